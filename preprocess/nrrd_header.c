/* Our own, because teem's parser leaks on malformed headers and keeps its errors in one global
 * buffer. */
#include "nrrd_header.h"

#include <ctype.h>
#include <inttypes.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "report.h"

#define AXES_MAX 16
#define FILES_MAX 65536

enum field {
    DIMENSION,
    SIZES,
    TYPE,
    ENDIAN,
    ENCODING,
    SPACINGS,
    MINS,
    MAXS,
    CENTERS,
    DIRECTIONS,
    ORIGIN,
    SPACE,
    KINDS,
    LINE_SKIP,
    BYTE_SKIP,
    DATA_FILE,
    FIELDS
};

static const struct {
    const char *name;
    enum field field; /* FIELDS: known, of no use here */
} names[] = {
    { "dimension", DIMENSION },
    { "sizes", SIZES },
    { "type", TYPE },
    { "endian", ENDIAN },
    { "encoding", ENCODING },
    { "spacings", SPACINGS },
    { "space directions", DIRECTIONS },
    { "space origin", ORIGIN },
    { "kinds", KINDS },
    { "line skip", LINE_SKIP },
    { "lineskip", LINE_SKIP },
    { "byte skip", BYTE_SKIP },
    { "byteskip", BYTE_SKIP },
    { "data file", DATA_FILE },
    { "datafile", DATA_FILE },
    { "content", FIELDS },
    { "number", FIELDS },
    { "block size", FIELDS },
    { "blocksize", FIELDS },
    { "sample units", FIELDS },
    { "sampleunits", FIELDS },
    { "min", FIELDS },
    { "max", FIELDS },
    { "old min", FIELDS },
    { "oldmin", FIELDS },
    { "old max", FIELDS },
    { "oldmax", FIELDS },
    { "thicknesses", FIELDS },
    { "axis mins", MINS },
    { "axismins", MINS },
    { "axis maxs", MAXS },
    { "axismaxs", MAXS },
    { "centers", CENTERS },
    { "centerings", CENTERS },
    { "labels", FIELDS },
    { "units", FIELDS },
    { "space", SPACE },
    { "space dimension", FIELDS }, /* the vectors show it */
    { "space units", FIELDS },
    { "measurement frame", FIELDS }, /* of vectors and tensors; scalars have none */
};

/* The lines of a header while it is taken apart. */
typedef struct parser {
    const char *path;
    char *next, *end;
    int line;
    char *values[FIELDS]; /* text after "field:", NULL where absent */
    int lines[FIELDS];
    int axes;
    int kept[3]; /* axes that are the volume's i, j, k */
} parser;

__attribute__((format(printf, 3, 4))) static int fail_line(const parser *p, int line,
                                                           const char *why, ...)
{
    char where[4200], text[512];
    va_list args;
    va_start(args, why);
    vsnprintf(text, sizeof text, why, args);
    va_end(args);
    snprintf(where, sizeof where, line ? "%s: line %d" : "%s", p->path, line);
    return trip_fail(TRIP_ERROR, "read", where, "%s", text);
}

/* The next line without its end, NULL after the last. */
static char *next_line(parser *p)
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

static char *trim(char *text)
{
    while (isspace((unsigned char)*text))
        text++;
    char *end = text + strlen(text);
    while (end > text && isspace((unsigned char)end[-1]))
        end--;
    *end = '\0';
    return text;
}

/* Keeps the value of one "field: value" line. */
static int keep_field(parser *p, char *line)
{
    char *colon = strchr(line, ':');
    if (!colon)
        return fail_line(p, p->line, "\"%.40s\" is neither \"field: value\" nor a comment", line);
    if (colon[1] == '=') /* a key and value of the user's */
        return 0;
    *colon = '\0';
    char *name = trim(line);
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++) {
        enum field f = names[i].field;
        if (strcasecmp(name, names[i].name) != 0)
            continue;
        if (f == FIELDS)
            return 0;
        if (p->values[f])
            return fail_line(p, p->line, "\"%s\" is given twice", name);
        p->values[f] = trim(colon + 1);
        p->lines[f] = p->line;
        return 0;
    }
    char where[4200];
    snprintf(where, sizeof where, "%s: line %d", p->path, p->line);
    trip_warn(where, "unknown field \"%.40s\" is ignored", name);
    return 0;
}

