/* The surfaces of a frame: one layer for each axis, a stencil and one strip of rows of the merged
 * picture. A layer is allocated when it is first drawn. Layers are split into bands of rows,
 * because software GL takes long to allocate large textures. Owned by one renderer and kept while
 * size and type stay the same. The bytes count against the budget. */
#ifndef TRIP_GL_TARGET_H
#define TRIP_GL_TARGET_H

#include <epoxy/gl.h>
#include <stdbool.h>

#include "budget.h"
#include "settings.h"

enum {
    /* Approximate pixels of a band; the largest pictures have larger bands. Software GL clears a
     * band before a frame can be cancelled, so its bands are smaller. */
    TRIP_GL_BAND_PIXELS = 1 << 24,
    TRIP_GL_SOFTWARE_BAND_PIXELS = 1 << 23,
    TRIP_GL_BANDS_MAX = 32,
    TRIP_GL_STRIP_PIXELS = 1 << 20, /* full-screen passes run in strips of about this size */
};

/* A colour texture with opacity. Pictures with depths add a depth texture of four channels, because
 * blending needs an opacity in each texture (TRIP_GL_OUT_COLOUR, TRIP_GL_OUT_DEPTH). */
typedef struct trip_gl_surface {
    GLuint colour, depth;
    GLuint framebuffer;
    uint64_t bytes; /* charged to the budget */
} trip_gl_surface;

typedef struct trip_gl_band {
    int first_row, rows;
    trip_gl_surface layers[3]; /* by axis */
    GLuint stencil;            /* shared by the layers */
    uint64_t stencil_bytes;
    trip_gl_surface sheet; /* sums of a sheet's splats, shared by the layers; rgba32f and r32f */
} trip_gl_band;

typedef struct trip_gl_target {
    trip_budget *budget;
    bool software; /* the processor emulates the GPU */
    int width, height;
    trip_target type;
    bool depth;
    trip_gl_band bands[TRIP_GL_BANDS_MAX];
    int band_count;
    int strip_rows;
    trip_gl_surface strip; /* rgba32f and r32f for all target types */
} trip_gl_target;

/* Prepares for a picture of the given size, with layers of the given type, with or without depths.
 */
int trip_gl_target_resize(trip_gl_target *t, int width, int height, trip_target type, bool depth);
/* Clears the layer of an axis. If `stencil` is set, the layer gets a stencil of zeros. If `sums` is
 * set, the bands also get empty sheets, with the same stencil. */
int trip_gl_target_begin_layer(trip_gl_target *t, int axis, bool stencil, bool sums);
/* Binds a band of a layer for drawing. Positions refer to the whole picture. Row 0 of the fragments
 * is row first_row of the picture. */
void trip_gl_target_bind(const trip_gl_target *t, int axis, const trip_gl_band *band);
/* Binds the sheet of a band for drawing, with the same coordinates. */
void trip_gl_target_bind_sheet(const trip_gl_target *t, const trip_gl_band *band);
void trip_gl_target_clear_sheet(const trip_gl_target *t, const trip_gl_band *band);
/* Binds the first `rows` rows of the strip for drawing. */
void trip_gl_target_bind_strip(const trip_gl_target *t, int rows);
/* Reads these rows after drawing: width * 4 floats for each row, and width depths if the target has
 * depths. */
void trip_gl_target_read_strip(const trip_gl_target *t, int rows, float *rgba, float *depth);
void trip_gl_target_release(trip_gl_target *t);

#endif
