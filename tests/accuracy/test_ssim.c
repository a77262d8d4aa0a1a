/* Tests SSIM with pictures of known means, variances and covariance. */
#include "ssim.h"
#include "test.h"

enum { SIDE = 40 };

static trip_budget *budget;

static double ssim(const float *a, const float *b, int width, int height)
{
    double out = -2;
    assert_int_equal(accuracy_ssim(a, b, width, height, budget, &out), 0);
    return out;
}

static void fill(float *rgba, double (*at)(int x, int y))
{
    for (int i = 0; i < SIDE * SIDE; i++) {
        for (int c = 0; c < 3; c++)
            rgba[4 * i + c] = (float)at(i % SIDE, i / SIDE);
        rgba[4 * i + 3] = 1;
    }
}

static double bright(int x, int y)
{
    (void)x;
    (void)y;
    return 0.8;
}

static double dark(int x, int y)
{
    (void)x;
    (void)y;
    return 0.2;
}

/* The variance in any window equals the variance of the whole board, except for the small sum of
 * the weights with alternating signs. */
static double board(int x, int y)
{
    return (x + y) % 2 ? 0.9 : 0.1;
}

static double inverse_board(int x, int y)
{
    return 1 - board(x, y);
}

static float a[4 * SIDE * SIDE], b[4 * SIDE * SIDE];

static void a_picture_is_similar_to_itself(void **state)
{
    (void)state;
    fill(a, board);
    assert_close(ssim(a, a, SIDE, SIDE), 1, 1e-9);
}

/* The picture is one window with a single white pixel, in the middle. If w is the weight of this
 * pixel, the means are w and 0, the variances are w - w^2 and 0, and the covariance is 0. */
static void windows_have_gaussian_weights_of_1_5_pixels(void **state)
{
    (void)state;
    double sum = 0;
    for (int i = -5; i <= 5; i++)
        sum += exp(-i * i / (2 * 1.5 * 1.5));
    const double w = 1 / (sum * sum);
    float one[4 * 11 * 11] = { 0 }, other[4 * 11 * 11] = { 0 };
    for (int c = 0; c < 4; c++)
        one[4 * (5 * 11 + 5) + c] = 1;
    assert_close(ssim(one, other, 11, 11), 1e-4 * 9e-4 / ((w * w + 1e-4) * (w - w * w + 9e-4)),
                 1e-7);
}

/* The pictures have no variance, so that only the means count. */
static void uniform_pictures_differ_by_their_means(void **state)
{
    (void)state;
    fill(a, bright);
    fill(b, dark);
    assert_close(ssim(a, b, SIDE, SIDE), (2 * 0.8 * 0.2 + 1e-4) / (0.64 + 0.04 + 1e-4), 1e-5);
}

/* A board and its inverse have the mean 1/2, the variance 0.16 and the covariance -0.16. The
 * figures are off by 0.4 times the square of the sum of the weights with alternating signs. This
 * sum is exp(-(pi sigma)^2/2), or 1e-5, along each side. */
static void inverse_pictures_are_dissimilar(void **state)
{
    (void)state;
    fill(a, board);
    fill(b, inverse_board);
    assert_close(ssim(a, b, SIDE, SIDE), (-0.32 + 9e-4) / (0.32 + 9e-4), 1e-4);
}

/* A window must lie within the picture. */
static void pictures_smaller_than_a_window_have_no_ssim(void **state)
{
    (void)state;
    fill(a, board);
    assert_true(isnan(ssim(a, a, 10, 40)));
    assert_close(ssim(a, a, 11, 11), 1, 1e-9);
}

static void too_little_memory_is_reported(void **state)
{
    (void)state;
    trip_budget *small;
    double out;
    assert_int_equal(trip_budget_create(&small, 4096), 0);
    test_catch_reports();
    assert_int_equal(accuracy_ssim(a, b, SIDE, SIDE, small, &out), TRIP_ERROR);
    assert_one_report("--memory");
    trip_budget_destroy(small);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_picture_is_similar_to_itself),
        cmocka_unit_test(windows_have_gaussian_weights_of_1_5_pixels),
        cmocka_unit_test(uniform_pictures_differ_by_their_means),
        cmocka_unit_test(inverse_pictures_are_dissimilar),
        cmocka_unit_test(pictures_smaller_than_a_window_have_no_ssim),
        cmocka_unit_test(too_little_memory_is_reported),
    };
    if (trip_budget_create(&budget, 1 << 24))
        return 1;
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    trip_budget_destroy(budget);
    return failed;
}
