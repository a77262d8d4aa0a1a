/* Tests the error figures with pictures made by hand. The expected figures are computed by hand. */
#include "error.h"
#include "test.h"

enum { PIXELS = 200 };

/* The first half of the pixels is grey and translucent. The other half is empty. */
static void make_picture(float rgba[PIXELS * 4])
{
    for (int i = 0; i < PIXELS * 4; i++)
        rgba[i] = i < PIXELS * 2 ? 0.5F : 0;
}

static void a_picture_has_no_error_against_itself(void **state)
{
    (void)state;
    static measure_error e;
    float picture[PIXELS * 4];
    make_picture(picture);
    measure_error_add(&e, picture, picture, PIXELS);
    const measure_error_figures f = measure_error_measure(&e);
    assert_int_equal(e.count, PIXELS * 2);
    assert_true(f.median == 0 && f.mean == 0 && f.percentile_99 == 0 && f.max == 0);
    assert_true(isinf(f.psnr) && f.psnr > 0);
}

/* 400 channels are covered. 238 of them are off by 3, and 2 are off by 51. */
static void errors_made_by_hand_have_the_expected_figures(void **state)
{
    (void)state;
    static measure_error e;
    float picture[PIXELS * 4], truth[PIXELS * 4];
    make_picture(picture);
    make_picture(truth);
    for (int i = 0; i < 240; i++)
        picture[i] += (i % 2 ? 3.0F : -3.0F) / 255;
    picture[0] = picture[101] = 0.5F + 51.0F / 255;
    measure_error_add(&e, picture, truth, PIXELS);
    const measure_error_figures f = measure_error_measure(&e);
    assert_close(f.median, 3, 1e-6);
    assert_close(f.mean, (238 * 3 + 2 * 51) / 400.0, 1e-5);
    assert_close(f.percentile_99, 3, 1e-6);
    assert_close(f.max, 51, 1e-5);
    assert_close(f.psnr, 10 * log10(255.0 * 255 * 400 / (238 * 9 + 2 * 51.0 * 51)), 1e-5);
}

/* The 99th percentile is the smallest error that 198 of 200 channels do not exceed. */
static void the_percentile_is_an_error_that_99_percent_do_not_exceed(void **state)
{
    (void)state;
    for (int off = 2; off <= 3; off++) {
        measure_error *e = calloc(1, sizeof *e);
        float picture[200], truth[200];
        assert_non_null(e);
        for (int i = 0; i < 200; i++)
            truth[i] = picture[i] = 0.5F;
        for (int i = 0; i < off; i++)
            picture[70 * i] += 51.0F / 255;
        measure_error_add(e, picture, truth, 50);
        assert_close(measure_error_measure(e).percentile_99, off == 2 ? 0 : 51, 1e-6);
        free(e);
    }
}

static void colour_and_alpha_are_counted_separately(void **state)
{
    (void)state;
    static measure_error colour, alpha;
    const float truth[8] = { 0.2F, 0.2F, 0.2F, 1, 0, 0, 0, 0 };
    const float picture[8] = { 0.2F + 6.0F / 255, 0.2F, 0.2F, 1 - 5.0F / 255, 1, 1, 1, 0 };
    measure_error_add_apart(&colour, &alpha, picture, truth, 2);
    assert_int_equal(colour.count, 3);
    assert_int_equal(alpha.count, 1);
    assert_close(measure_error_measure(&colour).mean, 2, 1e-5);
    assert_close(measure_error_measure(&alpha).mean, 5, 1e-5);
}

static void pixels_count_if_either_picture_covers_them(void **state)
{
    (void)state;
    static measure_error e;
    float covered[4] = { 0.2F, 0, 0, 1 }, empty[4] = { 0 }, faint[4] = { 0, 0, 0, 0.9F / 255 };
    measure_error_add(&e, covered, empty, 1);
    measure_error_add(&e, empty, covered, 1);
    assert_int_equal(e.count, 8);
    measure_error_add(&e, faint, empty, 1);
    assert_int_equal(e.count, 8);
    const measure_error_figures f = measure_error_measure(&e);
    assert_close(f.mean, (51 + 255) / 4.0, 1e-5);
    assert_close(f.max, 255, 1e-6);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_picture_has_no_error_against_itself),
        cmocka_unit_test(errors_made_by_hand_have_the_expected_figures),
        cmocka_unit_test(the_percentile_is_an_error_that_99_percent_do_not_exceed),
        cmocka_unit_test(colour_and_alpha_are_counted_separately),
        cmocka_unit_test(pixels_count_if_either_picture_covers_them),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
