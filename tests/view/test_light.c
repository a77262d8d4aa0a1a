#include "test.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "light.h"

/* The centre is (1, 2, 3), and half the diagonal is 6. */
static const triptych_info box = { .lo = { -3, -2, 1 }, .hi = { 5, 6, 5 } };

static void a_light_is_placed_around_the_centre_of_the_data(void **state)
{
    (void)state;
    triptych_settings s = triptych_default_settings();
    trip_light_control_set(&s, &box, &(trip_light_control){ 90, 30, 2 });
    assert_false(s.headlight);
    assert_true(s.point_light);
    const double position[3] = { 1, 2 + 12 * sqrt(0.75), 9 };
    for (int i = 0; i < 3; i++)
        assert_close(s.light[i], position[i], 1e-12);
}

static void at_the_maximum_distance_a_light_is_a_direction(void **state)
{
    (void)state;
    triptych_settings s = triptych_default_settings();
    trip_light_control_set(&s, &box, &(trip_light_control){ 180, 0, TRIP_LIGHT_FARTHEST });
    assert_false(s.point_light);
    const double way[3] = { -1, 0, 0 };
    for (int i = 0; i < 3; i++)
        assert_close(s.light[i], way[i], 1e-12);
    assert_true(trip_light_control_of(&s, &box).distance == TRIP_LIGHT_FARTHEST);
}

static void the_controls_show_the_numbers_that_were_set(void **state)
{
    (void)state;
    const double distances[] = { TRIP_LIGHT_NEAREST, 0.3, 1, 9.9, TRIP_LIGHT_FARTHEST };
    for (int i = 0; i < 5; i++)
        for (double round = -170; round < 180; round += 35) {
            const trip_light_control set = { round, round / 2, distances[i] };
            triptych_settings s = triptych_default_settings();
            trip_light_control_set(&s, &box, &set);
            const trip_light_control shown = trip_light_control_of(&s, &box);
            assert_close(shown.round, set.round, 1e-9);
            assert_close(shown.up, set.up, 1e-9);
            assert_close(shown.distance, set.distance, 1e-9);
        }
}

/* A light at the centre of the data has no direction. */
static void a_light_at_the_centre_has_finite_numbers(void **state)
{
    (void)state;
    triptych_settings s = triptych_default_settings();
    s.point_light = 1;
    for (int i = 0; i < 3; i++)
        s.light[i] = 0.5 * (box.lo[i] + box.hi[i]);
    const trip_light_control c = trip_light_control_of(&s, &box);
    assert_true(isfinite(c.round) && isfinite(c.up) && c.distance == 0);
}

static void assert_text(const triptych_settings *s, const char *expected)
{
    char *text = trip_light_text(s);
    assert_string_equal(text, expected);
    free(text);
}

static void a_light_is_written_as_an_option_if_it_has_an_effect(void **state)
{
    (void)state;
    triptych_settings s = triptych_default_settings();
    assert_text(&s, "");
    s.headlight = 0;
    s.light[0] = 0.1, s.light[1] = -2, s.light[2] = 1e-20;
    assert_text(&s, " --light 0.1,-2,1e-20");
    s.point_light = 1;
    assert_text(&s, " --light point:0.1,-2,1e-20");
    s.shading = 0;
    assert_text(&s, "");
    s.effects = TRIPTYCH_SHADOWS;
    assert_text(&s, " --light point:0.1,-2,1e-20");
}

static void assert_effects(const triptych_settings *s, const char *heat, const char *options,
                           const char *words)
{
    char *text = trip_effects_text(s, heat), said[200];
    assert_string_equal(text, options);
    free(text);
    trip_effects_say(s, heat, said, sizeof said);
    assert_string_equal(said, words);
}

static void effects_are_written_as_options_and_in_words(void **state)
{
    (void)state;
    triptych_settings s = triptych_default_settings();
    assert_effects(&s, NULL, "", "");
    assert_effects(&s, "heat.trip", "", "");
    s.effects = TRIPTYCH_EMISSION;
    assert_effects(&s, "its place/it's hot.trip",
                   " --effects emission --emission 'its place/it'\\''s hot.trip'"
                   " --temperature 0:2500",
                   "emission of it's hot.trip, 0 to 2500 K");
    s.effects = TRIPTYCH_SHADOWS | TRIPTYCH_CUEING;
    s.cueing = 0.25;
    s.light_cells = 64;
    assert_effects(&s, "heat.trip", " --effects shadows,cueing --cueing 0.25 --light-cells 64",
                   "shadows, depth cueing");
    s.effects = TRIPTYCH_OCCLUSION;
    s.anisotropy = 0.5;
    assert_effects(&s, NULL, " --effects occlusion --light-cells 64", "occlusion");
    s.effects = TRIPTYCH_EFFECTS_AUTO;
    s.kelvin[1] = 1800.5;
    assert_effects(&s, "h",
                   " --effects auto --anisotropy 0.5 --cueing 0.25 --light-cells 64 --emission h"
                   " --temperature 0:1800.5",
                   "effects chosen by the kind of data, emission of h, 0 to 1800.5 K");
}

static const trip_effect_switch *switch_of(int bit)
{
    int i = 0;
    while (trip_effect_switches[i].bit != bit)
        i++;
    return &trip_effect_switches[i];
}

