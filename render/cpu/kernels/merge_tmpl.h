/* Clears and finishes the pixels of a pane: the weights of the lists, the merge (equation 3 of
 * Hofsetz, Max & Bastos 2008) and the picture. Included by table_tmpl.h after blend_tmpl.h.
 *
 * The weights equal the results of weight.c in double precision, with the same operations in the
 * same order. A list therefore begins at the same pixel in all code, and small weights are exact
 * for any h. */
#ifndef TRIP_CPU_MERGE_H
#define TRIP_CPU_MERGE_H

#include "cpu/kernels/blend_tmpl.h"
#include "cpu/kernels/kernels.h"
#include "cpu/kernels/project_tmpl.h"
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

typedef struct rays {
    vd r[3]; /* magnitudes of the components */
} rays;

INLINE vd component_at(const trip_camera *c, int axis, vd x, vd y)
{
    vd r = vd_set(trip_component(c->r0, axis));
    if (c->ortho)
        return r;
    return r + (vd_set(trip_component(c->rx, axis)) * x + vd_set(trip_component(c->ry, axis)) * y);
}

INLINE rays rays_at(const trip_camera *c, vd x, vd y)
{
    rays out;
    for (int i = 0; i < 3; i++)
        out.r[i] = vd_abs(component_at(c, i, x, y));
    return out;
}

/* Agrees with largest_axis() of weight.c: the first of equal components is the largest. */
INLINE vl is_largest(const rays *r, int axis)
{
    vl x = (vl)(r->r[0] >= r->r[1]) & (vl)(r->r[0] >= r->r[2]);
    if (axis == 0)
        return x;
    vl y = ~x & (vl)(r->r[1] >= r->r[2]);
    return axis == 1 ? y : ~x & ~y;
}

INLINE vd max_of(const rays *r)
{
    return vd_max(r->r[0], vd_max(r->r[1], r->r[2]));
}

/* Does not index the array, so that compilers keep the vectors in registers. */
INLINE vd magnitude(const rays *r, int axis)
{
    return axis == 0 ? r->r[0] : axis == 1 ? r->r[1] : r->r[2];
}

INLINE vd weight_half(const trip_cpu_view *view, const trip_settings *s, int axis, const rays *r)
{
    if (s->method == TRIP_METHOD_AXIS)
        return vd_set(axis == view->of->plan->axis_of_view);
    if (s->method == TRIP_METHOD_CLIP)
        return vd_select(is_largest(r, axis), vd_set(1), vd_set(0));
    const double h = trip_settings_h(s);
    return vd_max(vd_set(0), (magnitude(r, axis) / max_of(r) - vd_set(h)) / vd_set(1 - h));
}

INLINE vd_pair centres(int first, const float offsets[V])
{
    vf f = v_load(offsets);
    return (vd_pair){ vd_low(f) + vd_set(first), vd_high(f) + vd_set(first) };
}

/* Rays through the pixels of a stamp, and 1 / (largest magnitude) of each ray. The inverse is one
 * Newton step from the single-precision quotient. Its relative error is at most 2^-45 in lanes of
 * `safe`, where the magnitude is in a safe range. */
typedef struct pixel_rays {
    rays lo, hi;
    vd_pair inverse;
    vm safe;
} pixel_rays;

typedef struct pixel_centres {
    vd_pair x, y;
} pixel_centres;

INLINE pixel_centres centres_at(int x, int y, int column, int row)
{
    float across[V], down[V];
    for (int i = 0; i < V; i++) {
        across[i] = (float)(4 * column + i % 4) + 0.5f;
        down[i] = (float)(STAMP_ROWS * row + i / 4) + 0.5f;
    }
    return (pixel_centres){ centres(x, across), centres(y, down) };
}

INLINE pixel_rays pixel_rays_at(const trip_cpu_view *view, int x, int y, int column, int row)
{
    const pixel_centres p = centres_at(x, y, column, row);
    const trip_camera *camera = view->of->camera;
    rays lo = rays_at(camera, p.x.lo, p.y.lo), hi = rays_at(camera, p.x.hi, p.y.hi);
    vd_pair max = { max_of(&lo), max_of(&hi) };
    vf z = v_narrow(max.lo, max.hi), inverse = v_set(1) / z;
    return (pixel_rays){
        lo,
        hi,
        { refine(max.lo, vd_low(inverse)), refine(max.hi, vd_high(inverse)) },
        vm_and(v_gt(z, v_set(0x1p-60f)), v_gt(v_set(0x1p60f), z)),
    };
}

/* Returns the list's weight at a stamp's pixels. The products with the inverses differ from the
 * exact quotients by at most 2^-44. If both bounds round to one float, the weight is this float.
 * Otherwise it is computed with divisions. */
