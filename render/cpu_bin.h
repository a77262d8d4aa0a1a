/* Projected splats on their way to the screen tiles. The projecting threads turn a batch into
 * chunks, each on its own, and copy a chunk's splats into a flush buffer sorted by tile, without
 * disturbing their order; then every tile's pieces are linked in the chunks' order, for the
 * blending threads to read one after the other.
 *
 * Chunks are reserved and linked by the renderer's thread; each is filled by one projecting thread;
 * a linked buffer is read-only but for the spare splats. */
#ifndef TRIP_CPU_BIN_H
#define TRIP_CPU_BIN_H

#include <stdatomic.h>

#include "budget.h"
#include "cpu_kernels.h"

#define TRIP_CPU_NONE UINT32_MAX

/* Splats of one chunk in one tile: [first, first + count). */
typedef struct trip_cpu_segment {
    uint32_t tile, chunk;
    uint32_t first, count;
    uint32_t next; /* segment of the same tile, or TRIP_CPU_NONE */
} trip_cpu_segment;

/* Voxels of consecutive runs of a batch, and the splats that they became. */
typedef struct trip_cpu_chunk {
    size_t run;      /* the first, in the batch */
    uint32_t skip;   /* of its voxels, in draw order */
    uint32_t voxels; /* in all */
    uint32_t first_segment, segments;
    uint32_t wide, wide_count;                   /* wide splats */
    uint16_t wide_x0, wide_y0, wide_x1, wide_y1; /* pixels that contain theirs */
    trip_list_stats counts;                      /* where the frame counts */
    bool full; /* the buffer had no room for it: it is to be done again */
} trip_cpu_chunk;

/* A tile's share of a flush. */
typedef struct trip_cpu_share {
    uint32_t head, tail; /* segments */
    uint32_t splats;     /* wide ones aside */
} trip_cpu_share;

typedef struct trip_cpu_flush {
    uint32_t capacity, spare; /* splats */
    uint32_t segment_capacity, chunk_capacity, tile_capacity;
    trip_cpu_splat *splats;
    trip_cpu_segment *segments;
    trip_cpu_chunk *chunks;
    trip_cpu_share *shares; /* by tile */
    uint32_t *wide_chunks;  /* those that have wide splats */
    uint32_t chunk_count, wide_chunk_count, wide_splats;
    _Atomic uint64_t splats_used, segments_used;
    size_t bytes, share_bytes;
} trip_cpu_flush;

/* Tiles across the image and down. */
typedef struct trip_cpu_grid {
    uint32_t across, down;
} trip_cpu_grid;

/* `spare` further splats stand behind the capacity, for whatever the user wants. */
int trip_cpu_flush_create(trip_cpu_flush *f, uint32_t capacity, uint32_t spare,
                          trip_budget *budget);
void trip_cpu_flush_destroy(trip_cpu_flush *f, trip_budget *budget);
/* Makes room for a frame's tiles. */
int trip_cpu_flush_fit(trip_cpu_flush *f, uint32_t tiles, trip_budget *budget);
void trip_cpu_flush_empty(trip_cpu_flush *f);

/* The next chunk, or NULL when there can be no more. */
trip_cpu_chunk *trip_cpu_flush_reserve(trip_cpu_flush *f, uint32_t voxels);

/* Copies what became of a chunk into the buffer, sorted by tile; splats of closed tiles are left
 * out. `closed` has an entry for each tile, and one for the wide ones, never set. The basket's
 * counts are zero afterwards. */
void trip_cpu_sort(trip_cpu_flush *f, trip_cpu_chunk *chunk, trip_cpu_grid grid,
                   const _Atomic uint8_t *closed, trip_cpu_basket *basket);

/* The first chunk that found the buffer full, or chunk_count. It and those after it are forgotten.
 */
uint32_t trip_cpu_flush_cut(trip_cpu_flush *f);

/* Links the segments by tile. */
void trip_cpu_link(trip_cpu_flush *f, trip_cpu_grid grid);

/* Whether some wide splats of a chunk may lie in the tile at (x, y). */
static inline bool trip_cpu_wide_meets(const trip_cpu_chunk *chunk, int x, int y)
{
    return chunk->wide_count && chunk->wide_x0 < x + TRIP_CPU_TILE && chunk->wide_x1 >= x &&
           chunk->wide_y0 < y + TRIP_CPU_TILE && chunk->wide_y1 >= y;
}

/* Takes a tile's splats, piece by piece in their order, and single wide splats that may or may not
 * lie in it. */
typedef struct trip_cpu_taker {
    void (*take)(void *user, uint32_t first, uint32_t count);
    void (*take_wide)(void *user, uint32_t splat);
    void *user;
} trip_cpu_taker;

void trip_cpu_share_each(const trip_cpu_flush *f, uint32_t tile, int x, int y,
                         const trip_cpu_taker *taker);

#endif
