#include "key_sort.h"

enum { FEW = 24 };

static void sort_few(trip_key *keys, size_t count)
{
    for (size_t i = 1; i < count; i++) {
        const trip_key k = keys[i];
        size_t to = i;
        for (; to && keys[to - 1].key > k.key; to--)
            keys[to] = keys[to - 1];
        keys[to] = k;
    }
}

static void sort_byte(const trip_key *from, trip_key *to, size_t count, unsigned shift)
{
    size_t first[256] = { 0 }, sum = 0;
    for (size_t i = 0; i < count; i++)
        first[from[i].key >> shift & 255]++;
    for (int d = 0; d < 256; d++) {
        const size_t n = first[d];
        first[d] = sum;
        sum += n;
    }
    for (size_t i = 0; i < count; i++)
        to[first[from[i].key >> shift & 255]++] = from[i];
}

void trip_key_sort(trip_key *keys, trip_key *scratch, size_t count)
{
    uint64_t differ = 0;
    trip_key *from = keys, *to = scratch;
    if (count <= FEW) {
        sort_few(keys, count);
        return;
    }
    for (size_t i = 1; i < count; i++)
        differ |= keys[i].key ^ keys[0].key;
    for (unsigned shift = 0; shift < 64; shift += 8) {
        if (!(differ >> shift & 255))
            continue;
        sort_byte(from, to, count, shift);
        trip_key *other = from;
        from = to;
        to = other;
    }
    if (from != keys)
        memcpy(keys, from, count * sizeof *keys);
}
