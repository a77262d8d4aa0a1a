#include "kernel.h"

#include <math.h>

static void cubic_weights(double x, double weights[TRIP_KERNEL_TAPS])
{
    weights[0] = 0.5 * x * (x * (2 - x) - 1);
    weights[1] = 0.5 * (x * x * (3 * x - 5) + 2);
    weights[2] = 0.5 * x * (x * (4 - 3 * x) + 1);
    weights[3] = 0.5 * x * x * (x - 1);
}

static void gaussian_weights(double x, double weights[TRIP_KERNEL_TAPS])
{
    const double sigma = 2 / TRIP_CUTOFF, edge = exp(-0.5 * TRIP_CUTOFF * TRIP_CUTOFF);
    double sum = 0;
    for (int i = 0; i < TRIP_KERNEL_TAPS; i++) {
        double d = (x + 1 - i) / sigma;
        weights[i] = fmax(0, exp(-0.5 * d * d) - edge);
        sum += weights[i];
    }
    for (int i = 0; i < TRIP_KERNEL_TAPS; i++)
        weights[i] /= sum;
}

void trip_kernel_weights(trip_kernel kernel, double position, double weights[TRIP_KERNEL_TAPS])
{
    if (kernel == TRIP_KERNEL_CUBIC) {
        cubic_weights(position, weights);
    } else if (kernel == TRIP_KERNEL_GAUSSIAN) {
        gaussian_weights(position, weights);
    } else if (kernel == TRIP_KERNEL_NEAREST) {
        weights[0] = weights[3] = 0;
        weights[2] = position >= 0.5;
        weights[1] = 1 - weights[2];
    } else {
        weights[0] = weights[3] = 0;
        weights[1] = 1 - position;
        weights[2] = position;
    }
}

const char *trip_kernel_name(trip_kernel kernel)
{
    static const char *const names[] = { "linear", "cubic", "gaussian", "nearest" };
    return names[kernel];
}
