#include "cpu/panes.h"

#include <stdlib.h>
#include <string.h>

#include "cpu/layout.h"
#include "cpu/sheets/cpu_sheets.h"
#include "report.h"
#include "weight.h"

/* ---- memory ---- */

static size_t lay_out(trip_cpu *r, char *memory)
{
    size_t at = 0, panes = trip_cpu_pane_count(r);
    r->pixels =
        trip_cpu_take_array(memory, &at, panes * trip_cpu_pane_floats(r) * sizeof *r->pixels);
    r->sums = trip_cpu_take_array(memory, &at, panes * trip_cpu_pane_floats(r) * sizeof *r->sums);
    r->open_sheets = NULL;
    if (r->has_open_sheets)
        r->open_sheets = trip_cpu_take_array(
            memory, &at, panes * TRIP_CPU_SHEET_FLOATS(r->channels) * sizeof *r->open_sheets);
    r->states = trip_cpu_take_array(memory, &at, panes);
    r->layers = trip_cpu_take_array(memory, &at, panes);
    r->mask.panes = trip_cpu_take_array(memory, &at, (panes + 1) * sizeof *r->mask.panes);
    r->portions = trip_cpu_take_array(memory, &at, 4 * panes * sizeof *r->portions);
    /* The sort also counts splats in the pane diagonally behind the last one. */
    for (unsigned i = 0; i < trip_cpu_pool_threads(r->pool); i++)
        r->workers[i].sorting.counts = trip_cpu_take_array(
            memory, &at, (panes + r->mask.grid.across + 2) * sizeof *r->workers[i].sorting.counts);
    return at;
}

void trip_cpu_release_panes(trip_cpu *r)
{
    trip_budget_release(r->budget, r->pixels, r->panes_bytes);
    r->pixels = r->open_sheets = NULL;
    r->panes_bytes = 0;
    r->mask.grid = (trip_cpu_grid){ 0, 0, 0 };
}

int trip_cpu_fit_panes(trip_cpu *r, int width, int first_row, int rows)
{
    static_assert(TRIP_FRAME_ROWS == TRIP_CPU_PANE, "rows of a frame are rows of panes");
    bool sums = trip_settings_sum_sheets(r->frame->settings);
    trip_cpu_grid grid = { ((uint32_t)width + TRIP_CPU_PANE - 1) / TRIP_CPU_PANE,
                           ((uint32_t)rows + TRIP_CPU_PANE - 1) / TRIP_CPU_PANE,
                           (uint32_t)first_row / TRIP_CPU_PANE };
    if (grid.across == r->mask.grid.across && grid.down == r->mask.grid.down &&
        r->channels == r->kernels->channels && r->has_open_sheets == sums) {
        r->mask.grid.first = grid.first;
        return 0;
    }
    trip_cpu_release_panes(r);
    r->mask.grid = grid;
    r->channels = r->kernels->channels;
    r->has_open_sheets = sums;
    size_t bytes = lay_out(r, NULL);
    char *memory = trip_budget_take(r->budget, bytes);
    if (!memory && r->sheets) { /* the sheets may hold memory from the last picture */
        trip_cpu_sheets_destroy(r->sheets);
        r->sheets = NULL;
        memory = trip_budget_take(r->budget, bytes);
    }
    if (!memory) {
        r->mask.grid = (trip_cpu_grid){ 0, 0, 0 };
        return trip_fail(TRIP_ERROR, "render", "CPU renderer",
                         "%zu bytes of pixels do not fit the memory given; raise --memory to more "
                         "than %llu MiB or draw a smaller image",
                         bytes, trip_cpu_memory_mib(r->budget, bytes));
    }
    lay_out(r, memory);
    r->panes_bytes = bytes;
    return 0;
}

/* ---- frames and layers ---- */

/* Returns the layers of an axis that rays within the bounds may belong to. */
static unsigned layers_of_axis(const trip_frame *frame, const trip_ray_bounds *bounds, int axis)
{
    unsigned layers = 0;
    if (!frame->plan->layers[axis].parted)
        return trip_cpu_layer_bit(axis, TRIP_WAY_ANY);
    for (trip_way way = TRIP_WAY_UP; way <= TRIP_WAY_DOWN; way++)
        if (trip_way_may_lie(bounds, axis, way))
            layers |= trip_cpu_layer_bit(axis, way);
    return layers;
}

