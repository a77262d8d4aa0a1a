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

/* So many pairs are worked on at a time. A pair is one long chain of dependent operations, and the
 * processor does not look far enough ahead to find the next ones: so they are written side by
 * side. The numbers are those of one pair at a time. */
#define GROUP 2

#define EACH(i, n) for (int i = 0; i < (n); i++)

/* ---- exponentials ---- */

/* 2^(y / TRIP_CPU_EXP_UNIT - 127) of n vectors within 7.5e-5 of itself, for y in [0, 254
 * TRIP_CPU_EXP_UNIT]. The integer part becomes the float's exponent; a cubic does the mantissa. */
INLINE void exp2_biased(const vf y[], int n, vf out[])
{
    vf m[GROUP], p[GROUP];
    vi power[GROUP];
    EACH(i, n)
    {
        power[i] = v_truncate(y[i]);
        m[i] = v_from_bits(vi_low_or(power[i], 0x7fffff, 0x3f800000));
    }
    EACH(i, n)
    p[i] = v_fma(v_set(0.0780245233f), m[i], v_set(-0.00800641098f));
    EACH(i, n)
    p[i] = v_fma(p[i], m[i], v_set(0.477772789f));
    EACH(i, n)
    p[i] = v_fma(p[i], m[i], v_set(0.452134318f));
    EACH(i, n)
    out[i] = v_from_bits(power[i] & 0x7f800000) * p[i];
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

/* 1 - exp(-x) of n vectors within 8e-5 of itself, for 0 <= x <= TRIP_CPU_THIN. */
INLINE void thin_opacity(const vf x[], int n, vf out[])
{
    vf p[GROUP];
    EACH(i, n)
    p[i] = v_fma(v_set(0.143569535f), x[i], v_set(-0.496570851f));
    EACH(i, n)
    p[i] = v_fma(p[i], x[i], v_set(0.999921664f));
    EACH(i, n)
    out[i] = p[i] * x[i];
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

/* The pairs of a group, unpacked. */
typedef struct group {
    const trip_cpu_splat *splat[GROUP];
    const float *geometry[GROUP];
    float *pixels[GROUP];
} group;

INLINE group unpack(const trip_cpu_scratch *s, const uint32_t *pairs, int n)
{
    group g;
    EACH(i, n)
    {
        size_t block = BLOCK_FLOATS * (size_t)(pairs[i] & 255);
        g.splat[i] = &s->splats[pairs[i] >> 8];
        g.geometry[i] = s->geometry + block;
        g.pixels[i] = s->pixels + block;
    }
    return g;
}

/* Optical depths of splats at the pixels of their blocks, where `inside`. */
INLINE void optical_depths(const group *g, int n, trip_cpu_rays rays, vf depth[], vm inside[])
{
    vf a[GROUP], b[GROUP], y[GROUP];
    EACH(i, n)
    {
        vf py = v_load(g->geometry[i] + V);
        a[i] = v_fma(py, v_set(g->splat[i]->l21), v_set(g->splat[i]->u));
        b[i] = v_fma(py, v_set(g->splat[i]->l22), v_set(g->splat[i]->w));
    }
    EACH(i, n)
    a[i] = v_fma(v_load(g->geometry[i]), v_set(g->splat[i]->l11), a[i]);
    EACH(i, n)
    y[i] = v_fma(b[i], b[i], a[i] * a[i]);
    EACH(i, n)
    {
        vf scale = rays == TRIP_CPU_PARALLEL ? v_set(1) : v_load(g->geometry[i] + 2 * V);
        y[i] = v_fnma(scale, y[i], v_set(g->splat[i]->peak));
    }
    EACH(i, n)
    inside[i] = v_ge(y[i], v_set(g->splat[i]->least));
    if (rays == TRIP_CPU_STRETCHED)
        EACH(i, n)
    y[i] = y[i] + v_load(g->geometry[i] + 3 * V);
    exp2_biased(y, n, depth);
}

/* Opacities 1 - exp(-depth). */
INLINE void opacities(const group *g, int n, const vf depth[], vf alpha[])
{
    uint32_t thick = 0;
    EACH(i, n)
    thick |= g->splat[i]->thick;
    if (thick == 0) {
        thin_opacity(depth, n, alpha);
        return;
    }
    EACH(i, n)
    {
        if (g->splat[i]->thick)
            alpha[i] = v_set(1) - exp_minus(depth[i]);
        else
            thin_opacity(depth + i, 1, alpha + i);
    }
}

/* Front to back: `splat` goes behind what the pixels hold. */
INLINE void put_behind(float *pixels, const trip_cpu_splat *splat, vf alpha, vm inside,
                       trip_target target)
{
    vf t = v_load(pixels + 3 * V);
    vm open = v_ge_and(inside, t, v_set((float)TRIP_SATURATION));
    vf taken = v_mul_or_zero(open, t, alpha), left = t - taken;
    for (int c = 0; c < 3; c++) {
        vf colour = v_fma(taken, v_set((&splat->r)[c]), v_load(pixels + c * V));
        v_store(pixels + c * V, kept(colour, target));
    }
    if (target != TRIP_TARGET_RGBA32F)
        left = v_set(1) - kept(v_set(1) - left, target);
    v_store(pixels + 3 * V, left);
}

/* Back to front: `splat` goes over what the pixels hold. */
INLINE void put_over(float *pixels, const trip_cpu_splat *splat, vf alpha, vm inside,
                     trip_target target)
{
    vf t = v_load(pixels + 3 * V);
    alpha = v_select(inside, alpha, v_set(0));
    for (int c = 0; c < 3; c++) {
        vf under = v_load(pixels + c * V);
        vf colour = v_fma(alpha, v_set((&splat->r)[c]) - under, under);
        v_store(pixels + c * V, kept(colour, target));
    }
    vf left = v_fnma(t, alpha, t);
    if (target != TRIP_TARGET_RGBA32F)
        left = v_set(1) - kept(v_set(1) - left, target);
    v_store(pixels + 3 * V, left);
}

INLINE void blend_group(const trip_cpu_scratch *s, const uint32_t *pairs, int n, trip_cpu_rays rays,
                        bool front_to_back, trip_target target)
{
    vf depth[GROUP], alpha[GROUP];
    vm inside[GROUP];
    group g = unpack(s, pairs, n);
    optical_depths(&g, n, rays, depth, inside);
    opacities(&g, n, depth, alpha);
    EACH(i, n)
    {
        if (front_to_back)
            put_behind(g.pixels[i], g.splat[i], alpha[i], inside[i], target);
        else
            put_over(g.pixels[i], g.splat[i], alpha[i], inside[i], target);
    }
}

INLINE void blend_pairs(const trip_cpu_scratch *s, trip_cpu_rays rays, bool front_to_back,
                        trip_target target)
{
    uint32_t i = 0;
    for (; i + GROUP <= s->pair_count; i += GROUP)
        blend_group(s, s->pairs + i, GROUP, rays, front_to_back, target);
    for (; i < s->pair_count; i++)
        blend_group(s, s->pairs + i, 1, rays, front_to_back, target);
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

/* Bits of the four blocks at `pixels` that hold a pixel which may still take light. */
INLINE unsigned open_blocks(const float *pixels)
{
    unsigned bits = 0;
    for (unsigned b = 0; b < 4; b++) {
        vm open = v_ge(v_load(pixels + BLOCK_FLOATS * b + 3 * V), v_set((float)TRIP_SATURATION));
        bits |= (unsigned)(vm_bits(open) != 0) << b;
    }
    return bits;
}

/* Which blocks are ours and open: the others' pixels may be another thread's. Closed pixels never
 * change, so asking late is no error. */
static void find_open(trip_cpu_scratch *s)
{
    static_assert(BLOCKS_ACROSS == 8, "four blocks to a quarter");
    unsigned any = 0;
    for (unsigned row = 0; row < BLOCKS_DOWN; row++) {
        const float *pixels = s->pixels + BLOCK_FLOATS * BLOCKS_ACROSS * row;
        unsigned quarters = s->quarters >> (row < BLOCKS_DOWN / 2 ? 0 : 2), bits = 0;
        for (unsigned half = 0; half < 2; half++)
            if (quarters >> half & 1)
                bits |=
                    (s->view->front_to_back ? open_blocks(pixels + 4 * BLOCK_FLOATS * half) : 15u)
                    << 4 * half;
        s->open[row] = (uint8_t)bits;
        any |= bits;
    }
    s->any_open = any;
}

static void empty_pairs(trip_cpu_scratch *s)
{
    s->blend(s);
    s->local_count = s->pair_count = 0;
    find_open(s);
}

/* Pairs of a splat's place with the open blocks of some columns, from row `top` on and `more` rows
 * further, four rows at a time. Returns the end of the pairs. */
INLINE uint32_t *pair_up(const trip_cpu_scratch *s, uint32_t *pairs, uint32_t place,
                         unsigned columns, unsigned top, unsigned more)
{
    static const uint32_t rows[4] = { 0xff, 0xffff, 0xffffff, 0xffffffff };
    uint32_t first = place << 8 | top * BLOCKS_ACROSS;
    columns *= 0x01010101u;
    for (;; top += 4, more -= 4, first += 4 * BLOCKS_ACROSS) {
        uint32_t blocks;
        memcpy(&blocks, s->open + top, sizeof blocks);
        blocks &= columns & rows[more < 3 ? more : 3];
        for (unsigned i = 0; i < 32; i += APPENDED)
            pairs += append_bits(pairs, first + i, blocks >> i & ((1u << APPENDED) - 1));
        if (more < 4)
            return pairs;
    }
}

/* What part of [first, last] lies in the tile's 32 pixels from `corner` on. */
INLINE void clip(int corner, int *first, int *last)
{
    *first = *first > corner ? *first - corner : 0;
    *last = *last - corner < TRIP_CPU_TILE - 1 ? *last - corner : TRIP_CPU_TILE - 1;
}

/* A wide splat: a copy of it, with its centre from this tile's corner. */
static uint32_t *pair_copy(trip_cpu_scratch *s, uint32_t *pairs, uint32_t place)
{
    uint32_t copy = s->local + s->local_count++;
    trip_cpu_splat *c = &s->splats[copy];
    *c = s->splats[place];
    int x0 = c->x0, x1 = c->x1, y0 = c->y0, y1 = c->y1;
    float dx = (float)(s->x - x0 / TRIP_CPU_TILE * TRIP_CPU_TILE);
    float dy = (float)(s->y - y0 / TRIP_CPU_TILE * TRIP_CPU_TILE);
    c->u += c->l11 * dx + c->l21 * dy;
    c->w += c->l22 * dy;
    clip(s->x, &x0, &x1);
    clip(s->y, &y0, &y1);
    unsigned columns = 0xffu << x0 / 4 & 0xffu >> (BLOCKS_ACROSS - 1 - x1 / 4);
    unsigned top = (unsigned)y0 / BLOCK_ROWS, bottom = (unsigned)y1 / BLOCK_ROWS;
    return pair_up(s, pairs, copy, columns, top, bottom - top);
}

/* Blends where there might be no room for another splat's pairs. */
INLINE uint32_t *make_room(trip_cpu_scratch *s, uint32_t *pairs)
{
    if (pairs - s->pairs <= TRIP_CPU_PAIRS - BLOCKS)
        return pairs;
    s->pair_count = (uint32_t)(pairs - s->pairs);
    empty_pairs(s);
    return s->pairs;
}

static void tile_blend(trip_cpu_scratch *s, uint32_t first, uint32_t count)
{
    uint32_t *pairs = s->pairs + s->pair_count;
    for (uint32_t i = first; i < first + count && s->any_open; i++) {
        uint32_t blocks = s->splats[i].blocks;
        __builtin_prefetch(&s->splats[i + 16]);
        pairs = pair_up(s, pairs, i, blocks & 255, blocks >> TRIP_CPU_BLOCKS_TOP_SHIFT & 255,
                        blocks >> TRIP_CPU_BLOCKS_MORE_SHIFT);
        pairs = make_room(s, pairs);
    }
    s->pair_count = (uint32_t)(pairs - s->pairs);
}

static bool meets(const trip_cpu_scratch *s, const trip_cpu_splat *splat)
{
    return splat->x0 < s->x + TRIP_CPU_TILE && splat->x1 >= s->x &&
           splat->y0 < s->y + TRIP_CPU_TILE && splat->y1 >= s->y;
}

static void tile_blend_wide(trip_cpu_scratch *s, uint32_t splat)
{
    if (!s->any_open || !meets(s, &s->splats[splat]))
        return;
    uint32_t *pairs = make_room(s, pair_copy(s, s->pairs + s->pair_count, splat));
    s->pair_count = (uint32_t)(pairs - s->pairs);
    if (s->local_count == TRIP_CPU_LOCAL)
        empty_pairs(s);
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
    if (s->placed)
        return;
    s->placed = true;
    for (int b = 0; b < BLOCKS; b++) {
        float *geometry = s->geometry + BLOCK_FLOATS * b;
        for (int i = 0; i < V; i++) {
            geometry[i] = (float)(4 * (b % BLOCKS_ACROSS) + i % 4) + 0.5f;
            geometry[V + i] = (float)(BLOCK_ROWS * (b / BLOCKS_ACROSS) + i / 4) + 0.5f;
        }
    }
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
        float *geometry = s->geometry + BLOCK_FLOATS * b;
        vf x = x0 + v_load(geometry), y = y0 + v_load(geometry + V);
        vf inverse = v_set(1) / square_at(&index, x, y);
        v_store(geometry + 2 * V, c->ortho ? v_set(1) : inverse);
        vf log2_stretch = v_set(0);
        if (s->view->stretch_varies)
            log2_stretch = log2_each(square_at(&stretched, x, y) * inverse) *
                           v_set((float)(0.5 * TRIP_CPU_EXP_UNIT));
        if (s->view->rays == TRIP_CPU_STRETCHED)
            v_store(geometry + 3 * V, log2_stretch);
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
    s->local_count = s->pair_count = 0;
    s->blend = choose_blend(view);
    set_pixel_centres(s);
    if (view->rays != TRIP_CPU_PARALLEL)
        set_rays_tables(s);
    find_open(s);
}

#endif
