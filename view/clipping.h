/* How the viewer cuts a data set: what the panel's controls do to a box of voxels and to planes.
 * Plain values. */
#ifndef TRIP_VIEW_CLIPPING_H
#define TRIP_VIEW_CLIPPING_H

#include "navigation.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { TRIP_CLIPPING_PLANES = 6 };

/* The whole of what was kept, half a voxel around it included, in voxels. */
void trip_clipping_box_of_all(triptych_clip *c, const triptych_info *info);
/* Moves a face of the box, which stays a box: face 0 or 1 of an axis, 0 the lower. */
void trip_clipping_set_face(triptych_clip *c, int axis, int face, double position);

/* A plane through the point looked at, that faces the eye: what lies before it is cut away. False
 * where there is no room for one. */
bool trip_clipping_add_plane(triptych_clip *c, const trip_navigation *n);
void trip_clipping_flip_plane(triptych_clip *c, int plane);
void trip_clipping_remove_plane(triptych_clip *c, int plane);
/* How far the plane lies from the middle of the data towards what it keeps, over half of the data's
 * diagonal: from -1 to 1 it may cut something. */
double trip_clipping_depth(const triptych_clip *c, int plane, const triptych_info *info);
void trip_clipping_set_depth(triptych_clip *c, int plane, const triptych_info *info, double depth);

/* A box of voxels where the same data has voxels of another size. */
void trip_clipping_rescale(triptych_clip *c, const triptych_info *from, const triptych_info *to);
/* Whether a library would take it. */
bool trip_clipping_is_sound(const triptych_clip *c);
/* Between two that have the same kinds of parts, 0 is a and 1 is b; of others `a` below 1. */
triptych_clip trip_clipping_mix(const triptych_clip *a, const triptych_clip *b, double t);

/* As options of `triptych render`, each with a space before it, to the last bit, for free(); ""
 * where nothing is cut; NULL without memory. */
char *trip_clipping_text(const triptych_clip *c);

#ifdef __cplusplus
}
#endif

#endif
