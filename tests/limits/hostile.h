/* A data set's files in memory, to be changed at will and sealed with right checksums, as someone
 * would who means harm: what is behind the checksums is then all that protects a reader. */
#ifndef HOSTILE_H
#define HOSTILE_H

#include <stddef.h>
#include <stdint.h>

#include "format.h"

enum { HOSTILE_PLANE_FILES = 6 };

typedef struct hostile_file {
    char name[32];
    size_t bytes;
    unsigned char *data;
} hostile_file;

typedef struct hostile {
    hostile_file index, planes[HOSTILE_PLANE_FILES]; /* x0.voxels, x0.normals, y0.voxels, ... */
} hostile;

/* From a data set on disk with voxels and normals; the path is a folder's. */
void hostile_load(hostile *h, const char *path);
void hostile_copy(hostile *to, const hostile *from);
void hostile_free(hostile *h);

static inline trip_file_header *hostile_header(const hostile *h)
{
    return (trip_file_header *)(void *)h->index.data;
}

/* Descriptor of the list along an axis, by the place that the header of `sound` gives it. */
static inline trip_file_list *hostile_list(const hostile *h, const hostile *sound, int axis)
{
    return (trip_file_list *)(void *)(h->index.data + hostile_header(sound)->lists_offset) + axis;
}

/* Right checksums for whatever stands there now. Tables are found by the places that `sound`, the
 * data set before it was changed, gives them, so that the places themselves may be changed. */
void hostile_seal(hostile *h, const hostile *sound);
/* Writes the files into a folder, which is made when it is not there. */
void hostile_write(const hostile *h, const char *path);

#endif
