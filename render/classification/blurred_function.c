#include "blurred_function.h"

#include <math.h>

enum { CODES = TRIP_SEGMENT_CODES, LAST_ROW = TRIP_BLURRED_ROWS - 1 };

/* The minimum number of entries in a row's deviation, unless every code has an entry. */
#define ENTRIES_EACH_DEVIATION 15.9

/* The maximum number of bins within TRIP_BLURRED_REACH on each side of an entry. */
enum { BINS_MAX = 2 * 16 * 4 + 2 };

/* Extinction, and extinction times red, green and blue. */
typedef struct sums {
    double of[4];
} sums;

static void add(sums *to, const sums *s, double factor)
{
    for (int c = 0; c < 4; c++)
        to->of[c] += s->of[c] * factor;
}

double trip_blurred_d_of_row(unsigned row)
{
    const double part = (row + TRIP_BLURRED_BEFORE) / (double)(LAST_ROW + TRIP_BLURRED_BEFORE);
    return row == 0 ? 0 : TRIP_DEVIATION_MAX * part * part;
}

/* Returns the row at a deviation code or before it, less than the last row. */
static unsigned row_before(double d)
{
    unsigned row = 0;
    while (row + 2 < TRIP_BLURRED_ROWS && trip_blurred_d_of_row(row + 1) <= d)
        row++;
    return row;
}

trip_blurred_function trip_blurred_function_shape(void)
{
    trip_blurred_function f = { .entries = NULL };
    uint32_t first = 0;
    for (int r = 1; r <= LAST_ROW; r++) {
        const double deviation = trip_deviation(trip_blurred_d_of_row((unsigned)r));
        unsigned log2 = 0;
        while (ldexp(1, (int)log2 + 1) <= deviation / ENTRIES_EACH_DEVIATION)
            log2++;
        f.rows[r] = (trip_blurred_row){
            .deviation = deviation, .log2 = log2, .first = first, .entries = (CODES >> log2) + 1
        };
        first += f.rows[r].entries;
    }
    return f;
}

uint32_t trip_blurred_function_entries(const trip_blurred_function *f)
{
    const trip_blurred_row *last = &f->rows[LAST_ROW];
    return last->first + last->entries;
}

static sums entry_of(const trip_tf_entry *e)
{
    const double k = e->extinction;
    return (sums){ { k, k * e->r, k * e->g, k * e->b } };
}

/* Returns the integral between two neighbouring codes. */
static sums between(const trip_tf_entry *a, const trip_tf_entry *b)
{
    return (sums){ { 0.5 * ((double)a->extinction + b->extinction),
                     trip_segment_product(a->extinction, b->extinction, a->r, b->r),
                     trip_segment_product(a->extinction, b->extinction, a->g, b->g),
                     trip_segment_product(a->extinction, b->extinction, a->b, b->b) } };
}

/* Fills up_to[c] with the integral from code 0 to code c. */
static void fill_integrals(const trip_tf_entry *table, sums *up_to)
{
    up_to[0] = (sums){ { 0 } };
    for (int c = 1; c < CODES; c++) {
        const sums step = between(&table[c - 1], &table[c]);
        up_to[c] = up_to[c - 1];
        add(&up_to[c], &step, 1);
    }
}

/* Returns the integral from code 0 to a code, which may lie beyond the table. */
static sums integral_to(const trip_tf_entry *table, const sums *up_to, int64_t code)
{
    const int64_t last = CODES - 1, within = code < 0 ? 0 : code < last ? code : last;
    const sums end = entry_of(&table[within]);
    sums s = up_to[within];
    add(&s, &end, (double)(code - within));
    return s;
}

/* Computes the weight of each bin: the integral of g over it. Bin 0 is centred at the entry. Bins
 * beyond the result have no weight. */
static int find_weights(const trip_blurred_row *row, double weights[BINS_MAX + 1])
{
    const double step = ldexp(1, (int)row->log2) / row->deviation;
    const double whole = erf(TRIP_BLURRED_REACH * sqrt(0.5));
    int n = 0;
    for (; n <= BINS_MAX && (n - 0.5) * step < TRIP_BLURRED_REACH; n++) {
        const double from = (n - 0.5) * step, to = fmin((n + 0.5) * step, TRIP_BLURRED_REACH);
        weights[n] = 0.5 * (erf(to * sqrt(0.5)) - erf(from * sqrt(0.5))) / whole;
    }
    return n - 1;
}

/* Blurs the means over bins. `bins` has `beyond` bins more on both sides. Bins of the codes that
 * are not visible are passed over, so an entry out of reach is exactly 0. */
static void blur_row(const trip_blurred_row *row, const sums *bins, int beyond,
                     const double *weights, float (*out)[4])
{
    const int count = (int)row->entries;
    int first = -beyond, last = count - 1 + beyond;
    while (first <= last && bins[first].of[0] == 0)
        first++;
    while (last >= first && bins[last].of[0] == 0)
        last--;
    for (int i = 0; i < count; i++) {
        const int from = i - beyond > first ? i - beyond : first;
        const int to = i + beyond < last ? i + beyond : last;
        sums sum = { { 0 } };
        for (int n = from; n <= to; n++)
            add(&sum, &bins[n], weights[n < i ? i - n : n - i]);
        for (int c = 0; c < 4; c++)
            out[i][c] = (float)sum.of[c];
    }
}

