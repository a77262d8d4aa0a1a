/* Levels of cubes under a bound on bytes. The result is the same as with the smallest
 * settings.lod_px that keeps the bound. So the cubes that appear widest are drawn finest. Bytes are
 * the codes and normals of the cubes in view, in all lists with weight in the view. They are
 * computed from the number of level 0 voxels in each cube and the relative size of each level's
 * lists. The bytes, and so the picture, do not depend on tiles, slabs or earlier reads. Pure
 * functions. */
#ifndef TRIP_LOD_LIMIT_H
#define TRIP_LOD_LIMIT_H

#include "lod.h"

/* Minimum distance from the eye. Nearer cubes count as this far, so that they too can be coarser.
 */
#define TRIP_LOD_NEAREST_VOXELS 32.0

/* Raises levels until settings->max_bytes suffice or all are the coarsest, and fills lod->limit.
 * Cubes must be at least as large as tiles. Returns TRIP_ERROR if memory is exhausted. */
int trip_lod_bound(trip_lod *lod, const trip_dataset *data, const trip_camera *camera,
                   const trip_settings *settings, trip_budget *budget);

/* Returns the bytes of a level's values in all lists read, independent of the view. */
double trip_lod_values_bytes(const trip_dataset *data, const trip_camera *camera,
                             const trip_settings *settings, unsigned level);

#endif
