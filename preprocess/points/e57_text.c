#include "e57_text.h"

#include <expat.h>
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "report.h"
#include "text.h"

enum {
    DEPTH_MAX = 64,
    NAME_BYTES = 48,
    VALUE_BYTES = 256,
    PIECE_BYTES = 1 << 16,
    SCANS_MAX = 1 << 14,
    TEXT_BYTES_MAX = 1 << 28,
};

static const char *const field_names[TRIP_E57_FIELDS] = {
    [TRIP_E57_X] = "cartesianX",
    [TRIP_E57_Y] = "cartesianY",
    [TRIP_E57_Z] = "cartesianZ",
    [TRIP_E57_RANGE] = "sphericalRange",
    [TRIP_E57_AZIMUTH] = "sphericalAzimuth",
    [TRIP_E57_ELEVATION] = "sphericalElevation",
    [TRIP_E57_NORMAL_X] = "normalX",
    [TRIP_E57_NORMAL_Y] = "normalY",
    [TRIP_E57_NORMAL_Z] = "normalZ",
    [TRIP_E57_RED] = "colorRed",
    [TRIP_E57_GREEN] = "colorGreen",
    [TRIP_E57_BLUE] = "colorBlue",
    [TRIP_E57_INTENSITY] = "intensity",
    [TRIP_E57_RETURN_INDEX] = "returnIndex",
    [TRIP_E57_RETURN_COUNT] = "returnCount",
    [TRIP_E57_TIME] = "timeStamp",
    [TRIP_E57_CLASSIFICATION] = "classification",
    [TRIP_E57_INVALID_POSITION] = "cartesianInvalidState",
    [TRIP_E57_INVALID_DIRECTION] = "sphericalInvalidState",
    [TRIP_E57_INVALID_COLOUR] = "isColorInvalid",
    [TRIP_E57_INVALID_INTENSITY] = "isIntensityInvalid",
};

typedef struct reader {
    trip_e57_text *t;
    const char *path;
    XML_Parser parser;
    int status;
    int depth;
    char names[DEPTH_MAX][NAME_BYTES]; /* of the open elements, without a prefix */
    char value[VALUE_BYTES];           /* of the innermost element */
    size_t value_bytes;
} reader;

static void stop(reader *r, int status)
{
    if (r->status == 0)
        r->status = status;
    XML_StopParser(r->parser, XML_FALSE);
}

#define FAULT(...)                                                                                 \
    trip_fail_line("read", r->path, (long)XML_GetCurrentLineNumber(r->parser), __VA_ARGS__)

/* Returns whether the innermost elements have these names, from `depth` on. */
static bool is_at(const reader *r, int depth, const char *a, const char *b)
{
    return r->depth == depth + (b ? 2 : 1) && !strcmp(r->names[depth], a) &&
           (!b || !strcmp(r->names[depth + 1], b));
}

/* Returns the scan that is open, or NULL. */
static trip_e57_scan *open_scan(const reader *r)
{
    const bool inside = r->depth > 2 && !strcmp(r->names[1], "data3D") &&
                        !strcmp(r->names[2], "vectorChild") && r->t->count > 0;
    return inside ? &r->t->scans[r->t->count - 1] : NULL;
}

static const char *attribute(const char **attributes, const char *name)
{
    for (; *attributes; attributes += 2)
        if (!strcmp(attributes[0], name))
            return attributes[1];
    return NULL;
}

static int whole_at(reader *r, const char **attributes, const char *name, int64_t missing,
                    int64_t *out)
{
    const char *text = attribute(attributes, name);
    char *end = NULL;
    *out = text ? strtoll(text, &end, 10) : missing;
    return !text || (end != text && !*end) ? 0 : FAULT("%s is no whole number: %.40s", name, text);
}

static int number_at(reader *r, const char **attributes, const char *name, double missing,
                     double *out)
{
    const char *text = attribute(attributes, name);
    *out = missing;
    return !text || trip_text_to_double(text, out) ? 0
                                                   : FAULT("%s is no number: %.40s", name, text);
}

static int add_scan(reader *r)
{
    trip_e57_text *t = r->t;
    if (t->count == SCANS_MAX)
        return FAULT("more than %d scans", SCANS_MAX);
    if (t->count == t->room) {
        const uint32_t room = t->room ? 2 * t->room : 4;
        trip_e57_scan *scans = realloc(t->scans, room * sizeof *scans);
        if (!scans)
            return trip_fail(TRIP_ERROR, "read", r->path, "out of memory");
        t->scans = scans;
        t->room = room;
    }
    trip_e57_scan *s = &t->scans[t->count++];
    *s = (trip_e57_scan){ .rotation = { 1 } };
    for (int a = 0; a < 3; a++)
        s->bounds[a][0] = s->bounds[a][1] = NAN;
    return 0;
}

