#include "code_set.h"

#include <math.h>
#include <string.h>

/* Returns the smallest float that is at least x. */
static float at_least(double min)
{
    float nearest = (float)min;
    return (double)nearest < min ? nextafterf(nearest, INFINITY) : nearest;
}

/* Returns a bit for each of 64 entries. A product packs eight bytes of 0 or 1 into one without
 * carries, so that the compiler can vectorise the comparisons. */
static uint64_t with_extinction(const trip_tf_entry entries[64], float min)
{
    unsigned char is_in[64];
    uint64_t bits = 0, eight;
    for (int i = 0; i < 64; i++)
        is_in[i] = entries[i].extinction >= min;
    for (int i = 0; i < 64; i += 8) {
        memcpy(&eight, is_in + i, sizeof eight);
        bits |= (eight * UINT64_C(0x0102040810204080) >> 56) << i;
    }
    return bits;
}

void trip_code_set_make(trip_code_set *set, const trip_tf_entry *table, double min)
{
    const float limit = at_least(min);
    memset(set->some, 0, sizeof set->some);
    for (unsigned word = 0; word < 1024; word++) {
        set->codes[word] = with_extinction(table + word * 64, limit);
        set->some[word / 64] |= (uint64_t)(set->codes[word] != 0) << word % 64;
    }
}

void trip_code_set_keep(trip_code_set *set, trip_code_range range)
{
    for (unsigned word = 0; word < 1024; word++) {
        const unsigned first = word * 64;
        uint64_t kept = set->codes[word];
        if (first + 63 < range.min || first > range.max)
            kept = 0;
        if (kept && first < range.min)
            kept &= UINT64_MAX << (range.min - first);
        if (kept && first + 63 > range.max)
            kept &= UINT64_MAX >> (first + 63 - range.max);
        if (!kept)
            set->some[word / 64] &= ~(UINT64_C(1) << word % 64);
        set->codes[word] = kept;
    }
}

trip_code_range trip_code_set_range(const trip_code_set *set)
{
    unsigned min = 1, max = 0, count = 0;
    for (unsigned word = 0; word < 1024; word++) {
        const uint64_t bits = set->codes[word];
        if (bits && count == 0)
            min = word * 64 + (unsigned)__builtin_ctzll(bits);
        if (bits)
            max = word * 64 + 63 - (unsigned)__builtin_clzll(bits);
        count += (unsigned)__builtin_popcountll(bits);
    }
    return count > 0 && max - min + 1 == count ? (trip_code_range){ (uint16_t)min, (uint16_t)max }
                                               : (trip_code_range){ 1, 0 };
}

/* Returns whether any bit from first to last is set. */
static bool has_some(const uint64_t *bits, unsigned first, unsigned last)
{
    for (unsigned word = first / 64; word <= last / 64; word++) {
        uint64_t here = bits[word];
        if (word == first / 64)
            here &= UINT64_MAX << first % 64;
        if (word == last / 64)
            here &= UINT64_MAX >> (63 - last % 64);
        if (here)
            return true;
    }
    return false;
}

bool trip_code_set_has_some(const trip_code_set *set, unsigned first, unsigned last)
{
    const unsigned from = first / 64, to = last / 64;
    if (first > last)
        return false;
    if (to - from < 2)
        return has_some(set->codes, first, last);
    return has_some(set->codes, first, from * 64 + 63) || has_some(set->codes, to * 64, last) ||
           has_some(set->some, from + 1, to - 1);
}
