#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <cmocka.h>

#include "fields.h"

static double random_coordinate(void)
{
    return 1.98 * rand() / RAND_MAX - 0.99;
}

static trip_vec3 random_position(void)
{
    double x = random_coordinate(), y = random_coordinate();
    return trip_v3(x, y, random_coordinate());
}

static double difference(const trip_field *f, trip_vec3 p, int axis)
{
    const double step = 1e-6;
    trip_vec3 d = { axis == 0 ? step : 0, axis == 1 ? step : 0, axis == 2 ? step : 0 };
    return (f->sample(trip_add(p, d), 1, NULL) - f->sample(trip_sub(p, d), 1, NULL)) / (2 * step);
}

static void values_lie_between_0_and_1(void **state)
{
    (void)state;
    for (const trip_field *f = trip_fields; f->name; f++) {
        for (int n = 0; n < 20000; n++) {
            double v = f->sample(random_position(), 1 + n % 4, NULL);
            assert_true(v >= 0 && v <= 1);
        }
    }
}

/* Second derivatives reach about 1e4, so the error of central differences is about 1e-4. */
static void gradients_agree_with_differences(void **state)
{
    (void)state;
    for (const trip_field *f = trip_fields; f->name; f++) {
        for (int n = 0; n < 2000; n++) {
            trip_vec3 p = random_position(), g;
            f->sample(p, 1, &g);
            for (int axis = 0; axis < 3; axis++) {
                double expected = difference(f, p, axis), got = trip_component(g, axis);
                assert_true(fabs(got - expected) < 1e-3 * (1 + fabs(expected)));
            }
        }
    }
}

static void filaments_are_sparse_and_marschner_lobb_is_dense(void **state)
{
    (void)state;
    int filled = 0, dense = 0;
    for (int n = 0; n < 20000; n++) {
        trip_vec3 p = random_position();
        filled += trip_field_find("filaments")->sample(p, 1, NULL) > 0;
        dense += trip_field_find("marschner-lobb")->sample(p, 1, NULL) > 0;
    }
    assert_true(filled > 20 && filled < 600);
    assert_true(dense > 19900);
}

/* On the central axis, r = 0, the formula gives (1 - sin(pi z / 2) + alpha (1 + cos(2 pi f_M))) /
 * (2 (1 + alpha)). */
static void marschner_lobb_has_its_published_values(void **state)
{
    (void)state;
    const trip_field *f = trip_field_find("marschner-lobb");
    assert_true(fabs(f->sample(trip_v3(0, 0, 0), 1, NULL) - 1.5 / 2.5) < 1e-12);
    assert_true(fabs(f->sample(trip_v3(0, 0, 1), 1, NULL) - 0.5 / 2.5) < 1e-12);
    assert_true(fabs(f->sample(trip_v3(0, 0, -1), 1, NULL) - 1) < 1e-12);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(values_lie_between_0_and_1),
        cmocka_unit_test(gradients_agree_with_differences),
        cmocka_unit_test(filaments_are_sparse_and_marschner_lobb_is_dense),
        cmocka_unit_test(marschner_lobb_has_its_published_values),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
