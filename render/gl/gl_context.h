/* An OpenGL 4.5 core context without a window, by EGL: on a hardware device where there is one,
 * else on Mesa's surfaceless platform. Owned by one renderer; every call below and all GL calls
 * come from the thread that made the context current. Also the checks that turn GL's failures into
 * the project's one line and negative code. */
#ifndef TRIP_GL_CONTEXT_H
#define TRIP_GL_CONTEXT_H

#include <stdbool.h>
#include <stddef.h>

typedef struct trip_gl_context trip_gl_context;

/* Limits of the device that the renderer plans by. */
typedef struct trip_gl_limits {
    double point_size_px;       /* largest point sprite */
    size_t storage_block_bytes; /* largest shader storage block */
    int image_px;               /* largest layer, either way */
    bool software;              /* it draws on the processor */
} trip_gl_limits;

/* Leaves the new context current. Fails where there is no EGL or no OpenGL 4.5 core. */
int trip_gl_context_create(trip_gl_context **out);
void trip_gl_context_destroy(trip_gl_context *c);

/* Makes the context current unless it is. */
int trip_gl_context_use(trip_gl_context *c);

const char *trip_gl_context_device(const trip_gl_context *c);
const trip_gl_limits *trip_gl_context_limits(const trip_gl_context *c);

/* Reports what GL has recorded since the last check: out of memory, a lost context, or a
 * wrong call. `where` is what was being done. */
int trip_gl_check(const trip_gl_context *c, const char *where);

#endif
