#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>
#include <cmocka.h>

#include "frames.h"
#include "triptych_brick.h"

enum { SIDE = 20, WIDTH = 60, HEIGHT = 40, LARGE = 200 };

static char folder[] = "/tmp/trip-frames-XXXXXX";
static char data[64], other[64], with_levels[64];

/* Writes a ball that is not at the centre of the volume. Neighbouring voxels have different values.
 */
static void write_volume(const char *path, int seed)
{
    FILE *f = fopen(path, "wb");
    assert_non_null(f);
    for (int z = 0; z < SIDE; z++)
        for (int y = 0; y < SIDE; y++)
            for (int x = 0; x < SIDE; x++) {
                const double r = hypot(hypot(x - 9.5, y - 8.5), z - 7.5);
                fputc(r < 7 ? 60 + (x * 7 + y * 5 + z * 3 + seed) % 150 : 0, f);
            }
    assert_int_equal(fclose(f), 0);
}

static void brick(const char *name, char path[64], int seed, int levels)
{
    char volume[128];
    triptych *t;
    snprintf(volume, sizeof volume, "%s/%s.raw", folder, name);
    snprintf(path, 64, "%s/%s.trip", folder, name);
    write_volume(volume, seed);
    assert_int_equal(triptych_create(&t), 0);
    const triptych_brick_options options = { .raw_dims = { SIDE, SIDE, SIDE },
                                             .raw_type = "uint8",
                                             .keep_all = 1,
                                             .levels = levels,
                                             .threads = 2 };
    assert_int_equal(triptych_brick(t, volume, path, &options, NULL), 0);
    triptych_destroy(t);
}

static int set_up(void **state)
{
    (void)state;
    assert_non_null(mkdtemp(folder));
    brick("one", data, 0, 0);
    brick("two", other, 40, 0);
    brick("levels", with_levels, 0, 2);
    return 0;
}

static int tear_down(void **state)
{
    char command[128];
    (void)state;
    snprintf(command, sizeof command, "rm -r %s", folder);
    return system(command);
}

static void wake(void *user)
{
    (void)user;
}

static trip_frames *start(void)
{
    const trip_frames_params params = {
        .threads = 2, .renderer = TRIPTYCH_RENDERER_CPU, .frames_per_second = 30, .wake = wake
    };
    trip_frames *f = trip_frames_start(&params);
    assert_non_null(f);
    return f;
}

static trip_wanted wanted_of(unsigned document, const char *input)
{
    return (trip_wanted){
        .document = document, .input = input, .width = WIDTH, .height = HEIGHT, .opacity_scale = 1
    };
}

/* Waits until the picture is complete or has failed. */
static trip_frames_status await(trip_frames *f, unsigned document)
{
    for (;;) {
        const trip_frames_status s = trip_frames_get_status(f);
        if (s.document == document && s.rests)
            return s;
        nanosleep(&(struct timespec){ .tv_nsec = 1000000 }, NULL);
    }
}

typedef struct copy {
    trip_picture picture;
    uint8_t rgba[WIDTH * HEIGHT * 4];
} copy;

static void keep(void *user, const trip_picture *p)
{
    copy *c = user;
    assert_true(p->width <= WIDTH && p->height <= HEIGHT);
    c->picture = *p;
    memcpy(c->rgba, p->rgba, (size_t)p->width * (size_t)p->height * 4);
}

static copy take(trip_frames *f)
{
    copy c = { 0 };
    while (!trip_frames_use_picture(f, 0, keep, &c))
        nanosleep(&(struct timespec){ .tv_nsec = 1000000 }, NULL);
    return c;
}

/* A trial could fail here for lack of memory, and the picture would then need less. */
static draw_settings without_trial(void)
{
    return (draw_settings){ .all.samples = 1, .sheet.samples = 4, .lod.voxel_px = TRIPTYCH_ZERO };
}

/* Returns whether the library can draw a large picture with this memory if it caches nothing for
 * the next picture. */
static bool suffices(uint64_t memory_bytes)
{
    triptych *t;
    float *rgba, *other_pixels;
    const triptych_resources resources = { .memory_bytes = memory_bytes,
                                           .threads = 2,
                                           .renderer = TRIPTYCH_RENDERER_CPU };
    const triptych_view view = { .width = LARGE, .height = LARGE };
    const draw_settings numbers = without_trial();
    assert_int_equal(triptych_create(&t), 0);
    const bool drawn = triptych_open(t, data, &resources) == 0 &&
                       triptych_new_picture(t, LARGE, LARGE, 1, &other_pixels) == 0 &&
                       triptych_new_picture(t, LARGE, LARGE, 4, &rgba) == 0 &&
                       draw_settings_use(t, &numbers) == 0 && triptych_set_view(t, &view) == 0 &&
                       triptych_draw(t, rgba) == 0;
    triptych_destroy(t);
    return drawn;
}

