/* Reads scans in E57 (ASTM E2807). The points of a scan lie in packets. Each packet has a piece of
 * a stream of bytes for each field. The values of a field may begin in one packet and end in the
 * next one, so the reader follows the packets for each field alone. */
#include "point_file_internal.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "byte_stream.h"
#include "e57_pages.h"
#include "e57_text.h"
#include "little_endian.h"
#include "report.h"

enum {
    SECTION_BYTES = 32,
    PACKET_HEAD_BYTES = 6,
    PACKET_BYTES_MAX = 1 << 16,
    INDEX_PACKET = 0,
    DATA_PACKET = 1,
    EMPTY_PACKET = 2,
    CONSTANTS_MAX = 1 << 20, /* points of a scan with one position */
};

/* The place in the stream of a field. */
typedef struct cursor {
    uint64_t packet; /* logical offset of the next packet */
    uint32_t used, have;
    unsigned byte, bits;  /* of the current byte, that are left */
    unsigned char *bytes; /* of the current packet */
} cursor;

typedef struct e57 {
    trip_e57_pages *pages;
    trip_e57_text text;
    uint32_t scan;
    uint64_t done;     /* points of this scan */
    uint64_t data_end; /* logical offset */
    double turn[3][3];
    cursor cursors[TRIP_E57_FIELDS];
} e57;

static bool probe(const trip_point_head *head)
{
    return head->count >= 8 && memcmp(head->bytes, "ASTM-E57", 8) == 0;
}

static bool has(const trip_e57_scan *s, trip_e57_field field)
{
    return s->fields[field].exists;
}

static bool has_three(const trip_e57_scan *s, trip_e57_field first)
{
    return has(s, first) && has(s, first + 1) && has(s, first + 2);
}

/* ---- description ---- */

static int check_scan(const trip_point_file *f, const trip_e57_scan *s, uint32_t number)
{
    const trip_e57_field first = has_three(s, TRIP_E57_X) ? TRIP_E57_X : TRIP_E57_RANGE;
    unsigned bits = 0;
    if (s->count == 0)
        return 0;
    if (!has_three(s, first))
        return trip_fail(TRIP_ERROR, "read", f->path,
                         "scan %" PRIu32 " lacks the fields of a position", number);
    for (int a = 0; a < 3; a++)
        bits += s->fields[first + (trip_e57_field)a].bits;
    if (bits == 0 && s->count > CONSTANTS_MAX)
        return trip_fail(TRIP_ERROR, "read", f->path,
                         "scan %" PRIu32 " states %" PRIu64
                         " points at one position; is it damaged?",
                         number, s->count);
    double sum = 0;
    for (int i = 0; i < 4; i++)
        sum += s->rotation[i] * s->rotation[i];
    return fabs(sum - 1) < 1e-3
               ? 0
               : trip_fail(TRIP_ERROR, "read", f->path,
                           "scan %" PRIu32 " has a rotation of length %g, and needs 1", number,
                           sqrt(sum));
}

static unsigned attributes_of(const trip_e57_scan *s)
{
    return (has_three(s, TRIP_E57_NORMAL_X) ? TRIP_POINT_NORMAL : 0) |
           (has_three(s, TRIP_E57_RED) ? TRIP_POINT_COLOUR : 0) |
           (has(s, TRIP_E57_INTENSITY) ? TRIP_POINT_INTENSITY : 0) |
           (has(s, TRIP_E57_CLASSIFICATION) ? TRIP_POINT_CLASSIFICATION : 0) |
           (has(s, TRIP_E57_RETURN_INDEX) || has(s, TRIP_E57_RETURN_COUNT) ? TRIP_POINT_RETURNS
                                                                           : 0) |
           (has(s, TRIP_E57_TIME) ? TRIP_POINT_TIME : 0) | (s->posed ? TRIP_POINT_SCAN : 0);
}

/* Adds the bounds of a scan to the bounds of all. A turned scan has none. */
static void add_bounds(trip_point_file *f, const trip_e57_scan *s, bool first)
{
    const bool straight = fabs(s->rotation[0]) == 1;
    for (int a = 0; a < 3; a++) {
        const double lo = s->bounds[a][0] + s->translation[a];
        const double hi = s->bounds[a][1] + s->translation[a];
        f->info.bounded = f->info.bounded && straight && isfinite(lo) && isfinite(hi);
        f->info.lo[a] = first ? lo : fmin(f->info.lo[a], lo);
        f->info.hi[a] = first ? hi : fmax(f->info.hi[a], hi);
    }
}

