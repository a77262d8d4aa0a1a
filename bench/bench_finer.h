/* Times and errors of one object that is sampled more and more finely. Part of `bench levels`. One
 * thread. */
#ifndef TRIP_BENCH_FINER_H
#define TRIP_BENCH_FINER_H

#include "bench_options.h"
#include "bench_report.h"

enum { BENCH_FINER_COARSEST = 128, BENCH_FINER_MAX = 4 };

/* Row of a volume: milliseconds per frame, and mean errors of 255. */
typedef struct bench_finer_row {
    int voxels; /* along each axis */
    double fine_ms, fine_colour, fine_alpha;
    double ms, colour, alpha; /* with coarse levels */
} bench_finer_row;

int bench_finer(const bench_options *o, bench_report *r);

/* Draws the times into an SVG file. */
int bench_finer_plot(const char *path, const bench_finer_row *rows, int count);

#endif