static bool is_list(const char *data_file)
{
    return data_file && strncmp(data_file, "LIST", 4) == 0 &&
           (!data_file[4] || isspace((unsigned char)data_file[4]));
}

/* Up to the blank line, the end of a detached header, or the names of a LIST. */
static int split_lines(parser *p, bool ends)
{
    char *line;
    while ((line = next_line(p)) && *line) {
        int status = *line == '#' ? 0 : keep_field(p, line);
        if (status < 0)
            return status;
        if (is_list(p->values[DATA_FILE]))
            return 0;
    }
    if (!line && !ends)
        return fail_line(p, p->line, "the header does not end within %zu bytes",
                         TRIP_NRRD_HEADER_BYTES_MAX);
    if (!line && !p->values[DATA_FILE])
        return fail_line(p, p->line, "the file ends within the header");
    return 0;
}

static int require(const parser *p, enum field f, const char *name)
{
    if (p->values[f])
        return 0;
    fail_line(p, 0, "the header has no \"%s\"", name);
    return TRIP_ERROR;
}

static bool parse_integer(char **text, int64_t *value)
{
    char *end;
    long long v = strtoll(*text, &end, 10);
    if (end == *text || (*end && !isspace((unsigned char)*end)))
        return false;
    *value = v;
    *text = end;
    return true;
}

static bool parse_lone_integer(char *text, int64_t *value)
{
    return parse_integer(&text, value) && !*text;
}

/* Cuts the next word off. */
static char *next_word(char **text)
{
    char *word = *text + strspn(*text, " \t"), *end = word + strcspn(word, " \t");
    *text = *end ? end + 1 : end;
    *end = '\0';
    return word;
}

/* Axes that carry no position in space cannot be one of the volume's. */
static bool is_spatial_kind(const char *kind)
{
    static const char *const spatial[] = { "domain", "space", "time", "list",
                                           "scalar", "stub",  "none", "???" };
    for (size_t i = 0; i < sizeof spatial / sizeof spatial[0]; i++)
        if (strcasecmp(kind, spatial[i]) == 0)
            return true;
    return false;
}

static int check_kinds(const parser *p)
{
    char *text = p->values[KINDS];
    if (!text)
        return 0;
    for (int axis = 0; axis < p->axes; axis++) {
        const char *kind = next_word(&text);
        bool kept = axis == p->kept[0] || axis == p->kept[1] || axis == p->kept[2];
        if (kept && *kind && !is_spatial_kind(kind))
            return fail_line(p, p->lines[KINDS],
                             "axis %d is of kind \"%.40s\": only scalar volumes can be read", axis,
                             kind);
    }
    return 0;
}

/* Which three axes are the volume's: all, or those left when axes of size 1 are dropped, from the
 * slowest and then from the fastest on. */
static int choose_axes(parser *p, const int64_t sizes[AXES_MAX])
{
    int first = 0, last = p->axes;
    while (last - first > 3 && sizes[last - 1] == 1)
        last--;
    while (last - first > 3 && sizes[first] == 1)
        first++;
    if (last - first != 3)
        return fail_line(p, p->lines[SIZES],
                         "%d axes: only scalar volumes of three axes can be read", p->axes);
    for (int a = 0; a < 3; a++)
        p->kept[a] = first + a;
    return 0;
}

