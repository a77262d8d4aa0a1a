#include "test.h"

#include <stdlib.h>
#include <string.h>

#include "draw_settings.h"
#include "scope.h"

static char line[400];

static void keep(const char *text, void *user)
{
    (void)user;
    snprintf(line, sizeof line, "%s", text);
}

/* Checks settings given as options; fills `line` with the failure. */
static int check(const char *options, triptych_renderer *renderer)
{
    draw_settings s = { .has_background = 0 };
    trip_scope scope = { .sink = keep }, *before = trip_scope_enter(&scope);
    line[0] = 0;
    int status = draw_settings_read_text(&s, options);
    if (!status)
        status = draw_settings_check(&s, renderer, true);
    trip_scope_enter(before);
    return status;
}

static void assert_refused(const char *options, triptych_renderer renderer, const char *reason)
{
    assert_int_not_equal(check(options, &renderer), 0);
    if (!strstr(line, reason))
        fail_msg("%s: \"%s\" lacks \"%s\"", options, line, reason);
}

static void the_message_names_the_option_and_the_reason(void **state)
{
    (void)state;
    const triptych_renderer any = TRIPTYCH_RENDERER_AUTO, integral = TRIPTYCH_RENDERER_INTEGRAL;
    assert_refused("--light 1,0,0 --no-shading", any, "--light: does not apply with --no-shading");
    assert_refused("--effects shadows --light head", any,
                   "shadows cannot be seen with --light head");
    assert_refused("--h 0.5 --method clip", any, "--h: requires --method merge");
    assert_refused("--tolerance 0.01", any, "--tolerance: requires --renderer integral");
    assert_refused("--lod 2", integral, "--lod: does not apply to --renderer integral");
    assert_refused("--classify post --kernel-radius 2", any,
                   "--kernel-radius: requires --classify pre");
    assert_refused("--quality draft --compositing splat", any,
                   "--compositing: requires --classify pre");
    assert_refused("--samples-per-sheet 2 --target rgba8", any, "does not apply with options for");
    assert_refused("--low-pass uniform --kernel ewa", any, "uniform requires --renderer reference");
    assert_refused("--kernel gaussian", integral, "must be nearest, linear or cubic");
    assert_refused("--depth --samples 2", any, "--depth: requires --samples 1");
    assert_refused("--lod 1 --submit resident", any, "--submit indexed or resident");
    assert_refused("--lod 1 --submit indexed", any, "--lod: does not apply to --submit indexed");
    assert_refused("--method image", TRIPTYCH_RENDERER_CPU, "image requires --renderer reference");
}

static void settings_select_the_renderer_that_they_require(void **state)
{
    (void)state;
    triptych_renderer renderer = TRIPTYCH_RENDERER_AUTO;
    assert_int_equal(check("--method image", &renderer), 0);
    assert_int_equal(renderer, TRIPTYCH_RENDERER_REFERENCE);
    renderer = TRIPTYCH_RENDERER_AUTO;
    assert_int_equal(check("--submit triangles", &renderer), 0);
    assert_int_equal(renderer, TRIPTYCH_RENDERER_GL);
    renderer = TRIPTYCH_RENDERER_AUTO;
    assert_int_equal(check("--kernel-radius 3", &renderer), 0);
    assert_int_equal(renderer, TRIPTYCH_RENDERER_AUTO);
}

static void excluded_settings_are_dropped_and_others_stay(void **state)
{
    (void)state;
    draw_settings s = { .has_background = 0 };
    triptych_renderer renderer = TRIPTYCH_RENDERER_CPU;
    assert_int_equal(draw_settings_read_text(&s, "--classify post --kernel-radius 3 --h 0.5 "
                                                 "--method axis --samples 2 --submit indexed"),
                     0);
    draw_settings_drop_excluded(&s, renderer);
    assert_int_equal(draw_settings_check(&s, &renderer, true), 0);
    assert_true(s.splat.kernel_radius == 0 && s.all.h == 0 && s.splat.lists == 0);
    assert_int_equal(s.all.classify, TRIPTYCH_CLASSIFY_POST);
    assert_int_equal(s.all.method, TRIPTYCH_METHOD_AXIS);
    assert_int_equal(s.all.samples, 2);
}

static void settings_of_splats_are_named(void **state)
{
    (void)state;
    draw_settings s = { .has_background = 0 };
    assert_null(draw_settings_of_splats(&s));
    s.splat.footprint = TRIPTYCH_FOOTPRINT_EXACT;
    assert_string_equal(draw_settings_of_splats(&s), "kernel");
    s = (draw_settings){ .all = { .traversal = TRIPTYCH_TRAVERSAL_ASCENDING } };
    assert_string_equal(draw_settings_of_splats(&s), "traversal");
}

/* Returns the failure of settings for a kind of data; "" if they apply. */
static const char *kind_failure(const draw_settings *s, const triptych_resources *r, draw_kind kind)
{
    trip_scope scope = { .sink = keep }, *before = trip_scope_enter(&scope);
    line[0] = 0;
    const int status = draw_settings_check_kind(s, r, kind);
    trip_scope_enter(before);
    assert_int_equal(status, line[0] ? -2 : 0);
    return line;
}

