/* Vector types and operations for the CPU renderer's kernels, over AVX-512, AVX2 + FMA, NEON and
 * plain C (the compiler's vectors with four floats). Each isa_*.c defines TRIP_SIMD as one of the
 * numbers below and includes the kernels. So does each gaussians/tiles_*.c. Nothing else includes
 * this file.
 *
 *   vf, vi   V floats or 32-bit integers; operators do + - * / and arithmetic without comparisons
 *   vd       V / 2 doubles; a pair (lo, hi) has the lanes of one vf
 *   vw       V / 2 words of 64 bits; a pair has the lanes of one vi
 *   vm       one truth value per lane
 *
 * Only v_fma, v_fnma, v_fms, v_fnma_where and vd_fma fuse a product and a sum. All other operations
 * are the IEEE ones. A kernel's results are therefore the same on every processor that runs it. */
#ifndef TRIP_CPU_SIMD_H
#define TRIP_CPU_SIMD_H

#include <math.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include "cpu/kernels/kernels.h"

#define TRIP_SIMD_PLAIN 0
#define TRIP_SIMD_AVX2 2
#define TRIP_SIMD_AVX512 3
#define TRIP_SIMD_NEON 4

#if TRIP_SIMD == TRIP_SIMD_AVX512 || TRIP_SIMD == TRIP_SIMD_AVX2
#include <immintrin.h>
#elif TRIP_SIMD == TRIP_SIMD_NEON
#include <arm_neon.h>
#endif

#if TRIP_SIMD == TRIP_SIMD_AVX512
#define V 16
#elif TRIP_SIMD == TRIP_SIMD_AVX2
#define V 8
#else
#define V 4
#endif

typedef float vf __attribute__((vector_size(4 * V)));
typedef int32_t vi __attribute__((vector_size(4 * V)));
typedef uint32_t vu __attribute__((vector_size(4 * V)));
typedef double vd __attribute__((vector_size(4 * V)));
typedef uint64_t vw __attribute__((vector_size(4 * V)));

/* Vectors of four numbers of one splat, in every instruction set. */
typedef int32_t int4 __attribute__((vector_size(16)));
typedef float float4 __attribute__((vector_size(16)));

typedef struct vd_pair {
    vd lo, hi;
} vd_pair;

#if TRIP_SIMD == TRIP_SIMD_AVX512
typedef __mmask16 vm;
#else
typedef vi vm;
#endif

#define INLINE static inline __attribute__((always_inline))

INLINE vf v_set(float x)
{
    return x - (vf){ 0 };
}

INLINE vi vi_set(int32_t x)
{
    return x - (vi){ 0 };
}

INLINE vd vd_set(double x)
{
    return x - (vd){ 0 };
}

INLINE vw vw_set(uint64_t x)
{
    return x - (vw){ 0 };
}

INLINE vf v_load(const float *p)
{
    vf r;
    memcpy(&r, p, sizeof r);
    return r;
}

INLINE vi vi_load(const void *p)
{
    vi r;
    memcpy(&r, p, sizeof r);
    return r;
}

INLINE void v_store(float *p, vf a)
{
    memcpy(p, &a, sizeof a);
}

INLINE void vi_store(void *p, vi a)
{
    memcpy(p, &a, sizeof a);
}

INLINE vi v_bits(vf a)
{
    return (vi)a;
}

INLINE vf v_from_bits(vi a)
{
    return (vf)a;
}

INLINE vi v_shift_right(vi a, int bits)
{
    return (vi)((vu)a >> bits);
}

INLINE vf v_abs(vf a)
{
    return (vf)((vi)a & 0x7fffffff);
}

/* a with the sign of b. */
INLINE vf v_copysign(vf a, vf b)
{
    return (vf)(((vi)a & 0x7fffffff) | ((vi)b & INT32_MIN));
}

/* int4_widened() unpacks four numbers of 16 bits, the lowest first. */
#if TRIP_SIMD == TRIP_SIMD_AVX512 || TRIP_SIMD == TRIP_SIMD_AVX2

INLINE int4 int4_widened(uint64_t four)
{
    return (int4)_mm_cvtepu16_epi32(_mm_cvtsi64_si128((int64_t)four));
}

INLINE int4 int4_within(int4 a, int32_t min, int32_t max)
{
    return (int4)_mm_min_epi32(_mm_max_epi32((__m128i)a, _mm_set1_epi32(min)), _mm_set1_epi32(max));
}

#else

