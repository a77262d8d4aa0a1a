/* Kernels that blend projected splats into the pixels of a tile: included by each cpu_isa_*.c after
 * cpu_simd.h. Splats are first paired with the blocks they may touch, so that the loop that blends
 * is one flat loop over pairs, whatever the footprints' sizes; each pixel still meets the splats in
 * their order. */
#ifndef TRIP_CPU_BLEND_H
#define TRIP_CPU_BLEND_H

#include "cpu_exp.h"
#include "cpu_kernels.h"
#include "cpu_simd.h"

#define BLOCK_ROWS (V / 4)
#define BLOCKS_ACROSS (TRIP_CPU_TILE / 4)
#define BLOCKS_DOWN (TRIP_CPU_TILE / BLOCK_ROWS)
#define BLOCKS (BLOCKS_ACROSS * BLOCKS_DOWN)
#define BLOCK_FLOATS (4 * V)
#define BLOCK_BYTES (4 * BLOCK_FLOATS)

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

/* Optical depth of a splat at the pixels of a block: 0 outside its support. */
INLINE vf optical_depth(const float *geometry, const trip_cpu_splat *splat, trip_cpu_rays rays)
{
    const vf zero = v_set(0);
    vf dx = v_load(geometry) - v_set(splat->x);
    vf dy = v_load(geometry + V) - v_set(splat->y);
    vf a = v_fma(dy, v_set(splat->l21), dx * v_set(splat->l11));
    vf b = dy * v_set(splat->l22);
    vf y;
    if (rays == TRIP_CPU_PARALLEL)
        y = v_fnma(b, b, v_fnma(a, a, v_set(splat->peak)));
    else
        y = v_fnma(v_load(geometry + 2 * V), v_fma(b, b, a * a), v_set(splat->peak));
    vf depth = v_max(exp2_biased(v_max(y, zero)) - v_set(splat->edge), zero);
    return rays == TRIP_CPU_STRETCHED ? depth * v_load(geometry + 3 * V) : depth;
}

