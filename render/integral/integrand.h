/* What the integral is of: the values of a field between its voxels, classified and lit; or the sum
 * of the splats of its voxels. Read-only, for any number of threads. */
#ifndef TRIP_INTEGRAND_H
#define TRIP_INTEGRAND_H

#include "classes.h"
#include "effects.h"
#include "field.h"
#include "quadrature.h"
#include "ray.h"
#include "shade.h"

typedef struct trip_integrand {
    const trip_field *field;             /* finished */
    const trip_coordinates *coordinates; /* of its grid */
    const trip_classes *classes;
    const trip_settings *settings;
    const trip_camera *camera; /* of the grid of the field */
    const trip_clip *clip;     /* of the rays, or of the voxels; index space */
    bool shaded;
    double gradient_full; /* as of trip_shade() */
    trip_effects_view effects;
} trip_integrand;

/* Through the values: those of a cell are classified where the ray is, and lit by the gradient
 * there. The ray is divided at the faces of cells, where the value turns, and where it passes a
 * knot of the transfer function, so that a piece is smooth but for kinks of the light. Along a ray
 * a linear cell is a polynomial of degree 3, a cubic one of degree 9, of code and gradient alike.
 * Stored normals of 3 bytes are no longer than gradient_full, and are interpolated as they are. */
/* Where effects depend on what light passes, each place has integrals of its own, to the same
 * tolerance. */
trip_ray_sum trip_integrate_values(const trip_integrand *in, const trip_ray *ray);

/* Splats that a ray meets: a thread's memory, from the budget, kept from ray to ray. */
typedef struct trip_splat_hit {
    double enter, middle, leave; /* t */
    double distance2;            /* of the ray from the voxel, index space of its own (splat.h) */
    double length;               /* of the ray's direction there */
    double extinction;           /* per world unit */
    double rgb[3];
    uint64_t voxel; /* its number in the grid */
} trip_splat_hit;

typedef struct trip_splat_hits {
    trip_budget *budget;
    trip_splat_hit *hits;
    size_t count, room;
} trip_splat_hits;

void trip_splat_hits_free(trip_splat_hits *h);

/* Through the splats: extinction is the sum over voxels, colour their mean by it. splat.h gives the
 * line integral of a splat at distance d, amplitude (exp(-d^2 / (2 sigma^2)) - edge) up to
 * k = TRIP_CUTOFF standard deviations; of all densities around a point one alone has these
 * integrals (the inverse of Abel's transform):
 *     density(r) = amplitude / (sqrt(2 pi) sigma) exp(-r^2 / (2 sigma^2))
 *                  erf(sqrt((k^2 sigma^2 - r^2) / 2) / sigma)                 r <= k sigma
 * and that is what a splat is here: without the low-pass of the screen, and in part only where the
 * eye is in it. Negative: failed, for want of memory. */
int trip_integrate_splats(const trip_integrand *in, const trip_ray *ray, trip_splat_hits *hits,
                          trip_ray_sum *out);

#endif
