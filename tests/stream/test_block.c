/* Tests of blocks. Packed records decode from any record on, with the bytes that FORMAT.md defines.
 * The check finds blocks that contradict their run or brick. */
#include "fixture.h"

#include "block.h"

enum { ROOM = TRIP_RUN_RECORDS_MAX };

/* Interleaves bit by bit, independently of the code under test. */
static uint32_t plain_morton(uint32_t u, uint32_t v)
{
    uint32_t m = 0;
    for (int b = 0; b < 8; b++)
        m |= (u >> b & 1) << 2 * b | (v >> b & 1) << (2 * b + 1);
    return m;
}

typedef struct run {
    trip_block_form form;
    uint32_t voxels[ROOM], count, words;
    uint64_t block[TRIP_BLOCK_WORDS_MAX];
    trip_file_brick brick; /* has exact bounds */
} run;

static run shared; /* large */

/* Forms with codes of one byte, of two bytes, and of two bytes with whole steps. */
enum { BYTES, CODES, STEPS, FORMS };

static trip_block_form form_of(unsigned tile_log2, int form)
{
    return (trip_block_form){ .tile_log2 = tile_log2,
                              .code_bytes = form == BYTES ? 1 : 2,
                              .steps = form == STEPS };
}

static uint32_t random_code(const trip_block_form *f, uint64_t random)
{
    return f->code_bytes == 1 ? 85 * (258 + (random & 255))
           : f->steps         ? 85 * ((random & 65535) % 772)
                              : random & 65535;
}

/* Makes a run with each voxel of the tile at probability `density`, and packs its block. */
static run *make_run(trip_block_form form, double density, uint64_t seed)
{
    static uint32_t by_number[ROOM];
    run *r = &shared;
    uint32_t edge = 1u << form.tile_log2;
    for (uint32_t v = 0; v < edge; v++)
        for (uint32_t u = 0; u < edge; u++)
            by_number[plain_morton(u, v)] = u | v << 8;
    *r = (run){ .form = form,
                .brick = { .code_min = UINT16_MAX, .u_min = UINT8_MAX, .v_min = UINT8_MAX } };
    trip_file_brick *b = &r->brick;
    for (uint32_t n = 0; n < edge * edge; n++) {
        uint64_t random = fixture_random(&seed);
        if ((double)(random >> 40) >= density * (1 << 24) && n + 1 < edge * edge)
            continue;
        uint32_t position = by_number[n], u = position & 255, v = position >> 8;
        uint32_t code = random_code(&form, random);
        r->voxels[r->count++] = position | code << 16;
        b->u_min = (uint8_t)(u < b->u_min ? u : b->u_min);
        b->u_max = (uint8_t)(u > b->u_max ? u : b->u_max);
        b->v_min = (uint8_t)(v < b->v_min ? v : b->v_min);
        b->v_max = (uint8_t)(v > b->v_max ? v : b->v_max);
        b->code_min = (uint16_t)(code < b->code_min ? code : b->code_min);
        b->code_max = (uint16_t)(code > b->code_max ? code : b->code_max);
    }
    r->words = trip_block_pack(&r->form, r->voxels, r->count, r->block);
    return r;
}

static trip_block block_of(const run *r)
{
    return trip_block_make(&r->form, r->count, r->words, r->block, NULL);
}

