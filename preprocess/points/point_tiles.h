/* A cloud on disk, in the order of an octree, and divided into tiles of neighbouring points.
 * Threads search the tiles for nearest neighbours. Each search is exact: it goes on to other tiles
 * as far as their bounds are near enough. Tiles depend on the points alone, not on the memory. */
#ifndef TRIP_POINT_TILES_H
#define TRIP_POINT_TILES_H

#include <assert.h>

#include "gaussian_octree.h"
#include "gaussian_sort.h"
#include "neighbours.h"

enum { TRIP_POINT_TILE_MAX = 6144 };

/* A point in a file of tiles. Its position stands where a trip_gaussian has its centre, so that
 * trip_gaussian_sort() can sort it. */
typedef struct trip_point_row {
    trip_spilled head;
    double position[3];
    union {
        float scan;
        float uncertainty; /* of an ellipsoid, which has a normal */
        float part;        /* of the tile, once normals are found (point_sides.h) */
    };
    float normal[3];   /* 0, 0, 0: none */
    float radius;      /* 0: none */
    float colour[3];   /* or a value, which a palette colours */
    float spread;      /* mean distance of the neighbours; 0 until they are found */
    uint32_t reserved; /* 0 */
} trip_point_row;

static_assert(offsetof(trip_point_row, position) == sizeof(trip_spilled) &&
                  offsetof(trip_gaussian, centre) == 0,
              "the position stands where a Gaussian has its centre");

typedef struct trip_point_tile {
    double lo[3], hi[3];
    uint64_t first; /* row */
    uint32_t count, reserved;
} trip_point_tile;

typedef struct trip_point_tiles trip_point_tiles;

typedef struct trip_point_tiles_params {
    trip_output *spool;    /* of trip_point_row, flushed; it is closed once it is read */
    trip_workers *workers; /* no loop runs */
    uint64_t records;
    const trip_octree *octree; /* of the positions; it must outlive the tiles */
    const char *folder;        /* for temporary files */
    const char *name;          /* of the cloud, for messages */
    void (*progress)(void *user, uint64_t rows);
    void *user;
} trip_point_tiles_params;

/* Sorts the rows. */
int trip_point_tiles_make(trip_point_tiles **out, const trip_point_tiles_params *params,
                          trip_budget *budget);
void trip_point_tiles_free(trip_point_tiles *t); /* NULL is allowed */

uint64_t trip_point_tiles_count(const trip_point_tiles *t);
const trip_point_tile *trip_point_tiles_at(const trip_point_tiles *t, uint64_t tile);
/* Reads the rows of a tile. Any thread. */
int trip_point_tiles_read(const trip_point_tiles *t, uint64_t tile, trip_point_row *rows);

/* Lists the tiles with bounds around a position, at most `room`, and returns their number. */
unsigned trip_point_tiles_around(const trip_point_tiles *t, const double position[3], uint64_t *out,
                                 unsigned room);

/* Takes memory for searches by so many threads: up to half of the memory that is left. */
int trip_point_tiles_begin_searches(trip_point_tiles *t, unsigned threads);
/* Prepares a thread for fast searches from the positions of a tile. The caller has read the rows
 * of the tile. Searches without this call find the same neighbours. */
int trip_point_tiles_prepare(trip_point_tiles *t, unsigned thread, uint64_t tile,
                             const trip_point_row *rows, unsigned wanted);
/* Finds the nearest neighbours of n->position, which lies in a tile. Each thread has a number of
 * its own. */
int trip_point_tiles_search(trip_point_tiles *t, unsigned thread, uint64_t tile,
                            trip_neighbours *n);

#endif
