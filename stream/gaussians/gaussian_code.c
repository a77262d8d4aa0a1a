#include "gaussian_code.h"

#include <limits.h>
#include <math.h>
#include <string.h>
#include <xxhash.h>

static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "files are read as they lie in memory");

enum {
    CENTRE_BITS = 21,
    CENTRE_MAX = (1 << CENTRE_BITS) - 1,
    ROTATION_MAX = 4094, /* an even number, so that 0 has a code */
    DEVIATION_MAX = 4095,
    OPACITY_MAX = 4095,
    COLOUR_MAX = (1 << 14) - 1,
    HARMONIC_MAX = 127,
};

/* Deviations below exp(-14) of the brick's largest are raised to it. */
#define LOG_RANGE 14.0
#define SQRT_HALF 0.70710678118654752440

typedef struct words {
    uint64_t w[3];
} words;

int trip_gaussian_size_class(const float deviations[3])
{
    const float largest = fmaxf(fmaxf(deviations[0], deviations[1]), deviations[2]);
    int exponent;
    if (!(largest > 0))
        return -128;
    frexpf(largest, &exponent);
    return (exponent - 1) >> 1;
}

static words load(const unsigned char *record)
{
    words r;
    memcpy(&r, record, sizeof r);
    return r;
}

static unsigned bits(uint64_t word, unsigned at, unsigned count)
{
    return (unsigned)(word >> at & ((UINT64_C(1) << count) - 1));
}

static double lowest(double x, double lo, double hi)
{
    return x < lo ? lo : x > hi ? hi : x;
}

/* Returns the code of a value in [lo, hi], 0 to `max`. */
static uint64_t code_of(double value, double lo, double hi, unsigned max)
{
    return hi > lo ? (uint64_t)(lowest((value - lo) / (hi - lo), 0, 1) * max + 0.5) : 0;
}

/* Conditions are faster than fmin() and fmax() here. All values are finite. */
static void include(double lo[3], double hi[3], const double at[3], const double half[3])
{
    for (int a = 0; a < 3; a++) {
        const double below = at[a] - half[a], above = at[a] + half[a];
        lo[a] = below < lo[a] ? below : lo[a];
        hi[a] = above > hi[a] ? above : hi[a];
    }
}

static void include_value(float *lo, float *hi, float value)
{
    *lo = value < *lo ? value : *lo;
    *hi = value > *hi ? value : *hi;
}

static unsigned char *pack_harmonics(float largest, const float sh[TRIP_SH_MAX][3], int n,
                                     unsigned char *to)
{
    const double scale = (double)largest;
    for (int k = n * n; k < trip_sh_count(n); k++)
        for (int c = 0; c < 3; c++) {
            const double part = scale > 0 ? (double)sh[k][c] / scale : 0;
            *to++ = (unsigned char)(int8_t)lrint(lowest(part, -1, 1) * HARMONIC_MAX);
        }
    return to;
}

static const unsigned char *unpack_harmonics(float largest, const unsigned char *from, int n,
                                             float sh[TRIP_SH_MAX][3])
{
    const float step = largest / HARMONIC_MAX;
    for (int k = n * n; k < trip_sh_count(n); k++)
        for (int c = 0; c < 3; c++)
            sh[k][c] = (float)(int8_t)*from++ * step;
    return from;
}

static float largest_of(const float sh[TRIP_SH_MAX][3], int n)
{
    float largest = 0;
    for (int k = n * n; k < trip_sh_count(n); k++)
        for (int c = 0; c < 3; c++)
            largest = fmaxf(largest, fabsf(sh[k][c]));
    return largest;
}

void trip_gaussian_encode_entry(const float sh[TRIP_SH_MAX][3], int degree, unsigned char *entry)
{
    for (int n = 1; n <= degree; n++) {
        const float largest = largest_of(sh, n);
        memcpy(entry, &largest, sizeof largest);
        entry = pack_harmonics(largest, sh, n, entry + sizeof largest);
    }
}

void trip_gaussian_decode_entry(const unsigned char *entry, int degree, float sh[TRIP_SH_MAX][3])
{
    for (int n = 1; n <= degree; n++) {
        float largest;
        memcpy(&largest, entry, sizeof largest);
        entry = unpack_harmonics(largest, entry + sizeof largest, n, sh);
    }
}

