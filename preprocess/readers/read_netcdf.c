/* Reads netCDF files in the classic formats (CDF-1, CDF-2 and CDF-5); read_netcdf4.c reads
 * netCDF-4.
 * - A volume is a variable with at least three dimensions. The last three are k, j and i. The first
 *   of the earlier dimensions is time, the next has channels, and all others use index 0.
 * - A variable with the name of a dimension gives the coordinates along this dimension.
 * - Values equal to a fill value or missing value become NaN.
 * - Integers are unsigned if the attribute _Unsigned is "true". CDF-1 and CDF-2 have no unsigned
 *   types.
 *
 * MINC 1 files are refused: each slice has a scale of its own, in the variables image-min and
 * image-max.
 *
 * This reader does not use libnetcdf. For damaged files, nc_open() of version 4.9.0 writes beyond
 * its memory and allocates gigabytes. It also reads truncated files without an error. */
#include <fcntl.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>
#include <unistd.h>

#include "dense_file.h"
#include "read_at.h"
#include "report.h"
#include "volume_coordinates.h"
#include "volume_reader.h"

enum {
    HEADER_MAX = 1 << 20, /* the header and its parsed form then take some 14 MB */
    DIMS_MAX = 32,        /* of a variable */
    TAG_DIMENSION = 10,
    TAG_VARIABLE = 11,
    TAG_ATTRIBUTE = 12,
    TYPE_CHAR = 2,
    TYPES = 12,
    PIECE_BYTES = 1 << 16,
};

/* Index: type number of the file. Entries without a volume type are -1. */
static const int scalar_of[TYPES] = { -1,       TRIP_I8, -1,       TRIP_I16, TRIP_I32, TRIP_F32,
                                      TRIP_F64, TRIP_U8, TRIP_U16, TRIP_U32, TRIP_I64, TRIP_U64 };

typedef struct text {
    const char *at; /* points into the header; not terminated */
    size_t length;
} text;

typedef struct dimension {
    text name;
    uint64_t size; /* 0 for the dimension of records */
} dimension;

typedef struct variable {
    text name;
    unsigned dims;
    uint64_t dim[DIMS_MAX];
    int scalar;       /* trip_scalar; -1 for characters */
    bool minc;        /* has an attribute of MINC */
    bool is_unsigned; /* overrides the type in the file */
    uint64_t begin;
    double slope, inter, missing[2]; /* NaN if absent */
} variable;

typedef struct header {
    const char *path;
    unsigned char *bytes;
    size_t count, at;
    bool broken;    /* a read went beyond the header, or a number is invalid */
    bool wide, far; /* counts (wide) and file offsets (far) have 8 bytes */
    uint64_t file_bytes, records, record_bytes;
    dimension *dims;
    uint64_t dim_count;
    variable *variables;
    uint64_t variable_count;
} header;

static uint64_t take_number(header *h, unsigned bytes)
{
    uint64_t x = 0;
    if (h->count - h->at < bytes) {
        h->broken = true;
        return 0;
    }
    for (unsigned i = 0; i < bytes; i++)
        x = x << 8 | h->bytes[h->at++];
    return x;
}

static uint64_t take_count(header *h)
{
    return take_number(h, h->wide ? 8 : 4);
}

/* Takes so many bytes and the padding to a multiple of 4. */
static const unsigned char *take_bytes(header *h, uint64_t bytes)
{
    uint64_t left = h->count - h->at, padded = (bytes + 3) & ~UINT64_C(3);
    const unsigned char *from = h->bytes + h->at;
    if (bytes > left || padded > left) {
        h->broken = true;
        return NULL;
    }
    h->at += (size_t)padded;
    return from;
}

static text take_text(header *h)
{
    text t = { NULL, 0 };
    uint64_t length = take_count(h);
    t.at = (const char *)take_bytes(h, length);
    t.length = t.at ? (size_t)length : 0;
    return t;
}

/* Returns the number of items of a list with this tag. Each item takes at least `min` bytes. */
static uint64_t take_list(header *h, unsigned tag, unsigned min)
{
    uint64_t is = take_number(h, 4), count = take_count(h);
    if ((is != tag && !(is == 0 && count == 0)) || count > (h->count - h->at) / min)
        h->broken = true;
    return h->broken ? 0 : count;
}

static bool is_named(text t, const char *name)
{
    return t.length == strlen(name) && memcmp(t.at, name, t.length) == 0;
}