INLINE vf weight(const trip_cpu_view *view, int axis, const pixel_rays *r)
{
    const trip_settings *s = view->of->settings;
    if (s->method == TRIP_METHOD_MERGE) {
        const double h = trip_settings_h(s), scale = 1 / (1 - h), slack = 0x1p-44 * scale;
        vd lo = vd_fma(magnitude(&r->lo, axis), r->inverse.lo, vd_set(-h)) * vd_set(scale);
        vd hi = vd_fma(magnitude(&r->hi, axis), r->inverse.hi, vd_set(-h)) * vd_set(scale);
        const vd off = vd_set(slack);
        vf below = v_max(v_narrow(lo - off, hi - off), v_set(0));
        vf above = v_max(v_narrow(lo + off, hi + off), v_set(0));
        if (vm_all(vm_and(r->safe, v_ge(below, above))))
            return below;
    }
    return v_narrow(weight_half(view, s, axis, &r->lo), weight_half(view, s, axis, &r->hi));
}

/* Returns 1 for rays that go up an axis by trip_ray_goes(), otherwise 0. */
INLINE vd is_upwards(const trip_camera *c, int axis, vd x, vd y)
{
    return vd_select((vl)(component_at(c, axis, x, y) >= vd_set(0)), vd_set(1), vd_set(0));
}

/* Returns the weight of the view's layer at a stamp's pixels. It is 0 for rays in the opposite
 * direction. */
INLINE vf layer_weight(const trip_cpu_view *view, int x, int y, int column, int row)
{
    pixel_rays r = pixel_rays_at(view, x, y, column, row);
    vf w = weight(view, view->axis, &r);
    if (view->way == TRIP_WAY_ANY)
        return w;
    const pixel_centres p = centres_at(x, y, column, row);
    const trip_camera *camera = view->of->camera;
    vf up = v_narrow(is_upwards(camera, view->axis, p.x.lo, p.y.lo),
                     is_upwards(camera, view->axis, p.x.hi, p.y.hi));
    return w * (view->way == TRIP_WAY_UP ? up : v_set(1) - up);
}

INLINE vm in_image(const trip_camera *camera, int x, int y, int column, int row)
{
    vf px, py;
    for (int i = 0; i < V; i++) {
        px[i] = (float)(x + 4 * column + i % 4);
        py[i] = (float)(y + STAMP_ROWS * row + i / 4);
    }
    return vm_and(v_gt(v_set((float)camera->width), px), v_gt(v_set((float)camera->height), py));
}

static void pane_clear(const trip_cpu_view *view, int x, int y, bool alone, float *pixels)
{
    for (int b = 0; b < STAMPS; b++) {
        float *stamp = pixels + STAMP_FLOATS * b;
        int column = b % STAMPS_ACROSS, row = b / STAMPS_ACROSS;
        vf t = v_set(1);
        if (view->front_to_back) {
            vm open = in_image(&view->splat.camera, x, y, column, row);
            if (!alone)
                open = vm_and(open, v_gt(layer_weight(view, x, y, column, row), v_set(0)));
            t = v_select(open, t, v_set(0));
        }
        for (int c = 0; c < 3; c++)
            v_store(stamp + c * V, v_set(0));
        v_store(stamp + 3 * V, t);
        if (TRIP_CPU_DEPTH)
            v_store(stamp + TRIP_CHANNEL_DEPTH * V, v_set(0));
    }
}

static void pane_merge(const trip_cpu_view *view, int x, int y, const float *pixels, bool first,
                       float *sum)
{
    for (int b = 0; b < STAMPS; b++) {
        const float *stamp = pixels + STAMP_FLOATS * b;
        float *to = sum + STAMP_FLOATS * b;
        vf w = layer_weight(view, x, y, b % STAMPS_ACROSS, b / STAMPS_ACROSS);
        w = w * w;
        for (int c = 0; c < CHANNELS; c++) {
            vf layer = v_load(stamp + c * V);
            if (c == 3)
                layer = v_set(1) - layer;
            v_store(to + c * V, first ? w * layer : v_fma(w, layer, v_load(to + c * V)));
        }
    }
}

/* Returns 1 / (sum of the squared weights of the lists) at a stamp's pixels; 1 if lists are not
 * merged. */
INLINE vf inverse_weight(const trip_cpu_view *view, int x, int y, int b)
{
    vf sum = v_set(0);
    if (view->of->settings->method != TRIP_METHOD_MERGE)
        return v_set(1);
    pixel_rays r = pixel_rays_at(view, x, y, b % STAMPS_ACROSS, b / STAMPS_ACROSS);
    for (int axis = 0; axis < 3; axis++) {
        vf w = weight(view, axis, &r);
        sum = v_fma(w, w, sum);
    }
    return v_set(1) / sum;
}

/* Computes stamp b of the picture without the background. */
INLINE void merged_stamp(const trip_cpu_view *view, int x, int y, int b, trip_cpu_content content,
                         const float *pixels, vf out[CHANNELS])
{
    for (int c = 0; c < CHANNELS; c++)
        out[c] = v_load(pixels + STAMP_FLOATS * b + c * V);
    if (content == TRIP_CPU_LAYER) {
        out[3] = v_set(1) - out[3];
        return;
    }
    vf inverse = inverse_weight(view, x, y, b);
    for (int c = 0; c < CHANNELS; c++)
        out[c] = out[c] * inverse;
}