static int parse_sizes(parser *p, trip_nrrd_header *h)
{
    int64_t axes, sizes[AXES_MAX];
    int status = require(p, DIMENSION, "dimension");
    if (status < 0 || (status = require(p, SIZES, "sizes")) < 0)
        return status;
    if (!parse_lone_integer(p->values[DIMENSION], &axes) || axes < 1 || axes > AXES_MAX)
        return fail_line(p, p->lines[DIMENSION], "\"dimension\" must be a number from 1 to %d",
                         AXES_MAX);
    p->axes = (int)axes;
    char *text = p->values[SIZES];
    for (int a = 0; a < p->axes; a++)
        if (!parse_integer(&text, &sizes[a]) || sizes[a] < 1)
            return fail_line(p, p->lines[SIZES], "\"sizes\" must be %d numbers of at least 1",
                             p->axes);
    if (*trim(text))
        return fail_line(p, p->lines[SIZES], "\"sizes\" has more than %d numbers", p->axes);
    if ((status = choose_axes(p, sizes)) < 0)
        return status;
    for (int a = 0; a < 3; a++)
        h->dims[a] = sizes[p->kept[a]];
    return check_kinds(p);
}

static int parse_encoding(const parser *p, trip_nrrd_header *h)
{
    static const struct {
        const char *name;
        trip_byte_encoding encoding;
    } known[] = { { "raw", TRIP_BYTES_PLAIN },
                  { "gzip", TRIP_BYTES_ZLIB },
                  { "gz", TRIP_BYTES_ZLIB },
                  { "bzip2", TRIP_BYTES_BZIP2 },
                  { "bz2", TRIP_BYTES_BZIP2 } };
    int status = require(p, ENCODING, "encoding");
    if (status < 0)
        return status;
    for (size_t i = 0; i < sizeof known / sizeof known[0]; i++)
        if (strcasecmp(p->values[ENCODING], known[i].name) == 0) {
            h->encoding = known[i].encoding;
            return 0;
        }
    return fail_line(p, p->lines[ENCODING],
                     "encoding \"%.40s\" cannot be read; raw, gzip and bzip2 can: convert it, for "
                     "example with \"unu save -e gzip\"",
                     p->values[ENCODING]);
}

static int parse_type(const parser *p, trip_nrrd_header *h)
{
    int status = require(p, TYPE, "type");
    if (status < 0)
        return status;
    int type = trip_scalar_from_name(p->values[TYPE]);
    if (type < 0)
        return fail_line(p, p->lines[TYPE], "type \"%.40s\" is not a scalar type", p->values[TYPE]);
    h->type = (trip_scalar)type;
    if (trip_scalar_bytes(h->type) == 1)
        return 0;
    if ((status = require(p, ENDIAN, "endian")) < 0)
        return status;
    h->big_endian = strcasecmp(p->values[ENDIAN], "big") == 0;
    if (!h->big_endian && strcasecmp(p->values[ENDIAN], "little") != 0)
        return fail_line(p, p->lines[ENDIAN], "\"endian\" must be \"little\" or \"big\"");
    return 0;
}

static int parse_skips(const parser *p, trip_nrrd_header *h)
{
    if (p->values[LINE_SKIP] &&
        (!parse_lone_integer(p->values[LINE_SKIP], &h->line_skip) || h->line_skip < 0))
        return fail_line(p, p->lines[LINE_SKIP], "\"line skip\" must be a number of at least 0");
    if (p->values[BYTE_SKIP] &&
        (!parse_lone_integer(p->values[BYTE_SKIP], &h->byte_skip) || h->byte_skip < -1))
        return fail_line(p, p->lines[BYTE_SKIP], "\"byte skip\" must be a number of at least -1");
    if (h->byte_skip < 0 && h->encoding != TRIP_BYTES_PLAIN)
        return fail_line(p, p->lines[BYTE_SKIP],
                         "\"byte skip: -1\" has no meaning for compressed data");
    return 0;
}

/* What the header's `space` says of the axes of world space. */
typedef struct space {
    const char *name;       /* without what separates its words */
    const char *convention; /* as in anatomy.h, when it is right-handed */
    bool left_handed;
    bool has_time; /* vectors have a fourth part */
} space;

