#include "test.h"

#include <unistd.h>

#include "tf_editor.h"

#define RAMP "unit 0.5\n-1 0 0 0 0\n1 1 0.5 0 0.8\n"

static trip_tf_editor *edit(const char *text)
{
    trip_tf_editor *e = trip_tf_editor_create();
    assert_non_null(e);
    assert_int_equal(trip_tf_editor_set_text(e, "test", text), 0);
    return e;
}

static trip_tf_point point_of(const trip_tf_editor *e, size_t i)
{
    size_t count;
    const trip_tf_point *points = trip_tf_editor_points(e, &count);
    assert_true(i < count);
    return points[i];
}

static size_t count_of(const trip_tf_editor *e)
{
    size_t count;
    trip_tf_editor_points(e, &count);
    return count;
}

static void assert_text(const trip_tf_editor *e, const char *expected)
{
    char *text = trip_tf_editor_text(e);
    assert_string_equal(text, expected);
    free(text);
}

static void a_new_point_has_the_interpolated_colour(void **state)
{
    (void)state;
    trip_tf_editor *e = edit(RAMP);
    assert_int_equal(trip_tf_editor_add(e, 0.5, 0.1), 1);
    trip_tf_point p = point_of(e, 1);
    assert_close(p.value, 0.5, 0);
    assert_close(p.colour.r, 0.75, 1e-15);
    assert_close(p.colour.g, 0.375, 1e-15);
    assert_close(p.colour.opacity, 0.1, 0);
    assert_int_equal(trip_tf_editor_add(e, 7, 2), 3);
    assert_close(point_of(e, 3).colour.opacity, 1, 0);
    assert_int_equal(trip_tf_editor_add(e, NAN, 0), -1);
    assert_int_equal(count_of(e), 4);
    trip_tf_editor_destroy(e);
}

static void points_stay_between_their_neighbours(void **state)
{
    (void)state;
    trip_tf_editor *e = edit("0 0 0 0 0\n1 1 1 1 0.5\n2 0 0 0 0\n");
    trip_tf_editor_move(e, 1, 9, -3);
    assert_close(point_of(e, 1).value, 2, 0);
    assert_close(point_of(e, 1).colour.opacity, 0, 0);
    trip_tf_editor_move(e, 2, -5, 0.25);
    assert_close(point_of(e, 2).value, 2, 0);
    assert_close(point_of(e, 2).colour.opacity, 0.25, 0);
    trip_tf_editor_move(e, 0, -5, 0.25);
    assert_close(point_of(e, 0).value, -5, 0);
    uint64_t revision = trip_tf_editor_revision(e);
    trip_tf_editor_move(e, 3, 0, 0);
    trip_tf_editor_move(e, -1, 0, 0);
    assert_int_equal(trip_tf_editor_revision(e), revision);
    trip_tf_editor_destroy(e);
}

static void colours_are_clamped(void **state)
{
    (void)state;
    trip_tf_editor *e = edit(RAMP);
    trip_tf_editor_set_colour(e, 1, 0.25, -1, 3);
    assert_text(e, "unit 0.5\nvalues data\n-1 0 0 0 0\n1 0.25 0 1 0.8\n");
    trip_tf_editor_destroy(e);
}

static void the_last_point_cannot_be_removed(void **state)
{
    (void)state;
    trip_tf_editor *e = edit(RAMP);
    trip_tf_editor_remove(e, 0);
    assert_text(e, "unit 0.5\nvalues data\n1 1 0.5 0 0.8\n");
    trip_tf_editor_remove(e, 0);
    assert_int_equal(count_of(e), 1);
    trip_tf_editor_destroy(e);
}

static void values_are_stretched_together(void **state)
{
    (void)state;
    trip_tf_editor *e = edit(RAMP);
    trip_tf_editor_stretch(e, 0, 3, 10);
    assert_close(point_of(e, 0).value, 7, 0);
    assert_close(point_of(e, 1).value, 13, 0);
    trip_tf_editor_stretch(e, 0, 1e308, 0);
    trip_tf_editor_stretch(e, 0, -1, 0);
    assert_close(point_of(e, 1).value, 13, 0);
    trip_tf_editor_destroy(e);
}

static void each_change_can_be_undone_and_redone(void **state)
{
    (void)state;
    trip_tf_editor *e = edit(RAMP);
    trip_tf_editor_add(e, 0, 0.3);
    trip_tf_editor_remove(e, 0);
    char *after = trip_tf_editor_text(e);
    uint64_t revision = trip_tf_editor_revision(e);
    trip_tf_editor_undo(e);
    assert_int_equal(count_of(e), 3);
    assert_true(trip_tf_editor_revision(e) > revision);
    trip_tf_editor_undo(e);
    assert_text(e, "unit 0.5\nvalues data\n-1 0 0 0 0\n1 1 0.5 0 0.8\n");
    trip_tf_editor_undo(e); /* undoes the text of edit() */
    assert_false(trip_tf_editor_can_undo(e));
    for (int i = 0; i < 3; i++)
        trip_tf_editor_redo(e);
    assert_false(trip_tf_editor_can_redo(e));
    assert_text(e, after);
    /* A change after an undo discards the undone steps. */
    trip_tf_editor_undo(e);
    trip_tf_editor_set_colour(e, 0, 1, 1, 1);
    assert_false(trip_tf_editor_can_redo(e));
    free(after);
    trip_tf_editor_destroy(e);
}

