#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "pace.h"

static void without_measurements_frames_are_half_as_wide(void **state)
{
    (void)state;
    const trip_pace p = { 0 };
    assert_true(trip_pace_scale(&p, 1e6, 33) == 0.5);
    assert_true(trip_pace_expect_ms(&p, 1e6) == 0);
}

/* A frame takes 10 ms, and 100 ms more for each megapixel. 33 ms suffice for 0.23 megapixels. */
static void the_size_is_chosen_to_meet_the_time(void **state)
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

/* A frame takes 100 ms, and 40 ms more for each megapixel. Its pixels may then take 25 ms. */
static void frames_keep_pixels_if_the_time_cannot_be_met(void **state)
{
    (void)state;
    trip_pace p = { 0 };
    for (int i = 0; i < 20; i++) {
        double pixels = i % 2 ? 0.25e6 : 1e6;
        trip_pace_note(&p, pixels, 100 + 40e-6 * pixels);
    }
    assert_true(fabs(trip_pace_scale(&p, 1e6, 33) - sqrt(25.0 / 40)) < 1e-6);
}

/* By chance the smaller frames are the slower ones. The next frame must not be large for this
 * reason. */
static void scattered_times_do_not_make_the_next_frame_large(void **state)
{
    (void)state;
    trip_pace p = { 0 };
    const double pixels[] = { 21e3, 20e3, 22e3, 20e3, 21e3 }, ms[] = { 36, 43, 35, 41, 38 };
    for (int i = 0; i < 5; i++)
        trip_pace_note(&p, pixels[i], ms[i]);
    const double part = trip_pace_scale(&p, 480e3, 33);
    assert_true(part * part * 480e3 < 3.1 * 21e3);
    trip_pace free = { 0 }; /* pixels cost nothing, so that frames grow step by step */
    for (int i = 0; i < 8; i++) {
        const double size = trip_pace_scale(&free, 480e3, 33);
        trip_pace_note(&free, size * size * 480e3, 5);
    }
    assert_true(trip_pace_scale(&free, 480e3, 33) == 1);
}

/* After one frame, its whole time counts as time for pixels. 33 ms would then suffice for 132e3
 * pixels. */
static void frames_grow_by_at_most_a_factor_of_three(void **state)
{
    (void)state;
    trip_pace p = { 0 };
    trip_pace_note(&p, 20e3, 5);
    const double part = trip_pace_scale(&p, 480e3, 33);
    assert_true(fabs(part * part * 480e3 - 60e3) < 1);
}

/* By chance the larger frames are faster. The scatter may hide a cost of pixels. */
static void scattered_times_may_hide_the_cost_of_pixels(void **state)
{
    (void)state;
    trip_pace p = { 0 };
    const double pixels[] = { 210e3, 200e3, 220e3, 200e3, 210e3 }, ms[] = { 36, 43, 35, 41, 38 };
    for (int i = 0; i < 5; i++)
        trip_pace_note(&p, pixels[i], ms[i]);
    assert_true(trip_pace_expect_ms(&p, 480e3) > trip_pace_expect_ms(&p, 210e3) + 5);
    assert_true(trip_pace_scale(&p, 480e3, 33) < 0.9);
}

/* A viewer that starts without any measurement reaches the requested time. */
static void a_sequence_of_frames_reaches_the_requested_time(void **state)
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
        cmocka_unit_test(without_measurements_frames_are_half_as_wide),
        cmocka_unit_test(the_size_is_chosen_to_meet_the_time),
        cmocka_unit_test(frames_keep_pixels_if_the_time_cannot_be_met),
        cmocka_unit_test(scattered_times_do_not_make_the_next_frame_large),
        cmocka_unit_test(frames_grow_by_at_most_a_factor_of_three),
        cmocka_unit_test(scattered_times_may_hide_the_cost_of_pixels),
        cmocka_unit_test(a_sequence_of_frames_reaches_the_requested_time),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
