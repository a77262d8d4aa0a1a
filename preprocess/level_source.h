/* Where the voxels of a level are read from while the next one is made: runs of the finished lists
 * along Z of level 0, or the file of voxels that a coarse level left. A source gives the even or
 * the odd sheets, square by square, in list order. One thread goes on from square to square. */
#ifndef TRIP_LEVEL_SOURCE_H
#define TRIP_LEVEL_SOURCE_H

#include "coarse.h"
#include "output.h"
#include "piece.h"
#include "writer.h"

/* The key of a square of 2^edge_log2 voxels: sheet << TRIP_TILE_MORTON_BITS | its Morton code. */

typedef struct trip_level_source {
    unsigned odd;
    bool has;     /* it is at a square: */
    uint64_t key; /* of the square of the next level that its voxels belong to */
    int64_t u, v; /* where it starts in that, in voxels of this one */
    /* Of a list. */
    trip_list_cursor *cursor;
    bool kept;
    trip_list_place run;
    /* Of a file. */
    const trip_output *file;
    uint64_t next;
    struct {
        uint64_t at;
        uint32_t count;
    } voxels;

    unsigned edge_log2; /* of squares of the next level */
    unsigned tile_log2; /* of squares here */
} trip_level_source;

/* Of a list along Z; `kept`: it holds voxels that were kept, not their halo. */
int trip_level_source_list(trip_level_source *s, trip_writer *w, unsigned list, bool kept,
                           unsigned odd, unsigned tile_log2, unsigned edge_log2,
                           trip_budget *budget);
/* Of a flushed file of trip_level_file_append(). */
int trip_level_source_file(trip_level_source *s, const trip_output *file, unsigned odd,
                           unsigned edge_log2);
void trip_level_source_close(trip_level_source *s);

/* Goes on to the next square; `has` says whether there is one. Nothing of its voxels is read: a
 * copy of the source says where they are, and any thread may read them. */
int trip_level_source_next(trip_level_source *s);

/* Appends the voxels of a square; keys ascend. */
int trip_level_file_append(trip_output *file, uint64_t key, const trip_coarse_voxel *voxels,
                           uint32_t count);

/* Reads back what stands before a square's voxels, which follow TRIP_LEVEL_SQUARE_BYTES behind. */
enum { TRIP_LEVEL_SQUARE_BYTES = 16 };
int trip_level_file_square(const trip_output *file, uint64_t at, unsigned edge_log2, uint64_t *key,
                           uint32_t *count);

#endif
