/* Lays out several arrays in one piece of memory. */
#ifndef TRIP_CPU_LAYOUT_H
#define TRIP_CPU_LAYOUT_H

#include <stddef.h>

/* Returns the next array, at offset *at of `memory`, and moves *at behind it. The size is rounded
 * up to 64 bytes, so that each array is aligned for vectors. If `memory` is NULL, returns NULL and
 * only counts bytes. */
static inline void *trip_cpu_take_array(char *memory, size_t *at, size_t bytes)
{
    void *array = memory ? memory + *at : NULL;
    *at += (bytes + 63) & ~(size_t)63;
    return array;
}

#endif
