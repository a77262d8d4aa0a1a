/* Tests the library as other programs use it, with only its headers and its shared object. */
#include "draw_settings.h"
#include <triptych_brick.h>

#include <math.h>
#include <pthread.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include <cmocka.h>

#include "contexts.h"
#include "sanitizers.h"

enum { SIZE = 96, FLOATS = 4 * SIZE * SIZE };

#define DATA_SET "library.trip"
#define VOLUME TRIP_SOURCE_DIR "/datasets/tooth.nhdr"

static int brick(void **state)
{
    (void)state;
    const char *grey = "grey";
    const triptych_brick_options options = { .functions = &grey,
                                             .function_count = 1,
                                             .automatic = 1,
                                             .normals = TRIPTYCH_NORMALS_STORED,
                                             .levels = -1,
                                             .replace = 1,
                                             .memory_bytes = 64 << 20,
                                             .threads = 2 };
    return brick_volume(VOLUME, DATA_SET, &options);
}

static int remove_data(void **state)
{
    (void)state;
    return system("rm -r " DATA_SET);
}

static void open_data(triptych *t, triptych_renderer renderer)
{
    assert_int_equal(
        triptych_open(
            t, DATA_SET,
            &(triptych_resources){ .memory_bytes = 64 << 20, .threads = 2, .renderer = renderer }),
        TRIPTYCH_OK);
    assert_int_equal(
        triptych_set_view(
            t, &(triptych_view){ .width = SIZE, .height = SIZE, .side = TRIPTYCH_SIDE_ISO }),
        TRIPTYCH_OK);
}

static void assert_fails(const triptych *t, int status, int expected, const char *text)
{
    if (status != expected || !strstr(triptych_error(t), text))
        fail_msg("%d, \"%s\": not %d, \"%s\"", status, triptych_error(t), expected, text);
    assert_null(strchr(triptych_error(t), '\n'));
}

static void info_describes_the_volume(void **state)
{
    (void)state;
    triptych *t = new_context();
    triptych_info info;
    open_data(t, TRIPTYCH_RENDERER_CPU);
    assert_int_equal(triptych_get_info(t, &info), TRIPTYCH_OK);
    /* from datasets/tooth.nhdr */
    assert_int_equal(info.dims[0], 103);
    assert_int_equal(info.dims[1], 94);
    assert_int_equal(info.dims[2], 161);
    assert_true(info.kept > 0 && info.kept < 103 * 94 * 161);
    assert_true(info.bytes > 0);
    assert_int_equal(info.voxels, 103 * 94 * 161);
    assert_int_equal(info.lists, 6); /* three of kept voxels, three of halo */
    assert_int_equal(info.normal_bytes, 3);
    assert_true(info.value_min < info.value_max);
    for (int a = 0; a < 3; a++) {
        /* The grid is parallel to the axes of world space, so that the box encloses exactly the
         * kept voxels. */
        double step = info.index_to_world[a][a], corner = info.index_to_world[a][3];
        assert_true(info.first[a] >= 0 && info.first[a] < info.last[a]);
        assert_true(info.last[a] < info.dims[a]);
        assert_true(step > 0);
        assert_float_equal(info.lo[a], corner + step * ((double)info.first[a] - 0.5), 1e-6);
        assert_float_equal(info.hi[a], corner + step * ((double)info.last[a] + 0.5), 1e-6);
    }
    assert_non_null(strstr(info.notes, "tooth"));
    triptych_destroy(t);
}

static void lists_hold_the_kept_voxels_along_each_axis(void **state)
{
    (void)state;
    triptych *t = new_context();
    triptych_info info;
    uint64_t bytes;
    unsigned drawn = 0;
    open_data(t, TRIPTYCH_RENDERER_CPU);
    assert_int_equal(triptych_get_info(t, &info), TRIPTYCH_OK);
    bytes = info.index_bytes;
    for (unsigned i = 0; i < info.lists; i++) {
        triptych_list list;
        assert_int_equal(triptych_get_list(t, i, &list), TRIPTYCH_OK);
        assert_int_equal(list.drawn, !strcmp(list.kind, "voxels"));
        assert_int_equal(list.records, list.drawn ? info.kept : info.halo);
        assert_int_equal(list.level, 0);
        assert_memory_equal(list.dims, info.dims, sizeof info.dims);
        assert_float_equal(list.sheet_step, 1, 0);
        assert_true(list.bricks > 0 && list.slabs > 0);
        drawn |= list.drawn ? 1u << list.axis : 0;
        bytes += list.bytes;
    }
    assert_int_equal(drawn, 7);
    assert_int_equal(bytes, info.bytes);
    assert_int_equal(triptych_verify(t), TRIPTYCH_OK);
    triptych_destroy(t);
}

/* The figures of a frame are the sums over its lists. Counting does not change the picture. */
static void a_frame_has_statistics_for_each_list(void **state)
{
    (void)state;
    static float timed[FLOATS], counted[FLOATS];
    triptych *t = new_context();
    draw_settings settings = { 0 };
    triptych_frame_stats frame;
    triptych_list_stats list;
    triptych_info info;
    settings.all.classify = TRIPTYCH_CLASSIFY_PRE;
    assert_int_equal(draw_settings_use(t, &settings), TRIPTYCH_OK);
    open_data(t, TRIPTYCH_RENDERER_CPU);
    assert_int_equal(triptych_get_info(t, &info), TRIPTYCH_OK);
    assert_int_equal(triptych_draw(t, timed), TRIPTYCH_OK);
    for (settings.all.count_exactly = 0; settings.all.count_exactly < 2;
         settings.all.count_exactly++) {
        uint64_t splats = 0, bytes = 0, drawn = 0;
        assert_int_equal(draw_settings_use(t, &settings), TRIPTYCH_OK);
        assert_int_equal(triptych_draw(t, counted), TRIPTYCH_OK);
        assert_memory_equal(timed, counted, sizeof timed);
        assert_int_equal(triptych_get_frame_stats(t, &frame), TRIPTYCH_OK);
        for (unsigned i = 0; i < info.lists; i++) {
            assert_int_equal(triptych_get_list_stats(t, i, &list), TRIPTYCH_OK);
            assert_int_equal(list.counted, settings.all.count_exactly);
            assert_true(list.splats_drawn <= list.splats_projected);
            assert_true(list.splats_projected <= list.splats_read);
            assert_true(list.bricks_selected + list.bricks_transparent + list.bricks_outside +
                            list.bricks_without_weight <=
                        list.bricks);
            splats += list.splats_read;
            bytes += list.bytes_read;
            drawn += list.splats_drawn;
        }
        assert_int_equal(splats, frame.splats);
        assert_int_equal(bytes, frame.bytes_read);
        assert_int_equal(drawn > 0, settings.all.count_exactly);
    }
    assert_true(frame.splats > 0 && frame.splats <= 3 * info.kept);
    assert_true(frame.ms > 0 && frame.memory_bytes == 64 << 20);
    assert_true(frame.peak_memory_bytes > 0 && frame.peak_memory_bytes <= frame.memory_bytes);
    assert_string_equal(frame.renderer, "cpu");
    assert_true(*frame.device && *frame.engine && *frame.ring);
    assert_fails(t, triptych_get_list_stats(t, info.lists, &list), TRIPTYCH_USAGE, "6 lists");
    triptych_destroy(t);
}

/* `pre` reads normals for shading, `post` does not. */
static void reads_of_a_frame_do_not_depend_on_earlier_frames(void **state)
{
    (void)state;
    triptych *t = new_context();
    draw_settings s = { 0 };
    triptych_frame_stats stats;
    uint64_t bytes[3] = { 0 };
    float *rgba = calloc((size_t)SIZE * SIZE * 4, sizeof *rgba);
    open_data(t, TRIPTYCH_RENDERER_CPU);
    for (int i = 0; i < 3; i++) {
        s.all.classify = i == 1 ? TRIPTYCH_CLASSIFY_PRE : TRIPTYCH_CLASSIFY_POST;
        assert_int_equal(draw_settings_use(t, &s), TRIPTYCH_OK);
        assert_int_equal(triptych_draw(t, rgba), TRIPTYCH_OK);
        assert_int_equal(triptych_get_frame_stats(t, &stats), TRIPTYCH_OK);
        bytes[i] = stats.bytes_read;
    }
    assert_true(bytes[0] > 0 && bytes[1] > bytes[0]);
    assert_int_equal(bytes[2], bytes[0]);
    free(rgba);
    triptych_destroy(t);
}

static void the_plan_of_a_frame_can_be_printed(void **state)
{
    (void)state;
    triptych *t = new_context();
    char *text;
    open_data(t, TRIPTYCH_RENDERER_CPU);
    assert_fails(t, triptych_explain(t, &text), TRIPTYCH_USAGE, "no frame is begun");
    assert_int_equal(triptych_begin(t), TRIPTYCH_OK);
    assert_int_equal(triptych_explain(t, &text), TRIPTYCH_OK);
    assert_non_null(strstr(text, "merge"));
    assert_non_null(strstr(text, "\nlist x"));
    free(text);
    triptych_end(t);
    open_data(t, TRIPTYCH_RENDERER_INTEGRAL);
    assert_int_equal(triptych_begin(t), TRIPTYCH_OK);
    assert_int_equal(triptych_explain(t, &text), TRIPTYCH_OK);
    assert_non_null(strstr(text, "\nlist x      not read: list z holds the same voxels\n"));
    assert_non_null(strstr(text, "\nlist z      read: "));
    assert_non_null(strstr(text, "\n            all sheets\n"));
    free(text);
    triptych_destroy(t);
}