static void every_effect_has_its_own_switch(void **state)
{
    (void)state;
    int all = 0;
    triptych_settings s = triptych_default_settings();
    s.headlight = 0;
    for (int i = 0; i < TRIP_EFFECT_SWITCHES; i++) {
        const trip_effect_switch *e = &trip_effect_switches[i];
        assert_true(trip_effect_turn(e, true, &s, "heat.trip"));
        assert_int_equal(s.effects, e->bit);
        assert_true(trip_effect_turn(e, false, &s, NULL));
        assert_int_equal(s.effects, 0);
        all |= e->bit;
    }
    assert_int_equal(all, TRIPTYCH_SHADOWS | TRIPTYCH_OCCLUSION | TRIPTYCH_CUEING |
                              TRIPTYCH_EFFECTS_AUTO | TRIPTYCH_EMISSION);
}

static void effects_without_light_or_heat_cannot_be_turned_on(void **state)
{
    (void)state;
    triptych_settings s = triptych_default_settings();
    assert_non_null(strstr(trip_effect_lacks(switch_of(TRIPTYCH_SHADOWS), &s, "h"), "headlight"));
    assert_false(trip_effect_turn(switch_of(TRIPTYCH_SHADOWS), true, &s, "h"));
    assert_non_null(
        strstr(trip_effect_lacks(switch_of(TRIPTYCH_EMISSION), &s, NULL), "--emission"));
    assert_false(trip_effect_turn(switch_of(TRIPTYCH_EMISSION), true, &s, NULL));
    assert_int_equal(s.effects, 0);
    assert_null(trip_effect_lacks(switch_of(TRIPTYCH_OCCLUSION), &s, NULL));
    s.headlight = 0;
    assert_null(trip_effect_lacks(switch_of(TRIPTYCH_SHADOWS), &s, NULL));
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
        triptych_settings s = triptych_default_settings();
        const double defaults = trip_effect_number_get(n, &s);
        const double bad[] = { n->lo - 0.001, n->hi + 0.001, NAN, INFINITY, n->lo + 0.5 };
        assert_true(defaults >= n->lo && defaults <= n->hi);
        for (int k = 0; k < (n->whole ? 5 : 4); k++) {
            assert_false(trip_effect_number_set(n, bad[k], &s));
            assert_true(trip_effect_number_get(n, &s) == defaults);
        }
        assert_true(trip_effect_number_set(n, n->lo, &s));
        assert_true(trip_effect_number_get(n, &s) == n->lo && s.kelvin[0] < s.kelvin[1]);
        assert_true(trip_effect_number_set(n, n->hi, &s));
        assert_true(trip_effect_number_get(n, &s) == n->hi && s.kelvin[0] < s.kelvin[1]);
    }
    triptych_settings s = triptych_default_settings();
    assert_true(trip_effect_number_set(number_of("anisotropy"), 0.25, &s) && s.anisotropy == 0.25);
    assert_true(trip_effect_number_set(number_of("fading"), 0.5, &s) && s.cueing == 0.5);
    assert_true(trip_effect_number_set(number_of("hottest"), 3000, &s) && s.kelvin[1] == 3000);
    assert_true(trip_effect_number_set(number_of("coldest"), 400, &s) && s.kelvin[0] == 400);
    assert_true(s.kelvin[1] == 3000);
}

/* Three effects use --light-cells. The panel shows this number below one of them. */
static void a_number_of_several_effects_is_below_only_one(void **state)
{
    (void)state;
    const trip_effect_number *n = number_of("light-cells");
    triptych_settings s = triptych_default_settings();
    const int on[] = { 0, TRIPTYCH_SHADOWS, TRIPTYCH_OCCLUSION | TRIPTYCH_CUEING, TRIPTYCH_EMISSION,
                       TRIPTYCH_SHADOWS | TRIPTYCH_OCCLUSION };
    const int below[] = { TRIPTYCH_SHADOWS, TRIPTYCH_SHADOWS, TRIPTYCH_OCCLUSION, TRIPTYCH_EMISSION,
                          TRIPTYCH_SHADOWS };
    for (int i = 0; i < 5; i++) {
        s.effects = on[i];
        for (int k = 0; k < TRIP_EFFECT_SWITCHES; k++)
            assert_int_equal(trip_effect_number_is_below(n, &trip_effect_switches[k], &s),
                             trip_effect_switches[k].bit == below[i]);
    }
    assert_true(trip_effect_number_set(n, 48, &s) && s.light_cells == 48);
}

static void words_are_cut_at_the_end_of_the_buffer(void **state)
{
    (void)state;
    triptych_settings s = triptych_default_settings();
    s.effects = TRIPTYCH_SHADOWS | TRIPTYCH_OCCLUSION | TRIPTYCH_EMISSION;
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
        cmocka_unit_test(a_light_is_written_as_an_option_if_it_has_an_effect),
        cmocka_unit_test(effects_are_written_as_options_and_in_words),
        cmocka_unit_test(every_effect_has_its_own_switch),
        cmocka_unit_test(effects_without_light_or_heat_cannot_be_turned_on),
        cmocka_unit_test(numbers_of_effects_stay_within_their_bounds),
        cmocka_unit_test(a_number_of_several_effects_is_below_only_one),
        cmocka_unit_test(words_are_cut_at_the_end_of_the_buffer),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
