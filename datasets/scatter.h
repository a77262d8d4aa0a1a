/* Numbers that look random. They depend on the arguments alone, and are the same on every machine.
 */
#ifndef TRIP_SCATTER_H
#define TRIP_SCATTER_H

#include <stdint.h>

static inline uint64_t trip_scatter_hash(uint64_t x)
{
    x = (x + 0x9e3779b97f4a7c15) * 0xbf58476d1ce4e5b9;
    x = (x ^ x >> 27) * 0x94d049bb133111eb;
    return x ^ x >> 31;
}

/* Returns a number in [0, 1) for a thing and one of its uses: 0 to 15. */
static inline double trip_scatter(uint64_t thing, unsigned use)
{
    return (double)(trip_scatter_hash(trip_scatter_hash(thing) + use) >> 11) /
           (double)(UINT64_C(1) << 53);
}

#endif
