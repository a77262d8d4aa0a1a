#include "laz_codes.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "read_at.h"
#include "report.h"

enum {
    WIDTH_MIN = 1 << 24, /* below this width, the decoder takes another byte */
    BIT_SHIFT = 13,      /* fractions of a model of bits have 13 bits, of symbols 15 */
    SYMBOL_SHIFT = 15,
    HIGH_BITS = 8, /* leading bits of a correction that have a model */
    BLOCK_VALUES = 1 << 15,
    BEYOND_MAX = 4, /* an encoder may leave out its last bytes if they are 0 */
};

/* ---- memory ---- */

typedef struct block {
    struct block *next;
    size_t used;
    uint16_t values[BLOCK_VALUES];
} block;

struct trip_laz_room {
    block *blocks;
};

int trip_laz_room_create(trip_laz_room **out, const char *path)
{
    *out = calloc(1, sizeof **out);
    return *out ? 0 : trip_fail(TRIP_ERROR, "read", path, "out of memory");
}

void trip_laz_room_destroy(trip_laz_room *r)
{
    while (r && r->blocks) {
        block *next = r->blocks->next;
        free(r->blocks);
        r->blocks = next;
    }
    free(r);
}

static uint16_t *take(trip_laz_room *r, size_t values)
{
    if (!r->blocks || r->blocks->used + values > BLOCK_VALUES) {
        block *made = malloc(sizeof *made);
        if (!made)
            return NULL;
        made->next = r->blocks;
        made->used = 0;
        r->blocks = made;
    }
    uint16_t *taken = r->blocks->values + r->blocks->used;
    r->blocks->used += values;
    return taken;
}

/* ---- bytes ---- */

int trip_laz_decoder_create(trip_laz_decoder *d, trip_laz_room *room, int fd, const char *path)
{
    *d = (trip_laz_decoder){ .room = room, .fd = fd, .buffer = malloc(TRIP_LAZ_BUFFER_BYTES) };
    return d->buffer ? 0 : trip_fail(TRIP_ERROR, "read", path, "out of memory");
}

void trip_laz_decoder_release(trip_laz_decoder *d)
{
    free(d->buffer);
    d->buffer = NULL;
}

void trip_laz_decoder_aim(trip_laz_decoder *d, uint64_t from, uint64_t to, uint32_t epoch)
{
    /* Small steps forward keep the buffer, as between chunks. */
    const uint64_t begin = d->at - d->have;
    if (d->have > 0 && from >= begin && from <= d->at && d->at <= to) {
        d->used = (uint32_t)(from - begin);
    } else {
        d->at = from;
        d->used = d->have = 0;
    }
    d->end = to;
    d->epoch = epoch;
    d->beyond = 0;
}

static void fill(trip_laz_decoder *d)
{
    const uint64_t left = d->end > d->at ? d->end - d->at : 0;
    const size_t wanted = left < TRIP_LAZ_BUFFER_BYTES ? (size_t)left : TRIP_LAZ_BUFFER_BYTES;
    const ssize_t got = wanted ? trip_read_at(d->fd, d->buffer, wanted, wanted, d->at) : 0;
    d->failed = d->failed || got < 0;
    d->used = 0;
    d->have = got > 0 ? (uint32_t)got : 0;
    d->at += d->have;
}

unsigned trip_laz_byte(trip_laz_decoder *d)
{
    if (d->used == d->have)
        fill(d);
    if (d->have > 0)
        return d->buffer[d->used++];
    d->beyond += d->beyond < UINT32_MAX;
    return 0;
}

uint64_t trip_laz_position(const trip_laz_decoder *d)
{
    return d->at - (d->have - d->used);
}

bool trip_laz_sound(const trip_laz_decoder *d)
{
    return !d->failed && d->beyond <= BEYOND_MAX;
}

/* ---- arithmetic codes ---- */

void trip_laz_decoder_begin(trip_laz_decoder *d)
{
    d->width = UINT32_MAX;
    d->value = 0;
    for (int i = 0; i < 4; i++)
        d->value = d->value << 8 | trip_laz_byte(d);
}

/* Widens an interval that became narrow. */
static void widen(trip_laz_decoder *d)
{
    /* Bytes that no encoder writes can leave a value outside of the interval. */
    d->failed = d->failed || d->width == 0;
    while (d->width < WIDTH_MIN && !d->failed) {
        d->value = d->value << 8 | trip_laz_byte(d);
        d->width <<= 8;
    }
    if (d->failed)
        d->width = UINT32_MAX;
}

static uint32_t longer(uint32_t cycle, uint32_t most)
{
    cycle = cycle * 5 / 4;
    return cycle < most ? cycle : most;
}

static void adapt_bits(trip_laz_bit_model *m)
{
    enum { MOST = 1 << BIT_SHIFT, LONGEST = 64 };
    m->all += m->cycle;
    if (m->all > MOST) {
        m->all = (m->all + 1) / 2;
        m->zeros = (m->zeros + 1) / 2;
        m->all += m->zeros == m->all;
    }
    m->share = m->zeros * (0x80000000u / m->all) >> (31 - BIT_SHIFT);
    m->left = m->cycle = longer(m->cycle, LONGEST);
}

