#include "piece.h"

#include <string.h>

#include "format.h"
#include "normal.h"
#include "report.h"

static unsigned tile_words(const trip_piece_format *f)
{
    return 1u << (2 * f->tile_log2 - 6);
}

/* 64-bit masks that say which words of the bitmap are there. */
static unsigned mask_count(const trip_piece_format *f)
{
    return (tile_words(f) + 63) / 64;
}

static size_t padded(size_t bytes)
{
    return (bytes + 7) & ~(size_t)7;
}

trip_piece_parts trip_piece_layout(const trip_piece_format *f, uint32_t splats, unsigned words)
{
    trip_piece_parts parts = { .positions = sizeof(trip_piece) };
    size_t positions = words ? (mask_count(f) + words) * 8 : padded(splats * sizeof(uint16_t));
    parts.values = parts.positions + positions;
    parts.bytes = parts.values + padded(splats * (f->quantised ? sizeof(uint16_t) : sizeof(float)));
    if (!f->normals)
        return parts;
    parts.normals = parts.bytes;
    parts.bytes += padded(splats * sizeof(uint32_t));
    if (f->quantised)
        return parts;
    parts.magnitudes = parts.bytes;
    parts.bytes += padded(splats * sizeof(float));
    return parts;
}

size_t trip_piece_max_bytes(const trip_piece_format *f)
{
    uint32_t splats = 1u << 2 * f->tile_log2;
    return trip_piece_layout(f, splats, tile_words(f)).bytes;
}

unsigned trip_piece_choose_words(const trip_piece_format *f, uint32_t splats, unsigned used)
{
    return (mask_count(f) + used) * 8 <= padded(splats * sizeof(uint16_t)) ? used : 0;
}

static void write_bitmap(uint64_t *to, const trip_piece_format *f, const uint64_t *bitmap)
{
    uint64_t *word = to + mask_count(f);
    memset(to, 0, mask_count(f) * sizeof *to);
    for (unsigned w = 0; w < tile_words(f); w++) {
        if (bitmap[w] == 0)
            continue;
        to[w / 64] |= UINT64_C(1) << (w % 64);
        *word++ = bitmap[w];
    }
}

/* Positions of the bits set in word `w`; returns how many. */
static inline unsigned expand_word(uint64_t bits, unsigned w, uint16_t *to)
{
    unsigned n = 0;
    for (; bits; bits &= bits - 1)
        to[n++] = (uint16_t)(w * 64 + (unsigned)__builtin_ctzll(bits));
    return n;
}

static void write_list(uint16_t *to, const trip_piece_format *f, uint32_t splats,
                       const uint64_t *bitmap)
{
    uint16_t *end = to;
    for (unsigned w = 0; w < tile_words(f); w++)
        end += expand_word(bitmap[w], w, end);
    memset(end, 0, padded(splats * sizeof *to) - splats * sizeof *to);
}

void trip_piece_begin(trip_piece *p, const trip_piece_format *f, uint64_t key, uint32_t splats,
                      unsigned words, const uint64_t *bitmap)
{
    *p = (trip_piece){ .key = key, .last = (uint16_t)(splats - 1), .words = (uint16_t)words };
    void *positions = p + 1;
    if (words)
        write_bitmap(positions, f, bitmap);
    else
        write_list(positions, f, splats, bitmap);
}

/* All positions of a piece; returns their number, which for sound pieces is the header's. */
static uint32_t expand(const trip_piece *p, const trip_piece_format *f, uint16_t *to)
{
    if (p->words == 0) {
        memcpy(to, p + 1, (p->last + 1u) * sizeof *to);
        return p->last + 1u;
    }
    const uint64_t *mask = (const void *)(p + 1);
    const uint64_t *word = mask + mask_count(f);
    uint32_t n = 0;
    for (unsigned m = 0; m < mask_count(f); m++)
        for (uint64_t bits = mask[m]; bits; bits &= bits - 1)
            n += expand_word(*word++, m * 64 + (unsigned)__builtin_ctzll(bits), to + n);
    return n;
}

