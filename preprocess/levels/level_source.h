/* Reads a level's voxels while the next level is made. The voxels come from the finished Z lists of
 * level 0, or from the file of a coarse level. A source delivers the even or the odd sheets, square
 * by square, in list order. One thread advances it. */
#ifndef TRIP_LEVEL_SOURCE_H
#define TRIP_LEVEL_SOURCE_H

#include "coarse.h"
#include "output.h"
#include "piece.h"
#include "writer.h"

/* The key of a square is sheet << TRIP_TILE_MORTON_BITS | its Morton code, in squares of
 * 2^edge_log2 voxels. */

typedef struct trip_level_source {
    unsigned odd;
    bool has;     /* there is a current square */
    uint64_t key; /* key of the next level's square that contains the current square */
    int64_t u, v; /* position of the current square in that square, in voxels of this level */
    /* For a list: */
    trip_list_cursor *cursor;
    bool kept;
    trip_list_position run;
    /* For a file: */
    const trip_output *file;
    bool means; /* the file contains means */
    uint64_t next;
    struct {
        uint64_t at;
        uint32_t count;
    } voxels;

    unsigned edge_log2; /* log2 of the edge of the next level's squares */
    unsigned tile_log2; /* log2 of the edge of this level's squares */
} trip_level_source;

/* Opens a Z list. `kept` means that the list holds kept voxels, not halo. With `normals`, the
 * list's normals are read too, if it has any. */
int trip_level_source_list(trip_level_source *s, trip_writer *w, unsigned list, bool kept,
                           bool normals, unsigned odd, unsigned tile_log2, unsigned edge_log2,
                           trip_budget *budget);
/* Opens a flushed file of trip_level_file_append(), with or without means. */
int trip_level_source_file(trip_level_source *s, const trip_output *file, bool means, unsigned odd,
                           unsigned edge_log2);
void trip_level_source_close(trip_level_source *s);

/* Advances to the next square and sets `has`. Reads no voxels. Any thread may read the voxels with
 * a copy of the source. */
int trip_level_source_next(trip_level_source *s);

/* Returns the next part of `memory`, aligned to 64 bytes, and advances *used. With `memory` NULL it
 * only advances *used. */
static inline void *trip_level_carve(unsigned char *memory, size_t *used, size_t bytes)
{
    const size_t at = *used;
    *used = at + ((bytes + 63) & ~(size_t)63);
    return memory ? memory + at : NULL;
}

/* Reports that memory for levels is exhausted. */
int trip_level_fail_memory(void);

/* Appends the voxels of a square, values before means. `means` is NULL for all squares of a file or
 * for none. Keys must ascend. */
int trip_level_file_append(trip_output *file, uint64_t key, const trip_coarse_value *values,
                           const trip_coarse_mean *means, uint32_t count);

/* Returns the bytes of a square's voxels, without its header. */
static inline uint64_t trip_level_voxels_bytes(uint32_t count, bool means)
{
    return count * (sizeof(trip_coarse_value) + (means ? sizeof(trip_coarse_mean) : 0));
}

/* Reads back the header of the square at file position `at`. The voxels start
 * TRIP_LEVEL_SQUARE_BYTES after it. */
enum { TRIP_LEVEL_SQUARE_BYTES = 16 };
int trip_level_file_square(const trip_output *file, uint64_t at, unsigned edge_log2, uint64_t *key,
                           uint32_t *count);

#endif
