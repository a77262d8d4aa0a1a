#include "test.h"

#include <stdlib.h>

#include "draw_settings.h"

/* Settings with a value in every row. */
static draw_settings full(void)
{
    static const char *const options =
        " --background 0.25,0.5,0.75,1 --light point:1,-2,0.1 --effects shadows,emission,edl"
        " --anisotropy -0.5 --cueing 0.25 --light-cells 64 --temperature 100:3000"
        " --edl-strength 0.5 --edl-radius 2 --no-shading"
        " --clip-box voxels:1,2,3,4,5.5,6 --clip-plane 1,0,0,-3 --clip-plane 0,1,0,0.1"
        " --quality high --classify pre --early-termination 0 --kernel ewa --interpolation cubic"
        " --lod 1.5 --max-bytes 1048576 --max-ms 20 --samples 3 --samples-per-sheet auto"
        " --depth --count --show levels --field splats --tolerance 0.001 --compositing sheet"
        " --flatten 3 --h 0 --kernel-radius 2.5 --low-pass ewa --low-pass-width 0"
        " --method clip --normalise --submit indexed --submit triangles --target rgba16f "
        "--traversal ascending"
        " --weights vertex --order lists --sheet 0.125 --sh 2 --sides front";
    draw_settings s = { .has_background = 0 };
    assert_int_equal(draw_settings_read_text(&s, options), 0);
    char *text = draw_settings_text(&s);
    assert_string_equal(text, options);
    free(text);
    return s;
}

static void every_row_reads_and_prints_the_same_option(void **state)
{
    (void)state;
    const draw_settings s = full();
    for (int i = 0; i < DRAW_OPTIONS; i++)
        assert_true(i == DRAW_DEPTH || trip_option_is_set(&draw_settings_table.rows[i], &s));
    assert_int_equal(draw_settings_check_ranges(&s), 0);
}

static void options_set_the_members_of_their_names(void **state)
{
    (void)state;
    const draw_settings s = full();
    assert_true(s.background[1] == 0.5 && s.background[3] == 1);
    assert_int_equal(s.light.kind, TRIPTYCH_LIGHT_POINT);
    assert_true(s.light.toward[1] == -2 && s.light.no_shading);
    assert_int_equal(s.effects.which,
                     TRIPTYCH_EFFECT_SHADOWS | TRIPTYCH_EFFECT_EMISSION | TRIPTYCH_EFFECT_EDL);
    assert_true(s.effects.kelvin[0] == 100 && s.effects.kelvin[1] == 3000);
    assert_true(s.clip.box && s.clip.box_of_voxels && s.clip.box_hi[1] == 5.5);
    assert_int_equal(s.clip.planes, 2);
    assert_int_equal(s.all.quality, TRIPTYCH_QUALITY_HIGH);
    assert_int_equal(s.all.classify, TRIPTYCH_CLASSIFY_PRE);
    assert_int_equal(s.all.interpolation, TRIPTYCH_INTERPOLATION_CUBIC);
    assert_int_equal(s.splat.footprint, TRIPTYCH_FOOTPRINT_EWA);
    assert_true(s.all.early_termination == TRIPTYCH_ZERO && s.all.h == TRIPTYCH_ZERO);
    assert_true(s.splat.low_pass_px == TRIPTYCH_ZERO);
    assert_int_equal(s.sheet.samples, -1);
    assert_int_equal(s.splat.lists, TRIPTYCH_SUBMIT_INDEXED);
    assert_int_equal(s.splat.primitives, TRIPTYCH_SUBMIT_TRIANGLES);
    assert_int_equal(s.all.traversal, TRIPTYCH_TRAVERSAL_ASCENDING);
}

static draw_settings read_light(const char *options)
{
    draw_settings s = { .has_background = 0 };
    assert_int_equal(draw_settings_read_text(&s, options), 0);
    char *text = draw_settings_text(&s);
    assert_string_equal(text, options);
    free(text);
    return s;
}

