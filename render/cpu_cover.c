#include "cpu_cover.h"

/* The support of a splat whose kernel lies in a box lies in the box's projection, widened by the
 * low-pass: k TRIP_LOW_PASS_PX = 1.33 px in parallel views. In perspective that much is divided by
 * sqrt(G(p) |r_c|^2) >= 1 / 1.29 where the kernel is at least eight radii of depth away (a pixel of
 * the support is at most 9/8 as far as the centre, and at least 7/8 as deep). */
#define MARGIN_PX 2.5
#define NEAREST_RADII 8.0

/* Half extents and centre of a box along one of the projections. */
typedef struct slope {
    double middle, half[3];
} slope;

static slope slope_of(const double along[4], const double middle[3], const double half[3])
{
    slope s = { .middle = along[3] };
    for (int i = 0; i < 3; i++) {
        s.middle += along[i] * middle[i];
        s.half[i] = along[i] * half[i];
    }
    return s;
}

static double reach(const slope *s)
{
    return fabs(s->half[0]) + fabs(s->half[1]) + fabs(s->half[2]);
}

static double at_corner(const slope *s, int corner)
{
    double sum = s->middle;
    for (int i = 0; i < 3; i++)
        sum += corner >> i & 1 ? s->half[i] : -s->half[i];
    return sum;
}

typedef struct range {
    double lo, hi;
} range;

/* Of x over the box; perspective views divide by z > 0. */
static range range_of(const slope *x, const slope *z, bool ortho)
{
    range r = { INFINITY, -INFINITY };
    for (int corner = 0; corner < 8; corner++) {
        double p = at_corner(x, corner);
        if (!ortho)
            p /= at_corner(z, corner);
        r.lo = fmin(r.lo, p);
        r.hi = fmax(r.hi, p);
    }
    return (range){ r.lo - MARGIN_PX, r.hi + MARGIN_PX };
}

/* Tiles that hold the pixels of a range; none when first > last. */
static void tiles_of(range r, int size, int *first, int *last)
{
    *first = (int)(fmax(0, fmin(size, r.lo))) / TRIP_CPU_TILE;
    *last = r.hi < 0 || r.lo >= size ? -1 : (int)(fmin(size - 1, r.hi)) / TRIP_CPU_TILE;
}

static bool all_closed(const trip_cpu_view *view, trip_cpu_grid grid, const _Atomic uint8_t *closed,
                       range x, range y)
{
    const trip_camera *camera = &view->splat.camera;
    int x0, x1, y0, y1;
    tiles_of(x, camera->width, &x0, &x1);
    tiles_of(y, camera->height, &y0, &y1);
    for (int ty = y0; ty <= y1; ty++)
        for (int tx = x0; tx <= x1; tx++)
            if (!atomic_load_explicit(&closed[(uint32_t)ty * grid.across + (uint32_t)tx],
                                      memory_order_relaxed))
                return false;
    return true;
}

bool trip_cpu_box_is_hidden(const trip_cpu_view *view, trip_cpu_grid grid,
                            const _Atomic uint8_t *closed, const trip_cpu_box *box)
{
    const trip_camera *camera = &view->splat.camera;
    double radius = view->of->settings->kernel_radius;
    double middle[3], half[3];
    for (int i = 0; i < 3; i++) {
        middle[i] = 0.5 * (box->lo[i] + box->hi[i]);
        half[i] = 0.5 * (box->hi[i] - box->lo[i]) + radius;
    }
    slope z = slope_of(view->along_z, middle, half);
    double near = camera->ortho ? 0 : NEAREST_RADII * radius * trip_length(camera->forward);
    if (z.middle - reach(&z) < near)
        return z.middle + reach(&z) <= 0;
    slope x = slope_of(view->along_x, middle, half), y = slope_of(view->along_y, middle, half);
    return all_closed(view, grid, closed, range_of(&x, &z, camera->ortho),
                      range_of(&y, &z, camera->ortho));
}

static const trip_file_slab *slab_of(const trip_list *list, uint64_t brick)
{
    uint64_t lo = 0, hi = list->slab_count;
    while (hi - lo > 1) {
        uint64_t middle = (lo + hi) / 2;
        if (list->slabs[middle].first_brick <= brick)
            lo = middle;
        else
            hi = middle;
    }
    return &list->slabs[lo];
}

trip_cpu_box trip_cpu_brick_box(const trip_cpu_view *view, uint64_t brick, int64_t first_sheet,
                                int64_t last_sheet)
{
    const trip_file_header *header = &view->of->data->header;
    const trip_list *list = &view->of->data->lists[view->axis];
    const trip_file_brick *b = &list->bricks[brick];
    double u = (double)((uint64_t)b->tile_u << header->tile_log2);
    double v = (double)((uint64_t)b->tile_v << header->tile_log2);
    double sheet = (double)((uint64_t)slab_of(list, brick)->slab * header->slab_sheets);
    return (trip_cpu_box){
        .lo = { u + b->u_min, v + b->v_min, fmax(sheet + b->sheet_min, (double)first_sheet) },
        .hi = { u + b->u_max, v + b->v_max, fmin(sheet + b->sheet_max, (double)last_sheet) },
    };
}

/* Components of r are linear over the tile: their extremes are at its corners. */
static void magnitudes(const trip_camera *c, int x, int y, double least[3], double most[3])
{
    for (int axis = 0; axis < 3; axis++) {
        double lo = INFINITY, hi = -INFINITY;
        for (int corner = 0; corner < 4; corner++) {
            trip_vec3 r = trip_camera_ray(c, x + (corner & 1 ? TRIP_CPU_TILE : 0),
                                          y + (corner & 2 ? TRIP_CPU_TILE : 0));
            lo = fmin(lo, trip_component(r, axis));
            hi = fmax(hi, trip_component(r, axis));
        }
        most[axis] = fmax(fabs(lo), fabs(hi));
        least[axis] = lo <= 0 && hi >= 0 ? 0 : fmin(fabs(lo), fabs(hi));
    }
}

bool trip_cpu_tile_without_weight(const trip_cpu_view *view, int x, int y)
{
    const trip_settings *s = view->of->settings;
    double least[3], most[3], h = s->method == TRIP_METHOD_CLIP ? 1 : s->h;
    if (s->method == TRIP_METHOD_AXIS)
        return view->axis != view->of->plan->axis_of_view;
    magnitudes(&view->splat.camera, x, y, least, most);
    double largest = fmax(least[0], fmax(least[1], least[2]));
    return most[view->axis] < h * largest * (1 - 1e-12);
}
