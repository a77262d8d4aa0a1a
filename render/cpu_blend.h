/* Kernels that blend projected splats into the pixels of a tile: included by each cpu_isa_*.c after
 * cpu_simd.h. Splats are first paired with the blocks they may touch, so that the loop that blends
 * is one flat loop over pairs, whatever the footprints' sizes; each pixel still meets the splats in
 * their order. */
#ifndef TRIP_CPU_BLEND_H
#define TRIP_CPU_BLEND_H

#include "cpu_kernels.h"
#include "cpu_simd.h"

#define BLOCK_ROWS (V / 4)
#define BLOCKS_ACROSS (TRIP_CPU_TILE / 4)
#define BLOCKS_DOWN (TRIP_CPU_TILE / BLOCK_ROWS)
#define BLOCKS (BLOCKS_ACROSS * BLOCKS_DOWN)
#define BLOCK_FLOATS (4 * V)

/* ---- exponentials ---- */

/* 2^(y / TRIP_CPU_EXP_UNIT - 127) within 7.5e-5 of itself, for y in [0, 254 TRIP_CPU_EXP_UNIT]. The
 * integer part becomes the float's exponent; a cubic does the mantissa. */
INLINE vf exp2_biased(vf y)
{
    vi i = v_truncate(y);
    vf m = v_from_bits(vi_low_or(i, 0x7fffff, 0x3f800000));
    vf p = v_fma(v_set(0.0780245233f), m, v_set(-0.00800641098f));
    p = v_fma(p, m, v_set(0.477772789f));
    p = v_fma(p, m, v_set(0.452134318f));
    return v_from_bits(i & 0x7f800000) * p;
}

/* exp(-x), x >= 0, within 1.1e-4 of itself and exact at 0, so that the faint rims of many splats
 * add up to nothing wrong. */
INLINE vf exp_minus(vf x)
{
    const float unit = (float)(1.44269504088896340736 * TRIP_CPU_EXP_UNIT);
    vf y = v_fnma(x, v_set(unit), v_set((float)(127 * TRIP_CPU_EXP_UNIT)));
    vi i = v_truncate(v_max(y, v_set(0)));
    vf m = v_from_bits(vi_low_or(i, 0x7fffff, 0x3f800000));
    vf p = v_fma(v_set(0.0782679702f), m, v_set(-0.0084962282f));
    p = v_fma(p, m, v_set(0.477612893f));
    p = v_fma(p, m, v_set(0.452615365f));
    return v_from_bits(i & 0x7f800000) * p;
}

/* (1 - exp(-x)) / x within 8e-5 of itself, for 0 <= x <= TRIP_CPU_THIN. */
INLINE vf thin_ratio(vf x)
{
    vf p = v_fma(v_set(0.143569535f), x, v_set(-0.496570851f));
    return v_fma(p, x, v_set(0.999921664f));
}

/* ---- what a target keeps ---- */

/* To the nearest half float (normal range), ties to even. */
INLINE vf to_half(vf a)
{
    vi bits = v_bits(a);
    return v_from_bits((bits + 0xfff + (v_shift_right(bits, 13) & 1)) & ~0x1fff);
}

INLINE vf to_unorm8(vf a)
{
    vf steps = v_fma(v_min(v_set(1), v_max(v_set(0), a)), v_set(255), v_set(0.5f));
    return v_from_int(v_truncate(steps)) * v_set(1.0f / 255);
}

INLINE vf kept(vf a, trip_target target)
{
    if (target == TRIP_TARGET_RGBA16F)
        return to_half(a);
    if (target == TRIP_TARGET_RGBA8)
        return to_unorm8(a);
    return a;
}

/* ---- blending ---- */

