#include "gaussian_code.h"

#include <limits.h>
#include <math.h>
#include <string.h>
#include <xxhash.h>

#include "clones.h"

static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "files are read as they lie in memory");

enum {
    CENTRE_BITS = 21,
    CENTRE_MAX = (1 << CENTRE_BITS) - 1,
    ROTATION_MAX = 4094, /* an even number, so that 0 has a code */
    DEVIATION_MAX = 4095,
    OPACITY_MAX = 4095,
    COLOUR_MAX = (1 << 14) - 1,
    HARMONIC_MAX = 127,
    CHUNK = 64, /* a multiple of LANES */
    LANES = 4,
};

/* Deviations below exp(-14) of the brick's largest are raised to it. */
#define LOG_RANGE 14.0
#define SQRT_HALF 0.70710678118654752440

/* The cosine of a cone is less by this, since readers round normals in other ways. */
#define CONE_MARGIN 1e-6

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

static uint32_t deviation_code(const trip_file_gaussian_brick *b, float deviation)
{
    if (!(deviation > 0))
        return 0;
    return 1 + (uint32_t)code_of(log((double)deviation), (double)b->log_lo, (double)b->log_hi,
                                 DEVIATION_MAX - 1);
}

/* Values and codes of CHUNK records, so that the compiler codes several at once. */
typedef struct chunk {
    double centre[3][CHUNK], rotation[3][CHUNK], opacity[CHUNK], colour[3][CHUNK];
    uint32_t centre_code[3][CHUNK], rotation_code[3][CHUNK], opacity_code[CHUNK];
    uint32_t colour_code[3][CHUNK], deviation_code[3][CHUNK];
    int64_t largest[CHUNK];     /* of the four numbers of a rotation */
    double deviation[3][CHUNK]; /* decoded */
} chunk;

/* The largest of the four numbers is left out. It is positive after a change of all signs. */
static void load_rotation(chunk *k, unsigned i, const float rotation[4])
{
    int largest = 0;
    for (int n = 1; n < 4; n++)
        largest = fabsf(rotation[n]) > fabsf(rotation[largest]) ? n : largest;
    const double sign = rotation[largest] < 0 ? -1 : 1;
    k->largest[i] = largest;
    for (int n = 0; n < 3; n++)
        k->rotation[n][i] = sign * (double)rotation[n + (n >= largest)];
}

/* Loads records. The last one fills the rest of the chunk. */
static void load_chunk(chunk *k, const trip_file_gaussian_brick *b,
                       const unsigned char *const *splats, unsigned count)
{
    for (unsigned i = 0; i < CHUNK; i++) {
        const trip_gaussian *g = (const void *)splats[i < count ? i : count - 1];
        uint32_t code = 0; /* of the last deviation; often the next one has it too */
        for (int a = 0; a < 3; a++) {
            k->centre[a][i] = g->centre[a];
            k->colour[a][i] = (double)g->sh[0][a];
            if (i < count && (a == 0 || g->deviations[a] != g->deviations[a - 1]))
                code = deviation_code(b, g->deviations[a]);
            k->deviation_code[a][i] = code;
        }
        k->opacity[i] = (double)g->opacity;
        load_rotation(k, i, g->rotation);
    }
}

/* Sets the codes of values in [lo, hi], 0 to `max`. */
static inline void set_codes(const double *restrict values, double lo, double hi, int max,
                             uint32_t *restrict codes)
{
    const double range = hi > lo ? hi - lo : INFINITY;
    for (int i = 0; i < CHUNK; i++) {
        double part = (values[i] - lo) / range;
        part = part < 0 ? 0 : part;
        part = part > 1 ? 1 : part;
        codes[i] = (uint32_t)(int32_t)(part * max + 0.5);
    }
}

static inline void code_chunk(chunk *k, const trip_file_gaussian_brick *b)
{
    for (int a = 0; a < 3; a++) {
        set_codes(k->centre[a], b->centre_lo[a], b->centre_hi[a], CENTRE_MAX, k->centre_code[a]);
        set_codes(k->rotation[a], -SQRT_HALF, SQRT_HALF, ROTATION_MAX, k->rotation_code[a]);
        set_codes(k->colour[a], (double)b->colour_lo[a], (double)b->colour_hi[a], COLOUR_MAX,
                  k->colour_code[a]);
    }
    set_codes(k->opacity, 0, 1, OPACITY_MAX, k->opacity_code);
}

