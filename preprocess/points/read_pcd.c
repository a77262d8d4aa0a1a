/* Reads clouds of points in PCD (Point Cloud Library): text, binary, and binary compressed by LZF,
 * also organised ones. A compressed file holds the values of each field together. So the reader has
 * a stream for each field that it uses. */
#include "point_file_internal.h"

#include <fcntl.h>
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <unistd.h>

#include "byte_stream.h"
#include "little_endian.h"
#include "lzf_stream.h"
#include "point_fields.h"
#include "read_at.h"
#include "report.h"
#include "text_lines.h"

enum {
    COLUMNS_MAX = TRIP_TEXT_COLUMNS_MAX,
    ROW_BYTES_MAX = 1 << 20,
    HEADER_LINES_MAX = 100,
    BUFFER_BYTES = 1 << 18,
    BATCH = 4096,             /* points of a compressed file */
    PACKED = TRIP_FIELDS + 1, /* a colour in 32 bits */
};

typedef enum form { FORM_TEXT, FORM_BINARY, FORM_COMPRESSED } form;

typedef struct column {
    char name[32];
    char type; /* I, U or F */
    uint32_t bytes, count;
    uint32_t field; /* a trip_point_field, PACKED, or TRIP_FIELDS */
    uint64_t at;    /* bytes of a row before it */
    uint32_t word;  /* words of a text row before it */
    trip_lzf_stream *start, *stream;
    unsigned char *values;
} column;

typedef struct pcd {
    form form;
    unsigned column_count;
    column columns[COLUMNS_MAX];
    uint64_t width, height, count, row_bytes;
    uint32_t words;
    bool counted; /* the header states the number of points */
    double view[7];
    uint64_t data_at;
    long data_line;
    uint64_t done;
    float colour_unit;
    trip_text_lines *lines;
    trip_byte_stream *stream;
    int fd;
    unsigned char *rows;
    size_t room; /* rows that fit */
} pcd;

static bool probe(const trip_point_head *head)
{
    const char *text = (const char *)head->bytes;
    const bool marked = head->count >= 8 && memcmp(text, "# .PCD v", 8) == 0;
    return marked ||
           (head->count >= 8 && memcmp(text, "VERSION ", 8) == 0 &&
            memmem(text, head->count, "\nFIELDS ", 8) && memmem(text, head->count, "\nDATA ", 6));
}

/* ---- header ---- */

#define FAULT(...) trip_fail_line("read", f->path, line, __VA_ARGS__)

/* Splits the words after a key. Each column gets one. */
static int set_columns(trip_point_file *f, long line, const char *key, char **words, unsigned count)
{
    pcd *p = f->state;
    if (!strcmp(key, "FIELDS")) {
        p->column_count = count;
        for (unsigned i = 0; i < count; i++)
            p->columns[i].count = 1;
    }
    if (count != p->column_count)
        return FAULT("%s has %u values, but FIELDS names %u", key, count, p->column_count);
    for (unsigned i = 0; i < count; i++) {
        column *c = &p->columns[i];
        double number = 0;
        const bool counted = !strcmp(key, "SIZE") || !strcmp(key, "COUNT");
        if (counted && (!trip_text_number(words[i], &number) || number != floor(number) ||
                        number < 0 || number > 1e6))
            return FAULT("%s of the field %s is no such number: %.40s", key, c->name, words[i]);
        if (!strcmp(key, "FIELDS"))
            snprintf(c->name, sizeof c->name, "%s", words[i]);
        else if (!strcmp(key, "SIZE"))
            c->bytes = (uint32_t)number;
        else if (!strcmp(key, "COUNT"))
            c->count = (uint32_t)number;
        else
            c->type = words[i][0];
    }
    return 0;
}

static int set_number(trip_point_file *f, long line, const char *key, char **words, unsigned count,
                      uint64_t *out)
{
    double number = 0;
    if (count != 1 || !trip_text_number(words[0], &number) || !(number >= 0) || number > 1e15 ||
        number != floor(number))
        return FAULT("%s is no whole number: %.40s", key, count ? words[0] : "");
    *out = (uint64_t)number;
    return 0;
}

static int set_view(trip_point_file *f, long line, char **words, unsigned count)
{
    pcd *p = f->state;
    for (unsigned i = 0; i < 7; i++)
        if (count != 7 || !trip_text_number(words[i], &p->view[i]) || !isfinite(p->view[i]))
            return FAULT("VIEWPOINT needs seven finite numbers");
    return 0;
}

