/* Blends projected splats into the pixels of a pane. Included by table_tmpl.h after simd_tmpl.h.
 * Splats are gathered in groups of up to TRIP_CPU_LOCAL. A stable sort assigns them to the stamps
 * that they may touch. Then each stamp blends its splats with its pixels in registers. */
#ifndef TRIP_CPU_BLEND_H
#define TRIP_CPU_BLEND_H

#include <stddef.h>

#include "cpu/kernels/exp_tmpl.h"
#include "cpu/kernels/kernels.h"
#include "cpu/kernels/rays_tmpl.h"
#include "cpu/kernels/simd_tmpl.h"

#define STAMP_ROWS (V / 4)
#define STAMPS_ACROSS (TRIP_CPU_PANE / 4)
#define STAMPS_DOWN (TRIP_CPU_PANE / STAMP_ROWS)
#define STAMPS (STAMPS_ACROSS * STAMPS_DOWN)
#define CHANNELS (TRIP_CPU_DEPTH ? TRIP_CHANNELS_MAX : TRIP_CHANNEL_DEPTH)
#define STAMP_FLOATS (CHANNELS * V)
/* A band is eight rows of stamps, a bit each in one word. */
#define BANDS (STAMPS / 64)

static_assert(STAMPS_ACROSS == 8 && BANDS >= 1 && BANDS <= TRIP_CPU_BANDS, "64 stamps to a band");

/* ---- rounding to the target's format ---- */

/* Rounds to the nearest half float, ties to even, for 0 <= a < 65504. Half floats have eleven bits.
 * Below 2^-14 they are multiples of 2^-24, the step of floats between 1/2 and 1. */
INLINE vf to_half(vf a)
{
    vi bits = v_bits(a);
    vf normal = v_from_bits((bits + 0xfff + (v_shift_right(bits, 13) & 1)) & ~0x1fff);
    return v_select(v_gt(v_set(0x1p-14f), a), (a + v_set(0.5f)) - v_set(0.5f), normal);
}

/* Rounds to the nearest multiple of 1/255. */
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

/* ---- pixel positions ---- */

/* Return the pixel centres of a stamp, relative to the pane's corner. */
INLINE vf stamp_x(unsigned number)
{
    vf x;
    for (int i = 0; i < V; i++)
        x[i] = (float)(i % 4) + 0.5f;
    return x + v_set((float)(4 * (number % STAMPS_ACROSS)));
}

INLINE vf stamp_y(unsigned number)
{
    vf y;
    for (int i = 0; i < V; i++)
        y[i] = (float)(i / 4) + 0.5f;
    return y + v_set((float)(STAMP_ROWS * (number / STAMPS_ACROSS)));
}

/* ---- blending ---- */

/* Returns the position of a word after transpose(). */
INLINE unsigned position_of(unsigned word)
{
    return word % 8 * 8 + word / 8;
}

typedef struct patch {
    vf r, g, b, t;
    vf depth; /* only in layers with depth */
    vf x, y;  /* pixel centres from the pane's corner */
    vf ray;   /* G */
    vf stretch;
    vf cutoff; /* as in trip_cpu_view */
    const trip_cpu_scratch *pane;
    /* Summed sheets only (sum_tmpl.h), where r, g, b, t and depth hold sums: their sheet, and the
     * number of the stamp. */
    int32_t sheet;
    unsigned number;
} patch;

/* Returns u of trip_cpu_splat with the given G. */
INLINE vf nearness_by(const patch *p, const trip_cpu_splat *splat, vf g)
{
    vf a = v_fma(p->x, v_set(splat->l11), v_fma(p->y, v_set(splat->l21), v_set(splat->l1)));
    vf b = v_fma(p->y, v_set(splat->l22), v_set(splat->l2));
    return v_max(v_fnma(g, v_fma(b, b, a * a), v_set(1)), v_set(0));
}

/* Returns u of trip_cpu_splat. For near splats see rays_of_near(). */
INLINE vf nearness(const patch *p, const trip_cpu_splat *splat, trip_cpu_rays rays)
{
    vf a = v_fma(p->x, v_set(splat->l11), v_fma(p->y, v_set(splat->l21), v_set(splat->l1)));
    vf b = v_fma(p->y, v_set(splat->l22), v_set(splat->l2));
    vf u;
    if (rays == TRIP_CPU_PARALLEL)
        u = v_fnma(b, b, v_fnma(a, a, v_set(1)));
    else
        u = v_fnma(p->ray, v_fma(b, b, a * a), v_set(1));
    return v_max(u, v_set(0));
}

