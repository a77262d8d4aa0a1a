/* GL memory that what a draw needs is copied into: a few buffers, mapped for good, each reused once
 * the last part of the GPU's work that reads it is done. Owned by one renderer; made once and grown
 * to the largest batch seen. Its bytes count against the budget. */
#ifndef TRIP_GL_RING_H
#define TRIP_GL_RING_H

#include <epoxy/gl.h>
#include <stdbool.h>
#include <stddef.h>

#include "budget.h"
#include "gl/queue.h"

enum { TRIP_GL_RING_SLOTS = 3, TRIP_GL_ALIGNMENT_BYTES = 256 };

typedef struct trip_gl_slot {
    GLuint buffer;
    size_t bytes;
    unsigned char *memory; /* mapped */
    uint64_t part;         /* of the queue: the last that reads it */
} trip_gl_slot;

typedef struct trip_gl_ring {
    trip_budget *budget;
    trip_gl_queue *queue;
    trip_gl_slot slots[TRIP_GL_RING_SLOTS];
    unsigned next;
} trip_gl_ring;

/* Makes a slot, for writing only or to be read back too; false where it does not fit the budget or
 * the driver's memory, which is not reported. `slot` is zeroed. */
bool trip_gl_slot_make(trip_gl_slot *slot, size_t bytes, bool readable, trip_budget *budget);
void trip_gl_slot_release(trip_gl_slot *slot, trip_budget *budget);

/* Whether the GPU has read what the next slot held: 1, or 0: not yet; negative: failed (reported).
 */
int trip_gl_ring_is_free(const trip_gl_ring *r);
/* Every slot is read by the queue's last part. */
void trip_gl_ring_leave(trip_gl_ring *r);
/* The next slot with room for `bytes`, waiting until the GPU has read what it held. */
int trip_gl_ring_take(trip_gl_ring *r, size_t bytes, trip_gl_slot **slot);
void trip_gl_ring_release(trip_gl_ring *r);

/* The offset of the next aligned part behind a part of `bytes` at `offset`. */
static inline size_t trip_gl_ring_after(size_t offset, size_t bytes)
{
    size_t end = offset + bytes + TRIP_GL_ALIGNMENT_BYTES - 1;
    return end - end % TRIP_GL_ALIGNMENT_BYTES;
}

#endif
