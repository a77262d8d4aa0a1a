/* The included volume as a data set in a temporary folder, for a benchmark that names none. */
#ifndef TRIP_BENCH_SAMPLE_H
#define TRIP_BENCH_SAMPLE_H

typedef struct bench_sample {
    char folder[256], data[272]; /* "": not made */
} bench_sample;

/* Bricks the volume with its defaults. Remove it also after a failure. */
int bench_sample_make(bench_sample *s);
void bench_sample_remove(const bench_sample *s);

#endif
