/* Pieces: the splats that one box of voxels gives to one tile of one sheet of a list. Between the
 * threads that make them, the spill file and the merge, splats only ever travel as pieces. A tile
 * puts the pieces of one tile together and gives out the run that the data set holds.
 *
 * A piece in memory and in the spill file is a header, then, each padded to 8 bytes:
 *   positions    Morton code of (u, v) in the tile, ascending: either `words` 64-bit words of the
 *                tile's bitmap, after a mask of one bit for each word that is there, or, with
 *                words 0, one uint16 a splat; whichever is shorter
 *   values       codes (uint16), or float32 while the range of the values is not known yet
 *   normals      packed (uint32); then without their magnitude while that range is not known
 *   magnitudes   float32, of gradients per gradient_unit, while the range is not known */
#ifndef TRIP_PIECE_H
#define TRIP_PIECE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "budget.h"

/* Lists by number: of kept voxels along X, Y and Z, then of their halo. */
enum { TRIP_HALO_LISTS = 3, TRIP_MOST_LISTS = 6 };

static inline int trip_list_axis(unsigned list)
{
    return (int)(list % 3);
}

enum {
    TRIP_TILE_MAX_SPLATS = 128 * 128,
    TRIP_TILE_MAX_WORDS = TRIP_TILE_MAX_SPLATS / 64,
    TRIP_TILE_MORTON_BITS = 40, /* tiles of a sheet: up to 2^20 a side */
};

/* What codes mean: value(c) = lo + (hi - lo) * c / 65535, and the gradient of magnitude 255. */
typedef struct trip_quantiser {
    double lo, hi;
    double gradient_scale;
    double gradient_unit; /* trip_gradient_unit() of magnitudes that wait; 0: 1 */
} trip_quantiser;

static inline uint32_t trip_quantise(const trip_quantiser *q, double value)
{
    double code = (value - q->lo) * (65535 / (q->hi - q->lo)) + 0.5;
    return !(code > 0) ? 0 : code >= 65535 ? 65535 : (uint32_t)code; /* NaN: 0 */
}

/* The same for all pieces of a run of the program, but that those of a halo have no normals. */
typedef struct trip_piece_format {
    unsigned tile_log2;
    bool quantised; /* codes and whole normals; otherwise floats */
    bool normals;
    bool halo; /* there are lists of a halo */
} trip_piece_format;

static inline unsigned trip_piece_list_count(const trip_piece_format *f)
{
    return f->halo ? TRIP_MOST_LISTS : TRIP_HALO_LISTS;
}

/* The format of the pieces of one list. */
static inline trip_piece_format trip_piece_format_of(const trip_piece_format *f, unsigned list)
{
    trip_piece_format own = *f;
    own.normals = f->normals && list < TRIP_HALO_LISTS;
    return own;
}

typedef struct trip_piece {
    uint64_t key;  /* sheet << TRIP_TILE_MORTON_BITS | Morton code of the tile */
    uint32_t next; /* free for the owner of the memory */
    uint16_t last; /* number of splats - 1 */
    uint16_t words;
} trip_piece;

/* Where the parts of a piece are, in bytes from its start; 0 for parts that are not there. */
typedef struct trip_piece_parts {
    size_t positions, values, normals, magnitudes, bytes;
} trip_piece_parts;

trip_piece_parts trip_piece_layout(const trip_piece_format *f, uint32_t splats, unsigned words);

static inline trip_piece_parts trip_piece_get_parts(const trip_piece_format *f, const trip_piece *p)
{
    return trip_piece_layout(f, p->last + 1u, p->words);
}

/* No piece is longer than this. */
size_t trip_piece_max_bytes(const trip_piece_format *f);

/* `words` of the shorter form of `splats` positions that are in `used` words of the bitmap. */
unsigned trip_piece_choose_words(const trip_piece_format *f, uint32_t splats, unsigned used);
/* Fills header and positions, of a piece with this many splats, from the tile's bitmap. */
void trip_piece_begin(trip_piece *p, const trip_piece_format *f, uint64_t key, uint32_t splats,
                      unsigned words, const uint64_t *bitmap);

/* False unless the header is possible and, for bytes from disk, `room` holds the piece and its
 * positions are ascending and as many as the header says. */
bool trip_piece_check(const trip_piece *p, const trip_piece_format *f, size_t room);

/* Puts pieces of one key together, in any order. One thread. */
typedef struct trip_tile trip_tile;

int trip_tile_create(trip_tile **out, const trip_piece_format *f, trip_budget *budget);
void trip_tile_destroy(trip_tile *t);
void trip_tile_add(trip_tile *t, const trip_piece *p);
/* The records of all that was added since the last call, in list order; they stand until the next
 * one. *normals is NULL without normals. */
uint32_t trip_tile_take(trip_tile *t, const trip_quantiser *q, const uint32_t **voxels,
                        const uint32_t **normals);

#endif
