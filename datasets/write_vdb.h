/* Writes a fog-volume VDB of any size in bounded memory. It holds one cube of 128^3 voxels, which
 * is a node above the leaves of the tree. It reads each cube twice: first to write the set of
 * active voxels, then to write their values. Zeros are omitted. Single-threaded; the source may use
 * threads. */
#ifndef TRIP_WRITE_VDB_H
#define TRIP_WRITE_VDB_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

enum { TRIP_VDB_CUBE = 128 };

/* Sets the values of `size` voxels from `first` on, within one cube. Voxel (i, j, k) goes to
 * values[(k * size[1] + j) * TRIP_VDB_CUBE + i]. Must set the same values in every call. A negative
 * return value stops the writing. */
typedef int trip_vdb_source(void *user, const int64_t first[3], const int64_t size[3],
                            float *values);

int trip_vdb_write(const char *path, const int64_t dims[3], trip_vdb_source *source, void *user);

#ifdef __cplusplus
}
#endif

#endif
