/* Prepares the rasters of sheets: ranges of codes, gradients, sample planes between sheets.
 * Included by table_tmpl.h after simd_tmpl.h. A vector here has eight numbers of 16 bits, one row
 * of a square. tests/render/test_cpu_sheets.c checks that all instruction sets give the same
 * numbers. Functions with several callers are not inlined, so that profilers show their cost. */
#ifndef TRIP_CPU_SAMPLE_H
#define TRIP_CPU_SAMPLE_H

#include "cpu/kernels/kernels.h"
#include "cpu/kernels/simd_tmpl.h"

typedef int16_t vh __attribute__((vector_size(16)));
typedef uint16_t vhu __attribute__((vector_size(16)));

INLINE vh vh_load(const int16_t *p)
{
    vh a;
    memcpy(&a, p, sizeof a);
    return a;
}

INLINE void vh_store(int16_t *p, vh a)
{
    memcpy(p, &a, sizeof a);
}

INLINE vh vh_set(int16_t x)
{
    return x - (vh){ 0 };
}

/* Returns b where m is set, otherwise a. */
INLINE vh vh_select(vh m, vh a, vh b)
{
    return (m & b) | (~m & a);
}

/* Returns a - 1 modulo 2^16. */
INLINE vh vh_less_1(vh a)
{
    return (vh)((vhu)a - 1);
}

INLINE vh vh_is_missing(vh a)
{
    return (vh)(a == TRIP_CPU_CODE_MISSING);
}

/* Returns (a + b) / 2, rounded down. */
INLINE vh vh_mean(vh a, vh b)
{
    return (a & b) + ((a ^ b) >> 1);
}

#if TRIP_SIMD == TRIP_SIMD_AVX2 || TRIP_SIMD == TRIP_SIMD_AVX512

INLINE vh vh_min(vh a, vh b)
{
    return (vh)_mm_min_epi16((__m128i)a, (__m128i)b);
}

INLINE vh vh_max(vh a, vh b)
{
    return (vh)_mm_max_epi16((__m128i)a, (__m128i)b);
}

/* Returns (a - b) / 2, rounded down. The instruction computes the mean of a and -1 - b, rounded up.
 */
INLINE vh vh_half_difference(vh a, vh b)
{
    const vh min = vh_set(INT16_MIN);
    return (vh)_mm_avg_epu16((__m128i)(a ^ min), (__m128i)(b ^ ~min)) ^ min;
}

INLINE unsigned vh_bits(vh m)
{
    return (unsigned)_mm_movemask_epi8(_mm_packs_epi16((__m128i)m, _mm_setzero_si128()));
}

/* Returns (a (16384 - w) + b w) / 16384, rounded down. `weights` is w << 16 | 16384 - w. */
INLINE vh vh_between(vh a, vh b, int32_t weights)
{
    const __m128i w = _mm_set1_epi32(weights);
    __m128i low = _mm_madd_epi16(_mm_unpacklo_epi16((__m128i)a, (__m128i)b), w);
    __m128i high = _mm_madd_epi16(_mm_unpackhi_epi16((__m128i)a, (__m128i)b), w);
    return (vh)_mm_packs_epi32(_mm_srai_epi32(low, 14), _mm_srai_epi32(high, 14));
}

INLINE int16_t vh_lowest(vh a)
{
    __m128i m = _mm_minpos_epu16(_mm_xor_si128((__m128i)a, _mm_set1_epi16(INT16_MIN)));
    return (int16_t)(_mm_cvtsi128_si32(m) ^ INT16_MIN);
}

