/* Kernels that begin and finish the pixels of a tile: weights of the lists, the merge (equation 3
 * of Hofsetz, Max & Bastos 2008) and the picture. Included by each cpu_isa_*.c after cpu_blend.h.
 * The weights are computed in double precision by the operations of weight.c in their order, so
 * that where a list begins does not depend on who asks. */
#ifndef TRIP_CPU_MERGE_H
#define TRIP_CPU_MERGE_H

#include "cpu_blend.h"
#include "cpu_kernels.h"
#include "weight.h"

typedef int64_t vl __attribute__((vector_size(4 * V)));

INLINE vd vd_select(vl m, vd a, vd b)
{
    return (vd)((m & (vl)a) | (~m & (vl)b));
}

INLINE vd vd_abs(vd a)
{
    return (vd)((vl)a & INT64_MAX);
}

INLINE vd vd_max(vd a, vd b)
{
    return vd_select((vl)(a > b), a, b);
}

typedef struct rays {
    vd r[3]; /* magnitudes */
} rays;

INLINE rays rays_at(const trip_camera *c, vd x, vd y)
{
    const double r0[3] = { c->r0.x, c->r0.y, c->r0.z };
    const double rx[3] = { c->rx.x, c->rx.y, c->rx.z }, ry[3] = { c->ry.x, c->ry.y, c->ry.z };
    rays out;
    for (int i = 0; i < 3; i++) {
        vd r = vd_set(r0[i]);
        if (!c->ortho)
            r = r + (vd_set(rx[i]) * x + vd_set(ry[i]) * y);
        out.r[i] = vd_abs(r);
    }
    return out;
}

/* As largest_axis() of weight.c: the first of equals. */
INLINE vl is_largest(const rays *r, int axis)
{
    vl x = (vl)(r->r[0] >= r->r[1]) & (vl)(r->r[0] >= r->r[2]);
    if (axis == 0)
        return x;
    vl y = ~x & (vl)(r->r[1] >= r->r[2]);
    return axis == 1 ? y : ~x & ~y;
}

INLINE vd weight_half(const trip_cpu_view *view, const trip_settings *s, int axis, vd x, vd y)
{
    if (s->method == TRIP_METHOD_AXIS)
        return vd_set(axis == view->of->plan->axis_of_view);
    rays r = rays_at(&view->splat.camera, x, y);
    if (s->method == TRIP_METHOD_CLIP)
        return vd_select(is_largest(&r, axis), vd_set(1), vd_set(0));
    vd most = vd_max(r.r[0], vd_max(r.r[1], r.r[2]));
    return vd_max(vd_set(0), (r.r[axis] / most - vd_set(s->h)) / vd_set(1 - s->h));
}

INLINE vd_pair centres(int first, const float offsets[V])
{
    vf f = v_load(offsets);
    return (vd_pair){ vd_low(f) + vd_set(first), vd_high(f) + vd_set(first) };
}

/* The list's weight at the pixels of block (column, row) of the tile at (x, y). */
INLINE vf weight(const trip_cpu_view *view, int axis, int x, int y, int column, int row)
{
    float across[V], down[V];
    for (int i = 0; i < V; i++) {
        across[i] = (float)(4 * column + i % 4) + 0.5f;
        down[i] = (float)(BLOCK_ROWS * row + i / 4) + 0.5f;
    }
    vd_pair px = centres(x, across), py = centres(y, down);
    const trip_settings *s = view->of->settings;
    return v_narrow(weight_half(view, s, axis, px.lo, py.lo),
                    weight_half(view, s, axis, px.hi, py.hi));
}

/* Lanes of a block that lie in the image. */
INLINE vm in_image(const trip_camera *camera, int x, int y, int column, int row)
{
    vf px, py;
    for (int i = 0; i < V; i++) {
        px[i] = (float)(x + 4 * column + i % 4);
        py[i] = (float)(y + BLOCK_ROWS * row + i / 4);
    }
    return vm_and(v_gt(v_set((float)camera->width), px), v_gt(v_set((float)camera->height), py));
}

