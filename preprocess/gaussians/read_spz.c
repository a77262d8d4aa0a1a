/* Reads Gaussian scenes in SPZ (Niantic). Versions 1 to 3 are one stream of gzip, also as plain
 * bytes; version 4 has a stream of zstd for each attribute. The values of an attribute lie
 * together. So the reader has a stream for each attribute, and its memory does not grow with the
 * scene. */
#include "gaussian_file_internal.h"

#include <inttypes.h>
#include <fcntl.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "byte_stream.h"
#include "little_endian.h"
#include "read_at.h"
#include "report.h"
#include "zstd_stream.h"

enum {
    HEADER_BYTES = 16,
    HEADER_4_BYTES = 32,
    ENTRY_BYTES = 16, /* of a stream in the table of version 4 */
    BATCH = 4096,
    FLAG_ANTIALIASED = 1,
    FLAG_EXTENSIONS = 2
};

/* The attributes, in their order in the file. */
typedef enum attribute {
    CENTRES,
    OPACITIES,
    COLOURS,
    SCALES,
    ROTATIONS,
    HARMONICS,
    ATTRIBUTES
} attribute;

typedef struct spz {
    unsigned char header[HEADER_4_BYTES];
    uint32_t version;
    unsigned item_bytes[ATTRIBUTES]; /* of one Gaussian */
    trip_byte_stream *streams[ATTRIBUTES];
    trip_zstd_stream *packed[ATTRIBUTES]; /* of version 4 */
    unsigned char *items[ATTRIBUTES];
} spz;

static bool probe(const trip_gaussian_head *head)
{
    return head->count >= 4 && memcmp(head->bytes, "NGSP", 4) == 0;
}

static int parse_header(trip_gaussian_file *f, spz *s)
{
    const int degree = s->header[12];
    s->version = trip_le_u32(s->header + 4);
    if (s->version < 1 || s->version > 4)
        return trip_fail(TRIP_ERROR, "read", f->path,
                         "has version %" PRIu32 " of SPZ; versions 1 to 4 are read", s->version);
    if (degree > 4)
        return trip_fail(TRIP_ERROR, "read", f->path,
                         "states spherical harmonics of degree %d; is its header damaged?", degree);
    static const char *const formats[] = { "SPZ 1", "SPZ 2", "SPZ 3", "SPZ 4" };
    f->info.format = formats[s->version - 1];
    f->info.count = trip_le_u32(s->header + 8);
    f->info.degree = degree < TRIP_SH_DEGREE_MAX ? degree : TRIP_SH_DEGREE_MAX;
    f->info.antialiased = s->header[14] & FLAG_ANTIALIASED;
    memcpy(f->info.up, "y", sizeof "y"); /* x right, y up, z back */
    if (degree > TRIP_SH_DEGREE_MAX)
        trip_warn(f->path,
                  "has spherical harmonics of degree %d; those above degree %d are left "
                  "out",
                  degree, TRIP_SH_DEGREE_MAX);
    s->item_bytes[CENTRES] = s->version == 1 ? 6 : 9;
    s->item_bytes[OPACITIES] = 1;
    s->item_bytes[COLOURS] = s->item_bytes[SCALES] = 3;
    s->item_bytes[ROTATIONS] = s->version < 3 ? 3 : 4;
    s->item_bytes[HARMONICS] = 3 * (unsigned)(trip_sh_count(degree) - 1);
    return 0;
}

/* Opens a stream at each attribute of versions 1 to 3. The last one warns of bytes after the data,
 * unless they are extensions. */
static int open_planes(trip_gaussian_file *f, spz *s)
{
    const attribute last = s->item_bytes[HARMONICS] ? HARMONICS : ROTATIONS;
    const trip_byte_encoding encoding = trip_byte_encoding_of(f->path);
    uint64_t offset = HEADER_BYTES;
    for (attribute a = 0; a <= last; a++) {
        const uint64_t bytes = f->info.count * s->item_bytes[a];
        const trip_byte_source source = {
            .path = f->path,
            .encoding = encoding,
            .skip_bytes = offset,
            .size_bytes = bytes,
            .warned = a < last || s->header[14] & FLAG_EXTENSIONS,
        };
        int status = trip_byte_stream_open(&s->streams[a], &source);
        if (status < 0)
            return status;
        offset += bytes;
    }
    return 0;
}

