/* The CPU renderer. Its threads project the voxels of a batch into splats and sort the splats by
 * pane. They blend each pane's splats in list order while the next batch is projected.
 *
 * A pixel depends only on the order of the splats, never on where a batch, chunk or splat buffer
 * ends. So the picture is the same, bit for bit, for any number of threads, memory, tile size and
 * batch size.
 *
 * After an interrupt the tasks return without work, so waiting for them ends at once. */
#include "cpu/cpu_renderer.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "cpu/cpu_batch.h"
#include "cpu/occlusion.h"
#include "cpu/sheets/cpu_sheets.h"
#include "cpu/panes.h"
#include "cpu/cpu_view.h"
#include "light_map.h"
#include "report.h"
#include "sheet.h"

enum { MAX_SPLATS = 1 << 17, MIN_SPLATS = 1 << 13 };

/* ---- layers ---- */

static bool classifies_post(const trip_cpu *r)
{
    return r->frame->settings->classify == TRIP_CLASSIFY_POST;
}

static void make_views(trip_cpu *r, bool front_to_back, bool normals)
{
    const trip_dataset *data = r->frame->data;
    const int axis = r->view.axis;
    const trip_way way = r->view.way;
    trip_cpu_layer_view_make(&r->view, r->frame, axis, front_to_back);
    r->view.way = way;
    r->view.shading = normals && r->frame->settings->shading;
    r->view.flattens = normals && r->view.splat.flatten > 0;
    for (unsigned i = 0; i < data->list_count; i++) {
        const trip_list *list = &data->lists[i];
        if (list->axis != axis || !r->frame->plan->lists[i].drawn)
            continue;
        trip_cpu_view_make(&r->views[i], classifies_post(r) ? &r->sheet_frame : r->frame, list,
                           front_to_back);
        r->views[i].way = way;
        r->views[i].shading = r->view.shading;
        r->views[i].flattens = r->view.flattens;
        if (!classifies_post(r))
            trip_cpu_view_set_table(&r->views[i], r->frame->plan->lists[i].table,
                                    r->frame->plan->lists[i].shown);
        if (!r->frame->count)
            continue;
        trip_cpu_view_make(&r->counted_views[i], &r->counted_frame, list, front_to_back);
        r->counted_views[i].way = way;
    }
}

/* Starts an empty layer of an axis. If the axis has a layer for each direction of rays, `way`
 * selects it. */
static void start_layer(trip_cpu *r, int axis, trip_way way)
{
    r->view.axis = axis;
    r->view.way = way;
    make_views(r, true, false);
    trip_cpu_begin_pane_layer(r);
    r->visible_per_voxel = 1;
}

/* If the batch's pass draws rays in another direction, merges the layer and starts the next one. */
static void use_way(trip_cpu *r, const trip_batch *batch)
{
    const trip_way way = trip_plan_way(r->frame->plan, r->view.axis, batch->pass->descending);
    if (way == r->view.way)
        return;
    trip_cpu_merge_layer(r);
    start_layer(r, r->view.axis, way);
}

static int draw(trip_renderer *base, const trip_batch *batch, bool front_to_back)
{
    trip_cpu *r = (trip_cpu *)base;
    if (classifies_post(r))
        return trip_cpu_sheets_draw(r->sheets, batch);
    use_way(r, batch);
    bool normals = batch->planes[TRIP_PLANE_NORMALS];
    bool shading = r->frame->settings->shading && normals;
    bool flattens = r->view.splat.flatten > 0 && normals;
    if (front_to_back != r->view.front_to_back || shading != r->view.shading ||
        flattens != r->view.flattens) {
        trip_cpu_finish_blending(r);
        make_views(r, front_to_back, normals);
    }
    return trip_cpu_draw_batch(r, batch);
}

static int end_layer(trip_cpu *r)
{
    if (!r->in_layer)
        return 0;
    int status = classifies_post(r) ? trip_cpu_sheets_end_layer(r->sheets) : 0;
    if (status)
        return status;
    trip_cpu_merge_layer(r);
    r->in_layer = false;
    return trip_frame_poll();
}

