#include "plan.h"

#include <float.h>
#include <inttypes.h>
#include <string.h>

#include "effects.h"
#include "field.h"
#include "plan_cull.h"
#include "report.h"
#include "shade.h"
#include "sheet.h"

static const char axis_names[3] = { 'x', 'y', 'z' };

typedef struct planning {
    trip_plan *plan;
    const trip_dataset *data;
    const trip_camera *camera;
    const trip_settings *settings;
    const trip_tf_entry *table;
    trip_mean_tables *tables; /* the plan's own, or the caller's */
    trip_budget *budget;
    trip_classification *classified; /* results of earlier frames */
    trip_brick_ranges *about;        /* post: ranges along the axis being planned; else NULL */
    /* The codes with extinction in the table `shown_by`, which is a coarse level's. */
    trip_code_set shown;
    const trip_tf_entry *shown_by;
} planning;

/* Sheets on one side of the eye, or all sheets. */
typedef enum sides { ALL, BEYOND, BELOW } sides;

static bool is_of(const trip_settings *s, const trip_list *list)
{
    const trip_kind_info *kind = trip_kind_of(list->kind);
    return s->classify == TRIP_CLASSIFY_POST ? kind->lattice : kind->splatted;
}

static bool is_in_layer(const planning *p, const trip_list *list, int axis)
{
    if (list->axis != axis || !is_of(p->settings, list))
        return false;
    if (p->settings->classify == TRIP_CLASSIFY_POST)
        return list->level == 0;
    return !trip_kind_of(list->kind)->coarse || trip_lod_concerns(&p->plan->lod, list);
}

/* Whether each ray takes part only in the pass of its own direction. It does not in three cases:
 * - post: rays begin at the eye, whatever the passes are;
 * - vertex_weights: the weights belong to splats, not to rays;
 * - image-aligned sheets: they have an order of their own. */
static bool is_by_ways(const planning *p)
{
    const trip_settings *s = p->settings;
    return s->classify == TRIP_CLASSIFY_PRE && s->traversal == TRIP_TRAVERSAL_OUTWARD &&
           !p->camera->ortho && !s->vertex_weights && s->method != TRIP_METHOD_IMAGE;
}

/* Position of the eye along a list's axis, and the distance that splats of one side reach over
 * to the other side. */
typedef struct eye_position {
    double at, over;
} eye_position;

static eye_position position_of_eye(const planning *p, const trip_list *list)
{
    const trip_plan_list *planned = &p->plan->lists[list->index];
    eye_position eye = { .at = trip_component(planned->camera.eye, list->axis) };
    if (is_by_ways(p)) {
        const trip_cull cull = trip_cull_make(p->data, &planned->camera, &planned->grid,
                                              p->settings, p->plan->axis_of_view, NULL, NULL);
        eye.over = trip_cull_reach_over_eye(&cull, list->axis, list->dims);
    }
    return eye;
}

/* Returns the first sheet at or above a position, limited to [0, sheets]. */
static int64_t first_sheet_beyond(const planning *p, const trip_list *list, double position)
{
    double index = trip_coordinates_index(&p->data->coordinates, list->axis, position);
    return (int64_t)fmin((double)list->dims[list->axis], fmax(0, ceil(index)));
}

static int add_selection(const planning *p, trip_plan_pass *pass, const trip_list *list, sides side)
{
    trip_plan *plan = p->plan;
    int64_t sheets = list->dims[list->axis], first = 0, last = sheets - 1;
    const eye_position eye = position_of_eye(p, list);
    /* Interpolation at one side of the eye also reads sheets of the other side, if the eye lies
     * among the sheets. */
    int64_t over = p->about ? trip_sheet_reach(p->settings->kernel) : 0;
    if (side == BEYOND) {
        first = first_sheet_beyond(p, list, eye.at - eye.over);
        first -= first < sheets ? over : 0;
    } else if (side == BELOW) {
        last = first_sheet_beyond(p, list, eye.at + eye.over) - 1;
        last += last >= 0 ? over : 0;
    }
    first = first > 0 ? first : 0;
    last = last < sheets ? last : sheets - 1;
    if (first > last)
        return 0;
    trip_selection *s = &plan->selections[plan->selection_count];
    int status =
        trip_selection_create(s, p->data, list, pass->pass.descending, first, last, p->budget);
    if (status)
        return status;
    plan->selection_count++;
    pass->pass.selection_count++;
    return 0;
}

static int add_pass(const planning *p, int axis, sides side, bool descending, bool front_to_back)
{
    trip_plan_layer *layer = &p->plan->layers[axis];
    trip_plan_pass *pass = &layer->passes[layer->pass_count];
    int status = 0;
    *pass = (trip_plan_pass){
        .pass = { .selections = &p->plan->selections[p->plan->selection_count],
                  .descending = descending },
        .front_to_back = front_to_back,
    };
    for (unsigned i = 0; i < p->data->list_count && !status; i++)
        if (is_in_layer(p, &p->data->lists[i], axis))
            status = add_selection(p, pass, &p->data->lists[i], side);
    layer->pass_count += pass->pass.selection_count > 0;
    return status;
}

static bool has_rays(const planning *p, int axis, trip_way way)
{
    return !is_by_ways(p) ||
           trip_weight_is_somewhere(p->settings, p->camera, p->plan->axis_of_view, axis, way);
}

/* Adds one pass for each side of the eye, from the eye outwards. A ray meets the sheets of the
 * side it points to, and splats of the other side that reach over the eye's coordinate. In a
 * parallel view the eye is infinitely far away, and one pass covers all sheets. */
