#include "laz_points.h"

#include <stdlib.h>
#include <string.h>

#include "laz_fields.h"
#include "little_endian.h"
#include "report.h"

/* Offsets in a record of point format 6. */
enum { X = 0, Y = 4, Z = 8, INTENSITY = 12, RETURNS = 14, FLAGS = 15, CLASS = 16, TIME = 22 };

/* The layers of the point, in their order in the file. Colours have one more. */
typedef enum layer {
    LAYER_XY,
    LAYER_Z,
    LAYER_CLASS,
    LAYER_FLAGS,
    LAYER_INTENSITY,
    LAYER_ANGLE,
    LAYER_USER,
    LAYER_SOURCE,
    LAYER_TIME,
    LAYER_COLOUR,
    LAYERS
} layer;

enum { CHANNELS = 4, POINT_LAYERS = LAYER_COLOUR, POINT_BYTES = 30 };

/* The state of a channel of the scanner. */
typedef struct channel {
    bool used;
    unsigned char last[POINT_BYTES]; /* the last record */
    bool time_changed;               /* with the last record */
    trip_laz_model changed[8], other_channel, counts[16], numbers[16], same_time_numbers;
    trip_laz_model classes[64], flags[64];
    trip_laz_integers dx, dy, z, intensities;
    trip_laz_median x_steps[12], y_steps[12];
    int32_t heights[8];
    uint16_t last_intensities[8];
    trip_laz_times times;
    bool coloured;
    uint16_t rgb[3];
    trip_laz_colours colours;
} channel;

struct trip_laz_layered {
    trip_laz_items items;
    const trip_laz_item *colour; /* or NULL */
    uint32_t colour_at;          /* in a record */
    size_t sizes_bytes;
    trip_laz_room *room;
    trip_laz_decoder layers[LAYERS];
    bool present[LAYERS]; /* fields without a layer do not change in a chunk */
    uint32_t epoch;
    channel channels[CHANNELS];
    unsigned current, colour_channel;
};

/* The series of a return, by the returns of the pulse and the number of this one: a hexadecimal
 * digit each. */
static const char *const series_of[16] = {
    "0123453445555555", "1013333333333333", "2124444444433333", "3345444444444444",
    "4344544444444444", "5344454444444444", "3344445444444444", "4344444544444444",
    "4344444454444444", "5344444445444444", "5344444444544444", "5334444444455444",
    "5334444444455544", "5334444444445554", "5334444444444555", "5334444444444455",
};

int trip_laz_layered_create(trip_laz_layered **out, const trip_laz_items *items, int fd,
                            const char *path)
{
    uint32_t at = 0;
    trip_laz_layered *p = *out = calloc(1, sizeof *p);
    if (!p)
        return trip_fail(TRIP_ERROR, "read", path, "out of memory");
    p->items = *items;
    for (unsigned i = 0; i < items->count; i++) {
        const trip_laz_item *item = &p->items.items[i];
        p->sizes_bytes += 4 * (item->type == TRIP_LAZ_POINT_14        ? (size_t)POINT_LAYERS
                               : item->type == TRIP_LAZ_COLOUR_NIR_14 ? 2
                               : item->type == TRIP_LAZ_BYTES_14      ? item->bytes
                                                                      : 1);
        if (item->type == TRIP_LAZ_COLOUR_14 || item->type == TRIP_LAZ_COLOUR_NIR_14) {
            p->colour = item;
            p->colour_at = at;
        }
        at += item->bytes;
    }
    int status = trip_laz_room_create(&p->room, path);
    for (int l = 0; l < LAYERS && status == 0; l++)
        status = trip_laz_decoder_create(&p->layers[l], p->room, fd, path);
    return status;
}

void trip_laz_layered_destroy(trip_laz_layered *p)
{
    if (!p)
        return;
    for (int l = 0; l < LAYERS; l++)
        trip_laz_decoder_release(&p->layers[l]);
    trip_laz_room_destroy(p->room);
    free(p);
}

size_t trip_laz_layered_sizes_bytes(const trip_laz_layered *p)
{
    return p->sizes_bytes;
}

/* Begins a channel with the record before, of any channel. */
static void begin_channel(channel *c, const unsigned char *record)
{
    c->used = true;
    c->time_changed = false;
    memmove(c->last, record, POINT_BYTES);
    memset(c->x_steps, 0, sizeof c->x_steps);
    memset(c->y_steps, 0, sizeof c->y_steps);
    for (int i = 0; i < 8; i++) {
        c->heights[i] = (int32_t)trip_le_u32(record + Z);
        c->last_intensities[i] = trip_le_u16(record + INTENSITY);
    }
    trip_laz_times_begin(&c->times, trip_le_u64(record + TIME));
}

