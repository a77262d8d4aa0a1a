/* Compares blurred transfer functions with direct quadrature of the normal distribution. */
#include "test.h"

#include "blurred_function.h"

enum { LAST = TRIP_SEGMENT_CODES - 1 };

static trip_tf_entry table[TRIP_SEGMENT_CODES];
static trip_segments plain;
static trip_blurred_function blurred;
static trip_budget *budget;

static int setup(void **state)
{
    (void)state;
    return trip_budget_create(&budget, 64 << 20);
}

static int teardown(void **state)
{
    (void)state;
    trip_budget_destroy(budget);
    return 0;
}

static void make(trip_tf_entry (*entry)(int code))
{
    for (int code = 0; code <= LAST; code++)
        table[code] = entry(code);
    trip_segments_make(&plain, table);
    assert_true(trip_blurred_function_create(&blurred, table, budget));
}

static void end(void)
{
    trip_blurred_function_destroy(&blurred, budget);
}

static double entry_at(double code, int channel)
{
    const double at = fmin(LAST, fmax(0, code));
    const int i = at < LAST ? (int)at : LAST - 1;
    const double t = at - i;
    const trip_tf_entry *a = &table[i], *b = a + 1;
    const double k = a->extinction + t * ((double)b->extinction - a->extinction);
    const double q =
        channel == 1 ? a->r + t * ((double)b->r - a->r) : a->g + t * ((double)b->g - a->g);
    return channel == 0 ? k : k * q;
}

/* Integrates with steps of a fraction of a code, or of the deviation if it is large. */
static double direct(double code, double deviation, int channel)
{
    const double step = fmin(0.25, deviation / 64) / deviation;
    double sum = 0, weight = 0;
    for (double t = -TRIP_BLURRED_REACH + step / 2; t < TRIP_BLURRED_REACH; t += step) {
        const double g = exp(-0.5 * t * t);
        sum += g * entry_at(code + deviation * t, channel);
        weight += g;
    }
    return sum / weight;
}

static double greatest(int channel)
{
    double max = 0;
    for (int code = 0; code <= LAST; code++)
        max = fmax(max, entry_at(code, channel));
    return max;
}

/* Compares single codes at the deviations of rows. A segment without length has one code. */
static void compare_with_direct(trip_tf_entry (*entry)(int code))
{
    make(entry);
    const double max = greatest(0);
    for (int row = 1; row < TRIP_BLURRED_ROWS; row = row < 4 ? row + 1 : row + 4)
        for (int i = 0; i < 16; i++) {
            const double code = i < 2 ? i * LAST : LAST * test_random();
            const double d = trip_blurred_d_of_row((unsigned)row);
            const trip_segment s = trip_blurred_segment_of(&blurred, &plain, code, code, d);
            const double at = trip_deviation(d);
            assert_close(s.extinction, direct(code, at, 0), TRIP_BLURRED_ERROR * max);
            assert_close(s.extinction * s.rgb[0], direct(code, at, 1), TRIP_BLURRED_ERROR * max);
        }
    end();
}

static trip_tf_entry step(int code)
{
    return code < 20000 ? (trip_tf_entry){ 0 } : (trip_tf_entry){ 1, 0.5F, 0, 8 };
}

static trip_tf_entry peak(int code)
{
    const float k = code >= 40000 && code < 40512 ? 3 : 0;
    return (trip_tf_entry){ 0.25F, 1, 0, k };
}

static trip_tf_entry stripes(int code)
{
    const float at = (float)(code / 4096 % 2);
    return (trip_tf_entry){ at, 1 - at, 0, 1 + (float)code / 65536 };
}

static trip_tf_entry ramp(int code)
{
    return (trip_tf_entry){ (float)code / 65536, 0.5F, 0, (float)code / 1024 };
}

static void a_step_is_blurred_as_by_quadrature(void **state)
{
    (void)state;
    compare_with_direct(step);
}

static void a_peak_is_blurred_as_by_quadrature(void **state)
{
    (void)state;
    compare_with_direct(peak);
}

static void stripes_are_blurred_as_by_quadrature(void **state)
{
    (void)state;
    compare_with_direct(stripes);
}

static void a_ramp_that_ends_within_reach_is_blurred_as_by_quadrature(void **state)
{
    (void)state;
    compare_with_direct(ramp);
}

/* A step blurred by a normal distribution is its integral, erf. */
static void a_step_becomes_the_error_function(void **state)
{
    (void)state;
    make(step);
    const double deviation = trip_deviation(255.0 * 14 * 14 / (36 * 36));
    for (double t = -3; t <= 3; t += 0.25) {
        const double code = 19999.5 + deviation * t;
        const trip_segment s =
            trip_blurred_segment_of(&blurred, &plain, code, code, 255.0 * 14 * 14 / (36 * 36));
        assert_close(s.extinction, 4 * (1 + erf(t * sqrt(0.5))), 8 * TRIP_BLURRED_ERROR);
        /* Between the codes 19999 and 20000 the colour rises too, and counts less. */
        assert_close(s.rgb[1], s.extinction > 0 ? 0.5 : 0, 3e-3);
    }
    end();
}

