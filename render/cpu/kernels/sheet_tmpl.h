/* Draws a group of sample planes into the pixels of a pane (sheet.h). Included by table_tmpl.h
 * after merge_tmpl.h. For each patch of 8 x 8 pixels the kernel finds the segments that may be
 * visible. Each stamp then composites them in order, with its pixels in registers.
 *
 * Positions are computed from the pane's corner at each sample plane, so that they do not depend on
 * the grouping of sample planes or the layout of rasters. With TRIP_CPU_CLOSED segments have a
 * closed form (closed_form.h). */
#ifndef TRIP_CPU_SHEET_H
#define TRIP_CPU_SHEET_H

#include "cpu/kernels/blend_tmpl.h"
#include "cpu/kernels/effects_tmpl.h"
#include "cpu/kernels/kernels.h"
#include "cpu/kernels/simd_tmpl.h"
#include "shade.h"
#include "sheet.h"

/* Room for the sample planes of a group in whole vectors. */
#define SAMPLES_ROOM (TRIP_CPU_SEGMENTS + V)

/* The weights of a cell's corners are integers with the sum 2^WEIGHT_LOG2. */
#define WEIGHT_LOG2 14
static_assert(1 << WEIGHT_LOG2 == TRIP_CPU_CODE_PARTS, "parts of a code that samples are in");

/* Returns exp(-x) for x >= 0 with a relative error of at most 3e-7. It is exact at 0. */
INLINE vf exp_of_minus(vf x)
{
    vf y = v_max(x * v_set(-1.44269504088896340736f), v_set(-126));
    vf whole = v_from_int(v_truncate(y - v_set(0.5f))); /* so that y - whole is in (-0.5, 0.5] */
    vf f = y - whole;
    vf p = v_fma(f, v_set(1.3333558e-3f), v_set(9.6181291e-3f));
    p = v_fma(p, f, v_set(5.5504109e-2f));
    p = v_fma(p, f, v_set(2.4022651e-1f));
    p = v_fma(p, f, v_set(6.9314718e-1f));
    p = v_fma(p, f, v_set(1));
    return v_from_bits(v_bits(p) + (v_truncate(whole) << 23));
}

/* ---- the pane's rays at the sample planes ---- */

/* The rays' positions at the sample planes, in voxels from the corner of the grid of rasters. */
typedef struct pane_path {
    /* The ray of a lane is at base + first + along * slope + shift, with slope and shift of
     * stamp_rays. `along` is counted from the eye, or from sheet 0 in parallel views. */
    int32_t base[2][SAMPLES_ROOM];
    float first[2][SAMPLES_ROOM];
    float along[SAMPLES_ROOM];
    float middle[TRIP_CPU_SEGMENTS + 1]; /* sheets from the grid's middle, exact for a far eye */
    float sheets[TRIP_CPU_SEGMENTS];     /* length of each segment, in sheets */
    double slope[2], start[2];           /* of the ray at the pane's corner */
    /* Linear functions of the position in the pane: the value at its corner, and the change per
     * pixel in x and y. */
    float toward[3];      /* the ray along the list's axis; length near 1 at the corner */
    float aside[2][3];    /* the ray along u and v, minus the corner's slope times `toward` */
    float world[3][3];    /* the ray in world space; length near 1 at the corner */
    float sheet[3];       /* parallel views: sheet coordinate of the eye's plane */
    float world_length;   /* world units per sheet if `world` and `toward` are 1 */
    float depth;          /* z per sheet if `toward` is 1 */
    float gradient[3][3]; /* the view's map divided by 2^WEIGHT_LOG2 */
    /* The distance of a ray inside each half-space at the grid's middle, and its growth per sheet
     * in the direction of the pass. In perspective both are multiplied by `toward`. */
    float clip_at[TRIP_CLIP_MAX][3], clip_toward[TRIP_CLIP_MAX][3];
    /* NULL with even spacing. Otherwise positions are in the units of trip_coordinates, from the
     * grid's first voxel. */
    const trip_coordinates *coordinates;
    int axes[2];
    int32_t corner[2];   /* voxel at the corner of the grid of rasters */
    int32_t cells[2][2]; /* first and last cell of the grid along u and v, from this corner */
    double sides[2][2];  /* the sides of the grid, in the units of `base` */
} pane_path;

/* Only the plain kernels draw uneven grids, so that even grids cost no extra instruction. */
INLINE bool is_uneven(const pane_path *path)
{
    return TRIP_SIMD == TRIP_SIMD_PLAIN && path->coordinates;
}

/* A kernel of its own draws the nearest value. So the other kernels cost no extra instruction. */
#define NEAREST TRIP_CPU_NEAREST

/* A kernel of its own draws blurred functions, for the same reason. */
#define BLURRED TRIP_CPU_BLURRED

/* Only the plain kernels sample with 64 voxels, so that linear sampling costs no extra instruction.
 */
INLINE bool is_wide(const trip_cpu_group *g)
{
    return TRIP_SIMD == TRIP_SIMD_PLAIN && g->about;
}

/* Computes the ray of a pixel position: its start, and its movement along u and v per sheet. In
 * parallel views the start is at sheet 0. Returns false if the ray does not go in the direction of
 * the pass. */
INLINE bool ray_slope(const trip_cpu_sheet_view *view, double x, double y, double start[2],
                      double slope[2])
{
    double r[3];
    for (int i = 0; i < 3; i++)
        r[i] = view->ortho ? view->r0[i] : view->r0[i] + x * view->rx[i] + y * view->ry[i];
    bool along = r[2] * view->direction > 0;
    for (int i = 0; i < 2; i++) {
        slope[i] = along ? r[i] / r[2] : 0;
        start[i] = view->eye[i];
        if (view->ortho) { /* the ray's position at sheet 0 */
            double sheet = view->eye[2] + x * view->rx[2] + y * view->ry[2];
            start[i] += x * view->rx[i] + y * view->ry[i] - sheet * slope[i];
        }
    }
    return along;
}

/* Returns the distance along the sheets from the start of the rays. */
INLINE double from_start(const trip_cpu_sheet_view *view, double coordinate)
{
    return view->ortho ? coordinate : coordinate - view->eye[2];
}

/* The rays of a square of pixel positions: results of ray_slope() at its corners, which bound all
 * its rays. */
typedef struct beam {
    double start[4][2], slope[4][2];
    bool whole; /* all its rays inside the picture are drawn */
} beam;

static beam beam_of(const trip_cpu_sheet_view *view, double x, double y, double size)
{
    beam b;
    bool all = true;
    for (int i = 0; i < 4; i++)
        all &= ray_slope(view, x + (i & 1) * size, y + (i >> 1) * size, b.start[i], b.slope[i]);
    b.whole = all;
    for (int i = 0; i < 4; i++)
        for (int a = 0; a < 2; a++) {
            double s = b.slope[i][a], max = view->steepest;
            if (!all) /* the directions of the rays are unbounded */
                s = (a ? i >> 1 : i & 1) ? max : -max;
            b.slope[i][a] = s < -max ? -max : s > max ? max : s;
            b.whole &= b.slope[i][a] == s;
        }
    return b;
}

/* Computes the minimum and maximum position of a beam along u (a = 0) or v (a = 1). */
INLINE void beam_bounds(const beam *b, int a, double along, double bounds[2])
{
    bounds[0] = INFINITY;
    bounds[1] = -INFINITY;
    for (int i = 0; i < 4; i++) {
        double at = b->start[i][a] + along * b->slope[i][a];
        bounds[0] = at < bounds[0] ? at : bounds[0];
        bounds[1] = at > bounds[1] ? at : bounds[1];
    }
}

static double within(double a, double min, double max)
{
    return a < min ? min : a > max ? max : a;
}

static double greatest_of(const double v[3])
{
    return fmax(fabs(v[0]), fmax(fabs(v[1]), fabs(v[2])));
}

static void find_forms(const trip_cpu_sheet_view *view, int x, int y, pane_path *path)
{
    double corner[3], world[3][3], turns = view->ortho ? 0 : 1;
    for (int i = 0; i < 3; i++)
        corner[i] = view->r0[i] + turns * (x * view->rx[i] + y * view->ry[i]);
    double unit = 1 / greatest_of(corner);
    const double *linear[3] = { corner, view->rx, view->ry };
    for (int k = 0; k < 3; k++)
        for (int i = 0; i < 3; i++)
            world[i][k] = view->world[k][0] * linear[i][0] + view->world[k][1] * linear[i][1] +
                          view->world[k][2] * linear[i][2];
    double world_unit = 1 / greatest_of(world[0]);
    for (int i = 0; i < 3; i++) {
        double factor = i == 0 || !view->ortho ? 1 : 0;
        path->toward[i] = (float)(factor * unit * linear[i][2]);
        for (int a = 0; a < 2; a++)
            path->aside[a][i] = (float)((view->ortho && i ? 1 : unit) *
                                        (linear[i][a] - path->slope[a] * linear[i][2]));
        for (int k = 0; k < 3; k++)
            path->world[k][i] = (float)(factor * world_unit * world[i][k]);
        path->sheet[i] = (float)linear[i][2];
    }
    path->sheet[0] = (float)(view->eye[2] + x * view->rx[2] + y * view->ry[2]);
    path->world_length = (float)(unit / world_unit);
    path->depth = (float)unit;
}

