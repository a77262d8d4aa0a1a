#include "cpu/sheets/cpu_sheets_state.h"

#include <math.h>
#include <string.h>

#include "sheet.h"

/* Number of sheets for which open squares are found at once. Rays move sideways between sheets, so
 * more sheets open more squares. */
enum { SHEETS = 8 };

/* Edge of a texel in pixels, and of a pane in texels. */
enum { TEXEL = 4, ACROSS = TRIP_CPU_PANE / TEXEL };

/* A bound of the error of ray positions in single precision. */
#define SLACK_VOXELS 0.125

/* A range of sheets along the list's axis, with the sheets about them that interpolation reads.
 * `ends` holds the distances of both ends from the start of the rays, in any order. */
typedef struct extent {
    double ends[2];
    int reach;
} extent;

/* A rectangle of positions along u and v. */
typedef struct bounds {
    double min[2], max[2];
} bounds;

static void include(bounds *b, int a, double at)
{
    b->min[a] = at < b->min[a] ? at : b->min[a];
    b->max[a] = at > b->max[a] ? at : b->max[a];
}

/* The rays at the corners of a pane's texels. */
enum { CORNERS = ACROSS + 1 };
typedef struct pane_rays {
    bool along[CORNERS * CORNERS];      /* the ray goes in the direction of the pass */
    double at[2][2][CORNERS * CORNERS]; /* [end][u, v]: positions at both ends */
} pane_rays;

/* Finds the ray of corner i, at pixel position (x, y). Slopes are limited to view->steepest,
 * because steeper rays are not drawn. */
static void find_ray(const trip_cpu_sheet_view *view, const extent *e, double x, double y, int i,
                     pane_rays *rays)
{
    double beside[3], r[3];
    for (int k = 0; k < 3; k++) {
        beside[k] = x * view->rx[k] + y * view->ry[k];
        r[k] = view->r0[k] + (view->ortho ? 0 : beside[k]);
    }
    rays->along[i] = r[2] * view->direction > 0;
    if (!rays->along[i])
        return;
    const double inverse = 1 / r[2], max = view->steepest;
    for (int a = 0; a < 2; a++) {
        double start = view->eye[a], slope = r[a] * inverse;
        slope = slope < -max ? -max : slope > max ? max : slope;
        if (view->ortho) /* position at sheet 0 */
            start += beside[a] - (view->eye[2] + beside[2]) * slope;
        for (int end = 0; end < 2; end++)
            rays->at[end][a][i] = start + e->ends[end] * slope;
    }
}

static void open_row(trip_cpu_store *s, int64_t v, int64_t first, int64_t last)
{
    uint64_t *row = s->open + (v >> 3) * s->across;
    for (int64_t u = first; u <= last;) {
        const int64_t end = last < (u | 7) ? last : u | 7; /* last square of the raster */
        row[u >> 3] |= ((UINT64_C(2) << (end - u)) - 1) << ((v & 7) * 8 + (u & 7));
        u = end + 1;
    }
}

/* Opens all squares with voxels that rays within the bounds may read. */
static void open_squares(trip_cpu_store *s, const bounds *b, int reach)
{
    const int64_t origin[2] = { s->first_u * TRIP_CPU_RASTER, s->first_v * TRIP_CPU_RASTER };
    const int64_t size[2] = { (int64_t)s->across * TRIP_CPU_RASTER,
                              (int64_t)s->down * TRIP_CPU_RASTER };
    int64_t first[2], last[2];
    for (int a = 0; a < 2; a++) {
        const double lo = b->min[a] - SLACK_VOXELS - reach - (double)origin[a];
        const double hi = b->max[a] + SLACK_VOXELS + reach - (double)origin[a];
        if (!(hi >= 0 && lo < (double)size[a]))
            return;
        first[a] = lo > 0 ? (int64_t)lo / 8 : 0;
        last[a] = (hi < (double)size[a] ? (int64_t)hi : size[a] - 1) / 8;
    }
    for (int64_t v = first[1]; v <= last[1]; v++)
        open_row(s, v, first[0], last[0]);
}

/* Opens the squares for rays between four corners. `first` is the first corner; the corners are
 * `step` texels apart. If only some of the four rays go in the pass's direction, rays between them
 * may have any slope. */
static void open_rectangle(trip_cpu_sheets *s, const extent *e, const pane_rays *rays, int first,
                           int step)
{
    const trip_cpu_sheet_view *view = &s->view;
    bounds b = { { INFINITY, INFINITY }, { -INFINITY, -INFINITY } };
    int along = 0;
    for (int i = 0; i < 4; i++) {
        const int corner = first + (i & 1) * step + (i >> 1) * step * CORNERS;
        along += rays->along[corner];
        for (int n = 0; n < 4 && rays->along[corner]; n++)
            include(&b, n & 1, rays->at[n >> 1][n & 1][corner]);
    }
    for (int n = 0; n < 8 && along > 0 && along < 4; n++)
        include(&b, n & 1,
                view->eye[n & 1] +
                    e->ends[n >> 1 & 1] * (n >> 2 ? view->steepest : -view->steepest));
    if (along > 0)
        open_squares(&s->store, &b, e->reach);
}

