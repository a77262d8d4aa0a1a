/* Kernels that prepare the blocks of sheets: ranges of codes, gradients, slices between sheets.
 * Included by table_tmpl.h after simd_tmpl.h. A vector here is of HV voxels, four numbers of 16
 * bits each; tests/render/test_cpu_sheets.c holds every instruction set to the same numbers. */
#ifndef TRIP_CPU_SLICE_H
#define TRIP_CPU_SLICE_H

#include "cpu/kernels/kernels.h"
#include "cpu/kernels/simd_tmpl.h"

#if TRIP_SIMD == TRIP_SIMD_AVX2 || TRIP_SIMD == TRIP_SIMD_AVX512

#define HV 4
typedef __m256i vh;

INLINE vh vh_load(const trip_cpu_voxel *p)
{
    return _mm256_loadu_si256((const void *)p);
}

INLINE void vh_store(trip_cpu_voxel *p, vh a)
{
    _mm256_storeu_si256((void *)p, a);
}

INLINE vh vh_set(int16_t x)
{
    return _mm256_set1_epi16(x);
}

INLINE vh vh_min(vh a, vh b)
{
    return _mm256_min_epi16(a, b);
}

INLINE vh vh_max(vh a, vh b)
{
    return _mm256_max_epi16(a, b);
}

/* Modulo 2^16. */
INLINE vh vh_less_1(vh a)
{
    return _mm256_sub_epi16(a, _mm256_set1_epi16(1));
}

INLINE vh vh_is_missing(vh a)
{
    return _mm256_cmpeq_epi16(a, _mm256_set1_epi16(TRIP_CPU_CODE_MISSING));
}

INLINE vh vh_greater(vh a, vh b)
{
    return _mm256_cmpgt_epi16(a, b);
}

/* A bit for each voxel of which the code's number is set. */
INLINE unsigned vh_code_bits(vh m)
{
    return ((unsigned)_mm256_movemask_epi8(m) & 0x01010101u) * 0x10204080u >> 28;
}

/* b where m is set, else a. */
INLINE vh vh_select(vh m, vh a, vh b)
{
    return _mm256_blendv_epi8(a, b, m);
}

INLINE vh vh_or(vh a, vh b)
{
    return _mm256_or_si256(a, b);
}

/* The first number of each voxel in place of all four; or in one place alone, the rest 0. */
INLINE vh vh_codes(vh a)
{
    return _mm256_shuffle_epi8(a, _mm256_broadcastsi128_si256(_mm_setr_epi8(
                                      0, 1, 0, 1, 0, 1, 0, 1, 8, 9, 8, 9, 8, 9, 8, 9)));
}

INLINE vh vh_code_at_1(vh a)
{
    return _mm256_shuffle_epi8(a, _mm256_broadcastsi128_si256(_mm_setr_epi8(
                                      -1, -1, 0, 1, -1, -1, -1, -1, -1, -1, 8, 9, -1, -1, -1, -1)));
}

INLINE vh vh_code_at_2(vh a)
{
    return _mm256_shuffle_epi8(a, _mm256_broadcastsi128_si256(_mm_setr_epi8(
                                      -1, -1, -1, -1, 0, 1, -1, -1, -1, -1, -1, -1, 8, 9, -1, -1)));
}

INLINE vh vh_code_at_3(vh a)
{
    return _mm256_shuffle_epi8(a, _mm256_broadcastsi128_si256(_mm_setr_epi8(
                                      -1, -1, -1, -1, -1, -1, 0, 1, -1, -1, -1, -1, -1, -1, 8, 9)));
}

/* The code of a, the rest of b. */
INLINE vh vh_with_gradients(vh a, vh b)
{
    return _mm256_blend_epi16(b, a, 0x11);
}

/* Sums and differences that end at the greatest and least number. */
INLINE vh vh_adds(vh a, vh b)
{
    return _mm256_adds_epi16(a, b);
}

INLINE vh vh_subs(vh a, vh b)
{
    return _mm256_subs_epi16(a, b);
}

/* (a - b) / 2, rounded down: the mean of a and 65535 - b of numbers without a sign, rounded up, is
 * (a - b + 65536) / 2. */