INLINE int4 int4_widened(uint64_t four)
{
    return (int4){ four & 0xffff, four >> 16 & 0xffff, four >> 32 & 0xffff, four >> 48 };
}

INLINE int4 int4_within(int4 a, int32_t min, int32_t max)
{
    int4 low = a<min, high = a> max;
    return (min & low) | (max & high) | (a & ~low & ~high);
}

#endif

/* ---- AVX-512 ---- */
#if TRIP_SIMD == TRIP_SIMD_AVX512

INLINE vf v_fma(vf a, vf b, vf c)
{
    return (vf)_mm512_fmadd_ps((__m512)a, (__m512)b, (__m512)c);
}

INLINE vf v_fms(vf a, vf b, vf c)
{
    return (vf)_mm512_fmsub_ps((__m512)a, (__m512)b, (__m512)c);
}

INLINE vf v_fnma(vf a, vf b, vf c)
{
    return (vf)_mm512_fnmadd_ps((__m512)a, (__m512)b, (__m512)c);
}

INLINE vd vd_fma(vd a, vd b, vd c)
{
    return (vd)_mm512_fmadd_pd((__m512d)a, (__m512d)b, (__m512d)c);
}

INLINE vf v_sqrt(vf a)
{
    return (vf)_mm512_sqrt_ps((__m512)a);
}

/* v_min() and v_max() return b if either argument is NaN, in every instruction set. */
INLINE vf v_min(vf a, vf b)
{
    return (vf)_mm512_min_ps((__m512)a, (__m512)b);
}

INLINE vf v_max(vf a, vf b)
{
    return (vf)_mm512_max_ps((__m512)a, (__m512)b);
}

INLINE vd vd_max(vd a, vd b)
{
    return (vd)_mm512_max_pd((__m512d)a, (__m512d)b);
}

INLINE vi v_truncate(vf a)
{
    return (vi)_mm512_cvttps_epi32((__m512)a);
}

INLINE vf v_from_int(vi a)
{
    return (vf)_mm512_cvtepi32_ps((__m512i)a);
}

INLINE vm v_ge(vf a, vf b)
{
    return _mm512_cmp_ps_mask((__m512)a, (__m512)b, _CMP_GE_OQ);
}

INLINE vm v_gt(vf a, vf b)
{
    return _mm512_cmp_ps_mask((__m512)a, (__m512)b, _CMP_GT_OQ);
}

INLINE vm vm_and(vm a, vm b)
{
    return (vm)(a & b);
}

INLINE vf v_select(vm m, vf a, vf b)
{
    return (vf)_mm512_mask_blend_ps(m, (__m512)b, (__m512)a);
}

/* m ? c - a * b : a */
INLINE vf v_fnma_where(vm m, vf a, vf b, vf c)
{
    return (vf)_mm512_mask_fnmadd_ps((__m512)a, m, (__m512)b, (__m512)c);
}

INLINE unsigned vm_bits(vm m)
{
    return m;
}

INLINE bool vm_any(vm m)
{
    return m != 0;
}

INLINE bool vm_all(vm m)
{
    return m == 0xffff;
}

INLINE vm vm_first(unsigned lanes)
{
    return (vm)(lanes >= 16 ? 0xffffu : (1u << lanes) - 1);
}

INLINE vm vm_last(unsigned lanes)
{
    return (vm)~vm_first(V - lanes);
}

/* (a & low) | high */
INLINE vi vi_low_or(vi a, int32_t low, int32_t high)
{
    return (vi)_mm512_ternarylogic_epi32((__m512i)a, _mm512_set1_epi32(low),
                                         _mm512_set1_epi32(high), 0xea);
}

INLINE vf v_gather(const float *base, vi index)
{
    return (vf)_mm512_i32gather_ps((__m512i)index, base, 4);
}

INLINE vd vd_low(vf a)
{
    return (vd)_mm512_cvtps_pd(_mm512_castps512_ps256((__m512)a));
}

INLINE vd vd_high(vf a)
{
    return (vd)_mm512_cvtps_pd(_mm512_extractf32x8_ps((__m512)a, 1));
}

INLINE vd vd_low_int(vi a)
{
    return (vd)_mm512_cvtepi32_pd(_mm512_castsi512_si256((__m512i)a));
}

INLINE vd vd_high_int(vi a)
{
    return (vd)_mm512_cvtepi32_pd(_mm512_extracti32x8_epi32((__m512i)a, 1));
}