static bool check_bitmap(const trip_piece *p, const trip_piece_format *f)
{
    const uint64_t *mask = (const void *)(p + 1);
    const uint64_t *word = mask + mask_count(f);
    unsigned words = 0, splats = 0;
    if (tile_words(f) < 64 && mask[0] >> tile_words(f))
        return false;
    for (unsigned m = 0; m < mask_count(f); m++)
        words += (unsigned)__builtin_popcountll(mask[m]);
    if (words != p->words)
        return false;
    for (unsigned w = 0; w < words; w++)
        splats += (unsigned)__builtin_popcountll(word[w]);
    return splats == p->last + 1u;
}

static bool check_list(const trip_piece *p, const trip_piece_format *f)
{
    const uint16_t *positions = (const void *)(p + 1);
    for (uint32_t i = 1; i <= p->last; i++)
        if (positions[i] <= positions[i - 1])
            return false;
    return positions[p->last] < 1u << 2 * f->tile_log2;
}

bool trip_piece_check(const trip_piece *p, const trip_piece_format *f, size_t room)
{
    if (room < sizeof *p || p->last >= 1u << 2 * f->tile_log2 || p->words > tile_words(f) ||
        trip_piece_get_parts(f, p).bytes > room)
        return false;
    return p->words ? check_bitmap(p, f) : check_list(p, f);
}

/* One entry a place in the tile, written where pieces have a splat. While there is one piece alone,
 * its splats stand in order in the arrays of records: many tiles have no other. */
struct trip_tile {
    trip_piece_format format;
    trip_budget *budget;
    bool started;   /* something was added */
    uint32_t alone; /* splats of the one piece; 0 when there are more */
    uint16_t alone_positions[TRIP_TILE_MAX_SPLATS];
    uint64_t bits[TRIP_TILE_MAX_WORDS];
    uint16_t positions[TRIP_TILE_MAX_SPLATS];
    uint16_t uv[TRIP_TILE_MAX_SPLATS]; /* bytes u and v of a place */
    uint32_t values[TRIP_TILE_MAX_SPLATS];
    uint32_t normals[TRIP_TILE_MAX_SPLATS];
    float magnitudes[TRIP_TILE_MAX_SPLATS];
    uint32_t voxel_records[TRIP_TILE_MAX_SPLATS];
    uint32_t normal_records[TRIP_TILE_MAX_SPLATS];
};

int trip_tile_create(trip_tile **out, const trip_piece_format *f, trip_budget *budget)
{
    trip_tile *t = *out = trip_budget_take(budget, sizeof *t);
    if (!t)
        return trip_fail(TRIP_ERROR, "brick", "merge",
                         "needs more memory than is allowed: give more with --memory");
    t->format = *f;
    t->budget = budget;
    for (unsigned v = 0; v < 1u << f->tile_log2; v++)
        for (unsigned u = 0; u < 1u << f->tile_log2; u++)
            t->uv[trip_morton(u, v)] = (uint16_t)(u | v << 8);
    return 0;
}

void trip_tile_destroy(trip_tile *t)
{
    if (t)
        trip_budget_release(t->budget, t, sizeof *t);
}

static void add_first(trip_tile *t, const trip_piece *p)
{
    const unsigned char *base = (const unsigned char *)p;
    trip_piece_parts parts = trip_piece_get_parts(&t->format, p);
    const uint16_t *codes = (const void *)(base + parts.values);
    t->alone = expand(p, &t->format, t->alone_positions);
    for (uint32_t i = 0; i < t->alone; i++)
        t->voxel_records[i] = codes[i];
    if (parts.normals)
        memcpy(t->normal_records, base + parts.normals, t->alone * sizeof *t->normal_records);
}

