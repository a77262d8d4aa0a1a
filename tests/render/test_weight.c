#include "test.h"

#include "pixels.h"
#include "weight.h"

static trip_settings with(trip_method method, double h)
{
    trip_settings s = trip_settings_default();
    s.method = method;
    s.h = h;
    return s;
}

static trip_vec3 random_direction(void)
{
    return trip_v3(test_random() * 2 - 1, test_random() * 2 - 1, test_random() * 2 - 1);
}

static trip_camera random_camera(bool ortho)
{
    trip_camera_params p = { .eye = trip_scale(random_direction(), 100),
                             .look = random_direction(),
                             .up = random_direction(),
                             .fov_degrees = 0.01 + 179.98 * test_random(),
                             .ortho_height = ortho ? 10 : 0,
                             .width = 1 + (int)(test_random() * 40),
                             .height = 1 + (int)(test_random() * 40) };
    trip_affine m;
    for (int i = 0; i < 12; i++)
        m.m[i / 4][i % 4] = test_random() * 4 - 2;
    trip_camera c;
    assert_int_equal(trip_camera_make(&c, &p, &m), 0);
    return c;
}

static void merge_weights_follow_the_papers_formula(void **state)
{
    (void)state;
    trip_settings s = with(TRIP_METHOD_MERGE, 0.5);
    trip_vec3 ray = { -4, 3, 1 };
    assert_close(trip_weight(&s, 0, ray, 0), 1, 1e-15);
    assert_close(trip_weight(&s, 0, ray, 1), (0.75 - 0.5) / 0.5, 1e-15);
    assert_close(trip_weight(&s, 0, ray, 2), 0, 1e-15);
    s.h = 0;
    assert_close(trip_weight(&s, 0, ray, 2), 0.25, 1e-15);
}

/* With h = 1/2 the ray (1, 4, 0) has the signed weight -1/2 in list X. */
static void two_points_cull_by_the_difference_of_their_weights(void **state)
{
    (void)state;
    trip_settings s = with(TRIP_METHOD_MERGE, 0.5);
    const trip_vec3 c = { 1, 4, 0 };
    static const struct {
        double x, y; /* of the vector to the second point */
        bool reaches;
    } cases[] = {
        { 0, 0, false },    { 0.5, 0, false }, /* -1/2 + 1/4 */
        { 1.5, 0, true },                      /* -1/2 + 3/4 */
        { -1.5, 0, false }, /* -1/2 + 1/4: the other side would reach, but is not tested */
        { 0, -3, true },    /* the second ray is (1, 1, 0), of weight 1 */
    };
    for (int i = 0; i < 5; i++)
        assert_int_equal(trip_weight_of_two_points(&s, 0, c, trip_v3(cases[i].x, cases[i].y, 0)),
                         cases[i].reaches);
    assert_true(trip_weight_of_two_points(&s, 1, c, trip_v3(0, 0, 0)));
}

static void clip_takes_the_axis_most_aligned_with_the_ray(void **state)
{
    (void)state;
    trip_settings s = with(TRIP_METHOD_CLIP, 0.85);
    const double expected[3] = { 0, 0, 1 };
    for (int a = 0; a < 3; a++)
        assert_close(trip_weight(&s, 0, trip_v3(1, 2, -3), a), expected[a], 0);
    for (int a = 0; a < 3; a++)
        assert_close(trip_weight(&s, 0, trip_v3(1, -1, 1), a), a == 0, 0);
}

static void axis_takes_the_list_of_the_image_centre(void **state)
{
    (void)state;
    trip_settings s = with(TRIP_METHOD_AXIS, 0.85);
    trip_camera_params p = {
        .eye = { 10, 1, 2 }, .up = { 0, 0, 1 }, .fov_degrees = 120, .width = 9, .height = 9
    };
    trip_affine m = trip_affine_identity();
    trip_camera c;
    assert_int_equal(trip_camera_make(&c, &p, &m), 0);
    assert_int_equal(trip_weight_axis_of_view(&c), 0);
    for (int a = 0; a < 3; a++)
        assert_close(trip_weight(&s, 0, trip_v3(0, 0, 1), a), a == 0, 0);
}

