/* Makes the squares of a coarse level, 2^edge_log2 voxels on each side: adds up the voxels of the
 * level below, and makes pieces for the list builder. Each thread has its own lane. The shared part
 * is read-only while lanes work. */
#ifndef TRIP_LEVEL_LANE_H
#define TRIP_LEVEL_LANE_H

#include "level_source.h"
#include "levels.h"
#include "mean.h"
#include "sharpen.h"
#include "splat_box.h"

/* The shared part of a level's lanes. */
typedef struct trip_level_work {
    const trip_levels_params *params;
    trip_piece_format format; /* of the level's pieces */
    trip_mean_scale scale;
    unsigned edge_log2; /* of the level's squares */
    bool lists;         /* made from lists, not from a file */
    trip_splat_box_tables tables;
    trip_list_builder *builder;
} trip_level_work;

/* Sources: even and odd sheets, of at most two lists. */
enum { TRIP_LEVEL_SOURCES = 4 };

typedef struct trip_level_lane {
    unsigned producer; /* producer number of the builder */
    /* The sources of the current square's voxels. */
    uint64_t key, number;
    unsigned square_count;
    trip_level_source *squares;

    trip_splat_box box;
    /* Sums of a square, by row; NULL for means if there are no such lists. */
    trip_coarse_value_sum *value_sums;
    trip_coarse_mean_sum *mean_sums;
    uint64_t *touched; /* bit masks of both */
    /* The square's voxels, in order. */
    trip_coarse_value *values;
    trip_coarse_mean *means;
    /* A square of the file. */
    trip_coarse_value *values_below;
    trip_coarse_mean *means_below;
    trip_list_buffer *run; /* of a list */
    trip_sharpen_lane sharpen;
} trip_level_lane;

/* Lays out a lane in zeroed memory aligned to 64. With NULL it only computes the bytes. */
size_t trip_level_lane_make(trip_level_lane *l, const trip_level_work *w, unsigned producer,
                            unsigned char *memory);

/* Adds the voxels of the current square of the first of several sources. The others are added next.
 */
int trip_level_lane_add(trip_level_lane *l, const trip_level_work *w,
                        const trip_level_source *squares, unsigned count);
/* Converts the sums to `values` and `means`. Returns their number. */
uint32_t trip_level_lane_take(trip_level_lane *l, const trip_level_work *w);

/* Makes the pieces of a square for the lists of means, from the lane's values and means. */
int trip_level_lane_emit_means(trip_level_lane *l, const trip_level_work *w, uint64_t key,
                               uint32_t count);
/* Makes the pieces of a sharpened column for the lists of values. */
int trip_level_lane_emit_values(trip_level_lane *l, const trip_level_work *w,
                                const trip_sharpen *sharpen, const trip_sharpen_column *column);

#endif
