#include "gl/gl_batch.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "gl/frame_block.h"
#include "report.h"
#include "settings.h"

/* OpenGL 4.5 guarantees storage blocks of 128 MiB. Vertex numbers, four for each splat, stay below
 * 2^31. */
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
    b->square_count = 0;
    for (size_t i = 0; i < batch->run_count && batch->planes[TRIP_PLANE_VOXELS]; i++)
        b->square_count += trip_block_of(batch, &batch->runs[i]).squares;
    return TRIP_OK;
}

static trip_gl_part next_part(size_t *end, size_t bytes)
{
    trip_gl_part part = { *end, bytes };
    *end = trip_gl_ring_after(*end, bytes);
    return part;
}

/* Returns the part of a slot that contains a plane. The part begins at an aligned offset; *start is
 * the offset of the plane in it. */
static trip_gl_part part_in(const trip_gl_slot *slot, const trip_batch *batch, int plane,
                            size_t *start)
{
    if (!batch->planes[plane])
        return (trip_gl_part){ 0 };
    size_t at = (size_t)(batch->planes[plane] - slot->memory);
    *start = at % TRIP_GL_ALIGNMENT_BYTES;
    return (trip_gl_part){ at - *start, (*start + batch->plane_bytes[plane] + 3) / 4 * 4 };
}

static int take_slot(trip_gl_batch *b, trip_gl_ring *ring, const trip_batch *batch,
                     trip_gl_slot *records)
{
    const int voxels = TRIP_PLANE_VOXELS, normals = TRIP_PLANE_NORMALS;
    size_t end = 0;
    b->voxels_start = b->normals_start = 0;
    if (records) {
        b->voxels = part_in(records, batch, voxels, &b->voxels_start);
        b->normals = part_in(records, batch, normals, &b->normals_start);
    } else {
        b->voxels =
            next_part(&end, batch->planes[voxels] ? (batch->plane_bytes[voxels] + 3) / 4 * 4 : 0);
        b->normals =
            next_part(&end, batch->planes[normals] ? (batch->plane_bytes[normals] + 3) / 4 * 4 : 0);
    }
    b->runs = next_part(&end, batch->run_count * sizeof(struct trip_gl_run));
    b->squares = next_part(&end, b->square_count * sizeof(struct trip_gl_square));
    b->run_of = next_part(&end, b->positions * sizeof(uint32_t));
    int status = trip_gl_ring_take(ring, end, &b->slot);
    b->records = records ? records : b->slot;
    return status;
}

static void copy_planes(trip_gl_batch *b, const trip_batch *batch)
{
    const int voxels = TRIP_PLANE_VOXELS, normals = TRIP_PLANE_NORMALS;
    if (batch->planes[voxels])
        memcpy(b->slot->memory + b->voxels.offset, batch->planes[voxels],
               batch->plane_bytes[voxels]);
    if (batch->planes[normals])
        memcpy(b->slot->memory + b->normals.offset, batch->planes[normals],
               batch->plane_bytes[normals]);
}

/* Returns u and v of a square's corner in its tile, from its Morton number. */
static uint32_t corner_of(uint32_t number)
{
    return 8 * (trip_morton_even(number) | trip_morton_even(number >> 1) << 16);
}

/* State while squares and draw positions are filled. */
typedef struct filling {
    struct trip_gl_square *squares;
    uint32_t *entries;
    uint32_t square, position;
} filling;

/* Returns a mask by rank: bit k tells whether the k-th voxel of `mask` is in `drawn`. */
static uint64_t ranks_of(uint64_t mask, uint64_t drawn)
{
    uint64_t ranks = 0;
    for (unsigned k = 0; mask; mask &= mask - 1, k++)
        ranks |= (uint64_t)((drawn & mask & -mask) != 0) << k;
    return ranks;
}

/* Adds a square, and the draw positions of its drawn voxels. */
static void fill_square(filling *f, struct trip_gl_square square, uint64_t mask, uint64_t drawn,
                        bool reversed)
{
    const uint32_t count = trip_bits_set(mask);
    const uint64_t ranks = (mask & ~drawn) ? ranks_of(mask, drawn) : UINT64_MAX;
    f->squares[f->square] = square;
    for (uint32_t n = 0; n < count; n++) {
        uint32_t k = reversed ? count - 1 - n : n;
        if (ranks >> k & 1)
            f->entries[f->position++] = f->square << 6 | k;
    }
    f->square++;
}

static uint64_t drawn_of(const trip_plan *plan, const trip_list *list, const trip_run *run,
                         uint32_t corner)
{
    return trip_plan_square(plan, list, run->sheet, run->u + (int64_t)(corner & 0xffff),
                            run->v + (int64_t)(corner >> 16));
}

