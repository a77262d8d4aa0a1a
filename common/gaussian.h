/* A Gaussian splat of a scene: an ellipsoid with a density that falls from its centre as
 * exp(-d^2 / 2), where d counts standard deviations. A ray through the centre has the opacity
 * `opacity` (Zwicker et al. 2001; Kerbl et al. 2023). A flat one has a deviation of 0: a surfel. */
#ifndef TRIP_GAUSSIAN_H
#define TRIP_GAUSSIAN_H

#include <stdint.h>

enum { TRIP_SH_DEGREE_MAX = 3, TRIP_SH_MAX = 16 };

typedef struct trip_gaussian {
    double centre[3];
    float deviations[3]; /* standard deviations along the principal axes, in units of the scene */
    float rotation[4];   /* w, x, y, z; unit length; from the principal axes to the scene */
    float opacity;       /* 0 to 1 */
    /* Spherical harmonics of the display colour: coefficient, then channel. The colour is 0.5 plus
     * their sum (gaussian_colour.h). Coefficients beyond the scene's degree are 0. */
    float sh[TRIP_SH_MAX][3];
    /* 1: trained with a compensated opacity, as trip_gaussian_settings.antialiased says of all. */
    uint16_t antialiased;
    /* 1: the third axis points to the camera that saw it, and the opacity depends on the view
     * (gaussian_picture.h). */
    uint8_t from_camera;
    uint8_t hyperline; /* 1: the coefficients hold colours from several cameras (hyperline.h) */
    uint32_t merged;   /* 1: of a coarse level, where it stands for Gaussians of the scene */
} trip_gaussian;

/* Returns the number of coefficients up to a degree: 1, 4, 9 or 16. */
static inline int trip_sh_count(int degree)
{
    return (degree + 1) * (degree + 1);
}

/* The harmonic of degree 0: 1 / (2 sqrt(pi)). */
#define TRIP_SH_CONSTANT 0.28209479177387814

/* Returns the coefficient of degree 0 of a colour from 0 to 1. */
static inline float trip_sh_of_colour(double colour)
{
    return (float)((colour - 0.5) / TRIP_SH_CONSTANT);
}

#endif