/* Front to back: `splat` goes behind what the pixels hold. */
INLINE void put_behind(float *pixels, const trip_cpu_splat *splat, vf depth, trip_target target)
{
    vf t = v_load(pixels + 3 * V);
    vm open = v_ge(t, v_set((float)TRIP_SATURATION));
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
INLINE void put_over(float *pixels, const trip_cpu_splat *splat, vf depth, trip_target target)
{
    vm inside = v_gt(depth, v_set(0));
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
    const uint32_t *end = s->pairs + s->pair_count;
    char *pixels = (char *)s->pixels;
    for (const uint32_t *pair = s->pairs; pair < end; pair++) {
        uint32_t block = *pair & 0xffff, at = *pair >> 16;
        const trip_cpu_splat *splat = (const void *)((const char *)s->local + at);
        const float *geometry = (const void *)((const char *)s->geometry + block);
        float *to = (void *)(pixels + block);
        vf depth = optical_depth(geometry, splat, rays);
        if (front_to_back)
            put_behind(to, splat, depth, target);
        else
            put_over(to, splat, depth, target);
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
    s->splats = s->pair_count = 0;
    find_open(s);
}

typedef int32_t int4 __attribute__((vector_size(16)));
typedef uint16_t ushort4 __attribute__((vector_size(8)));
typedef float float4 __attribute__((vector_size(16)));

/* A copy of a splat with its centre relative to the tile, where floats are finest. */
INLINE void make_local(trip_cpu_splat *local, const trip_cpu_splat *splat, float4 origin)
{
    float4 part, centre;
    memcpy(&part, splat, sizeof part);
    memcpy(local, splat, sizeof *local);
    centre = part + (__builtin_shufflevector(part, part, 2, 3, 2, 3) - origin);
    memcpy(local, &centre, 2 * sizeof(float));
}

typedef struct block_range {
    unsigned left, top, right, bottom; /* inclusive */
} block_range;

INLINE block_range blocks_of(const trip_cpu_splat *splat, int4 origin)
{
    const int4 shift = { 2, V == 16 ? 2 : V == 8, 2, V == 16 ? 2 : V == 8 };
    const int4 edge = { TRIP_CPU_TILE - 1, TRIP_CPU_TILE - 1, TRIP_CPU_TILE - 1,
                        TRIP_CPU_TILE - 1 };
    ushort4 bounds;
    memcpy(&bounds, &splat->x0, sizeof bounds);
    int4 b = __builtin_convertvector(bounds, int4) - origin;
    b &= b > 0;
    b = (b & (b < edge)) | (edge & (b >= edge));
    b >>= shift;
    return (block_range){ (unsigned)b[0], (unsigned)b[1], (unsigned)b[2], (unsigned)b[3] };
}

/* Pairs of splat `index` with the open blocks of a range, four rows at a time; their number. */
INLINE uint32_t pair_up(const trip_cpu_scratch *s, uint32_t *pairs, uint32_t index, block_range r)
{
    static const uint32_t rows[4] = { 0xff, 0xffff, 0xffffff, 0xffffffff };
    uint32_t columns = (0xffu << r.left & 0xffu >> (BLOCKS_ACROSS - 1 - r.right)) * 0x01010101u;
    uint32_t n = 0;
    static_assert(sizeof *s->local == 64 && BLOCK_BYTES == TRIP_SIMD_STEP, "bytes in pairs");
    for (unsigned row = r.top;; row += 4) {
        unsigned more = r.bottom - row;
        uint32_t blocks, first = index << 22 | row * BLOCKS_ACROSS * BLOCK_BYTES;
        memcpy(&blocks, s->open + row, sizeof blocks);
        blocks &= columns & rows[more < 3 ? more : 3];
        for (unsigned i = 0; i < 32; i += APPENDED)
            n += append_bits(pairs + n, first + i * BLOCK_BYTES,
                             blocks >> i & ((1u << APPENDED) - 1));
        if (more < 4)
            return n;
    }
}

static bool meets(const trip_cpu_scratch *s, const trip_cpu_splat *splat)
{
    return splat->x0 < s->x + TRIP_CPU_TILE && splat->x1 >= s->x &&
           splat->y0 < s->y + TRIP_CPU_TILE && splat->y1 >= s->y;
}

/* What tile_blend() keeps in registers. */
typedef struct pairing {
    uint32_t splats, pairs;
    int4 corner;
    float4 origin;
} pairing;

INLINE void add(trip_cpu_scratch *s, pairing *p, const trip_cpu_splat *splat)
{
    make_local(&s->local[p->splats], splat, p->origin);
    p->pairs += pair_up(s, s->pairs + p->pairs, p->splats, blocks_of(splat, p->corner));
    p->splats++;
    if (p->splats == TRIP_CPU_LOCAL || p->pairs > TRIP_CPU_PAIRS - BLOCKS) {
        s->pair_count = p->pairs;
        empty_pairs(s);
        p->splats = p->pairs = 0;
    }
}

/* Splats to fetch ahead: they lie scattered among those of other tiles. */
#define AHEAD 12

static void tile_blend(trip_cpu_scratch *s, const trip_cpu_splat *splats, const uint16_t *order,
                       uint32_t count)
{
    const int4 corner = { s->x, s->y, s->x, s->y };
    pairing p = { s->splats, s->pair_count, corner, __builtin_convertvector(corner, float4) };
    if (order) {
        for (uint32_t i = 0; i < count && s->any_open; i++) {
            __builtin_prefetch(&splats[order[i + AHEAD < count ? i + AHEAD : i]]);
            add(s, &p, &splats[order[i]]);
        }
    } else {
        for (uint32_t i = 0; i < count && s->any_open; i++)
            if (meets(s, &splats[i]))
                add(s, &p, &splats[i]);
    }
    s->splats = p.splats;
    s->pair_count = p.pairs;
}

static uint64_t tile_end(trip_cpu_scratch *s)
{
    uint64_t open = 0;
    empty_pairs(s);
    for (unsigned row = 0; row < BLOCKS_DOWN; row++)
        open |= (uint64_t)s->open[row] << 8 * (row * BLOCK_ROWS / 4);
    return open;
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
    for (int b = 0; b < BLOCKS; b++) {
        float *geometry = s->geometry + BLOCK_FLOATS * b;
        for (int i = 0; i < V; i++) {
            geometry[i] = (float)(4 * (b % BLOCKS_ACROSS) + i % 4) + 0.5f;
            geometry[V + i] = (float)(BLOCK_ROWS * (b / BLOCKS_ACROSS) + i / 4) + 0.5f;
        }
    }
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
        if (s->view->rays != TRIP_CPU_STRETCHED)
            continue;
        vf stretch = v_set(1);
        if (s->view->stretch_varies)
            stretch = v_sqrt(square_at(&stretched, x, y) * inverse);
        v_store(geometry + 3 * V, stretch);
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
