/* Effects: shadows, scattering, ambient occlusion, emission and depth cueing, with the same
 * formulas in every renderer. Points of index space are positions if spacing is uneven
 * (coordinates.h).
 *
 * Shadows, scattering and occlusion
 * ---------------------------------
 * If one of them runs, a colour c of the transfer function becomes
 *     c (AMBIENT open + DIFFUSE reached ((1 - s) phase + s |n . l|)) + s reached SPECULAR specular
 * clamped to [0, 1], in place of the formula in shade.h. The strength s, n and l are from shade.h;
 * s is 0 without shading, for instance in fog. Both formulas agree if the following factors are 1:
 *     reached(x) = T(x + s b l),  T(y) = exp(-integral of extinction from y to the light)
 *     open(x)    = min(1, (1 + s) max(m(x + s b n), m(x - s b n)))
 *     phase      = (1 - g^2) / (1 + g^2 - 2 g cos)^(3/2)
 * - m is the mean of T over all directions.
 * - phase is Henyey & Greenstein's phase function (1941) times 4 pi. cos is the cosine of the angle
 *   between the light's direction and the direction to the eye.
 * - The offset b lights a surface slightly outside itself. It is TRIP_LIGHT_BIAS cells of the
 *   lattice, but at most the distance to a point light.
 * - The factor 1 + s makes up for the body itself, which fills half of a surface's surroundings.
 *
 * Fog therefore has single scattering after Max 1995 (Optical models for direct volume rendering,
 * section 5) plus ambient light. Surfaces cast shadows.
 *
 * T and m are interpolated in a lattice over the volume (light_grid.h); the lattice of m has cells
 * twice as long. The integral renderer computes both at each point, m with the same directions.
 * Clipped parts do not attenuate light.
 *
 * Emission
 * --------
 * Emission then adds the light that hot matter gives off (emission.h).
 *
 * Depth cueing
 * ------------
 * Depth cueing comes last:
 *     c' = c (1 - f) + background f
 * f is linear in the depth along the view, from 0 at the nearest point of the grid's box to
 * `cueing` at the farthest. */
#ifndef TRIP_EFFECTS_H
#define TRIP_EFFECTS_H

#include "light_grid.h"
#include "shade.h"

#define TRIP_LIGHT_BIAS 1.5
#define TRIP_OPEN_DIRECTIONS 32
#define TRIP_OPEN_STRIDE 2

/* Returns whether an effect needs the transmittance towards the light or the surroundings. */
static inline bool trip_effects_light(const trip_effects *e)
{
    return TRIP_HAS_EFFECTS && (e->shadows || e->occlusion);
}

static inline bool trip_effects_some(const trip_effects *e)
{
    return TRIP_HAS_EFFECTS && (trip_effects_light(e) || e->emission || e->cueing > 0);
}

/* Returns one of `count` unit vectors that are spread evenly. */
trip_vec3 trip_even_direction(int number, int count);
/* The directions for the mean of openness. */
static inline trip_vec3 trip_effects_direction(int number)
{
    return trip_even_direction(number, TRIP_OPEN_DIRECTIONS);
}

/* T and m at a point in index space. */
typedef double (*trip_light_reached)(const void *user, trip_vec3 voxel);

enum { TRIP_EMISSION_STEPS = 256 };

/* The light of hot matter (emission.h). */
typedef struct trip_emission_view {
    const trip_light_grid *heat; /* v / V */
    trip_affine to_heat;         /* maps the drawn data set's index space to the heat data set's */
    double last[3];              /* index of the heat data set's last voxel */
    const float *rgb; /* E for v / V from 0 to 1: TRIP_EMISSION_STEPS + 1 entries of 4 floats */
} trip_emission_view;

/* Constants of a frame. */
typedef struct trip_effects_view {
    trip_effects effects;
    double bias; /* world units */
    bool point_light;
    trip_vec3 light; /* index space: the light's position, or the direction to it per world unit */
    trip_affine to_index;
    double cue[4]; /* f = (cue[0], cue[1], cue[2]) . point + cue[3], clamped to [0, 1]; point in
                      index space */
    double cue_rgb[3];
    const void *user; /* set by the caller: */
    trip_light_reached reached, open;
    trip_emission_view emission; /* set by the caller if emission runs */
} trip_effects_view;

/* Computes the constants of a frame. `camera` belongs to the grid of `dims` voxels. */
trip_effects_view trip_effects_view_make(const trip_settings *s, const trip_camera *camera,
                                         const uint64_t dims[3]);
double trip_effects_phase(double g, double cosine);
/* Applies the effects to a colour at a point in index space. `gradient` NULL means no shading. */
void trip_effects_colour(const trip_effects_view *e, const trip_light *light, trip_vec3 voxel,
                         const double *gradient, double rgb[3]);

#endif