static void packed_records_are_decoded_from_any_record_on(void **state)
{
    static uint32_t out[ROOM];
    const double densities[] = { 0, 0.001, 0.1, 0.7, 1.1 };
    uint64_t seed = 1;
    (void)state;
    for (unsigned log2 = 4; log2 <= 7; log2++)
        for (int form = 0; form < FORMS; form++)
            for (int i = 0; i < 5; i++) {
                const run *r = make_run(form_of(log2, form), densities[i], i);
                const trip_block b = block_of(r);
                assert_true(trip_block_words_fit(&r->form, r->count, r->words));
                assert_true(r->words <= trip_block_max_words(&r->form));
                assert_null(trip_block_check(&b, &r->brick));
                assert_true(trip_block_is_padded(&b));
                trip_block_voxels(&b, 0, r->count, out);
                assert_memory_equal(out, r->voxels, r->count * sizeof *out);
                for (int k = 0; k < 20; k++) {
                    uint32_t first = (uint32_t)(fixture_random(&seed) % r->count);
                    uint32_t n = (uint32_t)(fixture_random(&seed) % (r->count - first + 1));
                    trip_block_voxels(&b, first, n, out);
                    assert_memory_equal(out, r->voxels + first, n * sizeof *out);
                }
            }
}

static void squares_hold_the_records_of_their_block(void **state)
{
    static uint32_t out[ROOM];
    trip_square squares[TRIP_BLOCK_SQUARES_MAX];
    (void)state;
    for (unsigned log2 = 4; log2 <= 7; log2++)
        for (int form = 0; form < FORMS; form++) {
            const run *r = make_run(form_of(log2, form), 0.3, log2);
            const trip_block b = block_of(r);
            const uint32_t count = trip_block_squares(&b, squares);
            for (uint32_t i = 0; i < count; i++) {
                uint32_t voxels[64], corner = trip_square_corner(&squares[i]);
                trip_square_voxels(&squares[i], voxels);
                for (uint32_t k = 0; k < squares[i].count; k++)
                    assert_int_equal(voxels[k] & 0xf8f8, corner);
                memcpy(out + squares[i].first, voxels, squares[i].count * sizeof *voxels);
            }
            assert_memory_equal(out, r->voxels, r->count * sizeof *out);
        }
}

static void a_block_has_the_bytes_that_the_format_defines(void **state)
{
    (void)state;
    /* (1, 0) is voxel 1 of square 0. (9, 8) and (15, 15) are voxels 1 and 63 of square 3. */
    const uint32_t voxels[] = { trip_voxel_pack(1, 0, 21930), trip_voxel_pack(9, 8, 22015),
                                trip_voxel_pack(15, 15, 43605) };
    uint64_t block[TRIP_BLOCK_WORDS_MAX];
    const trip_block_form bytes = form_of(4, BYTES), codes = form_of(7, CODES);
    assert_int_equal(trip_block_pack(&bytes, voxels, 3, block), 4);
    assert_true(block[0] == 9 && block[1] == 2 && block[2] == (UINT64_C(1) << 63 | 2));
    assert_true(block[3] == 0xff0100); /* code 85 (258 + c) is stored as c */
    assert_int_equal(trip_block_pack(&codes, voxels, 3, block), 8);
    assert_true(block[0] == 9 && !block[1] && !block[2] && !block[3] && block[4] == 2);
    assert_true(block[6] == 0x1055aa); /* one group with minimum 21930 and 16 bits */
    assert_true(block[7] == UINT64_C(0x54ab00550000)); /* codes minus 21930 */
    const trip_block_form steps = form_of(7, STEPS);
    assert_int_equal(trip_block_pack(&steps, voxels, 3, block), 8);
    assert_true(block[6] == 0x80102);  /* one group with minimum step 258 and 8 bits */
    assert_true(block[7] == 0xff0100); /* steps minus 258 */
}

/* A square of 32 records with codes over a range of 31 forms the first group. One other record
 * forms the second group. */
