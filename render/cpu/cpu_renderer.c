/* The CPU renderer: its threads project the voxels of a batch into splats, sort them by screen tile
 * and blend each tile's splats in list order, while the next batch is projected. What a pixel gets
 * depends on the order of the splats alone, never on where a batch, chunk or flush ends, so the
 * picture is the same bit for bit for any number of threads, memory, tile and batch size. Once the
 * program is interrupted no task does anything, and what waits for them returns at once. */
#include "cpu/cpu_renderer.h"

#include <stdlib.h>
#include <string.h>

#include "cpu/bin.h"
#include "cpu/count.h"
#include "cpu/cover.h"
#include "cpu/kernels/isa.h"
#include "cpu/near.h"
#include "cpu/pool.h"
#include "cpu/show.h"
#include "report.h"
#include "weight.h"

#define VISIBLE_BYTES (65536 * sizeof(trip_tf_entry))

enum { MAX_SPLATS = 1 << 17, MIN_SPLATS = 1 << 13 };

/* Fewer voxels are not worth a chunk. */
enum { LEAST_CHUNK = 512 };

/* Much is hidden where fewer voxels than this share show. */
#define MUCH_HIDDEN 0.75

/* What has become of a tile's pixels. */
enum tile_state {
    TILE_BEGUN = 1,  /* in the layer being drawn */
    TILE_MERGED = 2, /* the sum holds earlier layers */
};

/* One thread's own memory. */
typedef struct worker {
    trip_cpu_scratch scratch;
    trip_cpu_part parts[TRIP_CPU_CHUNK_RUNS]; /* of the chunk at hand */
    /* A square's bytes, where those about them may not be read. */
    unsigned char codes[2 * 64 + 2 * TRIP_CPU_READABLE];
    unsigned char normals[4 * 64 + 2 * TRIP_CPU_READABLE];
    trip_cpu_sorting sorting;
    /* Of a tile of a picture, where the frame goes on with its own. */
    _Alignas(64) float sum[TRIP_CHANNELS_MAX * TRIP_CPU_TILE_PIXELS];
    _Alignas(64) trip_cpu_splat counted[TRIP_CPU_STAGED + 16];
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
    const trip_cpu_kernels *isa;     /* for layers of colour alone */
    const trip_cpu_kernels *kernels; /* for the frame's layers */
    trip_cpu_pool *pool;
    char device[64];
    worker *workers;
    size_t workers_bytes;

    trip_cpu_mask mask; /* bits are cleared by whoever blends the tile */
    size_t tiles_bytes; /* of everything below and the mask, which grow with the image */
    unsigned channels;  /* that there is room for */
    float *pixels, *sums;
    uint8_t *states;
    uint8_t *axes; /* whose layers may have weight in a tile, a bit each */
    portion *portions;

    const trip_frame *frame;
    trip_cpu_view view;   /* of the layer being drawn */
    trip_cpu_view *views; /* of its lists, by number in the data set */
    unsigned list_room;   /* of `views`, and of `counted_views` where that is there */
    bool in_layer;
    trip_list_stats *stats; /* by number of the list, as many as `views` */
    /* Where the frame counts: the same with every voxel visible, whatever its code. */
    trip_frame counted_frame;
    trip_cpu_view *counted_views;
    trip_tf_entry *visible; /* 65536 entries; NULL until wanted */

    trip_cpu_flush flushes[2];
    trip_cpu_flush *filling, *blending;
    const trip_batch *batch;
    uint32_t first_chunk;   /* of the job */
    double shown_per_voxel; /* of late */
    uint32_t portion_count;
    float *rgba, *depth;
    trip_cpu_job project_job, blend_job, tile_job;
} cpu;

/* ---- tiles ---- */

static uint32_t tile_count(const cpu *r)
{
    return r->mask.grid.across * r->mask.grid.down;
}

static int tile_x(const cpu *r, uint32_t tile)
{
    return (int)(tile % r->mask.grid.across) * TRIP_CPU_TILE;
}

static int tile_y(const cpu *r, uint32_t tile)
{
    return (int)(tile / r->mask.grid.across) * TRIP_CPU_TILE;
}

