/* The programs of the renderer by pass and effects, each built when it is first called for and then
 * kept. Owned by one renderer; needs its context current. */
#ifndef TRIP_GL_VARIANT_H
#define TRIP_GL_VARIANT_H

#include <epoxy/gl.h>
#include <stddef.h>
#include <stdint.h>

#include "settings.h"

typedef enum trip_gl_pass {
    TRIP_GL_PASS_SPLAT,
    TRIP_GL_PASS_SUM,
    TRIP_GL_PASS_COUNT,
    TRIP_GL_PASS_REGION,
    TRIP_GL_PASS_MERGE,
    TRIP_GL_PASS_SHEET_DECODE,
    TRIP_GL_PASS_SHEET_GRADIENT,
    TRIP_GL_PASS_SHEET_DRAW,
} trip_gl_pass;

typedef struct trip_gl_variant {
    trip_gl_pass pass;
    trip_method method;
    unsigned effects; /* trip_gl_effect; those without meaning in the pass make no difference */
    unsigned layers;  /* merge only: bit a for a list that was drawn */
} trip_gl_variant;

typedef struct trip_gl_built {
    uint32_t key;
    GLuint program;
} trip_gl_built;

typedef struct trip_gl_variants {
    trip_gl_built *built;
    size_t count;
} trip_gl_variants;

int trip_gl_variants_get(trip_gl_variants *v, trip_gl_variant variant, GLuint *program);
void trip_gl_variants_release(trip_gl_variants *v);

#endif
