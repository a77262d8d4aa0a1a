/* Makes a data set in a temporary folder for a benchmark without a named one. It contains the
 * included volume or a field with known values. Main thread only. */
#ifndef TRIP_BENCH_SAMPLE_H
#define TRIP_BENCH_SAMPLE_H

typedef struct bench_sample {
    char folder[256], data[272]; /* "" if the folder was not made */
} bench_sample;

/* Bricks the included volume with default options. The caller removes the folder even after a
 * failure. */
int bench_sample_make(bench_sample *s);
/* Bricks a field (fields.h) with n * n * n samples of 8 bits, which cover the same world space for
 * every n. `tf` is the transfer function, a file or preset. NULL selects one with the same opacity
 * per world unit for every n. */
int bench_sample_make_field(bench_sample *s, const char *field, int n, const char *tf);
void bench_sample_remove(const bench_sample *s);

#endif
