#include "ply_header.h"

#include <ctype.h>
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "report.h"

enum { HEADER_BYTES = 1 << 20 };

static const struct {
    const char *name;
    trip_scalar type;
} types[] = {
    { "char", TRIP_I8 },   { "int8", TRIP_I8 },     { "uchar", TRIP_U8 },   { "uint8", TRIP_U8 },
    { "short", TRIP_I16 }, { "int16", TRIP_I16 },   { "ushort", TRIP_U16 }, { "uint16", TRIP_U16 },
    { "int", TRIP_I32 },   { "int32", TRIP_I32 },   { "uint", TRIP_U32 },   { "uint32", TRIP_U32 },
    { "float", TRIP_F32 }, { "float32", TRIP_F32 }, { "double", TRIP_F64 }, { "float64", TRIP_F64 },
};

typedef struct parser {
    trip_ply_header *h;
    const char *path;
    long line;
} parser;

#define FAULT(...) trip_fail_line("read", p->path, p->line, __VA_ARGS__)

static bool type_of(const char *name, trip_scalar *out)
{
    for (size_t i = 0; i < sizeof types / sizeof *types; i++)
        if (!strcmp(types[i].name, name)) {
            *out = types[i].type;
            return true;
        }
    return false;
}

/* Cuts the next word off a line. Returns "" at the end. */
static char *next_word(char **line)
{
    char *at = *line + strspn(*line, " \t");
    char *end = at + strcspn(at, " \t");
    *line = *end ? end + 1 : end;
    *end = 0;
    return at;
}

static int parse_format(parser *p, char *line)
{
    const char *form = next_word(&line);
    const bool here_big = __BYTE_ORDER__ == __ORDER_BIG_ENDIAN__;
    p->h->text = !strcmp(form, "ascii");
    const bool big = !strcmp(form, "binary_big_endian");
    if (!p->h->text && !big && strcmp(form, "binary_little_endian") != 0)
        return FAULT("unknown format of PLY: %.40s; ascii, binary_little_endian and "
                     "binary_big_endian are read",
                     form);
    p->h->swap = !p->h->text && big != here_big;
    return 0;
}

static int parse_element(parser *p, char *line)
{
    trip_ply_header *h = p->h;
    const char *name = next_word(&line), *count = next_word(&line);
    if (h->element_count == TRIP_PLY_ELEMENTS_MAX)
        return FAULT("more than %d elements", TRIP_PLY_ELEMENTS_MAX);
    trip_ply_element *e = &h->elements[h->element_count];
    *e = (trip_ply_element){ .first = h->property_count };
    snprintf(e->name, sizeof e->name, "%s", name);
    const size_t digits = strspn(count, "0123456789");
    if (!*name || digits == 0 || count[digits] || digits > 18)
        return FAULT("invalid count of the element %.40s: %.40s", name, count);
    e->count = strtoull(count, NULL, 10);
    if (trip_ply_element_of(h, e->name))
        return FAULT("the element %.40s is stated twice", name);
    h->element_count++;
    return 0;
}

static int parse_property(parser *p, char *line)
{
    trip_ply_header *h = p->h;
    const char *type = next_word(&line);
    if (h->element_count == 0)
        return FAULT("a property before the first element");
    if (h->property_count == TRIP_PLY_PROPERTIES_MAX)
        return FAULT("more than %d properties", TRIP_PLY_PROPERTIES_MAX);
    trip_ply_element *e = &h->elements[h->element_count - 1];
    trip_ply_property *made = &h->properties[h->property_count];
    *made = (trip_ply_property){ .offset = e->row_bytes, .list = !strcmp(type, "list") };
    if (made->list) {
        const char *count = next_word(&line);
        if (!type_of(count, &made->count_type) || made->count_type >= TRIP_F16)
            return FAULT("unknown type of the length of a list: %.40s", count);
        type = next_word(&line);
    }
    if (!type_of(type, &made->stated_type))
        return FAULT("unknown type of a property: %.40s", type);
    made->type = h->text ? TRIP_F64 : made->stated_type;
    snprintf(made->name, sizeof made->name, "%s", next_word(&line));
    if (!*made->name)
        return FAULT("a property without a name");
    if (trip_ply_property_of(h, e, made->name) && strlen(made->name) < sizeof made->name - 1)
        return FAULT("the property %s is stated twice", made->name);
    e->row_bytes += made->list ? 0 : trip_scalar_bytes(made->type);
    e->lists = e->lists || made->list;
    e->properties++;
    h->property_count++;
    return 0;
}

