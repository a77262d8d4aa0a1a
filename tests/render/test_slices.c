/* How many slices views call for, by slopes and sizes worked out by hand. */
#include "slices.h"

#include "test.h"

enum { WIDTH = 64 };

static const uint64_t dims[3] = { 40, 50, 60 };

/* Of a grid whose voxels are `spacing` wide. */
static trip_view_slices slices_of(trip_camera_params view, double spacing, trip_method method)
{
    const trip_affine to_world = {
        { { spacing, 0, 0, 0 }, { 0, spacing, 0, 0 }, { 0, 0, spacing, 0 } }
    };
    trip_settings settings = trip_settings_default();
    trip_camera camera;
    settings.method = method;
    view.width = view.height = WIDTH;
    view.up = trip_v3(0, 0, 1);
    assert_int_equal(trip_camera_make(&camera, &view, &to_world), 0);
    return trip_slices_of_view(&camera, &settings, dims);
}

/* Along (slope, 1, 0); a pixel is `pixel` voxels. */
static trip_view_slices parallel(double slope, double pixel, double spacing)
{
    const trip_camera_params view = { .eye = { 20 - 100 * slope, -100, 30 },
                                      .look = { 20, 0, 30 },
                                      .ortho_height = WIDTH * pixel };
    trip_camera_params scaled = view;
    scaled.eye = trip_scale(view.eye, spacing);
    scaled.look = trip_scale(view.look, spacing);
    scaled.ortho_height *= spacing;
    return slices_of(scaled, spacing, TRIP_METHOD_MERGE);
}

static void rays_along_an_axis_take_one_slice_and_oblique_ones_two(void **state)
{
    (void)state;
    const double slopes[] = { 0, 0.1, 0.12, 0.13, 0.5, 0.8 };
    for (int i = 0; i < 6; i++)
        for (double spacing = 1e-3; spacing < 1e4; spacing *= 100) {
            trip_view_slices v = parallel(slopes[i], 1, spacing);
            assert_close(v.slope, slopes[i], 1e-9);
            assert_close(v.voxel_px, 1, 1e-9);
            assert_int_equal(v.slices, slopes[i] <= 0.125 ? 1 : 2);
        }
}

static void large_voxels_take_more_but_along_an_axis(void **state)
{
    (void)state;
    for (double px = 0.25; px < 40; px *= 2) {
        trip_view_slices v = parallel(0.5, 1 / px, 1);
        assert_close(v.voxel_px, px, 1e-9);
        assert_int_equal(v.slices, px < 4 ? 2 : px < 8 ? 3 : px < 16 ? 4 : 6);
        assert_int_equal(parallel(0, 1 / px, 1).slices, 1);
    }
}

/* The pixel at the middle is 2 tan(fov / 2) / WIDTH wide at distance 1, and the grid's nearest
 * voxel is so far off; within the grid voxels have no greatest size, and count as 16 voxels off.
 * Corners are the steepest. */
static void perspective_views_go_by_the_nearest_voxel_and_the_steepest_ray(void **state)
{
    (void)state;
    const double half = tan(10 * acos(-1) / 180);
    const trip_camera_params view = { .eye = { 20, -100, 30 },
                                      .look = { 20, 0, 30 },
                                      .fov_degrees = 20 };
    trip_view_slices v = slices_of(view, 1, TRIP_METHOD_MERGE);
    assert_close(v.slope, half, 1e-9);
    assert_close(v.voxel_px, WIDTH / (2 * half * 100), 1e-9);
    assert_int_equal(v.slices, 2);
    trip_camera_params inside = view;
    inside.eye.y = 25;
    inside.look.y = 40;
    v = slices_of(inside, 1, TRIP_METHOD_MERGE);
    assert_true(isinf(v.voxel_px));
    assert_int_equal(v.slices, 2 + (int)(WIDTH / (2 * half * 16) / 4));
    assert_int_equal(v.slices, 4);
    inside.fov_degrees = 60; /* 3.5 pixels at 16 voxels */
    assert_int_equal(slices_of(inside, 1, TRIP_METHOD_MERGE).slices, 2);
    inside.fov_degrees = 16; /* 14.2 */
    assert_int_equal(slices_of(inside, 1, TRIP_METHOD_MERGE).slices, 5);
}

/* At 100 degrees, rays of slope 1 and more: by the list that they are most aligned with they are at
 * most 1, by that of the middle ray alone they are as steep as they are. */
static void the_steepest_ray_is_among_those_with_weight(void **state)
{
    (void)state;
    const trip_camera_params view = { .eye = { 20, -100, 30 },
                                      .look = { 20, 0, 30 },
                                      .fov_degrees = 100 };
    const double half = tan(50 * acos(-1) / 180);
    assert_true(slices_of(view, 1, TRIP_METHOD_CLIP).slope <= 1);
    assert_true(slices_of(view, 1, TRIP_METHOD_MERGE).slope <= 1 / 0.85);
    assert_close(slices_of(view, 1, TRIP_METHOD_AXIS).slope, half, 1e-9);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(rays_along_an_axis_take_one_slice_and_oblique_ones_two),
        cmocka_unit_test(large_voxels_take_more_but_along_an_axis),
        cmocka_unit_test(perspective_views_go_by_the_nearest_voxel_and_the_steepest_ray),
        cmocka_unit_test(the_steepest_ray_is_among_those_with_weight),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
