/* Reads Gaussian scenes in PLY as trainers write them (Kerbl et al. 2023): logarithms of
 * deviations, a logit of the opacity, spherical harmonics channel by channel. Scenes of 2D Gaussian
 * Splatting lack scale_2. Scenes of Mip-Splatting have filter_3D. */
#include "gaussian_file_internal.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "ply_header.h"
#include "report.h"

enum { BUFFER_BYTES = 1 << 18, REST_MAX = 45, CHANNELS = 3 };

typedef const trip_ply_property *property;

typedef struct ply {
    trip_ply_header header;
    const trip_ply_element *vertex;
    property centre[3], scales[3], rotation[4], opacity, filter;
    property dc[3], colour[3], rest[REST_MAX];
    int rest_per_channel; /* in the file, which may have higher degrees */
    trip_byte_stream *stream;
    unsigned char *rows;
    size_t room; /* rows that fit */
} ply;

static bool probe(const trip_gaussian_head *head)
{
    static const char *const names[] = { " scale_0", " rot_0", " f_dc_0" };
    if (head->count < 4 || memcmp(head->bytes, "ply", 3) != 0 ||
        (head->bytes[3] != '\n' && head->bytes[3] != '\r'))
        return false;
    const unsigned char *end = memmem(head->bytes, head->count, "end_header", 10);
    const size_t bytes = end ? (size_t)(end - head->bytes) : head->count;
    for (size_t i = 0; i < sizeof names / sizeof *names; i++)
        if (memmem(head->bytes, bytes, names[i], strlen(names[i])))
            return true;
    return false;
}

/* Finds NAME_0 and so on. Returns the number of them that exist. */
static int find(const ply *p, const char *name, property *out, int count)
{
    int found = 0;
    for (int i = 0; i < count; i++) {
        char full[TRIP_PLY_NAME_BYTES];
        snprintf(full, sizeof full, "%s_%d", name, i);
        out[i] = trip_ply_property_of(&p->header, p->vertex, full);
        found += out[i] != NULL;
    }
    return found;
}

static int lacks(const trip_gaussian_file *f, const char *name)
{
    return trip_fail(TRIP_ERROR, "read", f->path,
                     "lacks the property %s, which a Gaussian scene needs", name);
}

static property named(const ply *p, const char *name)
{
    return trip_ply_property_of(&p->header, p->vertex, name);
}

static int find_colour(const trip_gaussian_file *f, ply *p)
{
    static const char *const names[] = { "red", "green", "blue" };
    const int found = find(p, "f_dc", p->dc, 3);
    if (found == 3)
        return 0;
    memset(p->dc, 0, sizeof p->dc);
    for (int c = 0; c < 3; c++)
        if (found > 0 || !(p->colour[c] = named(p, names[c])))
            return lacks(f, "f_dc_0, f_dc_1 or f_dc_2");
    return 0;
}

/* Finds the coefficients beyond the constant one. They are stored channel by channel. */
static int find_rest(trip_gaussian_file *f, ply *p)
{
    int highest = 0, found = 0, degree = 0;
    for (uint32_t i = 0; i < p->vertex->properties; i++) {
        int number, used = 0;
        const char *name = p->header.properties[p->vertex->first + i].name;
        if (sscanf(name, "f_rest_%5d%n", &number, &used) != 1 || name[used] || number < 0)
            continue;
        found++;
        highest = number + 1 > highest ? number + 1 : highest;
    }
    while (degree < 10 && CHANNELS * (trip_sh_count(degree) - 1) < found)
        degree++;
    if (highest != found || CHANNELS * (trip_sh_count(degree) - 1) != found)
        return trip_fail(TRIP_ERROR, "read", f->path,
                         "has %d properties f_rest_*, up to f_rest_%d; spherical harmonics of "
                         "degree 1, 2 and 3 have 9, 24 and 45",
                         found, highest - 1);
    p->rest_per_channel = trip_sh_count(degree) - 1;
    f->info.degree = degree < TRIP_SH_DEGREE_MAX ? degree : TRIP_SH_DEGREE_MAX;
    if (degree > TRIP_SH_DEGREE_MAX)
        trip_warn(f->path,
                  "has spherical harmonics of degree %d; those above degree %d are left "
                  "out",
                  degree, TRIP_SH_DEGREE_MAX);
    const int kept = trip_sh_count(f->info.degree) - 1;
    for (int c = 0; c < CHANNELS; c++)
        for (int k = 0; k < kept; k++) {
            char name[TRIP_PLY_NAME_BYTES];
            snprintf(name, sizeof name, "f_rest_%d", c * p->rest_per_channel + k);
            if (!(p->rest[c * kept + k] = named(p, name)))
                return lacks(f, name);
        }
    return 0;
}

static int find_properties(trip_gaussian_file *f, ply *p)
{
    static const char *const axes[] = { "x", "y", "z" };
    for (int a = 0; a < 3; a++)
        if (!(p->centre[a] = named(p, axes[a])))
            return lacks(f, axes[a]);
    find(p, "scale", p->scales, 3);
    if (!p->scales[0] || !p->scales[1])
        return lacks(f, p->scales[0] ? "scale_1" : "scale_0");
    if (find(p, "rot", p->rotation, 4) < 4)
        return lacks(f, "rot_0, rot_1, rot_2 or rot_3");
    if (!(p->opacity = named(p, "opacity")))
        return lacks(f, "opacity");
    p->filter = named(p, "filter_3D");
    int status = find_colour(f, p);
    return status < 0 ? status : find_rest(f, p);
}

