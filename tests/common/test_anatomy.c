#include "test.h"

#include "anatomy.h"

static void assert_vec(trip_vec3 actual, double x, double y, double z)
{
    assert_close(actual.x, x, 0);
    assert_close(actual.y, y, 0);
    assert_close(actual.z, z, 0);
}

static void only_lps_and_ras_are_conventions(void **state)
{
    (void)state;
    char ends[4];
    const char *const none[] = { "", "LAS", "RPS", "ras", "RASX", "RA", "PLS", "\n", NULL };
    assert_true(trip_anatomy_known("LPS"));
    assert_true(trip_anatomy_known("RAS"));
    for (size_t i = 0; i < sizeof none / sizeof none[0]; i++) {
        assert_false(trip_anatomy_known(none[i]));
        assert_vec(trip_anatomy_direction(none[i], 'S'), 0, 0, 0);
        assert_string_equal(trip_anatomy_ends(none[i], trip_v3(1, 0, 0), ends), "");
    }
}

static void directions_of_the_ends_of_the_body_follow_the_convention(void **state)
{
    (void)state;
    assert_vec(trip_anatomy_direction("LPS", 'L'), 1, 0, 0);
    assert_vec(trip_anatomy_direction("LPS", 'R'), -1, 0, 0);
    assert_vec(trip_anatomy_direction("LPS", 'A'), 0, -1, 0);
    assert_vec(trip_anatomy_direction("LPS", 'P'), 0, 1, 0);
    assert_vec(trip_anatomy_direction("LPS", 'S'), 0, 0, 1);
    assert_vec(trip_anatomy_direction("LPS", 'I'), 0, 0, -1);
    assert_vec(trip_anatomy_direction("RAS", 'L'), -1, 0, 0);
    assert_vec(trip_anatomy_direction("RAS", 'R'), 1, 0, 0);
    assert_vec(trip_anatomy_direction("RAS", 'A'), 0, 1, 0);
    assert_vec(trip_anatomy_direction("RAS", 'S'), 0, 0, 1);
    assert_vec(trip_anatomy_direction("RAS", 'x'), 0, 0, 0);
    assert_vec(trip_anatomy_direction("RAS", '\0'), 0, 0, 0);
}

/* In a right-handed space, the patient's left is the cross product of up and forward. */
static void both_conventions_are_right_handed(void **state)
{
    (void)state;
    const char *const spaces[] = { "LPS", "RAS" };
    for (int i = 0; i < 2; i++) {
        trip_vec3 left = trip_cross(trip_anatomy_direction(spaces[i], 'S'),
                                    trip_anatomy_direction(spaces[i], 'A'));
        trip_vec3 expected = trip_anatomy_direction(spaces[i], 'L');
        assert_vec(left, expected.x, expected.y, expected.z);
    }
}

static void vectors_are_named_by_the_ends_they_point_to(void **state)
{
    (void)state;
    char ends[4], words[TRIP_ANATOMY_WORDS];
    const double c = cos(0.3490658503988659), s = sin(0.3490658503988659); /* 20 degrees */
    assert_string_equal(trip_anatomy_ends("LPS", trip_v3(0.5, 0, 0), ends), "L");
    assert_string_equal(trip_anatomy_words("LPS", trip_v3(0.5, 0, 0), words), "left");
    assert_string_equal(trip_anatomy_ends("RAS", trip_v3(-3, 1, 2), ends), "LSA");
    assert_string_equal(trip_anatomy_ends("LPS", trip_v3(0, 5 * s, 5 * c), ends), "SP");
    assert_string_equal(trip_anatomy_words("LPS", trip_v3(0, 5 * s, 5 * c), words),
                        "superior, 20 degrees to posterior");
    assert_string_equal(trip_anatomy_words("RAS", trip_v3(-1, -1, -1), words),
                        "left, 54.7 degrees to posterior and inferior");
    assert_string_equal(trip_anatomy_ends("LPS", trip_v3(1, 1e-9, 0), ends), "L");
    assert_string_equal(trip_anatomy_ends("LPS", trip_v3(0, 0, 0), ends), "");
    assert_string_equal(trip_anatomy_words("LPS", trip_v3(NAN, 0, 0), words), "");
}

static void scans_from_above_have_straight_axes_and_thick_slices(void **state)
{
    (void)state;
    static const double along[][4] = {
        { 1, 1, 3, true },  { 2, 2, 1, true },  { 1, 1, 1.5, true }, { 1, 1, 1.49, false },
        { 1, 1, 1, false }, { 0, 1, 3, false }, { -1, 1, 3, false }, { 1, 1, -3, false },
    };
    trip_affine m;
    for (size_t i = 0; i < sizeof along / sizeof *along; i++) {
        m = trip_affine_identity();
        for (int a = 0; a < 3; a++)
            m.m[a][a] = along[i][a];
        assert_int_equal(trip_anatomy_is_scan_from_above(&m), along[i][3] > 0);
    }
    for (int n = 0; n < 12; n++) { /* sheared or moved */
        m = (trip_affine){ { { 1, 0, 0, 0 }, { 0, 1, 0, 0 }, { 0, 0, 3, 0 } } };
        if (n / 4 == n % 4)
            continue;
        m.m[n / 4][n % 4] = 0.1;
        assert_false(trip_anatomy_is_scan_from_above(&m));
    }
}

static void axes_name_one_end_of_each_pair(void **state)
{
    (void)state;
    static const char *const good[] = { "PIR", "LPS", "RAS", "SAL", "IRA" };
    static const char *const bad[] = { "",    "P",   "PI",  "PIRR", "PAR", "LRS", "SIA",
                                       "pir", "XYZ", "PI ", "PIR ", "LL",  "AAA" };
    for (size_t i = 0; i < sizeof good / sizeof *good; i++)
        assert_true(trip_anatomy_axes_valid(good[i]));
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++)
        assert_false(trip_anatomy_axes_valid(bad[i]));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(only_lps_and_ras_are_conventions),
        cmocka_unit_test(directions_of_the_ends_of_the_body_follow_the_convention),
        cmocka_unit_test(both_conventions_are_right_handed),
        cmocka_unit_test(vectors_are_named_by_the_ends_they_point_to),
        cmocka_unit_test(scans_from_above_have_straight_axes_and_thick_slices),
        cmocka_unit_test(axes_name_one_end_of_each_pair),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
