/* From what is said of a view to the view: what is left open is found by what the transfer function
 * shows. */
#ifndef TRIP_LIB_VIEW_H
#define TRIP_LIB_VIEW_H

#include "framing.h"
#include "library_session.h"
#include "triptych.h"

typedef struct trip_found_view {
    trip_camera_params params;
    trip_vec3 axis;  /* that an orbit goes about */
    uint64_t splats; /* looked at to find out how far what is visible reaches */
} trip_found_view;

/* Reads some of the data where a view is to be fitted to it, with a reader like `wanted`. */
int trip_view_find(trip_found_view *found, const triptych_view *view, const session *s,
                   double kernel_radius, const session_reader *wanted);

#endif
