#include "cpu/cpu_batch.h"

#include <math.h>
#include <string.h>

#include "cpu/cull.h"
#include "cpu/panes.h"

/* A chunk of fewer voxels costs more than it gains. */
enum { MIN_CHUNK = 512 };

/* If a smaller share of the voxels is visible, the frame counts as much occluded. */
#define MUCH_OCCLUDED 0.75

/* ---- projecting a chunk ---- */

/* Returns whether the batch also holds TRIP_CPU_READABLE bytes after `bytes` bytes of the plane. */
static bool may_read_behind(const trip_batch *batch, int plane, const unsigned char *at,
                            size_t bytes)
{
    return (size_t)(at - batch->planes[plane]) + bytes + TRIP_CPU_READABLE <=
           batch->plane_bytes[plane];
}

/* Copies the codes and normals of the square's drawn voxels to the worker. Codes of two bytes are
 * unpacked first. */
static void keep_drawn(trip_cpu_worker *w, const trip_block *b, const trip_square *at,
                       uint64_t drawn, trip_cpu_square *s)
{
    unsigned char *codes = w->codes, *normals = w->normals;
    const unsigned code = b->code_bytes, normal = b->normal_bytes;
    uint16_t unpacked[64];
    const unsigned char *from = code == 1 ? at->codes : (const unsigned char *)unpacked;
    uint32_t n = 0, k = 0;
    trip_square_codes(at, unpacked);
    for (uint64_t rest = s->mask; rest; rest &= rest - 1, k++) {
        if (!(drawn & rest & -rest))
            continue;
        memcpy(codes + (size_t)n * code, from + (size_t)k * code, code);
        if (s->normals)
            memmove(normals + (size_t)n * normal, s->normals + (size_t)k * normal, normal);
        n++;
    }
    s->mask &= drawn;
    s->min = 0;
    s->width = 8 * code;
    s->codes = codes;
    s->normals = s->normals ? normals : NULL;
}

trip_cpu_part_squares trip_cpu_part_squares_of(const trip_cpu *r, const trip_cpu_part *part)
{
    const trip_block *b = &part->block;
    const bool all = trip_plan_draws_all(r->frame->plan, trip_batch_list(r->batch, part->run));
    return (trip_cpu_part_squares){
        .of = r,
        .part = part,
        .as_they_are =
            all &&
            may_read_behind(r->batch, TRIP_PLANE_VOXELS, (const unsigned char *)b->present,
                            b->words * sizeof *b->present) &&
            (!b->normals || may_read_behind(r->batch, TRIP_PLANE_NORMALS, b->normals,
                                            (size_t)b->count * b->normal_bytes)),
    };
}

trip_cpu_square trip_cpu_make_square(const trip_cpu_part_squares *of, trip_cpu_worker *w,
                                     const trip_square *at)
{
    const trip_cpu *r = of->of;
    const trip_run *run = of->part->run;
    const trip_block *b = &of->part->block;
    const size_t normal = (size_t)at->first * b->normal_bytes;
    trip_cpu_square s = {
        .u = run->u + TRIP_CPU_SQUARE * (int)trip_cpu_square_u(at->number),
        .v = run->v + TRIP_CPU_SQUARE * (int)trip_cpu_square_v(at->number),
        .sheet = run->sheet,
        .mask = at->mask,
        .min = at->min,
        .width = at->width,
        .codes = at->codes,
        .normals = b->normals ? b->normals + normal : NULL,
    };
    if (of->as_they_are)
        return s;
    const uint32_t code_bytes = trip_square_code_bytes(at);
    uint64_t drawn =
        trip_plan_square(r->frame->plan, trip_batch_list(r->batch, run), s.sheet, s.u, s.v);
    if (!(s.mask & drawn)) {
        s.mask = 0;
        return s;
    }
    if (!may_read_behind(r->batch, TRIP_PLANE_VOXELS, s.codes, code_bytes))
        s.codes = memcpy(w->codes, s.codes, code_bytes);
    if (s.normals &&
        !may_read_behind(r->batch, TRIP_PLANE_NORMALS, s.normals, at->count * b->normal_bytes))
        s.normals = memcpy(w->normals, s.normals, at->count * b->normal_bytes);
    if (s.mask & ~drawn)
        keep_drawn(w, b, at, drawn, &s);
    return s;
}

/* Fills w->parts with the parts of the chunk that may be visible. Returns the number of parts. */
static uint32_t cull_chunk(const trip_cpu *r, trip_cpu_worker *w, trip_cpu_chunk *chunk)
{
    const trip_cpu_culling culling = { r->kernels, &r->views[chunk->list], &r->mask,
                                       &w->scratch.lanes };
    uint32_t n = 0, skip = chunk->skip, left = chunk->voxels;
    for (size_t i = chunk->run; left > 0; i++) {
        const trip_run *run = &r->batch->runs[i];
        const trip_block block = trip_block_of(r->batch, run);
        trip_cpu_part *part = &w->parts[n];
        trip_cpu_part_make(part, run, &block, r->batch->pass->descending, skip, left);
        left -= part->voxels;
        skip = 0;
        if (r->frame->count)
            trip_cpu_count_part(r, w, chunk, part);
        trip_cpu_cull(&culling, part);
        n += part->voxels > 0;
    }
    return n;
}

