/* Clipping in the viewer: the panel's controls change a box of voxels and planes. Pure functions on
 * plain values. */
#ifndef TRIP_VIEW_CLIPPING_H
#define TRIP_VIEW_CLIPPING_H

#include "navigation.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { TRIP_CLIPPING_PLANES = 6 };

/* Sets the box to all kept voxels, in voxel indices, including half a voxel around them. For a
 * scene, sets it to the bounds that views fit and a quarter more on each side, in world units. */
void trip_clipping_box_of_all(triptych_clip *c, const triptych_info *info, bool is_scene);
/* Moves face 0 (lower) or 1 (upper) of an axis. The faces stay at least `min` apart. */
void trip_clipping_set_face(triptych_clip *c, int axis, int face, double position, double min);

/* Adds a plane through the point looked at, facing the eye. It cuts away the side of the eye.
 * Returns false if there are TRIP_CLIPPING_PLANES already. */
bool trip_clipping_add_plane(triptych_clip *c, const trip_navigation *n);
void trip_clipping_flip_plane(triptych_clip *c, int plane);
void trip_clipping_remove_plane(triptych_clip *c, int plane);
/* Returns the distance of the plane from the centre of the data towards the side that it keeps, in
 * half diagonals. Only planes from -1 to 1 can cut the data. */
double trip_clipping_depth(const triptych_clip *c, int plane, const triptych_info *info);
void trip_clipping_set_depth(triptych_clip *c, int plane, const triptych_info *info, double depth);

/* Converts a box of voxels between two data sets of one volume with different voxel sizes. */
void trip_clipping_rescale(triptych_clip *c, const triptych_info *from, const triptych_info *to);
/* Returns whether the library accepts the clipping. */
bool trip_clipping_is_sound(const triptych_clip *c);
/* Interpolates from `a` (t = 0) to `b` (t = 1) if both have the same parts; otherwise returns `a`
 * for t < 1. */
triptych_clip trip_clipping_mix(const triptych_clip *a, const triptych_clip *b, double t);

#ifdef __cplusplus
}
#endif

#endif
