#include "pace.h"

#include <math.h>

/* Decay of the sums with each recorded frame. */
static const double kept = 0.7;

#define MAX_GROWTH 3.0

void trip_pace_note(trip_pace *p, double pixels, double ms)
{
    const double x = pixels * 1e-6;
    p->weight = p->weight * kept + 1;
    p->px = p->px * kept + x;
    p->px_px = p->px_px * kept + x * x;
    p->ms = p->ms * kept + ms;
    p->px_ms = p->px_ms * kept + x * ms;
    p->ms_ms = p->ms_ms * kept + ms * ms;
}

/* Fits ms = fixed + slope * megapixels to the frames by least squares, with neither below 0. Adds
 * the standard error to the slope, for scattered frames. If all frames have one size, the whole
 * time counts as slope. */
static void fit(const trip_pace *p, double *fixed, double *slope)
{
    const double mean_px = p->px / p->weight, mean_ms = p->ms / p->weight;
    const double variance = p->px_px / p->weight - mean_px * mean_px;
    const double both = p->px_ms / p->weight - mean_px * mean_ms;
    const double max = mean_ms / mean_px;
    *slope = max;
    if (variance > 1e-4 * mean_px * mean_px) {
        const double rest = p->ms_ms / p->weight - mean_ms * mean_ms - both * both / variance;
        const double error = sqrt(fmax(rest, 0) / (variance * p->weight));
        *slope = fmin(fmax(both / variance, 0) + error, max);
    }
    *fixed = fmax(mean_ms - *slope * mean_px, 0);
}

double trip_pace_expect_ms(const trip_pace *p, double pixels)
{
    double fixed, slope;
    if (!(p->weight > 0))
        return 0;
    fit(p, &fixed, &slope);
    return fixed + slope * pixels * 1e-6;
}

double trip_pace_scale(const trip_pace *p, double pixels, double target_ms)
{
    double fixed, slope;
    if (!(p->weight > 0))
        return 0.5;
    fit(p, &fixed, &slope);
    const double left = fmax(target_ms - fixed, fixed / 4);
    const double all = slope * pixels * 1e-6;
    const double known = MAX_GROWTH * 1e6 * p->px / p->weight;
    const double part = sqrt(fmin(fmin(all > left ? left / all : 1, known / pixels), 1));
    return fmin(fmax(part, TRIP_PACE_MIN), 1);
}
