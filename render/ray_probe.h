/* What one ray meets, read from the data set: the bricks along it and no others, whatever frames
 * are drawn. The ray is cut into one piece for each sheet of the list that it goes along most, from
 * midway between two sheets to midway between the next; in a piece the value is the one where the
 * ray meets the sheet, interpolated between the four voxels around, or, where one of them is
 * missing, that of the nearest. One thread. */
#ifndef TRIP_RAY_PROBE_H
#define TRIP_RAY_PROBE_H

#include "clip.h"
#include "reader.h"
#include "transfer_function.h"

typedef struct trip_ray_probe {
    const trip_dataset *data;
    trip_reader *reader; /* of voxels, no pass under way */
    trip_budget *budget;
    const trip_tf_entry *table; /* as filled for the data set */
    /* Index space, places where spacing is uneven (coordinates.h): origin + z * direction, z >= 0,
     * is on the ray, whose pieces of z = 1 are so many world units long. */
    trip_vec3 origin, direction;
    double world_per_z;
    trip_clip clip; /* in the same: only what is inside counts */
} trip_ray_probe;

typedef struct trip_ray_hit {
    double opacity; /* of the whole ray; 0: it meets nothing that shows, and what follows is not
                       set */
    double first_z; /* where what shows begins */
    double z;       /* where half of that opacity is in front */
    double code;    /* of the value there, 0 to 65535 */
} trip_ray_hit;

/* 0, or a reported failure. */
int trip_ray_probe_find(const trip_ray_probe *probe, trip_ray_hit *out);

#endif
