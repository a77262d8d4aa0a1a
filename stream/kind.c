#include "kind.h"

#include "format.h"
#include "mean.h"

#include <stddef.h>

/* Records at grid points, packed by the squares of a tile. */
#define VOXEL_BLOCKS                                                                               \
    .max_words = trip_block_max_words, .words_fit = trip_block_words_fit, .pack = trip_block_pack, \
    .check = trip_block_check, .is_padded = trip_block_is_padded, .unpack = trip_block_voxels

static const trip_kind_info kinds[TRIP_KINDS] = {
    [TRIP_KIND_VOXELS] = { .name = "voxels",
                           .plane_names = { "voxels", "normals" },
                           .planes = 1u << TRIP_PLANE_VOXELS | 1u << TRIP_PLANE_NORMALS,
                           .splatted = true,
                           .lattice = true,
                           .reach = 1,
                           VOXEL_BLOCKS },
    [TRIP_KIND_HALO] = { .name = "halo",
                         .plane_names = { "halo" },
                         .planes = 1u << TRIP_PLANE_VOXELS,
                         .lattice = true,
                         VOXEL_BLOCKS },
    [TRIP_KIND_MEANS] = { .name = "means",
                          .plane_names = { "means", "mean-normals" },
                          .planes = 1u << TRIP_PLANE_VOXELS | 1u << TRIP_PLANE_NORMALS,
                          .splatted = true,
                          .code_bytes = 2,
                          .axis_bits = TRIP_MEAN_AXIS_BITS,
                          .coarse = true,
                          .reach = 1,
                          VOXEL_BLOCKS },
    [TRIP_KIND_VALUES] = { .name = "values",
                           .plane_names = { "values", NULL, "deviations" },
                           .planes = 1u << TRIP_PLANE_VOXELS | 1u << TRIP_PLANE_DEVIATIONS,
                           .lattice = true,
                           .code_bytes = 2,
                           .steps = true,
                           .coarse = true,
                           VOXEL_BLOCKS },
};

const trip_kind_info *trip_kind_of(trip_kind kind)
{
    return (unsigned)kind < TRIP_KINDS ? &kinds[kind] : NULL;
}