/* Sets the axis that points up. A lone "y" is the default text of some trainers, also for captures
 * that have y down, so it tells nothing. */
static void parse_up(trip_ply_header *h, const char *text)
{
    static const char *const names[] = { "x", "-x", "y", "-y", "z", "-z" };
    double v[3];
    if (sscanf(text, "%lf %lf %lf", &v[0], &v[1], &v[2]) == 3) {
        int axis = 0;
        for (int a = 1; a < 3; a++)
            axis = fabs(v[a]) > fabs(v[axis]) ? a : axis;
        if (fabs(v[axis]) > 0)
            snprintf(h->up, sizeof h->up, "%s", names[2 * axis + (v[axis] < 0)]);
        return;
    }
    for (size_t i = 0; i < sizeof names / sizeof *names; i++)
        if (!strcasecmp(text, names[i]) && i != 2)
            snprintf(h->up, sizeof h->up, "%s", names[i]);
}

static const char *after(const char *text, const char *key)
{
    const size_t n = strlen(key);
    return strncasecmp(text, key, n) ? NULL : text + n + strspn(text + n, " \t");
}

static void parse_comment(trip_ply_header *h, char *text)
{
    const char *value;
    text += strspn(text, " \t");
    for (size_t n = strlen(text); n > 0 && strchr(" \t", text[n - 1]); n--)
        text[n - 1] = 0;
    const size_t used = strlen(h->comments);
    snprintf(h->comments + used, sizeof h->comments - used, "%s%s", used && *text ? "; " : "",
             text);
    if ((value = after(text, "SplatRenderMode:"))) { /* Brush */
        h->antialiased = !strcasecmp(value, "mip");
    } else if ((value = after(text, "antialiased "))) { /* Postshot */
        h->antialiased = *value == '1';
    } else if ((value = after(text, "vertical axis:"))) { /* Nerfstudio, Brush */
        parse_up(h, value);
    }
}

/* Parses a line. Sets *end after the last one. */
static int parse_line(parser *p, char *line, bool *end)
{
    char *rest = line;
    const char *word = next_word(&rest);
    if (!strcmp(word, "format"))
        return parse_format(p, rest);
    if (!strcmp(word, "element"))
        return parse_element(p, rest);
    if (!strcmp(word, "property"))
        return parse_property(p, rest);
    *end = !strcmp(word, "end_header");
    if (!strcmp(word, "comment") || !strcmp(word, "obj_info"))
        parse_comment(p->h, rest);
    else if (!*end && *word && strcmp(word, "ply") != 0)
        return FAULT("unknown line in the header of a PLY: %.40s", word);
    return 0;
}

static int parse(parser *p, char *text, size_t bytes)
{
    const bool old = bytes > 4 && text[3] == '\r' && text[4] != '\n'; /* lines end with CR */
    char *at = text;
    bool end = false;
    while (!end) {
        char *stop = memchr(at, old ? '\r' : '\n', bytes - (size_t)(at - text));
        p->line++;
        if (!stop)
            return bytes < HEADER_BYTES ? FAULT("the header has no end; is the file truncated?")
                                        : FAULT("the header is longer than %d bytes", HEADER_BYTES);
        *stop = 0;
        if (stop > at && stop[-1] == '\r')
            stop[-1] = 0;
        int status = parse_line(p, at, &end);
        if (status < 0)
            return status;
        at = stop + 1;
    }
    p->h->bytes = (uint64_t)(at - text);
    return 0;
}

int trip_ply_header_read(trip_ply_header *h, const char *path)
{
    parser p = { .h = h, .path = path };
    size_t bytes = 0;
    *h = (trip_ply_header){ .antialiased = -1 };
    h->properties = calloc(TRIP_PLY_PROPERTIES_MAX, sizeof *h->properties);
    char *text = malloc(HEADER_BYTES + 1);
    int status = h->properties && text ? 0 : trip_fail(TRIP_ERROR, "read", path, "out of memory");
    if (status == 0)
        status = trip_byte_stream_head(path, text, HEADER_BYTES, false, &bytes);
    if (status == 0) {
        text[bytes] = 0;
        status = parse(&p, text, bytes);
    }
    free(text);
    return status;
}

