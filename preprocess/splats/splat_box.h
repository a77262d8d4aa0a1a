/* The splats of a box of voxels, from which the pieces of the lists are gathered. Along x and y the
 * box lies between two multiples of `edge`, which is at least the edge of a tile. Splats are in
 * dense arrays by voxel. For each axis and sheet a bitmap in Morton order tells which voxels have a
 * splat. Gathering splats in list order therefore needs no sorting. One thread. */
#ifndef TRIP_SPLAT_BOX_H
#define TRIP_SPLAT_BOX_H

#include "piece.h"

/* Shared by all boxes. */
typedef struct trip_splat_box_tables {
    int64_t edge;
    unsigned words;                         /* 64-bit words of the bitmap of edge x edge voxels */
    uint16_t even_bits[TRIP_TILE_MAX_EDGE]; /* Morton code of (x, 0) */
    uint16_t u_of[TRIP_TILE_MAX_SPLATS];    /* u_of, v_of: the coordinates of a Morton code */
    uint16_t v_of[TRIP_TILE_MAX_SPLATS];
} trip_splat_box_tables;

/* Local coordinates start at a multiple of the edge along x and y, and at the box's first slice
 * along z. Arrays are dense, x fastest, with `edge` entries for a row and edge * edge for a slice.
 * An entry is valid if the voxel has a splat. */
typedef struct trip_splat_box {
    const trip_splat_box_tables *tables;
    uint32_t *values;  /* codes with deviations above them, or the bits of floats */
    uint32_t *normals; /* normals and magnitudes: as in pieces, if the pieces have them */
    float *magnitudes;
    uint64_t *bits[3]; /* bitmaps, `words` for each local sheet of the axis */

    int64_t origin[3]; /* grid coordinates of the local origin */
    int64_t first[3];  /* local coordinates of the box's first voxel */
    int64_t size[3];   /* size of the box in voxels */
} trip_splat_box;

/* The destination of pieces. reserve() sets *memory to room for one piece, aligned to 8 bytes, and
 * returns a status. */
typedef struct trip_piece_sink {
    int (*reserve)(void *user, unsigned thread, unsigned list, size_t bytes, void **memory);
    void *user;
    unsigned thread;
} trip_piece_sink;

int64_t trip_splat_box_edge(const trip_piece_format *f);
void trip_splat_box_tables_fill(trip_splat_box_tables *t, const trip_piece_format *f);

/* Starts an empty box of the voxels [lo, lo + size) of the grid. The caller owns the tables and
 * arrays. */
void trip_splat_box_begin(trip_splat_box *c, const int64_t lo[3], const int64_t size[3]);

/* Returns the array index of local (0, y, z). */
static inline size_t trip_splat_box_row(const trip_splat_box *c, int64_t y, int64_t z)
{
    return (size_t)((z * c->tables->edge + y) * c->tables->edge);
}

/* Marks splats at local (x[i], y, z), i < count. */
void trip_splat_box_mark(trip_splat_box *c, int64_t y, int64_t z, const uint8_t *x, unsigned count);

/* Makes the pieces of one list from all splats. `f` is the format of the list's pieces. */
int trip_splat_box_emit(const trip_splat_box *c, const trip_piece_format *f, unsigned list,
                        const trip_piece_sink *sink);

#endif
