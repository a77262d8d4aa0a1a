/* Reads clouds of points in LAS 1.0 to 1.4, all point formats, plain or compressed (LAZ), and COPC,
 * which is a LAZ file with an octree. Positions are integers with a scale and an offset. */
#include "point_file_internal.h"

#include <ctype.h>
#include <fcntl.h>
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "byte_stream.h"
#include "laz_file.h"
#include "little_endian.h"
#include "read_at.h"
#include "report.h"

enum {
    HEADER_BYTES = 227, /* of LAS 1.0 to 1.2; 1.3 and 1.4 have more */
    HEADER_4_BYTES = 375,
    VLR_BYTES = 54, /* the head of a record before the points */
    EVLR_BYTES = 60,
    VLRS_MAX = 1 << 16,
    DESCRIPTION_MAX = 256,
    EXTRA_BYTES = 192, /* the description of a further attribute */
    BUFFER_BYTES = 1 << 18,
    FORMATS = 11,
    COMPRESSED = 0x80,
};

/* Bytes of a record, and offsets of its time and colour, or 0. */
static const struct {
    uint16_t bytes, time, colour;
} formats[FORMATS] = {
    { 20, 0, 0 },  { 28, 20, 0 },  { 26, 0, 20 },  { 34, 20, 28 }, { 57, 20, 0 },  { 63, 20, 28 },
    { 30, 22, 0 }, { 36, 22, 30 }, { 38, 22, 30 }, { 59, 22, 0 },  { 67, 22, 30 },
};

typedef struct las {
    int fd;
    uint64_t file_bytes;
    unsigned minor, format;
    bool compressed, octree;
    uint16_t record_bytes;
    uint64_t data_at, count, done;
    double scale[3], offset[3];
    uint64_t evlr_at;
    uint32_t vlr_count, evlr_count;
    bool waves; /* waveforms follow the points */
    unsigned char description[DESCRIPTION_MAX];
    size_t description_bytes;
    trip_byte_stream *stream;
    trip_laz_file *laz;
    unsigned char *records;
    size_t room; /* records that fit */
} las;

static bool probe(const trip_point_head *head)
{
    return head->count >= 4 && memcmp(head->bytes, "LASF", 4) == 0;
}

static double f64_at(const unsigned char *p)
{
    const uint64_t bits = trip_le_u64(p);
    double v;
    memcpy(&v, &bits, sizeof v);
    return v;
}

/* Copies a text of fixed length that zeros or blanks fill up. */
static void copy_text(char *to, const unsigned char *from, size_t bytes)
{
    size_t n = strnlen((const char *)from, bytes);
    while (n > 0 && isspace(from[n - 1]))
        n--;
    memcpy(to, from, n);
    to[n] = 0;
}

static int outside(const trip_point_file *f, const char *what)
{
    return trip_fail(TRIP_ERROR, "read", f->path,
                     "%s outside of the file; is it damaged or truncated?", what);
}

static int read_bytes(const trip_point_file *f, void *to, size_t bytes, uint64_t at)
{
    const las *s = f->state;
    return trip_read_at(s->fd, to, bytes, bytes, at) == (ssize_t)bytes ? 0
                                                                       : trip_point_truncated(f);
}

/* ---- header ---- */

static int parse_scale(trip_point_file *f, const unsigned char *h)
{
    las *s = f->state;
    bool finite = true;
    for (int a = 0; a < 3; a++) {
        s->scale[a] = f64_at(h + 131 + 8 * a);
        s->offset[a] = f64_at(h + 155 + 8 * a);
        f->info.hi[a] = f64_at(h + 179 + 16 * a);
        f->info.lo[a] = f64_at(h + 187 + 16 * a);
        finite = finite && isfinite(f->info.hi[a]) && isfinite(f->info.lo[a]);
        if (!isfinite(s->scale[a]) || s->scale[a] == 0 || !isfinite(s->offset[a]))
            return trip_fail(TRIP_ERROR, "read", f->path,
                             "states the scale %g and the offset %g along %c; is it damaged?",
                             s->scale[a], s->offset[a], 'x' + a);
    }
    f->info.bounded = finite;
    if (!finite)
        trip_point_note(f, "the header states bounds that are not finite; the bounds of the points "
                           "are used");
    return 0;
}

