/* Computes the view from a triptych_view. Parameters that are not given are chosen so that the view
 * fits the voxels that are visible with the transfer function. */
#ifndef TRIP_LIB_VIEW_H
#define TRIP_LIB_VIEW_H

#include "framing.h"
#include "library_session.h"
#include "triptych.h"

typedef struct trip_found_view {
    trip_camera_params params;
    trip_vec3 axis;  /* axis of an orbit */
    uint64_t splats; /* examined to find the bounds of the visible voxels */
} trip_found_view;

/* Finds the view. If the view has to fit the visible voxels, reads data with a reader like
 * `wanted`. Fails with TRIP_USAGE (reported) for parameters out of range. */
int trip_view_find(trip_found_view *found, const triptych_view *view, const session *s,
                   double kernel_radius, const session_reader *wanted);

#endif
