/* The constants of a pass over the sheets of a list in the shaders' form (shared.h), and the ends
 * of its segments. Pure functions. */
#ifndef TRIP_GL_SHEET_PASS_H
#define TRIP_GL_SHEET_PASS_H

#include "gl/shared.h"
#include "renderer.h"

typedef struct trip_gl_sheet_view {
    int axis;
    int64_t first_u, first_v; /* what ends are counted from (shared.h) */
    double eye[3];            /* along the list, u and v: where the ray by which others are taken
                                 starts */
    double slope[2];          /* how far it moves along u and v over a sheet */
    trip_gl_sheet_pass constants;
} trip_gl_sheet_view;

/* `descending`: rays go towards lower sheets. The sheets hold the voxels from `first` on, `size` of
 * them along u and v; `unit` is that of the function's sums. */
trip_gl_sheet_view trip_gl_sheet_view_make(const trip_frame *frame, int axis, bool descending,
                                           const int64_t first[2], const int64_t size[2],
                                           double unit);

/* The end at a coordinate, `step` (with the sign of the way) behind the one before; `layers` are of
 * the two sheets before and the two behind it, `part` its place between the middle ones. */
trip_gl_sheet_end trip_gl_sheet_end_at(const trip_gl_sheet_view *v, double coordinate, double step,
                                       const int layers[4], double part);

#endif
