#include "cpu/sheets/cpu_sheets.h"

#include <math.h>
#include <string.h>

#include "cpu/occlusion.h"
#include "cpu/sheets/cpu_sheets_state.h"
#include "effects.h"
#include "report.h"
#include "sheet.h"

/* One part in so many of the free memory stays free for the rest of the frame. */
enum { LEFT_OVER = 4, LEFT_OVER_OF_WINDOWS = 16 };

/* Minimum size of a processor's last-level cache. */
enum { CACHE_BYTES = 8 << 20 };

static trip_cpu_sheet *sheet_of(trip_cpu_sheets *s, int i)
{
    return &s->store.sheets[s->held[i]];
}

/* Reports that the transfer function's integrals, with `further` bytes, do not fit. */
static int no_memory(const trip_budget *budget, uint64_t further)
{
    return trip_fail(TRIP_ERROR, "render", "CPU renderer",
                     "the transfer function's integrals do not fit the memory given; raise "
                     "--memory to more than %llu MiB",
                     trip_cpu_memory_mib(budget, trip_cpu_tf_bytes() + further));
}

/* Reports that the sheets need more memory than the index of the data set called for. */
static int too_many_voxels(void)
{
    return trip_fail(TRIP_ERROR, "render", "CPU renderer",
                     "the sheets hold more voxels than the index says; brick the volume again");
}

/* ---- creation, frames ---- */

int trip_cpu_sheets_create(trip_cpu_sheets **out, const trip_cpu *r)
{
    trip_cpu_sheets *s = trip_budget_take(r->budget, sizeof *s);
    *out = s;
    if (!s)
        return no_memory(r->budget, 0);
    s->store.budget = r->budget;
    s->store.pool = r->pool;
    if (trip_cpu_tfs_create(&s->functions, r->budget))
        return 0;
    trip_cpu_sheets_destroy(s);
    *out = NULL;
    return no_memory(r->budget, 0);
}

void trip_cpu_sheets_destroy(trip_cpu_sheets *s)
{
    if (!s)
        return;
    trip_budget *budget = s->store.budget;
    trip_cpu_store_release(&s->store);
    trip_cpu_windows_release(&s->windows, budget);
    trip_cpu_tfs_destroy(&s->functions, budget);
    trip_budget_release(budget, s, sizeof *s);
}

/* Returns the frame's function, or NULL if it does not fit. */
static const trip_cpu_tf *take_function(trip_cpu_sheets *s, const trip_cpu *r)
{
    const trip_plan *plan = r->frame->plan;
    const bool closed = plan->not_closed == TRIP_CLOSED_FORM_FOUND;
    return trip_cpu_tfs_take(&s->functions, r->budget, r->frame->table,
                             closed ? &plan->closed : NULL, s->store.codes,
                             r->frame->camera->voxel_world, plan->blurs);
}

int trip_cpu_sheets_begin_frame(trip_cpu_sheets *s, trip_cpu *r)
{
    s->of = r;
    s->store.kernels = r->kernels;
    s->pass = NULL;
    s->count = s->front = 0;
    s->run_count = s->taken_count = 0;
    const trip_plan *plan = r->frame->plan;
    const bool closed = plan->not_closed == TRIP_CLOSED_FORM_FOUND;
    s->store.draw = &plan->draw;
    s->store.blurs = plan->blurs;
    s->store.codes = trip_cpu_codes_of(plan->code_min, plan->code_max);
    s->store.coordinates = &r->frame->data->coordinates;
    s->sheet_pane =
        r->frame->settings->kernel == TRIP_KERNEL_NEAREST ? r->kernels->sheet_pane_nearest
        : plan->blurs                                     ? r->kernels->sheet_pane_blurred
        : trip_effects_some(&r->frame->settings->effects) ? r->kernels->sheet_pane_effects
        : closed                                          ? r->kernels->sheet_pane_closed
                                                          : r->kernels->sheet_pane;
    s->function = take_function(s, r);
    if (!s->function) { /* the last frame may have left too little */
        trip_cpu_store_release(&s->store);
        trip_cpu_windows_release(&s->windows, r->budget);
        s->function = take_function(s, r);
    }
    return s->function ? 0 : no_memory(r->budget, trip_cpu_tf_blurred_bytes());
}

