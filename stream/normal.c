/* Normals in 32 bits: the sphere of directions is mapped to an octahedron, that is unfolded to the
 * square [-1, 1]^2, whose two coordinates are quantised. */
#include "format.h"

#include <math.h>

enum { COORDINATE_MAX = 4095, MAGNITUDE_MAX = 255 };

static double fold(double a, double b)
{
    return copysign(1 - fabs(b), a);
}

/* Comparisons, since calls of fmin and fmax take a third of the time. */
static inline double clamp(double x)
{
    return x > 0 ? x < 1 ? x : 1 : 0; /* 0 for NaN */
}

static uint32_t quantise(double x)
{
    return (uint32_t)(clamp(x * 0.5 + 0.5) * COORDINATE_MAX + 0.5);
}

static double dequantise(uint32_t q)
{
    return q * (2.0 / COORDINATE_MAX) - 1;
}

/* Square root coding: small gradients keep their relative accuracy. */
static uint32_t quantise_magnitude(double magnitude, double gradient_scale)
{
    if (!(magnitude > 0) || !(gradient_scale > 0))
        return 0;
    return (uint32_t)(sqrt(clamp(magnitude / gradient_scale)) * MAGNITUDE_MAX + 0.5);
}

uint32_t trip_normal_pack(const double gradient[3], double gradient_scale)
{
    double x = gradient[0], y = gradient[1], z = gradient[2];
    double sum = fabs(x) + fabs(y) + fabs(z);
    uint32_t magnitude = quantise_magnitude(sqrt(x * x + y * y + z * z), gradient_scale);
    if (magnitude == 0 || !isfinite(sum))
        return 0;
    double p = x / sum, q = y / sum;
    uint32_t a = quantise(z < 0 ? fold(p, q) : p);
    uint32_t b = quantise(z < 0 ? fold(q, p) : q);
    return a | b << 12 | magnitude << 24;
}

void trip_normal_unpack(uint32_t normal, double gradient_scale, double gradient[3])
{
    double a = dequantise(normal & COORDINATE_MAX);
    double b = dequantise(normal >> 12 & COORDINATE_MAX);
    double m = (normal >> 24) / (double)MAGNITUDE_MAX;
    double z = 1 - fabs(a) - fabs(b);
    double x = z < 0 ? fold(a, b) : a;
    double y = z < 0 ? fold(b, a) : b;
    double scale = m * m * gradient_scale / sqrt(x * x + y * y + z * z);
    gradient[0] = x * scale;
    gradient[1] = y * scale;
    gradient[2] = z * scale;
}
