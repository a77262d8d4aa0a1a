#include "scan.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "report.h"

enum { SCAN_EDGE = 64, SCAN_HEIGHT = 16, SCAN_VOXELS = SCAN_EDGE * SCAN_EDGE * SCAN_HEIGHT };

void trip_tally_clear(trip_tally *t)
{
    memset(t, 0, sizeof *t);
    t->value_min = INFINITY;
    t->value_max = -INFINITY;
}

/* Explicit vectors of four, because compilers do not vectorise these loops. */
typedef float four_floats __attribute__((vector_size(16)));
typedef int32_t four_ints __attribute__((vector_size(16)));

/* Returns whether all values lie within the range so far, as in most rows. NaN lies outside. */
static bool are_known(const trip_tally *t, const float *values, size_t count)
{
    const float lo = (float)t->value_min, hi = (float)t->value_max;
    four_ints all = { -1, -1, -1, -1 };
    bool rest = true;
    size_t i = 0;
    for (; i + 4 <= count; i += 4) {
        four_floats v;
        memcpy(&v, values + i, sizeof v);
        all &= (v >= lo) & (v <= hi);
    }
    for (; i < count; i++)
        rest &= (values[i] >= lo) & (values[i] <= hi);
    return rest & (all[0] & all[1] & all[2] & all[3]);
}

void trip_tally_range(trip_tally *t, const float *values, const uint8_t *active, size_t count)
{
    if (!active && are_known(t, values, count)) {
        t->voxels += count;
        t->finite += count;
        return;
    }
    for (size_t i = 0; i < count; i++) {
        double value = values[i] + 0.0; /* turns -0 into 0 */
        if (active && !active[i])
            continue;
        t->voxels++;
        if (!isfinite(value))
            continue;
        t->finite++;
        t->value_min = value < t->value_min ? value : t->value_min;
        t->value_max = value > t->value_max ? value : t->value_max;
    }
}

/* Returns the exponent of the last bit of a float of this magnitude. Finer bins would separate
 * nothing more. */
static int last_bit(double magnitude)
{
    int e = magnitude > 0 ? ilogb(magnitude) - 23 : -149;
    return e < -149 ? -149 : e;
}

static int64_t bin_of(double value, int exponent)
{
    return (int64_t)floor(ldexp(value, -exponent));
}

/* Returns the exponent of the narrowest bins that hold the range. The exponent never falls while
 * the range grows. Bins are therefore only merged, and the final state depends on the final range
 * only. */
static int exponent_for(double lo, double hi)
{
    int e = last_bit(fmax(fabs(lo), fabs(hi)));
    int wide = hi > lo ? ilogb(hi - lo) - 15 : e;
    if (wide > e)
        e = wide;
    while (bin_of(hi, e) - bin_of(lo, e) >= TRIP_TALLY_BINS)
        e++;
    return e;
}

static void merge_bins(trip_tally *t, int exponent)
{
    int64_t first = (int64_t)floor(ldexp((double)t->first, t->exponent - exponent));
    for (int64_t b = 0; b < TRIP_TALLY_BINS; b++) {
        uint64_t n = t->counts[b];
        if (n == 0)
            continue;
        int64_t to = (int64_t)floor(ldexp((double)(t->first + b), t->exponent - exponent)) - first;
        t->counts[b] = 0;
        t->counts[to] += n; /* to <= b, so the loop does not visit these counts again */
    }
    t->first = first;
    t->exponent = exponent;
}

static void move_bins(trip_tally *t, int64_t first)
{
    int64_t by = t->first - first; /* upwards if positive */
    if (by > 0)
        memmove(t->counts + by, t->counts, (size_t)(TRIP_TALLY_BINS - by) * sizeof *t->counts);
    if (by > 0)
        memset(t->counts, 0, (size_t)by * sizeof *t->counts);
    if (by < 0)
        memmove(t->counts, t->counts - by, (size_t)(TRIP_TALLY_BINS + by) * sizeof *t->counts);
    if (by < 0)
        memset(t->counts + TRIP_TALLY_BINS + by, 0, (size_t)-by * sizeof *t->counts);
    t->first = first;
}