/* Interleaves the numbers of a, b and c. */
INLINE void vh_store_3(int16_t *p, vh a, vh b, vh c)
{
#define TURN(a0, a1, a2, a3, a4, a5, a6, a7)                                                       \
    _mm_setr_epi8(a0, a0 < 0 ? -1 : a0 + 1, a1, a1 < 0 ? -1 : a1 + 1, a2, a2 < 0 ? -1 : a2 + 1,    \
                  a3, a3 < 0 ? -1 : a3 + 1, a4, a4 < 0 ? -1 : a4 + 1, a5, a5 < 0 ? -1 : a5 + 1,    \
                  a6, a6 < 0 ? -1 : a6 + 1, a7, a7 < 0 ? -1 : a7 + 1)
#define THIRD(i, of_a, of_b, of_c)                                                                 \
    _mm_storeu_si128((void *)(p + 8 * (i)),                                                        \
                     _mm_or_si128(_mm_or_si128(_mm_shuffle_epi8((__m128i)a, of_a),                 \
                                               _mm_shuffle_epi8((__m128i)b, of_b)),                \
                                  _mm_shuffle_epi8((__m128i)c, of_c)))
    THIRD(0, TURN(0, -1, -1, 2, -1, -1, 4, -1), TURN(-1, 0, -1, -1, 2, -1, -1, 4),
          TURN(-1, -1, 0, -1, -1, 2, -1, -1));
    THIRD(1, TURN(-1, 6, -1, -1, 8, -1, -1, 10), TURN(-1, -1, 6, -1, -1, 8, -1, -1),
          TURN(4, -1, -1, 6, -1, -1, 8, -1));
    THIRD(2, TURN(-1, -1, 12, -1, -1, 14, -1, -1), TURN(10, -1, -1, 12, -1, -1, 14, -1),
          TURN(-1, 10, -1, -1, 12, -1, -1, 14));
#undef THIRD
#undef TURN
}

#else

INLINE vh vh_min(vh a, vh b)
{
    return vh_select((vh)(b < a), a, b);
}

INLINE vh vh_max(vh a, vh b)
{
    return vh_select((vh)(b > a), a, b);
}

/* Returns (a - b) / 2, rounded down. */
INLINE vh vh_half_difference(vh a, vh b)
{
    return (vh)((vhu)(a >> 1) - (vhu)(b >> 1) - (vhu)(~a & b & 1));
}

INLINE unsigned vh_bits(vh m)
{
    unsigned bits = 0;
    for (unsigned i = 0; i < 8; i++)
        bits |= (unsigned)(m[i] & 1) << i;
    return bits;
}

INLINE vh vh_between(vh a, vh b, int32_t weights)
{
    int w = weights >> 16, rest = weights & 0xffff;
    for (int i = 0; i < 8; i++)
        a[i] = (int16_t)((a[i] * rest + b[i] * w) >> 14);
    return a;
}

INLINE int16_t vh_lowest(vh a)
{
    int16_t min = a[0];
    for (int i = 1; i < 8; i++)
        min = a[i] < min ? a[i] : min;
    return min;
}

INLINE void vh_store_3(int16_t *p, vh a, vh b, vh c)
{
    for (int i = 0; i < 8; i++) {
        p[3 * i] = a[i];
        p[3 * i + 1] = b[i];
        p[3 * i + 2] = c[i];
    }
}

#endif

static_assert(sizeof(trip_cpu_gradient) == 3 * sizeof(int16_t), "three numbers in a row");

#if TRIP_SIMD == TRIP_SIMD_AVX512 && defined(__AVX512VBMI2__)

/* Morton numbers of the voxels of four rows of a square, row by row. */
#define ROW8(n) (n), (n) + 1, (n) + 4, (n) + 5, (n) + 16, (n) + 17, (n) + 20, (n) + 21
typedef int16_t four_rows __attribute__((vector_size(64)));
static const four_rows morton_of_rows = { ROW8(0), ROW8(2), ROW8(8), ROW8(10) };
#undef ROW8

/* Writes the voxels of four rows that have a bit in `mask`. Other threads may write the other
 * voxels meanwhile. */
INLINE void decode_rows(const uint16_t codes[32], uint32_t mask, int16_t *to)
{
    const four_rows missing = (four_rows){ 0 } + TRIP_CPU_CODE_MISSING;
    four_rows at = (four_rows)_mm512_maskz_expand_epi16(mask, _mm512_loadu_si512(codes));
    at = (at - (at == 0)) ^ INT16_MIN;
    at = (four_rows)_mm512_mask_mov_epi16((__m512i)missing, mask, (__m512i)at);
    const __m512i rows = _mm512_permutexvar_epi16((__m512i)morton_of_rows, (__m512i)at);
    const uint32_t bits = _mm512_cmpneq_epi16_mask(rows, (__m512i)missing);
#define STORE_ROW(i)                                                                               \
    _mm_mask_storeu_epi16(to + (i)*TRIP_CPU_RASTER_STRIDE, (__mmask8)(bits >> 8 * (i)),            \
                          _mm512_extracti32x4_epi32(rows, i))
    STORE_ROW(0);
    STORE_ROW(1);
    STORE_ROW(2);
    STORE_ROW(3);
#undef STORE_ROW
}

