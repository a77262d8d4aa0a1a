/* Reads clouds of points in PLY: text or binary in either byte order, properties of any type in any
 * order. Faces and other elements after the vertices are ignored. The range_grid of a Stanford scan
 * gives the size of its grid. The rays of such a scan are parallel, and go along -z. */
#include "point_file_internal.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "ply_header.h"
#include "point_fields.h"
#include "report.h"

enum { BUFFER_BYTES = 1 << 18 };

/* The place along z of a scanner with parallel rays. */
#define FAR_AWAY 1e6

typedef struct ply {
    trip_ply_header header;
    const trip_ply_element *vertex;
    const trip_ply_property *fields[TRIP_FIELDS]; /* NULL for an absent one */
    float colour_unit;                            /* divides the colours */
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

static int find_fields(trip_point_file *f, ply *p)
{
    unsigned found = 0;
    for (uint32_t i = 0; i < p->vertex->properties; i++) {
        const trip_ply_property *property = &p->header.properties[p->vertex->first + i];
        const trip_point_field field = trip_point_field_of(property->name);
        if (field < TRIP_FIELDS && !p->fields[field]) {
            p->fields[field] = property;
            found |= 1u << field;
        } else if (strcasecmp(property->name, "alpha") != 0) {
            trip_point_add_extra(f, property->name);
        }
    }
    for (int a = 0; a < 3; a++)
        if (!p->fields[TRIP_FIELD_X + a])
            return trip_fail(TRIP_ERROR, "read", f->path,
                             "lacks the property %c, which a cloud of points needs", 'x' + a);
    f->info.attributes = trip_point_attributes_of(found);
    return 0;
}

/* Bytes and 16 bits are whole ranges. Floats are 0 to 1, or another range that the values tell. */
static void find_colours(trip_point_file *f, ply *p)
{
    p->colour_unit = 1;
    if (!(f->info.attributes & TRIP_POINT_COLOUR))
        return;
    const trip_scalar type = p->fields[TRIP_FIELD_RED]->stated_type;
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
    trip_point_scan *scan = trip_point_add_scan(f);
    if (!scan)
        return TRIP_ERROR;
    scan->width = width;
    scan->height = height;
    scan->posed = number_after(p->header.comments, "is_cyberware_data ") == 1;
    scan->scanner[2] = scan->posed ? FAR_AWAY : 0;
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

static void decode(const ply *p, const unsigned char *row, trip_point *out)
{
    for (int i = 0; i < TRIP_FIELDS; i++)
        if (p->fields[i])
            trip_point_set(out, i, trip_ply_value(&p->header, p->fields[i], row));
    for (int c = 0; c < 3; c++)
        out->colour[c] /= p->colour_unit;
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
        decode(p, p->rows + i * p->vertex->row_bytes, &out[i]);
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