/* Changes the bins so that they hold the tally's range. */
static void fit(trip_tally *t)
{
    int exponent = exponent_for(t->value_min, t->value_max);
    int64_t first = bin_of(t->value_min, exponent);
    t->fit_min = t->value_min;
    t->fit_max = t->value_max;
    if (t->counted == 0) {
        t->exponent = exponent;
        t->first = first;
        return;
    }
    if (exponent != t->exponent)
        merge_bins(t, exponent);
    if (first < t->first || bin_of(t->value_max, exponent) >= t->first + TRIP_TALLY_BINS)
        move_bins(t, first);
}

static bool is_fitted(const trip_tally *t)
{
    return t->counted > 0 && t->fit_min == t->value_min && t->fit_max == t->value_max;
}

/* Computes the bins of finite values, relative to the first bin. Scaling by a power of two is
 * exact, and the results are below 2^24 (see last_bit()). `count` must be a multiple of 4. */
static void find_bins(const trip_tally *t, const float *values, size_t count, int32_t *bins)
{
    const float per_value = ldexpf(1, -t->exponent);
    const int32_t first = (int32_t)t->first;
    for (size_t i = 0; i < count; i += 4) {
        four_floats v;
        memcpy(&v, values + i, sizeof v);
        four_floats scaled = v * per_value;
        four_ints at = __builtin_convertvector(scaled, four_ints);
        at += (scaled < __builtin_convertvector(at, four_floats)) - first; /* true is -1 */
        memcpy(bins + i, &at, sizeof at);
    }
}

/* Counts equal neighbours together, since additions to one bin wait for each other. `count` must be
 * a multiple of 4. */
static void add_bins(trip_tally *t, const int32_t *bins, size_t count)
{
    for (size_t i = 0; i < count; i += 4) {
        const int32_t *b = bins + i;
        if ((b[0] == b[1]) & (b[2] == b[3]) & (b[0] == b[2])) {
            t->counts[b[0]] += 4;
            continue;
        }
        for (int k = 0; k < 4; k++)
            t->counts[b[k]]++;
    }
    t->counted += count;
}

static void add_one_by_one(trip_tally *t, const float *values, const uint8_t *active, size_t count)
{
    const double per_value = ldexp(1, -t->exponent);
    for (size_t i = 0; i < count; i++) {
        if (!isfinite(values[i]) || (active && !active[i]))
            continue;
        double scaled = values[i] * per_value;
        int64_t at = (int64_t)scaled;
        at -= scaled < (double)at;
        t->counts[at - t->first]++;
        t->counted++;
    }
}

void trip_tally_count(trip_tally *t, const float *values, const uint8_t *active, size_t count)
{
    enum { CHUNK = 128 };
    int32_t bins[CHUNK];
    if (t->finite == 0)
        return;
    if (!is_fitted(t))
        fit(t);
    bool scalable = -t->exponent >= FLT_MIN_EXP && -t->exponent < FLT_MAX_EXP;
    size_t i = 0;
    if (scalable && !active && are_known(t, values, count))
        for (size_t n; i + 4 <= count; i += n) {
            n = count - i < CHUNK ? (count - i) & ~(size_t)3 : CHUNK;
            find_bins(t, values + i, n, bins);
            add_bins(t, bins, n);
        }
    add_one_by_one(t, values + i, active ? active + i : NULL, count - i);
}

void trip_tally_row(trip_tally *t, const float *values, const uint8_t *active, size_t count,
                    const int64_t at[3])
{
    trip_tally_range(t, values, active, count);
    trip_tally_count(t, values, active, count);
    trip_value_sample_add_row(&t->sample, values, active, count, at);
}