INLINE vf v_narrow(vd lo, vd hi)
{
    return (vf)_mm512_insertf32x8(_mm512_castps256_ps512(_mm512_cvtpd_ps((__m512d)lo)),
                                  _mm512_cvtpd_ps((__m512d)hi), 1);
}

INLINE vi vi_reverse(vi a)
{
    const __m512i order = _mm512_set_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
    return (vi)_mm512_permutexvar_epi32(order, (__m512i)a);
}

/* vw_low() widens the lanes below V / 2, vw_high() all others. Both treat them as unsigned. */
INLINE vw vw_low(vi a)
{
    return (vw)_mm512_cvtepu32_epi64(_mm512_castsi512_si256((__m512i)a));
}

INLINE vw vw_high(vi a)
{
    return (vw)_mm512_cvtepu32_epi64(_mm512_extracti32x8_epi32((__m512i)a, 1));
}

/* Reads each word like a relaxed atomic load. */
INLINE vw vw_gather(const _Atomic uint64_t *base, vw index)
{
    return (vw)_mm512_i64gather_epi64((__m512i)index, (const void *)(uintptr_t)base, 8);
}

/* Returns a bit per word: whether it is not 0. */
INLINE unsigned vw_not_0(vw a)
{
    return _mm512_test_epi64_mask((__m512i)a, (__m512i)a);
}

/* Stores the lanes of `a` with a set bit contiguously at p. All V lanes at p may be overwritten. */
INLINE void vi_store_packed(void *p, unsigned bits, vi a)
{
    _mm512_storeu_si512(p, _mm512_maskz_compress_epi32((__mmask16)bits, (__m512i)a));
}

#ifdef __AVX512VBMI2__
#define V_PACKS_BITS

typedef uint8_t v_bytes __attribute__((vector_size(64)));

/* Stores the bytes with a set bit contiguously at `out` and returns their number. All 64 bytes at
 * `out` may be overwritten. */
INLINE uint32_t v_pack_bytes(uint8_t *out, uint64_t bits, v_bytes from)
{
    _mm512_storeu_si512(out, _mm512_maskz_compress_epi8(bits, (__m512i)from));
    return (uint32_t)__builtin_popcountll(bits);
}

/* Stores first + n for each set bit n contiguously at `out` and returns their number. All 64 bytes
 * at `out` may be overwritten. */
INLINE uint32_t v_pack_bits(uint8_t *out, uint64_t bits, unsigned first)
{
    v_bytes position;
    for (int i = 0; i < 64; i++)
        position[i] = (uint8_t)i;
    return v_pack_bytes(out, bits, position + (uint8_t)first);
}
#endif

/* Stores lane i of (a, b, c, d) in the four floats at out + row[i]. Later lanes overwrite earlier
 * ones. */
INLINE void v_store_rows(float *out, const uint32_t row[V], vf a, vf b, vf c, vf d)
{
    __m512 ab0 = _mm512_unpacklo_ps((__m512)a, (__m512)b);
    __m512 ab1 = _mm512_unpackhi_ps((__m512)a, (__m512)b);
    __m512 cd0 = _mm512_unpacklo_ps((__m512)c, (__m512)d);
    __m512 cd1 = _mm512_unpackhi_ps((__m512)c, (__m512)d);
#define PAIR(x, y, unpack) _mm512_castpd_ps(unpack(_mm512_castps_pd(x), _mm512_castps_pd(y)))
    __m512 r0 = PAIR(ab0, cd0, _mm512_unpacklo_pd), r1 = PAIR(ab0, cd0, _mm512_unpackhi_pd);
    __m512 r2 = PAIR(ab1, cd1, _mm512_unpacklo_pd), r3 = PAIR(ab1, cd1, _mm512_unpackhi_pd);
#undef PAIR
#define QUARTER(lane)                                                                              \
    _mm_storeu_ps(out + row[4 * lane + 0], _mm512_extractf32x4_ps(r0, lane));                      \
    _mm_storeu_ps(out + row[4 * lane + 1], _mm512_extractf32x4_ps(r1, lane));                      \
    _mm_storeu_ps(out + row[4 * lane + 2], _mm512_extractf32x4_ps(r2, lane));                      \
    _mm_storeu_ps(out + row[4 * lane + 3], _mm512_extractf32x4_ps(r3, lane))
    QUARTER(0);
    QUARTER(1);
    QUARTER(2);
    QUARTER(3);
#undef QUARTER
}

