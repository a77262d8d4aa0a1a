#include "gl_slots.h"

#include <stdint.h>
#include <stdlib.h>

enum { DIRECT_ALIGNMENT_BYTES = 4096 };

/* A mapping starts where the driver likes: room to begin at a page. */
static bool make(trip_gl_slots *s, unsigned i, GLint alignment)
{
    size_t bytes = s->bytes + DIRECT_ALIGNMENT_BYTES;
    trip_gl_slot *slot = &s->slots[i];
    if (!trip_gl_slot_make(slot, bytes, true, s->budget))
        return false;
    size_t before = (size_t)(-(uintptr_t)slot->memory % DIRECT_ALIGNMENT_BYTES);
    s->memory[i] = slot->memory + before;
    return before % (size_t)alignment == 0;
}

bool trip_gl_slots_take(trip_gl_slots *s, unsigned count, size_t bytes)
{
    GLint alignment = 1;
    trip_gl_slots_release(s);
    s->slots = calloc(count, sizeof *s->slots);
    s->memory = calloc(count, sizeof *s->memory);
    s->bytes = bytes;
    glGetIntegerv(GL_SHADER_STORAGE_BUFFER_OFFSET_ALIGNMENT, &alignment);
    bool made = s->slots && s->memory;
    while (made && s->count < count)
        made = make(s, s->count++, alignment);
    if (!made)
        trip_gl_slots_release(s);
    return made;
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
    for (unsigned i = 0; i < s->count; i++)
        trip_gl_slot_release(&s->slots[i], s->budget);
    free(s->slots);
    free(s->memory);
    *s = (trip_gl_slots){ .budget = s->budget };
}
