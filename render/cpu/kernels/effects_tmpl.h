/* Applies the effects of effects.h to the colours at a vector of positions. Included before the
 * kernels that shade. */
#ifndef TRIP_CPU_EFFECTS_TMPL_H
#define TRIP_CPU_EFFECTS_TMPL_H

#include "cpu/kernels/kernel_effects.h"
#include "cpu/kernels/simd_tmpl.h"
#include "shade.h"

/* The lighting of a surface, as in trip_lit. `gloss` is the light that the highlight adds. */
typedef struct surface {
    vf strength, diffuse, gloss;
    vf normal[3]; /* world space, unit length; undefined where strength is 0 */
} surface;

INLINE vf within_01(vf a)
{
    return v_min(v_max(a, v_set(0)), v_set(1));
}

/* Interpolates the lattice at positions in level 0. */
INLINE vf light_at(const trip_cpu_light *g, const vf position[3])
{
    vf part[3];
    vi cell = vi_set(0);
    for (int a = 0; a < 3; a++) {
        const vf last = v_set(g->last[a]);
        vf node = v_max(position[a] * v_set(g->per_voxel), v_set(0)); /* maps NaN to 0 */
        node = v_min(node, last);
        vi whole = v_truncate(v_min(node, last - v_set(0.5f)));
        part[a] = node - v_from_int(whole);
        cell = cell + whole * g->step[a];
    }
    vf sum = v_set(0);
    for (int n = 0; n < 8; n++) {
        vf weight = n & 1 ? part[0] : v_set(1) - part[0];
        weight = weight * (n & 2 ? part[1] : v_set(1) - part[1]);
        weight = weight * (n & 4 ? part[2] : v_set(1) - part[2]);
        const float *corner = g->at + (ptrdiff_t)(n & 1) * g->step[0] +
                              (ptrdiff_t)(n >> 1 & 1) * g->step[1] +
                              (ptrdiff_t)(n >> 2) * g->step[2];
        sum = v_fma(weight, v_gather(corner, cell), sum);
    }
    return sum;
}

INLINE vf phase_of(const trip_cpu_effects *e, const vf light[3], const vf to_eye[3])
{
    vf turned = v_fma(light[0], to_eye[0], v_fma(light[1], to_eye[1], light[2] * to_eye[2]));
    vf d = v_fma(v_set(e->phase[2]), turned, v_set(e->phase[1]));
    return v_set(e->phase[0]) / (d * v_sqrt(d));
}

/* Returns one component of the bias along a unit vector in world space, times `share`. */
INLINE vf aside_of(const trip_cpu_effects *e, int axis, const vf unit[3], vf share)
{
    return v_fma(unit[0], v_set(e->aside[axis][0]),
                 v_fma(unit[1], v_set(e->aside[axis][1]), unit[2] * v_set(e->aside[axis][2]))) *
           share;
}

/* Computes the position for looking up the light on a surface. It lies towards the light, but not
 * beyond a point light. */
INLINE void towards_light(const trip_cpu_effects *e, const vf position[3], const surface *s,
                          const vf light[3], vf out[3])
{
    for (int a = 0; a < 3; a++) {
        const vf end = v_set(e->light[a]);
        out[a] = position[a] + aside_of(e, a, light, s->strength);
        if (e->point_light)
            out[a] = v_min(v_max(out[a], v_min(position[a], end)), v_max(position[a], end));
    }
}

INLINE vf open_of(const trip_cpu_effects *e, const vf position[3], const surface *s)
{
    vf one[3], other[3];
    for (int a = 0; a < 3; a++) {
        const vf aside = aside_of(e, a, s->normal, s->strength);
        one[a] = position[a] + aside;
        other[a] = position[a] - aside;
    }
    vf open = v_max(light_at(&e->open, one), light_at(&e->open, other));
    return v_min(v_set(1), (v_set(1) + s->strength) * open);
}

INLINE void light_positions(const trip_cpu_effects *e, const vf position[3], const surface *s,
                            const vf light[3], const vf to_eye[3], vf rgb[3])
{
    vf reached = v_set(1), open = v_set(1), phase = v_set(1);
    if (e->reached.at) {
        vf nearer[3];
        towards_light(e, position, s, light, nearer);
        reached = light_at(&e->reached, nearer);
        phase = phase_of(e, light, to_eye);
    }
    if (e->open.at)
        open = open_of(e, position, s);
    vf direct = v_fma(s->strength, s->diffuse - phase, phase) * reached;
    vf matt = v_fma(v_set((float)TRIP_DIFFUSE), direct, v_set((float)TRIP_AMBIENT) * open);
    for (int k = 0; k < 3; k++)
        rgb[k] = within_01(v_fma(rgb[k], matt, s->gloss * reached));
}

/* Adds the emission of effects.c for V positions. */
INLINE void add_emission(const trip_cpu_emission *e, const vf position[3], vf rgb[3])
{
    vf at[3], share = v_set(1);
    for (int a = 0; a < 3; a++) {
        at[a] = v_set(e->to_heat[a][3]);
        for (int k = 0; k < 3; k++)
            at[a] = v_fma(position[k], v_set(e->to_heat[a][k]), at[a]);
        const vf beyond = v_max(v_set(0) - at[a], at[a] - v_set(e->last[a]));
        share = share * (v_set(1) - within_01(beyond));
    }
    const vf x = share * light_at(&e->heat, at) * v_set(e->steps);
    const vi step = v_truncate(v_min(x, v_set(e->steps) - v_set(0.5f)));
    const vf part = x - v_from_int(step);
    const vi row = step * 4;
    for (int k = 0; k < 3; k++) {
        const vf below = v_gather(e->rgb + k, row), above = v_gather(e->rgb + 4 + k, row);
        rgb[k] = rgb[k] + v_fma(above - below, part, below);
    }
}

/* Applies all effects to `rgb`. `at` is a position in the list; `light` and `to_eye` are unit
 * vectors in world space. It is not inlined, so that frames without effects do not pay for it. */
static __attribute__((noinline)) void effects_on(const trip_cpu_effects *e, const vf at[3],
                                                 const surface *s, const vf light[3],
                                                 const vf to_eye[3], vf rgb[3])
{
    vf position[3];
    for (int a = 0; a < 3; a++)
        position[a] = v_fma(at[a], v_set(e->scale[a]), v_set(e->offset[a]));
    if (e->lit) {
        light_positions(e, position, s, light, to_eye, rgb);
    } else {
        const vf back = v_set((float)(TRIP_AMBIENT - 1));
        vf matt = v_fma(s->strength, v_fma(s->diffuse, v_set((float)TRIP_DIFFUSE), back), v_set(1));
        for (int k = 0; k < 3; k++)
            rgb[k] = within_01(v_fma(rgb[k], matt, s->gloss));
    }
    if (e->emission.heat.at)
        add_emission(&e->emission, position, rgb);
    if (!e->cued)
        return;
    vf f = v_set(e->cue[3]);
    for (int a = 0; a < 3; a++)
        f = v_fma(position[a], v_set(e->cue[a]), f);
    f = within_01(f) * v_set(e->cueing);
    for (int k = 0; k < 3; k++)
        rgb[k] = v_fma(v_set(e->cue_rgb[k]) - rgb[k], f, rgb[k]);
}

#endif
