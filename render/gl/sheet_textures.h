/* The sheets at hand in GL memory: a few layers of codes, and of gradients where there is light,
 * over the rectangle that a list's selected voxels lie in. Owned by one renderer; needs its context
 * current; kept while they are large enough. Their bytes count against the budget. */
#ifndef TRIP_GL_SHEET_TEXTURES_H
#define TRIP_GL_SHEET_TEXTURES_H

#include <epoxy/gl.h>
#include <stdbool.h>
#include <stdint.h>

#include "budget.h"

enum { TRIP_GL_SHEETS_MAX = 10 };

typedef struct trip_gl_sheet_textures {
    trip_budget *budget;
    GLuint codes;     /* r32f: codes, below 0 where no voxel is */
    GLuint gradients; /* rgba16f; 0: without light */
    int width, height, layers;
    uint64_t bytes; /* of the budget */
} trip_gl_sheet_textures;

/* Room for at least so many sheets of width x height voxels. */
int trip_gl_sheet_textures_fit(trip_gl_sheet_textures *t, int64_t width, int64_t height,
                               unsigned min, bool gradients);
/* No voxel is in the first width x height of a layer. */
void trip_gl_sheet_textures_clear(const trip_gl_sheet_textures *t, int layer, int width,
                                  int height);
void trip_gl_sheet_textures_release(trip_gl_sheet_textures *t);

#endif