/* Optical depth of a splat at the pixels of a block, where `inside`. */
INLINE vf optical_depth(const trip_cpu_scratch *s, const trip_cpu_splat *splat, unsigned block,
                        trip_cpu_rays rays, vm *inside)
{
    vf dx = v_load(s->columns + 16 * (block & (BLOCKS_ACROSS - 1))) - v_set(splat->x);
    vf dy = v_load(s->rows + 16 * (block / BLOCKS_ACROSS)) - v_set(splat->y);
    vf a = v_fma(dy, v_set(splat->l21), dx * v_set(splat->l11));
    vf b = dy * v_set(splat->l22);
    vf y;
    if (rays == TRIP_CPU_PARALLEL)
        y = v_fnma(b, b, v_fnma(a, a, v_set(splat->peak)));
    else
        y = v_fnma(v_load(s->rays + V * block), v_fma(b, b, a * a), v_set(splat->peak));
    *inside = v_ge(y, v_set(splat->least));
    if (rays == TRIP_CPU_STRETCHED)
        y = y + v_load(s->stretch + V * block);
    return exp2_biased(y);
}

/* Front to back: `splat` goes behind what the pixels hold. */
INLINE void put_behind(float *pixels, const trip_cpu_splat *splat, vf depth, vm inside,
                       trip_target target)
{
    vf t = v_load(pixels + 3 * V);
    vm open = v_ge_and(inside, t, v_set((float)TRIP_SATURATION));
    vf taken, left;
    if (splat->thick != 0) {
        left = v_mul_where(open, t, exp_minus(depth));
        taken = t - left;
    } else {
        taken = v_mul_or_zero(open, t * depth, thin_ratio(depth));
        left = t - taken;
    }
    for (int c = 0; c < 3; c++) {
        vf colour = v_fma(taken, v_set((&splat->r)[c]), v_load(pixels + c * V));
        v_store(pixels + c * V, kept(colour, target));
    }
    if (target != TRIP_TARGET_RGBA32F)
        left = v_set(1) - kept(v_set(1) - left, target);
    v_store(pixels + 3 * V, left);
}

/* Back to front: `splat` goes over what the pixels hold. */
INLINE void put_over(float *pixels, const trip_cpu_splat *splat, vf depth, vm inside,
                     trip_target target)
{
    vf keep = v_select(inside, exp_minus(depth), v_set(1));
    for (int c = 0; c < 3; c++) {
        vf colour = v_set((&splat->r)[c]);
        colour = v_fma(v_load(pixels + c * V) - colour, keep, colour);
        colour = v_select(inside, kept(colour, target), v_load(pixels + c * V));
        v_store(pixels + c * V, colour);
    }
    vf left = v_load(pixels + 3 * V) * keep;
    if (target != TRIP_TARGET_RGBA32F)
        left = v_set(1) - kept(v_set(1) - left, target);
    v_store(pixels + 3 * V, left);
}

INLINE void blend_pairs(trip_cpu_scratch *s, trip_cpu_rays rays, bool front_to_back,
                        trip_target target)
{
    for (uint32_t i = 0; i < s->pair_count; i++) {
        unsigned block = s->pairs[i] & 255;
        const trip_cpu_splat *splat = &s->local[s->pairs[i] >> 8];
        float *pixels = s->pixels + BLOCK_FLOATS * block;
        vm inside;
        vf depth = optical_depth(s, splat, block, rays, &inside);
        if (front_to_back)
            put_behind(pixels, splat, depth, inside, target);
        else
            put_over(pixels, splat, depth, inside, target);
    }
}

#define BLEND(name, rays, front_to_back, target)                                                   \
    static void name(trip_cpu_scratch *s)                                                          \
    {                                                                                              \
        blend_pairs(s, rays, front_to_back, target);                                               \
    }
BLEND(behind_parallel, TRIP_CPU_PARALLEL, true, TRIP_TARGET_RGBA32F)
BLEND(behind_perspective, TRIP_CPU_PERSPECTIVE, true, TRIP_TARGET_RGBA32F)
BLEND(behind_stretched, TRIP_CPU_STRETCHED, true, TRIP_TARGET_RGBA32F)
BLEND(behind_half, TRIP_CPU_STRETCHED, true, TRIP_TARGET_RGBA16F)
BLEND(behind_unorm8, TRIP_CPU_STRETCHED, true, TRIP_TARGET_RGBA8)
BLEND(over_float, TRIP_CPU_STRETCHED, false, TRIP_TARGET_RGBA32F)
BLEND(over_half, TRIP_CPU_STRETCHED, false, TRIP_TARGET_RGBA16F)
BLEND(over_unorm8, TRIP_CPU_STRETCHED, false, TRIP_TARGET_RGBA8)
#undef BLEND

