#include "segments.h"

#include <math.h>
#include <stdbool.h>

enum { CODES = TRIP_SEGMENT_CODES };

/* Extinction and its products with the colour, between two codes. */
typedef struct sample {
    double k, kq[3];
} sample;

static sample sample_at(const trip_tf_entry *e, double t)
{
    double k = e[0].extinction + t * ((double)e[1].extinction - e[0].extinction);
    double r = e[0].r + t * ((double)e[1].r - e[0].r);
    double g = e[0].g + t * ((double)e[1].g - e[0].g);
    double b = e[0].b + t * ((double)e[1].b - e[0].b);
    return (sample){ k, { k * r, k * g, k * b } };
}

/* Adds the part [t0, t1] between code i and the next, scaled to `length`. Simpson's rule is exact
 * for polynomials of degree two. */
static void add_part(trip_segment_sums *sums, const trip_tf_entry *table, int i, double t0,
                     double t1, double length)
{
    const sample s[3] = { sample_at(&table[i], t0), sample_at(&table[i], 0.5 * (t0 + t1)),
                          sample_at(&table[i], t1) };
    const double weights[3] = { length / 6, 4 * length / 6, length / 6 };
    for (int n = 0; n < 3; n++) {
        sums->k += weights[n] * s[n].k;
        for (int c = 0; c < 3; c++)
            sums->kq[c] += weights[n] * s[n].kq[c];
    }
}

static void add_sums(trip_segment_sums *to, const trip_segment_sums *sums, double scale)
{
    to->k += sums->k * scale;
    for (int c = 0; c < 3; c++)
        to->kq[c] += sums->kq[c] * scale;
}

void trip_segments_make(trip_segments *s, const trip_tf_entry *table)
{
    s->table = table;
    for (int i = 0; i < CODES; i++) {
        s->nodes[CODES + i] = (trip_segment_sums){ 0 };
        if (i + 1 < CODES)
            add_part(&s->nodes[CODES + i], table, i, 0, 1, 1);
    }
    for (int n = CODES - 1; n > 0; n--) {
        s->nodes[n] = s->nodes[2 * n];
        add_sums(&s->nodes[n], &s->nodes[2 * n + 1], 1);
    }
}

/* Adds the codes [first, end) with the largest nodes that fit. */
static void add_whole(trip_segment_sums *sums, const trip_segments *s, int first, int end,
                      double scale)
{
    while (first < end) {
        int length = 1, node = CODES + first;
        while (node % 2 == 0 && first + 2 * length <= end) {
            node /= 2;
            length *= 2;
        }
        add_sums(sums, &s->nodes[node], scale);
        first += length;
    }
}

static double clamp(double code)
{
    return fmin(CODES - 1, fmax(0, code));
}

/* Returns the table entry at or below a code. For the last code it returns the one before. */
static int code_before(double code)
{
    int i = (int)code;
    return i < CODES - 2 ? i : CODES - 2;
}

/* Returns the means over [a, b], a <= b. */
static trip_segment_sums means_over(const trip_segments *s, double a, double b)
{
    trip_segment_sums sums = { 0 };
    int first = code_before(a), last = code_before(b);
    if (first == last) {
        add_part(&sums, s->table, first, a - first, b - first, 1);
        return sums;
    }
    double unit = 1 / (b - a);
    add_part(&sums, s->table, first, a - first, 1, (first + 1 - a) * unit);
    add_whole(&sums, s, first + 1, last, unit);
    add_part(&sums, s->table, last, 0, b - last, (b - last) * unit);
    return sums;
}

/* Adds the end of the table for the part of [a, b] that lies beyond it. */
static void add_beyond(trip_segment_sums *sums, const trip_tf_entry *end, double part)
{
    const sample at = { end->extinction,
                        { (double)end->extinction * end->r, (double)end->extinction * end->g,
                          (double)end->extinction * end->b } };
    sums->k += part * at.k;
    for (int c = 0; c < 3; c++)
        sums->kq[c] += part * at.kq[c];
}

/* Returns the means over [a, b], a < b, of which a part lies beyond the ends of the table. */
static trip_segment_sums means_beyond(const trip_segments *s, double a, double b)
{
    const double from = clamp(a), to = clamp(b), unit = 1 / (b - a);
    const trip_segment_sums within = means_over(s, from, to);
    trip_segment_sums sums = { 0 };
    add_sums(&sums, &within, (to - from) * unit);
    add_beyond(&sums, &s->table[0], fmax(0, fmin(b, 0) - a) * unit);
    add_beyond(&sums, &s->table[CODES - 1], fmax(0, b - fmax(a, CODES - 1)) * unit);
    return sums;
}

trip_segment trip_segment_of(const trip_segments *s, double a, double b)
{
    const double from = fmin(a, b), to = fmax(a, b);
    const bool within = from == to || (from >= 0 && to <= CODES - 1);
    trip_segment_sums means =
        within ? means_over(s, clamp(from), clamp(to)) : means_beyond(s, from, to);
    trip_segment segment = { .extinction = means.k };
    for (int c = 0; c < 3 && means.k > 0; c++)
        segment.rgb[c] = means.kq[c] / means.k;
    return segment;
}
