/* A splat buffer carries projected splats to the panes. The projecting threads fill it chunk by
 * chunk. A stable counting sort orders each chunk by pane and keeps the draw order within a pane.
 * Then the buckets of all chunks are linked into one list for each pane, in draw order, for the
 * blending threads.
 *
 * The renderer's thread reserves, cuts and links chunks. One projecting thread fills a chunk and
 * claims room for its visible voxels. If there is no room, this chunk and all later chunks are done
 * again in the next buffer. A linked buffer is read-only. */
#ifndef TRIP_CPU_SPLAT_BUFFER_H
#define TRIP_CPU_SPLAT_BUFFER_H

#include <stdatomic.h>

#include "budget.h"
#include "cpu/occlusion.h"
#include "cpu/kernels/kernels.h"

/* The splats of one chunk in one pane. order[first] to order[first + count - 1] hold splat numbers,
 * relative to the chunk's first splat. */
typedef struct trip_cpu_bucket {
    uint32_t pane, chunk;
    uint32_t first, count;
    uint32_t next; /* next bucket of the pane, or TRIP_CPU_NONE */
} trip_cpu_bucket;

#define TRIP_CPU_NONE UINT32_MAX

/* Voxels from consecutive runs of a batch, and their splats. */
typedef struct trip_cpu_chunk {
    size_t run;       /* index of the first run in the batch */
    uint32_t skip;    /* squares to skip in the first run, in draw order */
    uint32_t skipped; /* voxels in the skipped squares */
    uint32_t voxels;  /* total, in whole squares */
    unsigned list;    /* trip_list.index of all runs */
    uint32_t splat;   /* first splat in the buffer */
    uint32_t splats;
    uint32_t first_bucket, buckets;
    bool unsorted;          /* every pane must look through all its splats */
    bool full;              /* the buffer had no room for the chunk */
    trip_list_stats counts; /* used if the frame counts */
} trip_cpu_chunk;

/* A pane's list of buckets. */
typedef struct trip_cpu_pane_list {
    uint32_t head, tail;
    uint32_t splats;
} trip_cpu_pane_list;

typedef struct trip_cpu_buffer {
    uint32_t capacity; /* splats */
    uint32_t bucket_capacity, order_capacity, chunk_capacity, pane_capacity;
    trip_cpu_splat *splats;
    float *depths; /* one per splat; NULL before the first layer with depth */
    uint16_t *order;
    trip_cpu_bucket *buckets;
    trip_cpu_chunk *chunks;
    trip_cpu_pane_list *pane_lists;
    uint32_t *unsorted; /* numbers of the unsorted chunks */
    uint32_t chunk_count, unsorted_count;
    bool one_by_one; /* reserve one chunk at a time, see trip_cpu_buffer_cut() */
    _Atomic uint64_t splats_used, orders_used, buckets_used;
    size_t bytes, pane_list_bytes;
} trip_cpu_buffer;

/* Maximum number of voxels in a chunk. */
#define TRIP_CPU_CHUNK 4096
/* Maximum number of runs in a chunk. */
#define TRIP_CPU_CHUNK_RUNS 1024

int trip_cpu_buffer_create(trip_cpu_buffer *f, uint32_t capacity, trip_budget *budget);
void trip_cpu_buffer_destroy(trip_cpu_buffer *f, trip_budget *budget);
/* Makes room for a frame's panes and, if `depths`, for the depths of splats. Fails with TRIP_ERROR
 * if the budget has too little left. */
int trip_cpu_buffer_fit(trip_cpu_buffer *f, uint32_t panes, bool depths, trip_budget *budget);
void trip_cpu_buffer_empty(trip_cpu_buffer *f);

/* Reserves the next chunk. Returns NULL if no more chunks are possible. */
trip_cpu_chunk *trip_cpu_buffer_reserve(trip_cpu_buffer *f);

/* Claims room for `splats` + 1 splats of a chunk. Returns false if the buffer is full. An empty
 * buffer always has room for TRIP_CPU_CHUNK splats. */
bool trip_cpu_buffer_claim(trip_cpu_buffer *f, trip_cpu_chunk *chunk, uint32_t splats);

/* Removes the first chunk that found the buffer full, and all later chunks. Returns the number of
 * chunks left; the removed ones stay readable until the next reservation. Chunks claim room in any
 * order, so even the first chunk may find the buffer full. The buffer is then empty, and the next
 * chunk is reserved alone, so that it fits. */
uint32_t trip_cpu_buffer_cut(trip_cpu_buffer *f);

/* Consecutive splats of a chunk in the same panes. A splat with TRIP_CPU_PANES_MORE has a series of
 * its own. */
typedef struct trip_cpu_series {
    uint32_t panes; /* trip_cpu_splat.panes */
    uint16_t end;   /* the splat after the last one, in the chunk */
} trip_cpu_series;

/* Scratch memory of a thread that sorts a chunk. */
typedef struct trip_cpu_sorting {
    uint32_t *counts; /* panes + across + 2 entries, 0 before and after a sort */
    trip_cpu_series series[TRIP_CPU_CHUNK];
} trip_cpu_sorting;

/* Sorts a filled chunk by pane. */
void trip_cpu_sort_chunk(trip_cpu_buffer *f, trip_cpu_chunk *chunk, trip_cpu_grid grid,
                         trip_cpu_sorting *sorting);

/* Links the buckets of all chunks by pane. Leaves out terminated panes. */
void trip_cpu_link_pane_lists(trip_cpu_buffer *f, const trip_cpu_mask *mask);

/* Calls `take` with pieces of a pane's splats, in draw order. If `order` is NULL, `take` must look
 * through all splats of the chunk. */
void trip_cpu_pane_list_each(const trip_cpu_buffer *f, uint32_t pane,
                             void (*take)(void *user, const trip_cpu_chunk *chunk,
                                          const trip_cpu_splat *splats, const uint16_t *order,
                                          uint32_t count),
                             void *user);

#endif
