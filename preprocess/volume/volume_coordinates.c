#include "volume_coordinates.h"

#include <errno.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "coordinates.h"
#include "input_file.h"
#include "report.h"
#include "text.h"

enum { LETTERS = 3 };
static const char letters[LETTERS] = { 'x', 'y', 'z' };

static int fail_axis(const char *path, int axis, const char *why)
{
    return trip_fail(TRIP_ERROR, "read", path, "coordinates along %c: %s", letters[axis], why);
}

static bool lies_along_axis(const trip_affine *m, int axis)
{
    for (int a = 0; a < 3; a++)
        if (a != axis && (m->m[a][axis] != 0 || m->m[axis][a] != 0))
            return false;
    return true;
}

static bool are_even(const double *table, int64_t count)
{
    for (int64_t i = 0; i < count; i++)
        if (!(fabs(table[i] - (double)i) <= TRIP_VOLUME_EVEN))
            return false;
    return true;
}

static const char *fault_of_values(const double *values, int64_t count)
{
    for (int64_t i = 0; i < count; i++) {
        if (!isfinite(values[i]))
            return "not all are finite";
        if (i > 1 && !((values[i] - values[i - 1]) * (values[1] - values[0]) > 0))
            return "they must ascend or descend throughout";
    }
    if (count > 1 && !(isfinite(values[count - 1] - values[0]) && values[1] != values[0]))
        return "they must ascend or descend throughout";
    return NULL;
}

int trip_volume_set_positions(trip_volume_info *info, int axis, const double *positions,
                              const char *path)
{
    const int64_t count = info->dims[axis];
    const char *fault = fault_of_values(positions, count);
    if (fault)
        return fail_axis(path, axis, fault);
    if (count <= 1)
        return 0;
    const double mean = (positions[count - 1] - positions[0]) / (double)(count - 1);
    double *table = calloc((size_t)count, sizeof *table);
    if (!table)
        return trip_fail(TRIP_ERROR, "read", path, "out of memory");
    for (int64_t i = 1; i < count; i++)
        table[i] = (positions[i] - positions[0]) / mean;
    table[count - 1] = (double)(count - 1);
    free(info->coordinates[axis]);
    info->coordinates[axis] = NULL;
    fault = trip_coordinates_fault(table, count);
    if (fault || are_even(table, count))
        free(table);
    else
        info->coordinates[axis] = table;
    return fault ? fail_axis(path, axis, fault) : 0;
}

int trip_volume_set_coordinates(trip_volume_info *info, int axis, const double *values,
                                const char *path)
{
    const int64_t count = info->dims[axis];
    const char *fault = fault_of_values(values, count);
    double *column = info->index_to_world.m[axis];
    if (!fault && !lies_along_axis(&info->index_to_world, axis))
        fault = "the axis of the volume is not parallel to the axis of world space";
    if (fault)
        return fail_axis(path, axis, fault);
    column[3] = values[0];
    if (count > 1)
        column[axis] = (values[count - 1] - values[0]) / (double)(count - 1);
    return trip_volume_set_positions(info, axis, values, path);
}

/* Splits the option into three names at its commas. Returns false unless there are three. */
static bool split_names(const char *files, const char *begin[3], size_t length[3])
{
    for (int a = 0; a < 3; a++) {
        begin[a] = files;
        length[a] = strcspn(files, ",");
        files += length[a];
        if (a < 2 && *files++ != ',')
            return false;
    }
    return *files == 0;
}

static bool is_between(int c)
{
    return c == ' ' || c == '\t' || c == '\n' || c == '\r' || c == ',' || c == ';';
}

/* A file that is read in order; it may be a pipe. */
typedef struct text_file {
    int fd;
    size_t used, count;
    bool failed; /* errno tells why */
    char bytes[1 << 14];
} text_file;

/* Returns EOF at the end or after a failure. */
static int next_byte(text_file *f)
{
    if (f->used == f->count) {
        const ssize_t n = f->failed ? -1 : trip_input_read(f->fd, f->bytes, sizeof f->bytes);
        f->failed = n < 0;
        f->used = 0;
        f->count = n > 0 ? (size_t)n : 0;
    }
    return f->used < f->count ? (unsigned char)f->bytes[f->used++] : EOF;
}

/* Parses the next number of a file. Returns 1, 0 at the end, or -1 if the next word is no number.
 */
static int next_number(text_file *f, double *value)
{
    char word[64];
    size_t n = 0;
    int c;
    while (is_between(c = next_byte(f)))
        continue;
    for (; c != EOF && !is_between(c); c = next_byte(f))
        if (n < sizeof word - 1)
            word[n++] = (char)c;
        else
            return -1;
    word[n] = 0;
    *value = 0;
    return n == 0 ? 0 : trip_text_to_double(word, value) ? 1 : -1;
}

