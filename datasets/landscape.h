/* Plants copies of Gaussian scenes on a hilly ground of Gaussians, so that a scene of any size
 * looks like a real one. The memory holds the given scenes, and does not grow with the result.
 *
 * The result is a PLY file of 3DGS without harmonics, y down. A lattice has a cell of
 * TRIP_LANDSCAPE_CELL units for each copy. Cells come row by row, along z within a row. The ground
 * of each cell comes first: flat Gaussians on the surface y = -height(x, z). Then comes one of the
 * scenes, turned about y and scaled. The hash of the cell's number decides these. */
#ifndef TRIP_LANDSCAPE_H
#define TRIP_LANDSCAPE_H

#include <stdint.h>

#include "landscape_cells.h"

/* Writes exactly `count` Gaussians. The last copy may be incomplete. */
int trip_landscape_write(const char *output, const char *const *scenes, int scene_count,
                         uint64_t count);

/* A landscape of points, from clouds. The result is a LAS file of version 1.4 with z up, in metres
 * and millimetres. A point of the landscape at x, y and z, with y down, has these coordinates:
 *
 *     TRIP_LANDSCAPE_EAST + U x,   TRIP_LANDSCAPE_NORTH + U z,   -U y,   with U = 100
 *
 * The ground of a cell has as many points along a side as the root of a quarter of the points of a
 * copy, and at least TRIP_LANDSCAPE_GROUND. A hash moves each one within its square. The file has
 * colours (point format 2) if a cloud has some, and otherwise point format 0. */
#define TRIP_LANDSCAPE_EAST 500000.0
#define TRIP_LANDSCAPE_NORTH 4900000.0
#define TRIP_LANDSCAPE_UNIT 100.0
#define TRIP_LANDSCAPE_STEP 0.001 /* of the coordinates */

/* Writes exactly `count` points. */
int trip_cloud_landscape_write(const char *output, const char *const *clouds, int cloud_count,
                               uint64_t count);

/* A landscape as a scene file with y up, and a cloud of its ground beside it: NAME-ground.ply. The
 * scene file places `copies` clouds and Gaussian scenes, which stay where they are. A cell at x, y
 * and z lies at x, -y and -z. */
enum { TRIP_LANDSCAPE_COPIES_MAX = 16383 };
int trip_scene_landscape_write(const char *output, const char *const *scenes, int scene_count,
                               uint64_t copies);

#endif