static size_t tile_floats(const cpu *r)
{
    return r->channels * TRIP_CPU_TILE_PIXELS;
}

static float *tile_pixels(const cpu *r, uint32_t tile)
{
    return r->pixels + tile * tile_floats(r);
}

/* Whether one layer alone has weight in a tile, and so it is 1 all over. */
static bool is_alone(const cpu *r, uint32_t tile)
{
    return (r->axes[tile] & (r->axes[tile] - 1)) == 0;
}

/* ---- projecting a batch ---- */

/* Whether TRIP_CPU_READABLE bytes before and behind those of a plane lie in the batch too. */
static bool may_read_about(const trip_batch *batch, int plane, const unsigned char *at,
                           size_t bytes)
{
    size_t before = (size_t)(at - batch->planes[plane]);
    return before >= TRIP_CPU_READABLE &&
           before + bytes + TRIP_CPU_READABLE <= batch->plane_bytes[plane];
}

/* A square of a run, with room to be read about its bytes. */
static trip_cpu_square make_square(const cpu *r, worker *w, const trip_block *b,
                                   const trip_run *run, const trip_cpu_walk *at)
{
    size_t code = (size_t)at->first * b->code_bytes, normal = (size_t)at->first * b->normal_bytes;
    unsigned square = at->number, code_bytes = at->count * b->code_bytes;
    trip_cpu_square s = {
        .u = run->u + TRIP_CPU_SQUARE * (int)trip_cpu_square_u(square),
        .v = run->v + TRIP_CPU_SQUARE * (int)trip_cpu_square_v(square),
        .sheet = run->sheet,
        .mask = at->mask,
        .codes = b->codes + code,
        .normals = b->normals ? b->normals + normal : NULL,
    };
    if (!may_read_about(r->batch, TRIP_PLANE_VOXELS, s.codes, code_bytes))
        s.codes = memcpy(w->codes + TRIP_CPU_READABLE, s.codes, code_bytes);
    if (s.normals &&
        !may_read_about(r->batch, TRIP_PLANE_NORMALS, s.normals, at->count * b->normal_bytes))
        s.normals = memcpy(w->normals + TRIP_CPU_READABLE, s.normals, at->count * b->normal_bytes);
    return s;
}

/* Counts by projecting for the count alone: what is hidden or transparent counts too. */
static void count_part(const cpu *r, worker *w, trip_cpu_chunk *chunk, const trip_block *block,
                       const trip_cpu_part *part)
{
    const trip_cpu_view *view = &r->counted_views[chunk->list];
    trip_cpu_walk at = trip_cpu_walk_begin(block, false);
    while (trip_cpu_walk_next(&at)) {
        if (!trip_cpu_part_has(part, at.number))
            continue;
        trip_cpu_square square = make_square(r, w, block, part->run, &at);
        const trip_cpu_staged *staged = &w->scratch.staged;
        uint32_t n = r->isa->stage(view, &square, false, &w->scratch.staged, 0);
        for (uint32_t i = 0; i < n; i++)
            chunk->counts.splats_projected +=
                trip_cpu_is_projected(view, staged->u[i], staged->v[i], staged->sheet[i]);
        n = r->isa->project(view, NULL, &w->scratch.staged, n, &w->scratch.lanes, w->counted, NULL);
        chunk->counts.splats_drawn += r->isa->drawn(view, &w->scratch, w->counted, n);
    }
}

/* What of a chunk may show: the number of its parts. */
static uint32_t show_chunk(const cpu *r, worker *w, trip_cpu_chunk *chunk)
{
    const trip_cpu_culling culling = { r->kernels, &r->views[chunk->list], &r->mask,
                                       &w->scratch.lanes };
    uint32_t n = 0, skip = chunk->skip, left = chunk->voxels;
    for (size_t i = chunk->run; left > 0; i++) {
        const trip_run *run = &r->batch->runs[i];
        const trip_block block = trip_block_of(r->batch, run);
        trip_cpu_part *part = &w->parts[n];
        *part = trip_cpu_part_make(run, &block, r->batch->pass->descending, skip, left);
        left -= part->voxels;
        skip = 0;
        if (r->frame->count)
            count_part(r, w, chunk, &block, part);
        trip_cpu_show(&culling, &block, part);
        n += part->voxels > 0;
    }
    return n;
}