static void assert_drawn_alike(const copy *c, const char *path, const trip_wanted *w)
{
    triptych *t;
    static float rgba[WIDTH * HEIGHT * 4];
    const triptych_view view = trip_navigation_view(&c->picture.navigation, WIDTH, HEIGHT);
    assert_int_equal(triptych_create(&t), 0);
    assert_int_equal(
        triptych_open(t, path, &(triptych_resources){ .renderer = TRIPTYCH_RENDERER_CPU }), 0);
    assert_int_equal(
        triptych_set_transfer_function(t, &(triptych_transfer_function){ .name = w->function }), 0);
    assert_int_equal(draw_settings_use(t, &w->settings), 0);
    assert_int_equal(triptych_set_view(t, &view), 0);
    assert_int_equal(triptych_draw(t, rgba), 0);
    triptych_destroy(t);
    for (int i = 0; i < WIDTH * HEIGHT * 4; i++)
        assert_int_equal(c->rgba[i], i % 4 == 3 ? 255 : (int)floor(rgba[i] * 255 + 0.5f));
}

static void the_picture_at_rest_equals_the_picture_of_the_library(void **state)
{
    (void)state;
    trip_frames *f = start();
    trip_wanted w = wanted_of(1, data);
    trip_frames_want(f, &w);
    assert_true(await(f, 1).exact);
    copy c = take(f);
    assert_true(c.picture.whole && c.picture.width == WIDTH);
    assert_drawn_alike(&c, data, &w);
    w.function = "hot-metal";
    w.settings.all.classify = TRIPTYCH_CLASSIFY_POST;
    w.has_navigation = true;
    w.navigation = c.picture.navigation;
    trip_navigation_orbit(&w.navigation, 40, 20);
    trip_frames_want(f, &w);
    assert_true(await(f, 1).exact);
    c = take(f);
    assert_memory_equal(&c.picture.navigation, &w.navigation, sizeof w.navigation);
    assert_drawn_alike(&c, data, &w);
    trip_frames_stop(f);
}

/* The data set has coarse levels for `post` only. Moving views use these levels without a warning.
 * The picture at rest consists of splats. */
static void moving_views_of_splats_use_coarse_levels_of_post(void **state)
{
    (void)state;
    trip_frames *f = start();
    trip_wanted w = wanted_of(1, with_levels);
    w.settings.all.classify = TRIPTYCH_CLASSIFY_PRE;
    trip_frames_want(f, &w);
    const trip_frames_status s = await(f, 1);
    assert_true(s.exact && s.moving > 0 && s.lod_px > 0);
    assert_string_equal(s.message, "");
    const copy c = take(f);
    assert_true(c.picture.whole);
    assert_drawn_alike(&c, with_levels, &w);
    trip_frames_stop(f);
}

static void only_the_last_of_many_requests_is_drawn(void **state)
{
    (void)state;
    trip_opened o;
    trip_frames *f = start();
    trip_wanted w = wanted_of(1, data);
    trip_frames_want(f, &w);
    await(f, 1);
    assert_true(trip_frames_take_opened(f, &o));
    assert_true(o.first && o.info.voxels == SIDE * SIDE * SIDE && o.function);
    w.has_navigation = true;
    w.navigation = o.navigation;
    trip_opened_free(&o);
    for (int i = 0; i < 300; i++) {
        trip_navigation_orbit(&w.navigation, 3, 1);
        trip_frames_want(f, &w);
        if (i % 20 == 0)
            nanosleep(&(struct timespec){ .tv_nsec = 3000000 }, NULL);
    }
    assert_true(await(f, 1).exact);
    const copy c = take(f);
    assert_memory_equal(&c.picture.navigation, &w.navigation, sizeof w.navigation);
    assert_drawn_alike(&c, data, &w);
    trip_frames_stop(f);
}

static void failures_are_reported_and_end_with_the_next_request(void **state)
{
    (void)state;
    trip_frames *f = start();
    trip_wanted w = wanted_of(1, "/nowhere/at-all.trip");
    trip_frames_want(f, &w);
    trip_frames_status s = await(f, 1);
    assert_true(s.failed && !s.open && strstr(s.message, "/nowhere/at-all.trip"));
    w = wanted_of(2, other);
    trip_frames_want(f, &w);
    s = await(f, 2);
    assert_true(s.exact && !s.failed);
    copy c = take(f);
    assert_drawn_alike(&c, other, &w);
    w.text = "this is no function";
    trip_frames_want(f, &w);
    assert_true(await(f, 2).failed);
    w.text = NULL;
    trip_frames_want(f, &w);
    assert_true(await(f, 2).exact);
    trip_frames_stop(f);
}

