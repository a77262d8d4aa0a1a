/* Compares segments of transfer functions with closed forms and with sums of many small steps. */
#include "test.h"

#include "segments.h"

enum { LAST = TRIP_SEGMENT_CODES - 1 };

static trip_tf_entry table[TRIP_SEGMENT_CODES];
static trip_segments segments;

static void make(trip_tf_entry (*entry)(int code))
{
    for (int code = 0; code <= LAST; code++)
        table[code] = entry(code);
    trip_segments_make(&segments, table);
}

/* Picks two codes. `decades` sets their distance. */
static void pick(int decades, double *a, double *b)
{
    double length = LAST * pow(10, -decades) * (0.1 + 0.9 * test_random());
    *a = (LAST - length) * test_random();
    *b = *a + length;
}

static trip_tf_entry constant(int code)
{
    (void)code;
    return (trip_tf_entry){ 0.25F, 0.5F, 1, 0.375F };
}

static void a_constant_function_has_its_own_mean(void **state)
{
    (void)state;
    make(constant);
    for (int i = 0; i < 400; i++) {
        double a, b;
        pick(i % 14, &a, &b);
        trip_segment s =
            i % 2 ? trip_segment_of(&segments, a, b) : trip_segment_of(&segments, b, a);
        assert_close(s.extinction, 0.375, 1e-14);
        assert_close(s.rgb[0], 0.25, 1e-14);
        assert_close(s.rgb[1], 0.5, 1e-14);
        assert_close(s.rgb[2], 1, 1e-14);
    }
}

static trip_tf_entry ramp(int code)
{
    return (trip_tf_entry){ (float)code / 65536, 1 - (float)code / 65536, 0, (float)code / 1024 };
}

/* Means over [a, b] of v and of v squared. */
static void a_ramp_has_the_means_of_polynomials_at_any_code_distance(void **state)
{
    (void)state;
    make(ramp);
    for (int i = 0; i < 2000; i++) {
        double a, b;
        pick(i % 20, &a, &b);
        double mean = (a + b) / 2, square = (a * a + a * b + b * b) / 3;
        trip_segment up = trip_segment_of(&segments, a, b), down = trip_segment_of(&segments, b, a);
        assert_close(up.extinction * 1024 / mean, 1, 1e-12);
        assert_close(up.rgb[0] / (square / mean / 65536), 1, 1e-12);
        assert_close(up.rgb[1], 1 - square / mean / 65536, 1e-12);
        assert_true(up.rgb[2] == 0);
        assert_close(down.extinction, up.extinction, 1e-15);
        assert_close(down.rgb[0], up.rgb[0], 1e-15);
    }
}

/* Red below 1000, transparent from 1001 to 2000, blue from 2001 on. */
static trip_tf_entry steps(int code)
{
    return (trip_tf_entry){ code <= 1000, 0, code > 1000, code <= 1000 ? 2 : code > 2000 ? 4 : 0 };
}

static void a_step_counts_for_the_part_beyond_it(void **state)
{
    (void)state;
    make(steps);
    /* From 1000 to 1001 extinction falls by 2 and red by 1, with integrals 1 and 2/3. Blue rises
     * there, and its product with extinction has the integral 1/3. From 2000 to 2001 blue is 1 and
     * extinction rises by 4. */
    trip_segment s = trip_segment_of(&segments, 400.5, 1500);
    assert_close(s.extinction, (2 * 599.5 + 1) / 1099.5, 1e-13);
    assert_close(s.rgb[0], (2 * 599.5 + 2.0 / 3) / (2 * 599.5 + 1), 1e-13);
    assert_close(s.rgb[2], 1.0 / 3 / (2 * 599.5 + 1), 1e-13);

    s = trip_segment_of(&segments, 1001, 2000);
    assert_true(s.extinction == 0);
    s = trip_segment_of(&segments, 3000, 1999);
    assert_close(s.extinction, (4 * 999 + 2) / 1001.0, 1e-13);
    assert_close(s.rgb[2], 1, 1e-13);
}

static int peak;

static trip_tf_entry triangle(int code)
{
    return (trip_tf_entry){ 1, 0, 0, code == peak ? 3 : 0 };
}

static void a_peak_of_one_code_counts_fully_at_any_position(void **state)
{
    (void)state;
    const int peaks[] = { 1, 2, 255, 256, 32767, 32768, 40000, 65533, 65534 };
    for (int i = 0; i < 9; i++) {
        peak = peaks[i];
        make(triangle);
        trip_segment s = trip_segment_of(&segments, 0, LAST);
        assert_close(s.extinction * LAST, 3, 1e-13);
        s = trip_segment_of(&segments, peak - 0.5, peak + 0.75);
        assert_close(s.extinction * 1.25, 3 * (0.375 + 15.0 / 32), 1e-13);
        s = trip_segment_of(&segments, peak + 0.5, peak + 1);
        assert_close(s.extinction, 0.75, 1e-13);
    }
}

static trip_tf_entry rough(int code)
{
    (void)code;
    return (trip_tf_entry){ (float)test_random(), (float)test_random(), (float)test_random(),
                            (float)fmax(0, 3 * test_random() - 1) };
}

