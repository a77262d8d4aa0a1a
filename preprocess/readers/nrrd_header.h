/* Parses the text header of an NRRD file (NRRD0001 to NRRD0005), attached or detached. The parser
 * works on memory only, so that it can be fuzzed. The caller owns the result. Any thread may call
 * it. */
#ifndef TRIP_NRRD_HEADER_H
#define TRIP_NRRD_HEADER_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "byte_stream.h"
#include "volume.h"

#define TRIP_NRRD_HEADER_BYTES_MAX ((size_t)1 << 20)

typedef struct trip_nrrd_header {
    int64_t dims[3]; /* the three kept axes; other axes have size 1 and are dropped */
    trip_affine index_to_world;
    char space[8];          /* anatomical, as in anatomy.h; "" if the header names no such space */
    double *coordinates[3]; /* of the samples in world space; NULL if even */
    bool oriented;          /* the header gives the directions of the axes in space */
    trip_scalar type;
    bool big_endian; /* meaningless for types of one byte */
    trip_byte_encoding encoding;
    int64_t line_skip, byte_skip; /* byte_skip -1: the data are at the end of the file */
    char **files;                 /* data files as the header names them, in order */
    size_t file_count;            /* 0 if the data follow the header */
    size_t header_bytes;          /* including the blank line that ends the header */
} trip_nrrd_header;

/* Parses the first `bytes` bytes of a file and changes them; text[bytes] must be writable. `path`
 * is used in messages only. `ends` tells that the text reaches the end of the file. Reports
 * failures and returns a negative status; there is then nothing to free. */
int trip_nrrd_header_parse(trip_nrrd_header *h, const char *path, char *text, size_t bytes,
                           bool ends);
void trip_nrrd_header_free(trip_nrrd_header *h);

#endif
