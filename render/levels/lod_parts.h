/* The levels of detail of a post-classified frame. Its values lie in sheets, and each sheet has one
 * level. So the frame is made of several pictures, each drawn from one level of the data set
 * (dataset_level.h).
 *
 * - Perspective: planes of equal depth divide the volume into parts. Each part is drawn at the
 *   coarsest level with voxels at most lod_px pixels wide at the part's nearest point. Rays are cut
 *   at the planes (clip.h), so that each point of a ray is drawn at exactly one level. The pictures
 *   are composited from the eye outward. As the eye moves, the planes move through the volume, and
 *   the picture changes gradually.
 * - Parallel views, and volumes too thin to divide: the whole volume has one level, the finest that
 *   any part needs. To avoid popping, a share of the next coarser level's picture is mixed in. The
 *   share grows from 0 to 1 over the last quarter octave of voxel width before the coarser level
 *   takes over.
 *
 * A bound on bytes acts like a larger lod_px. It applies to the visible part of each part
 * (trip_lod_bound()), and to the whole grid if it has one level. Plain values. */
#ifndef TRIP_LOD_PARTS_H
#define TRIP_LOD_PARTS_H

#include "dataset_level.h"
#include "lod.h"

enum { TRIP_LOD_PARTS_MAX = 1 + TRIP_DATASET_LEVELS_MAX };

typedef struct trip_lod_parts {
    int count; /* number of pictures, at least 1 */
    unsigned level[TRIP_LOD_PARTS_MAX];
    /* For each part behind another: its half-space in world space, and its first distance along the
     * view. */
    trip_half_space begin[TRIP_LOD_PARTS_MAX];
    double distance[TRIP_LOD_PARTS_MAX];
    double
        share; /* share of the second of two mixed pictures; 0 if pictures lie behind one another */
    bool bounded; /* levels are coarser than lod_px requires */
    double bytes; /* bytes of the chosen levels, if there is a bound */
} trip_lod_parts;

/* Chooses the parts. `camera` is made with level 0's map. `one` forces a single level. */
int trip_lod_parts_make(trip_lod_parts *parts, const trip_dataset *data, const trip_camera *camera,
                        const trip_settings *settings, bool one, trip_budget *budget);

/* Adds the two planes of a part to a clip. */
void trip_lod_parts_clip(const trip_lod_parts *parts, int part, trip_clip *clip);

/* Composites a part's picture behind the previous ones, or mixes it in once it is `done`. Pictures
 * are premultiplied, without background. `out` may alias an input. */
void trip_lod_parts_add(const trip_lod_parts *parts, const float *before, const float *picture,
                        bool done, size_t pixels, float *out);

#endif
