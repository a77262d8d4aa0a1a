/* The bricks that a view reads and the order in which it reads them. Pure functions. */
#ifndef TRIP_GAUSSIAN_KEYS_H
#define TRIP_GAUSSIAN_KEYS_H

#include "camera.h"
#include "gaussian_stream.h"

/* Sets the planes of the view's sides, and the nearest plane that shows a centre. Returns their
 * number. `planes` has room for TRIP_GAUSSIAN_PLANES_MAX. */
unsigned trip_gaussian_planes_of(const trip_camera *c, trip_gaussian_plane planes[]);

/* Returns the key of a list: the coordinate relative to the eye, in one direction (1 or -1). */
trip_gaussian_key trip_gaussian_key_of_list(const trip_camera *c, int axis, int way);
trip_gaussian_key trip_gaussian_key_of_depth(const trip_camera *c);

/* Returns the levels of a view. A length covers the most pixels in the corners of the picture. */
trip_gaussian_lod trip_gaussian_lod_of(const trip_camera *c, double voxel_px);

#endif