/* Returns the opacity of a thin splat, 0 outside its support.
 *
 * Footprints are evaluated, not looked up. A table is possible only in parallel views. It would
 * move the centre to the nearest of n x n positions in a pixel. Its error is up to exp(-1/2) /
 * (sqrt(2) n s) of the peak, where s is the footprint's standard deviation in pixels. Errors up to
 * 1/255 need n s > 109, thus a table of 2 MB: n^2 footprints of (2 TRIP_CUTOFF s)^2 pixels. */
INLINE vf thin_opacity(const trip_cpu_splat *splat, vf u)
{
    static_assert(TRIP_CPU_TERMS == 5, "the terms below");
    vf sum = v_fma(u, v_set(splat->c[4]), v_set(splat->c[3]));
    sum = v_fma(u, sum, v_set(splat->c[2]));
    sum = v_fma(u, sum, v_set(splat->c[1]));
    sum = v_fma(u, sum, v_set(splat->c[0]));
    return u * sum * sum;
}

INLINE bool is_near(const trip_cpu_splat *splat)
{
    return __builtin_expect((splat->panes & TRIP_CPU_PANES_NEAR) != 0, 0);
}

/* Returns `along` of a near splat, not yet divided by the length of the ray. */
INLINE vf along_of(const patch *p, const trip_cpu_splat *splat)
{
    vf x = p->x + v_set((float)p->pane->x), y = p->y + v_set((float)p->pane->y);
    vf along = v_fma(x, v_set(splat->c[TRIP_CPU_ALONG_X]), v_set(splat->c[TRIP_CPU_ALONG]));
    return v_fma(y, v_set(splat->c[TRIP_CPU_ALONG_Y]), along);
}

/* Returns G and the stretch in the index space of the splat (trip_cpu_own_rays()). */
INLINE ray_lengths own_rays(const patch *p, const trip_cpu_splat *splat, vf x, vf y)
{
    vf a = v_fma(p->x, v_set(splat->l11), v_fma(p->y, v_set(splat->l21), v_set(splat->l1)));
    vf b = v_fma(p->y, v_set(splat->l22), v_set(splat->l2)), along = along_of(p, splat);
    vf all = v_fma(v_set((float)(TRIP_CUTOFF * TRIP_CUTOFF)), v_fma(b, b, a * a), along * along);
    vf g = v_set(splat->c[TRIP_CPU_AWAY2]) / v_max(all, v_set(1e-30f));
    return (ray_lengths){ .g = g, .stretch = v_sqrt(form_at(p->pane->view->world2, x, y) * g) };
}

/* Returns G and the stretch for a near splat. In affine views they differ from the values of other
 * splats. */
INLINE ray_lengths rays_of_near(const patch *p, const trip_cpu_splat *splat, trip_cpu_rays rays)
{
    const trip_cpu_scratch *s = p->pane;
    const trip_camera *camera = &s->view->splat.camera;
    if (trip_cpu_own_rays(s->view))
        return own_rays(p, splat, v_set((float)(s->x - 0.5 * camera->width)) + p->x,
                        v_set((float)(s->y - 0.5 * camera->height)) + p->y);
    if (s->view->affine)
        return ray_lengths_at(s->view, v_set((float)(s->x - 0.5 * camera->width)) + p->x,
                              v_set((float)(s->y - 0.5 * camera->height)) + p->y);
    return (ray_lengths){ .g = rays == TRIP_CPU_PARALLEL ? v_set(1) : p->ray,
                          .stretch = rays == TRIP_CPU_STRETCHED ? p->stretch : v_set(1) };
}

/* Returns front(p) of splat.h. The error function is 1 - polynomial exp(-t^2), Abramowitz and
 * Stegun 1964, 7.1.25. Its error is at most 2e-5, plus the error of exp_minus(). */
