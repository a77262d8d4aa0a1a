/* The voxel positions of a brick. Pure functions of an open data set. */
#ifndef TRIP_BRICK_BOX_H
#define TRIP_BRICK_BOX_H

#include "dataset.h"

/* A box of voxels in list coordinates [u, v, sheet], bounds inclusive. */
typedef struct trip_brick_box {
    double lo[3], hi[3];
} trip_brick_box;

/* Returns the slab of brick number `brick` of a list. */
const trip_file_slab *trip_brick_slab(const trip_list *list, uint64_t brick);

/* Returns the box of a brick in `slab`. */
trip_brick_box trip_brick_box_of(const trip_file_header *header, const trip_file_slab *slab,
                                 const trip_file_brick *brick);

#endif
