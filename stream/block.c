#include "block.h"

#include <string.h>

enum { CODE_STEP = 257 /* between the 16-bit codes that 8-bit ones stand for */ };

/* A voxel's u and v in its square, by its Morton number. */
#define PLACE(n)                                                                                   \
    (((n)&1) | ((n) >> 1 & 2) | ((n) >> 2 & 4) | ((n)&2) << 7 | ((n)&8) << 6 | ((n)&32) << 5)
#define PLACES4(n) PLACE(n), PLACE((n) + 1), PLACE((n) + 2), PLACE((n) + 3)
#define PLACES16(n) PLACES4(n), PLACES4((n) + 4), PLACES4((n) + 8), PLACES4((n) + 12)
static const uint32_t places[64] = { PLACES16(0), PLACES16(16), PLACES16(32), PLACES16(48) };

/* u and v of a square's corner in the tile, by its Morton number. */
static uint32_t corner_of(uint32_t square)
{
    uint32_t x = (square & 0x55) | (square & 0xaa) << 15; /* v in the upper half */
    x = (x | x >> 1) & 0x00330033;
    x = (x | x >> 2) & 0x000f000f;
    return (x & 15) << 3 | (x >> 16) << 11;
}

/* The Morton number of a voxel in the tile. */
static uint32_t number_of(uint32_t voxel)
{
    uint32_t x = (voxel & 0x7f) | (voxel & 0x7f00) << 8;
    x = (x | x << 4) & 0x0f0f0f0f;
    x = (x | x << 2) & 0x33333333;
    x = (x | x << 1) & 0x55555555;
    return (x & 0xffff) | x >> 15;
}

bool trip_block_words_fit(const trip_block_form *f, uint32_t records, uint32_t words)
{
    uint32_t all = 1u << 2 * f->tile_log2;
    uint32_t fixed =
        trip_block_present_words(f->tile_log2) + trip_block_code_words(records, f->code_bytes);
    if (records < 1 || records > all || words <= fixed)
        return false;
    uint32_t squares = words - fixed;
    return squares <= records && squares <= all / 64 && records <= 64 * squares;
}

trip_block trip_block_make(const trip_block_form *f, uint32_t records, uint32_t words,
                           const void *block, const void *normals)
{
    trip_block b = { .count = records,
                     .present_words = trip_block_present_words(f->tile_log2),
                     .code_bytes = f->code_bytes,
                     .normal_bytes = f->normal_bytes,
                     .present = block,
                     .normals = normals };
    b.squares = words - b.present_words - trip_block_code_words(records, f->code_bytes);
    b.masks = b.present + b.present_words;
    b.codes = (const unsigned char *)(b.masks + b.squares);
    return b;
}

/* ---- packing ---- */

/* Sets the bits of presence and masks; the number of squares, or 0 when voxels are not in order or
 * not in the tile. */
static uint32_t pack_places(unsigned tile_log2, const uint32_t *voxels, uint32_t count,
                            uint64_t *present, uint64_t *masks)
{
    uint32_t squares = 0;
    int64_t last = -1, last_square = -1;
    for (uint32_t i = 0; i < count; i++) {
        int64_t number = number_of(voxels[i]), square = number / 64;
        if (number <= last || number >> 2 * tile_log2 || voxels[i] & 0x8080)
            return 0;
        if (square != last_square) {
            present[square / 64] |= UINT64_C(1) << square % 64;
            masks[squares++] = 0;
        }
        masks[squares - 1] |= UINT64_C(1) << number % 64;
        last = number;
        last_square = square;
    }
    return squares;
}

static bool pack_codes(unsigned code_bytes, const uint32_t *voxels, uint32_t count,
                       unsigned char *codes)
{
    uint32_t rest = 0;
    if (code_bytes == 1) {
        for (uint32_t i = 0; i < count; i++) {
            uint32_t code = trip_voxel_code(voxels[i]);
            codes[i] = (unsigned char)code;
            rest |= code ^ (code & 255) * CODE_STEP;
        }
        return rest == 0;
    }
    for (uint32_t i = 0; i < count; i++) {
        uint16_t code = (uint16_t)trip_voxel_code(voxels[i]);
        memcpy(codes + 2 * (size_t)i, &code, sizeof code);
    }
    return true;
}

