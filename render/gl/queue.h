/* Splits the GPU's work into parts with a fence after each. At most TRIP_GL_QUEUE_PARTS
 * parts are in progress, so a picture waits only briefly. When a frame is cancelled, its parts in
 * progress finish by themselves. Owned by one renderer; the context must be current. */
#ifndef TRIP_GL_QUEUE_H
#define TRIP_GL_QUEUE_H

#include <epoxy/gl.h>
#include <stdbool.h>
#include <stdint.h>

enum { TRIP_GL_QUEUE_PARTS = 4 };

/* Parts are numbered from 1 and finish in this order. */
typedef struct trip_gl_queue {
    GLsync fences[TRIP_GL_QUEUE_PARTS]; /* the fence of part n is at n % TRIP_GL_QUEUE_PARTS */
    uint64_t ended, done; /* number of the last part submitted, and of the last one finished */
} trip_gl_queue;

/* Returns 1 if a part can end without waiting, 0 if not yet, or a negative failure (reported). */
int trip_gl_queue_has_room(trip_gl_queue *q);
/* Ends a part: all commands since the previous part. Waits if the queue is full. Fails (reported)
 * if the frame is cancelled; then call trip_gl_queue_leave(). */
int trip_gl_queue_end_part(trip_gl_queue *q);
/* Returns 1 if the part is finished; part 0 always is. Returns 0 if it is not finished and `wait`
 * is false. Returns a negative number if the wait failed or the frame was cancelled (reported). */
int trip_gl_queue_is_done(trip_gl_queue *q, uint64_t part, bool wait);
/* Waits until one more part is finished, for at most `timeout_ns`. */
void trip_gl_queue_await(trip_gl_queue *q, uint64_t timeout_ns);
/* Ends a frame, complete or cancelled, without waiting. The last part then includes all commands so
 * far. */
void trip_gl_queue_leave(trip_gl_queue *q);
/* Waits until the GPU has finished all commands, even in a cancelled frame. */
void trip_gl_queue_drain(trip_gl_queue *q);

#endif
