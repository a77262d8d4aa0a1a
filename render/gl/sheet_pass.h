/* Computes the constants of a pass over the sheets of a list and the segment ends, in the layout of
 * the shaders (shared.h). Pure functions. */
#ifndef TRIP_GL_SHEET_PASS_H
#define TRIP_GL_SHEET_PASS_H

#include "gl/shared.h"
#include "renderer.h"

typedef struct trip_gl_sheet_view {
    int axis;
    int64_t first_u, first_v; /* origin of the ends' integer coordinates (shared.h) */
    double eye[3];            /* along the list, u and v: start of the reference ray */
    double slope[2];          /* movement of the reference ray along u and v for each sheet */
    double gradient_scale;    /* factor of stored gradients; 1 unless codes are exact */
    trip_gl_sheet_pass constants;
} trip_gl_sheet_view;

/* Returns the constants. If `descending`, rays go towards lower sheets. The sheets hold `size`
 * voxels along u and v, starting at `first`. `unit` is the value of 1 in the transfer function's
 * sums. */
trip_gl_sheet_view trip_gl_sheet_view_make(const trip_frame *frame, int axis, bool descending,
                                           const int64_t first[2], const int64_t size[2],
                                           double unit);

/* Returns the segment end at a coordinate. `step` is its signed distance from the previous end.
 * `layers` holds the texture layers of two sheets before and two behind it. `part` is its position
 * between the middle two, from 0 to 1. */
trip_gl_sheet_end trip_gl_sheet_end_at(const trip_gl_sheet_view *v, double coordinate, double step,
                                       const int layers[4], double part);

#endif