/* Returns the layers, one bit each, that may have weight in the pane at (x, y). If there is only
 * one, its weight is 1 in the whole pane. */
static uint8_t layers_of_pane(const trip_frame *frame, int x, int y)
{
    const double from[2] = { x, y }, to[2] = { x + TRIP_CPU_PANE, y + TRIP_CPU_PANE };
    trip_ray_bounds bounds = trip_ray_bounds_over(frame->camera, from, to);
    unsigned layers = 0;
    for (int axis = 0; axis < 3; axis++)
        if (trip_weight_may_lie(frame->settings, frame->plan->axis_of_view, &bounds, axis))
            layers |= layers_of_axis(frame, &bounds, axis);
    return (uint8_t)layers;
}

static bool is_of_layer(const trip_cpu *r, uint32_t pane)
{
    return r->layers[pane] & trip_cpu_layer_bit(r->view.axis, r->view.way);
}

void trip_cpu_begin_panes(trip_cpu *r)
{
    memset(r->states, 0, trip_cpu_pane_count(r));
    for (uint32_t t = 0; t < trip_cpu_pane_count(r); t++)
        r->layers[t] = layers_of_pane(r->frame, trip_cpu_pane_x(r, t), trip_cpu_pane_y(r, t));
}

void trip_cpu_begin_pane_layer(trip_cpu *r)
{
    for (uint32_t t = 0; t < trip_cpu_pane_count(r); t++)
        atomic_store_explicit(&r->mask.panes[t], is_of_layer(r, t) ? UINT64_MAX : 0,
                              memory_order_relaxed);
}

/* ---- blending ---- */

typedef struct blend_context {
    const trip_cpu *of;
    trip_cpu_scratch *scratch;
} blend_context;

static void blend_some(void *user, const trip_cpu_chunk *chunk, const trip_cpu_splat *splats,
                       const uint16_t *order, uint32_t count)
{
    blend_context *c = user;
    if (trip_interrupted())
        return;
    c->of->kernels->pane_blend(&c->of->views[chunk->list], c->scratch, splats,
                               trip_cpu_depths_from(c->of->blending, chunk->splat), order, count);
}

/* Returns the mask's bits for some quarters of a pane. */
static uint64_t bits_of_quarters(unsigned quarters)
{
    static const uint64_t quarter = 0x0f0f0f0f;
    return (quarters & 1 ? quarter : 0) | (quarters & 2 ? quarter << 4 : 0) |
           (quarters & 4 ? quarter << 32 : 0) | (quarters & 8 ? quarter << 36 : 0);
}

static void blend_portion(void *context, unsigned task, unsigned thread)
{
    trip_cpu *r = context;
    if (trip_interrupted())
        return;
    const trip_cpu_portion *p = &r->portions[task];
    trip_cpu_scratch *s = &r->workers[thread].scratch;
    int x = trip_cpu_pane_x(r, p->pane), y = trip_cpu_pane_y(r, p->pane);
    if (!(r->states[p->pane] & TRIP_CPU_PANE_BEGUN)) {
        r->kernels->pane_clear(&r->view, x, y, trip_cpu_is_alone(r, p->pane),
                               trip_cpu_pane_pixels(r, p->pane));
        if (r->open_sheets)
            r->kernels->sheet_clear(trip_cpu_pane_sheet(r, p->pane));
        r->states[p->pane] |= TRIP_CPU_PANE_BEGUN;
    }
    r->kernels->pane_begin(&r->view, s, x, y, p->quarters, trip_cpu_pane_pixels(r, p->pane),
                           trip_cpu_pane_sheet(r, p->pane));
    trip_cpu_pane_list_each(r->blending, p->pane, blend_some, &(blend_context){ r, s });
    uint64_t open = r->kernels->pane_end(s) | ~bits_of_quarters(p->quarters);
    atomic_fetch_and_explicit(&r->mask.panes[p->pane], open, memory_order_relaxed);
}

