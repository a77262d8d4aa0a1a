/* GL memory that what a draw needs is copied into: a few buffers, mapped for good, each reused once
 * the GPU has passed the fence behind its last draw. Owned by one renderer; made once and grown to
 * the largest batch seen. Its bytes count against the budget. */
#ifndef TRIP_GL_RING_H
#define TRIP_GL_RING_H

#include <epoxy/gl.h>
#include <stdbool.h>
#include <stddef.h>

#include "budget.h"

enum { TRIP_GL_RING_SLOTS = 3, TRIP_GL_ALIGNMENT_BYTES = 256 };

typedef struct trip_gl_slot {
    GLuint buffer;
    size_t bytes;
    unsigned char *memory; /* mapped */
    GLsync fence;          /* NULL: not in use */
} trip_gl_slot;

typedef struct trip_gl_ring {
    trip_budget *budget;
    trip_gl_slot slots[TRIP_GL_RING_SLOTS];
    unsigned next;
} trip_gl_ring;

/* Makes a slot, for writing only or to be read back too; false where it does not fit the budget or
 * the driver's memory, which is not reported. `slot` is zeroed. */
bool trip_gl_slot_make(trip_gl_slot *slot, size_t bytes, bool readable, trip_budget *budget);
void trip_gl_slot_release(trip_gl_slot *slot, trip_budget *budget);
/* After the last draw from the slot. */
void trip_gl_slot_fence(trip_gl_slot *slot);
/* 1: the GPU has done with the slot; 0: not yet, only when not told to wait; negative: failed. */
int trip_gl_slot_is_done(trip_gl_slot *slot, bool wait);
/* Until the GPU has done all that it was given; fails (reported) when the program is interrupted
 * meanwhile, as does waiting for a slot. */
int trip_gl_await(void);

/* The next slot with room for `bytes`, waiting until the GPU has done with it. */
int trip_gl_ring_take(trip_gl_ring *r, size_t bytes, trip_gl_slot **slot);
void trip_gl_ring_release(trip_gl_ring *r);

/* The offset of the next aligned part behind a part of `bytes` at `offset`. */
static inline size_t trip_gl_ring_after(size_t offset, size_t bytes)
{
    size_t end = offset + bytes + TRIP_GL_ALIGNMENT_BYTES - 1;
    return end - end % TRIP_GL_ALIGNMENT_BYTES;
}

#endif
