/* Grids with uneven spacing. Turns the coordinates that readers and --coordinates give into the map
 * and tables of a volume. */
#ifndef TRIP_VOLUME_COORDINATES_H
#define TRIP_VOLUME_COORDINATES_H

#include "volume_info.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Spacing counts as even if all coordinates differ from even ones by at most this fraction of the
 * mean step. Even coordinates rounded to single precision pass. */
#define TRIP_VOLUME_EVEN 1e-3

/* Sets the world coordinates of the voxels along an axis: info->dims[axis] values, ascending or
 * descending. Sets the axis's column of the map; the axis must be parallel to the same axis of
 * world space. Sets the table in info->coordinates, which stays NULL for even spacing. Messages
 * name `path`. */
int trip_volume_set_coordinates(trip_volume_info *info, int axis, const double *values,
                                const char *path);

/* Sets the table of an axis from positions along its column of the map, which holds the mean step.
 */
int trip_volume_set_positions(trip_volume_info *info, int axis, const double *positions,
                              const char *path);

/* Reads text files, one for each axis, named as in `--coordinates X.txt,Y.txt,Z.txt`. Blanks,
 * commas or line ends separate the numbers. An axis without a file keeps its spacing. */
int trip_volume_read_coordinates(trip_volume_info *info, const char *files, const char *path);
/* Calls visit(user, FILE) for each file. Stops at a negative result and returns it. */
int trip_volume_list_coordinates(const char *files, int (*visit)(void *user, const char *file),
                                 void *user);

/* Keeps every `step`-th voxel along an axis, `count` voxels in all. */
void trip_volume_sample_coordinates(trip_volume_info *info, int axis, int64_t step, int64_t count);

/* Completes the tables for trip_coordinates_make(): if one axis has a table, adds even tables for
 * the other axes. */
int trip_volume_complete_coordinates(trip_volume_info *info, const char *path);
void trip_volume_free_coordinates(trip_volume_info *info);

#ifdef __cplusplus
}
#endif

#endif