static int add_passes(const planning *p, int axis)
{
    const trip_camera *c = p->camera;
    trip_vec3 view_direction = trip_camera_ray(c, 0.5 * c->width, 0.5 * c->height);
    bool upwards = trip_component(view_direction, axis) > 0;
    if (p->settings->traversal == TRIP_TRAVERSAL_ASCENDING)
        return add_pass(p, axis, ALL, false, upwards);
    if (c->ortho)
        return add_pass(p, axis, ALL, !upwards, true);
    int status = 0;
    if (has_rays(p, axis, TRIP_WAY_UP))
        status = add_pass(p, axis, BEYOND, false, true);
    if (!status && has_rays(p, axis, TRIP_WAY_DOWN))
        status = add_pass(p, axis, BELOW, true, true);
    return status;
}

/* Returns the selections of a pass as part of the plan's own array, to write to them. */
static trip_selection *selections_of(const trip_plan *plan, const trip_plan_pass *pass)
{
    return plan->selections + (pass->pass.selections - plan->selections);
}

/* Returns the selection of a list in pass `i` of its layer, or NULL. The list may be the one
 * with the same index at another level (dataset_level.h). */
static trip_selection *selection_in(const trip_plan *plan, int axis, int i, const trip_list *list)
{
    const trip_plan_pass *pass = &plan->layers[axis].passes[i];
    trip_selection *selections = selections_of(plan, pass);
    for (unsigned k = 0; k < pass->pass.selection_count; k++)
        if (selections[k].list->index == list->index)
            return &selections[k];
    return NULL;
}

typedef struct selecting {
    const planning *p;
    const trip_list *list;
    trip_plan_list *planned;
    trip_cull cull;
    trip_selection *selections[2]; /* by pass; NULL if the pass draws no sheet of the list */
} selecting;

/* Returns the number of passes that draw a sheet. Both passes may draw a sheet near the eye. */
static unsigned passes_of(const selecting *of, int64_t sheet)
{
    unsigned count = 0;
    for (int i = 0; i < 2; i++) {
        const trip_selection *s = of->selections[i];
        count += s && sheet >= s->sheet_first && sheet <= s->sheet_last;
    }
    return count;
}

static void count_runs(const selecting *of, uint64_t index, int64_t slab_sheet)
{
    const trip_file_header *h = &of->p->data->header;
    const trip_file_run *runs = of->list->runs + index * h->slab_sheets;
    uint64_t *bytes = of->planned->bytes_selected;
    for (uint32_t s = 0; s < h->slab_sheets; s++) {
        const uint64_t passes = passes_of(of, slab_sheet + s);
        of->planned->splats_selected += passes * runs[s].records;
        bytes[TRIP_PLANE_VOXELS] += passes * 8 * runs[s].words;
        if (of->list->planes >> TRIP_PLANE_NORMALS & 1 && !of->p->data->computes_normals)
            bytes[TRIP_PLANE_NORMALS] += passes * runs[s].records * h->normal_bytes;
        if (of->list->planes >> TRIP_PLANE_DEVIATIONS & 1)
            bytes[TRIP_PLANE_DEVIATIONS] += passes * runs[s].records;
    }
}

static void select_brick(const selecting *of, uint64_t index, int64_t slab_sheet)
{
    const trip_file_brick *brick = &of->list->bricks[index];
    for (int i = 0; i < 2; i++) {
        trip_selection *s = of->selections[i];
        if (s && slab_sheet + brick->sheet_max >= s->sheet_first &&
            slab_sheet + brick->sheet_min <= s->sheet_last)
            trip_selection_add(s, index);
    }
    of->planned->bricks_selected++;
    count_runs(of, index, slab_sheet);
}

static void consider_brick(selecting *of, const trip_file_slab *slab, uint64_t index)
{
    const trip_file_brick *brick = &of->list->bricks[index];
    if (of->planned->by_level &&
        !trip_lod_brick(&of->p->plan->lod, of->list, &of->p->data->header, brick, slab->slab)) {
        of->planned->bricks_of_other_levels++;
        return;
    }
    switch (trip_cull_brick(&of->cull, of->list->axis, brick, slab)) {
    case TRIP_CULL_KEEP:
        select_brick(of, index, (int64_t)slab->slab * of->p->data->header.slab_sheets);
        break;
    case TRIP_CULL_TRANSPARENT:
        of->planned->bricks_transparent++;
        break;
    case TRIP_CULL_OUTSIDE:
        of->planned->bricks_outside++;
        break;
    case TRIP_CULL_NO_WEIGHT:
        of->planned->bricks_without_weight++;
        break;
    case TRIP_CULL_CLIPPED:
        of->planned->bricks_clipped++;
        break;
    }
}

/* Returns the codes with extinction in `table`, which is the plan's or a coarse level's. */
static const trip_code_set *shown_by(planning *p, const trip_tf_entry *table)
{
    if (table == p->table)
        return trip_classification_shown(p->classified, table);
    if (p->shown_by != table)
        trip_code_set_make(&p->shown, table, FLT_TRUE_MIN);
    p->shown_by = table;
    return &p->shown;
}