/* ---- layers and passes ---- */

/* Widens *b to the selected bricks. first > last stands for an empty rectangle. */
static void add_bricks(trip_cpu_rasters *b, const trip_selection *selection)
{
    unsigned tile_log2 = selection->data->header.tile_log2;
    for (uint64_t i = 0; i < selection->list->brick_count; i++) {
        const trip_file_brick *brick = &selection->list->bricks[i];
        const int64_t tile[2] = { brick->tile_u, brick->tile_v };
        if (!trip_selection_has(selection, i))
            continue;
        bool some = b->first[0] <= b->last[0];
        for (int a = 0; a < 2; a++) {
            int64_t from = tile[a] << tile_log2 >> TRIP_CPU_RASTER_LOG2;
            int64_t to = (((tile[a] + 1) << tile_log2) - 1) >> TRIP_CPU_RASTER_LOG2;
            b->first[a] = !some || from < b->first[a] ? from : b->first[a];
            b->last[a] = !some || to > b->last[a] ? to : b->last[a];
        }
    }
}

static trip_cpu_rasters rasters_of_layer(const trip_plan_layer *layer)
{
    trip_cpu_rasters all = { .first = { 1, 1 } };
    for (int i = 0; i < layer->pass_count; i++)
        for (unsigned k = 0; k < layer->passes[i].pass.selection_count; k++)
            add_bricks(&all, &layer->passes[i].pass.selections[k]);
    return all.first[0] <= all.last[0] ? all : (trip_cpu_rasters){ .last = { 0, 0 } };
}

static uint64_t rasters_in(const trip_cpu_rasters *all)
{
    return (uint64_t)((all->last[0] - all->first[0] + 1) * (all->last[1] - all->first[1] + 1));
}

/* Returns how many consecutive sheets are in memory while an interval is drawn. They are the sheet
 * before it, its own two, the sheets behind it on which it depends, and one sheet that has begun.
 */
static int in_a_row(const trip_frame *frame)
{
    static_assert(4 + TRIP_SHEET_REACH_MAX - 1 == (int)TRIP_CPU_AT_HAND_MAX, "the need");
    return 4 + trip_cpu_sheets_about(frame);
}

/* Makes room for as many sheets as fit beside twice the needed number of rasters. Returns false if
 * there is too little room. */
static bool fit_sheets(trip_cpu_sheets *s, const trip_cpu_rasters *all, const trip_cpu_need *need,
                       uint64_t room)
{
    const unsigned fewest = (unsigned)in_a_row(s->of->frame) + 1;
    s->sample_rasters = need->of_sheet * (uint64_t)s->of->frame->settings->samples_per_sheet;
    const uint64_t min = need->rasters + s->sample_rasters;
    const uint64_t max = rasters_in(all) * (TRIP_CPU_SHEETS_MAX + TRIP_CPU_SAMPLES_MAX);
    unsigned sheets = TRIP_CPU_SHEETS_MAX;
    while (sheets > fewest &&
           trip_cpu_store_bytes(all, sheets, TRIP_CPU_SAMPLES_MAX, 2 * min, s->store.blurs) > room)
        sheets--;
    s->max = (int)(sheets > fewest + 2 ? sheets - 4 : fewest - 2);
    return trip_cpu_store_fit(&s->store, all, sheets, TRIP_CPU_SAMPLES_MAX, min, max, room);
}

int trip_cpu_sheets_about(const trip_frame *frame)
{
    return trip_sheet_reach(frame->settings->kernel) - 1;
}

int trip_cpu_sheets_held(const trip_frame *frame)
{
    static_assert(2 + 2 * (TRIP_SHEET_REACH_MAX - 1) == (int)TRIP_CPU_AT_HAND_MAX, "the need");
    return 2 + 2 * trip_cpu_sheets_about(frame);
}

/* Returns whether interpolation reads 64 voxels. */
static bool is_wide(const trip_cpu_sheets *s)
{
    return trip_kernel_is_wide(s->of->frame->settings->kernel);
}

static bool is_nearest(const trip_cpu_sheets *s)
{
    return s->of->frame->settings->kernel == TRIP_KERNEL_NEAREST;
}

