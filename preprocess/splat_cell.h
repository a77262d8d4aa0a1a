/* The splats of a part of one cell, from which the pieces of the lists are gathered. A cell is an
 * aligned square of `edge` x `edge` voxels along x and y; the largest tile is as large. Splats are
 * in dense arrays by voxel; for each axis and sheet a bitmap in Morton order says which voxels have
 * one, so that gathering them in list order needs no sorting. One thread. */
#ifndef TRIP_SPLAT_CELL_H
#define TRIP_SPLAT_CELL_H

#include "piece.h"

/* The same for all cells. */
typedef struct trip_cell_tables {
    int64_t edge;
    unsigned words;                      /* 64-bit words of the bitmap of edge x edge voxels */
    uint16_t even_bits[128];             /* Morton code of (x, 0) */
    uint16_t u_of[TRIP_TILE_MAX_SPLATS]; /* the coordinates of a Morton code */
    uint16_t v_of[TRIP_TILE_MAX_SPLATS];
} trip_cell_tables;

/* Local coordinates count from the corner of the cell along x and y, and from the part's first
 * slice along z. Arrays are dense, x fastest, `edge` entries for a row and edge * edge for a slice;
 * entries are valid where there is a splat. */
typedef struct trip_splat_cell {
    const trip_cell_tables *tables;
    uint32_t *values;  /* codes, or the bits of floats */
    uint32_t *normals; /* and magnitudes: as in pieces, where pieces have them */
    float *magnitudes;
    uint64_t *bits[3]; /* bitmaps, `words` for each local sheet of the axis */

    int64_t origin[3]; /* grid coordinates of the local origin */
    int64_t first[3];  /* local coordinates of the part's first voxel */
    int64_t size[3];   /* of the part, in voxels */
} trip_splat_cell;

/* Where pieces go: returns memory for one, aligned to 8 bytes, or NULL after a failure. */
typedef struct trip_piece_sink {
    void *(*reserve)(void *user, unsigned thread, unsigned list, size_t bytes);
    void *user;
    unsigned thread;
} trip_piece_sink;

/* Voxels of a cell's edge. */
int64_t trip_cell_edge(const trip_piece_format *f);
void trip_cell_tables_fill(trip_cell_tables *t, const trip_piece_format *f);

/* Begins with the voxels [lo, lo + size) of the grid, which lie in one cell; no splat is in it.
 * Tables and arrays are the caller's. */
void trip_splat_cell_begin(trip_splat_cell *c, const int64_t lo[3], const int64_t size[3]);

/* Index in the arrays of local (0, y, z). */
static inline size_t trip_splat_cell_row(const trip_splat_cell *c, int64_t y, int64_t z)
{
    return (size_t)((z * c->tables->edge + y) * c->tables->edge);
}

/* There are splats at local (x[i], y, z), i < count. */
void trip_splat_cell_mark(trip_splat_cell *c, int64_t y, int64_t z, const uint8_t *x,
                          unsigned count);

/* Makes the pieces of a list of all splats. `f` is the format of the list's pieces. */
int trip_splat_cell_emit(const trip_splat_cell *c, const trip_piece_format *f, unsigned list,
                         const trip_piece_sink *sink);

#endif
