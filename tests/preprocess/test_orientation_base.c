/* Tests that find the level side on which an object stands. The shares are computed by hand or in
 * closed form, and the volumes stand on a known side. */
#include "brick_files.h"

#include <math.h>

#include "orientation.h"

enum { EDGE = TRIP_OCCUPANCY_EDGE };

/* Returns whether a point is in the half ball with its flat side towards `side`. Coordinates are
 * from -1 to 1 along each edge. */
static bool is_in_half_ball(const double p[3], int side)
{
    double up = side % 2 ? -p[side / 2] : p[side / 2];
    return p[0] * p[0] + p[1] * p[1] + p[2] * p[2] < 0.9 * 0.9 && up > 0;
}

/* The share of a side is the fraction of the rows through the object that reach into the last
 * tenth.
 *
 * - Flat side: 1, the whole disc.
 * - Round side: the rows higher than 0.9 radii, a disc of 1 - 0.81 of the radius squared.
 * - Other sides: the object is two radii long. The rows that reach farther than 0.8 radii cover 1 -
 * 0.64 of the half disc. */
static void shares_of_a_half_ball_are_areas_of_its_discs(void **state)
{
    (void)state;
    static trip_occupancy o = { { EDGE, EDGE, EDGE }, { 0 } };
    for (int side = 0; side < 6; side++) {
        for (int n = 0; n < EDGE * EDGE * EDGE; n++) {
            const int at[3] = { n % EDGE, n / EDGE % EDGE, n / EDGE / EDGE };
            double p[3];
            for (int a = 0; a < 3; a++)
                p[a] = 2 * (at[a] + 0.5) / EDGE - 1;
            o.weights[n] = is_in_half_ball(p, side) ? UINT16_MAX : UINT16_MAX / 8;
        }
        for (int s = 0; s < 6; s++) {
            double expected = s == side ? 1 : s == (side ^ 1) ? 0.19 : 0.36;
            assert_float_equal(trip_orientation_base_share(&o, s), expected, 0.05);
        }
    }
}

static void rows_that_reach_into_the_last_tenth_count(void **state)
{
    (void)state;
    /* The object covers eleven bins from the third on, so the last tenth is two bins. The third row
     * is empty. */
    trip_occupancy o = { { 14, 4, 1 }, { 0 } };
    o.weights[2] = o.weights[12] = UINT16_MAX;
    o.weights[14 + 3] = UINT16_MAX;
    o.weights[3 * 14 + 4] = UINT16_MAX;
    assert_float_equal(trip_orientation_base_share(&o, 0), 2.0 / 3, 1e-15);
    assert_float_equal(trip_orientation_base_share(&o, 1), 1.0 / 3, 1e-15);
    const trip_occupancy nothing = { { 3, 3, 3 }, { 0 } };
    assert_float_equal(trip_orientation_base_share(&nothing, 2), 0, 0);
}

static void a_base_needs_a_clearly_level_side(void **state)
{
    (void)state;
    static const struct {
        double shares[6];
        int side;
    } rows[] = {
        { { 0.14, 0.13, 0.72, 0.05, 0.04, 0.12 }, 2 },
        { { 0, 0, 0, 0, 0, 0.6 }, 5 },
        { { 0.9, 0.44, 0, 0, 0.45, 0 }, 0 },
        { { 1, 1, 1, 1, 1, 1 }, -1 },
        { { 0.1, 0.9, 0.1, 0.8, 0.1, 0.1 }, -1 }, /* two */
        { { 0, 0, 0, 0, 0.55, 0 }, -1 },          /* no side is level enough */
        { { 0, 0, 0, 0, 0, 0 }, -1 },
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++)
        assert_int_equal(trip_orientation_base_side(rows[i].shares), rows[i].side);
}

/* Bricks a half ball that stands on `side`, or a whole ball if `side` is -1. Returns the data set's
 * text, which the caller frees. The summary holds the note. */
static char *brick_ball(int side, trip_brick_params p, trip_brick_summary *s)
{
    enum { NX = 90, NY = 84, NZ = 76 };
    static uint8_t bytes[NX * NY * NZ];
    for (int n = 0; n < NX * NY * NZ; n++) {
        const double at[3] = { (n % NX + 0.5) / NX * 2 - 1, (n / NX % NY + 0.5) / NY * 2 - 1,
                               (n / NX / NY + 0.5) / NZ * 2 - 1 };
        bool in = side >= 0 ? is_in_half_ball(at, side)
                            : is_in_half_ball(at, 0) || is_in_half_ball(at, 1);
        bytes[n] = in ? 200 : 10;
    }
    return test_brick_bytes(p, bytes, (const int[]){ NX, NY, NZ }, s);
}

static void a_half_ball_stands_on_its_flat_side(void **state)
{
    (void)state;
    static const char *const names[] = { "-x", "+x", "-y", "+y", "-z", "+z" };
    for (int side = 0; side < 6; side++) {
        trip_brick_summary s;
        char expected[32];
        char *text = brick_ball(side, (trip_brick_params){ 0 }, &s);
        snprintf(expected, sizeof expected, "\"footing\":\"%s\"", names[side]);
        if (!strstr(text, expected))
            fail_msg("%s is not in: %.300s", expected, text);
        snprintf(expected, sizeof expected, "up at %s", names[side ^ 1]);
        assert_true((strstr(s.note, expected) != NULL) == (side != 4)); /* z is up by default */
        free(text);
    }
}

static void balls_parts_and_oriented_volumes_have_no_base(void **state)
{
    (void)state;
    const trip_brick_params ways[] = { { 0 },
                                       { .volume.axes = "PIR" },
                                       { .region.past = { 0, 0,
                                                          75 } } /* the ball without one slice */ };
    for (int i = 0; i < 3; i++) {
        trip_brick_summary s;
        char *text = brick_ball(i - 1, ways[i], &s);
        assert_null(strstr(text, "footing"));
        assert_string_equal(s.note, "");
        free(text);
    }
}

#define TEST(f) cmocka_unit_test_setup_teardown(f, test_begin, test_end)

int main(void)
{
    const struct CMUnitTest tests[] = {
        TEST(shares_of_a_half_ball_are_areas_of_its_discs),
        TEST(rows_that_reach_into_the_last_tenth_count),
        TEST(a_base_needs_a_clearly_level_side),
        TEST(a_half_ball_stands_on_its_flat_side),
        TEST(balls_parts_and_oriented_volumes_have_no_base),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