void trip_ply_describe(const trip_ply_header *h, trip_gaussian_file *f)
{
    snprintf(f->info.trainer, sizeof f->info.trainer, "%s", h->comments);
    f->info.antialiased = h->antialiased == 1;
    if (*h->up)
        memcpy(f->info.up, h->up, sizeof f->info.up);
}

static void describe(trip_gaussian_file *f, const ply *p)
{
    const trip_ply_header *h = &p->header;
    f->info.flat = !p->scales[2];
    f->info.format = f->info.flat ? "2DGS PLY" : "3DGS PLY";
    f->info.count = p->vertex->count;
    trip_ply_describe(h, f);
    f->info.antialiased =
        !f->info.flat && (h->antialiased < 0 ? p->filter != NULL : h->antialiased != 0);
}

static int open_ply(trip_gaussian_file *f)
{
    ply *p = f->state = calloc(1, sizeof *p);
    if (!p)
        return trip_gaussian_no_memory(f);
    int status = trip_ply_header_read(&p->header, f->path);
    if (status < 0)
        return status;
    p->vertex = trip_ply_element_of(&p->header, "vertex");
    if (!p->vertex)
        return trip_fail(TRIP_ERROR, "read", f->path, "lacks the element vertex");
    status = find_properties(f, p);
    if (status < 0)
        return status;
    describe(f, p);
    if (f->info.count == 0)
        return 0;
    p->room = BUFFER_BYTES / p->vertex->row_bytes + 1;
    if (!(p->rows = malloc(p->room * p->vertex->row_bytes)))
        return trip_gaussian_no_memory(f);
    return trip_ply_stream_open(&p->stream, &p->header, p->vertex, f->path);
}

static double value(const ply *p, property from, const unsigned char *row)
{
    return trip_ply_value(&p->header, from, row);
}

/* Adds the smoothing filter of Mip-Splatting to a Gaussian. Its total weight stays. */
static void widen(trip_gaussian *g, double filter)
{
    double before = 1, after = 1;
    for (int a = 0; a < 3; a++) {
        const double variance = (double)g->deviations[a] * g->deviations[a];
        before *= variance;
        after *= variance + filter * filter;
        g->deviations[a] = (float)sqrt(variance + filter * filter);
    }
    if (after > 0)
        g->opacity = (float)(g->opacity * sqrt(before / after));
}

static float colour_of(const ply *p, property from, const unsigned char *row)
{
    const bool whole = from->stated_type == TRIP_U8;
    return trip_sh_of_colour(value(p, from, row) / (whole ? 255 : 1));
}

static void decode(const trip_gaussian_file *f, const unsigned char *row, trip_gaussian *g)
{
    const ply *p = f->state;
    const int kept = trip_sh_count(f->info.degree) - 1;
    for (int a = 0; a < 3; a++) {
        g->centre[a] = value(p, p->centre[a], row);
        g->deviations[a] = p->scales[a] ? (float)exp(value(p, p->scales[a], row)) : 0;
    }
    for (int i = 0; i < 4; i++)
        g->rotation[i] = (float)value(p, p->rotation[i], row);
    g->opacity = trip_sigmoid(value(p, p->opacity, row));
    for (int c = 0; c < CHANNELS; c++)
        g->sh[0][c] = p->dc[c] ? (float)value(p, p->dc[c], row) : colour_of(p, p->colour[c], row);
    for (int c = 0; c < CHANNELS; c++)
        for (int k = 0; k < kept; k++)
            g->sh[k + 1][c] = (float)value(p, p->rest[c * kept + k], row);
    if (p->filter && !f->info.flat)
        widen(g, value(p, p->filter, row));
}

static int read_ply(trip_gaussian_file *f, trip_gaussian *out, size_t count)
{
    ply *p = f->state;
    for (size_t done = 0; done < count;) {
        const size_t n = count - done < p->room ? count - done : p->room;
        int status = trip_byte_stream_read(p->stream, p->rows, n * p->vertex->row_bytes);
        if (status < 0)
            return status;
        for (size_t i = 0; i < n; i++)
            decode(f, p->rows + i * p->vertex->row_bytes, &out[done + i]);
        done += n;
    }
    return 0;
}

static int rewind_ply(trip_gaussian_file *f)
{
    const ply *p = f->state;
    return trip_ply_stream_rewind(p->stream, &p->header, p->vertex);
}

static void close_ply(trip_gaussian_file *f)
{
    ply *p = f->state;
    if (!p)
        return;
    trip_byte_stream_close(p->stream);
    trip_ply_header_release(&p->header);
    free(p->rows);
    free(p);
}

const trip_gaussian_reader trip_read_gaussian_ply = { probe, open_ply, read_ply, rewind_ply,
                                                      close_ply };
