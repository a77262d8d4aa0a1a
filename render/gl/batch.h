/* A batch of splats in GL memory: its records, a record for each run, the run of every draw
 * position, and the pieces to draw in one form. Owned by one renderer, refilled for every batch;
 * its memory is a slot of the ring, but for records that lie in GL memory already. */
#ifndef TRIP_GL_BATCH_H
#define TRIP_GL_BATCH_H

#include <stdbool.h>
#include <stddef.h>

#include "gl/ring.h"
#include "gl/shared.h"
#include "renderer.h"

/* A list of a frame: its constants, and what places its runs. */
typedef struct trip_gl_placing {
    const trip_camera *camera; /* of the list */
    trip_gl_frame_double constants;
    unsigned effects;
    int axis;
    double tile_voxels;
    bool quads; /* always */
    double
        sprite_depth; /* and where voxels may be nearer than this, trip_gl_frame_sprite_depth() */
} trip_gl_placing;

/* Draw positions [first, first + count), all of one list. */
typedef struct trip_gl_piece {
    uint32_t first, count;
    unsigned list; /* its number in the data set */
    bool quads;
} trip_gl_piece;

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

/* Fills `b` from a batch of the reader in draw order. `records` is the slot that its planes lie in;
 * NULL: they are copied. `placings` are those
 * of the data set's lists. `resident`: the whole list's records are in GL memory already, and the
 * batch has runs only. */
int trip_gl_batch_fill(trip_gl_batch *b, trip_gl_ring *ring, const trip_gl_placing *placings,
                       const trip_batch *batch, trip_gl_slot *records, bool resident);
void trip_gl_batch_release(trip_gl_batch *b);

#endif
