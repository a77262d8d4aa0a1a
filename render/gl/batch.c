#include "gl/batch.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "report.h"

/* OpenGL 4.5 promises storage blocks of 128 MiB; vertex numbers, four a splat, stay below 2^31. */
enum { MAX_BLOCK_BYTES = 1 << 27, MAX_POSITIONS = MAX_BLOCK_BYTES / sizeof(uint32_t) };

static int count_positions(trip_gl_batch *b, const trip_batch *batch)
{
    uint64_t sum = 0;
    for (size_t i = 0; i < batch->run_count; i++)
        sum += batch->runs[i].count;
    if (sum > MAX_POSITIONS || batch->run_count > MAX_BLOCK_BYTES / sizeof(struct trip_gl_run))
        return trip_fail(TRIP_ERROR, "gl", "batch",
                         "%llu splats at a time are too many; read in smaller pieces",
                         (unsigned long long)sum);
    b->positions = (uint32_t)sum;
    return TRIP_OK;
}

static trip_gl_part next_part(size_t *end, size_t bytes)
{
    trip_gl_part part = { *end, bytes };
    *end = trip_gl_ring_after(*end, bytes);
    return part;
}

static int take_slot(trip_gl_batch *b, trip_gl_ring *ring, const trip_batch *batch)
{
    size_t end = 0, bytes = b->positions * sizeof(uint32_t);
    b->voxels = next_part(&end, batch->planes[TRIP_PLANE_VOXELS] ? bytes : 0);
    b->normals = next_part(&end, batch->planes[TRIP_PLANE_NORMALS] ? bytes : 0);
    b->runs = next_part(&end, batch->run_count * sizeof(struct trip_gl_run));
    b->run_of = next_part(&end, bytes);
    return trip_gl_ring_take(ring, end, &b->slot);
}

/* The records of a run, decoded, from place `at` on. */
static void decode_run(trip_gl_batch *b, const trip_batch *batch, const trip_run *run, uint64_t at)
{
    const trip_block block = trip_block_of(batch, run);
    void *voxels = b->slot->memory + b->voxels.offset;
    void *normals = b->slot->memory + b->normals.offset;
    trip_block_voxels(&block, 0, run->count, (uint32_t *)voxels + at);
    if (block.normals)
        trip_block_normals(&block, 0, run->count, (uint32_t *)normals + at);
}

/* One piece for each run at most. */
static int make_room(trip_gl_batch *b, size_t runs)
{
    b->piece_count = 0;
    if (runs <= b->piece_room)
        return TRIP_OK;
    trip_gl_piece *pieces = realloc(b->pieces, runs * sizeof *pieces);
    if (!pieces)
        return trip_fail(TRIP_ERROR, "gl", "batch", "out of memory");
    b->pieces = pieces;
    b->piece_room = runs;
    return TRIP_OK;
}

static double dot(const trip_gl_double4 *a, const double c[3])
{
    return a->v[0] * c[0] + a->v[1] * c[1] + a->v[2] * c[2];
}

/* The record of `count` draw positions from `position` on. Positions in GL memory are whole: there
 * the origin is the volume's. */
static struct trip_gl_run make_run(const trip_gl_placing *p, const trip_run *run, uint64_t first,
                                   bool descending, bool whole, uint32_t position)
{
    const trip_gl_frame_double *f = &p->constants;
    const double origin[3] = { whole ? 0 : run->sheet, whole ? 0 : run->u, whole ? 0 : run->v };
    double c[3];
    for (int i = 0; i < 3; i++)
        c[i] = origin[i] - trip_component(p->camera->eye, (p->axis + i) % 3);
    double px = p->camera->ortho ? f->screen.v[0] : 0, py = p->camera->ortho ? f->screen.v[1] : 0;
    int64_t at = (int64_t)first;
    at = descending ? at + run->count - 1 + position : at - position;
    struct trip_gl_run r = {
        .base = { (float)c[0], (float)c[1], (float)c[2] },
        .first = (int32_t)at,
        .step = descending ? -1 : 1,
        .place = { (float)(dot(&f->to_x, c) - px), (float)(dot(&f->to_y, c) - py),
                   (float)dot(&f->forward, c) },
    };
    r.base_low = (trip_gl_vec3){ (float)(c[0] - (double)r.base.x), (float)(c[1] - (double)r.base.y),
                                 (float)(c[2] - (double)r.base.z) };
    return r;
}

/* Whether some place in the run's tile is nearer than sprites can be drawn. */
static bool needs_quads(const trip_gl_placing *p, const trip_run *run)
{
    if (p->quads || p->sprite_depth == HUGE_VAL)
        return true;
    if (p->sprite_depth <= 0)
        return false;
    int u = (p->axis + 1) % 3, v = (p->axis + 2) % 3;
    trip_vec3 forward = p->camera->forward;
    double depth = trip_component(forward, p->axis) * run->sheet +
                   trip_component(forward, u) * run->u + trip_component(forward, v) * run->v -
                   trip_dot(forward, p->camera->eye);
    double far = p->tile_voxels - 1;
    depth += fmin(0, trip_component(forward, u) * far) + fmin(0, trip_component(forward, v) * far);
    return depth < p->sprite_depth;
}

static void add_piece(trip_gl_batch *b, uint32_t first, uint32_t count, unsigned list, bool quads)
{
    trip_gl_piece *last = b->piece_count ? &b->pieces[b->piece_count - 1] : NULL;
    if (last && last->quads == quads && last->list == list)
        last->count += count;
    else
        b->pieces[b->piece_count++] = (trip_gl_piece){ first, count, list, quads };
}

static void fill_runs(trip_gl_batch *b, const trip_gl_placing *placings, const trip_batch *batch,
                      bool resident)
{
    void *memory = b->slot->memory + b->runs.offset;
    struct trip_gl_run *runs = memory;
    memory = b->slot->memory + b->run_of.offset;
    uint32_t *run_of = memory, position = 0;
    for (size_t i = 0; i < batch->run_count; i++) {
        const trip_run *run = &batch->runs[i];
        unsigned list = trip_batch_list(batch, run)->index;
        const trip_gl_placing *p = &placings[list];
        uint64_t first = resident ? run->first : position;
        runs[i] = make_run(p, run, first, batch->pass->descending, resident, position);
        if (!resident)
            decode_run(b, batch, run, position);
        add_piece(b, position, run->count, list, needs_quads(p, run));
        for (uint32_t k = 0; k < run->count; k++)
            run_of[position++] = (uint32_t)i;
    }
}

int trip_gl_batch_fill(trip_gl_batch *b, trip_gl_ring *ring, const trip_gl_placing *placings,
                       const trip_batch *batch, bool resident)
{
    int status = count_positions(b, batch);
    if (!status)
        status = make_room(b, batch->run_count);
    if (!status)
        status = take_slot(b, ring, batch);
    if (!status)
        fill_runs(b, placings, batch, resident);
    return status;
}

void trip_gl_batch_release(trip_gl_batch *b)
{
    free(b->pieces);
    *b = (trip_gl_batch){ 0 };
}
