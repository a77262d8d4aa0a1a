/* Emulates AVX-512 in tests on processors without it (TRIP_EMULATE_AVX512). SIMDe's functions
 * replace the compiler's intrinsics; this file adds the functions that SIMDe lacks. Included before
 * everything else in isa_avx512*.c. */
#ifndef TRIP_CPU_EMULATED_AVX512_H
#define TRIP_CPU_EMULATED_AVX512_H

#include <immintrin.h>
#include <math.h>
#include <stdint.h>
#include <string.h>

#define SIMDE_ENABLE_NATIVE_ALIASES
#include <simde/x86/avx512.h>

typedef float emulated_ps __attribute__((vector_size(64), may_alias));
typedef double emulated_pd __attribute__((vector_size(64), may_alias));
typedef int32_t emulated_i32 __attribute__((vector_size(64), may_alias));
typedef int64_t emulated_i64 __attribute__((vector_size(64), may_alias));

static inline __m512 emulated_i32gather_ps(__m512i index, const float *base)
{
    emulated_ps r;
    for (int i = 0; i < 16; i++)
        r[i] = base[((emulated_i32)index)[i]];
    return (__m512)r;
}
#undef _mm512_i32gather_ps
#define _mm512_i32gather_ps(index, base, scale) emulated_i32gather_ps(index, base)

static inline __m512i emulated_i64gather_epi64(__m512i index, const int64_t *base)
{
    emulated_i64 r;
    for (int i = 0; i < 8; i++)
        r[i] = base[((emulated_i64)index)[i]];
    return (__m512i)r;
}
#undef _mm512_i64gather_epi64
#define _mm512_i64gather_epi64(index, base, scale) emulated_i64gather_epi64(index, base)

static inline __m512i emulated_cvtepu8_epi32(__m128i a)
{
    uint8_t from[16];
    emulated_i32 r;
    memcpy(from, &a, sizeof from);
    for (int i = 0; i < 16; i++)
        r[i] = from[i];
    return (__m512i)r;
}
#undef _mm512_cvtepu8_epi32
#define _mm512_cvtepu8_epi32 emulated_cvtepu8_epi32

static inline __m512i emulated_maskz_compress_epi8(uint64_t mask, __m512i a)
{
    int8_t from[64], to[64] = { 0 };
    memcpy(from, &a, sizeof from);
    for (int i = 0, n = 0; i < 64; i++)
        if (mask >> i & 1)
            to[n++] = from[i];
    memcpy(&a, to, sizeof to);
    return a;
}
#undef _mm512_maskz_compress_epi8
#define _mm512_maskz_compress_epi8 emulated_maskz_compress_epi8

static inline __m512 emulated_mask_fnmadd_ps(__m512 a, __mmask16 mask, __m512 b, __m512 c)
{
    emulated_ps r = (emulated_ps)a;
    for (int i = 0; i < 16; i++)
        if (mask >> i & 1)
            r[i] = fmaf(-((emulated_ps)a)[i], ((emulated_ps)b)[i], ((emulated_ps)c)[i]);
    return (__m512)r;
}
#undef _mm512_mask_fnmadd_ps
#define _mm512_mask_fnmadd_ps emulated_mask_fnmadd_ps

static inline __mmask16 emulated_testn_epi32_mask(__m512i a, __m512i b)
{
    unsigned r = 0;
    for (int i = 0; i < 16; i++)
        r |= (unsigned)!(((emulated_i32)a)[i] & ((emulated_i32)b)[i]) << i;
    return (__mmask16)r;
}
#undef _mm512_testn_epi32_mask
#define _mm512_testn_epi32_mask emulated_testn_epi32_mask

static inline __attribute__((always_inline)) __m512i emulated_cvttps_epi32(__m512 a)
{
    __m256 half[2];
    __m256i r[2];
    __m512i out;
    memcpy(half, &a, sizeof half);
    for (int i = 0; i < 2; i++)
        r[i] = _mm256_cvttps_epi32(half[i]);
    memcpy(&out, r, sizeof out);
    return out;
}
#undef _mm512_cvttps_epi32
#define _mm512_cvttps_epi32 emulated_cvttps_epi32