/* Returns the mean over a bin around a code. A bin of one code has the mean of the code. */
static sums mean_of_bin(const trip_tf_entry *table, const sums *up_to, int64_t code, int64_t width)
{
    const int64_t last = CODES - 1;
    if (width == 1)
        return entry_of(&table[code < 0 ? 0 : code < last ? code : last]);
    const sums before = integral_to(table, up_to, code - width / 2);
    sums mean = integral_to(table, up_to, code + width / 2);
    for (int c = 0; c < 4; c++)
        mean.of[c] = (mean.of[c] - before.of[c]) / (double)width;
    return mean;
}

static void make_row(const trip_blurred_row *row, const trip_tf_entry *table, const sums *up_to,
                     sums *memory, float (*out)[4])
{
    double weights[BINS_MAX + 1];
    const int beyond = find_weights(row, weights);
    const int64_t width = INT64_C(1) << row->log2;
    sums *bins = memory + beyond;
    for (int64_t i = -beyond; i < (int64_t)row->entries + beyond; i++)
        bins[i] = mean_of_bin(table, up_to, i * width, width);
    blur_row(row, bins, beyond, weights, out);
}

bool trip_blurred_function_create(trip_blurred_function *f, const trip_tf_entry *table,
                                  trip_budget *budget)
{
    *f = trip_blurred_function_shape();
    const size_t bytes = trip_blurred_function_entries(f) * sizeof *f->entries;
    const size_t bins = f->rows[1].entries + 2 * BINS_MAX;
    const size_t memory_bytes = (CODES + bins) * sizeof(sums);
    sums *up_to = trip_budget_take(budget, memory_bytes);
    f->entries = up_to ? trip_budget_take(budget, bytes) : NULL;
    if (f->entries) {
        fill_integrals(table, up_to);
        for (int r = 1; r <= LAST_ROW; r++)
            make_row(&f->rows[r], table, up_to, up_to + CODES, f->entries + f->rows[r].first);
    }
    trip_budget_release(budget, up_to, memory_bytes);
    return f->entries != NULL;
}

void trip_blurred_function_destroy(trip_blurred_function *f, trip_budget *budget)
{
    trip_budget_release(budget, f->entries, trip_blurred_function_entries(f) * sizeof *f->entries);
    f->entries = NULL;
}

/* Two entries may lie beyond the reach of g, since bins and lines between entries widen it. Room
 * for the rounding of codes is two more. */
double trip_blurred_reach_of_row(unsigned row)
{
    const double deviation = trip_deviation(trip_blurred_d_of_row(row));
    return row == 0 ? 0 : deviation * (TRIP_BLURRED_REACH + 4 / ENTRIES_EACH_DEVIATION) + 2;
}

double trip_blurred_reach(unsigned d)
{
    return trip_blurred_reach_of_row(d == 0 ? 0 : row_before(d) + 1);
}

/* ---- segments ---- */

static sums row_at(const float (*entries)[4], double at)
{
    const int i = (int)at;
    sums s;
    for (int c = 0; c < 4; c++)
        s.of[c] = entries[i][c] + (at - i) * ((double)entries[i + 1][c] - entries[i][c]);
    return s;
}

/* Adds the integral of a row over a part, in entries, between two neighbouring entries. */
static void add_part(sums *to, const float (*entries)[4], double from, double end)
{
    const sums middle = row_at(entries, 0.5 * (from + end));
    for (int c = 0; c < 4; c++)
        to->of[c] += (end - from) * middle.of[c];
}

/* Returns the means of a row over the codes from `a` to `b`, a <= b. */
static sums means_of_row(const trip_blurred_function *f, int row, double a, double b)
{
    const trip_blurred_row *r = &f->rows[row];
    const float(*entries)[4] = (const float(*)[4])(f->entries + r->first);
    const double last = CODES - 1, unit = ldexp(1, -(int)r->log2);
    const double from = fmin(last, fmax(0, a)) * unit, to = fmin(last, fmax(0, b)) * unit;
    sums s = { { 0 } };
    if (!(b > a))
        return row_at(entries, from);
    for (double at = from; at < to; at = fmin(to, floor(at) + 1))
        add_part(&s, entries, at, fmin(to, floor(at) + 1));
    const double below = fmax(0, fmin(b, 0) - a), above = fmax(0, b - fmax(a, last));
    const sums first = row_at(entries, 0), end = row_at(entries, last * unit);
    for (int c = 0; c < 4; c++)
        s.of[c] = (s.of[c] / unit + below * first.of[c] + above * end.of[c]) / (b - a);
    return s;
}

static sums plain_means(const trip_segments *plain, double a, double b)
{
    const trip_segment s = trip_segment_of(plain, a, b);
    return (sums){ { s.extinction, s.extinction * s.rgb[0], s.extinction * s.rgb[1],
                     s.extinction * s.rgb[2] } };
}

trip_segment trip_blurred_segment_of(const trip_blurred_function *f, const trip_segments *plain,
                                     double a, double b, double d)
{
    const double from = fmin(a, b), to = fmax(a, b);
    const unsigned row = row_before(d);
    const double before = pow(trip_blurred_d_of_row(row), 4);
    const double share = (pow(d, 4) - before) / (pow(trip_blurred_d_of_row(row + 1), 4) - before);
    const sums low = row ? means_of_row(f, (int)row, from, to) : plain_means(plain, from, to);
    const sums high = share > 0 ? means_of_row(f, (int)row + 1, from, to) : low;
    double k[4];
    for (int c = 0; c < 4; c++)
        k[c] = (1 - share) * low.of[c] + share * high.of[c];
    trip_segment s = { .extinction = k[0] };
    for (int c = 0; c < 3 && k[0] > 0; c++)
        s.rgb[c] = k[1 + c] / k[0];
    return s;
}
