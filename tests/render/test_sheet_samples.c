/* The samples per sheet that views need, computed by hand from slopes and sizes. */
#include "sheet_samples.h"

#include "test.h"

enum { WIDTH = 64 };

static const uint64_t dims[3] = { 40, 50, 60 };

/* Computes the samples for a grid with the given voxel widths along each axis. Pictures are WIDTH
 * wide and high and z is up, unless the view sets another size or up vector. */
static trip_view_samples_per_sheet
samples_per_sheet_of_grid(trip_camera_params view, const double spacing[3], trip_method method)
{
    const trip_affine to_world = {
        { { spacing[0], 0, 0, 0 }, { 0, spacing[1], 0, 0 }, { 0, 0, spacing[2], 0 } }
    };
    trip_settings settings = trip_settings_default();
    trip_camera camera;
    settings.method = method;
    view.width = view.width ? view.width : WIDTH;
    view.height = view.height ? view.height : WIDTH;
    view.up = trip_length(view.up) > 0 ? view.up : trip_v3(0, 0, 1);
    assert_int_equal(trip_camera_make(&camera, &view, &to_world), 0);
    return trip_sheet_samples_of_view(&camera, &settings, dims);
}

/* Computes the samples for a grid with voxels of width `spacing`. */
static trip_view_samples_per_sheet samples_per_sheet_of(trip_camera_params view, double spacing,
                                                        trip_method method)
{
    return samples_per_sheet_of_grid(view, (double[3]){ spacing, spacing, spacing }, method);
}

/* Views along (slope, 1, 0). A pixel is `pixel` voxels wide. */
static trip_view_samples_per_sheet parallel(double slope, double pixel, double spacing)
{
    const trip_camera_params view = { .eye = { 20 - 100 * slope, -100, 30 },
                                      .look = { 20, 0, 30 },
                                      .ortho_height = WIDTH * pixel };
    trip_camera_params scaled = view;
    scaled.eye = trip_scale(view.eye, spacing);
    scaled.look = trip_scale(view.look, spacing);
    scaled.ortho_height *= spacing;
    return samples_per_sheet_of(scaled, spacing, TRIP_METHOD_MERGE);
}

static void axis_rays_take_one_sample_per_sheet_and_oblique_rays_two(void **state)
{
    (void)state;
    const double slopes[] = { 0, 0.1, 0.12, 0.13, 0.5, 0.8 };
    for (int i = 0; i < 6; i++)
        for (double spacing = 1e-3; spacing < 1e4; spacing *= 100) {
            trip_view_samples_per_sheet v = parallel(slopes[i], 1, spacing);
            assert_close(v.slope, slopes[i], 1e-9);
            assert_close(v.voxel_px, 1, 1e-9);
            assert_int_equal(v.samples_per_sheet, slopes[i] <= 0.125 ? 1 : 2);
        }
    assert_true(parallel(0.125, 1, 1).slope == 0.125); /* an eighth rounds like the whole */
    assert_int_equal(parallel(0.125, 1, 1).samples_per_sheet, 1);
}

/* A pixel is one world unit. Voxels are two units wide along one axis of the picture. */
static void the_wider_side_of_a_voxel_counts(void **state)
{
    (void)state;
    const trip_camera_params view = { .eye = { 20, -100, 30 },
                                      .look = { 20, 0, 30 },
                                      .ortho_height = WIDTH };
    assert_close(
        samples_per_sheet_of_grid(view, (double[3]){ 2, 1, 1 }, TRIP_METHOD_MERGE).voxel_px, 2,
        1e-9);
    assert_close(
        samples_per_sheet_of_grid(view, (double[3]){ 1, 1, 2 }, TRIP_METHOD_MERGE).voxel_px, 2,
        1e-9);
}

static void large_voxels_take_more_samples_except_along_an_axis(void **state)
{
    (void)state;
    for (double px = 0.25; px < 40; px *= 2) {
        trip_view_samples_per_sheet v = parallel(0.5, 1 / px, 1);
        assert_close(v.voxel_px, px, 1e-9);
        assert_int_equal(v.samples_per_sheet, px < 4 ? 2 : px < 8 ? 3 : px < 16 ? 4 : 6);
        assert_int_equal(parallel(0, 1 / px, 1).samples_per_sheet, 1);
    }
}

/* At distance 1, the central pixel is 2 tan(fov / 2) / WIDTH wide. The grid's nearest voxel gives
 * the distance. Inside the grid, the size of voxels has no maximum, and the distance counts as 16
 * voxels. Rays at corners are the steepest. */
static void perspective_views_use_the_nearest_voxel_and_steepest_ray(void **state)
{
    (void)state;
    const double half = tan(10 * acos(-1) / 180);
    const trip_camera_params view = { .eye = { 20, -100, 30 },
                                      .look = { 20, 0, 30 },
                                      .fov_degrees = 20 };
    trip_view_samples_per_sheet v = samples_per_sheet_of(view, 1, TRIP_METHOD_MERGE);
    assert_close(v.slope, half, 1e-9);
    assert_close(v.voxel_px, WIDTH / (2 * half * 100), 1e-9);
    assert_int_equal(v.samples_per_sheet, 2);
    trip_camera_params inside = view;
    inside.eye.y = 25;
    inside.look.y = 40;
    v = samples_per_sheet_of(inside, 1, TRIP_METHOD_MERGE);
    assert_close(v.voxel_px, WIDTH / (2 * half * 16), 1e-9);
    assert_int_equal(v.samples_per_sheet, 2 + (int)(WIDTH / (2 * half * 16) / 4));
    assert_int_equal(v.samples_per_sheet, 4);
    inside.fov_degrees = 60; /* 3.5 pixels at 16 voxels */
    assert_int_equal(samples_per_sheet_of(inside, 1, TRIP_METHOD_MERGE).samples_per_sheet, 2);
    inside.fov_degrees = 16; /* 14.2 */
    assert_int_equal(samples_per_sheet_of(inside, 1, TRIP_METHOD_MERGE).samples_per_sheet, 5);
}