/* The program uses a completely given camera without any change. */
static void the_reported_camera_gives_the_same_picture(void **state)
{
    (void)state;
    static float found[FLOATS], given[FLOATS];
    triptych *t = new_context();
    triptych_camera first, second;
    open_data(t, TRIPTYCH_RENDERER_CPU);
    assert_int_equal(triptych_get_camera(t, &first), TRIPTYCH_OK);
    assert_true(first.splats > 0 && first.width == SIZE && first.height == SIZE);
    assert_float_equal(first.fov_degrees, 30, 0);
    assert_int_equal(triptych_draw(t, found), TRIPTYCH_OK);
    const triptych_view view = { .width = first.width,
                                 .height = first.height,
                                 .eye = first.eye,
                                 .look = first.look,
                                 .up = first.up,
                                 .fov_degrees = first.fov_degrees };
    assert_int_equal(triptych_set_view(t, &view), TRIPTYCH_OK);
    assert_int_equal(triptych_get_camera(t, &second), TRIPTYCH_OK);
    assert_int_equal(second.splats, 0);
    assert_memory_equal(first.eye, second.eye, sizeof first.eye);
    assert_int_equal(triptych_draw(t, given), TRIPTYCH_OK);
    assert_memory_equal(found, given, sizeof found);
    triptych_destroy(t);
}

static void pictures_are_part_of_the_given_memory(void **state)
{
    (void)state;
    triptych *t = new_context();
    float *rgba, *other;
    open_data(t, TRIPTYCH_RENDERER_CPU);
    assert_fails(t, triptych_new_picture(t, 0, 8, 4, &rgba), TRIPTYCH_USAGE, "pixels");
    assert_fails(t, triptych_new_picture(t, 8, 8, 3, &rgba), TRIPTYCH_USAGE, "channels");
    assert_fails(t, triptych_new_picture(t, 4096, 4096, 4, &rgba), TRIPTYCH_ERROR, "fit in memory");
    assert_int_equal(triptych_new_picture(t, 1536, 1536, 4, &rgba), TRIPTYCH_OK); /* 36 MiB of 64 */
    assert_fails(t, triptych_new_picture(t, 1536, 1536, 4, &other), TRIPTYCH_ERROR,
                 "fit in memory");
    assert_int_equal(triptych_new_picture(t, 1536, 1536, 1, &other), TRIPTYCH_OK);
    triptych_release_picture(t, rgba);
    assert_int_equal(triptych_new_picture(t, 1536, 1536, 4, &rgba), TRIPTYCH_OK);
    assert_float_equal(rgba[4 * 1536 * 1536 - 1], 0, 0);
    triptych_destroy(t); /* also frees the picture */
}

/* Each frame also needs a picture of 16 rays per pixel, 2.4 MB. */
static void more_memory_never_draws_less(void **state)
{
    static float rgba[FLOATS];
    draw_settings s = { .all.samples = 4 };
    const uint64_t step = TEST_BY_TURNS ? 4500000 : 500000;
    int drawn = 0, refused = 0;
    (void)state;
    for (uint64_t memory = 6 << 20; memory < 24 << 20; memory += step) {
        triptych *t = new_context();
        assert_int_equal(triptych_open(t, DATA_SET,
                                       &(triptych_resources){ .memory_bytes = memory,
                                                              .threads = 2,
                                                              .renderer = TRIPTYCH_RENDERER_CPU }),
                         TRIPTYCH_OK);
        assert_int_equal(triptych_set_view(t, &(triptych_view){ .width = SIZE, .height = SIZE }),
                         TRIPTYCH_OK);
        assert_int_equal(draw_settings_use(t, &s), TRIPTYCH_OK);
        const bool draws = triptych_draw(t, rgba) == TRIPTYCH_OK;
        if (!draws && drawn > 0)
            fail_msg("%llu bytes: %s", (unsigned long long)memory, triptych_error(t));
        drawn += draws;
        refused += !draws;
        triptych_destroy(t);
    }
    print_message("%d memories drew, %d were too little\n", drawn, refused);
    assert_true(drawn > 1 && refused > 0);
}

/* Checks the classification of a frame with these settings, in its statistics and in the words of
 * its plan. */
static void check_classified(triptych *t, const draw_settings *s, triptych_classify expected,
                             const char *words)
{
    static float rgba[FLOATS];
    triptych_frame_stats frame;
    char *text;
    assert_int_equal(draw_settings_use(t, s), TRIPTYCH_OK);
    assert_int_equal(triptych_begin(t), TRIPTYCH_OK);
    assert_int_equal(triptych_explain(t, &text), TRIPTYCH_OK);
    assert_non_null(strstr(text, words));
    free(text);
    triptych_end(t);
    assert_int_equal(triptych_draw(t, rgba), TRIPTYCH_OK);
    assert_int_equal(triptych_get_frame_stats(t, &frame), TRIPTYCH_OK);
    assert_int_equal(frame.classify, expected);
    assert_int_equal(frame.samples_per_sheet > 0, expected == TRIPTYCH_CLASSIFY_POST);
}

static void settings_for_splats_select_pre(void **state)
{
    (void)state;
    triptych *t = new_context();
    draw_settings defaults = { 0 }, s = defaults;
    assert_int_equal(defaults.all.classify, TRIPTYCH_CLASSIFY_AUTO);
    open_data(t, TRIPTYCH_RENDERER_CPU);
    check_classified(t, &s, TRIPTYCH_CLASSIFY_POST, "normal promises 1");
    s.sheet.samples = 4;
    check_classified(t, &s, TRIPTYCH_CLASSIFY_POST, "at 4 samples per sheet");
    s = defaults;
    s.splat.kernel_radius = 1.75;
    check_classified(t, &s, TRIPTYCH_CLASSIFY_PRE,
                     "instead of post: --kernel-radius is for splats");
    s = defaults;
    s.lod.voxel_px = 2;
    check_classified(t, &s, TRIPTYCH_CLASSIFY_POST, "the data set has none");
    s = defaults;
    s.splat.target = TRIPTYCH_TARGET_RGBA8;
    check_classified(t, &s, TRIPTYCH_CLASSIFY_PRE, "instead of post: --target is for splats");
    s = defaults;
    s.all.traversal = TRIPTYCH_TRAVERSAL_ASCENDING;
    check_classified(t, &s, TRIPTYCH_CLASSIFY_PRE, "instead of post: --traversal is for splats");
    s = defaults;
    s.all.count_exactly = 1;
    check_classified(t, &s, TRIPTYCH_CLASSIFY_PRE, "instead of post: --count is for splats");
    s.all.count_exactly = 0;
    s.all.classify = TRIPTYCH_CLASSIFY_PRE;
    check_classified(t, &s, TRIPTYCH_CLASSIFY_PRE, "classify    pre");
    triptych_destroy(t);
}

/* The eye is outside the box of the kept voxels. All distances must lie within this box. */
static void depth_is_the_distance_of_the_visible_surface(void **state)
{
    (void)state;
    static float rgba[FLOATS], plain[FLOATS], depth[SIZE * SIZE];
    triptych *t = new_context();
    draw_settings settings = { 0 };
    triptych_info info;
    int seen = 0;
    settings.all.samples = 1;
    settings.sheet.samples = 4;
    settings.lod.voxel_px = TRIPTYCH_ZERO;
    open_data(t, TRIPTYCH_RENDERER_CPU);
    assert_int_equal(draw_settings_use(t, &settings), TRIPTYCH_OK);
    settings.all.depth = 1;
    assert_int_equal(triptych_get_info(t, &info), TRIPTYCH_OK);
    const double middle = (info.lo[1] + info.hi[1]) / 2, far = 1000;
    const triptych_view view = {
        .width = SIZE,
        .height = SIZE,
        .eye = (double[]){ (info.lo[0] + info.hi[0]) / 2, middle - far,
                           (info.lo[2] + info.hi[2]) / 2 },
        .look = (double[]){ (info.lo[0] + info.hi[0]) / 2, middle, (info.lo[2] + info.hi[2]) / 2 },
        .ortho_height = info.hi[2] - info.lo[2] + 20,
    };
    assert_int_equal(triptych_set_view(t, &view), TRIPTYCH_OK);
    assert_int_equal(triptych_draw(t, plain), TRIPTYCH_OK);
    assert_int_equal(draw_settings_use(t, &settings), TRIPTYCH_OK);
    assert_fails(t, triptych_draw(t, rgba), TRIPTYCH_USAGE, "picture_and_depth");
    assert_int_equal(triptych_begin(t), TRIPTYCH_OK);
    while (triptych_step(t, UINT64_MAX) > 0)
        assert_int_equal(triptych_await(t, UINT64_MAX), TRIPTYCH_OK);
    assert_int_equal(triptych_picture_and_depth(t, rgba, depth), TRIPTYCH_OK);
    triptych_end(t);
    assert_memory_equal(rgba, plain, sizeof plain);
    for (int i = 0; i < SIZE * SIZE; i++) {
        if (isinf(depth[i]))
            continue;
        assert_in_range(depth[i], (int)(far + info.lo[1] - middle - 2),
                        (int)(far + info.hi[1] - middle + 3));
        seen++;
    }
    assert_in_range(seen, SIZE * SIZE / 20, SIZE * SIZE - 1);
    assert_int_equal(triptych_write_depth(t, "depth.exr", SIZE, SIZE, depth), TRIPTYCH_OK);
    depth[5] = NAN;
    assert_fails(t, triptych_write_depth(t, "depth.exr", SIZE, SIZE, depth), TRIPTYCH_ERROR,
                 "(5, 0)");
    assert_int_equal(remove("depth.exr"), 0);
    settings.splat.target = TRIPTYCH_TARGET_RGBA8;
    assert_int_equal(draw_settings_use(t, &settings), TRIPTYCH_OK);
    assert_fails(t, triptych_begin(t), TRIPTYCH_USAGE, "--depth: requires --target rgba32f");
    triptych_destroy(t);
}