static int begin_layer(trip_renderer *base, int axis)
{
    trip_cpu *r = (trip_cpu *)base;
    int status = end_layer(r);
    if (status)
        return status;
    start_layer(r, axis, trip_plan_way(r->frame->plan, axis, false));
    r->in_layer = true;
    return classifies_post(r) ? trip_cpu_sheets_begin_layer(r->sheets, axis) : 0;
}

static int end_passes(trip_renderer *base)
{
    trip_cpu *r = (trip_cpu *)base;
    return r->in_layer && classifies_post(r) ? trip_cpu_sheets_end_layer(r->sheets) : 0;
}

/* ---- frames ---- */

static void release_lists(trip_cpu *r)
{
    size_t bytes = r->list_room * sizeof *r->views;
    trip_budget_release(r->budget, r->views, bytes);
    trip_budget_release(r->budget, r->counted_views, bytes);
    trip_budget_release(r->budget, r->stats, r->list_room * sizeof *r->stats);
    r->views = r->counted_views = NULL;
    r->stats = NULL;
    r->list_room = 0;
}

/* Makes room for the data set's lists and sets their counts to 0. */
static int fit_lists(trip_cpu *r)
{
    unsigned wanted = r->frame->data->list_count;
    if (wanted > r->list_room)
        release_lists(r);
    r->list_room = wanted > r->list_room ? wanted : r->list_room;
    size_t bytes = r->list_room * sizeof *r->views;
    if (!r->views)
        r->views = trip_budget_take(r->budget, bytes);
    if (!r->counted_views && r->frame->count)
        r->counted_views = trip_budget_take(r->budget, bytes);
    if (!r->stats)
        r->stats = trip_budget_take(r->budget, r->list_room * sizeof *r->stats);
    if (r->stats)
        memset(r->stats, 0, r->list_room * sizeof *r->stats);
    if (r->views && r->stats && (r->counted_views || !r->frame->count))
        return 0;
    return trip_fail(TRIP_ERROR, "render", "CPU renderer",
                     "%u lists do not fit the memory given; raise --memory", wanted);
}

/* Returns the capacity of each splat buffer. Both together take about an eighth of the memory. */
static uint32_t buffer_capacity(const trip_budget *budget)
{
    uint64_t each = trip_budget_limit_bytes(budget) / 16 / 100; /* about 100 bytes per splat */
    return each < MIN_SPLATS ? MIN_SPLATS : each > MAX_SPLATS ? MAX_SPLATS : (uint32_t)each;
}

static void release_buffers(trip_cpu *r)
{
    for (int i = 0; i < 2; i++) {
        trip_cpu_buffer_destroy(&r->buffers[i], r->budget);
        r->buffers[i] = (trip_cpu_buffer){ 0 };
    }
    r->filling = NULL;
}

static int create_buffers(trip_cpu *r)
{
    int status = 0;
    for (int i = 0; i < 2 && !status; i++)
        status = trip_cpu_buffer_create(&r->buffers[i], buffer_capacity(r->budget), r->budget);
    r->filling = &r->buffers[0];
    return status;
}

/* Fits empty splat buffers to the frame's panes. Releases the buffers if the frame draws no splats.
 */
static int fit_buffers(trip_cpu *r)
{
    if (classifies_post(r)) {
        release_buffers(r);
        return 0;
    }
    int status = r->buffers[1].splats ? 0 : create_buffers(r);
    for (int i = 0; i < 2 && !status; i++)
        status = trip_cpu_buffer_fit(&r->buffers[i], trip_cpu_pane_count(r),
                                     r->channels > TRIP_CHANNEL_DEPTH, r->budget);
    if (status)
        release_buffers(r);
    else
        trip_cpu_buffer_empty(r->filling);
    return status;
}

static int begin_sheets(trip_cpu *r)
{
    int status = r->sheets ? 0 : trip_cpu_sheets_create(&r->sheets, r);
    r->sheet_settings = *r->frame->settings;
    r->sheet_settings.kernel_radius = trip_sheet_radius(r->frame->settings->kernel);
    r->sheet_frame = *r->frame;
    r->sheet_frame.settings = &r->sheet_settings;
    return status ? status : trip_cpu_sheets_begin_frame(r->sheets, r);
}

