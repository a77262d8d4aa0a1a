/* Divides the memory of `brick` between reading, splats and lists before anything large is
 * allocated. Any thread. */
#ifndef TRIP_BRICK_MEMORY_H
#define TRIP_BRICK_MEMORY_H

#include "piece.h"
#include "volume.h"

typedef struct trip_memory_plan {
    int64_t slices;      /* read at a time, of dense volumes */
    bool read_ahead;     /* read the next slices while these are processed */
    bool in_order;       /* the ordered list can be written as it arrives */
    uint64_t list_bytes; /* for pieces */
} trip_memory_plan;

/* The default number of threads: one for each processor, but not so many that they take more than
 * half of the memory. */
unsigned trip_memory_plan_threads(const trip_piece_format *format, uint64_t memory_bytes);

/* Makes a plan for `memory_bytes`. A reported failure, with the least that would do, if that is too
 * little. `slices` 0: the plan chooses. */
int trip_memory_plan_make(trip_memory_plan *plan, const char *path, const trip_volume_info *info,
                          const trip_piece_format *format, unsigned threads, uint64_t memory_bytes,
                          int64_t slices);

/* Divides the memory anew, once all but the lists and the slices is allocated and `left_bytes` are
 * left: sets list_bytes and in_order. */
int trip_memory_plan_update(trip_memory_plan *plan, const char *path, const trip_volume_info *info,
                            const trip_piece_format *format, unsigned threads, uint64_t left_bytes);

#endif
