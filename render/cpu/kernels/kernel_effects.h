/* A frame's effects (effects.h) as the kernels read them: plain values without ownership. Vectors
 * use the axes of a list: u, v and sheet. */
#ifndef TRIP_CPU_EFFECTS_H
#define TRIP_CPU_EFFECTS_H

#include <stdbool.h>
#include <stdint.h>

/* A lattice of transmittances (light_grid.h). */
typedef struct trip_cpu_light {
    const float *at; /* NULL disables the lookup */
    int32_t step[3]; /* floats between neighbouring nodes */
    float last[3];   /* index of the last node */
    float per_voxel; /* nodes per voxel of level 0 */
} trip_cpu_light;

/* The kernels' copy of trip_emission_view. */
typedef struct trip_cpu_emission {
    trip_cpu_light heat;
    float to_heat[3][4]; /* from positions in level 0, [u, v, sheet] */
    float last[3];
    float steps; /* number of intervals in `rgb` */
    const float *rgb;
} trip_cpu_emission;

typedef struct trip_cpu_effects {
    bool some, lit, cued; /* any effect; shadows or occlusion; depth cueing */
    /* Map positions in the list to positions in level 0. All fields below use level 0. */
    float scale[3], offset[3];
    trip_cpu_light reached, open;
    float aside[3][3]; /* maps a unit vector in world space to the bias along it: [u, v,
                          sheet][world] */
    bool point_light;
    float light[3]; /* position of the point light; read only if point_light */
    float phase[3]; /* 1 - g^2, 1 + g^2, 2 g */
    trip_cpu_emission emission;
    float cue[4], cue_rgb[3]; /* as in trip_effects_view */
    float cueing;
} trip_cpu_effects;

#endif
