#include "cpu/occlusion.h"

#include "brick_box.h"
#include "pixels.h"

/* Let b be the half-size of a support at the G of its centre. |r(p)| differs from |r_c| by at most
 * |p - c| |rx|. So the support reaches at most b / (1 - b |rx| / |r_c|).
 *
 * The test uses this bound only if it is below 1.3 b and the kernels lie at least eight radii of
 * depth away. The kernels compute splats in floats; SLACK_PX covers their rounding. */
#define SLACK_PX 0.05
#define NEAREST_RADII 8.0
#define MAX_GROWTH 0.23

enum { TEXEL = 4, TEXELS = TRIP_CPU_PANE / TEXEL };

static double dot(const double along[3], const double at[3])
{
    return along[0] * at[0] + along[1] * at[1] + along[2] * at[2];
}

static double reach(const double along[3], const double half[3])
{
    return fabs(along[0]) * half[0] + fabs(along[1]) * half[1] + fabs(along[2]) * half[2];
}

static trip_pixels pixels(double middle, double reach, int size)
{
    return trip_pixels_within(middle - reach - SLACK_PX, middle + reach + SLACK_PX, size);
}

/* Extent of a box's splats along one screen axis, in pixels. `middle` is the centre of the middle
 * splat. `centres` bounds the distance of the other centres from `middle`. `support` bounds the
 * half-size of a support at the G of its centre. */
typedef struct projection {
    double middle, centres, support;
} projection;

/* Bounds x = X / z over a box, given 1 / z at its middle and at its nearest point. With x0 at the
 * middle, x - x0 = (X - x0 z) / z; the numerator is 0 at the middle. The variance of a footprint is
 * sigma^2 times the square of the gradient (X - x z)' / z of x. */
static projection projection_of(const trip_cpu_view *view, const double along_x[4],
                                const double along_z[4], const trip_cpu_box *box, double inverse,
                                double inverse_nearest)
{
    const double radius = view->of->settings->kernel_radius;
    const double low_pass2 = view->splat.low_pass2 * view->splat.cutoff2;
    double x = (dot(along_x, box->middle) + along_x[3]) * inverse, slope[3];
    for (int i = 0; i < 3; i++)
        slope[i] = along_x[i] - x * along_z[i];
    double centres = reach(slope, box->half) * inverse_nearest;
    double steepest = sqrt(dot(slope, slope)) + centres * sqrt(dot(along_z, along_z));
    double kernel = radius * steepest * inverse_nearest;
    return (projection){ x, centres, sqrt(kernel * kernel + low_pass2) };
}

static uint64_t bits_of(int left, int right, int top, int bottom)
{
    uint64_t columns = (0xffu << left & 0xffu >> (7 - right)) * UINT64_C(0x0101010101010101);
    return columns & UINT64_MAX << 8 * top & UINT64_MAX >> (56 - 8 * bottom);
}

/* Returns the part of the texels [first, last] inside a pane, relative to the pane's first texel.
 */
static trip_pixels in_pane(trip_pixels texels, int pane)
{
    int first = texels.first - pane * TEXELS, last = texels.last - pane * TEXELS;
    return (trip_pixels){ first > 0 ? first : 0, last < TEXELS - 1 ? last : TEXELS - 1 };
}

static trip_cpu_occlusion occlusion_of(const trip_cpu_mask *mask, trip_pixels px, trip_pixels py)
{
    static_assert(TEXELS == 8, "a byte for a row");
    trip_pixels x = { px.first / TEXEL, px.last / TEXEL },
                y = { py.first / TEXEL, py.last / TEXEL };
    bool open = false, terminated = false;
    if (px.first > px.last || py.first > py.last)
        return TRIP_CPU_OCCLUDED;
    const int rows[2] = { (int)mask->grid.first, (int)(mask->grid.first + mask->grid.down) - 1 };
    const int top = y.first / TEXELS, bottom = y.last / TEXELS;
    for (int ty = top > rows[0] ? top : rows[0]; ty <= bottom && ty <= rows[1]; ty++)
        for (int tx = x.first / TEXELS; tx <= x.last / TEXELS; tx++) {
            trip_pixels h = in_pane(x, tx), v = in_pane(y, ty);
            uint64_t bits = bits_of(h.first, h.last, v.first, v.last);
            uint64_t rest =
                bits &
                atomic_load_explicit(
                    &mask->panes[(uint32_t)(ty - rows[0]) * mask->grid.across + (uint32_t)tx],
                    memory_order_relaxed);
            open |= rest != 0;
            terminated |= rest != bits;
            if (open && terminated)
                return TRIP_CPU_PARTLY;
        }
    return open ? TRIP_CPU_VISIBLE : TRIP_CPU_OCCLUDED;
}

/* Returns an upper bound of |rx| / |r_c| and |ry| / |r_c|. */
static double max_turn(const trip_cpu_view *view)
{
    return sqrt(fmax(view->splat.rxrx, view->splat.ryry)) * view->forward_length;
}

