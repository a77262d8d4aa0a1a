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
    trip_list_position run;
    /* Of a file. */
    const trip_output *file;
    bool means; /* it has them */
    uint64_t next;
    struct {
        uint64_t at;
        uint32_t count;
    } voxels;

    unsigned edge_log2; /* of squares of the next level */
    unsigned tile_log2; /* of squares here */
} trip_level_source;

/* Of a list along Z; `kept`: it holds voxels that were kept, not their halo; `normals`: these are
 * read, too, where it has them. */
int trip_level_source_list(trip_level_source *s, trip_writer *w, unsigned list, bool kept,
                           bool normals, unsigned odd, unsigned tile_log2, unsigned edge_log2,
                           trip_budget *budget);
/* Of a flushed file of trip_level_file_append(), with means or without. */
int trip_level_source_file(trip_level_source *s, const trip_output *file, bool means, unsigned odd,
                           unsigned edge_log2);
void trip_level_source_close(trip_level_source *s);

/* Goes on to the next square; `has` says whether there is one. Nothing of its voxels is read: a
 * copy of the source says where they are, and any thread may read them. */
int trip_level_source_next(trip_level_source *s);

/* The next part of some memory, aligned to 64, where *used of it is; with NULL it is counted only.
 */
static inline void *trip_level_carve(unsigned char *memory, size_t *used, size_t bytes)
{
    const size_t at = *used;
    *used = at + ((bytes + 63) & ~(size_t)63);
    return memory ? memory + at : NULL;
}

/* Reports that there is no memory for levels. */
int trip_level_fail_memory(void);

/* Appends the voxels of a square, values before means, or without means (NULL), which is the same
 * for all of a file; keys ascend. */
int trip_level_file_append(trip_output *file, uint64_t key, const trip_coarse_value *values,
                           const trip_coarse_mean *means, uint32_t count);

/* Of a square of so many voxels. */
static inline uint64_t trip_level_voxels_bytes(uint32_t count, bool means)
{
    return count * (sizeof(trip_coarse_value) + (means ? sizeof(trip_coarse_mean) : 0));
}

/* Reads back what stands before a square's voxels, which follow TRIP_LEVEL_SQUARE_BYTES behind. */
enum { TRIP_LEVEL_SQUARE_BYTES = 16 };
int trip_level_file_square(const trip_output *file, uint64_t at, unsigned edge_log2, uint64_t *key,
                           uint32_t *count);

#endif
