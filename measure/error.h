/* Errors of pictures against reference pictures of the same views. A pixel counts if the object
 * covers it: alpha is above 1/255 in either picture. One thread. */
#ifndef TRIP_MEASURE_ERROR_H
#define TRIP_MEASURE_ERROR_H

#include <stddef.h>
#include <stdint.h>

/* The histogram bins limit the resolution of the median and the percentile. */
enum {
    MEASURE_ERROR_BINS_PER_LEVEL = 100,
    MEASURE_ERROR_BINS = 255 * MEASURE_ERROR_BINS_PER_LEVEL + 1
};

/* Collects errors over pictures. Zeroed at first. */
typedef struct measure_error {
    uint64_t count; /* channels of covered pixels */
    double sum, sum_of_squares, max;
    uint64_t bins[MEASURE_ERROR_BINS];
} measure_error;

/* Errors of 255. psnr is in decibels against 255, and infinite if the pictures are equal. */
typedef struct measure_error_figures {
    double median, mean, percentile_99, max, psnr;
} measure_error_figures;

/* Adds all four channels of `pixels` * 4 floats, premultiplied, without background. */
void measure_error_add(measure_error *e, const float *picture, const float *truth, size_t pixels);
/* Adds red, green and blue to `colour`, and alpha to `alpha`. */
void measure_error_add_apart(measure_error *colour, measure_error *alpha, const float *picture,
                             const float *truth, size_t pixels);
/* Returns the smallest multiple of 0.01 that a share of the covered pixels does not exceed. The
 * error of a pixel is the largest one of its four channels, of 255. Overwrites *scratch. Returns 0
 * if no pixel is covered. */
double measure_error_bound(measure_error *scratch, const float *picture, const float *truth,
                           size_t pixels, double share);
/* Returns zeros and an infinite psnr if no pixel is covered. */
measure_error_figures measure_error_measure(const measure_error *e);

#endif