INLINE vh vh_half_difference(vh a, vh b)
{
    const vh sign = _mm256_set1_epi16(INT16_MIN);
    vh above = _mm256_xor_si256(a, sign);
    vh below = _mm256_xor_si256(b, _mm256_set1_epi16(INT16_MAX));
    return _mm256_xor_si256(_mm256_avg_epu16(above, below), sign);
}

/* (a (16384 - w) + b w) / 16384, rounded down; `weights` is w << 16 | 16384 - w. */
INLINE vh vh_between(vh a, vh b, int32_t weights)
{
    const vh w = _mm256_set1_epi32(weights);
    vh low = _mm256_srai_epi32(_mm256_madd_epi16(_mm256_unpacklo_epi16(a, b), w), 14);
    vh high = _mm256_srai_epi32(_mm256_madd_epi16(_mm256_unpackhi_epi16(a, b), w), 14);
    return _mm256_packs_epi32(low, high);
}

/* The least of the codes of a vector. */
INLINE int16_t vh_least_code(vh a)
{
    __m128i b = _mm_min_epi16(_mm256_castsi256_si128(a), _mm256_extracti128_si256(a, 1));
    b = _mm_min_epi16(b, _mm_unpackhi_epi64(b, b));
    return (int16_t)_mm_cvtsi128_si32(b);
}

INLINE int16_t vh_most_code(vh a)
{
    __m128i b = _mm_max_epi16(_mm256_castsi256_si128(a), _mm256_extracti128_si256(a, 1));
    b = _mm_max_epi16(b, _mm_unpackhi_epi64(b, b));
    return (int16_t)_mm_cvtsi128_si32(b);
}

#else

#define HV 2
typedef int16_t vh __attribute__((vector_size(16)));
typedef uint16_t vhu __attribute__((vector_size(16)));

INLINE vh vh_load(const trip_cpu_voxel *p)
{
    vh a;
    memcpy(&a, p, sizeof a);
    return a;
}

INLINE void vh_store(trip_cpu_voxel *p, vh a)
{
    memcpy(p, &a, sizeof a);
}

INLINE vh vh_set(int16_t x)
{
    return x - (vh){ 0 };
}

INLINE vh vh_or(vh a, vh b)
{
    return a | b;
}

INLINE vh vh_select(vh m, vh a, vh b)
{
    return (m & b) | (~m & a);
}

INLINE vh vh_min(vh a, vh b)
{
    return vh_select((vh)(b < a), a, b);
}

INLINE vh vh_max(vh a, vh b)
{
    return vh_select((vh)(b > a), a, b);
}

INLINE vh vh_less_1(vh a)
{
    return (vh)((vhu)a - 1);
}

INLINE vh vh_is_missing(vh a)
{
    return (vh)(a == TRIP_CPU_CODE_MISSING);
}

INLINE vh vh_greater(vh a, vh b)
{
    return (vh)(a > b);
}

INLINE unsigned vh_code_bits(vh m)
{
    return (m[0] & 1u) | (m[4] & 2u);
}

INLINE vh vh_codes(vh a)
{
    return (vh){ a[0], a[0], a[0], a[0], a[4], a[4], a[4], a[4] };
}

INLINE vh vh_code_at_1(vh a)
{
    return (vh){ 0, a[0], 0, 0, 0, a[4], 0, 0 };
}

INLINE vh vh_code_at_2(vh a)
{
    return (vh){ 0, 0, a[0], 0, 0, 0, a[4], 0 };
}

INLINE vh vh_code_at_3(vh a)
{
    return (vh){ 0, 0, 0, a[0], 0, 0, 0, a[4] };
}

INLINE vh vh_with_gradients(vh a, vh b)
{
    return (vh){ a[0], b[1], b[2], b[3], a[4], b[5], b[6], b[7] };
}

INLINE int16_t within_16_bits(int x)
{
    return (int16_t)(x < INT16_MIN ? INT16_MIN : x > INT16_MAX ? INT16_MAX : x);
}

INLINE vh vh_adds(vh a, vh b)
{
    for (int i = 0; i < 8; i++)
        a[i] = within_16_bits(a[i] + b[i]);
    return a;
}

