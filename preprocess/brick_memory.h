/* How the memory promised to `brick` is shared out, decided before anything large is taken. */
#ifndef TRIP_BRICK_MEMORY_H
#define TRIP_BRICK_MEMORY_H

#include "piece.h"
#include "volume.h"

typedef struct trip_memory_plan {
    int64_t slices;      /* read at a time, of formats that come in slices */
    bool read_ahead;     /* the next ones while these are worked on */
    bool in_order;       /* the list along Z can be written as it comes */
    uint64_t list_bytes; /* for pieces of splats */
} trip_memory_plan;

/* Threads to take where nobody said how many: one a processor, but no more than leave half of the
 * memory for other things. */
unsigned trip_memory_plan_threads(const trip_piece_format *format, uint64_t memory_bytes);

/* Refuses, with the least that would do, what cannot be done in `memory_bytes`. `slices` 0 leaves
 * that choice to the plan. */
int trip_memory_plan_make(trip_memory_plan *plan, const char *path, const trip_volume_info *info,
                          const trip_piece_format *format, unsigned threads, uint64_t memory_bytes,
                          int64_t slices);

/* Once all but the lists and the slices has been taken and `left_bytes` are there: what the lists
 * get of them. */
int trip_memory_plan_settle(trip_memory_plan *plan, const char *path, const trip_volume_info *info,
                            const trip_piece_format *format, unsigned threads, uint64_t left_bytes);

#endif
