/* What the kernels need of a frame's effects (effects.h), by the axes of a list: u, v and sheet.
 * Plain values. */
#ifndef TRIP_CPU_EFFECTS_H
#define TRIP_CPU_EFFECTS_H

#include <stdbool.h>
#include <stdint.h>

/* A lattice of what light reaches (light_grid.h). */
typedef struct trip_cpu_light {
    const float *at; /* NULL: it is not looked up */
    int32_t step[3]; /* from a node to the next */
    float last[3];   /* of nodes */
    float per_voxel; /* nodes */
} trip_cpu_light;

/* As trip_emission_view. */
typedef struct trip_cpu_emission {
    trip_cpu_light heat;
    float to_heat[3][4]; /* from places of level 0: [u, v, sheet] */
    float last[3];
    float steps; /* of colours */
    const float *rgb;
} trip_cpu_emission;

typedef struct trip_cpu_effects {
    bool some, lit, cued; /* any; shadows or occlusion; depth cueing */
    /* From places of the list to those of level 0, in which what follows is. */
    float scale[3], offset[3];
    trip_cpu_light reached, open;
    float aside[3][3]; /* the bias along a unit vector of the world: [u, v, sheet][world] */
    bool point_light;
    float light[3]; /* of that, its place */
    float phase[3]; /* 1 - g^2, 1 + g^2, 2 g */
    trip_cpu_emission emission;
    float cue[4], cue_rgb[3]; /* as of trip_effects_view */
    float cueing;
} trip_cpu_effects;

#endif
