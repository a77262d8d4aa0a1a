#include "block.h"

#include "clones.h"

#include <string.h>

#define INLINE static inline __attribute__((always_inline))

/* u and v of a voxel in its square, by Morton number. */
#define PLACE(n)                                                                                   \
    (((n)&1) | ((n) >> 1 & 2) | ((n) >> 2 & 4) | ((n)&2) << 7 | ((n)&8) << 6 | ((n)&32) << 5)
#define PLACES4(n) PLACE(n), PLACE((n) + 1), PLACE((n) + 2), PLACE((n) + 3)
#define PLACES16(n) PLACES4(n), PLACES4((n) + 4), PLACES4((n) + 8), PLACES4((n) + 12)
static const uint32_t positions[64] = { PLACES16(0), PLACES16(16), PLACES16(32), PLACES16(48) };

/* Returns u and v of a square's corner in the tile, by the square's Morton number. */
static uint32_t corner_of(uint32_t square)
{
    uint32_t x = (square & 0x55) | (square & 0xaa) << 15; /* v in the upper half */
    x = (x | x >> 1) & 0x00330033;
    x = (x | x >> 2) & 0x000f000f;
    return (x & 15) << 3 | (x >> 16) << 11;
}

/* Returns the Morton number of a voxel in the tile. */
static uint32_t number_of(uint32_t voxel)
{
    uint32_t x = (voxel & 0x7f) | (voxel & 0x7f00) << 8;
    x = (x | x << 4) & 0x0f0f0f0f;
    x = (x | x << 2) & 0x33333333;
    x = (x | x << 1) & 0x55555555;
    return (x & 0xffff) | x >> 15;
}

static uint32_t code_words(uint32_t bytes)
{
    return (bytes + 7) / 8;
}

/* Returns the words of the forms of `groups` groups. */
static uint32_t form_words(uint32_t groups)
{
    return (groups + 1) / 2;
}

uint32_t trip_block_max_words(const trip_block_form *f)
{
    uint32_t records = 1u << 2 * f->tile_log2, squares = records / 64;
    return trip_block_present_words(f->tile_log2) + squares +
           (f->code_bytes == 1 ? 0 : form_words(squares)) + code_words(records * f->code_bytes);
}

bool trip_block_words_fit(const trip_block_form *f, uint32_t records, uint32_t words)
{
    uint32_t all = 1u << 2 * f->tile_log2, present = trip_block_present_words(f->tile_log2);
    if (records < 1 || records > all)
        return false;
    uint32_t min = (records + 63) / 64, max = records < all / 64 ? records : all / 64;
    if (f->code_bytes == 1) {
        uint32_t codes = code_words(records);
        return words >= present + min + codes && words <= present + max + codes;
    }
    return words > present + min &&
           words <= present + max + form_words(max) + code_words(2 * records);
}

/* ---- groups ---- */

/* Returns the square after the group that starts with `square`. */
static uint32_t group_end(const uint64_t *masks, uint32_t squares, uint32_t square)
{
    uint32_t records = 0;
    while (square < squares && records < TRIP_GROUP_RECORDS)
        records += trip_bits_set(masks[square++]);
    return square;
}

static uint32_t count_groups(const uint64_t *masks, uint32_t squares)
{
    uint32_t groups = 0;
    for (uint32_t i = 0; i < squares; groups++)
        i = group_end(masks, squares, i);
    return groups;
}

static uint32_t width_of(uint32_t form)
{
    return form >> 16;
}

static uint32_t count_squares(const uint64_t *present, unsigned words)
{
    uint32_t squares = 0;
    for (unsigned w = 0; w < words; w++)
        squares += trip_bits_set(present[w]);
    return squares;
}

static uint32_t count_records(const uint64_t *masks, uint32_t squares)
{
    uint32_t records = 0;
    for (uint32_t i = 0; i < squares; i++)
        records += trip_bits_set(masks[i]);
    return records;
}

/* Returns the bytes of the packed codes. */
static uint32_t packed_bytes(const uint64_t *masks, uint32_t squares, const uint32_t *forms)
{
    uint32_t bytes = 0;
    for (uint32_t i = 0; i < squares; forms++)
        for (uint32_t end = group_end(masks, squares, i); i < end; i++)
            bytes += (trip_bits_set(masks[i]) * width_of(*forms) + 7) / 8;
    return bytes;
}

