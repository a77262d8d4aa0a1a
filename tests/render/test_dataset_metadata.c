#include "test.h"

#include <string.h>

#include "framing.h"

/* Returns a data set of 10 x 20 x 40 voxels without splats and with the given metadata text. */
static trip_dataset with_text(char *text)
{
    static char path[] = "a.trip";
    trip_dataset d = { .path = path, .index_to_world = trip_affine_identity(), .text = text };
    d.header.dims[0] = 10;
    d.header.dims[1] = 20;
    d.header.dims[2] = 40;
    d.header.code_hi = 100;
    return d;
}

static trip_dataset_metadata *parse(trip_dataset *d)
{
    trip_dataset_metadata *t;
    assert_int_equal(trip_dataset_metadata_parse(&t, d), 0);
    return t;
}

/* Returns the direction from the centre to the eye in the default view, and the view's up vector.
 */
static trip_vec3 view_from(char *text, trip_vec3 *up)
{
    trip_dataset d = with_text(text);
    trip_dataset_metadata *t = parse(&d);
    const trip_view_object o = trip_view_object_of(&d, t);
    trip_dataset_metadata_destroy(t);
    trip_found_view v;
    assert_int_equal(trip_view_find(&v, &(trip_view_settings){ .width = 100, .height = 100 }, &o),
                     0);
    *up = v.params.up;
    return trip_normalize(trip_sub(v.params.eye, v.params.look));
}

static void text_without_an_object_is_refused(void **state)
{
    (void)state;
    char *const bad[] = { "", "[]", "{", "7", "null" };
    for (int i = 0; i < 5; i++) {
        trip_dataset d = with_text(bad[i]);
        trip_dataset_metadata *t;
        test_catch_reports();
        assert_int_equal(trip_dataset_metadata_parse(&t, &d), TRIP_ERROR);
        assert_one_report("its metadata is not a JSON object");
        assert_null(t);
    }
}

static void keys_of_another_kind_are_taken_as_missing(void **state)
{
    (void)state;
    trip_dataset d = with_text("{\"transfer_function\": 3, \"envelope\": {}, \"histogram\": [],"
                               " \"up\": [1], \"front\": \"left\", \"format\": null}");
    trip_dataset_metadata *t = parse(&d);
    trip_tf *tf;
    double range[2];
    assert_int_equal(trip_dataset_metadata_tf(t, &d, &tf), 0);
    assert_true(trip_tf_evaluate(tf, 100).opacity > 0);
    assert_close(trip_dataset_metadata_culled(t, tf, range), 0, 0);
    trip_vec3 up, front;
    trip_dataset_metadata_orient(t, &d, &up, &front);
    assert_close(up.z, 1, 0);
    trip_tf_destroy(tf);
    trip_dataset_metadata_destroy(t);
}

static void the_stored_transfer_function_is_drawn(void **state)
{
    (void)state;
    trip_dataset d = with_text("{\"transfer_function\": \"0 0 0 0 0\\n100 1 0.5 0.25 0.8\\n\"}");
    trip_dataset_metadata *t = parse(&d);
    trip_tf *tf;
    assert_int_equal(trip_dataset_metadata_tf(t, &d, &tf), 0);
    assert_close(trip_tf_evaluate(tf, 50).opacity, 0.4, 1e-12);
    trip_tf_destroy(tf);
    trip_dataset_metadata_destroy(t);
}

static void each_kind_of_data_is_shown_the_right_way_up(void **state)
{
    (void)state;
    trip_vec3 up, d = view_from("{}", &up);
    assert_true(up.z == 1 && -d.y > d.x && d.x > 0 && d.z > 0);
    d = view_from("{\"format\": \"openvdb\"}", &up);
    assert_true(up.y == 1 && d.z > d.x && d.x > 0 && d.y > 0);
    d = view_from("{\"format\": \"nifti\"}", &up);
    assert_true(up.z == 1 && d.y > -d.x && d.x < 0 && d.z > 0);
    d = view_from("{\"up\": \"-x\", \"front\": \"+z\"}", &up);
    assert_true(up.x == -1 && d.z > 0.5 && d.x < 0);
}