static int fail_to_read(const char *file)
{
    return trip_interrupted() ? trip_fail(TRIP_INTERRUPTED, "read", file, "interrupted")
                              : trip_fail_errno("read", file, "cannot read");
}

static int read_numbers(text_file *f, const char *file, double *values, int64_t count)
{
    double beyond;
    for (int64_t i = 0; i <= count; i++) {
        int got = next_number(f, i < count ? &values[i] : &beyond);
        if (f->failed)
            return fail_to_read(file);
        if (got < 0)
            return trip_fail(TRIP_ERROR, "read", file, "item %" PRId64 " is not a number", i + 1);
        if (got != (i < count))
            return trip_fail(TRIP_ERROR, "read", file,
                             "has %s numbers than the %" PRId64 " voxels along its axis",
                             got ? "more" : "fewer", count);
    }
    return 0;
}

static int read_axis(trip_volume_info *info, int axis, const char *file, const char *path)
{
    const int64_t count = info->dims[axis];
    double *values = calloc((size_t)count, sizeof *values);
    if (!values)
        return trip_fail(TRIP_ERROR, "read", file, "out of memory");
    text_file f = { .fd = trip_input_open(file) };
    int status = f.fd >= 0 ? read_numbers(&f, file, values, count)
                           : trip_fail_errno("read", file, "cannot open");
    if (f.fd >= 0)
        close(f.fd);
    if (!status)
        status = trip_volume_set_coordinates(info, axis, values, path);
    free(values);
    return status;
}

typedef int (*visit_axis)(void *user, int axis, const char *file);

static int each_file(const char *files, visit_axis visit, void *user)
{
    const char *begin[3];
    size_t length[3];
    int status = 0;
    if (!split_names(files, begin, length))
        return trip_fail(TRIP_USAGE, "read", files, "--coordinates takes three files: X,Y,Z");
    for (int a = 0; a < 3 && !status; a++) {
        char *file = length[a] ? strndup(begin[a], length[a]) : NULL;
        if (length[a] && !file)
            return trip_fail(TRIP_ERROR, "read", files, "out of memory");
        status = file ? visit(user, a, file) : 0;
        free(file);
    }
    return status;
}

typedef struct reading {
    trip_volume_info *info;
    const char *path;
} reading;

static int read_one(void *user, int axis, const char *file)
{
    const reading *r = user;
    return read_axis(r->info, axis, file, r->path);
}

int trip_volume_read_coordinates(trip_volume_info *info, const char *files, const char *path)
{
    int status = trip_volume_check_axes(path, info);
    return status == 0 ? each_file(files, read_one, &(reading){ info, path }) : status;
}

typedef struct listing {
    int (*visit)(void *user, const char *file);
    void *user;
} listing;

static int list_one(void *user, int axis, const char *file)
{
    const listing *l = user;
    (void)axis;
    return l->visit(l->user, file);
}

int trip_volume_list_coordinates(const char *files, int (*visit)(void *user, const char *file),
                                 void *user)
{
    return each_file(files, list_one, &(listing){ visit, user });
}

void trip_volume_sample_coordinates(trip_volume_info *info, int axis, int64_t step, int64_t count)
{
    double *table = info->coordinates[axis];
    const bool uneven = table && count > 1;
    const double mean = uneven ? table[(count - 1) * step] / (double)(count - 1) : (double)step;
    for (int row = 0; row < 3; row++)
        info->index_to_world.m[row][axis] *= mean;
    if (!uneven)
        return;
    for (int64_t i = 1; i < count; i++)
        table[i] = table[i * step] / mean;
    table[count - 1] = (double)(count - 1);
}

int trip_volume_complete_coordinates(trip_volume_info *info, const char *path)
{
    if (!info->coordinates[0] && !info->coordinates[1] && !info->coordinates[2])
        return 0;
    int status = trip_volume_check_axes(path, info);
    for (int a = 0; a < 3 && status == 0; a++) {
        const size_t count = (size_t)info->dims[a];
        if (info->coordinates[a])
            continue;
        if (!(info->coordinates[a] = calloc(count, sizeof(double))))
            return trip_fail(TRIP_ERROR, "read", path, "out of memory");
        for (size_t i = 0; i < count; i++)
            info->coordinates[a][i] = (double)i;
    }
    return status;
}

void trip_volume_free_coordinates(trip_volume_info *info)
{
    for (int a = 0; a < 3; a++) {
        free(info->coordinates[a]);
        info->coordinates[a] = NULL;
    }
}
