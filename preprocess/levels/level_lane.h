/* Makes the squares of a coarse level, 2^edge_log2 voxels on each side. It adds up the voxels of
 * the level below and makes pieces for the list builder. Each thread has its own lane. */
#ifndef TRIP_LEVEL_LANE_H
#define TRIP_LEVEL_LANE_H

#include "level_source.h"
#include "list_builder.h"
#include "mean.h"
#include "normal.h"
#include "sharpen.h"
#include "splat_box.h"

/* The part of a level that its lanes share. It is read-only while they work. */
typedef struct trip_level_work {
    trip_piece_format format; /* format of the level's pieces */
    bool means, values;       /* the kinds of lists */
    bool hidden_above;        /* as in trip_levels_params */
    trip_quantiser quantiser;
    const double *value_of;              /* value of each code; NULL if codes are even or ids */
    const trip_compact_normals *compact; /* NULL means 4 bytes */
    trip_affine index_to_world;
    trip_mean_scale scale;
    unsigned edge_log2; /* log2 of the edge of the level's squares, in voxels */
    bool lists;         /* the level is made from lists, not from a file */
    trip_splat_box_tables tables;
    trip_list_builder *builder;
} trip_level_work;

/* Maximum number of sources of a level: the even and the odd sheets of two lists. */
enum { TRIP_LEVEL_SOURCES = 4 };

typedef struct trip_level_lane {
    unsigned producer; /* the lane's producer number in the list builder */
    /* The current square: its key, its number in file order, and the sources of its voxels. */
    uint64_t key, number;
    unsigned square_count;
    trip_level_source *squares;

    trip_splat_box box;
    /* Sums for the voxels of a square, by row. `mean_sums` is NULL if there are no lists of means.
     */
    trip_coarse_value_sum *value_sums;
    trip_coarse_mean_sum *mean_sums;
    uint64_t *touched; /* bit mask of the voxels with sums */
    /* The square's finished voxels, by row. `means` is NULL without lists of means. */
    trip_coarse_value *values;
    trip_coarse_mean *means;
    /* A square of the level below, read from its file. */
    trip_coarse_value *values_below;
    trip_coarse_mean *means_below;
    trip_list_buffer *run; /* a run of the level below, read from its list */
    trip_sharpen_lane sharpen;
} trip_level_lane;

/* Lays out a lane in zeroed memory aligned to 64. With NULL it only computes the bytes. */
size_t trip_level_lane_make(trip_level_lane *l, const trip_level_work *w, unsigned producer,
                            unsigned char *memory);

/* Adds the voxels of squares[0]. The later squares are added next, so one read may fetch several
 * runs. */
int trip_level_lane_add(trip_level_lane *l, const trip_level_work *w,
                        const trip_level_source *squares, unsigned count);
/* Converts the sums to `values` and `means`. Returns the number of voxels. */
uint32_t trip_level_lane_take(trip_level_lane *l, const trip_level_work *w);

/* Makes the pieces of a square for the lists of means, from the lane's values and means. */
int trip_level_lane_emit_means(trip_level_lane *l, const trip_level_work *w, uint64_t key,
                               uint32_t count);
/* Makes the pieces of a sharpened column for the lists of values. */
int trip_level_lane_emit_values(trip_level_lane *l, const trip_level_work *w,
                                const trip_sharpen *sharpen, const trip_sharpen_column *column);

#endif
