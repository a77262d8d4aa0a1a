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

#define TRIP_LANDSCAPE_CELL 1.25 /* the widest scene with scale 1 has the width 1 */
#define TRIP_LANDSCAPE_SMALLEST 0.7
#define TRIP_LANDSCAPE_LARGEST 1.2
#define TRIP_LANDSCAPE_SCENES_MAX 64

enum { TRIP_LANDSCAPE_GROUND = 16 }; /* ground Gaussians along each side of a cell */

/* Returns the height of the ground:
 * 0.8 sin(0.35 x + 0.6) cos(0.27 z) + 0.2 sin(0.9 z + 0.4 x). */
double trip_landscape_height(double x, double z);

/* Writes exactly `count` Gaussians. The last copy may be incomplete. */
int trip_landscape_write(const char *output, const char *const *scenes, int scene_count,
                         uint64_t count);

#endif
