/* Compares the integral along a ray with closed forms for integrands that are not smooth. */
#include "quadrature.h"
#include "test.h"

#include <math.h>

/* Extinction is `before` up to a position and `after` behind it, or falls and rises from there.
 * The colour is 1 before the position and `colour_behind` behind it. */
typedef struct broken {
    double at, before, after, colour_behind;
    bool steps;
    int samples; /* samples taken so far */
} broken;

static void sample(void *user, double t, trip_ray_sample *out)
{
    broken *b = user;
    b->samples++;
    const double slope = t < b->at ? b->before : b->after;
    *out = (trip_ray_sample){ .extinction = b->steps ? slope : slope * fabs(t - b->at) };
    for (int i = 0; i < 3; i++)
        out->rgb[i] = t < b->at ? 1 : b->colour_behind;
}

/* Returns the colour, and the transmittance of both parts: exp(-integral of the extinction). */
static void closed_form(const broken *b, double *colour, double *through)
{
    const double first = b->at, last = 1 - b->at;
    const double front = exp(-b->before * (b->steps ? first : first * first / 2));
    const double back = exp(-b->after * (b->steps ? last : last * last / 2));
    *colour = 1 - front + b->colour_behind * front * (1 - back);
    *through = front * back;
}

/* Returns the error of a ray computed as one piece. */
static double error_of(broken *b, double tolerance)
{
    double colour, through;
    trip_ray_sum sum = trip_ray_sum_begin(tolerance, 1);
    const trip_ray_end from = trip_ray_end_at(0, sample, b), to = trip_ray_end_at(1, sample, b);
    trip_ray_sum_add(&sum, &from, &to, sample, b);
    closed_form(b, &colour, &through);
    return fmax(fabs(sum.rgb[0] - colour), fabs(sum.transmittance - through));
}

/* A kink or a step may lie anywhere. At some positions, the rules over a piece and over its halves
 * have the same error by chance. */
static void breaks_anywhere_keep_the_error_within_the_tolerance(void **state)
{
    (void)state;
    enum { PLACES = 1999 };
    static const broken kinds[] = {
        { .before = 4, .after = 4, .colour_behind = 1 },
        { .before = 0, .after = 6, .colour_behind = 1 },
        { .before = 3, .after = 1, .colour_behind = 0.25 },
        { .before = 0, .after = 2, .colour_behind = 1, .steps = true },
        { .before = 2, .after = 0.5, .colour_behind = 0.25, .steps = true },
        { .before = 0, .after = 30, .colour_behind = 1 },
        { .before = 0, .after = 300, .colour_behind = 1 },
        { .before = 300, .after = 30, .colour_behind = 0 },
        { .before = 40, .after = 10, .colour_behind = 0 },
        { .before = 0, .after = 3000, .colour_behind = 1 },
        { .before = 0, .after = 20, .colour_behind = 1, .steps = true },
        { .before = 0, .after = 200, .colour_behind = 1, .steps = true },
    };
    static const double tolerances[] = { 1e-2, 1e-3, 1e-4, 1e-6 };
    for (size_t k = 0; k < sizeof kinds / sizeof kinds[0]; k++)
        for (size_t i = 0; i < sizeof tolerances / sizeof tolerances[0]; i++) {
            double worst = 0;
            for (int n = 1; n <= PLACES; n++) {
                broken b = kinds[k];
                b.at = n / (PLACES + 1.0);
                worst = fmax(worst, error_of(&b, tolerances[i]));
            }
            assert_true(worst <= tolerances[i]);
        }
}

/* The integrand changes little and the tolerance is tiny. An integrator that mistakes rounding for
 * an error would subdivide without end. */
static void the_smallest_tolerance_takes_no_more_samples_than_it_needs(void **state)
{
    (void)state;
    for (double extinction = 1e-12; extinction < 1e3; extinction *= 10)
        for (int n = 0; n < 4; n++) {
            broken b = { .at = n / 2 ? 0.37 : 0.5,
                         .before = extinction,
                         .after = 0.3 * extinction,
                         .colour_behind = n % 2,
                         .steps = n / 2 };
            assert_true(error_of(&b, 1e-12) <= 1e-12);
            assert_true(b.samples < 50000);
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(breaks_anywhere_keep_the_error_within_the_tolerance),
        cmocka_unit_test(the_smallest_tolerance_takes_no_more_samples_than_it_needs),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