/* Refuses summed sheets of exact kernels on grids with uneven spacing. There each kernel has its
 * own index space, and rays differ in length between these spaces. A summed splat has no room for
 * the lengths of its own rays; affine kernels need none. */
static int check_kernels(const trip_frame *frame)
{
    const trip_settings *s = frame->settings;
    if (s->footprint == TRIP_FOOTPRINT_EWA || s->classify == TRIP_CLASSIFY_POST ||
        !trip_settings_sum_sheets(s) || frame->camera->ortho ||
        !trip_coordinates_uneven(&frame->data->coordinates))
        return 0;
    return trip_fail(
        TRIP_USAGE, "render", "cpu",
        "--compositing sheet cannot sum exact kernels on a grid with uneven spacing; use "
        "--kernel ewa or --compositing splat");
}

/* The plain kernels (kernels/sheet_tmpl.h) draw sheets with uneven spacing and sheets interpolated
 * from 64 voxels. */
static void choose_kernels(trip_cpu *r)
{
    const trip_settings *s = r->frame->settings;
    r->draws_plain =
        s->classify == TRIP_CLASSIFY_POST &&
        (trip_coordinates_uneven(&r->frame->data->coordinates) || trip_kernel_is_wide(s->kernel));
    const trip_cpu_kernels *isa = r->draws_plain ? &trip_cpu_plain : r->isa;
    r->kernels = s->depth ? isa->with_depth : isa;
    r->project = trip_effects_some(&s->effects) ? r->kernels->project_effects : r->kernels->project;
}

static int begin_frame(trip_renderer *base, const trip_frame *frame)
{
    trip_cpu *r = (trip_cpu *)base;
    r->in_layer = false;
    r->frame = frame;
    choose_kernels(r);
    for (unsigned i = 0; i < trip_cpu_pool_threads(r->pool); i++)
        r->workers[i].scratch.lanes.broken = false;
    if (classifies_post(r))
        release_buffers(r);
    int status = check_kernels(frame);
    if (!status)
        status = trip_cpu_fit_panes(r, frame->camera->width, frame->first_row,
                                    frame->rows ? frame->rows : frame->camera->height);
    if (!status)
        status = fit_buffers(r);
    if (!status)
        status = fit_lists(r);
    if (!status && frame->count)
        status = trip_cpu_begin_counting(r);
    if (!status && classifies_post(r))
        status = begin_sheets(r);
    if (status)
        return status;
    trip_cpu_layer_view_make(&r->view, frame, frame->plan->axis_of_view, true);
    trip_cpu_begin_panes(r);
    return 0;
}

static int picture(trip_renderer *base, float *rgba, float *depth)
{
    trip_cpu *r = (trip_cpu *)base;
    trip_cpu_finish_picture(r, rgba, depth);
    return trip_frame_poll();
}

/* Waits, because the threads may still blend the last splat buffer. */
static void end_frame(trip_renderer *base)
{
    trip_cpu *r = (trip_cpu *)base;
    trip_cpu_pool_wait(r->pool, &r->blend_job);
}

static trip_list_stats stats(const trip_renderer *base, unsigned list)
{
    return ((const trip_cpu *)base)->stats[list];
}

static const char *device(const trip_renderer *base)
{
    const trip_cpu *r = (const trip_cpu *)base;
    return r->draws_plain ? r->plain_device : r->device;
}

static void destroy(trip_renderer *base)
{
    trip_cpu *r = (trip_cpu *)base;
    trip_budget *budget = r->budget;
    trip_cpu_sheets_destroy(r->sheets);
    trip_cpu_pool_destroy(r->pool);
    trip_cpu_release_panes(r);
    release_lists(r);
    release_buffers(r);
    trip_budget_release(budget, r->workers, r->workers_bytes);
    trip_budget_release(budget, r->visible, TRIP_CPU_COUNT_TABLE_BYTES);
    trip_budget_release(budget, r, sizeof *r);
}

typedef struct tasks {
    void (*task)(void *context, unsigned number);
    void *context;
} tasks;

static void run_task(void *context, unsigned number, unsigned thread)
{
    const tasks *t = context;
    (void)thread;
    t->task(t->context, number);
}

