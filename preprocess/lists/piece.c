#include "piece.h"

#include "clones.h"

#include <string.h>

/* Returns the number of 64-bit masks with one bit for each word of the bitmap. */
static unsigned mask_count(const trip_piece_format *f)
{
    return (trip_tile_words(f) + 63) / 64;
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
    if (f->deviations) {
        parts.deviations = parts.bytes;
        parts.bytes += padded(splats);
    }
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
    return trip_piece_layout(f, splats, trip_tile_words(f)).bytes;
}

unsigned trip_piece_choose_words(const trip_piece_format *f, uint32_t splats, unsigned used)
{
    return (mask_count(f) + used) * 8 <= padded(splats * sizeof(uint16_t)) ? used : 0;
}

static void write_bitmap(uint64_t *to, const trip_piece_format *f, const uint64_t *bitmap)
{
    uint64_t *word = to + mask_count(f);
    memset(to, 0, mask_count(f) * sizeof *to);
    for (unsigned w = 0; w < trip_tile_words(f); w++) {
        if (bitmap[w] == 0)
            continue;
        to[w / 64] |= UINT64_C(1) << (w % 64);
        *word++ = bitmap[w];
    }
}

static void write_list(uint16_t *to, const trip_piece_format *f, uint32_t splats,
                       const uint64_t *bitmap)
{
    uint16_t *end = to;
    for (unsigned w = 0; w < trip_tile_words(f); w++)
        end += trip_word_positions(bitmap[w], w, end);
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

TRIP_ALSO_V3 uint32_t trip_piece_positions(const trip_piece *p, const trip_piece_format *f,
                                           uint16_t *to)
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
            n += trip_word_positions(*word++, m * 64 + (unsigned)__builtin_ctzll(bits), to + n);
    return n;
}

static bool check_bitmap(const trip_piece *p, const trip_piece_format *f)
{
    const uint64_t *mask = (const void *)(p + 1);
    const uint64_t *word = mask + mask_count(f);
    unsigned words = 0, splats = 0;
    if (trip_tile_words(f) < 64 && mask[0] >> trip_tile_words(f))
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
    if (room < sizeof *p || p->last >= 1u << 2 * f->tile_log2 || p->words > trip_tile_words(f) ||
        trip_piece_get_parts(f, p).bytes > room)
        return false;
    return p->words ? check_bitmap(p, f) : check_list(p, f);
}
