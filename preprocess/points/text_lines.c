#include "text_lines.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "byte_stream.h"
#include "report.h"
#include "text.h"

enum { LINE_MAX_BYTES = 1 << 16, BUFFER_BYTES = 1 << 18 };

struct trip_text_lines {
    char *path;
    trip_byte_stream *stream;
    char *buffer; /* BUFFER_BYTES and a zero */
    size_t used, have;
    bool ended;
    long line;
};

int trip_text_lines_open(trip_text_lines **out, const char *path)
{
    trip_text_lines *l = *out = calloc(1, sizeof *l);
    if (l) {
        l->path = strdup(path);
        l->buffer = malloc(BUFFER_BYTES + 1);
    }
    if (!l || !l->path || !l->buffer)
        return trip_fail(TRIP_ERROR, "read", path, "out of memory");
    const trip_byte_source source = { .path = path,
                                      .encoding = trip_byte_encoding_of(path),
                                      .warned = true };
    return trip_byte_stream_open(&l->stream, &source);
}

void trip_text_lines_close(trip_text_lines *l)
{
    if (!l)
        return;
    trip_byte_stream_close(l->stream);
    free(l->path);
    free(l->buffer);
    free(l);
}

int trip_text_lines_rewind(trip_text_lines *l)
{
    l->used = l->have = 0;
    l->ended = false;
    l->line = 0;
    return trip_byte_stream_rewind(l->stream);
}

/* Moves the rest of the buffer to its begin and fills it up. */
static int fill(trip_text_lines *l)
{
    size_t got = 0;
    l->have -= l->used;
    memmove(l->buffer, l->buffer + l->used, l->have);
    l->used = 0;
    const size_t room = BUFFER_BYTES - l->have;
    const int status = trip_byte_stream_read_some(l->stream, l->buffer + l->have, room, &got);
    l->have += got;
    l->ended = got < room;
    return status;
}

static char *line_end(const trip_text_lines *l)
{
    char *from = l->buffer + l->used;
    const size_t bytes = l->have - l->used;
    char *end = memchr(from, '\n', bytes);
    char *old = memchr(from, '\r', end ? (size_t)(end - from) : bytes);
    /* A lone carriage return ends a line of an old Macintosh. It may lie before "\n" yet to come.
     */
    if (old && (old + 1 < from + bytes || l->ended) && !(old + 1 < from + bytes && old[1] == '\n'))
        return old;
    return end;
}

int trip_text_lines_next(trip_text_lines *l, char **line)
{
    *line = NULL;
    char *end = line_end(l);
    if (!end && !l->ended) {
        const int status = fill(l);
        if (status < 0)
            return status;
        end = line_end(l);
    }
    if (l->used == l->have)
        return 0;
    l->line++;
    char *begin = l->buffer + l->used;
    size_t bytes = end ? (size_t)(end - begin) : l->have - l->used;
    l->used += bytes + (end ? 1 : 0);
    if (bytes > 0 && begin[bytes - 1] == '\r')
        bytes--;
    begin[bytes] = 0;
    if (bytes > LINE_MAX_BYTES)
        return trip_fail_line("read", l->path, l->line, "the line is longer than %d bytes",
                              LINE_MAX_BYTES);
    if (strlen(begin) < bytes)
        return trip_fail_line("read", l->path, l->line, "holds a zero byte; is it a text?");
    *line = begin;
    return 0;
}

long trip_text_lines_number(const trip_text_lines *l)
{
    return l->line;
}

/* ---- words and numbers ---- */

#define GAPS " \t\v\f,;"

unsigned trip_text_split(char *line, char *words[TRIP_TEXT_COLUMNS_MAX])
{
    unsigned count = 0;
    for (char *at = line + strspn(line, GAPS); *at && count < TRIP_TEXT_COLUMNS_MAX;) {
        words[count++] = at;
        at += strcspn(at, GAPS);
        if (*at)
            *at++ = 0;
        at += strspn(at, GAPS);
    }
    return count;
}

/* Parses the usual decimal numbers exactly: up to 15 digits, and a power of ten up to 22. */
static bool parse_short(const char *word, double *out)
{
    static const double powers[] = { 1e0, 1e1, 1e2,  1e3,  1e4,  1e5,  1e6,  1e7,
                                     1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15 };
    const bool minus = *word == '-';
    uint64_t digits = 0;
    int count = 0, after = -1;
    for (const char *at = word + minus; *at; at++) {
        if (*at == '.' && after < 0) {
            after = 0;
            continue;
        }
        if (*at < '0' || *at > '9' || ++count > 15)
            return false;
        digits = 10 * digits + (uint64_t)(*at - '0');
        after += after >= 0;
    }
    const double value = (double)digits / powers[after > 0 ? after : 0];
    *out = minus ? -value : value;
    return count > 0;
}

bool trip_text_number(const char *word, double *out)
{
    if (parse_short(word, out) || trip_text_to_double(word, out))
        return true;
    const bool minus = *word == '-';
    const char *name = word + (minus || *word == '+');
    if (strcasecmp(name, "nan") == 0 || strcasecmp(name, "nan(ind)") == 0)
        *out = NAN;
    else if (strcasecmp(name, "inf") == 0 || strcasecmp(name, "infinity") == 0)
        *out = minus ? -INFINITY : INFINITY;
    else
        return false;
    return true;
}

int trip_text_row(char *line, double *values, unsigned room, const char **wrong)
{
    char *words[TRIP_TEXT_COLUMNS_MAX];
    const unsigned count = trip_text_split(line, words);
    for (unsigned i = 0; i < count && i < room; i++)
        if (!trip_text_number(words[i], &values[i])) {
            *wrong = words[i];
            return -1;
        }
    return (int)count;
}

static bool is_digit(char c)
{
    return c >= '0' && c <= '9';
}

bool trip_text_has_commas(const char *line)
{
    int words = 0, decimal = 0;
    if (!strchr(line, ','))
        return false;
    for (const char *at = line + strspn(line, " \t;"); *at; at += strspn(at, " \t;")) {
        const size_t bytes = strcspn(at, " \t;");
        const char *comma = memchr(at, ',', bytes);
        const bool inside = comma && comma > at && comma + 1 < at + bytes && is_digit(comma[-1]) &&
                            is_digit(comma[1]);
        const bool one = inside && !memchr(comma + 1, ',', (size_t)(at + bytes - comma - 1));
        words++;
        decimal += one;
        at += bytes;
    }
    return words >= 3 && decimal >= 1;
}
