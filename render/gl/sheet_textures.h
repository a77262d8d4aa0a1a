/* The textures that hold sheets in GL memory: some layers of codes, of gradients if shading is on,
 * and of deviations if they blur the transfer function. They cover the rectangle of a list's
 * selected voxels. Owned by one renderer and kept while they are large enough; the context must be
 * current. Their bytes count against the budget. */
#ifndef TRIP_GL_SHEET_TEXTURES_H
#define TRIP_GL_SHEET_TEXTURES_H

#include <epoxy/gl.h>
#include <stdbool.h>
#include <stdint.h>

#include "budget.h"

enum { TRIP_GL_SHEETS_MAX = 10 };

typedef struct trip_gl_sheet_textures {
    trip_budget *budget;
    GLuint codes;      /* r32f: codes; TRIP_GL_MISSING_... where a voxel is missing */
    GLuint gradients;  /* rgba16f; 0 without shading */
    GLuint deviations; /* r16: deviation codes divided by 255; 0 if no frame needed them */
    int width, height, layers;
    uint64_t bytes; /* charged to the budget */
} trip_gl_sheet_textures;

/* Ensures a capacity of at least `min` sheets of width x height voxels. */
int trip_gl_sheet_textures_fit(trip_gl_sheet_textures *t, int64_t width, int64_t height,
                               unsigned min, bool gradients, bool deviations);
/* Writes the code of missing voxels to the first width x height voxels of a layer. */
void trip_gl_sheet_textures_clear(const trip_gl_sheet_textures *t, int layer, int width, int height,
                                  float missing);
void trip_gl_sheet_textures_release(trip_gl_sheet_textures *t);

#endif