static int max_first(const void *a, const void *b)
{
    const trip_cpu_portion *p = a, *q = b;
    return p->splats < q->splats ? 1 : p->splats > q->splats ? -1 : 0;
}

/* Lists the panes with work, largest first. A pane with more than twice a thread's share of the
 * splats would keep one thread busy after all others had finished. The function splits such a pane
 * into quarters, although each quarter goes through all splats of the pane. A new pane is not
 * split, because one thread has to clear it. */
static void make_portions(trip_cpu *r, const trip_cpu_buffer *f)
{
    uint64_t all = 0;
    r->portion_count = 0;
    for (uint32_t t = 0; t < trip_cpu_pane_count(r); t++)
        all += f->pane_lists[t].splats;
    uint64_t large = all / trip_cpu_pool_threads(r->pool) * 2;
    for (uint32_t t = 0; t < trip_cpu_pane_count(r); t++) {
        uint32_t n = f->pane_lists[t].splats;
        if (n == 0 || trip_cpu_pane_is_terminated(&r->mask, t))
            continue;
        if (n > large && trip_cpu_pool_threads(r->pool) > 1 && r->states[t] & TRIP_CPU_PANE_BEGUN) {
            for (unsigned q = 0; q < 4; q++)
                r->portions[r->portion_count++] = (trip_cpu_portion){ t, 1u << q, n / 3 };
        } else {
            r->portions[r->portion_count++] = (trip_cpu_portion){ t, 15, n };
        }
    }
    qsort(r->portions, r->portion_count, sizeof *r->portions, max_first);
}

void trip_cpu_blend_filled(trip_cpu *r)
{
    trip_cpu_buffer *full = r->filling;
    if (!full || full->chunk_count == 0)
        return;
    trip_cpu_link_pane_lists(full, &r->mask);
    trip_cpu_pool_wait(r->pool, &r->blend_job);
    make_portions(r, full);
    r->filling = full == &r->buffers[0] ? &r->buffers[1] : &r->buffers[0];
    r->blending = full;
    trip_cpu_buffer_empty(r->filling);
    r->blend_job = (trip_cpu_job){ .run = blend_portion, .context = r, .tasks = r->portion_count };
    trip_cpu_pool_start(r->pool, &r->blend_job);
}

void trip_cpu_finish_blending(trip_cpu *r)
{
    trip_cpu_blend_filled(r);
    trip_cpu_pool_wait(r->pool, &r->blend_job);
}

/* ---- merging ---- */

static float *pane_sum(const trip_cpu *r, uint32_t pane)
{
    return r->sums + pane * trip_cpu_pane_floats(r);
}

/* Returns whether the pane's sum needs the layer. The only layer of a pane needs no sum. */
static bool is_to_merge(const trip_cpu *r, uint32_t pane)
{
    return r->states[pane] & TRIP_CPU_PANE_BEGUN && !trip_cpu_is_alone(r, pane);
}

/* Returns whether the pane's only layer has an open sheet to composite at the layer's end. */
static bool is_to_end(const trip_cpu *r, uint32_t pane)
{
    return r->open_sheets && r->states[pane] & TRIP_CPU_PANE_BEGUN && trip_cpu_is_alone(r, pane) &&
           is_of_layer(r, pane);
}

/* Returns the layer's pixels with the open sheet composited. */
static const float *layer_of_pane(const trip_cpu *r, trip_cpu_worker *w, uint32_t pane)
{
    const float *pixels = trip_cpu_pane_pixels(r, pane);
    if (!r->open_sheets)
        return pixels;
    r->kernels->sheet_composite(&r->view, pixels, trip_cpu_pane_sheet(r, pane), w->layer);
    return w->layer;
}

static void merge_pane(trip_cpu *r, trip_cpu_worker *w, uint32_t pane)
{
    bool first = !(r->states[pane] & TRIP_CPU_PANE_MERGED);
    r->kernels->pane_merge(&r->view, trip_cpu_pane_x(r, pane), trip_cpu_pane_y(r, pane),
                           layer_of_pane(r, w, pane), first, pane_sum(r, pane));
    r->states[pane] = TRIP_CPU_PANE_MERGED;
}