static bool same_text(text a, text b)
{
    return a.length == b.length && memcmp(a.at, b.at, a.length) == 0;
}

/* Converts a stored number. */
static double number_at(const unsigned char *at, int scalar)
{
    const unsigned bytes = trip_scalar_bytes((trip_scalar)scalar);
    uint64_t bits = 0;
    for (unsigned i = 0; i < bytes; i++)
        bits = bits << 8 | at[i];
    float single;
    double both;
    uint32_t half = (uint32_t)bits;
    const unsigned up = 64 - 8 * bytes;
    switch (scalar) {
    case TRIP_F32:
        memcpy(&single, &half, sizeof single);
        return (double)single;
    case TRIP_F64:
        memcpy(&both, &bits, sizeof both);
        return both;
    case TRIP_I8:
    case TRIP_I16:
    case TRIP_I32:
    case TRIP_I64:
        return (double)((int64_t)(bits << up) >> up);
    default:
        return (double)bits;
    }
}

static bool is_true(const unsigned char *at, uint64_t bytes)
{
    return bytes >= 4 && strncasecmp((const char *)at, "true", 4) == 0 && (bytes == 4 || !at[4]);
}

static void take_attribute(header *h, variable *v)
{
    text name = take_text(h);
    unsigned type = (unsigned)take_number(h, 4);
    uint64_t count = take_count(h), bytes;
    const bool known = type > 0 && type < TYPES;
    const unsigned each = !known              ? 1
                          : type == TYPE_CHAR ? 1
                                              : trip_scalar_bytes((trip_scalar)scalar_of[type]);
    if (!known || __builtin_mul_overflow(count, each, &bytes)) {
        h->broken = true;
        return;
    }
    const unsigned char *values = take_bytes(h, bytes);
    if (v && (is_named(name, "signtype") || is_named(name, "vartype")))
        v->minc = true;
    if (v && values && type == TYPE_CHAR && is_named(name, "_Unsigned"))
        v->is_unsigned = is_true(values, bytes);
    if (!v || !values || count == 0 || type == TYPE_CHAR)
        return;
    if (is_named(name, "scale_factor"))
        v->slope = number_at(values, scalar_of[type]);
    else if (is_named(name, "add_offset"))
        v->inter = number_at(values, scalar_of[type]);
    else if (is_named(name, "_FillValue"))
        v->missing[0] = number_at(values, scalar_of[type]);
    else if (is_named(name, "missing_value"))
        v->missing[1] = number_at(values, scalar_of[type]);
}

static void take_attributes(header *h, variable *v)
{
    uint64_t count = take_list(h, TAG_ATTRIBUTE, 12);
    for (uint64_t i = 0; i < count && !h->broken; i++)
        take_attribute(h, v);
}

static void take_dimension(header *h, dimension *d)
{
    d->name = take_text(h);
    d->size = take_count(h);
}

/* Default fill value of unwritten floating-point values. */
#define FILL_FLOAT 9.9692099683868690e+36

static void take_type(header *h, variable *v)
{
    const uint64_t type = take_number(h, 4);
    h->broken |= type == 0 || type >= TYPES;
    v->scalar = h->broken ? -1 : scalar_of[type];
    if ((v->scalar == TRIP_F32 || v->scalar == TRIP_F64) && isnan(v->missing[0]))
        v->missing[0] = FILL_FLOAT;
    if (!v->is_unsigned || v->scalar < 0)
        return;
    const trip_scalar bits = trip_scalar_unsigned((trip_scalar)v->scalar);
    for (int i = 0; i < 2 && bits < TRIP_F16; i++)
        v->missing[i] = trip_scalar_without_sign(bits, v->missing[i]);
    v->scalar = (int)bits;
}

static void take_variable(header *h, variable *v)
{
    v->name = take_text(h);
    uint64_t dims = take_count(h);
    if (dims > DIMS_MAX) {
        h->broken = true;
        return;
    }
    v->dims = (unsigned)dims;
    for (unsigned i = 0; i < v->dims; i++) {
        v->dim[i] = take_count(h);
        h->broken |= v->dim[i] >= h->dim_count;
    }
    v->slope = 1;
    v->missing[0] = v->missing[1] = NAN;
    take_attributes(h, v);
    take_type(h, v);
    take_count(h); /* size in bytes, which follows from the other fields */
    v->begin = take_number(h, h->far ? 8 : 4);
}