static const space spaces[] = {
    { "rightanteriorsuperior", "RAS", false, false },
    { "RAS", "RAS", false, false },
    { "leftposteriorsuperior", "LPS", false, false },
    { "LPS", "LPS", false, false },
    { "leftanteriorsuperior", "RAS", true, false },
    { "LAS", "RAS", true, false },
    { "scannerxyz", "", false, false },
    { "3Drighthanded", "", false, false },
    { "3Dlefthanded", "", true, false },
};

/* `text` in one of its spellings: words apart or together, in any case, with "time" or "t" after
 * them. NULL as name where the header has none that is known. */
static space find_space(const parser *p)
{
    char name[64] = "";
    size_t length = 0;
    const char *text = p->values[SPACE] ? p->values[SPACE] : "";
    for (; *text && length + 1 < sizeof name; text++)
        if (!strchr("- _", *text))
            name[length++] = *text;
    for (size_t i = 0; i < sizeof spaces / sizeof spaces[0] && !*text; i++) {
        space s = spaces[i];
        const char *rest = name + strlen(s.name);
        if (strncasecmp(name, s.name, strlen(s.name)) != 0)
            continue;
        s.has_time = strcasecmp(rest, "time") == 0 || strcasecmp(rest, "t") == 0;
        if (!*rest || s.has_time)
            return s;
    }
    if (p->values[SPACE]) {
        char where[4200];
        snprintf(where, sizeof where, "%s: line %d", p->path, p->lines[SPACE]);
        trip_warn(where, "unknown space \"%.40s\" is ignored", p->values[SPACE]);
    }
    return (space){ 0 };
}

/* "(x,y,z)", or "(x,y,z,t)" where the space has time, into v. */
static bool parse_vector(char **text, const space *s, double v[4])
{
    char *at = *text + strspn(*text, " \t");
    v[3] = 0;
    for (int i = 0; i < (s->has_time ? 4 : 3); i++) {
        if (*at != "(,,,"[i])
            return false;
        char *end, *number = at + 1;
        v[i] = strtod(number, &end);
        if (end == number)
            return false;
        at = end + strspn(end, " \t");
    }
    if (*at != ')')
        return false;
    *text = at + 1;
    return true;
}

static int parse_directions(const parser *p, const space *s, trip_nrrd_header *h)
{
    char *text = p->values[DIRECTIONS];
    for (int axis = 0; axis < p->axes; axis++) {
        double v[4];
        text += strspn(text, " \t");
        bool none = strncasecmp(text, "none", 4) == 0;
        if (none)
            text += 4;
        else if (!parse_vector(&text, s, v))
            return fail_line(p, p->lines[DIRECTIONS],
                             "\"space directions\" must be \"(x,y,z%s)\" or \"none\" for each of "
                             "%d axes",
                             s->has_time ? ",t" : "", p->axes);
        for (int a = 0; a < 3; a++) {
            if (axis == p->kept[a] && none)
                return fail_line(p, p->lines[DIRECTIONS],
                                 "axis %d has no direction in space: only scalar volumes can be "
                                 "read",
                                 axis);
            if (axis == p->kept[a] && v[3] != 0)
                return fail_line(p, p->lines[DIRECTIONS],
                                 "axis %d goes through time: only volumes of one time can be read",
                                 axis);
            for (int row = 0; axis == p->kept[a] && row < 3; row++)
                h->index_to_world.m[row][a] = v[row];
        }
    }
    return 0;
}

/* One number for each axis; NaN, which means unknown, where the field is absent. */
static int parse_numbers(const parser *p, enum field f, const char *name, double v[AXES_MAX])
{
    char *text = p->values[f];
    for (int axis = 0; axis < p->axes; axis++) {
        v[axis] = NAN;
        if (!text)
            continue;
        char *end, *word = next_word(&text);
        v[axis] = strtod(word, &end);
        if (end == word || *end)
            return fail_line(p, p->lines[f], "\"%s\" must be %d numbers", name, p->axes);
    }
    return 0;
}

/* Whether samples are at the ends of their axis ("node") rather than in the middle of its cells,
 * which is the default. */