static void sheet_decode(const uint16_t codes[64 + 32], uint64_t mask, int16_t *to)
{
    const uint32_t first = (uint32_t)mask;
    decode_rows(codes, first, to);
    decode_rows(codes + __builtin_popcount(first), (uint32_t)(mask >> 32),
                to + 4 * TRIP_CPU_RASTER_STRIDE);
}

#else

static void sheet_decode(const uint16_t codes[64 + 32], uint64_t mask, int16_t *to)
{
    int16_t biased[64];
    const int16_t *next = biased;
    for (int i = 0; i < 64; i++)
        biased[i] = (int16_t)((codes[i] + (codes[i] == 0)) ^ TRIP_CPU_CODE_BIAS);
    if (mask == UINT64_MAX) { /* each pair of voxels is adjacent in a row */
        for (unsigned i = 0; i < 64; i += 2)
            memcpy(to + trip_cpu_places[i], biased + i, 2 * sizeof *biased);
        return;
    }
    for (uint64_t rest = mask; rest; rest &= rest - 1)
        to[trip_cpu_places[__builtin_ctzll(rest)]] = *next++;
}

#endif

INLINE int square_first(int square)
{
    return square / TRIP_CPU_SQUARES_ACROSS * 8 * TRIP_CPU_RASTER_STRIDE +
           square % TRIP_CPU_SQUARES_ACROSS * 8;
}

/* Returns the minimum code that is not missing in a square, or INT16_MAX if all are missing. The
 * square must have a missing voxel. */
static int16_t min_there(const int16_t *at)
{
    /* A missing code is the minimum of the type, so a missing code - 1 is the maximum. */
    vh min = vh_set(INT16_MAX);
    for (int row = 0; row < 9; row++, at += TRIP_CPU_RASTER_STRIDE)
        min = vh_min(min, vh_min(vh_less_1(vh_load(at)), vh_less_1(vh_load(at + 1))));
    int low = vh_lowest(min);
    return (int16_t)(low == INT16_MAX ? low : low + 1);
}

static void sheet_ranges(const trip_cpu_voxels *raster, uint64_t squares,
                         trip_cpu_square_ranges *out)
{
    for (int i = 0; i < 64; i++) {
        out->min[i] = INT16_MAX;
        out->max[i] = INT16_MIN;
    }
    for (uint64_t rest = squares; rest; rest &= rest - 1) {
        const int square = __builtin_ctzll(rest);
        const int16_t *first = raster->codes + square_first(square), *at = first;
        vh min = vh_set(INT16_MAX), max = vh_set(INT16_MIN);
        for (int row = 0; row < 9; row++, at += TRIP_CPU_RASTER_STRIDE) {
            vh a = vh_load(at), b = vh_load(at + 1);
            max = vh_max(max, vh_max(a, b));
            min = vh_min(min, vh_min(a, b));
        }
        out->min[square] = vh_lowest(min);
        out->max[square] = (int16_t)~vh_lowest(~max);
        if (out->min[square] == TRIP_CPU_CODE_MISSING)
            out->min[square] = min_there(first);
    }
}

/* Minimum and maximum of two neighbouring voxels over two sheets. */
typedef struct extremes {
    vh min, max;
} extremes;

INLINE extremes extremes_at(const int16_t *from, const int16_t *to)
{
    vh a = vh_load(from), b = vh_load(from + 1), c = vh_load(to), d = vh_load(to + 1);
    return (extremes){ vh_min(vh_min(a, b), vh_min(c, d)), vh_max(vh_max(a, b), vh_max(c, d)) };
}

/* Returns the minimum code that is not missing for each cell of a row. `lack` marks cells that have
 * all four corners in neither sheet. */