TRIP_ALSO_V3 uint32_t trip_block_end(const trip_block_form *f, const uint64_t *block,
                                     uint32_t words)
{
    const uint32_t present = trip_block_present_words(f->tile_log2);
    if (words < present)
        return present;
    const uint64_t *masks = block + present;
    const uint32_t squares = count_squares(block, present), behind = present + squares;
    if (words < behind)
        return behind;
    if (f->code_bytes == 1)
        return behind + code_words(count_records(masks, squares));
    const uint32_t head = behind + form_words(count_groups(masks, squares));
    const void *forms = masks + squares;
    return words < head ? head : head + code_words(packed_bytes(masks, squares, forms));
}

TRIP_ALSO_V3 trip_block trip_block_make(const trip_block_form *f, uint32_t records, uint32_t words,
                                        const void *block, const void *normals)
{
    trip_block b = { .count = records,
                     .words = words,
                     .present_words = trip_block_present_words(f->tile_log2),
                     .code_bytes = f->code_bytes,
                     .normal_bytes = f->normal_bytes,
                     .step = trip_block_step(f),
                     .present = block,
                     .normals = normals };
    b.squares = count_squares(b.present, b.present_words);
    b.masks = b.present + b.present_words;
    return b;
}

/* Returns the part after the masks. */
static const void *forms_of(const trip_block *b)
{
    return b->masks + b->squares;
}

const unsigned char *trip_block_codes(const trip_block *b)
{
    const uint32_t forms = b->code_bytes == 1 ? 0 : count_groups(b->masks, b->squares);
    return (const unsigned char *)(b->masks + b->squares + form_words(forms));
}

size_t trip_block_codes_bytes(const trip_block *b)
{
    return (size_t)((const unsigned char *)(b->present + b->words) - trip_block_codes(b));
}

/* ---- packing ---- */

/* Finds the Morton numbers of voxels. Returns false if a voxel is outside the tile. */
static bool find_numbers(unsigned tile_log2, const uint32_t *voxels, uint32_t count,
                         uint32_t *numbers)
{
    uint32_t outside = 0;
    for (uint32_t i = 0; i < count; i++) {
        numbers[i] = number_of(voxels[i]);
        outside |= numbers[i] >> 2 * tile_log2 | (voxels[i] & 0x8080);
    }
    return outside == 0;
}

/* Sets the bits of presence and masks. Returns the number of squares, or 0 if voxels are out of
 * order or outside the tile. */
static uint32_t pack_positions(unsigned tile_log2, const uint32_t *voxels, uint32_t count,
                               uint64_t *present, uint64_t *masks)
{
    enum { AT_ONCE = 64 };
    uint32_t numbers[AT_ONCE], squares = 0, last_square = UINT32_MAX, min = 0;
    uint64_t mask = 0;
    for (uint32_t first = 0; first < count; first += AT_ONCE) {
        const uint32_t some = count - first < AT_ONCE ? count - first : AT_ONCE;
        if (!find_numbers(tile_log2, voxels + first, some, numbers))
            return 0;
        for (uint32_t i = 0; i < some; i++) {
            const uint32_t number = numbers[i], square = number / 64;
            if (number < min)
                return 0;
            if (square != last_square) {
                present[square / 64] |= UINT64_C(1) << square % 64;
                squares++;
                mask = 0;
            }
            mask |= UINT64_C(1) << number % 64;
            masks[squares - 1] = mask;
            last_square = square;
            min = number + 1;
        }
    }
    return squares;
}

static bool pack_bytes(const uint32_t *voxels, uint32_t count, unsigned char *codes)
{
    uint32_t rest = 0;
    for (uint32_t i = 0; i < count; i++) {
        const uint32_t code = trip_voxel_code(voxels[i]);
        codes[i] = (unsigned char)(code / TRIP_CODE_STEP - TRIP_CODE_FIRST);
        rest |= code ^ (codes[i] + TRIP_CODE_FIRST) * TRIP_CODE_STEP;
    }
    return rest == 0;
}

static bool are_steps(const uint32_t *voxels, uint32_t count)
{
    uint32_t rest = 0;
    for (uint32_t i = 0; i < count; i++)
        rest |= trip_voxel_code(voxels[i]) % TRIP_CODE_STEP;
    return rest == 0;
}