/* Returns whether the distances of the eight pixels around pixel i differ by at most 3 world units
 * from its own. */
static int is_smooth(const float *depth, int i)
{
    static const int around[] = { -SIZE - 1, -SIZE, -SIZE + 1, -1, 1, SIZE - 1, SIZE, SIZE + 1 };
    int x = i % SIZE, y = i / SIZE;
    for (size_t n = 0; n < sizeof around / sizeof *around; n++)
        if (x < 1 || y < 1 || x > SIZE - 2 || y > SIZE - 2 ||
            !(fabsf(depth[i + around[n]] - depth[i]) <= 3))
            return 0;
    return 1;
}

/* The mean and the median distance are close together if the surface is almost opaque. */
static void a_probe_finds_the_visible_surface(void **state)
{
    (void)state;
    static float rgba[FLOATS], depth[SIZE * SIZE];
    triptych *t = new_context();
    draw_settings settings = { 0 };
    triptych_info info;
    triptych_hit hit;
    int surface = 0;
    settings.all.depth = 1;
    settings.background[3] = 0;
    open_data(t, TRIPTYCH_RENDERER_CPU);
    assert_int_equal(
        triptych_set_transfer_function(
            t, &(triptych_transfer_function){ .text = "700 0 0 0 0\n701 1 1 1 0.99\n" }),
        TRIPTYCH_OK);
    for (int parallel = 0; parallel < 2; parallel++) {
        const triptych_view view = {
            .width = SIZE, .height = SIZE, .side = TRIPTYCH_SIDE_ISO, .ortho_fit = parallel
        };
        assert_int_equal(triptych_set_view(t, &view), TRIPTYCH_OK);
        assert_int_equal(triptych_get_info(t, &info), TRIPTYCH_OK);
        assert_int_equal(draw_settings_use(t, &settings), TRIPTYCH_OK);
        assert_int_equal(triptych_begin(t), TRIPTYCH_OK);
        assert_fails(t, triptych_probe(t, 1, 1, &hit), TRIPTYCH_USAGE, "end it first");
        while (triptych_step(t, UINT64_MAX) == TRIPTYCH_STEP_WAITS)
            triptych_await(t, UINT64_MAX);
        assert_int_equal(triptych_picture_and_depth(t, rgba, depth), TRIPTYCH_OK);
        triptych_end(t);
        double voxel = info.index_to_world[0][0];
        for (int i = 7; i < SIZE * SIZE; i += 61) {
            if (!is_smooth(depth, i) || rgba[4 * i + 3] < 0.99f)
                continue;
            assert_int_equal(triptych_probe(t, i % SIZE + 0.5, i / SIZE + 0.5, &hit), TRIPTYCH_OK);
            assert_float_equal(hit.depth, depth[i], 3 * voxel);
            assert_true(hit.opacity > 0.9);
            surface++;
            assert_true(hit.value > 700);
            assert_true(hit.depth_first <= hit.depth);
            for (int a = 0; a < 3; a++)
                assert_float_equal(
                    hit.position[a],
                    info.index_to_world[a][a] * hit.index[a] + info.index_to_world[a][3], 1e-9);
        }
    }
    assert_true(surface > 30);
    assert_int_equal(triptych_probe(t, -1000, 5, &hit), TRIPTYCH_OK);
    assert_true(hit.opacity == 0);
    assert_fails(t, triptych_probe(t, NAN, 5, &hit), TRIPTYCH_USAGE, "not finite");
    triptych_destroy(t);
}

static void the_histogram_counts_all_voxels(void **state)
{
    (void)state;
    triptych *t = new_context();
    triptych_histogram histogram;
    triptych_info info;
    uint64_t sum = 0;
    assert_fails(t, triptych_get_histogram(t, &histogram), TRIPTYCH_USAGE, "no data set");
    open_data(t, TRIPTYCH_RENDERER_CPU);
    assert_int_equal(triptych_get_histogram(t, &histogram), TRIPTYCH_OK);
    assert_int_equal(triptych_get_info(t, &info), TRIPTYCH_OK);
    assert_true(histogram.lo == info.value_min && histogram.hi == info.value_max);
    for (int i = 0; i < TRIPTYCH_HISTOGRAM_BINS; i++)
        sum += histogram.counts[i];
    assert_int_equal(sum, 103 * 94 * 161);
    assert_int_equal(histogram.total, sum);
    triptych_destroy(t);
}

/* The name of a transfer function and its text give the same picture. */
static void a_transfer_function_can_be_given_as_text(void **state)
{
    (void)state;
    static float named[FLOATS], worded[FLOATS];
    triptych *t = new_context();
    char *text = NULL;
    open_data(t, TRIPTYCH_RENDERER_CPU);
    triptych_transfer_function f = { .name = "bone" };
    assert_int_equal(triptych_set_transfer_function(t, &f), TRIPTYCH_OK);
    assert_int_equal(triptych_draw(t, named), TRIPTYCH_OK);
    assert_int_equal(triptych_convert(t, &(triptych_conversion){ .function = "bone" }, &text),
                     TRIPTYCH_OK);
    assert_int_equal(triptych_set_transfer_function(t, NULL), TRIPTYCH_OK);
    f.text = text;
    assert_fails(t, triptych_set_transfer_function(t, &f), TRIPTYCH_USAGE, "not both");
    f.name = NULL;
    assert_int_equal(triptych_set_transfer_function(t, &f), TRIPTYCH_OK);
    assert_int_equal(triptych_draw(t, worded), TRIPTYCH_OK);
    assert_memory_equal(named, worded, sizeof named);
    f.text = "0 0 0 0 2\n";
    assert_fails(t, triptych_set_transfer_function(t, &f), TRIPTYCH_ERROR, "line 1");
    free(text);
    triptych_destroy(t);
}

static void transfer_functions_are_listed_and_converted(void **state)
{
    (void)state;
    triptych *t = new_context();
    triptych_preset preset;
    char *text;
    int grey = 0;
    unsigned count = 0;
    while (triptych_get_preset(count, &preset)) {
        assert_true(*preset.name && *preset.values && *preset.summary);
        grey |= !strcmp(preset.name, "grey");
        count++;
    }
    assert_true(count > 10 && grey);
    assert_fails(t, triptych_convert(t, &(triptych_conversion){ 0 }, &text), TRIPTYCH_USAGE,
                 "give a transfer function or data");
    assert_fails(t, triptych_convert(t, &(triptych_conversion){ .function = "mr" }, &text),
                 TRIPTYCH_USAGE, "histogram");
    triptych_conversion grey_over = {
        .function = "grey", .lo = 10, .hi = 30, .form = TRIPTYCH_FORM_VP
    };
    assert_int_equal(triptych_convert(t, &grey_over, &text), TRIPTYCH_OK);
    assert_non_null(strstr(text, "30"));
    free(text);
    /* The data set stores the automatic transfer function of the volume. */
    char *own, *volumes;
    open_data(t, TRIPTYCH_RENDERER_CPU);
    assert_int_equal(triptych_convert(t, &(triptych_conversion){ 0 }, &own), TRIPTYCH_OK);
    assert_int_equal(triptych_convert(t, &(triptych_conversion){ .volume = VOLUME }, &volumes),
                     TRIPTYCH_OK);
    assert_string_equal(own, volumes);
    free(own);
    free(volumes);
    triptych_destroy(t);
}

typedef struct stages {
    int draws, splats, reads, others;
} stages;

static void note_stage(void *user, const char *stage, uint64_t done, uint64_t total)
{
    stages *s = user;
    assert_true(done <= total);
    s->draws += !strcmp(stage, "draw");
    s->splats += !strcmp(stage, "splat");
    s->reads += !strcmp(stage, "read");
    s->others++;
}

static void progress_is_reported_by_stage(void **state)
{
    (void)state;
    static float rgba[FLOATS];
    triptych *t = new_context();
    stages seen = { 0 };
    triptych_brick_summary summary;
    triptych_set_progress(t, note_stage, &seen);
    assert_int_equal(triptych_brick(t, VOLUME, "progress.trip", NULL, &summary), TRIPTYCH_OK);
    assert_true(seen.reads > 0 && seen.draws == 0);
    open_data(t, TRIPTYCH_RENDERER_CPU);
    assert_int_equal(triptych_draw(t, rgba), TRIPTYCH_OK);
    assert_true(seen.draws > 0 && seen.splats == 0);
    draw_settings s = { 0 };
    s.all.classify = TRIPTYCH_CLASSIFY_PRE;
    seen = (stages){ 0 };
    assert_int_equal(draw_settings_use(t, &s), TRIPTYCH_OK);
    assert_int_equal(triptych_draw(t, rgba), TRIPTYCH_OK);
    assert_true(seen.splats > 0 && seen.draws == 0);
    assert_fails(t, triptych_brick(t, VOLUME, "progress.trip", NULL, &summary), TRIPTYCH_ERROR,
                 "progress.trip");
    triptych_destroy(t);
    assert_int_equal(system("rm -r progress.trip"), 0);
}