static int parse_points(reader *r, trip_e57_scan *s, const char **attributes)
{
    int64_t offset = 0, count = 0;
    int status = whole_at(r, attributes, "fileOffset", -1, &offset);
    if (status == 0)
        status = whole_at(r, attributes, "recordCount", -1, &count);
    if (status == 0 && (offset < 0 || count < 0 || count > (int64_t)1 << 50))
        status = FAULT("the points of a scan lack a valid fileOffset or recordCount");
    s->file_offset = (uint64_t)offset;
    s->count = (uint64_t)count;
    return status;
}

/* Integers have as many bits as the difference of their limits needs. */
static int parse_integer(reader *r, trip_e57_storage *s, const char **attributes)
{
    int status = whole_at(r, attributes, "minimum", INT64_MIN, &s->minimum);
    if (status == 0)
        status = whole_at(r, attributes, "maximum", INT64_MAX, &s->maximum);
    if (status == 0)
        status = number_at(r, attributes, "scale", 1, &s->scale);
    if (status == 0)
        status = number_at(r, attributes, "offset", 0, &s->offset);
    if (status == 0 && s->minimum > s->maximum)
        status = FAULT("a field has the limits %" PRId64 " to %" PRId64, s->minimum, s->maximum);
    const uint64_t most = (uint64_t)s->maximum - (uint64_t)s->minimum;
    s->bits = most ? 64 - (unsigned)__builtin_clzll(most) : 0;
    s->form = TRIP_E57_INTEGER;
    return status;
}

static int parse_field(reader *r, trip_e57_scan *scan, const char *name, const char **attributes)
{
    const char *type = attribute(attributes, "type");
    const char *precision = attribute(attributes, "precision");
    trip_e57_storage s = { .exists = true, .stream = scan->streams++, .scale = 1 };
    int field = 0, status = 0;
    while (field < TRIP_E57_FIELDS && strcmp(name, field_names[field]) != 0)
        field++;
    if (field == TRIP_E57_FIELDS) {
        const size_t used = strlen(r->t->extras);
        if (r->t->count == 1)
            snprintf(r->t->extras + used, sizeof r->t->extras - used, "%s%s", used ? ", " : "",
                     name);
        return 0;
    }
    if (type && !strcmp(type, "Float")) {
        s.form = precision && !strcmp(precision, "single") ? TRIP_E57_FLOAT : TRIP_E57_DOUBLE;
        s.bits = s.form == TRIP_E57_FLOAT ? 32 : 64;
    } else if (type && (!strcmp(type, "Integer") || !strcmp(type, "ScaledInteger"))) {
        status = parse_integer(r, &s, attributes);
    } else {
        status = FAULT("the field %s has the type %.40s; Float, Integer and ScaledInteger are read",
                       name, type ? type : "-");
    }
    scan->fields[field] = s;
    return status;
}

static void XMLCALL on_start(void *user, const char *full_name, const char **attributes)
{
    reader *r = user;
    const char *colon = strrchr(full_name, ':');
    const char *name = colon ? colon + 1 : full_name;
    int status = 0;
    if (r->depth == DEPTH_MAX) {
        stop(r, FAULT("more than %d elements inside each other", DEPTH_MAX));
        return;
    }
    snprintf(r->names[r->depth++], NAME_BYTES, "%s", name);
    r->value_bytes = 0;
    if (r->depth == 3 && !strcmp(r->names[1], "data3D"))
        status = add_scan(r);
    trip_e57_scan *s = open_scan(r);
    if (s && is_at(r, 3, "points", NULL))
        status = parse_points(r, s, attributes);
    else if (s && is_at(r, 3, "pose", NULL))
        s->posed = true;
    else if (s && r->depth == 6 && !strcmp(r->names[3], "points") &&
             !strcmp(r->names[4], "prototype"))
        status = parse_field(r, s, name, attributes);
    if (status < 0)
        stop(r, status);
}

static void XMLCALL on_text(void *user, const char *text, int bytes)
{
    reader *r = user;
    const size_t room = VALUE_BYTES - 1 - r->value_bytes;
    const size_t part = (size_t)bytes < room ? (size_t)bytes : room;
    memcpy(r->value + r->value_bytes, text, part);
    r->value_bytes += part;
}

