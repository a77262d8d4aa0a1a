/* Divides the memory of `brick` between reading, splats and lists, before anything large is
 * allocated. Any thread may call it. */
#ifndef TRIP_BRICK_MEMORY_H
#define TRIP_BRICK_MEMORY_H

#include "piece.h"
#include "volume_info.h"

typedef struct trip_memory_plan {
    int64_t slices;      /* slices read at once, for dense volumes */
    bool read_ahead;     /* reads the next slices during processing */
    bool in_order;       /* the ordered list can be written as it arrives */
    uint64_t list_bytes; /* memory for pieces */
} trip_memory_plan;

/* Returns the default number of threads: one per processor, but no more than fit in half of the
 * memory. */
unsigned trip_memory_plan_threads(const trip_piece_format *format, uint64_t memory_bytes);

/* Makes a plan for `memory_bytes`. Too little memory is a reported failure that names the minimum.
 * With `slices` 0 the plan chooses. */
int trip_memory_plan_make(trip_memory_plan *plan, const char *path, const trip_volume_info *info,
                          const trip_piece_format *format, unsigned threads, uint64_t memory_bytes,
                          int64_t slices);

/* Divides the memory again once all but the lists and the slices is allocated, and `left_bytes` are
 * left. Sets list_bytes and in_order. */
int trip_memory_plan_update(trip_memory_plan *plan, const char *path, const trip_volume_info *info,
                            const trip_piece_format *format, unsigned threads, uint64_t left_bytes);

#endif