static void codes_are_packed_in_groups_of_squares(void **state)
{
    uint32_t voxels[33];
    const trip_block_form form = form_of(4, CODES);
    uint64_t block[TRIP_BLOCK_WORDS_MAX], codes[3] = { 0 };
    (void)state;
    for (uint32_t i = 0; i < 32; i++) {
        const uint32_t above = 5 * i % 32;
        voxels[i] = trip_voxel_pack((i & 1) | (i >> 1 & 2) | (i >> 2 & 4),
                                    (i >> 1 & 1) | (i >> 2 & 2), 1000 + above);
        for (uint32_t bit = 0; bit < 6; bit++) /* 5 bits suffice, but widths are even */
            codes[(6 * i + bit) / 64] |= (uint64_t)(above >> bit & 1) << (6 * i + bit) % 64;
    }
    voxels[32] = trip_voxel_pack(8, 8, 7);
    assert_int_equal(trip_block_pack(&form, voxels, 33, block), 7);
    assert_true(block[0] == 9 && block[1] == UINT32_MAX && block[2] == 1);
    assert_true(block[3] == (UINT64_C(7) << 32 | 6 << 16 | 1000));
    assert_memory_equal(block + 4, codes, sizeof codes);
}

static void invalid_runs_are_not_packed(void **state)
{
    uint64_t block[TRIP_BLOCK_WORDS_MAX];
    const trip_block_form small = form_of(4, CODES), bytes = form_of(4, BYTES),
                          steps = form_of(4, STEPS);
    const uint32_t backwards[] = { trip_voxel_pack(1, 0, 0), trip_voxel_pack(0, 0, 0) };
    const uint32_t twice[] = { 5, 5 }, outside = trip_voxel_pack(16, 0, 0);
    const uint32_t far = trip_voxel_pack(128, 0, 0), odd = trip_voxel_pack(0, 0, 258);
    const uint32_t low = trip_voxel_pack(0, 0, 85 * 257), high = trip_voxel_pack(0, 0, 85 * 514);
    (void)state;
    assert_int_equal(trip_block_pack(&small, backwards, 2, block), 0);
    assert_int_equal(trip_block_pack(&small, twice, 2, block), 0);
    assert_int_equal(trip_block_pack(&small, &outside, 1, block), 0);
    assert_int_equal(trip_block_pack(&small, &far, 1, block), 0);
    assert_int_equal(trip_block_pack(&bytes, &odd, 1, block), 0);
    assert_int_equal(trip_block_pack(&bytes, &low, 1, block), 0);
    assert_int_equal(trip_block_pack(&bytes, &high, 1, block), 0);
    assert_int_equal(trip_block_pack(&steps, &odd, 1, block), 0);
    assert_int_equal(trip_block_pack(&steps, &low, 1, block), 3);
    assert_int_equal(trip_block_pack(&small, &odd, 1, block), 3);
}

static void a_number_of_words_fits_if_squares_can_hold_the_records(void **state)
{
    const trip_block_form bytes = form_of(4, BYTES); /* one presence word, four squares */
    /* A word holds two groups. Codes have no bits, or a word holds at least four codes. */
    const trip_block_form f = form_of(4, CODES);
    (void)state;
    assert_false(trip_block_words_fit(&bytes, 0, 2));
    assert_false(trip_block_words_fit(&bytes, 1, 2));
    assert_true(trip_block_words_fit(&bytes, 1, 3));
    assert_false(trip_block_words_fit(&bytes, 1, 4)); /* two squares for one record */
    assert_true(trip_block_words_fit(&bytes, 64, 1 + 1 + 8));
    assert_false(trip_block_words_fit(&bytes, 65, 1 + 1 + 9));
    assert_true(trip_block_words_fit(&bytes, 65, 1 + 4 + 9));
    assert_false(trip_block_words_fit(&bytes, 65, 1 + 5 + 9));
    assert_true(trip_block_words_fit(&bytes, 256, 1 + 4 + 32));
    assert_false(trip_block_words_fit(&bytes, 257, 1 + 4 + 33));
    assert_false(trip_block_words_fit(&bytes, UINT32_MAX, 65535));
    assert_false(trip_block_words_fit(&f, 0, 2));
    assert_false(trip_block_words_fit(&f, 1, 1 + 1));
    assert_true(trip_block_words_fit(&f, 1, 1 + 1 + 1));
    assert_true(trip_block_words_fit(&f, 1, 1 + 1 + 1 + 1));
    assert_false(trip_block_words_fit(&f, 1, 1 + 1 + 1 + 2)); /* two words for one code */
    assert_false(trip_block_words_fit(&f, 65, 1 + 2));
    assert_true(trip_block_words_fit(&f, 65, 1 + 2 + 1));
    assert_true(trip_block_words_fit(&f, 256, 1 + 4 + 2 + 64));
    assert_false(trip_block_words_fit(&f, 256, 1 + 4 + 2 + 65));
    assert_false(trip_block_words_fit(&f, 257, 1 + 4 + 2 + 64));
    assert_false(trip_block_words_fit(&f, UINT32_MAX, 65535));
}

