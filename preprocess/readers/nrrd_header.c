/* The project has its own parser because teem leaks on malformed headers and keeps its errors in
 * one global buffer. */
#include "nrrd_header.h"

#include <ctype.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "report.h"

static const struct {
    const char *name;
    trip_nrrd_field field; /* TRIP_NRRD_FIELDS marks fields that are known but unused */
} names[] = {
    { "dimension", TRIP_NRRD_DIMENSION },
    { "sizes", TRIP_NRRD_SIZES },
    { "type", TRIP_NRRD_TYPE },
    { "endian", TRIP_NRRD_ENDIAN },
    { "encoding", TRIP_NRRD_ENCODING },
    { "spacings", TRIP_NRRD_SPACINGS },
    { "space directions", TRIP_NRRD_DIRECTIONS },
    { "space origin", TRIP_NRRD_ORIGIN },
    { "kinds", TRIP_NRRD_KINDS },
    { "line skip", TRIP_NRRD_LINE_SKIP },
    { "lineskip", TRIP_NRRD_LINE_SKIP },
    { "byte skip", TRIP_NRRD_BYTE_SKIP },
    { "byteskip", TRIP_NRRD_BYTE_SKIP },
    { "data file", TRIP_NRRD_DATA_FILE },
    { "datafile", TRIP_NRRD_DATA_FILE },
    { "content", TRIP_NRRD_FIELDS },
    { "number", TRIP_NRRD_FIELDS },
    { "block size", TRIP_NRRD_FIELDS },
    { "blocksize", TRIP_NRRD_FIELDS },
    { "sample units", TRIP_NRRD_FIELDS },
    { "sampleunits", TRIP_NRRD_FIELDS },
    { "min", TRIP_NRRD_FIELDS },
    { "max", TRIP_NRRD_FIELDS },
    { "old min", TRIP_NRRD_FIELDS },
    { "oldmin", TRIP_NRRD_FIELDS },
    { "old max", TRIP_NRRD_FIELDS },
    { "oldmax", TRIP_NRRD_FIELDS },
    { "thicknesses", TRIP_NRRD_FIELDS },
    { "axis mins", TRIP_NRRD_MINS },
    { "axismins", TRIP_NRRD_MINS },
    { "axis maxs", TRIP_NRRD_MAXS },
    { "axismaxs", TRIP_NRRD_MAXS },
    { "centers", TRIP_NRRD_CENTERS },
    { "centerings", TRIP_NRRD_CENTERS },
    { "labels", TRIP_NRRD_FIELDS },
    { "units", TRIP_NRRD_FIELDS },
    { "space", TRIP_NRRD_SPACE },
    { "space dimension", TRIP_NRRD_FIELDS }, /* follows from the vectors */
    { "space units", TRIP_NRRD_FIELDS },
    { "measurement frame", TRIP_NRRD_FIELDS }, /* for vectors and tensors only */
};

int trip_nrrd_fail(const trip_nrrd_parser *p, int line, const char *why, ...)
{
    char where[4200], text[512];
    va_list args;
    va_start(args, why);
    vsnprintf(text, sizeof text, why, args);
    va_end(args);
    snprintf(where, sizeof where, line ? "%s: line %d" : "%s", p->path, line);
    return trip_fail(TRIP_ERROR, "read", where, "%s", text);
}

void trip_nrrd_warn_unknown(const trip_nrrd_parser *p, int line, const char *stage,
                            const char *text)
{
    char where[4200];
    snprintf(where, sizeof where, "%s: line %d", p->path, line);
    trip_warn(where, "unknown %s \"%.40s\" is ignored", stage, text);
}

char *trip_nrrd_next_line(trip_nrrd_parser *p)
{
    if (p->next >= p->end)
        return NULL;
    char *line = p->next, *stop = memchr(line, '\n', (size_t)(p->end - line));
    p->next = stop ? stop + 1 : p->end;
    if (!stop)
        stop = p->end;
    *stop = '\0';
    if (stop > line && stop[-1] == '\r')
        stop[-1] = '\0';
    p->line++;
    return line;
}

char *trip_nrrd_trim(char *text)
{
    while (isspace((unsigned char)*text))
        text++;
    char *end = text + strlen(text);
    while (end > text && isspace((unsigned char)end[-1]))
        end--;
    *end = '\0';
    return text;
}

/* Keeps the key "coordinates N:=x0 x1 ...", which gives the positions of the samples of axis N.
 * Headers have no field for them. Ignores all other keys. */