/* Returns a channel of the premultiplied background. */
INLINE float behind(const trip_cpu_view *view, int channel)
{
    const double *background = view->of->settings->background;
    return (float)(channel == 3 ? background[3] : background[channel] * background[3]);
}

/* Stores a stamp's pixels. Lines are `line_floats` apart. Only the first `count` columns and
 * `lines` lines lie in the image. */
INLINE void store_pixels(float *rgba, size_t line_floats, int count, int lines, const vf out[4])
{
    uint32_t row[V];
    bool whole = count >= 4 && lines >= STAMP_ROWS;
    float stamp[STAMP_FLOATS];
    for (uint32_t i = 0; i < V; i++)
        row[i] = 4 * (i % 4) + i / 4 * (whole ? (uint32_t)line_floats : 16);
    v_store_rows(whole ? rgba : stamp, row, out[0], out[1], out[2], out[3]);
    if (whole)
        return;
    for (int r = 0; r < STAMP_ROWS && r < lines && count > 0; r++)
        memcpy(rgba + (size_t)r * line_floats, stamp + 16 * r,
               16 * (size_t)(count < 4 ? count : 4));
}

/* Fills a pane in which no list has drawn. Lines are `width` pixels apart. Only the first `count`
 * columns and `lines` lines lie in the image. */
static void pane_background(const trip_cpu_view *view, float *rgba, float *depth, size_t width,
                            int count, int lines)
{
    const float pixel[4] = { behind(view, 0), behind(view, 1), behind(view, 2), behind(view, 3) };
    count = count < TRIP_CPU_PANE ? count : TRIP_CPU_PANE;
    for (int r = 0; r < lines && r < TRIP_CPU_PANE; r++)
        for (int i = 0; i < count; i++) {
            memcpy(rgba + 4 * ((size_t)r * width + (size_t)i), pixel, sizeof pixel);
            if (TRIP_CPU_DEPTH)
                depth[(size_t)r * width + (size_t)i] = INFINITY;
        }
}

/* Returns the mean distance of the visible matter (layer.h) at a stamp's pixels, from the merged
 * sums. */
INLINE vf mean_distance(const trip_cpu_view *view, int x, int y, unsigned b, vf depth, vf alpha)
{
    const trip_camera *camera = &view->splat.camera;
    vf px = v_set((float)(x - 0.5 * camera->width)) + stamp_x(b);
    vf py = v_set((float)(y - 0.5 * camera->height)) + stamp_y(b);
    vf ray_length = v_sqrt(form_at(view->world2, px, py)) * v_set((float)view->stretch);
    vm seen = v_gt(alpha, v_set(0));
    return v_select(seen, depth / v_select(seen, alpha, v_set(1)) * ray_length, v_set(INFINITY));
}

/* Stores the distances of a stamp's pixels. The arguments are as in store_pixels(), in pixels. */
INLINE void store_depths(float *depth, size_t width, int count, int lines, vf distances)
{
    float stamp[V];
    v_store(stamp, distances);
    for (int r = 0; r < STAMP_ROWS && r < lines; r++)
        for (int i = 0; i < 4 && i < count; i++)
            depth[(size_t)r * width + (size_t)i] = stamp[4 * r + i];
}

static void pane_finish(const trip_cpu_view *view, int x, int y, trip_cpu_content content,
                        const float *pixels, float *rgba, float *depth)
{
    const trip_camera *camera = &view->splat.camera;
    const size_t width = (size_t)camera->width, first = (size_t)y * width + (size_t)x;
    rgba += 4 * first;
    if (TRIP_CPU_DEPTH)
        depth += first;
    if (content == TRIP_CPU_NOTHING) {
        pane_background(view, rgba, depth, width, camera->width - x, camera->height - y);
        return;
    }
    for (int b = 0; b < STAMPS; b++) {
        int column = 4 * (b % STAMPS_ACROSS), line = STAMP_ROWS * (b / STAMPS_ACROSS);
        int columns = camera->width - x - column, lines = camera->height - y - line;
        size_t at = (size_t)line * width + (size_t)column;
        vf out[CHANNELS];
        merged_stamp(view, x, y, b, content, pixels, out);
        if (TRIP_CPU_DEPTH)
            store_depths(depth + at, width, columns, lines,
                         mean_distance(view, x, y, (unsigned)b, out[CHANNELS - 1], out[3]));
        vf through = v_set(1) - out[3];
        for (int c = 0; c < 4; c++)
            out[c] = v_fma(through, v_set(behind(view, c)), out[c]);
        store_pixels(rgba + 4 * at, 4 * width, columns, lines, out);
    }
}

#endif
