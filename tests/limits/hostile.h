/* The files of a data set in memory. Tests change them and then compute valid checksums, as an
 * attacker would. The reader must detect the changes by other checks. */
#ifndef HOSTILE_H
#define HOSTILE_H

#include <stddef.h>
#include <stdint.h>

#include "format.h"

typedef struct hostile_file {
    char name[32];
    unsigned list; /* list of a plane file */
    int plane;
    size_t bytes;
    unsigned char *data;
} hostile_file;

typedef struct hostile {
    hostile_file index;
    hostile_file *planes; /* plane files of all lists in order */
    unsigned plane_count;
} hostile;

/* Loads the data set in folder `path`. */
void hostile_load(hostile *h, const char *path);
void hostile_copy(hostile *to, const hostile *from);
void hostile_free(hostile *h);

static inline trip_file_header *hostile_header(const hostile *h)
{
    return (trip_file_header *)(void *)h->index.data;
}

/* Returns the descriptor of a list in `h`, at the offset that the header of `sound` gives. */
static inline trip_file_list *hostile_list(const hostile *h, const hostile *sound, unsigned list)
{
    return (trip_file_list *)(void *)(h->index.data + hostile_header(sound)->lists_offset) + list;
}

/* Computes valid checksums for the current bytes. `sound` is the data set before all changes. Its
 * header gives the offsets of the tables, so tests may also change the offsets in `h`. */
void hostile_seal(hostile *h, const hostile *sound);
/* Writes the files of `h` that differ from `disk`, the current files in folder `path`, and updates
 * `disk`. An all-zero `disk` means that the folder is empty. */
void hostile_write(const hostile *h, hostile *disk, const char *path);

#endif