void trip_tally_add(trip_tally *t, const trip_tally *other)
{
    t->voxels += other->voxels;
    t->finite += other->finite;
    t->kept += other->kept;
    t->borders += other->borders;
    t->below += other->below;
    t->above += other->above;
    trip_value_sample_add(&t->sample, &other->sample);
    t->value_min = fmin(t->value_min, other->value_min);
    t->value_max = fmax(t->value_max, other->value_max);
    if (other->counted == 0)
        return;
    fit(t);
    for (int64_t b = 0; b < TRIP_TALLY_BINS; b++) {
        if (other->counts[b] == 0)
            continue;
        double bin = ldexp((double)(other->first + b), other->exponent - t->exponent);
        t->counts[(int64_t)floor(bin) - t->first] += other->counts[b];
    }
    t->counted += other->counted;
}

/* Checks that the bounds are ordered and fit in floats. */
static bool check_range(double lo, double hi)
{
    return fabs(lo) <= FLT_MAX && fabs(hi) <= FLT_MAX && lo <= hi && (double)(float)lo == lo &&
           (double)(float)hi == hi;
}

/* Checks that only bins within the range have counts, and that no bin is wider than the range
 * needs. Adding to a tally with a wider range then stays within its bins. */
static bool check_bins(const trip_tally *t)
{
    const int64_t max = INT64_C(1) << 26; /* see last_bit() */
    const double lo = t->has_typical ? t->typical_min : t->value_min;
    const double hi = t->has_typical ? t->typical_max : t->value_max;
    uint64_t sum = 0;
    if (!check_range(lo, hi) || t->exponent < -149 || t->first < -max || t->first > max ||
        t->exponent > exponent_for(lo, hi))
        return false;
    double first = floor(ldexp(lo, -t->exponent));
    double last = floor(ldexp(hi, -t->exponent));
    for (int64_t b = 0; b < TRIP_TALLY_BINS; b++) {
        double bin = (double)(t->first + b);
        if (t->counts[b] > 0 && (bin < first || bin > last))
            return false;
        if (__builtin_add_overflow(sum, t->counts[b], &sum))
            return false;
    }
    return sum == t->counted;
}

static bool has_range(const trip_tally *t)
{
    return check_range(t->value_min, t->value_max) &&
           (!t->has_typical || (check_range(t->typical_min, t->typical_max) &&
                                t->typical_min >= t->value_min && t->typical_max <= t->value_max));
}

bool trip_tally_check(const trip_tally *t)
{
    if (t->finite > t->voxels || t->counted > t->finite || t->kept > t->voxels ||
        t->borders > 2 * t->voxels || t->has_typical > 1 || t->below > t->finite ||
        t->above > t->finite - t->below || t->counted > t->finite - t->below - t->above)
        return false;
    if (t->finite == 0)
        return t->value_min == INFINITY && t->value_max == -INFINITY && !t->has_typical &&
               t->sample.count == 0 && trip_value_sample_check(&t->sample, 0, 0, 0);
    return has_range(t) &&
           trip_value_sample_check(&t->sample, t->finite, t->value_min, t->value_max) &&
           (t->counted == 0 || check_bins(t));
}

enum { BINS = sizeof((trip_histogram *)0)->counts / sizeof *((trip_histogram *)0)->counts };

static int to_bin(const trip_histogram *h, double value)
{
    const double range = h->value_max - h->value_min;
    const int to = range > 0 ? (int)((value - h->value_min) / range * BINS) : 0;
    return to < BINS ? to : BINS - 1;
}

/* Fills the histogram from the sample, because the fine bins also cover values far outside. The
 * sum of all counts is `inside`. */
static void count_sample(const trip_tally *t, uint64_t inside, trip_histogram *h)
{
    uint64_t counts[BINS] = { 0 }, all = 0, before = 0, given = 0;
    for (uint32_t i = 0; i < t->sample.count; i++)
        if (t->sample.values[i] >= h->value_min && t->sample.values[i] <= h->value_max) {
            counts[to_bin(h, t->sample.values[i])]++;
            all++;
        }
    for (int b = 0; b < BINS && all > 0; b++) {
        before += counts[b];
        const uint64_t to = (uint64_t)((double)inside * ((double)before / (double)all) + 0.5);
        h->counts[b] = to - given;
        given = to;
    }
    h->total = given;
}