static void a_drag_is_undone_in_one_step(void **state)
{
    (void)state;
    trip_tf_editor *e = edit(RAMP);
    trip_tf_editor_begin(e);
    for (int i = 0; i <= 1000; i++)
        trip_tf_editor_move(e, 1, 1 + i, 0.5);
    trip_tf_editor_end(e);
    assert_close(point_of(e, 1).value, 1001, 0);
    trip_tf_editor_undo(e);
    assert_close(point_of(e, 1).value, 1, 0);
    /* A drag without movement adds no step. */
    trip_tf_editor_begin(e);
    trip_tf_editor_end(e);
    trip_tf_editor_undo(e);
    assert_int_equal(count_of(e), 1);
    trip_tf_editor_destroy(e);
}

static void a_limited_number_of_steps_can_be_undone(void **state)
{
    (void)state;
    trip_tf_editor *e = edit(RAMP);
    enum { CHANGES = 3 * TRIP_TF_EDITOR_STEPS };
    int undone = 0;
    for (int i = 1; i <= CHANGES; i++)
        trip_tf_editor_move(e, 1, 1 + i, 0.5);
    for (; trip_tf_editor_can_undo(e); undone++)
        trip_tf_editor_undo(e);
    assert_int_equal(undone, TRIP_TF_EDITOR_STEPS);
    assert_close(point_of(e, 1).value, 1 + CHANGES - TRIP_TF_EDITOR_STEPS, 0);
    for (int i = 0; i < undone; i++)
        trip_tf_editor_redo(e);
    assert_close(point_of(e, 1).value, 1 + CHANGES, 0);
    trip_tf_editor_destroy(e);
}

static void the_nearest_point_in_reach_is_found(void **state)
{
    (void)state;
    trip_tf_editor *e = edit(RAMP);
    assert_int_equal(trip_tf_editor_find(e, 0.95, 0.78, 0.1, 0.1), 1);
    assert_int_equal(trip_tf_editor_find(e, -1, 0.09, 0.1, 0.1), 0);
    assert_int_equal(trip_tf_editor_find(e, -1, 0.11, 0.1, 0.1), -1);
    trip_tf_editor_destroy(e);
}

static void bad_text_changes_nothing(void **state)
{
    (void)state;
    static const char *const texts[] = { "", "0 0 0 0\n", "values normalised\n0 0 0 0 0\n",
                                         "0 0 0 0 0\n-1 0 0 0 0\n", "nan 0 0 0 0\n" };
    trip_tf_editor *e = edit(RAMP);
    uint64_t revision = trip_tf_editor_revision(e);
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++) {
        test_catch_reports();
        assert_int_equal(trip_tf_editor_set_text(e, "panel", texts[i]), TRIP_ERROR);
        assert_one_report("panel");
    }
    assert_int_equal(trip_tf_editor_revision(e), revision);
    trip_tf_editor_destroy(e);
}

static void a_saved_transfer_function_can_be_loaded(void **state)
{
    (void)state;
    trip_tf_editor *e = edit(RAMP);
    trip_tf *tf = NULL;
    trip_tf_editor_add(e, 0.1, 1.0 / 3);
    assert_int_equal(trip_tf_editor_save(e, "saved.tf"), 0);
    assert_int_equal(trip_tf_load(&tf, "./saved.tf"), 0);
    char *saved = trip_tf_to_text(tf);
    assert_text(e, saved);
    free(saved);
    trip_tf_destroy(tf);
    unlink("saved.tf");
    test_catch_reports();
    assert_int_equal(trip_tf_editor_save(e, "no/such/folder.tf"), TRIP_ERROR);
    assert_one_report("no/such/folder.tf");
    trip_tf_editor_destroy(e);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_new_point_has_the_interpolated_colour),
        cmocka_unit_test(points_stay_between_their_neighbours),
        cmocka_unit_test(colours_are_clamped),
        cmocka_unit_test(the_last_point_cannot_be_removed),
        cmocka_unit_test(values_are_stretched_together),
        cmocka_unit_test(each_change_can_be_undone_and_redone),
        cmocka_unit_test(a_drag_is_undone_in_one_step),
        cmocka_unit_test(a_limited_number_of_steps_can_be_undone),
        cmocka_unit_test(the_nearest_point_in_reach_is_found),
        cmocka_unit_test(bad_text_changes_nothing),
        cmocka_unit_test(a_saved_transfer_function_can_be_loaded),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
