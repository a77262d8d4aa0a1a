/* A block is a run in the voxel plane. It stores which 8 x 8 squares of the tile hold records,
 * which voxels of each square are present, and their codes. Its parts, in order:
 *
 * - presence: one bit per square of the tile, by Morton number, in words of 64 bits
 *
 * - masks: one word per present square, ascending, with one bit per voxel. The bit is the Morton
 *   number in the square, with u in the even bits and v in the odd bits. No mask is 0.
 *
 * - forms, only with code_bytes 2: how the codes of a group of squares are packed. A group has
 *   consecutive squares until it holds TRIP_GROUP_RECORDS records, or the remaining squares. A form
 *   has 32 bits: bits 0-15 are the minimum code of the group, bits 16-31 the width, an even
 *   number of bits from 0 to 16. Forms are padded to a multiple of 8 bytes.
 *
 * - codes, in the order of the bits. With code_bytes 1, a code is one byte. With code_bytes 2, it
 *   is the difference to the group's minimum, in `width` bits, the lowest bit first. Each square
 *   starts at a whole byte.
 *
 * - padding: zeros up to a multiple of 8 bytes
 *
 * Voxels thus come in Morton order of the tile. Only block.c packs and checks blocks. block.c
 * decodes them, and the CPU renderer's kernels decode them into registers. Pure functions. */
#ifndef TRIP_BLOCK_H
#define TRIP_BLOCK_H

#include <stdbool.h>
#include <stddef.h>

#include "format.h"

enum {
    TRIP_BLOCK_PRESENT_MAX = 4, /* words */
    TRIP_BLOCK_SQUARES_MAX = 256,
    TRIP_RUN_RECORDS_MAX = 128 * 128,
    TRIP_GROUP_RECORDS = 32,
    TRIP_BLOCK_WORDS_MAX = TRIP_BLOCK_PRESENT_MAX + TRIP_BLOCK_SQUARES_MAX +
                           TRIP_BLOCK_SQUARES_MAX / 2 + TRIP_RUN_RECORDS_MAX / 4,
};

/* The properties that all blocks of a list share, by the header and the list's kind. The forms of
 * groups differ from block to block. */
typedef struct trip_block_form {
    unsigned tile_log2, code_bytes, normal_bytes;
    bool steps; /* 2-byte codes are multiples of TRIP_CODE_STEP, and the multiples are packed */
} trip_block_form;

typedef struct trip_block {
    uint32_t count, words; /* number of records; length in 8-byte words */
    uint32_t squares;      /* number of present squares */
    unsigned present_words, code_bytes, normal_bytes;
    unsigned step; /* difference of neighbouring codes */
    const uint64_t *present, *masks;
    const unsigned char *normals; /* NULL if the plane is not read */
    const uint8_t *deviations;    /* one byte per record; NULL if the plane is not read */
} trip_block;

/* A square of a block and its codes. A code is (min + the packed bits) * step. */
typedef struct trip_square {
    uint64_t mask;
    uint32_t number;       /* Morton number in the tile */
    uint32_t first, count; /* records of the run */
    uint32_t min, width, step;
    const unsigned char *codes;
} trip_square;

/* Returns the number of set bits. Compilers call a function for this if some processors of the
 * target lack the instruction. */
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

static inline unsigned trip_block_step(const trip_block_form *f)
{
    return f->code_bytes == 1 || f->steps ? TRIP_CODE_STEP : 1;
}

static inline unsigned trip_block_present_words(unsigned tile_log2)
{
    return tile_log2 > 6 ? 4 : 1;
}

/* Returns the words of the largest block of a tile. */
uint32_t trip_block_max_words(const trip_block_form *f);
/* Returns how far the block's first `words` words determine its length: the end of the next part,
 * or of the whole block. The result equals `words` if the whole block is there. */
uint32_t trip_block_end(const trip_block_form *f, const uint64_t *block, uint32_t words);
/* Whether a run of `records` records, at least 1, can have a block of `words` words. */
bool trip_block_words_fit(const trip_block_form *f, uint32_t records, uint32_t words);

/* Returns the parts of a block with a length that fits its records. `block` is aligned to 8 bytes.
 */
trip_block trip_block_make(const trip_block_form *f, uint32_t records, uint32_t words,
                           const void *block, const void *normals);

/* Packs `count` voxels, at least 1, in Morton order of (u, v), all within the tile. `block` has
 * room for the largest block of the tile. Returns the number of words. Returns 0 if voxels are out
 * of order or outside the tile, or if a block of this form cannot hold a code. */
uint32_t trip_block_pack(const trip_block_form *f, const uint32_t *voxels, uint32_t count,
                         uint64_t *block);
/* Packs normals, given in 32 bits each. */
void trip_normals_pack(unsigned normal_bytes, const uint32_t *normals, uint32_t count,
                       unsigned char *out);

/* Checks the parts of a block against each other, and its records against the brick's bounds and
 * range of codes. Returns the fault, or NULL. */
const char *trip_block_check(const trip_block *b, const trip_file_brick *brick);
/* Whether the padding of a checked block is zero. trip_block_check() ignores padding, since it does
 * no harm. */
bool trip_block_is_padded(const trip_block *b);

/* Return the start of a checked block's codes, and the bytes from there to the end of the block, a
 * multiple of 8. */
const unsigned char *trip_block_codes(const trip_block *b);
size_t trip_block_codes_bytes(const trip_block *b);
/* Lists the squares of a checked block in order. Returns their number. */
uint32_t trip_block_squares(const trip_block *b, trip_square squares[TRIP_BLOCK_SQUARES_MAX]);
/* Returns the bytes of a square's codes. */
static inline uint32_t trip_square_code_bytes(const trip_square *s)
{
    return (s->count * s->width + 7) / 8;
}
/* Unpacks the codes of a square to 16 bits. */
void trip_square_codes(const trip_square *s, uint16_t codes[64]);

/* Returns u and v of a square's corner in the tile, as a voxel with code 0. */
uint32_t trip_square_corner(const trip_square *s);
/* Unpacks the records of a square, as voxels with u and v in the tile and 16-bit codes. */
void trip_square_voxels(const trip_square *s, uint32_t voxels[64]);

/* Unpacks records [first, first + count) of a checked block, as voxels with u and v in the tile and
 * 16-bit codes. */
void trip_block_voxels(const trip_block *b, uint32_t first, uint32_t count, uint32_t *voxels);
/* Unpacks the normals of records [first, first + count). 3-byte normals are in the low bits. The
 * block must have normals. */
void trip_block_normals(const trip_block *b, uint32_t first, uint32_t count, uint32_t *normals);

#endif