static void at_every_pixel_of_any_camera_one_weight_is_1(void **state)
{
    (void)state;
    for (int i = 0; i < 600; i++) {
        trip_settings s = with((trip_method)(i % 3), i % 2 ? 0 : 0.999 * test_random());
        trip_camera c = random_camera(i % 7 == 0);
        int view = trip_weight_axis_of_view(&c);
        for (int y = 0; y < c.height; y++) {
            for (int x = 0; x < c.width; x++) {
                trip_vec3 ray = trip_camera_ray(&c, x + 0.5, y + 0.5);
                double max = 0;
                for (int a = 0; a < 3; a++)
                    max = fmax(max, trip_weight(&s, view, ray, a));
                assert_close(max, 1, 0);
            }
        }
    }
}

/* Rays pass through points of the ball about a centre. If the bound excludes the ball, no ray may
 * have weight. */
static void a_ball_is_left_out_only_when_no_ray_through_it_has_weight(void **state)
{
    (void)state;
    trip_camera c = random_camera(false);
    int left_out = 0;
    for (int i = 0; i < 3000; i++) {
        trip_settings s = with((trip_method)(i % 3), i % 4 ? test_random() : 0.85);
        trip_vec3 centre = trip_scale(random_direction(), 10);
        double radius = 3 * test_random();
        int axis = i % 5 % 3, view = i % 3;
        if (trip_weight_may_reach(&s, &c, view, axis, centre, radius))
            continue;
        left_out++;
        for (int j = 0; j < 100; j++) {
            trip_vec3 e = trip_scale(trip_normalize(random_direction()), radius);
            assert_close(trip_weight(&s, view, trip_add(centre, e), axis), 0, 0);
        }
    }
    assert_true(left_out > 100);
}

static void without_a_band_every_ball_is_kept_and_far_ones_beyond_it_are_not(void **state)
{
    (void)state;
    trip_camera c = random_camera(false);
    trip_settings s = with(TRIP_METHOD_MERGE, 0);
    assert_true(trip_weight_may_reach(&s, &c, 0, 1, trip_v3(100, 0, 0), 1));
    s.h = 0.85;
    assert_false(trip_weight_may_reach(&s, &c, 0, 1, trip_v3(100, 0, 0), 1));
    assert_true(trip_weight_may_reach(&s, &c, 0, 1, trip_v3(100, 86, 0), 1));
}

static void in_a_parallel_view_the_one_direction_decides(void **state)
{
    (void)state;
    trip_camera_params p = {
        .eye = { 10, 0, 0 }, .up = { 0, 0, 1 }, .ortho_height = 5, .width = 9, .height = 9
    };
    trip_affine m = trip_affine_identity();
    trip_camera c;
    assert_int_equal(trip_camera_make(&c, &p, &m), 0);
    trip_settings s = with(TRIP_METHOD_MERGE, 0);
    assert_true(trip_weight_may_reach(&s, &c, 0, 0, trip_v3(-10, 20, 0), 1));
    assert_false(trip_weight_may_reach(&s, &c, 0, 1, trip_v3(-10, 20, 0), 1));
}

typedef struct weighing {
    bool some, all;
    bool way[TRIP_WAY_DOWN + 1]; /* whether some ray has weight, by direction */
} weighing;

static weighing weigh_every_pixel(const trip_settings *s, const trip_camera *c, int view, int axis)
{
    weighing w = { .all = true };
    for (int y = 0; y < c->height; y++)
        for (int x = 0; x < c->width; x++) {
            trip_vec3 ray = trip_camera_ray(c, x + 0.5, y + 0.5);
            bool some = trip_weight(s, view, ray, axis) > 0;
            w.way[trip_component(ray, axis) < 0 ? TRIP_WAY_DOWN : TRIP_WAY_UP] |= some;
            w.some |= some;
            w.all &= some;
        }
    return w;
}

