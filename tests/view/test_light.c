#include "test.h"
#include "draw_settings.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "light.h"

/* The centre is (1, 2, 3), and half the diagonal is 6. */
static const triptych_info box = { .lo = { -3, -2, 1 }, .hi = { 5, 6, 5 } };

static void a_light_is_placed_around_the_centre_of_the_data(void **state)
{
    (void)state;
    draw_settings s = { 0 };
    trip_light_control_set(&s, &box, &(trip_light_control){ false, 90, 30, 2 });
    assert_int_equal(s.light.kind, TRIPTYCH_LIGHT_POINT);
    const double position[3] = { 1, 2 + 12 * sqrt(0.75), 9 };
    for (int i = 0; i < 3; i++)
        assert_close(s.light.toward[i], position[i], 1e-12);
}

static void at_the_maximum_distance_a_light_is_a_direction(void **state)
{
    (void)state;
    draw_settings s = { 0 };
    trip_light_control_set(&s, &box, &(trip_light_control){ false, 180, 0, TRIP_LIGHT_FARTHEST });
    assert_int_equal(s.light.kind, TRIPTYCH_LIGHT_DIRECTION);
    const double way[3] = { -1, 0, 0 };
    for (int i = 0; i < 3; i++)
        assert_close(s.light.toward[i], way[i], 1e-12);
    assert_true(trip_light_control_of(&s, &box).distance == TRIP_LIGHT_FARTHEST);
}

static void the_controls_show_the_numbers_that_were_set(void **state)
{
    (void)state;
    const double distances[] = { TRIP_LIGHT_NEAREST, 0.3, 1, 9.9, TRIP_LIGHT_FARTHEST,
                                 TRIP_LIGHT_FARTHEST };
    for (int i = 0; i < 6; i++)
        for (double round = -170; round < 180; round += 35) {
            const trip_light_control set = { i == 5, round, round / 2, distances[i] };
            draw_settings s = { 0 };
            trip_light_control_set(&s, &box, &set);
            const trip_light_control shown = trip_light_control_of(&s, &box);
            assert_int_equal(shown.turns, set.turns);
            assert_close(shown.round, set.round, 1e-9);
            assert_close(shown.up, set.up, 1e-9);
            assert_close(shown.distance, set.distance, 1e-9);
        }
}

/* A light at the centre of the data has no direction. */
static void a_light_at_the_centre_has_finite_numbers(void **state)
{
    (void)state;
    draw_settings s = { 0 };
    s.light.kind = TRIPTYCH_LIGHT_POINT;
    for (int i = 0; i < 3; i++)
        s.light.toward[i] = 0.5 * (box.lo[i] + box.hi[i]);
    const trip_light_control c = trip_light_control_of(&s, &box);
    assert_true(isfinite(c.round) && isfinite(c.up) && c.distance == 0);
}

static void the_light_leaves_the_eye_to_its_last_direction_of_the_view(void **state)
{
    (void)state;
    draw_settings s = { .light = { .kind = TRIPTYCH_LIGHT_HEAD } };
    assert_true(trip_light_is_head(&s));
    trip_light_set_head(&s, false);
    assert_false(trip_light_is_head(&s));
    assert_int_equal(s.light.kind, TRIPTYCH_LIGHT_VIEW);
    for (int i = 0; i < 3; i++)
        assert_true(s.light.toward[i] == 1); /* the upper left front */
    s.light.toward[0] = 3;
    trip_light_set_head(&s, true);
    assert_true(trip_light_is_head(&s));
    trip_light_set_head(&s, false);
    assert_true(s.light.toward[0] == 3);
    s.light.kind = TRIPTYCH_LIGHT_POINT; /* a position is no direction of the view */
    trip_light_set_head(&s, true);
    trip_light_set_head(&s, false);
    assert_true(s.light.toward[0] == 1);
}

