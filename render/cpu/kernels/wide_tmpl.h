/* Samples sheets with kernels of 64 voxels (kernel.h), one ray after the other. Included by
 * sheet_tmpl.h. Both ends of a segment are sampled in the segment's own cells (sheet.h). A missing
 * voxel has the value of the cell's nearest corner. */
#ifndef TRIP_CPU_WIDE_H
#define TRIP_CPU_WIDE_H

/* A voxel that the kernel weights: its raster, and its position there. */
typedef struct tap {
    const trip_cpu_voxels *raster;
    int32_t at;
} tap;

/* The position of a column or row of voxels along u or v: `raster` is an offset in the grid of
 * rasters, `voxel` an offset in the raster. */
typedef struct tap_line {
    int32_t raster, voxel;
} tap_line;

INLINE tap_line line_of(int32_t voxel, int32_t rasters, int32_t voxels)
{
    return (tap_line){ (voxel >> TRIP_CPU_RASTER_LOG2) * rasters,
                       (voxel & (TRIP_CPU_RASTER - 1)) * voxels };
}

/* Returns false if the voxel is missing. */
INLINE bool take_tap(const trip_cpu_group *g, const int32_t *rasters, tap_line u, tap_line v,
                     tap *t)
{
    if (!rasters)
        return false;
    t->raster = &g->pool[rasters[v.raster + u.raster]];
    t->at = v.voxel + u.voxel;
    return t->raster->codes[t->at] != TRIP_CPU_CODE_MISSING;
}

/* Finds the 64 taps of one ray: u fastest, then v, then the sheets. Returns false if the cell lacks
 * a corner or lies beyond the grid. The outermost rasters have no voxels. */
static bool take_taps(const trip_cpu_sheet_view *view, const trip_cpu_group *g,
                      const wide_position *p, int lane, tap taps[64])
{
    const int32_t size[2] = { g->across * TRIP_CPU_RASTER, g->down * TRIP_CPU_RASTER };
    const int64_t origin[2] = { g->first_u, g->first_v };
    tap_line lines[2][TRIP_KERNEL_TAPS]; /* the voxels at the edge of the grid repeat beyond it */
    tap eight[8];
    for (int a = 0; a < 2; a++) {
        const int32_t cell = p->cell[a][lane];
        if (cell < 1 || cell > size[a] - TRIP_KERNEL_TAPS)
            return false;
        if (cell + origin[a] < 0 || cell + origin[a] > view->voxels[a] - 2)
            return false;
        for (int i = 0; i < TRIP_KERNEL_TAPS; i++) {
            const double voxel =
                within(cell + i - 1, (double)-origin[a], (double)(view->voxels[a] - 1 - origin[a]));
            lines[a][i] =
                line_of((int32_t)voxel, a ? g->across : 1, a ? TRIP_CPU_RASTER_STRIDE : 1);
        }
    }
    for (int n = 0; n < 8; n++)
        if (!take_tap(g, p->about->rasters[1 + (n >> 2)], lines[0][1 + (n & 1)],
                      lines[1][1 + (n >> 1 & 1)], &eight[n]))
            return false;
    for (int n = 0; n < 64; n++) {
        const int x = n & 3, y = n >> 2 & 3, z = n >> 4;
        if (!take_tap(g, p->about->rasters[z], lines[0][x], lines[1][y], &taps[n]))
            taps[n] = eight[(x > 1) + 2 * (y > 1) + 4 * (z > 1)];
    }
    return true;
}

static void find_tap_weights(const trip_cpu_sheet_view *view, const wide_position *p, int lane,
                             float weights[64])
{
    double w[3][TRIP_KERNEL_TAPS];
    for (int a = 0; a < 2; a++)
        trip_kernel_weights(view->kernel, (double)p->part[a][lane], w[a]);
    trip_kernel_weights(view->kernel, (double)p->between, w[2]);
    for (int n = 0; n < 64; n++)
        weights[n] = (float)(w[0][n & 3] * w[1][n >> 2 & 3] * w[2][n >> 4]);
}

