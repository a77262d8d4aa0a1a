/* Where the voxels of a grid with uneven spacing lie and how long they are (coordinates.h), in GL
 * memory, for drawing splats. Owned by one renderer; needs its context current. Its bytes count
 * against the budget. */
#ifndef TRIP_GL_VOXEL_POSITIONS_H
#define TRIP_GL_VOXEL_POSITIONS_H

#include <epoxy/gl.h>
#include <stdbool.h>

#include "budget.h"
#include "coordinates.h"

typedef struct trip_gl_voxel_positions {
    trip_budget *budget;
    GLuint buffer; /* as fetch.glsl reads it; 0: spacing is even */
    uint64_t bytes;
} trip_gl_voxel_positions;

/* None where spacing is even; fails without memory. */
int trip_gl_voxel_positions_set(trip_gl_voxel_positions *p, const trip_coordinates *c);
/* For lists that are indexed, or not. */
void trip_gl_voxel_positions_bind(const trip_gl_voxel_positions *p, bool indexed);
void trip_gl_voxel_positions_release(trip_gl_voxel_positions *p);

#endif
