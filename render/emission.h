/* Light that hot matter gives off by itself: a second data set, on any grid, has its
 * temperatures, and matter radiates as a black body does, as much as it absorbs (Kirchhoff), so
 * that its colour c becomes c' = c + E(T),   linear light of E = (T / HI)^4 black body of T
 * (black_body.h) before depth cueing. Like all colours E is what a screen is given, not linear
 * light. A value v of the data set is the temperature LO + (HI - LO) v / V, V its greatest,
 * negative ones as 0. Values lie on a coarse lattice (light_grid.h), gathered by one pass over a
 * list (light_map.h) and kept from frame to frame; between nodes they are interpolated linearly,
 * and beyond the data set they fall to 0 over a voxel, as what was culled counts as 0. One thread;
 * renderers read it once its map is complete. */
#ifndef TRIP_EMISSION_H
#define TRIP_EMISSION_H

#include "light_map.h"

enum { TRIP_EMISSION_STEPS = 256 };

typedef struct trip_emission trip_emission;

/* What it is for: a frame. */
typedef struct trip_emission_params {
    const trip_affine *index_to_world; /* of what is drawn */
    double kelvin[2];                  /* LO, HI */
    int cells;                         /* most along the longest side; 0: a voxel each */
    trip_engine engine;
    unsigned threads;
} trip_emission_params;

/* What renderers need of it. */
typedef struct trip_emission_view {
    const trip_light_grid *heat; /* v / V */
    trip_affine to_heat;         /* index space of what is drawn to that of the data set */
    double last[3];              /* of its voxels */
    const float *rgb;            /* E of v / V from 0 to 1, TRIP_EMISSION_STEPS + 1 times 4 */
} trip_emission_view;

/* Opens the data set; fails (reported) where there is no heat in it. */
int trip_emission_create(trip_emission **out, const char *path, trip_budget *budget);
/* Waits for reads under way. */
void trip_emission_destroy(trip_emission *e);
/* As trip_light_map_begin(). */
int trip_emission_begin(trip_emission *e, const trip_emission_params *params);
/* Gives the lattice back. */
void trip_emission_drop(trip_emission *e);
/* To be stepped before a frame is drawn; NULL before the first begin. */
trip_light_map *trip_emission_map(const trip_emission *e);

trip_emission_view trip_emission_view_of(const trip_emission *e);
/* E at a place in index space of what is drawn. */
void trip_emission_at(const trip_emission *e, trip_vec3 voxel, double rgb[3]);

#endif
