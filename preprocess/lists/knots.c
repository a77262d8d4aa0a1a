#include "knots.h"

#include <stdlib.h>
#include <string.h>

enum {
    FROM_KEPT = TRIP_KNOT_INTERVALS / 2,
    FROM_ALL = TRIP_KNOT_INTERVALS / 4,
    FROM_LIKELY = 36,
    FROM_RANGE = TRIP_KNOT_INTERVALS - FROM_KEPT - FROM_ALL - FROM_LIKELY - 4,
};

/* One value may fill this part of an interval. Frequent values, such as a background, would
 * otherwise take the codes of the others. */
static const double one_value = 1;

static int compare(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Adds `intervals` quantiles of sorted values. Equal values count as at most `max` values. Returns
 * the new number of knots. */
static size_t add_quantiles(double *knots, size_t n, const float *values, size_t count,
                            size_t intervals, double max, double total)
{
    double weight = 0;
    size_t next = 1;
    for (size_t i = 0, past; i < count && next < intervals; i = past) {
        for (past = i + 1; past < count && values[past] == values[i];)
            past++;
        weight += fmin(max, (double)(past - i));
        if (weight * (double)intervals < (double)next * total)
            continue;
        knots[n++] = (double)values[i];
        while (weight * (double)intervals >= (double)next * total)
            next++;
    }
    return n;
}

static double total_weight(const float *values, size_t count, double max)
{
    double weight = 0;
    for (size_t i = 0, past; i < count; i = past) {
        for (past = i + 1; past < count && values[past] == values[i];)
            past++;
        weight += fmin(max, (double)(past - i));
    }
    return weight;
}

static size_t add_values(double *knots, size_t n, const float *values, size_t count,
                         size_t intervals)
{
    if (count == 0)
        return n;
    knots[n++] = (double)values[0];
    knots[n++] = (double)values[count - 1];
    const double max = fmax(1, one_value * (double)count / (double)intervals);
    return add_quantiles(knots, n, values, count, intervals, max, total_weight(values, count, max));
}

static size_t add_even(double *knots, size_t n, double lo, double hi, size_t intervals)
{
    for (size_t i = 0; i <= intervals; i++) {
        const double t = (double)i / (double)intervals;
        knots[n++] = lo * (1 - t) + hi * t;
    }
    return n;
}

/* Sorts the knots. Drops those that lie outside or too near to the one before. Codes between two
 * knots must be different values. */
static size_t tidy(double *knots, size_t n, double lo, double hi)
{
    size_t kept = 0;
    qsort(knots, n, sizeof *knots, compare);
    for (size_t i = 0; i < n; i++) {
        const double x = knots[i];
        const double least = 1024 * (nextafter(fabs(x), INFINITY) - fabs(x));
        if (x >= lo && x <= hi && (kept == 0 || x - knots[kept - 1] > least))
            knots[kept++] = x;
    }
    return kept;
}

/* Divides the longest intervals of the likely range until there are enough. */
static size_t fill_up(double *knots, size_t n, const trip_knots_params *p)
{
    while (n < TRIP_KNOTS) {
        size_t longest = 0;
        double length = -1;
        for (size_t i = 0; i + 1 < n; i++) {
            const double lo = fmax(knots[i], p->likely_lo), hi = fmin(knots[i + 1], p->likely_hi);
            if (hi - lo > length) {
                length = hi - lo;
                longest = i;
            }
        }
        const double middle = knots[longest] + (knots[longest + 1] - knots[longest]) / 2;
        memmove(knots + longest + 2, knots + longest + 1, (n - longest - 1) * sizeof *knots);
        knots[longest + 1] = middle;
        n++;
    }
    return n;
}

void trip_knots_make(trip_knots *k, const trip_knots_params *p)
{
    double knots[TRIP_KNOTS + 8];
    size_t n = add_values(knots, 0, p->kept, p->kept_count, FROM_KEPT);
    n = add_values(knots, n, p->all, p->all_count, FROM_ALL);
    n = add_even(knots, n, p->likely_lo, p->likely_hi, FROM_LIKELY - 1);
    n = add_even(knots, n, p->lo, p->hi, FROM_RANGE - 1);
    n = tidy(knots, n, p->lo, p->hi);
    knots[n - 1] = p->hi;
    n = fill_up(knots, n, p);
    memcpy(k->values, knots, sizeof k->values);
    /* The last code is one step below the last knot. It must be hi. */
    const double before = k->values[TRIP_KNOTS - 2];
    k->values[TRIP_KNOTS - 1] = before + (p->hi - before) * 256 / 255;
    for (int i = 0; i < TRIP_KNOT_INTERVALS; i++)
        k->codes_per_value[i] = 256 / (k->values[i + 1] - k->values[i]);
}