INLINE vh vh_subs(vh a, vh b)
{
    for (int i = 0; i < 8; i++)
        a[i] = within_16_bits(a[i] - b[i]);
    return a;
}

INLINE vh vh_half_difference(vh a, vh b)
{
    for (int i = 0; i < 8; i++)
        a[i] = (int16_t)((a[i] - b[i]) >> 1);
    return a;
}

INLINE vh vh_between(vh a, vh b, int32_t weights)
{
    int w = weights >> 16, rest = weights & 0xffff;
    for (int i = 0; i < 8; i++)
        a[i] = (int16_t)((a[i] * rest + b[i] * w) >> 14);
    return a;
}

INLINE int16_t vh_least_code(vh a)
{
    return a[0] < a[4] ? a[0] : a[4];
}

INLINE int16_t vh_most_code(vh a)
{
    return a[0] > a[4] ? a[0] : a[4];
}

#endif

static_assert(sizeof(vh) == HV * sizeof(trip_cpu_voxel), "whole voxels");

/* A square's 9 x 9 voxels are read as vectors from these columns on, the last over others. */
#define COLUMNS (8 / HV + 1)

INLINE int column_of(int i)
{
    return i < 8 / HV ? HV * i : 9 - HV;
}

static void sheet_ranges(const trip_cpu_voxel *block, uint64_t squares, trip_cpu_square_ranges *out)
{
    for (uint64_t rest = squares; rest; rest &= rest - 1) {
        int square = __builtin_ctzll(rest);
        const trip_cpu_voxel *at = block +
                                   square / TRIP_CPU_SQUARES_ACROSS * 8 * TRIP_CPU_BLOCK_STRIDE +
                                   square % TRIP_CPU_SQUARES_ACROSS * 8;
        /* A missing code is the least, and less 1 it is the greatest. */
        vh least = vh_set(INT16_MAX), most = vh_set(INT16_MIN);
        for (int row = 0; row < 9; row++, at += TRIP_CPU_BLOCK_STRIDE)
            for (int i = 0; i < COLUMNS; i++) {
                vh a = vh_load(at + column_of(i));
                most = vh_max(most, a);
                least = vh_min(least, vh_less_1(a));
            }
        int low = vh_least_code(least);
        out->least[square] = (int16_t)(low == INT16_MAX ? low : low + 1);
        out->most[square] = vh_most_code(most);
    }
}

/* The least and greatest of two voxels beside each other at two sheets. */
typedef struct extremes {
    vh least, most;
} extremes;

INLINE extremes extremes_at(const trip_cpu_voxel *from, const trip_cpu_voxel *to)
{
    vh a = vh_load(from), b = vh_load(from + 1), c = vh_load(to), d = vh_load(to + 1);
    return (extremes){ vh_min(vh_min(a, b), vh_min(c, d)), vh_max(vh_max(a, b), vh_max(c, d)) };
}

static void sheet_cells(const trip_cpu_voxel *from, const trip_cpu_voxel *to, uint64_t squares,
                        int16_t least, int16_t most, trip_cpu_cells *out)
{
    const vh lowest = vh_set(least), highest = vh_set(most);
    for (uint64_t rest = squares; rest; rest &= rest - 1) {
        int square = __builtin_ctzll(rest);
        int first = square / TRIP_CPU_SQUARES_ACROSS * 8 * TRIP_CPU_BLOCK_STRIDE +
                    square % TRIP_CPU_SQUARES_ACROSS * 8;
        uint64_t seen = 0;
        for (int u = 0; u < 8; u += HV) {
            extremes above = extremes_at(from + first + u, to + first + u);
            for (int v = 0; v < 8; v++) {
                int at = first + (v + 1) * TRIP_CPU_BLOCK_STRIDE + u;
                extremes below = extremes_at(from + at, to + at);
                vh low = vh_min(above.least, below.least), high = vh_max(above.most, below.most);
                vh out_of = vh_or(vh_or(vh_greater(low, highest), vh_greater(lowest, high)),
                                  vh_is_missing(low));
                seen |= (uint64_t)(~vh_code_bits(out_of) & ((1u << HV) - 1)) << (8 * v + u);
                above = below;
            }
        }
        out->squares[square] = seen;
    }
}