/* Caches between frames give their memory back to the picture. */
static void the_minimum_memory_for_a_picture_suffices(void **state)
{
    (void)state;
    uint64_t bytes = 1 << 20;
    while (!suffices(bytes))
        bytes += bytes / 16;
    const trip_frames_params params = { .memory_bytes = bytes,
                                        .threads = 2,
                                        .renderer = TRIPTYCH_RENDERER_CPU,
                                        .frames_per_second = 30,
                                        .wake = wake };
    trip_frames *f = trip_frames_start(&params);
    assert_non_null(f);
    trip_wanted w = wanted_of(1, data);
    w.width = w.height = LARGE;
    w.settings = without_trial();
    trip_frames_want(f, &w);
    const trip_frames_status s = await(f, 1);
    if (!s.exact)
        print_message("%s\n", s.message);
    assert_true(s.exact);
    trip_frames_stop(f);
}

static void picture_sizes_and_data_sets_can_alternate(void **state)
{
    (void)state;
    trip_frames *f = start();
    for (unsigned i = 1; i <= 12; i++) {
        trip_wanted w = wanted_of(1 + i % 2, i % 2 ? data : other);
        w.width = WIDTH - (int)(i % 5);
        w.height = HEIGHT - (int)(i % 3);
        trip_frames_want(f, &w);
        if (i % 3)
            continue;
        assert_true(await(f, 1 + i % 2).exact);
        const copy c = take(f);
        assert_int_equal(c.picture.width, w.width);
        assert_int_equal(c.picture.height, w.height);
        assert_int_equal(c.picture.document, w.document);
    }
    trip_frames_stop(f);
}

static void frames_can_be_stopped_at_any_moment(void **state)
{
    (void)state;
    for (int i = 0; i < 20; i++) {
        trip_frames *f = start();
        const trip_wanted w = wanted_of(1, data);
        trip_frames_want(f, &w);
        nanosleep(&(struct timespec){ .tv_nsec = i * 500000 }, NULL);
        trip_frames_stop(f);
    }
}

static void a_pixel_of_the_picture_can_be_probed(void **state)
{
    (void)state;
    trip_frames *f = start();
    const trip_wanted w = wanted_of(1, data);
    trip_frames_want(f, &w);
    trip_frames_probe(f, WIDTH / 2.0, HEIGHT / 2.0);
    await(f, 1);
    trip_probed p;
    while (!(p = trip_frames_get_probed(f)).valid)
        nanosleep(&(struct timespec){ .tv_nsec = 1000000 }, NULL);
    assert_true(p.hit.opacity > 0.5 && p.hit.value >= 30 && p.hit.value < 210);
    trip_frames_stop(f);
}

/* ---- Gaussian scenes ---- */

/* Writes white Gaussians from left to right. Each one is a little farther from the eye. */
static void brick_scene(const char *name, int count, char path[64])
{
    static const char *const names[] = { "x",      "y",       "z",       "f_dc_0",  "f_dc_1",
                                         "f_dc_2", "opacity", "scale_0", "scale_1", "scale_2",
                                         "rot_0",  "rot_1",   "rot_2",   "rot_3" };
    char ply[128];
    triptych *t;
    snprintf(ply, sizeof ply, "%s/%s.ply", folder, name);
    snprintf(path, 64, "%s/%s.trip", folder, name);
    FILE *f = fopen(ply, "wb");
    assert_non_null(f);
    fprintf(f, "ply\nformat binary_little_endian 1.0\nelement vertex %d\n", count);
    for (int i = 0; i < 14; i++)
        fprintf(f, "property float %s\n", names[i]);
    fputs("end_header\n", f);
    for (int i = 0; i < count; i++) {
        const float part = (float)i / (float)count;
        const float row[14] = { 2 * part - 1,
                                0.3f * (float)(i % 7 - 3) / 3,
                                0.1f * part,
                                1.77f,
                                1.77f,
                                1.77f,
                                2,
                                -1.8f,
                                -1.8f,
                                -4,
                                1 };
        assert_int_equal(fwrite(row, sizeof row, 1, f), 1);
    }
    assert_int_equal(fclose(f), 0);
    assert_int_equal(triptych_create(&t), 0);
    assert_int_equal(triptych_brick_gaussians(t, ply, path, NULL, NULL), 0);
    triptych_destroy(t);
}

