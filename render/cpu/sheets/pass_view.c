#include "cpu/sheets/cpu_sheets_state.h"

#include <math.h>

#include "cpu/cpu_effects.h"
#include "cpu/sheets/uneven.h"
#include "shade.h"
#include "debug_view.h"
#include "weight.h"

/* If several lists are drawn, rays that move farther along u or v between two sheets are left out.
 * Their weight w in the list is below 1 / STEEPEST. So w^2 is below a tenth of 1/255 of the
 * picture. */
#define STEEPEST 64.0

static void by_list(const trip_cpu_sheet_view *view, trip_vec3 v, double out[3])
{
    for (int i = 0; i < 3; i++)
        out[i] = trip_component(v, (view->axis + 1 + i) % 3);
}

/* Returns the factor 0.5, explained below, over the length of a fully lit outline. */
static double outline_unit(const trip_cpu_sheet_view *view, const trip_frame *frame)
{
    const trip_coordinates *c = &frame->data->coordinates;
    trip_affine world = { 0 };
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++)
            world.m[i][k] = view->world[i][k];
    return 0.5 / (trip_shade_outline_full(&world, c->widest) * trip_cpu_outline_unit(c));
}

/* Sets the map of gradients from index space to world space: the inverse transpose of view->world.
 * It also converts code differences in the store's unit to lengths relative to full shading. The
 * factor 0.5 is there because the kernels pass the sum of two gradients. */
static void set_gradient(trip_cpu_sheet_view *view, const trip_frame *frame, trip_cpu_codes codes)
{
    const trip_draw_codes *draw = &frame->plan->draw;
    double full =
        trip_shade_gradient_full(&frame->data->header, frame->settings, 1, frame->plan->level);
    double unit = ldexp(0.5 * trip_draw_value_per_code(draw) / full, -(int)codes.shift) /
                  trip_cpu_gradient_unit(&frame->data->coordinates);
    const double(*m)[3] = (const double(*)[3])view->world;
    if (view->kernel == TRIP_KERNEL_NEAREST)
        unit = outline_unit(view, frame);
    double adjugate[3][3];
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++)
            adjugate[i][k] = m[(i + 1) % 3][(k + 1) % 3] * m[(i + 2) % 3][(k + 2) % 3] -
                             m[(i + 1) % 3][(k + 2) % 3] * m[(i + 2) % 3][(k + 1) % 3];
    double determinant =
        m[0][0] * adjugate[0][0] + m[0][1] * adjugate[0][1] + m[0][2] * adjugate[0][2];
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++)
            view->gradient[i][k] =
                (float)trip_shade_within_floats(unit * adjugate[i][k] / determinant);
}

static void set_light(trip_cpu_sheet_view *view, const trip_frame *frame)
{
    const trip_settings *s = frame->settings;
    const trip_vec3 position = trip_light_position(s, &frame->camera->index_to_world);
    const trip_vec3 forward = frame->camera->world_forward;
    for (int k = 0; k < 3; k++) {
        view->light[k] = (float)(s->point_light ? trip_component(position, (view->axis + 1 + k) % 3)
                                                : trip_component(s->light_direction, k));
        view->to_eye[k] = (float)-trip_component(forward, k);
    }
}

static void set_clip(trip_cpu_sheet_view *view, const trip_clip *clip)
{
    view->clips = clip->count;
    for (int i = 0; i < clip->count; i++) {
        by_list(view, clip->planes[i].normal, view->clip[i]);
        view->clip[i][3] = clip->planes[i].offset;
    }
}

static void set_debug_view(trip_cpu_sheet_view *view, const trip_frame *frame)
{
    double debug_colour[3] = { 0 };
    view->has_debug_colour =
        trip_debug_view_of(frame->settings, view->axis, frame->plan->level, debug_colour);
    for (int k = 0; k < 3; k++)
        view->debug_colour[k] = (float)debug_colour[k];
}

/* Returns the largest slope of the view's rays against the view's axis, at most the extent of the
 * grid. */
static double steepest_of_view(const trip_frame *frame)
{
    const trip_camera *c = frame->camera;
    const int axis = frame->plan->axis_of_view;
    const uint64_t *dims = frame->data->header.dims;
    const double grid = (double)(dims[0] + dims[1] + dims[2]);
    const double along = trip_component(c->r0, axis);
    double max = 0;
    for (int i = 0; i < 4; i++) {
        const trip_vec3 ray = trip_camera_ray(c, i & 1 ? c->width : 0, i & 2 ? c->height : 0);
        const double r[3] = { ray.x, ray.y, ray.z };
        if (!(r[axis] * along > 0))
            return grid;
        const double across = fmax(fabs(r[(axis + 1) % 3]), fabs(r[(axis + 2) % 3]));
        max = fmax(max, across / fabs(r[axis]));
    }
    return fmin(grid, max);
}

double trip_cpu_pass_steepest(const trip_frame *frame)
{
    const trip_settings *s = frame->settings;
    const double h = trip_weight_h(s);
    if (s->method == TRIP_METHOD_AXIS)
        return fmax(STEEPEST, steepest_of_view(frame));
    return h * STEEPEST > 1 ? 1 / h : STEEPEST;
}

void trip_cpu_pass_view_make(trip_cpu_sheet_view *view, const trip_frame *frame, int axis,
                             bool descending, const trip_cpu_tf *function)
{
    const trip_camera *c = frame->camera;
    const trip_settings *s = frame->settings;
    *view = (trip_cpu_sheet_view){
        .of = frame,
        .integrals = &function->integrals,
        .blurred = &function->blurred,
        .coordinates =
            trip_coordinates_uneven(&frame->data->coordinates) ? &frame->data->coordinates : NULL,
        .axis = axis,
        .kernel = s->kernel,
        .table = frame->table,
        .code_shift = (int)function->codes.shift,
        .code_first = function->codes.first,
        .voxel_world = (float)c->voxel_world,
        .voxels = { (int64_t)frame->data->header.dims[(axis + 1) % 3],
                    (int64_t)frame->data->header.dims[(axis + 2) % 3] },
        .ortho = c->ortho,
        .shading = s->shading,
        .headlight = s->headlight,
        .point_light = s->point_light && !s->headlight,
        .early_termination = trip_cpu_early_termination(s),
        .direction = descending ? -1 : 1,
        .middle = trip_coordinates_position(&frame->data->coordinates, axis,
                                            0.5 * ((double)frame->data->header.dims[axis] - 1)),
        .steepest = trip_cpu_pass_steepest(frame),
    };
    by_list(view, c->eye, view->eye);
    by_list(view, c->r0, view->r0);
    by_list(view, c->rx, view->rx);
    by_list(view, c->ry, view->ry);
    for (int i = 0; i < 3; i++) {
        double unit[3] = { 0 };
        unit[(axis + 1 + i) % 3] = 1;
        trip_vec3 column =
            trip_affine_vector(&c->index_to_world, trip_v3(unit[0], unit[1], unit[2]));
        for (int k = 0; k < 3; k++)
            view->world[k][i] = trip_component(column, k) / c->voxel_world;
    }
    set_gradient(view, frame, function->codes);
    set_light(view, frame);
    set_clip(view, &frame->plan->clip);
    set_debug_view(view, frame);
    trip_cpu_effects_make(&view->effects, frame, axis, NULL);
}