/* Loads the four floats at base + 4 row[i] into lane i of r[0], r[1], r[2] and r[3]. */
INLINE void v_load_rows(const float *base, const int32_t row[V], vf r[4])
{
#define ROW(lane) _mm_loadu_ps(base + 4 * (ptrdiff_t)row[lane])
#define ROWS(lane)                                                                                 \
    _mm512_insertf32x4(_mm512_insertf32x4(_mm512_insertf32x4(_mm512_castps128_ps512(ROW(lane)),    \
                                                             ROW(lane + 4), 1),                    \
                                          ROW(lane + 8), 2),                                       \
                       ROW(lane + 12), 3)
    __m512 r0 = ROWS(0), r1 = ROWS(1), r2 = ROWS(2), r3 = ROWS(3);
#undef ROWS
#undef ROW
    __m512 ab01 = _mm512_unpacklo_ps(r0, r1), cd01 = _mm512_unpackhi_ps(r0, r1);
    __m512 ab23 = _mm512_unpacklo_ps(r2, r3), cd23 = _mm512_unpackhi_ps(r2, r3);
#define PAIR(x, y, unpack) (vf) unpack(_mm512_castps_pd(x), _mm512_castps_pd(y))
    r[0] = PAIR(ab01, ab23, _mm512_unpacklo_pd);
    r[1] = PAIR(ab01, ab23, _mm512_unpackhi_pd);
    r[2] = PAIR(cd01, cd23, _mm512_unpacklo_pd);
    r[3] = PAIR(cd01, cd23, _mm512_unpackhi_pd);
#undef PAIR
}

#else /* ---- vectors of masks: AVX2, NEON and plain ---- */

INLINE vm v_ge(vf a, vf b)
{
    return (vm)(a >= b);
}

INLINE vm v_gt(vf a, vf b)
{
    return (vm)(a > b);
}

INLINE vm vm_and(vm a, vm b)
{
    return a & b;
}

INLINE vf v_select(vm m, vf a, vf b)
{
    return (vf)((m & (vi)a) | (~m & (vi)b));
}

INLINE vm vm_first(unsigned lanes)
{
    vm m;
    for (unsigned i = 0; i < V; i++)
        m[i] = i < lanes ? -1 : 0;
    return m;
}

INLINE vm vm_last(unsigned lanes)
{
    return ~vm_first(V - lanes);
}

INLINE vi vi_low_or(vi a, int32_t low, int32_t high)
{
    return (a & low) | high;
}

#if TRIP_SIMD == TRIP_SIMD_AVX2

INLINE vf v_fma(vf a, vf b, vf c)
{
    return (vf)_mm256_fmadd_ps((__m256)a, (__m256)b, (__m256)c);
}

INLINE vf v_fms(vf a, vf b, vf c)
{
    return (vf)_mm256_fmsub_ps((__m256)a, (__m256)b, (__m256)c);
}

INLINE vf v_fnma(vf a, vf b, vf c)
{
    return (vf)_mm256_fnmadd_ps((__m256)a, (__m256)b, (__m256)c);
}

INLINE vd vd_fma(vd a, vd b, vd c)
{
    return (vd)_mm256_fmadd_pd((__m256d)a, (__m256d)b, (__m256d)c);
}

INLINE vf v_sqrt(vf a)
{
    return (vf)_mm256_sqrt_ps((__m256)a);
}

INLINE vf v_min(vf a, vf b)
{
    return (vf)_mm256_min_ps((__m256)a, (__m256)b);
}

INLINE vf v_max(vf a, vf b)
{
    return (vf)_mm256_max_ps((__m256)a, (__m256)b);
}

INLINE vd vd_max(vd a, vd b)
{
    return (vd)_mm256_max_pd((__m256d)a, (__m256d)b);
}

INLINE vi v_truncate(vf a)
{
    return (vi)_mm256_cvttps_epi32((__m256)a);
}

INLINE vf v_from_int(vi a)
{
    return (vf)_mm256_cvtepi32_ps((__m256i)a);
}

INLINE unsigned vm_bits(vm m)
{
    return (unsigned)_mm256_movemask_ps((__m256)m);
}

INLINE bool vm_any(vm m)
{
    return vm_bits(m) != 0;
}

INLINE bool vm_all(vm m)
{
    return vm_bits(m) == 0xff;
}

INLINE vf v_gather(const float *base, vi index)
{
    return (vf)_mm256_i32gather_ps(base, (__m256i)index, 4);
}

INLINE vd vd_low(vf a)
{
    return (vd)_mm256_cvtps_pd(_mm256_castps256_ps128((__m256)a));
}

