/* Squares of blocks: iteration, division into parts, and decoding by the kernels.
 * trip_block_voxels() gives the expected voxels. */
#include "cpu/squares.h"
#include "cpu/cpu_view.h"

#include "test.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "cpu/kernels/isa.h"

enum { MAX = TRIP_RUN_RECORDS_MAX };

/* A run's block and its voxels. */
typedef struct fixture {
    trip_block_form form;
    uint32_t voxels[MAX], normals[MAX], count;
    uint64_t words[TRIP_BLOCK_WORDS_MAX];
    unsigned char packed_normals[4 * MAX];
    trip_block block;
    trip_cpu_staged staged;
} fixture;

static fixture *make(void)
{
    fixture *f = calloc(1, sizeof *f);
    assert_non_null(f);
    return f;
}

/* Fills a tile. Some squares are full, some hold few voxels, some none. */
static void fill(fixture *f, unsigned tile_log2, unsigned code_bytes, unsigned normal_bytes)
{
    f->form = (trip_block_form){ .tile_log2 = tile_log2,
                                 .code_bytes = code_bytes,
                                 .normal_bytes = normal_bytes };
    f->count = 0;
    double share = 0, range = 256;
    for (uint32_t i = 0; i < 1u << 2 * tile_log2; i++) {
        uint32_t u = 0, v = 0;
        for (unsigned bit = 0; bit < tile_log2; bit++) {
            u |= (i >> 2 * bit & 1) << bit;
            v |= (i >> (2 * bit + 1) & 1) << bit;
        }
        if (i % 64 == 0) {
            share = test_random() * 2 - 0.5;
            range = code_bytes == 1 ? 256 : exp2(17 * test_random());
        }
        double random = test_random() * range;
        unsigned code = code_bytes == 1 ? ((unsigned)random + TRIP_CODE_FIRST) * TRIP_CODE_STEP
                                        : (unsigned)(65535 - fmin(random, 65535));
        if (test_random() >= share)
            continue;
        f->normals[f->count] = (uint32_t)(test_random() * 0x1p24) << (normal_bytes == 4 ? 8 : 0);
        f->voxels[f->count++] = trip_voxel_pack(u, v, code);
    }
    if (f->count == 0)
        f->voxels[f->count++] = trip_voxel_pack(3, 5, 0);
    uint32_t words = trip_block_pack(&f->form, f->voxels, f->count, f->words);
    assert_true(words > 0);
    trip_normals_pack(normal_bytes, f->normals, f->count, f->packed_normals);
    f->block = trip_block_make(&f->form, f->count, words, f->words, f->packed_normals);
}

static unsigned square_of(uint32_t voxel)
{
    return (unsigned)trip_morton(trip_voxel_u(voxel) / 8, trip_voxel_v(voxel) / 8);
}

static void squares_come_in_draw_order_with_their_records(void **state)
{
    (void)state;
    fixture *f = make();
    for (int i = 0; i < 60; i++) {
        bool reversed = i % 2;
        fill(f, 4 + (unsigned)i % 4, 2, 4);
        trip_cpu_walk w = trip_cpu_walk_begin(&f->block, reversed);
        uint32_t next = reversed ? f->count : 0;
        while (trip_cpu_walk_next(&w)) {
            assert_int_equal(reversed ? w.first + w.count : w.first, next);
            for (uint32_t k = 0; k < w.count; k++)
                assert_int_equal(square_of(f->voxels[w.first + k]), w.number);
            next = reversed ? w.first : w.first + w.count;
            assert_int_equal(trip_morton((uint32_t)trip_cpu_square_u(w.number),
                                         (uint32_t)trip_cpu_square_v(w.number)),
                             w.number);
        }
        assert_int_equal(next, reversed ? 0 : f->count);
    }
    free(f);
}

static void parts_of_a_run_hold_every_square_once(void **state)
{
    (void)state;
    fixture *f = make();
    const trip_run run = { 0 };
    for (int i = 0; i < 60; i++) {
        bool reversed = i % 2;
        uint64_t seen[TRIP_BLOCK_PRESENT_MAX] = { 0 };
        uint32_t skip = 0, voxels = 0, squares;
        fill(f, 4 + (unsigned)i % 4, 2, 4);
        for (; voxels < f->count; skip += squares) {
            uint32_t max = 64 + (uint32_t)(test_random() * 500);
            trip_cpu_part p;
            trip_cpu_part_make(&p, &run, &f->block, reversed, skip, max);
            squares = 0;
            for (unsigned w = 0; w < f->block.present_words; w++) {
                assert_int_equal(p.squares[w] & (seen[w] | ~f->block.present[w]), 0);
                seen[w] |= p.squares[w];
                squares += (uint32_t)__builtin_popcountll(p.squares[w]);
            }
            assert_true(squares > 0 && p.voxels <= max);
            voxels += p.voxels;
        }
        assert_int_equal(voxels, f->count);
        assert_memory_equal(seen, f->block.present, f->block.present_words * sizeof *seen);
    }
    free(f);
}