static words pack(const chunk *k, unsigned i)
{
    words r = { { 0 } };
    r.w[1] = (uint64_t)k->largest[i] | (uint64_t)k->opacity_code[i] << 38 |
             (uint64_t)k->colour_code[0][i] << 50;
    for (int a = 0; a < 3; a++) {
        r.w[0] |= (uint64_t)k->centre_code[a][i] << CENTRE_BITS * a;
        r.w[1] |= (uint64_t)k->rotation_code[a][i] << (2 + 12 * a);
        r.w[2] |= (uint64_t)k->deviation_code[a][i] << 12 * a;
    }
    r.w[2] |= (uint64_t)k->colour_code[1][i] << 36 | (uint64_t)k->colour_code[2][i] << 50;
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
    out->two_sided = (uint8_t)bits(r.w[0], 63, 1);
    out->opacity = (float)bits(r.w[1], 38, 12) / OPACITY_MAX;
}

/* Sums of the bounds of records, LANES at once. */
typedef struct reach {
    double lo[3][LANES], hi[3][LANES];
} reach;

static void begin_reach(reach *r, const trip_file_gaussian_brick *b)
{
    for (int a = 0; a < 3; a++)
        for (int l = 0; l < LANES; l++)
            r->lo[a][l] = b->centre_lo[a], r->hi[a][l] = b->centre_hi[a];
}

static void end_reach(const reach *r, trip_file_gaussian_brick *b)
{
    for (int a = 0; a < 3; a++) {
        b->reach_lo[a] = r->lo[a][0], b->reach_hi[a] = r->hi[a][0];
        for (int l = 1; l < LANES; l++) {
            b->reach_lo[a] = fmin(b->reach_lo[a], r->lo[a][l]);
            b->reach_hi[a] = fmax(b->reach_hi[a], r->hi[a][l]);
        }
    }
}

static void decode_deviations(chunk *k, const trip_file_gaussian_brick *b, unsigned count)
{
    for (unsigned i = 0; i < CHUNK; i++)
        for (int a = 0; a < 3; a++)
            k->deviation[a][i] = i >= count ? k->deviation[a][count - 1]
                                 : a > 0 && k->deviation_code[a][i] == k->deviation_code[a - 1][i]
                                     ? k->deviation[a - 1][i]
                                     : (double)decode_deviation(b, k->deviation_code[a][i]);
}

/* Decodes the rotations as decode_rotation() does, by selection instead of jumps. */
static inline void decode_rotations(const chunk *k, double q[4][CHUNK])
{
    for (int i = 0; i < CHUNK; i++) {
        const double u = (k->rotation_code[0][i] * (2.0 / ROTATION_MAX) - 1) * SQRT_HALF,
                     v = (k->rotation_code[1][i] * (2.0 / ROTATION_MAX) - 1) * SQRT_HALF,
                     t = (k->rotation_code[2][i] * (2.0 / ROTATION_MAX) - 1) * SQRT_HALF;
        const double sum = u * u + v * v + t * t, rest = 1 - sum;
        const double most = sqrt(rest > 0 ? rest : 0), length = sqrt(sum),
                     scale = sum < 1 ? 1 : 1 / length;
        const int64_t at = k->largest[i];
        q[0][i] = (double)(float)((at == 0 ? most : u) * scale);
        q[1][i] = (double)(float)((at == 1 ? most : at == 0 ? u : v) * scale);
        q[2][i] = (double)(float)((at == 2 ? most : at < 2 ? v : t) * scale);
        q[3][i] = (double)(float)((at == 3 ? most : t) * scale);
    }
}

/* Sets the extents of CHUNK records along an axis as trip_gaussian_half_extents() does, from a row
 * of their matrices. */
static inline void set_half(const chunk *k, const double *restrict r0, const double *restrict r1,
                            const double *restrict r2, double *restrict half)
{
    for (int i = 0; i < CHUNK; i++) {
        const double x = r0[i] * k->deviation[0][i], y = r1[i] * k->deviation[1][i],
                     z = r2[i] * k->deviation[2][i];
        half[i] = TRIP_GAUSSIAN_REACH * sqrt(x * x + y * y + z * z);
    }
}