INLINE vd vd_high(vf a)
{
    return (vd)_mm256_cvtps_pd(_mm256_extractf128_ps((__m256)a, 1));
}

INLINE vd vd_low_int(vi a)
{
    return (vd)_mm256_cvtepi32_pd(_mm256_castsi256_si128((__m256i)a));
}

INLINE vd vd_high_int(vi a)
{
    return (vd)_mm256_cvtepi32_pd(_mm256_extracti128_si256((__m256i)a, 1));
}

INLINE vf v_narrow(vd lo, vd hi)
{
    return (vf)_mm256_set_m128(_mm256_cvtpd_ps((__m256d)hi), _mm256_cvtpd_ps((__m256d)lo));
}

INLINE vi vi_reverse(vi a)
{
    return (vi)_mm256_permutevar8x32_epi32((__m256i)a, _mm256_set_epi32(0, 1, 2, 3, 4, 5, 6, 7));
}

INLINE vw vw_low(vi a)
{
    return (vw)_mm256_cvtepu32_epi64(_mm256_castsi256_si128((__m256i)a));
}

INLINE vw vw_high(vi a)
{
    return (vw)_mm256_cvtepu32_epi64(_mm256_extracti128_si256((__m256i)a, 1));
}

INLINE vw vw_gather(const _Atomic uint64_t *base, vw index)
{
    return (vw)_mm256_i64gather_epi64((const void *)(uintptr_t)base, (__m256i)index, 8);
}

INLINE unsigned vw_not_0(vw a)
{
    return (unsigned)_mm256_movemask_pd((__m256d)(a != 0));
}

INLINE void v_store_rows(float *out, const uint32_t row[V], vf a, vf b, vf c, vf d)
{
    __m256 ab0 = _mm256_unpacklo_ps((__m256)a, (__m256)b);
    __m256 ab1 = _mm256_unpackhi_ps((__m256)a, (__m256)b);
    __m256 cd0 = _mm256_unpacklo_ps((__m256)c, (__m256)d);
    __m256 cd1 = _mm256_unpackhi_ps((__m256)c, (__m256)d);
#define PAIR(x, y, unpack) _mm256_castpd_ps(unpack(_mm256_castps_pd(x), _mm256_castps_pd(y)))
    __m256 r0 = PAIR(ab0, cd0, _mm256_unpacklo_pd), r1 = PAIR(ab0, cd0, _mm256_unpackhi_pd);
    __m256 r2 = PAIR(ab1, cd1, _mm256_unpacklo_pd), r3 = PAIR(ab1, cd1, _mm256_unpackhi_pd);
#undef PAIR
#define HALF(lane)                                                                                 \
    _mm_storeu_ps(out + row[4 * lane + 0], _mm256_extractf128_ps(r0, lane));                       \
    _mm_storeu_ps(out + row[4 * lane + 1], _mm256_extractf128_ps(r1, lane));                       \
    _mm_storeu_ps(out + row[4 * lane + 2], _mm256_extractf128_ps(r2, lane));                       \
    _mm_storeu_ps(out + row[4 * lane + 3], _mm256_extractf128_ps(r3, lane))
    HALF(0);
    HALF(1);
#undef HALF
}

INLINE void v_load_rows(const float *base, const int32_t row[V], vf r[4])
{
#define ROW(lane) _mm_loadu_ps(base + 4 * (ptrdiff_t)row[lane])
#define ROWS(lane) _mm256_insertf128_ps(_mm256_castps128_ps256(ROW(lane)), ROW(lane + 4), 1)
    __m256 r0 = ROWS(0), r1 = ROWS(1), r2 = ROWS(2), r3 = ROWS(3);
#undef ROWS
#undef ROW
    __m256 ab01 = _mm256_unpacklo_ps(r0, r1), cd01 = _mm256_unpackhi_ps(r0, r1);
    __m256 ab23 = _mm256_unpacklo_ps(r2, r3), cd23 = _mm256_unpackhi_ps(r2, r3);
#define PAIR(x, y, unpack) (vf) unpack(_mm256_castps_pd(x), _mm256_castps_pd(y))
    r[0] = PAIR(ab01, ab23, _mm256_unpacklo_pd);
    r[1] = PAIR(ab01, ab23, _mm256_unpackhi_pd);
    r[2] = PAIR(cd01, cd23, _mm256_unpacklo_pd);
    r[3] = PAIR(cd01, cd23, _mm256_unpackhi_pd);
#undef PAIR
}