static uint64_t size_of(const header *h, uint64_t dim)
{
    return h->dims[dim].size ? h->dims[dim].size : h->records;
}

static bool has_records(const header *h, const variable *v)
{
    return v->dims > 0 && h->dims[v->dim[0]].size == 0;
}

static unsigned bytes_of(const variable *v)
{
    return v->scalar < 0 ? 1 : trip_scalar_bytes((trip_scalar)v->scalar);
}

/* Returns the size of one record of a variable in bytes. */
static uint64_t record_bytes_of(header *h, const variable *v)
{
    uint64_t bytes = bytes_of(v);
    for (unsigned i = 1; i < v->dims; i++)
        h->broken |= __builtin_mul_overflow(bytes, h->dims[v->dim[i]].size, &bytes);
    return bytes;
}

/* Computes the size of a record of all variables. Records of the variables follow each other. Each
 * is padded to 4 bytes, except if only one variable has records. */
static void measure_records(header *h)
{
    uint64_t alone = 0, sum = 0;
    unsigned count = 0;
    for (uint64_t i = 0; i < h->variable_count; i++)
        if (has_records(h, &h->variables[i])) {
            alone = record_bytes_of(h, &h->variables[i]);
            h->broken |= alone > INT64_MAX / 4 ||
                         __builtin_add_overflow(sum, (alone + 3) & ~UINT64_C(3), &sum);
            count++;
        }
    h->record_bytes = count == 1 ? alone : sum;
    h->broken |= h->record_bytes > INT64_MAX;
}

static void parse(header *h)
{
    const unsigned form = h->bytes[3];
    h->at = 4;
    h->far = form != 1;
    h->wide = form == 5;
    h->records = take_count(h);
    h->dim_count = take_list(h, TAG_DIMENSION, 8);
    if (h->broken || !(h->dims = calloc((size_t)h->dim_count + 1, sizeof *h->dims)))
        return;
    for (uint64_t i = 0; i < h->dim_count && !h->broken; i++)
        take_dimension(h, &h->dims[i]);
    take_attributes(h, NULL);
    h->variable_count = take_list(h, TAG_VARIABLE, 28);
    if (h->broken || !(h->variables = calloc((size_t)h->variable_count + 1, sizeof *h->variables)))
        return;
    for (uint64_t i = 0; i < h->variable_count && !h->broken; i++)
        take_variable(h, &h->variables[i]);
    for (uint64_t i = 0; i < h->variable_count && !h->broken; i++)
        for (unsigned d = 1; d < h->variables[i].dims; d++)
            h->broken |= h->dims[h->variables[i].dim[d]].size == 0;
    if (!h->broken)
        measure_records(h);
}

static int read_at(int fd, const char *path, uint64_t offset, void *to, size_t bytes)
{
    const ssize_t n = trip_read_at(fd, to, bytes, bytes, offset);
    if (n < 0)
        return trip_fail_errno("read", path, "cannot read");
    return (size_t)n == bytes ? 0
                              : trip_fail(TRIP_ERROR, "read", path, "ends early, at byte %" PRIu64,
                                          offset + (uint64_t)n);
}

static void free_header(header *h)
{
    free(h->bytes);
    free(h->dims);
    free(h->variables);
}

static int read_header(header *h, int fd, const char *path)
{
    struct stat st;
    if (fstat(fd, &st) < 0)
        return trip_fail_errno("read", path, "cannot open");
    h->path = path;
    h->file_bytes = (uint64_t)st.st_size;
    h->count = h->file_bytes < HEADER_MAX ? (size_t)h->file_bytes : HEADER_MAX;
    h->bytes = malloc(h->count + 1);
    if (!h->bytes)
        return trip_fail(TRIP_ERROR, "read", path, "out of memory for its header");
    int status = read_at(fd, path, 0, h->bytes, h->count);
    if (status)
        return status;
    if (h->count >= 4)
        parse(h);
    if (!h->broken && (!h->dims || !h->variables))
        return trip_fail(TRIP_ERROR, "read", path, "out of memory for its header");
    if (!h->broken)
        return 0;
    const char *stage = h->file_bytes > HEADER_MAX ? "the header is invalid, or longer than 1 MiB"
                                                   : "the header is invalid";
    return trip_fail(TRIP_ERROR, "read", path, "byte %zu: %s", h->at, stage);
}