static void find_ranges(trip_file_gaussian_brick *b, const unsigned char *const *splats,
                        unsigned count, int degree)
{
    const double none[3] = { 0 };
    float least = INFINITY, most = 0;
    for (int c = 0; c < 3; c++) {
        b->centre_lo[c] = INFINITY, b->centre_hi[c] = -INFINITY;
        b->colour_lo[c] = INFINITY, b->colour_hi[c] = -INFINITY;
        b->scale[c] = 0;
    }
    for (unsigned i = 0; i < count; i++) {
        const trip_gaussian *g = (const void *)splats[i];
        include(b->centre_lo, b->centre_hi, g->centre, none);
        for (int c = 0; c < 3; c++) {
            include_value(&b->colour_lo[c], &b->colour_hi[c], g->sh[0][c]);
            if (g->deviations[c] > 0)
                include_value(&least, &most, g->deviations[c]);
        }
        for (int n = 1; n <= degree; n++)
            b->scale[n - 1] = fmaxf(b->scale[n - 1], largest_of(g->sh, n));
    }
    const double log_hi = most > 0 ? log((double)most) : 0;
    const double log_lo = most > 0 ? fmax(log((double)least), log_hi - LOG_RANGE) : 0;
    b->log_hi = (float)log_hi;
    b->log_lo = (float)log_lo;
    if (b->log_lo > b->log_hi)
        b->log_lo = b->log_hi;
}

static uint64_t deviation_code(const trip_file_gaussian_brick *b, float deviation)
{
    if (!(deviation > 0))
        return 0;
    return 1 +
           code_of(log((double)deviation), (double)b->log_lo, (double)b->log_hi, DEVIATION_MAX - 1);
}

/* The largest of the four numbers is left out. It is positive after a change of all signs. */
static uint64_t rotation_code(const float rotation[4])
{
    int largest = 0;
    for (int i = 1; i < 4; i++)
        if (fabsf(rotation[i]) > fabsf(rotation[largest]))
            largest = i;
    const double sign = rotation[largest] < 0 ? -1 : 1;
    uint64_t code = (uint64_t)largest;
    for (int i = 0, at = 2; i < 4; i++) {
        if (i == largest)
            continue;
        code |= code_of(sign * (double)rotation[i], -SQRT_HALF, SQRT_HALF, ROTATION_MAX) << at;
        at += 12;
    }
    return code;
}

static uint64_t colour_code(const trip_file_gaussian_brick *b, const trip_gaussian *g, int c)
{
    return code_of((double)g->sh[0][c], (double)b->colour_lo[c], (double)b->colour_hi[c],
                   COLOUR_MAX);
}

static words pack(const trip_file_gaussian_brick *b, const trip_gaussian *g)
{
    words r = { { 0 } };
    uint64_t code = 0; /* of the last deviation; often the next one has it too */
    for (int a = 0; a < 3; a++) {
        r.w[0] |= code_of(g->centre[a], b->centre_lo[a], b->centre_hi[a], CENTRE_MAX)
                  << CENTRE_BITS * a;
        if (a == 0 || g->deviations[a] != g->deviations[a - 1])
            code = deviation_code(b, g->deviations[a]);
        r.w[2] |= code << 12 * a;
    }
    r.w[1] = rotation_code(g->rotation) | code_of((double)g->opacity, 0, 1, OPACITY_MAX) << 38 |
             colour_code(b, g, 0) << 50;
    r.w[2] |= colour_code(b, g, 1) << 36 | colour_code(b, g, 2) << 50;
    return r;
}

void trip_gaussian_half_extents(const trip_gaussian *g, double half[3])
{
    const double w = (double)g->rotation[0], x = (double)g->rotation[1], y = (double)g->rotation[2],
                 z = (double)g->rotation[3];
    const double r[3][3] = {
        { 1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y) },
        { 2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x) },
        { 2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y) },
    };
    for (int a = 0; a < 3; a++) {
        double sum = 0;
        for (int k = 0; k < 3; k++) {
            const double along = r[a][k] * (double)g->deviations[k];
            sum += along * along;
        }
        half[a] = TRIP_GAUSSIAN_REACH * sqrt(sum);
    }
}

/* Returns the value of a code, at most `hi` in spite of rounding. */
static inline double value_of(unsigned code, double lo, double hi, unsigned max)
{
    const double value = lo + code * ((hi - lo) * (1.0 / max));
    return value < hi ? value : hi;
}

void trip_gaussian_decode_centre(const trip_file_gaussian_brick *b, const unsigned char *record,
                                 double centre[3])
{
    const words r = load(record);
    for (int a = 0; a < 3; a++)
        centre[a] = value_of(bits(r.w[0], (unsigned)(CENTRE_BITS * a), CENTRE_BITS),
                             b->centre_lo[a], b->centre_hi[a], CENTRE_MAX);
}

static float decode_deviation(const trip_file_gaussian_brick *b, unsigned code)
{
    if (!code)
        return 0;
    return expf((float)value_of(code - 1, (double)b->log_lo, (double)b->log_hi, DEVIATION_MAX - 1));
}

