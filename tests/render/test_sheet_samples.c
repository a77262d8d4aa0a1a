/* The samples per sheet that views need, computed by hand from slopes and sizes. */
#include "sheet_samples.h"

#include "test.h"

enum { WIDTH = 64 };

static const uint64_t dims[3] = { 40, 50, 60 };

/* Computes the samples for a grid with the given voxel widths along each axis. Pictures are WIDTH
 * wide and high and z is up, unless the view sets another size or up vector. */
static trip_view_samples_per_sheet samples_per_sheet_of_grid(trip_camera_params view,
                                                             const double spacing[3])
{
    const trip_affine to_world = {
        { { spacing[0], 0, 0, 0 }, { 0, spacing[1], 0, 0 }, { 0, 0, spacing[2], 0 } }
    };
    trip_camera camera;
    view.width = view.width ? view.width : WIDTH;
    view.height = view.height ? view.height : WIDTH;
    view.up = trip_length(view.up) > 0 ? view.up : trip_v3(0, 0, 1);
    assert_int_equal(trip_camera_make(&camera, &view, &to_world), 0);
    return trip_sheet_samples_of_view(&camera, dims);
}

/* Computes the samples for a grid with voxels of width `spacing`. */
static trip_view_samples_per_sheet samples_per_sheet_of(trip_camera_params view, double spacing)
{
    return samples_per_sheet_of_grid(view, (double[3]){ spacing, spacing, spacing });
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
    return samples_per_sheet_of(scaled, spacing);
}

static void every_view_takes_two_samples_per_sheet(void **state)
{
    (void)state;
    const double slopes[] = { 0, 0.1, 0.12, 0.13, 0.5, 0.8 };
    for (int i = 0; i < 6; i++)
        for (double spacing = 1e-3; spacing < 1e4; spacing *= 100) {
            trip_view_samples_per_sheet v = parallel(slopes[i], 1, spacing);
            assert_close(v.voxel_px, 1, 1e-9);
            assert_int_equal(v.samples_per_sheet, 2);
        }
}

/* A pixel is one world unit. Voxels are two units wide along one axis of the picture. */
static void the_wider_side_of_a_voxel_counts(void **state)
{
    (void)state;
    const trip_camera_params view = { .eye = { 20, -100, 30 },
                                      .look = { 20, 0, 30 },
                                      .ortho_height = WIDTH };
    assert_close(samples_per_sheet_of_grid(view, (double[3]){ 2, 1, 1 }).voxel_px, 2, 1e-9);
    assert_close(samples_per_sheet_of_grid(view, (double[3]){ 1, 1, 2 }).voxel_px, 2, 1e-9);
}

static void large_voxels_take_more_samples(void **state)
{
    (void)state;
    for (double px = 0.25; px < 40; px *= 2)
        for (double slope = 0; slope < 1; slope += 0.5) {
            trip_view_samples_per_sheet v = parallel(slope, 1 / px, 1);
            assert_close(v.voxel_px, px, 1e-9);
            assert_int_equal(v.samples_per_sheet, px < 4 ? 2 : px < 8 ? 3 : px < 16 ? 4 : 6);
        }
}

/* At distance 1, the central pixel is 2 tan(fov / 2) / WIDTH wide. The grid's nearest voxel gives
 * the distance. Inside the grid, the size of voxels has no maximum, and the distance counts as 16
 * voxels. */
static void perspective_views_use_the_nearest_voxel(void **state)
{
    (void)state;
    const double half = tan(10 * acos(-1) / 180);
    const trip_camera_params view = { .eye = { 20, -100, 30 },
                                      .look = { 20, 0, 30 },
                                      .fov_degrees = 20 };
    trip_view_samples_per_sheet v = samples_per_sheet_of(view, 1);
    assert_close(v.voxel_px, WIDTH / (2 * half * 100), 1e-9);
    assert_int_equal(v.samples_per_sheet, 2);
    trip_camera_params inside = view;
    inside.eye.y = 25;
    inside.look.y = 40;
    v = samples_per_sheet_of(inside, 1);
    assert_close(v.voxel_px, WIDTH / (2 * half * 16), 1e-9);
    assert_int_equal(v.samples_per_sheet, 2 + (int)(WIDTH / (2 * half * 16) / 4));
    assert_int_equal(v.samples_per_sheet, 4);
    inside.fov_degrees = 60; /* 3.5 pixels at 16 voxels */
    assert_int_equal(samples_per_sheet_of(inside, 1).samples_per_sheet, 2);
    inside.fov_degrees = 16; /* 14.2 */
    assert_int_equal(samples_per_sheet_of(inside, 1).samples_per_sheet, 5);
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
        assert_close(samples_per_sheet_of(view, 1).voxel_px, WIDTH / (2 * half * views[i].distance),
                     1e-9);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_view_takes_two_samples_per_sheet),
        cmocka_unit_test(the_wider_side_of_a_voxel_counts),
        cmocka_unit_test(large_voxels_take_more_samples),
        cmocka_unit_test(perspective_views_use_the_nearest_voxel),
        cmocka_unit_test(the_nearest_voxel_may_be_at_a_face_an_edge_or_a_corner),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