typedef struct netcdf {
    int fd;
    char *path;
    uint64_t begin, stride; /* of slices in the file, in bytes */
    uint64_t values;        /* per slice */
    int64_t next;
    trip_scalar stored;
    bool decoded; /* slices are returned as floats, with NaN for missing values */
    float missing[2];
} netcdf;

static bool netcdf_probe(const char *path, const unsigned char *head, size_t bytes,
                         const trip_volume_params *params)
{
    (void)path;
    (void)params;
    return bytes >= 4 && memcmp(head, "CDF", 3) == 0 &&
           (head[3] == 1 || head[3] == 2 || head[3] == 5);
}

/* Returns the number of values of the last three dimensions, or 0 if the variable is no volume. */
static double volume_of(const header *h, const variable *v)
{
    double values = 1;
    if (v->dims < 3 || v->scalar < 0)
        return 0;
    for (unsigned i = v->dims - 3; i < v->dims; i++)
        values *= (double)size_of(h, v->dim[i]);
    return values;
}

static int refuse_minc(const header *h)
{
    bool image = false, marked = false;
    for (uint64_t i = 0; i < h->variable_count; i++) {
        const variable *v = &h->variables[i];
        image |= is_named(v->name, "image");
        marked |= is_named(v->name, "image-min") || is_named(v->name, "image-max") ||
                  (is_named(v->name, "image") && v->minc);
    }
    return image && marked ? trip_fail(TRIP_ERROR, "read", h->path, "%s", TRIP_VOLUME_MINC) : 0;
}

/* Exodus files hold finite elements. Their arrays with three axes are no grids. */
static int refuse_exodus(const header *h)
{
    bool nodes = false, blocks = false;
    for (uint64_t i = 0; i < h->dim_count; i++) {
        nodes |= is_named(h->dims[i].name, TRIP_VOLUME_EXODUS_NODES);
        blocks |= is_named(h->dims[i].name, TRIP_VOLUME_EXODUS_BLOCKS);
    }
    return nodes && blocks ? trip_fail(TRIP_ERROR, "read", h->path, "%s", TRIP_VOLUME_EXODUS) : 0;
}

/* Chooses the named variable, or else the variable with the most values. */
static int choose_variable(const header *h, const char *name, const variable **out)
{
    *out = NULL;
    for (uint64_t i = 0; i < h->variable_count; i++) {
        const variable *v = &h->variables[i];
        bool wanted =
            name ? is_named(v->name, name) : volume_of(h, v) > (*out ? volume_of(h, *out) : 0);
        *out = wanted ? v : *out;
    }
    if (!*out)
        return trip_fail(
            TRIP_ERROR, "read", h->path, name ? "has no variable \"%s\"" : "%s",
            name ? name
                 : "is netCDF without a numeric variable with three dimensions; `ncdump -h` lists "
                   "its variables");
    return volume_of(h, *out) > 0
               ? 0
               : trip_fail(TRIP_ERROR, "read", h->path,
                           "variable \"%.*s\" is not numeric or has fewer than three dimensions",
                           (int)((*out)->name.length < 99 ? (*out)->name.length : 99),
                           (*out)->name.at);
}

static const variable *coordinates_of(const header *h, uint64_t dim)
{
    for (uint64_t i = 0; i < h->variable_count; i++) {
        const variable *v = &h->variables[i];
        if (v->dims == 1 && v->dim[0] == dim && v->scalar >= 0 &&
            same_text(v->name, h->dims[dim].name))
            return v;
    }
    return NULL;
}

/* Reads in pieces and checks for an interruption between them. */
static int read_coordinates(const header *h, int fd, const variable *v, double *values,
                            uint64_t count)
{
    unsigned char piece[PIECE_BYTES];
    const unsigned bytes = bytes_of(v);
    const uint64_t stride = has_records(h, v) ? h->record_bytes : bytes;
    const uint64_t max = stride < sizeof piece ? sizeof piece / stride : 1;
    int status = 0;
    for (uint64_t i = 0, n; i < count && !status; i += n) {
        uint64_t at;
        n = count - i < max ? count - i : max;
        if (__builtin_mul_overflow(i, stride, &at) || __builtin_add_overflow(at, v->begin, &at) ||
            at > h->file_bytes)
            at = h->file_bytes;
        status = trip_interrupted()
                     ? trip_fail(TRIP_INTERRUPTED, "read", h->path, "interrupted")
                     : read_at(fd, h->path, at, piece, (size_t)((n - 1) * stride + bytes));
        for (uint64_t k = 0; k < n && !status; k++)
            values[i + k] = v->slope * number_at(piece + k * stride, v->scalar) + v->inter;
    }
    return status;
}

