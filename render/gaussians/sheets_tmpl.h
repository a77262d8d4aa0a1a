/* The kernel of gaussian_tiles.h that draws a run of sheets. tiles_tmpl.h includes this file. It
 * fuses no operations, so that all instruction sets give the same bits. */
#ifndef TRIP_SHEETS_TMPL_H
#define TRIP_SHEETS_TMPL_H

/* The sums of a sheet at each pixel: of optical depth, and of optical depth times colour or depth.
 */
enum { SUM_TAU, SUM_RED, SUM_GREEN, SUM_BLUE, SUM_DEPTH, SUMS };

/* The sums of a run in a tile. A block is cleared when a splat first meets it. */
typedef struct sheet_sums {
    float sums[TRIP_SHEET_RUN][SUMS][TRIP_TILE_PIXELS];
    uint16_t touched[TRIP_SHEET_RUN]; /* a bit for each block */
} sheet_sums;

/* The normal density's integral takes these values beyond so many deviations: 0 and 1. */
#define SHEET_REACH 4

/* Returns the natural logarithm of a number from 0.005 to 1, with an error of at most 1e-7. */
INLINE vf v_log(vf x)
{
    const vi bits = v_bits(x);
    const vi exponent = v_shift_right(bits, 23) - 127;
    vf m = v_from_bits((bits & 0x7fffff) | 0x3f800000);
    const vm high = v_gt(m, v_set(1.41421356f));
    m = v_select(high, m * v_set(0.5f), m);
    const vf e = v_from_int(exponent) + v_select(high, v_set(1), v_set(0));
    const vf f = (m - v_set(1)) / (m + v_set(1)), f2 = f * f;
    vf p = v_set(0.22222222f) * f2 + v_set(0.28571429f);
    p = p * f2 + v_set(0.4f);
    p = p * f2 + v_set(0.66666667f);
    p = p * f2 + v_set(2);
    return e * v_set(0.69314718f) + f * p;
}

/* Returns 1 - exp(-x) for x >= 0. */
INLINE vf v_absorbed(vf x)
{
    const vf small = v_min(x, v_set(0.25f));
    vf p = v_set(-1.0f / 720) * small + v_set(1.0f / 120);
    p = p * small + v_set(-1.0f / 24);
    p = p * small + v_set(1.0f / 6);
    p = p * small + v_set(-0.5f);
    p = (p * small + v_set(1)) * small;
    return v_select(v_gt(x, v_set(0.25f)), v_set(1) - exp_minus_half(x + x), p);
}

/* Returns the normal density's integral up to x, with an error of at most 4e-5 (Abramowitz and
 * Stegun 1964, equation 7.1.28, and the bounds of SHEET_REACH). */
INLINE vf normal_integral(vf x)
{
    const vf y = v_min(v_abs(x), v_set(SHEET_REACH)) * v_set(0.70710678f);
    vf p = v_set(0.0000430638f) * y + v_set(0.0002765672f);
    p = p * y + v_set(0.0001520143f);
    p = p * y + v_set(0.0092705272f);
    p = p * y + v_set(0.0422820123f);
    p = p * y + v_set(0.0705230784f);
    p = p * y + v_set(1);
    p = p * p;
    p = p * p;
    p = p * p;
    p = p * p;
    const vf beyond = v_set(0.5f) / p;
    const vf tail = v_select(v_ge(v_abs(x), v_set(SHEET_REACH)), v_set(0), beyond);
    return v_select(v_gt(x, v_set(0)), v_set(1) - tail, tail);
}

/* The numbers of a splat's density that its blocks in a tile share. */
typedef struct tile_density {
    linear u, v, slope, along, ray;
    float variance, unit, from, thickness; /* from: the run's beginning, less the centre */
    int first, last;                       /* sheets of the run, from 0 */
    bool begins, ends;                     /* no sheet before, none behind has a share */
    bool parallel;
} tile_density;