#else /* NEON and plain: four floats, two doubles */

#if TRIP_SIMD == TRIP_SIMD_NEON

INLINE vf v_fma(vf a, vf b, vf c)
{
    return (vf)vfmaq_f32((float32x4_t)c, (float32x4_t)a, (float32x4_t)b);
}

INLINE vf v_fms(vf a, vf b, vf c)
{
    return (vf)vfmaq_f32((float32x4_t)-c, (float32x4_t)a, (float32x4_t)b);
}

INLINE vf v_fnma(vf a, vf b, vf c)
{
    return (vf)vfmsq_f32((float32x4_t)c, (float32x4_t)a, (float32x4_t)b);
}

INLINE vd vd_fma(vd a, vd b, vd c)
{
    return (vd)vfmaq_f64((float64x2_t)c, (float64x2_t)a, (float64x2_t)b);
}

INLINE vf v_sqrt(vf a)
{
    return (vf)vsqrtq_f32((float32x4_t)a);
}

INLINE vi v_truncate(vf a)
{
    return (vi)vcvtq_s32_f32((float32x4_t)a);
}

INLINE unsigned vm_bits(vm m)
{
    const uint32x4_t bit = { 1, 2, 4, 8 };
    return vaddvq_u32(vandq_u32((uint32x4_t)m, bit));
}

#else

INLINE vf v_fma(vf a, vf b, vf c)
{
    return a * b + c;
}

INLINE vf v_fms(vf a, vf b, vf c)
{
    return a * b - c;
}

INLINE vf v_fnma(vf a, vf b, vf c)
{
    return c - a * b;
}

INLINE vd vd_fma(vd a, vd b, vd c)
{
    return a * b + c;
}

INLINE vf v_sqrt(vf a)
{
    return (vf){ sqrtf(a[0]), sqrtf(a[1]), sqrtf(a[2]), sqrtf(a[3]) };
}

INLINE unsigned vm_bits(vm m)
{
    return (unsigned)((m[0] & 1) | (m[1] & 2) | (m[2] & 4) | (m[3] & 8));
}

#endif

typedef int64_t vl2 __attribute__((vector_size(16)));

INLINE bool vm_any(vm m)
{
    return (((vl2)m)[0] | ((vl2)m)[1]) != 0;
}

INLINE bool vm_all(vm m)
{
    return (((vl2)m)[0] & ((vl2)m)[1]) == -1;
}

INLINE vf v_min(vf a, vf b)
{
    return v_select((vm)(a < b), a, b);
}

INLINE vf v_max(vf a, vf b)
{
    return v_select((vm)(a > b), a, b);
}

INLINE vd vd_max(vd a, vd b)
{
    const vl2 m = (vl2)(a > b);
    return (vd)((m & (vl2)a) | (~m & (vl2)b));
}

#if TRIP_SIMD == TRIP_SIMD_PLAIN
/* The result is undefined outside the range of integers, as with the vector instructions. */
INLINE vi v_truncate(vf a)
{
    return __builtin_convertvector(v_max(v_min(a, v_set(2147483520.0f)), v_set(-2147483648.0f)),
                                   vi);
}
#endif

INLINE vf v_from_int(vi a)
{
    return __builtin_convertvector(a, vf);
}

INLINE vf v_gather(const float *base, vi index)
{
    return (vf){ base[index[0]], base[index[1]], base[index[2]], base[index[3]] };
}

INLINE vd vd_low(vf a)
{
    return (vd){ a[0], a[1] };
}

INLINE vd vd_high(vf a)
{
    return (vd){ a[2], a[3] };
}

INLINE vd vd_low_int(vi a)
{
    return (vd){ a[0], a[1] };
}

INLINE vd vd_high_int(vi a)
{
    return (vd){ a[2], a[3] };
}

INLINE vf v_narrow(vd lo, vd hi)
{
    return (vf){ (float)lo[0], (float)lo[1], (float)hi[0], (float)hi[1] };
}

INLINE vi vi_reverse(vi a)
{
    return (vi){ a[3], a[2], a[1], a[0] };
}

INLINE vw vw_low(vi a)
{
    return (vw){ (uint32_t)a[0], (uint32_t)a[1] };
}

INLINE vw vw_high(vi a)
{
    return (vw){ (uint32_t)a[2], (uint32_t)a[3] };
}

INLINE vw vw_gather(const _Atomic uint64_t *base, vw index)
{
    return (vw){ atomic_load_explicit(&base[index[0]], memory_order_relaxed),
                 atomic_load_explicit(&base[index[1]], memory_order_relaxed) };
}