static void describe(trip_point_file *f, const unsigned char *h)
{
    const las *s = f->state;
    char system[33], software[33];
    snprintf(f->info.format, sizeof f->info.format, "%s 1.%u, point format %u",
             s->octree       ? "COPC"
             : s->compressed ? "LAZ"
                             : "LAS",
             s->minor, s->format);
    copy_text(system, h + 26, 32);
    copy_text(software, h + 58, 32);
    snprintf(f->info.comments, sizeof f->info.comments, "%s%s%s", system,
             *system && *software ? "; " : "", software);
    f->info.attributes = TRIP_POINT_INTENSITY | TRIP_POINT_CLASSIFICATION | TRIP_POINT_RETURNS |
                         (formats[s->format].time ? TRIP_POINT_TIME : 0) |
                         (formats[s->format].colour ? TRIP_POINT_COLOUR : 0);
    f->colour_form = TRIP_COLOUR_SIXTEEN;
}

static int parse_header(trip_point_file *f, const unsigned char *h, size_t bytes)
{
    las *s = f->state;
    const unsigned least[] = { HEADER_BYTES, HEADER_BYTES, HEADER_BYTES, 235, HEADER_4_BYTES };
    s->minor = h[25];
    if (h[24] != 1 || s->minor > 4)
        return trip_fail(TRIP_ERROR, "read", f->path,
                         "has version %u.%u of LAS; versions 1.0 to 1.4 are read", h[24], h[25]);
    const unsigned header_bytes = trip_le_u16(h + 94);
    if (header_bytes < least[s->minor] || bytes < least[s->minor])
        return trip_fail(TRIP_ERROR, "read", f->path,
                         "has a header of %u bytes, but LAS 1.%u needs %u; is it damaged?",
                         header_bytes, s->minor, least[s->minor]);
    s->data_at = trip_le_u32(h + 96);
    s->vlr_count = trip_le_u32(h + 100);
    s->format = h[104] & 0x3f;
    s->compressed = h[104] & COMPRESSED;
    s->record_bytes = trip_le_u16(h + 105);
    s->count = trip_le_u32(h + 107);
    if (s->minor >= 3)
        s->waves = trip_le_u64(h + 227) != 0;
    if (s->minor >= 4) {
        const uint64_t count = trip_le_u64(h + 247);
        s->count = count ? count : s->count;
        s->evlr_at = trip_le_u64(h + 235);
        s->evlr_count = trip_le_u32(h + 243);
    }
    if (s->format >= FORMATS)
        return trip_fail(TRIP_ERROR, "read", f->path, "has point format %u; 0 to 10 are read",
                         s->format);
    if (s->record_bytes < formats[s->format].bytes)
        return trip_fail(TRIP_ERROR, "read", f->path,
                         "has records of %u bytes, but point format %u needs %u; is it damaged?",
                         s->record_bytes, s->format, formats[s->format].bytes);
    if (s->data_at < header_bytes || s->data_at > s->file_bytes)
        return outside(f, "its points begin");
    return parse_scale(f, h);
}

/* ---- records beside the points ---- */

/* Adds the names of further attributes. */
static int add_extras(trip_point_file *f, uint64_t at, uint64_t bytes)
{
    enum { MOST = 256 };
    unsigned char one[EXTRA_BYTES];
    char name[33];
    for (uint64_t i = 0; i < bytes / EXTRA_BYTES && i < MOST; i++) {
        const int status = read_bytes(f, one, sizeof one, at + i * EXTRA_BYTES);
        if (status < 0)
            return status;
        copy_text(name, one + 4, 32);
        trip_point_add_extra(f, *name ? name : "(without a name)");
    }
    return 0;
}