INLINE void place_density(tile_density *at, const trip_sheet_run *run, const trip_sheet_splat *s,
                          int x, int y)
{
    const double dx = x + 0.5 - s->footprint.x, dy = y + 0.5 - s->footprint.y;
    const int64_t first = s->first - run->first, last = s->last - run->first;
    at->first = first > 0 ? (int)first : 0;
    at->last = last < TRIP_SHEET_RUN ? (int)last : TRIP_SHEET_RUN - 1;
    at->begins = first >= 0;
    at->ends = last < TRIP_SHEET_RUN;
    at->u = linear_of((double)s->across * dx - (double)s->across_shear * dy, s->across,
                      -s->across_shear);
    at->v = linear_of((double)s->down * dy, 0, s->down);
    at->slope =
        linear_of((double)s->slope_x * dx + (double)s->slope_y * dy, s->slope_x, s->slope_y);
    const float ox = (float)((double)s->unit * run->ox), oy = (float)((double)s->unit * run->oy);
    at->along = linear_of((double)ox * dx + (double)oy * dy, ox, oy);
    at->ray = linear_of(run->r0 + run->rx * (x + 0.5) + run->ry * (y + 0.5), (float)run->rx,
                        (float)run->ry);
    at->variance = s->variance;
    at->unit = s->unit;
    at->from = (float)((double)run->first * run->thickness - s->coordinate);
    at->thickness = (float)run->thickness;
    at->parallel = run->parallel;
}

/* The mean of a density along the axis, from the centre, and 1 / its deviation. */
INLINE void density_at(const tile_density *at, int i, float x, float y, vf *mean, vf *inverse)
{
    const vf u = linear_at(&at->u, i, x, y), v = linear_at(&at->v, i, x, y);
    const vf g = linear_at(&at->slope, i, x, y), ray = linear_at(&at->ray, i, x, y);
    const vf variance = v_set(at->variance), unit = v_set(at->unit);
    vf depth = g, by = v_set(1);
    if (!at->parallel) {
        const vf h = v_set(1) - g, wide = variance * (u * u + v * v);
        by = v_max(h * h + wide, v_set(1e-12f));
        depth = (g * h - wide) / by;
    }
    *mean = unit * depth * ray + linear_at(&at->along, i, x, y);
    *inverse = v_set(1) / v_max(unit * v_sqrt(variance / by) * ray, v_set(1e-30f));
}

INLINE void add_to_sheet(sheet_sums *sums, int sheet, int block, int i, const trip_projected *s,
                         vf tau, bool depth)
{
    float(*planes)[TRIP_TILE_PIXELS] = sums->sums[sheet];
    const int first = 16 * block;
    if (!(sums->touched[sheet] >> block & 1)) {
        for (int plane = 0; plane < SUMS; plane++)
            memset(&planes[plane][first], 0, 16 * sizeof(float));
        sums->touched[sheet] = (uint16_t)(sums->touched[sheet] | 1u << block);
    }
    float *const to = &planes[SUM_TAU][first + V * i];
    v_store(to, v_load(to) + tau);
    for (int c = 0; c < 3; c++) {
        float *const colour = to + (SUM_RED + c) * TRIP_TILE_PIXELS;
        v_store(colour, v_load(colour) + tau * v_set(s->rgb[c]));
    }
    if (depth) {
        float *const z = to + SUM_DEPTH * TRIP_TILE_PIXELS;
        v_store(z, v_load(z) + tau * v_set(s->z));
    }
}

/* Shares out the optical depth of a vector of pixels over the sheets of the run. */
INLINE void share_out(sheet_sums *sums, const tile_density *at, int block, int i, float x, float y,
                      const trip_projected *s, vf tau, bool depth)
{
    if (at->begins && at->ends && at->first == at->last) {
        add_to_sheet(sums, at->first, block, i, s, tau, depth);
        return;
    }
    vf mean, inverse;
    density_at(at, i, x, y, &mean, &inverse);
    vf before = at->begins ? v_set(0) : normal_integral((v_set(at->from) - mean) * inverse);
    for (int sheet = at->first; sheet <= at->last; sheet++) {
        const float end = at->from + (float)(sheet + 1) * at->thickness;
        vf after = v_set(1);
        if (!at->ends || sheet < at->last)
            after = normal_integral((v_set(end) - mean) * inverse);
        const vf share = after - before;
        if (vm_any(v_gt(share, v_set(0))))
            add_to_sheet(sums, sheet, block, i, s, tau * v_max(share, v_set(0)), depth);
        before = after;
    }
}

