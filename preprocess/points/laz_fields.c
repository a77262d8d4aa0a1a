#include "laz_fields.h"

#include <string.h>

void trip_laz_median_add(trip_laz_median *m, int32_t value)
{
    int32_t *v = m->values;
    const int32_t before = v[2];
    int at;
    if (m->low_leaves) {
        for (at = 0; at < 4 && v[at + 1] < value; at++)
            v[at] = v[at + 1];
        m->low_leaves = before < value;
    } else {
        for (at = 4; at > 0 && v[at - 1] > value; at--)
            v[at] = v[at - 1];
        m->low_leaves = value >= before;
    }
    v[at] = value;
}

/* ---- times ---- */

enum {
    MULTIPLE_MOST = 500, /* multiples of the difference before that have a symbol */
    MULTIPLE_LEAST = -10,
    EXTREMES = 3, /* after more, the difference is replaced */
    TIME_BITS = 32,
    FULL_CONTEXT = 8,
};

void trip_laz_times_begin(trip_laz_times *t, uint64_t first)
{
    memset(t->last, 0, sizeof t->last);
    memset(t->difference, 0, sizeof t->difference);
    memset(t->extremes, 0, sizeof t->extremes);
    t->current = t->newest = 0;
    t->last[0] = first;
}

static int32_t corrected(trip_laz_times *t, trip_laz_decoder *d, int64_t prediction,
                         unsigned context)
{
    return trip_laz_integer(d, &t->differences, TIME_BITS, (int32_t)(uint32_t)(uint64_t)prediction,
                            context);
}

static void step(trip_laz_times *t, int32_t difference)
{
    t->last[t->current] += (uint64_t)(int64_t)difference;
}

/* Begins a sequence with a whole time. */
static void start_sequence(trip_laz_times *t, trip_laz_decoder *d)
{
    const uint32_t before = (uint32_t)(t->last[t->current] >> 32);
    const uint32_t high = (uint32_t)corrected(t, d, (int32_t)before, FULL_CONTEXT);
    t->newest = (t->newest + 1) % 4;
    t->last[t->newest] = (uint64_t)high << 32 | trip_laz_raw_bits(d, 32);
    t->current = t->newest;
    t->difference[t->current] = 0;
    t->extremes[t->current] = 0;
}

static void note_extreme(trip_laz_times *t, int32_t difference)
{
    if (++t->extremes[t->current] <= EXTREMES)
        return;
    t->difference[t->current] = difference;
    t->extremes[t->current] = 0;
}

/* Applies a multiple of the difference before. */
static void step_multiple(trip_laz_times *t, trip_laz_decoder *d, unsigned symbol)
{
    const int64_t before = t->difference[t->current];
    if (symbol == 1) {
        step(t, corrected(t, d, before, 1));
        t->extremes[t->current] = 0;
        return;
    }
    const int multiple = symbol <= MULTIPLE_MOST ? (int)symbol : MULTIPLE_MOST - (int)symbol;
    const bool extreme = multiple == 0 || multiple == MULTIPLE_MOST || multiple == MULTIPLE_LEAST;
    const unsigned context = multiple == 0               ? 7
                             : multiple == MULTIPLE_MOST ? 4
                             : multiple >= 10            ? 3
                             : multiple > 0              ? 2
                             : multiple > MULTIPLE_LEAST ? 5
                                                         : 6;
    const int32_t difference = corrected(t, d, multiple * before, context);
    step(t, difference);
    if (extreme)
        note_extreme(t, difference);
}

uint64_t trip_laz_times_next(trip_laz_times *t, trip_laz_decoder *d, bool layered)
{
    const unsigned equal = layered ? 0 : 1;
    const unsigned full = MULTIPLE_MOST - MULTIPLE_LEAST + 1 + equal;
    /* Each change of the sequence takes bits, so the loop ends with the bytes of the file. */
    while (trip_laz_sound(d)) {
        if (t->difference[t->current] == 0) {
            const unsigned symbol = trip_laz_symbol(d, &t->first_multiples, 5 + equal);
            if (symbol < equal)
                break;
            if (symbol == equal) {
                const int32_t difference = corrected(t, d, 0, 0);
                t->difference[t->current] = difference;
                t->extremes[t->current] = 0;
                step(t, difference);
                break;
            }
            if (symbol == 1 + equal) {
                start_sequence(t, d);
                break;
            }
            t->current = (t->current + symbol - 1 - equal) % 4;
        } else {
            const unsigned symbol = trip_laz_symbol(d, &t->multiples, full + 4);
            if (symbol < full - equal) {
                step_multiple(t, d, symbol);
                break;
            }
            if (symbol == full) {
                start_sequence(t, d);
                break;
            }
            if (symbol < full)
                break; /* an equal time */
            t->current = (t->current + symbol - full) % 4;
        }
    }
    return t->last[t->current];
}

/* ---- colours ---- */

static int clamped(int v)
{
    return v < 0 ? 0 : v > 255 ? 255 : v;
}

void trip_laz_colours_next(trip_laz_colours *c, trip_laz_decoder *d, uint16_t rgb[3])
{
    enum { GREY_BIT = 6 };
    const unsigned changed = trip_laz_symbol(d, &c->changed, 128);
    int now[3][2], before[3][2]; /* the low and the high byte of each channel */
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 2; k++)
            now[i][k] = before[i][k] = rgb[i] >> 8 * k & 255;
    for (int k = 0; k < 2; k++)
        if (changed >> k & 1)
            now[0][k] = (before[0][k] + (int)trip_laz_symbol(d, &c->bytes[k], 256)) & 255;
    for (int k = 0; k < 2; k++) {
        int shift = now[0][k] - before[0][k]; /* that the other channels are expected to share */
        if (!(changed >> GREY_BIT & 1)) {
            now[1][k] = now[2][k] = now[0][k];
            continue;
        }
        if (changed >> (2 + k) & 1)
            now[1][k] =
                ((int)trip_laz_symbol(d, &c->bytes[2 + k], 256) + clamped(shift + before[1][k])) &
                255;
        if (changed >> (4 + k) & 1) {
            shift = (shift + now[1][k] - before[1][k]) / 2;
            now[2][k] =
                ((int)trip_laz_symbol(d, &c->bytes[4 + k], 256) + clamped(shift + before[2][k])) &
                255;
        }
    }
    for (int i = 0; i < 3; i++)
        rgb[i] = (uint16_t)(now[i][0] | now[i][1] << 8);
}
