#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "pace.h"

static void with_nothing_known_frames_are_half_as_wide(void **state)
{
    (void)state;
    const trip_pace p = { 0 };
    assert_true(trip_pace_scale(&p, 1e6, 33) == 0.5);
    assert_true(trip_pace_expect_ms(&p, 1e6) == 0);
}

/* 10 ms and 100 ms a megapixel: 33 ms is 0.23 megapixels. */
static void the_size_meets_the_time(void **state)
{
    (void)state;
    trip_pace p = { 0 };
    for (int i = 0; i < 20; i++) {
        double pixels = i % 2 ? 0.25e6 : 0.5e6;
        trip_pace_note(&p, pixels, 10 + 100e-6 * pixels);
    }
    assert_true(fabs(trip_pace_scale(&p, 1e6, 33) - sqrt(0.23)) < 1e-6);
    assert_true(fabs(trip_pace_expect_ms(&p, 1e6) - 110) < 1e-6);
    assert_true(trip_pace_scale(&p, 1e6, 111) == 1);
    assert_true(trip_pace_scale(&p, 1e9, 10.001) == TRIP_PACE_MIN);
}

/* 100 ms whatever the size, and 40 ms a megapixel: pixels get 25 ms. */
static void where_the_time_cannot_be_met_pixels_are_not_thrown_away(void **state)
{
    (void)state;
    trip_pace p = { 0 };
    for (int i = 0; i < 20; i++) {
        double pixels = i % 2 ? 0.25e6 : 1e6;
        trip_pace_note(&p, pixels, 100 + 40e-6 * pixels);
    }
    assert_true(fabs(trip_pace_scale(&p, 1e6, 33) - sqrt(25.0 / 40)) < 1e-6);
}

/* The slower frames are the smaller ones, by chance: that is no reason for a large one. */
static void frames_that_scatter_do_not_make_the_next_one_large(void **state)
{
    (void)state;
    trip_pace p = { 0 };
    const double pixels[] = { 21e3, 20e3, 22e3, 20e3, 21e3 }, ms[] = { 36, 43, 35, 41, 38 };
    for (int i = 0; i < 5; i++)
        trip_pace_note(&p, pixels[i], ms[i]);
    const double part = trip_pace_scale(&p, 480e3, 33);
    assert_true(part * part * 480e3 < 3.1 * 21e3);
    trip_pace free = { 0 }; /* pixels cost nothing: it grows, step by step */
    for (int i = 0; i < 8; i++) {
        const double size = trip_pace_scale(&free, 480e3, 33);
        trip_pace_note(&free, size * size * 480e3, 5);
    }
    assert_true(trip_pace_scale(&free, 480e3, 33) == 1);
}

/* Of one frame all of the time is taken to be of its pixels: 33 ms would be 132e3 of them. */
static void frames_grow_threefold_at_max(void **state)
{
    (void)state;
    trip_pace p = { 0 };
    trip_pace_note(&p, 20e3, 5);
    const double part = trip_pace_scale(&p, 480e3, 33);
    assert_true(fabs(part * part * 480e3 - 60e3) < 1);
}

/* The larger ones are faster, by chance: pixels may still cost as much as scatter hides. */
static void pixels_that_seem_to_cost_nothing_may_cost_what_scatter_hides(void **state)
{
    (void)state;
    trip_pace p = { 0 };
    const double pixels[] = { 210e3, 200e3, 220e3, 200e3, 210e3 }, ms[] = { 36, 43, 35, 41, 38 };
    for (int i = 0; i < 5; i++)
        trip_pace_note(&p, pixels[i], ms[i]);
    assert_true(trip_pace_expect_ms(&p, 480e3) > trip_pace_expect_ms(&p, 210e3) + 5);
    assert_true(trip_pace_scale(&p, 480e3, 33) < 0.9);
}

/* Followed as a viewer does, from a start that says nothing, the time is met. */
static void following_it_comes_to_the_time(void **state)
{
    (void)state;
    trip_pace p = { 0 };
    double ms = 0;
    for (int i = 0; i < 30; i++) {
        const double part = trip_pace_scale(&p, 2e6, 33), pixels = part * part * 2e6;
        ms = 5 + 200e-6 * pixels;
        trip_pace_note(&p, pixels, ms);
    }
    assert_true(ms > 30 && ms < 36);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(with_nothing_known_frames_are_half_as_wide),
        cmocka_unit_test(the_size_meets_the_time),
        cmocka_unit_test(where_the_time_cannot_be_met_pixels_are_not_thrown_away),
        cmocka_unit_test(frames_that_scatter_do_not_make_the_next_one_large),
        cmocka_unit_test(frames_grow_threefold_at_max),
        cmocka_unit_test(pixels_that_seem_to_cost_nothing_may_cost_what_scatter_hides),
        cmocka_unit_test(following_it_comes_to_the_time),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