/* Finds the number that an element of a scan sets, or returns NULL. */
static double *number_of(const reader *r, trip_e57_scan *s)
{
    static const char *const rotation[] = { "w", "x", "y", "z" };
    static const struct {
        const char *group, *low, *high;
    } ranges[] = {
        { "colorLimits", "colorRedMinimum", "colorRedMaximum" },
        { "colorLimits", "colorGreenMinimum", "colorGreenMaximum" },
        { "colorLimits", "colorBlueMinimum", "colorBlueMaximum" },
        { "intensityLimits", "intensityMinimum", "intensityMaximum" },
        { "indexBounds", "rowMinimum", "rowMaximum" },
        { "indexBounds", "columnMinimum", "columnMaximum" },
        { "cartesianBounds", "xMinimum", "xMaximum" },
        { "cartesianBounds", "yMinimum", "yMaximum" },
        { "cartesianBounds", "zMinimum", "zMaximum" },
    };
    double *const to[] = { s->colour_limits[0], s->colour_limits[1], s->colour_limits[2],
                           s->intensity_limits, s->index_bounds[0],  s->index_bounds[1],
                           s->bounds[0],        s->bounds[1],        s->bounds[2] };
    for (int i = 0; i < 4 && r->depth == 6; i++) {
        if (!strcmp(r->names[3], "pose") && !strcmp(r->names[4], "rotation") &&
            !strcmp(r->names[5], rotation[i]))
            return &s->rotation[i];
        if (i > 0 && !strcmp(r->names[3], "pose") && !strcmp(r->names[4], "translation") &&
            !strcmp(r->names[5], rotation[i]))
            return &s->translation[i - 1];
    }
    for (size_t i = 0; i < sizeof ranges / sizeof *ranges; i++) {
        if (is_at(r, 3, ranges[i].group, ranges[i].low))
            return &to[i][0];
        if (is_at(r, 3, ranges[i].group, ranges[i].high))
            return &to[i][1];
    }
    return NULL;
}

/* Adds a name of the scanner, or of the program that wrote the file. */
static void keep_comment(reader *r)
{
    const bool first = r->t->count == 1 && open_scan(r);
    const bool wanted =
        (first && (is_at(r, 3, "sensorVendor", NULL) || is_at(r, 3, "sensorModel", NULL))) ||
        is_at(r, 1, "e57LibraryVersion", NULL);
    const size_t used = strlen(r->t->comments);
    if (wanted && *r->value)
        snprintf(r->t->comments + used, sizeof r->t->comments - used, "%s%s", used ? "; " : "",
                 r->value);
}

static void XMLCALL on_end(void *user, const char *name)
{
    reader *r = user;
    trip_e57_scan *s = open_scan(r);
    double *to = s ? number_of(r, s) : NULL;
    r->value[r->value_bytes] = 0;
    char *text = r->value + strspn(r->value, " \t\r\n");
    for (size_t n = strlen(text); n > 0 && strchr(" \t\r\n", text[n - 1]); n--)
        text[n - 1] = 0;
    (void)name;
    if (to) {
        *to = 0; /* an empty element is 0 */
        if (*text && !trip_text_to_double(text, to))
            stop(r, FAULT("%s is no number: %.40s", r->names[r->depth - 1], text));
    }
    keep_comment(r);
    r->value_bytes = 0;
    r->depth--;
}

/* A document type may define entities, which E57 does not have. */
static void XMLCALL on_doctype(void *user, const char *name, const char *system, const char *public,
                               int has_subset)
{
    reader *r = user;
    (void)name, (void)system, (void)public, (void)has_subset;
    stop(r, FAULT("holds a document type, which E57 does not have"));
}

static int parse_piece(reader *r, const char *piece, size_t bytes, bool last)
{
    if (XML_Parse(r->parser, piece, (int)bytes, last) != XML_STATUS_ERROR || r->status < 0)
        return r->status;
    return FAULT("its XML is damaged: %s", XML_ErrorString(XML_GetErrorCode(r->parser)));
}

static int parse(reader *r, trip_e57_pages *pages)
{
    const uint64_t at = trip_e57_pages_text_at(pages), all = trip_e57_pages_text_bytes(pages);
    const uint64_t end = trip_e57_pages_bytes(pages);
    if (at > end || all > end - at || all > TEXT_BYTES_MAX)
        return trip_fail(TRIP_ERROR, "read", r->path,
                         "its XML lies outside of the file; is it damaged or truncated?");
    char *piece = malloc(PIECE_BYTES);
    int status = piece ? 0 : trip_fail(TRIP_ERROR, "read", r->path, "out of memory");
    for (uint64_t done = 0; done < all && status == 0;) {
        const size_t bytes = all - done < PIECE_BYTES ? (size_t)(all - done) : PIECE_BYTES;
        status = trip_e57_pages_read(pages, piece, bytes, at + done);
        done += bytes;
        if (status == 0)
            status = parse_piece(r, piece, bytes, done == all);
    }
    free(piece);
    return status;
}

int trip_e57_text_read(trip_e57_text *t, trip_e57_pages *pages, const char *path)
{
    *t = (trip_e57_text){ 0 };
    reader *r = calloc(1, sizeof *r);
    if (r) {
        r->t = t;
        r->path = path;
        r->parser = XML_ParserCreate(NULL);
    }
    int status = r && r->parser ? 0 : trip_fail(TRIP_ERROR, "read", path, "out of memory");
    if (status == 0) {
        XML_SetUserData(r->parser, r);
        XML_SetElementHandler(r->parser, on_start, on_end);
        XML_SetCharacterDataHandler(r->parser, on_text);
        XML_SetStartDoctypeDeclHandler(r->parser, on_doctype);
        status = parse(r, pages);
    }
    if (r && r->parser)
        XML_ParserFree(r->parser);
    free(r);
    return status;
}

void trip_e57_text_release(trip_e57_text *t)
{
    free(t->scans);
    t->scans = NULL;
}