/* Returns how far rays move along u or v between two sheets, in rasters. The distance of two sheets
 * is at most twice the width of a voxel. */
static int64_t reach_of(const trip_frame *frame)
{
    const trip_coordinates *c = &frame->data->coordinates;
    double voxels = trip_cpu_pass_steepest(frame);
    if (trip_coordinates_uneven(c))
        voxels = fmin(voxels * 2 * c->widest / c->nearest, 0x1p31);
    return ((int64_t)voxels + 4) / TRIP_CPU_RASTER + 1;
}

/* Finds the bytes that the smallest windows need in any layer of the frame. */
static int find_min(const trip_cpu_sheets *s, uint64_t *bytes)
{
    const trip_frame *frame = s->of->frame;
    int status = 0;
    *bytes = 0;
    for (int axis = 0; axis < 3 && !status; axis++) {
        const trip_plan_layer *layer = &frame->plan->layers[axis];
        const trip_cpu_rasters all = rasters_of_layer(layer);
        trip_cpu_need need;
        const int held_sheets = trip_cpu_sheets_held(frame);
        status = trip_cpu_need_find(&need, layer, rasters_in(&all), held_sheets, s->store.blurs,
                                    s->store.budget);
        if (status)
            break;
        uint64_t min =
            trip_cpu_windows_min_bytes(&all, reach_of(frame), &need, held_sheets,
                                       frame->settings->samples_per_sheet, s->store.blurs);
        *bytes = min > *bytes ? min : *bytes;
    }
    return status;
}

static int refuse(const trip_cpu_sheets *s, const trip_cpu_rasters *all)
{
    uint64_t needed;
    int status = find_min(s, &needed);
    if (status)
        return status;
    return trip_fail(TRIP_ERROR, "render", "CPU renderer",
                     "sheets of %lld x %lld voxels do not fit the memory given; raise --memory to "
                     "%llu MiB or use --classify pre",
                     (long long)(all->last[0] - all->first[0] + 1) * TRIP_CPU_RASTER,
                     (long long)(all->last[1] - all->first[1] + 1) * TRIP_CPU_RASTER,
                     trip_cpu_memory_mib(s->store.budget, needed / (LEFT_OVER_OF_WINDOWS - 1) *
                                                              LEFT_OVER_OF_WINDOWS));
}

/* Makes room for whole sheets if they certainly fit, otherwise for windows. */
static int fit_layer(trip_cpu_sheets *s, const trip_plan_layer *layer)
{
    const trip_cpu_rasters all = rasters_of_layer(layer);
    const uint64_t grid = rasters_in(&all);
    const int64_t reach = reach_of(s->of->frame);
    const int sheets = in_a_row(s->of->frame);
    trip_cpu_windows_release(&s->windows, s->store.budget);
    uint64_t left = trip_budget_left_bytes(s->store.budget) + trip_cpu_store_held_bytes(&s->store);
    uint64_t room = left / LEFT_OVER * (LEFT_OVER - 1);
    s->windows.used = false;
    trip_cpu_need need = { .rasters = (uint64_t)sheets * grid, .of_sheet = grid };
    if (fit_sheets(s, &all, &need, room))
        return 0;
    int status = trip_cpu_need_find(&need, layer, grid, sheets, s->store.blurs, s->store.budget);
    if (status || fit_sheets(s, &all, &need, room))
        return status;
    trip_cpu_store_release(&s->store);
    room = left / LEFT_OVER_OF_WINDOWS * (LEFT_OVER_OF_WINDOWS - 1);
    if (trip_cpu_windows_fit(s, &all, reach, &need, room))
        return 0;
    return refuse(s, &all);
}

int trip_cpu_sheets_begin_layer(trip_cpu_sheets *s, int axis)
{
    s->axis = s->store.axis = axis;
    s->pass = NULL;
    s->count = s->front = 0;
    return fit_layer(s, &s->of->frame->plan->layers[axis]);
}

static void drop_all(trip_cpu_sheets *s)
{
    for (int i = 0; i < s->count; i++)
        trip_cpu_store_drop(&s->store, sheet_of(s, i));
    s->count = s->front = 0;
}

/* ---- drawing sheets ---- */

