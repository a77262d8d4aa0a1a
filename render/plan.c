#include "plan.h"

#include <inttypes.h>

#include "plan_cull.h"
#include "report.h"
#include "weight.h"

static const char axis_names[3] = { 'x', 'y', 'z' };

static int add_pass(trip_plan_list *list, const trip_dataset *data, int axis, bool descending,
                    bool front_to_back, int64_t first, int64_t last, trip_budget *budget)
{
    if (first > last)
        return 0;
    trip_plan_pass *pass = &list->passes[list->pass_count];
    int status = trip_selection_create(&pass->selection, data,
                                       trip_dataset_find(data, axis, 0, TRIP_KIND_VOXELS),
                                       descending, first, last, budget);
    if (status)
        return status;
    pass->front_to_back = front_to_back;
    list->pass_count++;
    return 0;
}

/* First sheet that is not below the eye, cut to [0, sheets]. */
static int64_t first_sheet_beyond(double eye, int64_t sheets)
{
    return (int64_t)fmin((double)sheets, fmax(0, ceil(eye)));
}

/* The sides of the eye, each from the eye outwards. Sides do not cover one another: a ray meets
 * only the side it points to. In a parallel view the eye is infinitely far off. */
static int add_passes(trip_plan_list *list, const trip_dataset *data, const trip_camera *camera,
                      const trip_settings *settings, int axis, trip_budget *budget)
{
    int64_t sheets = (int64_t)data->header.dims[axis];
    trip_vec3 gaze = trip_camera_ray(camera, 0.5 * camera->width, 0.5 * camera->height);
    bool upwards = trip_component(gaze, axis) > 0;
    if (settings->traversal == TRIP_TRAVERSAL_ASCENDING)
        return add_pass(list, data, axis, false, upwards, 0, sheets - 1, budget);
    if (camera->ortho)
        return add_pass(list, data, axis, !upwards, true, 0, sheets - 1, budget);
    int64_t beyond = first_sheet_beyond(trip_component(camera->eye, axis), sheets);
    int status = add_pass(list, data, axis, false, true, beyond, sheets - 1, budget);
    if (status)
        return status;
    return add_pass(list, data, axis, true, true, 0, beyond - 1, budget);
}

static void select_brick(trip_plan_list *list, uint64_t index, const trip_file_brick *brick,
                         int64_t slab_sheet)
{
    for (int i = 0; i < list->pass_count; i++) {
        trip_selection *s = &list->passes[i].selection;
        if (slab_sheet + brick->sheet_max >= s->sheet_first &&
            slab_sheet + brick->sheet_min <= s->sheet_last)
            trip_selection_add(s, index);
    }
    list->bricks_selected++;
    list->splats_selected += brick->splats;
}

static int select_bricks(trip_plan_list *list, const trip_list *source, trip_cull *cull,
                         uint32_t slab_sheets)
{
    list->bricks = source->brick_count;
    for (uint64_t i = 0; i < source->slab_count; i++) {
        if (trip_interrupted())
            return trip_fail(TRIP_INTERRUPTED, "render", "plan", "interrupted");
        const trip_file_slab *slab = &source->slabs[i];
        int64_t slab_sheet = (int64_t)slab->slab * slab_sheets;
        for (uint64_t j = slab->first_brick; j < slab->first_brick + slab->brick_count; j++) {
            const trip_file_brick *brick = &source->bricks[j];
            switch (trip_cull_brick(cull, source->axis, brick, slab)) {
            case TRIP_CULL_KEEP:
                select_brick(list, j, brick, slab_sheet);
                break;
            case TRIP_CULL_TRANSPARENT:
                list->bricks_transparent++;
                break;
            case TRIP_CULL_OUTSIDE:
                list->bricks_outside++;
                break;
            case TRIP_CULL_NO_WEIGHT:
                list->bricks_without_weight++;
                break;
            }
        }
    }
    return 0;
}

/* Passes that read nothing are left out. */
static void drop_empty_passes(trip_plan_list *list, trip_budget *budget)
{
    int kept = 0;
    for (int i = 0; i < list->pass_count; i++) {
        trip_plan_pass pass = list->passes[i];
        trip_run_iterator it = trip_run_begin(&pass.selection);
        trip_run run;
        if (trip_run_next(&it, &run))
            list->passes[kept++] = pass;
        else
            trip_selection_destroy(&pass.selection, budget);
    }
    list->pass_count = kept;
}

