/* Tests of the planner's packing, on a data set of dense lists. The X list has 8 sheets of 16
 * tiles.
 *
 * A run has 256 records with codes of 16 bits. Its block has a presence word, 4 masks, 2 words of
 * forms and 64 words of codes: 568 bytes. So run n of a list starts at byte 568 n, and its normals
 * at byte 1024 n. Pages have 4096 bytes. */
#include "fixture.h"

#include "extent.h"

enum { RUN_BYTES = 568, RUN_RECORDS = 256, SHEETS = 8, RUNS = 16 * SHEETS, RUNS_MAX = 256 };

typedef struct plan_test {
    fixture f;
    trip_dataset *d;
    trip_selection s[2];
    trip_pass pass;
    trip_pass_cursor cursors[2];
    trip_planner planner;
    trip_run runs[RUNS_MAX];
    trip_extent extent;
} plan_test;

static void start(plan_test *t, bool descending, size_t slot_bytes, unsigned planes)
{
    *t = (plan_test){ 0 };
    fixture_make(&t->f, &(fixture_params){ .dims = { SHEETS, 64, 64 },
                                           .density = 1.1,
                                           .tile_voxels = 16,
                                           .slab_sheets = SHEETS,
                                           .page_bytes = 4096,
                                           .normals = true,
                                           .in_memory = true });
    assert_int_equal(trip_dataset_open(&t->d, t->f.path, t->f.budget), TRIP_OK);
    for (int i = 0; i < 2; i++)
        assert_int_equal(trip_selection_create(&t->s[i], t->d, &t->d->lists[i], descending, 0,
                                               INT32_MAX, t->f.budget),
                         0);
    t->planner = (trip_planner){ .planes = planes,
                                 .normal_bytes = 4,
                                 .page_bytes = 4096,
                                 .slot_bytes = slot_bytes,
                                 .gap_bytes = 4096 };
    t->pass = trip_pass_of(&t->s[0]);
    t->extent.runs = t->runs;
    t->extent.run_room = RUNS_MAX;
}

static void begin(plan_test *t)
{
    trip_planner_begin(&t->planner, &t->pass, t->cursors);
}

static void select_all(plan_test *t, int list)
{
    for (uint64_t b = 0; b < t->d->lists[list].brick_count; b++)
        trip_selection_add(&t->s[list], b);
}

static void finish(plan_test *t)
{
    for (int i = 0; i < 2; i++)
        trip_selection_destroy(&t->s[i], t->f.budget);
    trip_dataset_close(t->d);
    fixture_free(&t->f);
}

static void expect_range(const plan_test *t, unsigned i, uint64_t offset, size_t bytes,
                         size_t slot_offset)
{
    assert_true(i < t->extent.range_count);
    assert_int_equal(t->extent.ranges[i].offset, offset);
    assert_int_equal(t->extent.ranges[i].bytes, bytes);
    assert_int_equal(t->extent.ranges[i].slot_offset, slot_offset);
}

/* Returns the bytes of all pages that [first, end) touches. */
static size_t paged(size_t first, size_t end)
{
    return (end + 4095) / 4096 * 4096 - first / 4096 * 4096;
}

static void the_whole_list_is_split_between_runs(void **state)
{
    plan_test t;
    size_t next = 0;
    (void)state;
    start(&t, false, 3 * 4096, 1);
    select_all(&t, 0);
    begin(&t);
    while (trip_planner_fill(&t.planner, &t.extent)) {
        size_t first = next * RUN_BYTES, n = 0;
        while (next + n < RUNS && paged(first, first + (n + 1) * RUN_BYTES) <= 3 * 4096)
            n++;
        assert_int_equal(t.extent.run_count, n);
        assert_int_equal(t.extent.records, n * RUN_RECORDS);
        assert_int_equal(t.extent.range_count, 1);
        expect_range(&t, 0, first / 4096 * 4096, paged(first, first + n * RUN_BYTES), 0);
        for (size_t i = 0; i < n; i++)
            assert_int_equal(t.runs[i].at[0], first % 4096 + i * RUN_BYTES);
        next += n;
    }
    assert_int_equal(next, RUNS);
    finish(&t);
}