/* By the right-hand rule, up x (direction towards the eye) points to the right of the picture. */
static void patients_are_seen_from_the_front_with_their_right_on_the_left(void **state)
{
    (void)state;
    static const struct {
        char *text;
        double anterior, left; /* along y and x */
    } spaces[] = {
        { "{\"space\": \"LPS\", \"format\": \"images\"}", -1, 1 },
        { "{\"space\": \"LPS\", \"format\": \"nifti\"}", -1, 1 },
        { "{\"space\": \"RAS\", \"format\": \"nrrd\"}", 1, -1 },
    };
    for (int i = 0; i < 3; i++) {
        trip_vec3 up, d = view_from(spaces[i].text, &up);
        trip_vec3 right = trip_cross(up, d);
        assert_true(up.z == 1 && up.x == 0 && up.y == 0);
        assert_true(d.y * spaces[i].anterior > fabs(d.x) && d.z > 0);
        assert_true(right.x * spaces[i].left > 0.5);
    }
}

static void an_invalid_space_counts_as_not_given(void **state)
{
    (void)state;
    char *const texts[] = { "{\"space\": \"LAS\"}", "{\"space\": \"\"}", "{\"space\": 7}",
                            "{\"space\": \"RASRASRASRASRASRAS\"}", "{\"oriented\": \"yes\"}" };
    for (int i = 0; i < 5; i++) {
        trip_vec3 up, d = view_from(texts[i], &up), expected = view_from("{}", &up);
        assert_true(d.x == expected.x && d.y == expected.y && d.z == expected.z);
    }
}

static void thick_slices_of_a_known_orientation_are_not_turned_over(void **state)
{
    (void)state;
    char *const texts[] = { "{\"space\": \"LPS\"}", "{\"space\": \"RAS\"}",
                            "{\"format\": \"nrrd\", \"oriented\": true}" };
    for (int i = 0; i < 3; i++) {
        trip_dataset d = with_text(texts[i]);
        trip_dataset_metadata *t = parse(&d);
        trip_vec3 up, front;
        d.index_to_world.m[2][2] = 5;
        trip_dataset_metadata_orient(t, &d, &up, &front);
        assert_close(up.z, 1, 0);
        trip_dataset_metadata_destroy(t);
    }
}

static void thick_slices_without_an_orientation_are_a_scan_from_above(void **state)
{
    (void)state;
    trip_dataset d = with_text("{\"format\": \"nrrd\"}");
    trip_dataset_metadata *t = parse(&d);
    trip_vec3 up, front;
    d.index_to_world.m[2][2] = 2;
    trip_dataset_metadata_orient(t, &d, &up, &front);
    assert_close(up.z, -1, 0);
    d.index_to_world.m[2][3] = -300; /* an origin: the file gives the position */
    trip_dataset_metadata_orient(t, &d, &up, &front);
    assert_close(up.z, 1, 0);
    trip_dataset_metadata_destroy(t);
}

static void assert_same_view(char *own_text, char *other_text)
{
    trip_vec3 own_up, other_up;
    trip_vec3 own = view_from(own_text, &own_up), other = view_from(other_text, &other_up);
    assert_true(trip_length(trip_sub(own, other)) == 0);
    assert_true(trip_length(trip_sub(own_up, other_up)) == 0);
}

static void slices_with_mirrored_sides_are_views_from_the_side(void **state)
{
    (void)state;
    trip_vec3 up, d = view_from("{\"mirror\": \"z\"}", &up);
    assert_true(up.y == -1 && -d.x > fabs(d.z) && d.y < 0);
    d = view_from("{\"mirror\": \"z\", \"format\": \"nrrd\", \"front\": \"+z\"}", &up);
    assert_true(up.y == -1 && d.z > fabs(d.x));
    char *const others[][2] = {
        { "{\"mirror\": \"z\", \"space\": \"LPS\"}", "{\"space\": \"LPS\"}" },
        { "{\"mirror\": \"z\", \"oriented\": true}", "{\"oriented\": true}" },
        { "{\"mirror\": \"z\", \"format\": \"openvdb\"}", "{\"format\": \"openvdb\"}" },
        { "{\"mirror\": \"z\", \"format\": \"nifti\"}", "{\"format\": \"nifti\"}" },
        { "{\"mirror\": \"z\", \"up\": \"+x\"}", "{\"up\": \"+x\"}" },
        { "{\"mirror\": \"x\"}", "{}" },
        { "{\"mirror\": \"y\"}", "{}" },
        { "{\"mirror\": \"zz\"}", "{}" },
        { "{\"mirror\": 2}", "{}" },
    };
    for (size_t i = 0; i < sizeof others / sizeof *others; i++)
        assert_same_view(others[i][0], others[i][1]);
}

