/* Draws the passes of deferred pictures as trip_surfel_device describes. Quads cover the discs, and
 * image atomics keep the least depths. Compute shaders select surfels, and blending adds up those
 * that are visible. Depths, cells and sums are textures. Owned by one renderer; the bytes count
 * against the picture's budget. */
#ifndef TRIP_GL_SURFELS_H
#define TRIP_GL_SURFELS_H

#include "gl/gl_context.h"
#include "gl/queue.h"
#include "gl/variant.h"
#include "surfel_device.h"

/* The objects of the renderer that the passes use, and the device. */
typedef struct trip_gl_surfels {
    trip_gl_context *context;
    trip_gl_queue *queue;
    trip_gl_variants *variants;
    trip_surfel_device device;
} trip_gl_surfels;

/* Sets the device. The other fields must be set, and must stay where they are. */
void trip_gl_surfels_set_up(trip_gl_surfels *of);

#endif