/* Opens the squares for a patch of 2 x 2 texels: for the whole patch, or for each open texel. */
static void open_patch(trip_cpu_sheets *s, const extent *e, const pane_rays *rays, int u, int v,
                       uint64_t texels)
{
    static_assert(ACROSS == 8, "a byte for a row of texels");
    const uint64_t open = texels >> (v * ACROSS + u) & 0x303;
    const int first = v * CORNERS + u;
    if (open == 0x303)
        open_rectangle(s, e, rays, first, 2);
    for (int i = 0; i < 4 && open != 0x303; i++)
        if (open >> (i / 2 * ACROSS + i % 2) & 1)
            open_rectangle(s, e, rays, first + i / 2 * CORNERS + i % 2, 1);
}

static void open_pane(trip_cpu_sheets *s, const extent *e, uint32_t pane, uint64_t texels)
{
    const int x = trip_cpu_pane_x(s->of, pane), y = trip_cpu_pane_y(s->of, pane);
    const bool whole = texels == UINT64_MAX;
    pane_rays rays;
    for (int i = 0; i < CORNERS * CORNERS; i++)
        if (!whole || (i % CORNERS % ACROSS == 0 && i / CORNERS % ACROSS == 0))
            find_ray(&s->view, e, x + i % CORNERS * TEXEL, y + i / CORNERS * TEXEL, i, &rays);
    if (whole)
        open_rectangle(s, e, &rays, 0, ACROSS);
    for (int i = 0; i < ACROSS * ACROSS / 4 && !whole; i++)
        open_patch(s, e, &rays, i % (ACROSS / 2) * 2, i / (ACROSS / 2) * 2, texels);
}

static uint64_t open_texels(const trip_cpu *r, uint32_t pane)
{
    return atomic_load_explicit(&r->mask.panes[pane], memory_order_relaxed);
}

/* Returns whether a pixel is terminated in a pane of the layer. Panes without the layer do not
 * count. */
static bool some_is_terminated(const trip_cpu *r, int axis)
{
    for (uint32_t i = 0; i < trip_cpu_pane_count(r); i++)
        if (r->layers[i] & trip_cpu_layer_bit(axis, TRIP_WAY_ANY) &&
            open_texels(r, i) != UINT64_MAX)
            return true;
    return false;
}

static extent extent_from(const trip_cpu_sheets *s, int64_t number)
{
    const trip_cpu_sheet_view *view = &s->view;
    extent e = { .reach = trip_sheet_reach(view->kernel) };
    const int64_t first = number - s->way * e.reach,
                  last = number + s->way * (SHEETS - 1 + e.reach);
    for (int i = 0; i < 2; i++) {
        const double at = (double)(i ? last : first) - (view->ortho ? 0 : view->eye[2]);
        const bool before_eye = view->ortho || at * view->direction > 0;
        e.ends[i] = before_eye ? at : 0; /* rays start at the eye */
    }
    return e;
}

/* Finds the open squares for SHEETS sheets from `number` on. */
static void find_open_squares(trip_cpu_sheets *s, int64_t number)
{
    const extent e = extent_from(s, number);
    for (uint32_t i = 0; i < trip_cpu_pane_count(s->of); i++) {
        const uint64_t texels = open_texels(s->of, i);
        if (texels)
            open_pane(s, &e, i, texels);
    }
}

void trip_cpu_open_squares_of_sheet(trip_cpu_sheets *s, int64_t number)
{
    const size_t bytes = trip_cpu_store_grid(&s->store) * sizeof *s->store.open;
    if (s->open_sheets > 0) {
        s->open_sheets--;
        return;
    }
    s->open_sheets = SHEETS - 1;
    const bool some = !s->view.coordinates && some_is_terminated(s->of, s->axis);
    memset(s->store.open, some ? 0 : 0xff, bytes);
    if (some)
        find_open_squares(s, number);
}

bool trip_cpu_open_squares_some_of_run(const trip_cpu_sheets *s, const trip_run *run)
{
    const trip_cpu_store *store = &s->store;
    const int edge = 1 << s->of->frame->data->header.tile_log2;
    const unsigned columns = edge < TRIP_CPU_RASTER ? (1u << edge / 8) - 1 : 0xff;
    for (int v = run->v; v < run->v + edge; v += 8)
        for (int u = run->u; u < run->u + edge; u += TRIP_CPU_RASTER) {
            const uint64_t open = store->open[trip_cpu_store_at(store, u >> TRIP_CPU_RASTER_LOG2,
                                                                v >> TRIP_CPU_RASTER_LOG2)];
            if (open >> (v / 8 % 8 * 8 + u / 8 % 8) & columns)
                return true;
        }
    return false;
}

void trip_cpu_open_squares_forget(trip_cpu_sheets *s)
{
    s->open_sheets = 0;
}