uint32_t trip_block_pack(const trip_block_form *f, const uint32_t *voxels, uint32_t count,
                         uint64_t *block)
{
    unsigned present = trip_block_present_words(f->tile_log2);
    memset(block, 0, present * sizeof *block);
    if (count > 1u << 2 * f->tile_log2)
        return 0;
    uint32_t squares = pack_places(f->tile_log2, voxels, count, block, block + present);
    uint64_t *codes = block + present + squares;
    uint32_t words = trip_block_code_words(count, f->code_bytes);
    if (squares == 0)
        return 0;
    codes[words - 1] = 0;
    if (!pack_codes(f->code_bytes, voxels, count, (unsigned char *)codes))
        return 0;
    return present + squares + words;
}

void trip_normals_pack(unsigned normal_bytes, const uint32_t *normals, uint32_t count,
                       unsigned char *out)
{
    if (normal_bytes == sizeof *normals) {
        memcpy(out, normals, count * sizeof *normals);
        return;
    }
    for (uint32_t i = 0; i < count; i++)
        memcpy(out + 3 * (size_t)i, &normals[i], 3);
}

/* ---- checking ---- */

/* Bits of a square whose u is less than x, and those whose v is: of x they are the first column and
 * row, moved by the Morton numbers of those before. */
#define COLUMN UINT64_C(0x0000050500000505)
#define ROW UINT64_C(0x0000000000330033)
#define COLUMNS4 (COLUMN | COLUMN << 1 | COLUMN << 4 | COLUMN << 5)
#define ROWS4 (ROW | ROW << 2 | ROW << 8 | ROW << 10)
static const uint64_t columns_below[9] = {
    0,
    COLUMN,
    COLUMN | COLUMN << 1,
    COLUMN | COLUMN << 1 | COLUMN << 4,
    COLUMNS4,
    COLUMNS4 | COLUMN << 16,
    COLUMNS4 | COLUMN << 16 | COLUMN << 17,
    COLUMNS4 | COLUMN << 16 | COLUMN << 17 | COLUMN << 20,
    UINT64_MAX,
};
static const uint64_t rows_below[9] = {
    0,
    ROW,
    ROW | ROW << 2,
    ROW | ROW << 2 | ROW << 8,
    ROWS4,
    ROWS4 | ROW << 32,
    ROWS4 | ROW << 32 | ROW << 34,
    ROWS4 | ROW << 32 | ROW << 34 | ROW << 40,
    UINT64_MAX,
};

/* Bits below the coordinate x, the square starting at `corner`. */
static uint64_t bits_below(const uint64_t table[9], int x, int corner)
{
    int n = x - corner;
    return table[n < 0 ? 0 : n > 8 ? 8 : n];
}

/* The bits of a square that lie within the brick's bounds. */
static uint64_t bits_within(const trip_file_brick *b, uint32_t corner)
{
    int u = (int)trip_voxel_u(corner), v = (int)trip_voxel_v(corner);
    return bits_below(columns_below, b->u_max + 1, u) & ~bits_below(columns_below, b->u_min, u) &
           bits_below(rows_below, b->v_max + 1, v) & ~bits_below(rows_below, b->v_min, v);
}

static const char *check_places(const trip_block *b, const trip_file_brick *brick)
{
    uint32_t squares = 0, records = 0;
    uint64_t outside = 0;
    bool empty = false;
    for (unsigned w = 0; w < b->present_words; w++)
        squares += (uint32_t)__builtin_popcountll(b->present[w]);
    if (squares != b->squares)
        return "a run's squares are not as many as its masks";
    const uint64_t *mask = b->masks;
    for (unsigned w = 0; w < b->present_words; w++)
        for (uint64_t bits = b->present[w]; bits; bits &= bits - 1, mask++) {
            uint32_t corner = corner_of(64 * w + (uint32_t)__builtin_ctzll(bits));
            records += (uint32_t)__builtin_popcountll(*mask);
            outside |= *mask & ~bits_within(brick, corner);
            empty |= *mask == 0;
        }
    if (records != b->count)
        return "a run's masks do not hold as many voxels as the index says";
    if (empty)
        return "a mask is empty";
    return outside ? "a voxel is outside its brick's bounds" : NULL;
}