static int add_scan(trip_point_file *f, const trip_e57_scan *s)
{
    trip_point_scan *scan = trip_point_add_scan(f);
    double cells[2];
    if (!scan)
        return TRIP_ERROR;
    scan->posed = s->posed;
    memcpy(scan->scanner, s->translation, sizeof scan->scanner);
    for (int i = 0; i < 2; i++)
        cells[i] = s->index_bounds[i][1] - s->index_bounds[i][0] + 1;
    if (cells[0] > 1 && cells[1] > 1 && cells[0] < 1e9 && cells[1] < 1e9) {
        scan->height = (uint64_t)cells[0];
        scan->width = (uint64_t)cells[1];
    }
    return 0;
}

static int describe(trip_point_file *f)
{
    e57 *e = f->state;
    bool first = true;
    f->info.bounded = true;
    f->gaps = true; /* points may be marked as invalid */
    for (uint32_t i = 0; i < e->text.count; i++) {
        const trip_e57_scan *s = &e->text.scans[i];
        int status = check_scan(f, s, i + 1);
        if (status == 0)
            status = add_scan(f, s);
        if (status < 0)
            return status;
        if (s->count == 0)
            continue;
        f->info.attributes |= attributes_of(s);
        f->info.count += s->count;
        add_bounds(f, s, first);
        if (s->intensity_limits[0] < s->intensity_limits[1]) {
            f->info.intensity_limits[0] = (float)s->intensity_limits[0];
            f->info.intensity_limits[1] = (float)s->intensity_limits[1];
        }
        first = false;
    }
    f->info.attributes |= e->text.count > 1 ? TRIP_POINT_SCAN : 0;
    snprintf(f->info.extras, sizeof f->info.extras, "%s", e->text.extras);
    snprintf(f->info.comments, sizeof f->info.comments, "%s", e->text.comments);
    return f->info.count ? 0 : trip_fail(TRIP_ERROR, "read", f->path, "holds no points");
}

static int rewind_e57(trip_point_file *f)
{
    e57 *e = f->state;
    e->scan = UINT32_MAX; /* none has begun */
    e->done = 0;
    return 0;
}

static int open_e57(trip_point_file *f)
{
    snprintf(f->info.format, sizeof f->info.format, "E57");
    e57 *e = f->state = calloc(1, sizeof *e);
    if (!e)
        return trip_point_no_memory(f);
    int status = trip_byte_stream_refuse_compressed(f->path, f->info.format);
    if (status == 0)
        status = trip_e57_pages_open(&e->pages, f->path);
    if (status == 0)
        status = trip_e57_text_read(&e->text, e->pages, f->path);
    if (status == 0)
        status = describe(f);
    for (int i = 0; i < TRIP_E57_FIELDS && status == 0; i++)
        if (!(e->cursors[i].bytes = malloc(PACKET_BYTES_MAX)))
            status = trip_point_no_memory(f);
    return status < 0 ? status : rewind_e57(f);
}

/* ---- packets ---- */

static int damaged(const trip_point_file *f, const char *what)
{
    return trip_fail(TRIP_ERROR, "read", f->path, "%s; is it damaged or truncated?", what);
}

/* Reads the piece of a stream in the packet at the cursor, if it is a packet of data. Moves to the
 * packet behind it. */
