/* Tests FLIP with uniform pictures, for which only colours count. The expected values are computed
 * here step by step. tests/cli/test_accuracy.py compares pictures with detail with a plain
 * computation. */
#include "flip.h"
#include "test.h"

enum { SIDE = 24 };

static trip_budget *budget;

static void fill(float *rgba, double red, double green, double blue)
{
    for (int i = 0; i < SIDE * SIDE; i++) {
        rgba[4 * i] = (float)red;
        rgba[4 * i + 1] = (float)green;
        rgba[4 * i + 2] = (float)blue;
        rgba[4 * i + 3] = 1;
    }
}

static float a[4 * SIDE * SIDE], b[4 * SIDE * SIDE];

static double flip(void)
{
    double out = -1;
    assert_int_equal(accuracy_flip(a, b, SIDE, SIDE, budget, &out), 0);
    return out;
}

/* The arrays hold L*, a* and b* of sRGB green and blue under D65, from colour tables. */
static double max_apart(void)
{
    const double green[3] = { 87.7347, -86.1827, 83.1793 },
                 blue[3] = { 32.2970, 79.1875, -107.8602 };
    double da = 0.01 * (green[0] * green[1] - blue[0] * blue[1]);
    double db = 0.01 * (green[0] * green[2] - blue[0] * blue[2]);
    return pow(green[0] - blue[0] + sqrt(da * da + db * db), 0.7);
}

static double of_distance(double distance)
{
    double e = pow(distance, 0.7), max = max_apart(), knee = 0.4 * max;
    return e < knee ? 0.95 * e / knee : 0.95 + 0.05 * (e - knee) / (max - knee);
}

static void a_picture_does_not_differ_from_itself(void **state)
{
    (void)state;
    fill(a, 0.3, 0.6, 0.9);
    fill(b, 0.3, 0.6, 0.9);
    assert_close(flip(), 0, 1e-9);
}

/* The lightness differs by 100. */
static void black_and_white_differ_by_a_lightness_of_100(void **state)
{
    (void)state;
    fill(a, 0, 0, 0);
    fill(b, 1, 1, 1);
    assert_close(flip(), of_distance(100), 2e-4);
}

/* Greys differ only by lightness, which is 116 times the cube root of the luminance, minus 16. */
static void greys_differ_by_lightness(void **state)
{
    (void)state;
    double y = pow((0.5 + 0.055) / 1.055, 2.4), z = pow((0.52 + 0.055) / 1.055, 2.4);
    fill(a, 0.5, 0.5, 0.5);
    fill(b, 0.52, 0.52, 0.52);
    assert_close(flip(), of_distance(116 * (cbrt(z) - cbrt(y))), 2e-4);
}

static void green_and_blue_have_the_maximum_distance(void **state)
{
    (void)state;
    fill(a, 0, 1, 0);
    fill(b, 0, 0, 1);
    /* The luminances differ, but neither picture has edges. */
    assert_close(flip(), 1, 2e-4);
}

/* FLIP clamps colours to the range that a display can show. */
static void colours_are_clamped(void **state)
{
    (void)state;
    fill(a, 1, 1, 1);
    fill(b, 1.5, 2, 9);
    assert_close(flip(), 0, 1e-9);
}

static void the_order_of_the_pictures_does_not_matter(void **state)
{
    (void)state;
    for (int i = 0; i < 4 * SIDE * SIDE; i++) {
        a[i] = (float)test_random();
        b[i] = (float)test_random();
    }
    double one, other;
    assert_int_equal(accuracy_flip(a, b, SIDE, SIDE, budget, &one), 0);
    assert_int_equal(accuracy_flip(b, a, SIDE, SIDE, budget, &other), 0);
    assert_true(one > 0 && one <= 1);
    assert_close(one, other, 1e-12);
}

static void too_little_memory_is_reported(void **state)
{
    (void)state;
    trip_budget *small;
    double out;
    assert_int_equal(trip_budget_create(&small, 4096), 0);
    test_catch_reports();
    assert_int_equal(accuracy_flip(a, b, SIDE, SIDE, small, &out), TRIP_ERROR);
    assert_one_report("--memory");
    trip_budget_destroy(small);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_picture_does_not_differ_from_itself),
        cmocka_unit_test(black_and_white_differ_by_a_lightness_of_100),
        cmocka_unit_test(greys_differ_by_lightness),
        cmocka_unit_test(green_and_blue_have_the_maximum_distance),
        cmocka_unit_test(colours_are_clamped),
        cmocka_unit_test(the_order_of_the_pictures_does_not_matter),
        cmocka_unit_test(too_little_memory_is_reported),
    };
    if (trip_budget_create(&budget, 1 << 24))
        return 1;
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    trip_budget_destroy(budget);
    return failed;
}