INLINE vf front_of(const patch *p, const trip_cpu_splat *splat, vf g)
{
    vf along = along_of(p, splat);
    if (!p->pane->view->splat.camera.ortho)
        along = along * v_sqrt(g);
    vf end = v_set((float)TRIP_CUTOFF), s = v_min(v_abs(along), end);
    vf t = v_set(1) / v_fma(s, v_set((float)(0.47047 * 0.70710678118654752)), v_set(1));
    vf sum = v_fma(t, v_set(0.7478556f), v_set(-0.0958798f));
    sum = v_fma(t, sum, v_set(0.3480242f)) * t;
    vf half = v_fnma(sum, exp_minus(s * s * v_set(0.5f)), v_set(1));
    half = half * v_set((float)(0.5 * p->pane->view->splat.front));
    vf front = v_set(0.5f) + v_copysign(half, along);
    front = v_select(v_ge(along, end), v_set(1), front);
    return v_select(v_gt(along, -end), front, v_set(0));
}

/* Returns the optical depth from c[MIN] and c[EDGE], without the stretch. */
INLINE vf long_depth(const patch *p, const trip_cpu_splat *splat, vf u)
{
    vf y = v_fma(u, p->cutoff, v_set(splat->c[TRIP_CPU_MIN]));
    return exp2_biased_less(y, v_set(splat->c[TRIP_CPU_EDGE]));
}

/* Returns the optical depth for trip_cpu_own_rays(). The splat does not store its edge, so the
 * function computes the edge from c[MIN]. */
INLINE vf own_depth(const patch *p, const trip_cpu_splat *splat, vf u)
{
    vf min = v_set(splat->c[TRIP_CPU_MIN]);
    return exp2_biased_less(v_fma(u, p->cutoff, min), exp2_biased_less(min, v_set(0)));
}

/* Near splats are rare. This function is not inlined and takes values, so that loops over other
 * splats keep their stamp in registers. */
static __attribute__((noinline, cold)) vf near_depth_at(const trip_cpu_scratch *pane,
                                                        const trip_cpu_splat *splat, vf x, vf y,
                                                        vf ray, vf stretch, vf cutoff,
                                                        trip_cpu_rays rays)
{
    const patch p = {
        .x = x, .y = y, .ray = ray, .stretch = stretch, .cutoff = cutoff, .pane = pane
    };
    ray_lengths of = rays_of_near(&p, splat, rays);
    vf u = nearness_by(&p, splat, of.g);
    vf depth = trip_cpu_own_rays(pane->view) ? own_depth(&p, splat, u) : long_depth(&p, splat, u);
    return depth * of.stretch * front_of(&p, splat, of.g);
}

INLINE vf near_depth(const patch *p, const trip_cpu_splat *splat, trip_cpu_rays rays)
{
    return near_depth_at(p->pane, splat, p->x, p->y, p->ray, p->stretch, p->cutoff, rays);
}

INLINE vf far_depth(const patch *p, const trip_cpu_splat *splat, trip_cpu_rays rays)
{
    vf depth = long_depth(p, splat, nearness(p, splat, rays));
    return rays == TRIP_CPU_STRETCHED ? depth * p->stretch : depth;
}

INLINE vf optical_depth(const patch *p, const trip_cpu_splat *splat, trip_cpu_rays rays)
{
    return is_near(splat) ? near_depth(p, splat, rays) : far_depth(p, splat, rays);
}

/* Returns the opacity. `thick` must be true for near splats. */
INLINE vf opacity(const patch *p, const trip_cpu_splat *splat, bool thick, trip_cpu_rays rays)
{
    if (rays != TRIP_CPU_STRETCHED && !thick)
        return thin_opacity(splat, nearness(p, splat, rays));
    vf depth = thick ? optical_depth(p, splat, rays) : far_depth(p, splat, rays);
    if (thick && is_near(splat))
        return v_select(v_gt(v_set(TRIP_CPU_THIN), depth), depth * thin_ratio(depth),
                        v_set(1) - exp_minus(depth));
    return thick ? v_set(1) - exp_minus(depth) : depth * thin_ratio(depth);
}

/* put_behind() for stamps in which every pixel is open and stays open. */
INLINE void put_behind_open(patch *p, const trip_cpu_splat *splat, float depth, vf opacity)
{
    vf left = v_fnma(p->t, opacity, p->t), taken = p->t - left;
    p->r = v_fma(taken, v_set(splat->r), p->r);
    p->g = v_fma(taken, v_set(splat->g), p->g);
    p->b = v_fma(taken, v_set(splat->b), p->b);
    if (TRIP_CPU_DEPTH)
        p->depth = v_fma(taken, v_set(depth), p->depth);
    p->t = left;
}

