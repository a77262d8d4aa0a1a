/* Where the voxels of a brick lie. Pure functions of an opened data set. */
#ifndef TRIP_BRICK_BOX_H
#define TRIP_BRICK_BOX_H

#include "dataset.h"

/* A box of voxel positions by the list's own coordinates: [u, v, sheet], inclusive. */
typedef struct trip_brick_box {
    double lo[3], hi[3];
} trip_brick_box;

/* The slab that brick number `brick` of a list is in. */
const trip_file_slab *trip_brick_slab(const trip_list *list, uint64_t brick);

/* The voxels of a brick that is in `slab`. */
trip_brick_box trip_brick_box_of(const trip_file_header *header, const trip_file_slab *slab,
                                 const trip_file_brick *brick);

#endif