/* Puts the splats of the first piece where those of others go. */
static void scatter_first(trip_tile *t)
{
    for (uint32_t i = 0; i < t->alone; i++) {
        unsigned position = t->alone_positions[i];
        t->bits[position / 64] |= UINT64_C(1) << (position % 64);
        t->values[position] = t->voxel_records[i];
    }
    for (uint32_t i = 0; t->format.normals && i < t->alone; i++)
        t->normals[t->alone_positions[i]] = t->normal_records[i];
    t->alone = 0;
}

static void scatter_values(trip_tile *t, const void *from, uint32_t splats)
{
    const uint16_t *codes = from;
    const uint32_t *floats = from;
    if (t->format.quantised)
        for (uint32_t i = 0; i < splats; i++)
            t->values[t->positions[i]] = codes[i];
    else
        for (uint32_t i = 0; i < splats; i++)
            t->values[t->positions[i]] = floats[i];
}

static void scatter_piece(trip_tile *t, const trip_piece *p)
{
    const unsigned char *base = (const unsigned char *)p;
    trip_piece_parts parts = trip_piece_get_parts(&t->format, p);
    uint32_t splats = expand(p, &t->format, t->positions);
    for (uint32_t i = 0; i < splats; i++)
        t->bits[t->positions[i] / 64] |= UINT64_C(1) << (t->positions[i] % 64);
    scatter_values(t, base + parts.values, splats);
    const uint32_t *normals = (const void *)(base + parts.normals);
    if (parts.normals)
        for (uint32_t i = 0; i < splats; i++)
            t->normals[t->positions[i]] = normals[i];
    const float *magnitudes = (const void *)(base + parts.magnitudes);
    if (parts.magnitudes)
        for (uint32_t i = 0; i < splats; i++)
            t->magnitudes[t->positions[i]] = magnitudes[i];
}

void trip_tile_add(trip_tile *t, const trip_piece *p)
{
    if (!t->started && t->format.quantised) {
        add_first(t, p);
    } else {
        scatter_first(t);
        scatter_piece(t, p);
    }
    t->started = true;
}

static uint32_t take_positions(trip_tile *t)
{
    uint32_t n = 0;
    for (unsigned w = 0; w < tile_words(&t->format); w++) {
        n += expand_word(t->bits[w], w, t->positions + n);
        t->bits[w] = 0;
    }
    return n;
}

static uint32_t code_of(const trip_tile *t, const trip_quantiser *q, unsigned position)
{
    float value;
    if (t->format.quantised)
        return t->values[position];
    memcpy(&value, &t->values[position], sizeof value);
    return trip_quantise(q, value);
}

static uint32_t normal_of(const trip_tile *t, const trip_quantiser *q, unsigned position)
{
    if (t->format.quantised)
        return t->normals[position];
    double scale = q->gradient_scale * (q->gradient_unit > 0 ? q->gradient_unit : 1);
    uint32_t magnitude =
        trip_normal_pack((const double[3]){ t->magnitudes[position] }, scale) >> 24;
    return magnitude ? t->normals[position] | magnitude << 24 : 0;
}

static uint32_t take_alone(trip_tile *t)
{
    uint32_t splats = t->alone;
    for (uint32_t i = 0; i < splats; i++)
        t->voxel_records[i] = t->uv[t->alone_positions[i]] | t->voxel_records[i] << 16;
    t->alone = 0;
    return splats;
}

static uint32_t take_scattered(trip_tile *t, const trip_quantiser *q)
{
    uint32_t splats = take_positions(t);
    for (uint32_t i = 0; i < splats; i++) {
        unsigned position = t->positions[i];
        t->voxel_records[i] = t->uv[position] | code_of(t, q, position) << 16;
    }
    for (uint32_t i = 0; t->format.normals && i < splats; i++)
        t->normal_records[i] = normal_of(t, q, t->positions[i]);
    return splats;
}

uint32_t trip_tile_take(trip_tile *t, const trip_quantiser *q, const uint32_t **voxels,
                        const uint32_t **normals)
{
    t->started = false;
    *voxels = t->voxel_records;
    *normals = t->format.normals ? t->normal_records : NULL;
    return t->alone ? take_alone(t) : take_scattered(t, q);
}
