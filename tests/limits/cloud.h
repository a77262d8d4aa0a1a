/* The data set that the tests damage. It has a random two thirds of the voxels of a small grid and
 * a halo, at two levels. */
#ifndef CLOUD_H
#define CLOUD_H

#include "scenes.h"

/* Indices of the X lists. The Y and Z lists follow each X list. */
enum {
    CLOUD_VOXELS = 0,
    CLOUD_HALO = 3,
    CLOUD_COARSE = 6,
    CLOUD_COARSE_HALO = 9,
    CLOUD_LISTS = 12
};

/* index.trip, and three planes for each axis and level */
enum { CLOUD_FILES = 1 + 2 * 3 * 3 };

static inline bool cloud_voxel(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    uint32_t hash = scene_hash(i, j, k);
    (void)user;
    gradient[0] = i - 15;
    gradient[1] = j - 12;
    gradient[2] = k - 10;
    *code = hash % 60000;
    return hash % 3 != 0;
}

/* Puts half of the other voxels into the halo. */
static inline bool cloud_halo(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    return !cloud_voxel(user, i, j, k, code, gradient) && *code % 2;
}

static inline void cloud_create(scene *s)
{
    static const scene_part parts[] = {
        { .kind = TRIP_KIND_HALO, .by = { 1, 1, 1 }, .voxel = cloud_halo },
        { .level = 1, .by = { 2, 2, 1 }, .voxel = cloud_voxel },
        { .level = 1, .kind = TRIP_KIND_HALO, .by = { 2, 2, 1 }, .voxel = cloud_halo },
    };
    scene_create(s, &(scene_params){ .dims = { 30, 24, 20 },
                                     .tile_voxels = 16,
                                     .slab_sheets = 5,
                                     .normals = true,
                                     .voxel = cloud_voxel,
                                     .parts = parts,
                                     .part_count = 3 });
}

#endif
