/* The lists' weights in the kernels that merge must equal the weights of weight.c to the last bit.
 */
#include "test.h"

#include <math.h>
#include <string.h>

#include "cpu/kernels/isa.h"
#include "plan.h"
#include "weight.h"

enum { WIDTH = 640, HEIGHT = 480 };

typedef struct scene {
    trip_settings settings;
    trip_camera camera;
    trip_plan plan;
    trip_frame frame;
    trip_cpu_view view;
} scene;

static double within(double lo, double hi)
{
    return lo + (hi - lo) * test_random();
}

static trip_vec3 any_vector(double length)
{
    return trip_v3(within(-length, length), within(-length, length), within(-length, length));
}

/* Creates views in any direction, with rays of any length. Every other view has a ray with
 * components of equal length along all axes. */
static void make_scene(scene *s, int number, trip_method method)
{
    const double length = exp2(number % 5 == 4 ? within(-200, 200) : within(-3, 3));
    *s = (scene){ .settings = trip_settings_default(),
                  .camera = { .width = WIDTH, .height = HEIGHT } };
    s->settings.method = method;
    s->settings.h = number % 3 ? within(0, 1) : number % 2 ? 0 : TRIP_H_AUTO;
    s->camera.r0 = number % 2 ? any_vector(length) : trip_v3(length, -length, length);
    s->camera.rx = any_vector(length / WIDTH);
    s->camera.ry = any_vector(length / HEIGHT);
    s->camera.ortho = number % 7 == 6;
    s->plan.axis_of_view = trip_weight_axis_of_view(&s->camera);
    s->frame = (trip_frame){ .settings = &s->settings, .camera = &s->camera, .plan = &s->plan };
    s->view = (trip_cpu_view){ .of = &s->frame };
}

/* Merging a layer that is 1 everywhere gives the squares of the weights. */
static void assert_weights_of_pane(const trip_cpu_kernels *k, const scene *s, int x, int y)
{
    enum { FLOATS = 4 * TRIP_CPU_PANE_PIXELS };
    static _Alignas(64) float layer[FLOATS], sum[FLOATS];
    const int lanes = (int)k->lanes, rows = lanes / 4, across = TRIP_CPU_PANE / 4;
    for (int i = 0; i < FLOATS; i++)
        layer[i] = 1;
    k->pane_merge(&s->view, x, y, layer, true, sum);
    for (int i = 0; i < TRIP_CPU_PANE_PIXELS; i++) {
        const int stamp = i / lanes, lane = i % lanes;
        const int column = x + stamp % across * 4 + lane % 4;
        const int row = y + stamp / across * rows + lane / 4;
        const trip_vec3 ray = trip_camera_ray(&s->camera, column + 0.5, row + 0.5);
        const float weight =
            (float)trip_weight(&s->settings, s->plan.axis_of_view, ray, s->view.axis);
        assert_true(sum[4 * lanes * stamp + lane] == weight * weight);
    }
}

static void weights_equal_those_of_the_reference(void **state)
{
    (void)state;
    static const trip_method methods[] = { TRIP_METHOD_MERGE, TRIP_METHOD_MERGE, TRIP_METHOD_MERGE,
                                           TRIP_METHOD_CLIP, TRIP_METHOD_AXIS };
    scene s;
    for (int i = 0; i < 2000; i++) {
        make_scene(&s, i, methods[i / 7 % 5]);
        const int x = (int)within(0, WIDTH / TRIP_CPU_PANE) * TRIP_CPU_PANE;
        const int y = (int)within(0, HEIGHT / TRIP_CPU_PANE) * TRIP_CPU_PANE;
        for (s.view.axis = 0; s.view.axis < 3; s.view.axis++)
            for (const trip_cpu_kernels *const *k = trip_cpu_isas(); *k; k++)
                assert_weights_of_pane(*k, &s, x, y);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(weights_equal_those_of_the_reference),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
