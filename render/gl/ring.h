/* A ring of persistently mapped GL buffers. The CPU writes the data of a draw into a slot. A slot
 * is reused after the GPU has finished the last part that reads it. Owned by one renderer. It is
 * created once and grows to the largest batch so far. Its bytes count against the budget. */
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
    unsigned char *memory;
    uint64_t part; /* number of the last part in the queue that reads it */
} trip_gl_slot;

typedef struct trip_gl_ring {
    trip_budget *budget;
    trip_gl_queue *queue;
    trip_gl_slot slots[TRIP_GL_RING_SLOTS];
    unsigned next;
} trip_gl_ring;

/* Creates a slot for writing, or also for reading back. `slot` must be zeroed. Returns false,
 * without a report, if the budget or the driver has too little memory. */
bool trip_gl_slot_make(trip_gl_slot *slot, size_t bytes, bool readable, trip_budget *budget);
void trip_gl_slot_release(trip_gl_slot *slot, trip_budget *budget);

/* Returns 1 if the GPU has finished reading the next slot, 0 if not yet, or a negative failure
 * (reported). */
int trip_gl_ring_is_free(const trip_gl_ring *r);
/* Marks every slot as read by the queue's last part. */
void trip_gl_ring_leave(trip_gl_ring *r);
/* Takes the next slot, with a capacity of at least `bytes`. Waits until the GPU has finished
 * reading it. */
int trip_gl_ring_take(trip_gl_ring *r, size_t bytes, trip_gl_slot **slot);
void trip_gl_ring_release(trip_gl_ring *r);

/* Returns the next aligned offset after `bytes` bytes at `offset`. */
static inline size_t trip_gl_ring_after(size_t offset, size_t bytes)
{
    size_t end = offset + bytes + TRIP_GL_ALIGNMENT_BYTES - 1;
    return end - end % TRIP_GL_ALIGNMENT_BYTES;
}

#endif
