#include "laz_points.h"

#include <stdlib.h>
#include <string.h>

#include "laz_fields.h"
#include "little_endian.h"
#include "report.h"

/* Offsets in a record of point format 0. */
enum {
    X = 0,
    Y = 4,
    Z = 8,
    INTENSITY = 12,
    RETURNS = 14,
    CLASS = 15,
    ANGLE = 16,
    USER = 17,
    SOURCE = 18
};

typedef struct point_10 {
    trip_laz_model changed, angles[2], returns[256], classes[256], users[256];
    trip_laz_integers intensities, sources, dx, dy, z;
    trip_laz_median x_steps[16], y_steps[16];
    int32_t heights[8];
    uint16_t last_intensities[16];
} point_10;

typedef struct wave {
    trip_laz_model index, offset_kinds[4];
    trip_laz_integers offsets, sizes, places, gradients;
    unsigned kind;
    int32_t step;
} wave;

struct trip_laz_pointwise {
    trip_laz_items items;
    point_10 point;
    trip_laz_times times;
    trip_laz_colours colours;
    wave wave;
    trip_laz_model *bytes; /* one for each further byte */
};

/* The series that a return belongs to, by the returns of the pulse and the number of this one. */
static const uint8_t series_of[8][8] = {
    { 15, 14, 13, 12, 11, 10, 9, 8 },  { 14, 0, 1, 3, 6, 10, 10, 9 },
    { 13, 1, 2, 4, 7, 11, 11, 10 },    { 12, 3, 4, 5, 8, 12, 12, 11 },
    { 11, 6, 7, 8, 9, 13, 13, 12 },    { 10, 10, 11, 12, 13, 14, 14, 13 },
    { 9, 10, 11, 12, 13, 14, 15, 14 }, { 8, 9, 10, 11, 12, 13, 14, 15 },
};

int trip_laz_pointwise_create(trip_laz_pointwise **out, const trip_laz_items *items,
                              const char *path)
{
    trip_laz_pointwise *p = *out = calloc(1, sizeof *p);
    if (!p)
        return trip_fail(TRIP_ERROR, "read", path, "out of memory");
    p->items = *items;
    p->bytes = calloc(items->record_bytes, sizeof *p->bytes);
    return p->bytes ? 0 : trip_fail(TRIP_ERROR, "read", path, "out of memory");
}

void trip_laz_pointwise_destroy(trip_laz_pointwise *p)
{
    if (!p)
        return;
    free(p->bytes);
    free(p);
}

static void begin_point(point_10 *p)
{
    memset(p->x_steps, 0, sizeof p->x_steps);
    memset(p->y_steps, 0, sizeof p->y_steps);
    memset(p->heights, 0, sizeof p->heights);
    memset(p->last_intensities, 0, sizeof p->last_intensities);
}

void trip_laz_pointwise_begin(trip_laz_pointwise *p, const unsigned char *record)
{
    for (unsigned i = 0; i < p->items.count; i++) {
        const trip_laz_item *item = &p->items.items[i];
        if (item->type == TRIP_LAZ_POINT_10)
            begin_point(&p->point);
        else if (item->type == TRIP_LAZ_TIME)
            trip_laz_times_begin(&p->times, trip_le_u64(record));
        else if (item->type == TRIP_LAZ_WAVE)
            p->wave.kind = 0, p->wave.step = 0;
        record += item->bytes;
    }
}

static void put_u16(unsigned char *to, unsigned v)
{
    to[0] = (unsigned char)v;
    to[1] = (unsigned char)(v >> 8);
}

static void put_u32(unsigned char *to, uint32_t v)
{
    put_u16(to, v & 0xffff);
    put_u16(to + 2, v >> 16);
}

static void put_u64(unsigned char *to, uint64_t v)
{
    put_u32(to, (uint32_t)v);
    put_u32(to + 4, (uint32_t)(v >> 32));
}

static int32_t i32_at(const unsigned char *p)
{
    return (int32_t)trip_le_u32(p);
}

/* Decodes the fields beside the coordinates that changed. */
static void next_attributes(point_10 *p, trip_laz_decoder *d, unsigned changed, unsigned char *r)
{
    if (changed & 32)
        r[RETURNS] = (unsigned char)trip_laz_symbol(d, &p->returns[r[RETURNS]], 256);
    const unsigned series = series_of[r[RETURNS] >> 3 & 7][r[RETURNS] & 7];
    if (changed & 16)
        p->last_intensities[series] = (uint16_t)trip_laz_integer(
            d, &p->intensities, 16, p->last_intensities[series], series < 3 ? series : 3);
    put_u16(r + INTENSITY, p->last_intensities[series]);
    if (changed & 8)
        r[CLASS] = (unsigned char)trip_laz_symbol(d, &p->classes[r[CLASS]], 256);
    if (changed & 4)
        r[ANGLE] =
            (unsigned char)(r[ANGLE] + trip_laz_symbol(d, &p->angles[r[RETURNS] >> 6 & 1], 256));
    if (changed & 2)
        r[USER] = (unsigned char)trip_laz_symbol(d, &p->users[r[USER]], 256);
    if (changed & 1)
        put_u16(r + SOURCE,
                (unsigned)trip_laz_integer(d, &p->sources, 16, trip_le_u16(r + SOURCE), 0));
}

