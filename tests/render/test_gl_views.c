/* Compares every renderer with the reference on real data. The test bricks three volumes that come
 * with the project and draws them from twelve difficult views. The first volume uses every view,
 * the others every second one in turn. A pixel may differ by at most 1/255, and the mean by
 * 0.05/255. */
#include <stdlib.h>
#include <string.h>

#include "brick.h"
#include "dataset_level.h"
#include "dataset_metadata.h"
#include "scenes.h"
#include "test.h"

enum { SIZE = 96, VIEWS = 12 };

/* Bricks one of the project's volumes and opens it as a scene with the settings of a default
 * render. */
static void open_volume(scene *s, const char *name, trip_brick_levels_for levels_for)
{
    char input[512];
    trip_brick_summary summary;
    trip_dataset_metadata *text;
    trip_tf *tf;
    memset(s, 0, sizeof *s);
    snprintf(s->folder, sizeof s->folder, "/tmp/trip-views-XXXXXX");
    assert_non_null(mkdtemp(s->folder));
    snprintf(s->path, sizeof s->path, "%s/v.trip", s->folder);
    snprintf(input, sizeof input, "%s/datasets/%s", TRIP_SOURCE_DIR, name);
    assert_int_equal(trip_brick(&(trip_brick_params){ .input = input,
                                                      .output = s->path,
                                                      .levels_for = levels_for,
                                                      .normals = TRIP_NORMALS_STORED,
                                                      .memory_bytes = UINT64_C(1) << 30 },
                                &summary),
                     0);
    assert_int_equal(trip_budget_create(&s->budget, UINT64_C(1) << 30), 0);
    assert_int_equal(trip_dataset_open(&s->data, s->path, s->budget), 0);
    s->table = calloc(65536, sizeof *s->table);
    assert_non_null(s->table);
    assert_int_equal(trip_dataset_metadata_parse(&text, s->data), 0);
    assert_int_equal(trip_dataset_metadata_tf(text, s->data, &tf), 0);
    const trip_file_header *h = &s->data->header;
    trip_tf_denormalise(tf, h->value_min, h->value_max);
    double voxel = cbrt(fabs(trip_affine_determinant(&s->data->index_to_world)));
    trip_tf_fill_table(tf, h->code_lo, h->code_hi, voxel, s->table);
    trip_tf_destroy(tf);
    trip_dataset_metadata_destroy(text);
}

/* Returns half the diagonal of the volume in world units. */
static double half_diagonal(const scene *s)
{
    const uint64_t *dims = s->data->header.dims;
    trip_vec3 diagonal = { (double)dims[0], (double)dims[1], (double)dims[2] };
    return 0.5 * trip_length(trip_affine_vector(&s->data->index_to_world, diagonal));
}

static const struct {
    const char *name;
    trip_vec3 direction; /* from the centre to the eye */
    double distance;     /* in half diagonals */
    double fov_degrees;
    double ortho; /* height in half diagonals; 0 selects perspective */
    int size;     /* width and height in pixels */
} views[VIEWS] = {
    { "along x", { 1, 0, 0 }, 4, 30, 0, SIZE },
    { "along -y", { 0, -1, 0 }, 4, 30, 0, SIZE },
    { "along z", { 0, 0, 1 }, 4, 30, 0, SIZE },
    { "between x and y", { 1, 1, 0.2 }, 4, 30, 0, SIZE },
    { "along the diagonal", { -1, -1, -1 }, 4, 30, 0, SIZE },
    { "from near by, 100 degrees", { 0.3, 1, -0.7 }, 1, 100, 0, SIZE },
    { "from inside, 90 degrees", { 0.2, 0.5, 1 }, 0.15, 90, 0, SIZE },
    { "from inside, 160 degrees", { 1, -0.3, 0.4 }, 0.1, 160, 0, SIZE },
    { "parallel, oblique", { 1, 0.8, -0.5 }, 3, 0, 2, SIZE },
    { "parallel, along y", { 0, 1, 0 }, 3, 0, 2, SIZE },
    { "magnified", { 0.6, -1, 0.4 }, 1.5, 1.2, 0, SIZE },
    { "minified", { 1, 0.6, 0.9 }, 5, 30, 0, SIZE / 4 },
};