bool trip_cpu_sheets_are_ahead(const trip_cpu_sheets *s, int64_t to)
{
    return s->view.ortho || ((double)to - s->eye) * (double)s->way > 0;
}

bool trip_cpu_sheets_leap(const trip_cpu_sheets *s)
{
    return trip_cpu_sheets_at_once(s) ||
           s->view.steepest > 0.999 * s->of->frame->settings->samples_per_sheet;
}

bool trip_cpu_sheets_at_once(const trip_cpu_sheets *s)
{
    return s->view.coordinates || is_wide(s);
}

/* Finds the ranges of the complete sheets, and the squares and cells that may be visible between
 * them. */
static void find_visible(trip_cpu_sheets *s, int complete)
{
    trip_cpu_sheet_work work[TRIP_CPU_SHEETS_MAX] = { 0 };
    unsigned count = 0;
    for (int i = 0; i < complete; i++)
        if (!sheet_of(s, i)->prepared)
            work[count++] = (trip_cpu_sheet_work){ .sheet = sheet_of(s, i) };
    trip_cpu_store_prepare(&s->store, work, count);
    count = 0;
    for (int i = s->front; i + 1 < complete; i++)
        if (trip_cpu_sheets_are_ahead(s, sheet_of(s, i + 1)->number))
            work[count++] = (trip_cpu_sheet_work){
                .sheet = sheet_of(s, i),
                .other = sheet_of(s, i + 1),
                .before = is_wide(s) && i > 0 ? sheet_of(s, i - 1) : NULL,
                .behind = is_wide(s) && i + 2 < complete ? sheet_of(s, i + 2) : NULL,
                .kernel = s->view.kernel,
                .everywhere = trip_cpu_sheets_leap(s),
            };
    trip_cpu_store_find_visible(&s->store, work, count, s->function);
}

/* Finds the gradients of the sheets up to held[last], or sets up making them on demand. Some sheets
 * may already have gradients. */
static void find_gradients(trip_cpu_sheets *s, int last, int complete)
{
    trip_cpu_sheet_work work[TRIP_CPU_SHEETS_MAX] = { 0 };
    unsigned count = 0;
    for (int i = 0; i <= last; i++) {
        trip_cpu_sheet *sheet = sheet_of(s, i);
        const trip_cpu_sheet *before = i > 0 ? sheet_of(s, i - 1) : NULL;
        const trip_cpu_sheet *after = i + 1 < complete ? sheet_of(s, i + 1) : NULL;
        if (!sheet->shaded)
            work[count++] = (trip_cpu_sheet_work){ .sheet = sheet,
                                                   .other = s->way > 0 ? before : after,
                                                   .third = s->way > 0 ? after : before,
                                                   .kernel = s->view.kernel };
    }
    trip_cpu_sheets_find_gradients(s, work, count);
}

void trip_cpu_sheets_find_gradients(trip_cpu_sheets *s, const trip_cpu_sheet_work *work,
                                    unsigned count)
{
    if (s->view.shading && trip_cpu_sheets_at_once(s))
        trip_cpu_store_find_gradients(&s->store, work, count);
    for (unsigned i = 0; i < count; i++) {
        trip_cpu_making *m = &work[i].sheet->making;
        m->before = work[i].other ? work[i].other->rasters : NULL;
        m->behind = work[i].third ? work[i].third->rasters : NULL;
    }
}

/* Returns the rasters of sheet `number`, a neighbour of held[i]. Beyond the grid, returns the
 * rasters of held[i] itself. Returns NULL if the sheet is absent. */
static const int32_t *rasters_beside(const trip_cpu_sheets *s, int i, int64_t number)
{
    const int64_t voxels = (int64_t)s->of->frame->data->header.dims[s->axis];
    if (number < 0 || number >= voxels)
        return s->store.sheets[s->held[i]].rasters;
    for (int k = i > 0 ? i - 1 : 0; k <= i + 1 && k < s->count; k++)
        if (s->store.sheets[s->held[k]].number == number)
            return s->store.sheets[s->held[k]].rasters;
    return NULL;
}