/* Returns the context of a code by the length of the ones before. */
static unsigned by_length(uint32_t length, unsigned most)
{
    return length < most ? length & ~1u : most;
}

static void next_point(point_10 *p, trip_laz_decoder *d, unsigned char *r)
{
    const unsigned changed = trip_laz_symbol(d, &p->changed, 64);
    if (changed)
        next_attributes(p, d, changed, r);
    const int number = r[RETURNS] & 7, count = r[RETURNS] >> 3 & 7;
    const unsigned series = series_of[count][number], single = count == 1;
    const int32_t dx =
        trip_laz_integer(d, &p->dx, 32, trip_laz_median_of(&p->x_steps[series]), single);
    trip_laz_median_add(&p->x_steps[series], dx);
    put_u32(r + X, trip_le_u32(r + X) + (uint32_t)dx);
    const int32_t dy = trip_laz_integer(d, &p->dy, 32, trip_laz_median_of(&p->y_steps[series]),
                                        single + by_length(p->dx.length, 20));
    trip_laz_median_add(&p->y_steps[series], dy);
    put_u32(r + Y, trip_le_u32(r + Y) + (uint32_t)dy);
    int32_t *height = &p->heights[abs(count - number)];
    *height = trip_laz_integer(d, &p->z, 32, *height,
                               single + by_length((p->dx.length + p->dy.length) / 2, 18));
    put_u32(r + Z, (uint32_t)*height);
}

/* A packet of a waveform: index, offset in the file, size, place of the return, and a gradient. */
static void next_wave(wave *w, trip_laz_decoder *d, unsigned char *r)
{
    enum { OFFSET = 1, SIZE = 9, PLACE = 13, GRADIENT = 17 };
    uint64_t offset = trip_le_u64(r + OFFSET);
    r[0] = (unsigned char)trip_laz_symbol(d, &w->index, 256);
    w->kind = trip_laz_symbol(d, &w->offset_kinds[w->kind], 4);
    if (w->kind == 1)
        offset += trip_le_u32(r + SIZE);
    else if (w->kind == 2)
        offset += (uint64_t)(int64_t)(w->step = trip_laz_integer(d, &w->offsets, 32, w->step, 0));
    else if (w->kind == 3) {
        offset = trip_laz_raw_bits(d, 32);
        offset |= (uint64_t)trip_laz_raw_bits(d, 32) << 32;
    }
    put_u64(r + OFFSET, offset);
    put_u32(r + SIZE, (uint32_t)trip_laz_integer(d, &w->sizes, 32, i32_at(r + SIZE), 0));
    put_u32(r + PLACE, (uint32_t)trip_laz_integer(d, &w->places, 32, i32_at(r + PLACE), 0));
    for (unsigned a = 0; a < 3; a++) {
        unsigned char *at = r + GRADIENT + 4 * a;
        put_u32(at, (uint32_t)trip_laz_integer(d, &w->gradients, 32, i32_at(at), a));
    }
}

void trip_laz_pointwise_next(trip_laz_pointwise *p, trip_laz_decoder *d, unsigned char *record)
{
    for (unsigned i = 0; i < p->items.count; i++) {
        const trip_laz_item *item = &p->items.items[i];
        uint16_t rgb[3];
        switch (item->type) {
        case TRIP_LAZ_POINT_10:
            next_point(&p->point, d, record);
            break;
        case TRIP_LAZ_TIME:
            put_u64(record, trip_laz_times_next(&p->times, d, false));
            break;
        case TRIP_LAZ_COLOUR:
            for (int c = 0; c < 3; c++)
                rgb[c] = trip_le_u16(record + 2 * c);
            trip_laz_colours_next(&p->colours, d, rgb);
            for (int c = 0; c < 3; c++)
                put_u16(record + 2 * c, rgb[c]);
            break;
        case TRIP_LAZ_WAVE:
            next_wave(&p->wave, d, record);
            break;
        default:
            for (unsigned b = 0; b < item->bytes; b++)
                record[b] = (unsigned char)(record[b] + trip_laz_symbol(d, &p->bytes[b], 256));
        }
        record += item->bytes;
    }
}