/* The four voxels' neighbours along each axis, below and above. */
typedef struct around {
    vh below, above;
} around;

INLINE around codes_around(const trip_cpu_voxel *at, const trip_cpu_voxel *before,
                           const trip_cpu_voxel *left, const trip_cpu_voxel *before_sheet,
                           const trip_cpu_voxel *behind_sheet)
{
    return (around){
        vh_or(vh_or(vh_code_at_1(vh_load(left)), vh_code_at_2(vh_load(before))),
              vh_code_at_3(vh_load(before_sheet))),
        vh_or(
            vh_or(vh_code_at_1(vh_load(at + 1)), vh_code_at_2(vh_load(at + TRIP_CPU_BLOCK_STRIDE))),
            vh_code_at_3(vh_load(behind_sheet))),
    };
}

/* Central differences; where a neighbour is missing, the difference to the other. */
INLINE vh differences(vh codes, around a)
{
    vh no_below = vh_is_missing(a.below), no_above = vh_is_missing(a.above);
    vh below = vh_select(no_below, a.below, codes), above = vh_select(no_above, a.above, codes);
    vh one_sided = vh_adds(vh_subs(above, codes), vh_subs(codes, below));
    return vh_select(vh_or(no_below, no_above), vh_half_difference(above, below), one_sided);
}

/* Voxels are stored whole, with the code that they have, while the tasks of blocks beside this one
 * read that code: none of its bits ever changes, which ThreadSanitizer cannot see. */
__attribute__((no_sanitize("thread"))) static void
sheet_gradients(trip_cpu_voxel *block, uint64_t squares, const trip_cpu_voxel *left,
                const trip_cpu_voxel *above, const trip_cpu_voxel *sheet_before,
                const trip_cpu_voxel *sheet_behind)
{
    /* The voxels before a row's first and a column's first are those of the neighbours. */
    trip_cpu_voxel first[HV];
    for (uint64_t rest = squares; rest; rest &= rest - 1) {
        int square = __builtin_ctzll(rest);
        int u0 = square % TRIP_CPU_SQUARES_ACROSS * 8, v0 = square / TRIP_CPU_SQUARES_ACROSS * 8;
        for (int v = v0; v < v0 + 8; v++)
            for (int u = u0; u < u0 + 8; u += HV) {
                int i = v * TRIP_CPU_BLOCK_STRIDE + u;
                trip_cpu_voxel *at = block + i;
                const trip_cpu_voxel *to_left = at - 1, *before = at - TRIP_CPU_BLOCK_STRIDE;
                if (v == 0)
                    before = above + 63 * TRIP_CPU_BLOCK_STRIDE + u;
                if (u == 0) {
                    first[0] = left[v * TRIP_CPU_BLOCK_STRIDE + 63];
                    memcpy(first + 1, at, (HV - 1) * sizeof *first);
                    to_left = first;
                }
                vh here = vh_load(at);
                around a = codes_around(at, before, to_left, sheet_before + i, sheet_behind + i);
                vh g = differences(vh_codes(here), a);
                vh_store(at, vh_with_gradients(here, g));
            }
    }
}

static void sheet_between(const trip_cpu_voxel *from, const trip_cpu_voxel *to, uint64_t squares,
                          int32_t weights, trip_cpu_voxel *out)
{
    for (uint64_t rest = squares; rest; rest &= rest - 1) {
        int square = __builtin_ctzll(rest);
        int at = square / TRIP_CPU_SQUARES_ACROSS * 8 * TRIP_CPU_BLOCK_STRIDE +
                 square % TRIP_CPU_SQUARES_ACROSS * 8;
        for (int row = 0; row < 9; row++, at += TRIP_CPU_BLOCK_STRIDE)
            for (int i = 0; i < COLUMNS; i++) {
                int k = at + column_of(i);
                vh a = vh_load(from + k), b = vh_load(to + k);
                vh missing = vh_codes(vh_or(vh_is_missing(a), vh_is_missing(b)));
                vh_store(out + k, vh_select(missing, vh_between(a, b, weights),
                                            vh_set(TRIP_CPU_CODE_MISSING)));
            }
    }
}

#endif
