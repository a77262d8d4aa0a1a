/* Parses the header of a PLY file (Turk 1994): elements of fixed properties, and comments. Any
 * thread. */
#ifndef TRIP_PLY_HEADER_H
#define TRIP_PLY_HEADER_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "byte_stream.h"

enum { TRIP_PLY_NAME_BYTES = 32, TRIP_PLY_ELEMENTS_MAX = 16, TRIP_PLY_PROPERTIES_MAX = 4096 };

typedef struct trip_ply_property {
    char name[TRIP_PLY_NAME_BYTES]; /* cut if longer */
    trip_scalar type;               /* of a value in a row: double if the file is text */
    trip_scalar stated_type;
    uint32_t offset; /* in a row */
    bool list;
    trip_scalar count_type; /* of the length of a list */
} trip_ply_property;

typedef struct trip_ply_element {
    char name[TRIP_PLY_NAME_BYTES];
    uint64_t count;
    uint32_t first, properties; /* in trip_ply_header.properties */
    uint32_t row_bytes;         /* of the properties that are no lists */
    bool lists;
} trip_ply_element;

typedef struct trip_ply_header {
    bool text, swap; /* values as text; bytes in the other order than this machine's */
    uint64_t bytes;  /* of the header */
    trip_ply_element elements[TRIP_PLY_ELEMENTS_MAX];
    uint32_t element_count, property_count;
    trip_ply_property *properties;
    char comments[256]; /* separated by "; " */
    char up[3];         /* the axis that points up, or "" */
    int antialiased;    /* -1 if no comment tells */
} trip_ply_header;

/* Reads and parses the header of a file. Faults are reported. Release it after a failure too. */
int trip_ply_header_read(trip_ply_header *h, const char *path);
void trip_ply_header_release(trip_ply_header *h);

/* Returns the element, or NULL. */
const trip_ply_element *trip_ply_element_of(const trip_ply_header *h, const char *name);
/* Returns the property, or NULL. */
const trip_ply_property *trip_ply_property_of(const trip_ply_header *h, const trip_ply_element *e,
                                              const char *name);

/* Opens a stream at the first row of an element without lists. In a text, each value of a row is a
 * double. Elements before it may hold lists, which are read through. */
int trip_ply_stream_open(trip_byte_stream **out, const trip_ply_header *h,
                         const trip_ply_element *e, const char *path);
int trip_ply_stream_rewind(trip_byte_stream *s, const trip_ply_header *h,
                           const trip_ply_element *e);

/* Returns the value of a property in a row. */
double trip_ply_value(const trip_ply_header *h, const trip_ply_property *p,
                      const unsigned char *row);

#endif
