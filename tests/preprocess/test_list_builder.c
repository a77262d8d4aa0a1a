#include "brick_files.h"

#include <fcntl.h>

#include "list_builder.h"

/* Gives random splats of a grid to a builder, in small pieces and in no order. */
enum { NX = 200, NY = 90, NZ = 60, BATCHES = 12 };

typedef struct run_params {
    uint64_t memory_bytes;
    unsigned producers;
    bool in_order; /* batches are slabs along Z */
    bool checkpoints;
    bool damage; /* damages a byte of the spilled data before the merge */
} run_params;

typedef struct building {
    trip_budget *budget;
    trip_writer *writer;
    trip_spill *spill;
    trip_journal *journal;
    trip_workers *workers;
    trip_list_builder *builder;
} building;

static const trip_piece_format format = { 5, true, true, false, false };
static const int64_t dims[3] = { NX, NY, NZ };

static void open_building(building *b, const char *name, const run_params *p)
{
    trip_writer_params w = { .normal_bytes = 4,
                             .tile_voxels = 32,
                             .dims = { NX, NY, NZ },
                             .index_to_world = trip_affine_identity(),
                             .codes = { .code_hi = 1, .gradient_full = 1 } };
    trip_list_builder_params l = { .format = format,
                                   .dims = { NX, NY, NZ },
                                   .producers = p->producers,
                                   .in_order = p->in_order,
                                   .memory_bytes = p->memory_bytes };
    assert_int_equal(trip_budget_create(&b->budget, (uint64_t)1 << 28), 0);
    assert_int_equal(trip_writer_open(&b->writer, test_path(name), &w, b->budget), 0);
    assert_int_equal(trip_spill_open(&b->spill, test_path("spill"), false, b->budget), 0);
    assert_int_equal(trip_journal_open(&b->journal, b->spill,
                                       &(trip_journal_params){ .identity = 1 }, b->budget),
                     0);
    assert_int_equal(trip_workers_create(&b->workers, 3), 0);
    l.writer = b->writer;
    l.spill = b->spill;
    l.journal = b->journal;
    assert_int_equal(trip_list_builder_create(&b->builder, &l, b->budget), 0);
}

static void close_building(building *b)
{
    trip_list_builder_destroy(b->builder);
    trip_writer_abort(b->writer);
    trip_journal_close(b->journal);
    trip_spill_close(b->spill);
    trip_workers_destroy(b->workers);
    trip_budget_destroy(b->budget);
}

/* Returns a hash that decides whether a voxel is a splat, and gives its code and normal. */
static uint32_t hash_of(unsigned x, unsigned y, unsigned z)
{
    uint64_t state = x + 1000 * y + 1000000 * (uint64_t)z;
    test_random(&state);
    test_random(&state);
    return test_random(&state);
}

static bool is_splat(unsigned x, unsigned y, unsigned z)
{
    return hash_of(x, y, z) % 3 == 0;
}

/* Gives the builder one row of voxels along `step_axis`, as a piece of the list along `axis`. */
static void put_row(trip_list_builder *b, unsigned producer, unsigned axis, const unsigned from[3],
                    unsigned step_axis)
{
    uint64_t bitmap[16] = { 0 };
    uint16_t codes[32];
    uint32_t normals[32];
    unsigned splats = 0, used = 0, p[3] = { from[0], from[1], from[2] };
    const unsigned u = (axis + 1) % 3, v = (axis + 2) % 3;
    for (unsigned i = 0; i < 32 && from[step_axis] + i < (unsigned)dims[step_axis]; i++) {
        p[step_axis] = from[step_axis] + i;
        if (!is_splat(p[0], p[1], p[2]))
            continue;
        uint64_t position = trip_morton(p[u] % 32, p[v] % 32);
        bitmap[position / 64] |= UINT64_C(1) << position % 64;
        codes[splats] = (uint16_t)(hash_of(p[0], p[1], p[2]) >> 8);
        normals[splats++] = hash_of(p[0], p[1], p[2]) | 1u << 24;
    }
    for (int w = 0; w < 16; w++)
        used += bitmap[w] != 0;
    if (splats == 0)
        return;
    unsigned words = trip_piece_choose_words(&format, splats, used);
    trip_piece_parts parts = trip_piece_layout(&format, splats, words);
    void *piece;
    assert_int_equal(trip_list_builder_reserve(b, producer, axis, parts.bytes, &piece), 0);
    unsigned char *at = piece;
    uint64_t key =
        (uint64_t)from[axis] << TRIP_TILE_MORTON_BITS | trip_morton(from[u] / 32, from[v] / 32);
    trip_piece_begin(piece, &format, key, splats, words, bitmap);
    memcpy(at + parts.values, codes, splats * sizeof *codes);
    memcpy(at + parts.normals, normals, splats * sizeof *normals);
}

