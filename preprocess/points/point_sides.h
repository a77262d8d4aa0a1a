/* Turns the normals of a cloud to consistent sides, out of core, after Hoppe et al. (Surface
 * reconstruction from unorganized points, 1992). Their spanning tree joins points. Here it joins
 * the points within each tile, then the parts of tiles:
 *
 * - In a tile, each point has edges to its EDGES nearest neighbours. The cost of an edge is
 *   1 - |n . m| for the normals n and m of its ends, in 256 steps. A spanning tree of least cost
 *   decides which normals turn round. Points without a path between them are in different parts.
 * - Points near the border of a tile have their nearest neighbour in another tile. The sums of n .
 * m over such pairs are votes that join two parts. A spanning tree of the greatest votes decides
 *   which parts turn round. Parts without a path between them are in different groups.
 * - A group is a closed surface or a sheet. Let A be the area of a point, p its position, and c the
 *   mean of the positions by area. For a closed surface, the sum of A n . (p - c) is three times
 *   its volume, so the group turns until the sum is positive. If up is known, and the sum of
 *   A n . up is a greater share of its maximum, that sum must be positive.
 *
 * Further parts of a tile, beyond PARTS, keep the sides that they have. */
#ifndef TRIP_POINT_SIDES_H
#define TRIP_POINT_SIDES_H

#include "point_tiles.h"

enum { TRIP_POINT_SIDES_EDGES = 8, TRIP_POINT_SIDES_PARTS = 32 };

typedef struct trip_point_sides trip_point_sides;

/* They must outlive the sides. */
typedef struct trip_point_sides_params {
    const trip_point_tiles *tiles;
    unsigned rooms;   /* tiles that workers have in hand at once */
    unsigned threads; /* workers */
    double middle[3]; /* of the cloud */
    double up[3];     /* 0, 0, 0: not known */
    const char *folder, *name;
} trip_point_sides_params;

int trip_point_sides_create(trip_point_sides **out, const trip_point_sides_params *params,
                            trip_budget *budget);
void trip_point_sides_free(trip_point_sides *s); /* NULL is allowed */

/* A worker begins a tile in a room. */
void trip_point_sides_begin(trip_point_sides *s, unsigned room, trip_point_row *rows,
                            uint32_t count);
/* Takes the neighbours of a row. */
void trip_point_sides_note(trip_point_sides *s, unsigned room, uint32_t row,
                           const trip_neighbours *n);
/* Joins the rows of a tile with their normals. Their `part` becomes the number of their part. */
void trip_point_sides_join(trip_point_sides *s, unsigned thread, unsigned room);
/* Keeps the parts of a tile. One thread calls it for each tile, in order. */
int trip_point_sides_keep(trip_point_sides *s, unsigned room);

/* Joins the parts. `rows` has all joined rows in the order of the tiles; `room` holds two tiles. */
int trip_point_sides_choose(trip_point_sides *s, const trip_output *rows, trip_point_row *room);
/* Turns the normal of a row to its side. Rows must come in the order of the tiles. The tiles need
 * not exist any more. */
void trip_point_sides_turn(trip_point_sides *s, trip_point_row *row);

#endif