/* Composites a splat behind the pixels' contents, front to back. */
INLINE void put_behind(patch *p, const trip_cpu_splat *splat, float depth, vf opacity,
                       trip_target target)
{
    vm open = v_ge(p->t, v_load(p->pane->early_termination));
    vf left = v_fnma_where(open, p->t, opacity, p->t), taken = p->t - left;
    p->r = kept(v_fma(taken, v_set(splat->r), p->r), target);
    p->g = kept(v_fma(taken, v_set(splat->g), p->g), target);
    p->b = kept(v_fma(taken, v_set(splat->b), p->b), target);
    if (TRIP_CPU_DEPTH)
        p->depth = v_fma(taken, v_set(depth), p->depth);
    p->t = target == TRIP_TARGET_RGBA32F ? left : v_set(1) - kept(v_set(1) - left, target);
}

INLINE vf over(vf behind, float colour, vf keep, trip_target target)
{
    vf front = v_set(colour);
    return kept(v_fma(behind - front, keep, front), target);
}

/* Composites a splat over the pixels' contents, back to front. */
INLINE void put_over(patch *p, const trip_cpu_splat *splat, float depth, vf optical_depth,
                     trip_target target)
{
    vm inside = v_gt(optical_depth, v_set(0));
    vf keep = exp_minus(optical_depth), left = p->t * keep;
    p->r = v_select(inside, over(p->r, splat->r, keep, target), p->r);
    p->g = v_select(inside, over(p->g, splat->g, keep, target), p->g);
    p->b = v_select(inside, over(p->b, splat->b, keep, target), p->b);
    if (TRIP_CPU_DEPTH)
        p->depth = v_select(inside, over(p->depth, depth, keep, target), p->depth);
    if (target != TRIP_TARGET_RGBA32F)
        left = v_set(1) - kept(v_set(1) - left, target);
    p->t = v_select(inside, left, p->t);
}

INLINE bool any_open(const trip_cpu_scratch *s, vf t)
{
    return vm_any(v_ge(t, v_load(s->early_termination)));
}

INLINE bool all_open(const patch *p)
{
    return vm_all(v_ge(p->t, v_load(p->pane->early_termination)));
}

static void set_rays(trip_cpu_scratch *s, unsigned number);

/* Loads a stamp from a pane's pixels, or from sums with the same layout. */
INLINE patch load_stamp(trip_cpu_scratch *s, unsigned number, trip_cpu_rays rays, const float *pane)
{
    const float *pixels = pane + STAMP_FLOATS * number;
    patch p = {
        .r = v_load(pixels),
        .g = v_load(pixels + V),
        .b = v_load(pixels + 2 * V),
        .t = v_load(pixels + 3 * V),
        .x = stamp_x(number),
        .y = stamp_y(number),
        .cutoff = v_set(s->view->cutoff),
        .pane = s,
    };
    if (TRIP_CPU_DEPTH)
        p.depth = v_load(pixels + TRIP_CHANNEL_DEPTH * V);
    if (rays != TRIP_CPU_PARALLEL) {
        const float *of = s->rays + 2 * V * number;
        if (!(s->rays_known[number / 64] >> number % 64 & 1))
            set_rays(s, number);
        p.ray = v_load(of);
        p.stretch = v_load(of + V);
    }
    return p;
}

INLINE void store_stamp(float *pane, unsigned number, const patch *p)
{
    float *pixels = pane + STAMP_FLOATS * number;
    v_store(pixels, p->r);
    v_store(pixels + V, p->g);
    v_store(pixels + 2 * V, p->b);
    v_store(pixels + 3 * V, p->t);
    if (TRIP_CPU_DEPTH)
        v_store(pixels + TRIP_CHANNEL_DEPTH * V, p->depth);
}

/* The splats of the group that may touch a stamp, a bit each. */
typedef struct touching {
    const trip_cpu_splat *local;
    const float *depths; /* of the splats, in layers with depth */
    uint64_t splats[TRIP_CPU_LOCAL / 64];
} touching;

typedef void blend_one(patch *p, const trip_cpu_splat *splat, float depth, trip_cpu_rays rays,
                       bool front_to_back, trip_target target);

/* Returns local + number in one register. Without the asm, compilers address each field by two
 * registers, which costs one more operation per field. */