static void bricking_describes_its_result(void **state)
{
    (void)state;
    triptych *t = new_context();
    triptych_brick_summary s;
    triptych_brick_estimate e;
    triptych_info info;
    const triptych_range ranges[] = { { 100, 200 }, { 900, 1000 } };
    triptych_brick_options o = { .ranges = ranges,
                                 .range_count = 2,
                                 .normals = TRIPTYCH_NORMALS_FULL,
                                 .no_halo = 1,
                                 .levels = -1,
                                 .tile_voxels = 32 };
    assert_int_equal(triptych_estimate(t, VOLUME, "made.trip", &o, &e), TRIPTYCH_OK);
    assert_int_equal(triptych_brick(t, VOLUME, "made.trip", &o, &s), TRIPTYCH_OK);
    assert_int_equal(triptych_open(t, "made.trip", NULL), TRIPTYCH_OK);
    assert_int_equal(triptych_get_info(t, &info), TRIPTYCH_OK);
    assert_int_equal(info.kept, s.kept);
    assert_int_equal(s.voxels, 103 * 94 * 161);
    assert_int_equal(e.voxels, s.voxels);
    assert_true(e.kept > s.kept / 2 && e.kept < s.kept * 2);
    assert_int_equal(info.lists, 3);
    assert_int_equal(info.halo, 0);
    assert_int_equal(info.normal_bytes, 4);
    assert_int_equal(info.tile_voxels, 32);
    assert_true(s.kept > 0 && s.peak_memory_bytes <= s.memory_bytes);
    assert_true(*s.kind && *s.kind_title && s.stages[TRIPTYCH_STAGE_READ].seconds > 0);
    triptych_close(t);
    o.tile_voxels = 33;
    assert_fails(t, triptych_brick(t, VOLUME, "made.trip", &o, &s), TRIPTYCH_USAGE, "tile");
    o.tile_voxels = 0;
    o.raw_type = "uint7";
    assert_fails(t, triptych_estimate(t, VOLUME, "made.trip", &o, &e), TRIPTYCH_USAGE, "type");
    assert_true(triptych_is_raw_type("uint8") && !triptych_is_raw_type("uint7"));
    triptych_destroy(t);
    assert_int_equal(system("rm -r made.trip"), 0);
}

static void write_volume(const char *name, int bytes, int value)
{
    FILE *f = fopen(name, "wb");
    assert_non_null(f);
    for (int i = 0; i < bytes; i++)
        fputc(value, f);
    assert_int_equal(fclose(f), 0);
}

/* Equal bytes in another file have the same content and another state. */
static void volumes_are_identified_by_content_and_state(void **state)
{
    (void)state;
    triptych *t = new_context();
    triptych_identity a, copy, changed, unread, all;
    const char *one = "identity_4x4x4_uint8.raw";
    const triptych_brick_options keep_all = { .keep_all = 1 }, threads = { .threads = 1 };
    write_volume(one, 64, 1);
    assert_int_equal(triptych_identify(t, one, NULL, 1000, &a), TRIPTYCH_OK);
    assert_int_equal(triptych_identify(t, one, &threads, 0, &unread), TRIPTYCH_OK);
    assert_int_equal(triptych_identify(t, one, &keep_all, 1000, &all), TRIPTYCH_OK);
    assert_int_equal(mkdir("identity", 0700), 0);
    write_volume("identity/identity_4x4x4_uint8.raw", 64, 1);
    assert_int_equal(triptych_identify(t, "identity/identity_4x4x4_uint8.raw", NULL, 1000, &copy),
                     TRIPTYCH_OK);
    write_volume(one, 64, 2);
    assert_int_equal(triptych_identify(t, one, NULL, 1000, &changed), TRIPTYCH_OK);
    assert_int_equal(a.bytes, 64);
    assert_int_equal(a.stable, 0); /* the file is too new */
    assert_int_equal(strlen(a.content), 32);
    assert_string_equal(a.content, copy.content);
    assert_string_not_equal(a.state, copy.state);
    assert_string_equal(a.state, unread.state);
    assert_string_equal(unread.content, "");
    assert_string_equal(a.content, all.content); /* only the kept values differ */
    assert_int_equal(strlen(a.kept), 32);
    assert_string_equal(a.kept, unread.kept);
    assert_string_not_equal(a.kept, all.kept);
    assert_string_not_equal(a.content, changed.content);
    triptych_destroy(t);
    assert_int_equal(system("rm -r identity identity_4x4x4_uint8.raw"), 0);
}

static int holds_range(triptych *t, double lo, double hi)
{
    const triptych_range range = { lo, hi };
    return triptych_holds(t, &(triptych_brick_options){ .ranges = &range, .range_count = 1 }, NULL);
}

/* The data set keeps 100 to 200 and 900 to 1000. The volume has no values above 1300. */
static void a_data_set_tells_whether_it_holds_values(void **state)
{
    (void)state;
    triptych *t = new_context();
    const triptych_range ranges[] = { { 100, 200 }, { 900, 1000 } };
    const triptych_brick_options o = { .ranges = ranges, .range_count = 2 },
                                 all = { .keep_all = 1 };
    const triptych_brick_options automatic = { 0 };
    triptych_transfer_function inside = {
        .text = "values data\n110 1 1 1 0\n150 1 1 1 0.5\n190 1 1 1 0\n"
    };
    const char *below = "values data\n99 1 1 1 0.1\n150 1 1 1 0.5\n190 1 1 1 0\n";
    assert_int_equal(triptych_brick(t, VOLUME, "held.trip", &o, NULL), TRIPTYCH_OK);
    assert_fails(t, triptych_holds(t, &o, NULL), TRIPTYCH_USAGE, "open");
    assert_int_equal(triptych_open(t, "held.trip", NULL), TRIPTYCH_OK);
    assert_int_equal(triptych_holds(t, NULL, NULL), 1);
    assert_int_equal(triptych_holds(t, &o, NULL), 1);
    assert_int_equal(triptych_holds(t, &all, NULL), 0);
    assert_int_equal(triptych_holds(t, &automatic, NULL), 0);
    assert_int_equal(holds_range(t, 100, 200), 1);
    assert_int_equal(holds_range(t, nextafterf(100, 0), 200), 0);
    assert_int_equal(holds_range(t, 120, 920), 0);
    assert_int_equal(holds_range(t, 1500, 1e9), 1);
    assert_int_equal(holds_range(t, 900, 1e9), 0);
    assert_int_equal(triptych_holds(t, NULL, &inside), 1);
    assert_int_equal(triptych_holds(t, &all, &inside), 0);
    inside.window = 400; /* stretches it over 150 to 550 */
    inside.level = 350;
    assert_int_equal(triptych_holds(t, NULL, &inside), 0);
    assert_int_equal(triptych_holds(t, NULL, &(triptych_transfer_function){ .text = below }), 0);
    triptych_close(t);
    assert_int_equal(triptych_brick(t, VOLUME, "held.trip",
                                    &(triptych_brick_options){ .keep_all = 1, .replace = 1 }, NULL),
                     TRIPTYCH_OK);
    assert_int_equal(triptych_open(t, "held.trip", NULL), TRIPTYCH_OK);
    assert_int_equal(triptych_holds(t, &all, &inside), 1);
    assert_int_equal(triptych_holds(t, &automatic, NULL), 1);
    triptych_destroy(t);
    assert_int_equal(system("rm -r held.trip"), 0);
}

static int count_file(void *user, const char *path)
{
    int *left = user;
    assert_non_null(strstr(path, "listed_4x4x4_uint8.raw"));
    return --*left < 0 ? TRIPTYCH_ERROR : 0;
}

static void the_files_of_a_volume_are_listed(void **state)
{
    (void)state;
    triptych *t = new_context();
    const char *volume = "listed_4x4x4_uint8.raw";
    int left = 1;
    write_volume(volume, 64, 1);
    assert_int_equal(triptych_list_files(t, volume, NULL, count_file, &left), TRIPTYCH_OK);
    assert_int_equal(left, 0);
    assert_int_equal(triptych_list_files(t, volume, NULL, count_file, &left), TRIPTYCH_ERROR);
    assert_fails(t, triptych_list_files(t, "none.nrrd", NULL, count_file, &left), TRIPTYCH_ERROR,
                 "none.nrrd");
    triptych_destroy(t);
    assert_int_equal(remove(volume), 0);
}

static void a_failure_gives_its_reason_and_the_context_continues(void **state)
{
    (void)state;
    static float rgba[FLOATS];
    triptych *t = new_context();
    triptych_info info;
    draw_settings bad = { 0 };
    bad.all.h = 1;
    assert_fails(t, triptych_draw(t, rgba), TRIPTYCH_USAGE, "no data set is open");
    assert_fails(t, triptych_get_info(t, &info), TRIPTYCH_USAGE, "no data set is open");
    assert_fails(t, triptych_open(t, "none.trip", NULL), TRIPTYCH_ERROR, "none.trip");
    assert_fails(t, triptych_open(t, DATA_SET, &(triptych_resources){ .memory_bytes = 4096 }),
                 TRIPTYCH_ERROR, "memory");
    assert_fails(t, triptych_step(t, 0), TRIPTYCH_USAGE, "no frame is begun");
    open_data(t, TRIPTYCH_RENDERER_CPU);
    assert_string_equal(triptych_error(t), "");
    assert_fails(t, draw_settings_use(t, &bad), TRIPTYCH_USAGE, "--h: 1 is not between 0 and 1");
    assert_fails(t, triptych_set_view(t, &(triptych_view){ .zoom = NAN }), TRIPTYCH_USAGE,
                 "finite");
    assert_fails(t, triptych_set_view(t, &(triptych_view){ .width = -1 }), TRIPTYCH_USAGE,
                 "pixels");
    assert_fails(t, triptych_set_view(t, &(triptych_view){ .up = (double[3]){ 0 } }),
                 TRIPTYCH_USAGE, "up direction is zero");
    assert_fails(t, triptych_turn(t, INFINITY), TRIPTYCH_USAGE, "finite");
    assert_fails(t,
                 triptych_set_transfer_function(
                     t, &(triptych_transfer_function){ .name = "preset:no-such" }),
                 TRIPTYCH_USAGE, "no-such");
    assert_fails(t, triptych_write(t, "p.gif", SIZE, SIZE, rgba), TRIPTYCH_USAGE, "p.gif");
    const double clear[4] = { 1, 1, 1, 0.5 };
    assert_int_equal(triptych_set_settings(t, &(triptych_settings){ .background = clear }), 0);
    assert_fails(t, triptych_write(t, "p.jpg", SIZE, SIZE, rgba), TRIPTYCH_USAGE,
                 "p.jpg: cannot hold a transparent background");
    assert_int_equal(triptych_set_settings(t, NULL), 0);
    assert_fails(t, triptych_prepare_write(t, "p.gif", NULL), TRIPTYCH_USAGE, "p.gif");
    assert_fails(t, triptych_prepare_write(t, "p.png", "z.png"), TRIPTYCH_USAGE, "z.png");
    assert_int_equal(triptych_prepare_write(t, "p.png", "z.exr"), TRIPTYCH_OK);
    assert_int_equal(triptych_begin(t), TRIPTYCH_OK);
    assert_fails(t, triptych_begin(t), TRIPTYCH_USAGE, "end it first");
    assert_fails(t, triptych_set_transfer_function(t, NULL), TRIPTYCH_USAGE, "end it first");
    assert_fails(t, triptych_open(t, DATA_SET, NULL), TRIPTYCH_USAGE, "end it first");
    triptych_end(t);
    assert_int_equal(triptych_draw(t, rgba), TRIPTYCH_OK);
    triptych_destroy(t);
    triptych_destroy(NULL);
}

