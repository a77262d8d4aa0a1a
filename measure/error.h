/* Errors of pictures against reference pictures of the same views. A pixel counts if the object
 * covers it: alpha is above 1/255 in either picture. One thread. */
#ifndef TRIP_MEASURE_ERROR_H
#define TRIP_MEASURE_ERROR_H

#include <stddef.h>
#include <stdint.h>

/* The histogram bins limit the resolution of the median and the percentile. */
enum {
    ACCURACY_ERROR_BINS_PER_LEVEL = 100,
    ACCURACY_ERROR_BINS = 255 * ACCURACY_ERROR_BINS_PER_LEVEL + 1
};

/* Collects errors over pictures. Zeroed at first. */
typedef struct accuracy_error {
    uint64_t count; /* channels of covered pixels */
    double sum, sum_of_squares, max;
    uint64_t bins[ACCURACY_ERROR_BINS];
} accuracy_error;

/* Errors of 255. psnr is in decibels against 255, and infinite if the pictures are equal. */
typedef struct accuracy_error_figures {
    double median, mean, percentile_99, max, psnr;
} accuracy_error_figures;

/* Adds all four channels of `pixels` * 4 floats, premultiplied, without background. */
void accuracy_error_add(accuracy_error *e, const float *picture, const float *truth, size_t pixels);
/* Adds red, green and blue to `colour`, and alpha to `alpha`. */
void accuracy_error_add_apart(accuracy_error *colour, accuracy_error *alpha, const float *picture,
                              const float *truth, size_t pixels);
/* Returns zeros and an infinite psnr if no pixel is covered. */
accuracy_error_figures accuracy_error_measure(const accuracy_error *e);

#endif