/* Returns the form that fits the codes. */
static uint32_t form_of(const uint32_t *voxels, uint32_t count, uint32_t step)
{
    uint32_t min = UINT16_MAX, max = 0;
    for (uint32_t i = 0; i < count; i++) {
        uint32_t code = trip_voxel_code(voxels[i]);
        min = code < min ? code : min;
        max = code > max ? code : max;
    }
    min /= step;
    max /= step;
    uint32_t width = max > min ? 32 - (uint32_t)__builtin_clz(max - min) : 0;
    return min | (width + width % 2) << 16;
}

/* Packs the codes of a square. Returns the number of bytes. */
INLINE uint32_t pack_square(const uint32_t *voxels, uint32_t count, uint32_t step, uint32_t form,
                            unsigned char *out)
{
    const uint32_t min = form & UINT16_MAX, width = width_of(form), bytes = (count * width + 7) / 8;
    unsigned char packed[2 * 64 + sizeof(uint64_t)];
    for (uint32_t i = 0; i < count; i += 4) { /* four codes start at a whole byte */
        uint64_t four = 0;
        for (uint32_t k = 0; k < 4 && i + k < count; k++)
            four |= (uint64_t)(trip_voxel_code(voxels[i + k]) / step - min) << k * width;
        memcpy(packed + i / 4 * width / 2, &four, sizeof four);
    }
    memcpy(out, packed, bytes);
    return bytes;
}

/* Packs the forms and codes of all groups. Returns the number of words. Callers pass a constant
 * `step`. */
INLINE uint32_t pack_groups(const uint32_t *voxels, uint32_t step, const uint64_t *masks,
                            uint32_t squares, uint64_t *out)
{
    const uint32_t head = form_words(count_groups(masks, squares));
    void *forms_at = out, *codes_at = out + head;
    uint32_t *form = forms_at, bytes = 0;
    unsigned char *codes = codes_at;
    out[head - 1] = 0;
    for (uint32_t i = 0; i < squares; form++) {
        const uint32_t end = group_end(masks, squares, i);
        *form = form_of(voxels, count_records(masks + i, end - i), step);
        for (; i < end; i++) {
            const uint32_t count = trip_bits_set(masks[i]);
            bytes += pack_square(voxels, count, step, *form, codes + bytes);
            voxels += count;
        }
    }
    memset(codes + bytes, 0, 8 * code_words(bytes) - bytes);
    return head + code_words(bytes);
}