uint32_t trip_laz_bit(trip_laz_decoder *d, trip_laz_bit_model *m)
{
    if (m->epoch != d->epoch)
        *m = (trip_laz_bit_model){ .epoch = d->epoch,
                                   .zeros = 1,
                                   .all = 2,
                                   .share = 1 << (BIT_SHIFT - 1),
                                   .cycle = 4,
                                   .left = 4 };
    const uint32_t limit = m->share * (d->width >> BIT_SHIFT);
    const bool one = d->value >= limit;
    if (one) {
        d->value -= limit;
        d->width -= limit;
    } else {
        d->width = limit;
        m->zeros++;
    }
    if (d->width < WIDTH_MIN)
        widen(d);
    if (--m->left == 0)
        adapt_bits(m);
    return one;
}

/* Computes the shares of the symbols from their counts. */
static void adapt(trip_laz_model *m)
{
    uint16_t *starts = m->counts + m->symbols;
    m->total += m->cycle;
    if (m->total > 1u << SYMBOL_SHIFT) {
        m->total = 0;
        for (uint32_t i = 0; i < m->symbols; i++)
            m->total += m->counts[i] = (uint16_t)((m->counts[i] + 1) / 2);
    }
    const uint32_t scale = 0x80000000u / m->total;
    uint32_t sum = 0;
    for (uint32_t i = 0; i < m->symbols; i++) {
        starts[i] = (uint16_t)(scale * sum >> (31 - SYMBOL_SHIFT));
        sum += m->counts[i];
    }
    m->left = m->cycle = longer(m->cycle, (m->symbols + 6) * 8);
}

/* Begins a model with equal counts. Returns false without memory. */
static bool begin_model(trip_laz_decoder *d, trip_laz_model *m, uint32_t symbols)
{
    if (!m->counts && !(m->counts = take(d->room, 2 * (size_t)symbols)))
        return false;
    m->epoch = d->epoch;
    m->symbols = symbols;
    m->total = 0;
    m->cycle = symbols;
    for (uint32_t i = 0; i < symbols; i++)
        m->counts[i] = 1;
    adapt(m);
    m->left = m->cycle = (symbols + 6) / 2;
    return true;
}

uint32_t trip_laz_symbol(trip_laz_decoder *d, trip_laz_model *m, uint32_t symbols)
{
    if (m->epoch != d->epoch && !begin_model(d, m, symbols)) {
        d->failed = true;
        return 0;
    }
    const uint16_t *starts = m->counts + m->symbols;
    const uint32_t unit = d->width >> SYMBOL_SHIFT;
    const uint32_t place = d->value / unit;
    uint32_t low = 0;
    for (uint32_t left = symbols; left > 1;) {
        const uint32_t half = left / 2;
        low += starts[low + half] <= place ? half : 0; /* without a branch */
        left -= half;
    }
    const uint32_t high = low + 1;
    const uint32_t from = starts[low] * unit;
    const uint32_t to = high < symbols ? starts[high] * unit : d->width;
    d->value -= from;
    d->width = to - from;
    if (d->width < WIDTH_MIN)
        widen(d);
    m->counts[low]++;
    if (--m->left == 0)
        adapt(m);
    return low;
}

uint32_t trip_laz_raw_bits(trip_laz_decoder *d, unsigned bits)
{
    enum { MOST = 19, LOW = 16 };
    if (bits > MOST) {
        const uint32_t low = trip_laz_raw_bits(d, LOW);
        return trip_laz_raw_bits(d, bits - LOW) << LOW | low;
    }
    d->width >>= bits;
    const uint32_t number = d->value / d->width;
    d->value -= number * d->width;
    if (d->width < WIDTH_MIN)
        widen(d);
    return number & ((1u << bits) - 1);
}

/* ---- integers ---- */

/* Returns a correction of `length` bits: the lower half of the codes is negative. */
static int64_t correction(trip_laz_decoder *d, trip_laz_integers *i, unsigned length)
{
    const unsigned high = length < HIGH_BITS ? length : HIGH_BITS;
    const unsigned low = length - high;
    int64_t c = trip_laz_symbol(d, &i->corrections[length], 1u << high);
    if (low > 0)
        c = c << low | trip_laz_raw_bits(d, low);
    const int64_t half = (int64_t)1 << (length - 1);
    return c >= half ? c + 1 : c - (2 * half - 1);
}

int32_t trip_laz_integer(trip_laz_decoder *d, trip_laz_integers *i, unsigned bits,
                         int32_t prediction, unsigned context)
{
    const unsigned length = trip_laz_symbol(d, &i->lengths[context], bits + 1);
    int64_t c;
    i->length = length;
    if (length == 0)
        c = trip_laz_bit(d, &i->shortest);
    else if (length == 32)
        c = INT32_MIN;
    else
        c = correction(d, i, length);
    const uint64_t sum = (uint64_t)(prediction + c);
    return bits == 32 ? (int32_t)(uint32_t)sum : (int32_t)(sum & ((1u << bits) - 1));
}
