#include <unistd.h>

#include "program.h"

#include <sys/stat.h>

#include <cjson/cJSON.h>

#include "image_file.h"

static program_run run;

static int enter_with_data(void **state)
{
    if (program_enter_folder(state))
        return -1;
    program_call(&run, "brick -q %s/datasets/stent.nrrd -o stent.trip", TRIP_SOURCE_DIR);
    assert_works(&run);
    program_call(&run, "brick -q %s/datasets/densityAndHeat.vdb -o fog.trip", TRIP_SOURCE_DIR);
    assert_works(&run);
    return 0;
}

static bool exists(const char *path)
{
    struct stat s;
    return stat(path, &s) == 0;
}

typedef struct picture {
    int width, height;
    float *rgba;
} picture;

static picture load(const char *path)
{
    static trip_image_files files;
    picture p;
    assert_int_equal(trip_image_read(&files, path, &p.width, &p.height, &p.rgba), 0);
    return p;
}

static const float *at(const picture *p, int x, int y)
{
    return p->rgba + 4 * ((size_t)y * (size_t)p->width + (size_t)x);
}

/* Finds the maximum colour at the border of the picture, and in the whole picture. */
static void brightness(const picture *p, double *rim, double *all)
{
    *rim = *all = 0;
    for (int i = 0; i < p->width * p->height; i++) {
        int x = i % p->width, y = i / p->width;
        double max = fmax(at(p, x, y)[0], fmax(at(p, x, y)[1], at(p, x, y)[2]));
        *all = fmax(*all, max);
        if (x == 0 || y == 0 || x == p->width - 1 || y == p->height - 1)
            *rim = fmax(*rim, max);
    }
}

static void wrong_usage_is_one_line_and_exit_status_2(void **state)
{
    (void)state;
    const char *const wrong[] = {
        "",
        "fog.trip",
        "-o a.png",
        "fog.trip stent.nrrd -o a.png",
        "fog.trip -o a.xyz",
        "fog.trip -o a.png --nonsense",
        "fog.trip -o a.png --size",
        "fog.trip -o a.png --size 0x10",
        "fog.trip -o a.png --size -3x10",
        "fog.trip -o a.png --size 100000x10",
        "fog.trip -o a.png --eye 1,2",
        "fog.trip -o a.png --eye 1,2,nan",
        "fog.trip -o a.png --eye 1,1,1 --look 1,1,1",
        "fog.trip -o a.png --up 0,0,0",
        "fog.trip -o a.png --fov 180",
        "fog.trip -o a.png --fov 0",
        "fog.trip -o a.png --ortho 0",
        "fog.trip -o a.png --ortho 5 --fov 30",
        "fog.trip -o a.png --orbit 0",
        "fog.trip -o a.png --orbit 2.5",
        "fog.trip -o a.png --background 1,2,3",
        "fog.trip -o a.png --background whit",
        "fog.trip -o a.png --light 0,0,0",
        "fog.trip -o a.png --method blend",
        "fog.trip -o a.png --h 1",
        "fog.trip -o a.png --h -0.1",
        "fog.trip -o a.png --h 0.5 --method clip",
        "fog.trip -o a.png --kernel-radius 0",
        "fog.trip -o a.png --traversal down",
        "fog.trip -o a.png --renderer vulkan",
        "fog.trip -o a.png --target rgba8 --renderer reference",
        "fog.trip -o a.png --target rgba64f",
        "fog.trip -o a.png --submit sprites --renderer cpu",
        "fog.trip -o a.png --submit sprites,triangles",
        "fog.trip -o a.png --submit quads",
        "fog.trip -o a.png --occluded skip --renderer reference",
        "fog.trip -o a.png --memory 0",
        "fog.trip -o a.png --memory lots",
        "fog.trip -o a.png --engine aio",
        "fog.trip -o a.png --threads 0",
        "fog.trip -o a.png --tf preset:nonsense",
    };
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        program_call(&run, "render %s", wrong[i]);
        assert_fails(&run, 2);
        assert_false(exists("a.png"));
    }
}

static void failures_are_one_line_and_exit_status_1(void **state)
{
    (void)state;
    FILE *f = fopen("bad.tf", "w");
    fputs("0 1 1\n", f);
    fclose(f);
    const char *const failing[] = {
        "missing.trip -o a.png",
        "bad.tf -o a.png",
        "fog.trip -o missing/a.png",
        "fog.trip -o a.png --tf missing.tf",
        "fog.trip -o a.png --tf bad.tf",
        "fog.trip -o a.png --stats missing/a.json",
        "fog.trip -o a.png --memory 1M",
        "fog.trip -o a.png --memory 20M --renderer reference",
        "fog.trip -o a.png --memory 40M --renderer reference --classify pre",
    };
    for (size_t i = 0; i < sizeof failing / sizeof *failing; i++) {
        program_call(&run, "render %s --size 1000x1000", failing[i]);
        assert_fails(&run, 1);
    }
}

