#include "test.h"
#include "draw_settings.h"

#include <sys/stat.h>
#include <unistd.h>

#include "state_file.h"

static trip_view_state defaults(void)
{
    return (trip_view_state){
        .opacity_scale = 1,
    };
}

static trip_view_state unusual(void)
{
    trip_view_state s = defaults();
    s.has_navigation = true;
    s.navigation = (trip_navigation){ .eye = { 1.0 / 3, -2e-17, 5e20 },
                                      .look = { 0, 1e-3, 4 },
                                      .up = { 0.1, 0.7, 0 },
                                      .upright = { 0, 1, 0 },
                                      .fov_degrees = 30.000000000000004,
                                      .ortho_height = 0.1 };
    s.text = strdup("unit voxel\nvalues data\n0 0 0 0 0\n1 1 1 1 0.5\n");
    s.heat = strdup("/data/heat of it.trip");
    s.opacity_scale = 2.5;
    s.settings.all.classify = TRIPTYCH_CLASSIFY_POST;
    s.settings.sheet.samples = 3;
    s.settings.splat.compositing = TRIPTYCH_COMPOSITING_SHEET;
    s.settings.all.early_termination = 1.0 / 96;
    s.settings.lod.voxel_px = 1.5;
    s.settings.light.kind = TRIPTYCH_LIGHT_POINT;
    s.settings.light.toward[1] = -1.0 / 7;
    s.settings.effects.which = TRIPTYCH_EFFECT_EMISSION | TRIPTYCH_EFFECT_CUEING;
    s.settings.effects.kelvin[0] = 100.0 / 3;
    s.settings.effects.kelvin[1] = 3000;
    s.settings.has_background = 1;
    s.settings.background[2] = 0.2;
    s.settings.all.show = TRIPTYCH_SHOW_LEVELS;
    s.settings.clip = (triptych_clip){ .box = 1,
                                       .box_lo = { 0.1, -1.0 / 3, 2 },
                                       .box_hi = { 1, 0, 1e9 },
                                       .planes = 2,
                                       .plane = { { 1.0 / 7, 0, 0, 5 }, { 0, 0, -1, 0.3 } } };
    s.clips = true;
    s.panel = s.axes = true;
    return s;
}

/* Compares the members, because padding between them is undefined. */
static void assert_same_clip(const triptych_clip *a, const triptych_clip *b)
{
    assert_int_equal(a->box, b->box);
    assert_int_equal(a->box_of_voxels, b->box_of_voxels);
    assert_memory_equal(a->box_lo, b->box_lo, sizeof a->box_lo);
    assert_memory_equal(a->box_hi, b->box_hi, sizeof a->box_hi);
    assert_int_equal(a->planes, b->planes);
    assert_memory_equal(a->plane, b->plane, sizeof a->plane);
}

static void assert_same(const trip_view_state *a, const trip_view_state *b)
{
    char *p = trip_view_state_print(a, "/d"), *q = trip_view_state_print(b, "/d");
    assert_string_equal(p, q);
    free(p);
    free(q);
    assert_memory_equal(&a->navigation, &b->navigation, sizeof a->navigation);
    assert_int_equal(a->settings.light.kind, b->settings.light.kind);
    assert_memory_equal(a->settings.light.toward, b->settings.light.toward,
                        sizeof a->settings.light.toward);
    assert_true(a->settings.background[2] == b->settings.background[2]);
    assert_int_equal(a->settings.all.classify, b->settings.all.classify);
    assert_int_equal(a->settings.sheet.samples, b->settings.sheet.samples);
    assert_int_equal(a->settings.splat.compositing, b->settings.splat.compositing);
    assert_true(a->settings.lod.voxel_px == b->settings.lod.voxel_px);
    assert_same_clip(&a->settings.clip, &b->settings.clip);
    assert_int_equal(a->settings.all.show, b->settings.all.show);
    assert_int_equal(a->settings.effects.which, b->settings.effects.which);
    assert_memory_equal(a->settings.effects.kelvin, b->settings.effects.kelvin,
                        sizeof a->settings.effects.kelvin);
    assert_string_equal(a->heat, b->heat);
    assert_int_equal(a->clips, b->clips);
}

