#include "code_set.h"

#include <string.h>

void trip_code_set_make(trip_code_set *set, const trip_tf_entry *table, double least)
{
    memset(set->some, 0, sizeof set->some);
    for (unsigned word = 0; word < 1024; word++) {
        const trip_tf_entry *entries = table + word * 64;
        uint64_t bits = 0;
        for (unsigned i = 0; i < 64; i++)
            bits |= (uint64_t)((double)entries[i].extinction >= least) << i;
        set->codes[word] = bits;
        set->some[word / 64] |= (uint64_t)(bits != 0) << word % 64;
    }
}

/* Whether some bit from first to last is set. */
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
