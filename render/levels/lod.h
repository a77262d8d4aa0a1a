/* The level of detail of each cube in a frame of splats; lod_parts.h does the same for interpolated
 * values. A cube is an aligned cube of voxels. Its size depends only on the grid. Its level depends
 * on the cube, the view and the settings, not on bricks, tiles or memory. Each voxel of a level
 * lies in one cube, and is drawn if the cube has that level. So each position is drawn at exactly
 * one level.
 *
 * Without a bound on bytes (trip_lod_bound()), a cube has the coarsest level with voxels at most
 * lod_px pixels wide. The width is measured at the cube's nearest point to the eye, along the
 * grid's longest step. Cubes around the eye have level 0. Read-only once made. */
#ifndef TRIP_LOD_H
#define TRIP_LOD_H

#include "budget.h"
#include "camera.h"
#include "dataset.h"
#include "settings.h"

/* The result of a bound on bytes; zero without one. */
typedef struct trip_lod_limit {
    double bytes;      /* bytes in view at the chosen levels */
    double full_bytes; /* bytes without the bound */
    double px; /* maximum width of voxels in pixels, except at the coarsest level; 0 if the bound
                  changed nothing */
} trip_lod_limit;

typedef struct trip_lod {
    trip_kind kind;   /* kind of coarse levels: means or values */
    unsigned levels;  /* maximum level; the data set has all levels up to it */
    int cube_log2;    /* log2 of the level 0 voxels along a cube's edge */
    int64_t cubes[3]; /* along i, j, k */
    uint8_t *level;   /* level by cube, i fastest; NULL means level 0 everywhere */
    size_t bytes;     /* size of `level`, from the budget */
    uint32_t chosen;  /* one bit per level, set if any cube has it */
    trip_lod_limit limit;
} trip_lod;

/* Chooses the levels. `camera` is made with level 0's map. `kind` is the kind of the coarse levels.
 * Allocates nothing if the settings ask for the finest level. */
int trip_lod_make(trip_lod *lod, const trip_dataset *data, trip_kind kind,
                  const trip_camera *camera, const trip_settings *settings, trip_budget *budget);
void trip_lod_release(trip_lod *lod, trip_budget *budget);

/* Returns the width of level 0 voxels at a cube's nearest point to the eye, in pixels; HUGE_VAL for
 * cubes around the eye. */
double trip_lod_cube_width(const trip_lod *lod, const trip_dataset *data, const trip_camera *camera,
                           const int64_t cube[3]);

/* Returns whether the list's voxels are selected by level. This applies to the lists that `brick`
 * makes for splats; other lists are always drawn. */
bool trip_lod_concerns(const trip_lod *lod, const trip_list *list);

/* Returns the coarsest level, up to `levels`, with voxels at most `px` wide, for level 0 voxels of
 * a given width. */
unsigned trip_lod_level(double width_px, double px, unsigned levels);

/* Returns the width of level 0 voxels in pixels at a camera depth; parallel views ignore the depth.
 */
double trip_lod_width_px(const trip_camera *camera, double depth);

static inline unsigned trip_lod_at(const trip_lod *lod, const int64_t cube[3])
{
    return lod->level[(cube[2] * lod->cubes[1] + cube[1]) * lod->cubes[0] + cube[0]];
}

/* Returns whether the voxel of a list at sheet, u and v is drawn. */
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

/* Returns a mask of the drawn voxels in the 8 x 8 square of a sheet with its corner at u, v. Bits
 * are in Morton order, as in a block, and valid for voxels inside the grid. */
uint64_t trip_lod_square(const trip_lod *lod, const trip_list *list, int64_t sheet, int64_t u,
                         int64_t v);

/* Returns whether any voxel of a brick can be drawn. */
bool trip_lod_brick(const trip_lod *lod, const trip_list *list, const trip_file_header *header,
                    const trip_file_brick *brick, int64_t slab);

/* Minimum distance from the eye. Nearer cubes count as this far, so that they too can be coarser.
 */
#define TRIP_LOD_NEAREST_VOXELS 32.0

/* Chooses levels under a bound on bytes. The result is the same as with the smallest
 * settings.lod_px that keeps the bound. So the cubes that appear widest are drawn finest. Bytes are
 * the codes and normals of the cubes in view, in all lists with weight in the view. They are
 * computed from the number of level 0 voxels in each cube and the relative size of each level's
 * lists. The bytes, and so the picture, do not depend on tiles, slabs or earlier reads.
 *
 * Raises levels until settings->max_bytes suffice or all are the coarsest, and fills lod->limit.
 * Cubes must be at least as large as tiles. Returns TRIP_ERROR if memory is exhausted. */
int trip_lod_bound(trip_lod *lod, const trip_dataset *data, const trip_camera *camera,
                   const trip_settings *settings, trip_budget *budget);

/* Returns the bytes of a level's values in all lists read, independent of the view. */
double trip_lod_values_bytes(const trip_dataset *data, const trip_camera *camera,
                             const trip_settings *settings, unsigned level);

#endif