/* Permutes each group of four elements by the same `order`. */
static inline __m512i emulated_shuffle_epi32(__m512i a, unsigned order)
{
    emulated_i32 r;
    for (unsigned i = 0; i < 16; i++)
        r[i] = ((emulated_i32)a)[i / 4 * 4 + (order >> i % 4 * 2 & 3)];
    return (__m512i)r;
}
#undef _mm512_shuffle_epi32
#define _mm512_shuffle_epi32 emulated_shuffle_epi32

#undef _mm512_madd_epi16
#define _mm512_madd_epi16 simde_mm512_madd_epi16

#undef _mm512_cvtepi32_ps
#define _mm512_cvtepi32_ps(a) ((__m512) __builtin_convertvector((emulated_i32)(a), emulated_ps))

static inline __m256 emulated_extractf32x8_ps(__m512 a, int half)
{
    __m256 r;
    memcpy(&r, (const char *)&a + 32 * half, sizeof r);
    return r;
}
#undef _mm512_extractf32x8_ps
#define _mm512_extractf32x8_ps emulated_extractf32x8_ps
#undef _mm512_extracti32x8_epi32
#define _mm512_extracti32x8_epi32(a, half) ((__m256i)emulated_extractf32x8_ps((__m512)(a), half))

typedef float emulated_8_ps __attribute__((vector_size(32), may_alias));
typedef int32_t emulated_8_i32 __attribute__((vector_size(32), may_alias));
typedef uint32_t emulated_8_u32 __attribute__((vector_size(32), may_alias));

#undef _mm512_cvtps_pd
#define _mm512_cvtps_pd(a) ((__m512d) __builtin_convertvector((emulated_8_ps)(a), emulated_pd))
#undef _mm512_cvtpd_ps
#define _mm512_cvtpd_ps(a) ((__m256) __builtin_convertvector((emulated_pd)(a), emulated_8_ps))
#undef _mm512_cvtepi32_pd
#define _mm512_cvtepi32_pd(a) ((__m512d) __builtin_convertvector((emulated_8_i32)(a), emulated_pd))
#undef _mm512_cvtepu32_epi64
#define _mm512_cvtepu32_epi64(a)                                                                   \
    ((__m512i) __builtin_convertvector((emulated_8_u32)(a), emulated_i64))

#ifdef TRIP_EMULATED_VBMI2
#define __AVX512VBMI2__ 1

typedef int16_t emulated_i16 __attribute__((vector_size(64), may_alias));

static inline __m512i emulated_maskz_expand_epi16(uint32_t mask, __m512i a)
{
    emulated_i16 r = { 0 };
    for (int i = 0, n = 0; i < 32; i++)
        if (mask >> i & 1)
            r[i] = ((emulated_i16)a)[n++];
    return (__m512i)r;
}
#undef _mm512_maskz_expand_epi16
#define _mm512_maskz_expand_epi16 emulated_maskz_expand_epi16

static inline __m512i emulated_permutexvar_epi16(__m512i numbers, __m512i a)
{
    emulated_i16 r;
    for (int i = 0; i < 32; i++)
        r[i] = ((emulated_i16)a)[((emulated_i16)numbers)[i] & 31];
    return (__m512i)r;
}
#undef _mm512_permutexvar_epi16
#define _mm512_permutexvar_epi16 emulated_permutexvar_epi16

static inline uint32_t emulated_cmpneq_epi16_mask(__m512i a, __m512i b)
{
    uint32_t mask = 0;
    for (int i = 0; i < 32; i++)
        mask |= (uint32_t)(((emulated_i16)a)[i] != ((emulated_i16)b)[i]) << i;
    return mask;
}
#undef _mm512_cmpneq_epi16_mask
#define _mm512_cmpneq_epi16_mask emulated_cmpneq_epi16_mask

static inline void emulated_mask_storeu_epi16(void *to, uint8_t mask, __m128i a)
{
    for (int i = 0; i < 8; i++)
        if (mask >> i & 1)
            memcpy((char *)to + 2 * i, (const char *)&a + 2 * i, 2);
}
#undef _mm_mask_storeu_epi16
#define _mm_mask_storeu_epi16 emulated_mask_storeu_epi16
#endif

#endif