/* Left is 0 degrees down from the azimuth of 90, the top is at the elevation of 90. */
static void controls_of_a_light_that_turns_count_from_the_front_to_the_left(void **state)
{
    (void)state;
    const double at[][5] = { { 0, 0, 0, 0, 1 },
                             { 90, 0, 1, 0, 0 },
                             { -90, 0, -1, 0, 0 },
                             { 180, 0, 0, 0, -1 },
                             { 30, 90, 0, 1, 0 } };
    for (int i = 0; i < 5; i++) {
        draw_settings s = { 0 };
        trip_light_control_set(
            &s, &box, &(trip_light_control){ true, at[i][0], at[i][1], TRIP_LIGHT_FARTHEST });
        assert_int_equal(s.light.kind, TRIPTYCH_LIGHT_VIEW);
        for (int k = 0; k < 3; k++)
            assert_close(s.light.toward[k], at[i][2 + k], 1e-12);
    }
}

/* The camera looks along +y with z up, so left is -x and the front is -y. */
static void a_light_keeps_its_direction_when_it_is_fixed_or_turns(void **state)
{
    (void)state;
    const triptych_camera camera = { .eye = { 5, -20, 3 }, .look = { 5, 9, 3 }, .up = { 0, 0, 1 } };
    const trip_navigation n = trip_navigation_from_camera(&camera, NULL);
    draw_settings s = { .light = { .kind = TRIPTYCH_LIGHT_VIEW, .toward = { 1, 2, 3 } } };
    const double world[3] = { -1, -3, 2 };
    trip_light_set_turns(&s, &box, &n, false);
    assert_int_equal(s.light.kind, TRIPTYCH_LIGHT_DIRECTION);
    for (int i = 0; i < 3; i++)
        assert_close(s.light.toward[i], world[i], 1e-12);
    trip_light_set_turns(&s, &box, &n, true);
    assert_int_equal(s.light.kind, TRIPTYCH_LIGHT_VIEW);
    for (int i = 0; i < 3; i++)
        assert_close(s.light.toward[i], i + 1, 1e-12);
}

static void assert_words(const draw_settings *s, const char *heat, const char *words)
{
    char said[200];
    trip_effects_say(s, heat, said, sizeof said);
    assert_string_equal(said, words);
}

static void active_effects_are_named_in_words(void **state)
{
    (void)state;
    draw_settings s = { .has_background = 0 };
    assert_words(&s, NULL, "");
    assert_words(&s, "heat.trip", "");
    s.effects.which = TRIPTYCH_EFFECT_EMISSION;
    assert_words(&s, "its place/it's hot.trip", "emission of it's hot.trip, 0 to 2500 K");
    s.effects.which = TRIPTYCH_EFFECT_SHADOWS | TRIPTYCH_EFFECT_CUEING;
    assert_words(&s, "heat.trip", "shadows, depth cueing");
    s.effects.which = TRIPTYCH_EFFECT_AUTO;
    s.effects.kelvin[1] = 1800.5;
    assert_words(&s, "h", "effects chosen by the kind of data, emission of h, 0 to 1800.5 K");
}

static const trip_effect_switch *switch_of(int bit)
{
    int i = 0;
    while (trip_effect_switches[i].bit != bit)
        i++;
    return &trip_effect_switches[i];
}

static void shadows_take_the_default_light_from_the_eye(void **state)
{
    (void)state;
    const trip_effect_switch *shadows = switch_of(TRIPTYCH_EFFECT_SHADOWS);
    draw_settings s = { 0 };
    assert_null(trip_effect_lacks(shadows, &s, NULL));
    assert_true(trip_effect_turn(shadows, true, &s, NULL));
    assert_int_equal(s.light.kind, TRIPTYCH_LIGHT_VIEW);
    s.light.kind = TRIPTYCH_LIGHT_DEFAULT; /* as from the command line */
    assert_false(trip_light_is_head(&s));
    assert_true(trip_light_control_of(&s, &box).turns);
}

