/* Compares the mean over a pixel's area with closed forms. */
#include "pixel_area.h"
#include "test.h"

#include <math.h>
#include <string.h>

#define PI 3.14159265358979323846

typedef struct wave {
    double along, across, phase; /* cycles per pixel */
} wave;

/* The half plane of points with nx x + ny y < d is 1, the rest 0. */
typedef struct half_plane {
    double nx, ny, d;
} half_plane;

typedef struct scene {
    double (*at)(const void *of, double x, double y);
    const void *of;
    int rays;
} scene;

static int function(void *user, double x, double y, double out[4])
{
    scene *s = user;
    s->rays++;
    for (int c = 0; c < 4; c++)
        out[c] = (c + 1) * s->at(s->of, x, y) / 4;
    return 0;
}

/* Returns the mean over the pixel at (x, y), and checks that the components keep their ratio. */
static double mean_of(scene *s, double x, double y, double tolerance, int first)
{
    const trip_pixel_area a = {
        .function = function, .user = s, .tolerance = tolerance, .first = first
    };
    double mean = 0;
    for (int n = 0; n < first * first; n++) {
        const double left = x + (double)(n % first) / first, top = y + (double)(n / first) / first;
        double corners[4][4], out[4];
        for (int i = 0; i < 4; i++)
            function(s, left + (double)(i & 1) / first, top + (double)(i >> 1) / first, corners[i]);
        const double *const at[4] = { corners[0], corners[1], corners[2], corners[3] };
        assert_int_equal(trip_pixel_area_square(&a, left, top, at, out), 0);
        for (int c = 0; c < 3; c++)
            assert_true(fabs(out[c] - out[3] * (c + 1) / 4) < 1e-12);
        mean += out[3] / (first * first);
    }
    return mean;
}

static double cubic(const void *of, double x, double y)
{
    (void)of;
    return 2 + x - 3 * y + x * y + 2 * x * x - y * y + 0.5 * x * x * x - x * y * y;
}

/* Returns the integral of x^n from `from` to from + 1. */
static double power(double from, int n)
{
    return (pow(from + 1, n + 1) - pow(from, n + 1)) / (n + 1);
}

static void polynomials_of_degree_three_are_exact(void **state)
{
    (void)state;
    for (int first = 1; first <= 5; first++) {
        scene s = { .at = cubic };
        const double x = 3, y = -2;
        const double exact = 2 + power(x, 1) - 3 * power(y, 1) + power(x, 1) * power(y, 1) +
                             2 * power(x, 2) - power(y, 2) + 0.5 * power(x, 3) -
                             power(x, 1) * power(y, 2);
        assert_true(fabs(mean_of(&s, x, y, 100, first) - exact) < 1e-12);
    }
}

static double wave_at(const void *of, double x, double y)
{
    const wave *w = of;
    return 0.5 + 0.5 * cos(2 * PI * (w->along * x + w->across * y + w->phase));
}

/* Returns the mean of a wave over one period or less, relative to its height at the middle. */
static double sinc(double cycles)
{
    return cycles == 0 ? 1 : sin(PI * cycles) / (PI * cycles);
}

/* Waves of up to half a cycle in a first square. An interpolated volume has at most half a cycle
 * per voxel. */
static void waves_are_within_the_tolerance(void **state)
{
    (void)state;
    static const double tolerances[] = { 1e-2, 1e-3, 1e-4 };
    for (int first = 1; first <= 8; first += 7)
        for (size_t t = 0; t < sizeof tolerances / sizeof tolerances[0]; t++)
            for (int n = 0; n < 500; n++) {
                const wave w = { first * fmod(n * 0.618034, 1) / 2,
                                 first * fmod(n * 0.414214, 1) / 2, fmod(n * 0.732051, 1) };
                scene s = { .at = wave_at, .of = &w };
                const double exact = 0.5 + 0.5 * sinc(w.along) * sinc(w.across) *
                                               cos(2 * PI * ((w.along + w.across) / 2 + w.phase));
                assert_true(fabs(mean_of(&s, 0, 0, tolerances[t], first) - exact) <= tolerances[t]);
            }
}

static double half_plane_at(const void *of, double x, double y)
{
    const half_plane *p = of;
    return p->nx * x + p->ny * y < p->d;
}

/* Returns the area of the part of the unit square where nx x + ny y < d. Both nx and ny are
 * positive. The part is a triangle less the two tips outside of the square. */
static double area_below(const half_plane *p)
{
    const double twice = 2 * p->nx * p->ny;
    const double tip_x = fmax(p->d - p->nx, 0), tip_y = fmax(p->d - p->ny, 0);
    return fmin((p->d * p->d - tip_x * tip_x - tip_y * tip_y) / twice, 1);
}

static void steps_are_within_the_tolerance_with_few_rays(void **state)
{
    (void)state;
    static const double tolerances[] = { 1e-2, 1e-3 };
    /* Squares at a step are divided until there are about 1 / tolerance, with 9 rays each. */
    static const int most_rays[] = { 1000, 10000 };
    for (size_t t = 0; t < sizeof tolerances / sizeof tolerances[0]; t++)
        for (int n = 1; n < 500; n++) {
            const double angle = PI / 2 * (0.01 + 0.98 * fmod(n * 0.618034, 1));
            half_plane p = { .nx = cos(angle), .ny = sin(angle) };
            p.d = fmod(n * 0.414214, 1) * (p.nx + p.ny);
            scene s = { .at = half_plane_at, .of = &p };
            const double mean = mean_of(&s, 0, 0, tolerances[t], 1);
            assert_true(fabs(mean - area_below(&p)) <= tolerances[t]);
            assert_in_range(s.rays, 9, most_rays[t]);
        }
}

static double constant(const void *of, double x, double y)
{
    (void)of;
    (void)x;
    (void)y;
    return 0.25;
}

static void a_constant_takes_one_ray_more_than_its_corners(void **state)
{
    (void)state;
    scene s = { .at = constant };
    assert_true(mean_of(&s, 7, 9, 1e-6, 1) == 0.25);
    assert_int_equal(s.rays, 4 + 1);
}

static int failing(void *user, double x, double y, double out[4])
{
    int *left = user;
    memset(out, 0, 4 * sizeof *out);
    out[0] = x > 0.3 && y > 0.4;
    return --*left < 0 ? -7 : 0;
}

static void a_failure_at_any_ray_is_returned(void **state)
{
    (void)state;
    static const double nothing[4];
    const double *const corners[4] = { nothing, nothing, nothing, nothing };
    for (int rays = 0; rays < 9; rays++) {
        int left = rays;
        double out[4];
        const trip_pixel_area a = {
            .function = failing, .user = &left, .tolerance = 1e-3, .first = 1
        };
        assert_int_equal(trip_pixel_area_square(&a, 0, 0, corners, out), -7);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(polynomials_of_degree_three_are_exact),
        cmocka_unit_test(waves_are_within_the_tolerance),
        cmocka_unit_test(steps_are_within_the_tolerance_with_few_rays),
        cmocka_unit_test(a_constant_takes_one_ray_more_than_its_corners),
        cmocka_unit_test(a_failure_at_any_ray_is_returned),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
