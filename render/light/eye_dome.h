/* Eye-dome lighting: darkens pixels that lie behind their neighbours, from distances alone.
 * Boucheny (Visualisation scientifique interactive de grands volumes de données, 2009) invented it.
 * The constants are Potree's. Pure functions.
 *
 * A pixel p with a finite distance has the level L(p), and 8 neighbours n_i in even directions:
 *
 *     L(p) = log2 z(p)                         in perspective
 *     L(p) = z(p) 2 tan(15 degrees) / (H ln 2) in parallel views of height H
 *     n_i  = p + (round(r cos(i pi/4)), round(r sin(i pi/4)))
 *     c'   = c exp(-300 strength / 8 sum of a_i max(0, L(p) - L(n_i)))
 *
 * - z is the view depth of the pixel's distance (layer.h), so a plane that faces the eye has one
 *   level.
 * - A parallel view has the same steps as a view of 30 degrees that shows the same height.
 * - r is `radius_px`. a_i is the opacity of the neighbour.
 * - Neighbours outside of the picture and those without a distance add nothing. A pixel without a
 *   distance does not change. */
#ifndef TRIP_EYE_DOME_H
#define TRIP_EYE_DOME_H

#include "camera.h"

#define TRIP_EYE_DOME_STRENGTH 0.4
#define TRIP_EYE_DOME_RADIUS_PX 1.4

typedef struct trip_eye_dome {
    double strength, radius_px;
} trip_eye_dome;

/* Darkens the colours of a picture without background. `distances` has a number per pixel. Writes
 * the levels to `levels`, which may be `distances`. */
void trip_eye_dome_darken(const trip_eye_dome *e, const trip_camera *camera, const float *distances,
                          float *levels, float *rgba);

#endif