/* Between rows the result is linear in the variance, and 0 is the function itself. */
static void rows_are_linear_between(void **state)
{
    (void)state;
    make(peak);
    for (int i = 0; i < 200; i++) {
        const double a = LAST * test_random(), b = LAST * test_random();
        const unsigned row = (unsigned)i % 32;
        const double share = test_random();
        const double first = trip_blurred_d_of_row(row), last = trip_blurred_d_of_row(row + 1);
        const double d = pow((1 - share) * pow(first, 4) + share * pow(last, 4), 0.25);
        const double low = trip_blurred_segment_of(&blurred, &plain, a, b, first).extinction;
        const double high = trip_blurred_segment_of(&blurred, &plain, a, b, last).extinction;
        const double is = trip_blurred_segment_of(&blurred, &plain, a, b, d).extinction;
        assert_close(is, low + share * (high - low), 1e-9);
        assert_close(trip_blurred_segment_of(&blurred, &plain, a, b, 0).extinction,
                     trip_segment_of(&plain, a, b).extinction, 0);
    }
    end();
}

/* A function that rises by a factor of e every 20 codes, as of data with few codes. The mean of
 * exp(x / 20) over a normal distribution is exp((s / 20)^2 / 2) times its value at the mean.
 * Between two rows, a line in the variance differs by up to 14 % from this exponential. */
static trip_tf_entry steep(int code)
{
    return (trip_tf_entry){ 1, 1, 1, expf((float)(code < 400 ? code - 400 : 0) / 20) };
}

static void small_deviations_act_by_their_variance(void **state)
{
    (void)state;
    make(steep);
    for (double s = 1; s <= 24; s *= 1.3) {
        const double d = 255 * sqrt(s / 32767.5), plain_value = exp(-10), code = 200;
        const double is = trip_blurred_segment_of(&blurred, &plain, code, code, d).extinction;
        const double more = exp(s * s / 800) - 1;
        assert_close(is / plain_value - 1, more, 0.15 * more + 1e-3);
    }
    end();
}

/* The mean over a segment equals the mean of many codes. */
static void a_segment_has_the_mean_of_its_codes(void **state)
{
    (void)state;
    make(peak);
    enum { PARTS = 4000 };
    for (int i = 0; i < 40; i++) {
        const double a = 36000 + 9000 * test_random(), b = 36000 + 9000 * test_random();
        const double d = 255 * test_random();
        double k = 0, kq = 0;
        for (int n = 0; n < PARTS; n++) {
            const double code = a + (b - a) * (n + 0.5) / PARTS;
            const trip_segment s = trip_blurred_segment_of(&blurred, &plain, code, code, d);
            k += s.extinction / PARTS;
            kq += s.extinction * s.rgb[0] / PARTS;
        }
        const trip_segment s = trip_blurred_segment_of(&blurred, &plain, a, b, d);
        assert_close(s.extinction, k, 2e-3);
        assert_close(s.extinction * s.rgb[0], kq, 2e-3);
    }
    end();
}

/* A value with extinction lies within trip_blurred_reach() of a visible code. */
static void nothing_shows_out_of_reach(void **state)
{
    (void)state;
    make(peak);
    for (unsigned d = 0; d <= 255; d++) {
        const double reach = trip_blurred_reach(d);
        for (int side = 0; side < 2; side++) {
            const double code = side ? 40512 + reach : 39999 - reach;
            if (code < 0 || code > LAST)
                continue;
            const trip_segment s = trip_blurred_segment_of(&blurred, &plain, code, code, d);
            assert_true(s.extinction == 0);
        }
        const double near = 39999 - 3.5 * trip_deviation(d);
        if (d > 16 && near > 0)
            assert_true(trip_blurred_segment_of(&blurred, &plain, near, near, d).extinction > 0);
    }
    end();
}

static void all_rows_take_less_than_4_megabytes(void **state)
{
    (void)state;
    const trip_blurred_function f = trip_blurred_function_shape();
    assert_true(trip_blurred_function_entries(&f) * sizeof *f.entries < 4000000);
    for (int r = 1; r < TRIP_BLURRED_ROWS; r++)
        assert_true(f.rows[r].log2 == 0 ||
                    ldexp(1, (int)f.rows[r].log2) < f.rows[r].deviation / 15);
}

static void too_little_memory_is_an_answer(void **state)
{
    (void)state;
    trip_budget *small;
    assert_int_equal(trip_budget_create(&small, 1 << 20), 0);
    assert_false(trip_blurred_function_create(&blurred, table, small));
    assert_int_equal(trip_budget_left_bytes(small), 1 << 20);
    trip_budget_destroy(small);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_step_is_blurred_as_by_quadrature),
        cmocka_unit_test(a_peak_is_blurred_as_by_quadrature),
        cmocka_unit_test(stripes_are_blurred_as_by_quadrature),
        cmocka_unit_test(a_ramp_that_ends_within_reach_is_blurred_as_by_quadrature),
        cmocka_unit_test(a_step_becomes_the_error_function),
        cmocka_unit_test(rows_are_linear_between),
        cmocka_unit_test(small_deviations_act_by_their_variance),
        cmocka_unit_test(a_segment_has_the_mean_of_its_codes),
        cmocka_unit_test(nothing_shows_out_of_reach),
        cmocka_unit_test(all_rows_take_less_than_4_megabytes),
        cmocka_unit_test(too_little_memory_is_an_answer),
    };
    return cmocka_run_group_tests(tests, setup, teardown);
}