void trip_ply_header_release(trip_ply_header *h)
{
    free(h->properties);
    h->properties = NULL;
}

const trip_ply_element *trip_ply_element_of(const trip_ply_header *h, const char *name)
{
    for (uint32_t i = 0; i < h->element_count; i++)
        if (!strcmp(h->elements[i].name, name))
            return &h->elements[i];
    return NULL;
}

const trip_ply_property *trip_ply_property_of(const trip_ply_header *h, const trip_ply_element *e,
                                              const char *name)
{
    for (uint32_t i = 0; i < e->properties; i++)
        if (!strcmp(h->properties[e->first + i].name, name))
            return &h->properties[e->first + i];
    return NULL;
}

/* ---- rows ---- */

/* Reads through the file from the end of the header. */
typedef struct walk {
    const trip_ply_header *h;
    const char *path;
    trip_byte_stream *stream;
    unsigned char bytes[1 << 14];
    size_t used, have;
    uint64_t at; /* in the decompressed file */
} walk;

/* Takes up to `bytes` bytes. Sets *part_out to their number, and *from to their place. */
static int take_some(walk *w, uint64_t bytes, const unsigned char **from, size_t *part_out)
{
    if (w->used == w->have) {
        w->used = 0;
        int status = trip_byte_stream_read_some(w->stream, w->bytes, sizeof w->bytes, &w->have);
        if (status == 0 && w->have == 0)
            status = trip_fail(TRIP_ERROR, "read", w->path,
                               "ends before its vertices; is it truncated?");
        if (status < 0)
            return status;
    }
    const size_t left = w->have - w->used;
    *part_out = bytes < left ? (size_t)bytes : left;
    *from = w->bytes + w->used;
    w->used += *part_out;
    w->at += *part_out;
    return 0;
}

/* Skips bytes, or copies them if `to` is not NULL. */
static int pass_bytes(walk *w, uint64_t bytes, unsigned char *to)
{
    while (bytes > 0) {
        const unsigned char *from;
        size_t part;
        const int status = take_some(w, bytes, &from, &part);
        if (status < 0)
            return status;
        for (size_t i = 0; i < part && to; i++)
            *to++ = from[i];
        bytes -= part;
    }
    return 0;
}

/* Skips a list: its length, then its values. */
static int pass_list(walk *w, const trip_ply_property *p)
{
    unsigned char count[8];
    const trip_ply_property length = { .type = p->count_type };
    int status = pass_bytes(w, trip_scalar_bytes(p->count_type), count);
    if (status < 0)
        return status;
    const double values = trip_ply_value(w->h, &length, count);
    if (values < 0)
        return trip_fail(TRIP_ERROR, "read", w->path, "a list has the length %.0f", values);
    return pass_bytes(w, (uint64_t)values * trip_scalar_bytes(p->type), NULL);
}

/* Each row of a text is a line with a number or more. The line ends in one or two characters. */
static int pass_line(walk *w)
{
    for (bool begun = false;;) {
        const unsigned char *from;
        size_t part;
        const int status = take_some(w, 1, &from, &part);
        if (status < 0)
            return status;
        const bool end = *from == '\n' || *from == '\r';
        if (end && begun)
            return 0;
        begun = begun || !end;
    }
}

static int pass_element(walk *w, const trip_ply_element *e)
{
    int status = 0;
    if (!e->lists && !w->h->text) {
        uint64_t bytes;
        if (__builtin_mul_overflow(e->count, (uint64_t)e->row_bytes, &bytes))
            bytes = UINT64_MAX; /* beyond the end of the file */
        return pass_bytes(w, bytes, NULL);
    }
    for (uint64_t row = 0; row < e->count && status == 0; row++) {
        if (w->h->text)
            status = pass_line(w);
        for (uint32_t i = 0; i < e->properties && status == 0 && !w->h->text; i++) {
            const trip_ply_property *p = &w->h->properties[e->first + i];
            status = p->list ? pass_list(w, p) : pass_bytes(w, trip_scalar_bytes(p->type), NULL);
        }
    }
    return status;
}

