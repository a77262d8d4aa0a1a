/* Reads points as text: PTS (Leica) and rows of numbers (XYZ). A line of names tells the columns.
 * If it is missing, PTS has intensity before colours, and columns of XYZ are guessed from the first
 * rows. */
#include "point_file_internal.h"

#include <ctype.h>
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "byte_stream.h"
#include "point_fields.h"
#include "report.h"
#include "text_lines.h"

enum { SAMPLED_ROWS = 1000, COLUMNS_MAX = 32, PROBED_ROWS = 50, LINE_BYTES = 4096 };

/* The values of a column in the first rows. */
typedef struct seen {
    bool whole; /* all are whole */
    bool unit;  /* with the next two columns, all are unit vectors */
    double least, most;
} seen;

typedef struct text {
    trip_text_lines *lines;
    bool pts;
    unsigned columns;
    trip_point_field fields[COLUMNS_MAX];
    long names_line; /* of the names of the columns, or 0 */
    bool counted;    /* a line of PTS states the number of points that follow */
    uint64_t stated, left;
    bool excess; /* more points than stated */
    float colour_unit;
} text;

static bool is_comment(const char *line)
{
    const char *at = line + strspn(line, " \t");
    return *at == '#' || *at == '%' || *at == '!' || (at[0] == '/' && at[1] == '/');
}

static bool is_blank(const char *line)
{
    return !line[strspn(line, " \t\v\f,;")];
}

/* Splits names of columns: letters, perhaps in quotes, and with a unit in brackets. Returns the
 * number of names if x, y and z are among them, otherwise 0. */
static unsigned split_names(char *line, char *words[TRIP_TEXT_COLUMNS_MAX])
{
    unsigned found = 0;
    line += strspn(line, " \t#%!/");
    const unsigned count = trip_text_split(line, words);
    for (unsigned i = 0; i < count; i++) {
        words[i] += strspn(words[i], "\"'");
        words[i][strcspn(words[i], "\"'[(")] = 0;
        const trip_point_field field = trip_point_field_of(words[i]);
        found |= field < TRIP_FIELDS ? 1u << field : 0;
    }
    return (found & 7) == 7 ? count : 0;
}

/* ---- probes ---- */

typedef struct probed {
    unsigned rows, columns;
    bool names, counted, good;
} probed;

/* Looks at the whole lines of the first bytes. */
static probed look_at_head(const trip_point_head *head)
{
    probed p = { .good = true };
    const char *at = (const char *)head->bytes, *end = at + head->count;
    while (p.good && at < end && p.rows < PROBED_ROWS) {
        char line[LINE_BYTES], *words[TRIP_TEXT_COLUMNS_MAX];
        const size_t bytes = (size_t)(end - at);
        const char *stop = memchr(at, '\n', bytes);
        const size_t length = stop ? (size_t)(stop - at) : bytes;
        if (length >= LINE_BYTES || memchr(at, 0, length)) {
            p.good = false;
            break;
        }
        memcpy(line, at, length);
        line[length] = 0;
        line[strcspn(line, "\r")] = 0;
        at += length + 1;
        if (is_comment(line)) {
            p.names = p.names || (p.rows == 0 && split_names(line, words) > 0);
            continue;
        }
        if (is_blank(line))
            continue;
        double values[COLUMNS_MAX];
        const char *wrong;
        char copy[LINE_BYTES];
        memcpy(copy, line, sizeof copy);
        const int count = trip_text_row(copy, values, COLUMNS_MAX, &wrong);
        if (count < 0 && p.rows == 0 && !p.names && split_names(line, words) > 0)
            p.names = true;
        else if (count == 1 && p.rows == 0 && !p.counted)
            p.counted = true;
        else if (count < 3 || (p.rows > 0 && (unsigned)count != p.columns))
            p.good = !stop && p.rows > 0 && head->count > LINE_BYTES; /* the last line may be cut */
        else
            p.columns = (unsigned)count, p.rows++;
    }
    p.good = p.good && p.rows > 0;
    return p;
}

static bool probe_pts(const trip_point_head *head)
{
    return trip_byte_suffix(head->path, ".pts") && look_at_head(head).rows > 0;
}