static void planes_are_contiguous_in_a_slot(void **state)
{
    plan_test t;
    (void)state;
    start(&t, false, 1 << 20, 3);
    select_all(&t, 0);
    begin(&t);
    assert_true(trip_planner_fill(&t.planner, &t.extent));
    assert_int_equal(t.extent.run_count, RUNS);
    assert_int_equal(t.extent.range_count, 2);
    size_t voxels = paged(0, RUNS * RUN_BYTES);
    expect_range(&t, 0, 0, voxels, 0);
    expect_range(&t, 1, 0, RUNS * 4 * RUN_RECORDS, voxels);
    assert_int_equal(t.extent.plane_at[1], voxels);
    assert_int_equal(t.extent.plane_bytes[0], voxels);
    assert_int_equal(t.extent.plane_bytes[1], RUNS * 4 * RUN_RECORDS);
    for (size_t i = 0; i < RUNS; i++) {
        assert_int_equal(t.runs[i].at[0], i * RUN_BYTES);
        assert_int_equal(t.runs[i].at[1], i * 4 * RUN_RECORDS);
    }
    finish(&t);
}

static void large_gaps_separate_pieces_and_small_gaps_do_not(void **state)
{
    plan_test t;
    (void)state;
    start(&t, false, 1 << 16, 1);
    trip_selection_add(&t.s[0], 1); /* starts at byte 568 of a sheet of 9088 bytes */
    trip_selection_add(&t.s[0], 6); /* starts at byte 3408, after a gap of 2272 */
    /* The runs of the second sheet start at 9656, after a gap of 5680, and at 12496. */
    t.s[0].sheet_last = 1;
    begin(&t);
    assert_true(trip_planner_fill(&t.planner, &t.extent));
    assert_int_equal(t.extent.range_count, 2);
    expect_range(&t, 0, 0, 4096, 0);
    expect_range(&t, 1, 8192, 8192, 4096);
    assert_int_equal(t.extent.run_count, 4);
    const size_t at[] = { 568, 3408, 4096 + 9656 - 8192, 4096 + 12496 - 8192 };
    for (int i = 0; i < 4; i++)
        assert_int_equal(t.runs[i].at[0], at[i]);
    assert_false(trip_planner_fill(&t.planner, &t.extent));
    finish(&t);
}

static void a_descending_pass_orders_pieces_from_the_end_of_the_file(void **state)
{
    plan_test t;
    (void)state;
    start(&t, true, 1 << 16, 1);
    trip_selection_add(&t.s[0], 1);
    trip_selection_add(&t.s[0], 15);
    /* The runs start at bytes 17608, 9656, 8520 and 568. The middle two are close. */
    t.s[0].sheet_last = 1;
    begin(&t);
    assert_true(trip_planner_fill(&t.planner, &t.extent));
    assert_int_equal(t.extent.range_count, 3);
    expect_range(&t, 0, 16384, 4096, 0);
    expect_range(&t, 1, 8192, 4096, 4096);
    expect_range(&t, 2, 0, 4096, 8192);
    const size_t at[] = { 17608 - 16384, 4096 + 9656 - 8192, 4096 + 8520 - 8192, 8192 + 568 };
    for (int i = 0; i < 4; i++)
        assert_int_equal(t.runs[i].at[0], at[i]);
    finish(&t);
}

static void a_descending_pass_takes_the_whole_list_backwards(void **state)
{
    plan_test t;
    (void)state;
    start(&t, true, 8192, 1);
    select_all(&t, 0);
    begin(&t);
    uint64_t records = 0;
    while (trip_planner_fill(&t.planner, &t.extent)) {
        for (size_t i = 0; i + 1 < t.extent.run_count; i++)
            assert_int_equal(t.runs[i + 1].at[0] + RUN_BYTES, t.runs[i].at[0]);
        assert_int_equal(t.runs[0].first, t.f.count - records - RUN_RECORDS);
        records += t.extent.records;
    }
    assert_int_equal(records, t.f.count);
    finish(&t);
}

