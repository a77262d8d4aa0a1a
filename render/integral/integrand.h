/* The integral renderer integrates one of two functions along a ray. One is the values of a field
 * between its voxels, classified and lit. The other is the sum of the splats of its voxels.
 * Read-only, for any number of threads. */
#ifndef TRIP_INTEGRAND_H
#define TRIP_INTEGRAND_H

#include "classes.h"
#include "effects.h"
#include "field.h"
#include "quadrature.h"
#include "ray.h"
#include "shade.h"

typedef struct trip_integrand {
    const trip_field *field;
    const trip_coordinates *coordinates;
    const trip_classes *classes;
    const trip_settings *settings;
    const trip_camera *camera; /* of the field's grid */
    const trip_clip *clip;     /* for rays (values) or voxels (splats); index space */
    double tolerance;          /* of each component of a ray */
    bool shaded;
    bool nearest;         /* the value of the nearest voxel (sheet.h), with gradients of outlines */
    trip_affine to_index; /* from world space; for gradients of outlines */
    double gradient_full; /* as for trip_shade() */
    trip_effects_view effects;
} trip_integrand;

/* Integrates through the values. The values of a cell are classified at each point of the ray, and
 * lit by the gradient there. Along a ray, code and gradient are polynomials: of degree 3 in a
 * linear cell, of degree 9 in a cubic one. The ray is divided at three kinds of points:
 * - at the faces of cells,
 * - where the value turns,
 * - where the value passes a knot of the transfer function.
 *
 * Each piece is then smooth except for kinks of the light. The nearest value and its gradient are
 * constant in the box of each voxel, so the ray is divided at the faces of boxes only. */
/* If effects depend on light that passes through the volume, each point has integrals of its own,
 * to the same tolerance. */
trip_ray_sum trip_integrate_values(const trip_integrand *in, const trip_ray *ray);

/* The splats that a ray meets. The memory belongs to one thread, comes from the budget, and is
 * reused from ray to ray. */
typedef struct trip_splat_hit {
    double enter, middle, leave; /* t of the ray */
    double distance2;  /* from the voxel to the ray, in the voxel's own index space (splat.h) */
    double length;     /* of the ray's direction in that space */
    double extinction; /* per world unit */
    double rgb[3];
    uint64_t voxel; /* index in the grid */
} trip_splat_hit;

typedef struct trip_splat_hits {
    trip_budget *budget;
    trip_splat_hit *hits;
    size_t count, room;
} trip_splat_hits;

void trip_splat_hits_free(trip_splat_hits *h);

/* Integrates through the splats. Extinction is the sum over the voxels, and colour their mean
 * weighted by extinction. splat.h gives the line integral of a splat at distance d,
 *
 *     amplitude (exp(-d^2 / (2 sigma^2)) - edge)
 *
 * up to k = TRIP_CUTOFF standard deviations. Only one density around a point has these integrals
 * (inverse Abel transform):
 *
 *     density(r) = amplitude / (sqrt(2 pi) sigma) exp(-r^2 / (2 sigma^2))
 *                  erf(sqrt((k^2 sigma^2 - r^2) / 2) / sigma)                 r <= k sigma
 *
 * Here this density is the splat. There is no low-pass filter, and a splat is cut only if the eye
 * is inside it. Returns a negative code if memory is exhausted. */
int trip_integrate_splats(const trip_integrand *in, const trip_ray *ray, trip_splat_hits *hits,
                          trip_ray_sum *out);

#endif
