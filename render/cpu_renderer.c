/* The CPU renderer: its threads project the voxels of a batch into splats, sort them by screen tile
 * and blend each tile's splats in list order, while the next batch is projected. What a pixel gets
 * depends on the order of the splats alone, never on where a batch, chunk or flush ends, so the
 * picture is the same bit for bit for any number of threads, memory, tile and batch size. */
#include "cpu_renderer.h"

#include <stdlib.h>
#include <string.h>

#include "cpu_bin.h"
#include "cpu_count.h"
#include "cpu_cover.h"
#include "cpu_isa.h"
#include "cpu_near.h"
#include "cpu_pool.h"
#include "report.h"

enum { FLOATS_PER_TILE = 4 * TRIP_CPU_TILE_PIXELS, MAX_SPLATS = 1 << 16, MIN_SPLATS = 1 << 13 };

/* What has become of a tile's pixels. */
enum tile_state {
    TILE_BEGUN = 1,  /* in the list being drawn */
    TILE_MERGED = 2, /* the sum holds earlier lists */
};

/* One thread's own memory. */
typedef struct worker {
    trip_cpu_scratch scratch;
    trip_list_stats counts;
    uint32_t *tile_counts;
} worker;

/* A tile to blend, or a quarter of one. */
typedef struct portion {
    uint32_t tile;
    unsigned quarters;
    uint32_t splats;
} portion;

typedef struct cpu {
    trip_renderer base;
    trip_budget *budget;
    const trip_cpu_kernels *kernels;
    trip_cpu_pool *pool;
    char device[64];
    worker *workers;
    size_t workers_bytes;

    trip_cpu_grid grid;
    size_t tiles_bytes; /* of everything below that grows with the image */
    float *pixels, *sums;
    uint8_t *states;
    _Atomic uint8_t *closed; /* no pixel can take more light; set by whoever blends the tile */
    _Atomic uint8_t *open_quarters;
    portion *portions;
    uint32_t *tile_counts;

    const trip_frame *frame;
    trip_cpu_view view;
    bool in_list;
    trip_list_stats stats[3];

    trip_cpu_flush flushes[2];
    trip_cpu_flush *filling, *blending;
    const trip_batch *batch;
    uint32_t first_chunk; /* of the job */
    uint32_t portion_count;
    float *rgba;
    trip_cpu_job project_job, blend_job, tile_job;
} cpu;

/* ---- tiles ---- */

static uint32_t tile_count(const cpu *r)
{
    return r->grid.across * r->grid.down;
}

static int tile_x(const cpu *r, uint32_t tile)
{
    return (int)(tile % r->grid.across) * TRIP_CPU_TILE;
}

static int tile_y(const cpu *r, uint32_t tile)
{
    return (int)(tile / r->grid.across) * TRIP_CPU_TILE;
}

static float *tile_pixels(const cpu *r, uint32_t tile)
{
    return r->pixels + (size_t)tile * FLOATS_PER_TILE;
}

static void close_tile(cpu *r, uint32_t tile)
{
    atomic_store_explicit(&r->closed[tile], 1, memory_order_relaxed);
}

/* ---- projecting a batch ---- */

static void count_piece(worker *w, const cpu *r, const trip_run *run, const uint32_t *voxels,
                        uint32_t count)
{
    for (uint32_t i = 0; i < count; i++)
        trip_cpu_count(&r->view, run, voxels[i], &w->counts);
}

static bool run_is_hidden(const cpu *r, const trip_run *run)
{
    if (!r->view.front_to_back)
        return false;
    trip_cpu_box box = trip_cpu_brick_box(&r->view, run->brick, run->sheet, run->sheet);
    return trip_cpu_box_is_hidden(&r->view, r->grid, r->closed, &box);
}

/* Projects what is staged to the end of the chunk. */
static void empty_staged(const cpu *r, worker *w, trip_cpu_chunk *chunk, uint32_t *staged)
{
    trip_cpu_splat *out = r->filling->splats + chunk->splat + chunk->splats;
    chunk->splats +=
        r->kernels->project(&r->view, &w->scratch.staged, *staged, &w->scratch.lanes, out);
    *staged = 0;
}