/* Text files are clouds if their names say so, if names of columns do, or if every line holds three
 * numbers or more. */
static bool probe_xyz(const trip_point_head *head)
{
    static const char *const sure[] = { ".xyz", ".asc", ".xyzrgb", ".xyzn", ".xyzi" };
    const probed p = look_at_head(head);
    for (size_t i = 0; i < sizeof sure / sizeof *sure; i++)
        if (trip_byte_suffix(head->path, sure[i]))
            return p.rows > 0; /* the reader names the line of a fault */
    return p.good && ((trip_byte_suffix(head->path, ".txt") && (p.names || p.rows >= 3)) ||
                      (trip_byte_suffix(head->path, ".csv") && p.names));
}

/* ---- columns ---- */

#define FAULT(...) trip_fail_line("read", f->path, trip_text_lines_number(t->lines), __VA_ARGS__)

/* Reads the next row. Sets *count to 0 at the end of the file. */
static int next_row(trip_point_file *f, double *values, int *count)
{
    const text *t = f->state;
    const char *wrong = NULL;
    for (;;) {
        char *line;
        *count = 0;
        const int status = trip_text_lines_next(t->lines, &line);
        if (status < 0 || !line)
            return status;
        if (is_comment(line) || is_blank(line) || trip_text_lines_number(t->lines) == t->names_line)
            continue;
        if (trip_text_has_commas(line))
            return FAULT("has decimal commas: %.40s; write decimal points", line);
        *count = trip_text_row(line, values, COLUMNS_MAX, &wrong);
        return *count < 0 ? FAULT("\"%.40s\" is no number", wrong) : 0;
    }
}

/* Finds a line of names before the first row. */
static int find_names(trip_point_file *f)
{
    text *t = f->state;
    char *line;
    int status;
    while ((status = trip_text_lines_next(t->lines, &line)) == 0 && line) {
        char *words[TRIP_TEXT_COLUMNS_MAX];
        double first;
        if (is_blank(line))
            continue;
        if (!is_comment(line) && line[strspn(line, "+-.,; \t0123456789eE")] == 0)
            break;
        const bool comment = is_comment(line);
        const unsigned count = split_names(line, words);
        if (count == 0 && comment)
            continue;
        if (count == 0)
            break;
        if (count > COLUMNS_MAX)
            return FAULT("names %u columns; up to %d are read", count, COLUMNS_MAX);
        for (unsigned i = 0, found = 0; i < count; i++) {
            const trip_point_field field = trip_point_field_of(words[i]);
            const bool new = field < TRIP_FIELDS && !(found >> field & 1);
            t->fields[i] = new ? field : TRIP_FIELDS;
            found |= new ? 1u << field : 0;
            if (!new && !trip_text_number(words[i], &first))
                trip_point_add_extra(f, words[i]);
        }
        t->columns = count;
        t->names_line = trip_text_lines_number(t->lines);
        if (!comment)
            break;
    }
    return status < 0 ? status : trip_text_lines_rewind(t->lines);
}

static void begin_look(seen *s)
{
    for (unsigned i = 0; i < COLUMNS_MAX; i++)
        s[i] = (seen){ .whole = true, .unit = true, .least = INFINITY, .most = -INFINITY };
}

static void look(seen *s, const double *v, unsigned columns)
{
    for (unsigned i = 0; i < columns; i++) {
        s[i].whole = s[i].whole && v[i] == floor(v[i]);
        s[i].least = fmin(s[i].least, v[i]);
        s[i].most = fmax(s[i].most, v[i]);
        if (i + 2 < columns) {
            const double square = v[i] * v[i] + v[i + 1] * v[i + 1] + v[i + 2] * v[i + 2];
            s[i].unit = s[i].unit && fabs(square - 1) < 0.02;
        }
    }
}

/* Returns whether three columns look like colours: all whole and at most 255, or all 0 to 1. */
static bool are_colours(const seen *s)
{
    bool whole = true, parts = true;
    for (int c = 0; c < 3; c++) {
        whole = whole && s[c].whole && s[c].least >= 0 && s[c].most <= 255;
        parts = parts && s[c].least >= 0 && s[c].most <= 1;
    }
    return whole || parts;
}