static trip_vec3 from_eye(trip_vec3 eye, double x, double y, double z)
{
    return trip_add(eye, trip_v3(x, y, z));
}

/* Views along an axis. Pictures are square or four times as wide as high. */
static void the_longer_side_of_a_picture_has_its_steepest_rays(void **state)
{
    (void)state;
    const double half = tan(10 * acos(-1) / 180);
    for (int i = 0; i < 6; i++) {
        const int axis = i / 2, wide = i % 2;
        trip_camera_params view = { .eye = { 20, 25, 30 },
                                    .up = { axis == 2, 0, axis != 2 },
                                    .fov_degrees = 20,
                                    .width = wide ? 4 * WIDTH : WIDTH,
                                    .height = WIDTH };
        view.look = from_eye(view.eye, axis == 0, axis == 1, axis == 2);
        assert_close(samples_per_sheet_of(view, 1, TRIP_METHOD_MERGE).slope, wide ? 4 * half : half,
                     1e-9);
    }
}

/* The view is turned by 15 degrees and covers 10 degrees to either side. The steepest rays are at
 * 25 degrees, at one edge of the picture. */
static void the_steepest_ray_may_be_at_any_edge(void **state)
{
    (void)state;
    const double degree = acos(-1) / 180, aside = tan(15 * degree);
    const double turns[4][2] = { { aside, 0 }, { -aside, 0 }, { 0, aside }, { 0, -aside } };
    for (int i = 0; i < 4; i++) {
        trip_camera_params view = { .eye = { 20, -100, 30 }, .fov_degrees = 20 };
        view.look = from_eye(view.eye, turns[i][0], 1, turns[i][1]);
        assert_close(samples_per_sheet_of(view, 1, TRIP_METHOD_MERGE).slope, tan(25 * degree),
                     1e-9);
    }
}

/* The eye is beyond a face, an edge or a corner of the box of voxels, on either side. The distance
 * is 120, 150 or 170 voxels. */
static void the_nearest_voxel_may_be_at_a_face_an_edge_or_a_corner(void **state)
{
    (void)state;
    const double half = tan(10 * acos(-1) / 180);
    const struct {
        trip_vec3 eye;
        double distance;
    } views[] = { { { -120, 25, 30 }, 120 },  { { 159, 25, 30 }, 120 },  { { 20, -120, 30 }, 120 },
                  { { 20, 169, 30 }, 120 },   { { 20, 25, -120 }, 120 }, { { 20, 25, 179 }, 120 },
                  { { -120, 139, 30 }, 150 }, { { 20, -90, 179 }, 150 }, { { 159, 139, -80 }, 170 },
                  { { -120, -90, 139 }, 170 } };
    for (size_t i = 0; i < sizeof views / sizeof *views; i++) {
        const trip_camera_params view = { .eye = views[i].eye,
                                          .look = { 20, 24, 30.5 },
                                          .up = { 0.1, 0.2, 0.3 },
                                          .fov_degrees = 20 };
        assert_close(samples_per_sheet_of(view, 1, TRIP_METHOD_MERGE).voxel_px,
                     WIDTH / (2 * half * views[i].distance), 1e-9);
    }
}

/* At 100 degrees some rays have slope 1 and more. With the list that each ray is most aligned
 * with, slopes are at most 1. With the list of the central ray alone, slopes are larger. */
static void the_steepest_ray_is_among_those_with_weight(void **state)
{
    (void)state;
    const trip_camera_params view = { .eye = { 20, -100, 30 },
                                      .look = { 20, 0, 30 },
                                      .fov_degrees = 100 };
    const double half = tan(50 * acos(-1) / 180);
    assert_true(samples_per_sheet_of(view, 1, TRIP_METHOD_CLIP).slope <= 1);
    assert_true(samples_per_sheet_of(view, 1, TRIP_METHOD_MERGE).slope <= 1 / 0.85);
    assert_close(samples_per_sheet_of(view, 1, TRIP_METHOD_AXIS).slope, half, 1e-9);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(axis_rays_take_one_sample_per_sheet_and_oblique_rays_two),
        cmocka_unit_test(the_wider_side_of_a_voxel_counts),
        cmocka_unit_test(large_voxels_take_more_samples_except_along_an_axis),
        cmocka_unit_test(perspective_views_use_the_nearest_voxel_and_steepest_ray),
        cmocka_unit_test(the_longer_side_of_a_picture_has_its_steepest_rays),
        cmocka_unit_test(the_steepest_ray_may_be_at_any_edge),
        cmocka_unit_test(the_nearest_voxel_may_be_at_a_face_an_edge_or_a_corner),
        cmocka_unit_test(the_steepest_ray_is_among_those_with_weight),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