/* The voxels of a run from `skip` in draw order. */
static void project_piece(const cpu *r, worker *w, trip_cpu_chunk *chunk, const trip_run *run,
                          uint32_t skip, uint32_t count, uint32_t *staged)
{
    const trip_batch *batch = r->batch;
    bool reversed = batch->selection->descending;
    uint64_t at = run->first + (reversed ? run->count - skip - count : skip);
    if (r->frame->count)
        count_piece(w, r, run, batch->voxels + at, count);
    if (run_is_hidden(r, run))
        return;
    for (uint32_t done = 0; done < count;) {
        uint32_t n = count - done, room = TRIP_CPU_STAGED - *staged;
        n = n < room ? n : room;
        uint64_t from = at + (reversed ? count - done - n : done);
        *staged = r->kernels->stage(&r->view, run, batch->voxels + from,
                                    r->view.shading ? batch->normals + from : NULL, n, reversed,
                                    &w->scratch.staged, *staged);
        if (*staged == TRIP_CPU_STAGED)
            empty_staged(r, w, chunk, staged);
        done += n;
    }
}

static void project_chunk(void *context, unsigned task, unsigned thread)
{
    cpu *r = context;
    worker *w = &r->workers[thread];
    trip_cpu_chunk *chunk = &r->filling->chunks[r->first_chunk + task];
    uint32_t staged = 0, skip = chunk->skip, left = chunk->voxels;
    for (size_t i = chunk->run; left > 0; i++) {
        const trip_run *run = &r->batch->runs[i];
        uint32_t n = run->count - skip < left ? run->count - skip : left;
        project_piece(r, w, chunk, run, skip, n, &staged);
        left -= n;
        skip = 0;
    }
    empty_staged(r, w, chunk, &staged);
    trip_cpu_bin(r->filling, chunk, r->grid, w->tile_counts);
}

/* ---- blending a flush ---- */

typedef struct blend_context {
    const trip_cpu_kernels *kernels;
    trip_cpu_scratch *scratch;
} blend_context;

static void blend_some(void *user, const trip_cpu_splat *splats, const uint16_t *order,
                       uint32_t count)
{
    blend_context *c = user;
    c->kernels->tile_blend(c->scratch, splats, order, count);
}

/* The tile is closed once every quarter is. */
static void close_quarters(cpu *r, uint32_t tile, unsigned quarters)
{
    unsigned before = atomic_fetch_and_explicit(&r->open_quarters[tile], (uint8_t)~quarters,
                                                memory_order_relaxed);
    if ((before & ~quarters) == 0)
        close_tile(r, tile);
}

static void blend_portion(void *context, unsigned task, unsigned thread)
{
    cpu *r = context;
    const portion *p = &r->portions[task];
    trip_cpu_scratch *s = &r->workers[thread].scratch;
    int x = tile_x(r, p->tile), y = tile_y(r, p->tile);
    if (!(r->states[p->tile] & TILE_BEGUN)) {
        r->kernels->tile_clear(&r->view, x, y, tile_pixels(r, p->tile));
        r->states[p->tile] |= TILE_BEGUN;
    }
    r->kernels->tile_begin(&r->view, s, x, y, p->quarters, tile_pixels(r, p->tile));
    trip_cpu_share_each(r->blending, p->tile, blend_some, &(blend_context){ r->kernels, s });
    if (!r->kernels->tile_end(s))
        close_quarters(r, p->tile, p->quarters);
}

static int most_first(const void *a, const void *b)
{
    const portion *p = a, *q = b;
    return p->splats < q->splats ? 1 : p->splats > q->splats ? -1 : 0;
}

/* Tiles with work, those with most of it first. One that holds so much that a thread would still be
 * at it when the others are done is given out in quarters; not when it is new, since then one
 * thread has to clear it. */
static void make_portions(cpu *r, const trip_cpu_flush *f)
{
    uint64_t all = 0;
    r->portion_count = 0;
    for (uint32_t t = 0; t < tile_count(r); t++)
        all += f->shares[t].splats;
    uint64_t large = all / trip_cpu_pool_threads(r->pool) / 2;
    for (uint32_t t = 0; t < tile_count(r); t++) {
        uint32_t n = f->shares[t].splats;
        if (n == 0 || atomic_load_explicit(&r->closed[t], memory_order_relaxed))
            continue;
        if (n > large && trip_cpu_pool_threads(r->pool) > 1 && r->states[t] & TILE_BEGUN) {
            for (unsigned q = 0; q < 4; q++)
                r->portions[r->portion_count++] = (portion){ t, 1u << q, n / 3 };
        } else {
            r->portions[r->portion_count++] = (portion){ t, 15, n };
        }
    }
    qsort(r->portions, r->portion_count, sizeof *r->portions, most_first);
}