/* Puts rows along an axis that differs from the list's axis, Y in the X lists and so on. Positions
 * ascend along these rows. */
static void put_slice(building *b, unsigned producer, unsigned z)
{
    for (unsigned y = 0; y < NY; y++)
        for (unsigned x = 0; x < NX; x += 32) {
            put_row(b->builder, producer, 2, (unsigned[3]){ x, y, z }, 0);
            put_row(b->builder, producer, 1, (unsigned[3]){ x, y, z }, 0);
        }
    for (unsigned x = 0; x < NX; x++)
        for (unsigned y = 0; y < NY; y += 32)
            put_row(b->builder, producer, 0, (unsigned[3]){ x, y, z }, 1);
}

typedef struct slab {
    building *b;
    unsigned first;
} slab;

static int put_slab_slice(void *user, unsigned thread, uint64_t item)
{
    const slab *s = user;
    put_slice(s->b, thread, s->first + (unsigned)item);
    return 0;
}

static void damage_spill(void)
{
    int fd = open(test_path("spill/pieces"), O_RDWR);
    unsigned char byte;
    assert_true(fd >= 0);
    assert_int_equal(pread(fd, &byte, 1, 5000), 1);
    byte ^= 16;
    assert_int_equal(pwrite(fd, &byte, 1, 5000), 1);
    close(fd);
}

static int run(const char *name, const run_params *p, uint64_t *spilled)
{
    building b;
    trip_workers *producers;
    trip_quantiser q = { .hi = 1, .gradient_full = 1 };
    open_building(&b, name, p);
    assert_int_equal(trip_workers_create(&producers, p->producers), 0);
    int status = 0;
    for (unsigned batch = 0; batch < BATCHES; batch++) {
        /* Without in_order the slabs come from the last to the first. */
        slab s = { &b, (p->in_order ? batch : BATCHES - 1 - batch) * (NZ / BATCHES) };
        assert_int_equal(trip_workers_run(producers, put_slab_slice, &s, NZ / BATCHES), 0);
        int full = trip_list_builder_end_batch(b.builder, (batch + 1.0) / BATCHES);
        assert_true(full >= 0);
        if (full && p->checkpoints)
            assert_int_equal(trip_list_builder_spill(b.builder, calloc(1, sizeof(trip_checkpoint))),
                             0);
    }
    if (p->damage)
        damage_spill();
    status = trip_list_builder_finish(b.builder, &q, b.workers, NULL, NULL);
    *spilled = trip_spill_bytes(b.spill);
    trip_writer_summary summary = { .value_max = 1,
                                    .voxels = (uint64_t)NX * NY * NZ,
                                    .text = "{}" };
    if (status == 0) {
        assert_int_equal(trip_writer_finish(b.writer, &summary), 0);
        b.writer = NULL;
    }
    trip_workers_destroy(producers);
    close_building(&b);
    return status;
}

static void lists_hold_the_splats_in_order(void **state)
{
    (void)state;
    test_lists l;
    uint64_t spilled;
    size_t at = 0;
    assert_int_equal(
        run("a.trip", &(run_params){ (uint64_t)1 << 27, 2, true, true, false }, &spilled), 0);
    assert_int_equal(spilled, 0);
    test_read_lists("a.trip", &l);
    test_check_lists(&l);
    for (unsigned z = 0; z < NZ; z++)
        for (unsigned y = 0; y < NY; y++)
            for (unsigned x = 0; x < NX; x++, at++)
                assert_int_equal(l.codes[0][at] >= 0, is_splat(x, y, z));
    test_free_lists(&l);
}