static int set_form(trip_point_file *f, long line, char **words, unsigned count)
{
    static const char *const names[] = { "ascii", "binary", "binary_compressed" };
    pcd *p = f->state;
    for (unsigned i = 0; i < sizeof names / sizeof *names && count == 1; i++)
        if (!strcasecmp(words[0], names[i])) {
            p->form = (form)i;
            return 0;
        }
    return FAULT("unknown DATA of PCD: %.40s; ascii, binary and binary_compressed are read",
                 count ? words[0] : "");
}

/* Parses a line. Sets *end after the last one. */
static int parse_line(trip_point_file *f, char *text, long line, bool *end)
{
    pcd *p = f->state;
    char *all[TRIP_TEXT_COLUMNS_MAX];
    if (*text == '#')
        return 0;
    const unsigned words = trip_text_split(text, all);
    if (words == 0)
        return 0;
    if (words == TRIP_TEXT_COLUMNS_MAX)
        return FAULT("%.40s has more than %d values", all[0], TRIP_TEXT_COLUMNS_MAX - 2);
    const char *key = all[0];
    char **rest = all + 1;
    const unsigned count = words - 1;
    if (!strcmp(key, "FIELDS") || !strcmp(key, "SIZE") || !strcmp(key, "TYPE") ||
        !strcmp(key, "COUNT"))
        return set_columns(f, line, key, rest, count);
    if (!strcmp(key, "COLUMNS")) /* of version 0.5 */
        return set_columns(f, line, "FIELDS", rest, count);
    if (!strcmp(key, "WIDTH"))
        return set_number(f, line, key, rest, count, &p->width);
    if (!strcmp(key, "HEIGHT"))
        return set_number(f, line, key, rest, count, &p->height);
    if (!strcmp(key, "POINTS")) {
        p->counted = true;
        return set_number(f, line, key, rest, count, &p->count);
    }
    if (!strcmp(key, "VIEWPOINT"))
        return set_view(f, line, rest, count);
    *end = !strcmp(key, "DATA");
    if (*end)
        return set_form(f, line, rest, count);
    return strcmp(key, "VERSION") ? FAULT("unknown line in the header of a PCD: %.40s", key) : 0;
}

/* Parses the header. The lines are also counted in bytes, to find the data. */
static int parse_header(trip_point_file *f)
{
    enum { HEAD_BYTES = 1 << 16 };
    pcd *p = f->state;
    size_t bytes = 0;
    long line = 0;
    bool end = false;
    char *text = malloc(HEAD_BYTES + 1);
    int status = text ? trip_byte_stream_head(f->path, text, HEAD_BYTES, false, &bytes)
                      : trip_point_no_memory(f);
    char *at = text;
    p->view[3] = 1;
    p->height = 1;
    while (status == 0 && !end) {
        char *stop = memchr(at, '\n', bytes - (size_t)(at - text));
        line++;
        if (!stop || line > HEADER_LINES_MAX) {
            status = FAULT("the header has no line DATA; is the file truncated?");
            break;
        }
        *stop = 0;
        if (stop > at && stop[-1] == '\r')
            stop[-1] = 0;
        status = parse_line(f, at, line, &end);
        at = stop + 1;
    }
    p->data_at = (uint64_t)(at - text);
    p->data_line = line;
    free(text);
    return status;
}

static bool type_is_known(const column *c)
{
    return c->type == 'F' ? c->bytes == 4 || c->bytes == 8
                          : (c->type == 'I' || c->type == 'U') &&
                                (c->bytes == 1 || c->bytes == 2 || c->bytes == 4 || c->bytes == 8);
}

static int check_columns(trip_point_file *f)
{
    pcd *p = f->state;
    unsigned found = 0;
    for (unsigned i = 0; i < p->column_count; i++) {
        column *c = &p->columns[i];
        const bool packed = !strcasecmp(c->name, "rgb") || !strcasecmp(c->name, "rgba");
        if (!type_is_known(c))
            return trip_fail(TRIP_ERROR, "read", f->path,
                             "has the field %s of type %c with %" PRIu32 " bytes; I and U of 1, 2, "
                             "4 and 8 bytes and F of 4 and 8 are read",
                             c->name, c->type ? c->type : '-', c->bytes);
        c->at = p->row_bytes;
        c->word = p->words;
        p->row_bytes += (uint64_t)c->bytes * c->count;
        p->words += c->count;
        c->field = packed && c->bytes == 4 ? PACKED : trip_point_field_of(c->name);
        if (c->count != 1 || (c->field < TRIP_FIELDS && found >> c->field & 1))
            c->field = TRIP_FIELDS;
        if (c->field == PACKED)
            found |= 7u << TRIP_FIELD_RED;
        else if (c->field < TRIP_FIELDS)
            found |= 1u << c->field;
        else if (strcmp(c->name, "_") != 0) /* padding */
            trip_point_add_extra(f, c->name);
    }
    if (p->row_bytes > ROW_BYTES_MAX)
        return trip_fail(TRIP_ERROR, "read", f->path,
                         "has points of %" PRIu64 " bytes; is its header damaged?", p->row_bytes);
    for (int a = 0; a < 3; a++)
        if (!(found >> (TRIP_FIELD_X + a) & 1))
            return trip_fail(TRIP_ERROR, "read", f->path,
                             "lacks the field %c, which a cloud of points needs", 'x' + a);
    f->info.attributes = trip_point_attributes_of(found);
    return 0;
}