TRIP_ALSO_V3 uint32_t trip_block_pack(const trip_block_form *f, const uint32_t *voxels,
                                      uint32_t count, uint64_t *block)
{
    unsigned present = trip_block_present_words(f->tile_log2);
    memset(block, 0, present * sizeof *block);
    if (count > 1u << 2 * f->tile_log2)
        return 0;
    uint32_t squares = pack_positions(f->tile_log2, voxels, count, block, block + present);
    uint64_t *behind = block + present + squares;
    uint32_t words = code_words(count);
    if (squares == 0)
        return 0;
    if (f->steps && !are_steps(voxels, count))
        return 0;
    if (f->code_bytes != 1)
        return present + squares +
               (f->steps ? pack_groups(voxels, TRIP_CODE_STEP, block + present, squares, behind)
                         : pack_groups(voxels, 1, block + present, squares, behind));
    behind[words - 1] = 0;
    return pack_bytes(voxels, count, (unsigned char *)behind) ? present + squares + words : 0;
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

/* ---- squares ---- */

TRIP_ALSO_V3 uint32_t trip_block_squares(const trip_block *b,
                                         trip_square squares[TRIP_BLOCK_SQUARES_MAX])
{
    const bool packed = b->code_bytes != 1;
    const uint32_t *forms = forms_of(b);
    uint32_t n = 0, first = 0, groups = 0,
             left = 0; /* number of records that the group still needs */
    for (unsigned w = 0; w < b->present_words; w++)
        for (uint64_t bits = b->present[w]; bits; bits &= bits - 1, n++) {
            const uint64_t mask = b->masks[n];
            const uint32_t count = trip_bits_set(mask);
            groups += left == 0;
            left = left == 0 ? TRIP_GROUP_RECORDS : left;
            left -= count < left ? count : left;
            squares[n] = (trip_square){ .mask = mask,
                                        .number = 64 * w + (uint32_t)__builtin_ctzll(bits),
                                        .first = first,
                                        .count = count,
                                        .min = groups - 1 /* index of the square's group */ };
            first += count;
        }
    const void *behind = b->masks + b->squares + (packed ? form_words(groups) : 0);
    const unsigned char *codes = behind;
    for (uint32_t i = 0; i < n; i++) {
        trip_square *s = &squares[i];
        const uint32_t form = packed ? forms[s->min] : TRIP_CODE_FIRST | 8u << 16;
        s->min = form & UINT16_MAX;
        s->width = width_of(form);
        s->step = b->step;
        s->codes = codes;
        codes += trip_square_code_bytes(s);
    }
    return n;
}

/* Packed codes of a square, with room to read four more codes behind them. */
typedef struct packed_codes {
    unsigned char bytes[2 * 64 + sizeof(uint64_t)];
} packed_codes;

static void copy_codes(const trip_square *s, packed_codes *p)
{
    const uint32_t bytes = trip_square_code_bytes(s);
    memcpy(p->bytes, s->codes, bytes);
    memset(p->bytes + bytes, 0, sizeof(uint64_t));
}

/* Returns codes i to i + 3 minus the minimum, the first one lowest. Four codes start at a whole
 * byte and take at most 8 bytes. */
INLINE uint64_t four_above(const packed_codes *p, uint32_t width, uint32_t i)
{
    const uint64_t max = (UINT64_C(1) << width) - 1;
    uint64_t four;
    memcpy(&four, p->bytes + i / 4 * width / 2, sizeof four);
    return (four & max) | (four >> width & max) << 16 | (four >> 2 * width & max) << 32 |
           (four >> 3 * width & max) << 48;
}

/* Compiles `with` once for each possible width. */
#define WITH_WIDTH(width, with)                                                                    \
    switch (width) {                                                                               \
        OF_WIDTH(2, with);                                                                         \
        OF_WIDTH(4, with);                                                                         \
        OF_WIDTH(6, with);                                                                         \
        OF_WIDTH(8, with);                                                                         \
        OF_WIDTH(10, with);                                                                        \
        OF_WIDTH(12, with);                                                                        \
        OF_WIDTH(14, with);                                                                        \
        OF_WIDTH(16, with);                                                                        \
    default: /* all codes equal the minimum */                                                     \
        with(0);                                                                                   \
    }
#define OF_WIDTH(width, with)                                                                      \
    case width:                                                                                    \
        with(width);                                                                               \
        break

INLINE void unpack_as(uint32_t width, const packed_codes *p, uint32_t count, uint16_t above[64])
{
    for (uint32_t i = 0; i < count; i += 4) {
        const uint64_t four = four_above(p, width, i);
        memcpy(above + i, &four, sizeof four);
    }
}

static void unpack_square(const trip_square *s, uint16_t above[64])
{
    packed_codes p;
    copy_codes(s, &p);
#define UNPACK(width) unpack_as(width, &p, s->count, above)
    WITH_WIDTH(s->width, UNPACK)
#undef UNPACK
}

TRIP_ALSO_V3 void trip_square_codes(const trip_square *s, uint16_t codes[64])
{
    const uint32_t min = s->min, step = s->step;
    if (s->width == 8) {
        unsigned char bytes[64]; /* a copy cannot overlap the output */
        memcpy(bytes, s->codes, s->count);
        for (uint32_t i = 0; i < s->count; i++)
            codes[i] = (uint16_t)((bytes[i] + min) * step);
        return;
    }
    unpack_square(s, codes);
    for (uint32_t i = 0; i < 64; i++)
        codes[i] = (uint16_t)((codes[i] + min) * step);
}

/* ---- checking ---- */

/* Masks of the voxels of a square with u less than x, and with v less than x. The mask for x is the
 * first column or row, moved by the Morton numbers of the coordinates below x. */
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

/* Returns the bits below the coordinate x, for a square that starts at `corner`. */
static uint64_t bits_below(const uint64_t table[9], int x, int corner)
{
    int n = x - corner;
    return table[n < 0 ? 0 : n > 8 ? 8 : n];
}

/* Returns the bits of a square inside the brick's bounds. */
static uint64_t bits_within(const trip_file_brick *b, uint32_t corner)
{
    int u = (int)trip_voxel_u(corner), v = (int)trip_voxel_v(corner);
    return bits_below(columns_below, b->u_max + 1, u) & ~bits_below(columns_below, b->u_min, u) &
           bits_below(rows_below, b->v_max + 1, v) & ~bits_below(rows_below, b->v_min, v);
}

static const char *check_positions(const trip_block *b, const trip_file_brick *brick)
{
    uint32_t records = 0;
    uint64_t outside = 0;
    bool empty = false;
    if (b->present_words + b->squares > b->words)
        return "a run has more squares than its block has room for";
    const uint64_t *mask = b->masks;
    for (unsigned w = 0; w < b->present_words; w++)
        for (uint64_t bits = b->present[w]; bits; bits &= bits - 1, mask++) {
            uint32_t corner = corner_of(64 * w + (uint32_t)__builtin_ctzll(bits));
            records += trip_bits_set(*mask);
            outside |= *mask & ~bits_within(brick, corner);
            empty |= *mask == 0;
        }
    if (records != b->count)
        return "a run's masks do not hold as many voxels as the index says";
    if (empty)
        return "a mask is empty";
    return outside ? "a voxel is outside its brick's bounds" : NULL;
}

static bool are_bytes_within(const trip_block *b, const trip_file_brick *brick)
{
    const unsigned char *codes = trip_block_codes(b);
    uint8_t min = UINT8_MAX, max = 0;
    for (uint32_t i = 0; i < b->count; i++) {
        min = codes[i] < min ? codes[i] : min;
        max = codes[i] > max ? codes[i] : max;
    }
    return (min + TRIP_CODE_FIRST) * TRIP_CODE_STEP >= brick->code_min &&
           (max + TRIP_CODE_FIRST) * TRIP_CODE_STEP <= brick->code_max;
}

/* Whether all codes exceed the minimum by at most `max`. */
static bool are_above_at_most(const trip_square *s, uint32_t max)
{
    uint16_t above[64] = { 0 }, greatest = 0;
    unpack_square(s, above);
    for (uint32_t i = s->count; i % 4; i++) /* unpacked together with the previous codes */
        above[i] = 0;
    for (uint32_t i = 0; i < 64; i++)
        greatest = above[i] > greatest ? above[i] : greatest;
    return greatest <= max;
}

/* Looks at the codes only if their width allows values beyond the brick's range. */
static bool is_square_within(const trip_square *s, const trip_file_brick *brick)
{
    if (s->min * s->step < brick->code_min)
        return false;
    const uint32_t max = brick->code_max / s->step;
    return s->min + (1u << s->width) - 1 <= max ||
           (s->min <= max && are_above_at_most(s, max - s->min));
}

static const char wrong_length[] = "the length of a run's block does not match its codes",
                  wrong_value[] = "a value is outside its brick's range";

static const char *check_bytes(const trip_block *b, const trip_file_brick *brick)
{
    if (b->present_words + b->squares + code_words(b->count) != b->words)
        return wrong_length;
    return are_bytes_within(b, brick) ? NULL : wrong_value;
}

/* Looks at the codes only after all widths are valid and the block ends where the codes end. */
static const char *check_packed(const trip_block *b, const trip_file_brick *brick)
{
    const uint32_t groups = count_groups(b->masks, b->squares),
                   head = b->present_words + b->squares + form_words(groups);
    const uint32_t *forms = forms_of(b);
    trip_square squares[TRIP_BLOCK_SQUARES_MAX];
    if (b->squares == 0 || head > b->words)
        return wrong_length;
    for (uint32_t i = 0; i < groups; i++)
        if (width_of(forms[i]) > 16 || width_of(forms[i]) % 2)
            return "the width of codes is invalid";
    const uint32_t count = trip_block_squares(b, squares);
    const trip_square *last = &squares[count - 1];
    const unsigned char *end = last->codes + trip_square_code_bytes(last);
    if (head + code_words((uint32_t)(end - squares[0].codes)) != b->words)
        return wrong_length;
    for (uint32_t i = 0; i < count; i++)
        if (!is_square_within(&squares[i], brick))
            return wrong_value;
    return NULL;
}

TRIP_ALSO_V3 const char *trip_block_check(const trip_block *b, const trip_file_brick *brick)
{
    const char *fault = check_positions(b, brick);
    if (fault)
        return fault;
    return b->code_bytes == 1 ? check_bytes(b, brick) : check_packed(b, brick);
}

/* Whether the bits after the last code of each square are zero, in its last byte. */
static bool are_squares_padded(const trip_block *b)
{
    trip_square squares[TRIP_BLOCK_SQUARES_MAX];
    const uint32_t count = trip_block_squares(b, squares);
    for (uint32_t i = 0; i < count; i++) {
        const uint32_t bits = squares[i].count * squares[i].width;
        if (bits % 8 && squares[i].codes[bits / 8] >> bits % 8)
            return false;
    }
    return true;
}

bool trip_block_is_padded(const trip_block *b)
{
    const unsigned char *end = (const unsigned char *)(b->present + b->words);
    const uint32_t *forms = forms_of(b), groups = count_groups(b->masks, b->squares);
    const bool packed = b->code_bytes != 1;
    const uint32_t bytes = packed ? packed_bytes(b->masks, b->squares, forms) : b->count;
    for (const unsigned char *at = trip_block_codes(b) + bytes; at < end; at++)
        if (*at)
            return false;
    return !packed || ((groups % 2 == 0 || forms[groups] == 0) && are_squares_padded(b));
}

/* ---- decoding ---- */

/* Lists the positions of at most `count` set bits of a mask, after the first `skip`. Returns their
 * number. */
static uint32_t square_positions(uint64_t mask, uint32_t corner, uint32_t skip, uint32_t count,
                                 uint32_t *voxels)
{
    uint32_t n = 0;
    if (mask == UINT64_MAX && skip == 0 && count >= 64) {
        for (; n < 64; n++)
            voxels[n] = corner + positions[n];
        return n;
    }
    for (; skip > 0; skip--)
        mask &= mask - 1;
    for (; mask && n < count; mask &= mask - 1)
        voxels[n++] = corner + positions[__builtin_ctzll(mask)];
    return n;
}

uint32_t trip_square_corner(const trip_square *s)
{
    return corner_of(s->number);
}

void trip_square_voxels(const trip_square *s, uint32_t voxels[64])
{
    uint16_t codes[64];
    trip_square_codes(s, codes);
    square_positions(s->mask, corner_of(s->number), 0, s->count, voxels);
    for (uint32_t i = 0; i < s->count; i++)
        voxels[i] |= (uint32_t)codes[i] << 16;
}

/* Adds 16-bit codes to the positions of all records from `first` on. */
static void add_codes(const trip_block *b, uint32_t first, uint32_t count, uint32_t *voxels)
{
    trip_square squares[TRIP_BLOCK_SQUARES_MAX];
    uint16_t codes[64];
    if (b->code_bytes == 1) {
        const unsigned char *from = trip_block_codes(b) + first;
        for (uint32_t i = 0; i < count; i++)
            voxels[i] |= (uint32_t)(from[i] + TRIP_CODE_FIRST) * TRIP_CODE_STEP << 16;
        return;
    }
    const uint32_t n = trip_block_squares(b, squares);
    for (uint32_t s = 0, done = 0; s < n && done < count; s++) {
        const uint32_t skip = first + done - squares[s].first;
        if (skip >= squares[s].count)
            continue;
        trip_square_codes(&squares[s], codes);
        for (uint32_t i = skip; i < squares[s].count && done < count; i++)
            voxels[done++] |= (uint32_t)codes[i] << 16;
    }
}

void trip_block_voxels(const trip_block *b, uint32_t first, uint32_t count, uint32_t *voxels)
{
    const uint64_t *mask = b->masks;
    uint32_t skip = first, done = 0;
    for (unsigned w = 0; w < b->present_words; w++)
        for (uint64_t bits = b->present[w]; bits && done < count; bits &= bits - 1, mask++) {
            uint32_t here = trip_bits_set(*mask);
            if (skip >= here) {
                skip -= here;
                continue;
            }
            uint32_t corner = corner_of(64 * w + (uint32_t)__builtin_ctzll(bits));
            done += square_positions(*mask, corner, skip, count - done, voxels + done);
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
