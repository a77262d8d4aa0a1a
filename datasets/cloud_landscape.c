#include "landscape.h"

#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "interrupt.h"
#include "new_file.h"
#include "point_file.h"
#include "report.h"

enum {
    HEADER_BYTES = 375,
    RECORD_BYTES = 20, /* of point format 0; format 2 has a colour behind it */
    COLOUR_BYTES = 6,
    BUFFER_RECORDS = 1 << 14,
    BATCH = 1024,
    RETURNS = 15,
    GROUND_CLASS = 2,
};

typedef struct planted {
    double position[3];
    uint16_t colour[3], intensity;
    uint8_t returns, classification; /* as in a record */
} planted;

typedef struct cloud {
    planted *points;
    uint64_t count;
    trip_upright upright;
} cloud;

typedef struct landscape {
    const char *output;
    FILE *file;
    bool coloured;
    size_t record_bytes, used; /* records that wait for writing */
    unsigned char *records;
    uint64_t count, left, of_return[RETURNS];
    int32_t lo[3], hi[3];
    uint64_t ground; /* points along a side of a cell */
    cloud clouds[TRIP_LANDSCAPE_SCENES_MAX];
    int cloud_count;
} landscape;

/* ---- the clouds ---- */

static uint16_t sixteen_bits(double value)
{
    return (uint16_t)lrint(fmin(fmax(value, 0), 65535));
}

static planted planted_of(const trip_point *p)
{
    const unsigned number = p->return_number & 7u, returns = p->returns & 7u;
    planted made = { .intensity = sixteen_bits((double)p->intensity),
                     .returns = (uint8_t)(number | returns << 3),
                     .classification = p->classification & 31u };
    memcpy(made.position, p->position, sizeof made.position);
    for (int c = 0; c < 3; c++)
        made.colour[c] = sixteen_bits((double)p->colour[c] * 65535);
    return made;
}

static int read_points(trip_point_file *f, cloud *c, uint64_t room)
{
    trip_point batch[BATCH];
    size_t got = 1;
    int status = 0;
    while (!status && got > 0) {
        status = trip_point_file_read(f, batch, BATCH, &got);
        for (size_t i = 0; i < got && !status && c->count < room; i++)
            c->points[c->count++] = planted_of(&batch[i]);
    }
    return status;
}

static int add_cloud(landscape *l, const char *path)
{
    trip_point_file *f;
    cloud *c = &l->clouds[l->cloud_count++];
    int status = trip_point_file_open(path, &f);
    if (status)
        return status;
    const trip_point_info *info = trip_point_file_info(f);
    char up[3];
    status = trip_point_file_survey(f);
    if (!status) {
        c->points = malloc(info->points * sizeof *c->points);
        status = c->points ? read_points(f, c, info->points)
                           : trip_fail(TRIP_ERROR, "generate", path, "out of memory");
    }
    if (!status) {
        l->coloured = l->coloured || info->attributes & TRIP_POINT_COLOUR;
        trip_point_up(info, up);
        status = trip_upright_find(&c->upright, c->points->position, sizeof *c->points, c->count,
                                   up, path);
    }
    trip_point_file_close(f);
    return status;
}

/* ---- records ---- */

static unsigned char *put_number(unsigned char *to, uint64_t value, unsigned bytes)
{
    for (unsigned i = 0; i < bytes; i++)
        *to++ = (unsigned char)(value >> 8 * i);
    return to;
}

static unsigned char *put_double(unsigned char *to, double value)
{
    uint64_t bits;
    memcpy(&bits, &value, sizeof bits);
    return put_number(to, bits, 8);
}

static int flush(landscape *l)
{
    const size_t count = l->used;
    l->used = 0;
    return fwrite(l->records, l->record_bytes, count, l->file) == count
               ? 0
               : trip_fail_errno("generate", l->output, "cannot write");
}

