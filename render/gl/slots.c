#include "gl/slots.h"

#include <stdint.h>
#include <stdlib.h>

enum { DIRECT_ALIGNMENT_BYTES = 4096 };

/* Creates one buffer for all slots. It is larger by one page, so that the first slot can start at a
 * page boundary. */
static bool make_whole(trip_gl_slots *s, unsigned count, size_t bytes)
{
    GLint alignment = 1;
    glGetIntegerv(GL_SHADER_STORAGE_BUFFER_OFFSET_ALIGNMENT, &alignment);
    if (!trip_gl_slot_make(&s->whole, count * bytes + DIRECT_ALIGNMENT_BYTES, true, s->budget))
        return false;
    s->before_bytes = (size_t)(-(uintptr_t)s->whole.memory % DIRECT_ALIGNMENT_BYTES);
    return s->before_bytes % (size_t)alignment == 0;
}

bool trip_gl_slots_take(trip_gl_slots *s, unsigned count, size_t bytes)
{
    trip_gl_slots_release(s);
    s->slots = calloc(count, sizeof *s->slots);
    s->memory = calloc(count, sizeof *s->memory);
    if (!s->slots || !s->memory || !make_whole(s, count, bytes)) {
        trip_gl_slots_release(s);
        return false;
    }
    s->count = count;
    for (unsigned i = 0; i < count; i++) {
        s->slots[i] = s->whole;
        s->memory[i] = s->whole.memory + s->before_bytes + i * bytes;
    }
    return true;
}

trip_gl_slot *trip_gl_slots_find(const trip_gl_slots *s, const void *memory)
{
    for (unsigned i = 0; i < s->count; i++)
        if (s->memory[i] == memory)
            return &s->slots[i];
    return NULL;
}

void trip_gl_slots_release(trip_gl_slots *s)
{
    trip_gl_slot_release(&s->whole, s->budget);
    free(s->slots);
    free(s->memory);
    *s = (trip_gl_slots){ .budget = s->budget };
}
