/* Draws one picture of a data set: makes the plan, then reads and draws each layer, then merges. A
 * frame is drawn at once by trip_frame_draw(), or in steps that never wait for the disk:
 *
 *     trip_frame_begin(&d, renderer, reader, &frame);
 *     while ((status = trip_frame_step(&d, deadline_ns)) > 0) {
 *         trip_frame_picture(&d, rgba, depth);     // optional: the picture so far
 *         if (status == TRIP_FRAME_WAITS)
 *             trip_frame_await(&d, timeout_ns);
 *     }
 *     trip_frame_picture(&d, rgba, depth);
 *     trip_frame_end(&d);
 *
 * The picture has the same bits for any steps, and whether or not it was taken before the end. All
 * calls come from one thread, except trip_frame_cancel(). */
#ifndef TRIP_FRAME_H
#define TRIP_FRAME_H

#include "renderer.h"

typedef struct trip_frame_stats {
    double ms, read_ms, draw_ms, merge_ms;
    bool counted; /* splats projected and drawn are counted; otherwise those counts are invalid */
    trip_list_stats all;      /* of all lists */
    trip_reader_stats reader; /* summed over all passes */
} trip_frame_stats;

#define TRIP_FRAME_HELD_MAX 16

/* A frame in progress. The caller provides its memory and must not move it. */
typedef struct trip_drawing {
    trip_renderer *renderer;
    trip_reader *reader;
    const trip_frame *frame;
    trip_frame_stats stats; /* complete after the finished frame's picture was taken */

    /* Private to frame.c: */
    trip_scope scope; /* cancelled if the frame is abandoned */
    double begun_ms;
    bool begun, done; /* the renderer has begun; every batch is drawn */
    bool loaded;      /* resident data is loaded; reads have begun */
    bool all_read;    /* every batch is read and handed to the renderer */
    int next_axis;    /* first axis with a layer that has not begun */
    uint64_t splats;  /* drawn so far */
    /* The next run of the current batch, held[(held_first + held_count - 1) % TRIP_FRAME_HELD_MAX].
     */
    bool in_batch;
    size_t next_run;
    /* Batches that the renderer may still use; held[held_first % TRIP_FRAME_HELD_MAX] is the
     * oldest. */
    trip_batch held[TRIP_FRAME_HELD_MAX];
    unsigned held_first, held_count;
} trip_drawing;

/* Begins a frame. Starts the reads, unless the renderer must load data first. The reader must read
 * at least the plan's planes. trip_frame_end() must follow, also after a failure. */
int trip_frame_begin(trip_drawing *d, trip_renderer *renderer, trip_reader *reader,
                     const trip_frame *frame);
/* Loads and draws ready data until the deadline (CLOCK_MONOTONIC). It exceeds the deadline by at
 * most one piece: TRIP_FRAME_PIECE splats or one run. It always does at least one ready piece.
 * UINT64_MAX means no deadline. */
int trip_frame_step(trip_drawing *d, uint64_t deadline_ns);
/* Waits for data to draw or room for it, at most for the timeout. UINT64_MAX waits without limit.
 */
void trip_frame_await(trip_drawing *d, uint64_t timeout_ns);
/* Writes the picture so far: width * height * 4 floats, premultiplied, row 0 at the top. With
 * settings.depth it also writes width * height distances (layer.h); otherwise `depth` is NULL.
 * After TRIP_FRAME_DONE the picture is complete. */
int trip_frame_picture(trip_drawing *d, float *rgba, float *depth);
/* Cancels the frame, from any thread while the drawing exists. A step or picture in progress ends
 * within milliseconds. It and later calls return TRIP_INTERRUPTED. */
void trip_frame_cancel(trip_drawing *d);
/* Ends the frame, and frees the renderer and the reader for another one. An unfinished frame is
 * abandoned: pending drawing is dropped, or finishes on the graphics device before its next frame.
 * Pending reads are not awaited. */
void trip_frame_end(trip_drawing *d);

/* Draws a whole frame at once. rgba and depth are as in trip_frame_picture(). */
int trip_frame_draw(trip_renderer *renderer, trip_reader *reader, const trip_frame *frame,
                    float *rgba, float *depth, trip_frame_stats *stats);

/* Returns the statistics of a list for the last complete frame, until the next frame begins.
 * Without trip_frame.count only splats read and bytes are valid. */
trip_list_stats trip_frame_list_stats(const trip_renderer *renderer, const trip_reader *reader,
                                      unsigned list);

#endif