static void end_sheets(trip_cpu *r, trip_cpu_worker *w, uint32_t pane)
{
    memcpy(trip_cpu_pane_pixels(r, pane), layer_of_pane(r, w, pane),
           trip_cpu_pane_floats(r) * sizeof *w->layer);
    r->kernels->sheet_clear(trip_cpu_pane_sheet(r, pane));
}

/* Returns the pane's sum with the current layer merged in. The pane stays unchanged. */
static const float *sum_so_far(const trip_cpu *r, trip_cpu_worker *w, uint32_t pane)
{
    if (!is_to_merge(r, pane))
        return pane_sum(r, pane);
    bool first = !(r->states[pane] & TRIP_CPU_PANE_MERGED);
    if (!first)
        memcpy(w->sum, pane_sum(r, pane), trip_cpu_pane_floats(r) * sizeof *w->sum);
    r->kernels->pane_merge(&r->view, trip_cpu_pane_x(r, pane), trip_cpu_pane_y(r, pane),
                           layer_of_pane(r, w, pane), first, w->sum);
    return w->sum;
}

/* Writes the pane to the picture. The pane stays unchanged. */
static void finish_pane(trip_cpu *r, trip_cpu_worker *w, uint32_t pane)
{
    trip_cpu_content content = TRIP_CPU_NOTHING;
    const float *pixels = NULL;
    if (r->states[pane] & TRIP_CPU_PANE_BEGUN && trip_cpu_is_alone(r, pane)) {
        content = TRIP_CPU_LAYER;
        pixels = is_to_end(r, pane) ? layer_of_pane(r, w, pane) : trip_cpu_pane_pixels(r, pane);
    } else if (r->states[pane]) {
        content = TRIP_CPU_SUM;
        pixels = sum_so_far(r, w, pane);
    }
    r->kernels->pane_finish(&r->view, trip_cpu_pane_x(r, pane), trip_cpu_pane_y(r, pane), content,
                            pixels, r->rgba, r->depth);
}

/* Each task handles one row of panes. */
static void merge_row(void *context, unsigned task, unsigned thread)
{
    trip_cpu *r = context;
    for (uint32_t t = task * r->mask.grid.across; t < (task + 1) * r->mask.grid.across; t++) {
        if (trip_interrupted())
            return;
        if (is_to_merge(r, t))
            merge_pane(r, &r->workers[thread], t);
        else if (is_to_end(r, t))
            end_sheets(r, &r->workers[thread], t);
    }
}

static void finish_row(void *context, unsigned task, unsigned thread)
{
    trip_cpu *r = context;
    for (uint32_t t = task * r->mask.grid.across; t < (task + 1) * r->mask.grid.across; t++)
        if (!trip_interrupted())
            finish_pane(r, &r->workers[thread], t);
}

static void for_each_row(trip_cpu *r, void (*run)(void *, unsigned, unsigned))
{
    r->pane_job = (trip_cpu_job){ .run = run, .context = r, .tasks = r->mask.grid.down };
    trip_cpu_pool_start(r->pool, &r->pane_job);
    trip_cpu_pool_wait(r->pool, &r->pane_job);
}

void trip_cpu_merge_layer(trip_cpu *r)
{
    bool merge = false;
    trip_cpu_finish_blending(r);
    for (uint32_t t = 0; t < trip_cpu_pane_count(r) && !merge; t++)
        merge = is_to_merge(r, t) || is_to_end(r, t);
    if (merge)
        for_each_row(r, merge_row);
}

void trip_cpu_finish_picture(trip_cpu *r, float *rgba, float *depth)
{
    trip_cpu_finish_blending(r);
    /* kernels count rows from the top of the whole picture */
    r->rgba = rgba - (size_t)r->frame->first_row * (size_t)r->frame->camera->width * 4;
    r->depth = depth;
    for_each_row(r, finish_row);
}