static bool much_is_hidden(const cpu *r)
{
    return r->shown_per_voxel < MUCH_HIDDEN;
}

/* Depths of a buffer's splats from one on; NULL where it has none. */
static float *depths_from(const trip_cpu_flush *f, uint32_t splat)
{
    return f->depths ? f->depths + splat : NULL;
}

/* Projects what is staged to the end of the chunk. */
static void empty_staged(const cpu *r, worker *w, trip_cpu_chunk *chunk, uint32_t *staged)
{
    const _Atomic uint64_t *open = much_is_hidden(r) ? r->mask.tiles : NULL;
    uint32_t at = chunk->splat + chunk->splats;
    chunk->splats += r->kernels->project(&r->views[chunk->list], open, &w->scratch.staged, *staged,
                                         &w->scratch.lanes, r->filling->splats + at,
                                         depths_from(r->filling, at));
    *staged = 0;
}

static void project_part(const cpu *r, worker *w, trip_cpu_chunk *chunk, const trip_cpu_part *part,
                         uint32_t *staged)
{
    const trip_block block = trip_block_of(r->batch, part->run);
    bool reversed = r->batch->pass->descending;
    trip_cpu_walk at = trip_cpu_walk_begin(&block, reversed);
    while (trip_cpu_walk_next(&at)) {
        if (!trip_cpu_part_has(part, at.number))
            continue;
        trip_cpu_square square = make_square(r, w, &block, part->run, &at);
        *staged = r->kernels->stage(&r->views[chunk->list], &square, reversed, &w->scratch.staged,
                                    *staged);
        if (*staged > TRIP_CPU_STAGED - 64)
            empty_staged(r, w, chunk, staged);
    }
}

static void project_chunk(void *context, unsigned task, unsigned thread)
{
    cpu *r = context;
    if (trip_interrupted())
        return;
    worker *w = &r->workers[thread];
    trip_cpu_chunk *chunk = &r->filling->chunks[r->first_chunk + task];
    uint32_t staged = 0, shown = show_chunk(r, w, chunk), voxels = 0;
    for (uint32_t i = 0; i < shown; i++)
        voxels += w->parts[i].voxels;
    if (voxels == 0 || !trip_cpu_flush_claim(r->filling, chunk, voxels))
        return;
    for (uint32_t i = 0; i < shown; i++)
        project_part(r, w, chunk, &w->parts[i], &staged);
    empty_staged(r, w, chunk, &staged);
    trip_cpu_bin(r->filling, chunk, r->mask.grid, &w->sorting);
}

/* ---- blending a flush ---- */

typedef struct blend_context {
    const cpu *of;
    trip_cpu_scratch *scratch;
} blend_context;

static void blend_some(void *user, const trip_cpu_chunk *chunk, const trip_cpu_splat *splats,
                       const uint16_t *order, uint32_t count)
{
    blend_context *c = user;
    if (trip_interrupted())
        return;
    c->of->kernels->tile_blend(&c->of->views[chunk->list], c->scratch, splats,
                               depths_from(c->of->blending, chunk->splat), order, count);
}

/* The mask's bits of some quarters of a tile. */
static uint64_t bits_of_quarters(unsigned quarters)
{
    static const uint64_t quarter = 0x0f0f0f0f;
    return (quarters & 1 ? quarter : 0) | (quarters & 2 ? quarter << 4 : 0) |
           (quarters & 4 ? quarter << 32 : 0) | (quarters & 8 ? quarter << 36 : 0);
}