/* Adds the squares of a run and their draw positions, in draw order. Returns the number of
 * positions. */
static uint32_t fill_squares(trip_gl_batch *b, filling *f, const trip_plan *plan,
                             const trip_batch *batch, uint32_t run)
{
    const trip_run *of = &batch->runs[run];
    const trip_block block = trip_block_of(batch, of);
    const bool reversed = batch->pass->descending;
    const unsigned char *voxels = batch->planes[TRIP_PLANE_VOXELS];
    const size_t normals = b->normals_start + of->at[TRIP_PLANE_NORMALS];
    const uint32_t before = f->position;
    trip_square squares[TRIP_BLOCK_SQUARES_MAX];
    const uint32_t count = trip_block_squares(&block, squares);
    for (uint32_t k = 0; k < count; k++) {
        const trip_square *at = &squares[reversed ? count - 1 - k : k];
        const struct trip_gl_square square = {
            .mask_low = (uint32_t)at->mask,
            .mask_high = (uint32_t)(at->mask >> 32),
            .codes = (uint32_t)(b->voxels_start + (size_t)(at->codes - voxels)),
            .normals = (uint32_t)(normals + (size_t)at->first * block.normal_bytes),
            .min_width = at->min | at->width << 16,
            .run = run,
            .corner = corner_of(at->number),
        };
        fill_square(f, square, at->mask,
                    drawn_of(plan, trip_batch_list(batch, of), of, square.corner), reversed);
    }
    return f->position - before;
}

/* A batch has at most one piece for each run. */
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

/* Returns the position of a voxel of level 0 along a list axis. */
static double position_of(const trip_gl_placing *p, int i, int64_t voxel)
{
    return trip_coordinates_at(p->coordinates, (p->axis + i) % 3, voxel);
}

/* Returns the GPU record of a run with its draw positions starting at `position`. If `whole`, the
 * vertices hold positions from the origin of the volume. */
static struct trip_gl_run make_run(const trip_gl_placing *p, const trip_run *run, uint64_t first,
                                   bool descending, bool whole, uint32_t position)
{
    const trip_gl_frame_double *f = &p->constants;
    const int32_t origin[3] = { whole ? 0 : run->sheet, whole ? 0 : run->u, whole ? 0 : run->v };
    const bool placed = trip_coordinates_uneven(p->coordinates) && !whole;
    double c[3];
    for (int i = 0; i < 3; i++)
        c[i] = position_of(p, i, origin[i]) - trip_component(p->camera->eye, (p->axis + i) % 3);
    double px = p->camera->ortho ? f->screen.v[0] : 0, py = p->camera->ortho ? f->screen.v[1] : 0;
    int64_t at = (int64_t)first;
    at = descending ? at + run->count - 1 + position : at - position;
    struct trip_gl_run r = {
        .base = { (float)c[0], (float)c[1], (float)c[2] },
        .first = placed ? run->u : (int32_t)at,
        .step = placed       ? run->v
                : descending ? -1
                             : 1,
        .unused = placed ? run->sheet : 0,
        .position = { (float)(dot(&f->to_x, c) - px), (float)(dot(&f->to_y, c) - py),
                      (float)dot(&f->forward, c) },
    };
    r.base_low = (trip_gl_vec3){ trip_gl_frame_rest(c[0]), trip_gl_frame_rest(c[1]),
                                 trip_gl_frame_rest(c[2]) };
    return r;
}

/* Returns the position of the last voxel of a tile. With uneven spacing the grid bounds the tile.
 */
static double last_position(const trip_gl_placing *p, int i, int64_t first)
{
    const trip_coordinates *c = p->coordinates;
    const int64_t last = first + (int64_t)p->tile_voxels - 1;
    const int64_t end = c->voxels[(p->axis + i) % 3] - 1;
    return position_of(p, i, trip_coordinates_uneven(c) && last > end ? end : last);
}

/* Returns the minimum depth of all positions in the run's tile. */
static double nearest_depth(const trip_gl_placing *p, const trip_run *run)
{
    int u = (p->axis + 1) % 3, v = (p->axis + 2) % 3;
    trip_vec3 forward = p->camera->forward;
    double first[2] = { position_of(p, 1, run->u), position_of(p, 2, run->v) };
    double depth = trip_component(forward, p->axis) * position_of(p, 0, run->sheet) +
                   trip_component(forward, u) * first[0] + trip_component(forward, v) * first[1] -
                   trip_dot(forward, p->camera->eye);
    double far_u = last_position(p, 1, run->u) - first[0],
           far_v = last_position(p, 2, run->v) - first[1];
    return depth + fmin(0, trip_component(forward, u) * far_u) +
           fmin(0, trip_component(forward, v) * far_v);
}

static bool is_near(const trip_gl_placing *p, double depth)
{
    return !(depth >= p->near_depth);
}