void trip_tally_histogram(const trip_tally *t, trip_histogram *histogram)
{
    const bool typical = t->has_typical;
    memset(histogram, 0, sizeof *histogram);
    histogram->value_min = typical ? t->typical_min : t->value_min;
    histogram->value_max = typical ? t->typical_max : t->value_max;
    if (typical && t->counted + t->below + t->above > t->finite) {
        count_sample(t, t->finite - t->below - t->above, histogram);
        return;
    }
    histogram->total = t->counted;
    for (int64_t b = 0; b < TRIP_TALLY_BINS; b++) {
        if (t->counts[b] == 0)
            continue;
        /* A fine bin counts at its lower edge, which is exact for integers of up to 14 bits. */
        double value = fmax(ldexp((double)(t->first + b), t->exponent), histogram->value_min);
        histogram->counts[to_bin(histogram, value)] += t->counts[b];
    }
}

typedef struct scan {
    bool sparse;
    trip_tally *tallies; /* one for each thread */
    float *values;       /* SCAN_VOXELS for each thread */
    uint8_t *active;
    const trip_scan_params *params;
    trip_id_set *sets; /* one for each thread, or NULL */
    trip_budget *budget;
} scan;

static void count_kept(trip_tally *t, const trip_envelope *e, const float *values,
                       const uint8_t *active, size_t count)
{
    uint8_t keep[SCAN_EDGE];
    trip_envelope_keep_row(e, values, count, keep);
    for (size_t i = 0; active && i < count; i++)
        keep[i] &= active[i];
    for (size_t i = 0; i < count; i++)
        t->kept += keep[i];
    for (size_t i = 1; i < count; i++)
        t->borders += keep[i] != keep[i - 1];
    if (active) /* rows of sparse volumes end where voxels end */
        t->borders += (uint64_t)keep[0] + keep[count - 1];
}

/* Replaces the values outside of the clipping range by NaN, and counts them. */
static void clip_row(const scan *s, trip_tally *t, float *values, const uint8_t *active,
                     size_t count)
{
    const float lo = (float)s->params->clip_min, hi = (float)s->params->clip_max;
    for (size_t i = 0; i < count; i++) {
        const bool exists = isfinite(values[i]) && (!active || active[i]);
        t->below += exists && values[i] < lo;
        t->above += exists && values[i] > hi;
        if (!(values[i] >= lo && values[i] <= hi))
            values[i] = NAN;
    }
}

/* Adds the keys of a row of a dense volume to the set of ids. */
static int add_ids(const scan *s, unsigned thread, const trip_box *box, const int64_t at[3],
                   const float *values)
{
    const trip_scalar type = trip_volume_get_info(box->volume)->type;
    trip_id_set *set = &s->sets[thread];
    uint64_t keys[SCAN_EDGE];
    bool integers = true;
    if (set->other)
        return 0;
    if (type < TRIP_F16)
        trip_portion_keys(box->volume, box->portion, at, box->size[0], keys);
    size_t n = 0;
    for (int64_t i = 0; i < box->size[0] && integers; i++)
        if (isfinite(values[i]))
            keys[n++] = type < TRIP_F16 ? keys[i] : trip_id_key((double)values[i], &integers);
    set->other = !integers;
    if (integers)
        trip_id_set_add_row(
            set, keys, n, type == TRIP_U32 || type == TRIP_U64 ? 0 : UINT64_C(1) << 63, s->budget);
    return 0;
}

static void scan_row(scan *s, unsigned thread, const trip_box *box, size_t row, float *values,
                     const uint8_t *active)
{
    const trip_scan_params *p = s->params;
    trip_tally *t = &s->tallies[thread];
    const int64_t y = (int64_t)row % box->size[1], z = (int64_t)row / box->size[1];
    const int64_t at[3] = { box->lo[0], box->lo[1] + y, box->lo[2] + z };
    const size_t count = (size_t)box->size[0];
    if (s->sets)
        add_ids(s, thread, box, at, values);
    if (p->clip_min < p->clip_max)
        clip_row(s, t, values, active, count);
    if (!p->envelope) {
        trip_tally_row(t, values, active, count, at);
        return;
    }
    trip_tally_range(t, values, active, count);
    count_kept(t, p->envelope, values, active, count);
}