static int keep_key(trip_nrrd_parser *p, char *line, char *colon)
{
    static const char key[] = "coordinates ";
    char *number = line + sizeof key - 1;
    *colon = '\0';
    if (strncmp(line, key, sizeof key - 1) != 0)
        return 0;
    int64_t axis;
    if (!trip_nrrd_parse_integer(&number, &axis) || *number || axis < 0 ||
        axis >= TRIP_NRRD_AXES_MAX)
        return trip_nrrd_fail(
            p, p->line, "\"%.40s\" names no axis: use \"coordinates N\" with N from 0 to 15", line);
    if (p->coordinates[axis])
        return trip_nrrd_fail(p, p->line, "\"%s\" is given twice", line);
    p->coordinates[axis] = trip_nrrd_trim(colon + 2);
    p->coordinate_lines[axis] = p->line;
    return 0;
}

/* Keeps the value of one "field: value" line. */
static int keep_field(trip_nrrd_parser *p, char *line)
{
    char *colon = strchr(line, ':');
    if (!colon)
        return trip_nrrd_fail(p, p->line, "\"%.40s\" is neither \"field: value\" nor a comment",
                              line);
    if (colon[1] == '=')
        return keep_key(p, line, colon);
    *colon = '\0';
    char *name = trip_nrrd_trim(line);
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++) {
        trip_nrrd_field f = names[i].field;
        if (strcasecmp(name, names[i].name) != 0)
            continue;
        if (f == TRIP_NRRD_FIELDS)
            return 0;
        if (p->values[f])
            return trip_nrrd_fail(p, p->line, "\"%s\" is given twice", name);
        p->values[f] = trip_nrrd_trim(colon + 1);
        p->lines[f] = p->line;
        return 0;
    }
    trip_nrrd_warn_unknown(p, p->line, "field", name);
    return 0;
}

/* Reads the fields up to the blank line, the end of a detached header, or the names of a LIST. */
static int split_lines(trip_nrrd_parser *p, bool ends)
{
    char *line;
    while ((line = trip_nrrd_next_line(p)) && *line) {
        int status = *line == '#' ? 0 : keep_field(p, line);
        if (status < 0)
            return status;
        if (trip_nrrd_is_list(p->values[TRIP_NRRD_DATA_FILE]))
            return 0;
    }
    if (!line && !ends)
        return trip_nrrd_fail(p, p->line, "the header does not end within %zu bytes",
                              TRIP_NRRD_HEADER_BYTES_MAX);
    if (!line && !p->values[TRIP_NRRD_DATA_FILE])
        return trip_nrrd_fail(p, p->line, "the file ends within the header");
    return 0;
}

int trip_nrrd_require(const trip_nrrd_parser *p, trip_nrrd_field f, const char *name)
{
    if (p->values[f])
        return 0;
    trip_nrrd_fail(p, 0, "the header has no \"%s\"", name);
    return TRIP_ERROR;
}

bool trip_nrrd_parse_integer(char **text, int64_t *value)
{
    char *end;
    long long v = strtoll(*text, &end, 10);
    if (end == *text || (*end && !isspace((unsigned char)*end)))
        return false;
    *value = v;
    *text = end;
    return true;
}

bool trip_nrrd_parse_lone_integer(char *text, int64_t *value)
{
    return trip_nrrd_parse_integer(&text, value) && !*text;
}

char *trip_nrrd_next_word(char **text)
{
    char *word = *text + strspn(*text, " \t"), *end = word + strcspn(word, " \t");
    *text = *end ? end + 1 : end;
    *end = '\0';
    return word;
}

static int parse_encoding(const trip_nrrd_parser *p, trip_nrrd_header *h)
{
    static const struct {
        const char *name;
        trip_byte_encoding encoding;
        trip_text_form text;
    } known[] = { { "raw", TRIP_BYTES_PLAIN, TRIP_TEXT_NONE },
                  { "gzip", TRIP_BYTES_ZLIB, TRIP_TEXT_NONE },
                  { "gz", TRIP_BYTES_ZLIB, TRIP_TEXT_NONE },
                  { "bzip2", TRIP_BYTES_BZIP2, TRIP_TEXT_NONE },
                  { "bz2", TRIP_BYTES_BZIP2, TRIP_TEXT_NONE },
                  { "ascii", TRIP_BYTES_PLAIN, TRIP_TEXT_NUMBERS },
                  { "text", TRIP_BYTES_PLAIN, TRIP_TEXT_NUMBERS },
                  { "txt", TRIP_BYTES_PLAIN, TRIP_TEXT_NUMBERS },
                  { "hex", TRIP_BYTES_PLAIN, TRIP_TEXT_HEX } };
    int status = trip_nrrd_require(p, TRIP_NRRD_ENCODING, "encoding");
    if (status < 0)
        return status;
    for (size_t i = 0; i < sizeof known / sizeof known[0]; i++)
        if (strcasecmp(p->values[TRIP_NRRD_ENCODING], known[i].name) == 0) {
            h->encoding = known[i].encoding;
            h->text = known[i].text;
            return 0;
        }
    return trip_nrrd_fail(
        p, p->lines[TRIP_NRRD_ENCODING],
        "encoding \"%.40s\" is unknown; raw, ascii, hex, gzip and bzip2 can be read",
        p->values[TRIP_NRRD_ENCODING]);
}

