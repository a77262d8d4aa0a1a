#include "segments.h"

#include <math.h>

enum { CODES = TRIP_SEGMENT_CODES };

/* Extinction and its products at a place between two codes. */
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

/* Adds what lies from t0 to t1 between code i and the next, which is `length` long in `v`, where it
 * begins at `v`. Simpson's rule is exact for polynomials of degree two. */
static void add_part(trip_segment_sums *sums, const trip_tf_entry *table, int i, double t0,
                     double t1, double v, double length)
{
    const sample s[3] = { sample_at(&table[i], t0), sample_at(&table[i], 0.5 * (t0 + t1)),
                          sample_at(&table[i], t1) };
    const double weights[3] = { length / 6, 4 * length / 6, length / 6 };
    for (int n = 0; n < 3; n++) {
        sums->k += weights[n] * s[n].k;
        sums->kv += weights[n] * s[n].k * (v + 0.5 * n * length);
        for (int c = 0; c < 3; c++)
            sums->kq[c] += weights[n] * s[n].kq[c];
    }
}

/* Adds a sum over codes, `scale` of them being 1 in v, where it begins at `v`. */
static void add_sums(trip_segment_sums *to, const trip_segment_sums *sums, double v, double scale)
{
    to->k += sums->k * scale;
    to->kv += sums->kv * scale * scale + sums->k * scale * v;
    for (int c = 0; c < 3; c++)
        to->kq[c] += sums->kq[c] * scale;
}

void trip_segments_make(trip_segments *s, const trip_tf_entry *table)
{
    s->table = table;
    for (int i = 0; i < CODES; i++) {
        s->nodes[CODES + i] = (trip_segment_sums){ 0 };
        if (i + 1 < CODES)
            add_part(&s->nodes[CODES + i], table, i, 0, 1, 0, 1);
    }
    double length = 1; /* of the nodes added */
    for (int first = CODES / 2; first > 0; first /= 2, length *= 2)
        for (int n = first; n < 2 * first; n++) {
            s->nodes[n] = (trip_segment_sums){ 0 };
            add_sums(&s->nodes[n], &s->nodes[2 * n], 0, 1);
            add_sums(&s->nodes[n], &s->nodes[2 * n + 1], length, 1);
        }
}

/* Adds codes [first, end), by blocks as large as fit. */
static void add_whole(trip_segment_sums *sums, const trip_segments *s, int first, int end, double v,
                      double scale)
{
    while (first < end) {
        int length = 1, node = CODES + first;
        while (node % 2 == 0 && first + 2 * length <= end) {
            node /= 2;
            length *= 2;
        }
        add_sums(sums, &s->nodes[node], v, scale);
        v += length * scale;
        first += length;
    }
}

static double clamp(double code)
{
    return fmin(CODES - 1, fmax(0, code));
}

/* The code that a place is behind; the last one has no next. */
static int code_before(double code)
{
    int i = (int)code;
    return i < CODES - 2 ? i : CODES - 2;
}

/* Means over [a, b], a < b, in which v goes from 0 to 1. */
static trip_segment_sums means_over(const trip_segments *s, double a, double b)
{
    trip_segment_sums sums = { 0 };
    int first = code_before(a), last = code_before(b);
    if (first == last) {
        add_part(&sums, s->table, first, a - first, b - first, 0, 1);
        return sums;
    }
    double before = (first + 1 - a) / (b - a), behind = (b - last) / (b - a);
    add_part(&sums, s->table, first, a - first, 1, 0, before);
    add_whole(&sums, s, first + 1, last, before, 1 / (b - a));
    add_part(&sums, s->table, last, 0, b - last, 1 - behind, behind);
    return sums;
}

static trip_segment at_code(const trip_segments *s, double code)
{
    int i = code_before(code);
    sample at = sample_at(&s->table[i], code - i);
    trip_segment segment = { .extinction = at.k, .where = 0.5 };
    for (int c = 0; c < 3 && at.k > 0; c++)
        segment.rgb[c] = at.kq[c] / at.k;
    return segment;
}

trip_segment trip_segment_of(const trip_segments *s, double a, double b)
{
    double from = clamp(a), to = clamp(b);
    if (from == to)
        return at_code(s, from);
    trip_segment_sums sums = means_over(s, fmin(from, to), fmax(from, to));
    trip_segment segment = { .extinction = sums.k, .where = 0.5 };
    if (!(sums.k > 0))
        return segment;
    segment.where = from < to ? sums.kv / sums.k : 1 - sums.kv / sums.k;
    for (int c = 0; c < 3; c++)
        segment.rgb[c] = sums.kq[c] / sums.k;
    return segment;
}
