#include "typical.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "report.h"

/* Fraction of the values on each side that may stand far outside. */
static const double outside = 0.001;
/* A gap that ends the typical range is larger than this part of the range between the quantiles. It
 * is also this many times larger than the range of the values just before it. */
static const double gap_part = 0.25, gap_times = 8;
enum { VALUES_BEFORE = 4, FEW = 64 };

/* Values of a volume in ascending order. */
typedef struct sorted {
    float *sample, *all; /* the sample; the sample and the extremes */
    size_t samples, count;
} sorted;

static void sorted_free(sorted *v)
{
    free(v->sample);
    free(v->all);
    *v = (sorted){ 0 };
}

static int sorted_make(sorted *v, const trip_tally *t, const char *path)
{
    const trip_value_sample *s = &t->sample;
    *v = (sorted){ .samples = s->count, .sample = malloc((s->count + 1) * sizeof *v->sample) };
    v->all = trip_value_sample_sorted(s, &v->count);
    if (!v->sample || !v->all) {
        sorted_free(v);
        return trip_fail(TRIP_ERROR, "brick", path, "out of memory");
    }
    memcpy(v->sample, s->values, s->count * sizeof *v->sample);
    trip_value_sample_sort(v->sample, v->samples);
    return 0;
}

/* ---- the typical range ---- */

/* Finds the most frequent value of the sample, if it is more than a few outliers. */
static size_t find_background(const sorted *v, size_t *past)
{
    size_t first = 0, longest = 0, begin = 0;
    for (size_t i = 1; i <= v->samples; i++) {
        if (i < v->samples && v->sample[i] == v->sample[begin])
            continue;
        if (i - begin > longest) {
            longest = i - begin;
            first = begin;
        }
        begin = i;
    }
    *past = (double)longest > outside * (double)v->samples && longest > 1 ? first + longest : first;
    return first;
}

/* Returns a value by its number among the values without the background. */
static double value_at(const sorted *v, size_t number, size_t first, size_t past)
{
    return (double)v->sample[number < first ? number : number + (past - first)];
}

/* A walk along the values away from the middle: upwards (sign 1) or downwards (sign -1). */
typedef struct walk_outward {
    const sorted *values;
    const trip_tally *tally;
    int sign;
    double max_gap;
} walk_outward;

static double at(const walk_outward *w, size_t i)
{
    const sorted *v = w->values;
    return w->sign > 0 ? (double)v->all[i] : -(double)v->all[v->count - 1 - i];
}

/* Returns whether all values beyond `from` are known: the sample has all, or they are among the
 * extremes. */
static bool is_exact(const walk_outward *w, double from)
{
    const trip_value_sample *s = &w->tally->sample;
    return s->log2 == 0 ||
           (w->sign > 0 ? from >= (double)s->greatest[0] : -from <= (double)s->least[0]);
}

/* Returns where the values end below a gap in the sample, by the fine bins. They count the values
 * that the sample lacks. Returns INFINITY if no gap is too large. */
static double end_by_bins(const walk_outward *w, double from, double to)
{
    const trip_tally *t = w->tally;
    const double width = ldexp(1, t->exponent);
    double end = from;
    if (is_exact(w, from) || t->counted == 0 || width > w->max_gap / 2)
        return from;
    for (int i = 0; i < TRIP_TALLY_BINS; i++) {
        const int b = w->sign > 0 ? i : TRIP_TALLY_BINS - 1 - i;
        const double low = ldexp((double)(t->first + b), t->exponent);
        const double near = w->sign > 0 ? low : -low - width;
        if (t->counts[b] == 0 || near <= from || near >= to)
            continue;
        if (near - end > w->max_gap)
            return end;
        end = fmax(end, fmin(near + width, to));
    }
    return to - end > w->max_gap ? end : INFINITY;
}

/* Returns the range of the few distinct values before number `i`. */
static double range_before(const walk_outward *w, size_t i)
{
    const size_t last = i > 0 ? i - 1 : 0;
    unsigned distinct = 1;
    size_t n = last;
    for (; n > 0 && distinct < VALUES_BEFORE; n--)
        distinct += at(w, n - 1) < at(w, n);
    return at(w, last) - at(w, n);
}

/* Returns the end of the typical range beyond `from`. */
static double walk_until_gap(const walk_outward *w, double from)
{
    size_t i = 0;
    while (i < w->values->count && at(w, i) <= from)
        i++;
    for (; i < w->values->count; i++) {
        const double here = i > 0 ? at(w, i - 1) : from, gap = at(w, i) - here;
        if (!(gap > w->max_gap && gap > gap_times * range_before(w, i)))
            continue;
        const double end = end_by_bins(w, here, at(w, i));
        if (end < INFINITY)
            return fmax(from, end);
    }
    return i > 0 ? at(w, i - 1) : from;
}

static void find_range(const sorted *v, const trip_tally *t, double range[2])
{
    size_t past, first = find_background(v, &past), rest = v->samples - (past - first);
    range[0] = v->count ? (double)v->all[0] : INFINITY;
    range[1] = v->count ? (double)v->all[v->count - 1] : -INFINITY;
    if (rest < FEW)
        return;
    const double last = (double)(rest - 1);
    const double lo = value_at(v, (size_t)ceil(outside * last), first, past);
    const double hi = value_at(v, (size_t)floor((1 - outside) * last), first, past);
    const double background = past > first ? (double)v->sample[first] : lo;
    const double from = fmin(lo, background), to = fmax(hi, background);
    const double width = hi > lo ? hi - lo : to - from;
    if (!(width > 0))
        return;
    const walk_outward up = { v, t, 1, gap_part * width }, down = { v, t, -1, gap_part * width };
    range[1] = walk_until_gap(&up, to);
    range[0] = -walk_until_gap(&down, -from);
}