/* Returns the four sheets about the segments between held[i] and held[i + 1]. */
static trip_cpu_about about_of(const trip_cpu_sheets *s, int i)
{
    const bool up = s->way > 0;
    const int low = up ? i : i + 1, high = up ? i + 1 : i;
    const trip_cpu_sheet *sheets = s->store.sheets;
    const int64_t number = sheets[s->held[low]].number;
    return (trip_cpu_about){
        .rasters = { rasters_beside(s, low, number - 1), sheets[s->held[low]].rasters,
                     sheets[s->held[high]].rasters, rasters_beside(s, high, number + 2) },
        .number = number
    };
}

/* Returns the sheets of the segment from s->last_index to `index`, between held[i] and held[i + 1].
 */
static trip_cpu_pair pair_of(trip_cpu_sheets *s, int i, double index)
{
    const trip_cpu_sheet *from = sheet_of(s, i), *to = sheet_of(s, i + 1);
    const double middle = 0.5 * (s->last_index + index);
    const bool first = fabs(middle - (double)from->number) < 0.5;
    return (trip_cpu_pair){ first ? &from->making : &to->making, (first ? to : from)->rasters };
}

/* Adds a sample plane at `index` of the axis to the group. Unless it is the group's first sample
 * plane, this ends a segment between held[i] and held[i + 1]. */
static void add_sample(trip_cpu_sheets *s, const trip_cpu_sheet *at, double index, int i,
                       bool first)
{
    const double coordinate = trip_coordinates_position(s->store.coordinates, s->axis, index);
    trip_cpu_group *g = &s->group;
    if (!first) {
        const trip_cpu_sheet *from = sheet_of(s, i);
        g->visible[g->segments] = from->visible;
        g->cells[g->segments] = from->cells;
        g->needed[g->segments] = from->needed;
        if (is_wide(s))
            s->about[g->segments] = about_of(s, i);
        if (is_nearest(s))
            g->nearest[g->segments] = pair_of(s, i, index);
        g->segments++;
    }
    s->last_index = index;
    g->samples[g->segments] = (trip_cpu_sample){ at->rasters, coordinate,
                                                 trip_cpu_sheets_at_once(s) ? NULL : &at->making };
}

/* The sample planes of a group. They are cleared or cut after all of them have rasters. */
typedef struct cutting {
    trip_cpu_sheet_work work[TRIP_CPU_SAMPLES_MAX];
    unsigned count;
} cutting;

/* Adds a sample plane between held[i] and held[i + 1], with weight `part` for held[i + 1]. Returns
 * false if the pool is full. Kernels of 64 voxels and the nearest value read the sheets, so they
 * need no rasters for sample planes. */
static bool take_sample(trip_cpu_sheets *s, int i, double part, bool first, cutting *cut)
{
    const trip_cpu_sheet *from = sheet_of(s, i), *to = sheet_of(s, i + 1);
    trip_cpu_sheet *sample = &s->store.samples[cut->count];
    const double index = (double)from->number + part * (double)s->way;
    if (is_wide(s) || is_nearest(s)) {
        add_sample(s, from, index, i, first);
        return true;
    }
    const int32_t weight = (int32_t)lrint(part * 16384);
    const trip_cpu_sheet_work w = { .sheet = sample, .other = from, .third = to };
    if (!trip_cpu_store_take_sample(&s->store, &w))
        return false;
    sample->making.from = &from->making;
    sample->making.to = &to->making;
    sample->making.weights = weight << 16 | (16384 - weight);
    cut->work[cut->count++] = w;
    add_sample(s, sample, index, i, first);
    return true;
}

/* Adds the sample planes between held[i] and held[i + 1], and held[i + 1] itself. The first
 * interval of a group starts at held[i], or at the eye if it lies between both sheets. Returns
 * false and adds nothing if the pool is full. */
static bool take_interval(trip_cpu_sheets *s, int i, bool first, cutting *cut)
{
    const trip_cpu_sheet *from = sheet_of(s, i), *to = sheet_of(s, i + 1);
    const int samples_per_sheet = s->of->frame->settings->samples_per_sheet;
    const unsigned count_before = cut->count;
    const trip_cpu_group before = s->group;
    double eye = s->view.ortho ? 0 : (s->eye - (double)from->number) * (double)s->way;
    bool fits = true;
    if (first && eye <= 0)
        add_sample(s, from, (double)from->number, i, true);
    else if (first)
        fits = take_sample(s, i, eye, true, cut);
    for (int n = 1; n < samples_per_sheet && fits; n++)
        if (n > eye * samples_per_sheet)
            fits = take_sample(s, i, (double)n / samples_per_sheet, false, cut);
    if (fits) {
        add_sample(s, to, (double)to->number, i, false);
        return true;
    }
    while (cut->count > count_before)
        trip_cpu_store_drop(&s->store, &s->store.samples[--cut->count]);
    s->group = before;
    return false;
}

