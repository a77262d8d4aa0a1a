/* Makes the coarse levels of a data set, each from the finished level below. Level 1 is made from
 * the Z lists of level 0. Every other level is made from a file of the voxels below, which stays in
 * memory if possible. Two sheets are read at a time, square by square, so that memory does not grow
 * with the volume. A list builder sorts the pieces. Only lists of means need normals and kept
 * shares; without such lists, neither is read. */
#ifndef TRIP_LEVELS_H
#define TRIP_LEVELS_H

#include "brick_params.h"
#include "codes.h"
#include "list_builder.h"
#include "normal.h"

/* Maximum number of levels above 0. */
enum { TRIP_LEVELS_MAX = 24 };

/* The kinds of lists of a coarse level, three lists each: means, drawn as splats, come before
 * values, which are interpolated. */
typedef struct trip_level_kinds {
    bool means, values; /* at least one of them */
} trip_level_kinds;

typedef struct trip_levels_params {
    trip_piece_format format; /* format of level 0's pieces */
    trip_level_kinds kinds;   /* values require a halo in level 0 */
    trip_quantiser quantiser;
    const trip_compact_normals *compact; /* encoding of 3-byte normals; NULL means 4 bytes */
    int64_t dims[3];                     /* voxels of level 0 along each axis */
    trip_affine index_to_world;
    unsigned levels;
    double typical_min, typical_max; /* typical range of the volume's values */
    trip_codes codes;                /* the same codes as the quantiser's */
    bool hidden_above;               /* dropped values lie mostly above the kept ones */
    const char *folder;              /* folder for temporary files */
    trip_writer *writer;             /* has the lists of trip_levels_lists() */
    trip_spill *spill; /* its sequences are retired, because they are no longer needed */
    trip_workers *workers;
    /* Called from time to time with the number of finished sheets. May be NULL. */
    void (*progress)(void *user, uint64_t done, uint64_t total);
    void *progress_user;
} trip_levels_params;

/* Returns the number of coarse levels for `wanted`, as defined by trip_brick_params.levels. */
unsigned trip_levels_count(const int64_t dims[3], int wanted, unsigned tile_voxels);

trip_level_kinds trip_levels_kinds(trip_brick_levels_for wanted, bool halo);

/* Fills in the lists of levels 0 to `levels` for the writer. `lists` has room for 6 lists per
 * level. Returns the number of lists. */
unsigned trip_levels_lists(const int64_t dims[3], const trip_affine *index_to_world, bool halo,
                           trip_level_kinds kinds, unsigned levels, trip_writer_list *lists);

/* Returns the number of a level's first list. */
unsigned trip_levels_first_list(bool halo, trip_level_kinds kinds, unsigned level);

/* Makes all levels above 0. The lists of level 0 must be complete. */
int trip_levels_make(const trip_levels_params *params, trip_budget *budget);

#endif