/* Assigns `count` columns from `at` on to fields. */
static void assign(text *t, unsigned at, trip_point_field first, unsigned count)
{
    for (unsigned i = 0; i < count; i++)
        t->fields[at + i] = first + i;
}

static void note_columns(trip_point_file *f, const char *what, unsigned at, unsigned count)
{
    const size_t used = strlen(f->info.comments);
    snprintf(f->info.comments + used, sizeof f->info.comments - used, "%scolumn%s %u",
             used ? "; " : "", count > 1 ? "s" : "", at + 1);
    const size_t more = strlen(f->info.comments);
    if (count > 1)
        snprintf(f->info.comments + more, sizeof f->info.comments - more, " to %u: %s", at + count,
                 what);
    else
        snprintf(f->info.comments + more, sizeof f->info.comments - more, ": %s", what);
}

static int guess_pts(trip_point_file *f)
{
    text *t = f->state;
    const unsigned n = t->columns;
    if (n != 3 && n != 4 && n != 6 && n != 7)
        return trip_fail(TRIP_ERROR, "read", f->path, "has %u numbers a row; PTS has 3, 4, 6 or 7",
                         n);
    assign(t, 0, TRIP_FIELD_X, 3);
    if (n == 4 || n == 7)
        assign(t, 3, TRIP_FIELD_INTENSITY, 1);
    if (n >= 6)
        assign(t, n - 3, TRIP_FIELD_RED, 3);
    return 0;
}

/* Three columns of unit length are normals. Three columns with values of colours are colours. The
 * first column that is left is the intensity. Others are ignored. */
static void guess_xyz(trip_point_file *f, const seen *s)
{
    text *t = f->state;
    bool normal = false, colour = false, intensity = false;
    assign(t, 0, TRIP_FIELD_X, 3);
    for (unsigned at = 3; at < t->columns;) {
        const bool three = at + 3 <= t->columns;
        unsigned count = 1;
        if (three && !normal && s[at].unit) {
            assign(t, at, TRIP_FIELD_NX, count = 3);
            note_columns(f, "normals", at, 3);
            normal = true;
        } else if (three && !colour && are_colours(s + at)) {
            assign(t, at, TRIP_FIELD_RED, count = 3);
            note_columns(f, "colours", at, 3);
            colour = true;
        } else if (!intensity) {
            assign(t, at, TRIP_FIELD_INTENSITY, 1);
            note_columns(f, "intensity", at, 1);
            intensity = true;
        } else {
            char name[32];
            snprintf(name, sizeof name, "column %u", at + 1);
            t->fields[at] = TRIP_FIELDS;
            trip_point_add_extra(f, name);
        }
        at += count;
    }
}

/* Whole colours up to 255 have 8 bits. */
static void find_colours(trip_point_file *f, const seen *s)
{
    text *t = f->state;
    bool whole = true;
    double most = 0;
    for (unsigned i = 0; i < t->columns; i++)
        if (t->fields[i] >= TRIP_FIELD_RED && t->fields[i] <= TRIP_FIELD_BLUE) {
            whole = whole && s[i].whole;
            most = fmax(most, s[i].most);
        }
    const bool bytes = (whole && most > 1 && most <= 255) || t->pts;
    t->colour_unit = bytes ? 255 : 1;
    f->colour_form = bytes ? TRIP_COLOUR_UNIT : TRIP_COLOUR_FLOAT;
}

