#include "value_sample.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { RANK_MAX = 63 };

/* An explicit vector of four, because compilers do not vectorise such loops. */
typedef float four_floats __attribute__((vector_size(16)));
typedef int32_t four_ints __attribute__((vector_size(16)));

static uint64_t hash(int64_t y, int64_t z)
{
    uint64_t h =
        (uint64_t)y * UINT64_C(0x9e3779b97f4a7c15) ^ (uint64_t)z * UINT64_C(0xc2b2ae3d27d4eb4f);
    h = (h ^ h >> 32) * UINT64_C(0xd6e8feb86659fd93);
    return h ^ h >> 32;
}

static unsigned rank_of(uint64_t place)
{
    return place ? (unsigned)__builtin_ctzll(place) : RANK_MAX;
}

/* Drops the values of the lowest rank until there is room for one more. */
static void make_room(trip_value_sample *s)
{
    while (s->count == TRIP_SAMPLE_MAX && s->log2 < RANK_MAX) {
        uint32_t kept = 0;
        s->log2++;
        for (uint32_t i = 0; i < s->count; i++) {
            s->values[kept] = s->values[i];
            s->ranks[kept] = s->ranks[i];
            kept += s->ranks[i] >= s->log2;
        }
        s->count = kept;
    }
}

static void take(trip_value_sample *s, float value, unsigned rank)
{
    make_room(s);
    if (rank < s->log2 || s->count == TRIP_SAMPLE_MAX)
        return;
    s->values[s->count] = value;
    s->ranks[s->count++] = (uint8_t)rank;
}

/* Puts a value into a heap of extremes. The heap's first value leaves first. Sign 1 keeps the
 * least values, sign -1 the greatest. */
static void put(float *heap, uint32_t *count, float value, float sign)
{
    uint32_t at;
    if (*count < TRIP_EXTREMES) {
        for (at = (*count)++; at > 0 && sign * heap[(at - 1) / 2] < sign * value; at = (at - 1) / 2)
            heap[at] = heap[(at - 1) / 2];
        heap[at] = value;
        return;
    }
    if (sign * value >= sign * heap[0])
        return;
    for (at = 0;;) {
        uint32_t next = 2 * at + 1;
        if (next + 1 < *count && sign * heap[next + 1] > sign * heap[next])
            next++;
        if (next >= *count || sign * heap[next] <= sign * value)
            break;
        heap[at] = heap[next];
        at = next;
    }
    heap[at] = value;
}

static void put_extremes(trip_value_sample *s, float value)
{
    put(s->least, &s->least_count, value, 1);
    put(s->greatest, &s->greatest_count, value, -1);
}

/* Whether the row has no new extremes, as most rows. NaN is new. */
static bool is_between(const trip_value_sample *s, const float *values, size_t count)
{
    const float lo = s->least[0], hi = s->greatest[0];
    four_ints all = { -1, -1, -1, -1 };
    bool rest = true;
    size_t i = 0;
    if (s->least_count < TRIP_EXTREMES)
        return false;
    for (; i + 4 <= count; i += 4) {
        four_floats v;
        memcpy(&v, values + i, sizeof v);
        all &= (v >= lo) & (v <= hi);
    }
    for (; i < count; i++)
        rest &= (values[i] >= lo) & (values[i] <= hi);
    return rest & (all[0] & all[1] & all[2] & all[3]);
}

void trip_value_sample_add_row(trip_value_sample *s, const float *values, const uint8_t *active,
                               size_t count, const int64_t at[3])
{
    const uint64_t place = (uint64_t)at[0] + hash(at[1], at[2]);
    if (!is_between(s, values, count))
        for (size_t i = 0; i < count; i++)
            if (isfinite(values[i]) && (!active || active[i]))
                put_extremes(s, values[i] + 0.0f); /* turns -0 into 0 */
    const uint64_t before = s->log2;
    for (uint64_t i = -place & ((UINT64_C(1) << before) - 1); i < count; i += UINT64_C(1) << before)
        if (isfinite(values[i]) && (!active || active[i]))
            take(s, values[i] + 0.0f, rank_of(place + i));
}

void trip_value_sample_add(trip_value_sample *s, const trip_value_sample *other)
{
    for (uint32_t i = 0; i < other->least_count; i++)
        put(s->least, &s->least_count, other->least[i], 1);
    for (uint32_t i = 0; i < other->greatest_count; i++)
        put(s->greatest, &s->greatest_count, other->greatest[i], -1);
    while (s->log2 < other->log2) {
        const uint32_t all = s->count;
        s->log2++;
        s->count = 0;
        for (uint32_t i = 0; i < all; i++)
            if (s->ranks[i] >= s->log2) {
                s->values[s->count] = s->values[i];
                s->ranks[s->count++] = s->ranks[i];
            }
    }
    for (uint32_t i = 0; i < other->count; i++)
        if (other->ranks[i] >= s->log2)
            take(s, other->values[i], other->ranks[i]);
}

static bool are_within(const float *values, uint32_t count, double lo, double hi)
{
    for (uint32_t i = 0; i < count; i++)
        if (!(values[i] >= lo && values[i] <= hi))
            return false;
    return true;
}

bool trip_value_sample_check(const trip_value_sample *s, uint64_t finite, double lo, double hi)
{
    const uint64_t extremes = finite < TRIP_EXTREMES ? finite : TRIP_EXTREMES;
    if (s->log2 > RANK_MAX || s->count > TRIP_SAMPLE_MAX || s->count > finite ||
        s->least_count > extremes || s->greatest_count > extremes)
        return false;
    for (uint32_t i = 0; i < s->count; i++)
        if (s->ranks[i] < s->log2 || s->ranks[i] > RANK_MAX)
            return false;
    return are_within(s->values, s->count, lo, hi) &&
           are_within(s->least, s->least_count, lo, hi) &&
           are_within(s->greatest, s->greatest_count, lo, hi);
}

static int compare(const void *a, const void *b)
{
    const float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

void trip_value_sample_sort(float *values, size_t count)
{
    qsort(values, count, sizeof *values, compare);
}

/* Copies the values that lie between the extremes. A sample of all voxels has the extremes. */
float *trip_value_sample_sorted(const trip_value_sample *s, size_t *count)
{
    float *sorted = malloc((TRIP_SAMPLE_MAX + 2 * TRIP_EXTREMES) * sizeof *sorted);
    size_t n = 0;
    *count = 0;
    if (!sorted)
        return NULL;
    for (uint32_t i = 0; i < s->count; i++)
        if (s->log2 == 0 || (s->values[i] > s->least[0] && s->values[i] < s->greatest[0]))
            sorted[n++] = s->values[i];
    for (uint32_t i = 0; s->log2 > 0 && i < s->least_count; i++)
        sorted[n++] = s->least[i];
    for (uint32_t i = 0; s->log2 > 0 && i < s->greatest_count; i++)
        sorted[n++] = s->greatest[i];
    trip_value_sample_sort(sorted, n);
    *count = n;
    return sorted;
}