/* Writes a point at a place of the landscape. */
static int put(landscape *l, const double at[3], const planted *p)
{
    unsigned char *r = l->records + l->used * l->record_bytes;
    const double turned[3] = { at[0], at[2], -at[1] };
    const unsigned number = p->returns & 7u;
    for (int a = 0; a < 3; a++) {
        const double steps = turned[a] * (TRIP_LANDSCAPE_UNIT / TRIP_LANDSCAPE_STEP);
        if (!(fabs(steps) < INT32_MAX))
            return trip_fail(TRIP_ERROR, "generate", l->output,
                             "so many points reach further than LAS can state");
        const int32_t code = (int32_t)lrint(steps);
        l->lo[a] = code < l->lo[a] ? code : l->lo[a];
        l->hi[a] = code > l->hi[a] ? code : l->hi[a];
        r = put_number(r, (uint32_t)code, 4);
    }
    r = put_number(r, p->intensity, 2);
    *r++ = p->returns;
    *r++ = p->classification;
    r = put_number(r, 0, 4); /* angle, user data, source */
    for (int c = 0; c < 3 && l->coloured; c++)
        r = put_number(r, p->colour[c], 2);
    l->of_return[number > 0 ? number - 1 : 0] += number > 0;
    l->left--;
    return ++l->used < BUFFER_RECORDS ? 0 : flush(l);
}

/* ---- the cells ---- */

static const cloud *cloud_of(const landscape *l, uint64_t cell)
{
    return &l->clouds[trip_scatter_hash(cell * 8) % (unsigned)l->cloud_count];
}

static int put_ground(landscape *l, uint64_t cell, double x0, double z0)
{
    const double step = TRIP_LANDSCAPE_CELL / (double)l->ground;
    const uint64_t points = l->ground * l->ground;
    planted p = { .returns = 1 | 1 << 3, .classification = GROUND_CLASS };
    int status = 0;
    for (uint64_t i = 0; i < points && l->left > 0 && !status; i++) {
        const uint64_t moved = trip_scatter_hash(cell * points + i);
        const double x = x0 + ((double)(i / l->ground) + (double)(moved >> 32) * 0x1p-32) * step;
        const double z =
            z0 + ((double)(i % l->ground) + (double)(moved & UINT32_MAX) * 0x1p-32) * step;
        double rgb[3];
        trip_ground_colour(x, z, rgb);
        for (int c = 0; c < 3; c++)
            p.colour[c] = sixteen_bits(rgb[c] * 65535);
        p.intensity = sixteen_bits(rgb[1] * 255);
        status = put(l, (const double[3]){ x, -trip_landscape_height(x, z), z }, &p);
    }
    return status;
}

static int put_copy(landscape *l, uint64_t cell, double x, double z)
{
    const cloud *c = cloud_of(l, cell);
    double m[3][4];
    int status = 0;
    trip_cell_transform(cell, x, z, &c->upright, m);
    for (uint64_t n = 0; n < c->count && l->left > 0 && !status; n++) {
        const double *p = c->points[n].position;
        double at[3];
        for (int i = 0; i < 3; i++)
            at[i] = m[i][0] * p[0] + m[i][1] * p[1] + m[i][2] * p[2] + m[i][3];
        status = put(l, at, &c->points[n]);
    }
    return status;
}

/* Returns the number of cells along a side that holds all points. */
static uint64_t side_of(const landscape *l, uint64_t count)
{
    uint64_t held = 0, cells = 0;
    for (; held < count; cells++)
        held += l->ground * l->ground + cloud_of(l, cells)->count;
    const uint64_t side = (uint64_t)sqrt((double)cells);
    return side * side < cells ? side + 1 : side;
}

static int put_cells(landscape *l)
{
    const uint64_t side = side_of(l, l->left);
    int status = 0;
    for (uint64_t cell = 0; l->left > 0 && !status; cell++) {
        const double x = TRIP_LANDSCAPE_CELL * (double)(cell / side);
        const double z = TRIP_LANDSCAPE_CELL * (double)(cell % side);
        status = trip_interrupted()
                     ? trip_fail(TRIP_INTERRUPTED, "generate", l->output, "interrupted")
                     : put_ground(l, cell, x, z);
        if (!status)
            status = put_copy(l, cell, x + TRIP_LANDSCAPE_CELL / 2, z + TRIP_LANDSCAPE_CELL / 2);
    }
    return status ? status : flush(l);
}