static void count_message(void *user, const char *line)
{
    assert_non_null(strstr(line, "triptych: "));
    ++*(int *)user;
}

static void messages_go_to_the_callback_if_there_is_one(void **state)
{
    (void)state;
    triptych *t = new_context();
    int messages = 0, ends[2], keep = dup(STDERR_FILENO);
    char text[16];
    assert_int_equal(pipe(ends), 0);
    dup2(ends[1], STDERR_FILENO);
    open_data(t, TRIPTYCH_RENDERER_CPU);
    /* The window shows no voxel. */
    const triptych_transfer_function none = { .window = 1, .level = 1e9, .name = "grey" };
    int silent = triptych_set_transfer_function(t, &none);
    triptych_set_messages(t, count_message, &messages);
    int reported = triptych_set_transfer_function(t, &none);
    int failed = triptych_open(t, "none.trip", NULL);
    dup2(keep, STDERR_FILENO);
    close(keep);
    close(ends[1]);
    assert_int_equal(read(ends[0], text, sizeof text), 0);
    close(ends[0]);
    assert_int_equal(silent, TRIPTYCH_OK);
    assert_int_equal(reported, TRIPTYCH_OK);
    assert_int_equal(failed, TRIPTYCH_ERROR);
    assert_int_equal(messages, 2);
    open_data(t, TRIPTYCH_RENDERER_CPU);
    assert_int_equal(triptych_set_transfer_function(
                         t, &(triptych_transfer_function){ .name = "grey", .all_values = 1 }),
                     TRIPTYCH_OK);
    triptych_destroy(t);
}

static void keep_message(void *user, const char *line)
{
    snprintf(user, 400, "%s", line);
}

/* By the formula of the kernel, the extinction varies from 0.423 to 1.807 of its value at a radius
 * of 1. */
static void a_too_small_kernel_gives_one_warning(void **state)
{
    (void)state;
    triptych *t = new_context();
    char line[400] = "";
    draw_settings settings = { 0 };
    triptych_set_messages(t, keep_message, line);
    for (int i = 0; i < 3; i++) {
        const double radii[3] = { 2, 1.5, 30 };
        settings.splat.kernel_radius = radii[i];
        assert_int_equal(draw_settings_use(t, &settings), TRIPTYCH_OK);
        assert_string_equal(line, "");
    }
    settings.splat.kernel_radius = 1;
    assert_int_equal(draw_settings_use(t, &settings), TRIPTYCH_OK);
    assert_non_null(strstr(line, "warning"));
    assert_non_null(strstr(line, "+81 %"));
    assert_non_null(strstr(line, "-58 %"));
    line[0] = 0;
    settings.all.h = 0.5;
    assert_int_equal(draw_settings_use(t, &settings), TRIPTYCH_OK);
    assert_string_equal(line, "");
    triptych_destroy(t);
}

static void steps_draw_the_same_picture_as_one_call(void **state)
{
    (void)state;
    static float whole[FLOATS], stepped[FLOATS];
    triptych *t = new_context();
    int status, steps = 0;
    open_data(t, TRIPTYCH_RENDERER_CPU);
    assert_int_equal(triptych_draw(t, whole), TRIPTYCH_OK);
    assert_int_equal(triptych_begin(t), TRIPTYCH_OK);
    while ((status = triptych_step(t, 0)) > 0) {
        assert_int_equal(triptych_await(t, UINT64_MAX), TRIPTYCH_OK);
        if (steps++ % 8 == 0)
            assert_int_equal(triptych_picture(t, stepped), TRIPTYCH_OK);
    }
    assert_int_equal(status, TRIPTYCH_STEP_DONE);
    assert_int_equal(triptych_picture(t, stepped), TRIPTYCH_OK);
    triptych_end(t);
    assert_true(steps > 3);
    assert_memory_equal(whole, stepped, sizeof whole);
    triptych_destroy(t);
}

static void an_abandoned_frame_does_not_change_the_next_one(void **state)
{
    (void)state;
    static float whole[FLOATS], after[FLOATS];
    triptych *t = new_context();
    open_data(t, TRIPTYCH_RENDERER_CPU);
    assert_int_equal(triptych_draw(t, whole), TRIPTYCH_OK);
    assert_int_equal(triptych_begin(t), TRIPTYCH_OK);
    assert_true(triptych_step(t, 0) > 0);
    triptych_end(t);
    assert_int_equal(triptych_begin(t), TRIPTYCH_OK);
    triptych_cancel(t);
    assert_fails(t, triptych_step(t, UINT64_MAX), TRIPTYCH_CANCELLED, "interrupted");
    assert_fails(t, triptych_await(t, UINT64_MAX), TRIPTYCH_CANCELLED, "interrupted");
    assert_fails(t, triptych_picture(t, after), TRIPTYCH_CANCELLED, "interrupted");
    triptych_end(t);
    assert_int_equal(triptych_draw(t, after), TRIPTYCH_OK);
    assert_memory_equal(whole, after, sizeof whole);
    triptych_destroy(t);
}

static void a_turned_view_can_be_turned_back(void **state)
{
    (void)state;
    static float first[FLOATS], half[FLOATS], back[FLOATS];
    triptych *t = new_context();
    open_data(t, TRIPTYCH_RENDERER_CPU);
    assert_int_equal(triptych_draw(t, first), TRIPTYCH_OK);
    assert_int_equal(triptych_turn(t, 180), TRIPTYCH_OK);
    assert_int_equal(triptych_draw(t, half), TRIPTYCH_OK);
    assert_int_equal(triptych_turn(t, 0), TRIPTYCH_OK);
    assert_int_equal(triptych_draw(t, back), TRIPTYCH_OK);
    assert_memory_equal(first, back, sizeof first);
    assert_memory_not_equal(first, half, sizeof first);
    triptych_destroy(t);
}

/* The tooth has 16 bits, which codes hold exactly. With a halo, all corners of each cell with a
 * visible value are stored. Without shading, nothing is lost. Shading would lose precision, because
 * normals have fewer bits. */
static void the_integral_of_kept_voxels_equals_the_one_of_the_volume(void **state)
{
    (void)state;
    enum { SMALL = TEST_BY_TURNS ? 8 : 20, SMALL_FLOATS = 4 * SMALL * SMALL };
    float stored[SMALL_FLOATS], source[SMALL_FLOATS];
    triptych *t = new_context();
    draw_settings s = { 0 };
    const triptych_view view = { .width = SMALL, .height = SMALL };
    const char *other = TRIP_SOURCE_DIR "/datasets/stent.nrrd";
    s.light.no_shading = 1;
    open_data(t, TRIPTYCH_RENDERER_CPU);
    assert_fails(t, triptych_set_source(t, VOLUME, NULL), TRIPTYCH_USAGE, "only the integral");
    open_data(t, TRIPTYCH_RENDERER_INTEGRAL);
    assert_int_equal(draw_settings_use(t, &s), TRIPTYCH_OK);
    assert_int_equal(triptych_set_view(t, &view), TRIPTYCH_OK);
    assert_int_equal(triptych_draw(t, stored), TRIPTYCH_OK);
    assert_fails(t, triptych_set_source(t, other, NULL), TRIPTYCH_ERROR, "the grids differ");
    assert_int_equal(triptych_set_source(t, VOLUME, NULL), TRIPTYCH_OK);
    assert_int_equal(triptych_draw(t, source), TRIPTYCH_OK);
    assert_memory_equal(stored, source, sizeof stored);
    s.integral.field = TRIPTYCH_FIELD_SPLATS;
    assert_int_equal(draw_settings_use(t, &s), TRIPTYCH_OK);
    assert_fails(t, triptych_draw(t, source), TRIPTYCH_USAGE, "the sum of the splats");
    triptych_destroy(t);
}