static unsigned channel_of(const unsigned char *record)
{
    return record[FLAGS] >> 4 & 3;
}

/* Returns whether the layer of a number is read. */
static bool is_read(const trip_laz_layered *p, size_t number)
{
    return number == LAYER_COLOUR ? p->colour != NULL
                                  : number < LAYERS && number != LAYER_ANGLE &&
                                        number != LAYER_USER && number != LAYER_SOURCE;
}

/* Aims the decoder of each layer that is read. Returns false if the layers end after `end`. */
static bool aim(trip_laz_layered *p, const unsigned char *sizes, uint64_t at, uint64_t end)
{
    for (size_t i = 0; 4 * i < p->sizes_bytes; i++) {
        const uint32_t bytes = trip_le_u32(sizes + 4 * i);
        if (bytes > end - at)
            return false;
        if (is_read(p, i)) {
            p->present[i] = bytes > 0 || i == LAYER_XY;
            trip_laz_decoder_aim(&p->layers[i], at, at + bytes, p->epoch);
            if (p->present[i])
                trip_laz_decoder_begin(&p->layers[i]);
        }
        at += bytes;
    }
    return true;
}

bool trip_laz_layered_begin(trip_laz_layered *p, const unsigned char *record,
                            const unsigned char *sizes, uint64_t at, uint64_t end)
{
    p->epoch += p->epoch == UINT32_MAX ? 2 : 1;
    if (at > end || !aim(p, sizes, at, end))
        return false;
    for (int c = 0; c < CHANNELS; c++)
        p->channels[c].used = p->channels[c].coloured = false;
    p->current = p->colour_channel = channel_of(record);
    channel *c = &p->channels[p->current];
    begin_channel(c, record);
    for (int k = 0; k < 3 && p->colour; k++)
        c->rgb[k] = trip_le_u16(record + p->colour_at + 2 * k);
    c->coloured = true;
    return true;
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

/* Decodes the number of the return. */
static unsigned next_number(channel *c, trip_laz_decoder *d, unsigned change, bool new_time,
                            unsigned before)
{
    if (change == 1)
        return (before + 1) & 15;
    if (change == 2)
        return (before + 15) & 15;
    if (change == 3 && new_time)
        return trip_laz_symbol(d, &c->numbers[before], 16);
    if (change == 3)
        return (before + trip_laz_symbol(d, &c->same_time_numbers, 13) + 2) & 15;
    return before;
}

/* Moves to the channel that the change names. */
static channel *switch_channel(trip_laz_layered *p, channel *from)
{
    const unsigned step = trip_laz_symbol(&p->layers[LAYER_XY], &from->other_channel, 3);
    p->current = (p->current + step + 1) & 3;
    channel *c = &p->channels[p->current];
    if (!c->used)
        begin_channel(c, from->last);
    c->last[FLAGS] = (unsigned char)((c->last[FLAGS] & 0xcf) | p->current << 4);
    return c;
}

static unsigned by_length(uint32_t length, unsigned most)
{
    return length < most ? length & ~1u : most;
}

static void next_position(trip_laz_layered *p, channel *c, unsigned count, unsigned number)
{
    trip_laz_decoder *d = &p->layers[LAYER_XY];
    unsigned char *r = c->last;
    const unsigned single = count == 1;
    const unsigned series =
        2 * (unsigned)(series_of[count][number] - '0') + (c->time_changed ? 1 : 0);
    const int32_t dx =
        trip_laz_integer(d, &c->dx, 32, trip_laz_median_of(&c->x_steps[series]), single);
    trip_laz_median_add(&c->x_steps[series], dx);
    put_u32(r + X, trip_le_u32(r + X) + (uint32_t)dx);
    const int32_t dy = trip_laz_integer(d, &c->dy, 32, trip_laz_median_of(&c->y_steps[series]),
                                        single + by_length(c->dx.length, 20));
    trip_laz_median_add(&c->y_steps[series], dy);
    put_u32(r + Y, trip_le_u32(r + Y) + (uint32_t)dy);
    if (!p->present[LAYER_Z])
        return;
    const int apart = abs((int)count - (int)number);
    int32_t *height = &c->heights[apart < 7 ? apart : 7];
    *height = trip_laz_integer(&p->layers[LAYER_Z], &c->z, 32, *height,
                               single + by_length((c->dx.length + c->dy.length) / 2, 18));
    put_u32(r + Z, (uint32_t)*height);
}

static void next_attributes(trip_laz_layered *p, channel *c, unsigned count, unsigned number)
{
    unsigned char *r = c->last;
    const bool first = number == 1, last = number >= count;
    const unsigned place = (first ? 2 : 0) + (last ? 1 : 0);
    if (p->present[LAYER_CLASS])
        r[CLASS] = (unsigned char)trip_laz_symbol(
            &p->layers[LAYER_CLASS], &c->classes[2 * (r[CLASS] & 31u) + (first && last ? 1 : 0)],
            256);
    if (p->present[LAYER_FLAGS]) {
        /* The layer holds the flags of the class, then the two of the scan. */
        const unsigned before = (r[FLAGS] & 15u) | (r[FLAGS] >> 2 & 48u);
        const unsigned now = trip_laz_symbol(&p->layers[LAYER_FLAGS], &c->flags[before], 64);
        r[FLAGS] = (unsigned char)((r[FLAGS] & 0x30) | (now & 15) | (now & 48) << 2);
    }
    if (p->present[LAYER_INTENSITY]) {
        uint16_t *before = &c->last_intensities[2 * place + (c->time_changed ? 1 : 0)];
        *before = (uint16_t)trip_laz_integer(&p->layers[LAYER_INTENSITY], &c->intensities, 16,
                                             *before, place);
        put_u16(r + INTENSITY, *before);
    }
    if (p->present[LAYER_TIME] && c->time_changed) {
        const uint64_t time = trip_laz_times_next(&c->times, &p->layers[LAYER_TIME], true);
        put_u32(r + TIME, (uint32_t)time);
        put_u32(r + TIME + 4, (uint32_t)(time >> 32));
    }
}

/* Decodes a colour with the models of a channel. Version 4 of the items takes the point's own
 * channel and its last colour. Version 3 takes channel 0 unless the channel has just changed, and
 * after a change between two channels in use the last colour of the other one. */
static void next_colour(trip_laz_layered *p, unsigned char *record, bool switched)
{
    const bool newer = p->colour->version > 3;
    const unsigned number = newer || switched ? p->current : 0;
    channel *c = &p->channels[number];
    uint16_t *last = p->channels[p->colour_channel].rgb;
    if (!c->coloured) {
        memcpy(c->rgb, last, sizeof c->rgb);
        c->coloured = true;
        last = c->rgb;
    } else if (newer) {
        last = c->rgb;
    }
    p->colour_channel = number;
    if (p->present[LAYER_COLOUR])
        trip_laz_colours_next(&c->colours, &p->layers[LAYER_COLOUR], last);
    for (int k = 0; k < 3; k++)
        put_u16(record + p->colour_at + 2 * k, last[k]);
}

void trip_laz_layered_next(trip_laz_layered *p, unsigned char *record)
{
    trip_laz_decoder *d = &p->layers[LAYER_XY];
    channel *c = &p->channels[p->current];
    const unsigned state = ((c->last[RETURNS] & 15) == 1 ? 1 : 0) +
                           ((c->last[RETURNS] & 15) >= c->last[RETURNS] >> 4 ? 2 : 0) +
                           (c->time_changed ? 4 : 0);
    const unsigned changed = trip_laz_symbol(d, &c->changed[state], 128);
    if (changed & 64)
        c = switch_channel(p, c);
    c->time_changed = changed & 16;
    unsigned number = c->last[RETURNS] & 15, count = c->last[RETURNS] >> 4;
    if (changed & 4)
        count = trip_laz_symbol(d, &c->counts[count], 16);
    number = next_number(c, d, changed & 3, c->time_changed, number);
    c->last[RETURNS] = (unsigned char)(number | count << 4);
    next_position(p, c, count, number);
    next_attributes(p, c, count, number);
    memcpy(record, c->last, POINT_BYTES);
    if (p->colour)
        next_colour(p, record, changed & 64);
}

bool trip_laz_layered_sound(const trip_laz_layered *p)
{
    for (int l = 0; l < LAYERS; l++)
        if (p->present[l] && !trip_laz_sound(&p->layers[l]))
            return false;
    return true;
}