static int use_folder(void **state)
{
    (void)state;
    char here[4096], folder[4200];
    if (!getcwd(here, sizeof here))
        return -1;
    snprintf(folder, sizeof folder, "%s/state_home/deeper", here);
    return setenv("XDG_STATE_HOME", folder, 1);
}

static int remove_folder(void **state)
{
    (void)state;
    return system("rm -rf state_home");
}

static void a_saved_state_is_restored_exactly(void **state)
{
    (void)state;
    trip_view_state kept = unusual(), found = defaults();
    found.function = strdup("bone");
    assert_int_equal(trip_state_file_load(&found, "/data/head.trip"), 0);
    assert_string_equal(found.function, "bone");
    assert_int_equal(trip_state_file_save(&kept, "/data/head.trip"), 0);
    assert_int_equal(trip_state_file_load(&found, "/data/other.trip"), 0);
    assert_int_equal(trip_state_file_load(&found, "/data/head.trip"), 1);
    assert_same(&found, &kept);
    assert_null(found.function);
    /* A later save replaces the file. */
    kept.settings.all.samples = 2;
    assert_int_equal(trip_state_file_save(&kept, "/data/head.trip"), 0);
    assert_int_equal(trip_state_file_load(&found, "/data/head.trip"), 1);
    assert_int_equal(found.settings.all.samples, 2);
    trip_view_state_release(&found);
    trip_view_state_release(&kept);
}

/* Files of transfer functions may be in Latin-1, with lines of at most 1023 bytes. */
static void transfer_functions_with_comments_in_latin_1_are_saved(void **state)
{
    (void)state;
    trip_view_state kept = defaults(), found = defaults();
    char text[1100] = "0 0 0 0 0\n1 1 1 1 0.5 # ";
    const size_t begun = strlen(text);
    memset(text + begun, 0xe9, 1000);
    kept.text = strdup(text);
    assert_int_equal(trip_state_file_save(&kept, "/data/accents.trip"), 0);
    assert_int_equal(trip_state_file_load(&found, "/data/accents.trip"), 1);
    assert_int_equal(strlen(found.text), begun + 1000);
    assert_memory_equal(found.text, text, begun);
    trip_view_state_release(&found);
    trip_view_state_release(&kept);
}

static void a_link_to_a_data_set_has_the_same_state(void **state)
{
    (void)state;
    char *a, *b;
    assert_int_equal(mkdir("set.trip", 0700), 0);
    assert_int_equal(symlink("set.trip", "link.trip"), 0);
    assert_int_equal(trip_state_file_path(&a, "set.trip"), 0);
    assert_int_equal(trip_state_file_path(&b, "./link.trip"), 0);
    assert_string_equal(a, b);
    free(a);
    free(b);
    unlink("link.trip");
    rmdir("set.trip");
}

static void assert_refused(const char *from, const char *to, const char *why)
{
    trip_view_state s = unusual(), before = s;
    char *text = trip_view_state_print(&s, "/d"), *at = strstr(text, from), *changed;
    assert_non_null(at);
    assert_true(asprintf(&changed, "%.*s%s%s", (int)(at - text), text, to, at + strlen(from)) > 0);
    test_catch_reports();
    assert_int_equal(trip_view_state_parse(&s, "/d", changed, "state.json"), TRIP_ERROR);
    assert_one_report(why);
    assert_memory_equal(&s, &before, sizeof s);
    free(changed);
    free(text);
    trip_view_state_release(&s);
}

