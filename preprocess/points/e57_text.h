/* Parses the text (XML) that describes an E57 file: the scans with their poses, and the fields of
 * their points. Pictures and other parts are ignored. One thread at a time. */
#ifndef TRIP_E57_TEXT_H
#define TRIP_E57_TEXT_H

#include <stdbool.h>
#include <stdint.h>

#include "e57_pages.h"

typedef enum trip_e57_field {
    TRIP_E57_X,
    TRIP_E57_Y,
    TRIP_E57_Z,
    TRIP_E57_RANGE,
    TRIP_E57_AZIMUTH,
    TRIP_E57_ELEVATION,
    TRIP_E57_NORMAL_X,
    TRIP_E57_NORMAL_Y,
    TRIP_E57_NORMAL_Z,
    TRIP_E57_RED,
    TRIP_E57_GREEN,
    TRIP_E57_BLUE,
    TRIP_E57_INTENSITY,
    TRIP_E57_RETURN_INDEX,
    TRIP_E57_RETURN_COUNT,
    TRIP_E57_TIME,
    TRIP_E57_CLASSIFICATION,
    TRIP_E57_INVALID_POSITION,
    TRIP_E57_INVALID_DIRECTION,
    TRIP_E57_INVALID_COLOUR,
    TRIP_E57_INVALID_INTENSITY,
    TRIP_E57_FIELDS
} trip_e57_field;

typedef enum trip_e57_form { TRIP_E57_FLOAT, TRIP_E57_DOUBLE, TRIP_E57_INTEGER } trip_e57_form;

/* Storage of a field. The value of an integer is (minimum + stored) * scale + offset. */
typedef struct trip_e57_storage {
    bool exists;
    trip_e57_form form;
    unsigned stream; /* number of its stream of bytes */
    unsigned bits;   /* of a stored value */
    int64_t minimum, maximum;
    double scale, offset;
} trip_e57_storage;

typedef struct trip_e57_scan {
    bool posed;
    double rotation[4]; /* w, x, y, z */
    double translation[3];
    uint64_t file_offset, count;
    unsigned streams;
    trip_e57_storage fields[TRIP_E57_FIELDS];
    double colour_limits[3][2]; /* equal numbers if the file states none */
    double intensity_limits[2];
    double index_bounds[2][2]; /* of rows and columns, likewise */
    double bounds[3][2];       /* in the scan's coordinates; NAN if the file states none */
} trip_e57_scan;

typedef struct trip_e57_text {
    trip_e57_scan *scans;
    uint32_t count, room;
    char extras[512];   /* names of fields that are not read */
    char comments[256]; /* the scanner, or the program that wrote the file */
} trip_e57_text;

/* Reads and parses the text. Faults are reported. Release it after a failure too. */
int trip_e57_text_read(trip_e57_text *t, trip_e57_pages *pages, const char *path);
void trip_e57_text_release(trip_e57_text *t);

#endif