static void the_side_opposite_the_bottom_is_up(void **state)
{
    (void)state;
    trip_vec3 up;
    view_from("{\"footing\": \"-y\"}", &up);
    assert_true(up.x == 0 && up.y == 1 && up.z == 0);
    view_from("{\"footing\": \"+x\"}", &up);
    assert_true(up.x == -1 && up.y == 0 && up.z == 0);
    /* The given orientation, the format's convention and slices seen from the side take
     * precedence. */
    char *const others[][2] = {
        { "{\"footing\": \"-x\", \"mirror\": \"z\"}", "{\"mirror\": \"z\"}" },
        { "{\"footing\": \"-x\", \"space\": \"RAS\"}", "{\"space\": \"RAS\"}" },
        { "{\"footing\": \"-x\", \"oriented\": true}", "{\"oriented\": true}" },
        { "{\"footing\": \"-x\", \"format\": \"openvdb\"}", "{\"format\": \"openvdb\"}" },
        { "{\"footing\": \"-x\", \"up\": \"+y\"}", "{\"up\": \"+y\"}" },
        { "{\"footing\": \"below\"}", "{}" },
        { "{\"footing\": -1}", "{}" },
    };
    for (size_t i = 0; i < sizeof others / sizeof *others; i++)
        assert_same_view(others[i][0], others[i][1]);
}

static void voxels_shown_but_left_out_are_counted_from_the_histogram(void **state)
{
    (void)state;
    trip_dataset d =
        with_text("{\"envelope\": [[20, 30], [60, 100]], \"histogram\": {\"value_min\": 0,"
                  " \"value_max\": 100, \"counts\": [1000, 100, 10, 70, 50, 40, 30, 20, 10, 5]}}");
    trip_dataset_metadata *t = parse(&d);
    const trip_rgba none = { 0 }, some = { 1, 1, 1, 0.5 };
    /* The transfer function shows 35 to 55, and everything from 60. It covers the half bin up to
     * 40, one whole bin, and the half bin up to 55. */
    const trip_tf_point points[] = { { 35, none }, { 35, some }, { 55, some },
                                     { 55, none }, { 60, none }, { 60, some } };
    trip_tf *tf;
    double range[2];
    assert_int_equal(trip_tf_from_points(&tf, points, 6, false, 0), 0);
    assert_close(trip_dataset_metadata_culled(t, tf, range), 35 + 50 + 20, 1e-9);
    assert_close(range[0], 30, 1e-9);
    assert_close(range[1], 60, 1e-9);
    trip_tf_destroy(tf);

    const trip_tf_point kept[] = { { 20, none }, { 20, some }, { 30, some }, { 30, none } };
    assert_int_equal(trip_tf_from_points(&tf, kept, 4, false, 0), 0);
    assert_close(trip_dataset_metadata_culled(t, tf, range), 0, 0);
    trip_tf_destroy(tf);
    trip_dataset_metadata_destroy(t);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(text_without_an_object_is_refused),
        cmocka_unit_test(keys_of_another_kind_are_taken_as_missing),
        cmocka_unit_test(the_stored_transfer_function_is_drawn),
        cmocka_unit_test(each_kind_of_data_is_shown_the_right_way_up),
        cmocka_unit_test(patients_are_seen_from_the_front_with_their_right_on_the_left),
        cmocka_unit_test(an_invalid_space_counts_as_not_given),
        cmocka_unit_test(thick_slices_of_a_known_orientation_are_not_turned_over),
        cmocka_unit_test(thick_slices_without_an_orientation_are_a_scan_from_above),
        cmocka_unit_test(slices_with_mirrored_sides_are_views_from_the_side),
        cmocka_unit_test(the_side_opposite_the_bottom_is_up),
        cmocka_unit_test(voxels_shown_but_left_out_are_counted_from_the_histogram),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