/* The outline of a box on the screen. */
typedef struct outline {
    projection x, y;
    double grown; /* maximum growth of supports, a factor */
    double z, inverse_nearest;
} outline;

static const double *depth_along(const trip_cpu_view *view)
{
    static const double none[4] = { 0, 0, 0, 0 };
    return view->splat.camera.ortho ? none : view->along_z;
}

/* Computes the outline and returns TRIP_CPU_VISIBLE. If no outline can be computed, returns the
 * result for the whole box instead. */
static trip_cpu_occlusion find_outline(const trip_cpu_view *view, const trip_cpu_box *box,
                                       outline *out)
{
    const double *along_z = depth_along(view);
    double inverse = 1, growth = 0;
    out->z = out->inverse_nearest = 1;
    if (!view->splat.camera.ortho) {
        double radius = view->of->settings->kernel_radius * view->forward_length;
        double z = dot(along_z, box->middle) + along_z[3], deep = reach(along_z, box->half);
        if (z - deep < (NEAREST_RADII + 1) * radius)
            return z + deep <= (double)view->behind ? TRIP_CPU_OCCLUDED : TRIP_CPU_PARTLY;
        inverse = 1 / z;
        out->z = z;
        out->inverse_nearest = 1 / (z - deep);
    }
    out->x = projection_of(view, view->along_x, along_z, box, inverse, out->inverse_nearest);
    out->y = projection_of(view, view->along_y, along_z, box, inverse, out->inverse_nearest);
    if (!view->splat.camera.ortho) {
        double max = out->x.support > out->y.support ? out->x.support : out->y.support;
        growth = sqrt(2) * max * max_turn(view);
    }
    out->grown = 1 / (1 - growth);
    return growth > MAX_GROWTH ? TRIP_CPU_PARTLY : TRIP_CPU_VISIBLE;
}

trip_cpu_occlusion trip_cpu_box_occlusion(const trip_cpu_view *view, const trip_cpu_mask *mask,
                                          const trip_cpu_box *box)
{
    const trip_camera *camera = &view->splat.camera;
    outline o;
    trip_cpu_occlusion occlusion = find_outline(view, box, &o);
    if (occlusion != TRIP_CPU_VISIBLE)
        return occlusion;
    return occlusion_of(mask,
                        pixels(o.x.middle, o.x.centres + o.x.support * o.grown, camera->width),
                        pixels(o.y.middle, o.y.centres + o.y.support * o.grown, camera->height));
}

/* Makes the line of a region. x at a square's middle differs from x0 by at most the region's
 * `centres`. This bounds the change of the slope (X - x z)' between squares. */
static trip_cpu_line line_of(const double along[4], const double along_z[4], const projection *s,
                             const outline *o)
{
    trip_cpu_line line = { .middle = s->middle };
    double slopes = 0;
    for (int i = 0; i < 2; i++) {
        line.by[i] = along[i] - s->middle * along_z[i];
        slopes += fabs(line.by[i]) + s->centres * fabs(along_z[i]);
    }
    double centres = 0.5 * (TRIP_CPU_SQUARE - 1) * slopes * o->inverse_nearest;
    line.reach = centres + s->support * o->grown + SLACK_PX;
    return line;
}

trip_cpu_occlusion trip_cpu_region_make(const trip_cpu_view *view, int u, int v, int64_t sheet,
                                        trip_cpu_region *region)
{
    const double half = 0.5 * (TRIP_CPU_REGION - 1), *along_z = depth_along(view);
    trip_cpu_box box = { { u + half, v + half, (double)sheet }, { half, half, 0 } };
    outline o;
    trip_cpu_occlusion occlusion = find_outline(view, &box, &o);
    if (occlusion != TRIP_CPU_VISIBLE)
        return occlusion;
    *region = (trip_cpu_region){ .x = line_of(view->along_x, along_z, &o.x, &o),
                                 .y = line_of(view->along_y, along_z, &o.y, &o),
                                 .z = o.z,
                                 .z_by = { along_z[0], along_z[1] } };
    return TRIP_CPU_VISIBLE;
}

trip_cpu_box trip_cpu_brick_box(const trip_dataset *data, const trip_list *list, uint64_t brick,
                                int64_t first_sheet, int64_t last_sheet)
{
    trip_brick_box b =
        trip_brick_box_of(&data->header, trip_brick_slab(list, brick), &list->bricks[brick]);
    b.lo[2] = fmax(b.lo[2], (double)first_sheet);
    b.hi[2] = fmin(b.hi[2], (double)last_sheet);
    trip_cpu_box box;
    for (int i = 0; i < 3; i++) {
        box.middle[i] = 0.5 * (b.lo[i] + b.hi[i]);
        box.half[i] = 0.5 * (b.hi[i] - b.lo[i]);
    }
    return box;
}
