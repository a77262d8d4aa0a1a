/* Reads Gaussian scenes in .ksplat (Kellogg): a header, headers of sections, then each section with
 * its buckets and its Gaussians. Level 0 stores floats. Levels 1 and 2 store halves, and centres as
 * 16 bits around the centre of a bucket. */
#include "gaussian_file_internal.h"

#include <fcntl.h>
#include <inttypes.h>
#include <stdlib.h>
#include <unistd.h>

#include "byte_stream.h"
#include "little_endian.h"
#include "read_at.h"
#include "report.h"

enum { HEADER_BYTES = 4096, SECTION_BYTES = 1024, SECTION_USED = 44, ROWS = 1024, ROW_MAX = 224 };

/* The bytes of a number, by level. Red, green, blue and opacity have a byte each. */
typedef struct layout {
    unsigned centre, scale, rotation, harmonic;
} layout;

static const layout layouts[] = { { 4, 4, 4, 4 }, { 2, 2, 2, 2 }, { 2, 2, 2, 1 } };

typedef struct section {
    uint64_t count, at; /* Gaussians; place of the first one in the file */
    uint64_t buckets_at, sizes_at;
    uint32_t bucket_room, buckets, full, partial;
    double range, block;
    int degree;
    unsigned row_bytes;
} section;

typedef struct ksplat {
    int fd;
    unsigned level;
    uint32_t section_count, next; /* `next` section to begin */
    double lo, hi;                /* of coefficients in level 2 */
    uint64_t at, file_bytes;      /* of the next section */
    section now;
    uint64_t done; /* Gaussians of the section */
    uint64_t bucket, bucket_end;
    float centre[3]; /* of the bucket */
    unsigned char rows[ROWS * ROW_MAX];
} ksplat;

static bool probe(const trip_gaussian_head *head)
{
    return trip_byte_suffix(head->path, ".ksplat") && head->count > 0;
}

/* Reads all `bytes` bytes at a place of the file. */
static int get(const trip_gaussian_file *f, void *to, size_t bytes, uint64_t at)
{
    const ksplat *k = f->state;
    const ssize_t got = trip_read_at(k->fd, to, bytes, bytes, at);
    if (got < 0)
        return trip_fail_errno("read", f->path, "cannot read");
    return (size_t)got == bytes
               ? 0
               : trip_fail(TRIP_ERROR, "read", f->path,
                           "ends before byte %" PRIu64 "; is it truncated?", at + bytes);
}

static unsigned row_bytes(const layout *l, int degree)
{
    return 3 * l->centre + 3 * l->scale + 4 * l->rotation + 4 +
           3 * ((unsigned)trip_sh_count(degree) - 1) * l->harmonic;
}

/* Reads the header of the section k->next. Sets *end to the place after its data. */
static int read_section(const trip_gaussian_file *f, section *s, uint64_t at, uint64_t *end)
{
    const ksplat *k = f->state;
    unsigned char h[SECTION_USED];
    int status = get(f, h, sizeof h, HEADER_BYTES + (uint64_t)SECTION_BYTES * k->next);
    if (status < 0)
        return status;
    const uint64_t room = trip_le_u32(h + 4), bucket_bytes = trip_le_u16(h + 20);
    *s = (section){ .count = trip_le_u32(h),
                    .sizes_at = at,
                    .bucket_room = trip_le_u32(h + 8),
                    .buckets = trip_le_u32(h + 12),
                    .block = trip_le_float(h + 16),
                    .range = trip_le_u32(h + 24),
                    .full = trip_le_u32(h + 32),
                    .partial = trip_le_u32(h + 36),
                    .degree = trip_le_u16(h + 40) };
    if (s->range <= 0)
        s->range = 32767;
    if (s->degree > TRIP_SH_DEGREE_MAX)
        return trip_fail(TRIP_ERROR, "read", f->path,
                         "section %" PRIu32 " has spherical harmonics of degree %d; degrees 0 to 3 "
                         "are read",
                         k->next + 1, s->degree);
    if (s->count > room || (s->buckets && bucket_bytes < 12) ||
        (k->level > 0 && (uint64_t)s->full + s->partial > s->buckets))
        return trip_fail(TRIP_ERROR, "read", f->path,
                         "the header of section %" PRIu32
                         " contradicts itself; is the file damaged?",
                         k->next + 1);
    s->row_bytes = row_bytes(&layouts[k->level], s->degree);
    s->buckets_at = at + 4 * (uint64_t)s->partial;
    s->at = s->buckets_at + bucket_bytes * s->buckets;
    *end = s->at + room * s->row_bytes;
    if (s->at + s->count * s->row_bytes > k->file_bytes)
        return trip_fail(TRIP_ERROR, "read", f->path,
                         "section %" PRIu32 " ends at byte %" PRIu64 ", but the file has %" PRIu64
                         "; is it truncated?",
                         k->next + 1, s->at + s->count * s->row_bytes, k->file_bytes);
    return 0;
}