INLINE unsigned vw_not_0(vw a)
{
    return (a[0] != 0) | (unsigned)(a[1] != 0) << 1;
}

INLINE void v_store_rows(float *out, const uint32_t row[V], vf a, vf b, vf c, vf d)
{
    for (int i = 0; i < V; i++) {
        vf r = { a[i], b[i], c[i], d[i] };
        v_store(out + row[i], r);
    }
}

INLINE void v_load_rows(const float *base, const int32_t row[V], vf r[4])
{
    const float *a = base + 4 * (ptrdiff_t)row[0], *b = base + 4 * (ptrdiff_t)row[1];
    const float *c = base + 4 * (ptrdiff_t)row[2], *d = base + 4 * (ptrdiff_t)row[3];
    for (int i = 0; i < 4; i++)
        r[i] = (vf){ a[i], b[i], c[i], d[i] };
}

#endif

INLINE vf v_fnma_where(vm m, vf a, vf b, vf c)
{
    return v_select(m, v_fnma(a, b, c), a);
}

/* AVX2 permutes the selected lanes to the front. Branches would be unpredictable here, since the
 * lanes change with every vector. */
INLINE void vi_store_packed(void *p, unsigned bits, vi a)
{
#if TRIP_SIMD == TRIP_SIMD_AVX2
    __m128i lanes = _mm_loadl_epi64((const void *)&trip_cpu_bits_set[bits]);
    vi_store(p, (vi)_mm256_permutevar8x32_epi32((__m256i)a, _mm256_cvtepu8_epi32(lanes)));
#else
    int32_t *out = p;
    if ((bits & (bits + 1)) == 0) { /* the selected lanes come first already */
        vi_store(out, a);
        return;
    }
    for (; bits; bits &= bits - 1)
        *out++ = a[__builtin_ctz(bits)];
#endif
}

#endif

/* Returns a bit for each of 64 bytes: whether it lies in [min, max]. Requires min <= max. */
INLINE uint64_t v_bytes_within(const uint8_t *from, uint8_t min, uint8_t max)
{
#if TRIP_SIMD == TRIP_SIMD_AVX512
    __m512i above = _mm512_sub_epi8(_mm512_loadu_si512(from), _mm512_set1_epi8((char)min));
    return _mm512_cmple_epu8_mask(above, _mm512_set1_epi8((char)(max - min)));
#elif TRIP_SIMD == TRIP_SIMD_AVX2
    uint64_t bits = 0;
    for (int i = 0; i < 2; i++) {
        __m256i a = _mm256_loadu_si256((const void *)(from + 32 * i));
        __m256i limited = _mm256_min_epu8(_mm256_max_epu8(a, _mm256_set1_epi8((char)min)),
                                          _mm256_set1_epi8((char)max));
        bits |= (uint64_t)(uint32_t)_mm256_movemask_epi8(_mm256_cmpeq_epi8(a, limited)) << 32 * i;
    }
    return bits;
#else
    uint64_t bits = 0;
    for (int i = 0; i < 64; i++)
        bits |= (uint64_t)(from[i] >= min && from[i] <= max) << i;
    return bits;
#endif
}

typedef uint8_t bytes_of_lanes __attribute__((vector_size(V)));

/* Loads a byte per lane. The intrinsics are needed on x86, where compilers convert lane by lane. */
INLINE vi vi_load_bytes(const unsigned char *from)
{
#if TRIP_SIMD == TRIP_SIMD_AVX512
    return (vi)_mm512_cvtepu8_epi32(_mm_loadu_si128((const void *)from));
#elif TRIP_SIMD == TRIP_SIMD_AVX2
    return (vi)_mm256_cvtepu8_epi32(_mm_loadl_epi64((const void *)from));
#else
    bytes_of_lanes b;
    memcpy(&b, from, sizeof b);
    return __builtin_convertvector(b, vi);
#endif
}