static void samples_are_averaged_as_in_a_larger_picture(void **state)
{
    (void)state;
    enum { SIDE = 3, LARGE = SIDE * SIZE };
    static float rgba[FLOATS], large[SIDE * SIDE * FLOATS];
    triptych *t = new_context();
    draw_settings s = { 0 };
    const triptych_view view = { .width = LARGE, .height = LARGE, .side = TRIPTYCH_SIDE_ISO };
    open_data(t, TRIPTYCH_RENDERER_CPU);
    assert_int_equal(triptych_set_view(t, &view), TRIPTYCH_OK);
    assert_int_equal(triptych_draw(t, large), TRIPTYCH_OK);
    open_data(t, TRIPTYCH_RENDERER_CPU);
    s.all.samples = SIDE;
    assert_int_equal(draw_settings_use(t, &s), TRIPTYCH_OK);
    assert_int_equal(triptych_draw(t, rgba), TRIPTYCH_OK);
    double max = 0;
    for (int n = 0; n < FLOATS; n++) {
        int x = n / 4 % SIZE * SIDE, y = n / 4 / SIZE * SIDE;
        double sum = 0;
        for (int i = 0; i < SIDE * SIDE; i++)
            sum += (double)large[4 * ((y + i / SIDE) * LARGE + x + i % SIDE) + n % 4];
        assert_float_equal(rgba[n], sum / (SIDE * SIDE), 1e-6);
        max = fmax(max, fabs((double)large[4 * (y * LARGE + x) + n % 4] - (double)rgba[n]));
    }
    assert_true(max > 0.01);
    s.all.depth = 1;
    assert_int_equal(draw_settings_use(t, &s), TRIPTYCH_OK);
    assert_fails(t, triptych_draw(t, rgba), TRIPTYCH_USAGE, "requires --samples 1");
    s.all.samples = 65;
    assert_fails(t, draw_settings_use(t, &s), TRIPTYCH_USAGE, "samples");
    s.all.samples = 1;
    s.integral.tolerance = 1;
    assert_fails(t, draw_settings_use(t, &s), TRIPTYCH_USAGE, "tolerance");
    triptych_destroy(t);
}

/* Draws in steps and fetches the picture after each step. */
static triptych_frame_stats draw_in_steps(triptych *t, float *rgba)
{
    triptych_frame_stats stats = { 0 };
    int status = TRIPTYCH_STEP_MORE;
    assert_int_equal(triptych_begin(t), TRIPTYCH_OK);
    while (status > 0) {
        status = triptych_step(t, 0);
        if (status == TRIPTYCH_STEP_WAITS)
            triptych_await(t, 20000000);
        if (status >= 0)
            assert_int_equal(triptych_picture(t, rgba), TRIPTYCH_OK);
    }
    assert_int_equal(status, TRIPTYCH_OK);
    triptych_end(t);
    assert_int_equal(triptych_get_frame_stats(t, &stats), TRIPTYCH_OK);
    return stats;
}

/* Draws with an `lod_px` that makes voxels of level 1 2^octaves times too wide. */
static triptych_frame_stats draw_at(triptych *t, double octaves, float *rgba)
{
    draw_settings s = { 0 };
    triptych_camera camera;
    assert_int_equal(triptych_get_camera(t, &camera), TRIPTYCH_OK);
    s.all.classify = TRIPTYCH_CLASSIFY_POST;
    s.lod.voxel_px = 2 * camera.height / camera.ortho_height * exp2(-octaves);
    assert_int_equal(draw_settings_use(t, &s), TRIPTYCH_OK);
    return draw_in_steps(t, rgba);
}

static void two_levels_are_blended(void **state)
{
    (void)state;
    static float fine[FLOATS], coarse[FLOATS], mixed[FLOATS], again[FLOATS];
    const triptych_view view = {
        .width = SIZE, .height = SIZE, .side = TRIPTYCH_SIDE_ISO, .ortho_fit = 1
    };
    triptych *t = new_context();
    const triptych_brick_options options = { .levels = 1, .memory_bytes = 64 << 20 };
    assert_int_equal(triptych_brick(t, VOLUME, "levels.trip", &options, NULL), TRIPTYCH_OK);
    const triptych_resources resources = { .memory_bytes = 64 << 20,
                                           .renderer = TRIPTYCH_RENDERER_CPU };
    assert_int_equal(triptych_open(t, "levels.trip", &resources), TRIPTYCH_OK);
    unsigned levels[2];
    assert_int_equal(triptych_count_levels(t, TRIPTYCH_CLASSIFY_POST, &levels[0]), TRIPTYCH_OK);
    assert_int_equal(triptych_count_levels(t, TRIPTYCH_CLASSIFY_PRE, &levels[1]), TRIPTYCH_OK);
    assert_int_equal(levels[0], 1);
    assert_int_equal(levels[1], 0);
    assert_int_equal(triptych_set_view(t, &view), TRIPTYCH_OK);
    const uint64_t of_fine = draw_at(t, 0.26, fine).splats;
    const uint64_t of_coarse = draw_at(t, -0.01, coarse).splats;
    assert_true(of_coarse > 0 && of_coarse < of_fine / 4);
    const double octaves[] = { 0.2, 0.05 };
    for (int i = 0; i < 2; i++) {
        const double share = 1 - octaves[i] / 0.25;
        double max = 0;
        assert_int_equal(draw_at(t, octaves[i], mixed).splats, of_fine + of_coarse);
        for (int n = 0; n < FLOATS; n++) {
            double a = fine[n], b = coarse[n];
            max = fmax(max, fabs(a - b));
            assert_float_equal(mixed[n], a + share * (b - a), 1e-6);
        }
        assert_int_equal(triptych_draw(t, again), TRIPTYCH_OK);
        assert_memory_equal(again, mixed, sizeof again);
        assert_true(max > 0.01);
    }
    triptych_destroy(t);
    assert_int_equal(system("rm -r levels.trip"), 0);
}

/* A thread with its own context. */
typedef struct worker {
    pthread_t thread;
    triptych *t;
    float *rgba;
    int status, frames;
    int same;
    char error[256];
} worker;

/* The frame has already begun, so that no cancel is missed. */
static void *draw_until_cancelled(void *user)
{
    worker *w = user;
    while (w->status >= 0)
        if ((w->status = triptych_step(w->t, 0)) >= 0)
            w->status = triptych_picture(w->t, w->rgba);
    snprintf(w->error, sizeof w->error, "%s", triptych_error(w->t));
    triptych_end(w->t);
    return NULL;
}

static void *draw_some(void *user)
{
    worker *w = user;
    float *first = malloc(FLOATS * sizeof *first);
    w->same = 1;
    for (int i = 0; i < 3 && w->status == TRIPTYCH_OK; i++) {
        w->status = triptych_draw(w->t, w->rgba);
        if (i == 0)
            memcpy(first, w->rgba, FLOATS * sizeof *first);
        w->same &= !memcmp(first, w->rgba, FLOATS * sizeof *first);
        w->frames++;
    }
    free(first);
    return NULL;
}

static void one_of_two_drawing_contexts_can_be_cancelled(void **state)
{
    (void)state;
    worker w[2] = { { .status = 0 }, { .status = 0 } };
    for (int i = 0; i < 2; i++) {
        w[i].t = new_context();
        w[i].rgba = malloc(FLOATS * sizeof *w[i].rgba);
        open_data(w[i].t, TRIPTYCH_RENDERER_CPU);
    }
    assert_int_equal(triptych_begin(w[0].t), TRIPTYCH_OK);
    assert_int_equal(pthread_create(&w[0].thread, NULL, draw_until_cancelled, &w[0]), 0);
    assert_int_equal(pthread_create(&w[1].thread, NULL, draw_some, &w[1]), 0);
    pthread_join(w[1].thread, NULL);
    triptych_cancel(w[0].t);
    pthread_join(w[0].thread, NULL);
    assert_int_equal(w[0].status, TRIPTYCH_CANCELLED);
    assert_non_null(strstr(w[0].error, "interrupted"));
    assert_int_equal(w[1].status, TRIPTYCH_OK);
    assert_string_equal(triptych_error(w[1].t), "");
    assert_int_equal(w[1].frames, 3);
    assert_true(w[1].same);
    for (int i = 0; i < 2; i++) {
        triptych_destroy(w[i].t);
        free(w[i].rgba);
    }
}

static void *draw_once(void *user)
{
    worker *w = user;
    w->status = triptych_draw(w->t, w->rgba);
    return NULL;
}

/* The cancels arrive at many moments of a frame, while it begins, reads, draws, or waits for the
 * disk. */
static void a_cancelled_frame_gives_one_message(void **state)
{
    (void)state;
    enum { TRIES = 200, APART_NS = 50000 };
    static float rgba[FLOATS];
    int cancelled = 0, messages;
    worker w = { .t = new_context(), .rgba = rgba };
    open_data(w.t, TRIPTYCH_RENDERER_CPU);
    triptych_set_messages(w.t, count_message, &messages);
    for (int i = 0; i < TRIES; i++) {
        const struct timespec moment = { .tv_nsec = (long)i * APART_NS };
        messages = 0;
        assert_int_equal(pthread_create(&w.thread, NULL, draw_once, &w), 0);
        nanosleep(&moment, NULL);
        triptych_cancel(w.t);
        pthread_join(w.thread, NULL);
        assert_true(w.status == TRIPTYCH_OK || w.status == TRIPTYCH_CANCELLED);
        assert_int_equal(messages, w.status == TRIPTYCH_CANCELLED);
        cancelled += messages;
    }
    assert_true(cancelled > 0);
    triptych_destroy(w.t);
}

static triptych_frame_stats draw(triptych *t, float *rgba)
{
    triptych_frame_stats stats;
    assert_int_equal(triptych_draw(t, rgba), TRIPTYCH_OK);
    assert_int_equal(triptych_get_frame_stats(t, &stats), TRIPTYCH_OK);
    return stats;
}