static void (*choose_blend(const trip_cpu_view *view))(trip_cpu_scratch *)
{
    static void (*const behind[])(trip_cpu_scratch *) = { behind_stretched, behind_half,
                                                          behind_unorm8 };
    static void (*const over[])(trip_cpu_scratch *) = { over_float, over_half, over_unorm8 };
    if (view->rays == TRIP_CPU_PARALLEL)
        return behind_parallel;
    if (view->rays == TRIP_CPU_PERSPECTIVE)
        return behind_perspective;
    return (view->front_to_back ? behind : over)[view->of->settings->target];
}

/* ---- pairing ---- */

/* Which blocks may still take light. Closed pixels never change, so asking late is no error. */
static void find_open(trip_cpu_scratch *s)
{
    s->any_open = false;
    for (unsigned b = 0; b < BLOCKS; b++) {
        unsigned right = b % BLOCKS_ACROSS >= BLOCKS_ACROSS / 2, low = b >= BLOCKS / 2;
        bool ours = s->quarters >> (right + 2 * low) & 1;
        vf t = v_load(s->pixels + BLOCK_FLOATS * b + 3 * V);
        bool open = !s->view->front_to_back || vm_bits(v_ge(t, v_set((float)TRIP_SATURATION))) != 0;
        s->open[b] = ours && open;
        s->any_open |= s->open[b];
    }
}

static void empty_pairs(trip_cpu_scratch *s)
{
    s->blend(s);
    s->splats = s->pair_count = 0;
    find_open(s);
}

/* Rows of blocks that a small footprint, five pixels, may meet. */
#define FEW_ROWS (V == 16 ? 2 : V == 8 ? 3 : 5)

INLINE void add_pair(trip_cpu_scratch *s, uint32_t splat, unsigned block, unsigned wanted)
{
    s->pairs[s->pair_count] = splat << 8 | block;
    s->pair_count += s->open[block] & wanted;
}

INLINE int at_least(int a, int b)
{
    return a > b ? a : b;
}

INLINE int at_most(int a, int b)
{
    return a < b ? a : b;
}

INLINE void pair_up(trip_cpu_scratch *s, const trip_cpu_splat *splat)
{
    uint32_t index = s->splats++;
    trip_cpu_splat *local = &s->local[index];
    *local = *splat;
    local->x = splat->x + (splat->whole_x - (float)s->x);
    local->y = splat->y + (splat->whole_y - (float)s->y);

    unsigned left = (unsigned)at_least(splat->x0 - s->x, 0) / 4;
    unsigned right = (unsigned)at_most(splat->x1 - s->x, TRIP_CPU_TILE - 1) / 4;
    unsigned top = (unsigned)at_least(splat->y0 - s->y, 0) / BLOCK_ROWS;
    unsigned bottom = (unsigned)at_most(splat->y1 - s->y, TRIP_CPU_TILE - 1) / BLOCK_ROWS;
    if (right - left < 2 && bottom - top < FEW_ROWS) {
        unsigned first = top * BLOCKS_ACROSS + left;
        for (unsigned row = 0; row < FEW_ROWS; row++) {
            add_pair(s, index, first + row * BLOCKS_ACROSS, top + row <= bottom);
            add_pair(s, index, first + row * BLOCKS_ACROSS + 1,
                     (right > left) & (top + row <= bottom));
        }
        return;
    }
    for (unsigned row = top; row <= bottom; row++)
        for (unsigned column = left; column <= right; column++)
            add_pair(s, index, row * BLOCKS_ACROSS + column, 1);
}

static bool meets(const trip_cpu_scratch *s, const trip_cpu_splat *splat)
{
    return splat->x0 < s->x + TRIP_CPU_TILE && splat->x1 >= s->x &&
           splat->y0 < s->y + TRIP_CPU_TILE && splat->y1 >= s->y;
}