static void tile_clear(const trip_cpu_view *view, int x, int y, bool alone, float *pixels)
{
    for (int b = 0; b < BLOCKS; b++) {
        float *block = pixels + BLOCK_FLOATS * b;
        int column = b % BLOCKS_ACROSS, row = b / BLOCKS_ACROSS;
        vf t = v_set(1);
        if (view->front_to_back) {
            vm open = in_image(&view->splat.camera, x, y, column, row);
            if (!alone)
                open = vm_and(open, v_gt(weight(view, view->axis, x, y, column, row), v_set(0)));
            t = v_select(open, t, v_set(0));
        }
        for (int c = 0; c < 3; c++)
            v_store(block + c * V, v_set(0));
        v_store(block + 3 * V, t);
    }
}

static void tile_merge(const trip_cpu_view *view, int x, int y, const float *pixels, bool first,
                       float *sum)
{
    for (int b = 0; b < BLOCKS; b++) {
        const float *block = pixels + BLOCK_FLOATS * b;
        float *to = sum + BLOCK_FLOATS * b;
        vf w = weight(view, view->axis, x, y, b % BLOCKS_ACROSS, b / BLOCKS_ACROSS);
        w = w * w;
        for (int c = 0; c < 4; c++) {
            vf layer = v_load(block + c * V);
            if (c == 3)
                layer = v_set(1) - layer;
            v_store(to + c * V, first ? w * layer : v_fma(w, layer, v_load(to + c * V)));
        }
    }
}

/* Sum of the squares of the lists' weights at a block: 1 unless lists are merged. */
INLINE vf weight_sum(const trip_cpu_view *view, int x, int y, int b)
{
    vf sum = v_set(0);
    if (view->of->settings->method != TRIP_METHOD_MERGE)
        return v_set(1);
    for (int axis = 0; axis < 3; axis++) {
        vf w = weight(view, axis, x, y, b % BLOCKS_ACROSS, b / BLOCKS_ACROSS);
        sum = v_fma(w, w, sum);
    }
    return sum;
}

/* Block b of the picture before the background. */
INLINE void merged_block(const trip_cpu_view *view, int x, int y, int b, trip_cpu_content content,
                         const float *pixels, vf out[4])
{
    vf inverse = content == TRIP_CPU_SUM ? v_set(1) / weight_sum(view, x, y, b) : v_set(1);
    for (int c = 0; c < 4; c++)
        out[c] = v_load(pixels + BLOCK_FLOATS * b + c * V) * inverse;
    if (content == TRIP_CPU_LAYER)
        out[3] = v_set(1) - out[3];
}

/* The block over the background. */
INLINE void finish_block(const trip_cpu_view *view, int x, int y, int b, trip_cpu_content content,
                         const float *pixels, vf out[4])
{
    const double *background = view->of->settings->background;
    vf merged[4] = { v_set(0), v_set(0), v_set(0), v_set(0) };
    if (content != TRIP_CPU_NOTHING)
        merged_block(view, x, y, b, content, pixels, merged);
    vf through = v_set(1) - merged[3];
    for (int c = 0; c < 4; c++) {
        double behind = c == 3 ? background[3] : background[c] * background[3];
        out[c] = v_fma(through, v_set((float)behind), merged[c]);
    }
}

static void tile_finish(const trip_cpu_view *view, int x, int y, trip_cpu_content content,
                        const float *pixels, float *rgba)
{
    const trip_camera *camera = &view->splat.camera;
    uint32_t row[V];
    float block[BLOCK_FLOATS];
    for (uint32_t i = 0; i < V; i++)
        row[i] = 4 * i;
    for (int b = 0; b < BLOCKS; b++) {
        vf out[4];
        finish_block(view, x, y, b, content, pixels, out);
        v_store_rows(block, row, out[0], out[1], out[2], out[3]);
        int first = x + 4 * (b % BLOCKS_ACROSS);
        int count = camera->width - first < 4 ? camera->width - first : 4;
        for (int r = 0; r < BLOCK_ROWS && count > 0; r++) {
            int line = y + BLOCK_ROWS * (b / BLOCKS_ACROSS) + r;
            if (line < camera->height)
                memcpy(rgba + 4 * ((size_t)line * (size_t)camera->width + (size_t)first),
                       block + 16 * r, 16 * (size_t)count);
        }
    }
}

#endif
