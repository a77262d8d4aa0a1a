/* Directions are mapped from the sphere to an octahedron, which is unfolded to the square [-1,
 * 1]^2. The two coordinates in the square are quantised. */
#include "normal.h"

#include "clones.h"

enum { COORDINATE_MAX = 4095, PART_BITS = 10, PART_MAX = 511, LENGTH_MAX = 127 };
enum {
    STEPS_MAX = 127,
    STEP_LENGTHS_MAX = 1024,
    P_MAX = 4095,
    Q_MAX = 2047,
    COMPACT_STRONG = 1 << 23
};
static const uint32_t STRONG = UINT32_C(1) << 31, CENTRE = UINT32_C(1) << 30;

static double fold(double a, double b)
{
    return copysign(1 - fabs(b), a);
}

/* Uses comparisons, since calls of fmin() and fmax() would take a third of the time. */
static inline double clamp(double x)
{
    return x > 0 ? x < 1 ? x : 1 : 0; /* 0 for NaN */
}

/* Packs octahedral coordinates in [0, max]. */
static void pack_octahedral(const double g[3], double max, uint32_t to[2])
{
    double sum = fabs(g[0]) + fabs(g[1]) + fabs(g[2]), x = g[0] / sum, y = g[1] / sum;
    double a = g[2] < 0 ? fold(x, y) : x, b = g[2] < 0 ? fold(y, x) : y;
    to[0] = (uint32_t)(clamp(a * 0.5 + 0.5) * max + 0.5);
    to[1] = (uint32_t)(clamp(b * 0.5 + 0.5) * max + 0.5);
}

/* Unpacks to a vector of the given length. */
static void unpack_octahedral(uint32_t first, uint32_t second, double max, double length,
                              double g[3])
{
    double a = first * (2 / max) - 1, b = second * (2 / max) - 1, z = 1 - fabs(a) - fabs(b);
    double x = z < 0 ? fold(a, b) : a, y = z < 0 ? fold(b, a) : b;
    double scale = length / sqrt(x * x + y * y + z * z);
    g[0] = x * scale;
    g[1] = y * scale;
    g[2] = z * scale;
}

uint32_t trip_direction_pack(const double gradient[3])
{
    double sum = fabs(gradient[0]) + fabs(gradient[1]) + fabs(gradient[2]);
    uint32_t c[2];
    if (!(sum > 0) || !isfinite(sum))
        return 0;
    pack_octahedral(gradient, UINT16_MAX, c);
    return c[0] | c[1] << 16;
}

void trip_direction_unpack(uint32_t direction, double unit[3])
{
    unpack_octahedral(direction & UINT16_MAX, direction >> 16, UINT16_MAX, 1, unit);
}

/* Rounds to the nearest corner of the lattice's cubes, or to the nearest centre, at 1/2 from the
 * corners. Returns the squared distance. |part| is at most PART_MAX. */
static double round_parts(const double part[3], double centre, uint32_t *normal)
{
    double squared = 0;
    *normal = centre > 0 ? CENTRE : 0;
    for (int a = 0; a < 3; a++) {
        double steps = part[a] - centre;
        int32_t whole = (int32_t)(steps + copysign(0.5, steps));
        *normal |= ((uint32_t)whole & ((1u << PART_BITS) - 1)) << PART_BITS * a;
        squared += (steps - whole) * (steps - whole);
    }
    return squared;
}

static uint32_t pack_parts(const double gradient[3], double full)
{
    const double scale = PART_MAX / full;
    const double part[3] = { gradient[0] * scale, gradient[1] * scale, gradient[2] * scale };
    uint32_t corner, centre;
    return round_parts(part, 0, &corner) <= round_parts(part, 0.5, &centre) ? corner : centre;
}

