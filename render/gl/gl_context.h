/* An OpenGL 4.5 core context without a window, created by EGL. It uses a hardware device if there
 * is one, and Mesa's surfaceless platform otherwise. Owned by one renderer; the thread that made
 * the context current makes all calls. trip_gl_check() reports GL errors as one line and a negative
 * code. */
#ifndef TRIP_GL_CONTEXT_H
#define TRIP_GL_CONTEXT_H

#include <stdbool.h>
#include <stddef.h>

typedef struct trip_gl_context trip_gl_context;

typedef struct trip_gl_limits {
    double point_size_px;       /* maximum size of a point sprite */
    size_t storage_block_bytes; /* maximum size of a shader storage block */
    int image_px;               /* maximum width and height of a layer */
    bool software;              /* the processor emulates the GPU */
} trip_gl_limits;

/* Creates a context and makes it current. Fails if EGL or OpenGL 4.5 core is missing. */
int trip_gl_context_create(trip_gl_context **out);
void trip_gl_context_destroy(trip_gl_context *c);

/* Makes the context current. Does nothing if it already is. */
int trip_gl_context_use(trip_gl_context *c);

const char *trip_gl_context_device(const trip_gl_context *c);
const trip_gl_limits *trip_gl_context_limits(const trip_gl_context *c);

/* Reports the first GL error since the last check: out of memory, a lost context, or an invalid
 * call. `where` names the operation. */
int trip_gl_check(const trip_gl_context *c, const char *where);

#endif
