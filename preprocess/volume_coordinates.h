/* Grids whose voxels lie at uneven distances: what readers and `--coordinates` say of the axes,
 * turned into the map and tables of a volume. */
#ifndef TRIP_VOLUME_COORDINATES_H
#define TRIP_VOLUME_COORDINATES_H

#include "volume.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Spacing whose coordinates are all within this part of the mean step of even ones is even: those
 * of files in single precision are, where what they were rounded from is. */
#define TRIP_VOLUME_EVEN 1e-3

/* Coordinates of the voxels along an axis in the world, info->dims[axis] of them, ascending or
 * descending: sets the axis's column of the map, which must lie along its own axis of the world,
 * and the table of info->coordinates, which stays NULL where spacing is even. `path` is named in
 * messages. */
int trip_volume_set_coordinates(trip_volume_info *info, int axis, const double *values,
                                const char *path);

/* Of text files, one an axis, as `--coordinates X.txt,Y.txt,Z.txt` has them: numbers with blanks,
 * commas or line ends between them. An axis whose file is left out keeps its spacing. */
int trip_volume_read_coordinates(trip_volume_info *info, const char *files, const char *path);
/* Calls visit(user, FILE) for each of them until a result is negative, which it returns. */
int trip_volume_list_coordinates(const char *files, int (*visit)(void *user, const char *file),
                                 void *user);

/* Keeps every `step`-th voxel along an axis, `count` of them. */
void trip_volume_sample_coordinates(trip_volume_info *info, int axis, int64_t step, int64_t count);

/* Even tables for the axes without, if another has one; and the tables for trip_coordinates_make().
 */
int trip_volume_complete_coordinates(trip_volume_info *info, const char *path);
void trip_volume_free_coordinates(trip_volume_info *info);

#ifdef __cplusplus
}
#endif

#endif