static void a_list_is_used_if_some_pixel_has_weight_in_it_and_whole_only_if_all_have(void **state)
{
    (void)state;
    int whole = 0, unused = 0;
    for (int i = 0; i < 900; i++) {
        trip_settings s = with((trip_method)(i % 3), 0.99 * test_random());
        trip_camera c = random_camera(i % 5 == 0);
        int view = trip_weight_axis_of_view(&c), axis = i / 3 % 3;
        weighing w = weigh_every_pixel(&s, &c, view, axis);
        assert_int_equal(trip_weight_is_somewhere(&s, &c, view, axis, TRIP_WAY_ANY), w.some);
        for (trip_way way = TRIP_WAY_UP; way <= TRIP_WAY_DOWN; way++)
            assert_int_equal(trip_weight_is_somewhere(&s, &c, view, axis, way), w.way[way]);
        unused += !w.some;
        if (!w.some || !trip_weight_is_everywhere(&s, &c, view, axis))
            continue;
        assert_true(w.all);
        whole++;
    }
    assert_true(whole > 20 && unused > 20);
}

static void bounds_over_a_rectangle_hold_for_every_ray_in_it(void **state)
{
    (void)state;
    int ruled_out = 0;
    for (int i = 0; i < 900; i++) {
        trip_settings s = with((trip_method)(i % 2), 0.99 * test_random());
        trip_camera c = random_camera(i % 5 == 0);
        const double from[2] = { 40 * test_random(), 40 * test_random() };
        const double to[2] = { from[0] + 9 * test_random(), from[1] + 9 * test_random() };
        trip_ray_bounds b = trip_ray_bounds_over(&c, from, to);
        for (int k = 0; k < 50; k++) {
            trip_vec3 ray = trip_camera_ray(&c, from[0] + (to[0] - from[0]) * test_random(),
                                            from[1] + (to[1] - from[1]) * test_random());
            for (int a = 0; a < 3; a++) {
                double r = fabs(trip_component(ray, a)), room = 1e-9 * trip_length(ray);
                assert_true(r >= b.min[a] - room && r <= b.max[a] + room);
                if (!trip_weight_may_lie(&s, 0, &b, a)) {
                    assert_close(trip_weight(&s, 0, ray, a), 0, 0);
                    ruled_out++;
                }
            }
        }
    }
    assert_true(ruled_out > 1000);
}

static void pixels_have_their_centres_within_the_bounds(void **state)
{
    (void)state;
    enum { SIZE = 9 };
    for (int i = 0; i < 20000; i++) {
        double lo = floor(60 * test_random() - 30) / 4, hi = lo + floor(24 * test_random() - 4) / 4;
        trip_pixels p = trip_pixels_within(lo, hi, SIZE);
        for (int x = 0; x < SIZE; x++)
            assert_int_equal(x >= p.first && x <= p.last, x + 0.5 >= lo && x + 0.5 <= hi);
        assert_true(p.first >= 0 && p.last < SIZE);
    }
    assert_true(trip_pixels_within(NAN, 3, SIZE).last < 0);
    assert_true(trip_pixels_within(-INFINITY, INFINITY, SIZE).last == SIZE - 1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(merge_weights_follow_the_papers_formula),
        cmocka_unit_test(two_points_cull_by_the_difference_of_their_weights),
        cmocka_unit_test(clip_takes_the_axis_most_aligned_with_the_ray),
        cmocka_unit_test(axis_takes_the_list_of_the_image_centre),
        cmocka_unit_test(at_every_pixel_of_any_camera_one_weight_is_1),
        cmocka_unit_test(a_ball_is_left_out_only_when_no_ray_through_it_has_weight),
        cmocka_unit_test(without_a_band_every_ball_is_kept_and_far_ones_beyond_it_are_not),
        cmocka_unit_test(in_a_parallel_view_the_one_direction_decides),
        cmocka_unit_test(a_list_is_used_if_some_pixel_has_weight_in_it_and_whole_only_if_all_have),
        cmocka_unit_test(bounds_over_a_rectangle_hold_for_every_ray_in_it),
        cmocka_unit_test(pixels_have_their_centres_within_the_bounds),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
