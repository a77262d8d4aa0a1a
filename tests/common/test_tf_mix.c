#include "test.h"

#include "transfer_function.h"

static trip_tf *parse(const char *text)
{
    trip_tf *tf;
    assert_int_equal(trip_tf_parse(&tf, "test", text, strlen(text)), 0);
    return tf;
}

#define A "0 0 0 0 0\n2 1 0.5 0 0.8\n2 0 0 1 0.4\n5 1 1 1 0.1\n"
#define B "-1 1 1 1 0.2\n1 0 0 0 0.6\n3 0.5 0.5 0.5 1\n3 0 1 0 0\n"

static void a_mix_is_linear_at_every_value(void **state)
{
    (void)state;
    trip_tf *a = parse(A), *b = parse(B), *m;
    static const double shares[] = { 0.25, 0.5, 0.9 };
    for (int s = 0; s < 3; s++) {
        double t = shares[s];
        assert_int_equal(trip_tf_mix(&m, a, b, t), 0);
        for (double value = -2; value <= 6; value += 0.125) {
            trip_rgba p = trip_tf_evaluate(a, value), q = trip_tf_evaluate(b, value);
            trip_rgba got = trip_tf_evaluate(m, value);
            assert_close(got.r, (1 - t) * p.r + t * q.r, 1e-14);
            assert_close(got.g, (1 - t) * p.g + t * q.g, 1e-14);
            assert_close(got.b, (1 - t) * p.b + t * q.b, 1e-14);
            assert_close(got.opacity, (1 - t) * p.opacity + t * q.opacity, 1e-14);
        }
        /* The values are just below the steps. */
        assert_close(trip_tf_evaluate(m, 2 - 1e-9).opacity, (1 - t) * 0.8 + t * 0.8, 1e-8);
        assert_close(trip_tf_evaluate(m, 3 - 1e-9).opacity, (1 - t) * 0.3 + t * 1, 1e-8);
        trip_tf_destroy(m);
    }
    trip_tf_destroy(a);
    trip_tf_destroy(b);
}

static void a_mix_of_0_or_1_equals_one_of_the_functions(void **state)
{
    (void)state;
    trip_tf *a = parse(A), *b = parse(B), *m;
    for (int end = 0; end < 2; end++) {
        assert_int_equal(trip_tf_mix(&m, a, b, end), 0);
        for (double value = -2; value <= 6; value += 0.125) {
            trip_rgba p = trip_tf_evaluate(end ? b : a, value), got = trip_tf_evaluate(m, value);
            assert_close(got.opacity, p.opacity, 1e-15);
            assert_close(got.g, p.g, 1e-15);
        }
        trip_tf_destroy(m);
    }
    trip_tf_destroy(a);
    trip_tf_destroy(b);
}

static void opacities_of_different_units_are_not_mixed(void **state)
{
    (void)state;
    trip_tf *a = parse(A), *b = parse("unit 2\n" A), *n = parse("values normalised\n0 0 0 0 0\n");
    trip_tf *m;
    test_catch_reports();
    assert_int_equal(trip_tf_mix(&m, a, b, 0.5), TRIP_ERROR);
    assert_one_report("different units");
    assert_null(m);
    test_catch_reports();
    assert_int_equal(trip_tf_mix(&m, a, n, 0.5), TRIP_ERROR);
    assert_one_report("different units");
    trip_tf_destroy(a);
    trip_tf_destroy(b);
    trip_tf_destroy(n);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_mix_is_linear_at_every_value),
        cmocka_unit_test(a_mix_of_0_or_1_equals_one_of_the_functions),
        cmocka_unit_test(opacities_of_different_units_are_not_mixed),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
