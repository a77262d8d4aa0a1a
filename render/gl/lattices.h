/* The GPU data of a frame's effects (render/light/effects.h, render/light/emission.h). The lattices
 * of light and heat are textures, kept until their values change. Uniform blocks hold the constants
 * by which shaders find positions in the lattices and along the view. Owned by one renderer; the
 * context must be current. The textures count against the budget. */
#ifndef TRIP_GL_LATTICES_H
#define TRIP_GL_LATTICES_H

#include <epoxy/gl.h>
#include <stdint.h>

#include "budget.h"
#include "gl/gl_context.h"
#include "gl/shared.h"
#include "light_grid.h"
#include "renderer.h"

typedef struct trip_gl_lattice {
    GLuint texture; /* 0 if the frame does not use this lattice */
    int nodes[3];
    uint64_t made_ns; /* trip_light_map_made_ns() of the values */
    int layers;       /* number of node layers along k already loaded */
} trip_gl_lattice;

enum { TRIP_GL_REACHED_LATTICE, TRIP_GL_OPEN_LATTICE, TRIP_GL_HEAT_LATTICE, TRIP_GL_LATTICES };

typedef struct trip_gl_lattices {
    trip_budget *budget;
    trip_gl_lattice lattices[TRIP_GL_LATTICES];
    GLuint blocks, colours; /* 0 before the first use */
    unsigned room;          /* capacity, in blocks */
} trip_gl_lattices;

/* Whether a frame has effects. */
bool trip_gl_lattices_wanted(const trip_frame *frame);
/* Allocates the textures for a frame, and frees the ones that an earlier frame left. Light and heat
 * must have begun. Sets the constants: of each list in `pre`, of each layer in `post`. The GPU must
 * have finished earlier frames. */
int trip_gl_lattices_begin(trip_gl_lattices *e, const trip_gl_context *context,
                           const trip_frame *frame);
/* Loads one part of the missing values, after light and heat are complete. Call it again until it
 * returns TRIP_FRAME_DONE. */
int trip_gl_lattices_load(trip_gl_lattices *e, const trip_gl_context *context,
                          const trip_frame *frame);
/* Binds the frame's textures, and then the constants of a list (by its index) or of a layer (by its
 * axis). */
void trip_gl_lattices_bind(const trip_gl_lattices *e);
void trip_gl_lattices_bind_block(const trip_gl_lattices *e, unsigned number);
void trip_gl_lattices_release(trip_gl_lattices *e);

/* Returns the constants of a list that the plan draws, or of the layer of `axis` if `list` is NULL.
 * Pure function. */
trip_gl_effects_block trip_gl_effects_block_of(const trip_frame *frame, const trip_list *list,
                                               int axis);

#endif
