/* One object sampled finer and finer: what its frames take, and how far they are from the finest.
 * Part of `bench levels`. */
#ifndef TRIP_BENCH_FINER_H
#define TRIP_BENCH_FINER_H

#include "bench_options.h"
#include "bench_report.h"

enum { BENCH_FINER_COARSEST = 128, BENCH_FINER_MAX = 4 };

/* Of a volume: ms of a frame, and mean errors of 255. */
typedef struct bench_finer_row {
    int voxels; /* along each axis */
    double fine_ms, fine_colour, fine_alpha;
    double ms, colour, alpha; /* by coarse levels */
} bench_finer_row;

int bench_finer(const bench_options *o, bench_report *r);

/* Draws the times into an .svg. */
int bench_finer_plot(const char *path, const bench_finer_row *rows, int count);

#endif