static bool are_same(const float *a, const float *b)
{
    return memcmp(a, b, FLOATS * sizeof *a) == 0;
}

static draw_settings with_effects(int effects)
{
    draw_settings s = { 0 };
    const double light[3] = { 1, -1, 1 };
    s.light.kind = TRIPTYCH_LIGHT_DIRECTION;
    memcpy(s.light.toward, light, sizeof light);
    s.effects.which = effects;
    s.effects.light_cells = 32;
    s.all.samples = 1; /* the reference is slow */
    s.sheet.samples = 2;
    return s;
}

/* Returns the greatest difference of two pictures. */
static double difference(const float *a, const float *b)
{
    double max = 0;
    for (size_t i = 0; i < FLOATS; i++)
        max = fmax(max, fabs((double)a[i] - (double)b[i]));
    return max;
}

/* The library draws a light of the view as the same light given in the world. The world direction
 * is computed here, from the camera. */
static void a_light_of_the_view_turns_with_the_camera(void **state)
{
    (void)state;
    static float view[FLOATS], world[FLOATS], before[FLOATS];
    const triptych_renderer renderers[] = { TRIPTYCH_RENDERER_CPU, TRIPTYCH_RENDERER_REFERENCE };
    for (int n = 0; n < 4; n++) {
        draw_settings s = with_effects(n / 2 ? TRIPTYCH_EFFECT_SHADOWS : 0);
        triptych *t = new_context();
        open_data(t, renderers[n % 2]);
        for (double degrees = 0; degrees < 250; degrees += TEST_BY_TURNS ? 160 : 80) {
            triptych_camera c;
            double axes[3][3], length[2] = { 0, 0 };
            const double light[3] = { 2, 1, 0.5 };
            assert_int_equal(triptych_turn(t, degrees), TRIPTYCH_OK);
            assert_int_equal(triptych_get_camera(t, &c), TRIPTYCH_OK);
            for (int i = 0; i < 3; i++)
                axes[2][i] = c.eye[i] - c.look[i];
            for (int i = 0; i < 3; i++) { /* front x up is left */
                const int j = (i + 1) % 3, k = (i + 2) % 3;
                axes[0][i] = axes[2][j] * c.up[k] - axes[2][k] * c.up[j];
            }
            for (int i = 0; i < 3; i++) {
                length[0] += axes[0][i] * axes[0][i];
                length[1] += axes[2][i] * axes[2][i];
            }
            for (int i = 0; i < 3; i++) {
                axes[0][i] /= sqrt(length[0]);
                axes[2][i] /= sqrt(length[1]);
            }
            s.light.kind = TRIPTYCH_LIGHT_DIRECTION;
            for (int i = 0; i < 3; i++) { /* left x front is up */
                const int j = (i + 1) % 3, k = (i + 2) % 3;
                axes[1][i] = axes[0][j] * axes[2][k] - axes[0][k] * axes[2][j];
            }
            for (int i = 0; i < 3; i++)
                s.light.toward[i] =
                    light[0] * axes[0][i] + light[1] * axes[1][i] + light[2] * axes[2][i];
            assert_int_equal(draw_settings_use(t, &s), TRIPTYCH_OK);
            draw(t, world);
            s.light.kind = TRIPTYCH_LIGHT_VIEW;
            memcpy(s.light.toward, light, sizeof light);
            assert_int_equal(draw_settings_use(t, &s), TRIPTYCH_OK);
            draw(t, view);
            assert_true(difference(view, world) < 1e-5);
            assert_true(degrees == 0 || difference(view, before) > 1e-3);
            memcpy(before, view, sizeof before);
        }
        triptych_destroy(t);
    }
}

static void shadows_without_a_light_get_one_and_read_nothing_for_another_view(void **state)
{
    (void)state;
    static float own[FLOATS], chosen[FLOATS];
    draw_settings none = with_effects(TRIPTYCH_EFFECT_SHADOWS), given = none, head = none;
    none.light = (triptych_light){ 0 };
    given.light = (triptych_light){ .kind = TRIPTYCH_LIGHT_VIEW, .toward = { 1, 1, 1 } };
    head.light = (triptych_light){ .kind = TRIPTYCH_LIGHT_HEAD };
    triptych *t = new_context();
    open_data(t, TRIPTYCH_RENDERER_CPU);
    assert_int_equal(draw_settings_use(t, &none), TRIPTYCH_OK);
    assert_int_equal(draw(t, chosen).effects, TRIPTYCH_EFFECT_SHADOWS);
    assert_int_equal(draw_settings_use(t, &given), TRIPTYCH_OK);
    assert_int_equal(draw(t, own).light_bytes_read, 0);
    assert_true(are_same(own, chosen));
    assert_int_equal(triptych_turn(t, 50), TRIPTYCH_OK);
    assert_int_equal(draw(t, own).light_bytes_read, 0);
    assert_int_equal(draw_settings_use(t, &head), TRIPTYCH_OK);
    assert_int_equal(triptych_draw(t, own), TRIPTYCH_USAGE);
    triptych_destroy(t);
}

static void effects_cost_nothing_when_off_and_are_kept_between_views(void **state)
{
    (void)state;
    static float plain[FLOATS], lit[FLOATS], turned[FLOATS], again[FLOATS];
    const draw_settings none = with_effects(0);
    const draw_settings some = with_effects(TRIPTYCH_EFFECT_SHADOWS | TRIPTYCH_EFFECT_OCCLUSION);
    triptych *t = new_context(), *other = new_context();
    open_data(t, TRIPTYCH_RENDERER_CPU);
    assert_int_equal(draw_settings_use(t, &none), TRIPTYCH_OK);
    const triptych_frame_stats before = draw(t, plain);
    assert_int_equal(before.effects, 0);
    assert_int_equal(before.light_bytes_read + before.light_memory_bytes, 0);

    assert_int_equal(draw_settings_use(t, &some), TRIPTYCH_OK);
    triptych_frame_stats with = draw(t, lit);
    assert_int_equal(with.effects, TRIPTYCH_EFFECT_SHADOWS | TRIPTYCH_EFFECT_OCCLUSION);
    assert_int_equal(with.bytes_read, before.bytes_read);
    assert_true(with.light_bytes_read > 0 && with.light_memory_bytes > 0);
    assert_false(are_same(plain, lit));

    assert_int_equal(triptych_turn(t, 40), TRIPTYCH_OK);
    assert_int_equal(draw(t, turned).light_bytes_read, 0);
    open_data(other, TRIPTYCH_RENDERER_CPU);
    assert_int_equal(draw_settings_use(other, &some), TRIPTYCH_OK);
    assert_int_equal(triptych_turn(other, 40), TRIPTYCH_OK);
    assert_true(draw(other, again).light_bytes_read > 0);
    assert_true(are_same(turned, again));

    assert_int_equal(
        triptych_set_transfer_function(t, &(triptych_transfer_function){ .opacity_scale = 0.5 }),
        TRIPTYCH_OK);
    assert_true(draw(t, turned).light_bytes_read > 0);
    assert_int_equal(triptych_set_transfer_function(t, NULL), TRIPTYCH_OK);
    assert_int_equal(triptych_turn(t, 0), TRIPTYCH_OK);
    assert_int_equal(draw_settings_use(t, &none), TRIPTYCH_OK);
    with = draw(t, again);
    assert_int_equal(with.light_bytes_read + with.light_memory_bytes, 0);
    assert_int_equal(with.bytes_read, before.bytes_read);
    assert_true(are_same(plain, again));
    triptych_destroy(other);
    triptych_destroy(t);
}

static void heat_is_read_once_if_emission_runs(void **state)
{
    (void)state;
    static float plain[FLOATS], hot[FLOATS], again[FLOATS];
    triptych *t = new_context();
    draw_settings s = { 0 };
    open_data(t, TRIPTYCH_RENDERER_CPU);
    draw(t, plain);
    assert_int_equal(triptych_set_heat(t, DATA_SET), TRIPTYCH_OK);
    triptych_frame_stats stats = draw(t, again);
    assert_int_equal(stats.heat_bytes_read + stats.heat_memory_bytes, 0);
    assert_true(are_same(plain, again));
    s.effects.which = TRIPTYCH_EFFECT_AUTO;
    assert_int_equal(draw_settings_use(t, &s), TRIPTYCH_OK);
    stats = draw(t, hot);
    assert_int_equal(stats.effects, TRIPTYCH_EFFECT_EMISSION);
    assert_true(stats.heat_bytes_read > 0 && stats.heat_memory_bytes > 0);
    assert_false(are_same(plain, hot));
    stats = draw(t, again);
    assert_int_equal(stats.heat_bytes_read, 0);
    assert_true(are_same(hot, again));
    assert_fails(t, triptych_set_heat(t, "none.trip"), TRIPTYCH_ERROR, "none.trip");
    assert_int_equal(draw(t, again).effects, 0);
    assert_true(are_same(plain, again));
    triptych_destroy(t);
}

/* Bricks two halves of a volume separately. Its values rise along z, so that the lower half has a
 * smaller maximum. */
static void brick_rising_volume(void)
{
    enum { EDGE = 16 };
    FILE *f = fopen("rising.nrrd", "wb");
    assert_non_null(f);
    fprintf(f, "NRRD0004\ntype: uint8\ndimension: 3\nsizes: %d %d %d\nencoding: raw\n\n", EDGE,
            EDGE, EDGE);
    for (int i = 0; i < EDGE * EDGE * EDGE; i++)
        fputc(i / EDGE / EDGE * 17, f);
    assert_int_equal(fclose(f), 0);
    triptych *t = new_context();
    for (int part = 0; part < 2; part++) {
        const triptych_brick_options options = { .keep_all = 1,
                                                 .replace = 1,
                                                 .region_first = { 0, 0, 8 * part },
                                                 .region_past = { EDGE, EDGE, 8 + 8 * part },
                                                 .memory_bytes = 64 << 20,
                                                 .threads = 1 };
        assert_int_equal(
            triptych_brick(t, "rising.nrrd", part ? "high.trip" : "low.trip", &options, NULL),
            TRIPTYCH_OK);
    }
    triptych_destroy(t);
}

