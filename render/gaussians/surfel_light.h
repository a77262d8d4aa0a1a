/* Light on surfels: the model of shade.h, with the normal of a surfel and full strength. It changes
 * the colours of Gaussians before they are drawn, so all renderers draw the same colours. */
#ifndef TRIP_SURFEL_LIGHT_H
#define TRIP_SURFEL_LIGHT_H

#include <stddef.h>

#include "camera.h"
#include "gaussian.h"
#include "settings.h"

/* Lights surfels with harmonics of degree 0, unless `s` is NULL. The principal axis with the least
 * deviation is the normal: the third axis of a flat surfel. */
void trip_surfel_light(const trip_settings *s, const trip_camera *c, trip_gaussian *surfels,
                       size_t count);

#endif