/* The words present determine the end of the next part, until the block is complete. */
static void the_words_present_determine_the_end_of_a_block(void **state)
{
    (void)state;
    for (unsigned log2 = 4; log2 <= 7; log2++)
        for (int form = 0; form < FORMS; form++) {
            const run *r = make_run(form_of(log2, form), 0.1, log2);
            uint64_t *part = calloc(r->words, sizeof *part); /* sanitizers check reads */
            uint32_t words = 0, end, parts = 0;
            assert_non_null(part);
            for (; (end = trip_block_end(&r->form, part, words)) > words; words = end, parts++) {
                assert_true(end <= r->words);
                memcpy(part + words, r->block + words, (end - words) * sizeof *part);
            }
            assert_true(words == r->words && parts == (form == BYTES ? 3 : 4));
            free(part);
        }
}

static void expect_fault(const run *r, const char *why)
{
    const trip_block b = block_of(r);
    const char *fault = trip_block_check(&b, &r->brick);
    if (!fault || !strstr(fault, why))
        fail_msg("wanted \"%s\", not \"%s\"", why, fault ? fault : "nothing");
}

/* All bounds are exact, so bounds smaller by one on any side exclude a record. */
static void records_outside_their_brick_are_found(void **state)
{
    (void)state;
    for (unsigned log2 = 4; log2 <= 7; log2++)
        for (int form = 0; form < FORMS; form++)
            for (uint64_t seed = 0; seed < 8; seed++) {
                run *r = make_run(form_of(log2, form), 0.02, seed);
                const trip_file_brick exact = r->brick;
                r->brick.u_min++;
                expect_fault(r, "outside its brick's bounds");
                r->brick = exact;
                r->brick.u_max--;
                expect_fault(r, "outside its brick's bounds");
                r->brick = exact;
                r->brick.v_min++;
                expect_fault(r, "outside its brick's bounds");
                r->brick = exact;
                r->brick.v_max--;
                expect_fault(r, "outside its brick's bounds");
                r->brick = exact;
                r->brick.code_min++;
                expect_fault(r, "outside its brick's range");
                r->brick = exact;
                r->brick.code_max--;
                expect_fault(r, "outside its brick's range");
            }
}

/* Makes a run with codes over a range of `bits` bits. Sets *max to the maximum code. */
static run *make_narrow_run(unsigned bits, double density, uint64_t seed, uint32_t *max)
{
    run *r = make_run(form_of(5, CODES), density, seed);
    const uint32_t span = (1u << bits) - 1, min = (uint32_t)(seed * 977) % (65536 - span);
    *max = 0;
    for (uint32_t i = 0; i < r->count; i++) {
        const uint32_t code = min + ((r->voxels[i] >> 16) & span);
        r->voxels[i] = (r->voxels[i] & UINT16_MAX) | code << 16;
        *max = code > *max ? code : *max;
    }
    r->words = trip_block_pack(&r->form, r->voxels, r->count, r->block);
    r->brick.code_min = 0;
    return r;
}

