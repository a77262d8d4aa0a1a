/* The planner's packing, on a data set of one dense list: 8 sheets of 16 tiles, each run 1024
 * bytes, pages of 4096 bytes. So run n of a sheet lies at byte 1024 n of its 16384. */
#include "fixture.h"

#include "extent.h"

enum { RUN_BYTES = 1024, SHEET_BYTES = 16 * RUN_BYTES, SHEETS = 8, RUNS_MAX = 64 };

typedef struct plan_test {
    fixture f;
    trip_dataset *d;
    trip_selection s;
    trip_pass pass;
    trip_pass_cursor cursor;
    trip_planner planner;
    trip_run runs[RUNS_MAX];
    trip_extent extent;
} plan_test;

static void start(plan_test *t, bool descending, size_t slot_bytes, size_t gap_bytes)
{
    *t = (plan_test){ 0 };
    fixture_make(&t->f, &(fixture_params){ .dims = { SHEETS, 64, 64 },
                                           .density = 1.1,
                                           .tile_voxels = 16,
                                           .slab_sheets = SHEETS,
                                           .page_bytes = 4096,
                                           .in_memory = true });
    assert_int_equal(trip_dataset_open(&t->d, t->f.path, t->f.budget), TRIP_OK);
    assert_int_equal(
        trip_selection_create(&t->s, t->d, &t->d->lists[0], descending, 0, SHEETS, t->f.budget), 0);
    t->planner =
        (trip_planner){ .page_bytes = 4096, .slot_bytes = slot_bytes, .gap_bytes = gap_bytes };
    t->pass = trip_pass_of(&t->s);
    t->extent.runs = t->runs;
    t->extent.run_room = RUNS_MAX;
}

static void finish(plan_test *t)
{
    trip_selection_destroy(&t->s, t->f.budget);
    trip_dataset_close(t->d);
    fixture_free(&t->f);
}

static void expect_segment(const plan_test *t, unsigned i, uint64_t offset, size_t bytes,
                           size_t slot_offset)
{
    assert_true(i < t->extent.segment_count);
    assert_int_equal(t->extent.segments[i].offset, offset);
    assert_int_equal(t->extent.segments[i].bytes, bytes);
    assert_int_equal(t->extent.segments[i].slot_offset, slot_offset);
}

static void the_whole_list_is_cut_at_slot_ends(void **state)
{
    plan_test t;
    uint64_t next = 0;
    (void)state;
    start(&t, false, 3 * 4096, 4096);
    for (uint64_t b = 0; b < 16; b++)
        trip_selection_add(&t.s, b);
    trip_planner_begin(&t.planner, &t.pass, &t.cursor);
    while (trip_planner_fill(&t.planner, &t.extent)) {
        assert_int_equal(t.extent.segment_count, 1);
        size_t left = SHEETS * SHEET_BYTES - next;
        expect_segment(&t, 0, next, left < 3 * 4096 ? left : 3 * 4096, 0);
        next += t.extent.bytes;
        assert_int_equal(t.extent.splats * TRIP_RECORD_BYTES, t.extent.bytes);
    }
    assert_int_equal(next, SHEETS * SHEET_BYTES);
    finish(&t);
}

static void large_gaps_part_segments_and_small_ones_do_not(void **state)
{
    plan_test t;
    (void)state;
    start(&t, false, 1 << 16, 4096);
    trip_selection_add(&t.s, 1); /* bytes 1024 to 2048 of each sheet */
    trip_selection_add(&t.s, 6); /* 6144 to 7168, after a gap of 4096 */
    t.s.sheet_last = 1;
    trip_planner_begin(&t.planner, &t.pass, &t.cursor);
    assert_true(trip_planner_fill(&t.planner, &t.extent));
    assert_int_equal(t.extent.segment_count, 2);
    expect_segment(&t, 0, 0, 8192, 0);
    expect_segment(&t, 1, SHEET_BYTES, 8192, 8192);
    assert_int_equal(t.extent.run_count, 4);
    const uint64_t first[] = { 256, 1536, 2048 + 256, 2048 + 1536 };
    for (int i = 0; i < 4; i++)
        assert_int_equal(t.runs[i].first, first[i]);
    assert_false(trip_planner_fill(&t.planner, &t.extent));
    finish(&t);
}

static void a_descending_pass_places_segments_from_the_files_end(void **state)
{
    plan_test t;
    (void)state;
    start(&t, true, 1 << 16, 4096);
    trip_selection_add(&t.s, 1);
    trip_selection_add(&t.s, 7);
    t.s.sheet_last = 1;
    trip_planner_begin(&t.planner, &t.pass, &t.cursor);
    assert_true(trip_planner_fill(&t.planner, &t.extent));
    assert_int_equal(t.extent.segment_count, 4);
    expect_segment(&t, 0, SHEET_BYTES + 4096, 4096, 0);
    expect_segment(&t, 1, SHEET_BYTES, 4096, 4096);
    expect_segment(&t, 2, 4096, 4096, 8192);
    expect_segment(&t, 3, 0, 4096, 12288);
    const uint64_t first[] = { 768, 1024 + 256, 2048 + 768, 3072 + 256 };
    for (int i = 0; i < 4; i++)
        assert_int_equal(t.runs[i].first, first[i]);
    finish(&t);
}

static void a_descending_pass_takes_the_whole_list_backwards(void **state)
{
    plan_test t;
    (void)state;
    start(&t, true, 4096, 4096);
    for (uint64_t b = 0; b < 16; b++)
        trip_selection_add(&t.s, b);
    trip_planner_begin(&t.planner, &t.pass, &t.cursor);
    uint64_t splats = 0;
    while (trip_planner_fill(&t.planner, &t.extent)) {
        for (size_t i = 0; i + 1 < t.extent.run_count; i++)
            assert_int_equal(t.runs[i + 1].first + t.runs[i + 1].count, t.runs[i].first);
        splats += t.extent.splats;
        expect_segment(&t, 0, SHEETS * SHEET_BYTES - splats * TRIP_RECORD_BYTES, 4096, 0);
    }
    assert_int_equal(splats, t.f.count);
    finish(&t);
}

static void a_full_table_of_runs_ends_the_extent(void **state)
{
    plan_test t;
    size_t runs = 0;
    (void)state;
    start(&t, false, 1 << 20, 4096);
    for (uint64_t b = 0; b < 16; b++)
        trip_selection_add(&t.s, b);
    t.extent.run_room = 5;
    trip_planner_begin(&t.planner, &t.pass, &t.cursor);
    while (trip_planner_fill(&t.planner, &t.extent)) {
        assert_true(t.extent.run_count <= 5);
        runs += t.extent.run_count;
    }
    assert_int_equal(runs, 16 * SHEETS);
    finish(&t);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_whole_list_is_cut_at_slot_ends),
        cmocka_unit_test(large_gaps_part_segments_and_small_ones_do_not),
        cmocka_unit_test(a_descending_pass_places_segments_from_the_files_end),
        cmocka_unit_test(a_descending_pass_takes_the_whole_list_backwards),
        cmocka_unit_test(a_full_table_of_runs_ends_the_extent),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
