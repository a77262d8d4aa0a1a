/* Writes a fog-volume VDB of any size in bounded memory: it holds one cube of 128^3 voxels, a node
 * of the tree above the leaves, and reads each cube twice, once to write which voxels are there
 * and once for their values. What is zero is left out. Single-threaded; the source may use threads.
 */
#ifndef TRIP_WRITE_VDB_H
#define TRIP_WRITE_VDB_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

enum { TRIP_VDB_CUBE = 128 };

/* Fills in the values of the `size` voxels from `first` on, none beyond a cube: that of (i, j, k)
 * goes to values[(k * size[1] + j) * TRIP_VDB_CUBE + i]. Returns a status that ends the writing
 * when it is negative; the same values every time. */
typedef int trip_vdb_source(void *user, const int64_t first[3], const int64_t size[3],
                            float *values);

int trip_vdb_write(const char *path, const int64_t dims[3], trip_vdb_source *source, void *user);

#ifdef __cplusplus
}
#endif

#endif
