/* The GPU's work in parts: a fence stands behind each, and only a few are under way at a time, so
 * that a picture does not wait long. What a frame that is given up has under way is left to end by
 * itself. Owned by one renderer; needs its context current. */
#ifndef TRIP_GL_QUEUE_H
#define TRIP_GL_QUEUE_H

#include <epoxy/gl.h>
#include <stdbool.h>
#include <stdint.h>

enum { TRIP_GL_QUEUE_PARTS = 4 };

/* Parts are numbered from 1 on, and done in that order. */
typedef struct trip_gl_queue {
    GLsync fences[TRIP_GL_QUEUE_PARTS]; /* of part n at n % TRIP_GL_QUEUE_PARTS */
    uint64_t ended, done;               /* the last part that is */
} trip_gl_queue;

/* Whether a part can be ended without waiting: 1, or 0: not yet; negative: failed (reported). */
int trip_gl_queue_has_room(trip_gl_queue *q);
/* Ends a part: all commands since the part before. Waits where the queue had no room; fails
 * (reported) when the frame is cancelled, after which trip_gl_queue_leave() follows. */
int trip_gl_queue_end_part(trip_gl_queue *q);
/* 1: the part is done, as is part 0; 0: not yet, never where `wait` is set; negative: failed, or
 * cancelled while waiting (reported). */
int trip_gl_queue_is_done(trip_gl_queue *q, uint64_t part, bool wait);
/* Waits until one more part is done, at most so long. */
void trip_gl_queue_await(trip_gl_queue *q, uint64_t timeout_ns);
/* The frame is over or given up: the last part ends behind all commands so far. Waits for nothing.
 */
void trip_gl_queue_leave(trip_gl_queue *q);
/* Waits until the GPU is done with all commands, those of no part included, cancelled or not. */
void trip_gl_queue_drain(trip_gl_queue *q);

#endif