INLINE const trip_cpu_splat *splat_at(const trip_cpu_splat *local, unsigned number)
{
    local += number;
    __asm__("" : "+r"(local));
    return local;
}

INLINE float depth_at(const touching *t, unsigned number)
{
    return TRIP_CPU_DEPTH ? t->depths[number] : 0;
}

/* Blends the splats in order. If an instruction can pack bits to a list, a single loop replaces a
 * loop per word. The processor then mispredicts at most one loop end. */
INLINE void blend_each(patch *p, const touching *t, blend_one *one, trip_cpu_rays rays,
                       bool front_to_back, trip_target target)
{
#ifdef V_PACKS_BITS
    uint8_t numbers[TRIP_CPU_LOCAL + 64];
    uint32_t count = 0;
    static_assert(TRIP_CPU_LOCAL <= 256, "numbers of a byte");
    for (unsigned word = 0; word < TRIP_CPU_LOCAL / 64; word++)
        count += v_pack_bits(numbers + count, t->splats[word], 64 * word);
    for (uint32_t i = 0; i < count; i++)
        one(p, splat_at(t->local, numbers[i]), depth_at(t, numbers[i]), rays, front_to_back,
            target);
#else
    for (unsigned word = 0; word < TRIP_CPU_LOCAL / 64; word++)
        for (uint64_t rest = t->splats[word]; rest; rest &= rest - 1) {
            unsigned number = 64 * word + (unsigned)__builtin_ctzll(rest);
            one(p, splat_at(t->local, number), depth_at(t, number), rays, front_to_back, target);
        }
#endif
}

INLINE void blend_thin_open(patch *p, const trip_cpu_splat *splat, float depth, trip_cpu_rays rays,
                            bool front_to_back, trip_target target)
{
    (void)front_to_back;
    (void)target;
    put_behind_open(p, splat, depth, opacity(p, splat, false, rays));
}

INLINE void blend_any(patch *p, const trip_cpu_splat *splat, float depth, trip_cpu_rays rays,
                      bool front_to_back, trip_target target)
{
    bool thick = splat->panes >> TRIP_CPU_PANES_THICK_SHIFT;
    if (front_to_back)
        put_behind(p, splat, depth, opacity(p, splat, thick, rays), target);
    else
        put_over(p, splat, depth, optical_depth(p, splat, rays), target);
}

/* Blends splats of which none is thick. Returns false, without any change, if a pixel is terminated
 * or would become terminated. */
INLINE bool blend_open(patch *p, const touching *t, trip_cpu_rays rays)
{
    patch q = *p;
    if (!all_open(&q))
        return false;
    blend_each(&q, t, blend_thin_open, rays, true, TRIP_TARGET_RGBA32F);
    if (!all_open(&q))
        return false;
    *p = q;
    return true;
}

/* Blends all splats of the group that may touch a stamp, in order. Returns false if all its pixels
 * are terminated. A late test is no error, since terminated pixels never change. */
INLINE bool blend_stamp(trip_cpu_scratch *s, unsigned number, trip_cpu_rays rays,
                        bool front_to_back, trip_target target)
{
    patch p = load_stamp(s, number, rays, s->pixels);
    touching t = { .local = s->local, .depths = s->local_depths };
    uint64_t thick = 0;
    for (unsigned word = 0; word < (s->splats + 63) / 64; word++) {
        t.splats[word] = s->touched[number / 64][word][position_of(number % 64)];
        thick |= t.splats[word] & s->thick[word];
    }
    bool simple = front_to_back && target == TRIP_TARGET_RGBA32F && !thick;
    if (!simple || !blend_open(&p, &t, rays))
        blend_each(&p, &t, blend_any, rays, front_to_back, target);
    store_stamp(s->pixels, number, &p);
    return !front_to_back || any_open(s, p.t);
}

INLINE void blend_group(trip_cpu_scratch *s, trip_cpu_rays rays, bool front_to_back,
                        trip_target target)
{
    for (unsigned band = 0; band < BANDS; band++)
        for (uint64_t rest = s->any[band] & s->open[band]; rest; rest &= rest - 1) {
            unsigned bit = (unsigned)__builtin_ctzll(rest);
            if (!blend_stamp(s, 64 * band + bit, rays, front_to_back, target))
                s->open[band] &= ~(UINT64_C(1) << bit);
        }
}