static void run_tasks(void *renderer, void (*task)(void *context, unsigned number), void *context,
                      unsigned count)
{
    trip_cpu *r = renderer;
    if (r->blend_job.active) { /* the pool is busy, so the caller runs the tasks */
        trip_run_tasks(NULL, task, context, count);
        return;
    }
    tasks all = { task, context };
    trip_cpu_job job = { .run = run_task, .context = &all, .tasks = count };
    trip_cpu_pool_start(r->pool, &job);
    trip_cpu_pool_wait(r->pool, &job);
}

static const trip_renderer_ops cpu_ops = {
    .name = "cpu",
    .classifies_post = true,
    .blurs = true,
    .closed_forms = true,
    .effects = 1u << TRIP_CLASSIFY_PRE | 1u << TRIP_CLASSIFY_POST,
    .destroy = destroy,
    .device = device,
    .begin_frame = begin_frame,
    .begin_layer = begin_layer,
    .draw = draw,
    .end_passes = end_passes,
    .picture = picture,
    .end_frame = end_frame,
    .run_tasks = run_tasks,
    .stats = stats,
};

/* Returns the view of a list's level along its axis. Lists that are read for normals alone have no
 * view of their own. */
static const trip_cpu_view *view_of_level(const trip_cpu *r, const trip_list *list)
{
    const trip_list *lists = r->frame->data->lists;
    unsigned i = list->index;
    if (!r->frame->plan->lists[i].drawn)
        for (i = 0; lists[i].axis != list->axis || lists[i].level != list->level ||
                    !r->frame->plan->lists[i].drawn;)
            i++;
    return &r->views[i];
}

bool trip_cpu_occluded(void *renderer, const trip_selection *selection, const trip_run *run)
{
    trip_cpu *r = renderer;
    if (r->base.ops != &cpu_ops || !r->in_layer || selection->list->axis != r->view.axis ||
        trip_plan_way(r->frame->plan, r->view.axis, selection->descending) != r->view.way ||
        !r->view.front_to_back || r->view.coordinates)
        return false;
    const trip_cpu_view *view = view_of_level(r, selection->list);
    trip_cpu_box box = trip_cpu_brick_box(r->frame->data, selection->list, run->brick,
                                          selection->sheet_first, selection->sheet_last);
    for (int i = 0; i < 3 && selection->ahead; i++)
        box.half[i]++; /* the normals of voxels beside the brick depend on it */
    return trip_cpu_box_occlusion(view, &r->mask, &box) == TRIP_CPU_OCCLUDED;
}

/* ---- creation ---- */

static void describe(char device[TRIP_CPU_DEVICE], const trip_cpu_kernels *isa, unsigned threads)
{
    snprintf(device, TRIP_CPU_DEVICE, "CPU, %s, %u thread%s", isa->isa, threads,
             threads == 1 ? "" : "s");
}

static int create_parts(trip_cpu *r, unsigned threads)
{
    int status = trip_cpu_pool_create(&r->pool, threads);
    if (status)
        return status;
    threads = trip_cpu_pool_threads(r->pool);
    r->workers_bytes = threads * sizeof *r->workers;
    r->workers = trip_budget_take(r->budget, r->workers_bytes);
    if (!r->workers) {
        r->workers_bytes = 0;
        return trip_fail(TRIP_ERROR, "render", "CPU renderer",
                         "%u threads do not fit the memory given; raise --memory", threads);
    }
    status = create_buffers(r);
    describe(r->device, r->isa, threads);
    describe(r->plain_device, &trip_cpu_plain, threads);
    return status;
}

int trip_cpu_create(trip_renderer **out, trip_budget *budget, unsigned threads)
{
    *out = NULL;
    const trip_cpu_kernels *kernels = trip_cpu_isa_choose(getenv("TRIPTYCH_ISA"));
    if (!kernels)
        return TRIP_USAGE;
    trip_cpu *r = trip_budget_take(budget, sizeof *r);
    if (!r)
        return trip_fail(TRIP_ERROR, "render", "CPU renderer", "out of memory");
    r->base.ops = &cpu_ops;
    r->budget = budget;
    r->isa = kernels;
    int status = create_parts(r, threads);
    if (status) {
        destroy(&r->base);
        return status;
    }
    *out = &r->base;
    return 0;
}
