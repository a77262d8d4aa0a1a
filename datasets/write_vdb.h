/* Writes a fog-volume VDB leaf by leaf: 8 x 8 x 8 boxes in any order, empty ones left out. The tree
 * is in memory until it is saved, about 1.2 KB per 512 voxels that are not empty. */
#ifndef TRIP_WRITE_VDB_H
#define TRIP_WRITE_VDB_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct trip_vdb_writer trip_vdb_writer;

int trip_vdb_writer_create(trip_vdb_writer **out, double voxel_size);
/* values: 512 floats, i fastest, of the leaf whose first voxel is `origin` (multiples of 8). */
int trip_vdb_writer_leaf(trip_vdb_writer *w, const int64_t origin[3], const float *values);
int trip_vdb_writer_save(trip_vdb_writer *w, const char *path);
void trip_vdb_writer_destroy(trip_vdb_writer *w);

#ifdef __cplusplus
}
#endif

#endif
