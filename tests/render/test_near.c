/* Splats about the eye. Compares pictures from inside fog with the closed form. */
#include "scenes.h"
#include "test.h"

enum { EDGE = 30 }; /* edge of a cube of fog in voxels */

/* Optical depth of one voxel. */
#define EXTINCTION 0.08

static void make_fog(scene *s)
{
    scene_create(s, &(scene_params){ .dims = { EDGE, EDGE, EDGE } });
    s->table[65535] = (trip_tf_entry){ 1, 1, 1, (float)EXTINCTION };
}

static trip_settings unlit(void)
{
    trip_settings s = trip_settings_default();
    s.shading = false;
    s.background[3] = 0;
    return s;
}

/* Returns the distance from the eye to the point where a pixel's ray leaves the cube. The cube's
 * faces are half a voxel beyond the outermost voxels. The result is negative if that point is
 * within `margin` of an edge of the cube. */
static double path(const trip_camera *c, double x, double y, double margin)
{
    trip_vec3 ray = trip_normalize(trip_camera_ray(c, x, y));
    double length = INFINITY;
    int face = 0;
    for (int a = 0; a < 3; a++) {
        double r = trip_component(ray, a), eye = trip_component(c->eye, a);
        double to = fabs(((r > 0 ? EDGE - 0.5 : -0.5) - eye) / r);
        if (to < length) {
            length = to;
            face = a;
        }
    }
    for (int a = 0; a < 3; a++) {
        double at = trip_component(c->eye, a) + length * trip_component(ray, a);
        if (a != face && !(at > margin - 0.5 && at < EDGE - 0.5 - margin))
            return -1;
    }
    return length;
}

static trip_camera camera_of(const trip_camera_params *view)
{
    trip_affine m = trip_affine_identity();
    trip_camera c;
    assert_int_equal(trip_camera_make(&c, view, &m), 0);
    return c;
}

static double optical_depth(const scene_picture *p, int n)
{
    return -log1p(-(double)p->rgba[4 * n + 3]);
}

/* Returns the largest relative error of the optical depth along the path, over all rays that leave
 * the cube away from its edges. */
static double worst_of(const scene_picture *p, const trip_camera_params *view, int *pixels)
{
    trip_camera c = camera_of(view);
    double worst = 0;
    for (int n = 0; n < p->width * p->height; n++) {
        double length = path(&c, n % p->width + 0.5, n / p->width + 0.5, 3);
        if (length < 0)
            continue;
        worst = fmax(worst, fabs(optical_depth(p, n) / (EXTINCTION * length) - 1));
        ++*pixels;
    }
    return worst;
}

/* Pictures begin at a size of one pixel. The remaining error is the kernel's ripple and the
 * low-pass filter, which adds the square of a pixel's width. The filter uses the pixel width at
 * the footprint's centre. */
static void fog_about_the_eye_has_the_opacity_of_the_path_in_it(void **state)
{
    (void)state;
    scene s;
    make_fog(&s);
    for (int i = 0; i < 25; i++) {
        const double angles[5] = { 20, 60, 90, 120, 150 };
        const int heights[5] = { 1, 2, 4, 12, 40 };
        int pixels = 0, height = heights[i % 5];
        trip_camera_params view = { .eye = { 14.6, 13.1 + 0.11 * i, 15.3 - 0.07 * i },
                                    .up = { 0, 0.1, 1 },
                                    .fov_degrees = angles[i / 5],
                                    .width = 2 * height,
                                    .height = height };
        view.look = trip_add(view.eye, i % 2 ? trip_v3(1, 0.4, -0.2) : trip_v3(-0.2, -1, 0.3));
        double pixel = 2 * tan(angles[i / 5] / 360 * 3.14159265358979323846) / height;
        double bound = 0.003 + fmin(0.45 * pixel * pixel, 0.7);
        trip_settings settings = unlit();
        for (const scene_renderer *r = scene_renderers(); r->name; r++) {
            scene_picture p = scene_draw(&s, r, &view, &settings);
            double worst = worst_of(&p, &view, &pixels);
            if (!(worst < bound))
                fail_msg("%s, %g degrees, %d px: %g of the path, %g allowed", r->name,
                         angles[i / 5], height, worst, bound);
            scene_picture_free(&p);
        }
        assert_true(pixels > 0);
    }
    scene_destroy(&s);
}

/* Each step of the eye changes the optical depth by the step's share, apart from the ripple. */
static void fog_thins_out_evenly_on_the_way_through_it(void **state)
{
    (void)state;
    enum { WIDTH = 16, HEIGHT = 12, STEPS = 25 };
    scene s;
    make_fog(&s);
    trip_settings settings = unlit();
    for (const scene_renderer *r = scene_renderers(); r->name; r++) {
        double before[WIDTH * HEIGHT], worst = 0;
        int pixels = 0;
        for (int i = 0; i <= STEPS; i++) {
            trip_camera_params view = { .eye = { 13 + 0.08 * i, 14.2 + 0.06 * i, 15.1 },
                                        .up = { 0, 0, 1 },
                                        .fov_degrees = 75,
                                        .width = WIDTH,
                                        .height = HEIGHT };
            view.look = trip_add(view.eye, trip_v3(1, 0.1, 0.2));
            trip_camera c = camera_of(&view);
            scene_picture p = scene_draw(&s, r, &view, &settings);
            for (int n = 0; n < WIDTH * HEIGHT; n++) {
                double length = path(&c, n % WIDTH + 0.5, n / WIDTH + 0.5, 2);
                double excess = optical_depth(&p, n) / EXTINCTION - length;
                if (i > 0 && length > 0 && !isnan(before[n])) {
                    worst = fmax(worst, fabs(excess - before[n]));
                    pixels++;
                }
                before[n] = length > 0 ? excess : NAN;
            }
            scene_picture_free(&p);
        }
        assert_true(worst < 0.012); /* voxels */
        assert_true(pixels > 1000);
    }
    scene_destroy(&s);
}

/* The eye's plane of a parallel view passes through the fog. */
static void a_parallel_view_begins_at_the_plane_of_the_eye(void **state)
{
    (void)state;
    scene s;
    make_fog(&s);
    trip_settings settings = unlit();
    for (int i = 0; i < 12; i++) {
        trip_camera_params view = { .eye = { 10 + 0.35 * i, 14.2, 15.1 },
                                    .up = { 0, 0, 1 },
                                    .ortho_height = 8,
                                    .width = 24,
                                    .height = 16 };
        view.look = trip_add(view.eye, trip_v3(1, 0.1, 0.2));
        trip_camera c = camera_of(&view);
        for (const scene_renderer *r = scene_renderers(); r->name; r++) {
            scene_picture p = scene_draw(&s, r, &view, &settings);
            for (int n = 0; n < p.width * p.height; n++) {
                trip_camera own = c;
                own.eye = trip_add(c.eye, trip_add(trip_scale(c.rx, n % p.width + 0.5),
                                                   trip_scale(c.ry, n / p.width + 0.5)));
                double length = path(&own, 0, 0, 2);
                assert_true(length > 0);
                assert_close(optical_depth(&p, n) / (EXTINCTION * length), 1, 0.004);
            }
            scene_picture_free(&p);
        }
    }
    scene_destroy(&s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(fog_about_the_eye_has_the_opacity_of_the_path_in_it),
        cmocka_unit_test(fog_thins_out_evenly_on_the_way_through_it),
        cmocka_unit_test(a_parallel_view_begins_at_the_plane_of_the_eye),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