static bool is_named(const unsigned char *head, const char *user, unsigned id)
{
    char name[17];
    copy_text(name, head + 2, 16);
    return strcmp(name, user) == 0 && trip_le_u16(head + 18) == id;
}

static int read_record(trip_point_file *f, const unsigned char *head, uint64_t at, uint64_t bytes)
{
    las *s = f->state;
    if (is_named(head, "LASF_Spec", 4))
        return add_extras(f, at, bytes);
    if (is_named(head, "copc", 1))
        s->octree = true;
    if (!is_named(head, "laszip encoded", 22204))
        return 0;
    s->description_bytes = bytes < DESCRIPTION_MAX ? (size_t)bytes : DESCRIPTION_MAX;
    return read_bytes(f, s->description, s->description_bytes, at);
}

static int read_records(trip_point_file *f, const unsigned char *header)
{
    las *s = f->state;
    unsigned char head[EVLR_BYTES];
    uint64_t at = trip_le_u16(header + 94);
    int status = 0;
    for (uint32_t i = 0; i < s->vlr_count && i < VLRS_MAX && status == 0; i++) {
        if (at + VLR_BYTES > s->data_at)
            return outside(f, "a record of its header lies");
        status = read_bytes(f, head, VLR_BYTES, at);
        const uint64_t bytes = trip_le_u16(head + 20);
        at += VLR_BYTES;
        if (status == 0 && bytes > s->data_at - at)
            return outside(f, "a record of its header lies");
        if (status == 0)
            status = read_record(f, head, at, bytes);
        at += bytes;
    }
    at = s->evlr_at;
    for (uint32_t i = 0; i < s->evlr_count && i < VLRS_MAX && status == 0; i++) {
        if (at < s->data_at || at > s->file_bytes || s->file_bytes - at < EVLR_BYTES)
            return outside(f, "a record after its points lies");
        status = read_bytes(f, head, EVLR_BYTES, at);
        const uint64_t bytes = trip_le_u64(head + 20);
        at += EVLR_BYTES;
        if (status == 0 && bytes > s->file_bytes - at)
            return outside(f, "a record after its points lies");
        if (status == 0 && is_named(head, "LASF_Spec", 4))
            status = add_extras(f, at, bytes);
        at += bytes;
    }
    return status;
}

/* ---- points ---- */

/* Compares the stated number of points with the bytes of the file. */
static int check_count(trip_point_file *f)
{
    las *s = f->state;
    const uint64_t bytes = s->file_bytes - s->data_at, held = bytes / s->record_bytes;
    const bool whole = bytes % s->record_bytes == 0, last = !s->waves && s->evlr_count == 0;
    if (s->count > held && (!whole || held == 0))
        return trip_fail(TRIP_ERROR, "read", f->path,
                         "states %" PRIu64 " points, but holds %" PRIu64 "; is it truncated?",
                         s->count, held);
    if (s->count > held || (s->count < held && whole && last)) {
        trip_point_note(f,
                        "the header states %" PRIu64 " points, but the file holds %" PRIu64
                        ", which are read",
                        s->count, held);
        s->count = held;
    }
    return 0;
}

static int open_plain(trip_point_file *f)
{
    las *s = f->state;
    const trip_byte_source source = { .path = f->path,
                                      .offset_bytes = s->data_at,
                                      .size_bytes = s->count * s->record_bytes,
                                      .warned = true };
    return trip_byte_stream_open(&s->stream, &source);
}

static int open_compressed(trip_point_file *f)
{
    las *s = f->state;
    const trip_laz_params params = { .path = f->path,
                                     .fd = s->fd,
                                     .data_at = s->data_at,
                                     .end = s->file_bytes,
                                     .count = s->count,
                                     .format = (uint8_t)s->format,
                                     .record_bytes = s->record_bytes,
                                     .description = s->description,
                                     .description_bytes = s->description_bytes };
    if (s->description_bytes == 0)
        return trip_fail(TRIP_ERROR, "read", f->path,
                         "is LAZ, but lacks the record that describes its compression");
    return trip_laz_file_open(&s->laz, &params);
}

