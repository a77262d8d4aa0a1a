/* A piece holds the splats that one box of voxels contributes to one tile of one sheet of a list.
 * The threads that make splats, the spill and the merge exchange splats only as pieces. Pure
 * functions.
 *
 * In memory and in the spill, a piece is a header followed by these parts. Each part is padded to 8
 * bytes.
 *   positions    Morton codes of (u, v) in the tile, ascending, in the shorter of two forms. If
 *                `words` is 0, one uint16 for each splat. Otherwise a mask with one bit for each
 *                nonzero word of the tile's bitmap, then these `words` 64-bit words.
 *   values       codes (uint16), or float32 while the range of values is unknown.
 *   normals      packed (uint32), without magnitude while the range of values is unknown.
 *   deviations   packed (uint8, deviation.h), only of coarse values.
 *   magnitudes   float32, gradients per gradient_unit; only while the range of values is unknown.
 */
#ifndef TRIP_PIECE_H
#define TRIP_PIECE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "budget.h"
#include "format.h"
#include "knots.h"

/* Lists 0 to 2 hold kept voxels along X, Y and Z. Lists 3 to 5 hold their halo. */
enum { TRIP_HALO_LISTS = 3, TRIP_MAX_LISTS = 6 };

static inline int trip_list_axis(unsigned list)
{
    return (int)(list % 3);
}

enum {
    TRIP_TILE_MAX_EDGE = 128,
    TRIP_TILE_MAX_SPLATS = TRIP_TILE_MAX_EDGE * TRIP_TILE_MAX_EDGE,
    TRIP_TILE_MAX_WORDS = TRIP_TILE_MAX_SPLATS / 64,
    TRIP_TILE_MORTON_BITS = 40, /* a sheet has up to 2^20 by 2^20 tiles */
};

/* The scale of codes, value(c) = lo + (hi - lo) * c / 65535 or knots, and of the magnitudes of
 * normals. */
typedef struct trip_quantiser {
    double lo, hi;
    double gradient_full;    /* `full` of 4-byte normals (normal.h) */
    double gradient_unit;    /* trip_gradient_unit() of magnitudes kept as floats; 0 stands for 1 */
    bool bytes;              /* use only the codes that 8 bits can express (format.h) */
    const trip_knots *knots; /* NULL means even codes */
    bool ids;                /* codes are ranks or numbers of ids (ids.h), which have no mean */
} trip_quantiser;

/* Sets the values of codes 0 and 65535 from the values of the first and the last 8-bit code. */
static inline void trip_quantiser_set_bytes(trip_quantiser *q, double first, double last)
{
    const double below = TRIP_CODE_FIRST * ((last - first) / 255);
    q->lo = first - below;
    q->hi = last + below;
}

/* Returns the nearest code. NaN gives the minimum code. */
static inline uint32_t trip_quantise(const trip_quantiser *q, double value)
{
    if (q->knots)
        return trip_knots_code(q->knots, value);
    const uint32_t step = q->bytes ? TRIP_CODE_STEP : 1, min = q->bytes ? TRIP_CODE_FIRST : 0,
                   max = q->bytes ? TRIP_CODE_FIRST + 255 : 65535;
    double code = (value - q->lo) * (65535 / step / (q->hi - q->lo)) + 0.5;
    return step * (!(code > min) ? min : code >= max ? max : (uint32_t)code);
}

/* The format of all pieces of one bricking. Pieces of the halo never have normals. */
typedef struct trip_piece_format {
    unsigned tile_log2;
    bool quantised; /* values are codes; otherwise values are floats, and normals store magnitudes
                       separately */
    bool normals;
    bool halo;       /* the data set has lists of the halo */
    bool deviations; /* the lists of the halo are coarse values with deviations */
} trip_piece_format;

static inline unsigned trip_piece_list_count(const trip_piece_format *f)
{
    return f->halo ? TRIP_MAX_LISTS : TRIP_HALO_LISTS;
}

/* Returns the number of 64-bit words in a tile's bitmap. */
static inline unsigned trip_tile_words(const trip_piece_format *f)
{
    return 1u << (2 * f->tile_log2 - 6);
}

/* Returns the format of the pieces of one list. */
static inline trip_piece_format trip_piece_format_of(const trip_piece_format *f, unsigned list)
{
    trip_piece_format own = *f;
    own.normals = f->normals && list < TRIP_HALO_LISTS;
    own.deviations = f->deviations && list >= TRIP_HALO_LISTS;
    return own;
}

typedef struct trip_piece {
    uint64_t key;  /* sheet << TRIP_TILE_MORTON_BITS | Morton code of the tile */
    uint32_t next; /* links pieces; set by the owner of the memory */
    uint16_t last; /* number of splats - 1 */
    uint16_t words;
} trip_piece;

/* Offsets of the parts in bytes from the start of a piece, and its length. Absent parts have offset
 * 0. */
typedef struct trip_piece_parts {
    size_t positions, values, normals, deviations, magnitudes, bytes;
} trip_piece_parts;

trip_piece_parts trip_piece_layout(const trip_piece_format *f, uint32_t splats, unsigned words);

static inline trip_piece_parts trip_piece_get_parts(const trip_piece_format *f, const trip_piece *p)
{
    return trip_piece_layout(f, p->last + 1u, p->words);
}

/* Returns the length of the longest possible piece. */
size_t trip_piece_max_bytes(const trip_piece_format *f);

/* Returns the header's `words` for the shorter form of positions. The bitmap has `splats` positions
 * in `used` nonzero words. */
unsigned trip_piece_choose_words(const trip_piece_format *f, uint32_t splats, unsigned used);
/* Fills the header and the positions of a piece from the tile's bitmap, which has `splats` bits
 * set. */
void trip_piece_begin(trip_piece *p, const trip_piece_format *f, uint64_t key, uint32_t splats,
                      unsigned words, const uint64_t *bitmap);

/* Returns whether `room` bytes hold a valid piece. Its header must be possible. Its positions must
 * be ascending, and their number must match the header. */
bool trip_piece_check(const trip_piece *p, const trip_piece_format *f, size_t room);

/* Writes the positions of the bits set in word `w` of a bitmap. Returns their number. */
static inline unsigned trip_word_positions(uint64_t bits, unsigned w, uint16_t *to)
{
    unsigned n = 0;
    for (; bits; bits &= bits - 1)
        to[n++] = (uint16_t)(w * 64 + (unsigned)__builtin_ctzll(bits));
    return n;
}

/* Writes all positions of a piece. Returns their number, which matches the header if the piece is
 * valid. */
uint32_t trip_piece_positions(const trip_piece *p, const trip_piece_format *f, uint16_t *to);

#endif