/* Interpolates the deviation for one ray, times 2^WEIGHT_LOG2 TRIP_CPU_DEVIATION_PARTS. */
static int32_t interpolated_deviation(const trip_cpu_sheet_view *view, const trip_cpu_group *g,
                                      const wide_position *p, int lane, const tap taps[64])
{
    float weights[64], sum = 0;
    find_tap_weights(view, p, lane, weights);
    for (int k = 0; k < 64; k++)
        sum += weights[k] * (float)g->deviations[taps[k].raster - g->pool][taps[k].at];
    return (int32_t)(within((double)sum, 0, 255 * TRIP_CPU_DEVIATION_PARTS) * (1 << WEIGHT_LOG2));
}

/* Interpolates the code for one ray. It sums differences from a corner of the cell. If all codes
 * are equal, the result is exactly that code, however the weights are rounded. */
static double interpolated_code(const trip_cpu_sheet_view *view, const wide_position *p, int lane,
                                const tap taps[64])
{
    enum { CORNER = 1 + 4 + 16 };
    const int corner = taps[CORNER].raster->codes[taps[CORNER].at];
    float weights[64], sum = 0;
    find_tap_weights(view, p, lane, weights);
    for (int k = 0; k < 64; k++)
        sum += weights[k] * (float)(taps[k].raster->codes[taps[k].at] - corner);
    return (double)corner + (double)sum;
}

/* Computes the positions of the rays at sample plane n, in cells of a segment. Rays
 * beyond a side of the grid count as inside the last cell. */
INLINE void find_wide_positions(const trip_cpu_group *g, const pane_path *path, const stamp_rays *l,
                                unsigned n, unsigned segment, wide_position *p)
{
    corners c = corners_at(path, l, n);
    vi whole[2];
    move_inside(path, n, &c);
    find_cells(g, path, n, &c, whole);
    p->about = &g->about[segment];
    p->between = (float)(g->samples[n].coordinate - (double)p->about->number);
    for (int a = 0; a < 2; a++) {
        vi_store(p->cell[a], whole[a]);
        v_store(p->part[a], c.part[a]);
    }
}

/* The cubic kernel overshoots the codes of its voxels by at most 0.4765625 of their range
 * (trip_field_code_bounds()). The maximum times 2^WEIGHT_LOG2, doubled, fits 32 bits. */
#define OVERSHOT_MAX 64000
static_assert((OVERSHOT_MAX - TRIP_CPU_CODE_BIAS) * INT64_C(10000000) >= 65535 * INT64_C(4765625),
              "no code is cut");
static_assert(OVERSHOT_MAX <= INT32_MAX / 2 >> WEIGHT_LOG2, "differences of codes");

/* Does the work of sample_at() at one end of a segment. */
static void wide_sample_at(const trip_cpu_sheet_view *view, const trip_cpu_group *g,
                           const pane_path *path, const stamp_rays *l, unsigned n, unsigned segment,
                           sample *s)
{
    vi code = { 0 }, lack = { 0 }, deviation = { 0 };
    find_wide_positions(g, path, l, n, segment, s->wide);
    for (int i = 0; i < V; i++) {
        tap taps[64];
        lack[i] = !take_taps(view, g, s->wide, i, taps);
        if (!lack[i])
            code[i] = (int32_t)(within(interpolated_code(view, s->wide, i, taps), -OVERSHOT_MAX,
                                       OVERSHOT_MAX) *
                                (1 << WEIGHT_LOG2));
        if (!lack[i] && BLURRED)
            deviation[i] = interpolated_deviation(view, g, s->wide, i, taps);
    }
    s->deviation = deviation;
    s->there = vi_is_0(lack);
    s->index = index_of(view->integrals, code);
    s->lit = 0;
    s->summed = false;
}

INLINE bool in_the_same_cells(const trip_cpu_group *g, unsigned segment, const sample *s)
{
    return s->wide->about->number == g->about[segment].number;
}

static void find_wide_gradients(const trip_cpu_sheet_view *view, const trip_cpu_group *g, sample *s)
{
    for (int i = 0; i < V; i++) {
        tap taps[64];
        float weights[64], sums[3] = { 0 };
        if (take_taps(view, g, s->wide, i, taps)) {
            find_tap_weights(view, s->wide, i, weights);
            for (int k = 0; k < 64; k++)
                for (int a = 0; a < 3; a++)
                    sums[a] += weights[k] * taps[k].raster->gradients[taps[k].at].along[a];
        }
        for (int a = 0; a < 3; a++)
            s->gradient[a][i] = (int32_t)(sums[a] * (1 << WEIGHT_LOG2));
    }
}

#endif