/* Hands what is projected to the blending threads, once they are done with what came before. */
static void flush(cpu *r)
{
    trip_cpu_flush *full = r->filling;
    if (full->chunk_count == 0)
        return;
    trip_cpu_link(full, r->grid, r->closed);
    trip_cpu_pool_wait(r->pool, &r->blend_job);
    make_portions(r, full);
    r->filling = full == &r->flushes[0] ? &r->flushes[1] : &r->flushes[0];
    r->blending = full;
    trip_cpu_flush_empty(r->filling);
    r->blend_job = (trip_cpu_job){ .run = blend_portion, .context = r, .tasks = r->portion_count };
    trip_cpu_pool_start(r->pool, &r->blend_job);
}

/* Ends with everything drawn so far in the pixels. */
static void settle(cpu *r)
{
    flush(r);
    trip_cpu_pool_wait(r->pool, &r->blend_job);
}

/* ---- drawing ---- */

/* A place in a batch's runs. */
typedef struct cursor {
    size_t run;
    uint32_t skip;
} cursor;

/* Reserves the next chunk; false when the batch is through or the buffer full. */
static bool reserve_chunk(cpu *r, const trip_batch *batch, cursor *at)
{
    uint32_t room = trip_cpu_flush_room(r->filling), voxels = 0;
    cursor start = *at;
    room = room < TRIP_CPU_CHUNK ? room : TRIP_CPU_CHUNK;
    while (at->run < batch->run_count && voxels < room) {
        uint32_t left = batch->runs[at->run].count - at->skip;
        if (left > room - voxels) {
            at->skip += room - voxels;
            voxels = room;
        } else {
            voxels += left;
            *at = (cursor){ at->run + 1, 0 };
        }
    }
    if (voxels == 0)
        return false;
    trip_cpu_chunk *chunk = trip_cpu_flush_reserve(r->filling, voxels);
    chunk->run = start.run;
    chunk->skip = start.skip;
    r->stats[r->view.axis].splats_read += voxels;
    return true;
}

/* As much of the batch as the buffer takes. */
static void project_batch(cpu *r, const trip_batch *batch, cursor *at)
{
    r->batch = batch;
    r->first_chunk = r->filling->chunk_count;
    while (reserve_chunk(r, batch, at))
        continue;
    r->project_job = (trip_cpu_job){ .run = project_chunk,
                                     .context = r,
                                     .tasks = r->filling->chunk_count - r->first_chunk };
    trip_cpu_pool_start(r->pool, &r->project_job);
    trip_cpu_pool_wait(r->pool, &r->project_job);
}

static int draw(trip_renderer *base, const trip_batch *batch, bool front_to_back)
{
    cpu *r = (cpu *)base;
    bool shading = r->frame->settings->shading && batch->normals;
    cursor at = { 0, 0 };
    if (front_to_back != r->view.front_to_back || shading != r->view.shading) {
        settle(r);
        trip_cpu_view_make(&r->view, r->frame, r->view.axis, front_to_back);
        r->view.shading = shading;
    }
    while (at.run < batch->run_count) {
        project_batch(r, batch, &at);
        if (at.run < batch->run_count)
            flush(r);
    }
    return 0;
}

/* ---- lists and frames ---- */

static void merge_tile(void *context, unsigned task, unsigned thread)
{
    cpu *r = context;
    (void)thread;
    if (!(r->states[task] & TILE_BEGUN))
        return;
    bool first = !(r->states[task] & TILE_MERGED);
    r->kernels->tile_merge(&r->view, tile_x(r, task), tile_y(r, task), tile_pixels(r, task), first,
                           r->sums + (size_t)task * FLOATS_PER_TILE);
    r->states[task] = TILE_MERGED;
}

