#include "cpu/cpu_view.h"

#include "block.h"
#include "normal.h"
#include "cpu/cpu_effects.h"
#include "shade.h"
#include "debug_view.h"

#define LOG2_E 1.44269504088896340736

/* Returns an upper bound of the stretch of a matrix: the root of the sum of its squared column
 * lengths. */
static double max_stretch(const trip_affine *a)
{
    double sum = 0;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            sum += a->m[i][j] * a->m[i][j];
    return sqrt(sum);
}

/* Sets the coefficients of to . (voxel - eye) for the list's coordinates: u, v, sheet and a
 * constant. */
static void set_along(double out[4], const trip_cpu_view *view, trip_vec3 to)
{
    const trip_camera *camera = &view->splat.camera;
    out[0] = trip_component(to, view->u_axis);
    out[1] = trip_component(to, view->v_axis);
    out[2] = trip_component(to, view->axis);
    out[3] = -trip_dot(to, camera->eye);
}

/* Sets the coefficients of |a + x b + y c|^2 in the order of trip_cpu_view.ray2. */
static void set_form(float out[6], trip_vec3 a, trip_vec3 b, trip_vec3 c)
{
    out[0] = (float)trip_dot(a, a);
    out[1] = (float)(2 * trip_dot(a, b));
    out[2] = (float)(2 * trip_dot(a, c));
    out[3] = (float)trip_dot(b, b);
    out[4] = (float)(2 * trip_dot(b, c));
    out[5] = (float)trip_dot(c, c);
}

static void set_forms(trip_cpu_view *view)
{
    const trip_camera *c = &view->splat.camera;
    const trip_affine *world = &c->index_to_world;
    trip_vec3 zero = trip_v3(0, 0, 0), r = trip_camera_ray(c, 0.5 * c->width, 0.5 * c->height);
    trip_vec3 rx = c->ortho ? zero : c->rx, ry = c->ortho ? zero : c->ry;
    double unit = 1 / view->stretch;
    set_form(view->ray2, r, rx, ry);
    set_form(view->world2, trip_scale(trip_affine_vector(world, r), unit),
             trip_scale(trip_affine_vector(world, rx), unit),
             trip_scale(trip_affine_vector(world, ry), unit));
}

/* Chooses the tables of G and stretch. The rarer ways of blending always use both tables. */
static void set_rays(trip_cpu_view *view)
{
    const trip_camera *camera = &view->splat.camera;
    bool alike = trip_affine_is_similarity(&camera->index_to_world);
    bool simple_blend = view->front_to_back && view->of->settings->target == TRIP_TARGET_RGBA32F;
    simple_blend |= view->sums;
    view->stretch_varies = !(camera->ortho || alike);
    view->affine = view->splat.affine;
    view->stretch =
        view->stretch_varies ? camera->voxel_world : trip_splat_stretch(&view->splat, 0, 0);
    view->rays = TRIP_CPU_STRETCHED;
    if (simple_blend && (camera->ortho || view->affine))
        view->rays = TRIP_CPU_PARALLEL;
    else if (simple_blend && alike)
        view->rays = TRIP_CPU_PERSPECTIVE;
}

/* Returns the length of the longest voxel, divided by the mean length. */
static double widest(const trip_cpu_view *view)
{
    return view->coordinates ? view->coordinates->widest : 1;
}

static void set_limits(trip_cpu_view *view)
{
    const trip_camera *camera = &view->splat.camera;
    double max = 1;
    if (view->stretch_varies && !view->affine)
        max = max_stretch(&camera->index_to_world) / view->stretch;
    view->thin = (float)((double)TRIP_CPU_THIN / max);
    view->behind = (float)(-widest(view) * trip_splat_behind(&view->splat) * (1 + 1e-6));
    view->early_termination = trip_cpu_early_termination(view->of->settings);
    view->cutoff = (float)(0.5 * LOG2_E * TRIP_CPU_EXP_UNIT * view->splat.cutoff2);
    view->panes_across = (camera->width + TRIP_CPU_PANE - 1) / TRIP_CPU_PANE;
}

/* Sets the footprint of a parallel view. All splats share the footprint of a voxel in front of the
 * eye. */
static void set_parallel(trip_cpu_view *view)
{
    const trip_camera *camera = &view->splat.camera;
    if (!camera->ortho)
        return;
    trip_splat_project(&view->splat, trip_add(camera->eye, camera->r0), &view->parallel);
    view->near = (float)(widest(view) * trip_splat_parallel_near(&view->splat) * (1 + 1e-6));
    view->behind = -view->near;
}

