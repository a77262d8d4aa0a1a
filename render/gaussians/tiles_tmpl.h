/* The kernel of gaussian_tiles.h for one instruction set. Each tiles_*.c defines TRIP_SIMD, then
 * includes this file. No operation is fused, so that all sets give the same bits. */
#ifndef TRIP_TILES_TMPL_H
#define TRIP_TILES_TMPL_H

#include "cpu/kernels/simd_tmpl.h"
#include "gaussian_picture.h"
#include "gaussian_tiles.h"

/* Vectors in a block. */
#define VECTORS (16 / V)

/* Returns exp(-q / 2) with a relative error of at most 3e-7, for 0 <= q <= 170. The result is
 * about 1e-37 for greater q. */
INLINE vf exp_minus_half(vf q)
{
    const vf y = v_max(q * v_set(-0.72134752f), v_set(-123)); /* log2 of the result */
    const vi n = v_truncate(y);
    const vf f = y - v_from_int(n); /* in (-1, 0] */
    vf p = v_set(0.000938787337f) * f + v_set(0.00918860915f);
    p = p * f + v_set(0.0552797202f);
    p = p * f + v_set(0.240172188f);
    p = p * f + v_set(0.693142252f);
    p = p * f + v_set(1);
    return p * v_from_bits((n + 127) << 23);
}

/* Composites a splat into one vector of pixels at squared radii q. Returns whether a pixel was
 * closed. */
INLINE bool draw_vector(float *planes, const trip_projected *s, vf q, float termination, bool depth)
{
    float *const t = planes + TRIP_TILE_T * TRIP_TILE_PIXELS;
    const vf before = v_load(t);
    const vm reached = vm_and(v_ge(v_set(s->limit), q), v_gt(before, v_set(0)));
    if (!vm_any(reached))
        return false;
    const vf alpha =
        v_min(v_set(s->opacity) * exp_minus_half(q), v_set((float)TRIP_GAUSSIAN_ALPHA_MAX));
    const vf after = before * (v_set(1) - alpha);
    const vm counts = vm_and(reached, v_ge(alpha, v_set((float)TRIP_GAUSSIAN_ALPHA_MIN)));
    const vm adds = vm_and(counts, v_ge(after, v_set(termination)));
    const vm closes = vm_and(counts, v_gt(v_set(termination), after));
    const vf weight = v_select(adds, before * alpha, v_set(0));
    for (int i = 0; i < 3; i++) {
        float *const plane = planes + (TRIP_TILE_RED + i) * TRIP_TILE_PIXELS;
        v_store(plane, v_load(plane) + weight * v_set(s->rgb[i]));
    }
    if (depth) {
        float *const plane = planes + TRIP_TILE_DEPTH * TRIP_TILE_PIXELS;
        v_store(plane, v_load(plane) + weight * v_set(s->z));
    }
    v_store(t, v_select(closes, -before, v_select(adds, after, before)));
    return vm_any(closes);
}

INLINE bool block_is_open(const float *t)
{
    bool open = false;
    for (int i = 0; i < 16; i++)
        open |= t[i] > 0;
    return open;
}

/* The numbers of a splat that its blocks in a tile share. */
typedef struct tile_splat {
    float u, v;                   /* at the tile's first pixel, q = u^2 + v^2 */
    vf us[VECTORS], vs[VECTORS];  /* differences to the first pixel of a block */
    int left, right, top, bottom; /* blocks; empty if left > right or top > bottom */
} tile_splat;

/* Returns the first and last block of a line with pixel centres from lo to hi, counted from the
 * first centre. */
INLINE void blocks_within(float lo, float hi, int *first, int *last)
{
    const float from = lo > 0 ? ceilf(lo) : 0, to = hi < TRIP_TILE_PX - 1 ? floorf(hi) : 15;
    *first = (int)from >> 2;
    *last = to < from ? -1 : (int)to >> 2;
}

INLINE void place_splat(tile_splat *at, const trip_projected *s, int x, int y)
{
    const double dx = x + 0.5 - s->x, dy = y + 0.5 - s->y;
    at->u = (float)((double)s->across * dx - (double)s->across_shear * dy);
    at->v = (float)((double)s->down * dy);
    for (int i = 0; i < VECTORS; i++) {
        vf column, row;
        for (int lane = 0; lane < V; lane++) {
            column[lane] = (float)(lane & 3);
            row[lane] = (float)((i * V + lane) >> 2);
        }
        at->us[i] = v_set(s->across) * column - v_set(s->across_shear) * row;
        at->vs[i] = v_set(s->down) * row;
    }
    blocks_within((float)-dx - s->reach_x, (float)-dx + s->reach_x, &at->left, &at->right);
    blocks_within((float)-dy - s->reach_y, (float)-dy + s->reach_y, &at->top, &at->bottom);
}

INLINE void draw_splat(float *planes, uint16_t *open, const trip_projected *s, int x, int y,
                       float termination, bool depth)
{
    tile_splat at;
    place_splat(&at, s, x, y);
    for (int row = at.top; row <= at.bottom; row++)
        for (int column = at.left; column <= at.right; column++) {
            const int block = row * (TRIP_TILE_PX / 4) + column;
            if (!(*open >> block & 1))
                continue;
            float *const first = planes + 16 * block;
            const float across = (float)(4 * column), down = (float)(4 * row);
            const float u = at.u + (s->across * across - s->across_shear * down);
            const float v = at.v + s->down * down;
            bool closed = false;
            for (int i = 0; i < VECTORS; i++) {
                const vf us = v_set(u) + at.us[i], vs = v_set(v) + at.vs[i];
                closed |= draw_vector(first + V * i, s, us * us + vs * vs, termination, depth);
            }
            if (closed && !block_is_open(first))
                *open = (uint16_t)(*open & ~(1u << block));
        }
}

INLINE void draw_splats(float *planes, uint16_t *open, const trip_projected *splats,
                        const uint32_t *list, size_t count, int x, int y, float termination,
                        bool depth)
{
    for (size_t i = 0; i < count && *open; i++) {
        if (i + 4 < count)
            __builtin_prefetch(&splats[list[i + 4]]);
        draw_splat(planes, open, &splats[list[i]], x, y, termination, depth);
    }
}

#define TRIP_TILE_TABLE(name, isa_name)                                                            \
    static void draw(float *planes, uint16_t *open, const trip_projected *splats,                  \
                     const uint32_t *list, size_t count, int x, int y, float termination,          \
                     bool depth)                                                                   \
    {                                                                                              \
        if (depth)                                                                                 \
            draw_splats(planes, open, splats, list, count, x, y, termination, true);               \
        else                                                                                       \
            draw_splats(planes, open, splats, list, count, x, y, termination, false);              \
    }                                                                                              \
    extern const trip_tile_kernels name;                                                           \
    const trip_tile_kernels name = { isa_name, draw }

#endif
