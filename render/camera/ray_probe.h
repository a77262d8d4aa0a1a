/* Finds the visible point on one ray from the data set itself, independent of any frame. It reads
 * only the bricks along the ray. One thread.
 *
 * The list along the ray's largest component divides the ray into one piece per sheet. A piece
 * reaches from midway between two sheets to midway between the next two. Its value is the value
 * where the ray meets the sheet, interpolated between the four voxels around that point. If one of
 * the four is missing, the value of the nearest voxel is used.
 *
 * With the nearest value, a piece ends also where the ray leaves the box of a voxel (sheet.h). The
 * voxel's value is used. With uneven spacing, the nearest of the four voxels is used. */
#ifndef TRIP_RAY_PROBE_H
#define TRIP_RAY_PROBE_H

#include "clip.h"
#include "draw_codes.h"
#include "reader.h"
#include "transfer_function.h"

typedef struct trip_ray_probe {
    const trip_dataset *data;
    trip_reader *reader; /* reads voxels; no pass may be running */
    trip_budget *budget;
    const trip_tf_entry *table; /* of draw codes */
    trip_draw_codes draw;       /* zero if draw codes are stored codes */
    bool nearest;               /* no interpolation; draw codes are then stored codes */
    /* The ray is origin + z * direction, z >= 0, in index space. With uneven spacing the
     * coordinates are positions (coordinates.h). A piece with a z length of 1 is world_per_z world
     * units long. */
    trip_vec3 origin, direction;
    double world_per_z;
    trip_clip clip; /* only the part of the ray inside counts; same coordinates */
} trip_ray_probe;

typedef struct trip_ray_hit {
    /* Opacity of the whole ray. If 0, nothing is visible and the other fields are unset. */
    double opacity;
    double first_z; /* where the first visible piece begins */
    double z;       /* where half of the opacity lies in front */
    double code;    /* exact draw code of the value at z */
} trip_ray_hit;

/* Returns 0 or a reported failure. */
int trip_ray_probe_find(const trip_ray_probe *probe, trip_ray_hit *out);

#endif
