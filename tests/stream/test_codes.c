/* Tests the values of codes. */
#include "fixture.h"

#include <math.h>
#include <stdlib.h>

#include "codes.h"

static void even_codes_span_their_range(void **state)
{
    (void)state;
    const trip_codes c = { .lo = -10, .hi = 10 };
    assert_true(trip_codes_even(&c) && !trip_codes_ids(&c));
    assert_true(trip_codes_value(&c, 0) == -10 && trip_codes_value(&c, 65535) == 10);
    assert_true(fabs(trip_codes_value(&c, 32767.5)) < 1e-12);
    assert_true(trip_codes_code(&c, 0) == 32767.5);
    assert_true(trip_codes_code(&c, -11) == 0 && trip_codes_code(&c, 1e300) == 65535);
    assert_true(trip_codes_code(&c, NAN) == 0);
    const trip_codes flat = { .lo = 3, .hi = 3 };
    assert_true(trip_codes_code(&flat, 3) == 0 && trip_codes_value(&flat, 9) == 3);
}

/* The first 256 codes cover 0 to 1, the others 1 to 1e6. */
static void knots_give_dense_values_finer_codes(void **state)
{
    (void)state;
    const double table[3] = { 0, 1, 1e6 };
    const trip_codes c = trip_codes_from_table(table, 3, 8);
    assert_true(!trip_codes_even(&c) && !trip_codes_ids(&c));
    assert_true(trip_codes_value(&c, 128) == 0.5 && trip_codes_code(&c, 0.5) == 128);
    assert_true(trip_codes_value(&c, 256) == 1 && trip_codes_code(&c, 1) == 256);
    assert_true(trip_codes_value(&c, 384) == 1 + (1e6 - 1) / 2);
    assert_true(trip_codes_value(&c, 512) == 1e6 && trip_codes_value(&c, 65535) == 1e6);
    assert_true(trip_codes_code(&c, 1e6) == 512 && trip_codes_code(&c, 1e7) == 512);
    assert_true(c.lo == 0 && c.hi == 1e6);
    /* Between codes 256 and 257 the nearest value decides, not the nearest code of an even scale.
     */
    const double step = (1e6 - 1) / 256;
    assert_int_equal(trip_codes_nearest(&c, 1 + 0.49 * step), 256);
    assert_int_equal(trip_codes_nearest(&c, 1 + 0.51 * step), 257);
}

static void ids_are_exact(void **state)
{
    (void)state;
    const double table[4] = { 0, 1, 100000, 4000000000.0 };
    const trip_codes c = trip_codes_from_table(table, 4, 0);
    assert_true(trip_codes_ids(&c));
    for (unsigned i = 0; i < 4; i++) {
        assert_true(trip_codes_value(&c, i) == table[i]);
        assert_int_equal(trip_codes_nearest(&c, table[i]), i);
    }
    assert_true(trip_codes_value(&c, 700) == 4000000000.0);
}

/* Values of random tables come back: codes of values of codes are the codes. */
static void codes_and_values_are_inverse(void **state)
{
    (void)state;
    double table[257];
    srand(7);
    table[0] = -5;
    for (int i = 1; i < 257; i++)
        table[i] = table[i - 1] + ldexp(1 + rand() % 7, rand() % 40 - 20);
    assert_null(trip_codes_fault(table, 257, 8));
    const trip_codes c = trip_codes_from_table(table, 257, 8);
    for (unsigned code = 0; code < TRIP_CODES; code++) {
        const double value = trip_codes_value(&c, code);
        assert_true(code == 0 || value > trip_codes_value(&c, code - 1));
        assert_int_equal(trip_codes_nearest(&c, value), code);
    }
}

static void wrong_tables_are_refused(void **state)
{
    (void)state;
    const double ascending[3] = { 0, 1, 2 }, descending[3] = { 0, 2, 1 }, constant[2] = { 4, 4 };
    const double wide[2] = { -1e308, 1e308 }, infinite[2] = { 0, INFINITY }, nan[1] = { NAN };
    assert_null(trip_codes_fault(ascending, 3, 0));
    assert_null(trip_codes_fault(ascending, 3, 15));
    assert_non_null(trip_codes_fault(ascending, 3, 16)); /* entry 2 lies behind code 65536 */
    assert_non_null(trip_codes_fault(ascending, 2, 17));
    assert_non_null(trip_codes_fault(ascending, 0, 0));
    assert_non_null(trip_codes_fault(descending, 3, 0));
    assert_non_null(trip_codes_fault(constant, 2, 0));
    assert_non_null(trip_codes_fault(wide, 2, 0));
    assert_non_null(trip_codes_fault(infinite, 2, 0));
    assert_non_null(trip_codes_fault(nan, 1, 0));
    assert_null(trip_codes_fault(constant, 1, 0));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(even_codes_span_their_range),
        cmocka_unit_test(knots_give_dense_values_finer_codes),
        cmocka_unit_test(ids_are_exact),
        cmocka_unit_test(codes_and_values_are_inverse),
        cmocka_unit_test(wrong_tables_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
