/* Turning points and positions of values of polynomials that are built from the expected results.
 */
#include "polynomial.h"
#include "test.h"

/* Multiplies a polynomial by (x - root). */
static void multiply(trip_polynomial *p, double root)
{
    p->c[++p->degree] = 0;
    for (int i = p->degree; i > 0; i--)
        p->c[i] = p->c[i - 1] - root * p->c[i];
    p->c[0] *= -root;
}

static trip_polynomial integral(const trip_polynomial *p)
{
    trip_polynomial out = { .degree = p->degree + 1 };
    for (int i = 0; i <= p->degree; i++)
        out.c[i + 1] = p->c[i] / (i + 1);
    return out;
}

static void polynomials_turn_where_their_slope_changes_sign(void **state)
{
    (void)state;
    /* The roots of the slope. Roots in (0, 1) come first, in ascending order. */
    static const struct {
        double roots[8];
        int inside, count;
    } cases[] = {
        { { 0.5 }, 1, 1 },
        { { -1, 2 }, 0, 2 },
        { { 0.25, 0.75 }, 2, 2 },
        { { 0.5, 3 }, 1, 2 },
        { { 0.1, 0.5, 0.9 }, 3, 3 },
        { { 0.3, 0.31, 0.7, -0.2, 1.4 }, 3, 5 },
        { { 0.05, 0.2, 0.35, 0.5, 0.6, 0.72, 0.85, 0.97 }, 8, 8 },
    };
    for (size_t n = 0; n < sizeof cases / sizeof cases[0]; n++) {
        trip_polynomial slope = { .c = { -3 } };
        double turns[TRIP_POLYNOMIAL_DEGREE];
        for (int i = 0; i < cases[n].count; i++)
            multiply(&slope, cases[n].roots[i]);
        const trip_polynomial p = integral(&slope);
        assert_int_equal(trip_polynomial_turns(&p, turns), cases[n].inside);
        for (int i = 0; i < cases[n].inside; i++)
            assert_close(turns[i], cases[n].roots[i], 1e-9);
    }
}

static void monotonic_polynomials_have_no_turns(void **state)
{
    (void)state;
    static const trip_polynomial all[] = {
        { .degree = 9, .c = { 5 } },             /* constant */
        { .degree = 3, .c = { 1, -2 } },         /* straight */
        { .degree = 3, .c = { 0, 1, -2, 4 } },   /* 1 - 4 x + 12 x^2 > 0 */
        { .degree = 3, .c = { 0, 0, 0, 1 } },    /* flat at 0 */
        { .degree = 3, .c = { 0, 0, 1.5, -1 } }, /* 3 x (1 - x) */
    };
    double turns[TRIP_POLYNOMIAL_DEGREE];
    for (size_t n = 0; n < sizeof all / sizeof all[0]; n++)
        assert_int_equal(trip_polynomial_turns(&all[n], turns), 0);
}

static void the_position_of_a_value_is_found(void **state)
{
    (void)state;
    /* x^3 and -x^3: the slope is 0 at one end. */
    for (int sign = -1; sign <= 1; sign += 2) {
        const trip_polynomial cube = { .degree = 3, .c = { 2, 0, 0, sign } };
        for (int i = 0; i <= 10; i++) {
            double value = 2 + sign * pow(0.1 * i, 3);
            double found = trip_polynomial_find(&cube, value, 0, 1);
            assert_close(trip_polynomial_at(&cube, found), value, 1e-12);
            if (i > 0)
                assert_close(found, 0.1 * i, 1e-9);
        }
    }
    /* Steep in the centre alone: 3 x^2 - 2 x^3, applied twice. */
    const trip_polynomial s = { .degree = 9, .c = { 0, 0, 0, 0, 27, -36, -42, 108, -72, 16 } };
    for (int i = 0; i <= 20; i++) {
        double x = 0.05 * i, once = x * x * (3 - 2 * x), twice = once * once * (3 - 2 * once);
        assert_close(trip_polynomial_at(&s, x), twice, 1e-12);
        double found = trip_polynomial_find(&s, twice, 0, 1);
        assert_close(trip_polynomial_at(&s, found), twice, 1e-12);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(polynomials_turn_where_their_slope_changes_sign),
        cmocka_unit_test(monotonic_polynomials_have_no_turns),
        cmocka_unit_test(the_position_of_a_value_is_found),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
