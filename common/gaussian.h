/* A Gaussian splat of a scene: an ellipsoid with a density that falls from its centre as
 * exp(-d^2 / 2), where d counts standard deviations. A ray through the centre has the opacity
 * `opacity` (Zwicker et al. 2001; Kerbl et al. 2023). A flat one has a deviation of 0: a surfel. */
#ifndef TRIP_GAUSSIAN_H
#define TRIP_GAUSSIAN_H

#include <stdint.h>

#include "geometry.h"

enum { TRIP_SH_DEGREE_MAX = 3, TRIP_SH_MAX = 16 };

typedef struct trip_gaussian {
    double centre[3];
    float deviations[3]; /* standard deviations along the principal axes, in units of the scene */
    float rotation[4];   /* w, x, y, z; unit length; from the principal axes to the scene */
    float opacity;       /* 0 to 1 */
    uint8_t merged;      /* 1: of a coarse level, where it stands for Gaussians of the scene */
    /* 1: a coarse surfel that stands for surfels of several sides, so it has no front side */
    uint8_t two_sided;
    uint16_t hidden; /* share of the surroundings that is hidden (openness.h), of 65535 */
    /* Spherical harmonics of the display colour: coefficient, then channel. The colour is 0.5 plus
     * their sum (gaussian_colour.h). Coefficients beyond the scene's degree are 0. */
    float sh[TRIP_SH_MAX][3];
    /* 1: trained with a compensated opacity, as trip_gaussian_settings.antialiased says of all. */
    uint16_t antialiased; /* two bytes, so that none is padding */
    /* 1: the third axis points to the camera that saw it, and the opacity depends on the view
     * (gaussian_picture.h). */
    uint8_t from_camera;
    uint8_t hyperline; /* 1: the coefficients hold colours from several cameras (hyperline.h) */
} trip_gaussian;

/* Returns the number of coefficients up to a degree: 1, 4, 9 or 16. */
static inline int trip_sh_count(int degree)
{
    return (degree + 1) * (degree + 1);
}

/* Returns the principal axis with the least deviation: the normal of a surfel. */
static inline int trip_surfel_axis(const trip_gaussian *g)
{
    int least = 2;
    for (int i = 0; i < 2; i++)
        least = g->deviations[i] < g->deviations[least] ? i : least;
    return least;
}

/* Returns a principal axis in scene space. */
static inline trip_vec3 trip_surfel_principal(const trip_gaussian *g, int axis)
{
    const double w = (double)g->rotation[0], x = (double)g->rotation[1];
    const double y = (double)g->rotation[2], z = (double)g->rotation[3];
    return axis == 0   ? trip_v3(1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y))
           : axis == 1 ? trip_v3(2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x))
                       : trip_v3(2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y));
}

/* Returns the normal of a surfel, which points away from its front side. */
static inline trip_vec3 trip_surfel_normal(const trip_gaussian *g)
{
    return trip_surfel_principal(g, trip_surfel_axis(g));
}

/* The harmonic of degree 0: 1 / (2 sqrt(pi)). */
#define TRIP_SH_CONSTANT 0.28209479177387814

/* Returns the coefficient of degree 0 of a colour from 0 to 1. */
static inline float trip_sh_of_colour(double colour)
{
    return (float)((colour - 0.5) / TRIP_SH_CONSTANT);
}

#endif
