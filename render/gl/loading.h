/* The loading of a trip_gl_resident: list after list, each level's vertices first, in pieces of at
 * most TRIP_FRAME_PIECE splats. Owned by that. */
#ifndef TRIP_GL_LOADING_H
#define TRIP_GL_LOADING_H

#include "gl/resident.h"

/* With `to` laid out and its arrays made. */
int trip_gl_loading_create(trip_gl_loading **out, trip_gl_resident *to);
void trip_gl_loading_destroy(trip_gl_loading *l);

/* Opens a reader; the list that was being loaded when it was closed is loaded from its start. */
int trip_gl_loading_open(trip_gl_loading *l);
void trip_gl_loading_close(trip_gl_loading *l);

/* Loads a piece, as trip_renderer_ops.load. */
int trip_gl_loading_step(trip_gl_loading *l);
void trip_gl_loading_await(trip_gl_loading *l, uint64_t timeout_ns);

#endif
