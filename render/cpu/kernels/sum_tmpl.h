/* Sums the splats of a sheet at each pixel and composites the sums (splat.h). Included by
 * table_tmpl.h after blend_tmpl.h.
 *
 * A pane has an open sheet next to its pixels. The open sheet holds for each stamp the sums of
 * optical depth times each channel. Its layout is the layout of the pixels, with the optical depth
 * instead of 1 - alpha. The sheet of each stamp's sums follows after all stamps. A stamp composites
 * its sheet when a splat of another sheet arrives, so that the picture depends only on the order of
 * the splats. */
#ifndef TRIP_CPU_SUM_H
#define TRIP_CPU_SUM_H

#include "cpu/kernels/blend_tmpl.h"
#include "cpu/kernels/exp_tmpl.h"
#include "cpu/kernels/kernels.h"

#define SHEET_FLOATS (STAMPS * STAMP_FLOATS)

static_assert(STAMPS <= TRIP_CPU_STAMPS_MAX, "room for the stamps' sheets");

INLINE uint64_t sheet_of_stamp(const float *sums, unsigned number)
{
    uint64_t sheet;
    memcpy(&sheet, sums + SHEET_FLOATS + 2 * number, sizeof sheet);
    return sheet;
}

INLINE void set_sheet_of_stamp(float *sums, unsigned number, uint64_t sheet)
{
    memcpy(sums + SHEET_FLOATS + 2 * number, &sheet, sizeof sheet);
}

/* ---- compositing a sheet ---- */

/* Returns (1 - exp(-x)) / x for x >= 0. */
INLINE vf mean_transmittance(vf x)
{
    vf thick = (v_set(1) - exp_minus(x)) / v_max(x, v_set(TRIP_CPU_THIN));
    return v_select(v_gt(v_set(TRIP_CPU_THIN), x), thin_ratio(x), thick);
}

/* Adds the visible share `w` of a sum to a channel, front to back. */
INLINE void add_behind(float *channel, vf w, vf sum, trip_target target)
{
    v_store(channel, kept(v_fma(w, sum, v_load(channel)), target));
}

INLINE void put_sheet_behind(const trip_cpu_view *view, float *pixels, const patch *sum,
                             trip_target target)
{
    vf t = v_load(pixels + 3 * V), w = t * mean_transmittance(sum->t);
    w = v_select(v_ge(t, v_set(view->early_termination)), w, v_set(0));
    add_behind(pixels, w, sum->r, target);
    add_behind(pixels + V, w, sum->g, target);
    add_behind(pixels + 2 * V, w, sum->b, target);
    vf left = v_max(v_fnma(w, sum->t, t), v_set(0));
    if (TRIP_CPU_DEPTH) /* weight by the rounded opacity, because its sum later divides the
                           distances */
        add_behind(pixels + TRIP_CHANNEL_DEPTH * V, t - left,
                   sum->depth / v_max(sum->t, v_set(0x1p-126f)), TRIP_TARGET_RGBA32F);
    if (target != TRIP_TARGET_RGBA32F)
        left = v_set(1) - kept(v_set(1) - left, target);
    v_store(pixels + 3 * V, left);
}

/* Composites a sum over a channel, back to front, where the sheet has an optical depth. */
INLINE void add_over(float *channel, const patch *sum, vf of, vf keep, vf w, trip_target target)
{
    vf behind = v_load(channel), over = kept(v_fma(w, of, behind * keep), target);
    v_store(channel, v_select(v_gt(sum->t, v_set(0)), over, behind));
}

INLINE void put_sheet_over(float *pixels, const patch *sum, trip_target target)
{
    vf keep = exp_minus(sum->t), w = mean_transmittance(sum->t), t = v_load(pixels + 3 * V);
    add_over(pixels, sum, sum->r, keep, w, target);
    add_over(pixels + V, sum, sum->g, keep, w, target);
    add_over(pixels + 2 * V, sum, sum->b, keep, w, target);
    if (TRIP_CPU_DEPTH) { /* weight by the opacity, because its sum later divides the distances */
        vf mean = sum->depth / v_max(sum->t, v_set(0x1p-126f));
        add_over(pixels + TRIP_CHANNEL_DEPTH * V, sum, mean, keep, v_set(1) - keep,
                 TRIP_TARGET_RGBA32F);
    }
    vf left = t * keep;
    if (target != TRIP_TARGET_RGBA32F)
        left = v_set(1) - kept(v_set(1) - left, target);
    v_store(pixels + 3 * V, v_select(v_gt(sum->t, v_set(0)), left, t));
}

INLINE void put_sheet(const trip_cpu_view *view, float *pixels, const patch *sum)
{
    trip_target target = view->of->settings->target;
    if (view->front_to_back)
        put_sheet_behind(view, pixels, sum, target);
    else
        put_sheet_over(pixels, sum, target);
}

INLINE void empty_sums(patch *p)
{
    p->r = p->g = p->b = p->t = v_set(0);
    if (TRIP_CPU_DEPTH)
        p->depth = v_set(0);
}

/* Composites and clears the open sheet of a patch's stamp. This is rare, since about 15 splats of a
 * sheet meet a pixel. */
static void end_sheet(patch *p)
{
    put_sheet(p->pane->view, p->pane->pixels + STAMP_FLOATS * p->number, p);
    empty_sums(p);
}

/* ---- summing ---- */

/* Returns exp(-m / 2) - edge of splat.h with an error of at most 1.4e-5, and 0 outside the support.
 * Its integral over the plane has a relative error of at most 1e-7. The polynomial is a
 * least-squares fit, reweighted to even out the error. */
