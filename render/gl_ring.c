#include "gl_ring.h"

#include "report.h"

static const GLuint64 wait_ns = 1000000000;

static int wait_for(trip_gl_slot *slot)
{
    GLenum result = GL_ALREADY_SIGNALED;
    if (!slot->fence)
        return TRIP_OK;
    do
        result = glClientWaitSync(slot->fence, GL_SYNC_FLUSH_COMMANDS_BIT, wait_ns);
    while (result == GL_TIMEOUT_EXPIRED);
    glDeleteSync(slot->fence);
    slot->fence = NULL;
    if (result == GL_WAIT_FAILED)
        return trip_fail(TRIP_ERROR, "gl", "buffer", "waiting for the GPU failed: OpenGL error %#x",
                         glGetError());
    return TRIP_OK;
}

static void empty(trip_gl_ring *r, trip_gl_slot *slot)
{
    if (slot->fence)
        glDeleteSync(slot->fence);
    if (slot->buffer) {
        glDeleteBuffers(1, &slot->buffer); /* unmaps it */
        trip_budget_discharge(r->budget, slot->bytes);
    }
    *slot = (trip_gl_slot){ 0 };
}

static int fill(trip_gl_ring *r, trip_gl_slot *slot, size_t bytes)
{
    const GLbitfield access = GL_MAP_WRITE_BIT | GL_MAP_PERSISTENT_BIT | GL_MAP_COHERENT_BIT;
    if (!trip_budget_charge(r->budget, bytes))
        return trip_fail(TRIP_ERROR, "gl", "buffer",
                         "%zu bytes do not fit the memory given; raise --memory", bytes);
    slot->bytes = bytes;
    glCreateBuffers(1, &slot->buffer);
    glNamedBufferStorage(slot->buffer, (GLsizeiptr)bytes, NULL, access);
    slot->memory = glMapNamedBufferRange(slot->buffer, 0, (GLsizeiptr)bytes, access);
    if (slot->memory)
        return TRIP_OK;
    empty(r, slot);
    return trip_fail(TRIP_ERROR, "gl", "buffer",
                     "the driver has no %zu bytes left: OpenGL error %#x", bytes, glGetError());
}

int trip_gl_ring_take(trip_gl_ring *r, size_t bytes, trip_gl_slot **slot)
{
    trip_gl_slot *s = &r->slots[r->next];
    int status = wait_for(s);
    if (!status && s->bytes < bytes) {
        empty(r, s);
        status = fill(r, s, bytes);
    }
    if (status)
        return status;
    r->next = (r->next + 1) % TRIP_GL_RING_SLOTS;
    *slot = s;
    return TRIP_OK;
}

void trip_gl_ring_give(trip_gl_slot *slot)
{
    slot->fence = glFenceSync(GL_SYNC_GPU_COMMANDS_COMPLETE, 0);
}

void trip_gl_ring_release(trip_gl_ring *r)
{
    for (int i = 0; i < TRIP_GL_RING_SLOTS; i++)
        empty(r, &r->slots[i]);
}