static void blend_portion(void *context, unsigned task, unsigned thread)
{
    cpu *r = context;
    if (trip_interrupted())
        return;
    const portion *p = &r->portions[task];
    trip_cpu_scratch *s = &r->workers[thread].scratch;
    int x = tile_x(r, p->tile), y = tile_y(r, p->tile);
    if (!(r->states[p->tile] & TILE_BEGUN)) {
        r->kernels->tile_clear(&r->view, x, y, is_alone(r, p->tile), tile_pixels(r, p->tile));
        r->states[p->tile] |= TILE_BEGUN;
    }
    r->kernels->tile_begin(&r->view, s, x, y, p->quarters, tile_pixels(r, p->tile));
    trip_cpu_share_each(r->blending, p->tile, blend_some, &(blend_context){ r, s });
    uint64_t open = r->kernels->tile_end(s) | ~bits_of_quarters(p->quarters);
    atomic_fetch_and_explicit(&r->mask.tiles[p->tile], open, memory_order_relaxed);
}

static int most_first(const void *a, const void *b)
{
    const portion *p = a, *q = b;
    return p->splats < q->splats ? 1 : p->splats > q->splats ? -1 : 0;
}

/* Tiles with work, those with most of it first. One that holds so much that a thread would still be
 * at it when the others are done, with the next splats to project too, is given out in quarters,
 * though each looks through all of its splats; not when it is new, since then one thread has to
 * clear it. */
