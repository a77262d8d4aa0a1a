/* Levels of cubes under a bound on bytes: as if settings.lod_px were larger, by no more than it
 * takes. What is widest in the picture is so drawn finest. Bytes are those of codes and normals in
 * cubes in view, by the number of voxels of level 0 in a cube and what share of these the lists of
 * a level have; in all lists that some ray of the view has weight in. None of that depends on
 * tiles, slabs or what was read before, so neither does the picture. Pure functions. */
#ifndef TRIP_LOD_LIMIT_H
#define TRIP_LOD_LIMIT_H

#include "lod.h"

/* What is nearer to the eye counts as if it were so far from it, so that it too can be coarser. */
#define TRIP_LOD_NEAREST_VOXELS 32.0

/* Raises levels until settings->max_bytes suffice, or all are the coarsest, and fills lod->limit.
 * Cubes are at least as large as tiles. TRIP_ERROR without memory. */
int trip_lod_bound(trip_lod *lod, const trip_dataset *data, const trip_camera *camera,
                   const trip_settings *settings, trip_budget *budget);

/* Of the values of a level in all lists that are read, whatever is in view. */
double trip_lod_values_bytes(const trip_dataset *data, const trip_camera *camera,
                             const trip_settings *settings, unsigned level);

#endif
