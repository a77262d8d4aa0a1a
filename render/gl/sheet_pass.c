#include "gl/sheet_pass.h"

#include <assert.h>
#include <math.h>

#include "shade.h"

/* Maximum movement of the reference ray along u or v for each sheet. */
#define STEEPEST 64.0

static void by_list(trip_vec3 v, int axis, double out[3])
{
    for (int i = 0; i < 3; i++)
        out[i] = trip_component(v, (axis + i) % 3);
}

static trip_gl_float4 linear(double constant, double x, double y, double w)
{
    return (trip_gl_float4){ { (float)constant, (float)x, (float)y, (float)w } };
}

/* Rays relative to the image's centre, scaled as in trip_gl_frame. */
typedef struct rays {
    double r0[3], rx[3], ry[3];              /* direction, and its change for each pixel */
    double start[3], x_start[3], y_start[3]; /* start, and its change for each pixel */
} rays;

static rays rays_of(const trip_camera *c, int axis)
{
    const trip_vec3 none = { 0, 0, 0 };
    double x = 0.5 * c->width, y = 0.5 * c->height;
    trip_vec3 r0 = trip_camera_ray(c, x, y), rx = c->ortho ? none : c->rx;
    trip_vec3 ry = c->ortho ? none : c->ry, start = c->eye;
    double length = c->ortho ? 1 : trip_length(r0);
    if (c->ortho)
        start = trip_add(start, trip_add(trip_scale(c->rx, x), trip_scale(c->ry, y)));
    rays r;
    by_list(trip_scale(r0, 1 / length), axis, r.r0);
    by_list(trip_scale(rx, 1 / length), axis, r.rx);
    by_list(trip_scale(ry, 1 / length), axis, r.ry);
    by_list(start, axis, r.start);
    by_list(c->ortho ? c->rx : none, axis, r.x_start);
    by_list(c->ortho ? c->ry : none, axis, r.y_start);
    return r;
}

/* Takes the ray at the image's centre as the reference if it goes in this direction. Differences
 * from it keep their precision, however far the eye is. */
static void choose_slope(trip_gl_sheet_view *v, const rays *r, double way)
{
    double u = r->r0[1] / r->r0[0], w = r->r0[2] / r->r0[0];
    bool usable = r->r0[0] * way > 0 && fabs(u) <= STEEPEST && fabs(w) <= STEEPEST;
    v->slope[0] = usable ? u : 0;
    v->slope[1] = usable ? w : 0;
}

/* The length of a stored gradient of full shading, if codes are exact. */
#define STORED_FULL 64.0

/* Maps differences of codes, or of indicators with the nearest value, from list axes to world
 * space, relative to full shading. The map is the inverse transpose of index_to_world. */
static void set_gradient(trip_gl_sheet_view *v, const trip_frame *frame)
{
    double full = trip_shade_gradient_full(&frame->data->header, frame->settings,
                                           frame->camera->voxel_world, frame->plan->level);
    double unit = trip_draw_value_per_code(&frame->plan->draw) / full;
    v->gradient_scale = 1;
    if (frame->settings->kernel == TRIP_KERNEL_NEAREST)
        unit = 1 / trip_shade_outline_full(&frame->data->index_to_world,
                                           frame->data->coordinates.widest);
    else if (frame->plan->draw
                 .of_stored) { /* exact draw codes may exceed the range of stored gradients */
        v->gradient_scale = STORED_FULL * unit / frame->camera->voxel_world;
        unit = frame->camera->voxel_world / STORED_FULL;
    }
    trip_gl_float4 *columns[3] = { &v->constants.gradient_0, &v->constants.gradient_1,
                                   &v->constants.gradient_2 };
    trip_affine to_index;
    trip_affine_invert(&frame->data->index_to_world,
                       &to_index); /* cannot fail: opening the data set checked it */
    for (int i = 0; i < 3; i++) {
        const double *row = to_index.m[(v->axis + i) % 3];
        *columns[i] =
            linear(trip_shade_within_floats(unit * row[0]), trip_shade_within_floats(unit * row[1]),
                   trip_shade_within_floats(unit * row[2]), 0);
    }
}

