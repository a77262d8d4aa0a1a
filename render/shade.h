/* Light on a splat: Blinn-Phong from the stored world-space gradient, the same numbers in every
 * renderer. A surface faces down the gradient (values fall outwards); both sides are lit alike.
 *     strength = min(1, |gradient| / gradient_full)        flat regions are left unshaded
 *     diffuse  = |n . l|,  specular = facing |n . half|^TRIP_SHININESS
 *     facing   = min(1, max(0, TRIP_FACING (n . l) (n . eye)))
 *     colour'  = colour (1 + strength (AMBIENT + DIFFUSE diffuse - 1)) + strength SPECULAR specular
 * clamped to [0, 1]; l towards the light, half between l and the direction to the eye. Only the
 * side that the light falls on has a highlight, and it is seen when light and eye are on the same
 * side of the surface. Where the angle between them is 120 degrees or less, a highlight is as
 * bright at its middle as without `facing`, which lets it fade towards grazing light. With light
 * from the eye `facing` changes no colour by more than 2e-8: where it is not 1, |n . half| < 1/2.
 */
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

/* |gradient| in value per world unit at which shading is full: the same at every level, the voxels
 * of which are `voxel_world` long. */
static inline double trip_shade_gradient_full(const trip_file_header *h, double voxel_world,
                                              unsigned level)
{
    double range =
        h->value_max > h->value_min ? h->value_max - h->value_min : h->code_hi - h->code_lo;
    return TRIP_GRADIENT_FULL * range / voxel_world * ldexp(1, (int)level);
}

/* So that squares of 65536 times it are floats: gradients that are steeper still are as well lit.
 */
static inline double trip_shade_within_floats(double x)
{
    return fmin(1e12, fmax(-1e12, x));
}

/* What is the same for all gradients at a point: unit vectors in world space, that to a light which
 * is at the very point zero. Along a ray from the eye it does not change, but for a light that is
 * at a place. */
typedef struct trip_light {
    trip_vec3 eye, light, half; /* towards them */
    double gradient_full;
} trip_light;

/* Farther from the first voxel (in voxels) a light cannot be, as an eye cannot; one that is so far
 * is a direction. */
#define TRIP_LIGHT_FARTHEST_VOXELS TRIP_CAMERA_FARTHEST_VOXELS

/* Of a light that is at a place: where in index space. */
trip_vec3 trip_light_position(const trip_settings *s, const trip_affine *index_to_world);
/* Fails (usage) where that is too far. */
int trip_light_check(const trip_settings *s, const trip_affine *index_to_world);

/* At a point in index space. */
trip_light trip_light_at(const trip_settings *s, const trip_camera *c, double gradient_full,
                         trip_vec3 voxel);
/* How a surface with a world-space gradient is lit: the terms above, all 0 where it is flat. */
typedef struct trip_lit {
    double strength, diffuse, specular; /* specular: with `facing` */
    bool behind;                        /* light falls on the side of falling values */
} trip_lit;
trip_lit trip_light_on(const trip_light *l, const double gradient[3]);

/* Lights the colour `rgb` (not premultiplied) of what has a world-space gradient. Returns a number
 * that stays the same while the gradient, the colour or both change and what comes of them is a
 * smooth function: it has kinks where a surface turns from the light and at the bounds. */
unsigned trip_light_colour(const trip_light *l, const double gradient[3], double rgb[3]);

/* Both: lights the colour `rgb` of the splat of a voxel (index space) with the given
 * world-space gradient. */
void trip_shade(const trip_settings *s, const trip_camera *c, double gradient_full, trip_vec3 voxel,
                const double gradient[3], double rgb[3]);

#endif
