#include "codes.h"

#include <math.h>
#include <stddef.h>
#include <string.h>

trip_codes trip_codes_of(const trip_file_header *h, const double *table)
{
    if (table)
        return trip_codes_from_table(table, h->code_table_entries, h->code_table_step_log2);
    return (trip_codes){ .lo = h->code_lo, .hi = h->code_hi };
}

trip_codes trip_codes_from_table(const double *table, uint32_t entries, unsigned step_log2)
{
    trip_codes c = { .table = table, .entries = entries, .step_log2 = step_log2 };
    c.lo = trip_codes_value(&c, 0);
    c.hi = trip_codes_value(&c, TRIP_CODES - 1);
    return c;
}

const char *trip_codes_fault(const double *table, uint32_t entries, unsigned step_log2)
{
    if (step_log2 > TRIP_CODE_STEP_LOG2_MAX)
        return "the step of the table of codes is too large";
    if (entries < 1 || entries > ((uint32_t)TRIP_CODES >> step_log2) + 1)
        return "the table of codes has a wrong number of entries";
    for (uint32_t i = 0; i < entries; i++)
        if (!isfinite(table[i]) || (i > 0 && table[i] < table[i - 1]))
            return "the table of codes does not ascend";
    if (!isfinite(table[entries - 1] - table[0]))
        return "the table of codes spans too much";
    return entries > 1 && table[entries - 1] <= table[0] ? "the table of codes is constant" : NULL;
}

double trip_codes_value(const trip_codes *c, double code)
{
    code = fmin(TRIP_CODES - 1, fmax(0, code));
    if (!c->table)
        return c->lo + (c->hi - c->lo) * code / (TRIP_CODES - 1);
    const double at = ldexp(code, -(int)c->step_log2);
    const uint32_t i = (uint32_t)at;
    if (i + 1 >= c->entries)
        return c->table[c->entries - 1];
    return c->table[i] + (c->table[i + 1] - c->table[i]) * (at - i);
}

/* Returns the last entry of the table below `value`, or 0. */
static uint32_t entry_below(const trip_codes *c, double value)
{
    uint32_t below = 0, end = c->entries;
    while (end - below > 1) {
        const uint32_t middle = below + (end - below) / 2;
        if (c->table[middle] < value)
            below = middle;
        else
            end = middle;
    }
    return below;
}

double trip_codes_code(const trip_codes *c, double value)
{
    if (!c->table) {
        const double range = c->hi - c->lo;
        const double code = range > 0 ? (TRIP_CODES - 1) * (value - c->lo) / range : 0;
        return fmin(TRIP_CODES - 1, fmax(0, code));
    }
    if (!(value > c->table[0]))
        return 0;
    const uint32_t i = entry_below(c, value);
    double at = i;
    if (i + 1 < c->entries)
        at += (value - c->table[i]) / (c->table[i + 1] - c->table[i]);
    return fmin(TRIP_CODES - 1, ldexp(at, (int)c->step_log2));
}

unsigned trip_codes_nearest(const trip_codes *c, double value)
{
    const double code = trip_codes_code(c, value);
    const unsigned below = (unsigned)code;
    if (below + 1 >= TRIP_CODES || below == code)
        return below;
    const double from_below = value - trip_codes_value(c, below);
    return from_below < trip_codes_value(c, below + 1) - value ? below : below + 1;
}

bool trip_codes_equal(const trip_codes *a, const trip_codes *b)
{
    if (a->lo != b->lo || a->hi != b->hi || !a->table != !b->table)
        return false;
    return !a->table || (a->entries == b->entries && a->step_log2 == b->step_log2 &&
                         !memcmp(a->table, b->table, a->entries * sizeof *a->table));
}
