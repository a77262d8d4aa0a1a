/* Interpolates codes and gradients from the corners of the rays' cells, and reads rows of the
 * transfer function's integrals. Included by sheet_tmpl.h. These reads dominate the time of a
 * sample. AVX2 and AVX-512 therefore read blocks of 16 bytes and transpose them. */
#ifndef TRIP_CPU_CORNERS_H
#define TRIP_CPU_CORNERS_H

#if TRIP_SIMD == TRIP_SIMD_AVX2 || TRIP_SIMD == TRIP_SIMD_AVX512

#if TRIP_SIMD == TRIP_SIMD_AVX512
typedef __m512i wide;
#define WIDE(operation) _mm512_##operation
#else
typedef __m256i wide;
#define WIDE(operation) _mm256_##operation
#endif
typedef int16_t halves __attribute__((vector_size(4 * V)));

INLINE __m128i load_16(const void *from)
{
    return _mm_loadu_si128(from);
}

INLINE __m256i two_blocks(__m128i low, __m128i high)
{
    return _mm256_inserti128_si256(_mm256_castsi128_si256(low), high, 1);
}

/* Reads 16 bytes each at the positions of lanes i, i + 4 and so on. The lowest 128 bits belong to
 * lane i. */
INLINE wide blocks_of_lanes(const char *from, const int32_t at[V], ptrdiff_t bytes, int i)
{
    __m256i low = two_blocks(load_16(from + bytes * at[i]), load_16(from + bytes * at[i + 4]));
#if TRIP_SIMD == TRIP_SIMD_AVX512
    __m256i high =
        two_blocks(load_16(from + bytes * at[i + 8]), load_16(from + bytes * at[i + 12]));
    return _mm512_inserti64x4(_mm512_castsi256_si512(low), high, 1);
#else
    return low;
#endif
}

/* Transposes four numbers per lane, in the order of blocks_of_lanes(), to four vectors. */
INLINE void turn_blocks(const wide of[4], vi out[4])
{
    wide ab0 = WIDE(unpacklo_epi32)(of[0], of[1]), ab1 = WIDE(unpackhi_epi32)(of[0], of[1]);
    wide cd0 = WIDE(unpacklo_epi32)(of[2], of[3]), cd1 = WIDE(unpackhi_epi32)(of[2], of[3]);
    out[0] = (vi)WIDE(unpacklo_epi64)(ab0, cd0);
    out[1] = (vi)WIDE(unpackhi_epi64)(ab0, cd0);
    out[2] = (vi)WIDE(unpacklo_epi64)(ab1, cd1);
    out[3] = (vi)WIDE(unpackhi_epi64)(ab1, cd1);
}

/* Reads two neighbouring corners for each of four lanes. This is faster than the gather instruction
 * with AVX2, and as fast with AVX-512. */
INLINE __m128i four_codes(const int16_t *pool, const int32_t at[4])
{
    int32_t two[4];
    for (int k = 0; k < 4; k++)
        memcpy(&two[k], pool + at[k], sizeof *two);
    return _mm_setr_epi32(two[0], two[1], two[2], two[3]);
}

INLINE wide two_codes(const int16_t *pool, const int32_t at[V])
{
    __m256i low = two_blocks(four_codes(pool, at), four_codes(pool, at + 4));
#if TRIP_SIMD == TRIP_SIMD_AVX512
    __m256i high = two_blocks(four_codes(pool, at + 8), four_codes(pool, at + 12));
    return _mm512_inserti64x4(_mm512_castsi256_si512(low), high, 1);
#else
    return low;
#endif
}

/* The four corners of each lane: two above, two below. */
typedef struct four_corners {
    wide top, bottom;
} four_corners;

INLINE four_corners corners_from(const int16_t *pool, vi at)
{
    int32_t positions[V];
    vi_store(positions, at);
    return (four_corners){ two_codes(pool, positions),
                           two_codes(pool + TRIP_CPU_RASTER_STRIDE, positions) };
}

/* Stores the interpolated index, and which rays have all four corners. */
INLINE void find_codes(const trip_cpu_group *g, const trip_cpu_integrals *in, vi at, sample *s)
{
    const halves missing = (halves){ 0 } + TRIP_CPU_CODE_MISSING;
    const four_corners c = corners_from((const int16_t *)g->pool, at);
    vi sum =
        (vi)WIDE(madd_epi16)(c.top, (wide)s->top) + (vi)WIDE(madd_epi16)(c.bottom, (wide)s->bottom);
    wide min = WIDE(min_epi16)(c.top, c.bottom); /* TRIP_CPU_CODE_MISSING if any is missing */
    s->there = vi_is_0((vi)((halves)min == missing));
    s->index = index_of(in, sum);
}