static const double scene_eye[] = { 0, 0, -5 }, scene_look[] = { 0, 0, 0 },
                    scene_up[] = { 0, -1, 0 };
static const triptych_view scene_view = {
    .eye = scene_eye, .look = scene_look, .up = scene_up, .fov_degrees = 30
};

/* The pictures as the drawing thread shows them. */
typedef struct shown {
    trip_frames *frames;
    uint64_t number;
    int count;
    double sum[64]; /* of all channels, relative to the size of the picture */
    bool whole[64];
} shown;

static void note_picture(void *user, const trip_picture *p)
{
    shown *s = user;
    double sum = 0;
    for (int i = 0; i < 4 * p->width * p->height; i++)
        sum += i % 4 < 3 ? p->rgba[i] : 0;
    s->number = p->number;
    if (s->count < 64) {
        s->sum[s->count] = sum / (p->width * p->height);
        s->whole[s->count++] = p->whole;
    }
}

static void note_news(void *user)
{
    shown *s = user;
    trip_frames_use_picture(s->frames, s->number, note_picture, s);
}

/* Draws a scene by the slow renderer, and returns the time of its first frame in ms. */
static double show_slowly(int count, shown *s)
{
    char path[64], name[32];
    trip_frames_status status;
    snprintf(name, sizeof name, "slow%d", count);
    brick_scene(name, count, path);
    *s = (shown){ 0 };
    s->frames = trip_frames_start(&(trip_frames_params){
        .renderer = TRIPTYCH_RENDERER_REFERENCE, .wake = note_news, .wake_user = s });
    assert_non_null(s->frames);
    trip_wanted w = wanted_of(1, path);
    w.start = &scene_view;
    trip_frames_want(s->frames, &w);
    while (!(status = trip_frames_get_status(s->frames)).moving && !status.failed)
        nanosleep(&(struct timespec){ .tv_nsec = 1000000 }, NULL);
    assert_true(!status.failed);
    trip_frames_stop(s->frames);
    return status.moving_ms;
}

static void a_slow_picture_of_a_scene_grows_from_front_to_back(void **state)
{
    (void)state;
    shown s;
    int count = 20000;
    while (show_slowly(count, &s) < 800)
        count *= 2;
    int parts = 0;
    while (parts < s.count && !s.whole[parts])
        parts++;
    assert_in_range(parts, 4, 63); /* the last one is the whole small frame */
    for (int i = 1; i < parts; i++)
        assert_true(s.sum[i] >= s.sum[i - 1]);
    assert_true(s.sum[0] < 0.6 * s.sum[parts - 1]);
}

static void a_part_of_a_picture_has_no_statistics(void **state)
{
    (void)state;
    char path[64];
    triptych *t;
    float *rgba;
    triptych_frame_stats stats;
    triptych_view view = scene_view;
    view.width = view.height = 40;
    brick_scene("part", 5000, path);
    assert_int_equal(triptych_create(&t), 0);
    assert_int_equal(triptych_open(t, path, NULL), 0);
    assert_int_equal(triptych_new_picture(t, 40, 40, 4, &rgba), 0);
    assert_int_equal(triptych_set_view(t, &view), 0);
    assert_int_equal(triptych_begin(t), 0);
    assert_int_equal(triptych_step(t, 0), TRIPTYCH_STEP_MORE);
    assert_int_equal(triptych_picture(t, rgba), 0);
    assert_int_equal(triptych_get_frame_stats(t, &stats), TRIPTYCH_USAGE);
    assert_int_equal(triptych_step(t, UINT64_MAX), TRIPTYCH_STEP_DONE);
    assert_int_equal(triptych_picture(t, rgba), 0);
    assert_int_equal(triptych_get_frame_stats(t, &stats), 0);
    assert_int_equal(stats.splats, 5000);
    triptych_destroy(t);
}

/* Draws a picture in as many steps as a deadline in the past makes. Returns their number. */
static int draw_in_steps(triptych *t, float *rgba)
{
    int status, steps = 0;
    assert_int_equal(triptych_begin(t), 0);
    while ((status = triptych_step(t, 0)) > 0) {
        steps += status == TRIPTYCH_STEP_MORE;
        if (status == TRIPTYCH_STEP_WAITS)
            assert_int_equal(triptych_await(t, 10000000), 0);
    }
    assert_int_equal(status, 0);
    assert_int_equal(triptych_picture(t, rgba), 0);
    triptych_end(t);
    return steps;
}

/* A volume beside a scene is drawn in at most 48 slabs, and a step may end inside a slab. A frame
 * that is abandoned there leaves nothing behind. */
