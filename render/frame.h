/* One image from a data set: plan, then for each layer reader -> renderer, then merge. A frame is
 * drawn at once by trip_frame_draw(), or in steps that never wait for the disk:
 *
 *     trip_frame_begin(&d, renderer, reader, &frame);
 *     while ((status = trip_frame_step(&d, deadline_ns)) > 0) {
 *         trip_frame_picture(&d, rgba, depth);     // so far, whenever it is wanted
 *         if (status == TRIP_FRAME_WAITS)
 *             trip_frame_await(&d, timeout_ns);
 *     }
 *     trip_frame_picture(&d, rgba, depth);
 *     trip_frame_end(&d);
 *
 * The picture has the same bits whatever the steps were and whether or not it was looked at before.
 * All calls come from one thread, but for trip_frame_cancel(). */
#ifndef TRIP_FRAME_H
#define TRIP_FRAME_H

#include "renderer.h"

typedef struct trip_frame_stats {
    double ms, read_ms, draw_ms, merge_ms;
    bool counted;             /* splats projected and drawn; else those counts say nothing */
    trip_list_stats all;      /* of all lists together */
    trip_reader_stats reader; /* summed over the passes */
} trip_frame_stats;

#define TRIP_FRAME_HELD_MAX 16

/* A frame being drawn, in memory of the caller's that stays where it is. */
typedef struct trip_drawing {
    trip_renderer *renderer;
    trip_reader *reader;
    const trip_frame *frame;
    trip_frame_stats stats; /* complete once the picture of the finished frame was taken */

    /* The rest is frame.c's. */
    trip_scope scope; /* cancelled: the frame is given up */
    double begun_ms;
    bool begun, done; /* the renderer has begun the frame; every batch is drawn */
    bool loaded;      /* by the renderer, what it keeps; the reads are begun */
    bool all_read;    /* and drawn */
    int next_axis;    /* layers before this one were begun */
    uint64_t splats;  /* drawn so far */
    /* Being drawn: held[(held_first + held_count - 1) % TRIP_FRAME_HELD_MAX] from this run on. */
    bool in_batch;
    size_t next_run;
    /* Drawn, but perhaps not done with: held[held_first % TRIP_FRAME_HELD_MAX] is the oldest. */
    trip_batch held[TRIP_FRAME_HELD_MAX];
    unsigned held_first, held_count;
} trip_drawing;

/* Starts the reads, where the renderer has nothing to load. The reader must read at least the
 * plan's planes. After a failure too, trip_frame_end() follows. */
int trip_frame_begin(trip_drawing *d, trip_renderer *renderer, trip_reader *reader,
                     const trip_frame *frame);
/* Loads and draws what is ready, until the deadline by CLOCK_MONOTONIC, which it passes by the time
 * of one piece of at most TRIP_FRAME_PIECE splats or one run; something of what is ready in any
 * case. UINT64_MAX: no deadline. */
int trip_frame_step(trip_drawing *d, uint64_t deadline_ns);
/* Waits until there is something to draw, or room for it, at most for the timeout; UINT64_MAX:
 * without end. */
void trip_frame_await(trip_drawing *d, uint64_t timeout_ns);
/* The picture of what is drawn so far: width * height * 4 floats, premultiplied, row 0 at the top,
 * and with settings.depth as many distances (layer.h); otherwise `depth` is NULL. After
 * TRIP_FRAME_DONE it is the picture. */
int trip_frame_picture(trip_drawing *d, float *rgba, float *depth);
/* Any thread, while the drawing is there: the frame is given up. A step or picture under way ends
 * within milliseconds, and like those that follow with TRIP_INTERRUPTED. */
void trip_frame_cancel(trip_drawing *d);
/* The renderer and the reader are free for another frame. One that is not done is given up: what
 * the renderer has under way is dropped, or left to end on a graphics device before the next frame
 * is drawn there, and reads under way are not waited for. */
void trip_frame_end(trip_drawing *d);

/* Begins, steps to the end, takes the picture; rgba and depth as in trip_frame_picture(). */
int trip_frame_draw(trip_renderer *renderer, trip_reader *reader, const trip_frame *frame,
                    float *rgba, float *depth, trip_frame_stats *stats);

/* What a list of the data set, by its number, took of the frame whose picture was last complete,
 * until the next one begins. Without trip_frame.count only splats read and bytes. */
trip_list_stats trip_frame_list_stats(const trip_renderer *renderer, const trip_reader *reader,
                                      unsigned list);

/* CLOCK_MONOTONIC. */
uint64_t trip_frame_now_ns(void);

#endif
