/* A data set's files in memory, to be changed at will and sealed with right checksums, as someone
 * would who means harm: what is behind the checksums is then all that protects a reader. */
#ifndef HOSTILE_H
#define HOSTILE_H

#include <stddef.h>
#include <stdint.h>

#include "format.h"

typedef struct hostile_file {
    char name[32];
    unsigned list; /* of a plane file: what of */
    int plane;
    size_t bytes;
    unsigned char *data;
} hostile_file;

typedef struct hostile {
    hostile_file index;
    hostile_file *planes; /* of all lists, one after the other */
    unsigned plane_count;
} hostile;

/* From a data set on disk; the path is a folder's. */
void hostile_load(hostile *h, const char *path);
void hostile_copy(hostile *to, const hostile *from);
void hostile_free(hostile *h);

static inline trip_file_header *hostile_header(const hostile *h)
{
    return (trip_file_header *)(void *)h->index.data;
}

/* Descriptor of a list, by the place that the header of `sound` gives it. */
static inline trip_file_list *hostile_list(const hostile *h, const hostile *sound, unsigned list)
{
    return (trip_file_list *)(void *)(h->index.data + hostile_header(sound)->lists_offset) + list;
}

/* Right checksums for whatever stands there now. Tables are found by the places that `sound`, the
 * data set before it was changed, gives them, so that the places themselves may be changed. */
void hostile_seal(hostile *h, const hostile *sound);
/* Makes what lies in a folder, `disk`, the same as `h`: files that differ are written. Nothing lies
 * there yet where `disk` is all zero. */
void hostile_write(const hostile *h, hostile *disk, const char *path);

#endif
