/* Parses the text header of an NRRD file (NRRD0001 to NRRD0005), attached or detached. Works on
 * memory only, so that it can be fuzzed; the caller owns the result. Any thread. */
#ifndef TRIP_NRRD_HEADER_H
#define TRIP_NRRD_HEADER_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "byte_stream.h"
#include "volume.h"

#define TRIP_NRRD_HEADER_BYTES_MAX ((size_t)1 << 20)

typedef struct trip_nrrd_header {
    int64_t dims[3]; /* of the three axes kept; axes of size 1 beyond them are dropped */
    trip_affine index_to_world;
    char space[8]; /* anatomical, as in anatomy.h; "" where the header names no such space */
    double *coordinates[3]; /* of the axes in the world; NULL: even */
    bool oriented;          /* the header gives the directions of the axes in space */
    trip_scalar type;
    bool big_endian; /* not meaningful for types of one byte */
    trip_byte_encoding encoding;
    int64_t line_skip, byte_skip; /* byte_skip -1: the data end the file */
    char **files;                 /* data files as the header names them, in order */
    size_t file_count;            /* 0: the data follow the header */
    size_t header_bytes;          /* with the blank line that ends the header */
} trip_nrrd_header;

/* Parses the first `bytes` bytes of the file named `path` (for messages only), which are changed;
 * text[bytes] must be writable. `ends`: the text reaches the end of the file. Reports and returns
 * negative on failure, with nothing to free. */
int trip_nrrd_header_parse(trip_nrrd_header *h, const char *path, char *text, size_t bytes,
                           bool ends);
void trip_nrrd_header_free(trip_nrrd_header *h);

#endif
