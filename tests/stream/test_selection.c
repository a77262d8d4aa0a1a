/* Tests of passes over several lists. Runs come in order of list coordinate, whatever the steps of
 * the lists, and in reverse order in a descending pass. The reader returns the same order with the
 * records of each list. */
#include "fixture.h"

#include "selection.h"

enum { RUNS_MAX = 4096 };

/* Combines the X lists of two data sets as level 0 and level 1. Level 1 has half the size. */
typedef struct two_levels {
    fixture f[2];
    trip_dataset *d[2];
    trip_dataset both;
    trip_list lists[2];
    trip_selection s[2];
} two_levels;

static void make(two_levels *t, double sheet_first)
{
    *t = (two_levels){ 0 };
    for (int i = 0; i < 2; i++) {
        fixture_make(&t->f[i], &(fixture_params){ .dims = { 40 >> i, 50 >> i, 60 >> i },
                                                  .seed = (unsigned)i + 1,
                                                  .tile_voxels = 16,
                                                  .slab_sheets = 3,
                                                  .page_bytes = 4096,
                                                  .normals = true,
                                                  .in_memory = true });
        assert_int_equal(trip_dataset_open(&t->d[i], t->f[i].path, t->f[i].budget), TRIP_OK);
        t->lists[i] = t->d[i]->lists[0];
        t->lists[i].index = (unsigned)i;
        t->lists[i].level = (unsigned)i;
    }
    t->lists[1].sheet_first = sheet_first;
    t->lists[1].sheet_step = 2;
    t->both = *t->d[0];
    t->both.lists = t->lists;
    t->both.list_count = 2;
}

static void select_both(two_levels *t, bool descending)
{
    for (int i = 0; i < 2; i++)
        assert_int_equal(trip_selection_create_whole(&t->s[i], &t->both, &t->lists[i], descending,
                                                     t->f[0].budget),
                         TRIP_OK);
}

static void unselect(two_levels *t)
{
    for (int i = 0; i < 2; i++)
        trip_selection_destroy(&t->s[i], t->f[0].budget);
}

static void release(two_levels *t)
{
    for (int i = 0; i < 2; i++) {
        trip_dataset_close(t->d[i]);
        fixture_free(&t->f[i]);
    }
}

static size_t runs_of(two_levels *t, bool descending, trip_run *runs)
{
    trip_pass_cursor cursors[2];
    size_t n = 0;
    select_both(t, descending);
    const trip_pass pass = { t->s, 2, descending, NULL };
    trip_pass_iterator it = trip_pass_begin(&pass, cursors);
    while (n < RUNS_MAX && trip_pass_next(&it, &runs[n]))
        n++;
    assert_true(n < RUNS_MAX);
    unselect(t);
    return n;
}

static bool same_run(const trip_run *a, const trip_run *b)
{
    return a->first == b->first && a->count == b->count && a->brick == b->brick &&
           a->sheet == b->sheet && a->u == b->u && a->v == b->v;
}

/* Checks that the runs of each selection equal the runs of an iterator over that selection alone.
 */
static void check_each(two_levels *t, const trip_run *runs, size_t count)
{
    select_both(t, false);
    for (unsigned i = 0; i < 2; i++) {
        trip_run_iterator it = trip_run_begin(&t->s[i]);
        trip_run run;
        for (size_t n = 0; n < count; n++)
            if (runs[n].selection == i)
                assert_true(trip_run_next(&it, &run) && same_run(&run, &runs[n]));
        assert_false(trip_run_next(&it, &run));
    }
    unselect(t);
}

static void check_order(const trip_run *runs, size_t count, double sheet_first)
{
    size_t changes = 0;
    for (size_t n = 1; n < count; n++) {
        const trip_run *a = &runs[n - 1], *b = &runs[n];
        double at_a = a->selection ? sheet_first + 2.0 * a->sheet : a->sheet;
        double at_b = b->selection ? sheet_first + 2.0 * b->sheet : b->sheet;
        assert_true(at_a < at_b || (at_a == at_b && a->selection <= b->selection));
        changes += a->selection != b->selection;
    }
    assert_true(changes > 20); /* the levels interleave */
}