static int select_bricks(planning *p, const trip_list *list)
{
    trip_plan *plan = p->plan;
    trip_plan_list *planned = &plan->lists[list->index];
    selecting of = { .p = p, .list = list, .planned = planned };
    of.cull = trip_cull_make(p->data, &planned->camera, &planned->grid, p->settings,
                             plan->axis_of_view, shown_by(p, planned->table), p->about);
    of.cull.clip = &planned->clip;
    planned->shown = trip_code_set_range(of.cull.shown);
    for (int i = 0; i < plan->layers[list->axis].pass_count; i++)
        of.selections[i] = selection_in(plan, list->axis, i, list);
    planned->bricks = list->brick_count;
    if (planned->by_level && !(plan->lod.chosen >> list->level & 1)) {
        planned->bricks_of_other_levels = list->brick_count;
        return 0;
    }
    for (uint64_t i = 0; i < list->slab_count; i++) {
        if (trip_interrupted())
            return trip_fail(TRIP_INTERRUPTED, "render", "plan", "interrupted");
        const trip_file_slab *slab = &list->slabs[i];
        for (uint64_t j = slab->first_brick; j < slab->first_brick + slab->brick_count; j++)
            consider_brick(&of, slab, j);
    }
    return 0;
}

/* Drops selections that read nothing, and passes without selections. */
static void drop_empty(trip_plan *plan, trip_plan_layer *layer, trip_budget *budget)
{
    int kept = 0;
    for (int i = 0; i < layer->pass_count; i++) {
        trip_plan_pass pass = layer->passes[i];
        trip_selection *selections = selections_of(plan, &pass);
        unsigned left = 0;
        for (unsigned k = 0; k < pass.pass.selection_count; k++) {
            trip_selection s = selections[k];
            trip_run_iterator it = trip_run_begin(&s);
            trip_run run;
            selections[k] = (trip_selection){ 0 };
            if (trip_run_next(&it, &run))
                selections[left++] = s;
            else
                trip_selection_destroy(&s, budget);
        }
        pass.pass.selection_count = left;
        if (left > 0)
            layer->passes[kept++] = pass;
    }
    layer->pass_count = kept;
}

/* Sets the clipping planes of a list in its own index space. */
static void place_clip(const planning *p, const trip_list *list, trip_plan_list *planned)
{
    const uint64_t dims[3] = { (uint64_t)list->dims[0], (uint64_t)list->dims[1],
                               (uint64_t)list->dims[2] };
    planned->clip = trip_clip_before(&p->settings->clip, &list->index_to_world);
    trip_clip_simplify(&planned->clip, dims);
}

/* Sets the grid, clipping, table and view of a list that is drawn. */
static int place_list(const planning *p, const trip_list *list)
{
    trip_plan_list *planned = &p->plan->lists[list->index];
    planned->drawn = true;
    planned->table = p->table;
    planned->by_level = trip_lod_concerns(&p->plan->lod, list);
    place_clip(p, list, planned);
    int status = trip_list_grid_make(&planned->grid, p->data, list);
    if (!status && trip_kind_of(list->kind)->axis_bits > 0 &&
        p->plan->lod.chosen >> list->level & 1)
        status =
            trip_mean_tables_get(p->tables, p->data, list, p->table, p->budget, &planned->table);
    if (status)
        return status;
    planned->camera = *p->camera;
    if (memcmp(&list->index_to_world, &p->data->index_to_world, sizeof list->index_to_world) == 0)
        return 0;
    return trip_camera_make(&planned->camera, &p->camera->params, &list->index_to_world);
}

static int plan_layer(planning *p, int axis)
{
    int status = 0;
    for (unsigned i = 0; i < p->data->list_count && !status; i++)
        if (is_in_layer(p, &p->data->lists[i], axis))
            status = place_list(p, &p->data->lists[i]);
    if (!status)
        status = add_passes(p, axis);
    for (unsigned i = 0; i < p->data->list_count && !status; i++)
        if (is_in_layer(p, &p->data->lists[i], axis))
            status = select_bricks(p, &p->data->lists[i]);
    if (status)
        return status;
    trip_plan_layer *layer = &p->plan->layers[axis];
    drop_empty(p->plan, layer, p->budget);
    layer->parted = layer->pass_count == 2 && is_by_ways(p);
    return 0;
}

/* Plans a layer of interpolated values. */
static int plan_sheets(planning *p, int axis)
{
    trip_brick_ranges about;
    trip_brick_ranges_create(&about, p->data, &p->plan->draw, axis, p->settings->kernel,
                             p->plan->blurs, p->budget);
    p->about = &about;
    int status = plan_layer(p, axis);
    p->about = NULL;
    trip_brick_ranges_destroy(&about);
    return status;
}

static int take_lists(trip_plan *plan, unsigned count, trip_budget *budget)
{
    plan->list_count = count;
    plan->lists = trip_budget_take(budget, count * sizeof *plan->lists);
    plan->selections = trip_budget_take(budget, 2 * (size_t)count * sizeof *plan->selections);
    if (plan->lists && plan->selections)
        return 0;
    return trip_fail(TRIP_ERROR, "render", "plan",
                     "%u lists do not fit the memory given; raise --memory", count);
}

/* `post` reads no normals: it lights by differences of values. Coarse values have deviations. */
static unsigned planes_of(const trip_dataset *data, const trip_settings *settings)
{
    bool wanted = settings->shading || settings->flatten > 1;
    bool read = wanted && settings->classify == TRIP_CLASSIFY_PRE;
    unsigned normals = read ? 1u << TRIP_PLANE_NORMALS : 0;
    bool coarse = settings->classify == TRIP_CLASSIFY_POST && trip_settings_has_levels(settings) &&
                  settings->kernel != TRIP_KERNEL_NEAREST;
    unsigned deviations = coarse && settings->deviations ? 1u << TRIP_PLANE_DEVIATIONS : 0;
    return 1u << TRIP_PLANE_VOXELS | (data->header.planes & (normals | deviations));
}