/* Whether splats at a depth may exceed the maximum size of point sprites. Near splats may cover the
 * whole image. */
static bool needs_quads(const trip_gl_placing *p, double depth)
{
    if (p->quads || p->sprite_depth == HUGE_VAL)
        return true;
    return p->sprite_depth > 0 && (depth < p->sprite_depth || is_near(p, depth));
}

/* Returns an upper bound on the length of a splat at a depth along a pixel step of the camera. */
static double length_px(const trip_gl_placing *p, trip_vec3 step, double depth, double image_px)
{
    double low_pass = 2 * TRIP_CUTOFF * p->low_pass_px;
    double px = low_pass + 2 * p->kernel_radius / (depth * trip_length(step));
    return depth > 0 ? fmin(px, image_px) : image_px;
}

static uint32_t cost_at(const trip_gl_placing *p, double depth)
{
    const trip_camera *c = p->camera;
    if (c->ortho)
        depth = 1;
    else if (is_near(p, depth))
        depth = 0;
    double pixels = length_px(p, c->rx, depth, c->width) * length_px(p, c->ry, depth, c->height);
    uint32_t cost = 1;
    while (cost < TRIP_GL_PART_COST && cost * (double)TRIP_GL_COST_PX < pixels)
        cost *= 2;
    return cost;
}

static void add_piece(trip_gl_batch *b, trip_gl_piece piece)
{
    trip_gl_piece *last = b->piece_count ? &b->pieces[b->piece_count - 1] : NULL;
    bool same_sheet = last && last->list == piece.list && last->sheet == piece.sheet;
    if (same_sheet)
        piece.before = 0;
    if (same_sheet && last->quads == piece.quads && last->near == piece.near &&
        last->cost == piece.cost)
        last->count += piece.count;
    else
        b->pieces[b->piece_count++] = piece;
}

static void fill_runs(trip_gl_batch *b, const trip_gl_placing *placings, const trip_plan *plan,
                      const trip_batch *batch, const trip_gl_resident_list *resident)
{
    void *memory = b->slot->memory + b->runs.offset;
    struct trip_gl_run *runs = memory;
    memory = b->slot->memory + b->squares.offset;
    filling f = { .squares = memory };
    memory = b->slot->memory + b->run_of.offset;
    f.entries = memory;
    uint32_t position = 0;
    for (size_t i = 0; i < batch->run_count; i++) {
        const trip_run *run = &batch->runs[i];
        unsigned list = trip_batch_list(batch, run)->index;
        const trip_gl_placing *p = &placings[list];
        double depth = nearest_depth(p, run);
        uint64_t first = run->first + (resident ? resident[list].order_first : 0);
        runs[i] = make_run(p, run, first, batch->pass->descending, resident, position);
        uint32_t count = run->count;
        for (uint32_t k = 0; k < run->count && resident; k++)
            f.entries[position + k] = (uint32_t)i;
        if (!resident)
            count = fill_squares(b, &f, plan, batch, (uint32_t)i);
        if (count > 0)
            add_piece(b, (trip_gl_piece){ .first = position,
                                          .count = count,
                                          .cost = cost_at(p, depth),
                                          .list = list,
                                          .sheet = p->sheet_cost ? run->sheet : 0,
                                          .before = p->sheet_cost,
                                          .quads = needs_quads(p, depth),
                                          .near = is_near(p, depth) });
        position += count;
    }
}

int trip_gl_batch_fill(trip_gl_batch *b, trip_gl_ring *ring, const trip_gl_placing *placings,
                       const trip_plan *plan, const trip_batch *batch, trip_gl_slot *records,
                       const trip_gl_resident_list *resident)
{
    int status = count_positions(b, batch);
    if (!status)
        status = make_room(b, batch->run_count);
    if (!status)
        status = take_slot(b, ring, batch, records);
    if (!status && !records)
        copy_planes(b, batch);
    if (!status)
        fill_runs(b, placings, plan, batch, resident);
    return status;
}

trip_gl_piece trip_gl_batch_next(const trip_gl_batch *b, trip_gl_cursor *at, uint32_t *room)
{
    trip_gl_piece next = b->pieces[at->piece];
    if (at->done == 0)
        *room -= next.before < *room ? next.before : *room;
    uint32_t max = *room < next.cost ? 1 : *room / next.cost, left = next.count - at->done;
    next.first += at->done;
    next.count = left < max ? left : max;
    uint32_t cost = next.count * next.cost;
    *room -= cost < *room ? cost : *room;
    at->done = next.count < left ? at->done + next.count : 0;
    at->piece += next.count == left;
    return next;
}

void trip_gl_batch_release(trip_gl_batch *b)
{
    free(b->pieces);
    *b = (trip_gl_batch){ 0 };
}
