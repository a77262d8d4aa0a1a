/* Draws a data set with uneven codes through the library, with one transfer function after another.
 * The truth is the integral through the volume itself. */
#include "test.h"

#include "scenes.h"

#include <stdlib.h>
#include <unistd.h>

#include "contexts.h"
#include "triptych_brick.h"

enum { NX = 24, NY = 20, NZ = 28, SIZE = 40, FLOATS = 4 * SIZE * SIZE, KNOTS = 257 };

#define VOLUME "decades.nrrd"

/* Exact in single precision, so that the volume and the data set start from the same values. From
 * about 1 to e^12. */
static float value_at(int i, int j, int k)
{
    const double x = i / (NX - 1.0), y = j / (NY - 1.0), z = k / (NZ - 1.0);
    return (float)exp(12 * (0.4 * x + 0.25 * y * y + 0.35 * z));
}

static double knots[KNOTS];

/* Knots at equal ratios. */
static void make_knots(void)
{
    for (int n = 0; n < KNOTS; n++)
        knots[n] = exp(12.001 * n / (KNOTS - 1));
}

static bool voxel(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    (void)gradient;
    *code = trip_codes_nearest(user, (double)value_at(i, j, k));
    return true;
}

static void write_volume(void)
{
    FILE *f = fopen(VOLUME, "wb");
    assert_non_null(f);
    fprintf(f,
            "NRRD0004\ntype: float\ndimension: 3\nsizes: %d %d %d\nendian: little\n"
            "encoding: raw\n\n",
            NX, NY, NZ);
    for (int n = 0; n < NX * NY * NZ; n++) {
        const float value = value_at(n % NX, n / NX % NY, n / NX / NY);
        fwrite(&value, sizeof value, 1, f);
    }
    fclose(f);
}

static triptych *open_scene(const scene *s, triptych_renderer renderer)
{
    triptych *t = new_context();
    const triptych_resources resources = { .memory_bytes = 256 << 20, .renderer = renderer };
    const triptych_view view = { .width = SIZE, .height = SIZE };
    const triptych_light light = { .no_shading = 1 };
    triptych_settings settings = { 0 };
    settings.classify = TRIPTYCH_CLASSIFY_POST;
    settings.samples = 1;
    settings.light = &light;
    if (triptych_open(t, s->path, &resources))
        fail_msg("%s", triptych_error(t));
    assert_int_equal(triptych_set_view(t, &view), 0);
    if (triptych_set_settings(t, &settings))
        fail_msg("%s", triptych_error(t));
    return t;
}

static void draw(triptych *t, const char *function, float *rgba)
{
    if (triptych_set_transfer_function(t, &(triptych_transfer_function){ .name = function }) ||
        triptych_draw(t, rgba))
        fail_msg("%s", triptych_error(t));
}

static double mean_difference(const float *a, const float *b)
{
    double sum = 0;
    for (int i = 0; i < FLOATS; i++)
        sum += fabs((double)a[i] - (double)b[i]);
    return 255 * sum / FLOATS;
}

static void write_function(const char *path, double lo, double hi)
{
    FILE *f = fopen(path, "w");
    assert_non_null(f);
    fprintf(f, "unit voxel\nvalues data\n%.9g 0 0 0 0\n%.9g 1 0.8 0.3 0.5\n", lo, hi);
    fclose(f);
}

static void each_function_has_draw_codes_of_its_own(void **state)
{
    (void)state;
    static const double windows[][2] = { { 2, 2.2 }, { 5000, 5600 }, { 100000, 150000 }, { 3, 4 } };
    static float truth[FLOATS], stored[FLOATS], post[FLOATS];
    make_knots();
    write_volume();
    trip_codes codes = trip_codes_from_table(knots, KNOTS, 8);
    scene s;
    scene_create(&s, &(scene_params){
                         .dims = { NX, NY, NZ }, .codes = &codes, .voxel = voxel, .user = &codes });
    triptych *source = open_scene(&s, TRIPTYCH_RENDERER_INTEGRAL);
    triptych *integral = open_scene(&s, TRIPTYCH_RENDERER_INTEGRAL);
    triptych *cpu = open_scene(&s, TRIPTYCH_RENDERER_CPU);
    triptych *reference = open_scene(&s, TRIPTYCH_RENDERER_REFERENCE);
    if (triptych_set_source(source, VOLUME, NULL))
        fail_msg("%s", triptych_error(source));
    for (int w = 0; w < 4; w++) {
        float max = 0;
        write_function("window.tf", windows[w][0], windows[w][1]);
        draw(source, "window.tf", truth);
        draw(integral, "window.tf", stored);
        for (int i = 3; i < FLOATS; i += 4)
            max = fmaxf(max, truth[i]);
        assert_true(max > 0.5F);
        assert_true(mean_difference(stored, truth) < 0.1);
        draw(reference, "window.tf", stored);
        draw(cpu, "window.tf", post);
        assert_true(mean_difference(post, stored) < 0.1);
    }
    triptych_destroy(source);
    triptych_destroy(integral);
    triptych_destroy(cpu);
    triptych_destroy(reference);
    scene_destroy(&s);
    unlink(VOLUME);
    unlink("window.tf");
}