/* Returns whether a list that the frame may draw has deviations, and the frame reads them. */
static bool has_deviations(const trip_dataset *data, unsigned planes)
{
    bool some = false;
    for (unsigned i = 0; i < data->list_count; i++)
        some |= data->lists[i].level == 0 && data->lists[i].planes >> TRIP_PLANE_DEVIATIONS & 1;
    return some && planes >> TRIP_PLANE_DEVIATIONS & 1;
}

int trip_plan_check_cells(const trip_dataset *data, const char *instead)
{
    for (int a = 0; a < 3; a++)
        if (data->header.dims[a] < 2)
            return trip_fail(
                TRIP_ERROR, "render", data->path,
                "is one voxel thick along %c and has no cells to interpolate in; use %s", "ijk"[a],
                instead);
    return 0;
}

int trip_plan_check_coordinates(const trip_dataset *data, const trip_settings *s)
{
    const char *why = NULL;
    if (!trip_coordinates_uneven(&data->coordinates))
        return 0;
    if (trip_kernel_is_wide(s->kernel))
        why = "only linear and nearest interpolation draw it";
    else if (s->footprint == TRIP_FOOTPRINT_FIXED || s->vertex_weights ||
             s->method == TRIP_METHOD_IMAGE)
        why = "fixed footprints, vertex weights and image-aligned sheets cannot draw it";
    return why ? trip_fail(TRIP_USAGE, "render", data->path, "has uneven spacing: %s", why) : 0;
}

/* Returns the draw codes of a frame that interpolates values. */
static trip_draw_codes draw_codes_of(const trip_dataset *data, const trip_draw_codes *draw)
{
    return draw ? *draw : trip_draw_codes_as_stored(&data->codes);
}

/* Decides whether classification has a closed form or looks up its integrals. */
static void plan_classification(const planning *p)
{
    trip_plan *plan = p->plan;
    trip_classification *c = p->classified;
    const bool effects = trip_effects_some(&p->settings->effects);
    const bool nearest = p->settings->kernel == TRIP_KERNEL_NEAREST;
    if (effects || nearest || plan->blurs)
        trip_classification_codes(c, p->data, p->settings->kernel);
    else
        trip_classification_form(c, p->data, p->settings->kernel, p->table);
    plan->code_min = c->code_min;
    plan->code_max = c->code_max;
    plan->not_closed = effects       ? TRIP_CLOSED_FORM_EFFECTS
                       : nearest     ? TRIP_CLOSED_FORM_NEAREST
                       : plan->blurs ? TRIP_CLOSED_FORM_BLURRED
                                     : c->not_closed;
    plan->closed = c->closed;
}

static void place_whole_clip(trip_plan *plan, const trip_dataset *data, const trip_camera *camera,
                             const trip_settings *settings)
{
    plan->clip = trip_clip_before(&settings->clip, &camera->index_to_world);
    trip_clip_simplify(&plan->clip, data->header.dims);
}

/* Adds the passes to read around the passes, if normals are computed. */
static int add_around(trip_plan *plan, const trip_dataset *data, trip_budget *budget)
{
    if (!data->computes_normals || !(plan->planes >> TRIP_PLANE_NORMALS & 1))
        return 0;
    int status = trip_plan_around_create(&plan->around, plan->list_count, budget);
    for (int axis = 0; axis < 3; axis++)
        for (int i = 0; i < plan->layers[axis].pass_count && !status; i++) {
            trip_plan_pass *pass = &plan->layers[axis].passes[i];
            status = trip_plan_around_add(&plan->around, &pass->pass, &pass->around, budget);
            pass->pass.around = &pass->around;
        }
    return status;
}

int trip_plan_make(trip_plan *plan, const trip_dataset *data, const trip_camera *camera,
                   const trip_settings *settings, const trip_tf_entry *table, trip_budget *budget)
{
    return trip_plan_make_next(plan, data, camera, settings, table, &(trip_classification){ 0 },
                               NULL, budget);
}

int trip_plan_make_next(trip_plan *plan, const trip_dataset *data, const trip_camera *camera,
                        const trip_settings *settings, const trip_tf_entry *table,
                        trip_classification *classified, trip_mean_tables *tables,
                        trip_budget *budget)
{
    planning p = { .plan = plan,
                   .data = data,
                   .camera = camera,
                   .settings = settings,
                   .table = table,
                   .tables = tables ? tables : &plan->own_tables,
                   .budget = budget,
                   .classified = classified };
    const bool interpolates = trip_settings_interpolates(settings, false);
    *plan = (trip_plan){ .axis_of_view = trip_weight_axis_of_view(camera),
                         .coordinates = &data->coordinates,
                         .planes = planes_of(data, settings),
                         .draw = draw_codes_of(data, interpolates ? classified->draw : NULL) };
    plan->blurs = has_deviations(data, plan->planes);
    place_whole_clip(plan, data, camera, settings);
    int status = trip_settings_check(settings);
    if (!status)
        status = trip_light_check(settings, &data->index_to_world);
    if (!status)
        status = trip_plan_check_coordinates(data, settings);
    if (!status && settings->classify == TRIP_CLASSIFY_POST)
        status = trip_plan_check_cells(data, "--classify pre");
    if (!status && settings->classify == TRIP_CLASSIFY_PRE)
        status = trip_lod_make(&plan->lod, data, TRIP_KIND_MEANS, camera, settings, budget);
    if (!status)
        status = take_lists(plan, data->list_count, budget);
    for (int axis = 0; axis < 3 && !status; axis++) {
        trip_plan_layer *layer = &plan->layers[axis];
        layer->used =
            settings->show != TRIP_SHOW_MERGE &&
            trip_weight_is_somewhere(settings, camera, plan->axis_of_view, axis, TRIP_WAY_ANY);
        if (layer->used)
            status = settings->classify == TRIP_CLASSIFY_POST ? plan_sheets(&p, axis)
                                                              : plan_layer(&p, axis);
    }
    if (!status && settings->classify == TRIP_CLASSIFY_POST)
        plan_classification(&p);
    if (!status)
        status = add_around(plan, data, budget);
    if (status)
        trip_plan_release(plan, budget);
    return status;
}