/* Sums the midpoints of `steps` steps between neighbouring codes. */
static trip_segment sum_up(double a, double b)
{
    enum { STEPS = 200 };
    trip_segment s = { 0 };
    for (double from = a, to; from < b; from = to) {
        to = fmin(b, floor(from) + 1);
        for (int n = 0; n < STEPS; n++) {
            double v = from + (to - from) * (n + 0.5) / STEPS, dv = (to - from) / STEPS;
            const trip_tf_entry *e = &table[(int)v];
            double t = v - floor(v), k = (1 - t) * e[0].extinction + t * e[1].extinction;
            s.extinction += k * dv;
            s.rgb[0] += k * dv * ((1 - t) * e[0].r + t * e[1].r);
            s.rgb[1] += k * dv * ((1 - t) * e[0].g + t * e[1].g);
            s.rgb[2] += k * dv * ((1 - t) * e[0].b + t * e[1].b);
        }
    }
    for (int c = 0; c < 3; c++)
        s.rgb[c] /= s.extinction;
    s.extinction /= b - a;
    return s;
}

static void a_rough_function_equals_the_sum_of_many_small_steps(void **state)
{
    (void)state;
    make(rough);
    for (int i = 0; i < 300; i++) {
        double a, b;
        pick(2 + i % 5, &a, &b);
        trip_segment expected = sum_up(a, b), s = trip_segment_of(&segments, a, b);
        assert_close(s.extinction, expected.extinction, 1e-4);
        if (!(expected.extinction > 1e-3))
            continue;
        for (int c = 0; c < 3; c++)
            assert_close(s.rgb[c], expected.rgb[c], 1e-4);
    }
}

/* t (1 - t) has the integral 1/6, t^2 1/3. */
static void products_of_linear_functions_are_integrated_exactly(void **state)
{
    (void)state;
    assert_close(trip_segment_product(0, 1, 1, 0), 1.0 / 6, 1e-16);
    assert_close(trip_segment_product(0, 1, 0, 1), 1.0 / 3, 1e-16);
    assert_close(trip_segment_product(2, 2, 1, 4), 5, 1e-15);
}

static void one_code_has_the_transfer_function_between_entries(void **state)
{
    (void)state;
    make(ramp);
    trip_segment s = trip_segment_of(&segments, 1024.25, 1024.25);
    assert_close(s.extinction, 1024.25 / 1024, 1e-15);
    assert_close(s.rgb[0], 1024.25 / 65536, 1e-15);
    s = trip_segment_of(&segments, LAST, LAST);
    assert_close(s.extinction, LAST / 1024.0, 1e-15);
    s = trip_segment_of(&segments, 0, 0);
    assert_true(s.extinction == 0);
}

/* Returns the integral of extinction of the ramp, and of extinction times red, from code 0. */
static double whole_k(double code)
{
    return code * code / 2 / 1024;
}

static double whole_kr(double code)
{
    return code * code * code / 3 / 1024 / 65536;
}

static void the_function_is_constant_beyond_its_ends(void **state)
{
    (void)state;
    make(ramp);
    const double last_k = LAST / 1024.0, last_kr = last_k * LAST / 65536;
    const double ends[][2] = { { -1000, 1000 },  { -3e6, 60000.5 },    { -1e15, 1e15 },
                               { 65000, 66535 }, { 65534.5, 7e8 },     { 65535, 65536 },
                               { 70000, 80000 }, { 65536.5, 65536.5 }, { -0.5, 65535.5 } };
    for (int i = 0; i < 9; i++) {
        const double a = ends[i][0], b = ends[i][1], length = b - a;
        const double from = fmin(LAST, fmax(0, a)), to = fmin(LAST, fmax(0, b));
        const double above = length > 0 ? fmax(0, b - fmax(a, LAST)) / length : 1;
        double k = above * last_k, kr = above * last_kr;
        if (to > from) {
            k += (whole_k(to) - whole_k(from)) / length;
            kr += (whole_kr(to) - whole_kr(from)) / length;
        }
        const trip_segment s = trip_segment_of(&segments, a, b),
                           t = trip_segment_of(&segments, b, a);
        assert_close(s.extinction / k, 1, 1e-9);
        assert_close(s.rgb[0] / (kr / k), 1, 1e-9);
        assert_true(s.extinction == t.extinction && s.rgb[0] == t.rgb[0]);
    }
    const trip_segment s = trip_segment_of(&segments, -200, -100);
    assert_true(s.extinction == 0 && s.rgb[0] == 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_constant_function_has_its_own_mean),
        cmocka_unit_test(a_ramp_has_the_means_of_polynomials_at_any_code_distance),
        cmocka_unit_test(a_step_counts_for_the_part_beyond_it),
        cmocka_unit_test(a_peak_of_one_code_counts_fully_at_any_position),
        cmocka_unit_test(a_rough_function_equals_the_sum_of_many_small_steps),
        cmocka_unit_test(products_of_linear_functions_are_integrated_exactly),
        cmocka_unit_test(one_code_has_the_transfer_function_between_entries),
        cmocka_unit_test(the_function_is_constant_beyond_its_ends),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
