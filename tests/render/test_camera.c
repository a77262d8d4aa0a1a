#include "test.h"

#include "camera.h"
#include "report.h"

/* Returns an anisotropic, rotated and sheared map. */
static trip_affine sheared(void)
{
    return (trip_affine){ { { 0.5, 0.2, -0.1, 3 }, { -0.3, 1.5, 0.4, -2 }, { 0.1, 0.2, 2.5, 7 } } };
}

static trip_camera_params view(bool ortho)
{
    return (trip_camera_params){
        .eye = { 20, -30, 11 },
        .look = { 4, 3, 8 },
        .up = { 0.1, 0.2, 1 },
        .fov_degrees = 40,
        .ortho_height = ortho ? 12 : 0,
        .width = 320,
        .height = 200,
    };
}

static trip_camera make(const trip_camera_params *p, trip_affine m)
{
    trip_camera c;
    assert_int_equal(trip_camera_make(&c, p, &m), 0);
    return c;
}

static void project(const trip_camera *c, trip_vec3 point, double *x, double *y, double *z)
{
    trip_vec3 d = trip_sub(point, c->eye);
    *z = trip_dot(c->forward, d);
    double w = c->ortho ? 1 : *z;
    *x = trip_dot(c->to_x, d) / w;
    *y = trip_dot(c->to_y, d) / w;
}

static void a_point_at_depth_z_on_the_ray_of_a_pixel_projects_there(void **state)
{
    (void)state;
    for (int ortho = 0; ortho < 2; ortho++) {
        trip_camera_params p = view(ortho);
        trip_camera c = make(&p, sheared());
        for (int i = 0; i < 50; i++) {
            double px = test_random() * 320, py = test_random() * 200, pz = 1 + test_random() * 50;
            trip_vec3 point = trip_add(c.eye, trip_scale(trip_camera_ray(&c, px, py), pz));
            if (c.ortho)
                point = trip_add(point, trip_add(trip_scale(c.rx, px), trip_scale(c.ry, py)));
            double x, y, z;
            project(&c, point, &x, &y, &z);
            assert_close(x, px, 1e-9);
            assert_close(y, py, 1e-9);
            assert_close(z, pz, 1e-9);
        }
    }
}

static void the_target_is_at_the_image_centre_at_its_distance(void **state)
{
    (void)state;
    for (int ortho = 0; ortho < 2; ortho++) {
        trip_camera_params p = view(ortho);
        trip_affine m = sheared(), inverse;
        trip_camera c = make(&p, m);
        assert_true(trip_affine_invert(&m, &inverse));
        double x, y, z;
        project(&c, trip_affine_point(&inverse, p.look), &x, &y, &z);
        assert_close(x, 160, 1e-9);
        assert_close(y, 100, 1e-9);
        double per_depth = trip_length(trip_affine_vector(&m, trip_camera_ray(&c, 160, 100)));
        assert_close(z * per_depth, trip_length(trip_sub(p.look, p.eye)), 1e-9);
    }
}

static void right_in_the_world_is_right_in_the_picture_and_up_is_up(void **state)
{
    (void)state;
    trip_camera_params p = {
        .eye = { 0, -10, 0 }, .up = { 0, 0, 1 }, .fov_degrees = 90, .width = 200, .height = 100
    };
    trip_camera c = make(&p, trip_affine_identity());
    double x, y, z;
    /* At distance 10 and a field of view of 90 degrees, half the height is 10 world units or 50
     * px. */
    project(&c, trip_v3(2, 0, 4), &x, &y, &z);
    assert_close(x, 110, 1e-9);
    assert_close(y, 30, 1e-9);
    assert_close(z, 10, 1e-9);
    p.ortho_height = 20;
    c = make(&p, trip_affine_identity());
    project(&c, trip_v3(2, 3, 4), &x, &y, &z);
    assert_close(x, 110, 1e-9);
    assert_close(y, 30, 1e-9);
    assert_close(z, 13, 1e-9);
}

static void a_voxel_is_as_long_as_the_cube_root_of_its_volume(void **state)
{
    (void)state;
    trip_camera_params p = view(false);
    trip_affine m = { { { 2, 0, 0, 0 }, { 0, -1, 0, 0 }, { 0, 0, 4, 0 } } };
    assert_close(make(&p, m).voxel_world, 2, 1e-12);
}

static void invalid_views_are_refused_as_wrong_usage(void **state)
{
    (void)state;
    trip_affine identity = trip_affine_identity();
    trip_camera_params bad[10];
    for (int i = 0; i < 10; i++)
        bad[i] = view(false);
    bad[0].look = bad[0].eye;
    bad[1].up = trip_sub(bad[1].look, bad[1].eye);
    bad[2].up = trip_v3(0, 0, 0);
    bad[3].fov_degrees = 180;
    bad[4].fov_degrees = 0;
    bad[5].width = 0;
    bad[6].height = 100000;
    bad[7].eye.x = NAN;
    bad[8].ortho_height = -1;
    bad[9].look.y = INFINITY;
    static const char *const why[10] = {
        "look: the point looked at must differ from the eye",
        "up: is zero or parallel to the view direction",
        "up: is zero or parallel to the view direction",
        "fov: 180 is not between 0 and 180",
        "fov: 0 is not between 0 and 180",
        "size: 0 x ",
        " x 100000 px is out of range",
        "eye, look, up: a coordinate is not a finite number",
        "ortho height: -1 is not a positive length",
        "eye, look, up: a coordinate is not a finite number",
    };
    for (int i = 0; i < 10; i++) {
        trip_camera c;
        test_catch_reports();
        assert_int_equal(trip_camera_make(&c, &bad[i], &identity), TRIP_USAGE);
        assert_one_report(why[i]);
    }
}

static void a_turned_view_keeps_its_target_and_distance(void **state)
{
    (void)state;
    trip_camera_params p = view(false);
    trip_camera_params turned = trip_camera_turn(&p, trip_v3(0, 0, 5), 90);
    /* The eye was 16 right of the target, 33 before it and 3 above it. */
    assert_close(turned.eye.x, 4 + 33, 1e-12);
    assert_close(turned.eye.y, 3 + 16, 1e-12);
    assert_close(turned.eye.z, 11, 1e-12);
    assert_close(turned.up.x, -0.2, 1e-12);
    assert_close(turned.up.y, 0.1, 1e-12);
    assert_close(turned.up.z, 1, 1e-12);
    assert_close(turned.look.x, 4, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_point_at_depth_z_on_the_ray_of_a_pixel_projects_there),
        cmocka_unit_test(the_target_is_at_the_image_centre_at_its_distance),
        cmocka_unit_test(right_in_the_world_is_right_in_the_picture_and_up_is_up),
        cmocka_unit_test(a_voxel_is_as_long_as_the_cube_root_of_its_volume),
        cmocka_unit_test(invalid_views_are_refused_as_wrong_usage),
        cmocka_unit_test(a_turned_view_keeps_its_target_and_distance),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