static bool is_gathered(const trip_list *list, unsigned kinds)
{
    return list->axis == 2 && list->level == 0 && kinds >> list->kind & 1;
}

/* Selects all bricks of a list. */
static int gather_list(const planning *p, trip_plan_pass *pass, const trip_list *list)
{
    trip_plan *plan = p->plan;
    trip_plan_list *planned = &plan->lists[list->index];
    int status = place_list(p, list);
    if (!status)
        status = trip_selection_create_whole(&plan->selections[plan->selection_count], p->data,
                                             list, false, p->budget);
    if (status)
        return status;
    plan->selection_count++;
    pass->pass.selection_count++;
    planned->bricks = planned->bricks_selected = list->brick_count;
    planned->splats_selected = list->records;
    for (int plane = 0; plane < TRIP_PLANES; plane++)
        planned->bytes_selected[plane] = list->plane_bytes[plane];
    return 0;
}

static int gather_lists(const planning *p, unsigned kinds)
{
    trip_plan_layer *layer = &p->plan->layers[2];
    trip_plan_pass *pass = &layer->passes[0];
    int status = 0;
    *pass =
        (trip_plan_pass){ .pass = { .selections = p->plan->selections }, .front_to_back = true };
    for (unsigned i = 0; i < p->data->list_count && !status; i++)
        if (p->data->lists[i].records > 0 && is_gathered(&p->data->lists[i], kinds))
            status = gather_list(p, pass, &p->data->lists[i]);
    layer->pass_count = pass->pass.selection_count > 0;
    layer->used = layer->pass_count > 0;
    return status;
}

/* The integral through values takes gradients as differences of values. Rounded normals would
 * change it. Splats are lit by their stored normals. */
static unsigned planes_gathered(const trip_dataset *data, const trip_settings *s)
{
    return s->field == TRIP_FIELD_SPLATS ? planes_of(data, s) : 1u << TRIP_PLANE_VOXELS;
}

int trip_plan_make_field(trip_plan *plan, const trip_dataset *data, const trip_camera *camera,
                         const trip_settings *settings, unsigned kinds, const trip_draw_codes *draw,
                         trip_budget *budget)
{
    const planning p = {
        .plan = plan, .data = data, .camera = camera, .settings = settings, .budget = budget
    };
    *plan = (trip_plan){ .axis_of_view = trip_weight_axis_of_view(camera),
                         .coordinates = &data->coordinates,
                         .gathers = true,
                         .draw = draw_codes_of(data, draw),
                         .planes = planes_gathered(data, settings) };
    place_whole_clip(plan, data, camera, settings);
    int status = trip_light_check(settings, &data->index_to_world);
    if (!status)
        status = trip_plan_check_coordinates(data, settings);
    if (!status)
        status = take_lists(plan, data->list_count, budget);
    if (!status)
        status = gather_lists(&p, kinds);
    if (!status)
        status = add_around(plan, data, budget);
    if (status)
        trip_plan_release(plan, budget);
    return status;
}

void trip_plan_release(trip_plan *plan, trip_budget *budget)
{
    size_t count = plan->list_count;
    for (unsigned i = 0; i < plan->selection_count; i++)
        trip_selection_destroy(&plan->selections[i], budget);
    trip_plan_around_release(&plan->around, budget);
    trip_mean_tables_release(&plan->own_tables, budget);
    trip_lod_release(&plan->lod, budget);
    trip_budget_release(budget, plan->selections, 2 * count * sizeof *plan->selections);
    trip_budget_release(budget, plan->lists, count * sizeof *plan->lists);
    *plan = (trip_plan){ 0 };
}

/* Prints the footprint settings that differ from the defaults. */
static void explain_footprints(const trip_settings *s, FILE *out)
{
    if (s->footprint == TRIP_FOOTPRINT_EWA)
        fprintf(out,
                "kernel      ewa: footprints by the affine approximation at each splat's centre\n");
    if (s->footprint == TRIP_FOOTPRINT_FIXED)
        fprintf(out, "kernel      fixed: every footprint is %.4g pixels wide\n", s->sprite_px);
    if (s->low_pass == TRIP_LOW_PASS_NONE)
        fprintf(out, "low-pass    does not run: switched off\n");
    else if (s->low_pass == TRIP_LOW_PASS_UNIFORM)
        fprintf(out, "low-pass    uniform: footprints are scaled until no axis is shorter than the "
                     "filter's\n");
    if (s->low_pass != TRIP_LOW_PASS_NONE && s->low_pass_px != TRIP_LOW_PASS_PX)
        fprintf(out, "low-pass    the filter's standard deviation is %g pixels\n", s->low_pass_px);
    if (s->flatten > 1)
        fprintf(out, "flattening  runs: kernels are up to %g times flatter along gradients\n",
                s->flatten);
}

