#include "test.h"

#include "clipping.h"

static const triptych_info info = {
    .first = { 2, 0, 5 },
    .last = { 9, 7, 20 },
    .lo = { -10, -20, 0 },
    .hi = { 10, 20, 40 },
    .index_to_world = { { 2, 0, 0, 1 }, { 0, 3, 0, 0 }, { 0, 0, 1, 0 } },
};

static void the_box_begins_around_all_voxels_and_is_never_empty(void **state)
{
    (void)state;
    triptych_clip c = { 0 };
    trip_clipping_box_of_all(&c, &info, false);
    assert_true(c.box && c.box_of_voxels && c.box_lo[0] == 1.5 && c.box_hi[2] == 20.5);
    trip_clipping_set_face(&c, 1, 0, 100, 0.01);
    assert_true(c.box_lo[1] < c.box_hi[1] && c.box_hi[1] == 7.5);
    trip_clipping_set_face(&c, 1, 1, -100, 0.01);
    assert_true(c.box_lo[1] < c.box_hi[1] && trip_clipping_is_sound(&c));
}

static void the_box_of_a_scene_is_in_world_units_with_room_on_each_side(void **state)
{
    (void)state;
    const triptych_info flat = { .lo = { -1, 2, -4 }, .hi = { 3, 2, -1 } };
    triptych_clip c = { 0 };
    trip_clipping_box_of_all(&c, &flat, true);
    assert_true(c.box && !c.box_of_voxels && trip_clipping_is_sound(&c));
    assert_true(c.box_lo[0] == -2 && c.box_hi[0] == 4);
    assert_true(c.box_lo[2] == -4.75 && c.box_hi[2] == -0.25);
    /* Without extent along y, the box has a quarter of half the diagonal, 5, on each side. */
    assert_true(c.box_lo[1] == 2 - 0.625 && c.box_hi[1] == 2 + 0.625);
}

static void a_new_plane_cuts_in_front_of_the_look_point(void **state)
{
    (void)state;
    const triptych_camera camera = {
        .eye = { 1, -50, 2 }, .look = { 1, 5, 2 }, .up = { 0, 0, 1 }, .fov_degrees = 30
    };
    const trip_navigation n = trip_navigation_from_camera(&camera, NULL);
    triptych_clip c = { 0 };
    for (int i = 0; i < TRIP_CLIPPING_PLANES; i++)
        assert_true(trip_clipping_add_plane(&c, &n));
    assert_false(trip_clipping_add_plane(&c, &n));
    const double *p = c.plane[0];
    assert_close(p[0], 0, 1e-12);
    assert_close(p[1], 1, 1e-12);
    assert_close(p[3], -5, 1e-12);
    /* Half the diagonal is 30, and the centre is at y = 0. */
    assert_close(trip_clipping_depth(&c, 0, &info), 5.0 / 30, 1e-12);
    trip_clipping_set_depth(&c, 0, &info, -0.5);
    assert_close(c.plane[0][3], 15, 1e-12);
    trip_clipping_flip_plane(&c, 0);
    assert_close(trip_clipping_depth(&c, 0, &info), 0.5, 1e-12);
    c.plane[1][3] = 7;
    trip_clipping_remove_plane(&c, 0);
    assert_int_equal(c.planes, TRIP_CLIPPING_PLANES - 1);
    assert_true(c.plane[0][3] == 7);
}

static void a_box_of_voxels_keeps_its_position_in_a_finer_grid(void **state)
{
    (void)state;
    triptych_info fine = info;
    triptych_clip c = {
        .box = 1, .box_of_voxels = 1, .box_lo = { 1, 2, 3 }, .box_hi = { 4, 5, 6 }
    };
    for (int a = 0; a < 3; a++)
        fine.index_to_world[a][a] /= 4;
    trip_clipping_rescale(&c, &info, &fine);
    assert_true(c.box_lo[0] == 4 && c.box_hi[1] == 20 && c.box_hi[2] == 24);
    c.box_of_voxels = 0;
    trip_clipping_rescale(&c, &info, &fine);
    assert_true(c.box_lo[0] == 4);
}

static void opposite_planes_are_not_interpolated(void **state)
{
    (void)state;
    const triptych_clip a = { .planes = 1, .plane = { { 1, 0, 0, 2 } } };
    const triptych_clip b = { .planes = 1, .plane = { { -1, 0, 0, -2 } } };
    const triptych_clip mix = trip_clipping_mix(&a, &b, 0.5);
    assert_true(mix.planes == 1 && mix.plane[0][0] == 1 && trip_clipping_is_sound(&mix));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_box_begins_around_all_voxels_and_is_never_empty),
        cmocka_unit_test(the_box_of_a_scene_is_in_world_units_with_room_on_each_side),
        cmocka_unit_test(a_new_plane_cuts_in_front_of_the_look_point),
        cmocka_unit_test(a_box_of_voxels_keeps_its_position_in_a_finer_grid),
        cmocka_unit_test(opposite_planes_are_not_interpolated),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