static void run_tasks(trip_cpu_sheets *s, void (*run)(void *, unsigned, unsigned), unsigned tasks)
{
    trip_cpu_job job = { .run = run, .context = s, .tasks = tasks };
    if (tasks == 0)
        return;
    trip_cpu_pool_start(s->of->pool, &job);
    trip_cpu_pool_wait(s->of->pool, &job);
}

static void draw_pane(void *context, unsigned task, unsigned thread)
{
    trip_cpu_sheets *s = context;
    trip_cpu *r = s->of;
    (void)thread;
    if (trip_interrupted() || !(r->layers[task] & trip_cpu_layer_bit(s->axis, TRIP_WAY_ANY)) ||
        trip_cpu_pane_is_terminated(&r->mask, task))
        return;
    float *pixels = trip_cpu_pane_pixels(r, task);
    int x = trip_cpu_pane_x(r, task), y = trip_cpu_pane_y(r, task);
    if (!(r->states[task] & TRIP_CPU_PANE_BEGUN)) {
        r->kernels->pane_clear(&r->view, x, y, trip_cpu_is_alone(r, task), pixels);
        r->states[task] |= TRIP_CPU_PANE_BEGUN;
    }
    uint64_t open = s->sheet_pane(&s->view, &s->group, x, y, pixels);
    atomic_store_explicit(&r->mask.panes[task], open, memory_order_relaxed);
}

/* Collects the squares that are visible in any segment. Returns false if there are none. */
static bool find_some(trip_cpu_sheets *s)
{
    size_t grid = trip_cpu_store_grid(&s->store);
    uint64_t any = 0;
    for (size_t i = 0; i < grid; i++) {
        uint64_t some = 0;
        for (unsigned n = 0; n < s->group.segments; n++)
            some |= s->group.visible[n][i];
        s->store.some[i] = some;
        any |= some;
    }
    s->group.some = s->store.some;
    return any != 0;
}

static void draw_panes(trip_cpu_sheets *s)
{
    if (!find_some(s))
        return;
    run_tasks(s, draw_pane, trip_cpu_pane_count(s->of));
}

static void drop_first(trip_cpu_sheets *s, int count)
{
    for (int i = 0; i < count; i++)
        trip_cpu_store_drop(&s->store, sheet_of(s, i));
    s->count -= count;
    s->front -= count;
    memmove(s->held, s->held + count, (size_t)s->count * sizeof *s->held);
}

void trip_cpu_sheets_draw_some(trip_cpu_sheets *s, int last)
{
    const trip_cpu_store *store = &s->store;
    cutting cut = { .count = 0 };
    bool first = true;
    const unsigned segments = (unsigned)s->of->frame->settings->samples_per_sheet;
    const trip_cpu_group given = s->group;
    s->group = (trip_cpu_group){ .pool = store->voxels,
                                 .deviations = store->blurs ? store->deviations : NULL,
                                 .first_u = store->first_u * TRIP_CPU_RASTER,
                                 .first_v = store->first_v * TRIP_CPU_RASTER,
                                 .across = store->across,
                                 .down = store->down,
                                 .about = is_wide(s) ? s->about : NULL,
                                 .leaps = trip_cpu_sheets_leap(s),
                                 .windowed = s->windows.used,
                                 .lo = { given.lo[0], given.lo[1] },
                                 .hi = { given.hi[0], given.hi[1] } };
    for (; s->front < last && s->group.segments + segments < TRIP_CPU_SEGMENTS; s->front++) {
        if (!trip_cpu_sheets_are_ahead(s, sheet_of(s, s->front + 1)->number))
            continue;
        if (!take_interval(s, s->front, first, &cut))
            break;
        first = false;
    }
    if (trip_cpu_sheets_at_once(s))
        trip_cpu_store_cut(&s->store, cut.work, cut.count);
    else
        trip_cpu_store_clear_samples(&s->store, cut.work, cut.count);
    draw_panes(s);
    trip_cpu_open_squares_forget(s);
    while (cut.count > 0)
        trip_cpu_store_drop(&s->store, &s->store.samples[--cut.count]);
}

