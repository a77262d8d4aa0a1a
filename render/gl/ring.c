#include "gl/ring.h"

#include "report.h"

static const GLuint64 wait_ns = 50000000; /* between two looks whether the program is interrupted */

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
    glGetError(); /* what it recorded is told by the result */
    return false;
}

void trip_gl_slot_release(trip_gl_slot *slot, trip_budget *budget)
{
    if (slot->fence)
        glDeleteSync(slot->fence);
    if (slot->buffer) {
        glDeleteBuffers(1, &slot->buffer); /* unmaps it */
        trip_budget_discharge(budget, slot->bytes);
    }
    *slot = (trip_gl_slot){ 0 };
}

void trip_gl_slot_fence(trip_gl_slot *slot)
{
    if (slot->fence)
        glDeleteSync(slot->fence);
    slot->fence = glFenceSync(GL_SYNC_GPU_COMMANDS_COMPLETE, 0);
}

int trip_gl_slot_is_done(trip_gl_slot *slot, bool wait)
{
    GLenum result;
    if (!slot->fence)
        return 1;
    do
        result = glClientWaitSync(slot->fence, wait ? GL_SYNC_FLUSH_COMMANDS_BIT : 0,
                                  wait ? wait_ns : 0);
    while (wait && result == GL_TIMEOUT_EXPIRED && !trip_interrupted());
    if (wait && result == GL_TIMEOUT_EXPIRED)
        return trip_fail(TRIP_INTERRUPTED, "render", "frame", "interrupted");
    if (result == GL_TIMEOUT_EXPIRED)
        return 0;
    glDeleteSync(slot->fence);
    slot->fence = NULL;
    if (result == GL_WAIT_FAILED)
        return trip_fail(TRIP_ERROR, "gl", "buffer", "waiting for the GPU failed: OpenGL error %#x",
                         glGetError());
    return 1;
}

int trip_gl_await(void)
{
    trip_gl_slot nothing = { 0 };
    trip_gl_slot_fence(&nothing);
    int status = trip_gl_slot_is_done(&nothing, true);
    if (nothing.fence)
        glDeleteSync(nothing.fence);
    return status < 0 ? status : TRIP_OK;
}

static int no_room(const trip_gl_ring *r, size_t bytes)
{
    if (trip_budget_left_bytes(r->budget) < bytes)
        return trip_fail(TRIP_ERROR, "gl", "buffer",
                         "%zu bytes do not fit the memory given; raise --memory", bytes);
    return trip_fail(TRIP_ERROR, "gl", "buffer", "the driver has no %zu bytes left", bytes);
}

int trip_gl_ring_take(trip_gl_ring *r, size_t bytes, trip_gl_slot **slot)
{
    trip_gl_slot *s = &r->slots[r->next];
    int status = trip_gl_slot_is_done(s, true);
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