static void steps_end_inside_a_volume_beside_a_scene(void **state)
{
    (void)state;
    enum { SLABS = 48, OBJECTS = 2, PIXELS = WIDTH * HEIGHT * 4 };
    char path[64];
    triptych *t;
    float *whole, *steps;
    triptych_scene scene;
    const triptych_view view = { .width = WIDTH, .height = HEIGHT };
    brick_scene("beside", 200, path);
    const triptych_object objects[OBJECTS] = {
        { .path = data, .matrix = { { 0.1, 0, 0, -1 }, { 0, 0.1, 0, -1 }, { 0, 0, 0.1, -1 } } },
        { .path = path, .matrix = TRIPTYCH_UNPLACED },
    };
    assert_int_equal(triptych_create(&t), 0);
    assert_int_equal(triptych_open_objects(t, objects, OBJECTS, NULL), 0);
    assert_int_equal(triptych_get_scene(t, &scene), 0);
    assert_true(scene.objects == 2 && scene.volumes == 1 && scene.gaussians == 200 && scene.moved);
    assert_int_equal(triptych_new_picture(t, WIDTH, HEIGHT, 4, &whole), 0);
    assert_int_equal(triptych_new_picture(t, WIDTH, HEIGHT, 4, &steps), 0);
    assert_int_equal(triptych_set_view(t, &view), 0);
    assert_int_equal(triptych_draw(t, whole), 0);
    for (int i = 1; i < 100; i += 7) { /* abandons frames */
        assert_int_equal(triptych_begin(t), 0);
        for (int k = 0; k < i; k++)
            assert_true(triptych_step(t, 0) > 0);
        triptych_end(t);
    }
    assert_true(draw_in_steps(t, steps) > (SLABS + 2) * (OBJECTS + 1));
    assert_memory_equal(whole, steps, PIXELS * sizeof *whole);
    triptych_destroy(t);
}

static void a_scene_is_described_and_drawn_as_by_the_library(void **state)
{
    (void)state;
    char path[64];
    trip_opened o;
    brick_scene("scene", 500, path);
    trip_frames *f = start();
    trip_wanted w = wanted_of(1, path);
    trip_frames_want(f, &w);
    assert_true(await(f, 1).exact);
    copy c = take(f);
    assert_drawn_alike(&c, path, &w);
    assert_true(trip_frames_take_opened(f, &o));
    assert_true(o.first && o.kind == DRAW_KIND_SCENE && o.scene.gaussians == 500 && o.scene.y_down);
    assert_true(!o.function && o.histogram.total == 0 && o.info.lo[0] < -0.9 && o.info.hi[0] > 0.9);
    trip_opened_free(&o);
    /* Parts that a scene lacks are left out. */
    trip_wanted others = w;
    others.function = "bone";
    others.settings.effects.which = TRIPTYCH_EFFECT_OCCLUSION;
    others.settings.all.quality = TRIPTYCH_QUALITY_EXACT;
    others.settings.scene.order = w.settings.scene.order = TRIPTYCH_ORDER_LISTS;
    trip_frames_want(f, &others);
    const trip_frames_status s = await(f, 1);
    assert_true(s.exact && !s.failed);
    c = take(f);
    assert_drawn_alike(&c, path, &w);
    /* So are the parts that a volume lacks. */
    trip_wanted volume = wanted_of(2, data);
    volume.settings.scene.order = TRIPTYCH_ORDER_LISTS;
    trip_frames_want(f, &volume);
    assert_true(await(f, 2).exact);
    volume.settings.scene.order = TRIPTYCH_ORDER_DEFAULT;
    c = take(f);
    assert_drawn_alike(&c, data, &volume);
    trip_frames_stop(f);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_picture_at_rest_equals_the_picture_of_the_library),
        cmocka_unit_test(moving_views_of_splats_use_coarse_levels_of_post),
        cmocka_unit_test(only_the_last_of_many_requests_is_drawn),
        cmocka_unit_test(failures_are_reported_and_end_with_the_next_request),
        cmocka_unit_test(the_minimum_memory_for_a_picture_suffices),
        cmocka_unit_test(picture_sizes_and_data_sets_can_alternate),
        cmocka_unit_test(frames_can_be_stopped_at_any_moment),
        cmocka_unit_test(a_pixel_of_the_picture_can_be_probed),
        cmocka_unit_test(a_slow_picture_of_a_scene_grows_from_front_to_back),
        cmocka_unit_test(a_part_of_a_picture_has_no_statistics),
        cmocka_unit_test(steps_end_inside_a_volume_beside_a_scene),
        cmocka_unit_test(a_scene_is_described_and_drawn_as_by_the_library),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