static void set_compact_normals(trip_cpu_view *view, const trip_dataset *data, double full)
{
    const trip_file_header *h = &data->header;
    if (h->normal_bytes != 3)
        return;
    trip_compact_normals c =
        trip_compact_normals_make(&data->index_to_world, h->gradient_full, h->gradient_step);
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            view->compact[i][j] = (float)(c.to_world[i][j] * c.step[j] / full);
}

static void set_byte_rows(trip_cpu_view *view)
{
    unsigned min = 255, max = 0, shown = 0;
    for (unsigned i = 0; i < 256; i++) {
        view->byte_rows[i] = view->table[(i + TRIP_CODE_FIRST) * TRIP_CODE_STEP];
        if (!(view->byte_rows[i].extinction > 0))
            continue;
        min = shown > 0 ? min : i;
        max = i;
        shown++;
    }
    const bool has_gaps = shown != max - min + 1;
    view->shown =
        has_gaps ? (trip_code_range){ 1, 0 } : (trip_code_range){ (uint16_t)min, (uint16_t)max };
}

void trip_cpu_view_set_table(trip_cpu_view *view, const trip_tf_entry *table, trip_code_range shown)
{
    view->table = table;
    view->shown = shown;
    if (view->code_bytes == 1)
        set_byte_rows(view);
}

/* `code_bytes` is the size of the voxels' codes. */
static void make_view(trip_cpu_view *view, const trip_frame *frame, const trip_camera *camera,
                      int axis, unsigned code_bytes, bool front_to_back)
{
    const trip_file_header *header = &frame->data->header;
    const double full =
        trip_shade_gradient_full(header, frame->settings, frame->camera->voxel_world, 0);
    const double eye[3] = { camera->eye.x, camera->eye.y, camera->eye.z };
    const trip_vec3 light = trip_light_position(frame->settings, &camera->index_to_world);
    *view = (trip_cpu_view){
        .of = frame,
        .coordinates =
            trip_coordinates_uneven(&frame->data->coordinates) ? &frame->data->coordinates : NULL,
        .splat = trip_splat_frame_make(camera, frame->settings),
        .front_to_back = front_to_back,
        .sums = trip_settings_sum_sheets(frame->settings),
        .axis = axis,
        .u_axis = (axis + 1) % 3,
        .v_axis = (axis + 2) % 3,
        .code_bytes = code_bytes,
        .normal_bytes = header->normal_bytes,
        .normal_full = (float)fmin(header->gradient_full / full, 1e30),
    };
    const int axes[3] = { view->u_axis, view->v_axis, axis };
    for (int i = 0; i < 3; i++) {
        view->eye[i] = eye[axes[i]];
        view->light[i] = trip_component(light, axes[i]);
        for (int k = 0; k < 3; k++)
            view->world[k][i] = camera->index_to_world.m[k][axes[i]] / camera->voxel_world;
    }
    trip_cpu_view_set_table(view, frame->table, (trip_code_range){ 1, 0 });
    set_compact_normals(view, frame->data, full);
    set_along(view->along_x, view, camera->to_x);
    set_along(view->along_y, view, camera->to_y);
    set_along(view->along_z, view, camera->forward);
    view->forward_length = trip_length(camera->forward);
    set_rays(view);
    set_forms(view);
    set_limits(view);
    set_parallel(view);
    view->depth_unit = trip_layer_depth_unit(camera, frame->camera);
}

void trip_cpu_view_make(trip_cpu_view *view, const trip_frame *frame, const trip_list *list,
                        bool front_to_back)
{
    const unsigned code_bytes = trip_block_form_of(&frame->data->header, list->kind).code_bytes;
    make_view(view, frame, &frame->plan->lists[list->index].camera, list->axis, code_bytes,
              front_to_back);
    view->list = list;
    trip_cpu_effects_make(&view->effects, frame, list->axis, &frame->plan->lists[list->index].grid);
    double debug_colour[3] = { 0 };
    view->has_debug_colour =
        trip_debug_view_of(frame->settings, list->axis, list->level, debug_colour);
    for (int i = 0; i < 3; i++)
        view->debug_colour[i] = (float)debug_colour[i];
}

void trip_cpu_layer_view_make(trip_cpu_view *view, const trip_frame *frame, int axis,
                              bool front_to_back)
{
    make_view(view, frame, frame->camera, axis, frame->data->header.code_bytes, front_to_back);
}