static int next_packet(trip_point_file *f, cursor *c, unsigned stream)
{
    e57 *e = f->state;
    unsigned char head[PACKET_HEAD_BYTES], size[2];
    if (c->packet > e->data_end || e->data_end - c->packet < PACKET_HEAD_BYTES)
        return damaged(f, "its packets hold fewer points than it states");
    int status = trip_e57_pages_read(e->pages, head, sizeof head, c->packet);
    const uint64_t begin = c->packet, bytes = (uint64_t)trip_le_u16(head + 2) + 1;
    c->packet += bytes;
    if (status < 0)
        return status;
    if (head[0] > EMPTY_PACKET || bytes < 4 || bytes > e->data_end - begin)
        return damaged(f, "one of its packets has an unknown type or a wrong length");
    if (head[0] != DATA_PACKET)
        return 0;
    const unsigned streams = trip_le_u16(head + 4);
    const uint64_t table = begin + PACKET_HEAD_BYTES;
    uint64_t at = table + 2 * (uint64_t)streams;
    if (stream >= streams || at > begin + bytes)
        return damaged(f, "one of its packets has a wrong number of streams");
    /* The table has at most 64 KiB, and the buffer holds it until the stream's place is known. */
    status = trip_e57_pages_read(e->pages, c->bytes, 2 * (size_t)stream, table);
    for (unsigned i = 0; i < stream; i++)
        at += trip_le_u16(c->bytes + 2 * i);
    if (status == 0)
        status = trip_e57_pages_read(e->pages, size, 2, table + 2 * (uint64_t)stream);
    if (status < 0)
        return status;
    c->have = trip_le_u16(size);
    c->used = 0;
    if (at > begin + bytes || c->have > begin + bytes - at)
        return damaged(f, "one of its packets has a stream beyond its end");
    return trip_e57_pages_read(e->pages, c->bytes, c->have, at);
}

/* Reads the bits of the next value, the least significant one first. */
static int next_bits(trip_point_file *f, cursor *c, const trip_e57_storage *s, uint64_t *out)
{
    *out = 0;
    for (unsigned got = 0; got < s->bits;) {
        if (c->bits == 0) {
            while (c->used == c->have) {
                const int status = next_packet(f, c, s->stream);
                if (status < 0)
                    return status;
            }
            c->byte = c->bytes[c->used++];
            c->bits = 8;
        }
        const unsigned part = c->bits < s->bits - got ? c->bits : s->bits - got;
        *out |= (uint64_t)(c->byte & ((1u << part) - 1)) << got;
        c->byte >>= part;
        c->bits -= part;
        got += part;
    }
    return 0;
}

static int next_value(trip_point_file *f, trip_e57_field field, double *out)
{
    e57 *e = f->state;
    const trip_e57_storage *s = &e->text.scans[e->scan].fields[field];
    uint64_t bits;
    float single;
    const int status = next_bits(f, &e->cursors[field], s, &bits);
    if (status < 0)
        return status;
    if (s->form == TRIP_E57_DOUBLE) {
        memcpy(out, &bits, sizeof *out);
    } else if (s->form == TRIP_E57_FLOAT) {
        const uint32_t low = (uint32_t)bits;
        memcpy(&single, &low, sizeof single);
        *out = (double)single;
    } else {
        *out = (double)(int64_t)((uint64_t)s->minimum + bits) * s->scale + s->offset;
    }
    return 0;
}

/* ---- points ---- */

static void set_turn(e57 *e, const double q[4])
{
    const double w = q[0], x = q[1], y = q[2], z = q[3];
    const double turn[3][3] = {
        { 1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y) },
        { 2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x) },
        { 2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y) },
    };
    memcpy(e->turn, turn, sizeof turn);
}

/* Begins the next scan with points. Sets *more to false behind the last one. */
static int begin_scan(trip_point_file *f, bool *more)
{
    e57 *e = f->state;
    unsigned char h[SECTION_BYTES];
    do
        e->scan++; /* from UINT32_MAX to 0 at first */
    while (e->scan < e->text.count && e->text.scans[e->scan].count == 0);
    *more = e->scan < e->text.count;
    e->done = 0;
    if (!*more)
        return 0;
    const trip_e57_scan *s = &e->text.scans[e->scan];
    const uint64_t at = trip_e57_pages_logical(e->pages, s->file_offset);
    const uint64_t end = trip_e57_pages_bytes(e->pages);
    if (at > end || end - at < SECTION_BYTES)
        return damaged(f, "its points lie outside of the file");
    const int status = trip_e57_pages_read(e->pages, h, sizeof h, at);
    if (status < 0)
        return status;
    const uint64_t bytes = trip_le_u64(h + 8);
    const uint64_t data = trip_e57_pages_logical(e->pages, trip_le_u64(h + 16));
    if (h[0] != 1 || bytes > end - at || data < at || data > at + bytes)
        return damaged(f, "the section of its points has a wrong head");
    e->data_end = at + bytes;
    set_turn(e, s->rotation);
    for (int i = 0; i < TRIP_E57_FIELDS; i++)
        e->cursors[i] = (cursor){ .packet = data, .bytes = e->cursors[i].bytes };
    return 0;
}