static int place_axis(const header *h, int fd, uint64_t dim, int axis, trip_volume_info *info)
{
    const variable *v = coordinates_of(h, dim);
    const uint64_t count = (uint64_t)info->dims[axis];
    if (!v || count > h->file_bytes)
        return 0;
    int status = trip_volume_check_axes(h->path, info);
    if (status)
        return status;
    double *values = calloc((size_t)count, sizeof *values);
    status = values ? read_coordinates(h, fd, v, values, count)
                    : trip_fail(TRIP_ERROR, "read", h->path, "out of memory for its coordinates");
    if (!status)
        status = trip_volume_set_coordinates(info, axis, values, h->path);
    free(values);
    return status;
}

static void describe(const header *h, const variable *v, trip_volume_info *info)
{
    int length = (int)(v->name.length < 60 ? v->name.length : 60);
    snprintf(info->name, sizeof info->name, "%.*s", length, v->name.at);
    unsigned others = 0;
    for (uint64_t i = 0; i < h->variable_count; i++)
        others += &h->variables[i] != v && volume_of(h, &h->variables[i]) > 0;
    if (others || v->dims > 5)
        snprintf(info->note, sizeof info->note, "variable \"%.*s\"%s%s", length, v->name.at,
                 others ? ", one of several (--grid NAME selects another)" : "",
                 v->dims > 5 ? ", at the first index of its other dimensions" : "");
}

/* Chooses the time and the channel from the first dimensions before the last three. Sets `record`
 * to the index of the record. Sets `volume` to the number of earlier volumes in the record. */
static int choose_entries(const header *h, const variable *v, const trip_volume_params *params,
                          trip_volume_info *info, uint64_t *record, uint64_t *volume)
{
    static const char *const names[] = { "time", "channel" };
    const int wanted[] = { params->time, params->channel };
    uint64_t step = 1;
    int status = 0;
    *record = *volume = 0;
    for (unsigned i = v->dims > 3 ? v->dims - 3 : 0; i-- > 0;) {
        const uint64_t size = size_of(h, v->dim[i]), index = i < 2 ? (uint64_t)wanted[i] : 0;
        if (i == 0 && has_records(h, v))
            *record = index;
        else
            *volume += index * step;
        if (__builtin_mul_overflow(step, size, &step) || size > INT64_MAX)
            return trip_fail(TRIP_ERROR, "read", h->path, "has impossibly many volumes");
    }
    for (unsigned i = 0; i < 2 && status == 0; i++) {
        const int64_t size = v->dims > 3 + i ? (int64_t)size_of(h, v->dim[i]) : 1;
        status = trip_volume_check_entry(h->path, names[i], wanted[i], size);
        trip_entry_note(info->note, sizeof info->note, names[i], wanted[i], size, "");
    }
    return status;
}

static int lay_out(const header *h, const variable *v, const trip_volume_params *params,
                   trip_volume_info *info, netcdf *n)
{
    uint64_t bytes = bytes_of(v), end, record, volume, volume_bytes;
    for (int a = 0; a < 3; a++) {
        uint64_t size = size_of(h, v->dim[v->dims - 1 - (unsigned)a]);
        info->dims[a] = size > INT64_MAX ? 0 : (int64_t)size;
    }
    info->type = n->stored = (trip_scalar)v->scalar;
    info->slope = v->slope;
    info->inter = v->inter;
    int status = trip_volume_check_dims(h->path, info);
    if (!status)
        status = choose_entries(h, v, params, info, &record, &volume);
    if (status)
        return status;
    n->values = (uint64_t)info->dims[0] * (uint64_t)info->dims[1];
    n->stride = has_records(h, v) && v->dims == 3 ? h->record_bytes : n->values * bytes;
    volume_bytes = n->values * (uint64_t)info->dims[2] * bytes;
    if (__builtin_mul_overflow(n->stride, (uint64_t)info->dims[2] - 1, &end) ||
        __builtin_add_overflow(end, n->values * bytes, &end) ||
        __builtin_mul_overflow(record, h->record_bytes, &record) ||
        __builtin_mul_overflow(volume, volume_bytes, &volume) ||
        __builtin_add_overflow(v->begin, record, &n->begin) ||
        __builtin_add_overflow(n->begin, volume, &n->begin) ||
        __builtin_add_overflow(end, n->begin, &end) || end > h->file_bytes)
        return trip_fail(TRIP_ERROR, "read", h->path,
                         "ends early, at byte %" PRIu64 ", within its variable", h->file_bytes);
    n->decoded = !isnan(v->missing[0]) || !isnan(v->missing[1]);
    for (int i = 0; i < 2; i++)
        n->missing[i] = (float)v->missing[i];
    info->type = n->decoded ? TRIP_F32 : info->type;
    return 0;
}

