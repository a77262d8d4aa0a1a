#include "scan.h"

#include <float.h>
#include <math.h>
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

void trip_tally_add(trip_tally *t, const trip_tally *other)
{
    t->voxels += other->voxels;
    t->finite += other->finite;
    t->kept += other->kept;
    t->borders += other->borders;
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
    uint64_t sum = 0;
    if (!check_range(t->value_min, t->value_max) || t->exponent < -149 || t->first < -max ||
        t->first > max || t->exponent > exponent_for(t->value_min, t->value_max))
        return false;
    double first = floor(ldexp(t->value_min, -t->exponent));
    double last = floor(ldexp(t->value_max, -t->exponent));
    for (int64_t b = 0; b < TRIP_TALLY_BINS; b++) {
        double bin = (double)(t->first + b);
        if (t->counts[b] > 0 && (bin < first || bin > last))
            return false;
        if (__builtin_add_overflow(sum, t->counts[b], &sum))
            return false;
    }
    return sum == t->counted;
}

bool trip_tally_check(const trip_tally *t)
{
    if (t->finite > t->voxels || t->counted > t->finite || t->kept > t->voxels ||
        t->borders > 2 * t->voxels)
        return false;
    if (t->finite == 0)
        return t->value_min == INFINITY && t->value_max == -INFINITY;
    return t->counted > 0 ? check_bins(t) : check_range(t->value_min, t->value_max);
}

void trip_tally_histogram(const trip_tally *t, trip_histogram *histogram)
{
    const int bins = sizeof histogram->counts / sizeof *histogram->counts;
    double range = t->value_max - t->value_min;
    memset(histogram, 0, sizeof *histogram);
    histogram->value_min = t->value_min;
    histogram->value_max = t->value_max;
    histogram->total = t->counted;
    for (int64_t b = 0; b < TRIP_TALLY_BINS; b++) {
        if (t->counts[b] == 0)
            continue;
        /* A fine bin counts at its lower edge, which is exact for integers of up to 14 bits. */
        double value = fmax(ldexp((double)(t->first + b), t->exponent), t->value_min);
        int to = range > 0 ? (int)((value - t->value_min) / range * bins) : 0;
        histogram->counts[to < bins ? to : bins - 1] += t->counts[b];
    }
}

typedef struct scan {
    bool sparse;
    trip_tally *tallies; /* one for each thread */
    float *values;       /* SCAN_VOXELS for each thread */
    uint8_t *active;
    const trip_scan_params *params;
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

static int scan_box(void *user, unsigned thread, const trip_box *box)
{
    scan *s = user;
    float *values = s->values + (size_t)thread * SCAN_VOXELS;
    uint8_t *active = s->sparse ? s->active + (size_t)thread * SCAN_VOXELS : NULL;
    int status = trip_portion_decode(box->volume, box->portion, box->lo, box->size, values, active);
    if (status < 0)
        return status;
    size_t row = (size_t)box->size[0], rows = (size_t)(box->size[1] * box->size[2]);
    for (size_t r = 0; r < rows; r++) {
        const uint8_t *row_active = active ? active + r * row : NULL;
        trip_tally_range(&s->tallies[thread], values + r * row, row_active, row);
        if (s->params->envelope)
            count_kept(&s->tallies[thread], s->params->envelope, values + r * row, row_active, row);
        else
            trip_tally_count(&s->tallies[thread], values + r * row, row_active, row);
    }
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
    scan s = { .sparse = trip_volume_get_info(volume)->sparse, .params = params };
    size_t tallies = threads * sizeof *s.tallies, values = threads * SCAN_VOXELS * sizeof *s.values;
    size_t active = s.sparse ? threads * SCAN_VOXELS : 0;
    int status;
    s.tallies = trip_budget_take(budget, tallies);
    s.values = trip_budget_take(budget, values);
    s.active = active ? trip_budget_take(budget, active) : NULL;
    if (s.tallies && s.values && (s.active || !active))
        status = scan_with(&s, out, volume, path, workers);
    else
        status = trip_fail(TRIP_ERROR, "brick", path,
                           "%zu threads need more memory than --memory allows: raise --memory or "
                           "lower --threads",
                           threads);
    trip_budget_release(budget, s.tallies, tallies);
    trip_budget_release(budget, s.values, values);
    if (active)
        trip_budget_release(budget, s.active, active);
    return status;
}
