/* A run as it lies in the voxel plane: a block. It says which 8 x 8 squares of the tile hold
 * records, which voxels of those, and their codes:
 *
 * - presence: a bit for each square of the tile, by Morton number, in words of 64 bits;
 *
 * - masks: a word for each square that is present, ascending: a bit for each voxel by its Morton
 *   number in the square, u in the even bits and v in the odd ones; never 0;
 *
 * - codes: of code_bytes each, in the order of the bits;
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
    TRIP_BLOCK_WORDS_MAX =
        TRIP_BLOCK_PRESENT_MAX + TRIP_BLOCK_SQUARES_MAX + TRIP_RUN_RECORDS_MAX / 4,
};

/* What the header says of all blocks, and a list's kind of its own. */
typedef struct trip_block_form {
    unsigned tile_log2, code_bytes, normal_bytes;
} trip_block_form;

typedef struct trip_block {
    uint32_t count;   /* records */
    uint32_t squares; /* present */
    unsigned present_words, code_bytes, normal_bytes;
    const uint64_t *present, *masks;
    const unsigned char *codes, *normals; /* normals NULL without that plane */
} trip_block;

static inline trip_block_form trip_block_form_of(const trip_file_header *h, trip_kind kind)
{
    unsigned own = trip_kind_of(kind)->code_bytes;
    return (trip_block_form){ h->tile_log2, own ? own : h->code_bytes, h->normal_bytes };
}

static inline unsigned trip_block_present_words(unsigned tile_log2)
{
    return tile_log2 > 6 ? 4 : 1;
}

/* Words that codes take. */
static inline uint32_t trip_block_code_words(uint32_t records, unsigned code_bytes)
{
    return (records * code_bytes + 7) / 8;
}

/* Words of the largest block of a tile. */
static inline uint32_t trip_block_most_words(const trip_block_form *f)
{
    uint32_t records = 1u << 2 * f->tile_log2;
    return trip_block_present_words(f->tile_log2) + records / 64 +
           trip_block_code_words(records, f->code_bytes);
}

/* Whether a run of `records`, at least 1, can have a block of `words`. */
bool trip_block_words_fit(const trip_block_form *f, uint32_t records, uint32_t words);

/* The parts of a block, whose words fit its records; `words` is aligned to 8 bytes. */
trip_block trip_block_make(const trip_block_form *f, uint32_t records, uint32_t words,
                           const void *block, const void *normals);

/* Packs `count` voxels, at least 1, in Morton order of (u, v), all within the tile; there is room
 * for the tile's largest block. Returns the words; 0 when voxels are out of order or out of the
 * tile, or code_bytes is 1 and a code is no multiple of 257. */
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

/* Records [first, first + count) of a checked block, as voxels with u and v in the tile and 16-bit
 * codes. */
void trip_block_voxels(const trip_block *b, uint32_t first, uint32_t count, uint32_t *voxels);
/* Their normals, 3-byte ones in the low bits; the block has that plane. */
void trip_block_normals(const trip_block *b, uint32_t first, uint32_t count, uint32_t *normals);

#endif