/* Looks at the first rows. */
static int find_columns(trip_point_file *f)
{
    text *t = f->state;
    seen s[COLUMNS_MAX];
    double values[COLUMNS_MAX];
    int count = 0, status = 0;
    unsigned rows = 0;
    begin_look(s);
    while (rows < SAMPLED_ROWS && (status = next_row(f, values, &count)) == 0 && count > 0) {
        if (count == 1 && rows == 0)
            continue; /* the number of points */
        if (count == 1 && t->pts)
            break;
        if (count < 3 || count > COLUMNS_MAX)
            return FAULT("has %d numbers; a point has 3 to %d", count, COLUMNS_MAX);
        if (t->columns == 0)
            t->columns = (unsigned)count;
        if ((unsigned)count != t->columns)
            return FAULT("has %d numbers, but %u are expected", count, t->columns);
        look(s, values, t->columns);
        rows++;
    }
    if (status < 0)
        return status;
    if (rows == 0)
        return trip_fail(TRIP_ERROR, "read", f->path, "holds no points");
    if (!t->names_line && !t->pts)
        guess_xyz(f, s);
    else if (!t->names_line)
        status = guess_pts(f);
    unsigned found = 0;
    for (unsigned i = 0; i < t->columns; i++)
        found |= t->fields[i] < TRIP_FIELDS ? 1u << t->fields[i] : 0;
    f->info.attributes = trip_point_attributes_of(found);
    find_colours(f, s);
    return status;
}

/* ---- reader ---- */

static int open_text(trip_point_file *f, bool pts)
{
    text *t = f->state = calloc(1, sizeof *t);
    if (!t)
        return trip_point_no_memory(f);
    t->pts = pts;
    snprintf(f->info.format, sizeof f->info.format, pts ? "PTS" : "XYZ, text");
    int status = trip_text_lines_open(&t->lines, f->path);
    if (status == 0)
        status = find_names(f);
    if (status == 0)
        status = find_columns(f);
    return status < 0 ? status : trip_point_file_rewind(f);
}

static int open_pts(trip_point_file *f)
{
    return open_text(f, true);
}

static int open_xyz(trip_point_file *f)
{
    return open_text(f, false);
}

static int check_left(trip_point_file *f)
{
    const text *t = f->state;
    return t->left == 0
               ? 0
               : trip_fail(TRIP_ERROR, "read", f->path,
                           "states %" PRIu64 " points, but holds %" PRIu64 "; is it truncated?",
                           t->stated, t->stated - t->left);
}

/* Begins the points that a line states. */
static int begin_block(trip_point_file *f, double number)
{
    text *t = f->state;
    int status = check_left(f);
    if (status == 0 && !(number >= 0 && number < 1e15 && number == floor(number)))
        status = FAULT("%g is no number of points", number);
    t->counted = true;
    t->stated = t->left = status == 0 ? (uint64_t)number : 0;
    return status;
}

static void count_point(trip_point_file *f)
{
    text *t = f->state;
    if (t->left > 0) {
        t->left--;
    } else if (t->counted && !t->excess) {
        t->excess = true;
        trip_point_note(f, "the file states %" PRIu64 " points, but holds more, which are read",
                        t->stated);
    }
}

static int read_text(trip_point_file *f, trip_point *out, size_t room, size_t *got_out)
{
    text *t = f->state;
    for (*got_out = 0; *got_out < room;) {
        double values[COLUMNS_MAX];
        int count;
        int status = next_row(f, values, &count);
        if (status < 0)
            return status;
        if (count == 0)
            return check_left(f);
        if (count == 1 && (t->pts || !t->counted)) {
            status = begin_block(f, values[0]);
            if (status < 0)
                return status;
            continue;
        }
        if ((unsigned)count != t->columns)
            return FAULT("has %d numbers, but %u are expected", count, t->columns);
        trip_point *p = &out[(*got_out)++];
        for (unsigned i = 0; i < t->columns; i++)
            if (t->fields[i] < TRIP_FIELDS)
                trip_point_set(p, t->fields[i], values[i]);
        for (int c = 0; c < 3; c++)
            p->colour[c] /= t->colour_unit;
        count_point(f);
    }
    return 0;
}

static int rewind_text(trip_point_file *f)
{
    text *t = f->state;
    t->counted = false;
    t->stated = t->left = 0;
    return trip_text_lines_rewind(t->lines);
}

static void close_text(trip_point_file *f)
{
    text *t = f->state;
    if (t)
        trip_text_lines_close(t->lines);
    free(t);
}

const trip_point_reader trip_read_pts = { probe_pts, open_pts, read_text, rewind_text, close_text };
const trip_point_reader trip_read_xyz = { probe_xyz, open_xyz, read_text, rewind_text, close_text };