/* Smallest and largest code, as in the file. */
static void code_range(const trip_block *b, unsigned range[2])
{
    unsigned lo = UINT16_MAX, hi = 0;
    if (b->code_bytes == 1) {
        uint8_t least = UINT8_MAX, most = 0;
        for (uint32_t i = 0; i < b->count; i++) {
            least = b->codes[i] < least ? b->codes[i] : least;
            most = b->codes[i] > most ? b->codes[i] : most;
        }
        lo = least;
        hi = most;
    } else {
        const uint16_t *codes = (const void *)b->codes; /* at a multiple of 8 bytes */
        uint16_t least = UINT16_MAX, most = 0;
        for (uint32_t i = 0; i < b->count; i++) {
            least = codes[i] < least ? codes[i] : least;
            most = codes[i] > most ? codes[i] : most;
        }
        lo = least;
        hi = most;
    }
    range[0] = lo;
    range[1] = hi;
}

const char *trip_block_check(const trip_block *b, const trip_file_brick *brick)
{
    unsigned range[2], step = b->code_bytes == 1 ? CODE_STEP : 1;
    const char *fault = check_places(b, brick);
    if (fault)
        return fault;
    code_range(b, range);
    return range[0] * step < brick->code_min || range[1] * step > brick->code_max
               ? "a value is outside its brick's range"
               : NULL;
}

bool trip_block_is_padded(const trip_block *b)
{
    size_t end = 8 * (size_t)trip_block_code_words(b->count, b->code_bytes);
    for (size_t i = (size_t)b->count * b->code_bytes; i < end; i++)
        if (b->codes[i])
            return false;
    return true;
}

/* ---- decoding ---- */

/* The places of at most `count` bits of a mask, the first `skip` left out; how many. */
static uint32_t square_places(uint64_t mask, uint32_t corner, uint32_t skip, uint32_t count,
                              uint32_t *voxels)
{
    uint32_t n = 0;
    if (mask == UINT64_MAX && skip == 0 && count >= 64) {
        for (; n < 64; n++)
            voxels[n] = corner + places[n];
        return n;
    }
    for (; skip > 0; skip--)
        mask &= mask - 1;
    for (; mask && n < count; mask &= mask - 1)
        voxels[n++] = corner + places[__builtin_ctzll(mask)];
    return n;
}

static void add_codes(const trip_block *b, uint32_t first, uint32_t count, uint32_t *voxels)
{
    if (b->code_bytes == 1) {
        const unsigned char *codes = b->codes + first;
        for (uint32_t i = 0; i < count; i++)
            voxels[i] |= (uint32_t)codes[i] * CODE_STEP << 16;
        return;
    }
    const uint16_t *codes = (const void *)b->codes;
    for (uint32_t i = 0; i < count; i++)
        voxels[i] |= (uint32_t)codes[first + i] << 16;
}

void trip_block_voxels(const trip_block *b, uint32_t first, uint32_t count, uint32_t *voxels)
{
    const uint64_t *mask = b->masks;
    uint32_t skip = first, done = 0;
    for (unsigned w = 0; w < b->present_words; w++)
        for (uint64_t bits = b->present[w]; bits && done < count; bits &= bits - 1, mask++) {
            uint32_t here = (uint32_t)__builtin_popcountll(*mask);
            if (skip >= here) {
                skip -= here;
                continue;
            }
            uint32_t corner = corner_of(64 * w + (uint32_t)__builtin_ctzll(bits));
            done += square_places(*mask, corner, skip, count - done, voxels + done);
            skip = 0;
        }
    add_codes(b, first, count, voxels);
}

void trip_block_normals(const trip_block *b, uint32_t first, uint32_t count, uint32_t *normals)
{
    const unsigned char *from = b->normals + (size_t)first * b->normal_bytes;
    if (b->normal_bytes == sizeof *normals) {
        memcpy(normals, from, count * sizeof *normals);
        return;
    }
    for (uint32_t i = 0; i < count; i++, from += 3)
        normals[i] = (uint32_t)from[0] | (uint32_t)from[1] << 8 | (uint32_t)from[2] << 16;
}
