/* The slots of a reader's ring in GL memory: a buffer mapped for good, which reads land in and
 * batches are drawn from without a copy. A slot is in use until the
 * last part of the GPU's work that reads it is done. Owned by one renderer; needs its context
 * current. Their bytes count against the budget. TRIPTYCH_GL_SLOTS=copy does without them: batches
 * are copied, to the same picture. */
#ifndef TRIP_GL_SLOTS_H
#define TRIP_GL_SLOTS_H

#include "gl/ring.h"

typedef struct trip_gl_slots {
    trip_budget *budget;
    trip_gl_slot whole;
    size_t before_bytes; /* of it, up to the first slot */
    unsigned count;
    trip_gl_slot *slots; /* the whole, each with a last part of its own */
    void **memory; /* of each: aligned to 4096 bytes and to what a storage block's start must be */
} trip_gl_slots;

/* Slots of `bytes`, a multiple of 4096. False where they do not fit or the driver has no such
 * memory; nothing is reported. */
bool trip_gl_slots_take(trip_gl_slots *s, unsigned count, size_t bytes);
/* The slot that starts at `memory`, a batch's; NULL: it lies elsewhere. */
trip_gl_slot *trip_gl_slots_find(const trip_gl_slots *s, const void *memory);
void trip_gl_slots_release(trip_gl_slots *s);

#endif
