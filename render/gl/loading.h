/* Loads a trip_gl_resident list by list, in pieces of at most TRIP_FRAME_PIECE splats. The list
 * with the vertices comes first in each level. Owned by the trip_gl_resident. */
#ifndef TRIP_GL_LOADING_H
#define TRIP_GL_LOADING_H

#include "gl/resident.h"

/* `to` must be laid out and its arrays allocated. */
int trip_gl_loading_create(trip_gl_loading **out, trip_gl_resident *to);
void trip_gl_loading_destroy(trip_gl_loading *l);

/* Opens a reader. If closing interrupted a list, loading starts that list again. */
int trip_gl_loading_open(trip_gl_loading *l);
void trip_gl_loading_close(trip_gl_loading *l);

/* Loads a piece; implements trip_renderer_ops.load. */
int trip_gl_loading_step(trip_gl_loading *l);
void trip_gl_loading_await(trip_gl_loading *l, uint64_t timeout_ns);

#endif