/* A constant opaque function: the first visible point has the value of the outermost voxels. */
static void the_probe_returns_a_value_of_the_volume(void **state)
{
    (void)state;
    make_knots();
    trip_codes codes = trip_codes_from_table(knots, KNOTS, 8);
    scene s;
    scene_create(&s, &(scene_params){
                         .dims = { NX, NY, NZ }, .codes = &codes, .voxel = voxel, .user = &codes });
    triptych *t = open_scene(&s, TRIPTYCH_RENDERER_CPU);
    write_function("window.tf", 0.5, 0.6);
    const triptych_transfer_function function = { .name = "window.tf", .opacity_scale = 1000 };
    triptych_hit hit;
    assert_int_equal(triptych_set_transfer_function(t, &function), 0);
    assert_int_equal(triptych_probe(t, SIZE / 2.0, SIZE / 2.0, &hit), 0);
    assert_true(hit.opacity > 0.99);
    /* neighbouring values differ by a factor of less than 2 */
    const double value = (double)value_at((int)lround(hit.index[0]), (int)lround(hit.index[1]),
                                          (int)lround(hit.index[2]));
    assert_true(hit.value > value / 2 && hit.value < value * 2);
    triptych_destroy(t);
    scene_destroy(&s);
    unlink("window.tf");
}

/* Ids with gaps. Voxels alternate between the second and the third. */
static const double ids[] = { 0, 7, 4000000000.0 };

static bool label(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    (void)user, (void)gradient;
    *code = 1 + (unsigned)(i + j + k) % 2;
    return true;
}

static void the_probe_returns_the_id_of_the_nearest_voxel(void **state)
{
    (void)state;
    const trip_codes codes = trip_codes_from_table(ids, 3, 0);
    scene s;
    scene_create(&s, &(scene_params){ .dims = { NX, NY, NZ }, .codes = &codes, .voxel = label });
    triptych *t = open_scene(&s, TRIPTYCH_RENDERER_CPU);
    triptych_settings settings = { 0 };
    settings.classify = TRIPTYCH_CLASSIFY_POST;
    settings.samples = 1;
    settings.interpolation = TRIPTYCH_INTERPOLATION_NEAREST;
    assert_int_equal(triptych_set_settings(t, &settings), 0);
    write_function("ids.tf", 1, 7);
    assert_int_equal(
        triptych_set_transfer_function(t, &(triptych_transfer_function){ .name = "ids.tf" }), 0);
    int found = 0;
    for (int n = 0; n < 100; n++) {
        triptych_hit hit;
        assert_int_equal(
            triptych_probe(t, SIZE / 3.0 + n % 10 * 1.3, SIZE / 3.0 + n / 10 * 1.3, &hit), 0);
        if (hit.opacity == 0)
            continue;
        const int sum = (int)(floor(hit.index[0] + 0.5) + floor(hit.index[1] + 0.5) +
                              floor(hit.index[2] + 0.5));
        assert_true(hit.value == (sum % 2 ? 4000000000.0 : 7));
        found |= 1 << sum % 2;
    }
    assert_int_equal(found, 3);
    triptych_destroy(t);
    scene_destroy(&s);
    unlink("ids.tf");
}

/* No interpolation is given. The data set has even codes, and the labels 3 and 9 touch: linear
 * interpolation gives values between them.
 */
static void the_probe_returns_a_label_of_labels(void **state)
{
    (void)state;
    enum { SIDE = 16 };
    static uint16_t values[SIDE * SIDE * SIDE];
    for (int n = 0; n < SIDE * SIDE * SIDE; n++) {
        const int i = n % SIDE, j = n / SIDE % SIDE, k = n / SIDE / SIDE;
        const bool inside = i > 1 && i < 14 && j > 1 && j < 14 && k > 1 && k < 14;
        values[n] = !inside ? 0 : (i / 2 + j / 2 + k / 2) % 2 ? 3 : 9;
    }
    const triptych_volume volume = { .type = "uint16",
                                     .dims = { SIDE, SIDE, SIDE },
                                     .data = values };
    const triptych_brick_options options = { .in_memory = &volume, .replace = 1, .keep_all = 1 };
    triptych *t = new_context();
    if (triptych_brick(t, "seg.raw", "seg.trip", &options, NULL) ||
        triptych_open(t, "seg.trip", &(triptych_resources){ .memory_bytes = 256 << 20 }) ||
        triptych_set_view(t, &(triptych_view){ .width = SIZE, .height = SIZE }))
        fail_msg("%s", triptych_error(t));
    int found = 0;
    for (int n = 0; n < 100; n++) {
        triptych_hit hit;
        if (triptych_probe(t, SIZE / 3.0 + n % 10 * 1.3, SIZE / 3.0 + n / 10 * 1.3, &hit))
            fail_msg("%s", triptych_error(t));
        if (hit.opacity == 0)
            continue;
        int at[3];
        for (int a = 0; a < 3; a++)
            at[a] = (int)floor(hit.index[a] + 0.5);
        const uint16_t value = values[at[0] + SIDE * (at[1] + SIDE * at[2])];
        assert_close(hit.value, value, 1e-9);
        found |= value == 3 ? 1 : value == 9 ? 2 : 0;
    }
    assert_int_equal(found, 3);
    triptych_destroy(t);
    assert_int_equal(system("rm -r seg.trip"), 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(each_function_has_draw_codes_of_its_own),
        cmocka_unit_test(the_probe_returns_a_value_of_the_volume),
        cmocka_unit_test(the_probe_returns_the_id_of_the_nearest_voxel),
        cmocka_unit_test(the_probe_returns_a_label_of_labels),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