static trip_camera_params make_view(const scene *s, int i)
{
    double half = half_diagonal(s);
    trip_camera_params p = scene_view(s, views[i].direction, views[i].distance * half,
                                      views[i].fov_degrees, views[i].size);
    p.width += p.width / 3; /* not square */
    p.ortho_height = views[i].ortho * half;
    return p;
}

typedef struct tally {
    double max, sum, components;
} tally;

static void add(tally *t, const scene_picture *a, const scene_picture *b,
                const trip_settings *settings, const char *view)
{
    double sum = 0, max = scene_difference(a, b);
    size_t n = 4 * (size_t)a->width * (size_t)a->height;
    for (size_t i = 0; i < n; i++)
        sum += fabs((double)a->rgba[i] - (double)b->rgba[i]);
    if (!(max <= scene_bound(settings) && sum / (double)n < 0.005 / 255))
        fail_msg("%s: most %.4f, mean %.5f of 1/255", view, 255 * max, 255 * sum / (double)n);
    t->max = fmax(t->max, max);
    t->sum += sum;
    t->components += (double)n;
}

/* In `post`, the test draws with gl alone; test_sheets.c tests the other renderers. */
static void check_view(const scene *s, int i, trip_classify classify, tally *tallies)
{
    trip_camera_params view = make_view(s, i);
    trip_settings settings = trip_settings_default();
    settings.classify = classify;
    const scene_renderer *all = scene_renderers();
    scene_picture expected = scene_draw(s, &all[0], &view, &settings);
    for (int r = 1; all[r].name; r++) {
        if (classify == TRIP_CLASSIFY_POST && strcmp(all[r].name, "gl") != 0)
            continue;
        scene_picture p = scene_draw(s, &all[r], &view, &settings);
        add(&tallies[r], &expected, &p, &settings, views[i].name);
        for (int axis = 0; axis < 3; axis++)
            scene_compare_counts(&expected.lists[axis], &p.lists[axis], all[r].name);
        scene_picture_free(&p);
    }
    scene_picture_free(&expected);
}

/* Makes all visible codes nearly opaque, alternately black and white for 256 codes each. */
static void set_hard_contrast(scene *s)
{
    double voxel = cbrt(fabs(trip_affine_determinant(&s->data->index_to_world)));
    for (unsigned code = 0; code < 65536; code++) {
        if (!(s->table[code].extinction > 0))
            continue;
        float grey = code >> 8 & 1 ? 1 : 0;
        s->table[code] =
            (trip_tf_entry){ grey, grey, grey, (float)(trip_extinction(0.9999) / voxel) };
    }
}

/* Draws the views from `first` on, at a given step. If tests run by turns, it draws every fourth.
 */
static void check_volume(const char *name, trip_classify classify, bool hard, int first, int step)
{
    scene s;
    tally tallies[4] = { { 0, 0, 0 } };
    open_volume(&s, name, TRIP_LEVELS_FOR_AUTO);
    if (hard)
        set_hard_contrast(&s);
    for (int i = first; i < VIEWS; i += TEST_BY_TURNS ? 4 : step)
        check_view(&s, i, classify, tallies);
    for (int r = 1; scene_renderers()[r].name; r++)
        if (tallies[r].components > 0)
            print_message("%s, %llu splats: %s most %.4f mean %.5f of 1/255\n", name,
                          (unsigned long long)s.data->header.kept, scene_renderers()[r].name,
                          255 * tallies[r].max, 255 * tallies[r].sum / tallies[r].components);
    scene_destroy(&s);
}

static void twelve_views_of_a_tooth_agree_with_the_reference(void **state)
{
    (void)state;
    check_volume("tooth.nhdr", TRIP_CLASSIFY_PRE, false, 0, 1);
}

static void views_of_a_stent_agree_with_the_reference(void **state)
{
    (void)state;
    check_volume("stent.nrrd", TRIP_CLASSIFY_PRE, false, 1, 2);
}

static void views_of_a_cloud_agree_with_the_reference(void **state)
{
    (void)state;
#ifdef TRIP_WITHOUT_OPENVDB
    skip();
#endif
    check_volume("wdas_cloud_sixteenth.vdb", TRIP_CLASSIFY_PRE, false, 0, 2);
}

static void nearly_opaque_black_and_white_agrees_with_the_reference(void **state)
{
    (void)state;
    check_volume("tooth.nhdr", TRIP_CLASSIFY_PRE, true, 2, 3);
}

