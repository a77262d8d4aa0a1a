#include "test.h"

#include <stdlib.h>

#include "look_text.h"

static void assert_text(const triptych_settings *s, const char *function, double opacity_scale,
                        const char *expected)
{
    char *text = trip_look_text(s, function, opacity_scale);
    assert_string_equal(text, expected);
    free(text);
}

static void defaults_are_left_out(void **state)
{
    (void)state;
    const triptych_settings s = triptych_default_settings();
    assert_text(&s, NULL, 1, "");
}

static void a_transfer_function_is_quoted_as_one_word(void **state)
{
    (void)state;
    const triptych_settings s = triptych_default_settings();
    assert_text(&s, "bone", 1, " --tf bone");
    assert_text(&s, "it's my.tf", 0.1, " --tf 'it'\\''s my.tf' --opacity-scale 0.1");
}

static void pre_and_post_have_their_own_options(void **state)
{
    (void)state;
    triptych_settings s = triptych_default_settings();
    s.samples_per_sheet = 3;
    s.compositing = TRIPTYCH_BY_SHEET;
    s.kernel_radius = 2.5;
    assert_text(&s, NULL, 1, " --samples-per-sheet 3");
    s.classify = TRIPTYCH_POST;
    assert_text(&s, NULL, 1, " --classify post --samples-per-sheet 3");
    s.classify = TRIPTYCH_PRE;
    assert_text(&s, NULL, 1, " --classify pre --compositing sheet --kernel-radius 2.5");
}

static void settings_of_the_panel_are_written(void **state)
{
    (void)state;
    triptych_settings s = triptych_default_settings();
    s.h = 0.25;
    s.early_termination = 0;
    s.lod_px = 1.5;
    s.samples = 2;
    assert_text(&s, NULL, 1, " --h 0.25 --early-termination 0 --lod 1.5 --samples 2");
    s = triptych_default_settings();
    s.method = TRIPTYCH_AXIS;
    s.h = 0.25; /* only `merge` uses h */
    s.shading = 0;
    s.show = TRIPTYCH_SHOW_LEVELS;
    s.background[1] = 0.5;
    assert_text(&s, NULL, 1, " --method axis --no-shading --show levels --background 0,0.5,0,1");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(defaults_are_left_out),
        cmocka_unit_test(a_transfer_function_is_quoted_as_one_word),
        cmocka_unit_test(pre_and_post_have_their_own_options),
        cmocka_unit_test(settings_of_the_panel_are_written),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