/* The type of the colours tells their range. */
static void find_colours(trip_point_file *f)
{
    pcd *p = f->state;
    p->colour_unit = 255;
    for (unsigned i = 0; i < p->column_count; i++) {
        const column *c = &p->columns[i];
        if (c->field != TRIP_FIELD_RED || (c->type != 'F' && c->bytes == 1))
            continue;
        f->colour_form = c->type == 'F' ? TRIP_COLOUR_FLOAT : TRIP_COLOUR_SIXTEEN;
        p->colour_unit = 1;
    }
}

/* An organised cloud has a grid. Its scanner is at VIEWPOINT, as in any cloud that states one. */
static int find_scan(trip_point_file *f)
{
    const pcd *p = f->state;
    static const double none[7] = { 0, 0, 0, 1, 0, 0, 0 };
    const bool organised = p->height > 1;
    const bool posed = organised || memcmp(p->view, none, sizeof none) != 0;
    if (!posed)
        return 0;
    trip_point_scan *scan = trip_point_add_scan(f);
    if (!scan)
        return TRIP_ERROR;
    scan->posed = true;
    memcpy(scan->scanner, p->view, sizeof scan->scanner);
    scan->width = organised ? p->width : 0;
    scan->height = organised ? p->height : 0;
    f->info.attributes |= TRIP_POINT_SCAN;
    f->gaps = organised;
    return 0;
}

static int check_count(trip_point_file *f)
{
    pcd *p = f->state;
    uint64_t cells = 0;
    if (__builtin_mul_overflow(p->width, p->height, &cells) || cells > (uint64_t)1 << 50)
        return trip_fail(TRIP_ERROR, "read", f->path,
                         "states a grid of %" PRIu64 " x %" PRIu64 "; is its header damaged?",
                         p->width, p->height);
    if (p->counted && p->count != cells) {
        trip_point_note(f,
                        "the header states %" PRIu64 " points, but a grid of %" PRIu64 " x %" PRIu64
                        "; the grid is ignored",
                        p->count, p->width, p->height);
        p->height = 1;
    } else {
        p->count = cells;
    }
    return p->count ? 0 : trip_fail(TRIP_ERROR, "read", f->path, "holds no points");
}

/* ---- data ---- */

/* Finds the start of each field that is used. Streams that start later begin as copies. */
static int open_compressed(trip_point_file *f)
{
    pcd *p = f->state;
    unsigned char sizes[8];
    uint64_t file_bytes = 0;
    int status = trip_byte_stream_refuse_compressed(f->path, f->info.format);
    if (status == 0)
        status = trip_file_size(f->path, &file_bytes);
    if (status < 0)
        return status;
    p->fd = open(f->path, O_RDONLY | O_CLOEXEC);
    if (p->fd < 0)
        return trip_fail_errno("read", f->path, "cannot open");
    if (trip_read_at(p->fd, sizes, 8, 8, p->data_at) != 8)
        return trip_point_truncated(f);
    const uint64_t from = p->data_at + 8, packed = trip_le_u32(sizes);
    if (packed > file_bytes - from)
        return trip_point_truncated(f);
    if (trip_le_u32(sizes + 4) != p->count * p->row_bytes)
        return trip_fail(TRIP_ERROR, "read", f->path,
                         "holds %" PRIu32 " bytes of values, but %" PRIu64 " points need %" PRIu64
                         "; is it damaged?",
                         trip_le_u32(sizes + 4), p->count, p->count * p->row_bytes);
    trip_lzf_stream *walk = malloc(sizeof *walk);
    if (!walk)
        return trip_point_no_memory(f);
    trip_lzf_stream_begin(walk, f->path, p->fd, from, from + packed);
    for (unsigned i = 0; i < p->column_count && status == 0; i++) {
        column *c = &p->columns[i];
        const uint64_t begin = c->at * p->count;
        if (c->field == TRIP_FIELDS)
            continue;
        status = trip_lzf_stream_read(walk, NULL, begin - walk->all);
        c->start = malloc(sizeof *c->start);
        c->stream = malloc(sizeof *c->stream);
        c->values = malloc((size_t)BATCH * c->bytes * c->count);
        if (status == 0 && (!c->start || !c->stream || !c->values))
            status = trip_point_no_memory(f);
        if (status == 0)
            *c->start = *c->stream = *walk;
    }
    free(walk);
    p->room = BATCH;
    return status;
}

