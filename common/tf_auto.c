/* A transfer function from a histogram alone. Most voxels of most volumes are background: air, the
 * zeros around a simulation, the black of an angiogram. Everything up to the upper edge of that
 * peak gets opacity 0, so that it is culled. Above it, values are ranked: a value's rank is the
 * share of the foreground below it, and opacity grows with a power of the rank, so that what is
 * common stays a veil and what is rare and high stands out, whatever the histogram's shape. */
#include "tf_internal.h"

#include <math.h>

enum { BINS = 1024, GROUPS = 64, GROUP_BINS = BINS / GROUPS, LEVELS = 24 };

static const double strongest_opacity = 0.7; /* at the highest rank */
static const double rank_power = 4;
static const double solid_opacity = 0.3; /* of a volume of one value */

/* Colours of increasing luminance, at equal steps of rank and value: a cut from dusk to daylight.
 */
static const double colours[][3] = {
    { 0.20, 0.16, 0.42 }, { 0.36, 0.20, 0.55 }, { 0.63, 0.25, 0.52 }, { 0.86, 0.38, 0.38 },
    { 0.96, 0.58, 0.31 }, { 0.98, 0.80, 0.45 }, { 1.00, 0.97, 0.85 },
};

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

static double upper_edge(const trip_histogram *h, int bin)
{
    return h->value_min + (h->value_max - h->value_min) * (bin + 1) / BINS;
}

/* The bin that ends the background peak. */
static int background_end(const trip_histogram *h)
{
    uint64_t group[GROUPS] = { 0 };
    int peak = 0;
    for (int i = 0; i < BINS; i++)
        group[i / GROUP_BINS] += h->counts[i];
    for (int g = 1; g < GROUPS; g++)
        if (group[g] > group[peak])
            peak = g;
    int end = peak;
    while (end + 1 < GROUPS && group[end + 1] > group[peak] / 100)
        end++;
    return end * GROUP_BINS + GROUP_BINS - 1;
}

int trip_tf_from_histogram(trip_tf **out, const trip_histogram *h)
{
    trip_tf_point points[LEVELS + 2];
    size_t count = 0;
    double total = 0, below = 0;
    int end = background_end(h);
    for (int i = end + 1; i < BINS; i++)
        total += (double)h->counts[i];
    if (!(total > 0)) {
        points[0] = (trip_tf_point){ h->value_min, colour_at(0.7, solid_opacity) };
        return trip_tf_from_points(out, points, 1, false, 0);
    }
    points[count++] = (trip_tf_point){ upper_edge(h, end), colour_at(0, 0) };
    double next = 1.0 / LEVELS;
    for (int i = end + 1; i < BINS; i++) {
        below += (double)h->counts[i];
        double rank = below / total;
        if (rank < next && i < BINS - 1)
            continue;
        while (next <= rank)
            next += 1.0 / LEVELS;
        double linear = (double)(i - end) / (BINS - 1 - end);
        points[count++] = (trip_tf_point){ upper_edge(h, i),
                                           colour_at((rank + linear) / 2,
                                                     strongest_opacity * pow(rank, rank_power)) };
    }
    return trip_tf_from_points(out, points, count, false, 0);
}