/* Draws the intervals that depend only on the complete sheets. If `all`, no sheet follows and all
 * intervals are drawn. */
static int draw_complete(trip_cpu_sheets *s, int complete, bool all)
{
    const int kept = trip_cpu_sheets_about(s->of->frame) - 1;
    int last = all ? complete - 1 : complete - 2 - kept;
    if (last <= s->front)
        return 0;
    find_visible(s, complete);
    find_gradients(s, last + kept < complete ? last + kept : last, complete);
    while (last > s->front) {
        const int before = s->front;
        trip_cpu_sheets_draw_some(s, last);
        if (s->front == before)
            return too_many_voxels();
        const int drop = s->front > 1 ? s->front - 1 : 0;
        drop_first(s, drop);
        last -= drop;
        int status = trip_frame_poll();
        if (status)
            return status;
    }
    return 0;
}

/* ---- from runs to sheets ---- */

static void clear_taken(void *context, unsigned task, unsigned thread)
{
    const trip_cpu_sheets *s = context;
    (void)thread;
    trip_cpu_store_clear(&s->store, s->taken[task]);
}

static void decode_run(void *context, unsigned task, unsigned thread)
{
    const trip_cpu_sheets *s = context;
    (void)thread;
    if (trip_interrupted())
        return;
    const trip_run *run = s->runs[task].run;
    const trip_block block = trip_block_of(s->batch, run);
    trip_cpu_store_decode(&s->store, s->runs[task].sheet, &block, run);
}

/* Decodes the collected runs. Must be called before the store's open squares change, before the
 * batch ends, and before sheets are drawn. */
static void decode_runs(trip_cpu_sheets *s)
{
    run_tasks(s, clear_taken, s->taken_count);
    run_tasks(s, decode_run, s->run_count);
    s->run_count = s->taken_count = 0;
}

/* Draws and drops all held sheets, which are complete. */
static int finish_row(trip_cpu_sheets *s)
{
    if (s->windows.used)
        return trip_cpu_windows_finish_row(s);
    int status = draw_complete(s, s->count, true);
    drop_all(s);
    trip_cpu_open_squares_forget(s);
    return status;
}

/* Returns whether to draw the held sheets before another begins. This is so if there is no room for
 * more, or if the sheets and their sample planes exceed the cache. Large sheets are then drawn a
 * few at a time, and the sheets behind are culled earlier. */
static bool are_enough(const trip_cpu_sheets *s)
{
    const int fewest = in_a_row(s->of->frame) + 2;
    const uint64_t rasters = s->store.rasters - 1 - s->store.free_count;
    const uint64_t bytes =
        rasters * (uint64_t)s->of->frame->settings->samples_per_sheet * sizeof(trip_cpu_voxels);
    return s->count >= s->max || (s->count >= fewest && bytes > CACHE_BYTES);
}

/* Begins the sheet of the next runs. All held sheets are complete. */
static int begin_sheet(trip_cpu_sheets *s, int64_t number)
{
    const bool ends_row = s->count > 0 && sheet_of(s, s->count - 1)->number + s->way != number;
    int status = 0;
    if (ends_row || are_enough(s) || s->open_sheets == 0)
        decode_runs(s);
    if (ends_row)
        status = finish_row(s);
    else if (are_enough(s))
        status = draw_complete(s, s->count, false);
    if (status)
        return status;
    bool taken[TRIP_CPU_SHEETS_MAX] = { false };
    for (int i = 0; i < s->count; i++)
        taken[s->held[i]] = true;
    int next = 0;
    while (taken[next])
        next++;
    s->held[s->count++] = next;
    s->store.sheets[next].number = number;
    trip_cpu_open_squares_of_sheet(s, number);
    return 0;
}

/* Takes a raster for the last sheet. Returns false if only the rasters set aside for sample planes
 * are left. */
