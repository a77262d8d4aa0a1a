/* The submission form "indexed" (2008 section 5.1): one vertex array for the whole data set, the
 * list along Z with its places written out, and for each list an array of places in it. All of it
 * stays in GL memory, so that it must fit there and in the budget; loaded when a data set is first
 * drawn. Owned by one renderer; needs its context current. */
#ifndef TRIP_GL_RESIDENT_H
#define TRIP_GL_RESIDENT_H

#include <epoxy/gl.h>
#include <stddef.h>
#include <stdint.h>

#include "reader.h"

typedef struct trip_gl_resident {
    trip_budget *budget;
    /* What is loaded. */
    const trip_dataset *data;
    uint64_t checksum;
    unsigned planes;
    uint64_t bytes;
    GLuint vertices, normals, order[3];
} trip_gl_resident;

/* Loads the data set unless it is there. `block_bytes` bounds each array. */
int trip_gl_resident_load(trip_gl_resident *r, const trip_dataset *data, unsigned planes,
                          size_t block_bytes);
/* Before the first batch of a list. */
void trip_gl_resident_bind(trip_gl_resident *r, int axis);
void trip_gl_resident_release(trip_gl_resident *r);

#endif