uint32_t trip_normal_pack(const double gradient[3], double full)
{
    double sum = fabs(gradient[0]) + fabs(gradient[1]) + fabs(gradient[2]);
    if (!(sum > 0) || !isfinite(sum) || !(full > 0))
        return 0;
    /* Squares of gradients may overflow. */
    double x = gradient[0] / sum, y = gradient[1] / sum, z = gradient[2] / sum;
    double length = sqrt(x * x + y * y + z * z) * (sum / full);
    uint32_t c[2];
    if (length < 1)
        return pack_parts(gradient, full);
    pack_octahedral(gradient, COORDINATE_MAX, c);
    double n = (sqrt(length) - 1) * 32 + 0.5;
    return STRONG | c[0] | c[1] << 12 | (n < LENGTH_MAX ? (uint32_t)n : LENGTH_MAX) << 24;
}

/* Returns the squared distance from a part to the nearest multiple of 1, plus `centre`. */
static inline float round_part(float part, float centre, int32_t *whole)
{
    const float steps = part - centre;
    *whole = (int32_t)(steps + copysignf(0.5f, steps));
    return (steps - (float)*whole) * (steps - (float)*whole);
}

static inline float within(float x, float lo, float hi)
{
    x = x > lo ? x : lo;
    return x < hi ? x : hi;
}

/* Selects without a branch, which would keep the loop out of vectors. */
static inline uint32_t selected(bool first, uint32_t a, uint32_t b)
{
    const uint32_t mask = -(uint32_t)first;
    return (a & mask) | (b & ~mask);
}

static inline uint32_t pack_whole(int32_t x, int32_t y, int32_t z)
{
    const uint32_t mask = (1u << PART_BITS) - 1;
    return ((uint32_t)x & mask) | ((uint32_t)y & mask) << PART_BITS |
           ((uint32_t)z & mask) << 2 * PART_BITS;
}

/* Packs the nearest point of the lattice with an offset. Sets its squared distance. */
static inline uint32_t pack_weak(float x, float y, float z, float centre, float *squared)
{
    int32_t n[3];
    *squared =
        round_part(x, centre, &n[0]) + round_part(y, centre, &n[1]) + round_part(z, centre, &n[2]);
    return pack_whole(n[0], n[1], n[2]);
}

static inline uint32_t pack_strong(float x, float y, float z, float length)
{
    const float sum = fabsf(x) + fabsf(y) + fabsf(z), scale = 1 / (sum > 0 ? sum : 1);
    const float p = x * scale, q = y * scale;
    const float a = z < 0 ? copysignf(1 - fabsf(q), p) : p;
    const float b = z < 0 ? copysignf(1 - fabsf(p), q) : q;
    const int32_t first = (int32_t)(within(a * 0.5f + 0.5f, 0, 1) * COORDINATE_MAX + 0.5f);
    const int32_t second = (int32_t)(within(b * 0.5f + 0.5f, 0, 1) * COORDINATE_MAX + 0.5f);
    const int32_t n = (int32_t)within((sqrtf(length) - 1) * 32 + 0.5f, 0, LENGTH_MAX);
    return STRONG | (uint32_t)first | (uint32_t)second << 12 | (uint32_t)n << 24;
}

TRIP_ALSO_V3
void trip_normals_pack_64(const float x[64], const float y[64], const float z[64],
                          uint32_t normals[64])
{
    float length[64], scale[64], corner[64], centre[64];
    uint32_t strong[64], at_centre[64];
    for (int i = 0; i < 64; i++)
        length[i] = sqrtf(x[i] * x[i] + y[i] * y[i] + z[i] * z[i]);
    for (int i = 0; i < 64; i++)
        strong[i] = pack_strong(x[i], y[i], z[i], length[i]);
    for (int i = 0; i < 64; i++)
        scale[i] = length[i] < 1 ? PART_MAX : 0; /* parts of other gradients might overflow */
    for (int i = 0; i < 64; i++)
        normals[i] = pack_weak(scale[i] * x[i], scale[i] * y[i], scale[i] * z[i], 0, &corner[i]);
    for (int i = 0; i < 64; i++)
        at_centre[i] =
            CENTRE | pack_weak(scale[i] * x[i], scale[i] * y[i], scale[i] * z[i], 0.5f, &centre[i]);
    for (int i = 0; i < 64; i++) {
        const uint32_t weak = selected(corner[i] <= centre[i], normals[i], at_centre[i]);
        normals[i] = selected(length[i] < 1, weak, strong[i]);
    }
}

