#include "key_sort.h"

#include <stdbool.h>

enum {
    FEW = 24,
    SPARE_BITS =
        4,     /* more bits than the number of keys needs, before insertions complete the order */
    MOVES = 8, /* of each key, on average, before insertions are given up */
    DIGITS = 8,
};

/* Sorts nearly sorted keys by insertions. Returns false after too many moves. The order of equal
 * keys stays. */
static bool insert_all(trip_key *keys, size_t count, size_t moves)
{
    for (size_t i = 1; i < count; i++) {
        const trip_key k = keys[i];
        size_t to = i;
        for (; to && keys[to - 1].key > k.key; to--)
            keys[to] = keys[to - 1];
        keys[to] = k;
        if (i - to > moves)
            return false;
        moves -= i - to;
    }
    return true;
}

static void sort_digit(const trip_key *from, trip_key *to, size_t count, uint64_t lo,
                       unsigned shift)
{
    size_t first[256] = { 0 }, sum = 0;
    for (size_t i = 0; i < count; i++)
        first[(from[i].key - lo) >> shift & 255]++;
    for (int d = 0; d < 256; d++) {
        const size_t n = first[d];
        first[d] = sum;
        sum += n;
    }
    for (size_t i = 0; i < count; i++)
        to[first[(from[i].key - lo) >> shift & 255]++] = from[i];
}

/* Sorts by the bits from `shift` on. */
static void sort_digits(trip_key *keys, trip_key *scratch, size_t count, uint64_t lo,
                        unsigned shift, unsigned bits)
{
    trip_key *from = keys, *to = scratch;
    for (; shift < bits; shift += DIGITS) {
        sort_digit(from, to, count, lo, shift);
        trip_key *other = from;
        from = to;
        to = other;
    }
    if (from != keys)
        memcpy(keys, from, count * sizeof *keys);
}

static unsigned bits_of(uint64_t value)
{
    return value ? 64 - (unsigned)__builtin_clzll(value) : 0;
}

void trip_key_sort(trip_key *keys, trip_key *scratch, size_t count)
{
    if (count <= FEW) {
        insert_all(keys, count, FEW * FEW);
        return;
    }
    uint64_t lo = keys[0].key, hi = lo;
    for (size_t i = 1; i < count; i++) {
        lo = keys[i].key < lo ? keys[i].key : lo;
        hi = keys[i].key > hi ? keys[i].key : hi;
    }
    const unsigned bits = bits_of(hi - lo);
    const unsigned wanted = (bits_of(count) + SPARE_BITS + DIGITS - 1) / DIGITS * DIGITS;
    const unsigned shift = bits > wanted + DIGITS ? bits - wanted : 0;
    sort_digits(keys, scratch, count, lo, shift, bits);
    if (shift && !insert_all(keys, count, MOVES * count))
        sort_digits(keys, scratch, count, lo, 0, bits);
}
