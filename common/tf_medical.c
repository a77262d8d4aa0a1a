/* Makes automatic functions for CT and magnetic resonance. Hounsfield units of CT have the same
 * meaning in every scan. Values of magnetic resonance have no meaning, except that tissue is
 * brighter than air. */
#include "tf_internal.h"

#include <math.h>
#include <string.h>

enum { BINS = 1024, GROUPS = 64 };

/* Optical depth of all muscle and organs along a typical ray. */
static const double veil_depth = 1.5;

static double value_at(const trip_histogram *h, double bin)
{
    return h->value_min + (h->value_max - h->value_min) * bin / BINS;
}

/* Returns the number of voxels with values in [lo, hi] on a typical ray. */
static double voxels_on_ray(const trip_histogram *h, double lo, double hi)
{
    double sum = 0;
    for (int i = 0; i < BINS; i++)
        if (value_at(h, i + 0.5) >= lo && value_at(h, i + 0.5) <= hi)
            sum += (double)h->counts[i];
    return sum / pow(fmax(1, (double)h->total), 2.0 / 3);
}

int trip_tf_ct_from_histogram(trip_tf **out, const trip_histogram *h)
{
    double veil = 1 - exp(-veil_depth / fmax(10, voxels_on_ray(h, -20, 150)));
    const trip_tf_point points[] = {
        { -250, { 0.80, 0.58, 0.42, 0 } },
        { -80, { 0.90, 0.70, 0.46, 0.2 * veil } }, /* fat */
        { 0, { 0.82, 0.50, 0.40, 0.6 * veil } },
        { 60, { 0.78, 0.38, 0.31, veil } }, /* muscle, organs */
        { 130, { 0.86, 0.50, 0.39, fmin(0.1, 2 * veil) } },
        { 220, { 0.93, 0.74, 0.55, 0.08 } }, /* spongy bone, vessels with contrast medium */
        { 400, { 0.97, 0.90, 0.76, 0.40 } },
        { 1200, { 1.00, 0.98, 0.92, 0.80 } }, /* dense bone */
        { 3000, { 1.00, 1.00, 1.00, 0.90 } },
    };
    return trip_tf_from_points(out, points, sizeof points / sizeof *points, false, 0);
}

/* Returns the bin below which a fraction of the voxels from bin `first` on lies. */
static int quantile(const trip_histogram *h, int first, double fraction)
{
    double total = 0, below = 0;
    for (int i = first; i < BINS; i++)
        total += (double)h->counts[i];
    for (int i = first; i < BINS; i++) {
        below += (double)h->counts[i];
        if (below >= fraction * total)
            return i;
    }
    return BINS - 1;
}

/* Counts voxels in GROUPS equal groups of the bins [first, past). Splits a bin on a border by
 * overlap. */
static void group_bins(const trip_histogram *h, int first, int past, double groups[GROUPS])
{
    double width = (double)(past - first) / GROUPS;
    memset(groups, 0, GROUPS * sizeof *groups);
    for (int i = first; i < past; i++)
        for (int g = (int)((i - first) / width); g < GROUPS && first + g * width < i + 1; g++) {
            double from = fmax(i, first + g * width), to = fmin(i + 1, first + (g + 1) * width);
            groups[g] += (double)h->counts[i] * fmax(0, to - from);
        }
}

/* Returns the group with the fewest voxels above the background's peak, if counts rise again to at
 * least twice as many. Returns -1 if there is none. */
static int find_valley(const double groups[GROUPS])
{
    int peak = 0, valley = -1;
    double max = 0;
    for (int g = 1; g < GROUPS / 4; g++)
        peak = groups[g] > groups[peak] ? g : peak;
    int lowest = peak;
    for (int g = peak + 1; g < GROUPS; g++) {
        if (groups[g] < groups[lowest])
            lowest = g;
        if (groups[g] > 2 * groups[lowest] && groups[g] > max) {
            max = groups[g];
            valley = lowest;
        }
    }
    return valley;
}

bool trip_tf_find_tissue(trip_tf_tissue *out, const trip_histogram *h)
{
    double groups[GROUPS], total = 0, tissue = 0, sharpest = 0;
    int past = quantile(h, 1, 0.998) + 1; /* a few bright voxels must not stretch the range */
    for (int i = 0; i < BINS; i++)
        total += (double)h->counts[i];
    group_bins(h, 0, past, groups);
    int valley = find_valley(groups);
    if (past < 16 || valley < 0)
        return false;
    for (int g = valley; g < GROUPS; g++)
        tissue += groups[g];
    for (int g = valley; g + 1 < GROUPS; g++)
        sharpest = fmax(sharpest, groups[g] + groups[g + 1]);
    int first = (int)((double)past * valley / GROUPS);
    *out = (trip_tf_tissue){
        .valley = value_at(h, (double)past * (valley + 0.5) / GROUPS),
        .middle = value_at(h, quantile(h, first, 0.5) + 0.5),
        .high = value_at(h, quantile(h, first, 0.98) + 1),
        .fraction = tissue / total,
        .sharpest = sharpest / tissue,
    };
    return out->valley < out->middle && out->middle < out->high;
}

int trip_tf_mr_from_histogram(trip_tf **out, const trip_histogram *h)
{
    trip_tf_tissue t;
    if (!trip_tf_find_tissue(&t, h))
        return trip_tf_from_histogram(out, h);
    double step = t.middle - t.valley;
    const trip_tf_point points[] = {
        { t.valley, { 0.30, 0.20, 0.18, 0 } },
        { t.valley + 0.4 * step, { 0.50, 0.36, 0.31, 0.03 } },
        { t.middle, { 0.82, 0.69, 0.62, 0.25 } },
        { t.high, { 1.00, 0.95, 0.90, 0.50 } },
    };
    return trip_tf_from_points(out, points, sizeof points / sizeof *points, false, 0);
}
