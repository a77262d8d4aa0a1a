/* The positions of a layer's voxels along u and v in GL memory, for grids with uneven spacing
 * (coordinates.h). Owned by one renderer; the context must be current. Its bytes count against the
 * budget. */
#ifndef TRIP_GL_SHEET_POSITIONS_H
#define TRIP_GL_SHEET_POSITIONS_H

#include <epoxy/gl.h>

#include "budget.h"
#include "coordinates.h"

typedef struct trip_gl_sheet_positions {
    trip_budget *budget;
    GLuint buffer; /* pairs of floats, whole part and rest: first u, then v */
    uint64_t bytes;
} trip_gl_sheet_positions;

/* Fills the positions for sheets of a list along `axis` that hold `size` voxels along u and v,
 * starting at `first`. Fails if the memory does not suffice. */
int trip_gl_sheet_positions_set(trip_gl_sheet_positions *p, const trip_coordinates *c, int axis,
                                const int64_t first[2], const int64_t size[2]);
void trip_gl_sheet_positions_release(trip_gl_sheet_positions *p);

#endif
