/* A batch of splats in GL memory: its records, one entry for each run and each draw position, and
 * the pieces to draw. Owned by one renderer and refilled for every batch. Its memory is a slot of
 * the ring; the records may lie in another slot that the reader filled. */
#ifndef TRIP_GL_BATCH_H
#define TRIP_GL_BATCH_H

#include <stdbool.h>
#include <stddef.h>

#include "gl/resident.h"
#include "gl/ring.h"
#include "gl/shared.h"
#include "renderer.h"

/* The constants of a list and the data that places its runs. */
typedef struct trip_gl_placing {
    const trip_camera *camera;
    const trip_coordinates *coordinates;
    trip_gl_frame_double constants;
    unsigned effects;
    int axis;
    double tile_voxels;
    double kernel_radius; /* of the widest kernel */
    double low_pass_px;   /* see trip_settings_low_pass_px() */
    bool quads;           /* always draws quads */
    double sprite_depth;  /* draws quads below this depth; see trip_gl_frame_sprite_depth() */
    double near_depth;    /* see trip_gl_frame_near_depth() */
    uint32_t sheet_cost;  /* cost of compositing one sheet if splats are summed, else 0 */
} trip_gl_placing;

/* The draw positions [first, first + count). They belong to one list. */
typedef struct trip_gl_piece {
    uint32_t first, count;
    uint32_t cost;   /* of each splat: a power of two, at least its pixels / TRIP_GL_COST_PX */
    unsigned list;   /* index in the data set */
    int32_t sheet;   /* the sheet if splats are summed, else 0 */
    uint32_t before; /* cost of compositing the sheet that ends before this piece */
    bool quads;
    bool near; /* some of its splats may be near (render/splat.h) */
} trip_gl_piece;

/* The maximum cost of one part of the GPU's work. A step exceeds its deadline by at most one part.
 * A splat of up to TRIP_GL_COST_PX pixels costs 1. In software GL a part is a fourth as large, so
 * that a frame can end soon. */
enum {
    TRIP_GL_COST_PX = 128,
    TRIP_GL_PART_COST = TRIP_FRAME_PIECE,
    TRIP_GL_SOFTWARE_PARTS = 4,
};

typedef struct trip_gl_part {
    size_t offset, bytes; /* in its slot; bytes is 0 if the part is absent */
} trip_gl_part;

typedef struct trip_gl_batch {
    trip_gl_slot *slot;    /* holds runs, squares and run_of */
    trip_gl_slot *records; /* holds voxels and normals */
    trip_gl_part voxels, normals, runs, squares, run_of;
    size_t voxels_start,
        normals_start; /* offsets of the batch's planes in `voxels` and `normals` */
    uint32_t square_count;
    uint32_t positions;
    trip_gl_piece *pieces;
    size_t piece_count, piece_room;
} trip_gl_batch;

/* The progress of drawing a batch. */
typedef struct trip_gl_cursor {
    size_t piece;
    uint32_t done; /* positions of this piece already drawn */
} trip_gl_cursor;

/* Fills `b` from a batch of the reader, in draw order.
 * - `placings` has one entry for each list of the data set.
 * - `records` is the slot that holds the batch's planes. NULL copies the planes.
 * - `resident` has one entry for each list if the records are in GL memory already. The batch then
 *   has runs only. NULL takes the records from the batch. */
int trip_gl_batch_fill(trip_gl_batch *b, trip_gl_ring *ring, const trip_gl_placing *placings,
                       const trip_plan *plan, const trip_batch *batch, trip_gl_slot *records,
                       const trip_gl_resident_list *resident);
static inline bool trip_gl_batch_is_drawn(const trip_gl_batch *b, const trip_gl_cursor *at)
{
    return at->piece == b->piece_count;
}

/* Returns the next splats of one piece. They cost at most *room, but at least one splat is
 * returned. Advances the cursor and subtracts the cost from *room. */
trip_gl_piece trip_gl_batch_next(const trip_gl_batch *b, trip_gl_cursor *at, uint32_t *room);
void trip_gl_batch_release(trip_gl_batch *b);

#endif