/* Interpolates the deviations of the samples. */
INLINE void find_deviations(const trip_cpu_group *g, sample *s)
{
    const four_corners c = corners_from(g->deviations[0], s->deviation_at);
    s->deviation =
        (vi)WIDE(madd_epi16)(c.top, (wide)s->top) + (vi)WIDE(madd_epi16)(c.bottom, (wide)s->bottom);
}

/* Pairs the gradients of two neighbouring corners: both components along u, both along v, both
 * along the sheets. */
INLINE wide two_gradients(wide blocks)
{
    const __m128i order = _mm_setr_epi8(0, 1, 6, 7, 2, 3, 8, 9, 4, 5, 10, 11, -1, -1, -1, -1);
#if TRIP_SIMD == TRIP_SIMD_AVX512
    return _mm512_shuffle_epi8(blocks, _mm512_broadcast_i32x4(order));
#else
    return _mm256_shuffle_epi8(blocks, _mm256_broadcastsi128_si256(order));
#endif
}

INLINE void find_gradients(const trip_cpu_group *g, vi from, sample *s)
{
    const char *pool = (const char *)g->pool;
    const int below = 3 * TRIP_CPU_RASTER_STRIDE * sizeof(int16_t);
    int32_t at[V];
    wide of[4];
    vi turned[4];
    vi_store(at, from);
#define OF_LANES(i)                                                                                \
    do {                                                                                           \
        wide above = two_gradients(blocks_of_lanes(pool, at, sizeof(int16_t), i));                 \
        wide under = two_gradients(blocks_of_lanes(pool + below, at, sizeof(int16_t), i));         \
        above = WIDE(madd_epi16)(above, WIDE(shuffle_epi32)((wide)s->top, 0x55 * (i)));            \
        under = WIDE(madd_epi16)(under, WIDE(shuffle_epi32)((wide)s->bottom, 0x55 * (i)));         \
        of[i] = WIDE(add_epi32)(above, under);                                                     \
    } while (0)
    OF_LANES(0);
    OF_LANES(1);
    OF_LANES(2);
    OF_LANES(3);
#undef OF_LANES
    turn_blocks(of, turned);
    for (int k = 0; k < 3; k++)
        s->gradient[k] = turned[k];
}

/* Reads one row of four numbers per lane and transposes the rows to four vectors. */
INLINE void find_rows(int32_t (*rows)[4], vi numbers, vi out[4])
{
    int32_t at[V];
    wide of[4];
    vi_store(at, numbers);
    for (int i = 0; i < 4; i++)
        of[i] = blocks_of_lanes((const char *)rows, at, sizeof *rows, i);
    turn_blocks(of, out);
}

#else

INLINE int32_t of_two(int16_t left, int16_t right, int32_t weights)
{
    return left * (weights & 0xffff) + right * (weights >> 16);
}

INLINE void find_codes(const trip_cpu_group *g, const trip_cpu_integrals *in, vi at, sample *s)
{
    vi sum, lack;
    for (int i = 0; i < V; i++) {
        const int16_t *top = (const int16_t *)g->pool + at[i],
                      *bottom = top + TRIP_CPU_RASTER_STRIDE;
        sum[i] = of_two(top[0], top[1], s->top[i]) + of_two(bottom[0], bottom[1], s->bottom[i]);
        lack[i] = top[0] == TRIP_CPU_CODE_MISSING || top[1] == TRIP_CPU_CODE_MISSING ||
                  bottom[0] == TRIP_CPU_CODE_MISSING || bottom[1] == TRIP_CPU_CODE_MISSING;
    }
    s->there = vi_is_0(lack);
    s->index = index_of(in, sum);
}

INLINE void find_deviations(const trip_cpu_group *g, sample *s)
{
    for (int i = 0; i < V; i++) {
        const int16_t *top = (const int16_t *)g->deviations + s->deviation_at[i],
                      *bottom = top + TRIP_CPU_RASTER_STRIDE;
        s->deviation[i] =
            of_two(top[0], top[1], s->top[i]) + of_two(bottom[0], bottom[1], s->bottom[i]);
    }
}

INLINE void find_gradients(const trip_cpu_group *g, vi from, sample *s)
{
    for (int i = 0; i < V; i++) {
        const int16_t *top = (const int16_t *)g->pool + from[i];
        const int16_t *bottom = top + 3 * TRIP_CPU_RASTER_STRIDE;
        for (int k = 0; k < 3; k++)
            s->gradient[k][i] = of_two(top[k], top[3 + k], s->top[i]) +
                                of_two(bottom[k], bottom[3 + k], s->bottom[i]);
    }
}

INLINE void find_rows(int32_t (*rows)[4], vi numbers, vi out[4])
{
    int32_t at[V], of[4][V];
    vi_store(at, numbers);
    for (int i = 0; i < V; i++)
        for (int k = 0; k < 4; k++)
            of[k][i] = rows[at[i]][k];
    for (int k = 0; k < 4; k++)
        out[k] = vi_load(of[k]);
}

#endif

#endif