static int open_points(trip_point_file *f)
{
    las *s = f->state;
    int status = s->compressed ? 0 : check_count(f);
    if (status == 0 && s->count == 0)
        status = trip_fail(TRIP_ERROR, "read", f->path, "holds no points");
    if (status < 0)
        return status;
    f->info.count = s->count;
    s->room = BUFFER_BYTES / s->record_bytes + 1;
    if (!(s->records = malloc(s->room * s->record_bytes)))
        return trip_point_no_memory(f);
    return s->compressed ? open_compressed(f) : open_plain(f);
}

static int open_las(trip_point_file *f)
{
    unsigned char header[HEADER_4_BYTES] = { 0 };
    snprintf(f->info.format, sizeof f->info.format, "LAS");
    int status = trip_byte_stream_refuse_compressed(f->path, f->info.format);
    las *s = f->state = calloc(1, sizeof *s);
    if (!s)
        return trip_point_no_memory(f);
    s->fd = -1;
    if (status == 0)
        status = trip_file_size(f->path, &s->file_bytes);
    if (status < 0)
        return status;
    s->fd = open(f->path, O_RDONLY | O_CLOEXEC);
    if (s->fd < 0)
        return trip_fail_errno("read", f->path, "cannot open");
    const size_t bytes = s->file_bytes < sizeof header ? (size_t)s->file_bytes : sizeof header;
    if (bytes < HEADER_BYTES)
        return trip_point_truncated(f);
    status = read_bytes(f, header, bytes, 0);
    if (status == 0)
        status = parse_header(f, header, bytes);
    if (status == 0)
        status = read_records(f, header);
    if (status < 0)
        return status;
    describe(f, header);
    return open_points(f);
}

/* Returns false for a point that is marked as withheld. */
static bool decode(const las *s, const unsigned char *r, trip_point *out)
{
    for (int a = 0; a < 3; a++)
        out->position[a] = (int32_t)trip_le_u32(r + 4 * a) * s->scale[a] + s->offset[a];
    out->intensity = trip_le_u16(r + 12);
    const bool old = s->format < 6;
    out->return_number = r[14] & (old ? 7 : 15);
    out->returns = old ? r[14] >> 3 & 7 : r[14] >> 4;
    out->classification = old ? r[15] & 31 : r[16];
    if (formats[s->format].time)
        out->gps_time = f64_at(r + formats[s->format].time);
    for (int c = 0; c < 3 && formats[s->format].colour; c++)
        out->colour[c] = trip_le_u16(r + formats[s->format].colour + 2 * c);
    return !(r[15] & (old ? 0x80 : 4));
}

static int read_las(trip_point_file *f, trip_point *out, size_t room, size_t *got_out)
{
    las *s = f->state;
    *got_out = 0;
    while (*got_out == 0 && s->done < s->count) {
        size_t count = room < s->room ? room : s->room;
        if (s->count - s->done < count)
            count = (size_t)(s->count - s->done);
        int status = s->laz ? trip_laz_file_read(s->laz, s->records, count)
                            : trip_byte_stream_read(s->stream, s->records, count * s->record_bytes);
        if (status < 0)
            return status;
        s->done += count;
        for (size_t i = 0; i < count; i++)
            *got_out += decode(s, s->records + i * s->record_bytes, &out[*got_out]);
        f->deleted += count - *got_out;
    }
    return 0;
}

static int rewind_las(trip_point_file *f)
{
    las *s = f->state;
    s->done = 0;
    return s->laz ? trip_laz_file_rewind(s->laz) : trip_byte_stream_rewind(s->stream);
}

static void close_las(trip_point_file *f)
{
    las *s = f->state;
    if (!s)
        return;
    trip_laz_file_close(s->laz);
    trip_byte_stream_close(s->stream);
    if (s->fd >= 0)
        close(s->fd);
    free(s->records);
    free(s);
}

const trip_point_reader trip_read_las = { probe, open_las, read_las, rewind_las, close_las };