static void levels_are_merged_by_list_coordinate(void **state)
{
    const double firsts[] = { 0.5, 0, 1, -7.25 }; /* between sheets, at sheets, and half outside */
    static trip_run up[RUNS_MAX], down[RUNS_MAX];
    (void)state;
    for (int i = 0; i < 4; i++) {
        two_levels t;
        make(&t, firsts[i]);
        size_t count = runs_of(&t, false, up);
        check_each(&t, up, count);
        check_order(up, count, firsts[i]);
        assert_int_equal(runs_of(&t, true, down), count);
        for (size_t n = 0; n < count; n++) {
            assert_true(same_run(&up[n], &down[count - 1 - n]));
            assert_int_equal(up[n].selection, down[count - 1 - n].selection);
        }
        release(&t);
    }
}

/* Compares the voxels of a batch with the next voxels of each level in draw order, and advances
 * `taken`. */
static void check_batch(const two_levels *t, const trip_batch *b, size_t taken[2])
{
    static uint32_t voxels[TRIP_RUN_RECORDS_MAX], normals[TRIP_RUN_RECORDS_MAX];
    for (size_t i = 0; i < b->run_count; i++) {
        const trip_run *run = &b->runs[i];
        const fixture *f = &t->f[run->selection];
        fixture_decode_run(b, run, voxels, normals);
        assert_ptr_equal(trip_batch_list(b, run), &t->lists[run->selection]);
        for (uint32_t k = 0; k < run->count; k++) {
            bool down = b->pass->descending;
            size_t n = taken[run->selection]++;
            const fixture_voxel *x = &f->lists[0][down ? f->count - 1 - n : n];
            uint32_t at = down ? run->count - 1 - k : k;
            assert_int_equal(trip_voxel_code(voxels[at]), x->code);
            assert_int_equal(normals[at], x->normal);
            assert_int_equal(run->sheet, x->p[0]);
            assert_int_equal((uint32_t)run->u + trip_voxel_u(voxels[at]), x->p[1]);
            assert_int_equal((uint32_t)run->v + trip_voxel_v(voxels[at]), x->p[2]);
        }
    }
}

/* Checks that the reader returns complete runs in the order of the iterator. */
static void check_reader(two_levels *t, const trip_reader_params *params, bool descending)
{
    static trip_run runs[RUNS_MAX];
    size_t count = runs_of(t, descending, runs), at = 0, taken[2] = { 0 };
    trip_reader *r;
    trip_batch b;
    int status;
    assert_int_equal(trip_reader_create(&r, &t->both, params, t->f[0].budget), TRIP_OK);
    select_both(t, descending);
    const trip_pass pass = { t->s, 2, descending, NULL };
    assert_int_equal(trip_reader_begin(r, &pass), TRIP_OK);
    while ((status = trip_reader_next(r, &b)) == 1) {
        check_batch(t, &b, taken);
        for (size_t i = 0; i < b.run_count; i++) {
            assert_true(at < count && runs[at].brick == b.runs[i].brick);
            assert_int_equal(runs[at].selection, b.runs[i].selection);
            assert_int_equal(runs[at++].count, b.runs[i].count);
        }
        trip_reader_release(r, &b);
    }
    assert_int_equal(status, 0);
    assert_int_equal(at, count);
    trip_reader_destroy(r);
    unselect(t);
}

static void a_reader_returns_merged_lists_in_order(void **state)
{
    const trip_reader_params params[] = {
        { .planes = 3 },
        { .planes = 3, .slots = 2, .slot_bytes = 4096 },
        { .planes = 3, .cache_bytes = 1 << 20 },
        { .planes = 3, .engine = TRIP_ENGINE_NULL },
    };
    two_levels t;
    (void)state;
    make(&t, 0.5);
    for (int i = 0; i < 4; i++)
        for (int descending = 0; descending < 2; descending++)
            check_reader(&t, &params[i], descending);
    release(&t);
}

static void more_selections_than_lists_are_refused(void **state)
{
    two_levels t;
    trip_reader *r;
    (void)state;
    make(&t, 0.5);
    select_both(&t, false);
    const trip_selection three[3] = { t.s[0], t.s[1], t.s[0] };
    const trip_pass pass = { three, 3, false, NULL };
    assert_int_equal(trip_reader_create(&r, &t.both, &(trip_reader_params){ 0 }, t.f[0].budget), 0);
    fixture_catch_reports();
    assert_int_equal(trip_reader_begin(r, &pass), TRIP_ERROR);
    assert_non_null(strstr(fixture_reports(), "3 selections"));
    trip_reader_destroy(r);
    unselect(&t);
    release(&t);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(levels_are_merged_by_list_coordinate),
        cmocka_unit_test(a_reader_returns_merged_lists_in_order),
        cmocka_unit_test(more_selections_than_lists_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