INLINE void add_splat(sheet_sums *sums, const float *planes, uint16_t open,
                      const trip_sheet_run *run, const trip_sheet_splat *s, int x, int y,
                      bool curved, bool depth)
{
    const trip_projected *p = &s->footprint;
    tile_splat at;
    tile_density density;
    place_splat(&at, p, curved ? &s->curve : NULL, x, y);
    place_density(&density, run, s, x, y);
    for (int row = at.top; row <= at.bottom; row++)
        for (int column = at.left; column <= at.right; column++) {
            const int block = row * (TRIP_TILE_PX / 4) + column;
            if (!(open >> block & 1))
                continue;
            for (int i = 0; i < VECTORS; i++) {
                const float bx = (float)(4 * column), by = (float)(4 * row);
                const vf q = radius2(&at, i, bx, by, curved);
                const vf t = v_load(planes + TRIP_TILE_T * TRIP_TILE_PIXELS + 16 * block + V * i);
                const vm reached = vm_and(v_ge(v_set(p->limit), q), v_gt(t, v_set(0)));
                if (!vm_any(reached))
                    continue;
                const vf alpha = v_min(v_set(p->opacity) * exp_minus_half(q),
                                       v_set((float)TRIP_GAUSSIAN_ALPHA_MAX));
                const vm counts =
                    vm_and(reached, v_ge(alpha, v_set((float)TRIP_GAUSSIAN_ALPHA_MIN)));
                if (!vm_any(counts))
                    continue;
                const vf tau = v_select(counts, v_set(0) - v_log(v_set(1) - alpha), v_set(0));
                share_out(sums, &density, block, i, bx, by, p, tau, depth);
            }
        }
}

/* Composites a sheet into a vector of pixels. */
INLINE void composite_sheet(float *t, const float *sums, float termination, bool depth)
{
    const vf before = v_load(t), tau = v_load(sums);
    const vm adds = vm_and(v_gt(before, v_set(0)), v_gt(tau, v_set(0)));
    if (!vm_any(adds))
        return;
    const vf absorbed = before * v_absorbed(tau);
    const vf weight = v_select(adds, absorbed / v_max(tau, v_set(1e-30f)), v_set(0));
    for (int c = 0; c < (depth ? 4 : 3); c++) {
        float *const to = t + (TRIP_TILE_RED + c) * TRIP_TILE_PIXELS;
        v_store(to, v_load(to) + weight * v_load(sums + (SUM_RED + c) * TRIP_TILE_PIXELS));
    }
    const vf after = before - absorbed;
    const vf closed = v_select(v_gt(v_set(termination), after), -v_max(after, v_set(0)), after);
    v_store(t, v_select(adds, v_select(v_gt(after, v_set(0)), closed, v_set(-1e-30f)), before));
}

INLINE void composite_run(float *planes, uint16_t *open, const sheet_sums *sums, float termination,
                          bool depth)
{
    for (int sheet = 0; sheet < TRIP_SHEET_RUN; sheet++) {
        const uint16_t blocks = sums->touched[sheet] & *open;
        for (int block = 0; block < TRIP_TILE_BLOCKS; block++) {
            if (!(blocks >> block & 1))
                continue;
            float *const first = planes + 16 * block;
            for (int i = 0; i < VECTORS; i++)
                composite_sheet(first + V * i, &sums->sums[sheet][SUM_TAU][16 * block + V * i],
                                termination, depth);
            if (!block_is_open(first))
                *open = (uint16_t)(*open & ~(1u << block));
        }
    }
}

INLINE void draw_run(float *planes, uint16_t *open, const trip_sheet_run *run,
                     const trip_sheet_splat *splats, const uint32_t *list, size_t count, int x,
                     int y, float termination, bool depth)
{
    sheet_sums sums;
    memset(sums.touched, 0, sizeof sums.touched);
    for (size_t i = 0; i < count; i++) {
        const trip_sheet_splat *s = &splats[list[i]];
        if (i + 2 < count)
            __builtin_prefetch(&splats[list[i + 2]]);
        if (s->footprint.curved)
            add_splat(&sums, planes, *open, run, s, x, y, true, depth);
        else
            add_splat(&sums, planes, *open, run, s, x, y, false, depth);
    }
    composite_run(planes, open, &sums, termination, depth);
}

static void draw_sheets(float *planes, uint16_t *open, const trip_sheet_run *run,
                        const trip_sheet_splat *splats, const uint32_t *list, size_t count, int x,
                        int y, float termination, bool depth)
{
    if (depth)
        draw_run(planes, open, run, splats, list, count, x, y, termination, true);
    else
        draw_run(planes, open, run, splats, list, count, x, y, termination, false);
}

#endif