static bool much_is_occluded(const trip_cpu *r)
{
    return r->visible_per_voxel < MUCH_OCCLUDED;
}

/* Appends the splats of the staged voxels to the chunk and empties the stage. */
static void empty_staged(const trip_cpu *r, trip_cpu_worker *w, trip_cpu_chunk *chunk,
                         uint32_t *staged)
{
    const _Atomic uint64_t *open = much_is_occluded(r) ? r->mask.panes : NULL;
    uint32_t at = chunk->splat + chunk->splats;
    /* The last vector may be part full. A code left there from voxels with longer codes has no row
     * in this table. */
    memset(w->scratch.staged.code + *staged, 0, 16 * sizeof *w->scratch.staged.code);
    chunk->splats +=
        r->project(&r->views[chunk->list], open, &w->scratch.staged, *staged, &w->scratch.lanes,
                   r->filling->splats + at, trip_cpu_depths_from(r->filling, at));
    *staged = 0;
}

static void project_part(const trip_cpu *r, trip_cpu_worker *w, trip_cpu_chunk *chunk,
                         const trip_cpu_part *part, uint32_t *staged)
{
    bool reversed = r->batch->pass->descending;
    trip_square squares[TRIP_BLOCK_SQUARES_MAX];
    const uint32_t count = trip_block_squares(&part->block, squares);
    const trip_cpu_part_squares of = trip_cpu_part_squares_of(r, part);
    for (uint32_t i = 0; i < count; i++) {
        const trip_square *at = &squares[reversed ? count - 1 - i : i];
        if (!trip_cpu_part_has(part, at->number))
            continue;
        trip_cpu_square square = trip_cpu_make_square(&of, w, at);
        if (square.mask == 0)
            continue;
        *staged = r->kernels->stage(&r->views[chunk->list], &square, reversed, &w->scratch.staged,
                                    *staged);
        if (*staged > TRIP_CPU_STAGED - 64)
            empty_staged(r, w, chunk, staged);
    }
}

static void project_chunk(void *context, unsigned task, unsigned thread)
{
    trip_cpu *r = context;
    if (trip_interrupted())
        return;
    trip_cpu_worker *w = &r->workers[thread];
    trip_cpu_chunk *chunk = &r->filling->chunks[r->first_chunk + task];
    uint32_t staged = 0, visible = cull_chunk(r, w, chunk), voxels = 0;
    for (uint32_t i = 0; i < visible; i++)
        voxels += w->parts[i].voxels;
    if (voxels == 0 || !trip_cpu_buffer_claim(r->filling, chunk, voxels))
        return;
    for (uint32_t i = 0; i < visible; i++)
        project_part(r, w, chunk, &w->parts[i], &staged);
    empty_staged(r, w, chunk, &staged);
    trip_cpu_sort_chunk(r->filling, chunk, r->mask.grid, &w->sorting);
}

/* ---- cutting a batch into chunks ---- */

/* A position in a batch's runs. */
typedef struct cursor {
    size_t run;
    uint32_t skip, skipped; /* squares before it in draw order, and their voxels */
} cursor;

/* Estimates how many more voxels fit the buffer, from the recent share of visible voxels. An empty
 * buffer always takes at least one chunk. A much occluded frame fills only a quarter of the buffer,
 * because splats that are blended earlier occlude later ones. */
static uint64_t room(const trip_cpu *r)
{
    const trip_cpu_buffer *f = r->filling;
    uint64_t used = atomic_load_explicit(&f->splats_used, memory_order_relaxed);
    uint32_t capacity = much_is_occluded(r) ? f->capacity / 4 : f->capacity;
    double left = ((double)capacity - (double)used) / (1.1 * r->visible_per_voxel);
    if (f->chunk_count == 0)
        left = fmax(left, TRIP_CPU_CHUNK);
    return left < MIN_CHUNK ? 0 : (uint64_t)left;
}

static uint64_t voxels_from(const trip_batch *batch, const cursor *at)
{
    uint64_t voxels = 0;
    for (size_t i = at->run; i < batch->run_count; i++)
        voxels += batch->runs[i].count;
    return voxels - at->skipped;
}

/* Returns the size of the next chunk if `left` voxels remain. Chunks shrink towards the end, so
 * that the threads finish together. */