static void make_portions(cpu *r, const trip_cpu_flush *f)
{
    uint64_t all = 0;
    r->portion_count = 0;
    for (uint32_t t = 0; t < tile_count(r); t++)
        all += f->shares[t].splats;
    uint64_t large = all / trip_cpu_pool_threads(r->pool) * 2;
    for (uint32_t t = 0; t < tile_count(r); t++) {
        uint32_t n = f->shares[t].splats;
        if (n == 0 || trip_cpu_tile_is_closed(&r->mask, t))
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
    trip_cpu_link(full, &r->mask);
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
    uint32_t skip, skipped; /* squares of it, in draw order, and their voxels */
} cursor;

/* Voxels that the buffer will still take, by how many of them showed of late; some when it is
 * empty. Where much is hidden it counts as full sooner: the sooner splats are blended, the sooner
 * they hide what lies behind them. */
static uint64_t room(const cpu *r)
{
    const trip_cpu_flush *f = r->filling;
    uint64_t used = atomic_load_explicit(&f->splats_used, memory_order_relaxed);
    uint32_t capacity = much_is_hidden(r) ? f->capacity / 4 : f->capacity;
    double left = ((double)capacity - (double)used) / (1.1 * r->shown_per_voxel);
    if (f->chunk_count == 0)
        left = fmax(left, TRIP_CPU_CHUNK);
    return left < LEAST_CHUNK ? 0 : (uint64_t)left;
}

static uint64_t voxels_from(const trip_batch *batch, const cursor *at)
{
    uint64_t voxels = 0;
    for (size_t i = at->run; i < batch->run_count; i++)
        voxels += batch->runs[i].count;
    return voxels - at->skipped;
}

/* Of a chunk, when so many are left: fewer towards the end, so that the threads end together. */
static uint32_t chunk_voxels(const cpu *r, uint64_t left)
{
    uint64_t each = left / trip_cpu_pool_threads(r->pool) / 2;
    return each < LEAST_CHUNK      ? LEAST_CHUNK
           : each > TRIP_CPU_CHUNK ? TRIP_CPU_CHUNK
                                   : (uint32_t)each;
}

/* Moves on within a run by as many squares as hold at most `most` voxels; returns how many those
 * hold. */
static uint32_t take_squares(const trip_batch *batch, uint32_t most, cursor *at)
{
    const trip_block block = trip_block_of(batch, &batch->runs[at->run]);
    trip_cpu_walk w = trip_cpu_walk_begin(&block, batch->pass->descending);
    uint32_t voxels = 0;
    for (uint32_t i = 0; i < at->skip; i++)
        trip_cpu_walk_next(&w);
    while (trip_cpu_walk_next(&w) && voxels + w.count <= most) {
        voxels += w.count;
        at->skip++;
    }
    at->skipped += voxels;
    return voxels;
}

/* Reserves the next chunk, of about `most` voxels of one list; false when the batch is through or
 * there are no more chunks. */
static bool reserve_chunk(cpu *r, const trip_batch *batch, uint32_t most, cursor *at)
{
    trip_cpu_chunk *chunk = at->run < batch->run_count ? trip_cpu_flush_reserve(r->filling) : NULL;
    if (!chunk)
        return false;
    unsigned selection = batch->runs[at->run].selection;
    chunk->run = at->run;
    chunk->skip = at->skip;
    chunk->skipped = at->skipped;
    chunk->list = batch->pass->selections[selection].list->index;
    while (at->run < batch->run_count && chunk->voxels < most &&
           at->run - chunk->run < TRIP_CPU_CHUNK_RUNS &&
           batch->runs[at->run].selection == selection) {
        uint32_t left = batch->runs[at->run].count - at->skipped, wanted = most - chunk->voxels;
        if (left > wanted) {
            chunk->voxels += take_squares(batch, wanted, at);
            break;
        }
        chunk->voxels += left;
        *at = (cursor){ at->run + 1, 0, 0 };
    }
    return true;
}

/* Fails when some splat's numbers were not finite. */
static int check_splats(const cpu *r)
{
    for (unsigned i = 0; i < trip_cpu_pool_threads(r->pool); i++)
        if (r->workers[i].scratch.lanes.broken)
            return trip_splat_fail();
    return 0;
}

/* Goes back to the first of the chunks that the buffer had no room for. */
static void keep_chunks(cpu *r, cursor *at)
{
    trip_cpu_flush *f = r->filling;
    uint32_t reserved = f->chunk_count, kept = trip_cpu_flush_cut(f);
    if (kept < reserved)
        *at = (cursor){ f->chunks[kept].run, f->chunks[kept].skip, f->chunks[kept].skipped };
    for (uint32_t i = r->first_chunk; i < kept; i++) {
        const trip_cpu_chunk *chunk = &f->chunks[i];
        trip_list_stats *stats = &r->stats[chunk->list];
        stats->splats_read += chunk->voxels;
        stats->splats_projected += chunk->counts.splats_projected;
        stats->splats_drawn += chunk->counts.splats_drawn;
    }
}

/* How many voxels show, from which room() knows how many more will fit. Few voxels tell little. */
static void learn(cpu *r, uint64_t shown, uint64_t voxels)
{
    double known = TRIP_CPU_CHUNK;
    double now = ((double)shown + known * r->shown_per_voxel) / ((double)voxels + known);
    r->shown_per_voxel = fmax(0.02, now);
}

/* As much of the batch as the buffer takes. */
static int project_batch(cpu *r, const trip_batch *batch, cursor *at)
{
    trip_cpu_flush *f = r->filling;
    uint64_t used = atomic_load_explicit(&f->splats_used, memory_order_relaxed), reserved = 0;
    r->batch = batch;
    r->first_chunk = f->chunk_count;
    uint64_t wanted = voxels_from(batch, at), most = room(r);
    wanted = wanted < most ? wanted : most;
    while (reserved < wanted && reserve_chunk(r, batch, chunk_voxels(r, wanted - reserved), at))
        reserved += f->chunks[f->chunk_count - 1].voxels;
    if (reserved == 0)
        return 0;
    r->project_job = (trip_cpu_job){ .run = project_chunk,
                                     .context = r,
                                     .tasks = f->chunk_count - r->first_chunk };
    trip_cpu_pool_start(r->pool, &r->project_job);
    trip_cpu_pool_wait(r->pool, &r->project_job);
    learn(r, atomic_load_explicit(&f->splats_used, memory_order_relaxed) - used, reserved);
    keep_chunks(r, at);
    return check_splats(r);
}

/* The views of the layer's lists. */
static void make_views(cpu *r, bool front_to_back, bool shading)
{
    const trip_dataset *data = r->frame->data;
    int axis = r->view.axis;
    trip_cpu_layer_view_make(&r->view, r->frame, axis, front_to_back);
    r->view.shading = shading;
    for (unsigned i = 0; i < data->list_count; i++) {
        const trip_list *list = &data->lists[i];
        if (list->axis != axis || !r->frame->plan->lists[i].drawn)
            continue;
        trip_cpu_view_make(&r->views[i], r->frame, list, front_to_back);
        r->views[i].shading = shading;
        if (r->frame->count)
            trip_cpu_view_make(&r->counted_views[i], &r->counted_frame, list, front_to_back);
    }
}

static int draw(trip_renderer *base, const trip_batch *batch, bool front_to_back)
{
    cpu *r = (cpu *)base;
    bool shading = r->frame->settings->shading && batch->planes[TRIP_PLANE_NORMALS];
    cursor at = { 0, 0, 0 };
    int status = 0;
    if (front_to_back != r->view.front_to_back || shading != r->view.shading) {
        settle(r);
        make_views(r, front_to_back, shading);
    }
    while (at.run < batch->run_count && !status) {
        status = project_batch(r, batch, &at);
        if (at.run < batch->run_count)
            flush(r);
        if (!status)
            status = trip_frame_poll();
    }
    return status;
}

/* ---- layers and frames ---- */

static float *tile_sum(const cpu *r, uint32_t tile)
{
    return r->sums + tile * tile_floats(r);
}

/* What is alone in its tile stays as it is. */
static bool is_to_merge(const cpu *r, uint32_t tile)
{
    return r->states[tile] & TILE_BEGUN && !is_alone(r, tile);
}

static void merge_tile(cpu *r, uint32_t tile)
{
    bool first = !(r->states[tile] & TILE_MERGED);
    r->kernels->tile_merge(&r->view, tile_x(r, tile), tile_y(r, tile), tile_pixels(r, tile), first,
                           tile_sum(r, tile));
    r->states[tile] = TILE_MERGED;
}

/* The sum with the layer being drawn in it. */
static const float *sum_so_far(const cpu *r, worker *w, uint32_t tile)
{
    if (!is_to_merge(r, tile))
        return tile_sum(r, tile);
    bool first = !(r->states[tile] & TILE_MERGED);
    if (!first)
        memcpy(w->sum, tile_sum(r, tile), tile_floats(r) * sizeof *w->sum);
    r->kernels->tile_merge(&r->view, tile_x(r, tile), tile_y(r, tile), tile_pixels(r, tile), first,
                           w->sum);
    return w->sum;
}

/* The frame's tile stays as it is. */
static void finish_tile(cpu *r, worker *w, uint32_t tile)
{
    trip_cpu_content content = TRIP_CPU_NOTHING;
    const float *pixels = NULL;
    if (r->states[tile] & TILE_BEGUN && is_alone(r, tile)) {
        content = TRIP_CPU_LAYER;
        pixels = tile_pixels(r, tile);
    } else if (r->states[tile]) {
        content = TRIP_CPU_SUM;
        pixels = sum_so_far(r, w, tile);
    }
    r->kernels->tile_finish(&r->view, tile_x(r, tile), tile_y(r, tile), content, pixels, r->rgba,
                            r->depth);
}

/* Tasks of whole rows of tiles. */
static void merge_row(void *context, unsigned task, unsigned thread)
{
    cpu *r = context;
    (void)thread;
    for (uint32_t t = task * r->mask.grid.across; t < (task + 1) * r->mask.grid.across; t++)
        if (!trip_interrupted() && is_to_merge(r, t))
            merge_tile(r, t);
}

static void finish_row(void *context, unsigned task, unsigned thread)
{
    cpu *r = context;
    for (uint32_t t = task * r->mask.grid.across; t < (task + 1) * r->mask.grid.across; t++)
        if (!trip_interrupted())
            finish_tile(r, &r->workers[thread], t);
}

static void for_each_row(cpu *r, void (*run)(void *, unsigned, unsigned))
{
    r->tile_job = (trip_cpu_job){ .run = run, .context = r, .tasks = r->mask.grid.down };
    trip_cpu_pool_start(r->pool, &r->tile_job);
    trip_cpu_pool_wait(r->pool, &r->tile_job);
}

static int end_layer(cpu *r)
{
    if (!r->in_layer)
        return 0;
    bool merge = false;
    settle(r);
    for (uint32_t t = 0; t < tile_count(r) && !merge; t++)
        merge = is_to_merge(r, t);
    if (merge)
        for_each_row(r, merge_row);
    r->in_layer = false;
    return trip_frame_poll();
}

static int begin_layer(trip_renderer *base, int axis)
{
    cpu *r = (cpu *)base;
    int status = end_layer(r);
    if (status)
        return status;
    r->view.axis = axis;
    make_views(r, true, false);
    for (uint32_t t = 0; t < tile_count(r); t++)
        atomic_store_explicit(&r->mask.tiles[t], r->axes[t] >> axis & 1 ? UINT64_MAX : 0,
                              memory_order_relaxed);
    r->in_layer = true;
    r->shown_per_voxel = 1;
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
    r->pixels = part(memory, &at, tiles * tile_floats(r) * sizeof *r->pixels);
    r->sums = part(memory, &at, tiles * tile_floats(r) * sizeof *r->sums);
    r->states = part(memory, &at, tiles);
    r->axes = part(memory, &at, tiles);
    r->mask.tiles = part(memory, &at, tiles * sizeof *r->mask.tiles);
    r->portions = part(memory, &at, 4 * tiles * sizeof *r->portions);
    /* Bins look one tile beyond the last, diagonally. */
    for (unsigned i = 0; i < trip_cpu_pool_threads(r->pool); i++)
        r->workers[i].sorting.counts = part(
            memory, &at, (tiles + r->mask.grid.across + 2) * sizeof *r->workers[i].sorting.counts);
    return at;
}

static void release_tiles(cpu *r)
{
    trip_budget_release(r->budget, r->pixels, r->tiles_bytes);
    r->pixels = NULL;
    r->tiles_bytes = 0;
    r->mask.grid = (trip_cpu_grid){ 0, 0 };
}

static int fit_tiles(cpu *r, int width, int height)
{
    trip_cpu_grid grid = { ((uint32_t)width + TRIP_CPU_TILE - 1) / TRIP_CPU_TILE,
                           ((uint32_t)height + TRIP_CPU_TILE - 1) / TRIP_CPU_TILE };
    if (grid.across == r->mask.grid.across && grid.down == r->mask.grid.down &&
        r->channels == r->kernels->channels)
        return 0;
    release_tiles(r);
    r->mask.grid = grid;
    r->channels = r->kernels->channels;
    size_t bytes = lay_out(r, NULL);
    char *memory = trip_budget_take(r->budget, bytes);
    if (!memory) {
        r->mask.grid = (trip_cpu_grid){ 0, 0 };
        return trip_fail(TRIP_ERROR, "render", "CPU renderer",
                         "%zu bytes of pixels do not fit the memory given; raise --memory or draw "
                         "a smaller image",
                         bytes);
    }
    lay_out(r, memory);
    r->tiles_bytes = bytes;
    int status = 0;
    for (int i = 0; i < 2 && !status; i++)
        status = trip_cpu_flush_fit(&r->flushes[i], tile_count(r), r->channels > TRIP_CHANNEL_DEPTH,
                                    r->budget);
    if (status)
        release_tiles(r);
    return status;
}

/* Any extinction will do that the kernels do not take for nothing. */
static int begin_counting(cpu *r)
{
    const trip_camera *camera = r->frame->camera;
    if (!r->visible)
        r->visible = trip_budget_take(r->budget, VISIBLE_BYTES);
    if (!r->visible)
        return trip_fail(TRIP_ERROR, "render", "CPU renderer",
                         "the memory given does not suffice for counting; raise --memory");
    for (int i = 0; i < 65536; i++)
        r->visible[i] = (trip_tf_entry){ .extinction = (float)(0x1p20 / camera->voxel_world) };
    r->counted_frame = *r->frame;
    r->counted_frame.table = r->visible;
    return 0;
}

static void release_lists(cpu *r)
{
    size_t bytes = r->list_room * sizeof *r->views;
    trip_budget_release(r->budget, r->views, bytes);
    trip_budget_release(r->budget, r->counted_views, bytes);
    trip_budget_release(r->budget, r->stats, r->list_room * sizeof *r->stats);
    r->views = r->counted_views = NULL;
    r->stats = NULL;
    r->list_room = 0;
}

/* Ends with room for the data set's lists and their counts at 0. */
static int fit_lists(cpu *r)
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

/* The axes, a bit each, whose layers may have weight in the tile at (x, y). Where there is but one,
 * its weight is 1 all over the tile. */
static uint8_t axes_of_tile(const trip_frame *frame, int x, int y)
{
    const double from[2] = { x, y }, to[2] = { x + TRIP_CPU_TILE, y + TRIP_CPU_TILE };
    trip_ray_bounds bounds = trip_ray_bounds_over(frame->camera, from, to);
    unsigned axes = 0;
    for (int axis = 0; axis < 3; axis++)
        if (trip_weight_may_lie(frame->settings, frame->plan->axis_of_view, &bounds, axis))
            axes |= 1u << axis;
    return (uint8_t)axes;
}

static int begin_frame(trip_renderer *base, const trip_frame *frame)
{
    cpu *r = (cpu *)base;
    trip_cpu_flush_empty(r->filling);
    r->in_layer = false;
    r->frame = frame;
    r->kernels = frame->settings->depth ? r->isa->with_depth : r->isa;
    for (unsigned i = 0; i < trip_cpu_pool_threads(r->pool); i++)
        r->workers[i].scratch.lanes.broken = false;
    int status = fit_tiles(r, frame->camera->width, frame->camera->height);
    if (!status)
        status = fit_lists(r);
    if (!status && frame->count)
        status = begin_counting(r);
    if (status)
        return status;
    trip_cpu_layer_view_make(&r->view, frame, frame->plan->axis_of_view, true);
    memset(r->states, 0, tile_count(r));
    for (uint32_t t = 0; t < tile_count(r); t++)
        r->axes[t] = axes_of_tile(frame, tile_x(r, t), tile_y(r, t));
    return 0;
}

static int picture(trip_renderer *base, float *rgba, float *depth)
{
    cpu *r = (cpu *)base;
    settle(r);
    r->rgba = rgba;
    r->depth = depth;
    for_each_row(r, finish_row);
    return trip_frame_poll();
}

/* Tiles of the last flush may still be blended. */
static void end_frame(trip_renderer *base)
{
    cpu *r = (cpu *)base;
    trip_cpu_pool_wait(r->pool, &r->blend_job);
}

static trip_list_stats stats(const trip_renderer *base, unsigned list)
{
    return ((const cpu *)base)->stats[list];
}

static const char *device(const trip_renderer *base)
{
    return ((const cpu *)base)->device;
}

static void destroy(trip_renderer *base)
{
    cpu *r = (cpu *)base;
    trip_budget *budget = r->budget;
    trip_cpu_pool_destroy(r->pool);
    release_tiles(r);
    release_lists(r);
    for (int i = 0; i < 2; i++)
        trip_cpu_flush_destroy(&r->flushes[i], budget);
    trip_budget_release(budget, r->workers, r->workers_bytes);
    trip_budget_release(budget, r->visible, VISIBLE_BYTES);
    trip_budget_release(budget, r, sizeof *r);
}

static const trip_renderer_ops cpu_ops = {
    .name = "cpu",
    .destroy = destroy,
    .device = device,
    .begin_frame = begin_frame,
    .begin_layer = begin_layer,
    .draw = draw,
    .picture = picture,
    .end_frame = end_frame,
    .stats = stats,
};

bool trip_cpu_covered(void *renderer, const trip_selection *selection, uint32_t brick)
{
    cpu *r = renderer;
    if (r->base.ops != &cpu_ops || !r->in_layer || selection->list->axis != r->view.axis ||
        !r->view.front_to_back)
        return false;
    const trip_cpu_view *view = &r->views[selection->list->index];
    trip_cpu_box box =
        trip_cpu_brick_box(view, brick, selection->sheet_first, selection->sheet_last);
    return trip_cpu_box_cover(view, &r->mask, &box) == TRIP_CPU_HIDDEN;
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
    snprintf(r->device, sizeof r->device, "CPU, %s, %u thread%s", r->isa->isa, threads,
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
    r->isa = kernels;
    int status = create_parts(r, threads);
    if (status) {
        destroy(&r->base);
        return status;
    }
    *out = &r->base;
    return 0;
}
