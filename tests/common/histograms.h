/* Makes histograms for tests from peaks and single values. */
#ifndef HISTOGRAMS_H
#define HISTOGRAMS_H

#include "test.h"

#include "transfer_function.h"

static trip_histogram h;

static inline void start(double value_min, double value_max)
{
    memset(&h, 0, sizeof h);
    h.value_min = value_min;
    h.value_max = value_max;
}

static inline void put(double value, double count)
{
    int bin = (int)((value - h.value_min) / (h.value_max - h.value_min) * 1024);
    h.counts[bin < 1024 ? bin : 1023] += (uint64_t)count;
    h.total += (uint64_t)count;
}

/* Adds `count` voxels with a normal distribution over the values lo, lo + 1, ... hi. */
static inline void put_peak(double lo, double hi, double mean, double deviation, double count)
{
    for (double v = lo; v <= hi; v++) {
        double x = (v - mean) / deviation;
        put(v, count / (deviation * 2.5066) * exp(-x * x / 2));
    }
}

/* Makes the histogram of a chest in Hounsfield units, with air, lung, fat, muscle and bone. */
static inline void put_chest(double lo, double hi)
{
    start(lo, hi);
    put_peak(lo, hi, -990, 15, 3e6);
    put_peak(lo, hi, -850, 40, 4e5);
    put_peak(lo, hi, -100, 30, 8e5);
    put_peak(lo, hi, 50, 30, 1e6);
    put_peak(lo, hi, 400, 200, 1e5);
}

/* Makes the histogram of a magnetic resonance image of a head, with noise and two broad peaks of
 * tissue. */
static inline void put_head(void)
{
    start(0, 1200);
    put_peak(0, 1200, 0, 15, 2e6);
    put_peak(0, 1200, 350, 80, 4e5);
    put_peak(0, 1200, 600, 100, 5e5);
}

#endif
