/* How far pictures are from others of the same views: over channels of the pixels that the object
 * covers, where alpha of either picture is above 1/255. One thread. */
#ifndef TRIP_ACCURACY_ERROR_H
#define TRIP_ACCURACY_ERROR_H

#include <stddef.h>
#include <stdint.h>

/* Median and percentile are as fine as the bins of a histogram. */
enum {
    ACCURACY_ERROR_BINS_PER_LEVEL = 100,
    ACCURACY_ERROR_BINS = 255 * ACCURACY_ERROR_BINS_PER_LEVEL + 1
};

/* Gathered picture by picture; starts zeroed. */
typedef struct accuracy_error {
    uint64_t count; /* of channels of covered pixels */
    double sum, sum_of_squares, max;
    uint64_t bins[ACCURACY_ERROR_BINS];
} accuracy_error;

/* Of 255, but for psnr: decibels against 255, infinite where the pictures are the same. */
typedef struct accuracy_error_figures {
    double median, mean, percentile_99, max, psnr;
} accuracy_error_figures;

/* Pictures of `pixels` times 4 floats, premultiplied, without background; all four channels. */
void accuracy_error_add(accuracy_error *e, const float *picture, const float *truth, size_t pixels);
/* Red, green and blue alone to `colour`, alpha to `alpha`. */
void accuracy_error_add_apart(accuracy_error *colour, accuracy_error *alpha, const float *picture,
                              const float *truth, size_t pixels);
/* All 0 where no pixel is covered. */
accuracy_error_figures accuracy_error_measure(const accuracy_error *e);

#endif
