/* Whether what was kept of a volume is mirror-symmetric across one axis of its grid and not across
 * the others, as nearly everything with a left and a right is: heads, teapots, animals. From that
 * follows how a volume lies whose file does not say so. One thread. */
#ifndef TRIP_MIRROR_H
#define TRIP_MIRROR_H

#include "mean.h"
#include "writer.h"

enum { TRIP_MIRROR_EDGE = 64 }; /* cells along each axis, at most */

/* What is kept in each cell of a coarse grid, i fastest. */
typedef struct trip_mirror_cells {
    int dims[3];       /* 1 to TRIP_MIRROR_EDGE */
    uint64_t *weights; /* dims[0] * dims[1] * dims[2] of them, each at most 65535 */
} trip_mirror_cells;

/* By how much the cells are their own mirror image across the plane at right angles to `axis` for
 * which this is most: the sum over the cells of w times w of the mirrored cell, of the sum of w
 * squared; 1 for an exact mirror image, 0 for cells without weight. Whole numbers are summed, so
 * that no order counts. */
double trip_mirror_score(const trip_mirror_cells *cells, int axis);

/* The axis across which the symmetry is strong, when it is much weaker across both others; else
 * -1. A ball, a box or a cylinder has none. */
int trip_mirror_axis(const double scores[3]);

typedef struct trip_mirror_params {
    int64_t dims[3];       /* of level 0 */
    unsigned levels;       /* coarse ones that are written */
    unsigned level_lists;  /* lists of a level; its third is that of kept voxels along Z */
    unsigned tile_log2;    /* of the lists' tiles */
    trip_mean_scale scale; /* of the codes of means */
} trip_mirror_params;

/* Of lists that are complete: reads that of one level along Z, the first in which some 128 voxels
 * span the grid, or of the coarsest. Sets the axis, as trip_mirror_axis() has it. */
int trip_mirror_find(int *axis, trip_writer *w, const trip_mirror_params *params,
                     trip_budget *budget);

#endif
