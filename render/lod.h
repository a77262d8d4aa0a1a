/* Which level of detail each cube of a frame of splats is drawn at; of interpolated values
 * lod_parts.h says it. A cube is an aligned one of voxels of the grid, of a size that depends on
 * the grid alone; its level follows from the cube, the view and the settings, so never from bricks,
 * tiles or memory. A voxel of a level covers voxels of one cube, and is drawn where that cube has
 * its level: so each place is drawn at one level, once.
 *
 * Without a bound on bytes (lod_limit.h) a cube has the coarsest level whose voxels are at most
 * lod_px pixels wide where the cube comes nearest to the eye, all along the grid's longest step;
 * cubes about the eye have level 0. Read-only once made. */
#ifndef TRIP_LOD_H
#define TRIP_LOD_H

#include "budget.h"
#include "camera.h"
#include "dataset.h"
#include "settings.h"

/* What a bound on bytes came to; zero: there was none. */
typedef struct trip_lod_limit {
    double bytes;      /* that the levels chosen have in view */
    double full_bytes; /* without the bound */
    double px;         /* voxels are at most so many pixels wide, but at the coarsest level; 0: the
                          bound has changed nothing */
} trip_lod_limit;

typedef struct trip_lod {
    trip_kind kind;   /* of coarse levels: means or values */
    unsigned levels;  /* that may be chosen: the data set has them all */
    int cube_log2;    /* voxels of level 0 along a cube's edge */
    int64_t cubes[3]; /* along i, j, k */
    uint8_t *level;   /* of a cube, i fastest; NULL: level 0 everywhere */
    size_t bytes;     /* of those, from the budget */
    uint32_t chosen;  /* levels that some cube has, a bit each */
    trip_lod_limit limit;
} trip_lod;

/* `camera` is made with level 0's map, `kind` is what coarse levels are drawn from. Where the
 * settings call for the finest level, nothing is allocated. */
int trip_lod_make(trip_lod *lod, const trip_dataset *data, trip_kind kind,
                  const trip_camera *camera, const trip_settings *settings, trip_budget *budget);
void trip_lod_release(trip_lod *lod, trip_budget *budget);

/* How wide voxels of level 0 are where a cube comes nearest to the eye; cubes about the eye:
 * HUGE_VAL. */
double trip_lod_cube_width(const trip_lod *lod, const trip_dataset *data, const trip_camera *camera,
                           const int64_t cube[3]);

/* Whether voxels of the list are chosen by level: those that `brick` makes for splats. All others
 * are drawn whatever the levels. */
bool trip_lod_concerns(const trip_lod *lod, const trip_list *list);

/* The coarsest level at which voxels of level 0 that wide are at most `px`; no more than `levels`.
 */
unsigned trip_lod_level(double width_px, double px, unsigned levels);

/* How many pixels wide voxels of level 0 are at a depth (that of the camera; parallel views: any).
 */
double trip_lod_width_px(const trip_camera *camera, double depth);

static inline unsigned trip_lod_at(const trip_lod *lod, const int64_t cube[3])
{
    return lod->level[(cube[2] * lod->cubes[1] + cube[1]) * lod->cubes[0] + cube[0]];
}

/* Whether the voxel of a list at sheet, u and v is drawn. */
static inline bool trip_lod_has(const trip_lod *lod, const trip_list *list, int64_t sheet,
                                int64_t u, int64_t v)
{
    const int shift = lod->cube_log2 - (int)list->level;
    int64_t cube[3];
    cube[list->axis] = sheet >> shift;
    cube[(list->axis + 1) % 3] = u >> shift;
    cube[(list->axis + 2) % 3] = v >> shift;
    return trip_lod_at(lod, cube) == list->level;
}

/* Of the 8 x 8 square of a list's sheet with its corner at u and v, which voxels are drawn: a bit
 * each by Morton number, as in a block. Only of voxels in the grid. */
uint64_t trip_lod_square(const trip_lod *lod, const trip_list *list, int64_t sheet, int64_t u,
                         int64_t v);

/* Whether some voxel of a brick may be drawn. */
bool trip_lod_brick(const trip_lod *lod, const trip_list *list, const trip_file_header *header,
                    const trip_file_brick *brick, int64_t slab);

#endif