static void an_invalid_state_is_refused_completely(void **state)
{
    (void)state;
    assert_refused("\"opacity_scale\":\t2.5", "\"opacity_scale\":\t1e9", "opacity_scale");
    assert_refused("\"opacity_scale\":\t2.5", "\"opacity_scale\":\t\"2\"", "opacity_scale");
    assert_refused("--samples-per-sheet 3", "--samples-per-sheet 2.5", "samples-per-sheet");
    assert_refused("--samples-per-sheet 3", "--samples-per-sheet 17", "samples-per-sheet");
    assert_refused("--lod 1.5", "--lod -1", "lod");
    assert_refused("--compositing sheet", "--compositing sheets", "compositing");
    assert_refused("--compositing sheet", "--compositing", "compositing");
    assert_refused("--compositing sheet", "--composting sheet", "composting");
    assert_refused("\"fov_degrees\":\t30", "\"fov_degrees\":\t230", "fov_degrees");
    assert_refused("\"fov_degrees\":\t30", "\"fow\":\t30", "fov_degrees");
    assert_refused("5e+20", "1e999", "eye");
    assert_refused("5e+20", "5, 3", "eye");
    assert_refused("[0.1, 0.7, 0]", "[0, 0, 0]", "the camera is invalid");
    assert_refused("[0, 1, 0]", "[0, 0.5, 0]", "the camera is invalid");
    assert_refused("\"heat\":\t\"/data/heat of it.trip\"", "\"heat\":\t7", "heat");
    assert_refused("--effects cueing", "--effects cuing", "effects");
    assert_refused("33.3", "3333.3", "temperature");
    assert_refused("\"panel\":\ttrue", "\"panel\":\t1", "panel");
    assert_refused("1 1 1 1 0.5", "1 1 1 1 7.5", "opacity");
    assert_refused("-0.142", "x", "light");
    assert_refused("\"triptych_view\":\t2", "\"triptych_view\":\t\"2\"", "is not a state file");
    trip_view_state s = defaults();
    test_catch_reports();
    assert_int_equal(trip_view_state_parse(&s, "/d", "[[[", "state.json"), TRIP_ERROR);
    assert_one_report("is not a state file");
}

static void states_of_other_versions_and_data_sets_are_ignored(void **state)
{
    (void)state;
    trip_view_state s = defaults(), before = s;
    char *text = trip_view_state_print(&s, "/d");
    assert_int_equal(trip_view_state_parse(&s, "/e", text, "f"), 0);
    assert_int_equal(
        trip_view_state_parse(&s, "/d", "{\"triptych_view\": 3, \"data\": \"/d\"}", "f"), 0);
    assert_memory_equal(&s, &before, sizeof s);
    assert_int_equal(
        trip_view_state_parse(&s, "/d", "{\"triptych_view\": 2, \"data\": \"/d\"}", "f"), 1);
    assert_memory_equal(&s, &before, sizeof s);
    free(text);
}

static void a_folder_in_place_of_the_file_is_reported(void **state)
{
    (void)state;
    trip_view_state s = defaults();
    char *path;
    assert_int_equal(trip_state_file_path(&path, "/data/folder.trip"), 0);
    assert_int_equal(trip_state_file_save(&s, "/data/folder.trip"), 0);
    assert_int_equal(unlink(path), 0);
    assert_int_equal(mkdir(path, 0700), 0);
    test_catch_reports();
    assert_int_equal(trip_state_file_load(&s, "/data/folder.trip"), TRIP_ERROR);
    assert_one_report("cannot be read, or");
    rmdir(path);
    free(path);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_saved_state_is_restored_exactly),
        cmocka_unit_test(transfer_functions_with_comments_in_latin_1_are_saved),
        cmocka_unit_test(a_link_to_a_data_set_has_the_same_state),
        cmocka_unit_test(an_invalid_state_is_refused_completely),
        cmocka_unit_test(states_of_other_versions_and_data_sets_are_ignored),
        cmocka_unit_test(a_folder_in_place_of_the_file_is_reported),
    };
    return cmocka_run_group_tests(tests, use_folder, remove_folder);
}