/* Finds the count and the degree by all sections. */
static int look_at_sections(trip_gaussian_file *f, ksplat *k, uint64_t stated)
{
    uint64_t at = k->at;
    for (k->next = 0; k->next < k->section_count; k->next++) {
        section s;
        int status = read_section(f, &s, at, &at);
        if (status < 0)
            return status;
        f->info.count += s.count;
        f->info.degree = s.count && s.degree > f->info.degree ? s.degree : f->info.degree;
    }
    if (f->info.count != stated)
        return trip_fail(TRIP_ERROR, "read", f->path,
                         "states %" PRIu64 " Gaussians, but its sections hold %" PRIu64, stated,
                         f->info.count);
    return 0;
}

static int rewind_ksplat(trip_gaussian_file *f)
{
    ksplat *k = f->state;
    k->next = 0;
    k->done = 0;
    k->now = (section){ 0 };
    k->at = HEADER_BYTES + (uint64_t)SECTION_BYTES * k->section_count;
    return 0;
}

static int open_ksplat(trip_gaussian_file *f)
{
    unsigned char h[44];
    ksplat *k = f->state = calloc(1, sizeof *k);
    if (!k)
        return trip_gaussian_no_memory(f);
    k->fd = -1;
    f->info.format = ".ksplat";
    int status = trip_byte_stream_refuse_compressed(f->path, f->info.format);
    if (status == 0)
        status = trip_file_size(f->path, &k->file_bytes);
    if (status < 0)
        return status;
    k->fd = open(f->path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    if (k->fd < 0)
        return trip_fail_errno("read", f->path, "cannot open");
    if ((status = get(f, h, sizeof h, 0)) < 0)
        return status;
    k->level = trip_le_u16(h + 20);
    k->section_count = trip_le_u32(h + 4);
    if (h[0] != 0 || h[1] < 1)
        return trip_fail(TRIP_ERROR, "read", f->path,
                         "has version %d.%d of .ksplat; version 0.1 is read", h[0], h[1]);
    if (k->level > 2)
        return trip_fail(TRIP_ERROR, "read", f->path,
                         "has the compression level %u; levels 0, 1 and 2 are read", k->level);
    k->lo = trip_le_float(h + 36);
    k->hi = trip_le_float(h + 40);
    k->lo = k->lo < 0 || k->lo > 0 ? k->lo : -1.5;
    k->hi = k->hi < 0 || k->hi > 0 ? k->hi : 1.5;
    rewind_ksplat(f);
    status = look_at_sections(f, k, trip_le_u32(h + 16));
    return status < 0 ? status : rewind_ksplat(f);
}

/* Goes on to the bucket that holds the next Gaussian of the section. */
static int next_bucket(const trip_gaussian_file *f, ksplat *k)
{
    const section *s = &k->now;
    unsigned char bytes[12];
    uint64_t size = s->bucket_room;
    if (k->bucket >= (uint64_t)s->full + s->partial)
        return trip_fail(TRIP_ERROR, "read", f->path,
                         "section %" PRIu32
                         " has more Gaussians than its buckets; is the file damaged?",
                         k->next);
    if (k->bucket >= s->full) {
        int status = get(f, bytes, 4, s->sizes_at + 4 * (k->bucket - s->full));
        if (status < 0)
            return status;
        size = trip_le_u32(bytes);
    }
    int status = get(f, bytes, 12, s->buckets_at + 12 * k->bucket);
    for (int a = 0; a < 3; a++)
        k->centre[a] = trip_le_float(bytes + 4 * a);
    k->bucket++;
    k->bucket_end += size;
    return status;
}

static int next_section(const trip_gaussian_file *f, ksplat *k)
{
    int status = read_section(f, &k->now, k->at, &k->at);
    k->next++;
    k->done = k->bucket = k->bucket_end = 0;
    return status;
}

static double number(const unsigned char *p, unsigned index, unsigned bytes)
{
    return bytes == 4 ? trip_le_float(p + 4 * index) : trip_le_half(p + 2 * index);
}

static double harmonic(const ksplat *k, const unsigned char *p, unsigned index)
{
    const unsigned bytes = layouts[k->level].harmonic;
    return bytes == 1 ? k->lo + p[index] / 255.0 * (k->hi - k->lo) : number(p, index, bytes);
}

/* Coefficients of a degree lie together, channel by channel. */
static void decode_harmonics(const ksplat *k, const unsigned char *p, trip_gaussian *g)
{
    for (int degree = 1, index = 0; degree <= k->now.degree; degree++)
        for (int channel = 0; channel < 3; channel++)
            for (int i = degree * degree; i < trip_sh_count(degree); i++)
                g->sh[i][channel] = (float)harmonic(k, p, (unsigned)index++);
}

static void decode(const ksplat *k, const unsigned char *p, trip_gaussian *g)
{
    const layout *l = &layouts[k->level];
    for (unsigned a = 0; a < 3; a++)
        g->centre[a] = k->level == 0 ? trip_le_float(p + 4 * a)
                                     : (trip_le_u16(p + 2 * a) - k->now.range) * k->now.block / 2 /
                                               k->now.range +
                                           k->centre[a];
    p += 3 * l->centre;
    for (unsigned a = 0; a < 3; a++)
        g->deviations[a] = (float)number(p, a, l->scale);
    p += 3 * l->scale;
    for (unsigned i = 0; i < 4; i++)
        g->rotation[i] = (float)number(p, i, l->rotation);
    p += 4 * l->rotation;
    for (int c = 0; c < 3; c++)
        g->sh[0][c] = trip_sh_of_colour(p[c] / 255.0);
    g->opacity = p[3] / 255.0f;
    decode_harmonics(k, p + 4, g);
}

/* Reads up to `count` Gaussians of the section. */
static int read_rows(const trip_gaussian_file *f, ksplat *k, trip_gaussian *out, size_t count)
{
    const section *s = &k->now;
    int status = get(f, k->rows, count * s->row_bytes, s->at + k->done * s->row_bytes);
    for (size_t i = 0; i < count && status == 0; i++) {
        while (k->level > 0 && k->done == k->bucket_end && status == 0)
            status = next_bucket(f, k);
        decode(k, k->rows + i * s->row_bytes, &out[i]);
        k->done++;
    }
    return status;
}

static int read_ksplat(trip_gaussian_file *f, trip_gaussian *out, size_t count)
{
    ksplat *k = f->state;
    int status = 0;
    for (size_t done = 0; done < count && status == 0;) {
        if (k->done == k->now.count) {
            status = next_section(f, k);
            continue;
        }
        size_t n = count - done < ROWS ? count - done : ROWS;
        n = k->now.count - k->done < n ? (size_t)(k->now.count - k->done) : n;
        status = read_rows(f, k, out + done, n);
        done += n;
    }
    return status;
}

static void close_ksplat(trip_gaussian_file *f)
{
    ksplat *k = f->state;
    if (k && k->fd >= 0)
        close(k->fd);
    free(k);
}

const trip_gaussian_reader trip_read_ksplat = { probe, open_ksplat, read_ksplat, rewind_ksplat,
                                                close_ksplat };
_Static_assert(ROW_MAX >= 40 + 4 + 45 * 4, "rows of level 0 and degree 3");
