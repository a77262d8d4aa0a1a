/* Makes the squares of a coarse level, here of 2^edge_log2 voxels along each side: adds up the
 * voxels of the level below, and makes pieces of what comes of that for the list builder. Each
 * thread has a lane of its own; what lanes share does not change while they work. */
#ifndef TRIP_LEVEL_LANE_H
#define TRIP_LEVEL_LANE_H

#include "level_source.h"
#include "levels.h"
#include "mean.h"
#include "sharpen.h"
#include "splat_box.h"

/* What the lanes of a level share. */
typedef struct trip_level_work {
    const trip_levels_params *params;
    trip_piece_format format; /* of its pieces */
    trip_mean_scale scale;
    unsigned edge_log2; /* of its squares */
    bool lists;         /* it is made from lists, not from a file */
    trip_splat_box_tables tables;
    trip_list_builder *builder;
} trip_level_work;

/* Of a level: even and odd sheets, of two lists at most. */
enum { TRIP_LEVEL_SOURCES = 4 };

typedef struct trip_level_lane {
    unsigned producer; /* of the builder */
    /* The square at hand: where the voxels below it are. */
    uint64_t key, number;
    unsigned square_count;
    trip_level_source *squares;

    trip_splat_box box;
    /* Of a square, by row; those of means NULL where there are no lists of these. */
    trip_coarse_value_sum *value_sums;
    trip_coarse_mean_sum *mean_sums;
    uint64_t *touched; /* bits of both */
    /* Its voxels, one after the other. */
    trip_coarse_value *values;
    trip_coarse_mean *means;
    /* Of a square of the file. */
    trip_coarse_value *values_below;
    trip_coarse_mean *means_below;
    trip_list_buffer *run; /* of a list */
    trip_sharpen_lane sharpen;
} trip_level_lane;

/* Lays out a lane in memory of so many bytes, zeroed and aligned to 64; with NULL it computes these
 * only. */
size_t trip_level_lane_make(trip_level_lane *l, const trip_level_work *w, unsigned producer,
                            unsigned char *memory);

/* Adds the voxels of the square that the first of some sources is at; the others come next. */
int trip_level_lane_add(trip_level_lane *l, const trip_level_work *w,
                        const trip_level_source *squares, unsigned count);
/* Turns what was added up into `values` and `means`; returns their number. */
uint32_t trip_level_lane_take(trip_level_lane *l, const trip_level_work *w);

/* The pieces of a square in the lists of means, of the lane's own values and means. */
int trip_level_lane_emit_means(trip_level_lane *l, const trip_level_work *w, uint64_t key,
                               uint32_t count);
/* Those of a column in the lists of values, once it is sharpened. */
int trip_level_lane_emit_values(trip_level_lane *l, const trip_level_work *w,
                                const trip_sharpen *sharpen, const trip_sharpen_column *column);

#endif