static void the_default_view_shows_the_whole_volume(void **state)
{
    (void)state;
    const char *const data[] = { "fog", "stent" };
    for (int i = 0; i < 2; i++) {
        program_call(&run, "render %s.trip -o a.png --size 160x120", data[i]);
        assert_works(&run);
        assert_int_equal(strncmp(run.out, "a.png: 160 x 120, ", 18), 0);
        picture p = load("a.png");
        double rim, all;
        brightness(&p, &rim, &all);
        assert_int_equal(p.width, 160);
        assert_int_equal(p.height, 120);
        assert_true(rim < 3.0 / 255); /* nothing that the eye sees; fog fades slowly */
        assert_true(all > 0.3);
        free(p.rgba);
        remove("a.png");
    }
}

static void the_default_background_is_black_in_png_and_clear_in_exr(void **state)
{
    (void)state;
    program_call(&run, "render fog.trip -o a.png --size 32x32");
    program_call(&run, "render fog.trip -o a.exr --size 32x32");
    program_call(&run, "render fog.trip -o b.exr --size 32x32 --background 0.25,0.5,1,0.5");
    picture png = load("a.png"), exr = load("a.exr"), given = load("b.exr");
    assert_true(at(&png, 0, 0)[3] == 1 && at(&png, 0, 0)[0] == 0);
    assert_true(at(&exr, 0, 0)[3] == 0 && at(&exr, 0, 0)[0] == 0);
    assert_true(fabsf(at(&given, 0, 0)[0] - 0.125F) < 1e-6F && at(&given, 0, 0)[2] == 0.5F);
    assert_true(at(&given, 0, 0)[3] == 0.5F);
    free(png.rgba);
    free(exr.rgba);
    free(given.rgba);
}

static void an_orbit_writes_numbered_images_that_differ(void **state)
{
    (void)state;
    program_call(&run, "render fog.trip -o turn.exr --size 24x24 --orbit 3 --stats turn.json");
    assert_works(&run);
    assert_true(exists("turn-000.exr") && exists("turn-001.exr") && exists("turn-002.exr"));
    assert_false(exists("turn.exr") || exists("turn-003.exr"));
    picture a = load("turn-000.exr"), b = load("turn-001.exr");
    assert_memory_not_equal(a.rgba, b.rgba, 24 * 24 * 4 * sizeof(float));
    free(a.rgba);
    free(b.rgba);
}

static cJSON *stats_of(const char *args)
{
    program_call(&run, "render %s -o a.exr --count --stats -", args);
    assert_works(&run);
    cJSON *root = cJSON_Parse(run.out); /* stdout has only the JSON */
    assert_non_null(root);
    return root;
}

static double drawn(const char *args)
{
    cJSON *root = stats_of(args);
    const cJSON *frame = cJSON_GetArrayItem(cJSON_GetObjectItem(root, "frames"), 0), *list;
    double sum = 0;
    cJSON_ArrayForEach(list, cJSON_GetObjectItem(frame, "counted"))
    {
        sum += cJSON_GetObjectItem(list, "splats_drawn")->valuedouble;
    }
    cJSON_Delete(root);
    return sum;
}

static double kept_voxels(const char *data)
{
    program_call(&run, "info --json %s", data);
    assert_works(&run);
    cJSON *root = cJSON_Parse(run.out);
    double kept = cJSON_GetObjectItem(root, "kept")->valuedouble;
    cJSON_Delete(root);
    return kept;
}

static void stats_have_the_fixed_keys(void **state)
{
    (void)state;
    const char *const strings[] = { "renderer", "device", "method" };
    const char *const times[] = { "ms", "read_ms", "draw_ms", "merge_ms" };
    const char *const counts[] = { "splats_read", "splats_projected", "splats_drawn" };
    cJSON *root = stats_of("stent.trip --size 64x48");
    for (int i = 0; i < 3; i++)
        assert_true(cJSON_IsString(cJSON_GetObjectItem(root, strings[i])));
    assert_int_equal(cJSON_GetArrayItem(cJSON_GetObjectItem(root, "size"), 0)->valueint, 64);
    assert_int_equal(cJSON_GetArrayItem(cJSON_GetObjectItem(root, "size"), 1)->valueint, 48);
    assert_true(cJSON_GetObjectItem(root, "peak_rss_bytes")->valuedouble > 1e6);
    const cJSON *frames = cJSON_GetObjectItem(root, "frames");
    assert_int_equal(cJSON_GetArraySize(frames), 1);
    const cJSON *frame = cJSON_GetArrayItem(frames, 0),
                *lists = cJSON_GetObjectItem(frame, "lists"),
                *counted = cJSON_GetObjectItem(frame, "counted");
    for (int i = 0; i < 4; i++)
        assert_true(cJSON_IsNumber(cJSON_GetObjectItem(frame, times[i])));
    for (const char *axis = "xyz"; *axis; axis++) {
        const char name[] = { *axis, 0 };
        const cJSON *list = cJSON_GetObjectItem(lists, name);
        assert_true(cJSON_IsNumber(cJSON_GetObjectItem(list, "splats_read")));
        assert_true(cJSON_IsNumber(cJSON_GetObjectItem(list, "bytes_read")));
        for (int i = 0; i < 3; i++)
            assert_true(
                cJSON_IsNumber(cJSON_GetObjectItem(cJSON_GetObjectItem(counted, name), counts[i])));
    }
    cJSON_Delete(root);
}