static int check_table(const trip_gaussian_file *f, const spz *s, const unsigned char *table,
                       int count, uint64_t data, uint64_t file_bytes)
{
    for (int a = 0; a < count; a++) {
        const uint64_t packed = trip_le_u64(table + ENTRY_BYTES * a);
        const uint64_t bytes = trip_le_u64(table + ENTRY_BYTES * a + 8);
        if (bytes != f->info.count * s->item_bytes[a])
            return trip_fail(TRIP_ERROR, "read", f->path,
                             "stream %d holds %" PRIu64 " bytes, but %" PRIu64
                             " Gaussians need %" PRIu64,
                             a + 1, bytes, f->info.count, f->info.count * s->item_bytes[a]);
        if (packed > file_bytes - data)
            return trip_fail(TRIP_ERROR, "read", f->path,
                             "stream %d lies beyond the end of the file; is it truncated?", a + 1);
        data += packed;
    }
    if (data < file_bytes)
        trip_warn(f->path, "%" PRIu64 " bytes are after the expected data", file_bytes - data);
    return 0;
}

/* Opens the streams of version 4. A table after the header holds their sizes. */
static int open_packed(trip_gaussian_file *f, spz *s, int fd)
{
    const int count = s->item_bytes[HARMONICS] ? 6 : 5;
    unsigned char table[ENTRY_BYTES * ATTRIBUTES];
    const uint64_t at = trip_le_u32(s->header + 16);
    uint64_t file_bytes, data = at + (uint64_t)(ENTRY_BYTES * count);
    if (s->header[15] != count || at < HEADER_4_BYTES)
        return trip_fail(TRIP_ERROR, "read", f->path,
                         "states %d streams at byte %" PRIu64
                         ", but %d are expected; is its header damaged?",
                         s->header[15], at, count);
    int status = trip_file_size(f->path, &file_bytes);
    if (status < 0)
        return status;
    const size_t bytes = (size_t)(ENTRY_BYTES * count);
    if (data > file_bytes || trip_read_at(fd, table, bytes, bytes, at) != (ssize_t)bytes)
        return trip_fail(TRIP_ERROR, "read", f->path, "ends in its header; is it truncated?");
    status = check_table(f, s, table, count, data, file_bytes);
    for (int a = 0; a < count && status == 0; a++) {
        const uint64_t packed = trip_le_u64(table + ENTRY_BYTES * a);
        status = trip_zstd_stream_open(&s->packed[a], f->path, data, packed,
                                       f->info.count * s->item_bytes[a]);
        data += packed;
    }
    return status;
}

static int open_version_4(trip_gaussian_file *f, spz *s)
{
    int status = trip_byte_stream_refuse_compressed(f->path, f->info.format);
    if (status < 0)
        return status;
    const int fd = open(f->path, O_RDONLY | O_CLOEXEC);
    if (fd < 0)
        return trip_fail_errno("read", f->path, "cannot open");
    status = open_packed(f, s, fd);
    close(fd);
    return status;
}

static int open_spz(trip_gaussian_file *f)
{
    size_t got = 0;
    spz *s = f->state = calloc(1, sizeof *s);
    if (!s)
        return trip_gaussian_no_memory(f);
    int status = trip_byte_stream_head(f->path, s->header, sizeof s->header, false, &got);
    if (status < 0)
        return status;
    if (got < HEADER_BYTES || (got < HEADER_4_BYTES && s->header[4] == 4))
        return trip_fail(TRIP_ERROR, "read", f->path, "ends in its header; is it truncated?");
    status = parse_header(f, s);
    if (status < 0 || f->info.count == 0)
        return status;
    for (attribute a = 0; a < ATTRIBUTES; a++)
        if (!(s->items[a] = malloc(BATCH * (size_t)s->item_bytes[a] + 1)))
            return trip_gaussian_no_memory(f);
    if (s->header[14] & FLAG_EXTENSIONS)
        trip_note(f->path, "the extensions of the file are left out");
    return s->version == 4 ? open_version_4(f, s) : open_planes(f, s);
}

/* Returns a signed fixed-point number of 24 bits. */
static int32_t fixed(const unsigned char *p)
{
    const uint32_t bits = p[0] | (uint32_t)p[1] << 8 | (uint32_t)p[2] << 16;
    return (int32_t)(bits ^ 0x800000) - 0x800000;
}