void trip_normal_unpack(uint32_t normal, double full, double gradient[3])
{
    if (normal & STRONG) {
        double root = 1 + (normal >> 24 & LENGTH_MAX) / 32.0;
        unpack_octahedral(normal & COORDINATE_MAX, normal >> 12 & COORDINATE_MAX, COORDINATE_MAX,
                          full * root * root, gradient);
        return;
    }
    for (int a = 0; a < 3; a++) {
        int32_t whole = (int32_t)(normal << (32 - PART_BITS * (a + 1))) >> (32 - PART_BITS);
        gradient[a] = full / PART_MAX * (whole + (normal & CENTRE ? 0.5 : 0));
    }
}

/* Returns `unit` divided by the largest power of two with which the steps still reach `max`.
 * Returns max / STEPS_MAX if even `unit` does not reach it. */
static double finest_step(double unit, double max)
{
    int halvings = (int)fmax(0, ilogb(unit * STEPS_MAX / max));
    return unit * STEPS_MAX >= max ? ldexp(unit, -halvings) : max / STEPS_MAX;
}

bool trip_compact_normals_choose(const trip_affine *index_to_world, double full, double unit,
                                 double step[3])
{
    const double(*m)[4] = index_to_world->m;
    bool exact = true;
    for (int a = 0; a < 3; a++) {
        /* The maximum component along an axis of gradients as long as `full` in world space. */
        double max = full * trip_length(trip_v3(m[0][a], m[1][a], m[2][a]));
        step[a] = finest_step(unit, max);
        exact = exact && unit * STEPS_MAX >= max;
    }
    return exact;
}

bool trip_compact_normals_possible(const trip_affine *index_to_world, double full,
                                   const double step[3])
{
    const double(*m)[4] = index_to_world->m;
    bool possible = true;
    for (int a = 0; a < 3; a++) {
        const double max = full * trip_length(trip_v3(m[0][a], m[1][a], m[2][a]));
        possible = possible && step[a] <= STEP_LENGTHS_MAX * max;
    }
    return possible;
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

static uint32_t pack_compact_direction(const double g[3])
{
    double sum = copysign(fabs(g[0]) + fabs(g[1]) + fabs(g[2]), g[2]);
    double x = g[0] / sum, y = g[1] / sum;
    uint32_t p = (uint32_t)(clamp((x + y) * 0.5 + 0.5) * P_MAX + 0.5);
    uint32_t q = (uint32_t)(clamp((x - y) * 0.5 + 0.5) * Q_MAX + 0.5);
    return COMPACT_STRONG | q << 12 | p;
}

/* Returns the nearest multiple of the step, within STEPS_MAX. */
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
        return pack_compact_direction(g);
    int32_t x = steps_of(gradient[0], c->step[0]), y = steps_of(gradient[1], c->step[1]),
            z = steps_of(gradient[2], c->step[2]), sign = z < 0 ? -1 : 1;
    return (uint32_t)(sign * x & 255) | (uint32_t)(sign * y & 255) << 8 |
           (uint32_t)(sign * z) << 16;
}

static void unpack_compact_direction(uint32_t normal, double g[3])
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
    if (normal & COMPACT_STRONG) {
        unpack_compact_direction(normal, gradient);
        for (int a = 0; a < 3; a++)
            gradient[a] *= c->full;
        return;
    }
    const double g[3] = { c->step[0] * (int8_t)(normal & 255),
                          c->step[1] * (int8_t)(normal >> 8 & 255),
                          c->step[2] * (double)(normal >> 16 & 127) };
    to_world(c, g, gradient);
}
