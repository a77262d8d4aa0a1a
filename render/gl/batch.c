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
    if (sum > MAX_POSITIONS || batch->splats > MAX_POSITIONS ||
        batch->run_count > MAX_BLOCK_BYTES / sizeof(struct trip_gl_run))
        return trip_fail(TRIP_ERROR, "gl", "batch",
                         "%zu splats at a time are too many; read in smaller pieces",
                         batch->splats);
    b->positions = (uint32_t)sum;
    return TRIP_OK;
}

static trip_gl_part next_part(size_t *end, size_t bytes)
{
    trip_gl_part part = { *end, bytes };
    *end = trip_gl_ring_after(*end, bytes);
    return part;
}

/* Where records that lie in GL memory are. */
static trip_gl_part part_in(const trip_gl_slot *slot, const uint32_t *records, size_t bytes)
{
    const unsigned char *at = (const unsigned char *)records;
    return records ? (trip_gl_part){ (size_t)(at - slot->memory), bytes } : (trip_gl_part){ 0 };
}

static int take_slot(trip_gl_batch *b, trip_gl_ring *ring, const trip_batch *batch,
                     trip_gl_slot *records)
{
    size_t end = 0, bytes = batch->splats * TRIP_RECORD_BYTES;
    if (records) {
        b->voxels = part_in(records, batch->voxels, bytes);
        b->normals = part_in(records, batch->normals, bytes);
    } else {
        b->voxels = next_part(&end, batch->voxels ? bytes : 0);
        b->normals = next_part(&end, batch->normals ? bytes : 0);
    }
    b->runs = next_part(&end, batch->run_count * sizeof(struct trip_gl_run));
    b->run_of = next_part(&end, b->positions * sizeof(uint32_t));
    int status = trip_gl_ring_take(ring, end, &b->slot);
    b->records = records ? records : b->slot;
    return status;
}

static void copy_records(trip_gl_batch *b, const trip_batch *batch)
{
    if (b->voxels.bytes)
        memcpy(b->slot->memory + b->voxels.offset, batch->voxels, b->voxels.bytes);
    if (b->normals.bytes)
        memcpy(b->slot->memory + b->normals.offset, batch->normals, b->normals.bytes);
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
                      const uint64_t *list_firsts)
{
    void *memory = b->slot->memory + b->runs.offset;
    struct trip_gl_run *runs = memory;
    memory = b->slot->memory + b->run_of.offset;
    uint32_t *run_of = memory, position = 0;
    for (size_t i = 0; i < batch->run_count; i++) {
        const trip_run *run = &batch->runs[i];
        unsigned list = trip_batch_list(batch, run)->index;
        const trip_gl_placing *p = &placings[list];
        uint64_t first = list_firsts ? list_firsts[i] : run->first;
        runs[i] = make_run(p, run, first, batch->pass->descending, list_firsts != NULL, position);
        add_piece(b, position, run->count, list, needs_quads(p, run));
        for (uint32_t k = 0; k < run->count; k++)
            run_of[position++] = (uint32_t)i;
    }
}

int trip_gl_batch_fill(trip_gl_batch *b, trip_gl_ring *ring, const trip_gl_placing *placings,
                       const trip_batch *batch, trip_gl_slot *records, const uint64_t *list_firsts)
{
    int status = count_positions(b, batch);
    if (!status)
        status = make_room(b, batch->run_count);
    if (!status)
        status = take_slot(b, ring, batch, records);
    if (status)
        return status;
    if (!records)
        copy_records(b, batch);
    fill_runs(b, placings, batch, list_firsts);
    return TRIP_OK;
}

void trip_gl_batch_release(trip_gl_batch *b)
{
    free(b->pieces);
    *b = (trip_gl_batch){ 0 };
}