void trip_typical_set_whole(trip_tally *t)
{
    t->has_typical = 1;
    t->typical_min = t->value_min;
    t->typical_max = t->value_max;
    t->below = t->above = 0;
}

/* Counts the values outside, by the extremes or, if these are too few, by the fine bins. */
static void count_outside(trip_tally *t)
{
    const trip_value_sample *s = &t->sample;
    uint64_t below = 0, above = 0;
    for (uint32_t i = 0; i < s->least_count; i++)
        below += (double)s->least[i] < t->typical_min;
    for (uint32_t i = 0; i < s->greatest_count; i++)
        above += (double)s->greatest[i] > t->typical_max;
    uint64_t bins_below = 0, bins_above = 0;
    for (int b = 0; b < TRIP_TALLY_BINS; b++) {
        const double low = ldexp((double)(t->first + b), t->exponent);
        bins_below += low + ldexp(1, t->exponent) <= t->typical_min ? t->counts[b] : 0;
        bins_above += low > t->typical_max ? t->counts[b] : 0;
    }
    t->below = below == TRIP_EXTREMES && bins_below > below ? bins_below : below;
    t->above = above == TRIP_EXTREMES && bins_above > above ? bins_above : above;
}

int trip_typical_set(trip_tally *t, const char *path)
{
    sorted v;
    double range[2];
    int status = sorted_make(&v, t, path);
    if (status < 0)
        return status;
    find_range(&v, t, range);
    sorted_free(&v);
    trip_typical_set_whole(t);
    t->typical_min = fmin(t->value_max, fmax(t->value_min, range[0]));
    t->typical_max = fmax(t->typical_min, fmin(t->value_max, range[1]));
    count_outside(t);
    return 0;
}

/* ---- fill values ---- */

/* Values that files use for "no value". Maxima of integer types are not among them, since these
 * also come from saturation. */
static const double known[] = {
    1e20,
    -1e20,
    2e20,
    9.999e20,
    1e15,
    -1e15,
    1e30,
    -1e30,
    1e31,
    -1e31,
    -1e34,
    1e35,
    -1e35,
    1e36,
    -1e36,
    1e37,
    -1e37,
    1e38,
    -1e38,
    1.70141e38,
    1.7014118e38,
    9.96921e36, /* netCDF */
    9.9692099683868690e36,
    -3.40282306073709653e38, /* ESRI */
    -3.40282346638528860e38, /* FLT_MAX, and the same with fewer digits */
    3.40282346638528860e38,
    -3.4028235e38,
    3.4028235e38,
    -3.4e38,
    3.4e38,
    -999,
    -999.25,
    -999.9,
    -9999,
    -9999.9,
    -99999,
    -999999,
    -9999999,
    -32767,
    -32768,
    -2147483647,
    -2147483648.,
    -9223372036854775806.,
    -9223372036854775808.,
};

/* Returns the known fill value that a float stands for, scaled or not, or NaN. */
static double known_fill(float value, const trip_volume_info *info)
{
    for (size_t i = 0; i < sizeof known / sizeof *known; i++) {
        const double scaled = info->slope * known[i] + info->inter;
        if (value == (float)known[i] || value == (float)scaled)
            return value == (float)known[i] ? known[i] : scaled;
    }
    return NAN;
}

static bool is_among(const trip_fills *fills, float value)
{
    for (unsigned i = 0; i < fills->count; i++)
        if ((float)fills->values[i] == value)
            return true;
    return false;
}

static void find_candidates(const sorted *v, const trip_volume_info *info, trip_fills *out)
{
    *out = (trip_fills){ 0 };
    for (size_t i = 0; i < v->count; i++) {
        const double fill =
            i == 0 || v->all[i] != v->all[i - 1] ? known_fill(v->all[i], info) : NAN;
        if (fill == fill && out->count < TRIP_FILLS_MAX)
            out->values[out->count++] = fill;
    }
}

static size_t without(const trip_fills *fills, float *values, size_t count)
{
    size_t kept = 0;
    for (size_t i = 0; i < count; i++)
        if (!is_among(fills, values[i]))
            values[kept++] = values[i];
    return kept;
}

static double distance_to(const sorted *v, double value)
{
    double least = INFINITY;
    for (size_t i = 0; i < v->count; i++)
        least = fmin(least, fabs((double)v->all[i] - value));
    return least;
}

/* A volume of one other value has no width. Only huge values are then taken for fill values. */
static const double huge = 1e10;

int trip_typical_find_fills(const trip_tally *t, const trip_volume_info *info, trip_fills *fills,
                            const char *path)
{
    trip_fills candidates;
    double range[2];
    sorted v;
    int found = 0, status = sorted_make(&v, t, path);
    if (status < 0)
        return status;
    find_candidates(&v, info, &candidates);
    v.samples = without(&candidates, v.sample, v.samples);
    v.count = without(&candidates, v.all, v.count);
    if (v.count > 0)
        find_range(&v, t, range);
    for (unsigned i = 0; i < candidates.count && v.count > 0; i++) {
        const double fill = candidates.values[i], width = range[1] - range[0];
        const bool far = distance_to(&v, fill) > width && (width > 0 || fabs(fill) >= huge);
        if (!far || is_among(fills, (float)fill) || fills->count == TRIP_FILLS_MAX)
            continue;
        fills->values[fills->count++] = fill;
        found++;
    }
    sorted_free(&v);
    return found;
}
