/* How far pictures are from others of the same views: over the channels red, green, blue and alpha
 * of the pixels that the object covers, where alpha of either picture is above 1/255. One thread.
 */
#ifndef TRIP_BENCH_ERROR_H
#define TRIP_BENCH_ERROR_H

#include <stddef.h>
#include <stdint.h>

/* Median and percentile are as fine as the bins of a histogram. */
enum { BENCH_ERROR_BINS_PER_LEVEL = 100, BENCH_ERROR_BINS = 255 * BENCH_ERROR_BINS_PER_LEVEL + 1 };

/* Gathered picture by picture; starts zeroed. */
typedef struct bench_error {
    uint64_t count; /* of channels of covered pixels */
    double sum, sum_of_squares, most;
    uint64_t bins[BENCH_ERROR_BINS];
} bench_error;

/* Of 255, but for psnr: decibels against 255, infinite where the pictures are the same. */
typedef struct bench_error_figures {
    double median, mean, percentile_99, most, psnr;
} bench_error_figures;

/* Pictures of `pixels` times 4 floats, premultiplied, without background. */
void bench_error_add(bench_error *e, const float *picture, const float *truth, size_t pixels);
/* All 0 where no pixel is covered. */
bench_error_figures bench_error_measure(const bench_error *e);

#endif
