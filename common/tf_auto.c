/* Makes a transfer function from a histogram alone. In most volumes, most voxels are background:
 * air, the zeros around a simulation, the black of an angiogram. All values up to the upper edge of
 * the background peak get opacity 0, so that their voxels are culled.
 *
 * Above that edge, opacity grows with a power of a value's standing. The standing combines the rank
 * (the fraction of the foreground below the value) with the position in the range. Common values
 * stay a faint veil; rare, high values stand out. */
#include "tf_internal.h"

#include <math.h>

enum { BINS = 1024, GROUPS = 64, GROUP_BINS = BINS / GROUPS, LEVELS = 24 };

static const double solid_opacity = 0.3; /* if background and foreground cannot be separated */
static const double even_depth =
    1.2; /* optical depth of a cube of all voxels, if all have one value */
static const double strongest_opacity = 0.7; /* at rank 1 */
static const double invisible = 0.1; /* opacity is 0 up to this standing, which is mostly noise */
/* Optical depth that the lower four fifths of the foreground may have along a typical ray. */
static const double veil_depth = 1.2;

/* From dusk to daylight: luminance always rises. */
static const double colours[][3] = {
    { 0.20, 0.16, 0.42 }, { 0.36, 0.20, 0.55 }, { 0.63, 0.25, 0.52 }, { 0.86, 0.38, 0.38 },
    { 0.96, 0.58, 0.31 }, { 0.98, 0.80, 0.45 }, { 1.00, 0.97, 0.85 },
};

typedef struct analysis {
    double low, range; /* of the values; range is negative if bins are in descending order */
    double counts[BINS];
    int end; /* last bin of the background */
    double total, foreground,
        under; /* numbers of voxels: all, above the background peak, below it */
} analysis;

static trip_rgba colour_at(double t, double opacity)
{
    int last = sizeof colours / sizeof *colours - 1;
    double x = fmin(1, fmax(0, t)) * last;
    int i = x < last ? (int)x : last - 1;
    double f = x - i, c[3];
    for (int k = 0; k < 3; k++)
        c[k] = colours[i][k] + f * (colours[i + 1][k] - colours[i][k]);
    return (trip_rgba){ c[0], c[1], c[2], opacity };
}

/* Finds the background peak: the lowest group of bins that is more than a tail. It ends where its
 * slope is no longer steep. */
static void find_background(analysis *a)
{
    double group[GROUPS] = { 0 }, max = 0;
    for (int i = 0; i < BINS; i++)
        group[i / GROUP_BINS] += a->counts[i];
    for (int g = 0; g < GROUPS; g++)
        max = fmax(max, group[g]);
    int end = 0;
    while (group[end] < max / 4)
        a->under += group[end++];
    while (end + 1 < GROUPS && group[end + 1] > group[end])
        end++;
    double peak = group[end];
    while (end + 1 < GROUPS && group[end + 1] >= peak / 100 && group[end + 1] < group[end] / 2)
        end++;
    a->end = end * GROUP_BINS + GROUP_BINS - 1;
    for (int g = end + 1; g < GROUPS; g++)
        a->foreground += group[g];
}

static void analyse(analysis *a, const trip_histogram *h, bool downwards)
{
    *a = (analysis){ .low = h->value_min, .range = h->value_max - h->value_min };
    if (downwards) {
        a->low = h->value_max;
        a->range = -a->range;
    }
    for (int i = 0; i < BINS; i++) {
        a->counts[i] = (double)h->counts[downwards ? BINS - 1 - i : i];
        a->total += a->counts[i];
    }
    find_background(a);
}

static double upper_edge(const analysis *a, int bin)
{
    return a->low + a->range * (bin + 1) / BINS;
}

/* Returns the standing of a bin in the foreground, 0 to 1. It depends mostly on the rank and partly
 * on the value. The noise within one peak is thus not spread over all opacities. */
static double standing(const analysis *a, int bin, double rank)
{
    return 0.65 * rank + 0.35 * (bin - a->end) / (BINS - 1 - a->end);
}