int trip_plan_make(trip_plan *plan, const trip_dataset *data, const trip_camera *camera,
                   const trip_settings *settings, const trip_tf_entry *table, trip_budget *budget)
{
    int status = 0;
    *plan = (trip_plan){ .axis_of_view = trip_weight_axis_of_view(camera),
                         .planes = 1u << TRIP_PLANE_VOXELS };
    if (settings->shading)
        plan->planes |= data->header.planes & 1u << TRIP_PLANE_NORMALS;

    trip_cull cull = trip_cull_make(data, camera, settings, plan->axis_of_view, table);
    for (int axis = 0; axis < 3 && !status; axis++) {
        trip_plan_list *list = &plan->lists[axis];
        list->used = trip_weight_is_somewhere(settings, camera, plan->axis_of_view, axis);
        if (!list->used)
            continue;
        status = add_passes(list, data, camera, settings, axis, budget);
        if (!status)
            status = select_bricks(list, trip_dataset_find(data, axis, 0, TRIP_KIND_VOXELS), &cull,
                                   data->header.slab_sheets);
        if (!status)
            drop_empty_passes(list, budget);
    }
    if (status)
        trip_plan_release(plan, budget);
    return status;
}

void trip_plan_release(trip_plan *plan, trip_budget *budget)
{
    for (int axis = 0; axis < 3; axis++)
        for (int i = 0; i < plan->lists[axis].pass_count; i++)
            trip_selection_destroy(&plan->lists[axis].passes[i].selection, budget);
    *plan = (trip_plan){ 0 };
}

static void explain_method(const trip_plan *plan, const trip_settings *s, FILE *out)
{
    switch (s->method) {
    case TRIP_METHOD_MERGE:
        fprintf(out, "method      merge: layers of up to three lists, blended by w^2 with h = %g\n",
                s->h);
        break;
    case TRIP_METHOD_CLIP:
        fprintf(out, "method      clip: every pixel from the list its ray is most aligned with\n");
        break;
    case TRIP_METHOD_AXIS:
        fprintf(out, "method      axis: list %c alone, by the ray at the image centre\n",
                axis_names[plan->axis_of_view]);
        break;
    }
}

static void explain_passes(const trip_plan_list *list, FILE *out)
{
    for (int i = 0; i < list->pass_count; i++) {
        const trip_plan_pass *pass = &list->passes[i];
        fprintf(out, "%ssheets %" PRId64 " to %" PRId64 " %s, %s", i ? "; then " : "            ",
                pass->selection.sheet_first, pass->selection.sheet_last,
                pass->selection.descending ? "descending" : "ascending",
                pass->front_to_back ? "front to back" : "back to front");
    }
    fprintf(out, "\n");
}

static void explain_list(const trip_plan *plan, int axis, FILE *out)
{
    const trip_plan_list *list = &plan->lists[axis];
    fprintf(out, "list %c      ", axis_names[axis]);
    if (!list->used) {
        fprintf(out, "not read: no ray of the view has weight in it\n");
        return;
    }
    unsigned planes = plan->planes & 1u << TRIP_PLANE_NORMALS ? 2 : 1;
    char bytes[32];
    fprintf(out,
            "%s: %" PRIu64 " of %" PRIu64 " bricks, %" PRIu64 " splats, %s (left out: %" PRIu64
            " transparent, %" PRIu64 " out of view, %" PRIu64 " without weight)\n",
            list->pass_count ? "read" : "empty", list->bricks_selected, list->bricks,
            list->splats_selected,
            trip_format_bytes(list->splats_selected * TRIP_RECORD_BYTES * planes, bytes),
            list->bricks_transparent, list->bricks_outside, list->bricks_without_weight);
    if (list->pass_count)
        explain_passes(list, out);
}

uint64_t trip_plan_bytes_left_out(const trip_plan *plan, const trip_dataset *data)
{
    uint64_t splats = 0;
    for (int axis = 0; axis < 3; axis++)
        splats += plan->lists[axis].splats_selected;
    unsigned left_out = data->header.planes & ~plan->planes & 1u << TRIP_PLANE_NORMALS;
    return left_out ? splats * TRIP_RECORD_BYTES : 0;
}

static void explain_shading(const trip_plan *plan, const trip_dataset *data, const trip_settings *s,
                            FILE *out)
{
    const char *light = s->headlight ? "from the eye" : "from the direction given";
    char bytes[32];
    if (plan->planes & 1u << TRIP_PLANE_NORMALS)
        fprintf(out, "shading     runs, lit %s: normal planes are read\n", light);
    else if (!(data->header.planes & 1u << TRIP_PLANE_NORMALS))
        fprintf(out, "shading     does not run: the data set has no normals\n");
    else
        fprintf(out, "shading     does not run: not asked for; normal planes are not read, %s\n",
                trip_format_bytes(trip_plan_bytes_left_out(plan, data), bytes));
}

void trip_plan_explain(const trip_plan *plan, const trip_dataset *data,
                       const trip_settings *settings, FILE *out)
{
    int used = 0;
    explain_method(plan, settings, out);
    for (int axis = 0; axis < 3; axis++) {
        explain_list(plan, axis, out);
        used += plan->lists[axis].pass_count > 0;
    }
    explain_shading(plan, data, settings, out);
    if (used > 1)
        fprintf(out, "merge       runs: %d layers are blended\n", used);
    else
        fprintf(out, "merge       copies: %s\n",
                used ? "one list has all the weight or all the splats" : "nothing is drawn");
}