static void every_effect_has_its_own_switch(void **state)
{
    (void)state;
    int all = 0;
    draw_settings s = { 0 };
    s.light.kind = TRIPTYCH_LIGHT_DIRECTION;
    for (int i = 0; i < TRIP_EFFECT_SWITCHES; i++) {
        const trip_effect_switch *e = &trip_effect_switches[i];
        assert_true(trip_effect_turn(e, true, &s, "heat.trip"));
        assert_int_equal(s.effects.which, e->bit);
        assert_true(trip_effect_turn(e, false, &s, NULL));
        assert_int_equal(s.effects.which, 0);
        all |= e->bit;
    }
    assert_int_equal(all, TRIPTYCH_EFFECT_SHADOWS | TRIPTYCH_EFFECT_OCCLUSION |
                              TRIPTYCH_EFFECT_CUEING | TRIPTYCH_EFFECT_AUTO |
                              TRIPTYCH_EFFECT_EMISSION | TRIPTYCH_EFFECT_EDL);
}

static void colours_of_a_camera_are_lit_once_shading_is_switched_on(void **state)
{
    (void)state;
    draw_settings s = { 0 };
    assert_true(trip_light_shades(&s, true));
    assert_false(trip_light_shades(&s, false));
    trip_light_set_shading(&s, false, true);
    assert_int_equal(s.light.kind, TRIPTYCH_LIGHT_HEAD);
    assert_true(trip_light_shades(&s, false));
    trip_light_set_head(&s, false);
    for (int on = 0; on < 2; on++) {
        trip_light_set_shading(&s, false, on);
        assert_int_equal(trip_light_shades(&s, false), on);
        assert_int_equal(s.light.kind, TRIPTYCH_LIGHT_VIEW);
    }
    s = (draw_settings){ 0 };
    trip_light_set_shading(&s, true, true);
    assert_int_equal(s.light.kind, TRIPTYCH_LIGHT_DEFAULT);
}

static void effects_without_light_or_heat_cannot_be_turned_on(void **state)
{
    (void)state;
    draw_settings s = { .light = { .kind = TRIPTYCH_LIGHT_HEAD } };
    assert_non_null(
        strstr(trip_effect_lacks(switch_of(TRIPTYCH_EFFECT_SHADOWS), &s, "h"), "headlight"));
    assert_false(trip_effect_turn(switch_of(TRIPTYCH_EFFECT_SHADOWS), true, &s, "h"));
    assert_non_null(
        strstr(trip_effect_lacks(switch_of(TRIPTYCH_EFFECT_EMISSION), &s, NULL), "--emission"));
    assert_false(trip_effect_turn(switch_of(TRIPTYCH_EFFECT_EMISSION), true, &s, NULL));
    assert_int_equal(s.effects.which, 0);
    assert_null(trip_effect_lacks(switch_of(TRIPTYCH_EFFECT_OCCLUSION), &s, NULL));
    s.light.kind = TRIPTYCH_LIGHT_DIRECTION;
    assert_null(trip_effect_lacks(switch_of(TRIPTYCH_EFFECT_SHADOWS), &s, NULL));
}

static const trip_effect_number *number_of(const char *name)
{
    int i = 0;
    while (strcmp(trip_effect_numbers[i].name, name))
        i++;
    return &trip_effect_numbers[i];
}

static void numbers_of_effects_stay_within_their_bounds(void **state)
{
    (void)state;
    for (int i = 0; i < TRIP_EFFECT_NUMBERS; i++) {
        const trip_effect_number *n = &trip_effect_numbers[i];
        draw_settings s = { 0 };
        const double defaults = trip_effect_number_get(n, &s);
        const double bad[] = { n->lo - 0.001, n->hi + 0.001, NAN, INFINITY, n->lo + 0.5 };
        assert_true(defaults >= n->lo && defaults <= n->hi);
        for (int k = 0; k < (n->whole ? 5 : 4); k++) {
            assert_false(trip_effect_number_set(n, bad[k], &s));
            assert_true(trip_effect_number_get(n, &s) == defaults);
        }
        assert_true(trip_effect_number_set(n, n->lo, &s));
        assert_true(trip_effect_number_get(n, &s) == n->lo &&
                    s.effects.kelvin[0] < s.effects.kelvin[1]);
        assert_true(trip_effect_number_set(n, n->hi, &s));
        assert_true(trip_effect_number_get(n, &s) == n->hi &&
                    s.effects.kelvin[0] < s.effects.kelvin[1]);
    }
    draw_settings s = { 0 };
    assert_true(trip_effect_number_set(number_of("anisotropy"), 0.25, &s) &&
                s.effects.anisotropy == 0.25);
    assert_true(trip_effect_number_set(number_of("fading"), 0.5, &s) && s.effects.cueing == 0.5);
    assert_true(trip_effect_number_set(number_of("hottest"), 3000, &s) &&
                s.effects.kelvin[1] == 3000);
    assert_true(trip_effect_number_set(number_of("coldest"), 400, &s) &&
                s.effects.kelvin[0] == 400);
    assert_true(s.effects.kelvin[1] == 3000);
}