/* ---- the file ---- */

static void make_header(const landscape *l, unsigned char h[HEADER_BYTES])
{
    static const double offset[3] = { TRIP_LANDSCAPE_EAST, TRIP_LANDSCAPE_NORTH, 0 };
    const bool few = l->count <= UINT32_MAX;
    unsigned char *p = h + 94;
    memset(h, 0, HEADER_BYTES);
    memcpy(h, "LASF", 4);
    h[24] = 1;
    h[25] = 4;
    memcpy(h + 26, "OTHER", 5);
    memcpy(h + 58, "triptych-generate", 17);
    p = put_number(p, HEADER_BYTES, 2);
    p = put_number(p, HEADER_BYTES, 4); /* where the points begin */
    p = put_number(p, 0, 4);
    *p++ = l->coloured ? 2 : 0;
    p = put_number(p, l->record_bytes, 2);
    p = put_number(p, few ? l->count : 0, 4);
    for (int i = 0; i < 5; i++)
        p = put_number(p, few ? l->of_return[i] : 0, 4);
    for (int a = 0; a < 3; a++)
        p = put_double(p, TRIP_LANDSCAPE_STEP);
    for (int a = 0; a < 3; a++)
        p = put_double(p, offset[a]);
    for (int a = 0; a < 3; a++) {
        p = put_double(p, l->hi[a] * TRIP_LANDSCAPE_STEP + offset[a]);
        p = put_double(p, l->lo[a] * TRIP_LANDSCAPE_STEP + offset[a]);
    }
    p = put_number(h + 247, l->count, 8);
    for (int i = 0; i < RETURNS; i++)
        p = put_number(p, l->of_return[i], 8);
}

static int write_header(const landscape *l)
{
    unsigned char header[HEADER_BYTES];
    make_header(l, header);
    return fseek(l->file, 0, SEEK_SET) == 0 && fwrite(header, sizeof header, 1, l->file) == 1
               ? 0
               : trip_fail_errno("generate", l->output, "cannot write");
}

static int write_file(landscape *l, const char *path)
{
    l->file = fopen(path, "wb");
    if (!l->file)
        return trip_fail_errno("generate", l->output, "cannot create");
    int status = write_header(l);
    if (!status)
        status = put_cells(l);
    if (!status)
        status = write_header(l);
    if (fclose(l->file) != 0 && !status)
        status = trip_fail_errno("generate", l->output, "cannot write");
    return status;
}

static int write_landscape(landscape *l)
{
    trip_new_file file;
    uint64_t all = 0;
    for (int n = 0; n < l->cloud_count; n++)
        all += l->clouds[n].count;
    l->ground = (uint64_t)sqrt((double)all / l->cloud_count / 4);
    if (l->ground < TRIP_LANDSCAPE_GROUND)
        l->ground = TRIP_LANDSCAPE_GROUND;
    l->record_bytes = RECORD_BYTES + (l->coloured ? COLOUR_BYTES : 0);
    l->records = malloc(BUFFER_RECORDS * l->record_bytes);
    if (!l->records)
        return trip_fail(TRIP_ERROR, "generate", l->output, "out of memory");
    int status = trip_new_file_begin(&file, "generate", l->output);
    if (status)
        return status;
    status = write_file(l, file.temporary);
    if (!status)
        return trip_new_file_finish(&file);
    trip_new_file_abandon(&file);
    return status;
}

int trip_cloud_landscape_write(const char *output, const char *const *clouds, int cloud_count,
                               uint64_t count)
{
    landscape l = { .output = output,
                    .count = count,
                    .left = count,
                    .lo = { INT32_MAX, INT32_MAX, INT32_MAX },
                    .hi = { INT32_MIN, INT32_MIN, INT32_MIN } };
    int status = 0;
    for (int n = 0; n < cloud_count && !status; n++)
        status = add_cloud(&l, clouds[n]);
    if (!status)
        status = write_landscape(&l);
    for (int n = 0; n < l.cloud_count; n++)
        free(l.clouds[n].points);
    free(l.records);
    return status;
}
