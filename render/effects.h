/* Effects: shadows, scattering, ambient occlusion, emission and depth cueing, the same numbers in
 * every renderer. Where one of the first three runs, a colour c of the transfer function becomes
 *     c (AMBIENT open + DIFFUSE reached ((1 - s) phase + s |n . l|)) + s reached SPECULAR specular
 * clamped to [0, 1], in the place of what shade.h makes of it, with its strength s (0 where nothing
 * is shaded, as in fog), n and l. It is the same where all of these are 1:
 *     reached(x) = T(x + s b l),  T(y) = exp(-integral of extinction from y to the light)
 *     open(x)    = min(1, (1 + s) max(m(x + s b n), m(x - s b n)))
 *     phase      = (1 - g^2) / (1 + g^2 - 2 g cos)^(3/2)
 * m is the mean of T over directions. phase is that of Henyey & Greenstein 1941, times 4 pi, cos
 * that of the angle by which light turns towards the eye. So fog has single scattering after Max
 * 1995 (Optical models for direct volume rendering, section 5) with a share of light from
 * everywhere, and surfaces have cast shadows. A surface is lit where light reaches it, a little
 * outside: b is TRIP_LIGHT_BIAS cells of the grid below long, but takes it no farther than to a
 * light that is at a place. Half of what is around a surface is the body itself, hence 1 + s.
 *
 * Points of index space are places where spacing is uneven (coordinates.h). T and m are looked up
 * in a lattice over the volume (light_grid.h), that of m with cells twice as long; the integral
 * renderer works them out, m by the same directions. What is cut away does not attenuate.
 *
 * Emission then adds what matter gives off by itself (emission.h).
 *
 * Depth cueing comes last, with f from 0 where the grid's box begins before the eye to `cueing`
 * where it ends, linear in the depth along the view:
 *     c' = c (1 - f) + background f */
#ifndef TRIP_EFFECTS_H
#define TRIP_EFFECTS_H

#include "light_grid.h"
#include "shade.h"

#define TRIP_LIGHT_BIAS 1.5
#define TRIP_OPEN_DIRECTIONS 32
#define TRIP_OPEN_STRIDE 2

/* Whether some effect depends on what light passes. */
static inline bool trip_effects_light(const trip_effects *e)
{
    return TRIP_HAS_EFFECTS && (e->shadows || e->occlusion);
}

static inline bool trip_effects_some(const trip_effects *e)
{
    return TRIP_HAS_EFFECTS && (trip_effects_light(e) || e->emission || e->cueing > 0);
}

/* Directions that openness is the mean over: unit vectors, evenly spread. */
trip_vec3 trip_effects_direction(int number);

/* T and m of a place in index space. */
typedef double (*trip_light_reached)(const void *user, trip_vec3 voxel);

/* Constants of a frame. */
typedef struct trip_effects_view {
    trip_effects effects;
    double bias; /* world units */
    bool point_light;
    trip_vec3 light; /* index space: the light's place, or the way to it for a world unit */
    trip_affine to_index;
    double cue[4]; /* f: the first three times the place in index space, and the last, in [0, 1], */
    double cue_rgb[3];
    const void *user; /* set by who has them: */
    trip_light_reached reached, open;
    const struct trip_emission *emission; /* that too, where that effect runs */
} trip_effects_view;

/* `camera` is of the grid of `dims` voxels. */
trip_effects_view trip_effects_view_make(const trip_settings *s, const trip_camera *camera,
                                         const uint64_t dims[3]);
double trip_effects_phase(double g, double cosine);
/* Of a colour at a place in index space; `gradient` NULL: it is not shaded. */
void trip_effects_colour(const trip_effects_view *e, const trip_light *light, trip_vec3 voxel,
                         const double *gradient, double rgb[3]);

#endif