/* A square, followed by exactly the padding that may be read behind its bytes. */
typedef struct square_bytes {
    unsigned char *codes, *normals;
} square_bytes;

static trip_cpu_square square_at(const fixture *f, const trip_square *at, square_bytes *bytes)
{
    const trip_block *b = &f->block;
    const size_t codes = trip_square_code_bytes(at), normals = (size_t)at->count * b->normal_bytes;
    bytes->codes = malloc(codes + TRIP_CPU_READABLE);
    bytes->normals = malloc(normals + TRIP_CPU_READABLE);
    assert_true(bytes->codes && bytes->normals);
    memset(bytes->codes, 0xee, codes + TRIP_CPU_READABLE);
    memset(bytes->normals, 0xee, normals + TRIP_CPU_READABLE);
    memcpy(bytes->codes, at->codes, codes);
    memcpy(bytes->normals, b->normals + (size_t)at->first * b->normal_bytes, normals);
    return (trip_cpu_square){ .u = 1000 + 8 * trip_cpu_square_u(at->number),
                              .v = 2000 + 8 * trip_cpu_square_v(at->number),
                              .sheet = 77,
                              .mask = at->mask,
                              .min = at->min,
                              .width = at->width,
                              .codes = bytes->codes,
                              .normals = bytes->normals };
}

static void check_staged(fixture *f, const trip_cpu_kernels *kernels, const trip_cpu_view *view,
                         bool reversed)
{
    trip_square squares[TRIP_BLOCK_SQUARES_MAX];
    const uint32_t count = trip_block_squares(&f->block, squares);
    for (uint32_t i = 0; i < count; i++) {
        const trip_square *of = &squares[reversed ? count - 1 - i : i];
        square_bytes bytes;
        uint32_t filled = (uint32_t)(test_random() * (TRIP_CPU_STAGED - 64)), before = filled;
        trip_cpu_square square = square_at(f, of, &bytes);
        uint32_t end = kernels->stage(view, &square, reversed, &f->staged, filled);
        for (uint32_t k = 0; k < of->count; k++) {
            uint32_t at = reversed ? of->first + of->count - 1 - k : of->first + k;
            uint32_t voxel = f->voxels[at];
            if (view->table[trip_voxel_code(voxel)].extinction == 0)
                continue;
            assert_int_equal(f->staged.u[filled], 1000 + (int)trip_voxel_u(voxel));
            assert_int_equal(f->staged.v[filled], 2000 + (int)trip_voxel_v(voxel));
            assert_int_equal(f->staged.sheet[filled], 77);
            const int32_t code = f->staged.code[filled];
            assert_int_equal(view->code_bytes == 1 ? (code + TRIP_CODE_FIRST) * TRIP_CODE_STEP
                                                   : code,
                             trip_voxel_code(voxel));
            if (view->shading)
                assert_int_equal((uint32_t)f->staged.normal[filled], f->normals[at]);
            filled++;
        }
        assert_true(end == filled && filled >= before);
        free(bytes.codes);
        free(bytes.normals);
    }
}

/* The codes with extinction: above a code, between two codes, separate ones, or none. */
typedef enum shown { ABOVE, BETWEEN, APART, NONE } shown;

static void show(trip_tf_entry *table, shown which)
{
    for (int i = 0; i < 65536; i++) {
        const bool above = i >= 22000, between = above && i < 48000;
        table[i].extinction = which == ABOVE     ? above
                              : which == BETWEEN ? between
                              : which == APART   ? i < 9000 || above
                                                 : 0;
    }
}

static void kernels_decode_squares_in_draw_order(void **state)
{
    (void)state;
    fixture *f = make();
    trip_tf_entry *table = calloc(65536, sizeof *table);
    assert_non_null(table);
    for (int i = 0; i < 256; i++) {
        show(table, (shown)(i / 64));
        unsigned code_bytes = 1 + (unsigned)i % 2, normal_bytes = 3 + (unsigned)i / 2 % 2;
        fill(f, 4 + (unsigned)i / 16 % 4, code_bytes, normal_bytes);
        trip_cpu_view view = { .shading = i / 4 % 2,
                               .code_bytes = code_bytes,
                               .normal_bytes = normal_bytes };
        for (int known = 0; known < 2; known++) {
            trip_code_set set;
            trip_code_set_make(&set, table, FLT_TRUE_MIN);
            trip_cpu_view_set_table(&view, table,
                                    known ? trip_code_set_range(&set) : (trip_code_range){ 1, 0 });
            for (const trip_cpu_kernels *const *isa = trip_cpu_isas(); *isa; isa++)
                check_staged(f, *isa, &view, i / 8 % 2);
        }
    }
    free(table);
    free(f);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(squares_come_in_draw_order_with_their_records),
        cmocka_unit_test(parts_of_a_run_hold_every_square_once),
        cmocka_unit_test(kernels_decode_squares_in_draw_order),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