static int scan_box(void *user, unsigned thread, const trip_box *box)
{
    scan *s = user;
    float *values = s->values + (size_t)thread * SCAN_VOXELS;
    uint8_t *active = s->sparse ? s->active + (size_t)thread * SCAN_VOXELS : NULL;
    int status = trip_portion_decode(box->volume, box->portion, box->lo, box->size, values, active);
    if (status < 0)
        return status;
    size_t row = (size_t)box->size[0], rows = (size_t)(box->size[1] * box->size[2]);
    for (size_t r = 0; r < rows; r++)
        scan_row(s, thread, box, r, values + r * row, active ? active + r * row : NULL);
    return 0;
}

static int scan_batch(void *user, uint64_t done, uint64_t voxels)
{
    const scan *s = user;
    (void)done;
    return s->params->progress ? s->params->progress(s->params->user, voxels) : 0;
}

static int check_tally(const trip_tally *t, const char *path)
{
    if (t->voxels == 0)
        return trip_fail(TRIP_ERROR, "brick", path, "has no active voxels");
    if (t->finite == 0)
        return trip_fail(TRIP_ERROR, "brick", path, "has no finite values");
    return 0;
}

static int walk_once(scan *s, trip_tally *out, trip_volume *volume, trip_workers *workers,
                     uint64_t stride)
{
    unsigned threads = trip_workers_count(workers);
    trip_walk_params walk = { .slices = s->params->slices,
                              .stride = stride,
                              .skip_seconds = s->params->skip_seconds,
                              .read_ahead = s->params->read_ahead,
                              .edge = SCAN_EDGE,
                              .height = SCAN_HEIGHT,
                              .box = scan_box,
                              .batch = scan_batch,
                              .user = s };
    for (unsigned i = 0; i < threads; i++)
        trip_tally_clear(&s->tallies[i]);
    trip_tally_clear(out);
    int status = trip_walk(volume, workers, &walk);
    for (unsigned i = 0; i < threads; i++)
        trip_tally_add(out, &s->tallies[i]);
    for (unsigned i = 0; i < threads && s->sets; i++) {
        trip_id_set_add(s->params->ids, &s->sets[i], s->budget);
        trip_id_set_free(&s->sets[i], s->budget);
    }
    return status == 0 ? trip_volume_rewind(volume) : status;
}

static int scan_with(scan *s, trip_tally *out, trip_volume *volume, const char *path,
                     trip_workers *workers)
{
    int status = walk_once(s, out, volume, workers, s->params->stride);
    if (status == 0 && out->finite == 0 && s->params->stride > 1)
        status = walk_once(s, out, volume, workers, 1);
    return status == 0 ? check_tally(out, path) : status;
}

int trip_scan_volume(trip_tally *out, trip_volume *volume, const char *path, trip_workers *workers,
                     const trip_scan_params *params, trip_budget *budget)
{
    size_t threads = trip_workers_count(workers);
    scan s = { .sparse = trip_volume_get_info(volume)->sparse, .params = params, .budget = budget };
    const bool ids = params->ids && !s.sparse;
    size_t tallies = threads * sizeof *s.tallies, values = threads * SCAN_VOXELS * sizeof *s.values;
    size_t active = s.sparse ? threads * SCAN_VOXELS : 0;
    int status;
    s.tallies = trip_budget_take(budget, tallies);
    s.values = trip_budget_take(budget, values);
    s.active = active ? trip_budget_take(budget, active) : NULL;
    s.sets = ids ? calloc(threads, sizeof *s.sets) : NULL;
    if (s.tallies && s.values && (s.active || !active) && (s.sets || !ids))
        status = scan_with(&s, out, volume, path, workers);
    else
        status = trip_fail(TRIP_ERROR, "brick", path,
                           "%zu threads need more memory than --memory allows: raise --memory or "
                           "lower --threads",
                           threads);
    free(s.sets);
    trip_budget_release(budget, s.tallies, tallies);
    trip_budget_release(budget, s.values, values);
    if (active)
        trip_budget_release(budget, s.active, active);
    return status;
}