static bool take_raster(trip_cpu_sheets *s, size_t at)
{
    trip_cpu_sheet *sheet = sheet_of(s, s->count - 1);
    if (s->taken_count == TRIP_CPU_SHEETS_TAKEN)
        decode_runs(s);
    if (s->store.free_count <= s->sample_rasters || !trip_cpu_store_take(&s->store, sheet, at))
        return false;
    s->taken[s->taken_count++] = sheet->rasters[at];
    return true;
}

/* Takes rasters of the last sheet for a run's voxels. */
static int take_rasters(trip_cpu_sheets *s, const trip_run *run)
{
    int edge = 1 << s->of->frame->data->header.tile_log2;
    for (int v = run->v; v < run->v + edge; v += TRIP_CPU_RASTER)
        for (int u = run->u; u < run->u + edge; u += TRIP_CPU_RASTER) {
            size_t at =
                trip_cpu_store_at(&s->store, u >> TRIP_CPU_RASTER_LOG2, v >> TRIP_CPU_RASTER_LOG2);
            while (s->store.open[at] && !sheet_of(s, s->count - 1)->rasters[at] &&
                   !take_raster(s, at)) {
                const int count = s->count, front = s->front;
                decode_runs(s);
                int status = draw_complete(s, s->count - 1, false);
                if (status || (s->count == count && s->front == front))
                    return status ? status : too_many_voxels();
            }
        }
    return 0;
}

static bool is_occluded(const trip_cpu_sheets *s, const trip_run *run)
{
    const trip_cpu *r = s->of;
    const trip_cpu_view *view = &r->views[trip_batch_list(s->batch, run)->index];
    if (view->coordinates)
        return false;
    trip_cpu_box box =
        trip_cpu_brick_box(view->of->data, view->list, run->brick, run->sheet, run->sheet);
    return trip_cpu_box_occlusion(view, &r->mask, &box) == TRIP_CPU_OCCLUDED;
}

/* Returns whether the run belongs to another data set than the collected runs. Runs decoded in one
 * job must not share a voxel; only runs of one data set never do. */
static bool is_of_another_part(const trip_cpu_sheets *s, const trip_run *run)
{
    return s->run_count > 0 &&
           trip_batch_list(s->batch, run)->part != trip_batch_list(s->batch, s->runs[0].run)->part;
}

static int add_run(trip_cpu_sheets *s, const trip_run *run)
{
    int status = 0;
    if (s->windows.used)
        return is_occluded(s, run) ? 0 : trip_cpu_windows_add_run(s, run);
    if (s->count == 0 || sheet_of(s, s->count - 1)->number != run->sheet)
        status = begin_sheet(s, run->sheet);
    if (status || !trip_cpu_open_squares_some_of_run(s, run))
        return status;
    if (s->run_count == TRIP_CPU_SHEETS_RUNS || is_of_another_part(s, run))
        decode_runs(s);
    status = take_rasters(s, run);
    if (!status)
        s->runs[s->run_count++] = (trip_cpu_sheet_run){ run, sheet_of(s, s->count - 1) };
    return status;
}

static int begin_pass(trip_cpu_sheets *s, const trip_pass *pass)
{
    int status = s->pass ? finish_row(s) : 0;
    trip_cpu_open_squares_forget(s);
    s->pass = pass;
    s->way = pass->descending ? -1 : 1;
    trip_cpu_pass_view_make(&s->view, s->of->frame, s->axis, pass->descending, s->function);
    s->eye = trip_coordinates_index(s->store.coordinates, s->axis, s->view.eye[2]);
    return status;
}

int trip_cpu_sheets_draw(trip_cpu_sheets *s, const trip_batch *batch)
{
    int status = batch->pass == s->pass ? 0 : begin_pass(s, batch->pass);
    s->batch = batch;
    for (size_t i = 0; i < batch->run_count && !status; i++) {
        const trip_run *run = &batch->runs[i];
        s->of->stats[trip_batch_list(batch, run)->index].splats_read += run->count;
        status = add_run(s, run);
    }
    decode_runs(s);
    return status ? status : trip_frame_poll();
}

int trip_cpu_sheets_end_layer(trip_cpu_sheets *s)
{
    int status = s->pass ? finish_row(s) : 0;
    s->pass = NULL;
    return status ? status : trip_frame_poll();
}