static double inner(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* Rays start at `start`, where their depth is 0. */
static void set_clip(trip_gl_sheet_view *v, const rays *r, const trip_clip *clip)
{
    static_assert((int)TRIP_CLIP_MAX == 14, "shared.h");
    v->constants.clips.v[0] = clip->count;
    for (int i = 0; i < clip->count; i++) {
        double n[3];
        by_list(clip->planes[i].normal, v->axis, n);
        v->constants.clip_start[i] = linear(inner(n, r->start) + clip->planes[i].offset,
                                            inner(n, r->x_start), inner(n, r->y_start), 0);
        v->constants.clip_along[i] = linear(inner(n, r->r0), inner(n, r->rx), inner(n, r->ry), 0);
    }
}

trip_gl_sheet_view trip_gl_sheet_view_make(const trip_frame *frame, int axis, bool descending,
                                           const int64_t first[2], const int64_t size[2],
                                           double unit)
{
    const uint64_t *dims = frame->data->header.dims;
    const rays r = rays_of(frame->camera, axis);
    const double way = descending ? -1 : 1;
    trip_gl_sheet_view v = { .axis = axis };
    if (!trip_coordinates_uneven(&frame->data->coordinates)) {
        v.first_u = first[0];
        v.first_v = first[1];
    }
    for (int i = 0; i < 3; i++)
        v.eye[i] = r.start[i];
    choose_slope(&v, &r, way);
    trip_gl_float4 *across[2] = { &v.constants.across_u, &v.constants.across_v };
    for (int a = 0; a < 2; a++) {
        double s = v.slope[a];
        *across[a] = frame->camera->ortho
                         ? linear(0, r.x_start[1 + a] - s * r.x_start[0],
                                  r.y_start[1 + a] - s * r.y_start[0], 0)
                         : linear(r.r0[1 + a] - s * r.r0[0], r.rx[1 + a] - s * r.rx[0],
                                  r.ry[1 + a] - s * r.ry[0], 0);
        v.constants.extent.v[a] = (int32_t)size[a];
        v.constants.clips.v[1 + a] = (int32_t)-first[a];
        v.constants.extent.v[2 + a] = (int32_t)((int64_t)dims[(axis + 1 + a) % 3] - 1 - first[a]);
    }
    v.constants.across_u.v[3] = (float)unit;
    v.constants.across_v.v[3] = (float)trip_settings_early_termination(frame->settings);
    v.constants.clips.v[3] = (int32_t)frame->settings->kernel;
    v.constants.along = linear(r.r0[0], r.rx[0], r.ry[0], way);
    v.constants.start = linear(0, r.x_start[0], r.y_start[0], 0);
    set_gradient(&v, frame);
    set_clip(&v, &r, &frame->plan->clip);
    return v;
}

/* Splits a position into whole voxels, relative to `first`, and a rest. */
static int32_t split(double position, int64_t first, float *rest)
{
    double whole = fmin(fmax(floor(position), -0x1p40), 0x1p40);
    *rest = (float)fmin(fmax(position - whole, -0x1p28), 0x1p28);
    return (int32_t)fmin(fmax(whole - (double)first, -0x1p28), 0x1p28);
}

trip_gl_sheet_end trip_gl_sheet_end_at(const trip_gl_sheet_view *v, double coordinate, double step,
                                       const int layers[4], double part)
{
    double along = coordinate - v->eye[0];
    trip_gl_sheet_end e = { .outer_before = layers[0],
                            .before = layers[1],
                            .behind = layers[2],
                            .outer_behind = layers[3],
                            .along = (float)along,
                            .sheet = (float)coordinate,
                            .step = (float)step,
                            .part = (float)part };
    e.base_u = split(v->eye[1] + along * v->slope[0], v->first_u, &e.first_u);
    e.base_v = split(v->eye[2] + along * v->slope[1], v->first_v, &e.first_v);
    return e;
}
