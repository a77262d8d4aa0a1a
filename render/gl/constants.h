/* The constants of a frame in GL memory: a block for the layer of each axis and one for each list,
 * in float and in double, the table of colours, and what places the lists' runs. Owned by one
 * renderer; needs its context current. */
#ifndef TRIP_GL_CONSTANTS_H
#define TRIP_GL_CONSTANTS_H

#include <epoxy/gl.h>

#include "gl/gl_batch.h"
#include "gl/gl_context.h"

typedef struct trip_gl_constants {
    GLuint blocks, table;
    unsigned room;          /* lists */
    trip_gl_placing *lists; /* by number in the data set, those that the plan draws */
} trip_gl_constants;

int trip_gl_constants_fill(trip_gl_constants *c, const trip_gl_context *context,
                           const trip_frame *frame);
/* Binds a block for the passes that work in float, or in double. */
void trip_gl_constants_bind_layer(const trip_gl_constants *c, int axis, bool in_double);
void trip_gl_constants_bind_list(const trip_gl_constants *c, unsigned list, bool in_double);
void trip_gl_constants_release(trip_gl_constants *c);

#endif
