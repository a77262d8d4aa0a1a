/* Directions: the sphere is mapped to an octahedron, that is unfolded to the square [-1, 1]^2,
 * whose two coordinates are quantised. */
#include "normal.h"

enum { COORDINATE_MAX = 4095, MAGNITUDE_MAX = 255 };
enum { STEPS_MAX = 127, P_MAX = 4095, Q_MAX = 2047, STRONG = 1 << 23 };

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

void trip_compact_normals_choose(const trip_affine *index_to_world, double full, double unit,
                                 double step[3])
{
    const double(*m)[4] = index_to_world->m;
    for (int a = 0; a < 3; a++) {
        /* The component along an axis of what is as long as `full` in world space, at most. */
        double most = full * trip_length(trip_v3(m[0][a], m[1][a], m[2][a]));
        step[a] = unit * STEPS_MAX >= most ? unit : most / STEPS_MAX;
    }
}

trip_compact_normals trip_compact_normals_make(const trip_affine *index_to_world, double full,
                                               const double step[3])
{
    trip_compact_normals c = { .full = full, .step = { step[0], step[1], step[2] } };
    trip_affine to_index;
    trip_affine_invert(index_to_world, &to_index);
    for (int row = 0; row < 3; row++)
        for (int column = 0; column < 3; column++)
            c.to_world[row][column] = to_index.m[column][row];
    return c;
}

static void to_world(const trip_compact_normals *c, const double from[3], double to[3])
{
    for (int row = 0; row < 3; row++)
        to[row] = c->to_world[row][0] * from[0] + c->to_world[row][1] * from[1] +
                  c->to_world[row][2] * from[2];
}

static uint32_t pack_direction(const double g[3])
{
    double sum = copysign(fabs(g[0]) + fabs(g[1]) + fabs(g[2]), g[2]);
    double x = g[0] / sum, y = g[1] / sum;
    uint32_t p = (uint32_t)(clamp((x + y) * 0.5 + 0.5) * P_MAX + 0.5);
    uint32_t q = (uint32_t)(clamp((x - y) * 0.5 + 0.5) * Q_MAX + 0.5);
    return STRONG | q << 12 | p;
}

/* The nearest multiple of the step; none is further than the steps reach. */
static int32_t steps_of(double x, double step)
{
    double steps = x / step;
    steps = steps > STEPS_MAX ? STEPS_MAX : steps < -STEPS_MAX ? -STEPS_MAX : steps;
    return (int32_t)(steps + copysign(0.5, steps));
}

uint32_t trip_compact_normal_pack(const trip_compact_normals *c, const double gradient[3])
{
    double g[3];
    to_world(c, gradient, g);
    double squared = g[0] * g[0] + g[1] * g[1] + g[2] * g[2];
    if (!isfinite(squared))
        return 0;
    if (squared >= c->full * c->full)
        return pack_direction(g);
    int32_t x = steps_of(gradient[0], c->step[0]), y = steps_of(gradient[1], c->step[1]),
            z = steps_of(gradient[2], c->step[2]), sign = z < 0 ? -1 : 1;
    return (uint32_t)(sign * x & 255) | (uint32_t)(sign * y & 255) << 8 |
           (uint32_t)(sign * z) << 16;
}

static void unpack_direction(uint32_t normal, double g[3])
{
    double p = (normal & P_MAX) * (2.0 / P_MAX) - 1, q = (normal >> 12 & Q_MAX) * (2.0 / Q_MAX) - 1;
    double x = (p + q) / 2, y = (p - q) / 2, z = 1 - fmax(fabs(p), fabs(q));
    double length = sqrt(x * x + y * y + z * z);
    g[0] = x / length;
    g[1] = y / length;
    g[2] = z / length;
}

void trip_compact_normal_unpack(const trip_compact_normals *c, uint32_t normal, double gradient[3])
{
    if (normal & STRONG) {
        unpack_direction(normal, gradient);
        for (int a = 0; a < 3; a++)
            gradient[a] *= c->full;
        return;
    }
    const double g[3] = { c->step[0] * (int8_t)(normal & 255),
                          c->step[1] * (int8_t)(normal >> 8 & 255),
                          c->step[2] * (double)(normal >> 16 & 127) };
    to_world(c, g, gradient);
}
