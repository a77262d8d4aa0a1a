/* The submission forms of lists that stay on the GPU (2008, section 5.1).
 * - indexed: one vertex array holds the voxels of one list with explicit positions. Each list has
 *   an array of indices into it.
 * - resident: each axis has a vertex array of its own, in the order of its lists.
 *
 * All arrays stay in GL memory and must fit the budget. They are loaded in pieces when a data set
 * is first drawn. Owned by one renderer; the context must be current. */
#ifndef TRIP_GL_RESIDENT_H
#define TRIP_GL_RESIDENT_H

#include <epoxy/gl.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "reader.h"

/* Layout in the shaders: x, y, z and code, 16 bits each. */
typedef struct trip_gl_vertex {
    uint32_t xy, zc;
} trip_gl_vertex;

/* The first elements of a list in the arrays. */
typedef struct trip_gl_resident_list {
    uint64_t order_first;  /* of its records in the array of its axis */
    uint64_t vertex_first; /* of the vertices of its level; resident: same as order_first */
} trip_gl_resident_list;

typedef struct trip_gl_loading trip_gl_loading;

typedef struct trip_gl_resident {
    trip_budget *budget;
    const trip_dataset *data;
    uint64_t checksum; /* of the data set's header */
    unsigned planes;
    bool replicated;       /* the form resident */
    uint64_t vertex_count; /* of the largest vertex array */
    uint64_t order_counts[3];
    trip_gl_resident_list
        *lists; /* by list index; filled only for lists that are drawn as splats */
    unsigned list_count;
    uint64_t bytes; /* of GL memory */
    /* By axis. The form indexed uses the first of `vertices` and `normals`, the form resident no
     * `order`. */
    GLuint vertices[3], normals[3], order[3];
    trip_gl_loading *loading; /* NULL when loading is complete */
} trip_gl_resident;

/* Begins to load a data set, or resumes loading after a pause. Does nothing if it is loaded.
 * `block_bytes` limits the size of each array. */
int trip_gl_resident_begin(trip_gl_resident *r, const trip_dataset *data, unsigned planes,
                           bool replicated, size_t block_bytes);
/* Loads a piece; implements trip_renderer_ops.load. */
int trip_gl_resident_load(trip_gl_resident *r);
/* Waits until a piece can be loaded, for at most `timeout_ns`. */
void trip_gl_resident_await(trip_gl_resident *r, uint64_t timeout_ns);
/* Stops using the data set until the next begin. Loaded lists remain. */
void trip_gl_resident_pause(trip_gl_resident *r);
/* Binds the arrays of an axis, before its first batch. */
void trip_gl_resident_bind(const trip_gl_resident *r, int axis);
void trip_gl_resident_release(trip_gl_resident *r);

#endif
