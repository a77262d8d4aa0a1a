/* Reads scans in PTX (Leica): a file holds one or more range grids as text. Each has its size, the
 * place of the scanner, a matrix to common coordinates, and a row for each cell. A row of zeros is
 * a cell without a point. */
#include "point_file_internal.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "geometry.h"
#include "report.h"
#include "text_lines.h"

enum { COLUMNS = 7, COLOURS_AT = 4, PROBED_LINES = 10, LINE_BYTES = 512 };

typedef struct ptx {
    trip_text_lines *lines;
    uint32_t scans;       /* that have begun */
    uint64_t cells, left; /* of this scan */
    double matrix[4][4];
} ptx;

/* The numbers of each line of a header. */
static const unsigned header_columns[PROBED_LINES] = { 1, 1, 3, 3, 3, 3, 4, 4, 4, 4 };

static bool probe(const trip_point_head *head)
{
    const char *at = (const char *)head->bytes, *end = at + head->count;
    for (unsigned i = 0; i < PROBED_LINES; i++) {
        char line[LINE_BYTES];
        double values[4];
        const char *wrong;
        const char *stop = memchr(at, '\n', (size_t)(end - at));
        if (!stop || stop - at >= LINE_BYTES)
            return false;
        memcpy(line, at, (size_t)(stop - at));
        line[stop - at] = 0;
        line[strcspn(line, "\r")] = 0;
        if (trip_text_row(line, values, 4, &wrong) != (int)header_columns[i])
            return false;
        at = stop + 1;
    }
    return true;
}

#define FAULT(...) trip_fail_line("read", f->path, trip_text_lines_number(p->lines), __VA_ARGS__)

/* Reads the numbers of the next line. Sets *count to 0 at the end of the file. */
static int next_row(trip_point_file *f, double *values, unsigned room, int *count)
{
    const ptx *p = f->state;
    const char *wrong = NULL;
    char *text;
    *count = 0;
    while (*count == 0) {
        const int status = trip_text_lines_next(p->lines, &text);
        if (status < 0 || !text)
            return status;
        *count = trip_text_row(text, values, room, &wrong);
        if (*count < 0)
            return FAULT("\"%.40s\" is no number", wrong);
    }
    return 0;
}

static int add_scan(trip_point_file *f, uint64_t width, uint64_t height)
{
    const ptx *p = f->state;
    trip_point_scan *scan = trip_point_add_scan(f);
    if (!scan)
        return TRIP_ERROR;
    *scan = (trip_point_scan){ .posed = true, .width = width, .height = height };
    memcpy(scan->scanner, p->matrix[3], sizeof scan->scanner);
    return 0;
}

/* Returns whether a matrix maps space to space, and not to a plane. */
static bool is_pose(double m[4][4])
{
    const trip_vec3 x = trip_v3(m[0][0], m[0][1], m[0][2]), y = trip_v3(m[1][0], m[1][1], m[1][2]),
                    z = trip_v3(m[2][0], m[2][1], m[2][2]);
    const double lengths = trip_length(x) * trip_length(y) * trip_length(z);
    return fabs(trip_dot(x, trip_cross(y, z))) > 1e-6 * lengths;
}

/* Reads the header of the next scan. Leaves p->left at 0 at the end of the file. */
static int begin_scan(trip_point_file *f)
{
    ptx *p = f->state;
    double v[PROBED_LINES][4];
    for (unsigned i = 0; i < PROBED_LINES; i++) {
        int count;
        const int status = next_row(f, v[i], 4, &count);
        if (status < 0 || (i == 0 && count == 0))
            return status;
        if (count == 0)
            return trip_point_truncated(f);
        if (count != (int)header_columns[i])
            return FAULT("line %u of the header of a scan has %d numbers, and needs %u", i + 1,
                         count, header_columns[i]);
        for (int k = 0; k < count; k++)
            if (!isfinite(v[i][k]))
                return FAULT("the header of a scan holds a number that is not finite");
    }
    const double width = v[0][0], height = v[1][0];
    if (!(width >= 0 && height >= 0 && width * height < 1e15) || width != floor(width) ||
        height != floor(height))
        return FAULT("a scan states a grid of %g x %g", width, height);
    memcpy(p->matrix, v[6], sizeof p->matrix);
    if (!is_pose(p->matrix))
        return FAULT("the matrix of a scan has no inverse");
    p->cells = p->left = (uint64_t)width * (uint64_t)height;
    p->scans++;
    return p->scans > f->info.scan_count ? add_scan(f, (uint64_t)width, (uint64_t)height) : 0;
}

static int open_ptx(trip_point_file *f)
{
    ptx *p = f->state = calloc(1, sizeof *p);
    double row[COLUMNS];
    int count = 0;
    if (!p)
        return trip_point_no_memory(f);
    snprintf(f->info.format, sizeof f->info.format, "PTX");
    f->gaps = true;
    int status = trip_text_lines_open(&p->lines, f->path);
    if (status == 0)
        status = begin_scan(f);
    if (status == 0 && p->left > 0)
        status = next_row(f, row, COLUMNS, &count);
    if (status < 0)
        return status;
    f->info.attributes = TRIP_POINT_SCAN | (count >= COLOURS_AT ? TRIP_POINT_INTENSITY : 0) |
                         (count >= COLUMNS ? TRIP_POINT_COLOUR : 0);
    return trip_point_file_rewind(f);
}

static void decode(const ptx *p, const double *v, int count, trip_point *out)
{
    out->scan = p->scans - 1;
    out->intensity = count >= COLOURS_AT ? (float)v[3] : 0;
    for (int c = 0; c < 3 && count >= COLUMNS; c++)
        out->colour[c] = (float)v[COLOURS_AT + c] / 255;
    if (v[0] == 0 && v[1] == 0 && v[2] == 0) {
        trip_point_drop(out);
        return;
    }
    for (int a = 0; a < 3; a++)
        out->position[a] = v[0] * p->matrix[0][a] + v[1] * p->matrix[1][a] +
                           v[2] * p->matrix[2][a] + p->matrix[3][a];
}

static int read_ptx(trip_point_file *f, trip_point *out, size_t room, size_t *got_out)
{
    ptx *p = f->state;
    for (*got_out = 0; *got_out < room;) {
        double row[COLUMNS];
        int count;
        if (p->left == 0) {
            const uint32_t before = p->scans;
            const int status = trip_interrupted()
                                   ? trip_fail(TRIP_INTERRUPTED, "read", f->path, "interrupted")
                                   : begin_scan(f);
            if (status < 0)
                return status;
            if (p->scans == before)
                break;
            continue;
        }
        const int status = next_row(f, row, COLUMNS, &count);
        if (status < 0)
            return status;
        if (count == 0)
            return trip_fail(TRIP_ERROR, "read", f->path,
                             "scan %" PRIu32 " states %" PRIu64 " points, but holds %" PRIu64
                             "; is it truncated?",
                             p->scans, p->cells, p->cells - p->left);
        if (count < 3)
            return FAULT("has %d numbers; a point has 4 or 7", count);
        decode(p, row, count, &out[(*got_out)++]);
        p->left--;
    }
    return 0;
}

static int rewind_ptx(trip_point_file *f)
{
    ptx *p = f->state;
    p->scans = 0;
    p->left = 0;
    return trip_text_lines_rewind(p->lines);
}

static void close_ptx(trip_point_file *f)
{
    ptx *p = f->state;
    if (p)
        trip_text_lines_close(p->lines);
    free(p);
}

const trip_point_reader trip_read_ptx = { probe, open_ptx, read_ptx, rewind_ptx, close_ptx };
