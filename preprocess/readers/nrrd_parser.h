/* The internal interface of the parser of NRRD headers. Only these files include it:
 * - nrrd_header.c splits the text into fields.
 * - nrrd_geometry.c makes the map to world space.
 * - nrrd_files.c makes the names of the data files.
 *
 * Functions report failures with file and line. */
#ifndef TRIP_NRRD_PARSER_H
#define TRIP_NRRD_PARSER_H

#include "nrrd_header.h"

enum { TRIP_NRRD_AXES_MAX = 16 };

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
/* Parses an integer, which a blank or the end of the text must follow. Returns false if there is
 * none. */
bool trip_nrrd_parse_integer(char **text, int64_t *value);

/* Fills index_to_world, space and oriented. dims must be set. */
int trip_nrrd_parse_geometry(const trip_nrrd_parser *p, trip_nrrd_header *h);

/* Returns whether the value of "data file" announces a list of names after the header. */
bool trip_nrrd_is_list(const char *data_file);
/* Fills files and file_count. Checks that the values can be divided equally among the files. dims
 * must be set. `ends` tells that the text reaches the end of the file. */
int trip_nrrd_parse_files(trip_nrrd_parser *p, trip_nrrd_header *h, bool ends);

#endif
