#include "error.h"

#include <math.h>
#include <stdbool.h>

static void add_channel(measure_error *e, double error)
{
    double position = fmin(MEASURE_ERROR_BINS - 1, round(error * MEASURE_ERROR_BINS_PER_LEVEL));
    e->bins[(size_t)position]++;
    e->count++;
    e->sum += error;
    e->sum_of_squares += error * error;
    e->max = fmax(e->max, error);
}

/* `i` is the index of the pixel's first channel. */
static bool is_covered(const float *picture, const float *truth, size_t i)
{
    return picture[i + 3] > 1.0F / 255 || truth[i + 3] > 1.0F / 255;
}

void measure_error_add_apart(measure_error *colour, measure_error *alpha, const float *picture,
                             const float *truth, size_t pixels)
{
    for (size_t i = 0; i < 4 * pixels; i += 4)
        if (is_covered(picture, truth, i))
            for (size_t c = 0; c < 4; c++)
                add_channel(c == 3 ? alpha : colour,
                            255 * fabs((double)picture[i + c] - (double)truth[i + c]));
}

void measure_error_add(measure_error *e, const float *picture, const float *truth, size_t pixels)
{
    measure_error_add_apart(e, e, picture, truth, pixels);
}

/* Returns the smallest error that a share of the channels does not exceed. */
static double percentile(const measure_error *e, double share)
{
    uint64_t below = 0;
    for (size_t i = 0; i < MEASURE_ERROR_BINS; i++) {
        below += e->bins[i];
        if ((double)below >= share * (double)e->count)
            return fmin((double)i / MEASURE_ERROR_BINS_PER_LEVEL, e->max);
    }
    return e->max;
}

double measure_error_bound(measure_error *scratch, const float *picture, const float *truth,
                           size_t pixels, double share)
{
    uint64_t below = 0;
    *scratch = (measure_error){ 0 };
    for (size_t i = 0; i < 4 * pixels; i += 4) {
        double error = 0;
        if (!is_covered(picture, truth, i))
            continue;
        for (size_t c = i; c < i + 4; c++)
            error = fmax(error, fabs((double)picture[c] - (double)truth[c]));
        const double bin = ceil(255 * error * MEASURE_ERROR_BINS_PER_LEVEL);
        scratch->bins[(size_t)fmin(MEASURE_ERROR_BINS - 1, bin)]++;
        scratch->count++;
    }
    for (size_t i = 0; i < MEASURE_ERROR_BINS && scratch->count; i++) {
        below += scratch->bins[i];
        if ((double)below >= share * (double)scratch->count)
            return (double)i / MEASURE_ERROR_BINS_PER_LEVEL;
    }
    return 0;
}

measure_error_figures measure_error_measure(const measure_error *e)
{
    if (!e->count)
        return (measure_error_figures){ .psnr = INFINITY };
    double count = (double)e->count;
    return (measure_error_figures){
        .median = percentile(e, 0.5),
        .mean = e->sum / count,
        .percentile_99 = percentile(e, 0.99),
        .max = e->max,
        .psnr = -10 * log10(e->sum_of_squares / count / (255.0 * 255.0)),
    };
}
