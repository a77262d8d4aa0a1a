/* Light from hot matter. A second data set, on any grid, holds temperatures. Matter radiates as a
 * black body, as much as it absorbs (Kirchhoff). Before depth cueing, its colour c becomes
 *     c' = c + E(T),   linear light of E = (T / HI)^4 black body of T   (black_body.h).
 * E is a display colour, like all colours. A value v of the data set means the temperature LO + (HI
 * - LO) v / V. V is the maximum value. Negative values count as 0.
 *
 * The values lie on a coarse lattice (light_grid.h). One pass over a list gathers it (light_map.h),
 * and it is kept from frame to frame. Between nodes, values are interpolated linearly. Outside the
 * data set they fall to 0 over one voxel; culled values count as 0. One thread at a time may use
 * it; renderers read it once its map is complete. */
#ifndef TRIP_EMISSION_H
#define TRIP_EMISSION_H

#include "light_map.h"

typedef struct trip_emission trip_emission;

/* Parameters of a frame. */
typedef struct trip_emission_params {
    const trip_affine *index_to_world; /* of the drawn data set */
    double kelvin[2];                  /* LO, HI */
    int cells;                         /* maximum along the longest side; 0 means one per voxel */
    trip_engine engine;
    unsigned threads;
} trip_emission_params;

/* Opens the heat data set. Fails, reported, if it holds no values above 0. */
int trip_emission_create(trip_emission **out, const char *path, trip_budget *budget);
/* Frees the heat data set and its lattice. Waits for reads in progress. */
void trip_emission_destroy(trip_emission *e);
/* Begins a frame, like trip_light_map_begin(). */
int trip_emission_begin(trip_emission *e, const trip_emission_params *params);
/* Releases the lattice. */
void trip_emission_drop(trip_emission *e);
/* Returns the map to step before a frame is drawn, or NULL before the first begin. */
trip_light_map *trip_emission_map(const trip_emission *e);

trip_emission_view trip_emission_view_of(const trip_emission *e);

#endif
