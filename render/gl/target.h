/* What a frame is drawn into: one layer per axis, made when it is first drawn, the stencil
 * that masks pixels without weight, and a strip of rows of the merged image. Large layers are made
 * of bands of rows: where textures are the processor's memory, one takes a while to make. Owned by
 * one renderer; kept from frame to frame while size and type stay. Its bytes count against the
 * budget. */
#ifndef TRIP_GL_TARGET_H
#define TRIP_GL_TARGET_H

#include <epoxy/gl.h>
#include <stdbool.h>

#include "budget.h"
#include "settings.h"

enum {
    /* About; more in the largest images. On a processor smaller ones, which it has to fill with
     * zeros before a frame can be given up. */
    TRIP_GL_BAND_PIXELS = 1 << 24,
    TRIP_GL_SOFTWARE_BAND_PIXELS = 1 << 23,
    TRIP_GL_BANDS_MAX = 32,
    TRIP_GL_STRIP_PIXELS = 1 << 20, /* a pass over an image is done in strips of about so many */
};

/* Colour and opacity; with depths these too, as wide, since they are blended by an opacity of their
 * own (TRIP_GL_OUT_COLOUR, TRIP_GL_OUT_DEPTH). */
typedef struct trip_gl_surface {
    GLuint colour, depth; /* textures */
    GLuint framebuffer;
    uint64_t bytes; /* of the budget */
} trip_gl_surface;

typedef struct trip_gl_band {
    int first_row, rows;
    trip_gl_surface layers[3]; /* by axis */
    GLuint stencil;            /* shared by the layers */
    uint64_t stencil_bytes;
    trip_gl_surface sheet; /* sums of a sheet's splats, shared too; rgba32f and r32f */
} trip_gl_band;

typedef struct trip_gl_target {
    trip_budget *budget;
    bool software; /* the device is the processor */
    int width, height;
    trip_target type;
    bool depth;
    trip_gl_band bands[TRIP_GL_BANDS_MAX];
    int band_count;
    int strip_rows;
    trip_gl_surface strip; /* rgba32f and r32f whatever the layers hold */
} trip_gl_target;

/* Readies an image of this size for layers of this type, with depths or without. */
int trip_gl_target_resize(trip_gl_target *t, int width, int height, trip_target type, bool depth);
/* Empties the layer of an axis; with `stencil` it has one, all zero; with `sums` the bands' sheets
 * are empty, too, and have the same stencil. */
int trip_gl_target_begin_layer(trip_gl_target *t, int axis, bool stencil, bool sums);
/* Binds a band of a layer for drawing: positions are those of the image, but row first_row of the
 * image is row 0 of the fragments. */
void trip_gl_target_bind(const trip_gl_target *t, int axis, const trip_gl_band *band);
/* The same of the band's sheet. */
void trip_gl_target_bind_sheet(const trip_gl_target *t, const trip_gl_band *band);
void trip_gl_target_clear_sheet(const trip_gl_target *t, const trip_gl_band *band);
/* Binds the first `rows` rows of the strip for drawing. */
void trip_gl_target_bind_strip(const trip_gl_target *t, int rows);
/* Reads them when they are drawn, width * 4 floats each; and width depths where there are any. */
void trip_gl_target_read_strip(const trip_gl_target *t, int rows, float *rgba, float *depth);
void trip_gl_target_release(trip_gl_target *t);

#endif