/* Loads three bytes per lane. Reads as many bytes as a vector has. */
INLINE vi vi_load_3_bytes(const unsigned char *from)
{
#if TRIP_SIMD == TRIP_SIMD_AVX512
    const __m512i words = _mm512_setr_epi32(0, 1, 2, 0, 3, 4, 5, 0, 6, 7, 8, 0, 9, 10, 11, 0);
    const __m512i bytes =
        _mm512_broadcast_i32x4(_mm_setr_epi8(0, 1, 2, -1, 3, 4, 5, -1, 6, 7, 8, -1, 9, 10, 11, -1));
    __m512i twelve = _mm512_permutexvar_epi32(words, _mm512_loadu_si512(from));
    return (vi)_mm512_shuffle_epi8(twelve, bytes);
#elif TRIP_SIMD == TRIP_SIMD_AVX2
    const __m256i words = _mm256_setr_epi32(0, 1, 2, 0, 3, 4, 5, 0);
    const __m256i bytes = _mm256_broadcastsi128_si256(
        _mm_setr_epi8(0, 1, 2, -1, 3, 4, 5, -1, 6, 7, 8, -1, 9, 10, 11, -1));
    __m256i eight = _mm256_loadu_si256((const void *)from);
    return (vi)_mm256_shuffle_epi8(_mm256_permutevar8x32_epi32(eight, words), bytes);
#else
    vi a;
    for (int i = 0; i < V; i++)
        a[i] = from[3 * i] | from[3 * i + 1] << 8 | from[3 * i + 2] << 16;
    return a;
#endif
}

/* Tables to unpack contiguous numbers of `width` bits, four at a time. FOUR_BYTES gives the byte in
 * which number i begins and the three bytes after it. BITS_OF also gives the number's first bit in
 * that byte. */
#define FIRST_BYTE(i, width) (uint8_t)((i) * (width) / 8)
#define FOUR_BYTES(i, width)                                                                       \
    FIRST_BYTE(i, width), FIRST_BYTE(i, width) + 1, FIRST_BYTE(i, width) + 2,                      \
        FIRST_BYTE(i, width) + 3
#define BITS_OF(width)                                                                             \
    {                                                                                              \
        { FOUR_BYTES(0, width), FOUR_BYTES(1, width), FOUR_BYTES(2, width),                        \
          FOUR_BYTES(3, width) },                                                                  \
        {                                                                                          \
            0, 1 * (width) % 8, 2 * (width) % 8, 3 * (width) % 8                                   \
        }                                                                                          \
    }

typedef struct bits_of_width {
    uint8_t bytes[16];
    uint32_t before[4];
} bits_of_width;

static const bits_of_width bits_of_widths[9] = { BITS_OF(0),  BITS_OF(2),  BITS_OF(4),
                                                 BITS_OF(6),  BITS_OF(8),  BITS_OF(10),
                                                 BITS_OF(12), BITS_OF(14), BITS_OF(16) };

/* Loads V numbers of `width` bits. `width` is even and at most 16. Reads up to 16 bytes past the
 * numbers. */
INLINE vi vi_load_bits(const unsigned char *from, uint32_t width)
{
    const bits_of_width *of = &bits_of_widths[width / 2];
    const vi max = vi_set((1 << width) - 1);
#if TRIP_SIMD == TRIP_SIMD_AVX512
    const uint32_t four = width / 2;
    __m512i bits = _mm512_castsi128_si512(_mm_loadu_si128((const void *)from));
    bits = _mm512_inserti32x4(bits, _mm_loadu_si128((const void *)(from + four)), 1);
    bits = _mm512_inserti32x4(bits, _mm_loadu_si128((const void *)(from + 2 * four)), 2);
    bits = _mm512_inserti32x4(bits, _mm_loadu_si128((const void *)(from + 3 * four)), 3);
    bits =
        _mm512_shuffle_epi8(bits, _mm512_broadcast_i32x4(_mm_loadu_si128((const void *)of->bytes)));
    return (vi)_mm512_srlv_epi32(
               bits, _mm512_broadcast_i32x4(_mm_loadu_si128((const void *)of->before))) &
           max;
#elif TRIP_SIMD == TRIP_SIMD_AVX2
    __m256i bits = _mm256_castsi128_si256(_mm_loadu_si128((const void *)from));
    bits = _mm256_inserti128_si256(bits, _mm_loadu_si128((const void *)(from + width / 2)), 1);
    bits = _mm256_shuffle_epi8(
        bits, _mm256_broadcastsi128_si256(_mm_loadu_si128((const void *)of->bytes)));
    return (vi)_mm256_srlv_epi32(
               bits, _mm256_broadcastsi128_si256(_mm_loadu_si128((const void *)of->before))) &
           max;
#else
    vi a;
    for (int i = 0; i < V; i++) {
        int32_t word;
        memcpy(&word, from + of->bytes[4 * i], sizeof word);
        a[i] = word >> of->before[i];
    }
    return a & max;
#endif
}

#endif
