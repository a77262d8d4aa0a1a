/* Light on a splat: Blinn-Phong from the stored world-space gradient, with the same constants in
 * every renderer. Pure functions.
 *
 * A surface faces down the gradient, since values fall outwards. Both sides are lit alike. With l
 * the direction to the light, and half between l and the direction to the eye:
 *     strength = min(1, |gradient| / gradient_full)        flat regions are left unshaded
 *     diffuse  = |n . l|,  specular = facing |n . half|^TRIP_SHININESS
 *     facing   = min(1, max(0, TRIP_FACING (n . l) (n . eye)))
 *     colour'  = colour (1 + strength (AMBIENT + DIFFUSE diffuse - 1)) + strength SPECULAR specular
 * Colours are clamped to [0, 1].
 *
 * Labels that are not interpolated have no gradient of values. They are lit by the gradient of
 * their outline, which counts as full (trip_shade_outline_full(), sheet.h).
 *
 * The highlight lies on the side towards the light. It is visible only if light and eye are on the
 * same side of the surface. `facing` lets the highlight fade towards grazing light. Up to an
 * angle of 120 degrees between light and eye, `facing` leaves the brightness at the middle of the
 * highlight unchanged. With light from the eye `facing` changes no colour by more than 2e-8: it is
 * below 1 only where |n . half| < 1/2. */
#ifndef TRIP_SHADE_H
#define TRIP_SHADE_H

#include "camera.h"
#include "format.h"
#include "normal.h"
#include "settings.h"

#define TRIP_AMBIENT 0.3
#define TRIP_DIFFUSE 0.7
#define TRIP_SPECULAR 0.2
#define TRIP_SHININESS 24.0
#define TRIP_FACING 4.0

/* The shading range is at most this many widths of the values in which the transfer function
 * changes. Values far outside of a narrow window then do not weaken its shading. */
#define TRIP_SHADING_WIDTHS 2.5

/* Returns |gradient| in value per world unit at which shading is full. It is the same at every
 * level. `voxel_world` is the voxel size of `level` in world units. The few values that lie far
 * from the others do not count, nor values far from those that the function shows. */
static inline double trip_shade_gradient_full(const trip_file_header *h, const trip_settings *s,
                                              double voxel_world, unsigned level)
{
    double range =
        h->typical_max > h->typical_min ? h->typical_max - h->typical_min : h->code_hi - h->code_lo;
    if (s->shading_range > 0)
        range = fmin(range, s->shading_range);
    return TRIP_GRADIENT_FULL * range / voxel_world * ldexp(1, (int)level);
}

/* Returns a length of gradients that no gradient of an outline (trip_field_outline()) falls below,
 * world space. `widest` is the greatest length of a voxel along an axis, as in trip_coordinates.
 * The norm of the map bounds the stretch of vectors, so the inverse map shrinks none by more. */
static inline double trip_shade_outline_full(const trip_affine *index_to_world, double widest)
{
    double sum = 0;
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++)
            sum += index_to_world->m[i][k] * index_to_world->m[i][k];
    return 1 / (sqrt(sum) * widest);
}

/* Limits x so that squares of 65536 times x fit a float. Steeper gradients are lit the same. */
static inline double trip_shade_within_floats(double x)
{
    return fmin(1e12, fmax(-1e12, x));
}

/* The part of lighting that is the same for all gradients at a point: unit vectors in world space.
 * The light vector is zero at the position of a point light. Along a ray from the eye the vectors
 * change only with a point light. */
typedef struct trip_light {
    trip_vec3 eye, light, half; /* directions to the eye and the light, and half between */
    double gradient_full;
} trip_light;

/* Maximum distance of a point light from the first voxel, in voxels, as for the eye. A light
 * farther away must be given as a direction. */
#define TRIP_LIGHT_FARTHEST_VOXELS TRIP_CAMERA_FARTHEST_VOXELS

/* Returns the position of a point light in index space. */
trip_vec3 trip_light_position(const trip_settings *s, const trip_affine *index_to_world);
/* Fails with TRIP_USAGE (reported) if a point light is too far away. */
int trip_light_check(const trip_settings *s, const trip_affine *index_to_world);

/* Returns the light at a point in index space. */
trip_light trip_light_at(const trip_settings *s, const trip_camera *c, double gradient_full,
                         trip_vec3 voxel);
/* The light on a surface with a world-space gradient, in the terms above. All are 0 on flat
 * regions. */
typedef struct trip_lit {
    double strength, diffuse, specular; /* specular includes `facing` */
    bool behind;                        /* the light is on the side of falling values */
} trip_lit;
trip_lit trip_light_on(const trip_light *l, const double gradient[3]);

/* Lights the colour `rgb` (not premultiplied) of matter with a world-space gradient. Returns the
 * form of the result: while the form stays the same, the lit colour is a smooth function of the
 * gradient and the colour. The form changes where a surface turns from the light and at the
 * clamping bounds. */
unsigned trip_light_colour(const trip_light *l, const double gradient[3], double rgb[3]);

/* Lights the colour `rgb` of a voxel's splat (index space) with a world-space gradient:
 * trip_light_at(), then trip_light_colour(). */
void trip_shade(const trip_settings *s, const trip_camera *c, double gradient_full, trip_vec3 voxel,
                const double gradient[3], double rgb[3]);

#endif
