/* The shader programs, by pass and effects. Each is built on first use and then kept. Owned by one
 * renderer; the context must be current. */
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
    TRIP_GL_PASS_TILES,
    TRIP_GL_PASS_TILE_CLEAR,
    TRIP_GL_PASS_SURFEL_DEPTH,
    TRIP_GL_PASS_SURFEL_SELECT,
    TRIP_GL_PASS_SURFEL_BLOCKS,
    TRIP_GL_PASS_SURFEL_BLEND,
} trip_gl_pass;

typedef struct trip_gl_variant {
    trip_gl_pass pass;
    trip_method method;
    unsigned effects; /* trip_gl_effect; bits that the pass does not use are ignored */
    unsigned layers;  /* for merge: bit a is set if list a was drawn */
} trip_gl_variant;

typedef struct trip_gl_built {
    uint64_t key;
    GLuint program;
} trip_gl_built;

typedef struct trip_gl_variants {
    trip_gl_built *built;
    size_t count;
} trip_gl_variants;

int trip_gl_variants_get(trip_gl_variants *v, trip_gl_variant variant, GLuint *program);
void trip_gl_variants_release(trip_gl_variants *v);

#endif
