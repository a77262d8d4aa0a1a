/* What a frame is drawn into: one layer per axis, made when it is first drawn, the stencil
 * that masks pixels without weight, and the merged image. Owned by one renderer; kept from frame to
 * frame while size and type stay. Its bytes count against the budget. */
#ifndef TRIP_GL_TARGET_H
#define TRIP_GL_TARGET_H

#include <epoxy/gl.h>
#include <stdbool.h>

#include "budget.h"
#include "settings.h"

typedef struct trip_gl_target {
    trip_budget *budget;
    int width, height;
    trip_target type;
    GLuint layers[3], framebuffers[3];
    GLuint stencil;            /* shared by the layers */
    GLuint image, framebuffer; /* rgba32f */
    uint64_t bytes;
} trip_gl_target;

/* Readies an image of this size for layers of this type. */
int trip_gl_target_resize(trip_gl_target *t, int width, int height, trip_target type);
/* Binds the layer of an axis for drawing, empty; with `stencil` its stencil too, all zero. */
int trip_gl_target_begin_layer(trip_gl_target *t, int axis, bool stencil);
/* Binds a layer again, as it is. */
int trip_gl_target_bind_layer(const trip_gl_target *t, int axis);
/* Binds the image for drawing; it holds rgba32f whatever the layers hold. */
int trip_gl_target_begin_image(trip_gl_target *t);
/* Rows [first, first + count) of the image, width * 4 floats each. */
void trip_gl_target_read_rows(const trip_gl_target *t, int first, int count, float *rgba);
void trip_gl_target_release(trip_gl_target *t);

#endif
