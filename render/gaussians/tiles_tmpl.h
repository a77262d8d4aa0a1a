/* The kernel of gaussian_tiles.h for one instruction set. Each tiles_*.c defines TRIP_SIMD, then
 * includes this file. It fuses no operations, so
 * that all sets give the same bits. */
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

/* A number that is linear in the pixel's position: its value at the tile's first pixel, its steps,
 * and its differences to the first pixel of a block. */
typedef struct linear {
    float at, across, down;
    vf steps[VECTORS];
} linear;

INLINE linear linear_of(double at, float across, float down)
{
    linear l = { .at = (float)at, .across = across, .down = down };
    for (int i = 0; i < VECTORS; i++) {
        vf column, row;
        for (int lane = 0; lane < V; lane++) {
            column[lane] = (float)(lane & 3);
            row[lane] = (float)((i * V + lane) >> 2);
        }
        l.steps[i] = v_set(across) * column + v_set(down) * row;
    }
    return l;
}

/* Returns the values in vector i of the block with its first pixel at (x, y) of the tile. */
INLINE vf linear_at(const linear *l, int i, float x, float y)
{
    return v_set(l->at + (l->across * x + l->down * y)) + l->steps[i];
}

/* The numbers of a splat that its blocks in a tile share:
 *
 *     q = (u^2 + v^2) / (w^2 + a^2 + b^2)
 *
 * q is infinite where w <= 0. Splats that are not curved lack w, a and b. */
typedef struct tile_splat {
    linear u, v, w, a, b;
    int left, right, top, bottom; /* blocks; empty if left > right or top > bottom */
} tile_splat;

/* Sets the first and last block of a line with pixel centres from lo to hi, counted from the first
 * centre. */
INLINE void blocks_within(float lo, float hi, int *first, int *last)
{
    const float from = lo > 0 ? ceilf(fminf(lo, TRIP_TILE_PX)) : 0;
    const float to = hi < TRIP_TILE_PX - 1 ? floorf(fmaxf(hi, -1)) : TRIP_TILE_PX - 1;
    *first = (int)from >> 2;
    *last = to < from ? -1 : (int)to >> 2;
}

/* Returns a number of a curved footprint that is `at` at the centre and has these steps. */
INLINE linear curve_part(float at, float across, float down, double dx, double dy)
{
    return linear_of((double)at + (double)across * dx + (double)down * dy, across, down);
}

INLINE void place_splat(tile_splat *at, const trip_projected *s, const trip_curve *curve, int x,
                        int y)
{
    const double dx = x + 0.5 - s->x, dy = y + 0.5 - s->y;
    const float column = (float)-dx, row = (float)-dy;
    at->u = linear_of((double)s->across * dx - (double)s->across_shear * dy, s->across,
                      -s->across_shear);
    at->v = linear_of((double)s->down * dy, 0, s->down);
    if (!curve) {
        blocks_within(column - s->reach_x, column + s->reach_x, &at->left, &at->right);
        blocks_within(row - s->reach_y, row + s->reach_y, &at->top, &at->bottom);
        return;
    }
    at->w = curve_part(1, curve->bend_x, curve->bend_y, dx, dy);
    at->a = curve_part(0, curve->tilt, curve->skew, dx, dy);
    at->b = curve_part(0, 0, curve->turn, dx, dy);
    blocks_within(column + curve->left, column + curve->right, &at->left, &at->right);
    blocks_within(row + curve->top, row + curve->bottom, &at->top, &at->bottom);
}

/* Returns q in vector i of a block. A large number stands for infinity. */
INLINE vf radius2(const tile_splat *at, int i, float x, float y, bool curved)
{
    const vf u = linear_at(&at->u, i, x, y), v = linear_at(&at->v, i, x, y);
    const vf numerator = u * u + v * v;
    if (!curved)
        return numerator;
    const vf w = linear_at(&at->w, i, x, y), a = linear_at(&at->a, i, x, y);
    const vf b = linear_at(&at->b, i, x, y);
    const vm front = v_gt(w, v_set(0));
    return v_select(front, numerator / (w * w + a * a + b * b), v_set(1e30f));
}

INLINE void draw_splat(float *planes, uint16_t *open, const trip_projected *s,
                       const trip_curve *curve, int x, int y, float termination, bool depth)
{
    tile_splat at;
    place_splat(&at, s, curve, x, y);
    for (int row = at.top; row <= at.bottom; row++)
        for (int column = at.left; column <= at.right; column++) {
            const int block = row * (TRIP_TILE_PX / 4) + column;
            if (!(*open >> block & 1))
                continue;
            float *const first = planes + 16 * block;
            bool closed = false;
            for (int i = 0; i < VECTORS; i++) {
                const vf q = radius2(&at, i, (float)(4 * column), (float)(4 * row), curve != NULL);
                closed |= draw_vector(first + V * i, s, q, termination, depth);
            }
            if (closed && !block_is_open(first))
                *open = (uint16_t)(*open & ~(1u << block));
        }
}

INLINE void draw_splats(float *planes, uint16_t *open, const trip_projected *splats,
                        const trip_curve *curves, const uint32_t *list, size_t count, int x, int y,
                        float termination, bool depth)
{
    for (size_t i = 0; i < count && *open; i++) {
        const trip_projected *s = &splats[list[i]];
        if (i + 4 < count)
            __builtin_prefetch(&splats[list[i + 4]]);
        if (curves && s->curved)
            draw_splat(planes, open, s, &curves[list[i]], x, y, termination, depth);
        else
            draw_splat(planes, open, s, NULL, x, y, termination, depth);
    }
}

#include "sheets_tmpl.h"

#define TRIP_TILE_TABLE(name, isa_name)                                                            \
    static void draw(float *planes, uint16_t *open, const trip_projected *splats,                  \
                     const trip_curve *curves, const uint32_t *list, size_t count, int x, int y,   \
                     float termination, bool depth)                                                \
    {                                                                                              \
        if (curves)                                                                                \
            draw_splats(planes, open, splats, curves, list, count, x, y, termination, depth);      \
        else if (depth)                                                                            \
            draw_splats(planes, open, splats, NULL, list, count, x, y, termination, true);         \
        else                                                                                       \
            draw_splats(planes, open, splats, NULL, list, count, x, y, termination, false);        \
    }                                                                                              \
    extern const trip_tile_kernels name;                                                           \
    const trip_tile_kernels name = { isa_name, draw, draw_sheets }

#endif
