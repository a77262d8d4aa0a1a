/* The submission form "indexed" (2008 section 5.1): of each level of the data set one vertex array,
 * a list's voxels with their places written out, and for each list an array of places in it. All of
 * it stays in GL memory, so that it must fit there and in the budget; loaded in pieces when a data
 * set is first drawn. Owned by one renderer; needs its context current. */
#ifndef TRIP_GL_RESIDENT_H
#define TRIP_GL_RESIDENT_H

#include <epoxy/gl.h>
#include <stddef.h>
#include <stdint.h>

#include "reader.h"

/* As the shaders read it: x, y, z and code in 16 bits each. */
typedef struct trip_gl_vertex {
    uint32_t xy, zc;
} trip_gl_vertex;

/* Where a list lies in the arrays. */
typedef struct trip_gl_resident_list {
    uint64_t order_first;  /* its records, in the order of its axis */
    uint64_t vertex_first; /* the vertices of its level */
} trip_gl_resident_list;

typedef struct trip_gl_loading trip_gl_loading;

typedef struct trip_gl_resident {
    trip_budget *budget;
    const trip_dataset *data;
    uint64_t checksum; /* of its header */
    unsigned planes;
    uint64_t vertex_count, order_counts[3];
    trip_gl_resident_list *lists; /* by number in the data set, those that are splatted */
    unsigned list_count;
    uint64_t bytes; /* in GL memory */
    GLuint vertices, normals, order[3];
    trip_gl_loading *loading; /* NULL: all is there */
} trip_gl_resident;

/* Begins to load the data set unless it is there, or goes on where it was paused. `block_bytes`
 * bounds each array. */
int trip_gl_resident_begin(trip_gl_resident *r, const trip_dataset *data, unsigned planes,
                           size_t block_bytes);
/* Loads a piece, as trip_renderer_ops.load. */
int trip_gl_resident_load(trip_gl_resident *r);
/* Waits until a piece can be loaded, at most so long. */
void trip_gl_resident_await(trip_gl_resident *r, uint64_t timeout_ns);
/* Until the next begin the data set is not used; lists that are loaded stay. */
void trip_gl_resident_pause(trip_gl_resident *r);
/* Before the first batch of an axis. */
void trip_gl_resident_bind(const trip_gl_resident *r, int axis);
void trip_gl_resident_release(trip_gl_resident *r);

/* The list whose records are the vertices of the level and kind of `list`: that along Z, or else Y,
 * or X. */
const trip_list *trip_gl_resident_base(const trip_dataset *data, const trip_list *list);

#endif
