/* Composites the tiles of Gaussian scenes by a compute shader, as trip_tile_device describes. The
 * planes lie in GL memory. Each piece is copied into a slot that the GPU reads while the CPU makes
 * the next piece. A slot comes back with the tiles that are closed. Owned by one renderer; the
 * bytes count against the picture's budget. */
#ifndef TRIP_GL_TILES_H
#define TRIP_GL_TILES_H

#include "gaussian_tiles.h"
#include "gl/gl_context.h"
#include "gl/queue.h"
#include "gl/variant.h"

/* The objects of the renderer that the tiles use, and the device. */
typedef struct trip_gl_tiles {
    trip_gl_context *context;
    trip_gl_queue *queue;
    trip_gl_variants *variants;
    trip_tile_device device;
} trip_gl_tiles;

/* Sets the device. The other fields must be set, and must stay where they are. */
void trip_gl_tiles_set_up(trip_gl_tiles *of);

#endif