#define BLEND(name, rays, front_to_back, target)                                                   \
    static void name(trip_cpu_scratch *s)                                                          \
    {                                                                                              \
        blend_group(s, rays, front_to_back, target);                                               \
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

typedef void blend_group_fn(trip_cpu_scratch *s);

static blend_group_fn *choose_sum(const trip_cpu_view *view);

static blend_group_fn *choose_blend(const trip_cpu_view *view)
{
    static blend_group_fn *const behind[] = { behind_stretched, behind_half, behind_unorm8 };
    static blend_group_fn *const over[] = { over_float, over_half, over_unorm8 };
    if (view->sums)
        return choose_sum(view);
    if (view->rays == TRIP_CPU_PARALLEL)
        return behind_parallel;
    if (view->rays == TRIP_CPU_PERSPECTIVE)
        return behind_perspective;
    return (view->front_to_back ? behind : over)[view->of->settings->target];
}

/* ---- sorting a group by stamps ---- */

typedef uint64_t words8 __attribute__((vector_size(64)));

/* Swaps the bits `low` of b with the bits `low` << `step` of a. In each pair of words (a, b) the
 * two off-diagonal submatrices of step x step bits are thereby exchanged. */
INLINE void exchange(words8 *a, words8 *b, unsigned step, uint64_t low)
{
    words8 swap = (*a >> step ^ *b) & low;
    *a ^= swap << step;
    *b ^= swap;
}

INLINE void exchange_all(words8 rows[8], unsigned step, uint64_t low4, uint64_t low2, uint64_t low1)
{
    for (int i = 0; i < 4; i++)
        exchange(&rows[i], &rows[i + 4], 4 * step, low4);
    for (int i = 0; i < 8; i += i % 2 ? 3 : 1)
        exchange(&rows[i], &rows[i + 2], 2 * step, low2);
    for (int i = 0; i < 8; i += 2)
        exchange(&rows[i], &rows[i + 1], step, low1);
}

/* Transposes 64 x 64 bits: bit i of word k becomes bit k of word i, stored at position_of(i). Steps
 * of 32, 16 and 8 words exchange whole vectors of eight words. After the vectors are transposed, so
 * do the steps of 4, 2 and 1. */
static void transpose(uint64_t words[64])
{
    words8 rows[8], columns[8];
    memcpy(rows, words, sizeof rows);
    exchange_all(rows, 8, UINT64_C(0x00000000ffffffff), UINT64_C(0x0000ffff0000ffff),
                 UINT64_C(0x00ff00ff00ff00ff));
    for (int i = 0; i < 8; i++)
        for (int k = 0; k < 8; k++)
            columns[i][k] = rows[k][i];
    exchange_all(columns, 1, UINT64_C(0x0f0f0f0f0f0f0f0f), UINT64_C(0x3333333333333333),
                 UINT64_C(0x5555555555555555));
    memcpy(words, columns, sizeof columns);
}

static uint64_t union_of(const uint64_t words[64])
{
    uint64_t all = 0;
    for (int i = 0; i < 64; i++)
        all |= words[i];
    return all;
}

static void empty_group(trip_cpu_scratch *s)
{
    for (unsigned band = 0; band < BANDS; band++) {
        s->any[band] = 0;
        for (uint32_t first = 0; first < s->splats; first += 64) {
            uint64_t *words = s->touched[band][first / 64];
            if (s->splats - first < 64)
                memset(words + (s->splats - first), 0, (64 - (s->splats - first)) * sizeof *words);
            const uint64_t all = union_of(words);
            if (all == 0)
                continue;
            s->any[band] |= all;
            transpose(words);
        }
    }
    s->blend(s);
    s->splats = 0;
}

static bool is_open(const trip_cpu_scratch *s)
{
    uint64_t any = 0;
    for (unsigned band = 0; band < BANDS; band++)
        any |= s->open[band];
    return any != 0;
}

/* Copies a splat and moves its origin to this pane's corner. `from` is the offset of this corner
 * from the corner of the splat's first pane, in pixels. */
INLINE void make_local(trip_cpu_splat *local, const trip_cpu_splat *splat, int4 from)
{
    float4 f = __builtin_convertvector(from, float4);
    *local = *splat;
    local->l1 = splat->l1 + (splat->l11 * f[0] + splat->l21 * f[1]);
    local->l2 = splat->l2 + splat->l22 * f[1];
}

/* Returns the stamps of a band in `column` or to its right, in every row. Column 8 gives none. */
INLINE uint64_t from_column(uint32_t column)
{
#define FROM(i) UINT64_C(0x0101010101010101) * (0xff << (i)&0xff)
    static const uint64_t bits[9] = { FROM(0), FROM(1), FROM(2), FROM(3), FROM(4),
                                      FROM(5), FROM(6), FROM(7), 0 };
#undef FROM
    return bits[column];
}

/* Returns the stamps of a band in the pane's row `row` or below, a byte per row. */
INLINE uint64_t from_row(unsigned band, uint32_t row)
{
    static const uint8_t bits[64] = { [32 ... 63] = 0xff };
    static_assert(STAMPS_DOWN <= 32 && __BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__,
                  "the bytes above");
    uint64_t word;
    memcpy(&word, bits + 32 + 8 * band - row, sizeof word);
    return word;
}

static bool meets(const trip_cpu_scratch *s, const trip_cpu_splat *splat)
{
    return splat->x0 < s->x + TRIP_CPU_PANE && splat->x1 >= s->x &&
           splat->y0 < s->y + TRIP_CPU_PANE && splat->y1 >= s->y;
}

/* The state that pane_blend() keeps in registers. */
typedef struct gathering {
    uint32_t splats;
    uint64_t thick; /* which of the last 64 splats are thick; the last one is the highest bit */
    int4 corner;    /* of the pane: x, y, x, y */
} gathering;

/* Adds splats[i] to the group, unless all its stamps are terminated. */
INLINE void add(trip_cpu_scratch *s, gathering *g, const trip_cpu_splat *splats,
                const float *depths, uint32_t i)
{
    const trip_cpu_splat *splat = &splats[i];
    uint32_t at = g->splats;
    const int4 to_stamp = { 2, V == 16 ? 2 : V == 8, 2, V == 16 ? 2 : V == 8 };
    uint64_t four, stamps[BANDS], any = 0;
    memcpy(&four, (const char *)splat + offsetof(trip_cpu_splat, x0), sizeof four);
    int4 bounds = int4_widened(four);
    int4 in = int4_within(bounds - g->corner, 0, TRIP_CPU_PANE - 1) >> to_stamp;
    uint32_t left = (uint32_t)in[0], right = (uint32_t)in[2];
    uint32_t top = (uint32_t)in[1], bottom = (uint32_t)in[3];
    uint64_t columns = from_column(left) & ~from_column(right + 1);
    for (unsigned band = 0; band < BANDS; band++) {
        stamps[band] = from_row(band, top) & ~from_row(band, bottom + 1);
        stamps[band] &= columns & s->open[band];
        any |= stamps[band];
    }
    if (any == 0)
        return;
    make_local(&s->local[at], splat, g->corner - (bounds & ~(TRIP_CPU_PANE - 1)));
    if (TRIP_CPU_DEPTH)
        s->local_depths[at] = depths[i];
    g->thick = g->thick >> 1 | (uint64_t)(splat->panes >> TRIP_CPU_PANES_THICK_SHIFT) << 63;
    for (unsigned band = 0; band < BANDS; band++)
        s->touched[band][at / 64][at % 64] = stamps[band];
    g->splats = ++at;
    if (at % 64 != 0)
        return;
    s->thick[at / 64 - 1] = g->thick;
    if (at == TRIP_CPU_LOCAL) {
        s->splats = at;
        empty_group(s);
        g->splats = 0;
    }
}

/* Number of splats to prefetch. The splats of a pane lie scattered in memory among the splats of
 * other panes. */
#define AHEAD 32

INLINE void add_in_order(trip_cpu_scratch *s, gathering *g, const trip_cpu_splat *splats,
                         const float *depths, const uint16_t *order, uint32_t count)
{
    uint32_t i = 0;
    for (; i < AHEAD && i < count; i++)
        __builtin_prefetch(&splats[order[i]]);
    for (; i < count; i++) {
        __builtin_prefetch(&splats[order[i]]);
        add(s, g, splats, depths, order[i - AHEAD]);
    }
    for (i = count < AHEAD ? 0 : count - AHEAD; i < count; i++)
        add(s, g, splats, depths, order[i]);
}

static void end_group(trip_cpu_scratch *s)
{
    if (s->splats % 64 != 0)
        s->thick[s->splats / 64] >>= 64 - s->splats % 64;
    empty_group(s);
}

static bool has_same_rays(const trip_cpu_view *a, const trip_cpu_view *b)
{
    return a->rays == b->rays && a->stretch_varies == b->stretch_varies &&
           memcmp(a->ray2, b->ray2, sizeof a->ray2) == 0 &&
           memcmp(a->world2, b->world2, sizeof a->world2) == 0;
}

static void use_view(trip_cpu_scratch *s, const trip_cpu_view *view)
{
    if (s->view == view)
        return;
    bool same_rays = has_same_rays(s->view, view);
    if (!same_rays || view->sums)
        end_group(s);
    if (!same_rays) {
        memset(s->rays_known, 0, sizeof s->rays_known);
        s->blend = choose_blend(view);
    }
    s->view = view;
}

static void pane_blend(const trip_cpu_view *view, trip_cpu_scratch *s, const trip_cpu_splat *splats,
                       const float *depths, const uint16_t *order, uint32_t count)
{
    use_view(s, view);
    gathering g = { s->splats, s->thick[s->splats / 64], { s->x, s->y, s->x, s->y } };
    if (!is_open(s))
        return;
    if (order)
        add_in_order(s, &g, splats, depths, order, count);
    else
        for (uint32_t i = 0; i < count; i++)
            if (meets(s, &splats[i]))
                add(s, &g, splats, depths, i);
    s->splats = g.splats;
    s->thick[g.splats / 64] = g.thick;
}

static uint64_t pane_end(trip_cpu_scratch *s)
{
    uint64_t open = 0;
    end_group(s);
    for (unsigned row = 0; row < STAMPS_DOWN; row++) {
        uint64_t bits = s->open[row / 8] >> 8 * (row % 8) & 255;
        open |= bits << 8 * (row * STAMP_ROWS / 4);
    }
    return open;
}

/* ---- beginning a pane ---- */

static void set_rays(trip_cpu_scratch *s, unsigned number)
{
    const trip_cpu_view *view = s->view;
    float *of = s->rays + 2 * V * number;
    vf x = v_set((float)(s->x - 0.5 * view->splat.camera.width)) + stamp_x(number);
    vf y = v_set((float)(s->y - 0.5 * view->splat.camera.height)) + stamp_y(number);
    ray_lengths of_rays = { v_set(1), v_set(1) };
    if (!view->splat.camera.ortho && !view->affine)
        of_rays = ray_lengths_at(view, x, y);
    v_store(of, of_rays.g);
    v_store(of + V, of_rays.stretch);
    s->rays_known[number / 64] |= UINT64_C(1) << number % 64;
}

/* Returns the stamps in this thread's quarters of the pane. Another thread may own the pixels of
 * the other quarters. */
static uint64_t stamps_of_quarters(unsigned quarters, unsigned band)
{
    uint64_t stamps = 0;
    for (unsigned row = 0; row < 8; row++) {
        unsigned below = 8 * band + row >= STAMPS_DOWN / 2, pair = quarters >> 2 * below & 3;
        uint64_t bits = (pair & 1 ? 0x0fu : 0) | (pair & 2 ? 0xf0u : 0);
        stamps |= bits << 8 * row;
    }
    return stamps;
}

static void find_open(trip_cpu_scratch *s, unsigned quarters)
{
    for (unsigned band = 0; band < BANDS; band++) {
        s->open[band] = stamps_of_quarters(quarters, band);
        if (!s->view->front_to_back)
            continue;
        for (uint64_t rest = s->open[band]; rest; rest &= rest - 1) {
            unsigned bit = (unsigned)__builtin_ctzll(rest);
            if (!any_open(s, v_load(s->pixels + STAMP_FLOATS * (64 * band + bit) + 3 * V)))
                s->open[band] &= ~(UINT64_C(1) << bit);
        }
    }
}

static void pane_begin(const trip_cpu_view *view, trip_cpu_scratch *s, int x, int y,
                       unsigned quarters, float *pixels, float *sums)
{
    s->view = view;
    s->x = x;
    s->y = y;
    s->pixels = pixels;
    s->sums = sums;
    s->splats = 0;
    s->blend = choose_blend(view);
    v_store(s->early_termination, v_set(view->early_termination));
    memset(s->rays_known, 0, sizeof s->rays_known);
    find_open(s, quarters);
}

#endif