static void finish_tile(void *context, unsigned task, unsigned thread)
{
    cpu *r = context;
    (void)thread;
    const float *sum =
        r->states[task] & TILE_MERGED ? r->sums + (size_t)task * FLOATS_PER_TILE : NULL;
    r->kernels->tile_finish(&r->view, tile_x(r, task), tile_y(r, task), sum, r->rgba);
}

static void for_each_tile(cpu *r, void (*run)(void *, unsigned, unsigned))
{
    r->tile_job = (trip_cpu_job){ .run = run, .context = r, .tasks = tile_count(r) };
    trip_cpu_pool_start(r->pool, &r->tile_job);
    trip_cpu_pool_wait(r->pool, &r->tile_job);
}

/* What the threads counted in the list. */
static void take_counts(cpu *r)
{
    trip_list_stats *list = &r->stats[r->view.axis];
    for (unsigned i = 0; i < trip_cpu_pool_threads(r->pool); i++) {
        list->splats_projected += r->workers[i].counts.splats_projected;
        list->splats_drawn += r->workers[i].counts.splats_drawn;
        r->workers[i].counts = (trip_list_stats){ 0 };
    }
}

static void end_list(cpu *r)
{
    if (!r->in_list)
        return;
    settle(r);
    for_each_tile(r, merge_tile);
    take_counts(r);
    r->in_list = false;
}

static int begin_list(trip_renderer *base, int axis)
{
    cpu *r = (cpu *)base;
    end_list(r);
    trip_cpu_view_make(&r->view, r->frame, axis, true);
    for (uint32_t t = 0; t < tile_count(r); t++) {
        bool none = trip_cpu_tile_without_weight(&r->view, tile_x(r, t), tile_y(r, t));
        atomic_store_explicit(&r->closed[t], none, memory_order_relaxed);
        atomic_store_explicit(&r->open_quarters[t], 15, memory_order_relaxed);
    }
    r->in_list = true;
    return 0;
}

static void *part(char *memory, size_t *at, size_t bytes)
{
    void *p = memory ? memory + *at : NULL;
    *at += (bytes + 63) & ~(size_t)63;
    return p;
}

static size_t lay_out(cpu *r, char *memory)
{
    size_t at = 0, tiles = tile_count(r);
    r->pixels = part(memory, &at, tiles * FLOATS_PER_TILE * sizeof *r->pixels);
    r->sums = part(memory, &at, tiles * FLOATS_PER_TILE * sizeof *r->sums);
    r->states = part(memory, &at, tiles);
    r->closed = part(memory, &at, tiles);
    r->open_quarters = part(memory, &at, tiles);
    r->portions = part(memory, &at, 4 * tiles * sizeof *r->portions);
    /* Bins look one tile beyond the last, diagonally. */
    for (unsigned i = 0; i < trip_cpu_pool_threads(r->pool); i++)
        r->workers[i].tile_counts =
            part(memory, &at, (tiles + r->grid.across + 2) * sizeof *r->tile_counts);
    return at;
}

static void release_tiles(cpu *r)
{
    trip_budget_release(r->budget, r->pixels, r->tiles_bytes);
    r->pixels = NULL;
    r->tiles_bytes = 0;
    r->grid = (trip_cpu_grid){ 0, 0 };
}

static int fit_tiles(cpu *r, int width, int height)
{
    trip_cpu_grid grid = { ((uint32_t)width + TRIP_CPU_TILE - 1) / TRIP_CPU_TILE,
                           ((uint32_t)height + TRIP_CPU_TILE - 1) / TRIP_CPU_TILE };
    if (grid.across == r->grid.across && grid.down == r->grid.down)
        return 0;
    release_tiles(r);
    r->grid = grid;
    size_t bytes = lay_out(r, NULL);
    char *memory = trip_budget_take(r->budget, bytes);
    if (!memory) {
        r->grid = (trip_cpu_grid){ 0, 0 };
        return trip_fail(TRIP_ERROR, "render", "CPU renderer",
                         "%zu bytes of pixels do not fit the memory given; raise --memory or draw "
                         "a smaller image",
                         bytes);
    }
    lay_out(r, memory);
    r->tiles_bytes = bytes;
    for (int i = 0; i < 2; i++) {
        int status = trip_cpu_flush_fit(&r->flushes[i], tile_count(r), r->budget);
        if (status)
            return status;
    }
    return 0;
}