/* Checks that `t` draws the same picture as a new context, and whether both use the closed form. */
static void assert_drawn_afresh(triptych *t, const char *function, const draw_settings *s,
                                bool with_high, bool closed)
{
    static float rgba[FLOATS], expected[FLOATS];
    triptych *other = new_context();
    assert_int_equal(triptych_open(other, "low.trip", NULL), TRIPTYCH_OK);
    if (with_high)
        assert_int_equal(triptych_add(other, "high.trip"), TRIPTYCH_OK);
    triptych *both[2] = { t, other };
    for (int i = 0; i < 2; i++) {
        assert_int_equal(triptych_set_transfer_function(
                             both[i], &(triptych_transfer_function){ .text = function }),
                         TRIPTYCH_OK);
        assert_int_equal(draw_settings_use(both[i], s), TRIPTYCH_OK);
        assert_int_equal(triptych_set_view(both[i], &(triptych_view){ .width = SIZE,
                                                                      .height = SIZE,
                                                                      .side = TRIPTYCH_SIDE_ISO }),
                         TRIPTYCH_OK);
    }
    for (int i = 0; i < 2; i++) /* the second frame reuses results of the first */
        assert_int_equal(draw(t, rgba).closed_form, closed);
    assert_int_equal(draw(other, expected).closed_form, closed);
    assert_true(are_same(rgba, expected));
    triptych_destroy(other);
}

#define LOOK "unit voxel\nvalues data\n0 .9 .6 .3 0\n"

static void the_closed_form_depends_on_the_current_settings(void **state)
{
    (void)state;
    static const char *const line = LOOK "255 .9 .6 .3 .1\n";
    /* Up to 140 this equals `line`. The maximum value in the lower half and its halo is 136. */
    static const char *const bent = LOOK "140 .9 .6 .3 .054902\n255 .1 .6 .9 .9\n";
    draw_settings defaults = { 0 }, cued = defaults, cubic = defaults;
    cued.effects.which = TRIPTYCH_EFFECT_CUEING;
    cubic.all.interpolation = TRIPTYCH_INTERPOLATION_CUBIC; /* overshoots the maximum value */
    brick_rising_volume();
    triptych *t = new_context();
    assert_int_equal(triptych_open(t, "low.trip", NULL), TRIPTYCH_OK);
    assert_drawn_afresh(t, line, &defaults, false, true);
    assert_drawn_afresh(t, LOOK "60 .9 .6 .3 .02\n255 .1 .6 .9 .9\n", &defaults, false, false);
    assert_drawn_afresh(t, bent, &defaults, false, true);
    assert_drawn_afresh(t, bent, &cued, false, false);
    assert_drawn_afresh(t, bent, &cubic, false, false);
    assert_drawn_afresh(t, line, &cubic, false, true);
    assert_drawn_afresh(t, bent, &defaults, false, true);
    assert_int_equal(triptych_add(t, "high.trip"), TRIPTYCH_OK);
    assert_drawn_afresh(t, bent, &defaults, true, false);
    assert_drawn_afresh(t, line, &defaults, true, true);
    assert_int_equal(triptych_open(t, "low.trip", NULL), TRIPTYCH_OK);
    assert_drawn_afresh(t, bent, &defaults, false, true);
    triptych_destroy(t);
    assert_int_equal(system("rm -r low.trip high.trip rising.nrrd"), 0);
}

/* Interpolation from 64 voxels has only plain kernels. */
static void the_device_names_the_kernels_in_use(void **state)
{
    (void)state;
    static float rgba[FLOATS];
    char defaults[64];
    triptych *t = new_context();
    draw_settings s = { 0 };
    open_data(t, TRIPTYCH_RENDERER_CPU);
    snprintf(defaults, sizeof defaults, "%s", draw(t, rgba).device);
    for (int i = 0; i < 4; i++) {
        s.all.interpolation = i == 1   ? TRIPTYCH_INTERPOLATION_CUBIC
                              : i == 2 ? TRIPTYCH_INTERPOLATION_GAUSSIAN
                                       : TRIPTYCH_INTERPOLATION_LINEAR;
        s.all.classify = i == 3 ? TRIPTYCH_CLASSIFY_PRE : TRIPTYCH_CLASSIFY_POST;
        assert_int_equal(draw_settings_use(t, &s), TRIPTYCH_OK);
        assert_string_equal(draw(t, rgba).device,
                            i == 1 || i == 2 ? "CPU, plain, 2 threads" : defaults);
    }
    triptych_destroy(t);
}

static void measured_volumes_have_effects_only_on_request(void **state)
{
    (void)state;
    static float rgba[FLOATS];
    triptych *t = new_context();
    char *text;
    open_data(t, TRIPTYCH_RENDERER_CPU);
    draw_settings s = with_effects(TRIPTYCH_EFFECT_AUTO);
    assert_int_equal(draw_settings_use(t, &s), TRIPTYCH_OK);
    assert_int_equal(draw(t, rgba).effects, 0);
    assert_int_equal(triptych_begin(t), TRIPTYCH_OK);
    assert_int_equal(triptych_explain(t, &text), TRIPTYCH_OK);
    assert_non_null(strstr(text, "shadows     does not run: "));
    assert_null(strstr(text, "light  "));
    free(text);
    triptych_end(t);
    s.effects.which |= TRIPTYCH_EFFECT_CUEING;
    assert_int_equal(draw_settings_use(t, &s), TRIPTYCH_OK);
    assert_int_equal(draw(t, rgba).effects, TRIPTYCH_EFFECT_CUEING);
    s.effects.which = TRIPTYCH_EFFECT_SHADOWS;
    s.light.kind = TRIPTYCH_LIGHT_HEAD;
    assert_int_equal(draw_settings_use(t, &s), TRIPTYCH_OK);
    assert_fails(t, triptych_begin(t), TRIPTYCH_USAGE, "shadows cannot be seen with --light head");
    s.effects.which = TRIPTYCH_EFFECT_EMISSION;
    assert_int_equal(draw_settings_use(t, &s), TRIPTYCH_OK);
    assert_fails(t, triptych_begin(t), TRIPTYCH_USAGE, "needs a data set of heat");
    s.effects.which = 64;
    assert_fails(t, draw_settings_use(t, &s), TRIPTYCH_USAGE, "unknown effect");
    triptych_destroy(t);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(info_describes_the_volume),
        cmocka_unit_test(lists_hold_the_kept_voxels_along_each_axis),
        cmocka_unit_test(a_frame_has_statistics_for_each_list),
        cmocka_unit_test(reads_of_a_frame_do_not_depend_on_earlier_frames),
        cmocka_unit_test(the_plan_of_a_frame_can_be_printed),
        cmocka_unit_test(the_reported_camera_gives_the_same_picture),
        cmocka_unit_test(pictures_are_part_of_the_given_memory),
        cmocka_unit_test(more_memory_never_draws_less),
        cmocka_unit_test(depth_is_the_distance_of_the_visible_surface),
        cmocka_unit_test(a_probe_finds_the_visible_surface),
        cmocka_unit_test(the_histogram_counts_all_voxels),
        cmocka_unit_test(a_transfer_function_can_be_given_as_text),
        cmocka_unit_test(transfer_functions_are_listed_and_converted),
        cmocka_unit_test(progress_is_reported_by_stage),
        cmocka_unit_test(bricking_describes_its_result),
        cmocka_unit_test(volumes_are_identified_by_content_and_state),
        cmocka_unit_test(a_data_set_tells_whether_it_holds_values),
        cmocka_unit_test(the_files_of_a_volume_are_listed),
        cmocka_unit_test(a_failure_gives_its_reason_and_the_context_continues),
        cmocka_unit_test(a_too_small_kernel_gives_one_warning),
        cmocka_unit_test(messages_go_to_the_callback_if_there_is_one),
        cmocka_unit_test(steps_draw_the_same_picture_as_one_call),
        cmocka_unit_test(an_abandoned_frame_does_not_change_the_next_one),
        cmocka_unit_test(a_turned_view_can_be_turned_back),
        cmocka_unit_test(the_integral_of_kept_voxels_equals_the_one_of_the_volume),
        cmocka_unit_test(settings_for_splats_select_pre),
        cmocka_unit_test(samples_are_averaged_as_in_a_larger_picture),
        cmocka_unit_test(two_levels_are_blended),
        cmocka_unit_test(a_light_of_the_view_turns_with_the_camera),
        cmocka_unit_test(shadows_without_a_light_get_one_and_read_nothing_for_another_view),
        cmocka_unit_test(effects_cost_nothing_when_off_and_are_kept_between_views),
        cmocka_unit_test(heat_is_read_once_if_emission_runs),
        cmocka_unit_test(the_closed_form_depends_on_the_current_settings),
        cmocka_unit_test(the_device_names_the_kernels_in_use),
        cmocka_unit_test(measured_volumes_have_effects_only_on_request),
        cmocka_unit_test(one_of_two_drawing_contexts_can_be_cancelled),
        cmocka_unit_test(a_cancelled_frame_gives_one_message),
    };
    return cmocka_run_group_tests(tests, brick, remove_data);
}
