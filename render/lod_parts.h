/* Which levels of detail a frame has that classifies after interpolation. Its values lie in sheets,
 * of one level each, so such a frame is made of pictures, each drawn from one level of the data set
 * (dataset_level.h).
 *
 * Where rays diverge, planes of equal depth part the volume, and each part is drawn at the coarsest
 * level whose voxels are at most lod_px pixels wide where the part comes nearest to the eye. Rays
 * are cut at the planes as clip.h says, so each place of a ray is drawn at one level, once; the
 * pictures follow one another from the eye on, each behind those before. As the eye moves, the
 * planes move through the volume, and what shows at a level changes little by little.
 *
 * Where rays are parallel, or the volume is so thin that a plane would go through all of it at
 * once, all of it has one level, the finest that some place calls for. So that nothing pops
 * then, a part of the next coarser level's picture is mixed in, which grows from 0 to 1 while
 * voxels become narrower by a quarter of an octave, down to where that level is chosen.
 *
 * A bound on bytes is as if lod_px were larger, for what is in view of parts (lod_limit.h), and for
 * all of the grid where it has one level. Plain values. */
#ifndef TRIP_LOD_PARTS_H
#define TRIP_LOD_PARTS_H

#include "dataset_level.h"
#include "lod.h"

enum { TRIP_LOD_PARTS_MAX = 1 + TRIP_DATASET_LEVELS_MAX };

typedef struct trip_lod_parts {
    int count; /* of pictures, 1 at least */
    unsigned level[TRIP_LOD_PARTS_MAX];
    /* Of each but the first that lies behind another: its half-space, in the world, and the
     * distance where it begins along the view. */
    trip_half_space begin[TRIP_LOD_PARTS_MAX];
    double distance[TRIP_LOD_PARTS_MAX];
    double share; /* of the second of two that are mixed; 0: they lie behind one another */
    bool bounded; /* levels are coarser than lod_px calls for */
    double bytes; /* where there is a bound: that the levels chosen have */
} trip_lod_parts;

/* `camera` is made with level 0's map. `one`: of one level alone. */
int trip_lod_parts_make(trip_lod_parts *parts, const trip_dataset *data, const trip_camera *camera,
                        const trip_settings *settings, bool one, trip_budget *budget);

/* Adds the planes that a part lies between. */
void trip_lod_parts_clip(const trip_lod_parts *parts, int part, trip_clip *clip);

/* Puts a part's picture behind those before it, or mixes it in once it is `done`. Pictures are
 * premultiplied, over nothing; `out` may be one of them. */
void trip_lod_parts_add(const trip_lod_parts *parts, const float *before, const float *picture,
                        bool done, size_t pixels, float *out);

#endif