bool trip_plan_halo_is_short(const trip_dataset *data, const trip_settings *s)
{
    const trip_file_header *h = &data->header;
    return s->classify == TRIP_CLASSIFY_POST && trip_kernel_is_wide(s->kernel) &&
           h->kept < h->dims[0] * h->dims[1] * h->dims[2];
}

static void explain_kernel(const trip_dataset *data, const trip_settings *s, FILE *out)
{
    if (s->classify == TRIP_CLASSIFY_POST && s->kernel == TRIP_KERNEL_NEAREST)
        fprintf(out, "kernel      nearest: each voxel has its own value up to half-way to the "
                     "next\n");
    if (s->classify != TRIP_CLASSIFY_POST || !trip_kernel_is_wide(s->kernel))
        return;
    fprintf(out, "kernel      %s: interpolates between 64 voxels%s\n", trip_kernel_name(s->kernel),
            trip_plan_halo_is_short(data, s)
                ? "; missing voxels count as the nearest corner of the cell"
                : "");
}

static void explain_codes(const trip_plan *plan, FILE *out)
{
    const trip_draw_codes *d = &plan->draw;
    if (d->of_stored)
        fprintf(out, "codes       uneven, drawn as even codes of the values from %.9g to %.9g\n",
                d->lo, d->hi);
}

static void explain_method(const trip_plan *plan, const trip_settings *s, FILE *out)
{
    if (plan->gathers) {
        fprintf(
            out,
            "method      integral: each ray is integrated through %s, each component within %g\n",
            s->field == TRIP_FIELD_SPLATS ? "the sum of the splats" : "the interpolated values",
            s->tolerance);
        return;
    }
    if (s->classify == TRIP_CLASSIFY_PRE)
        fprintf(out, "classify    pre: voxels are classified, then splatted\n");
    else
        fprintf(
            out,
            "classify    post: values are interpolated at %d sample%s per sheet, then classified\n",
            s->samples_per_sheet, s->samples_per_sheet == 1 ? "" : "s");
    explain_codes(plan, out);
    if (trip_settings_sum_sheets(s))
        fprintf(
            out,
            "compositing sheet: the splats of each sheet are added, then composited together\n");
    explain_footprints(s, out);
    fprintf(out, "termination below %g of transmittance a pixel takes no more samples or splats\n",
            trip_settings_early_termination(s));
    switch (s->method) {
    case TRIP_METHOD_MERGE:
        fprintf(out,
                "method      merge: the layers of up to three lists are blended by w^2, h = %g%s\n",
                trip_settings_h(s),
                s->vertex_weights ? ", w interpolated between the corners of splats" : "");
        break;
    case TRIP_METHOD_CLIP:
        fprintf(out, "method      clip: each pixel is drawn from the list that its ray is most "
                     "aligned with\n");
        break;
    case TRIP_METHOD_IMAGE:
        fprintf(out,
                "method      image: the splats of list %c are cut into sheets parallel to the "
                "image plane\n",
                axis_names[plan->axis_of_view]);
        break;
    case TRIP_METHOD_AXIS:
        fprintf(
            out,
            "method      axis: list %c alone is drawn; the ray at the image centre selects it\n",
            axis_names[plan->axis_of_view]);
        break;
    }
}

/* Prints how `post` classifies. `pre` needs no line: it reads one table entry per voxel. */
static void explain_classification(const trip_plan *plan, const trip_settings *s, FILE *out)
{
    static const char *const why[] = {
        [TRIP_CLOSED_FORM_ENDS] = "neither the minimum nor the maximum value is visible",
        [TRIP_CLOSED_FORM_EXTINCTION] = "extinction is not linear in the value, nor close to it",
        [TRIP_CLOSED_FORM_COLOUR] = "colours are not linear in the value",
        [TRIP_CLOSED_FORM_NEAREST] = "values are not interpolated",
        [TRIP_CLOSED_FORM_EFFECTS] = "frames with effects always do so",
        [TRIP_CLOSED_FORM_BLURRED] = "deviations of coarse values blur the function",
    };
    const double *k = plan->closed.k;
    if (plan->gathers || s->classify != TRIP_CLASSIFY_POST)
        return;
    if (plan->not_closed)
        fprintf(out, "integrals   are looked up: %s\n", why[plan->not_closed]);
    else
        fprintf(out,
                "integrals   have a closed form: extinction is %s, colours are %s; cpu and gl "
                "need no lookup\n",
                k[1] != 0 || k[2] != 0 || k[3] != 0 ? "linear in the value, or nearly" : "constant",
                plan->closed.coloured ? "linear" : "constant");
}

static void explain_levels(const trip_plan *plan, const trip_settings *s, FILE *out)
{
    if (!trip_settings_has_levels(s) || plan->gathers || s->classify == TRIP_CLASSIFY_POST ||
        s->show == TRIP_SHOW_MERGE)
        return;
    char chosen[64] = "the finest";
    const char *bound = s->max_bytes > 0 ? ", or coarser to keep the bound on bytes" : "";
    if (s->lod_px > 0)
        snprintf(chosen, sizeof chosen, "the coarsest with voxels at most %g pixels wide",
                 s->lod_px);
    if (plan->lod.level)
        fprintf(out, "levels      run: each cube of %d voxels a side has one of %u levels: %s%s\n",
                1 << plan->lod.cube_log2, plan->lod.levels + 1, chosen, bound);
    else
        fprintf(out, "levels      do not run: the data set has none\n");
}

