/* A stable sort of keys with a number each. A radix sort orders the upper bits in which the keys
 * differ. Insertions complete the order, or a radix sort of all bits does if they are too many. The
 * caller gives all memory. Any thread. */
#ifndef TRIP_KEY_SORT_H
#define TRIP_KEY_SORT_H

#include <stddef.h>
#include <stdint.h>
#include <string.h>

typedef struct trip_key {
    uint64_t key;
    uint64_t number;
} trip_key;

/* Sorts by ascending key. `scratch` has room for `count` keys. */
void trip_key_sort(trip_key *keys, trip_key *scratch, size_t count);

/* Returns a key that ascends with a double. Both zeros have the same key. */
static inline uint64_t trip_key_of(double x)
{
    uint64_t bits;
    x += 0.0;
    memcpy(&bits, &x, sizeof bits);
    return bits >> 63 ? ~bits : bits | UINT64_C(1) << 63;
}

#endif
