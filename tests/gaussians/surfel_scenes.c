#include "surfel_scenes.h"

#include <math.h>

#include "test.h"

trip_camera surfel_camera(double ortho_height)
{
    const trip_camera_params params = { .look = trip_v3(0, 0, 1),
                                        .up = trip_v3(0, 1, 0),
                                        .fov_degrees = 60,
                                        .ortho_height = ortho_height,
                                        .width = SURFEL_WIDTH,
                                        .height = SURFEL_HEIGHT };
    const trip_affine identity = trip_affine_identity();
    trip_camera c;
    assert_int_equal(trip_camera_make(&c, &params, &identity), 0);
    return c;
}

void surfel_colour(trip_gaussian *g, double red, double green, double blue)
{
    g->sh[0][0] = trip_sh_of_colour(red);
    g->sh[0][1] = trip_sh_of_colour(green);
    g->sh[0][2] = trip_sh_of_colour(blue);
}

trip_gaussian surfel_at(double x, double y, double z, double radius, double angle)
{
    const float d = (float)(0.85 * radius);
    trip_gaussian g = { .centre = { x, y, z },
                        .deviations = { d, d, 0 },
                        .rotation = { (float)cos(angle / 2), (float)sin(angle / 2), 0, 0 },
                        .opacity = 1 };
    surfel_colour(&g, 1, 1, 1);
    return g;
}

trip_gaussian *surfel_plane(trip_gaussian *to, double z, double distance, double angle)
{
    for (int i = 0; i < SURFEL_SIDE * SURFEL_SIDE; i++) {
        const double u = (i % SURFEL_SIDE - SURFEL_SIDE / 2 + 0.3) * distance;
        const double v = (i / SURFEL_SIDE - SURFEL_SIDE / 2 + 0.4) * distance;
        to[i] = surfel_at(u, v * cos(angle), z + v * sin(angle), distance / sqrt(2), angle);
    }
    return to;
}

const trip_gaussian *surfel_scene(void)
{
    static trip_gaussian scene[SURFEL_SCENE];
    if (scene[0].opacity > 0)
        return scene;
    for (int i = 0; i < SURFEL_SCENE; i++) {
        trip_gaussian *g = &scene[i];
        const double z = 0.1 + 20 * test_random(), size = i % 200 == 0 ? 1 : 0.1;
        *g = surfel_at(z * (2 * test_random() - 1), z * (2 * test_random() - 1), z, 0, 0);
        double length = 0;
        for (int k = 0; k < 4; k++) {
            g->rotation[k] = (float)(2 * test_random() - 1);
            length += (double)(g->rotation[k] * g->rotation[k]);
        }
        for (int k = 0; k < 4; k++)
            g->rotation[k] /= (float)sqrt(length);
        for (int k = 0; k < 3; k++)
            g->deviations[k] = (float)(size * exp(-3 * test_random()));
        g->merged = i % 7 == 0;
        if (!g->merged)
            g->deviations[2] = 0;
        g->opacity = i % 3 ? 0.99f : 0.5f;
        surfel_colour(g, test_random(), test_random(), test_random());
    }
    for (int i = 0; i < SURFEL_SCENE / 2;
         i++) { /* equal depths in parallel views, and a noisy wall */
        scene[i].centre[2] = i % 4 < 2 ? 12 + 2 * (i % 2) : 12 + 0.5 * test_random();
        scene[i].rotation[0] = 1;
        scene[i].rotation[1] = scene[i].rotation[2] = scene[i].rotation[3] = 0;
        scene[i].deviations[0] = scene[i].deviations[1] = 0.12f;
    }
    return scene;
}

void surfel_check_hidden(trip_surfels_cpu *s)
{
    /* It covers the columns from 0 to 64 or so: the middle of the left edge is its centre. */
    const trip_gaussian wall = surfel_at(7.5, 0, 5, 8, 0);
    assert_int_equal(trip_surfels_cpu_add(s, &wall, 1, 0), 0);
    assert_true(trip_surfels_cpu_hides(s, (double[]){ 3, 30 }, (double[]){ 40, 60 }, 5.1));
    assert_false(trip_surfels_cpu_hides(s, (double[]){ 3, 30 }, (double[]){ 40, 60 }, 5));
    assert_false(trip_surfels_cpu_hides(s, (double[]){ 3, 30 }, (double[]){ 140, 60 }, 5.1));
    assert_true(trip_surfels_cpu_hides(s, (double[]){ -99, 30 }, (double[]){ -10, 60 }, 5.1));
    assert_false(
        trip_surfels_cpu_hides(s, (double[]){ -1e30, -1e30 }, (double[]){ 1e30, 1e30 }, 9));
}
