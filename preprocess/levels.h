/* The coarse levels of a data set: each is made of the one below when that is written, from its
 * lists along Z or, above the first, from a file of its voxels, which is in memory where there is
 * enough. Two sheets are read at a time, square by square, so that no more memory is needed where
 * the volume is larger. The pieces go to a list builder, which sorts them as those of level 0.
 * Normals and how much of a voxel was kept, which only lists of means need, are read and added up
 * only where there are lists of these. */
#ifndef TRIP_LEVELS_H
#define TRIP_LEVELS_H

#include "brick.h"
#include "list_builder.h"
#include "normal.h"

/* Levels above 0. */
enum { TRIP_LEVELS_MAX = 24 };

/* What lists a level above 0 has, three each: of means, which are drawn as splats, before those of
 * values, which are interpolated. */
typedef struct trip_level_kinds {
    bool means, values; /* one of them at least */
} trip_level_kinds;

typedef struct trip_levels_params {
    trip_piece_format format; /* of level 0 */
    trip_level_kinds kinds;   /* values: where level 0 has a halo */
    trip_quantiser quantiser;
    const trip_compact_normals *compact; /* how normals of 3 bytes are encoded; NULL: they have 4 */
    int64_t dims[3];                     /* of level 0 */
    trip_affine index_to_world;
    unsigned levels;
    double value_min, value_max; /* of the volume */
    bool hidden_above;           /* what is not kept lies mostly above what is, not below */
    const char *folder;          /* for temporary files */
    trip_writer *writer;         /* with the lists of trip_levels_lists() */
    trip_spill *spill;           /* whose sequences are not needed any more */
    trip_workers *workers;
    /* Called now and then with how much of the work is done. */
    void (*progress)(void *user, uint64_t done, uint64_t total);
    void *progress_user;
} trip_levels_params;

/* How many levels trip_brick_params.levels comes to. */
unsigned trip_levels_count(const int64_t dims[3], int wanted, unsigned tile_voxels);

trip_level_kinds trip_levels_kinds(trip_brick_levels_for wanted, bool halo);

/* The lists of levels 0 to `levels`, as the writer takes them; returns their number. `lists` has
 * room for 6 a level. */
unsigned trip_levels_lists(const int64_t dims[3], const trip_affine *index_to_world, bool halo,
                           trip_level_kinds kinds, unsigned levels, trip_writer_list *lists);

/* The number of the first of a level's. */
unsigned trip_levels_first_list(bool halo, trip_level_kinds kinds, unsigned level);

/* Makes all levels above 0, once the lists of level 0 are complete. */
int trip_levels_make(const trip_levels_params *params, trip_budget *budget);

#endif
