/* One image from a data set: plan, then for each layer reader -> renderer, then merge. */
#ifndef TRIP_FRAME_H
#define TRIP_FRAME_H

#include "renderer.h"

typedef struct trip_frame_stats {
    double ms, read_ms, draw_ms, merge_ms;
    bool counted;             /* splats projected and drawn; else those counts say nothing */
    trip_list_stats lists[3]; /* by layer: all lists of an axis */
    trip_reader_stats reader; /* summed over the passes */
} trip_frame_stats;

/* rgba: width * height * 4 floats. The reader must read at least the plan's planes. */
int trip_frame_draw(trip_renderer *renderer, trip_reader *reader, const trip_frame *frame,
                    float *rgba, trip_frame_stats *stats);

#endif