INLINE vf falloff(vf u)
{
    vf sum = v_fma(u, v_set(0.311556676f), v_set(-0.357823259f));
    sum = v_fma(u, sum, v_set(0.591253442f));
    sum = v_fma(u, sum, v_set(0.0745626079f));
    sum = v_fma(u, sum, v_set(0.23392554f));
    sum = v_fma(u, sum, v_set(0.144584394f));
    return u * sum * sum;
}

/* Returns optical depth / `peak` at the pixels. */
INLINE vf share_of(const patch *p, const trip_cpu_splat *splat, trip_cpu_rays kind)
{
    if (is_near(splat)) {
        ray_lengths of = rays_of_near(p, splat, kind);
        return falloff(nearness_by(p, splat, of.g)) * of.stretch * front_of(p, splat, of.g);
    }
    vf share = falloff(nearness(p, splat, kind));
    return kind == TRIP_CPU_STRETCHED ? share * p->stretch : share;
}

/* A blend_one function for patches that hold the sums of the open sheet. */
INLINE void add_to_sheet(patch *p, const trip_cpu_splat *splat, float depth, trip_cpu_rays kind,
                         bool front_to_back, trip_target target)
{
    (void)front_to_back;
    (void)target;
    if (splat->sheet != p->sheet) {
        end_sheet(p);
        p->sheet = splat->sheet;
    }
    vf share = share_of(p, splat, kind);
    p->r = v_fma(share, v_set(splat->r), p->r);
    p->g = v_fma(share, v_set(splat->g), p->g);
    p->b = v_fma(share, v_set(splat->b), p->b);
    p->t = v_fma(share, v_set(splat->peak), p->t);
    if (TRIP_CPU_DEPTH)
        p->depth = v_fma(share, v_set(depth * splat->peak), p->depth);
}

/* Returns a key of a sheet. Lists of one level share sheets. The key never equals
 * TRIP_CPU_NO_SHEET. */
INLINE uint64_t sheet_key(const trip_cpu_view *view, int32_t sheet)
{
    return (uint64_t)view->list->level << 32 | (uint32_t)sheet;
}

/* Adds all splats of the group that may touch a stamp, in order. They belong to one list. Returns
 * false if all its pixels are terminated. */
INLINE bool sum_stamp(trip_cpu_scratch *s, unsigned number, trip_cpu_rays kind)
{
    patch p = load_stamp(s, number, kind, s->sums);
    uint64_t before = sheet_of_stamp(s->sums, number);
    touching t = { .local = s->local, .depths = s->local_depths };
    for (unsigned word = 0; word < (s->splats + 63) / 64; word++)
        t.splats[word] = s->touched[number / 64][word][position_of(number % 64)];
    p.number = number;
    p.sheet = (int32_t)before;
    if (before >> 32 != s->view->list->level && before != TRIP_CPU_NO_SHEET)
        end_sheet(&p);
    blend_each(&p, &t, add_to_sheet, kind, true, TRIP_TARGET_RGBA32F);
    store_stamp(s->sums, number, &p);
    set_sheet_of_stamp(s->sums, number, sheet_key(s->view, p.sheet));
    return !s->view->front_to_back ||
           any_open(s, v_load(s->pixels + STAMP_FLOATS * number + 3 * V));
}

INLINE void sum_group(trip_cpu_scratch *s, trip_cpu_rays kind)
{
    for (unsigned band = 0; band < BANDS; band++)
        for (uint64_t rest = s->any[band] & s->open[band]; rest; rest &= rest - 1) {
            unsigned bit = (unsigned)__builtin_ctzll(rest);
            if (!sum_stamp(s, 64 * band + bit, kind))
                s->open[band] &= ~(UINT64_C(1) << bit);
        }
}

static void sum_parallel(trip_cpu_scratch *s)
{
    sum_group(s, TRIP_CPU_PARALLEL);
}

static void sum_perspective(trip_cpu_scratch *s)
{
    sum_group(s, TRIP_CPU_PERSPECTIVE);
}

static void sum_stretched(trip_cpu_scratch *s)
{
    sum_group(s, TRIP_CPU_STRETCHED);
}

static blend_group_fn *choose_sum(const trip_cpu_view *view)
{
    static blend_group_fn *const by_rays[] = { [TRIP_CPU_PARALLEL] = sum_parallel,
                                               [TRIP_CPU_PERSPECTIVE] = sum_perspective,
                                               [TRIP_CPU_STRETCHED] = sum_stretched };
    return by_rays[view->rays];
}

/* ---- panes ---- */

static void sheet_clear(float *sums)
{
    for (unsigned i = 0; i < SHEET_FLOATS; i += V)
        v_store(sums + i, v_set(0));
    for (unsigned number = 0; number < STAMPS; number++)
        set_sheet_of_stamp(sums, number, TRIP_CPU_NO_SHEET);
}

static void sheet_composite(const trip_cpu_view *view, const float *pixels, const float *sums,
                            float *out)
{
    memcpy(out, pixels, SHEET_FLOATS * sizeof *out);
    for (unsigned number = 0; number < STAMPS; number++) {
        const float *of = sums + STAMP_FLOATS * number;
        patch p = {
            .r = v_load(of), .g = v_load(of + V), .b = v_load(of + 2 * V), .t = v_load(of + 3 * V)
        };
        if (TRIP_CPU_DEPTH)
            p.depth = v_load(of + TRIP_CHANNEL_DEPTH * V);
        put_sheet(view, out + STAMP_FLOATS * number, &p);
    }
}

#endif
