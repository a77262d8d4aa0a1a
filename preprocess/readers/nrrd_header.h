/* Parses the text header of an NRRD file (NRRD0001 to NRRD0005), attached or detached. The parser
 * works on memory only, so that it can be fuzzed. The caller owns the result. Any thread may call
 * it. */
#ifndef TRIP_NRRD_HEADER_H
#define TRIP_NRRD_HEADER_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "byte_stream.h"
#include "dense_file.h"
#include "volume_info.h"

#define TRIP_NRRD_HEADER_BYTES_MAX ((size_t)1 << 20)

enum { TRIP_NRRD_AXES_MAX = 16 };

typedef struct trip_nrrd_header {
    int64_t dims[3];                   /* the three kept axes */
    int64_t sizes[TRIP_NRRD_AXES_MAX]; /* of all axes; their product fits in an int64_t */
    int axes;
    int kept[3];      /* the axes that are i, j and k of the volume, in ascending order */
    int channel_axis; /* the axis from which --channel selects, or -1 */
    int time_axis;    /* the axis from which --time selects, or -1 */
    bool colour;      /* the values are red, green, blue and possibly opacity of each voxel */
    trip_affine index_to_world;
    char space[8];          /* anatomical, as in anatomy.h; "" if the header names no such space */
    double *coordinates[3]; /* of the samples in world space; NULL if even */
    bool oriented;          /* the header gives the directions of the axes in space */
    trip_scalar type;
    bool big_endian; /* meaningless for types of one byte */
    trip_byte_encoding encoding;
    trip_text_form text;
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
/* Sets the layout of the values for a channel and a time within the axes' sizes. */
void trip_nrrd_header_layout(const trip_nrrd_header *h, int64_t channel, int64_t time,
                             trip_dense_layout *out);

/* ---- for the parser's own files ----
 *
 * - nrrd_header.c splits the text into fields.
 * - nrrd_axes.c chooses the axes of the volume.
 * - nrrd_geometry.c makes the map to world space.
 * - nrrd_files.c makes the names of the data files.
 *
 * Functions report failures with file and line. */

typedef enum trip_nrrd_field {
    TRIP_NRRD_DIMENSION,
    TRIP_NRRD_SIZES,
    TRIP_NRRD_TYPE,
    TRIP_NRRD_ENDIAN,
    TRIP_NRRD_ENCODING,
    TRIP_NRRD_SPACINGS,
    TRIP_NRRD_MINS,
    TRIP_NRRD_MAXS,
    TRIP_NRRD_CENTERS,
    TRIP_NRRD_DIRECTIONS,
    TRIP_NRRD_ORIGIN,
    TRIP_NRRD_SPACE,
    TRIP_NRRD_KINDS,
    TRIP_NRRD_LINE_SKIP,
    TRIP_NRRD_BYTE_SKIP,
    TRIP_NRRD_DATA_FILE,
    TRIP_NRRD_FIELDS
} trip_nrrd_field;

/* A header during parsing. The parser changes its text. */
typedef struct trip_nrrd_parser {
    const char *path;               /* for messages */
    char *next, *end;               /* the remaining text */
    int line;                       /* number of the last line read */
    char *values[TRIP_NRRD_FIELDS]; /* text after "field:"; NULL if absent */
    int lines[TRIP_NRRD_FIELDS];
    /* Text after "coordinates N:=", and its line. */
    char *coordinates[TRIP_NRRD_AXES_MAX];
    int coordinate_lines[TRIP_NRRD_AXES_MAX];
    int axes;
    int kept[3]; /* the axes that are i, j and k of the volume */
} trip_nrrd_parser;

/* Reports a failure in a line of the header, or in the whole file if `line` is 0. Returns
 * TRIP_ERROR. */
__attribute__((format(printf, 3, 4))) int trip_nrrd_fail(const trip_nrrd_parser *p, int line,
                                                         const char *why, ...);
/* Warns that `text` is unknown and ignored. `stage` names it: "field" or "space". */
void trip_nrrd_warn_unknown(const trip_nrrd_parser *p, int line, const char *stage,
                            const char *text);

/* Returns the next line without its line end, or NULL after the last line. */
char *trip_nrrd_next_line(trip_nrrd_parser *p);
/* Cuts blanks off both ends and returns the new start. */
char *trip_nrrd_trim(char *text);
/* Cuts off the next word and returns it. */
char *trip_nrrd_next_word(char **text);
/* Fails if a field is missing. `name` is its name. */
int trip_nrrd_require(const trip_nrrd_parser *p, trip_nrrd_field f, const char *name);
/* Parses an integer, which a blank or the end of the text must follow. Returns false if there is
 * none. */
bool trip_nrrd_parse_integer(char **text, int64_t *value);
/* Parses an integer that fills the whole text. Returns false if there is none. */
bool trip_nrrd_parse_lone_integer(char *text, int64_t *value);

/* Fills sizes, axes, kept, channel_axis, time_axis, colour and dims. */
int trip_nrrd_parse_axes(trip_nrrd_parser *p, trip_nrrd_header *h);

/* Fills index_to_world, space and oriented. dims must be set. */
int trip_nrrd_parse_geometry(const trip_nrrd_parser *p, trip_nrrd_header *h);

/* Returns whether the value of "data file" announces a list of names after the header. */
bool trip_nrrd_is_list(const char *data_file);
/* Fills files and file_count. Checks that the values can be divided equally among the files. dims
 * must be set. `ends` tells that the text reaches the end of the file. */
int trip_nrrd_parse_files(trip_nrrd_parser *p, trip_nrrd_header *h, bool ends);

#endif