/* Versions 1 and 2 store x, y and z of a unit quaternion. */
static void decode_rotation(const unsigned char *p, float q[4])
{
    double rest = 1;
    for (int i = 0; i < 3; i++) {
        const double v = p[i] / 127.5 - 1;
        q[i + 1] = (float)v;
        rest -= v * v;
    }
    q[0] = rest > 0 ? (float)sqrt(rest) : 0;
}

/* Versions 3 and 4 store the three smaller components: a sign and 9 bits each. Two bits tell the
 * largest one, which is positive. */
static void decode_smallest_three(const unsigned char *p, float q[4])
{
    uint32_t bits = trip_le_u32(p);
    const unsigned largest = bits >> 30;
    double rest = 1;
    for (unsigned i = 4; i-- > 0;) { /* x, y, z, w */
        if (i == largest)
            continue;
        const double v = (bits & 0x1ff) * M_SQRT1_2 / 0x1ff * (bits & 0x200 ? -1 : 1);
        q[(i + 1) % 4] = (float)v;
        rest -= v * v;
        bits >>= 10;
    }
    q[(largest + 1) % 4] = rest > 0 ? (float)sqrt(rest) : 0;
}

static void decode(const trip_gaussian_file *f, size_t i, trip_gaussian *g)
{
    const spz *s = f->state;
    const unsigned char *centre = s->items[CENTRES] + i * s->item_bytes[CENTRES];
    const unsigned char *rotation = s->items[ROTATIONS] + i * s->item_bytes[ROTATIONS];
    const unsigned char *harmonics = s->items[HARMONICS] + i * s->item_bytes[HARMONICS];
    for (int a = 0; a < 3; a++) {
        g->centre[a] = s->version == 1 ? trip_le_half(centre + 2 * a)
                                       : ldexp(fixed(centre + 3 * a), -s->header[13]);
        g->deviations[a] = (float)exp(s->items[SCALES][3 * i + (size_t)a] / 16.0 - 10);
        /* The constant coefficient lies within 0.15 of the scale of a byte. */
        g->sh[0][a] = (float)((s->items[COLOURS][3 * i + (size_t)a] / 255.0 - 0.5) / 0.15);
    }
    g->opacity = s->items[OPACITIES][i] / 255.0f;
    if (s->version < 3)
        decode_rotation(rotation, g->rotation);
    else
        decode_smallest_three(rotation, g->rotation);
    for (int k = 1; k < trip_sh_count(f->info.degree); k++)
        for (int c = 0; c < 3; c++)
            g->sh[k][c] = ((float)harmonics[3 * (k - 1) + c] - 128) / 128;
}

static int read_items(spz *s, size_t count)
{
    int status = 0;
    for (attribute a = 0; a < ATTRIBUTES && status == 0; a++) {
        const size_t bytes = count * s->item_bytes[a];
        if (bytes > 0)
            status = s->packed[a] ? trip_zstd_stream_read(s->packed[a], s->items[a], bytes)
                                  : trip_byte_stream_read(s->streams[a], s->items[a], bytes);
    }
    return status;
}

static int read_spz(trip_gaussian_file *f, trip_gaussian *out, size_t count)
{
    spz *s = f->state;
    for (size_t done = 0; done < count;) {
        const size_t n = count - done < BATCH ? count - done : BATCH;
        int status = read_items(s, n);
        if (status < 0)
            return status;
        for (size_t i = 0; i < n; i++)
            decode(f, i, &out[done + i]);
        done += n;
    }
    return 0;
}

static int rewind_spz(trip_gaussian_file *f)
{
    spz *s = f->state;
    int status = 0;
    for (attribute a = 0; a < ATTRIBUTES && status == 0; a++)
        status = s->packed[a]    ? trip_zstd_stream_rewind(s->packed[a])
                 : s->streams[a] ? trip_byte_stream_rewind(s->streams[a])
                                 : 0;
    return status;
}

static void close_spz(trip_gaussian_file *f)
{
    spz *s = f->state;
    for (attribute a = 0; a < ATTRIBUTES && s; a++) {
        trip_byte_stream_close(s->streams[a]);
        trip_zstd_stream_close(s->packed[a]);
        free(s->items[a]);
    }
    free(s);
}

const trip_gaussian_reader trip_read_spz = { probe, open_spz, read_spz, rewind_spz, close_spz };
