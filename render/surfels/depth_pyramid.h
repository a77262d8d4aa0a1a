/* The greatest depths of the blocks of a picture, in levels. A rectangle of the picture hides
 * everything beyond its greatest depth. */
#ifndef TRIP_DEPTH_PYRAMID_H
#define TRIP_DEPTH_PYRAMID_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "budget.h"
#include "task_runner.h"

/* Blocks of level l are 8^(l + 1) pixels wide. */
enum { TRIP_PYRAMID_LEVELS = 6, TRIP_PYRAMID_BITS = 3 };

typedef struct trip_depth_pyramid {
    int width, height; /* pixels */
    int levels;
    int columns[TRIP_PYRAMID_LEVELS], rows[TRIP_PYRAMID_LEVELS];
    float *greatest[TRIP_PYRAMID_LEVELS];
    uint8_t *changed; /* for each block of level 0 */
    size_t blocks;    /* of all levels */
} trip_depth_pyramid;

/* All depths are infinite. Returns false, without a report, if the budget refuses the memory. */
bool trip_depth_pyramid_begin(trip_depth_pyramid *p, int width, int height, trip_budget *budget);
void trip_depth_pyramid_end(trip_depth_pyramid *p, trip_budget *budget);

/* Marks the block of a pixel. Any thread, but not during a refresh. */
static inline void trip_depth_pyramid_mark(trip_depth_pyramid *p, int x, int y)
{
    __atomic_store_n(&p->changed[(size_t)(y >> TRIP_PYRAMID_BITS) * (size_t)p->columns[0] +
                                 (size_t)(x >> TRIP_PYRAMID_BITS)],
                     1, __ATOMIC_RELAXED);
}

/* Takes over the depths of the marked blocks: bits of floats, row by row. */
void trip_depth_pyramid_refresh(trip_depth_pyramid *p, const uint32_t *depths,
                                const trip_task_runner *runner);

/* Takes over level 0, which the caller has written to greatest[0]. */
void trip_depth_pyramid_refresh_above(trip_depth_pyramid *p);

/* Returns whether all depths of a rectangle of pixels, inclusive and inside the picture, were less
 * than `depth` at the last refresh. Any thread. */
bool trip_depth_pyramid_is_before(const trip_depth_pyramid *p, int left, int top, int right,
                                  int bottom, float depth);

#endif