static inline void find_halves(const chunk *k, double half[3][CHUNK])
{
    double q[4][CHUNK], r[3][3][CHUNK];
    decode_rotations(k, q);
    for (int i = 0; i < CHUNK; i++) {
        const double w = q[0][i], x = q[1][i], y = q[2][i], z = q[3][i];
        r[0][0][i] = 1 - 2 * (y * y + z * z);
        r[0][1][i] = 2 * (x * y - w * z);
        r[0][2][i] = 2 * (x * z + w * y);
        r[1][0][i] = 2 * (x * y + w * z);
        r[1][1][i] = 1 - 2 * (x * x + z * z);
        r[1][2][i] = 2 * (y * z - w * x);
        r[2][0][i] = 2 * (x * z - w * y);
        r[2][1][i] = 2 * (y * z + w * x);
        r[2][2][i] = 1 - 2 * (x * x + y * y);
    }
    for (int a = 0; a < 3; a++)
        set_half(k, r[a][0], r[a][1], r[a][2], half[a]);
}

static inline void include_along(const uint32_t *restrict codes, const double *restrict half,
                                 double lo, double hi, double *restrict least,
                                 double *restrict most)
{
    const double step = (hi - lo) * (1.0 / CENTRE_MAX);
    for (int i = 0; i < CHUNK; i += LANES)
        for (int l = 0; l < LANES; l++) {
            const double up = lo + (int32_t)codes[i + l] * step, at = up < hi ? up : hi;
            const double below = at - half[i + l], above = at + half[i + l];
            least[l] = below < least[l] ? below : least[l];
            most[l] = above > most[l] ? above : most[l];
        }
}

/* Includes the bounds of the decoded records, since a reader draws them. */
static inline void include_chunk(reach *to, const chunk *k, const trip_file_gaussian_brick *b)
{
    double half[3][CHUNK];
    find_halves(k, half);
    for (int a = 0; a < 3; a++)
        include_along(k->centre_code[a], half[a], b->centre_lo[a], b->centre_hi[a], to->lo[a],
                      to->hi[a]);
}

static float most_opacity(const chunk *k)
{
    uint32_t most = 0;
    for (int i = 0; i < CHUNK; i++)
        most = k->opacity_code[i] > most ? k->opacity_code[i] : most;
    return (float)most / OPACITY_MAX;
}

/* Codes up to CHUNK records and includes their bounds. */
TRIP_ALSO_V3
static void encode_chunk(trip_file_gaussian_brick *b, reach *to, const unsigned char *const *splats,
                         unsigned count, unsigned char *plane)
{
    chunk k;
    load_chunk(&k, b, splats, count);
    code_chunk(&k, b);
    for (unsigned i = 0; i < count; i++) {
        const words r = pack(&k, i);
        memcpy(plane + i * sizeof r, &r, sizeof r);
    }
    decode_deviations(&k, b, count);
    include_chunk(to, &k, b);
    const float opacity = most_opacity(&k);
    b->opacity_max = opacity > b->opacity_max ? opacity : b->opacity_max;
}

/* Marks the records of surfels without a front side. */
static void mark_sides(const unsigned char *const *splats, unsigned count, unsigned char *plane)
{
    for (unsigned i = 0; i < count; i++) {
        unsigned char *record = plane + (size_t)i * TRIP_GAUSSIAN_RECORD_BYTES;
        words r = load(record);
        r.w[0] |= (uint64_t)((const trip_gaussian *)(const void *)splats[i])->two_sided << 63;
        memcpy(record, &r, sizeof r);
    }
}

/* Returns the decoded normal. A third deviation of 0 is the least one. */
static trip_vec3 normal_of(const trip_file_gaussian_brick *b, const unsigned char *record)
{
    const words r = load(record);
    trip_gaussian g = { .opacity = 0 };
    if (bits(r.w[2], 24, 12))
        decode_shape(b, r, &g);
    else
        decode_rotation(r.w[1], g.rotation);
    return trip_surfel_normal(&g);
}

/* Returns the sum of the decoded normals, or 0 if a surfel has no front side. */
static trip_vec3 sum_normals(const trip_file_gaussian_brick *b, const unsigned char *records,
                             unsigned count)
{
    trip_vec3 sum = trip_v3(0, 0, 0);
    for (unsigned i = 0; i < count; i++) {
        const unsigned char *record = records + (size_t)i * TRIP_GAUSSIAN_RECORD_BYTES;
        if (bits(load(record).w[0], 63, 1))
            return trip_v3(0, 0, 0);
        sum = trip_add(sum, normal_of(b, record));
    }
    return sum;
}

