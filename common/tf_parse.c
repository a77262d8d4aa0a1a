#include "tf_internal.h"

#include "report.h"
#include "text.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { LINE_BYTES = 1024 };

/* State of parsing a `.tf` text. TRANSFER_FUNCTIONS.md has the format. */
typedef struct parser {
    const char *name;
    long line_number;
    trip_tf_point *points;
    size_t count, room;
    double unit_world;
    bool normalised, unit_given, values_given;
} parser;

#define fail_at(p, ...) trip_fail_line(TRIP_TF_STAGE, (p)->name, (p)->line_number, __VA_ARGS__)

static int parse_unit(parser *p, const char *word)
{
    if (p->unit_given)
        return fail_at(p, "a second `unit`");
    p->unit_given = true;
    if (strcmp(word, "voxel") == 0)
        return TRIP_OK;
    if (!trip_text_to_double(word, &p->unit_world) || p->unit_world <= 0)
        return fail_at(p, "`unit %.40s`: expected `unit voxel` or `unit LENGTH` in world units",
                       word);
    return TRIP_OK;
}

static int parse_values(parser *p, const char *word)
{
    if (p->values_given)
        return fail_at(p, "a second `values`");
    p->values_given = true;
    p->normalised = strcmp(word, "normalised") == 0;
    if (!p->normalised && strcmp(word, "data") != 0)
        return fail_at(p, "`values %.40s`: expected `values data` or `values normalised`", word);
    return TRIP_OK;
}

static int parse_directive(parser *p, char **words, int count)
{
    if (count != 2)
        return fail_at(p, "`%s` takes one word", words[0]);
    if (p->count)
        return fail_at(p, "`%s` after a point; move it before the first point", words[0]);
    return words[0][0] == 'u' ? parse_unit(p, words[1]) : parse_values(p, words[1]);
}

static int parse_point(parser *p, char **words, int count)
{
    double n[5];
    if (count != 5)
        return fail_at(p, "%s numbers; expected `value r g b opacity`",
                       count < 5 ? "fewer than five" : "more than five");
    for (int i = 0; i < 5; i++)
        if (!trip_text_to_double(words[i], &n[i]))
            return fail_at(p, "`%.40s` is not a finite decimal number", words[i]);
    if (p->count == p->room)
        return fail_at(p, "more than %d points", TRIP_TF_MAX_POINTS);
    trip_tf_point *point = &p->points[p->count];
    *point = (trip_tf_point){ n[0], { n[1], n[2], n[3], n[4] } };
    const char *fault = trip_tf_point_fault(point, p->count ? point - 1 : NULL, p->normalised);
    if (fault)
        return fail_at(p, "%s", fault);
    p->count++;
    return TRIP_OK;
}

/* Parses one line without its line feed. Splits it into words in place. */
static int parse_line(parser *p, char *line)
{
    char *words[6], *rest = NULL;
    int count = 0;
    line[strcspn(line, "#")] = 0;
    for (char *w = strtok_r(line, " \t\r", &rest); w && count < 6;
         w = strtok_r(NULL, " \t\r", &rest))
        words[count++] = w;
    if (count == 0)
        return TRIP_OK;
    if (strcmp(words[0], "unit") == 0 || strcmp(words[0], "values") == 0)
        return parse_directive(p, words, count);
    return parse_point(p, words, count);
}

static int parse_lines(parser *p, const char *text, size_t bytes)
{
    char line[LINE_BYTES];
    const char *end = text + bytes;
    while (text < end) {
        const char *stop = memchr(text, '\n', (size_t)(end - text));
        size_t length = (size_t)((stop ? stop : end) - text);
        p->line_number++;
        if (length >= sizeof line)
            return fail_at(p, "longer than %d characters", LINE_BYTES - 1);
        if (memchr(text, 0, length))
            return fail_at(p, "a zero byte; this is not a text file");
        memcpy(line, text, length);
        line[length] = 0;
        int status = parse_line(p, line);
        if (status)
            return status;
        text += length + (stop != NULL);
    }
    return TRIP_OK;
}

/* A line has at most one point. */
static size_t max_points(const char *text, size_t bytes)
{
    size_t lines = 1;
    for (size_t i = 0; i < bytes && lines < TRIP_TF_MAX_POINTS; i++)
        lines += text[i] == '\n';
    return lines;
}

int trip_tf_parse(trip_tf **out, const char *name, const char *text, size_t bytes)
{
    parser p = { .name = name, .room = max_points(text, bytes) };
    *out = NULL;
    if (bytes >= 3 && memcmp(text, "\xef\xbb\xbf", 3) == 0) {
        text += 3;
        bytes -= 3;
    }
    p.points = calloc(p.room, sizeof *p.points);
    if (!p.points)
        return trip_fail(TRIP_ERROR, TRIP_TF_STAGE, name, "out of memory");
    int status = parse_lines(&p, text, bytes);
    if (!status && p.count == 0)
        status = trip_fail(TRIP_ERROR, TRIP_TF_STAGE, name,
                           "no points; expected lines `value r g b opacity`");
    if (!status)
        status = trip_tf_from_points(out, p.points, p.count, p.normalised, p.unit_world);
    free(p.points);
    return status;
}
