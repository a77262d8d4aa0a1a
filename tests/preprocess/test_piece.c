#include "brick_files.h"

#include "format.h"
#include "normal.h"
#include "piece.h"
#include "run_builder.h"

typedef struct sample {
    union {
        trip_piece piece;
        unsigned char bytes[300000];
    };
    size_t length;
} sample;

static unsigned words_of(const trip_piece_format *f)
{
    return 1u << (2 * f->tile_log2 - 6);
}

/* Makes the splats of a bitmap. Their values and normals are computed from their positions. */
static void make_piece(sample *s, const trip_piece_format *f, const uint64_t *bitmap)
{
    unsigned used = 0, splats = 0, n = 0;
    for (unsigned w = 0; w < words_of(f); w++) {
        used += bitmap[w] != 0;
        splats += (unsigned)__builtin_popcountll(bitmap[w]);
    }
    unsigned words = trip_piece_choose_words(f, splats, used);
    trip_piece_parts parts = trip_piece_layout(f, splats, words);
    assert_true(parts.bytes <= trip_piece_max_bytes(f));
    s->length = parts.bytes;
    trip_piece_begin(&s->piece, f, 7, splats, words, bitmap);
    for (unsigned p = 0; p < words_of(f) * 64; p++) {
        if (!(bitmap[p / 64] >> p % 64 & 1))
            continue;
        uint16_t code = (uint16_t)(p * 3 + 1);
        float value = (float)p, magnitude = (float)(p % 256) / 512.0f;
        uint32_t normal =
            f->quantised ? p | 200u << 24 : trip_direction_pack((const double[3]){ 7, 0, 0 });
        if (f->quantised)
            memcpy(s->bytes + parts.values + n * 2, &code, 2);
        else
            memcpy(s->bytes + parts.values + n * 4, &value, 4);
        if (f->normals)
            memcpy(s->bytes + parts.normals + n * 4, &normal, 4);
        if (parts.magnitudes)
            memcpy(s->bytes + parts.magnitudes + n * 4, &magnitude, 4);
        n++;
    }
}

static void check_records(const trip_piece_format *f, const uint64_t *bitmap, uint32_t splats,
                          const uint32_t *voxels, const uint32_t *normals)
{
    uint32_t n = 0;
    for (unsigned p = 0; p < words_of(f) * 64; p++) {
        if (!(bitmap[p / 64] >> p % 64 & 1))
            continue;
        assert_true(n < splats);
        assert_int_equal(trip_morton(trip_voxel_u(voxels[n]), trip_voxel_v(voxels[n])), p);
        /* Unquantised values run from 0 to 65535 here, so that each code equals its value. */
        assert_int_equal(trip_voxel_code(voxels[n]), f->quantised ? (uint16_t)(p * 3 + 1) : p);
        if (f->normals && f->quantised)
            assert_int_equal(normals[n], p | 200u << 24);
        else if (f->normals)
            assert_int_equal(normals[n], (uint32_t)(p % 256 / 512.0 * 511 + 0.5));
        else
            assert_null(normals);
        n++;
    }
    assert_int_equal(n, splats);
}

/* Tries bitmaps of few splats up to all splats, divided among three disjoint pieces. */
static void check_format(const trip_piece_format *f, trip_budget *budget)
{
    static sample pieces[3];
    trip_run_builder *builder;
    const trip_quantiser q = { .lo = 0, .hi = 65535, .gradient_full = 1 };
    uint64_t random = f->tile_log2;
    assert_int_equal(trip_run_builder_create(&builder, f, budget), 0);
    for (unsigned share = 0; share <= 16; share++) {
        uint64_t all[TRIP_TILE_MAX_WORDS] = { 0 }, bitmaps[3][TRIP_TILE_MAX_WORDS] = { 0 };
        const uint32_t *voxels, *normals;
        for (unsigned p = 0; p < words_of(f) * 64; p++)
            if (p < 3 || test_random(&random) % 16 < share)
                bitmaps[p % 3][p / 64] |= UINT64_C(1) << p % 64;
        for (int i = 0; i < 3; i++) {
            make_piece(&pieces[i], f, bitmaps[i]);
            assert_true(trip_piece_check(&pieces[i].piece, f, pieces[i].length));
            assert_false(trip_piece_check(&pieces[i].piece, f, pieces[i].length - 1));
            for (unsigned w = 0; w < words_of(f); w++)
                all[w] |= bitmaps[i][w];
        }
        for (int i = 0; i < 3; i++)
            trip_run_builder_add(builder, &pieces[(i + (int)share) % 3].piece);
        uint32_t splats = trip_run_builder_take(builder, &q, &voxels, &normals);
        check_records(f, all, splats, voxels, normals);
    }
    trip_run_builder_destroy(builder);
}

static void pieces_of_a_tile_merge_into_one_run(void **state)
{
    (void)state;
    trip_budget *budget;
    assert_int_equal(trip_budget_create(&budget, (uint64_t)1 << 26), 0);
    for (unsigned log2 = 4; log2 <= 7; log2++)
        for (int kind = 0; kind < 4; kind++)
            check_format(&(trip_piece_format){ log2, kind & 1, kind & 2, false, false }, budget);
    trip_budget_destroy(budget);
}