/* Three effects use --light-cells. The panel shows this number below one of them. */
static void a_number_of_several_effects_is_below_only_one(void **state)
{
    (void)state;
    const trip_effect_number *n = number_of("light-cells");
    draw_settings s = { 0 };
    const int on[] = { 0, TRIPTYCH_EFFECT_SHADOWS,
                       TRIPTYCH_EFFECT_OCCLUSION | TRIPTYCH_EFFECT_CUEING, TRIPTYCH_EFFECT_EMISSION,
                       TRIPTYCH_EFFECT_SHADOWS | TRIPTYCH_EFFECT_OCCLUSION };
    const int below[] = { TRIPTYCH_EFFECT_SHADOWS, TRIPTYCH_EFFECT_SHADOWS,
                          TRIPTYCH_EFFECT_OCCLUSION, TRIPTYCH_EFFECT_EMISSION,
                          TRIPTYCH_EFFECT_SHADOWS };
    for (int i = 0; i < 5; i++) {
        s.effects.which = on[i];
        for (int k = 0; k < TRIP_EFFECT_SWITCHES; k++)
            assert_int_equal(trip_effect_number_is_below(n, &trip_effect_switches[k], &s),
                             trip_effect_switches[k].bit == below[i]);
    }
    assert_true(trip_effect_number_set(n, 48, &s) && s.effects.light_cells == 48);
}

static void words_are_cut_at_the_end_of_the_buffer(void **state)
{
    (void)state;
    draw_settings s = { 0 };
    s.effects.which =
        TRIPTYCH_EFFECT_SHADOWS | TRIPTYCH_EFFECT_OCCLUSION | TRIPTYCH_EFFECT_EMISSION;
    for (size_t bytes = 1; bytes < 60; bytes++) {
        char said[64];
        memset(said, 1, sizeof said);
        trip_effects_say(&s, "heat.trip", said, bytes);
        assert_true(strlen(said) < bytes && said[bytes] == 1);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_light_is_placed_around_the_centre_of_the_data),
        cmocka_unit_test(at_the_maximum_distance_a_light_is_a_direction),
        cmocka_unit_test(the_controls_show_the_numbers_that_were_set),
        cmocka_unit_test(a_light_at_the_centre_has_finite_numbers),
        cmocka_unit_test(the_light_leaves_the_eye_to_its_last_direction_of_the_view),
        cmocka_unit_test(controls_of_a_light_that_turns_count_from_the_front_to_the_left),
        cmocka_unit_test(a_light_keeps_its_direction_when_it_is_fixed_or_turns),
        cmocka_unit_test(shadows_take_the_default_light_from_the_eye),
        cmocka_unit_test(active_effects_are_named_in_words),
        cmocka_unit_test(every_effect_has_its_own_switch),
        cmocka_unit_test(colours_of_a_camera_are_lit_once_shading_is_switched_on),
        cmocka_unit_test(effects_without_light_or_heat_cannot_be_turned_on),
        cmocka_unit_test(numbers_of_effects_stay_within_their_bounds),
        cmocka_unit_test(a_number_of_several_effects_is_below_only_one),
        cmocka_unit_test(words_are_cut_at_the_end_of_the_buffer),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