static void settings_of_another_kind_of_data_are_refused_and_dropped(void **state)
{
    (void)state;
    static const struct {
        const char *options;
        draw_kind kind;
        const char *says, *kept;
    } cases[] = {
        { "--effects occlusion --order lists", DRAW_KIND_SCENE, "--effects: must be edl or none",
          " --order lists" },
        { "--effects edl,cueing --edl-radius 2", DRAW_KIND_CLOUD,
          "--effects: must be occlusion, edl, auto or none", " --effects edl --edl-radius 2" },
        { "--light head --effects occlusion --light-cells 64", DRAW_KIND_CLOUD, "",
          " --light head --effects occlusion --light-cells 64" },
        { "--effects occlusion --light-cells 64", DRAW_KIND_SCENE, "--light-cells: does not apply",
          "" },
        { "--h 0.5 --order depth", DRAW_KIND_SCENE, "--h: does not apply", " --order depth" },
        { "--h 0.5 --method axis --order lists", DRAW_KIND_SCENE, "",
          " --h 0.5 --method axis --order lists" },
        { "--kernel fixed --samples 2", DRAW_KIND_SCENE, "fixed does not apply", " --samples 2" },
        { "--kernel ewa --sh 1", DRAW_KIND_SCENE, "", " --kernel ewa --sh 1" },
        { "--method image --order lists", DRAW_KIND_SCENE, "image does not apply",
          " --order lists" },
        { "--clip-box voxels:0,0,0,1,1,1", DRAW_KIND_SCENE, "voxels: does not apply", "" },
        { "--clip-box 0,0,0,1,1,1", DRAW_KIND_SCENE, "", " --clip-box 0,0,0,1,1,1" },
        { "--order depth --quality high", DRAW_KIND_VOLUME,
          "--order: applies to Gaussian scenes only", " --quality high" },
        { "--sh 0", DRAW_KIND_VOLUME, "--sh: applies to Gaussian scenes only", "" },
        { "--method image --h 0.5", DRAW_KIND_VOLUME, "", " --h 0.5 --method image" },
        { "--lod 2", DRAW_KIND_OBJECTS, "--lod: does not apply to a picture with volumes", "" },
        { "--lod 0", DRAW_KIND_OBJECTS, "", " --lod 0" },
        { "--order lists --sh 1", DRAW_KIND_OBJECTS, "--order: lists does not apply", " --sh 1" },
        { "--order depth --classify post --effects occlusion", DRAW_KIND_OBJECTS, "",
          " --effects occlusion --classify post --order depth" },
        { "--show lists --order lists", DRAW_KIND_SCENE, "", " --show lists --order lists" },
        { "--show lists --order depth", DRAW_KIND_SCENE, "--show: does not apply",
          " --order depth" },
        { "--show levels --order lists", DRAW_KIND_CLOUD, "levels does not apply",
          " --order lists" },
        { "--show merge --h 0.5", DRAW_KIND_OBJECTS, "--show: does not apply", " --h 0.5" },
        { "--max-ms 20", DRAW_KIND_OBJECTS, "--max-ms: does not apply", "" },
        { "--clip-box voxels:0,0,0,1,1,1", DRAW_KIND_OBJECTS, "voxels: does not apply", "" },
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        const triptych_resources none = { 0 };
        draw_settings s = { .has_background = 0 };
        assert_int_equal(draw_settings_read_text(&s, cases[i].options), 0);
        const char *said = kind_failure(&s, &none, cases[i].kind);
        if (cases[i].says[0] ? !strstr(said, cases[i].says) : said[0] != 0)
            fail_msg("%s: \"%s\"", cases[i].options, said);
        draw_settings_drop_kind(&s, cases[i].kind);
        char *kept = draw_settings_text(&s);
        assert_string_equal(kept, cases[i].kept);
        free(kept);
        assert_string_equal(kind_failure(&s, &none, cases[i].kind), "");
    }
}

static void resources_that_scenes_do_not_use_are_refused(void **state)
{
    (void)state;
    const draw_settings s = { .has_background = 0 };
    const triptych_resources engine = { .engine = TRIPTYCH_ENGINE_URING };
    const triptych_resources occluded = { .read_occluded = 1 };
    const triptych_resources plain = { .engine = TRIPTYCH_ENGINE_PREAD,
                                       .renderer = TRIPTYCH_RENDERER_REFERENCE };
    assert_non_null(strstr(kind_failure(&s, &engine, true), "--engine: must be pread"));
    assert_non_null(strstr(kind_failure(&s, &occluded, true), "--occluded: does not apply"));
    assert_string_equal(kind_failure(&s, &plain, true), "");
    assert_string_equal(kind_failure(&s, &engine, false), "");
    assert_string_equal(kind_failure(&s, &occluded, false), "");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_message_names_the_option_and_the_reason),
        cmocka_unit_test(settings_select_the_renderer_that_they_require),
        cmocka_unit_test(excluded_settings_are_dropped_and_others_stay),
        cmocka_unit_test(settings_of_splats_are_named),
        cmocka_unit_test(settings_of_another_kind_of_data_are_refused_and_dropped),
        cmocka_unit_test(resources_that_scenes_do_not_use_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
