/* The positions and widths of voxels in a grid with uneven spacing (coordinates.h), in GL memory,
 * for drawing splats. Owned by one renderer; the context must be current. Its bytes count against
 * the budget. */
#ifndef TRIP_GL_VOXEL_POSITIONS_H
#define TRIP_GL_VOXEL_POSITIONS_H

#include <epoxy/gl.h>
#include <stdbool.h>

#include "budget.h"
#include "coordinates.h"

typedef struct trip_gl_voxel_positions {
    trip_budget *budget;
    GLuint buffer; /* layout as in fetch.glsl; 0 for even spacing */
    uint64_t bytes;
} trip_gl_voxel_positions;

/* Fills the buffer; even spacing needs none. Fails if the memory does not suffice. */
int trip_gl_voxel_positions_set(trip_gl_voxel_positions *p, const trip_coordinates *c);
/* Binds the buffer for indexed or other lists. */
void trip_gl_voxel_positions_bind(const trip_gl_voxel_positions *p, bool indexed);
void trip_gl_voxel_positions_release(trip_gl_voxel_positions *p);

#endif