static void netcdf_close(void *state)
{
    netcdf *n = state;
    if (n->fd >= 0)
        close(n->fd);
    free(n->path);
    free(n);
}

static int open_variable(netcdf *n, const trip_volume_params *params, trip_volume_info *info)
{
    header h = { 0 };
    const variable *v;
    int status = read_header(&h, n->fd, n->path);
    if (!status)
        status = refuse_minc(&h);
    if (status == 0)
        status = refuse_exodus(&h);
    if (!status)
        status = choose_variable(&h, params->grid, &v);
    if (!status)
        describe(&h, v, info);
    if (!status)
        status = lay_out(&h, v, params, info, n);
    for (int a = 0; a < 3 && !status; a++)
        status = place_axis(&h, n->fd, v->dim[v->dims - 1 - (unsigned)a], a, info);
    free_header(&h);
    return status;
}

static int netcdf_open(const char *path, const trip_volume_params *params, trip_budget *budget,
                       trip_volume_info *info, void **state)
{
    (void)budget;
    netcdf *n = calloc(1, sizeof *n);
    if (!n || !(n->path = strdup(path))) {
        free(n);
        return trip_fail(TRIP_ERROR, "read", path, "out of memory");
    }
    n->fd = open(path, O_RDONLY | O_CLOEXEC);
    int status =
        n->fd < 0 ? trip_fail_errno("read", path, "cannot open") : open_variable(n, params, info);
    if (status)
        netcdf_close(n);
    else
        *state = n;
    return status;
}

static int netcdf_rewind(void *state)
{
    ((netcdf *)state)->next = 0;
    return 0;
}

/* Reads `count` values as floats. */
static int decode_values(const netcdf *n, uint64_t at, uint64_t count, float *to)
{
    unsigned char piece[PIECE_BYTES];
    const unsigned bytes = trip_scalar_bytes(n->stored);
    int status = 0;
    while (count > 0 && !status) {
        uint64_t some = count < PIECE_BYTES / bytes ? count : PIECE_BYTES / bytes;
        status = read_at(n->fd, n->path, at, piece, (size_t)(some * bytes));
        if (!status)
            trip_scalar_decode(n->stored, !trip_machine_is_big_endian(), 1, 0, piece, (size_t)some,
                               to);
        for (uint64_t i = 0; i < some && !status; i++)
            if (to[i] == n->missing[0] || to[i] == n->missing[1])
                to[i] = NAN;
        at += some * bytes;
        to += some;
        count -= some;
    }
    return status;
}

static int netcdf_read_slices(void *state, int64_t count, void *values)
{
    netcdf *n = state;
    const uint64_t bytes = trip_scalar_bytes(n->stored);
    int status = 0;
    for (int64_t i = 0; i < count && !status; i++, n->next++) {
        const uint64_t at = n->begin + (uint64_t)n->next * n->stride;
        const uint64_t to = (uint64_t)i * n->values;
        if (trip_interrupted())
            return trip_fail(TRIP_INTERRUPTED, "read", n->path, "interrupted");
        status = n->decoded ? decode_values(n, at, n->values, (float *)values + to)
                            : read_at(n->fd, n->path, at, (unsigned char *)values + to * bytes,
                                      (size_t)(n->values * bytes));
    }
    return status;
}

static int netcdf_skip_slices(void *state, int64_t count)
{
    ((netcdf *)state)->next += count;
    return 0;
}

static bool netcdf_swap(const void *state)
{
    return !((const netcdf *)state)->decoded && !trip_machine_is_big_endian();
}

const trip_volume_reader trip_read_netcdf = {
    .format = "netcdf",
    .probe = netcdf_probe,
    .open = netcdf_open,
    .close = netcdf_close,
    .rewind = netcdf_rewind,
    .read_slices = netcdf_read_slices,
    .skip_slices = netcdf_skip_slices,
    .swap = netcdf_swap,
};
