/* The parts of a parser of NRRD headers: nrrd_header.c splits the text into fields, nrrd_geometry.c
 * makes the map to world space of them, nrrd_files.c the names of data files. Only these include
 * it. Functions report failures with file and line. */
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

/* A header that is being parsed; its text is changed. */
typedef struct trip_nrrd_parser {
    const char *path;               /* for messages */
    char *next, *end;               /* the text that is left */
    int line;                       /* number of the last line that was taken */
    char *values[TRIP_NRRD_FIELDS]; /* text after "field:", NULL where absent */
    int lines[TRIP_NRRD_FIELDS];
    /* Of "coordinates N:=" and its line. */
    char *coordinates[TRIP_NRRD_AXES_MAX];
    int coordinate_lines[TRIP_NRRD_AXES_MAX];
    int axes;
    int kept[3]; /* axes that are the volume's i, j, k */
} trip_nrrd_parser;

/* A failure in a line of the header (0: in the file). Returns TRIP_ERROR. */
__attribute__((format(printf, 3, 4))) int trip_nrrd_fail(const trip_nrrd_parser *p, int line,
                                                         const char *why, ...);
/* Warns that `text`, a field or a value (`what`), is unknown and ignored. */
void trip_nrrd_warn_unknown(const trip_nrrd_parser *p, int line, const char *stage,
                            const char *text);

/* The next line without its end, NULL after the last. */
char *trip_nrrd_next_line(trip_nrrd_parser *p);
/* Cuts blanks off both ends. */
char *trip_nrrd_trim(char *text);
/* Cuts the next word off. */
char *trip_nrrd_next_word(char **text);
/* Takes an integer that a blank or the end follows; false when there is none. */
bool trip_nrrd_parse_integer(char **text, int64_t *value);

/* Fills index_to_world, space and oriented; dims are known. */
int trip_nrrd_parse_geometry(const trip_nrrd_parser *p, trip_nrrd_header *h);

/* Whether the value of "data file" announces a list of names after the header. */
bool trip_nrrd_is_list(const char *data_file);
/* Fills files and file_count, and checks that the values can be divided equally among the files;
 * dims are known. `ends`: the text reaches the end of the file. */
int trip_nrrd_parse_files(trip_nrrd_parser *p, trip_nrrd_header *h, bool ends);

#endif