static void memory_producers_and_order_do_not_change_the_result(void **state)
{
    (void)state;
    uint64_t spilled, min = trip_list_builder_min_bytes(&format, 1);
    const run_params ways[] = {
        { (uint64_t)1 << 27, 1, false, false, false },
        { min, 1, false, false, false },
        { min, 1, false, true, false },
        { 2 * min, 2, true, true, false },
        { 3 * min, 4, false, true, false },
    };
    assert_int_equal(
        run("a.trip", &(run_params){ (uint64_t)1 << 27, 3, true, true, false }, &spilled), 0);
    for (size_t i = 0; i < sizeof ways / sizeof *ways; i++) {
        assert_int_equal(run("b.trip", &ways[i], &spilled), 0);
        assert_int_equal(spilled > 0, i > 0);
        test_same_dataset("a.trip", "b.trip");
        char command[256];
        snprintf(command, sizeof command, "rm -rf %s", test_path("b.trip"));
        assert_int_equal(system(command), 0);
    }
    assert_false(test_exists("spill"));
}

static void data_that_fits_memory_is_not_spilled(void **state)
{
    (void)state;
    uint64_t all, spilled;
    run_params p = { trip_list_builder_min_bytes(&format, 1), 1, false, true, false };
    assert_int_equal(run("a.trip", &p, &all), 0);
    p.memory_bytes = all / 4 * 3;
    assert_int_equal(run("b.trip", &p, &spilled), 0);
    assert_int_equal(spilled, 0);
    p.memory_bytes = all / 2;
    assert_int_equal(run("c.trip", &p, &spilled), 0);
    assert_true(spilled > 0);
}

static void damaged_temporary_data_is_a_failure(void **state)
{
    (void)state;
    uint64_t spilled;
    run_params p = { trip_list_builder_min_bytes(&format, 1), 1, false, true, true };
    assert_int_equal(run("a.trip", &p, &spilled), TRIP_ERROR);
    assert_non_null(strstr(test_report, "temporary data"));
    assert_false(test_exists("a.trip"));
    assert_false(test_exists("a.trip.partial"));
    assert_false(test_exists("spill"));
}

/* The spilling thread detects the interruption. */
static void threads_waiting_for_memory_learn_of_an_interrupted_spill(void **state)
{
    (void)state;
    const run_params p = { trip_list_builder_min_bytes(&format, 1), 1, false, true, false };
    building b;
    void *piece;
    int status;
    open_building(&b, "a.trip", &p);
    put_slice(&b, 0, 0);
    trip_scope_cancel(trip_scope_current());
    assert_int_equal(trip_list_builder_spill(b.builder, calloc(1, sizeof(trip_checkpoint))), 0);
    do
        status = trip_list_builder_reserve(b.builder, 0, 0, trip_piece_max_bytes(&format), &piece);
    while (status == 0);
    assert_int_equal(status, TRIP_INTERRUPTED);
    trip_scope_renew(trip_scope_current());
    close_building(&b);
}

static void a_spill_in_use_is_refused(void **state)
{
    (void)state;
    trip_budget *budget;
    trip_spill *first, *second;
    assert_int_equal(trip_budget_create(&budget, (uint64_t)1 << 24), 0);
    assert_int_equal(trip_spill_open(&first, test_path("spill"), false, budget), 0);
    assert_int_equal(trip_spill_open(&second, test_path("spill"), false, budget), TRIP_ERROR);
    assert_non_null(strstr(test_report, "another process is at work there"));
    assert_true(test_exists("spill"));
    trip_spill_close(first);
    trip_budget_destroy(budget);
    assert_false(test_exists("spill"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(lists_hold_the_splats_in_order, test_begin, test_end),
        cmocka_unit_test_setup_teardown(memory_producers_and_order_do_not_change_the_result,
                                        test_begin, test_end),
        cmocka_unit_test_setup_teardown(data_that_fits_memory_is_not_spilled, test_begin, test_end),
        cmocka_unit_test_setup_teardown(damaged_temporary_data_is_a_failure, test_begin, test_end),
        cmocka_unit_test_setup_teardown(threads_waiting_for_memory_learn_of_an_interrupted_spill,
                                        test_begin, test_end),
        cmocka_unit_test_setup_teardown(a_spill_in_use_is_refused, test_begin, test_end),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