static float colour_of(const trip_e57_scan *s, int channel, double value)
{
    const trip_e57_storage *field = &s->fields[TRIP_E57_RED + channel];
    double lo = s->colour_limits[channel][0], hi = s->colour_limits[channel][1];
    if (!(lo < hi) && field->form == TRIP_E57_INTEGER) {
        lo = (double)field->minimum * field->scale + field->offset;
        hi = (double)field->maximum * field->scale + field->offset;
    }
    return (float)(lo < hi ? (value - lo) / (hi - lo) : value);
}

static uint8_t byte_of(double v)
{
    return v >= 0 && v < 256 ? (uint8_t)v : 0;
}

static void turn(const double m[3][3], const double v[3], double out[3])
{
    for (int i = 0; i < 3; i++)
        out[i] = m[i][0] * v[0] + m[i][1] * v[1] + m[i][2] * v[2];
}

static void decode(const e57 *e, const double *v, trip_point *out)
{
    const trip_e57_scan *s = &e->text.scans[e->scan];
    const bool spherical = !has_three(s, TRIP_E57_X);
    const double flat = v[TRIP_E57_RANGE] * cos(v[TRIP_E57_ELEVATION]);
    const double own[3] = {
        spherical ? flat * cos(v[TRIP_E57_AZIMUTH]) : v[TRIP_E57_X],
        spherical ? flat * sin(v[TRIP_E57_AZIMUTH]) : v[TRIP_E57_Y],
        spherical ? v[TRIP_E57_RANGE] * sin(v[TRIP_E57_ELEVATION]) : v[TRIP_E57_Z],
    };
    double normal[3];
    turn(e->turn, own, out->position);
    turn(e->turn, v + TRIP_E57_NORMAL_X, normal);
    for (int a = 0; a < 3; a++) {
        out->position[a] += s->translation[a];
        out->normal[a] = (float)normal[a];
        if (v[TRIP_E57_INVALID_COLOUR] == 0 && has_three(s, TRIP_E57_RED))
            out->colour[a] = colour_of(s, a, v[TRIP_E57_RED + a]);
    }
    out->intensity = v[TRIP_E57_INVALID_INTENSITY] == 0 ? (float)v[TRIP_E57_INTENSITY] : 0;
    out->classification = byte_of(v[TRIP_E57_CLASSIFICATION]);
    out->returns = byte_of(v[TRIP_E57_RETURN_COUNT]);
    out->return_number = has(s, TRIP_E57_RETURN_INDEX) ? byte_of(v[TRIP_E57_RETURN_INDEX] + 1) : 0;
    out->gps_time = v[TRIP_E57_TIME];
    out->scan = e->scan;
    if (v[spherical ? TRIP_E57_INVALID_DIRECTION : TRIP_E57_INVALID_POSITION] != 0)
        trip_point_drop(out);
}

static int read_one(trip_point_file *f, trip_point *out)
{
    e57 *e = f->state;
    const trip_e57_scan *s = &e->text.scans[e->scan];
    double v[TRIP_E57_FIELDS] = { 0 };
    for (int i = 0; i < TRIP_E57_FIELDS; i++)
        if (s->fields[i].exists) {
            const int status = next_value(f, (trip_e57_field)i, &v[i]);
            if (status < 0)
                return status;
        }
    decode(e, v, out);
    e->done++;
    return 0;
}

static int read_e57(trip_point_file *f, trip_point *out, size_t room, size_t *got_out)
{
    e57 *e = f->state;
    for (*got_out = 0; *got_out < room;) {
        int status = 0;
        bool more = true;
        if (e->scan >= e->text.count || e->done == e->text.scans[e->scan].count)
            status = begin_scan(f, &more);
        if (status == 0 && more)
            status = read_one(f, &out[(*got_out)++]);
        if (status < 0)
            return status;
        if (!more) {
            e->scan = e->text.count - 1; /* another read finds the end again */
            e->done = e->text.scans[e->scan].count;
            break;
        }
    }
    return 0;
}

static void close_e57(trip_point_file *f)
{
    e57 *e = f->state;
    if (!e)
        return;
    for (int i = 0; i < TRIP_E57_FIELDS; i++)
        free(e->cursors[i].bytes);
    trip_e57_text_release(&e->text);
    trip_e57_pages_close(e->pages);
    free(e);
}

const trip_point_reader trip_read_e57 = { probe, open_e57, read_e57, rewind_e57, close_e57 };