/* The stent reaches the border of the grid. In view 6 a ray passes a sample plane within a
 * millionth of a voxel of the border. Single precision cannot tell this position from the border
 * itself. */
static void views_classified_after_interpolation_agree_with_the_reference(void **state)
{
    (void)state;
    check_volume("tooth.nhdr", TRIP_CLASSIFY_POST, false, 1, 2);
    check_volume("stent.nrrd", TRIP_CLASSIFY_POST, false, 1, 3);
}

/* Volumes of 8 bits and of more. Far voxels belong to coarse levels, which are drawn as splats of
 * means. */
static void means_agree_with_the_reference(void **state)
{
    (void)state;
    static const char *const names[] = { "tooth.nhdr", "stent.nrrd" };
    trip_settings settings = trip_settings_default();
    const scene_renderer *all = scene_renderers();
    settings.lod_px = 1000;
    for (int n = 0; n < 2; n++) {
        scene s;
        tally tallies[4] = { { 0, 0, 0 } };
        open_volume(&s, names[n], TRIP_LEVELS_FOR_PRE);
        for (int i = 4; i < VIEWS; i += TEST_BY_TURNS ? 6 : 2) {
            trip_camera_params view = make_view(&s, i);
            scene_picture expected = scene_draw(&s, &all[0], &view, &settings);
            uint64_t coarse = 0;
            for (unsigned k = 0; k < s.data->list_count; k++)
                coarse += s.data->lists[k].level > 0 ? expected.lists[k].splats_read : 0;
            assert_true(coarse > 0);
            for (int r = 1; all[r].name; r++) {
                scene_picture p = scene_draw(&s, &all[r], &view, &settings);
                add(&tallies[r], &expected, &p, &settings, views[i].name);
                scene_picture_free(&p);
            }
            scene_picture_free(&expected);
        }
        scene_destroy(&s);
    }
}

/* Draws a coarse level with deviations by gl alone; test_blurred_levels.c tests cpu. Deviations
 * must change some view. */
static void check_level(const scene *level, tally *t)
{
    const scene_renderer *all = scene_renderers();
    double change = 0;
    for (int i = (int)level->level - 1; i < VIEWS; i += TEST_BY_TURNS ? 6 : 3) {
        const trip_camera_params view = make_view(level, i);
        trip_settings settings = trip_settings_default();
        settings.classify = TRIP_CLASSIFY_POST;
        settings.lod_px = 1;
        scene_picture expected = scene_draw(level, &all[0], &view, &settings);
        scene_picture p = scene_draw(level, &all[2], &view, &settings);
        add(t, &expected, &p, &settings, views[i].name);
        settings.deviations = false;
        scene_picture without = scene_draw(level, &all[2], &view, &settings);
        change = fmax(change, scene_difference(&p, &without));
        scene_picture_free(&expected);
        scene_picture_free(&p);
        scene_picture_free(&without);
    }
    assert_true(change > 8.0 / 255);
}

static void levels_with_deviations_agree_with_the_reference(void **state)
{
    (void)state;
    static const char *const names[] = { "tooth.nhdr", "stent.nrrd" };
    if (!scene_renderers()[2].name)
        skip();
    for (int n = 0; n < 2; n++) {
        scene s;
        tally t = { 0, 0, 0 };
        open_volume(&s, names[n], TRIP_LEVELS_FOR_POST);
        for (unsigned level = 1; level <= 2; level++) {
            scene at = s;
            at.level = level;
            assert_int_equal(trip_dataset_level_open(&at.data, s.data, level), 0);
            check_level(&at, &t);
            trip_dataset_level_close(at.data);
        }
        print_message("%s, levels 1 and 2: gl most %.4f mean %.5f of 1/255\n", names[n],
                      255 * t.max, 255 * t.sum / t.components);
        scene_destroy(&s);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(twelve_views_of_a_tooth_agree_with_the_reference),
        cmocka_unit_test(views_of_a_stent_agree_with_the_reference),
        cmocka_unit_test(views_of_a_cloud_agree_with_the_reference),
        cmocka_unit_test(nearly_opaque_black_and_white_agrees_with_the_reference),
        cmocka_unit_test(means_agree_with_the_reference),
        cmocka_unit_test(views_classified_after_interpolation_agree_with_the_reference),
        cmocka_unit_test(levels_with_deviations_agree_with_the_reference),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