static __attribute__((noinline)) vh min_of_faces(const int16_t *from, const int16_t *to, vh *lack)
{
    vh min = vh_set(INT16_MAX), faces = vh_set(0);
    for (int sheet = 0; sheet < 2; sheet++) {
        const int16_t *at = sheet ? to : from;
        vh face = vh_set(INT16_MIN);
        for (int n = 0; n < 4; n++) {
            /* A missing code - 1 is the maximum of the type. */
            vh code = vh_less_1(vh_load(at + n / 2 * TRIP_CPU_RASTER_STRIDE + n % 2));
            min = vh_min(min, code);
            face = vh_max(face, code);
        }
        faces |= (vh)(face != INT16_MAX);
    }
    *lack = ~faces;
    return (vh)((vhu)min + 1);
}

static void sheet_cells(const trip_cpu_voxels *from, const trip_cpu_voxels *to, uint64_t squares,
                        int16_t min, int16_t max, trip_cpu_cells *out)
{
    const vh lowest = vh_set(min), highest = vh_set(max);
    *out = (trip_cpu_cells){ .rows = { 0 } };
    for (uint64_t rest = squares; rest; rest &= rest - 1) {
        int square = __builtin_ctzll(rest), at = square_first(square);
        int u = square % TRIP_CPU_SQUARES_ACROSS * 8;
        uint64_t *row = out->rows + square / TRIP_CPU_SQUARES_ACROSS * 8;
        extremes above = extremes_at(from->codes + at, to->codes + at);
        for (int v = 0; v < 8; v++) {
            at += TRIP_CPU_RASTER_STRIDE;
            extremes below = extremes_at(from->codes + at, to->codes + at);
            vh low = vh_min(above.min, below.min), high = vh_max(above.max, below.max);
            vh lack = vh_is_missing(low), below_all = (vh)(lowest > high);
            if (vh_bits(lack & ~below_all))
                low = min_of_faces(from->codes + at - TRIP_CPU_RASTER_STRIDE,
                                   to->codes + at - TRIP_CPU_RASTER_STRIDE, &lack);
            vh out_of = (vh)(low > highest) | below_all | lack;
            row[v] |= (uint64_t)(~vh_bits(out_of) & 0xff) << u;
            above = below;
        }
    }
}

/* The voxels before and behind eight voxels, along u, v and the sheets. */
typedef struct neighbours {
    vh before[3], behind[3];
} neighbours;

INLINE bool all_are_missing(vh codes)
{
    return vh_bits(vh_is_missing(codes)) == 0xff;
}

INLINE bool some_is_missing(const neighbours *n)
{
    vh min = vh_min(n->before[0], n->behind[0]);
    for (int a = 1; a < 3; a++)
        min = vh_min(min, vh_min(n->before[a], n->behind[a]));
    return vh_bits(vh_is_missing(min)) != 0;
}

/* Returns half of the central differences. If a neighbour is missing, it is half of the difference
 * to the other one. */
INLINE vh differences(vh codes, vh below, vh above)
{
    vh no_below = vh_is_missing(below), no_above = vh_is_missing(above);
    below = vh_select(no_below, below, codes);
    above = vh_select(no_above, above, codes);
    vh half = vh_half_difference(above, below);
    return vh_select(no_below | no_above, half >> 1, half);
}

/* Returns the difference of the indicators of a code at the neighbours: 1, 0 or -1. */
INLINE vh outline(vh codes, vh below, vh above)
{
    return (vh)(below == codes) - (vh)(above == codes);
}