/* Finds the first row of an element behind others that hold lists. */
static int find_rows(const trip_ply_header *h, const trip_ply_element *e, const char *path,
                     uint64_t *at)
{
    const trip_byte_source source = { .path = path,
                                      .encoding = trip_byte_encoding_of(path),
                                      .skip_bytes = h->bytes,
                                      .warned = true };
    walk *w = calloc(1, sizeof *w);
    if (!w)
        return trip_fail(TRIP_ERROR, "read", path, "out of memory");
    w->h = h;
    w->path = path;
    w->at = h->bytes;
    int status = trip_byte_stream_open(&w->stream, &source);
    for (const trip_ply_element *i = h->elements; i < e && status == 0; i++)
        status = pass_element(w, i);
    *at = w->at;
    trip_byte_stream_close(w->stream);
    free(w);
    return status;
}

static bool lists_before(const trip_ply_header *h, const trip_ply_element *e)
{
    for (const trip_ply_element *i = h->elements; i < e; i++)
        if (i->lists)
            return true;
    return false;
}

/* Returns the bytes of the rows before an element without lists before it, as in memory. Returns
 * UINT64_MAX for a number that no file has. */
static uint64_t bytes_before(const trip_ply_header *h, const trip_ply_element *e)
{
    uint64_t before = 0, size;
    for (const trip_ply_element *i = h->elements; i < e; i++) {
        if (__builtin_mul_overflow(i->count, (uint64_t)i->row_bytes, &size) ||
            __builtin_add_overflow(before, size, &before) || before > (uint64_t)1 << 60)
            return UINT64_MAX;
    }
    return before;
}

int trip_ply_stream_open(trip_byte_stream **out, const trip_ply_header *h,
                         const trip_ply_element *e, const char *path)
{
    const bool far = lists_before(h, e);
    const uint64_t before = far ? 0 : bytes_before(h, e);
    uint64_t size = 0, at = h->bytes;
    if (e->lists)
        return trip_fail(TRIP_ERROR, "read", path,
                         "the element %s holds a list; its rows need one length", e->name);
    if (before == UINT64_MAX || __builtin_mul_overflow(e->count, (uint64_t)e->row_bytes, &size) ||
        size > (uint64_t)1 << 60)
        return trip_fail(TRIP_ERROR, "read", path,
                         "states %" PRIu64 " rows of %" PRIu32 " bytes; is its header damaged?",
                         e->count, e->row_bytes);
    int status = far ? find_rows(h, e, path, &at) : 0;
    trip_byte_source source = {
        .path = path,
        .encoding = trip_byte_encoding_of(path),
        .skip_bytes = at,
        .size_bytes = size,
        .warned = e + 1 < h->elements + h->element_count,
    };
    if (h->text) {
        source.text = TRIP_TEXT_NUMBERS;
        source.text_type = TRIP_F64;
        source.size_bytes += before;
    } else {
        source.skip_bytes += before;
    }
    if (status == 0)
        status = trip_byte_stream_open(out, &source);
    return status == 0 && h->text ? trip_byte_stream_skip(*out, before) : status;
}

int trip_ply_stream_rewind(trip_byte_stream *s, const trip_ply_header *h, const trip_ply_element *e)
{
    const int status = trip_byte_stream_rewind(s);
    const uint64_t before = lists_before(h, e) ? 0 : bytes_before(h, e);
    return status == 0 && h->text ? trip_byte_stream_skip(s, before) : status;
}

double trip_ply_value(const trip_ply_header *h, const trip_ply_property *p,
                      const unsigned char *row)
{
    const unsigned bytes = trip_scalar_bytes(p->type);
    unsigned char b[8];
    for (unsigned i = 0; i < bytes; i++)
        b[i] = row[p->offset + (h->swap ? bytes - 1 - i : i)];
    union {
        int8_t i8;
        int16_t i16;
        int32_t i32;
        uint16_t u16;
        uint32_t u32;
        float f32;
        double f64;
    } v;
    memcpy(&v, b, bytes);
    switch (p->type) {
    case TRIP_I8:
        return v.i8;
    case TRIP_U8:
        return b[0];
    case TRIP_I16:
        return v.i16;
    case TRIP_U16:
        return v.u16;
    case TRIP_I32:
        return v.i32;
    case TRIP_U32:
        return v.u32;
    case TRIP_F32:
        return v.f32;
    default:
        return v.f64;
    }
}