static int parse_type(const trip_nrrd_parser *p, trip_nrrd_header *h)
{
    int status = trip_nrrd_require(p, TRIP_NRRD_TYPE, "type");
    if (status < 0)
        return status;
    int type = trip_scalar_from_name(p->values[TRIP_NRRD_TYPE]);
    if (type < 0)
        return trip_nrrd_fail(p, p->lines[TRIP_NRRD_TYPE], "type \"%.40s\" is not a scalar type",
                              p->values[TRIP_NRRD_TYPE]);
    h->type = (trip_scalar)type;
    return 0;
}

static int parse_endian(const trip_nrrd_parser *p, trip_nrrd_header *h)
{
    if (h->type == TRIP_F16 && h->text == TRIP_TEXT_NUMBERS)
        return trip_nrrd_fail(p, p->lines[TRIP_NRRD_TYPE],
                              "values of the type half cannot be numbers in a text");
    if (trip_scalar_bytes(h->type) == 1 || h->text == TRIP_TEXT_NUMBERS) {
        h->big_endian = trip_machine_is_big_endian();
        return 0;
    }
    int status = trip_nrrd_require(p, TRIP_NRRD_ENDIAN, "endian");
    if (status < 0)
        return status;
    h->big_endian = strcasecmp(p->values[TRIP_NRRD_ENDIAN], "big") == 0;
    if (!h->big_endian && strcasecmp(p->values[TRIP_NRRD_ENDIAN], "little") != 0)
        return trip_nrrd_fail(p, p->lines[TRIP_NRRD_ENDIAN],
                              "\"endian\" must be \"little\" or \"big\"");
    return 0;
}

static int parse_skips(const trip_nrrd_parser *p, trip_nrrd_header *h)
{
    if (p->values[TRIP_NRRD_LINE_SKIP] &&
        (!trip_nrrd_parse_lone_integer(p->values[TRIP_NRRD_LINE_SKIP], &h->line_skip) ||
         h->line_skip < 0))
        return trip_nrrd_fail(p, p->lines[TRIP_NRRD_LINE_SKIP],
                              "\"line skip\" must be a number of at least 0");
    if (p->values[TRIP_NRRD_BYTE_SKIP] &&
        (!trip_nrrd_parse_lone_integer(p->values[TRIP_NRRD_BYTE_SKIP], &h->byte_skip) ||
         h->byte_skip < -1))
        return trip_nrrd_fail(p, p->lines[TRIP_NRRD_BYTE_SKIP],
                              "\"byte skip\" must be a number of at least -1");
    if (h->byte_skip < 0 && (h->encoding != TRIP_BYTES_PLAIN || h->text))
        return trip_nrrd_fail(p, p->lines[TRIP_NRRD_BYTE_SKIP],
                              "\"byte skip: -1\" cannot be used with %s data",
                              h->text ? "text" : "compressed");
    return 0;
}

static int parse(trip_nrrd_parser *p, trip_nrrd_header *h, bool ends)
{
    int status;
    const char *magic = trip_nrrd_next_line(p);
    if (!magic || strncmp(magic, "NRRD000", 7) != 0 || magic[7] < '1' || magic[7] > '5' || magic[8])
        return trip_nrrd_fail(p, 0, "is not an NRRD file of version 1 to 5");
    if ((status = split_lines(p, ends)) < 0 || (status = trip_nrrd_parse_axes(p, h)) < 0 ||
        (status = parse_type(p, h)) < 0 || (status = parse_encoding(p, h)) < 0 ||
        (status = parse_endian(p, h)) < 0 || (status = parse_skips(p, h)) < 0 ||
        (status = trip_nrrd_parse_geometry(p, h)) < 0)
        return status;
    return trip_nrrd_parse_files(p, h, ends);
}

int trip_nrrd_header_parse(trip_nrrd_header *h, const char *path, char *text, size_t bytes,
                           bool ends)
{
    trip_nrrd_parser p = { .path = path, .next = text, .end = text + bytes };
    *h = (trip_nrrd_header){ 0 };
    int status = parse(&p, h, ends);
    h->header_bytes = (size_t)(p.next - text);
    if (status < 0)
        trip_nrrd_header_free(h);
    return status;
}

void trip_nrrd_header_free(trip_nrrd_header *h)
{
    for (size_t i = 0; i < h->file_count; i++)
        free(h->files[i]);
    free(h->files);
    for (int a = 0; a < 3; a++)
        free(h->coordinates[a]);
    *h = (trip_nrrd_header){ 0 };
}