/* Sets the cone that holds the decoded normals. It has none if it would reach 90 degrees. */
static void find_cone(trip_file_gaussian_brick *b, const unsigned char *records, unsigned count)
{
    const trip_vec3 sum = sum_normals(b, records, count);
    double least = 1;
    if (!(trip_length(sum) > 0))
        return;
    const trip_vec3 mean = trip_normalize(sum);
    const float axis[3] = { (float)mean.x, (float)mean.y, (float)mean.z };
    const trip_vec3 rounded =
        trip_normalize(trip_v3((double)axis[0], (double)axis[1], (double)axis[2]));
    for (unsigned i = 0; i < count && least > 0; i++)
        least = fmin(least,
                     trip_dot(rounded, trip_normalize(normal_of(
                                           b, records + (size_t)i * TRIP_GAUSSIAN_RECORD_BYTES))));
    const float cosine = nextafterf((float)(least - CONE_MARGIN), -1);
    if (!(cosine > 0))
        return;
    memcpy(b->cone_axis, axis, sizeof axis);
    b->cone_cosine = cosine;
}

void trip_gaussian_encode(trip_file_gaussian_brick *b, const trip_file_gaussian_header *h,
                          const unsigned char *const *splats, unsigned count,
                          unsigned char *const planes[])
{
    const int degree = (int)h->degree, own = h->flags & TRIP_GAUSSIAN_PALETTE ? 0 : degree;
    const unsigned plane_count = trip_gaussian_plane_count(h, degree);
    const bool has_sides = trip_gaussian_has_sides(h);
    reach bounds;
    find_ranges(b, splats, count, own);
    b->records = count;
    b->opacity_max = 0;
    begin_reach(&bounds, b);
    for (unsigned i = 0; i < count; i += CHUNK)
        encode_chunk(b, &bounds, splats + i, count - i < CHUNK ? count - i : CHUNK,
                     planes[0] + (size_t)i * TRIP_GAUSSIAN_RECORD_BYTES);
    end_reach(&bounds, b);
    if (has_sides) {
        mark_sides(splats, count, planes[0]);
        find_cone(b, planes[0], count);
    }
    for (unsigned i = 0; i < count && own > 0; i++)
        for (int n = 1; n <= own; n++)
            pack_harmonics(b->scale[n - 1], ((const trip_gaussian *)(const void *)splats[i])->sh, n,
                           planes[n] + i * trip_gaussian_plane_bytes(h, (unsigned)n));
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
    out->hidden = 0;
    trip_gaussian_decode_centre(b, record, out->centre);
    decode_shape(b, r, out);
    out->sh[0][0] = decode_colour(b, bits(r.w[1], 50, 14), 0);
    out->sh[0][1] = decode_colour(b, bits(r.w[2], 36, 14), 1);
    out->sh[0][2] = decode_colour(b, bits(r.w[2], 50, 14), 2);
    for (int n = 1; n <= degree; n++)
        harmonics = unpack_harmonics(b->scale[n - 1], harmonics, n, out->sh);
}

/* Returns whether the cone of a brick holds the normal of a record. */
static bool is_in_cone(const trip_file_gaussian_brick *b, const unsigned char *record)
{
    const trip_vec3 n = normal_of(b, record);
    const trip_vec3 axis =
        trip_v3((double)b->cone_axis[0], (double)b->cone_axis[1], (double)b->cone_axis[2]);
    return trip_dot(n, axis) >=
           ((double)b->cone_cosine - CONE_MARGIN) * trip_length(n) * trip_length(axis);
}

const char *trip_gaussian_record_fault(const trip_file_gaussian_brick *b,
                                       const trip_file_gaussian_header *h,
                                       const unsigned char *record)
{
    const words r = load(record);
    const bool two_sided = r.w[0] >> 63;
    if (two_sided && !trip_gaussian_has_sides(h))
        return "a record without sides has the bit for two sides";
    for (unsigned at = 2; at < 38; at += 12)
        if (bits(r.w[1], at, 12) > ROTATION_MAX)
            return "the rotation of a record has an invalid code";
    if (b->cone_cosine > 0 && (two_sided || !is_in_cone(b, record)))
        return "the normal of a record is outside the cone of its brick";
    return NULL;
}

uint32_t trip_gaussian_centre_code(const unsigned char *record, int axis)
{
    return bits(load(record).w[0], (unsigned)(CENTRE_BITS * axis), CENTRE_BITS);
}
