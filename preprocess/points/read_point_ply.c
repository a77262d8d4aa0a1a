/* Reads clouds of points in PLY: text or binary in either byte order, properties of any type in any
 * order. Faces and other elements after the vertices are ignored. The range_grid of a Stanford scan
 * gives the size of its grid. */
#include "point_file_internal.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "ply_header.h"
#include "report.h"

enum { BUFFER_BYTES = 1 << 18 };

typedef enum field {
    X,
    Y,
    Z,
    NX,
    NY,
    NZ,
    RED,
    GREEN,
    BLUE,
    RADIUS,
    INTENSITY,
    CLASSIFICATION,
    RETURN_NUMBER,
    RETURNS,
    GPS_TIME,
    FIELDS
} field;

/* The names of each field, in lower case. "scalar_" in front of a name does not count. */
static const char *const names[FIELDS][6] = {
    [X] = { "x" },
    [Y] = { "y" },
    [Z] = { "z" },
    [NX] = { "nx", "normal_x" },
    [NY] = { "ny", "normal_y" },
    [NZ] = { "nz", "normal_z" },
    [RED] = { "red", "diffuse_red", "r" },
    [GREEN] = { "green", "diffuse_green", "g" },
    [BLUE] = { "blue", "diffuse_blue", "b" },
    [RADIUS] = { "radius", "pscale", "point_radius" },
    [INTENSITY] = { "intensity", "reflectance" },
    [CLASSIFICATION] = { "classification", "class" },
    [RETURN_NUMBER] = { "return_number", "returnnumber" },
    [RETURNS] = { "number_of_returns", "numberofreturns", "num_returns" },
    [GPS_TIME] = { "gps_time", "gpstime", "timestamp" },
};

typedef struct ply {
    trip_ply_header header;
    const trip_ply_element *vertex;
    const trip_ply_property *fields[FIELDS];
    float colour_unit; /* divides the colours */
    trip_byte_stream *stream;
    uint64_t done;
    unsigned char *rows;
    size_t room; /* rows that fit */
} ply;

/* Gaussian scenes in PLY have other readers. */
static bool probe(const trip_point_head *head)
{
    static const char *const gaussian[] = { " scale_0", " rot_0", " f_dc_0", " packed_position" };
    if (head->count < 4 || memcmp(head->bytes, "ply", 3) != 0 ||
        (head->bytes[3] != '\n' && head->bytes[3] != '\r'))
        return false;
    const unsigned char *end = memmem(head->bytes, head->count, "end_header", 10);
    const size_t bytes = end ? (size_t)(end - head->bytes) : head->count;
    for (size_t i = 0; i < sizeof gaussian / sizeof *gaussian; i++)
        if (memmem(head->bytes, bytes, gaussian[i], strlen(gaussian[i])))
            return false;
    return true;
}

static int field_of(const char *name)
{
    if (strncasecmp(name, "scalar_", 7) == 0)
        name += 7;
    for (int i = 0; i < FIELDS; i++)
        for (size_t k = 0; k < sizeof names[i] / sizeof *names[i] && names[i][k]; k++)
            if (strcasecmp(name, names[i][k]) == 0)
                return i;
    return FIELDS;
}

static bool has(const ply *p, field first, int count)
{
    for (int i = 0; i < count; i++)
        if (!p->fields[first + i])
            return false;
    return true;
}

static int find_fields(trip_point_file *f, ply *p)
{
    for (uint32_t i = 0; i < p->vertex->properties; i++) {
        const trip_ply_property *property = &p->header.properties[p->vertex->first + i];
        const int found = field_of(property->name);
        if (found < FIELDS && !p->fields[found])
            p->fields[found] = property;
        else if (strcasecmp(property->name, "alpha") != 0)
            trip_point_add_extra(f, property->name);
    }
    for (int a = 0; a < 3; a++)
        if (!p->fields[X + a])
            return trip_fail(TRIP_ERROR, "read", f->path,
                             "lacks the property %c, which a cloud of points needs", 'x' + a);
    f->info.attributes |=
        (has(p, NX, 3) ? TRIP_POINT_NORMAL : 0) | (has(p, RED, 3) ? TRIP_POINT_COLOUR : 0) |
        (has(p, RADIUS, 1) ? TRIP_POINT_RADIUS : 0) |
        (has(p, INTENSITY, 1) ? TRIP_POINT_INTENSITY : 0) |
        (has(p, CLASSIFICATION, 1) ? TRIP_POINT_CLASSIFICATION : 0) |
        (has(p, RETURNS, 1) || has(p, RETURN_NUMBER, 1) ? TRIP_POINT_RETURNS : 0) |
        (has(p, GPS_TIME, 1) ? TRIP_POINT_TIME : 0);
    return 0;
}

/* Bytes and 16 bits are whole ranges. Floats are 0 to 1, or another range that the values tell. */
static void find_colours(trip_point_file *f, ply *p)
{
    if (!(f->info.attributes & TRIP_POINT_COLOUR))
        return;
    const trip_scalar type = p->fields[RED]->stated_type;
    p->colour_unit = type == TRIP_U8 ? 255 : 1;
    if (type != TRIP_U8)
        f->colour_form =
            type == TRIP_F32 || type == TRIP_F64 ? TRIP_COLOUR_FLOAT : TRIP_COLOUR_SIXTEEN;
}