static int begin_frame(trip_renderer *base, const trip_frame *frame)
{
    cpu *r = (cpu *)base;
    trip_cpu_pool_wait(r->pool, &r->blend_job); /* of a frame that was given up */
    trip_cpu_flush_empty(r->filling);
    r->in_list = false;
    r->frame = frame;
    take_counts(r);
    memset(r->stats, 0, sizeof r->stats);
    int status = fit_tiles(r, frame->camera->width, frame->camera->height);
    if (status)
        return status;
    trip_cpu_view_make(&r->view, frame, frame->plan->axis_of_view, true);
    memset(r->states, 0, tile_count(r));
    return 0;
}

static int end_frame(trip_renderer *base, float *rgba)
{
    cpu *r = (cpu *)base;
    end_list(r);
    r->rgba = rgba;
    for_each_tile(r, finish_tile);
    return 0;
}

static void stats(const trip_renderer *base, trip_list_stats lists[3])
{
    memcpy(lists, ((const cpu *)base)->stats, 3 * sizeof *lists);
}

static const char *device(const trip_renderer *base)
{
    return ((const cpu *)base)->device;
}

static void destroy(trip_renderer *base)
{
    cpu *r = (cpu *)base;
    trip_budget *budget = r->budget;
    if (r->pool)
        trip_cpu_pool_wait(r->pool, &r->blend_job);
    trip_cpu_pool_destroy(r->pool);
    release_tiles(r);
    for (int i = 0; i < 2; i++)
        trip_cpu_flush_destroy(&r->flushes[i], budget);
    trip_budget_release(budget, r->workers, r->workers_bytes);
    trip_budget_release(budget, r, sizeof *r);
}

static const trip_renderer_ops cpu_ops = {
    .name = "cpu",
    .destroy = destroy,
    .device = device,
    .begin_frame = begin_frame,
    .begin_list = begin_list,
    .draw = draw,
    .end_frame = end_frame,
    .stats = stats,
};

bool trip_cpu_covered(void *renderer, const trip_selection *selection, uint32_t brick)
{
    cpu *r = renderer;
    if (r->base.ops != &cpu_ops || !r->in_list || selection->axis != r->view.axis ||
        !r->view.front_to_back)
        return false;
    trip_cpu_box box =
        trip_cpu_brick_box(&r->view, brick, selection->sheet_first, selection->sheet_last);
    return trip_cpu_box_is_hidden(&r->view, r->grid, r->closed, &box);
}

/* ---- creation ---- */

/* An eighth of the memory given goes to the two buffers of splats. */
static uint32_t flush_capacity(const trip_budget *budget)
{
    uint64_t each = trip_budget_limit_bytes(budget) / 16 / 100; /* bytes a splat, roughly */
    return each < MIN_SPLATS ? MIN_SPLATS : each > MAX_SPLATS ? MAX_SPLATS : (uint32_t)each;
}

static int create_parts(cpu *r, unsigned threads)
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
                         "the memory given does not suffice for %u threads; raise --memory",
                         threads);
    }
    for (int i = 0; i < 2 && !status; i++)
        status = trip_cpu_flush_create(&r->flushes[i], flush_capacity(r->budget), r->budget);
    r->filling = &r->flushes[0];
    snprintf(r->device, sizeof r->device, "CPU, %s, %u thread%s", r->kernels->isa, threads,
             threads == 1 ? "" : "s");
    return status;
}

int trip_cpu_create(trip_renderer **out, trip_budget *budget, unsigned threads)
{
    *out = NULL;
    const trip_cpu_kernels *kernels = trip_cpu_isa_choose(getenv("TRIPTYCH_ISA"));
    if (!kernels)
        return TRIP_USAGE;
    cpu *r = trip_budget_take(budget, sizeof *r);
    if (!r)
        return trip_fail(TRIP_ERROR, "render", "CPU renderer", "out of memory");
    r->base.ops = &cpu_ops;
    r->budget = budget;
    r->kernels = kernels;
    int status = create_parts(r, threads);
    if (status) {
        destroy(&r->base);
        return status;
    }
    *out = &r->base;
    return 0;
}