static void parse_centers(const parser *p, bool node[AXES_MAX])
{
    char *text = p->values[CENTERS];
    for (int axis = 0; axis < p->axes; axis++)
        node[axis] = text && strcasecmp(next_word(&text), "node") == 0;
}

/* Spacings, or the extents that stand for them. */
static int parse_spacings(const parser *p, trip_nrrd_header *h)
{
    double spacing[AXES_MAX], min[AXES_MAX], max[AXES_MAX];
    bool node[AXES_MAX];
    int status;
    if ((status = parse_numbers(p, SPACINGS, "spacings", spacing)) < 0 ||
        (status = parse_numbers(p, MINS, "axis mins", min)) < 0 ||
        (status = parse_numbers(p, MAXS, "axis maxs", max)) < 0)
        return status;
    parse_centers(p, node);
    for (int a = 0; a < 3; a++) {
        int axis = p->kept[a];
        int64_t steps = h->dims[a] - node[axis];
        double step = spacing[axis];
        if (isnan(step))
            step = steps > 0 ? (max[axis] - min[axis]) / (double)steps : 1;
        if (isnan(step))
            step = 1;
        h->index_to_world.m[a][a] = step;
        h->index_to_world.m[a][3] = isnan(min[axis]) ? 0 : min[axis] + (node[axis] ? 0 : step / 2);
    }
    return 0;
}

/* World space is right-handed: x of a left-handed one is counted the other way. */
static void take_space(trip_nrrd_header *h, const space *s)
{
    snprintf(h->space, sizeof h->space, "%s", s->name ? s->convention : "");
    for (int column = 0; column < 4 && s->left_handed; column++)
        h->index_to_world.m[0][column] = 0 - h->index_to_world.m[0][column];
}

static int parse_geometry(const parser *p, trip_nrrd_header *h)
{
    double origin[4];
    char *text = p->values[ORIGIN];
    const space s = find_space(p);
    h->index_to_world = trip_affine_identity();
    h->oriented = s.name || p->values[DIRECTIONS];
    int status = p->values[DIRECTIONS] ? parse_directions(p, &s, h) : parse_spacings(p, h);
    if (status < 0)
        return status;
    if (text && (!parse_vector(&text, &s, origin) || *text))
        return fail_line(p, p->lines[ORIGIN], "\"space origin\" must be \"(x,y,z%s)\"",
                         s.has_time ? ",t" : "");
    for (int row = 0; row < 3 && p->values[ORIGIN]; row++)
        h->index_to_world.m[row][3] = origin[row];
    take_space(h, &s);
    return 0;
}

static int add_file(const parser *p, trip_nrrd_header *h, const char *name)
{
    if (h->file_count == FILES_MAX)
        return fail_line(p, p->lines[DATA_FILE], "more than %d data files", FILES_MAX);
    if ((h->file_count & (h->file_count - 1)) == 0) { /* full at each power of two */
        size_t room = h->file_count ? 2 * h->file_count : 1;
        char **files = realloc(h->files, room * sizeof *files);
        if (!files)
            return fail_line(p, 0, "no memory for the names of its data files");
        h->files = files;
    }
    if (!(h->files[h->file_count] = strdup(name)))
        return fail_line(p, 0, "no memory for the names of its data files");
    h->file_count++;
    return 0;
}

static int parse_list(parser *p, trip_nrrd_header *h, bool ends)
{
    char *line;
    int status = 0;
    while (status == 0 && (line = next_line(p)))
        if (*(line = trim(line)))
            status = add_file(p, h, line);
    if (status == 0 && !ends)
        return fail_line(p, p->line, "the list of data files does not end within %zu bytes",
                         TRIP_NRRD_HEADER_BYTES_MAX);
    if (status == 0 && h->file_count == 0)
        return fail_line(p, p->lines[DATA_FILE], "the list of data files is empty");
    return status;
}

/* Splits "abc%03d.raw" into "abc", width 3 padded with '0', ".raw"; only %d is taken, once, since
 * the pattern comes from outside. */
