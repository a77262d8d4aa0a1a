/* Arrays that lie one behind the other in one piece of memory. */
#ifndef TRIP_CPU_LAYOUT_H
#define TRIP_CPU_LAYOUT_H

#include <stddef.h>

/* The next array, aligned for vectors; *at goes on behind it. NULL where `memory` is, which counts
 * the bytes alone. */
static inline void *trip_cpu_take_array(char *memory, size_t *at, size_t bytes)
{
    void *array = memory ? memory + *at : NULL;
    *at += (bytes + 63) & ~(size_t)63;
    return array;
}

#endif
