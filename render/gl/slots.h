/* The slots of a reader's ring, in GL memory. The reader writes into a persistently mapped buffer,
 * and batches are drawn from it without a copy. A slot is in use until the GPU has finished the
 * last part that reads it. Owned by one renderer; the context must be current. The bytes count
 * against the budget. TRIPTYCH_GL_SLOTS=copy disables the slots: batches are copied, and the
 * picture is the same. */
#ifndef TRIP_GL_SLOTS_H
#define TRIP_GL_SLOTS_H

#include "gl/ring.h"

typedef struct trip_gl_slots {
    trip_budget *budget;
    trip_gl_slot whole;
    size_t before_bytes; /* unused bytes before the first slot */
    unsigned count;
    trip_gl_slot *slots; /* each refers to the whole buffer but has its own last part */
    void *
        *memory; /* start of each slot, aligned to 4096 bytes and to the start of a storage block */
} trip_gl_slots;

/* Creates `count` slots of `bytes`, a multiple of 4096. Returns false, without a report, if they do
 * not fit or the driver has no such memory. */
bool trip_gl_slots_take(trip_gl_slots *s, unsigned count, size_t bytes);
/* Returns the slot that starts at `memory`, or NULL. */
trip_gl_slot *trip_gl_slots_find(const trip_gl_slots *s, const void *memory);
void trip_gl_slots_release(trip_gl_slots *s);

#endif