static int open_binary(trip_point_file *f)
{
    pcd *p = f->state;
    uint64_t bytes = 0;
    if (__builtin_mul_overflow(p->count, p->row_bytes, &bytes) || bytes > (uint64_t)1 << 60)
        return trip_fail(TRIP_ERROR, "read", f->path,
                         "states %" PRIu64 " points of %" PRIu64 " bytes; is its header damaged?",
                         p->count, p->row_bytes);
    const trip_byte_source source = { .path = f->path,
                                      .encoding = trip_byte_encoding_of(f->path),
                                      .skip_bytes = p->data_at,
                                      .size_bytes = bytes };
    p->room = BUFFER_BYTES / p->row_bytes + 1;
    if (!(p->rows = malloc(p->room * p->row_bytes)))
        return trip_point_no_memory(f);
    return trip_byte_stream_open(&p->stream, &source);
}

static int skip_header(trip_point_file *f)
{
    pcd *p = f->state;
    char *text = NULL;
    int status = trip_text_lines_rewind(p->lines);
    for (long i = 0; i < p->data_line && status == 0; i++)
        status = trip_text_lines_next(p->lines, &text);
    return status;
}

static int open_data(trip_point_file *f)
{
    pcd *p = f->state;
    if (p->form == FORM_COMPRESSED)
        return open_compressed(f);
    if (p->form == FORM_BINARY)
        return open_binary(f);
    const int status = trip_text_lines_open(&p->lines, f->path);
    return status < 0 ? status : skip_header(f);
}

static int open_pcd(trip_point_file *f)
{
    static const char *const forms[] = { "text", "binary", "compressed" };
    pcd *p = f->state = calloc(1, sizeof *p);
    if (!p)
        return trip_point_no_memory(f);
    p->fd = -1;
    snprintf(f->info.format, sizeof f->info.format, "PCD");
    int status = parse_header(f);
    if (status == 0)
        status = check_count(f);
    if (status == 0)
        status = check_columns(f);
    if (status == 0)
        status = find_scan(f);
    if (status < 0)
        return status;
    if (p->form == FORM_TEXT && p->words > TRIP_TEXT_COLUMNS_MAX)
        return trip_fail(TRIP_ERROR, "read", f->path,
                         "has %" PRIu32 " numbers a line; up to %d are read", p->words,
                         TRIP_TEXT_COLUMNS_MAX);
    snprintf(f->info.format, sizeof f->info.format, "PCD, %s", forms[p->form]);
    f->info.count = p->count;
    find_colours(f);
    return open_data(f);
}

/* Returns the value of a type at an address. */
static double value_at(const column *c, const unsigned char *v)
{
    uint64_t bits = 0;
    for (uint32_t i = 0; i < c->bytes; i++)
        bits |= (uint64_t)v[i] << 8 * i;
    if (c->type == 'F' && c->bytes == 4)
        return (double)trip_le_float(v);
    if (c->type == 'F') {
        double real;
        memcpy(&real, &bits, sizeof real);
        return real;
    }
    const unsigned free_bits = 64 - 8 * c->bytes;
    return c->type == 'U' ? (double)bits : (double)((int64_t)(bits << free_bits) >> free_bits);
}

static void set_packed(trip_point *out, uint32_t rgb)
{
    for (int c = 0; c < 3; c++)
        out->colour[c] = (float)(rgb >> (16 - 8 * c) & 255);
}

static void set_stored(const column *c, const unsigned char *v, trip_point *out)
{
    if (c->field == PACKED)
        set_packed(out, trip_le_u32(v));
    else
        trip_point_set(out, (trip_point_field)c->field, value_at(c, v));
}