static uint32_t chunk_voxels(const trip_cpu *r, uint64_t left)
{
    uint64_t each = left / trip_cpu_pool_threads(r->pool) / 2;
    return each < MIN_CHUNK ? MIN_CHUNK : each > TRIP_CPU_CHUNK ? TRIP_CPU_CHUNK : (uint32_t)each;
}

/* Advances within a run over squares that hold at most `max` voxels together. Returns the number of
 * voxels. */
static uint32_t take_squares(const trip_batch *batch, uint32_t max, cursor *at)
{
    const trip_block block = trip_block_of(batch, &batch->runs[at->run]);
    trip_cpu_walk w = trip_cpu_walk_begin(&block, batch->pass->descending);
    uint32_t voxels = 0;
    for (uint32_t i = 0; i < at->skip; i++)
        trip_cpu_walk_next(&w);
    while (trip_cpu_walk_next(&w) && voxels + w.count <= max) {
        voxels += w.count;
        at->skip++;
    }
    at->skipped += voxels;
    return voxels;
}

/* Reserves the next chunk, of at most `max` voxels of one list. Returns false at the end of the
 * batch, or if no chunk is left. */
static bool reserve_chunk(trip_cpu *r, const trip_batch *batch, uint32_t max, cursor *at)
{
    trip_cpu_chunk *chunk = at->run < batch->run_count ? trip_cpu_buffer_reserve(r->filling) : NULL;
    if (!chunk)
        return false;
    unsigned selection = batch->runs[at->run].selection;
    chunk->run = at->run;
    chunk->skip = at->skip;
    chunk->skipped = at->skipped;
    chunk->list = batch->pass->selections[selection].list->index;
    while (at->run < batch->run_count && chunk->voxels < max &&
           at->run - chunk->run < TRIP_CPU_CHUNK_RUNS &&
           batch->runs[at->run].selection == selection) {
        uint32_t left = batch->runs[at->run].count - at->skipped, wanted = max - chunk->voxels;
        if (left > wanted) {
            chunk->voxels += take_squares(batch, wanted, at);
            break;
        }
        chunk->voxels += left;
        *at = (cursor){ at->run + 1, 0, 0 };
    }
    return true;
}

/* Fails if the projection of a splat was not finite. */
static int check_splats(const trip_cpu *r)
{
    for (unsigned i = 0; i < trip_cpu_pool_threads(r->pool); i++)
        if (r->workers[i].scratch.lanes.broken)
            return trip_splat_fail();
    return 0;
}

/* Moves the cursor back to the first chunk that did not fit the buffer. Adds the kept chunks to the
 * lists' counts. */
static void keep_chunks(trip_cpu *r, cursor *at)
{
    trip_cpu_buffer *f = r->filling;
    uint32_t reserved = f->chunk_count, kept = trip_cpu_buffer_cut(f);
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

/* Updates the share of visible voxels, which room() uses. A few voxels alone say little, so earlier
 * voxels enter the average with the weight of one chunk. */
static void update_visible_per_voxel(trip_cpu *r, uint64_t visible, uint64_t voxels)
{
    double earlier = TRIP_CPU_CHUNK;
    double now = ((double)visible + earlier * r->visible_per_voxel) / ((double)voxels + earlier);
    r->visible_per_voxel = fmax(0.02, now);
}

/* Projects as much of the batch as fits the buffer. */
static int project_batch(trip_cpu *r, const trip_batch *batch, cursor *at)
{
    trip_cpu_buffer *f = r->filling;
    uint64_t used = atomic_load_explicit(&f->splats_used, memory_order_relaxed), reserved = 0;
    r->batch = batch;
    r->first_chunk = f->chunk_count;
    uint64_t wanted = voxels_from(batch, at), max = room(r);
    wanted = wanted < max ? wanted : max;
    while (reserved < wanted && reserve_chunk(r, batch, chunk_voxels(r, wanted - reserved), at))
        reserved += f->chunks[f->chunk_count - 1].voxels;
    if (reserved == 0)
        return 0;
    r->project_job = (trip_cpu_job){ .run = project_chunk,
                                     .context = r,
                                     .tasks = f->chunk_count - r->first_chunk };
    trip_cpu_pool_start(r->pool, &r->project_job);
    trip_cpu_pool_wait(r->pool, &r->project_job);
    update_visible_per_voxel(r, atomic_load_explicit(&f->splats_used, memory_order_relaxed) - used,
                             reserved);
    keep_chunks(r, at);
    return check_splats(r);
}

int trip_cpu_draw_batch(trip_cpu *r, const trip_batch *batch)
{
    cursor at = { 0, 0, 0 };
    int status = 0;
    while (at.run < batch->run_count && !status) {
        status = project_batch(r, batch, &at);
        if (at.run < batch->run_count)
            trip_cpu_blend_filled(r);
        if (!status)
            status = trip_frame_poll();
    }
    return status;
}