static void bounds_of_codes_are_exact_for_every_width(void **state)
{
    uint64_t random = 5;
    (void)state;
    for (unsigned bits = 0; bits <= 16; bits++)
        for (uint64_t seed = 0; seed < 20; seed++) {
            uint32_t max;
            run *r = make_narrow_run(bits, seed % 2 ? 0.03 : 0.8, seed, &max);
            const trip_block b = block_of(r);
            for (int i = 0; i < 20; i++) {
                const uint32_t by = (uint32_t)(fixture_random(&random) % (1u << bits));
                const uint32_t bound = i == 0 ? max : i == 1 ? max - (max > 0) : max + 9 - by;
                r->brick.code_max = (uint16_t)(bound > UINT16_MAX ? UINT16_MAX : bound);
                if (max > r->brick.code_max)
                    expect_fault(r, "outside its brick's range");
                else
                    assert_null(trip_block_check(&b, &r->brick));
            }
        }
}

static void masks_that_contradict_the_run_are_found(void **state)
{
    const trip_block_form f = form_of(6, CODES);
    (void)state;
    run *r = make_run(f, 0.3, 3);
    r->block[0] &= r->block[0] - 1;
    expect_fault(r, "as many voxels");
    r = make_run(f, 0, 3);
    r->block[0] = UINT64_MAX;
    expect_fault(r, "squares");
    r = make_run(f, 0.3, 3);
    r->block[1] &= r->block[1] - 1;
    expect_fault(r, "as many voxels");
    r = make_run(f, 0.3, 3); /* moves the bits of the first mask to the second */
    uint64_t both[2] = { r->block[1], r->block[2] };
    int bits = __builtin_popcountll(both[0]);
    for (int n = 0; n < 64 && bits > 0; n++)
        if (!(both[1] >> n & 1)) {
            both[1] |= UINT64_C(1) << n;
            bits--;
        }
    assert_int_equal(bits, 0);
    r->block[1] = 0;
    r->block[2] = both[1];
    expect_fault(r, "a mask is empty");
    r = make_run(form_of(4, CODES), 0.3, 3); /* squares 0 to 3 exist, bit 63 does not */
    r->block[0] ^= UINT64_C(1) << 3 | UINT64_C(1) << 63;
    expect_fault(r, "outside its brick's bounds");
}

/* Returns the first form of a block of 64 squares. */
static uint32_t *first_form(run *r)
{
    return (uint32_t *)(r->block + 1 + 64);
}

/* Tries invalid widths, widths that contradict the length of the block, and codes beyond 16 bits.
 */
static void invalid_forms_are_found(void **state)
{
    const trip_block_form f = form_of(6, CODES);
    const uint32_t widths[] = { 15, 1, 17, 18, 32, 65535 };
    (void)state;
    for (int i = 0; i < 6; i++) {
        run *r = make_run(f, 1.1, 3);
        *first_form(r) = widths[i] << 16;
        expect_fault(r, "width");
    }
    for (uint32_t width = 0; width < 16; width += 2) {
        run *r = make_run(f, 1.1, 3);
        *first_form(r) = width << 16;
        expect_fault(r, "length");
    }
    run *r = make_run(f, 1.1, 3);
    r->words--;
    expect_fault(r, "length");
    *first_form(r) = 17u << 16;
    r->words = 1 + 64; /* the block ends before the forms, so the check must not read them */
    expect_fault(r, "length");
    r = make_run(f, 1.1, 3);
    r->brick.code_max = UINT16_MAX;
    *first_form(r) += UINT16_MAX - (*first_form(r) & UINT16_MAX);
    expect_fault(r, "outside its brick's range");
}

static void nonzero_padding_is_found(void **state)
{
    (void)state;
    run *r = make_run(form_of(5, BYTES), 0.1, 5);
    while (r->count % 8 == 0)
        r = make_run(r->form, 0.1, r->count);
    const trip_block b = block_of(r);
    assert_true(trip_block_is_padded(&b));
    r->block[r->words - 1] |= UINT64_C(1) << 63;
    assert_false(trip_block_is_padded(&b));
    r = make_run(form_of(4, CODES), 0, 5); /* one group of one code */
    const trip_block one = block_of(r);
    assert_true(r->words == 3 && trip_block_is_padded(&one));
    r->block[2] |= UINT64_C(1) << 32;
    assert_false(trip_block_is_padded(&one));
}