INLINE double dot_list(const double a[4], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void find_clip(const trip_cpu_sheet_view *view, int x, int y, pane_path *path)
{
    const double along = from_start(view, view->middle);
    double turns = view->ortho ? 0 : 1, corner[3], start[3];
    for (int i = 0; i < 3; i++) {
        double beside = x * view->rx[i] + y * view->ry[i];
        corner[i] = view->r0[i] + turns * beside;
        start[i] = view->eye[i] + (1 - turns) * beside;
    }
    const double *linear[3] = { corner, view->rx, view->ry };
    const double *starts[3] = { start, view->rx, view->ry };
    const double way = view->direction;
    double unit = view->ortho ? (corner[2] != 0 ? 1 / corner[2] : 0) : 1 / greatest_of(corner);
    for (int n = 0; n < view->clips; n++) {
        const double *plane = view->clip[n];
        const double by = unit * dot_list(plane, corner), at = dot_list(plane, start) + plane[3];
        for (int i = 0; i < 3; i++) {
            double toward = unit * dot_list(plane, linear[i]);
            double inside = way * (at * unit * linear[i][2] + along * toward);
            if (view->ortho) {
                toward = i == 0 ? way * by : 0;
                inside = i == 0 ? at + by * (along - start[2])
                                : dot_list(plane, starts[i]) - by * starts[i][2];
            }
            path->clip_toward[n][i] = (float)toward;
            path->clip_at[n][i] = (float)inside;
        }
    }
}

static void find_sides(const trip_cpu_sheet_view *view, const trip_cpu_group *g, pane_path *path)
{
    const int64_t origin[2] = { g->first_u, g->first_v };
    for (int a = 0; a < 2; a++) {
        const int64_t ends[2] = { -origin[a], view->voxels[a] - 1 - origin[a] };
        for (int i = 0; i < 2; i++) {
            path->cells[a][i] = (int32_t)(ends[i] - i);
            path->sides[a][i] = (double)ends[i];
            if (is_uneven(path))
                path->sides[a][i] = trip_coordinates_at(path->coordinates, path->axes[a],
                                                        i ? view->voxels[a] - 1 : 0);
        }
    }
}

static void find_path(const trip_cpu_sheet_view *view, const trip_cpu_group *g, int x, int y,
                      pane_path *path)
{
    double origin[2] = { (double)g->first_u, (double)g->first_v };
    beam b = beam_of(view, x, y, TRIP_CPU_PANE);
    path->coordinates = view->coordinates;
    for (int a = 0; a < 2 && is_uneven(path); a++) {
        path->axes[a] = (view->axis + 1 + a) % 3;
        path->corner[a] = (int32_t)origin[a];
        origin[a] = 0;
    }
    for (int a = 0; a < 2; a++) {
        path->slope[a] = b.slope[0][a];
        path->start[a] = b.start[0][a];
    }
    for (unsigned n = 0; n <= g->segments; n++) {
        double along = from_start(view, g->samples[n].coordinate);
        path->along[n] = (float)along;
        path->middle[n] = (float)(g->samples[n].coordinate - view->middle);
        if (n > 0)
            path->sheets[n - 1] =
                (float)fabs(g->samples[n].coordinate - g->samples[n - 1].coordinate);
        for (int a = 0; a < 2; a++) {
            double bounds[2];
            beam_bounds(&b, a, along, bounds);
            double base = floor(bounds[0]);
            path->first[a][n] = (float)(path->start[a] + along * path->slope[a] - base);
            path->base[a][n] = (int32_t)within(base - origin[a], -0x1p28, 0x1p28);
        }
    }
    for (int k = 0; k < 3; k++)
        for (int i = 0; i < 3; i++)
            path->gradient[k][i] = view->gradient[k][i] * (1.0f / (1 << WEIGHT_LOG2));
    find_sides(view, g, path);
    find_forms(view, x, y, path);
    find_clip(view, x, y, path);
}

/* ---- segments that may be visible ---- */

#if TRIP_SIMD == TRIP_SIMD_AVX2

INLINE vi vi_lesser(vi a, vi b)
{
    return (vi)_mm256_min_epi32((__m256i)a, (__m256i)b);
}

INLINE vi vi_greater(vi a, vi b)
{
    return (vi)_mm256_max_epi32((__m256i)a, (__m256i)b);
}

#elif TRIP_SIMD == TRIP_SIMD_AVX512

INLINE vi vi_lesser(vi a, vi b)
{
    return (vi)_mm512_min_epi32((__m512i)a, (__m512i)b);
}

INLINE vi vi_greater(vi a, vi b)
{
    return (vi)_mm512_max_epi32((__m512i)a, (__m512i)b);
}

#else

INLINE vi vi_lesser(vi a, vi b)
{
    vi m = (vi)(a < b);
    return (a & m) | (b & ~m);
}

INLINE vi vi_greater(vi a, vi b)
{
    vi m = (vi)(a > b);
    return (a & m) | (b & ~m);
}

#endif

INLINE vi vi_within(vi a, int32_t min, int32_t max)
{
    const vi zero = { 0 };
    return vi_lesser(vi_greater(a, zero + min), zero + max);
}

/* Rounds down and clamps to +-2^28. */
INLINE vi v_floor_within(vf a)
{
    a = v_max(v_min(a, v_set(0x1p28f)), v_set(-0x1p28f));
    vi whole = v_truncate(a);
    return whole + (vi)(v_from_int(whole) > a);
}

/* Minimum and maximum of slope and shift along u and v, relative to the ray at the pane's corner.
 */
typedef struct ray_bounds {
    float slope[2][2], shift[2][2];
    bool whole; /* all rays inside the picture are drawn, and spacing is even */
} ray_bounds;

INLINE void include(float a, bool first, float bounds[2])
{
    bounds[0] = first || a < bounds[0] ? a : bounds[0];
    bounds[1] = first || a > bounds[1] ? a : bounds[1];
}

static ray_bounds bounds_of_beam(const trip_cpu_sheet_view *view, const pane_path *path, int x,
                                 int y, int size)
{
    beam b = beam_of(view, x, y, size);
    ray_bounds r = { .whole = b.whole && !is_uneven(path) };
    for (int a = 0; a < 2; a++)
        for (int i = 0; i < 4; i++) {
            include((float)(b.slope[i][a] - path->slope[a]), i == 0, r.slope[a]);
            include((float)(b.start[i][a] - path->start[a]), i == 0, r.shift[a]);
        }
    return r;
}

/* A box of cells of the grid, inclusive. */
typedef struct cell_box {
    int32_t lo[2], hi[2];
} cell_box;

/* The boxes of cells that rays meet at each sample plane, or in each segment, clamped to the grid
 * of rasters. */
typedef struct cell_boxes {
    int32_t lo[2][SAMPLES_ROOM], hi[2][SAMPLES_ROOM];
} cell_boxes;

/* Converts a position to voxels from the corner of the grid of rasters, at most a cell outside the
 * volume. The search starts at voxel *near, and stores the voxel before the position there. */
static double index_near(const pane_path *path, int a, double position, int32_t *near)
{
    const trip_coordinates *c = path->coordinates;
    const int axis = path->axes[a];
    const int32_t last = (int32_t)c->voxels[axis] - 2;
    const double *x = c->along[axis];
    int32_t k = *near;
    for (int step = 0; step < 4 && k < last && position >= x[k + 1]; step++)
        k++;
    for (int step = 0; step < 4 && k > 0 && position < x[k]; step++)
        k--;
    if ((k > 0 && position < x[k]) || (k < last && position >= x[k + 1]))
        k = (int32_t)within(floor(trip_coordinates_index(c, axis, position)), 0, last);
    *near = k;
    return within(k + (position - x[k]) / (x[k + 1] - x[k]), -1, last + 2) - path->corner[a];
}

static vi uneven_cells(const pane_path *path, int a, unsigned n, vf at)
{
    vi cells;
    int32_t near = 0;
    for (int i = 0; i < V; i++)
        cells[i] = (int32_t)floor(index_near(path, a, path->base[a][n + i] + (double)at[i], &near));
    return cells;
}

/* Returns the cells at V sample planes. `at` is relative to pane_path.base. */
INLINE vi cells_from_base(const pane_path *path, int a, unsigned n, vf at)
{
    if (is_uneven(path))
        return uneven_cells(path, a, n, at);
    return vi_load(path->base[a] + n) + v_floor_within(at);
}

/* Computes the boxes at the sample planes from `first` to `last`. The boxes are slightly enlarged
 * to cover the rounding of single precision. */
static void find_boxes(const trip_cpu_group *g, const pane_path *path, const ray_bounds *r,
                       unsigned first, unsigned last, cell_boxes *out)
{
    const int32_t size[2] = { g->across * TRIP_CPU_RASTER, g->down * TRIP_CPU_RASTER };
    for (unsigned n = first / V * V; n <= last; n += V)
        for (int a = 0; a < 2; a++) {
            const vf along = v_load(path->along + n), corner = v_load(path->first[a] + n);
            vf one = along * v_set(r->slope[a][0]), other = along * v_set(r->slope[a][1]);
            vf low = v_min(one, other) + v_set(r->shift[a][0]);
            vf high = v_max(one, other) + v_set(r->shift[a][1]);
            vf more = v_fma(v_abs(low) + v_abs(high), v_set(0x1p-20f), v_set(0x1p-6f));
            vi lo = cells_from_base(path, a, n, corner + low - more);
            vi hi = cells_from_base(path, a, n, corner + high + more);
            vi_store(out->lo[a] + n, vi_within(lo, 0, size[a] - 1));
            vi_store(out->hi[a] + n, vi_within(hi, 0, size[a] - 1));
        }
}

INLINE int32_t lesser_of(int32_t a, int32_t b)
{
    return a < b ? a : b;
}

INLINE int32_t greater_of(int32_t a, int32_t b)
{
    return a > b ? a : b;
}

INLINE cell_box both_boxes(const cell_boxes *of, unsigned m, unsigned n)
{
    cell_box box;
    for (int a = 0; a < 2; a++) {
        box.lo[a] = lesser_of(of->lo[a][m], of->lo[a][n]);
        box.hi[a] = greater_of(of->hi[a][m], of->hi[a][n]);
    }
    return box;
}

INLINE cell_box box_of_segment(const cell_boxes *of, unsigned n)
{
    return (cell_box){ { of->lo[0][n], of->lo[1][n] }, { of->hi[0][n], of->hi[1][n] } };
}

/* Computes the boxes of the segments from `first` to `last`: each is the union of the boxes at its
 * two sample planes. */
static void find_segment_boxes(unsigned first, unsigned last, const cell_boxes *samples,
                               cell_boxes *out)
{
    for (unsigned n = first / V * V; n <= last; n += V)
        for (int a = 0; a < 2; a++) {
            vi_store(out->lo[a] + n,
                     vi_lesser(vi_load(samples->lo[a] + n), vi_load(samples->lo[a] + n + 1)));
            vi_store(out->hi[a] + n,
                     vi_greater(vi_load(samples->hi[a] + n), vi_load(samples->hi[a] + n + 1)));
        }
}

INLINE bool some_square_of(const trip_cpu_group *g, const uint64_t *squares, cell_box box)
{
    int32_t u0 = box.lo[0] >> 3, u1 = box.hi[0] >> 3, v1 = box.hi[1] >> 3;
    for (int32_t v = box.lo[1] >> 3; v <= v1; v++) {
        const uint64_t *row = squares + (size_t)(v >> 3) * (size_t)g->across;
        for (int32_t u = u0; u <= u1;) {
            int32_t end = u | 7; /* last square of the raster */
            end = end > u1 ? u1 : end;
            uint64_t bits = row[u >> 3] >> (v & 7) * 8 & 255;
            if (bits >> (u & 7) & ((2u << (end - u)) - 1))
                return true;
            u = end + 1;
        }
    }
    return false;
}

/* Returns the columns of a raster with a cell that may be visible in rows `lo` to `hi`. */
INLINE uint64_t cells_of_rows(const trip_cpu_cells *raster, int32_t lo, int32_t hi)
{
    uint64_t some = 0;
    if (hi - lo < 3) {
        for (; lo <= hi; lo++)
            some |= raster->rows[lo];
        return some;
    }
    for (; lo < hi - 3; lo += 4)
        some |= raster->fours[lo];
    return some | raster->fours[hi - 3];
}

INLINE bool cells_show(const trip_cpu_group *g, unsigned segment, cell_box box)
{
    const int log2 = TRIP_CPU_RASTER_LOG2, last = TRIP_CPU_RASTER - 1;
    for (int32_t v = box.lo[1]; v <= box.hi[1]; v = (v | last) + 1) {
        const int32_t end_v = lesser_of(v | last, box.hi[1]);
        for (int32_t u = box.lo[0]; u <= box.hi[0]; u = (u | last) + 1) {
            const int32_t end_u = lesser_of(u | last, box.hi[0]);
            const size_t at = (size_t)(v >> log2) * (size_t)g->across + (size_t)(u >> log2);
            if (g->visible[segment][at] &&
                cells_of_rows(&g->cells[segment][at], v & last, end_v & last) >> (u & last) &
                    UINT64_MAX >> (last - (end_u - u)))
                return true;
        }
    }
    return false;
}

/* Size of a raster, and offset of its gradients, in numbers of 16 bits. */
#define RASTER_NUMBERS ((int32_t)(sizeof(trip_cpu_voxels) / sizeof(int16_t)))
#define GRADIENTS_FROM ((int32_t)(offsetof(trip_cpu_voxels, gradients) / sizeof(int16_t)))

#include "cpu/kernels/making_tmpl.h"

typedef struct patch_path {
    uint64_t segments; /* segments that may be visible */
    uint64_t made;     /* segments with all codes made that the patch's rays read */
    uint64_t beyond;   /* segments in which rays may be beyond a side of the grid */
    /* For each sample plane: the raster that contains all rays of the patch, as an offset in the
     * pool. It is -1 if several rasters or none contain them. `within` is the position of
     * pane_path.base in this raster. */
    int32_t raster[TRIP_CPU_SEGMENTS + 1], within[TRIP_CPU_SEGMENTS + 1];
    cell_boxes boxes; /* cells that rays meet, per segment */
} patch_path;

/* Returns whether a raster is not outermost. Outermost rasters are empty, and clamped rays may lie
 * anywhere beyond them. */
INLINE bool is_within(const trip_cpu_group *g, int32_t u, int32_t v)
{
    return u > 0 && v > 0 && u < g->across - 1 && v < g->down - 1;
}

static void find_raster(const trip_cpu_group *g, const pane_path *path, unsigned n, bool whole,
                        const cell_boxes *boxes, patch_path *area)
{
    const int log2 = TRIP_CPU_RASTER_LOG2;
    const int32_t u = boxes->lo[0][n] >> log2, v = boxes->lo[1][n] >> log2;
    area->raster[n] = -1;
    if (!whole || u != boxes->hi[0][n] >> log2 || v != boxes->hi[1][n] >> log2 ||
        !is_within(g, u, v))
        return;
    area->raster[n] = g->samples[n].rasters[v * g->across + u] * RASTER_NUMBERS;
    area->within[n] =
        (path->base[1][n] - (v << log2)) * TRIP_CPU_RASTER_STRIDE + path->base[0][n] - (u << log2);
}

/* Finds the raster of segment n for the nearest value: the raster that contains the patch's cells
 * at both sample planes. A raster repeats the first column and row of its neighbours. All corners
 * of the cells therefore lie in the raster. */
static void find_nearest_raster(const trip_cpu_group *g, const pane_path *path, unsigned n,
                                bool whole, const cell_boxes *boxes, patch_path *area)
{
    const int log2 = TRIP_CPU_RASTER_LOG2;
    const cell_box box = both_boxes(boxes, n, n + 1);
    const int32_t u = box.lo[0] >> log2, v = box.lo[1] >> log2;
    area->raster[n] = -1;
    if (!whole || u != box.hi[0] >> log2 || v != box.hi[1] >> log2 || !is_within(g, u, v))
        return;
    area->raster[n] = v * g->across + u;
    area->within[n] =
        (path->base[1][n] - (v << log2)) * TRIP_CPU_RASTER_STRIDE + path->base[0][n] - (u << log2);
}

typedef struct pane_segments {
    uint64_t some; /* segments with a square that may be visible */
    uint64_t made; /* segments with all voxels made that rays read */
    /* The rays meet many squares. Codes are then made for one patch at a time, and gradients for
     * the visible rays of a stamp. */
    bool sparse;
    cell_boxes boxes; /* cells that rays meet, per segment */
} pane_segments;

/* Minimum number of squares that rays meet in a segment if they are sparse. */
enum { SPARSE_SQUARES = 50 };

INLINE bool is_sparse(cell_box box)
{
    const int32_t across = (box.hi[0] >> 3) - (box.lo[0] >> 3) + 1;
    return across * ((box.hi[1] >> 3) - (box.lo[1] >> 3) + 1) >= SPARSE_SQUARES;
}

/* Moves the boxes inside the grid. Rays beyond a side read cells at it. */
static void move_boxes_inside(const trip_cpu_group *g, const pane_path *path, cell_boxes *boxes)
{
    const int32_t size[2] = { g->across * TRIP_CPU_RASTER, g->down * TRIP_CPU_RASTER };
    for (unsigned n = 0; n < g->segments; n += V)
        for (int a = 0; a < 2; a++) {
            const int32_t first = greater_of(path->cells[a][0], 0);
            const int32_t last = lesser_of(path->cells[a][1], size[a] - 1);
            vi_store(boxes->lo[a] + n, vi_within(vi_load(boxes->lo[a] + n), first, last));
            vi_store(boxes->hi[a] + n, vi_within(vi_load(boxes->hi[a] + n), first, last));
        }
}

static void find_segments(const trip_cpu_sheet_view *view, const trip_cpu_group *g,
                          const pane_path *path, int x, int y, pane_segments *out)
{
    const ray_bounds r = bounds_of_beam(view, path, x, y, TRIP_CPU_PANE);
    cell_boxes samples;
    out->some = 0;
    out->sparse = false;
    out->made = g->samples[0].making ? 0 : UINT64_MAX;
    find_boxes(g, path, &r, 0, g->segments, &samples);
    if (!some_square_of(g, g->some, both_boxes(&samples, 0, g->segments)))
        return;
    find_segment_boxes(0, g->segments - 1, &samples, &out->boxes);
    for (unsigned n = 0; n < g->segments; n++) {
        const cell_box box = box_of_segment(&out->boxes, n);
        if (some_square_of(g, g->visible[n], box))
            out->some |= UINT64_C(1) << n;
        out->sparse |= !NEAREST && out->made == 0 && is_sparse(box);
    }
    move_boxes_inside(g, path, &out->boxes);
}

/* Returns whether rays may be beyond a side of the grid. */
INLINE bool is_beyond(const pane_path *path, cell_box box)
{
    bool beyond = false;
    for (int a = 0; a < 2; a++)
        beyond |= box.lo[a] < path->cells[a][0] || box.hi[a] > path->cells[a][1];
    return beyond;
}

/* Finds the segments of a patch among the pane's `segments`, which must not be empty. */
static void find_patch(const trip_cpu_sheet_view *view, const trip_cpu_group *g,
                       const pane_path *path, uint64_t segments, int x, int y, patch_path *area)
{
    const ray_bounds r = bounds_of_beam(view, path, x, y, 8);
    unsigned placed = UINT32_MAX;
    cell_boxes samples;
    const unsigned first = (unsigned)__builtin_ctzll(segments);
    const unsigned last = 63 - (unsigned)__builtin_clzll(segments);
    find_boxes(g, path, &r, first, last + 1, &samples);
    find_segment_boxes(first, last, &samples, &area->boxes);
    area->segments = area->beyond = area->made = 0;
    for (; segments; segments &= segments - 1) {
        unsigned n = (unsigned)__builtin_ctzll(segments);
        const cell_box box = box_of_segment(&area->boxes, n);
        if (!cells_show(g, n, box))
            continue;
        area->segments |= UINT64_C(1) << n;
        if (NEAREST) {
            find_nearest_raster(g, path, n, r.whole, &samples, area);
            continue;
        }
        if (placed != n)
            find_raster(g, path, n, r.whole, &samples, area);
        find_raster(g, path, n + 1, r.whole, &samples, area);
        placed = n + 1;
        if (is_beyond(path, box)) {
            area->beyond |= UINT64_C(1) << n;
            area->raster[n] = area->raster[n + 1] = -1;
        }
    }
}

/* ---- rays at a sample plane ---- */

/* Unit vectors in world space: to the light, and halfway between light and eye. */
typedef struct light_way {
    vf light[3], half[3];
} light_way;

typedef struct stamp_rays {
    vf slope[2], shift[2]; /* relative to the ray at the pane's corner */
    vf length;             /* world units per sheet */
    vf depth;              /* z per sheet; depth_at_start is z at the start of the ray */
    vf depth_at_start;
    vm along;    /* rays in the direction of the pass */
    vf from, to; /* the part that is not clipped, in sheets from the middle in the direction of the
                    pass */
    vf to_eye[3];
    light_way way; /* except for a point light */
} stamp_rays;

INLINE vm vi_is_0(vi a)
{
#if TRIP_SIMD == TRIP_SIMD_AVX512
    return _mm512_testn_epi32_mask((__m512i)a, (__m512i)a);
#else
    return (vm)(a == 0);
#endif
}

/* The cells of the rays at a sample plane, relative to pane_path.base. */
typedef struct corners {
    vi whole[2];
    vf part[2]; /* position in the cell, 0 to 1 */
} corners;

INLINE corners corners_at(const pane_path *path, const stamp_rays *l, unsigned n)
{
    corners c;
    for (int a = 0; a < 2; a++) {
        vf at = v_fma(l->slope[a], v_set(path->along[n]), v_set(path->first[a][n]) + l->shift[a]);
        at = v_max(at, v_set(0)); /* rays that are not drawn may be negative */
        c.whole[a] = v_truncate(at);
        c.part[a] = at - v_from_int(c.whole[a]);
    }
    return c;
}

/* Converts the result of corners_at() to cells of a grid with uneven spacing. `near` is as in
 * index_near(). */
static corners uneven_corners(const pane_path *path, unsigned n, corners at, int32_t near[2])
{
    for (int a = 0; a < 2; a++) {
        const int32_t base = path->base[a][n];
        int32_t whole[V];
        float part[V];
        vi_store(whole, at.whole[a]);
        v_store(part, at.part[a]);
        for (int i = 0; i < V; i++) {
            double position = (double)(base + whole[i]) + (double)part[i];
            double index = index_near(path, a, position, &near[a]);
            double cell = floor(index);
            whole[i] = (int32_t)cell - base;
            part[i] = (float)(index - cell);
        }
        at.whole[a] = vi_load(whole);
        at.part[a] = v_load(part);
    }
    return at;
}

INLINE corners cells_at(const pane_path *path, const stamp_rays *l, unsigned n)
{
    corners c = corners_at(path, l, n);
    return is_uneven(path) ? uneven_corners(path, n, c, (int32_t[2]){ 0 }) : c;
}

/* Moves cells beyond a side of the grid to the nearest position in the grid. */
INLINE void move_inside(const pane_path *path, unsigned n, corners *c)
{
    for (int a = 0; a < 2; a++) {
        const int32_t base = path->base[a][n];
        const vi whole = vi_within(c->whole[a] - (path->cells[a][0] - base), 0,
                                   path->cells[a][1] - path->cells[a][0]) +
                         (path->cells[a][0] - base);
        c->part[a] = c->part[a] + v_from_int(c->whole[a] - whole);
        c->part[a] = v_min(v_max(c->part[a], v_set(0)), v_set(0x1.fffffep-1f));
        c->whole[a] = whole;
    }
}

/* The cells of the rays in the grid of rasters, for kernels of 64 voxels. The positions in a cell
 * are `part` along u and v, and `between` along the sheets. */
typedef struct wide_position {
    const trip_cpu_about *about;
    int32_t cell[2][V];
    float part[2][V], between;
} wide_position;

/* The samples of the rays at a sample plane. `index` is the entry of the transfer function's
 * integrals nearest to the code. With TRIP_CPU_CLOSED and with TRIP_CPU_BLURRED it is the biased
 * code times 2^WEIGHT_LOG2.
 * Gradients and sums are computed from the other fields on demand. */
typedef struct sample {
    vi index;
    vm there;            /* all corners are present */
    vi top, bottom;      /* weights of two corners, the right one's in the higher 16 bits */
    vi gradient_at;      /* offset of the first corner's gradient in the pool, in 16-bit numbers */
    vi gradient[3];      /* times 2^WEIGHT_LOG2 */
    vi deviation;        /* its code times 2^WEIGHT_LOG2 TRIP_CPU_DEVIATION_PARTS, if blurred */
    vi deviation_at;     /* offset of the first corner's deviation, if blurred */
    vi sums[4];          /* the integrals at the entry */
    vi cell[2];          /* in the grid of rasters; only with pane_segments.sparse */
    unsigned lit;        /* lanes with a valid `gradient` */
    bool summed;         /* `sums` is valid */
    int32_t near[2];     /* uneven spacing: start of the search in index_near() */
    wide_position *wide; /* kernels of 64 voxels: position of the sample */
} sample;

/* Computes the bilinear weights. Their sum is 2^WEIGHT_LOG2. */
INLINE void set_weights(const vf part[2], sample *s)
{
    vi u = v_truncate(v_fma(part[0], v_set(1 << WEIGHT_LOG2), v_set(0.5f)));
    vi v = v_truncate(part[1] * v_set(1 << 15)); /* below 2^15 */
    vi across = (u << 16) | ((1 << WEIGHT_LOG2) - u);
#if TRIP_SIMD == TRIP_SIMD_AVX2
    s->bottom = (vi)_mm256_mulhrs_epi16((__m256i)across, (__m256i)(v | v << 16));
    s->top = (vi)_mm256_sub_epi16((__m256i)across, (__m256i)s->bottom);
#elif TRIP_SIMD == TRIP_SIMD_AVX512
    s->bottom = (vi)_mm512_mulhrs_epi16((__m512i)across, (__m512i)(v | v << 16));
    s->top = (vi)_mm512_sub_epi16((__m512i)across, (__m512i)s->bottom);
#else
    vi right = (u * v + (1 << 14)) >> 15;
    vi left = (((1 << WEIGHT_LOG2) - u) * v + (1 << 14)) >> 15;
    s->bottom = (right << 16) | left;
    s->top = across - s->bottom; /* no borrow: no half of `bottom` is larger */
#endif
}

/* Returns the cells in the grid of rasters. Cells beyond it become the nearest cell. */
INLINE void find_cells(const trip_cpu_group *g, const pane_path *path, unsigned n, const corners *c,
                       vi whole[2])
{
    const int32_t size[2] = { g->across, g->down };
    for (int a = 0; a < 2; a++)
        whole[a] = vi_within(c->whole[a] + path->base[a][n], 0, size[a] * TRIP_CPU_RASTER - 1);
}

/* Returns the positions of cells in their rasters, in 16-bit numbers. */
INLINE vi position_in_raster(const vi whole[2])
{
    return (whole[1] & (TRIP_CPU_RASTER - 1)) * TRIP_CPU_RASTER_STRIDE +
           (whole[0] & (TRIP_CPU_RASTER - 1));
}

/* Returns the offsets of the cells' rasters in the pool, in 16-bit numbers. */
INLINE vi raster_starts(const trip_cpu_group *g, const int32_t *rasters, const vi whole[2])
{
    vi raster = (whole[1] >> TRIP_CPU_RASTER_LOG2) * g->across + (whole[0] >> TRIP_CPU_RASTER_LOG2);
    int32_t starts[V];
    vi_store(starts, raster);
    for (int i = 0; i < V; i++)
        starts[i] = rasters[starts[i]] * RASTER_NUMBERS;
    return vi_load(starts);
}

/* Returns the offset of a raster's deviations from the offset of its codes, in 16-bit numbers. */
INLINE int32_t deviations_from(int32_t raster)
{
    return raster / RASTER_NUMBERS * TRIP_CPU_RASTER_VOXELS;
}

/* Returns the offsets of the first corners' codes in the pool, in 16-bit numbers, and sets
 * gradient_at and deviation_at. With uneven spacing it also sets the weights. If `beyond`, rays may
 * be beyond a side of the grid. */
INLINE vi find_positions(const trip_cpu_group *g, const pane_path *path, const patch_path *area,
                         unsigned n, bool beyond, const corners *c, sample *s)
{
    if (area->raster[n] >= 0) {
        vi in = c->whole[1] * TRIP_CPU_RASTER_STRIDE + c->whole[0] + area->within[n];
        if (BLURRED)
            s->deviation_at = in + deviations_from(area->raster[n]);
        s->gradient_at = in * 3 + (area->raster[n] + GRADIENTS_FROM);
        return in + area->raster[n];
    }
    vi whole[2];
    if (is_uneven(path)) {
        corners uneven = uneven_corners(path, n, *c, s->near);
        if (beyond)
            move_inside(path, n, &uneven);
        set_weights(uneven.part, s);
        find_cells(g, path, n, &uneven, whole);
    } else {
        find_cells(g, path, n, c, whole);
    }
    vi in = position_in_raster(whole), from = raster_starts(g, g->samples[n].rasters, whole);
    for (int i = 0; i < V && BLURRED; i++)
        s->deviation_at[i] = in[i] + deviations_from(from[i]);
    s->gradient_at = from + (in * 3 + GRADIENTS_FROM);
    return from + in;
}

/* Returns sample.index for a biased code times 2^WEIGHT_LOG2. */
INLINE vi index_of(const trip_cpu_integrals *in, vi code)
{
    const int log2 = WEIGHT_LOG2 + in->entry_log2;
    if (TRIP_CPU_CLOSED || BLURRED)
        return code;
    return ((code + (1 << (log2 - 1))) >> log2) + (TRIP_CPU_CODE_BIAS >> in->entry_log2);
}

/* Moves a sample.index beyond the ends of the transfer function to the nearer end. */
INLINE vi within_ends(const trip_cpu_integrals *in, vi index)
{
    const vi zero = { 0 };
    const vi low = index_of(in, zero - TRIP_CPU_CODE_BIAS * (1 << WEIGHT_LOG2));
    const vi high = index_of(in, zero + in->end * (1 << WEIGHT_LOG2));
    return vi_lesser(vi_greater(index, low), high);
}

#include "cpu/kernels/corners_tmpl.h"

INLINE void sample_at(const trip_cpu_group *g, const trip_cpu_integrals *in, const pane_path *path,
                      const patch_path *area, const stamp_rays *l, unsigned n, bool beyond,
                      bool sparse, sample *s)
{
    corners c = corners_at(path, l, n);
    if (beyond && !is_uneven(path))
        move_inside(path, n, &c);
    set_weights(c.part, s);
    if (sparse)
        find_cells(g, path, n, &c, s->cell);
    find_codes(g, in, find_positions(g, path, area, n, beyond, &c, s), s);
    if (BLURRED)
        find_deviations(g, s);
    s->lit = 0;
    s->summed = false;
}

#include "cpu/kernels/wide_tmpl.h"

/* ---- a segment ---- */

/* The part of a segment that is not clipped. */
typedef struct remnant {
    vf from, to; /* positions in the segment, 0 to 1 */
    vm some;
} remnant;

#include "cpu/kernels/nearest_tmpl.h"

typedef struct medium {
    vf extinction; /* 0 if the segment is transparent */
    vf rgb[3];
} medium;

/* Replaces the sums by the transfer function's values where both ends have the same entry. */
INLINE void use_entries_alone(int32_t (*entries)[4], vi index, vm same, vi sums[4])
{
    vi at[4];
    find_rows(entries, index, at);
    for (int k = 0; k < 4; k++)
        sums[k] = (vi)v_select(same, (vf)at[k], (vf)sums[k]);
}

INLINE vm may_show(const trip_cpu_integrals *in, vi a, vi b)
{
    vi beyond = (vi)(vi_greater(a, b) < in->first) | (vi)(vi_lesser(a, b) > in->last);
    return vi_is_0(beyond);
}

INLINE void find_sums(const trip_cpu_integrals *in, sample *s)
{
    if (!s->summed)
        find_rows(in->sums, s->index, s->sums);
    s->summed = true;
}

INLINE medium classified(const trip_cpu_integrals *in, sample *a, sample *b)
{
    vi sums[4], entries = b->index - a->index;
    vm same = vi_is_0(entries);
    find_sums(in, a);
    find_sums(in, b);
    for (int k = 0; k < 4; k++)
        sums[k] = b->sums[k] - a->sums[k];
    vf over = v_from_int(entries);
    if (vm_any(same)) {
        use_entries_alone(in->at, a->index, same, sums);
        over = v_select(same, v_set(1), over);
    }
    vf extinction = v_from_int(sums[0]);
    vm some = v_gt(v_abs(extinction), v_set(0));
    medium s = { .extinction = v_set(0) };
    if (!vm_any(some))
        return s;
    extinction = v_select(some, extinction, v_set(1));
    /* One division serves both quotients. */
    vf inverse = v_set(1) / (extinction * over);
    vf per_extinction = inverse * over;
    for (int k = 0; k < 3; k++)
        s.rgb[k] = v_from_int(sums[k + 1]) * per_extinction;
    s.extinction =
        v_select(some, extinction * (inverse * extinction) * v_set(in->extinction), v_set(0));
    return s;
}

/* Returns the entries of rows nearest to a biased code times 2^WEIGHT_LOG2. */
INLINE vi entries_of(const vi row[4], vi code)
{
    const vi bias = (vi){ 0 } + TRIP_CPU_CODE_BIAS;
    return row[0] + ((code + row[2]) >> (row[1] + WEIGHT_LOG2)) + (bias >> row[1]);
}

/* Adds the means of rows over a segment from code a to code b, weighted by `share`: extinction, and
 * extinction times each colour. */
INLINE void add_row(const trip_cpu_blurred *f, vi number, vf share, vi a, vi b, vf means[4])
{
    vi row[4], first[4], last[4];
    find_rows((int32_t(*)[4])(uintptr_t)f->rows, number, row);
    const vi from = entries_of(row, a), to = entries_of(row, b), entries = to - from;
    const vm same = vi_is_0(entries);
    vf over = v_from_int(entries);
    find_rows(f->sums, from, first);
    find_rows(f->sums, to, last);
    for (int k = 0; k < 4; k++)
        last[k] = last[k] - first[k];
    if (vm_any(same)) {
        use_entries_alone(f->at, from, same, last);
        over = v_select(same, v_set(1), over);
    }
    const vf unit = share * ((vf)row[3] / over);
    for (int k = 0; k < 4; k++)
        means[k] = v_fma(unit, v_from_int(last[k]), means[k]);
}

INLINE vf eighth_power(vf a)
{
    const vf a2 = a * a, a4 = a2 * a2;
    return a4 * a4;
}

/* Classifies a segment by the blurred function, with the mean deviation of samples a and b. The
 * ends of the segment are `first` and `last`. A row without weight adds exactly nothing. */
INLINE medium classified_blurred(const trip_cpu_blurred *f, vm open, const sample *a,
                                 const sample *b, const sample *first, const sample *last)
{
    const float rows = TRIP_CPU_BLURRED_ROWS - 1 + TRIP_CPU_BLURRED_BEFORE;
    const float unit = 1 / (2.0f * 255 * TRIP_CPU_DEVIATION_PARTS * (1 << WEIGHT_LOG2));
    const vf none = v_set(0), one = v_set(1);
    vf d = v_from_int(a->deviation + b->deviation) * v_set(unit);
    d = v_select(open, v_min(v_max(d, none), one), none);
    /* The row before d, and the share of the next one by variances. These are d to the power of 4,
     * and the square root of d is linear in the row. */
    const vf beyond = v_sqrt(d) * v_set(rows) - v_set(TRIP_CPU_BLURRED_BEFORE);
    const vi row =
        vi_lesser(v_truncate(v_max(beyond, none)), (vi){ 0 } + (TRIP_CPU_BLURRED_ROWS - 2));
    const vf first_part = (v_from_int(row) + v_set(TRIP_CPU_BLURRED_BEFORE)) * v_set(1 / rows);
    const vf before = v_select(v_gt(one, v_from_int(row)), none, eighth_power(first_part));
    const vf behind = eighth_power(first_part + v_set(1 / rows));
    const vf share = v_min(v_max((d * d * (d * d) - before) / (behind - before), none), one);
    const vi from = (vi)v_select(open, (vf)first->index, none);
    const vi to = (vi)v_select(open, (vf)last->index, none);
    vf means[4] = { none, none, none, none };
    add_row(f, row, one - share, from, to, means);
    if (vm_any(v_gt(share, none)))
        add_row(f, row + 1, share, from, to, means);
    const vm some = v_gt(means[0], none);
    const vf inverse = one / v_select(some, means[0], one);
    medium s = { .extinction = v_select(some, means[0], none) };
    for (int k = 0; k < 3; k++)
        s.rgb[k] = means[1 + k] * inverse;
    return s;
}

/* Classifies a segment in closed form. `open` are the lanes that matter. */
INLINE medium classified_closed(const trip_cpu_closed_form *f, vm open, const sample *a,
                                const sample *b)
{
    const vf none = v_set(0), scale = v_set(f->scale), offset = v_set(f->offset);
    const vf from = v_fma(v_from_int(a->index), scale, offset);
    const vf to = v_fma(v_from_int(b->index), scale, offset);
    const vf x = v_max(from, none), y = v_max(to, none), d = y - x;
    const vf m = v_set(0.5f) * (x + y), dd = d * d * v_set(1.0f / 12);
    vf k = v_fma(v_fma(v_set(f->k[3]), m, v_set(f->k[2])), m, v_set(f->k[1]));
    k = v_fma(k, m, v_set(f->k[0]));
    k = v_fma(v_fma(v_set(3 * f->k[3]), m, v_set(f->k[2])), dd, k);
    medium s = { .extinction = k };
    vf at = none;
    if (f->coloured) {
        vf slope = v_fma(v_fma(v_set(3 * f->k[3]), m, v_set(2 * f->k[2])), m, v_set(f->k[1]));
        slope = v_fma(v_set(1.8f * f->k[3]), dd, slope);
        at = v_fma(dd, slope / v_max(k, v_set(1e-20f)), m); /* v_max: keeps it finite */
    }
    for (int i = 0; i < 3; i++)
        s.rgb[i] = f->coloured ? v_fma(at, v_set(f->q1[i]), v_set(f->q0[i])) : v_set(f->q0[i]);
    if (!f->ramp)
        return s;
    s.extinction = v_select(v_gt(v_max(from, to), v_set(f->min)), k, none);
    const vm cut = vm_and(open, v_gt(none, v_min(from, to)));
    if (vm_any(cut)) {
        const vf whole = v_select(v_gt(v_abs(to - from), none), to - from, v_set(1));
        s.extinction = v_select(cut, s.extinction * d / whole, s.extinction);
    }
    return s;
}

INLINE medium classified_within(const trip_cpu_sheet_view *view, vm open, const sample *a,
                                const sample *b, sample *first, sample *last)
{
    return BLURRED           ? classified_blurred(view->blurred, open, a, b, first, last)
           : TRIP_CPU_CLOSED ? classified_closed(&view->integrals->closed, open, first, last)
                             : classified(view->integrals, first, last);
}

/* Adds a part of the segment, with a medium of its own. */
INLINE void add_medium(const medium *part, vf share, medium *sum)
{
    const vf none = v_set(0), k = share * part->extinction;
    for (int i = 0; i < 3; i++)
        sum->rgb[i] = v_fma(k, v_select(v_gt(k, none), part->rgb[i], none), sum->rgb[i]);
    sum->extinction = sum->extinction + k;
}

/* Classifies a segment with codes that may lie beyond the ends of the transfer function, where it
 * is constant. Kernels of 64 voxels overshoot the codes of voxels. The result for a ray does not
 * depend on the rays beside it. */
static medium classified_beyond(const trip_cpu_sheet_view *view, vm open, const sample *a,
                                const sample *b, sample *first, sample *last)
{
    const vi zero = { 0 }, lesser = vi_lesser(first->index, last->index);
    const vi greater = vi_greater(first->index, last->index);
    const vi from = within_ends(view->integrals, lesser);
    const vi to = within_ends(view->integrals, greater);
    const vf none = v_set(0), one = v_set(1), all = v_from_int(greater - lesser);
    const vm beyond = v_gt(v_abs(v_from_int((from - lesser) | (greater - to))), none);
    if (!vm_any(beyond))
        return classified_within(view, open, a, b, first, last);
    sample ends[4] = { { .index = within_ends(view->integrals, first->index) },
                       { .index = within_ends(view->integrals, last->index) },
                       { .index = from },
                       { .index = to } };
    const vf unit = one / v_select(v_gt(all, none), all, one);
    const vi below = vi_greater(vi_lesser(greater, from) - lesser, zero);
    const vi above = vi_greater(greater - vi_greater(lesser, to), zero);
    medium s = classified_within(view, open, a, b, &ends[0], &ends[1]);
    const medium low = classified_within(view, open, a, b, &ends[2], &ends[2]);
    const medium high = classified_within(view, open, a, b, &ends[3], &ends[3]);
    medium sum = { .extinction = none, .rgb = { none, none, none } };
    add_medium(&s, v_from_int(to - from) * unit, &sum);
    add_medium(&low, v_from_int(below) * unit, &sum);
    add_medium(&high, v_from_int(above) * unit, &sum);
    const vm parts = vm_and(beyond, v_gt(all, none));
    for (int i = 0; i < 3; i++)
        s.rgb[i] = v_select(parts, sum.rgb[i] / v_max(sum.extinction, v_set(1e-30f)), s.rgb[i]);
    s.extinction = v_select(parts, sum.extinction, s.extinction);
    return s;
}

/* Looks up the box of a voxel. Lanes that are not open may have any index. */
INLINE medium classified_nearest(const trip_cpu_sheet_view *view, vm open, const sample *a)
{
    const vi zero = { 0 };
    vi row[4];
    static_assert(sizeof *view->table == 4 * sizeof(float), "a row of four floats");
    find_rows((int32_t(*)[4])(uintptr_t)view->table, (vi)v_select(open, (vf)a->index, (vf)zero),
              row);
    return (medium){ .extinction = (vf)row[3] * v_set(view->voxel_world),
                     .rgb = { (vf)row[0], (vf)row[1], (vf)row[2] } };
}

INLINE vf dot3(const vf a[3], const vf b[3])
{
    return v_fma(a[0], b[0], v_fma(a[1], b[1], a[2] * b[2]));
}

INLINE void set_unit(vf v[3])
{
    vf inverse = v_set(1) / v_sqrt(v_max(dot3(v, v), v_set(1e-30f)));
    for (int k = 0; k < 3; k++)
        v[k] = v[k] * inverse;
}

INLINE void set_half(light_way *way, const vf to_eye[3])
{
    for (int k = 0; k < 3; k++)
        way->half[k] = way->light[k] + to_eye[k];
    set_unit(way->half);
}

/* Computes the direction from a position in the list to a point light. It is not inlined, so that
 * frames without a point light do not pay for it. */
static __attribute__((noinline)) void find_way(const trip_cpu_sheet_view *view, const vf at[3],
                                               const vf to_eye[3], light_way *way)
{
    vf d[3];
    for (int a = 0; a < 3; a++)
        d[a] = v_set(view->light[a]) - at[a];
    for (int k = 0; k < 3; k++)
        way->light[k] = v_fma(
            d[0], v_set((float)view->world[k][0]),
            v_fma(d[1], v_set((float)view->world[k][1]), d[2] * v_set((float)view->world[k][2])));
    set_unit(way->light);
    set_half(way, to_eye);
}

/* Mirrors trip_light_on() for the mean of the gradients at both ends. */
INLINE surface surface_between(const trip_cpu_sheet_view *view, const pane_path *path,
                               const stamp_rays *l, const light_way *way, const sample *a,
                               const sample *b)
{
    vf g[3], n[3];
    for (int k = 0; k < 3; k++) /* twice the mean */
        g[k] = v_from_int(a->gradient[k] + b->gradient[k]);
    for (int k = 0; k < 3; k++)
        n[k] = v_fma(g[0], v_set(path->gradient[k][0]),
                     v_fma(g[1], v_set(path->gradient[k][1]), g[2] * v_set(path->gradient[k][2])));
    vf length2 = dot3(n, n);
    vf length = v_sqrt(length2);
    vm lit = v_gt(length2, v_set(1e-20f));
    vf strength = v_select(lit, v_min(length, v_set(1)), v_set(0));
    vf inverse = v_set(1) / v_select(lit, length, v_set(1));
    vf to_light = dot3(n, way->light) * inverse;
    vf to_half = to_light, facing = to_light * to_light;
    if (!view->headlight) {
        to_half = dot3(n, way->half) * inverse;
        facing = to_light * dot3(n, l->to_eye) * inverse;
    }
    facing = v_min(v_set(1), v_max(v_set(0), facing * v_set((float)TRIP_FACING)));
    static_assert((int)TRIP_SHININESS == 24, "the powers below");
    vf p2 = to_half * to_half, p4 = p2 * p2, p8 = p4 * p4;
    return (surface){
        .strength = strength,
        .diffuse = v_abs(to_light),
        .gloss = strength * v_set((float)TRIP_SPECULAR) * p8 * p8 * p8 * facing,
        .normal = { n[0] * inverse, n[1] * inverse, n[2] * inverse },
    };
}

/* Mirrors trip_shade(). */
INLINE void light_segment(const surface *lit, medium *s)
{
    vf matt =
        v_fma(v_fma(lit->diffuse, v_set((float)TRIP_DIFFUSE), v_set((float)(TRIP_AMBIENT - 1))),
              lit->strength, v_set(1));
    for (int k = 0; k < 3; k++)
        s->rgb[k] = v_min(v_set(1), v_max(v_set(0), v_fma(s->rgb[k], matt, lit->gloss)));
}

INLINE vf ray_depth(const stamp_rays *l, vf along)
{
    return v_fma(along, l->depth, l->depth_at_start);
}

#define ALL_LANES UINT32_MAX

/* Makes the squares of open rays at a sample plane, and finds the rays' gradients. */
static void find_sparse_gradients(const trip_cpu_group *g, unsigned n, vm open, sample *s)
{
    const trip_cpu_making *m = g->samples[n].making;
    int32_t cells[2][V];
    cell_box box = { { INT32_MAX, INT32_MAX }, { 0, 0 } };
    for (int a = 0; a < 2; a++)
        vi_store(cells[a], s->cell[a]);
    for (unsigned rest = vm_bits(open); rest; rest &= rest - 1)
        for (int a = 0; a < 2; a++) {
            const int32_t cell = cells[a][__builtin_ctz(rest)];
            box.lo[a] = lesser_of(box.lo[a], cell);
            box.hi[a] = greater_of(box.hi[a], cell);
        }
    make_gradients_of_box(g, m, box);
    /* Another thread may be making the squares of the other rays. These rays read the gradient of
     * the missing raster. */
    const vi none = { 0 };
    find_gradients(g, (vi)v_select(open, (vf)s->gradient_at, (vf)none), s);
    s->lit = vm_bits(open);
}

/* Finds the gradients of open rays at a sample plane. If `sparse`, they are made first. */
INLINE void find_light(const trip_cpu_sheet_view *view, const trip_cpu_group *g, unsigned n,
                       bool sparse, vm open, sample *s)
{
    if (sparse) {
        if (vm_bits(open) & ~s->lit)
            find_sparse_gradients(g, n, open, s);
        return;
    }
    if (!s->lit && NEAREST)
        find_nearest_gradients(g, s);
    else if (!s->lit && is_wide(g))
        find_wide_gradients(view, g, s);
    else if (!s->lit)
        find_gradients(g, s->gradient_at, s);
    s->lit = ALL_LANES;
}

INLINE remnant remnant_of(const trip_cpu_sheet_view *view, const stamp_rays *l,
                          const pane_path *path, unsigned n)
{
    const float from = (float)view->direction * path->middle[n];
    const vf inverse = v_set(1 / path->sheets[n]), zero = v_set(0), one = v_set(1);
    const vf first = v_min(one, v_max(zero, (l->from - v_set(from)) * inverse));
    const vf last = v_min(one, v_max(zero, (l->to - v_set(from)) * inverse));
    return (remnant){ first, last, v_gt(last, first) };
}

/* Cuts the rest of segment n at the sides of the grid. */
static remnant within_sides(const pane_path *path, const stamp_rays *l, unsigned n, remnant r)
{
    const vf zero = v_set(0), one = v_set(1);
    for (int a = 0; a < 2; a++) {
        const int32_t base = path->base[a][n];
        const vf at =
            v_fma(l->slope[a], v_set(path->along[n]), v_set(path->first[a][n]) + l->shift[a]);
        const vf end = v_fma(l->slope[a], v_set(path->along[n + 1]),
                             v_set(path->first[a][n + 1]) + l->shift[a]);
        const vf way = (end - at) + v_set((float)(path->base[a][n + 1] - base));
        const vf lo = v_set((float)(path->sides[a][0] - base));
        const vf hi = v_set((float)(path->sides[a][1] - base));
        const vm moves = v_gt(v_abs(way), v_set(1e-12f));
        const vf inverse = one / v_select(moves, way, one);
        const vf one_side = (lo - at) * inverse, other = (hi - at) * inverse;
        const vf inside = v_select(v_ge(at, lo), v_select(v_ge(hi, at), one, zero), zero);
        r.from = v_select(moves, v_max(r.from, v_min(one_side, other)), r.from);
        r.to = v_select(moves, v_min(r.to, v_max(one_side, other)), r.to * inside);
    }
    r.some = vm_and(r.some, v_gt(r.to, r.from));
    r.from = v_min(r.from, one); /* rays beside the grid still look up a code */
    r.to = v_max(r.to, zero);
    return r;
}

/* Computes the sample at a position between a (0) and b (1), with linear codes. */
INLINE void cut_sample(const sample *a, const sample *b, vf share, sample *out)
{
    vf code = v_fma(share, v_from_int(b->index - a->index), v_from_int(a->index));
    out->index = v_truncate(code + v_set(0.5f));
    out->summed = false;
}

/* Cuts a segment at the sides of the grid. Rays that are inside at both ends keep them exactly. */
static void cut_ends(const sample *a, const sample *b, const remnant *r, sample out[2])
{
    cut_sample(a, b, r->from, &out[0]);
    cut_sample(a, b, r->to, &out[1]);
    out[0].index = (vi)v_select(v_gt(r->from, v_set(0)), (vf)out[0].index, (vf)a->index);
    out[1].index = (vi)v_select(v_gt(v_set(1), r->to), (vf)out[1].index, (vf)b->index);
}

/* Computes the rays' positions `further` sheets beyond sample plane n, in the list's voxels. With
 * uneven spacing the units are positions of trip_coordinates. */
INLINE void positions_at(const trip_cpu_group *g, const pane_path *path, const stamp_rays *l,
                         unsigned n, vf further, vf at[3])
{
    const int64_t origin[2] = { is_uneven(path) ? 0 : g->first_u,
                                is_uneven(path) ? 0 : g->first_v };
    for (int a = 0; a < 2; a++) {
        float first = (float)(path->base[a][n] + origin[a]) + path->first[a][n];
        vf slope = l->slope[a] + v_set((float)path->slope[a]);
        at[a] = v_fma(l->slope[a], v_set(path->along[n]), v_set(first) + l->shift[a]);
        at[a] = v_fma(slope, further, at[a]);
    }
    at[2] = v_set((float)g->samples[n].coordinate) + further;
}

/* Composites a segment behind the pixels' contents. If `beyond`, rays may be beyond a side of the
 * grid. With the nearest value only the part `box` of the segment counts. Returns false if the
 * segment is visible in none of the pixels. */
INLINE bool composite_segment(const trip_cpu_sheet_view *view, const trip_cpu_group *g,
                              const stamp_rays *l, const pane_path *path, unsigned n, bool beyond,
                              bool sparse, sample *a, sample *b, const remnant *box,
                              vf pixel[CHANNELS])
{
    vm open = vm_and(vm_and(a->there, b->there), v_gt(pixel[3], v_set(0)));
    open = vm_and(open, TRIP_CPU_CLOSED || NEAREST || BLURRED ? l->along
                        : is_wide(g)
                            ? vm_and(l->along, may_show(view->integrals,
                                                        within_ends(view->integrals, a->index),
                                                        within_ends(view->integrals, b->index)))
                            : vm_and(l->along, may_show(view->integrals, a->index, b->index)));
    if (view->ortho) /* leaves out segments that begin behind the eye's plane */
        open = vm_and(open, v_ge(ray_depth(l, v_set(path->along[n])), v_set(0)));
    vf sheets = v_set(path->sheets[n]);
    vf middle = v_set(0.5f * (path->along[n] + path->along[n + 1]));
    sample cut[2], *first = a, *last = b;
    if (NEAREST) {
        const remnant r = *box;
        open = vm_and(open, r.some);
        middle =
            v_set(path->along[n]) + v_set(0.5f * (float)view->direction) * (r.from + r.to) * sheets;
        sheets = sheets * (r.to - r.from);
    } else if (view->clips > 0 || beyond) {
        remnant r = { v_set(0), v_set(1), open };
        if (view->clips > 0)
            r = remnant_of(view, l, path, n);
        if (beyond)
            r = within_sides(path, l, n, r);
        open = vm_and(open, r.some);
        first = &cut[0];
        last = &cut[1];
        if (view->clips > 0) {
            cut_sample(a, b, r.from, first);
            cut_sample(a, b, r.to, last);
        } else {
            cut_ends(a, b, &r, cut);
        }
        const vm whole = vm_and(v_ge(v_set(0), r.from), v_ge(r.to, v_set(1)));
        const vf centre =
            v_set(path->along[n]) + v_set(0.5f * (float)view->direction) * (r.from + r.to) * sheets;
        middle = view->clips > 0 ? centre : v_select(whole, middle, centre);
        sheets = sheets * (r.to - r.from);
    }
    if (!vm_any(open))
        return false;
    medium s = NEAREST      ? classified_nearest(view, open, first)
               : is_wide(g) ? classified_beyond(view, open, a, b, first, last)
                            : classified_within(view, open, a, b, first, last);
    for (int k = 0; k < 3 && view->has_debug_colour; k++)
        s.rgb[k] = v_set(view->debug_colour[k]);
    open = vm_and(open, v_gt(s.extinction, v_set(0)));
    if (!vm_any(open))
        return false;
    surface lit = { .strength = v_set(0), .gloss = v_set(0) };
    light_way of_position;
    const light_way *way = &l->way;
    vf at[3];
    const bool effects = TRIP_CPU_EFFECTS || ((NEAREST || BLURRED) && view->effects.some);
    if (effects || view->point_light)
        positions_at(g, path, l, n, middle - v_set(path->along[n]), at);
    if (view->point_light) {
        find_way(view, at, l->to_eye, &of_position);
        way = &of_position;
    }
    if (view->shading) {
        if (NEAREST)
            forget_closed(a, open);
        find_light(view, g, n, sparse, open, a);
        find_light(view, g, n + 1, sparse, open, b);
        lit = surface_between(view, path, l, way, a, b);
    }
    if (effects) {
        effects_on(&view->effects, at, &lit, way->light, l->to_eye, s.rgb);
    } else if (view->shading) {
        light_segment(&lit, &s);
    }
    vf opacity = v_set(1) - exp_of_minus(s.extinction * l->length * sheets);
    vf add = v_select(open, opacity * pixel[3], v_set(0));
    for (int k = 0; k < 3; k++)
        pixel[k] = v_fma(add, s.rgb[k], pixel[k]);
    if (TRIP_CPU_DEPTH) {
        vf z = ray_depth(l, middle);
        pixel[CHANNELS - 1] = v_fma(add, z, pixel[CHANNELS - 1]);
    }
    pixel[3] = pixel[3] - add;
    return true;
}

/* Ends pixels with a transmittance below early_termination. Divides their colour by their opacity
 * and makes them opaque (sheet.h). */
INLINE void finish_terminated(const trip_cpu_sheet_view *view, vf pixel[CHANNELS])
{
    vm terminated =
        vm_and(v_gt(v_set(view->early_termination), pixel[3]), v_gt(pixel[3], v_set(0)));
    if (!vm_any(terminated))
        return;
    vf whole = v_set(1) / (v_set(1) - pixel[3]);
    for (int k = 0; k < CHANNELS; k++)
        if (k != 3)
            pixel[k] = v_select(terminated, pixel[k] * whole, pixel[k]);
    pixel[3] = v_select(terminated, v_set(0), pixel[3]);
}

/* ---- stamps ---- */

INLINE void set_light(const trip_cpu_sheet_view *view, stamp_rays *l)
{
    for (int k = 0; k < 3; k++)
        l->way.light[k] = view->headlight ? l->to_eye[k] : v_set(view->light[k]);
    if (!view->headlight) /* with a headlight, `half` is not used */
        set_half(&l->way, l->to_eye);
}

INLINE vf form_of(const float form[3], vf x, vf y)
{
    return v_fma(x, v_set(form[1]), v_fma(y, v_set(form[2]), v_set(form[0])));
}

INLINE void clip_rays(const trip_cpu_sheet_view *view, const pane_path *path, vf x, vf y,
                      stamp_rays *l)
{
    const vf zero = v_set(0), never = v_set(0x1p100f);
    l->from = zero - never;
    l->to = never;
    for (int n = 0; n < view->clips; n++) {
        vf at = form_of(path->clip_at[n], x, y), by = form_of(path->clip_toward[n], x, y);
        vm in = v_gt(by, zero), out = v_gt(zero, by);
        vf where = (zero - at) / v_select(in, by, v_select(out, by, v_set(1)));
        l->from = v_select(in, v_max(l->from, where), l->from);
        l->to = v_select(out, v_min(l->to, where), l->to);
        vf beside = v_select(in, zero, v_select(out, zero, at)); /* rays parallel to the plane */
        l->from = v_select(v_gt(zero, beside), never, l->from);
    }
}

static void find_rays(const trip_cpu_sheet_view *view, const pane_path *path, unsigned number,
                      stamp_rays *l)
{
    const vf x = stamp_x(number), y = stamp_y(number), none = v_set(0);
    const vf max = v_set((float)view->steepest * (1 + 1e-6f));
    vf toward = form_of(path->toward, x, y);
    l->along = v_gt(toward * v_set((float)view->direction), none);
    toward = v_select(l->along, toward, v_set((float)view->direction));
    vf inverse = v_set(1) / toward;
    for (int a = 0; a < 2; a++) {
        const float *form = path->aside[a];
        vf beside = v_fma(x, v_set(form[1]), y * v_set(form[2])), first = v_set(form[0]);
        l->slope[a] = (view->ortho ? first : first + beside) * inverse;
        l->shift[a] = view->ortho ? beside : none;
        vf slope = l->slope[a] + v_set((float)path->slope[a]);
        l->along = vm_and(l->along, v_ge(max, v_abs(slope)));
    }
    for (int k = 0; k < 3; k++)
        l->to_eye[k] = none - form_of(path->world[k], x, y);
    l->length = v_sqrt(dot3(l->to_eye, l->to_eye)) * v_abs(inverse) * v_set(path->world_length);
    l->depth = inverse * v_set(path->depth);
    l->depth_at_start = none; /* perspective: rays start at the eye, at depth 0 */
    if (view->ortho) {
        l->depth_at_start = none - form_of(path->sheet, x, y) * l->depth;
        for (int k = 0; k < 3; k++)
            l->to_eye[k] = v_set(view->to_eye[k]);
    }
    set_unit(l->to_eye);
    set_light(view, l);
    clip_rays(view, path, x, y, l);
}

/* Returns the rays with a cell in the group's window at the first sample plane. */
INLINE vm in_window(const trip_cpu_group *g, const pane_path *path, const stamp_rays *l)
{
    corners c = cells_at(path, l, 0);
    vm in = l->along;
    for (int a = 0; a < 2; a++) {
        vf at = v_from_int(c.whole[a] + path->base[a][0]);
        in = vm_and(in, v_ge(at, v_set((float)g->lo[a])));
        in = vm_and(in, v_gt(v_set((float)g->hi[a]), at));
    }
    return in;
}

/* Composites a segment with the nearest value, box by box. */
INLINE void composite_boxes(const trip_cpu_sheet_view *view, const trip_cpu_group *g,
                            const stamp_rays *l, const pane_path *path, const patch_path *area,
                            unsigned n, vf pixel[CHANNELS])
{
    const remnant whole = { v_set(0), v_set(1), l->along };
    box_walk w =
        begin_boxes(view, g, path, l, n, view->clips > 0 ? remnant_of(view, l, path, n) : whole);
    while (vm_any(vm_and(w.part.some, v_gt(pixel[3], v_set(0))))) {
        remnant box = next_box(path, n, &w);
        sample s;
        nearest_at(view, g, path, area, n, &w, &box, &s);
        if (composite_segment(view, g, l, path, n, false, false, &s, &s, &box, pixel))
            finish_terminated(view, pixel);
    }
}

/* Makes the voxels that rays of segment n read: for the patch if rays are sparse, otherwise for the
 * pane. */
INLINE void make_for_rays(const trip_cpu_group *g, bool sparse, bool gradients,
                          pane_segments *passed, patch_path *area, unsigned n)
{
    uint64_t *made = sparse ? &area->made : &passed->made;
    if (*made >> n & 1)
        return;
    make_segment(g, gradients && !sparse, box_of_segment(sparse ? &area->boxes : &passed->boxes, n),
                 n);
    *made |= UINT64_C(1) << n;
}

INLINE void draw_stamp(const trip_cpu_sheet_view *view, const trip_cpu_group *g,
                       const pane_path *path, bool sparse, pane_segments *passed, patch_path *area,
                       const stamp_rays *l, float *stamp)
{
    uint64_t segments = area->segments;
    vf pixel[CHANNELS];
    sample ends[2];
    wide_position positions[2];
    unsigned sampled = UINT32_MAX; /* the sample plane sampled in ends[sampled % 2] */
    for (int k = 0; k < CHANNELS; k++)
        pixel[k] = v_load(stamp + k * V);
    for (int i = 0; i < 4 && is_uneven(path); i++)
        ends[i / 2].near[i % 2] = 0;
    for (int i = 0; i < 2 && is_wide(g); i++)
        ends[i].wide = &positions[i];
    for (; segments; segments &= segments - 1) {
        unsigned n = (unsigned)__builtin_ctzll(segments), next = n + 1;
        const bool beyond = area->beyond >> n & 1;
        make_for_rays(g, sparse, view->shading, passed, area, n);
        if (NEAREST) {
            composite_boxes(view, g, l, path, area, n, pixel);
        } else if (is_wide(g)) {
            if (sampled != n || !in_the_same_cells(g, n, &ends[n % 2]))
                wide_sample_at(view, g, path, l, n, n, &ends[n % 2]);
            wide_sample_at(view, g, path, l, next, n, &ends[next % 2]);
        } else {
            if (sampled != n)
                sample_at(g, view->integrals, path, area, l, n, beyond, sparse, &ends[n % 2]);
            sample_at(g, view->integrals, path, area, l, next, beyond, sparse, &ends[next % 2]);
        }
        sampled = next;
        if (!NEAREST && !composite_segment(view, g, l, path, n, beyond, sparse, &ends[n % 2],
                                           &ends[next % 2], NULL, pixel))
            continue;
        finish_terminated(view, pixel);
        if (!vm_any(v_gt(pixel[3], v_set(0))))
            break;
    }
    for (int k = 0; k < CHANNELS; k++)
        v_store(stamp + k * V, pixel[k]);
}

INLINE bool stamp_is_open(const float *stamp)
{
    return vm_any(v_gt(v_load(stamp + 3 * V), v_set(0)));
}

enum { PATCH_STAMPS = 2 * 8 / STAMP_ROWS };

/* Returns the pane's number of stamp i of the patch at `position`. */
INLINE unsigned patch_stamp(unsigned position, unsigned i)
{
    return (position / 4 * (8 / STAMP_ROWS) + i / 2) * STAMPS_ACROSS + position % 4 * 2 + i % 2;
}

INLINE void draw_patch(const trip_cpu_sheet_view *view, const trip_cpu_group *g,
                       const pane_path *path, bool sparse, pane_segments *passed, int x, int y,
                       unsigned position, float *pixels)
{
    bool open = false;
    for (unsigned i = 0; i < PATCH_STAMPS; i++)
        open |= stamp_is_open(pixels + STAMP_FLOATS * patch_stamp(position, i));
    if (!open)
        return;
    patch_path area;
    find_patch(view, g, path, passed->some, x + (int)(position % 4) * 8,
               y + (int)(position / 4) * 8, &area);
    if (!area.segments)
        return;
    if (sparse)
        move_boxes_inside(g, path, &area.boxes);
    for (unsigned i = 0; i < PATCH_STAMPS; i++) {
        unsigned number = patch_stamp(position, i);
        float *stamp = pixels + STAMP_FLOATS * number;
        if (!stamp_is_open(stamp))
            continue;
        stamp_rays l;
        find_rays(view, path, number, &l);
        if (g->windowed)
            l.along = in_window(g, path, &l);
        if (vm_any(l.along))
            draw_stamp(view, g, path, sparse, passed, &area, &l, stamp);
    }
}

/* Draws the patches of a pane. Dense rays have a function of their own, so that they cost no extra
 * instruction. */
static void draw_patches(const trip_cpu_sheet_view *view, const trip_cpu_group *g,
                         const pane_path *path, pane_segments *passed, int x, int y, float *pixels)
{
    for (unsigned position = 0; position < TRIP_CPU_PANE_PIXELS / 64; position++)
        draw_patch(view, g, path, false, passed, x, y, position, pixels);
}

static void draw_sparse_patches(const trip_cpu_sheet_view *view, const trip_cpu_group *g,
                                const pane_path *path, pane_segments *passed, int x, int y,
                                float *pixels)
{
    for (unsigned position = 0; position < TRIP_CPU_PANE_PIXELS / 64; position++)
        draw_patch(view, g, path, true, passed, x, y, position, pixels);
}

static uint64_t sheet_pane(const trip_cpu_sheet_view *view, const trip_cpu_group *g, int x, int y,
                           float *pixels)
{
    pane_path path = { .base = { { 0 } } };
    uint64_t open = 0;
    find_path(view, g, x, y, &path);
    pane_segments passed;
    find_segments(view, g, &path, x, y, &passed);
    if (passed.some)
        (!NEAREST && passed.sparse ? draw_sparse_patches : draw_patches)(view, g, &path, &passed, x,
                                                                         y, pixels);
    for (unsigned i = 0; i < STAMPS; i++)
        if (stamp_is_open(pixels + STAMP_FLOATS * i))
            open |= UINT64_C(1) << (i / STAMPS_ACROSS * STAMP_ROWS / 4 * 8 + i % STAMPS_ACROSS);
    return open;
}

#endif