static void the_words_before_a_light_select_its_kind(void **state)
{
    (void)state;
    const draw_settings view = read_light(" --light -1,2,3"),
                        world = read_light(" --light world:-1,2,3"),
                        point = read_light(" --light point:-1,2,3");
    assert_int_equal(view.light.kind, TRIPTYCH_LIGHT_VIEW);
    assert_int_equal(world.light.kind, TRIPTYCH_LIGHT_DIRECTION);
    assert_int_equal(point.light.kind, TRIPTYCH_LIGHT_POINT);
    assert_true(view.light.toward[0] == -1 && world.light.toward[2] == 3);
    assert_false(draw_settings_same(&view, &world));
}

static void the_longest_values_are_printed_completely(void **state)
{
    (void)state;
    draw_settings s = { .clip = { .planes = 6 }, .lod = { .max_bytes = 1e18 } },
                  again = { .has_background = 0 };
    for (int i = 0; i < 24; i++)
        s.clip.plane[i / 4][i % 4] = -1.2345678901234567e-300 / (i + 3);
    char *text = draw_settings_text(&s);
    assert_int_equal(draw_settings_read_text(&again, text), 0);
    assert_true(draw_settings_same(&s, &again));
    free(text);
}

static void a_difference_in_any_row_is_seen(void **state)
{
    (void)state;
    const draw_settings s = full();
    assert_true(draw_settings_same(&s, &s));
    for (int i = 0; i < DRAW_OPTIONS; i++) {
        draw_settings other = s;
        draw_settings_unset(&other, i);
        assert_int_equal(draw_settings_same(&s, &other), false);
    }
    draw_settings moved = s, lit = s, dark = s, cut = s;
    moved.clip.box_lo[2] = 2;
    lit.light.toward[0] = 7;
    dark.background[0] = 0;
    cut.clip.plane[1][3] = 0;
    assert_false(draw_settings_same(&s, &moved) || draw_settings_same(&s, &lit));
    assert_false(draw_settings_same(&s, &dark) || draw_settings_same(&s, &cut));
}

static void public_settings_point_to_every_group(void **state)
{
    (void)state;
    const draw_settings s = full(), none = draw_settings_of(NULL);
    const triptych_settings settings = draw_settings_public(&s);
    const draw_settings back = draw_settings_of(&settings);
    assert_true(draw_settings_same(&s, &back));
    assert_false(draw_settings_same(&s, &none));
    assert_string_equal(draw_settings_choice(&s, DRAW_METHOD), "clip");
    assert_string_equal(draw_settings_choice(&none, DRAW_METHOD), "merge");
    assert_true(draw_settings_background(&none)[3] == 1);
}

static int read_one(const char *options)
{
    draw_settings s = { .has_background = 0 };
    return draw_settings_read_text(&s, options);
}

static void bad_values_are_refused(void **state)
{
    (void)state;
    static const char *const bad[] = {
        "--kernel-radius 0.05",
        "--h 1",
        "--h -0.1",
        "--early-termination 0.2",
        "--samples 65",
        "--samples 1.5",
        "--cueing 0",
        "--temperature 5:5",
        "--effects none,auto",
        "--effects sun",
        "--method merges",
        "--submit indexed,replicated",
        "--light 0,0,0",
        "--clip-box 1,1",
        "--wrong",
        "--samples",
        "--background 0,0,2",
        "--max-bytes x",
        "--clip-plane 0,0,0,1",
    };
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++)
        assert_int_not_equal(read_one(bad[i]), 0);
    assert_int_equal(read_one("--submit indexed,sprites --effects none --light head"), 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_row_reads_and_prints_the_same_option),
        cmocka_unit_test(options_set_the_members_of_their_names),
        cmocka_unit_test(the_words_before_a_light_select_its_kind),
        cmocka_unit_test(the_longest_values_are_printed_completely),
        cmocka_unit_test(a_difference_in_any_row_is_seen),
        cmocka_unit_test(public_settings_point_to_every_group),
        cmocka_unit_test(bad_values_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