/* Numbers that no unit quaternion has are made one. */
static void decode_rotation(uint64_t word, float rotation[4])
{
    const int largest = (int)bits(word, 0, 2);
    double q[4], sum = 0;
    for (int i = 0, at = 2; i < 4; i++) {
        if (i == largest)
            continue;
        q[i] = ((double)bits(word, (unsigned)at, 12) * (2.0 / ROTATION_MAX) - 1) * SQRT_HALF;
        sum += q[i] * q[i];
        at += 12;
    }
    q[largest] = sum < 1 ? sqrt(1 - sum) : 0;
    const double scale = sum < 1 ? 1 : 1 / sqrt(sum);
    for (int i = 0; i < 4; i++)
        rotation[i] = (float)(q[i] * scale);
}

static void decode_shape(const trip_file_gaussian_brick *b, words r, trip_gaussian *out)
{
    unsigned before = 0;
    for (int a = 0; a < 3; a++) {
        const unsigned code = bits(r.w[2], (unsigned)(12 * a), 12);
        out->deviations[a] =
            a > 0 && code == before ? out->deviations[a - 1] : decode_deviation(b, code);
        before = code;
    }
    decode_rotation(r.w[1], out->rotation);
    out->opacity = (float)bits(r.w[1], 38, 12) / OPACITY_MAX;
}

/* Finds the bounds of the decoded records, since a reader draws them. */
static void find_reach(trip_file_gaussian_brick *b, const unsigned char *records, unsigned count)
{
    b->opacity_max = 0;
    for (int a = 0; a < 3; a++)
        b->reach_lo[a] = b->centre_lo[a], b->reach_hi[a] = b->centre_hi[a];
    for (unsigned i = 0; i < count; i++) {
        const unsigned char *record = records + (size_t)i * TRIP_GAUSSIAN_RECORD_BYTES;
        trip_gaussian g;
        double half[3];
        trip_gaussian_decode_centre(b, record, g.centre);
        decode_shape(b, load(record), &g);
        trip_gaussian_half_extents(&g, half);
        include(b->reach_lo, b->reach_hi, g.centre, half);
        b->opacity_max = g.opacity > b->opacity_max ? g.opacity : b->opacity_max;
    }
}

void trip_gaussian_encode(trip_file_gaussian_brick *b, const trip_file_gaussian_header *h,
                          const unsigned char *const *splats, unsigned count,
                          unsigned char *const planes[])
{
    const int degree = (int)h->degree, own = h->flags & TRIP_GAUSSIAN_PALETTE ? 0 : degree;
    const unsigned plane_count = trip_gaussian_plane_count(h, degree);
    find_ranges(b, splats, count, own);
    b->records = count;
    for (unsigned i = 0; i < count; i++) {
        const trip_gaussian *g = (const void *)splats[i];
        const words r = pack(b, g);
        memcpy(planes[0] + i * sizeof r, &r, sizeof r);
        for (int n = 1; n <= own; n++)
            pack_harmonics(b->scale[n - 1], g->sh, n,
                           planes[n] + i * trip_gaussian_plane_bytes(h, (unsigned)n));
    }
    find_reach(b, planes[0], count);
    for (unsigned n = 0; n < TRIP_GAUSSIAN_PLANES; n++)
        b->checksums[n] = n < plane_count
                              ? XXH64(planes[n], count * (size_t)trip_gaussian_plane_bytes(h, n), 0)
                              : 0;
}

static float decode_colour(const trip_file_gaussian_brick *b, unsigned code, int c)
{
    return (float)value_of(code, (double)b->colour_lo[c], (double)b->colour_hi[c], COLOUR_MAX);
}

void trip_gaussian_decode(const trip_file_gaussian_brick *b, const unsigned char *record,
                          const unsigned char *harmonics, int degree, trip_gaussian *out)
{
    const words r = load(record);
    memset(out->sh, 0, sizeof out->sh);
    out->merged = 0;
    out->antialiased = 0;
    out->from_camera = out->hyperline = 0;
    trip_gaussian_decode_centre(b, record, out->centre);
    decode_shape(b, r, out);
    out->sh[0][0] = decode_colour(b, bits(r.w[1], 50, 14), 0);
    out->sh[0][1] = decode_colour(b, bits(r.w[2], 36, 14), 1);
    out->sh[0][2] = decode_colour(b, bits(r.w[2], 50, 14), 2);
    for (int n = 1; n <= degree; n++)
        harmonics = unpack_harmonics(b->scale[n - 1], harmonics, n, out->sh);
}

const char *trip_gaussian_record_fault(const unsigned char *record)
{
    const words r = load(record);
    if (r.w[0] >> 63)
        return "the reserved bit of a record is not zero";
    for (unsigned at = 2; at < 38; at += 12)
        if (bits(r.w[1], at, 12) > ROTATION_MAX)
            return "the rotation of a record has an invalid code";
    return NULL;
}

uint32_t trip_gaussian_centre_code(const unsigned char *record, int axis)
{
    return bits(load(record).w[0], (unsigned)(CENTRE_BITS * axis), CENTRE_BITS);
}
