/* Projected splats on their way to the screen tiles: a flush buffer takes them chunk by chunk from
 * the projecting threads, sorts each chunk's by tile without disturbing their order, and then links
 * every tile's share of the chunks, in order, for the blending threads.
 *
 * Chunks are reserved, cut and linked by the renderer's thread. Each is filled by one projecting
 * thread, which claims room for what it finds visible; where there is none, the chunk and those
 * after it are done again in the next flush. A linked buffer is read-only. */
#ifndef TRIP_CPU_BIN_H
#define TRIP_CPU_BIN_H

#include <stdatomic.h>

#include "budget.h"
#include "cpu/cover.h"
#include "cpu/kernels/kernels.h"

/* Splats of one chunk in one tile: order[first ...] of them, counted from the chunk's first. */
typedef struct trip_cpu_segment {
    uint32_t tile, chunk;
    uint32_t first, count;
    uint32_t next; /* segment of the same tile, or TRIP_CPU_NONE */
} trip_cpu_segment;

#define TRIP_CPU_NONE UINT32_MAX

/* Voxels of consecutive runs of a batch, and the splats that they became. */
typedef struct trip_cpu_chunk {
    size_t run;       /* the first, in the batch */
    uint32_t skip;    /* of its squares, in draw order */
    uint32_t skipped; /* voxels of those */
    uint32_t voxels;  /* in all, of whole squares */
    unsigned list;    /* that all of them are of */
    uint32_t splat;   /* first one in the buffer */
    uint32_t splats;
    uint32_t first_segment, segments;
    bool spread;            /* not sorted: every tile looks through all its splats */
    bool full;              /* the buffer had no room for it */
    trip_list_stats counts; /* where the frame counts */
} trip_cpu_chunk;

/* A tile's share of a flush. */
typedef struct trip_cpu_share {
    uint32_t head, tail; /* segments */
    uint32_t splats;
} trip_cpu_share;

typedef struct trip_cpu_flush {
    uint32_t capacity; /* splats */
    uint32_t segment_capacity, order_capacity, chunk_capacity, tile_capacity;
    trip_cpu_splat *splats;
    float *depths; /* of the splats, once layers with depth were drawn */
    uint16_t *order;
    trip_cpu_segment *segments;
    trip_cpu_chunk *chunks;
    trip_cpu_share *shares; /* by tile */
    uint32_t *spread;       /* chunks that are spread */
    uint32_t chunk_count, spread_count;
    bool one_by_one; /* of late not even the first chunk found room beside others */
    _Atomic uint64_t splats_used, orders_used, segments_used;
    size_t bytes, share_bytes;
} trip_cpu_flush;

/* Most voxels of a chunk. */
#define TRIP_CPU_CHUNK 4096
/* And most runs that they are of. */
#define TRIP_CPU_CHUNK_RUNS 1024

int trip_cpu_flush_create(trip_cpu_flush *f, uint32_t capacity, trip_budget *budget);
void trip_cpu_flush_destroy(trip_cpu_flush *f, trip_budget *budget);
/* Makes room for a frame's tiles, and for depths where its layers have them. */
int trip_cpu_flush_fit(trip_cpu_flush *f, uint32_t tiles, bool depths, trip_budget *budget);
void trip_cpu_flush_empty(trip_cpu_flush *f);

/* The next chunk, or NULL when there can be no more for now. */
trip_cpu_chunk *trip_cpu_flush_reserve(trip_cpu_flush *f);

/* Room for so many splats of a chunk and one more; false when it is full. At most TRIP_CPU_CHUNK
 * always fit an empty buffer. */
bool trip_cpu_flush_claim(trip_cpu_flush *f, trip_cpu_chunk *chunk, uint32_t splats);

/* The first chunk that found the buffer full, or chunk_count. It and those after it are forgotten:
 * whoever claimed first has the room. Where that leaves none, the buffer is empty again and its
 * next chunk is reserved alone, so that it fits. */
uint32_t trip_cpu_flush_cut(trip_cpu_flush *f);

/* Consecutive splats of a chunk that lie in the same tiles; in many tiles, each is alone. */
typedef struct trip_cpu_series {
    uint32_t tiles; /* as in trip_cpu_splat */
    uint16_t end;   /* splat of the chunk */
} trip_cpu_series;

/* What a thread needs to sort a chunk. */
typedef struct trip_cpu_sorting {
    uint32_t *counts; /* for each tile and across + 2 more: zero, and left so */
    trip_cpu_series series[TRIP_CPU_CHUNK];
} trip_cpu_sorting;

/* Sorts a filled chunk by tile. */
void trip_cpu_bin(trip_cpu_flush *f, trip_cpu_chunk *chunk, trip_cpu_grid grid,
                  trip_cpu_sorting *sorting);

/* Links the chunks' segments by tile, leaving out closed tiles. */
void trip_cpu_link(trip_cpu_flush *f, const trip_cpu_mask *mask);

/* Calls `take` with a tile's splats, piece by piece in their order; order NULL: all of them are to
 * be looked through. */
void trip_cpu_share_each(const trip_cpu_flush *f, uint32_t tile,
                         void (*take)(void *user, const trip_cpu_chunk *chunk,
                                      const trip_cpu_splat *splats, const uint16_t *order,
                                      uint32_t count),
                         void *user);

#endif
