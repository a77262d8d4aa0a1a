#include "gl/ring.h"

#include "report.h"

bool trip_gl_slot_make(trip_gl_slot *slot, size_t bytes, bool readable, trip_budget *budget)
{
    GLbitfield access = GL_MAP_WRITE_BIT | GL_MAP_PERSISTENT_BIT | GL_MAP_COHERENT_BIT;
    access |= readable ? GL_MAP_READ_BIT : 0;
    if (!trip_budget_charge(budget, bytes))
        return false;
    slot->bytes = bytes;
    glCreateBuffers(1, &slot->buffer);
    glNamedBufferStorage(slot->buffer, (GLsizeiptr)bytes, NULL,
                         access | (readable ? GL_CLIENT_STORAGE_BIT : 0));
    slot->memory = glMapNamedBufferRange(slot->buffer, 0, (GLsizeiptr)bytes, access);
    if (slot->memory)
        return true;
    trip_gl_slot_release(slot, budget);
    glGetError(); /* clears the error; the result reports it */
    return false;
}

void trip_gl_slot_release(trip_gl_slot *slot, trip_budget *budget)
{
    if (slot->buffer) {
        glDeleteBuffers(1, &slot->buffer); /* also unmaps it */
        trip_budget_discharge(budget, slot->bytes);
    }
    *slot = (trip_gl_slot){ 0 };
}

static int no_room(const trip_gl_ring *r, size_t bytes)
{
    if (trip_budget_left_bytes(r->budget) < bytes)
        return trip_fail(TRIP_ERROR, "gl", "buffer",
                         "%zu bytes do not fit the memory given; raise --memory", bytes);
    return trip_fail(TRIP_ERROR, "gl", "buffer", "the driver has no %zu bytes left", bytes);
}

int trip_gl_ring_is_free(const trip_gl_ring *r)
{
    return trip_gl_queue_is_done(r->queue, r->slots[r->next].part, false);
}

void trip_gl_ring_leave(trip_gl_ring *r)
{
    for (int i = 0; i < TRIP_GL_RING_SLOTS; i++)
        r->slots[i].part = r->queue->ended;
}

int trip_gl_ring_take(trip_gl_ring *r, size_t bytes, trip_gl_slot **slot)
{
    trip_gl_slot *s = &r->slots[r->next];
    int status = trip_gl_queue_is_done(r->queue, s->part, true);
    if (status < 0)
        return status;
    if (s->bytes < bytes) {
        trip_gl_slot_release(s, r->budget);
        if (!trip_gl_slot_make(s, bytes, false, r->budget))
            return no_room(r, bytes);
    }
    r->next = (r->next + 1) % TRIP_GL_RING_SLOTS;
    *slot = s;
    return TRIP_OK;
}

void trip_gl_ring_release(trip_gl_ring *r)
{
    for (int i = 0; i < TRIP_GL_RING_SLOTS; i++)
        trip_gl_slot_release(&r->slots[i], r->budget);
}
