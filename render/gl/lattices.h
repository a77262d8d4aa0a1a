/* What a frame's effects are drawn from (render/effects.h, render/emission.h): the lattices of what
 * light reaches and of heat as textures, kept until their numbers change, and the constants by
 * which shaders place what they draw in them and along the view. A frame without effects has none
 * of it. Owned by one
 * renderer; needs its context current. Textures count against the budget. */
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
    GLuint texture; /* 0: the frame has none */
    int nodes[3];
    uint64_t made_ns; /* that its numbers are of, trip_light_map_made_ns(); */
    int layers;       /* of nodes along k, that it has of them */
} trip_gl_lattice;

enum { TRIP_GL_REACHED_LATTICE, TRIP_GL_OPEN_LATTICE, TRIP_GL_HEAT_LATTICE, TRIP_GL_LATTICES };

typedef struct trip_gl_lattices {
    trip_budget *budget;
    trip_gl_lattice lattices[TRIP_GL_LATTICES];
    GLuint blocks, colours; /* 0: not yet */
    unsigned room;          /* blocks */
} trip_gl_lattices;

/* Whether a frame has effects. */
bool trip_gl_lattices_wanted(const trip_frame *frame);
/* Takes memory for a frame whose light and heat are begun, and gives back what an earlier one
 * needed; sets the constants: of lists, or of the layers of frames that classify after
 * interpolation. What earlier frames drew is done. */
int trip_gl_lattices_begin(trip_gl_lattices *e, const trip_gl_context *context,
                           const trip_frame *frame);
/* Once light and heat are complete: a part of the numbers that are not there yet, until
 * TRIP_FRAME_DONE. */
int trip_gl_lattices_load(trip_gl_lattices *e, const trip_gl_context *context,
                          const trip_frame *frame);
/* The frame's textures; then the constants of a list by its number, or of the layer of an axis. */
void trip_gl_lattices_bind(const trip_gl_lattices *e);
void trip_gl_lattices_bind_block(const trip_gl_lattices *e, unsigned number);
void trip_gl_lattices_release(trip_gl_lattices *e);

/* Pure: the constants of a list that the plan draws, NULL: of the layer of `axis`. */
trip_gl_effects_block trip_gl_effects_block_of(const trip_frame *frame, const trip_list *list,
                                               int axis);

#endif