static void with_h_0_each_voxel_is_drawn_three_times_or_once(void **state)
{
    (void)state;
    const char *const renderers[] = { "auto", "cpu", "reference" };
    double kept = kept_voxels("stent.trip");
    for (int i = 0; i < 3; i++) {
        char args[256];
        snprintf(args, sizeof args, "stent.trip --size 200x200 --h 0 --renderer %s", renderers[i]);
        assert_true(drawn(args) == 3 * kept);
        snprintf(args, sizeof args,
                 "stent.trip --size 200x200 --h 0 --renderer %s --ortho 300"
                 " --look 64,64,128 --eye 64,-500,128",
                 renderers[i]);
        assert_true(drawn(args) == kept);
    }
}

static void skipping_occluded_bricks_does_not_change_the_picture(void **state)
{
    (void)state;
    const char *const classify[] = { "pre", "post" };
    const char *const look = "--tf preset:bone --size 100x100 --classify";
    for (int i = 0; i < 2; i++) {
        program_call(&run, "render stent.trip -o a.exr %s %s --occluded skip", look, classify[i]);
        assert_works(&run);
        program_call(&run, "render stent.trip -o b.exr %s %s --occluded draw", look, classify[i]);
        assert_works(&run);
        picture a = load("a.exr"), b = load("b.exr");
        assert_memory_equal(a.rgba, b.rgba, 100 * 100 * 4 * sizeof(float));
        free(a.rgba);
        free(b.rgba);
    }
}

static void explain_prints_the_plan_and_its_cost(void **state)
{
    (void)state;
    const char *const more[] = { "", "--classify pre" };
    for (int i = 0; i < 2; i++) {
        program_call(&run, "render stent.trip -o a.png --size 64x64 --explain --no-shading %s",
                     more[i]);
        assert_works(&run);
        assert_non_null(strstr(run.out, i ? "classify    pre" : "classify    post"));
        assert_non_null(strstr(run.out, "method      merge"));
        assert_non_null(strstr(run.out, "list y      read: "));
        assert_non_null(strstr(run.out, "shading     does not run: switched off"));
        assert_non_null(strstr(run.out, "cost y      "));
        assert_non_null(strstr(run.out, "time        "));
    }
}

static void a_warning_counts_the_voxels_that_bricking_dropped(void **state)
{
    (void)state;
    FILE *f = fopen("all.tf", "w");
    fputs("0 1 1 1 0.1\n1 1 1 1 0.1\n", f);
    fclose(f);
    program_call(&run, "brick -q %s/datasets/densityAndHeat.vdb --range 0.1:1 -o part.trip",
                 TRIP_SOURCE_DIR);
    assert_works(&run);
    program_call(&run, "render part.trip -o a.png --size 32x32 --tf all.tf");
    assert_works(&run);
    const char *about = strstr(run.err, "reveals about ");
    assert_int_equal(strncmp(run.err, "triptych: warning: part.trip: ", 30), 0);
    assert_non_null(about);
    /* The volume has 6124 voxels. The warning counts all voxels that are not kept. */
    double others = 6124 - kept_voxels("part.trip");
    assert_true(fabs(strtod(about + strlen("reveals about "), NULL) - others) < 0.02 * others);
}

static void a_failed_write_leaves_no_file(void **state)
{
    (void)state;
    program_call(&run, "render fog.trip -o /dev/full/a.png --size 32x32");
    assert_fails(&run, 1);
    const char *command = TRIP_PROGRAM " render fog.trip -o a.png --size 32x32 --stats -"
                                       " >/dev/full 2>err.txt";
    int status = system(command);
    run.exit_status = WEXITSTATUS(status);
    program_read("err.txt", run.err, sizeof run.err);
    assert_fails(&run, 1);
    assert_int_equal(WEXITSTATUS(system("ls *.partial* 2>/dev/null")), 2);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(wrong_usage_is_one_line_and_exit_status_2),
        cmocka_unit_test(failures_are_one_line_and_exit_status_1),
        cmocka_unit_test(the_default_view_shows_the_whole_volume),
        cmocka_unit_test(the_default_background_is_black_in_png_and_clear_in_exr),
        cmocka_unit_test(an_orbit_writes_numbered_images_that_differ),
        cmocka_unit_test(stats_have_the_fixed_keys),
        cmocka_unit_test(with_h_0_each_voxel_is_drawn_three_times_or_once),
        cmocka_unit_test(skipping_occluded_bricks_does_not_change_the_picture),
        cmocka_unit_test(explain_prints_the_plan_and_its_cost),
        cmocka_unit_test(a_warning_counts_the_voxels_that_bricking_dropped),
        cmocka_unit_test(a_failed_write_leaves_no_file),
    };
    return cmocka_run_group_tests(tests, enter_with_data, program_leave_folder);
}