static void explain_limit(const trip_plan *plan, const trip_settings *s, FILE *out)
{
    const trip_lod_limit *l = &plan->lod.limit;
    char max[32], full[32], bytes[32];
    if (!plan->lod.level || !(s->max_bytes > 0) || plan->gathers)
        return;
    trip_format_bytes((uint64_t)fmin(s->max_bytes, 1e18), max);
    trip_format_bytes((uint64_t)l->full_bytes, full);
    trip_format_bytes((uint64_t)l->bytes, bytes);
    if (l->px > 0)
        fprintf(out,
                "bound       %s of codes and normals in view: levels are chosen as if voxels "
                "could be %.3g pixels wide, which leaves %s of %s in view\n",
                max, l->px, bytes, full);
    else
        fprintf(out, "bound       %s of codes and normals in view: the levels need only %s\n", max,
                full);
}

static void explain_clip(const trip_plan *plan, const trip_settings *s, FILE *out)
{
    if (s->clip.count == 0 || s->show == TRIP_SHOW_MERGE)
        return;
    if (plan->clip.count == 0)
        fprintf(out, "clipping    does not run: the whole grid lies inside\n");
    else
        fprintf(out, "clipping    runs: %d plane%s the grid\n", plan->clip.count,
                plan->clip.count > 1 ? "s cut" : " cuts");
}

static void explain_passes(const trip_plan *plan, const trip_list *list, FILE *out)
{
    const trip_plan_layer *layer = &plan->layers[list->axis];
    const char *before = "            ";
    if (plan->gathers) {
        fprintf(out, "%sall sheets\n", before);
        return;
    }
    for (int i = 0; i < layer->pass_count; i++) {
        const trip_selection *s = selection_in(plan, list->axis, i, list);
        if (!s)
            continue;
        fprintf(out, "%ssheets %" PRId64 " to %" PRId64 " %s, %s%s", before, s->sheet_first,
                s->sheet_last, s->descending ? "descending" : "ascending",
                layer->passes[i].front_to_back ? "front to back" : "back to front",
                layer->parted ? ", for rays in that direction" : "");
        before = "; then ";
    }
    fprintf(out, "\n");
}

static bool is_read(const trip_plan *plan, const trip_list *list)
{
    const trip_plan_layer *layer = &plan->layers[list->axis];
    for (int i = 0; i < layer->pass_count; i++)
        if (selection_in(plan, list->axis, i, list))
            return true;
    return false;
}

static const char *why_not_drawn(const trip_plan *plan, const trip_settings *s,
                                 const trip_list *list)
{
    const bool post = s->classify == TRIP_CLASSIFY_POST;
    if (s->show == TRIP_SHOW_MERGE)
        return ": the merge map shows no part of the volume";
    if (plan->gathers)
        return list->level > 0   ? ": only the finest level is drawn"
               : list->axis != 2 ? ": list z holds the same voxels"
                                 : ": its records are not splatted";
    if (!is_of(s, list))
        return post ? ": it has no values to interpolate" : ": its records are not splatted";
    const bool other = post ? list->level != plan->level
                            : trip_kind_of(list->kind)->coarse &&
                                  !(plan->lod.level && list->level <= plan->lod.levels);
    if (other)
        return post && trip_settings_has_levels(s) ? ": the frame is drawn at another level"
                                                   : ": only the finest level is drawn";
    return ": no ray of the view has weight in it";
}

/* Returns the reasons that apply to some frames only. */
static const char *rarer_reasons(const trip_plan_list *planned, char text[96])
{
    int length = 0;
    text[0] = 0;
    if (planned->by_level)
        length =
            snprintf(text, 96, ", %" PRIu64 " of other levels", planned->bricks_of_other_levels);
    if (planned->clip.count > 0)
        snprintf(text + length, 96 - (size_t)length, ", %" PRIu64 " clipped",
                 planned->bricks_clipped);
    return text;
}

static void explain_list(const trip_plan *plan, const trip_settings *s, const trip_list *list,
                         FILE *out)
{
    const trip_plan_list *planned = &plan->lists[list->index];
    char name[24], bytes[32], others[96];
    fprintf(out, "list %-6s ", trip_plan_list_name(list, name));
    if (!planned->drawn) {
        fprintf(out, "not read%s\n", why_not_drawn(plan, s, list));
        return;
    }
    uint64_t bytes_read = 0;
    for (int plane = 0; plane < TRIP_PLANES; plane++)
        bytes_read += plan->planes >> plane & 1 ? planned->bytes_selected[plane] : 0;
    bool read = is_read(plan, list);
    fprintf(out,
            "%s: %" PRIu64 " of %" PRIu64 " bricks, %" PRIu64 " %s, %s (left out: %" PRIu64
            " transparent, %" PRIu64 " out of view, %" PRIu64 " without weight%s)\n",
            read ? "read" : "empty", planned->bricks_selected, planned->bricks,
            planned->splats_selected, s->classify == TRIP_CLASSIFY_POST ? "voxels" : "splats",
            trip_format_bytes(bytes_read, bytes), planned->bricks_transparent,
            planned->bricks_outside, planned->bricks_without_weight,
            rarer_reasons(planned, others));
    if (read)
        explain_passes(plan, list, out);
}

const char *trip_plan_list_name(const trip_list *list, char name[24])
{
    const char *kind = list->kind == TRIP_KIND_VOXELS ? "" : trip_kind_of(list->kind)->name;
    if (list->level == 0)
        snprintf(name, 24, "%c%s%s", "xyz"[list->axis], *kind ? " " : "", kind);
    else
        snprintf(name, 24, "%c%u%s%s", "xyz"[list->axis], list -> level, *kind ? " " : "", kind);
    return name;
}