/* A colour as text is the number that the same bits would be. */
static void set_text(const column *c, double value, trip_point *out)
{
    uint32_t bits;
    const float real = (float)value;
    if (c->field != PACKED) {
        trip_point_set(out, (trip_point_field)c->field, value);
        return;
    }
    memcpy(&bits, &real, sizeof bits);
    if (c->type == 'U')
        bits = value >= 0 && value <= UINT32_MAX ? (uint32_t)value : 0;
    else if (c->type == 'I')
        bits = fabs(value) <= INT32_MAX ? (uint32_t)(int32_t)value : 0;
    set_packed(out, bits);
}

static int read_text_row(trip_point_file *f, trip_point *out)
{
    const pcd *p = f->state;
    double values[TRIP_TEXT_COLUMNS_MAX];
    const char *wrong = NULL;
    char *text;
    do {
        const int status = trip_text_lines_next(p->lines, &text);
        if (status < 0)
            return status;
        if (!text)
            return trip_fail(TRIP_ERROR, "read", f->path,
                             "states %" PRIu64 " points, but holds %" PRIu64 "; is it truncated?",
                             p->count, p->done);
    } while (!text[strspn(text, " \t")]);
    const int count = trip_text_row(text, values, p->words, &wrong);
    const long line = trip_text_lines_number(p->lines);
    if (count < 0)
        return FAULT("\"%.40s\" is no number", wrong);
    if ((uint32_t)count < p->words)
        return FAULT("has %d numbers, but %" PRIu32 " are expected", count, p->words);
    for (unsigned i = 0; i < p->column_count; i++)
        if (p->columns[i].field != TRIP_FIELDS)
            set_text(&p->columns[i], values[p->columns[i].word], out);
    return 0;
}

static int read_planes(trip_point_file *f, trip_point *out, size_t count)
{
    const pcd *p = f->state;
    for (unsigned i = 0; i < p->column_count; i++) {
        const column *c = &p->columns[i];
        const uint64_t bytes = (uint64_t)c->bytes * c->count;
        if (!c->stream)
            continue;
        const int status = trip_lzf_stream_read(c->stream, c->values, count * bytes);
        if (status < 0)
            return status;
        for (size_t k = 0; k < count; k++)
            set_stored(c, c->values + k * bytes, &out[k]);
    }
    return 0;
}

static int read_rows(trip_point_file *f, trip_point *out, size_t count)
{
    pcd *p = f->state;
    if (p->form == FORM_TEXT) {
        for (size_t k = 0; k < count; k++) {
            const int status = read_text_row(f, &out[k]);
            if (status < 0)
                return status;
            p->done++;
        }
        return 0;
    }
    int status = p->form == FORM_COMPRESSED
                     ? read_planes(f, out, count)
                     : trip_byte_stream_read(p->stream, p->rows, count * p->row_bytes);
    if (status < 0)
        return status;
    p->done += count;
    for (size_t k = 0; k < count && p->form == FORM_BINARY; k++)
        for (unsigned i = 0; i < p->column_count; i++)
            if (p->columns[i].field != TRIP_FIELDS)
                set_stored(&p->columns[i], p->rows + k * p->row_bytes + p->columns[i].at, &out[k]);
    return 0;
}

static int read_pcd(trip_point_file *f, trip_point *out, size_t room, size_t *got_out)
{
    pcd *p = f->state;
    size_t count = p->room && p->room < room ? p->room : room;
    if (p->count - p->done < count)
        count = (size_t)(p->count - p->done);
    const int status = read_rows(f, out, count);
    for (size_t k = 0; k < count && status == 0; k++)
        for (int c = 0; c < 3; c++)
            out[k].colour[c] /= p->colour_unit;
    *got_out = count;
    return status;
}

static int rewind_pcd(trip_point_file *f)
{
    pcd *p = f->state;
    p->done = 0;
    for (unsigned i = 0; i < p->column_count; i++)
        if (p->columns[i].stream)
            *p->columns[i].stream = *p->columns[i].start;
    return p->lines ? skip_header(f) : p->stream ? trip_byte_stream_rewind(p->stream) : 0;
}

static void close_pcd(trip_point_file *f)
{
    pcd *p = f->state;
    if (!p)
        return;
    for (unsigned i = 0; i < COLUMNS_MAX; i++) {
        free(p->columns[i].start);
        free(p->columns[i].stream);
        free(p->columns[i].values);
    }
    trip_text_lines_close(p->lines);
    trip_byte_stream_close(p->stream);
    if (p->fd >= 0)
        close(p->fd);
    free(p->rows);
    free(p);
}

const trip_point_reader trip_read_pcd = { probe, open_pcd, read_pcd, rewind_pcd, close_pcd };
