/* The included volume, or one with known values, as a data set in a temporary folder, for a
 * benchmark that names none. */
#ifndef TRIP_BENCH_SAMPLE_H
#define TRIP_BENCH_SAMPLE_H

typedef struct bench_sample {
    char folder[256], data[272]; /* "": not made */
} bench_sample;

/* Bricks the volume with its defaults. Remove it also after a failure. */
int bench_sample_make(bench_sample *s);
/* The same of a field (fields.h) sampled at n * n * n places, 8 bits each, that reach over the same
 * world space whatever n. `tf`: the function kept, a file or preset; NULL: one whose opacity per
 * world unit is the same whatever n. */
int bench_sample_make_field(bench_sample *s, const char *field, int n, const char *tf);
void bench_sample_remove(const bench_sample *s);

#endif
