/* Projected splats on their way to the panes: a splat buffer takes them chunk by chunk from
 * the projecting threads, brings each chunk's into the order of panes by a counting sort, which
 * keeps their order within a pane, and then links every pane's buckets of all chunks to its list,
 * in order, for the blending threads.
 *
 * Chunks are reserved, cut and linked by the renderer's thread. Each is filled by one projecting
 * thread, which claims room for what it finds visible; where there is none, the chunk and those
 * after it are done again in the next buffer. A linked buffer is read-only. */
#ifndef TRIP_CPU_SPLAT_BUFFER_H
#define TRIP_CPU_SPLAT_BUFFER_H

#include <stdatomic.h>

#include "budget.h"
#include "cpu/occlusion.h"
#include "cpu/kernels/kernels.h"

/* Splats of one chunk in one pane: order[first ...] of them, counted from the chunk's first. */
typedef struct trip_cpu_bucket {
    uint32_t pane, chunk;
    uint32_t first, count;
    uint32_t next; /* bucket of the same pane, or TRIP_CPU_NONE */
} trip_cpu_bucket;

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
    uint32_t first_bucket, buckets;
    bool unsorted;          /* not sorted: every pane looks through all its splats */
    bool full;              /* the buffer had no room for it */
    trip_list_stats counts; /* where the frame counts */
} trip_cpu_chunk;

/* What of a buffer lies in a pane. */
typedef struct trip_cpu_pane_list {
    uint32_t head, tail; /* buckets */
    uint32_t splats;
} trip_cpu_pane_list;

typedef struct trip_cpu_buffer {
    uint32_t capacity; /* splats */
    uint32_t bucket_capacity, order_capacity, chunk_capacity, pane_capacity;
    trip_cpu_splat *splats;
    float *depths; /* of the splats, once layers with depth were drawn */
    uint16_t *order;
    trip_cpu_bucket *buckets;
    trip_cpu_chunk *chunks;
    trip_cpu_pane_list *pane_lists; /* by pane */
    uint32_t *unsorted;             /* chunks that are not sorted */
    uint32_t chunk_count, unsorted_count;
    bool one_by_one; /* of late not even the first chunk found room beside others */
    _Atomic uint64_t splats_used, orders_used, buckets_used;
    size_t bytes, pane_list_bytes;
} trip_cpu_buffer;

/* Most voxels of a chunk. */
#define TRIP_CPU_CHUNK 4096
/* And most runs that they are of. */
#define TRIP_CPU_CHUNK_RUNS 1024

int trip_cpu_buffer_create(trip_cpu_buffer *f, uint32_t capacity, trip_budget *budget);
void trip_cpu_buffer_destroy(trip_cpu_buffer *f, trip_budget *budget);
/* Makes room for a frame's panes, and for depths where its layers have them. */
int trip_cpu_buffer_fit(trip_cpu_buffer *f, uint32_t panes, bool depths, trip_budget *budget);
void trip_cpu_buffer_empty(trip_cpu_buffer *f);

/* The next chunk, or NULL when there can be no more for now. */
trip_cpu_chunk *trip_cpu_buffer_reserve(trip_cpu_buffer *f);

/* Room for so many splats of a chunk and one more; false when it is full. At most TRIP_CPU_CHUNK
 * always fit an empty buffer. */
bool trip_cpu_buffer_claim(trip_cpu_buffer *f, trip_cpu_chunk *chunk, uint32_t splats);

/* The first chunk that found the buffer full, or chunk_count. It and those after it are forgotten:
 * the room goes to those that claimed it first. Where that leaves none, the buffer is empty again
 * and its next chunk is reserved alone, so that it fits. */
uint32_t trip_cpu_buffer_cut(trip_cpu_buffer *f);

/* Consecutive splats of a chunk that lie in the same panes; in many panes, each is alone. */
typedef struct trip_cpu_series {
    uint32_t panes; /* as in trip_cpu_splat */
    uint16_t end;   /* splat of the chunk */
} trip_cpu_series;

/* What a thread needs to sort a chunk. */
typedef struct trip_cpu_sorting {
    uint32_t *counts; /* for each pane and across + 2 more: zero, and left so */
    trip_cpu_series series[TRIP_CPU_CHUNK];
} trip_cpu_sorting;

/* Sorts a filled chunk by pane. */
void trip_cpu_sort_chunk(trip_cpu_buffer *f, trip_cpu_chunk *chunk, trip_cpu_grid grid,
                         trip_cpu_sorting *sorting);

/* Links the chunks' buckets by pane, leaving out saturated panes. */
void trip_cpu_link_pane_lists(trip_cpu_buffer *f, const trip_cpu_mask *mask);

/* Calls `take` with a pane's splats, piece by piece in their order; order NULL: all of them are to
 * be looked through. */
void trip_cpu_pane_list_each(const trip_cpu_buffer *f, uint32_t pane,
                             void (*take)(void *user, const trip_cpu_chunk *chunk,
                                          const trip_cpu_splat *splats, const uint16_t *order,
                                          uint32_t count),
                             void *user);

#endif