uint64_t trip_plan_square(const trip_plan *plan, const trip_list *list, int64_t sheet, int64_t u,
                          int64_t v)
{
    const trip_plan_list *planned = &plan->lists[list->index];
    uint64_t drawn = UINT64_MAX;
    if (planned->by_level)
        drawn = trip_lod_square(&plan->lod, list, sheet, u, v);
    if (drawn && planned->clip.count > 0)
        drawn &= trip_coordinates_uneven(plan->coordinates)
                     ? trip_clip_uneven_square(&planned->clip, plan->coordinates, list->axis,
                                               (const int64_t[3]){ u, v, sheet })
                     : trip_clip_square(&planned->clip, list->axis, sheet, u, v);
    return drawn;
}

bool trip_plan_draws_all(const trip_plan *plan, const trip_list *list)
{
    const trip_plan_list *planned = &plan->lists[list->index];
    return !planned->by_level && planned->clip.count == 0;
}

uint64_t trip_plan_splats(const trip_plan *plan)
{
    uint64_t splats = 0;
    for (unsigned i = 0; i < plan->list_count; i++)
        splats += plan->lists[i].splats_selected;
    return splats;
}

uint64_t trip_plan_bytes_left_out(const trip_plan *plan, const trip_dataset *data)
{
    unsigned left_out = data->header.planes & ~plan->planes;
    uint64_t bytes = 0;
    for (unsigned i = 0; i < plan->list_count; i++)
        for (int plane = 0; plane < TRIP_PLANES; plane++)
            bytes += left_out >> plane & 1 ? plan->lists[i].bytes_selected[plane] : 0;
    return bytes;
}

trip_way trip_plan_way(const trip_plan *plan, int axis, bool descending)
{
    return !plan->layers[axis].parted ? TRIP_WAY_ANY : descending ? TRIP_WAY_DOWN : TRIP_WAY_UP;
}

bool trip_plan_is_of_values(const trip_plan *plan, const trip_settings *s)
{
    return plan->gathers ? s->field == TRIP_FIELD_VALUES : s->classify == TRIP_CLASSIFY_POST;
}

static void explain_shading(const trip_plan *plan, const trip_dataset *data, const trip_settings *s,
                            FILE *out)
{
    const char *light = s->headlight     ? "from the eye"
                        : s->point_light ? "from the given position"
                                         : "from a direction";
    char bytes[32];
    const bool of_values = trip_plan_is_of_values(plan, s);
    if (s->show == TRIP_SHOW_MERGE)
        fprintf(out, "shading     does not run: the merge map shows no part of the volume\n");
    else if (of_values && s->shading)
        fprintf(out, "shading     runs, lit %s; gradients are differences of the values\n", light);
    else if (of_values)
        fprintf(out, "shading     does not run: switched off\n");
    else if (!s->shading && s->flatten > 1)
        fprintf(out, "shading     does not run: switched off\n");
    else if (plan->planes & 1u << TRIP_PLANE_NORMALS)
        fprintf(out, "shading     runs, lit %s\n", light);
    else if (!(data->header.planes & 1u << TRIP_PLANE_NORMALS))
        fprintf(out, "shading     does not run: the data set has no normals\n");
    else
        fprintf(out, "shading     does not run: switched off; normal planes are not read, %s\n",
                trip_format_bytes(trip_plan_bytes_left_out(plan, data), bytes));
}

/* Prints where the gradients of splats come from. */
static void explain_normals(const trip_plan *plan, const trip_dataset *data, FILE *out)
{
    char bytes[32];
    uint64_t sum = 0;
    if (!(plan->planes & 1u << TRIP_PLANE_NORMALS))
        return;
    for (unsigned i = 0; i < plan->list_count; i++)
        sum += plan->lists[i].bytes_selected[TRIP_PLANE_NORMALS];
    if (data->computes_normals)
        fprintf(out,
                "gradients   are differences of the values, computed while reading: %s more are "
                "read for them\n",
                trip_format_bytes(plan->around.bytes, bytes));
    else
        fprintf(out, "gradients   are the stored normals: normal planes are read, %s\n",
                trip_format_bytes(sum, bytes));
}

void trip_plan_explain(const trip_plan *plan, const trip_dataset *data,
                       const trip_settings *settings, FILE *out)
{
    int used = 0;
    explain_method(plan, settings, out);
    if (!plan->gathers)
        explain_kernel(data, settings, out);
    explain_classification(plan, settings, out);
    explain_levels(plan, settings, out);
    explain_limit(plan, settings, out);
    explain_clip(plan, settings, out);
    for (unsigned i = 0; i < data->list_count; i++) {
        const trip_list *list = &data->lists[i];
        if (trip_dataset_parts(data) > 1 && (i == 0 || list[-1].part != list->part))
            fprintf(out, "data set    %s\n", list->path);
        explain_list(plan, settings, list, out);
    }
    for (int axis = 0; axis < 3; axis++)
        used += plan->layers[axis].pass_count > 0;
    explain_shading(plan, data, settings, out);
    if (!trip_plan_is_of_values(plan, settings) && settings->show != TRIP_SHOW_MERGE)
        explain_normals(plan, data, out);
    if (plan->gathers)
        return;
    if (used > 1)
        fprintf(out, "merge       runs: %d layers are blended\n", used);
    else
        fprintf(out, "merge       copies: %s\n",
                used ? "one layer has all the weight or all the splats" : "nothing is drawn");
}