static double opacity_at(double standing_of_bin, double power)
{
    double t = (standing_of_bin - invisible) / (1 - invisible);
    return t > 0 ? strongest_opacity * pow(t, power) : 0;
}

/* Returns the mean extinction of the lower four fifths of the foreground. */
static double veil_extinction(const analysis *a, double power)
{
    double sum = 0, below = 0;
    for (int i = a->end + 1; i < BINS && below < 0.8 * a->foreground; i++) {
        double middle = (below + 0.5 * a->counts[i]) / a->foreground;
        sum += a->counts[i] * trip_extinction(opacity_at(standing(a, i, middle), power));
        below += a->counts[i];
    }
    return sum / a->foreground;
}

/* Chooses the power. The veil on a ray through `foreground_voxels` voxels then has at most the
 * optical depth veil_depth. */
static double choose_power(const analysis *a, double foreground_voxels)
{
    double power = 2;
    while (power < 8 && veil_extinction(a, power) * foreground_voxels > veil_depth)
        power += 0.25;
    return power;
}

/* Makes a point at the edge of the background, and one each time the rank has grown by 1 / LEVELS.
 */
static size_t make_points(const analysis *a, trip_tf_point points[LEVELS + 2])
{
    double power = choose_power(a, cbrt(a->total) * a->foreground / a->total);
    double below = 0;
    size_t count = 0;
    int level = 1;
    /* Starts one code higher, since stored values have 16 bits and may be rounded up. */
    points[count++] = (trip_tf_point){ upper_edge(a, a->end) + a->range / 65535, colour_at(0, 0) };
    for (int i = a->end + 1; i < BINS; i++) {
        below += a->counts[i];
        double rank = below / a->foreground;
        if (a->counts[i] == 0 || rank * LEVELS < level)
            continue;
        level = (int)(rank * LEVELS) + 1;
        double t = standing(a, i, rank);
        trip_rgba colour = colour_at(t, opacity_at(t, power));
        points[count++] = (trip_tf_point){ upper_edge(a, i), colour };
    }
    return count;
}

static void reverse(trip_tf_point *points, size_t count)
{
    for (size_t i = 0; i < count / 2; i++) {
        trip_tf_point p = points[i];
        points[i] = points[count - 1 - i];
        points[count - 1 - i] = p;
    }
}

int trip_tf_even_fog(trip_tf **out, const trip_histogram *h)
{
    double edge = cbrt(fmax(1, (double)h->total));
    const trip_tf_point point = { h->value_min, { 0.85, 0.87, 0.9, 1 - exp(-even_depth / edge) } };
    return trip_tf_from_points(out, &point, 1, false, 0);
}

/* Returns whether the background is bright, so that bins are in descending order. */
static bool analyse_either_way(analysis *a, const trip_histogram *h)
{
    analyse(a, h, false);
    const bool downwards = a->foreground * 1000 < a->under;
    if (downwards)
        analyse(a, h, true);
    return downwards;
}

bool trip_tf_find_foreground(const trip_histogram *h, double *edge, double *extreme)
{
    analysis a;
    if (h->value_min == h->value_max)
        return false;
    analyse_either_way(&a, h);
    *edge = upper_edge(&a, a.end);
    *extreme = a.low + a.range;
    return a.foreground > 0 && isfinite(a.range);
}

int trip_tf_from_histogram(trip_tf **out, const trip_histogram *h)
{
    trip_tf_point points[LEVELS + 2];
    analysis a;
    if (h->value_min == h->value_max)
        return trip_tf_even_fog(out, h);
    const bool downwards = analyse_either_way(&a, h);
    if (!(a.foreground > 0) || !isfinite(a.range)) {
        points[0] = (trip_tf_point){ h->value_min, colour_at(0.7, solid_opacity) };
        return trip_tf_from_points(out, points, 1, false, 0);
    }
    size_t count = make_points(&a, points);
    if (downwards)
        reverse(points, count);
    return trip_tf_from_points(out, points, count, false, 0);
}