static void tile_blend(trip_cpu_scratch *s, const trip_cpu_splat *splats, const uint16_t *order,
                       uint32_t count)
{
    for (uint32_t i = 0; i < count && s->any_open; i++) {
        const trip_cpu_splat *splat = &splats[order ? order[i] : i];
        if (!order && !meets(s, splat))
            continue;
        pair_up(s, splat);
        if (s->splats == TRIP_CPU_LOCAL || s->pair_count > TRIP_CPU_PAIRS - BLOCKS)
            empty_pairs(s);
    }
}

static bool tile_end(trip_cpu_scratch *s)
{
    empty_pairs(s);
    return s->any_open;
}

/* ---- taking up a tile ---- */

/* A quadratic form over the image, |a + x b + y c|^2 about its middle. */
typedef struct square {
    vf aa, ab, ac, bb, bc, cc;
} square;

INLINE square square_of(trip_vec3 a, trip_vec3 b, trip_vec3 c)
{
    return (square){
        v_set((float)trip_dot(a, a)), v_set((float)trip_dot(a, b)), v_set((float)trip_dot(a, c)),
        v_set((float)trip_dot(b, b)), v_set((float)trip_dot(b, c)), v_set((float)trip_dot(c, c)),
    };
}

INLINE vf square_at(const square *q, vf x, vf y)
{
    vf ab = v_fma(x, q->bb, v_fma(y + y, q->bc, q->ab + q->ab));
    vf ac = v_fma(y, q->cc, q->ac + q->ac);
    return v_fma(x, ab, v_fma(y, ac, q->aa));
}

static void set_pixel_centres(trip_cpu_scratch *s)
{
    for (int b = 0; b < BLOCKS_ACROSS; b++)
        for (int i = 0; i < V; i++)
            s->columns[16 * b + i] = (float)(4 * b + i % 4) + 0.5f;
    for (int b = 0; b < BLOCKS_DOWN; b++)
        for (int i = 0; i < V; i++)
            s->rows[16 * b + i] = (float)(BLOCK_ROWS * b + i / 4) + 0.5f;
}

/* log2 a for the stretch, a in a modest range; by the library, since few views need it. */
static vf log2_each(vf a)
{
    for (int i = 0; i < V; i++)
        a[i] = log2f(a[i]);
    return a;
}

static void set_rays_tables(trip_cpu_scratch *s)
{
    const trip_camera *c = &s->view->splat.camera;
    const trip_affine *world = &c->index_to_world;
    trip_vec3 r = trip_camera_ray(c, 0.5 * c->width, 0.5 * c->height);
    trip_vec3 rx = c->ortho ? trip_v3(0, 0, 0) : c->rx, ry = c->ortho ? trip_v3(0, 0, 0) : c->ry;
    square index = square_of(r, rx, ry);
    square stretched = square_of(trip_affine_vector(world, r), trip_affine_vector(world, rx),
                                 trip_affine_vector(world, ry));
    vf x0 = v_set((float)(s->x - 0.5 * c->width)), y0 = v_set((float)(s->y - 0.5 * c->height));
    for (int b = 0; b < BLOCKS; b++) {
        vf x = x0 + v_load(s->columns + 16 * (b % BLOCKS_ACROSS));
        vf y = y0 + v_load(s->rows + 16 * (b / BLOCKS_ACROSS));
        vf inverse = v_set(1) / square_at(&index, x, y);
        v_store(s->rays + V * b, c->ortho ? v_set(1) : inverse);
        vf log2_stretch = v_set(0);
        if (s->view->stretch_varies)
            log2_stretch = log2_each(square_at(&stretched, x, y) * inverse) *
                           v_set((float)(0.5 * TRIP_CPU_EXP_UNIT));
        if (s->view->rays == TRIP_CPU_STRETCHED)
            v_store(s->stretch + V * b, log2_stretch);
    }
}

static void tile_begin(const trip_cpu_view *view, trip_cpu_scratch *s, int x, int y,
                       unsigned quarters, float *pixels)
{
    s->view = view;
    s->x = x;
    s->y = y;
    s->quarters = quarters;
    s->pixels = pixels;
    s->splats = s->pair_count = 0;
    s->blend = choose_blend(view);
    set_pixel_centres(s);
    if (view->rays != TRIP_CPU_PARALLEL)
        set_rays_tables(s);
    find_open(s);
}

#endif