/* A piece that passes the check can be added without harm, whatever its bytes are. The sanitizers
 * watch the additions. */
static void damaged_pieces_are_refused_or_harmless(void **state)
{
    (void)state;
    static sample good, bad;
    trip_budget *budget;
    const trip_quantiser q = { .lo = 0, .hi = 65535, .gradient_full = 1 };
    uint64_t random = 5;
    assert_int_equal(trip_budget_create(&budget, (uint64_t)1 << 26), 0);
    for (unsigned log2 = 4; log2 <= 7; log2++) {
        const trip_piece_format f = { log2, true, true, false, false };
        uint64_t bitmap[TRIP_TILE_MAX_WORDS] = { 0 };
        trip_run_builder *builder;
        assert_int_equal(trip_run_builder_create(&builder, &f, budget), 0);
        for (int round = 0; round < 2000; round++) {
            const uint32_t *voxels, *normals;
            for (int i = 0; i < 4; i++)
                bitmap[test_random(&random) % words_of(&f)] ^= UINT64_C(1)
                                                               << test_random(&random) % 64;
            bitmap[0] |= 1;
            make_piece(&good, &f, bitmap);
            size_t length = good.length;
            memcpy(&bad, &good, length);
            bad.bytes[test_random(&random) % length] ^=
                (unsigned char)(1 + test_random(&random) % 255);
            if (!trip_piece_check(&bad.piece, &f, length))
                continue;
            trip_run_builder_add(builder, &bad.piece);
            assert_true(trip_run_builder_take(builder, &q, &voxels, &normals) <= 1u << 2 * log2);
        }
        trip_run_builder_destroy(builder);
    }
    trip_budget_destroy(budget);
}

/* The tile has a bitmap of 4 words. One damage names a word beyond the tile. The other repeats the
 * preceding position. */
static void repeated_positions_and_positions_beyond_the_tile_are_refused(void **state)
{
    (void)state;
    static sample s;
    const trip_piece_format f = { 4, true, false, false, false };
    const uint64_t many[TRIP_TILE_MAX_WORDS] = { UINT64_MAX, 1 }, few[TRIP_TILE_MAX_WORDS] = { 7 };
    make_piece(&s, &f, many);
    assert_true(s.piece.words == 2 && trip_piece_check(&s.piece, &f, s.length));
    uint64_t *mask = (void *)(&s.piece + 1);
    assert_int_equal(*mask, 3);
    *mask = 1 | 1 << 4;
    assert_false(trip_piece_check(&s.piece, &f, s.length));
    make_piece(&s, &f, few);
    assert_true(s.piece.words == 0 && trip_piece_check(&s.piece, &f, s.length));
    uint16_t *positions = (void *)(&s.piece + 1);
    positions[1] = positions[0];
    assert_false(trip_piece_check(&s.piece, &f, s.length));
}

static void codes_are_nearest_and_clamped_to_the_range(void **state)
{
    (void)state;
    const trip_quantiser q = { .lo = -3, .hi = 5 };
    for (unsigned code = 0; code < 65536; code += 13) {
        double value = q.lo + (q.hi - q.lo) * code / 65535, half = (q.hi - q.lo) / 65535 / 2;
        assert_int_equal(trip_quantise(&q, value), code);
        assert_int_equal(trip_quantise(&q, value + 0.99 * half), code);
        assert_int_equal(trip_quantise(&q, value - 0.99 * half), code);
    }
    assert_int_equal(trip_quantise(&q, -1e30), 0);
    assert_int_equal(trip_quantise(&q, 1e30), 65535);
}

static void codes_of_8_and_16_bits_are_exact(void **state)
{
    (void)state;
    const trip_quantiser words = { .lo = 0, .hi = 65535 };
    trip_quantiser bytes = { .bytes = true };
    trip_quantiser_set_bytes(&bytes, -128, 127);
    assert_true(bytes.lo == -128 - 258 && bytes.hi == 127 + 258);
    for (int value = -128; value < 128; value++)
        assert_int_equal(trip_quantise(&bytes, value), 85 * (258 + value + 128));
    assert_int_equal(trip_quantise(&bytes, -1e30), 85 * 258);
    assert_int_equal(trip_quantise(&bytes, NAN), 85 * 258);
    assert_int_equal(trip_quantise(&bytes, 1e30), 85 * (258 + 255));
    for (int value = 0; value < 65536; value++)
        assert_int_equal(trip_quantise(&words, value), value);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(pieces_of_a_tile_merge_into_one_run),
        cmocka_unit_test(damaged_pieces_are_refused_or_harmless),
        cmocka_unit_test(repeated_positions_and_positions_beyond_the_tile_are_refused),
        cmocka_unit_test(codes_are_nearest_and_clamped_to_the_range),
        cmocka_unit_test(codes_of_8_and_16_bits_are_exact),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