/* Finds gradients, or with `outlines` the gradients of outlines. */
INLINE void squares_gradients(trip_cpu_voxels *raster, uint64_t squares, bool outlines,
                              const trip_cpu_voxels *left, const trip_cpu_voxels *above,
                              const trip_cpu_voxels *sheet_before,
                              const trip_cpu_voxels *sheet_behind)
{
    /* The voxels before the first column and row come from the neighbouring rasters. */
    int16_t first[8];
    for (uint64_t rest = squares; rest; rest &= rest - 1) {
        int square = __builtin_ctzll(rest);
        int u = square % TRIP_CPU_SQUARES_ACROSS * 8, v0 = square / TRIP_CPU_SQUARES_ACROSS * 8;
        for (int v = v0; v < v0 + 8; v++) {
            int i = v * TRIP_CPU_RASTER_STRIDE + u;
            const int16_t *at = raster->codes + i;
            const int16_t *to_left = at - 1, *before = at - TRIP_CPU_RASTER_STRIDE;
            if (all_are_missing(vh_load(at)))
                continue;
            if (v == 0)
                before = above->codes + 63 * TRIP_CPU_RASTER_STRIDE + u;
            if (u == 0) {
                first[0] = left->codes[v * TRIP_CPU_RASTER_STRIDE + 63];
                memcpy(first + 1, at, 7 * sizeof *first);
                to_left = first;
            }
            const neighbours n = {
                { vh_load(to_left), vh_load(before), vh_load(sheet_before->codes + i) },
                { vh_load(at + 1), vh_load(at + TRIP_CPU_RASTER_STRIDE),
                  vh_load(sheet_behind->codes + i) },
            };
            const bool lacks = !outlines && some_is_missing(&n);
            vh d[3];
            for (int a = 0; a < 3; a++)
                d[a] = outlines ? outline(vh_load(at), n.before[a], n.behind[a])
                       : lacks  ? differences(vh_load(at), n.before[a], n.behind[a])
                                : vh_half_difference(n.behind[a], n.before[a]) >> 1;
            vh_store_3((int16_t *)&raster->gradients[i], d[0], d[1], d[2]);
        }
    }
}

static __attribute__((noinline)) void sheet_gradients(trip_cpu_voxels *raster, uint64_t squares,
                                                      const trip_cpu_voxels *left,
                                                      const trip_cpu_voxels *above,
                                                      const trip_cpu_voxels *sheet_before,
                                                      const trip_cpu_voxels *sheet_behind)
{
    squares_gradients(raster, squares, false, left, above, sheet_before, sheet_behind);
}

static __attribute__((noinline)) void sheet_outlines(trip_cpu_voxels *raster, uint64_t squares,
                                                     const trip_cpu_voxels *left,
                                                     const trip_cpu_voxels *above,
                                                     const trip_cpu_voxels *sheet_before,
                                                     const trip_cpu_voxels *sheet_behind)
{
    squares_gradients(raster, squares, true, left, above, sheet_before, sheet_behind);
}

INLINE vh mean_or_between(vh a, vh b, int32_t weights)
{
    return weights == (8192 << 16 | 8192) ? vh_mean(a, b) : vh_between(a, b, weights);
}

/* Interpolates eight voxels from `at` on. */
INLINE void voxels_between(const trip_cpu_voxels *from, const trip_cpu_voxels *to, int at,
                           int32_t weights, unsigned parts, trip_cpu_voxels *out)
{
    vh a = vh_load(from->codes + at), b = vh_load(to->codes + at);
    vh missing = vh_is_missing(a) | vh_is_missing(b);
    if (parts & TRIP_CPU_PART_CODES)
        vh_store(out->codes + at,
                 vh_select(missing, mean_or_between(a, b, weights), vh_set(TRIP_CPU_CODE_MISSING)));
    const bool gradients = parts & TRIP_CPU_PART_GRADIENTS && vh_bits(missing) != 0xff;
    const int16_t *c = (const int16_t *)&from->gradients[at];
    const int16_t *d = (const int16_t *)&to->gradients[at];
    int16_t *numbers = (int16_t *)&out->gradients[at];
    for (int i = 0; i < 24 && gradients; i += 8)
        vh_store(numbers + i, mean_or_between(vh_load(c + i), vh_load(d + i), weights));
}

INLINE int16_t number_between(int16_t a, int16_t b, int32_t weights)
{
    return (int16_t)((a * (weights & 0xffff) + b * (weights >> 16)) >> 14);
}

