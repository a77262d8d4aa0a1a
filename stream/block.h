/* A run as it lies in the voxel plane: a block. It says which 8 x 8 squares of the tile hold
 * records, which voxels of those, and their codes:
 *
 * - presence: a bit for each square of the tile, by Morton number, in words of 64 bits;
 *
 * - masks: a word for each square that is present, ascending: a bit for each voxel by its Morton
 *   number in the square, u in the even bits and v in the odd ones; never 0;
 *
 * - forms, with code_bytes 2: how the codes of a group of squares are packed. A group is as many
 *   squares, in order, as it takes to hold TRIP_GROUP_RECORDS records, or those that are left. A
 *   form has 32 bits: bits 0-15 the group's least code, bits 16-31 the width, an even number of
 *   bits from 0 to 16; padded to a multiple of 8 bytes;
 *
 * - codes, in the order of the bits: with code_bytes 1 a byte each; with 2 what each is above its
 *   group's least, of that width, the lowest bit first, each square from a whole byte on;
 *
 * - padding: zeros up to a multiple of 8 bytes.
 *
 * Voxels so come in Morton order of the tile. Packed and checked here alone; decoded here, and in
 * the CPU renderer's kernels into registers. Pure functions. */
#ifndef TRIP_BLOCK_H
#define TRIP_BLOCK_H

#include <stdbool.h>
#include <stddef.h>

#include "format.h"
#include "kind.h"

enum {
    TRIP_BLOCK_PRESENT_MAX = 4, /* words */
    TRIP_BLOCK_SQUARES_MAX = 256,
    TRIP_RUN_RECORDS_MAX = 128 * 128,
    TRIP_GROUP_RECORDS = 32,
    TRIP_BLOCK_WORDS_MAX = TRIP_BLOCK_PRESENT_MAX + TRIP_BLOCK_SQUARES_MAX +
                           TRIP_BLOCK_SQUARES_MAX / 2 + TRIP_RUN_RECORDS_MAX / 4,
};

/* What all blocks of a list have in common, by the header and the list's kind; not the forms of
 * groups. */
typedef struct trip_block_form {
    unsigned tile_log2, code_bytes, normal_bytes;
    bool steps; /* of 2 bytes: codes are whole steps, and these are what is packed */
} trip_block_form;

typedef struct trip_block {
    uint32_t count, words; /* records; length */
    uint32_t squares;      /* present */
    unsigned present_words, code_bytes, normal_bytes;
    unsigned step; /* from one code to the next */
    const uint64_t *present, *masks;
    const unsigned char *normals; /* NULL without that plane */
} trip_block;

/* A square of a block, and where its codes lie: they are `least` and what the width's bits say
 * above it, times `step`. */
typedef struct trip_square {
    uint64_t mask;
    uint32_t number;       /* Morton number in the tile */
    uint32_t first, count; /* records of the run */
    uint32_t min, width, step;
    const unsigned char *codes;
} trip_square;

/* How many bits are set. Compilers call a function for that where not every processor of the target
 * has an instruction. */
static inline uint32_t trip_bits_set(uint64_t x)
{
#if defined(__x86_64__) && !defined(__POPCNT__)
    x -= x >> 1 & UINT64_C(0x5555555555555555);
    x = (x & UINT64_C(0x3333333333333333)) + (x >> 2 & UINT64_C(0x3333333333333333));
    x = (x + (x >> 4)) & UINT64_C(0x0f0f0f0f0f0f0f0f);
    return (uint32_t)(x * UINT64_C(0x0101010101010101) >> 56);
#else
    return (uint32_t)__builtin_popcountll(x);
#endif
}

static inline trip_block_form trip_block_form_of(const trip_file_header *h, trip_kind kind)
{
    const trip_kind_info *of = trip_kind_of(kind);
    return (trip_block_form){ h->tile_log2, of->code_bytes ? of->code_bytes : h->code_bytes,
                              h->normal_bytes, of->steps && h->code_bytes == 1 };
}

static inline unsigned trip_block_step(const trip_block_form *f)
{
    return f->code_bytes == 1 || f->steps ? TRIP_CODE_STEP : 1;
}

static inline unsigned trip_block_present_words(unsigned tile_log2)
{
    return tile_log2 > 6 ? 4 : 1;
}

/* Words of the largest block of a tile. */
uint32_t trip_block_max_words(const trip_block_form *f);
/* How far a block's first `words` determine where it goes on: the end of the next part of it, or of
 * all of it, which is `words` where that is there. */
uint32_t trip_block_end(const trip_block_form *f, const uint64_t *block, uint32_t words);
/* Whether a run of `records`, at least 1, can have a block of `words`. */
bool trip_block_words_fit(const trip_block_form *f, uint32_t records, uint32_t words);

/* The parts of a block, whose words fit its records; `words` is aligned to 8 bytes. */
trip_block trip_block_make(const trip_block_form *f, uint32_t records, uint32_t words,
                           const void *block, const void *normals);

/* Packs `count` voxels, at least 1, in Morton order of (u, v), all within the tile; there is room
 * for the tile's largest block. Returns the words; 0 when voxels are out of order or out of the
 * tile, or a code is none that such a block can hold. */
uint32_t trip_block_pack(const trip_block_form *f, const uint32_t *voxels, uint32_t count,
                         uint64_t *block);
/* Packs normals from 32 bits each. */
void trip_normals_pack(unsigned normal_bytes, const uint32_t *normals, uint32_t count,
                       unsigned char *out);

/* NULL when the block's parts agree with one another and its records are within the brick's bounds
 * and range of codes; else what is wrong with it. */
const char *trip_block_check(const trip_block *b, const trip_file_brick *brick);
/* What of a checked block is not checked by that, since it does no harm: whether the padding is
 * zero. */
bool trip_block_is_padded(const trip_block *b);

/* Where the codes of a checked block begin, and the bytes from there to its end, a multiple of 8.
 */
const unsigned char *trip_block_codes(const trip_block *b);
size_t trip_block_codes_bytes(const trip_block *b);
/* The squares of a checked block, in order; how many. */
uint32_t trip_block_squares(const trip_block *b, trip_square squares[TRIP_BLOCK_SQUARES_MAX]);
/* Bytes of a square's codes. */
static inline uint32_t trip_square_code_bytes(const trip_square *s)
{
    return (s->count * s->width + 7) / 8;
}
/* The 16-bit codes of a square. */
void trip_square_codes(const trip_square *s, uint16_t codes[64]);

/* u and v of a square's corner in the tile, as a voxel with code 0. */
uint32_t trip_square_corner(const trip_square *s);
/* The records of a square of the block, as voxels with u and v in the tile and 16-bit codes. */
void trip_square_voxels(const trip_square *s, uint32_t voxels[64]);

/* Records [first, first + count) of a checked block, as voxels with u and v in the tile and 16-bit
 * codes. */
void trip_block_voxels(const trip_block *b, uint32_t first, uint32_t count, uint32_t *voxels);
/* Their normals, 3-byte ones in the low bits; the block has that plane. */
void trip_block_normals(const trip_block *b, uint32_t first, uint32_t count, uint32_t *normals);

#endif
