/* A batch of splats in GL memory: its records, a record for each run, the run of every draw
 * position, and the pieces to draw in one form. Owned by one renderer, refilled for every batch;
 * its memory is a slot of the ring, but for records that lie in GL memory already. */
#ifndef TRIP_GL_BATCH_H
#define TRIP_GL_BATCH_H

#include <stdbool.h>
#include <stddef.h>

#include "gl/resident.h"
#include "gl/ring.h"
#include "gl/shared.h"
#include "renderer.h"

/* A list of a frame: its constants, and what places its runs. */
typedef struct trip_gl_placing {
    const trip_camera *camera; /* of the list */
    const trip_coordinates *coordinates;
    trip_gl_frame_double constants;
    unsigned effects;
    int axis;
    double tile_voxels;
    double kernel_radius; /* of the widest */
    bool quads;           /* always */
    double sprite_depth;  /* and where voxels may be nearer, trip_gl_frame_sprite_depth() */
    double near_depth;    /* likewise, trip_gl_frame_near_depth() */
    uint32_t sheet_cost;  /* of compositing a sheet, where splats are summed; else 0 */
} trip_gl_placing;

/* Draw positions [first, first + count), all of one list. */
typedef struct trip_gl_piece {
    uint32_t first, count;
    uint32_t cost;   /* of each splat, a power of two: at least its pixels over TRIP_GL_COST_PX */
    unsigned list;   /* its number in the data set */
    int32_t sheet;   /* where splats are summed; else 0 */
    uint32_t before; /* cost of the sheet that ends before it */
    bool quads;
    bool near; /* some of them may be near (render/splat.h) */
} trip_gl_piece;

/* What a part of the GPU's work may cost: a step passes its deadline by the time of one. Splats of
 * up to so many pixels cost 1; larger parts would keep a frame on a software GL from ending soon,
 * where a part is a fourth of that. */
enum {
    TRIP_GL_COST_PX = 128,
    TRIP_GL_PART_COST = TRIP_FRAME_PIECE,
    TRIP_GL_SOFTWARE_PARTS = 4,
};

typedef struct trip_gl_part {
    size_t offset, bytes; /* in its slot; bytes 0: not there */
} trip_gl_part;

typedef struct trip_gl_batch {
    trip_gl_slot *slot;    /* of what is made of the runs */
    trip_gl_slot *records; /* of voxels and normals */
    trip_gl_part voxels, normals, runs, squares, run_of;
    size_t voxels_start, normals_start; /* of the batch's planes in those parts */
    uint32_t square_count;
    uint32_t positions;
    trip_gl_piece *pieces;
    size_t piece_count, piece_room;
} trip_gl_batch;

/* How far a batch is drawn. */
typedef struct trip_gl_cursor {
    size_t piece;
    uint32_t done; /* of its positions */
} trip_gl_cursor;

/* Fills `b` from a batch of the reader in draw order. `records` is the slot that its planes lie in;
 * NULL: they are copied. `placings` are by
 * the data set's lists. `resident`: by the data set's lists, whose records are in GL memory
 * already; the batch has runs only. NULL: it has its records. */
int trip_gl_batch_fill(trip_gl_batch *b, trip_gl_ring *ring, const trip_gl_placing *placings,
                       const trip_plan *plan, const trip_batch *batch, trip_gl_slot *records,
                       const trip_gl_resident_list *resident);
static inline bool trip_gl_batch_is_drawn(const trip_gl_batch *b, const trip_gl_cursor *at)
{
    return at->piece == b->piece_count;
}

/* The splats behind the cursor, all of one piece, that cost no more than *room, but one at least;
 * the cursor moves on, and their cost is taken from *room. */
trip_gl_piece trip_gl_batch_next(const trip_gl_batch *b, trip_gl_cursor *at, uint32_t *room);
void trip_gl_batch_release(trip_gl_batch *b);

#endif