/* Padding fills the bits between the last code of a square and the next byte. */
static void bits_behind_the_codes_of_a_square_are_padding(void **state)
{
    (void)state;
    run *r = make_run(form_of(4, STEPS), 0.3, 5); /* codes have 10 bits */
    trip_square squares[TRIP_BLOCK_SQUARES_MAX];
    const trip_block b = block_of(r);
    const uint32_t count = trip_block_squares(&b, squares);
    uint32_t i = 0;
    while (i < count && squares[i].count * squares[i].width % 8 == 0)
        i++;
    assert_true(i < count && trip_block_is_padded(&b));
    unsigned char *last = (unsigned char *)r->block +
                          (squares[i].codes - (const unsigned char *)r->block) +
                          squares[i].count * squares[i].width / 8;
    *last |= 0x80;
    assert_false(trip_block_is_padded(&b));
}

/* Sets bits behind three codes of 2 bits. As a fourth code they would be out of range. */
static void bits_behind_the_last_code_are_no_code(void **state)
{
    (void)state;
    run *r = &shared;
    *r = (run){ .form = form_of(4, CODES),
                .voxels = { trip_voxel_pack(0, 0, 100), trip_voxel_pack(1, 0, 101),
                            trip_voxel_pack(0, 1, 102) },
                .count = 3,
                .brick = { .code_min = 100, .code_max = 102, .u_max = 1, .v_max = 1 } };
    r->words = trip_block_pack(&r->form, r->voxels, r->count, r->block);
    assert_int_equal(r->words, 4); /* presence word, mask, form and codes */
    r->block[3] |= 3 << 6;
    const trip_block b = block_of(r);
    assert_null(trip_block_check(&b, &r->brick));
    r->brick.code_max--;
    expect_fault(r, "outside its brick's range");
}

static void normals_are_packed_and_decoded(void **state)
{
    const uint32_t normals[] = { 0x000000, 0x800000, 0xabcdef, 0x7fffff };
    uint32_t out[4];
    unsigned char packed[16];
    (void)state;
    for (unsigned bytes = 3; bytes <= 4; bytes++) {
        trip_normals_pack(bytes, normals, 4, packed);
        assert_int_equal(packed[2 * bytes], 0xef);
        assert_int_equal(packed[2 * bytes + 2], 0xab);
        const trip_block b = { .count = 4, .normal_bytes = bytes, .normals = packed };
        trip_block_normals(&b, 0, 4, out);
        assert_memory_equal(out, normals, sizeof out);
        trip_block_normals(&b, 2, 1, out);
        assert_int_equal(out[0], 0xabcdef);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(packed_records_are_decoded_from_any_record_on),
        cmocka_unit_test(squares_hold_the_records_of_their_block),
        cmocka_unit_test(a_block_has_the_bytes_that_the_format_defines),
        cmocka_unit_test(codes_are_packed_in_groups_of_squares),
        cmocka_unit_test(invalid_runs_are_not_packed),
        cmocka_unit_test(a_number_of_words_fits_if_squares_can_hold_the_records),
        cmocka_unit_test(the_words_present_determine_the_end_of_a_block),
        cmocka_unit_test(records_outside_their_brick_are_found),
        cmocka_unit_test(bounds_of_codes_are_exact_for_every_width),
        cmocka_unit_test(masks_that_contradict_the_run_are_found),
        cmocka_unit_test(invalid_forms_are_found),
        cmocka_unit_test(nonzero_padding_is_found),
        cmocka_unit_test(bits_behind_the_codes_of_a_square_are_padding),
        cmocka_unit_test(bits_behind_the_last_code_are_no_code),
        cmocka_unit_test(normals_are_packed_and_decoded),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
