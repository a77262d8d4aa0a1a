#include "envelope.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "report.h"

/* Maximum number of intervals for sweeping a row once per interval. With more, each value is looked
 * up. */
enum { MAX_SWEPT_INTERVALS = 4 };

/* Numbers the finite floats in ascending order: -0 and +0 have rank 0, their neighbours -1 and 1.
 */
static int64_t rank_of(float f)
{
    int32_t bits;
    memcpy(&bits, &f, sizeof bits);
    return bits < 0 ? -(int64_t)(bits & 0x7fffffff) : bits;
}

static float float_of(int64_t rank)
{
    uint32_t bits = rank < 0 ? (uint32_t)-rank | 0x80000000u : (uint32_t)rank;
    float f;
    memcpy(&f, &bits, sizeof f);
    return f;
}

/* Returns the rank of the smallest float >= value, or the rank of FLT_MAX plus 1 if there is none.
 */
static int64_t rank_at_least(double value)
{
    if (value > FLT_MAX)
        return rank_of(FLT_MAX) + 1;
    if (value < -FLT_MAX)
        return rank_of(-FLT_MAX);
    int64_t rank = rank_of((float)value);
    return float_of(rank) < value ? rank + 1 : rank;
}

static int64_t rank_at_most(double value)
{
    return -rank_at_least(-value);
}

static int out_of_memory(void)
{
    return trip_fail(TRIP_ERROR, "brick", "opacity envelope", "out of memory");
}

/* Adds the ranks [lo, hi] and merges touching intervals. */
static int add_ranks(trip_envelope *e, int64_t lo, int64_t hi)
{
    size_t first = 0, past;
    if (lo > hi)
        return 0;
    while (first < e->count && rank_of(e->intervals[first].hi) < lo - 1)
        first++;
    for (past = first; past < e->count && rank_of(e->intervals[past].lo) <= hi + 1; past++) {
        int64_t from = rank_of(e->intervals[past].lo), to = rank_of(e->intervals[past].hi);
        lo = from < lo ? from : lo;
        hi = to > hi ? to : hi;
    }
    trip_interval *larger = realloc(e->intervals, (e->count + 1) * sizeof *larger);
    if (!larger)
        return out_of_memory();
    e->intervals = larger;
    memmove(larger + first + 1, larger + past, (e->count - past) * sizeof *larger);
    larger[first] = (trip_interval){ float_of(lo), float_of(hi) };
    e->count = e->count + 1 - (past - first);
    return 0;
}

int trip_envelope_add_range(trip_envelope *e, double lo, double hi)
{
    if (!(lo <= hi))
        return trip_fail(TRIP_USAGE, "brick", "opacity envelope",
                         "the range %g to %g is empty or invalid; give the lower value first", lo,
                         hi);
    return add_ranks(e, rank_at_least(lo), rank_at_most(hi));
}

int trip_envelope_add_all(trip_envelope *e)
{
    return add_ranks(e, rank_of(-FLT_MAX), rank_of(FLT_MAX));
}

static bool shows(const trip_tf *tf, int64_t rank)
{
    return trip_tf_evaluate(tf, float_of(rank)).opacity > 0;
}

/* Adds the visible ranks of [lo, hi], where opacity is monotone. Every rounding step of its
 * evaluation (subtract, divide, multiply, add) is monotone too. So the visible ranks are one
 * interval at one end, and bisection finds its border exactly. */
static int add_monotone(trip_envelope *e, const trip_tf *tf, int64_t lo, int64_t hi)
{
    if (lo > hi)
        return 0;
    bool first = shows(tf, lo), last = shows(tf, hi);
    if (first == last)
        return first ? add_ranks(e, lo, hi) : 0;
    int64_t a = lo, b = hi; /* shows(a) == first, shows(b) == last */
    while (b - a > 1) {
        int64_t middle = a + (b - a) / 2;
        if (shows(tf, middle) == first)
            a = middle;
        else
            b = middle;
    }
    return first ? add_ranks(e, lo, a) : add_ranks(e, b, hi);
}

int trip_envelope_add_tf(trip_envelope *e, const trip_tf *tf)
{
    size_t count;
    const trip_tf_point *points = trip_tf_points(tf, &count);
    int64_t from = rank_of(-FLT_MAX);
    int status = 0;
    for (size_t i = 0; i < count && status == 0; i++) {
        int64_t next = rank_at_least(points[i].value);
        status = add_monotone(e, tf, from, next - 1);
        from = next;
    }
    return status == 0 ? add_monotone(e, tf, from, rank_of(FLT_MAX)) : status;
}

void trip_envelope_destroy(trip_envelope *e)
{
    free(e->intervals);
    *e = (trip_envelope){ 0 };
}

bool trip_envelope_keeps(const trip_envelope *e, float value)
{
    size_t low = 0, high = e->count;
    while (low < high) {
        size_t middle = low + (high - low) / 2;
        if (e->intervals[middle].hi < value)
            low = middle + 1;
        else
            high = middle;
    }
    return low < e->count && e->intervals[low].lo <= value && value <= e->intervals[low].hi;
}

static void sweep(const trip_interval *interval, const float *values, size_t count, uint8_t *keep)
{
    const float lo = interval->lo, hi = interval->hi;
    for (size_t i = 0; i < count; i++)
        keep[i] |= (uint8_t)((values[i] >= lo) & (values[i] <= hi));
}

void trip_envelope_keep_row(const trip_envelope *e, const float *values, size_t count,
                            uint8_t *keep)
{
    memset(keep, 0, count);
    if (e->count <= MAX_SWEPT_INTERVALS) {
        for (size_t i = 0; i < e->count; i++)
            sweep(&e->intervals[i], values, count, keep);
        return;
    }
    for (size_t i = 0; i < count; i++)
        keep[i] = trip_envelope_keeps(e, values[i]);
}
