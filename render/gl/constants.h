/* The constants of a frame in GL memory. They consist of one block for each layer and each list, in
 * float and in double, and the colour table. The CPU keeps the data that places the runs of each
 * list. Owned by one renderer; the context must be current. */
#ifndef TRIP_GL_CONSTANTS_H
#define TRIP_GL_CONSTANTS_H

#include <epoxy/gl.h>

#include "gl/gl_batch.h"
#include "gl/gl_context.h"

typedef struct trip_gl_constants {
    GLuint blocks, table;
    unsigned room; /* capacity, in lists */
    trip_gl_placing
        *lists; /* by list index in the data set; filled only for lists that the plan draws */
} trip_gl_constants;

int trip_gl_constants_fill(trip_gl_constants *c, const trip_gl_context *context,
                           const trip_frame *frame);
/* Binds the block of a layer or a list, in double or in float. */
void trip_gl_constants_bind_layer(const trip_gl_constants *c, int axis, bool in_double);
void trip_gl_constants_bind_list(const trip_gl_constants *c, unsigned list, bool in_double);
void trip_gl_constants_release(trip_gl_constants *c);

#endif