/* Reads the number after a name in the comments, or 0. */
static uint64_t number_after(const char *comments, const char *name)
{
    const char *at = strstr(comments, name);
    return at ? strtoull(at + strlen(name), NULL, 10) : 0;
}

static int find_grid(trip_point_file *f, const ply *p)
{
    const trip_ply_element *grid = trip_ply_element_of(&p->header, "range_grid");
    if (!grid)
        return 0;
    const uint64_t width = number_after(p->header.comments, "num_cols "),
                   height = number_after(p->header.comments, "num_rows ");
    if (width == 0 || height > grid->count || width > grid->count ||
        width * height != grid->count) {
        trip_point_note(f,
                        "the range grid has %" PRIu64 " cells, but the header states no size "
                        "that fits it; it is ignored",
                        grid->count);
        return 0;
    }
    trip_point_scan *scan = trip_point_add_scans(f, 1);
    if (!scan)
        return TRIP_ERROR;
    scan->width = width;
    scan->height = height;
    return 0;
}

static void note_faces(trip_point_file *f, const ply *p)
{
    const trip_ply_element *faces = trip_ply_element_of(&p->header, "face");
    if (faces && faces->count > 0)
        trip_point_note(f, "the file is a mesh; its %" PRIu64 " faces are ignored", faces->count);
}

static int describe(trip_point_file *f, ply *p)
{
    const trip_ply_header *h = &p->header;
    const bool little = h->swap == (__BYTE_ORDER__ == __ORDER_BIG_ENDIAN__);
    p->vertex = trip_ply_element_of(h, "vertex");
    if (!p->vertex)
        return trip_fail(TRIP_ERROR, "read", f->path, "lacks the element vertex");
    snprintf(f->info.format, sizeof f->info.format, "PLY, %s",
             h->text  ? "text"
             : little ? "little-endian"
                      : "big-endian");
    snprintf(f->info.comments, sizeof f->info.comments, "%s", h->comments);
    f->info.count = p->vertex->count;
    if (p->vertex->count == 0)
        return trip_fail(TRIP_ERROR, "read", f->path, "holds no points");
    int status = find_fields(f, p);
    if (status < 0)
        return status;
    find_colours(f, p);
    note_faces(f, p);
    return find_grid(f, p);
}

static int open_ply(trip_point_file *f)
{
    ply *p = f->state = calloc(1, sizeof *p);
    if (!p)
        return trip_point_no_memory(f);
    int status = trip_ply_header_read(&p->header, f->path);
    if (status == 0)
        status = describe(f, p);
    if (status < 0)
        return status;
    p->room = BUFFER_BYTES / p->vertex->row_bytes + 1;
    if (!(p->rows = malloc(p->room * p->vertex->row_bytes)))
        return trip_point_no_memory(f);
    return trip_ply_stream_open(&p->stream, &p->header, p->vertex, f->path);
}

static double value(const ply *p, field from, const unsigned char *row)
{
    return p->fields[from] ? trip_ply_value(&p->header, p->fields[from], row) : 0;
}

static uint8_t byte_of(double v)
{
    return v >= 0 && v < 255.5 ? (uint8_t)v : 0;
}

static void decode(const trip_point_file *f, const unsigned char *row, trip_point *out)
{
    const ply *p = f->state;
    const unsigned has_bits = f->info.attributes;
    for (int a = 0; a < 3; a++)
        out->position[a] = value(p, X + a, row);
    for (int a = 0; a < 3 && has_bits & TRIP_POINT_NORMAL; a++)
        out->normal[a] = (float)value(p, NX + a, row);
    for (int c = 0; c < 3 && has_bits & TRIP_POINT_COLOUR; c++)
        out->colour[c] = (float)value(p, RED + c, row) / p->colour_unit;
    out->radius = (float)value(p, RADIUS, row);
    out->intensity = (float)value(p, INTENSITY, row);
    out->classification = byte_of(value(p, CLASSIFICATION, row));
    out->return_number = byte_of(value(p, RETURN_NUMBER, row));
    out->returns = byte_of(value(p, RETURNS, row));
    out->gps_time = value(p, GPS_TIME, row);
}

static int read_ply(trip_point_file *f, trip_point *out, size_t room, size_t *got_out)
{
    ply *p = f->state;
    const uint64_t left = p->vertex->count - p->done;
    size_t count = room < p->room ? room : p->room;
    if (left < count)
        count = (size_t)left;
    *got_out = count;
    if (count == 0)
        return 0;
    int status = trip_byte_stream_read(p->stream, p->rows, count * p->vertex->row_bytes);
    if (status < 0)
        return status;
    for (size_t i = 0; i < count; i++)
        decode(f, p->rows + i * p->vertex->row_bytes, &out[i]);
    p->done += count;
    return 0;
}

static int rewind_ply(trip_point_file *f)
{
    ply *p = f->state;
    p->done = 0;
    return trip_ply_stream_rewind(p->stream, &p->header, p->vertex);
}

static void close_ply(trip_point_file *f)
{
    ply *p = f->state;
    if (!p)
        return;
    trip_byte_stream_close(p->stream);
    trip_ply_header_release(&p->header);
    free(p->rows);
    free(p);
}

const trip_point_reader trip_read_point_ply = { probe, open_ply, read_ply, rewind_ply, close_ply };
