/* Reads Gaussian scenes in the compressed PLY of PlayCanvas. The first element has bounds of
 * centres, log scales and perhaps colours, for each 256 Gaussians. The second one has four words
 * for each Gaussian. A third one may have a byte for each coefficient of a degree above 0. A stream
 * for each element keeps memory bounded. */
#include "gaussian_file_internal.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "ply_header.h"
#include "report.h"

enum { CHUNK = 256, CHANNELS = 3, REST_MAX = 45, VALUES = 9 };

typedef enum stream { CHUNKS, VERTICES, HARMONICS, STREAMS } stream;

typedef const trip_ply_property *property;

typedef struct compressed {
    trip_ply_header header;
    const trip_ply_element *elements[STREAMS];
    trip_byte_stream *streams[STREAMS];
    unsigned char *rows[STREAMS];    /* of one chunk */
    property lo[VALUES], hi[VALUES]; /* of the centre, the log scale and the colour */
    property words[4], rest[REST_MAX];
    bool coloured;
    size_t used, room; /* Gaussians of the chunk */
    double range[VALUES][2];
} compressed;

static const char *const words[] = { "packed_position", "packed_rotation", "packed_scale",
                                     "packed_color" };
static const char *const values[VALUES] = { "x",       "y", "z", "scale_x", "scale_y",
                                            "scale_z", "r", "g", "b" };

static bool probe(const trip_gaussian_head *head)
{
    if (head->count < 4 || memcmp(head->bytes, "ply", 3) != 0)
        return false;
    const unsigned char *end = memmem(head->bytes, head->count, "end_header", 10);
    const size_t bytes = end ? (size_t)(end - head->bytes) : head->count;
    return memmem(head->bytes, bytes, " chunk ", 7) &&
           memmem(head->bytes, bytes, words[0], strlen(words[0]));
}

static int lacks(const trip_gaussian_file *f, const char *name)
{
    return trip_fail(TRIP_ERROR, "read", f->path,
                     "lacks %s, which a compressed Gaussian scene needs", name);
}

static int find_bounds(const trip_gaussian_file *f, compressed *c)
{
    for (int i = 0; i < VALUES; i++) {
        char lo[16], hi[16];
        snprintf(lo, sizeof lo, "min_%s", values[i]);
        snprintf(hi, sizeof hi, "max_%s", values[i]);
        c->lo[i] = trip_ply_property_of(&c->header, c->elements[CHUNKS], lo);
        c->hi[i] = trip_ply_property_of(&c->header, c->elements[CHUNKS], hi);
        const bool found = c->lo[i] && c->hi[i];
        c->coloured = i == 6 ? found : c->coloured;
        if (!found && (i < 6 || c->coloured))
            return lacks(f, c->lo[i] ? hi : lo);
    }
    return 0;
}

static int find_words(const trip_gaussian_file *f, compressed *c)
{
    for (int i = 0; i < 4; i++) {
        c->words[i] = trip_ply_property_of(&c->header, c->elements[VERTICES], words[i]);
        if (!c->words[i])
            return lacks(f, words[i]);
        if (c->words[i]->stated_type != TRIP_U32)
            return trip_fail(TRIP_ERROR, "read", f->path, "%s is not of the type uint", words[i]);
    }
    return 0;
}

static int find_harmonics(trip_gaussian_file *f, compressed *c)
{
    const trip_ply_element *e = c->elements[HARMONICS];
    int degree = 0;
    if (!e)
        return 0;
    while (degree < TRIP_SH_DEGREE_MAX &&
           CHANNELS * ((uint32_t)trip_sh_count(degree) - 1) < e->properties)
        degree++;
    if (CHANNELS * ((uint32_t)trip_sh_count(degree) - 1) != e->properties)
        return trip_fail(TRIP_ERROR, "read", f->path,
                         "has %" PRIu32 " properties f_rest_*; spherical harmonics of degree 1, 2 "
                         "and 3 have 9, 24 and 45",
                         e->properties);
    f->info.degree = degree;
    for (uint32_t i = 0; i < e->properties; i++) {
        char name[16];
        snprintf(name, sizeof name, "f_rest_%" PRIu32, i);
        if (!(c->rest[i] = trip_ply_property_of(&c->header, e, name)))
            return lacks(f, name);
        if (c->rest[i]->stated_type != TRIP_U8)
            return trip_fail(TRIP_ERROR, "read", f->path, "%s is not of the type uchar", name);
    }
    return 0;
}

static int check_counts(const trip_gaussian_file *f, const compressed *c)
{
    const uint64_t count = c->elements[VERTICES]->count;
    const uint64_t needed = count / CHUNK + (count % CHUNK > 0);
    if (c->elements[CHUNKS]->count != needed)
        return trip_fail(TRIP_ERROR, "read", f->path,
                         "states %" PRIu64 " chunks, but %" PRIu64 " Gaussians have %" PRIu64,
                         c->elements[CHUNKS]->count, count, needed);
    if (c->elements[HARMONICS] && c->elements[HARMONICS]->count != count)
        return trip_fail(TRIP_ERROR, "read", f->path,
                         "states harmonics of %" PRIu64 " Gaussians, but has %" PRIu64,
                         c->elements[HARMONICS]->count, count);
    return 0;
}

static int open_streams(trip_gaussian_file *f, compressed *c)
{
    for (stream i = 0; i < STREAMS; i++) {
        const trip_ply_element *e = c->elements[i];
        if (!e)
            continue;
        if (!(c->rows[i] = malloc((i == CHUNKS ? 1 : CHUNK) * (size_t)e->row_bytes + 1)))
            return trip_gaussian_no_memory(f);
        int status = trip_ply_stream_open(&c->streams[i], &c->header, e, f->path);
        if (status < 0)
            return status;
    }
    return 0;
}