static bool split_pattern(char *pattern, int *width, bool *zeros, char **tail)
{
    char *at = strchr(pattern, '%');
    if (!at)
        return false;
    *at++ = '\0';
    *zeros = *at == '0';
    int64_t w = 0;
    while (isdigit((unsigned char)*at) && w < 100)
        w = 10 * w + (*at++ - '0');
    if (*at != 'd' || w > 20 || strchr(at, '%'))
        return false;
    *width = (int)w;
    *tail = at + 1;
    return true;
}

/* "PATTERN min max step [axes in each file]" */
static int parse_pattern(const parser *p, trip_nrrd_header *h)
{
    char *text = p->values[DATA_FILE], *pattern = next_word(&text), *tail, name[4096];
    int64_t from, to, step, each = p->axes - 1;
    int width, status = 0;
    bool zeros;
    if (!split_pattern(pattern, &width, &zeros, &tail) || !parse_integer(&text, &from) ||
        !parse_integer(&text, &to) || !parse_integer(&text, &step) || step == 0 ||
        llabs(from) > INT32_MAX || llabs(to) > INT32_MAX || llabs(step) > INT32_MAX ||
        (*trim(text) && !parse_integer(&text, &each)) || *text)
        return fail_line(p, p->lines[DATA_FILE],
                         "\"data file\" with a %% must be \"name%%03d.raw first last step\"");
    for (int64_t i = from; status == 0 && (step > 0 ? i <= to : i >= to); i += step) {
        int n = zeros ? snprintf(name, sizeof name, "%s%0*" PRId64 "%s", pattern, width, i, tail)
                      : snprintf(name, sizeof name, "%s%*" PRId64 "%s", pattern, width, i, tail);
        if (n >= (int)sizeof name)
            return fail_line(p, p->lines[DATA_FILE], "the names of the data files are too long");
        status = add_file(p, h, name);
    }
    if (status == 0 && h->file_count == 0)
        return fail_line(p, p->lines[DATA_FILE], "\"data file\" counts no files");
    return status;
}

static int parse_data_file(parser *p, trip_nrrd_header *h, bool ends)
{
    char *text = p->values[DATA_FILE];
    if (!text)
        return 0;
    if (!*text)
        return fail_line(p, p->lines[DATA_FILE], "\"data file\" is empty");
    if (is_list(text))
        return parse_list(p, h, ends);
    return strchr(text, '%') ? parse_pattern(p, h) : add_file(p, h, text);
}

/* Each file holds the same share, and no value is cut in two. */
static int check_share(const parser *p, const trip_nrrd_header *h)
{
    int64_t values = 1;
    for (int a = 0; a < 3; a++)
        if (__builtin_mul_overflow(values, h->dims[a], &values))
            return fail_line(p, p->lines[SIZES], "the sizes are impossibly large");
    if (h->file_count > 1 && values % (int64_t)h->file_count != 0)
        return fail_line(p, p->lines[DATA_FILE],
                         "%" PRId64 " values cannot be shared out evenly to %zu data files", values,
                         h->file_count);
    return 0;
}

static int parse(parser *p, trip_nrrd_header *h, bool ends)
{
    int status;
    const char *magic = next_line(p);
    if (!magic || strncmp(magic, "NRRD000", 7) != 0 || magic[7] < '1' || magic[7] > '5' || magic[8])
        return fail_line(p, 0, "is not an NRRD file of version 1 to 5");
    if ((status = split_lines(p, ends)) < 0 || (status = parse_sizes(p, h)) < 0 ||
        (status = parse_type(p, h)) < 0 || (status = parse_encoding(p, h)) < 0 ||
        (status = parse_skips(p, h)) < 0 || (status = parse_geometry(p, h)) < 0 ||
        (status = parse_data_file(p, h, ends)) < 0)
        return status;
    return check_share(p, h);
}

int trip_nrrd_header_parse(trip_nrrd_header *h, const char *path, char *text, size_t bytes,
                           bool ends)
{
    parser p = { .path = path, .next = text, .end = text + bytes };
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
    *h = (trip_nrrd_header){ 0 };
}