/* Eight sheets of X and of Y alternate, then the other sheets of Y follow. */
static void alternating_lists_have_separate_pieces(void **state)
{
    plan_test t;
    (void)state;
    start(&t, false, 1 << 20, 1);
    select_all(&t, 0);
    select_all(&t, 1);
    t.pass = (trip_pass){ t.s, 2, false, NULL };
    begin(&t);
    assert_true(trip_planner_fill(&t.planner, &t.extent));
    assert_int_equal(t.extent.range_count, 2);
    assert_ptr_equal(t.extent.ranges[0].list, &t.d->lists[0]);
    assert_ptr_equal(t.extent.ranges[1].list, &t.d->lists[1]);
    expect_range(&t, 0, 0, paged(0, RUNS * RUN_BYTES), 0);
    uint64_t seen[2] = { 0 };
    for (size_t i = 0; i < t.extent.run_count; i++) {
        unsigned s = t.runs[i].selection;
        assert_int_equal(t.runs[i].at[0] - t.extent.ranges[s].slot_offset, 8 * seen[s]);
        seen[s] += t.runs[i].words;
    }
    assert_int_equal(seen[0], RUNS * RUN_BYTES / 8);
    finish(&t);
}

static void a_full_table_of_runs_ends_the_extent(void **state)
{
    plan_test t;
    size_t runs = 0;
    (void)state;
    start(&t, false, 1 << 20, 1);
    select_all(&t, 0);
    t.extent.run_room = 5;
    begin(&t);
    while (trip_planner_fill(&t.planner, &t.extent)) {
        assert_true(t.extent.run_count <= 5);
        runs += t.extent.run_count;
    }
    assert_int_equal(runs, RUNS);
    finish(&t);
}

/* A block of 568 bytes and 1024 bytes of normals may each cross into a second page. */
static void the_minimum_slot_holds_the_largest_run(void **state)
{
    plan_test t;
    (void)state;
    start(&t, false, 1 << 20, 1);
    assert_int_equal(trip_planner_min_slot(t.d, 1), 2 * 4096);
    assert_int_equal(trip_planner_min_slot(t.d, 3), 4 * 4096);
    finish(&t);
}

/* For 64 x 64 records, a block with one-byte codes has 577 words. A block of means has two-byte
 * codes and 1121 words. */
static void the_minimum_slot_holds_a_run_of_any_kind(void **state)
{
    plan_test t = { 0 };
    (void)state;
    fixture_make(&t.f, &(fixture_params){ .code_bytes = 1, .page_bytes = 4096, .in_memory = true });
    assert_int_equal(trip_dataset_open(&t.d, t.f.path, t.f.budget), TRIP_OK);
    assert_int_equal(trip_planner_min_slot(t.d, 1), (2 + 1) * 4096);
    t.d->lists[2].kind = TRIP_KIND_MEANS;
    assert_int_equal(trip_planner_min_slot(t.d, 1), (3 + 1) * 4096);
    trip_dataset_close(t.d);
    fixture_free(&t.f);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_whole_list_is_split_between_runs),
        cmocka_unit_test(planes_are_contiguous_in_a_slot),
        cmocka_unit_test(large_gaps_separate_pieces_and_small_gaps_do_not),
        cmocka_unit_test(a_descending_pass_orders_pieces_from_the_end_of_the_file),
        cmocka_unit_test(a_descending_pass_takes_the_whole_list_backwards),
        cmocka_unit_test(alternating_lists_have_separate_pieces),
        cmocka_unit_test(a_full_table_of_runs_ends_the_extent),
        cmocka_unit_test(the_minimum_slot_holds_the_largest_run),
        cmocka_unit_test(the_minimum_slot_holds_a_run_of_any_kind),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