INLINE void voxel_between(const trip_cpu_voxels *from, const trip_cpu_voxels *to, int at,
                          int32_t weights, unsigned parts, trip_cpu_voxels *out)
{
    const int16_t a = from->codes[at], b = to->codes[at];
    const bool missing = a == TRIP_CPU_CODE_MISSING || b == TRIP_CPU_CODE_MISSING;
    if (parts & TRIP_CPU_PART_CODES)
        out->codes[at] = missing ? TRIP_CPU_CODE_MISSING : number_between(a, b, weights);
    for (int i = 0; i < 3 && parts & TRIP_CPU_PART_GRADIENTS; i++)
        out->gradients[at].along[i] =
            number_between(from->gradients[at].along[i], to->gradients[at].along[i], weights);
}

INLINE void squares_between(const trip_cpu_voxels *from, const trip_cpu_voxels *to,
                            uint64_t squares, int32_t weights, unsigned parts, trip_cpu_voxels *out)
{
    const int last = TRIP_CPU_SQUARES_ACROSS - 1;
    for (uint64_t rest = squares; rest; rest &= rest - 1) {
        const int square = __builtin_ctzll(rest);
        const int rows = square / TRIP_CPU_SQUARES_ACROSS == last ? 9 : 8;
        int at = square_first(square);
        for (int row = 0; row < rows; row++, at += TRIP_CPU_RASTER_STRIDE) {
            voxels_between(from, to, at, weights, parts, out);
            if (square % TRIP_CPU_SQUARES_ACROSS == last)
                voxel_between(from, to, at + 8, weights, parts, out);
        }
    }
}

/* Interpolates the deviations of squares as squares_between() interpolates codes. */
static __attribute__((noinline)) void sheet_deviations_between(const int16_t *from,
                                                               const int16_t *to, uint64_t squares,
                                                               int32_t weights, int16_t *out)
{
    const int last = TRIP_CPU_SQUARES_ACROSS - 1;
    for (uint64_t rest = squares; rest; rest &= rest - 1) {
        const int square = __builtin_ctzll(rest);
        const int rows = square / TRIP_CPU_SQUARES_ACROSS == last ? 9 : 8;
        int at = square_first(square);
        for (int row = 0; row < rows; row++, at += TRIP_CPU_RASTER_STRIDE) {
            vh_store(out + at, mean_or_between(vh_load(from + at), vh_load(to + at), weights));
            if (square % TRIP_CPU_SQUARES_ACROSS == last)
                out[at + 8] = number_between(from[at + 8], to[at + 8], weights);
        }
    }
}

/* Returns the least row with a deviation of at least this one. */
INLINE uint8_t row_that_suffices(int16_t deviation)
{
    enum { LAST = TRIP_CPU_BLURRED_ROWS - 1 };
    const float d = (float)deviation / (255 * TRIP_CPU_DEVIATION_PARTS);
    const float at = (LAST + TRIP_CPU_BLURRED_BEFORE) * sqrtf(d) - TRIP_CPU_BLURRED_BEFORE;
    const int row = at > 1 ? (int)ceilf(at + 1e-3f) : 1;
    return (uint8_t)(deviation <= 0 ? 0 : row < LAST ? row : LAST);
}

static void sheet_rows(const int16_t *deviations, uint64_t squares, uint8_t out[64])
{
    memset(out, 0, 64);
    for (uint64_t rest = squares; rest; rest &= rest - 1) {
        const int square = __builtin_ctzll(rest);
        const int16_t *at = deviations + square_first(square);
        vh max = vh_set(0);
        for (int row = 0; row < 9; row++, at += TRIP_CPU_RASTER_STRIDE)
            max = vh_max(max, vh_max(vh_load(at), vh_load(at + 1)));
        out[square] = row_that_suffices((int16_t)~vh_lowest(~max));
    }
}

static __attribute__((noinline)) void sheet_between(const trip_cpu_voxels *from,
                                                    const trip_cpu_voxels *to, uint64_t squares,
                                                    int32_t weights, unsigned parts,
                                                    trip_cpu_voxels *out)
{
    const int32_t halves = 8192 << 16 | 8192;
    if (weights == halves && parts == TRIP_CPU_PART_CODES)
        squares_between(from, to, squares, halves, TRIP_CPU_PART_CODES, out);
    else if (weights == halves && parts == TRIP_CPU_PART_GRADIENTS)
        squares_between(from, to, squares, halves, TRIP_CPU_PART_GRADIENTS, out);
    else
        squares_between(from, to, squares, weights, parts, out);
}

#endif
