/* Light on surfels: the model of shade.h, with the normal of a surfel and full strength. It changes
 * the colours of Gaussians before they are drawn, so all renderers draw the same colours.
 *
 * A surfel with the openness o (openness.h) gets the formula of effects.h with open = o and without
 * shadows. Where no light shades the cloud, the colour is multiplied by o. */
#ifndef TRIP_SURFEL_LIGHT_H
#define TRIP_SURFEL_LIGHT_H

#include <stddef.h>

#include "camera.h"
#include "gaussian.h"
#include "settings.h"

/* Lights surfels: their normals count. Without `s`, only their openness does. Light needs harmonics
 * of degree 0. */
void trip_surfel_light(const trip_settings *s, const trip_camera *c, trip_gaussian *surfels,
                       size_t count);

#endif