static int open_compressed(trip_gaussian_file *f)
{
    static const char *const names[] = { "chunk", "vertex", "sh" };
    compressed *c = f->state = calloc(1, sizeof *c);
    if (!c)
        return trip_gaussian_no_memory(f);
    f->info.format = "compressed PLY";
    int status = trip_ply_header_read(&c->header, f->path);
    for (stream i = 0; i < STREAMS && status == 0; i++) {
        c->elements[i] = trip_ply_element_of(&c->header, names[i]);
        if (!c->elements[i] && i != HARMONICS)
            status = lacks(f, names[i]);
    }
    if (status == 0)
        status = find_bounds(f, c);
    if (status == 0)
        status = find_words(f, c);
    if (status == 0)
        status = find_harmonics(f, c);
    if (status == 0)
        status = check_counts(f, c);
    if (status < 0)
        return status;
    f->info.count = c->elements[VERTICES]->count;
    trip_ply_describe(&c->header, f);
    return f->info.count ? open_streams(f, c) : 0;
}

/* Returns bits of a word as a number from 0 to 1. */
static double part(uint32_t word, int shift, int bits)
{
    const uint32_t most = (1u << bits) - 1;
    return (double)(word >> shift & most) / most;
}

static double between(const compressed *c, int value, double t)
{
    return c->range[value][0] * (1 - t) + c->range[value][1] * t;
}

/* The word holds the number of the largest component and the three others, within sqrt(1/2). */
static void decode_rotation(uint32_t word, float q[4])
{
    const int largest = (int)(word >> 30);
    double rest = 1;
    for (int i = 0, shift = 20; i < 4; i++) {
        if (i == largest)
            continue;
        const double v = (part(word, shift, 10) - 0.5) * M_SQRT2;
        q[i] = (float)v;
        rest -= v * v;
        shift -= 10;
    }
    q[largest] = rest > 0 ? (float)sqrt(rest) : 0;
}

static float decode_coefficient(double byte)
{
    const double t = byte <= 0 ? 0 : byte >= 255 ? 1 : (byte + 0.5) / 256;
    return (float)((t - 0.5) * 8);
}

static void decode(const trip_gaussian_file *f, const compressed *c, size_t i, trip_gaussian *g)
{
    static const int shifts[] = { 21, 11, 0 }, bits[] = { 11, 10, 11 };
    const unsigned char *row = c->rows[VERTICES] + i * c->elements[VERTICES]->row_bytes;
    uint32_t w[4];
    for (int k = 0; k < 4; k++)
        w[k] = (uint32_t)trip_ply_value(&c->header, c->words[k], row);
    for (int a = 0; a < 3; a++) {
        const double colour = part(w[3], 24 - 8 * a, 8);
        g->centre[a] = between(c, a, part(w[0], shifts[a], bits[a]));
        g->deviations[a] = (float)exp(between(c, 3 + a, part(w[2], shifts[a], bits[a])));
        g->sh[0][a] = trip_sh_of_colour(c->coloured ? between(c, 6 + a, colour) : colour);
    }
    g->opacity = (float)part(w[3], 0, 8);
    decode_rotation(w[1], g->rotation);
    const int kept = trip_sh_count(f->info.degree) - 1;
    if (kept == 0)
        return;
    row = c->rows[HARMONICS] + i * c->elements[HARMONICS]->row_bytes;
    for (int channel = 0; channel < CHANNELS; channel++)
        for (int k = 0; k < kept; k++)
            g->sh[k + 1][channel] =
                decode_coefficient(trip_ply_value(&c->header, c->rest[channel * kept + k], row));
}

/* Reads the next chunk of up to 256 Gaussians. `left` Gaussians remain. */
static int read_chunk(compressed *c, uint64_t left)
{
    c->used = 0;
    c->room = left < CHUNK ? (size_t)left : CHUNK;
    for (stream i = 0; i < STREAMS; i++) {
        const size_t bytes =
            c->elements[i] ? (i == CHUNKS ? 1 : c->room) * c->elements[i]->row_bytes : 0;
        int status = bytes ? trip_byte_stream_read(c->streams[i], c->rows[i], bytes) : 0;
        if (status < 0)
            return status;
    }
    for (int i = 0; i < (c->coloured ? VALUES : 6); i++) {
        c->range[i][0] = trip_ply_value(&c->header, c->lo[i], c->rows[CHUNKS]);
        c->range[i][1] = trip_ply_value(&c->header, c->hi[i], c->rows[CHUNKS]);
    }
    return 0;
}

static int read_compressed(trip_gaussian_file *f, trip_gaussian *out, size_t count)
{
    compressed *c = f->state;
    for (size_t i = 0; i < count; i++) {
        int status = c->used == c->room ? read_chunk(c, f->info.count - f->done - i) : 0;
        if (status < 0)
            return status;
        decode(f, c, c->used++, &out[i]);
    }
    return 0;
}

static int rewind_compressed(trip_gaussian_file *f)
{
    compressed *c = f->state;
    int status = 0;
    c->used = c->room = 0;
    for (stream i = 0; i < STREAMS && status == 0; i++)
        if (c->streams[i])
            status = trip_ply_stream_rewind(c->streams[i], &c->header, c->elements[i]);
    return status;
}

static void close_compressed(trip_gaussian_file *f)
{
    compressed *c = f->state;
    if (!c)
        return;
    for (stream i = 0; i < STREAMS; i++) {
        trip_byte_stream_close(c->streams[i]);
        free(c->rows[i]);
    }
    trip_ply_header_release(&c->header);
    free(c);
}

const trip_gaussian_reader trip_read_compressed_ply = { probe, open_compressed, read_compressed,
                                                        rewind_compressed, close_compressed };
