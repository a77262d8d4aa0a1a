/* Tests pictures of interpolated values that are drawn in parts at several levels of detail. The
 * values of the volume rise linearly, so that interpolated means equal the values, and all levels
 * are alike. The picture must therefore equal the integral through the finest level. */
#include "draw_settings.h"
#include <triptych_brick.h>

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "contexts.h"

enum { NX = 64, NY = 64, NZ = 192, SIZE = 64, FLOATS = 4 * SIZE * SIZE };

#define VOLUME "ramp.nrrd"
#define DATA_SET "ramp.trip"

/* The box is away from the border of the volume, where coarse levels end before fine levels. */
static const triptych_clip inside = {
    .box = 1, .box_of_voxels = 1, .box_lo = { 9, 9, 9 }, .box_hi = { NX - 10, NY - 10, NZ - 10 }
};

static const char function[] = "unit voxel\nvalues data\n"
                               "0 1 0.2 0.1 0.002\n"
                               "1 0.1 0.4 1 0.03\n";

static int write_volume(int nx)
{
    FILE *f = fopen(VOLUME, "wb");
    if (!f)
        return -1;
    fprintf(f,
            "NRRD0004\ntype: float\ndimension: 3\nsizes: %d %d %d\nendian: little\n"
            "encoding: raw\n\n",
            nx, NY, NZ);
    for (int k = 0; k < NZ; k++)
        for (int j = 0; j < NY; j++)
            for (int i = 0; i < nx; i++) {
                const float value =
                    0.25f * (float)i / NX + 0.25f * (float)j / NY + 0.5f * (float)k / NZ;
                fwrite(&value, sizeof value, 1, f);
            }
    return fclose(f);
}

static int brick_ramp(int nx)
{
    const triptych_brick_options options = {
        .keep_all = 1, .levels = 4, .tile_voxels = 16, .memory_bytes = 64 << 20, .replace = 1
    };
    return write_volume(nx) ? -1 : brick_volume(VOLUME, DATA_SET, &options);
}

static int brick(void **state)
{
    (void)state;
    return brick_ramp(NX);
}

static int remove_data(void **state)
{
    (void)state;
    return system("rm -r " VOLUME " " DATA_SET);
}

/* Both eyes look along the volume. One is in front of it, the other inside. */
static const double eyes[2][3] = { { 20, 40, -30 }, { 30, 35, 40 } };

static triptych *open_at(triptych_renderer renderer, const double eye[3])
{
    triptych *t = new_context();
    const triptych_resources resources = { .memory_bytes = 256 << 20, .renderer = renderer };
    const triptych_view view = { .width = SIZE,
                                 .height = SIZE,
                                 .eye = eye,
                                 .look = (double[]){ 33, 30, 180 },
                                 .up = (double[]){ 0, 1, 0 },
                                 .fov_degrees = 25 };
    assert_int_equal(triptych_open(t, DATA_SET, &resources), TRIPTYCH_OK);
    assert_int_equal(
        triptych_set_transfer_function(t, &(triptych_transfer_function){ .text = function }),
        TRIPTYCH_OK);
    assert_int_equal(triptych_set_view(t, &view), TRIPTYCH_OK);
    return t;
}

static draw_settings plain(double lod_px)
{
    draw_settings s = { 0 };
    s.light.no_shading = 1;
    s.lod.voxel_px = lod_px;
    s.integral.tolerance = 1e-4;
    s.all.samples = 1;
    s.clip = inside;
    s.has_background = 1;
    return s;
}

static uint64_t draw(triptych *t, const draw_settings *s, float *rgba)
{
    triptych_frame_stats stats;
    assert_int_equal(draw_settings_use(t, s), TRIPTYCH_OK);
    assert_int_equal(triptych_draw(t, rgba), TRIPTYCH_OK);
    assert_int_equal(triptych_get_frame_stats(t, &stats), TRIPTYCH_OK);
    return stats.splats;
}

static void assert_near(const float *a, const float *b, double mean, double max)
{
    double sum = 0, greatest = 0;
    for (int i = 0; i < FLOATS; i++) {
        const double d = fabs((double)a[i] - (double)b[i]);
        sum += d;
        greatest = fmax(greatest, d);
    }
    if (!(255 * sum / FLOATS <= mean && 255 * greatest <= max))
        fail_msg("%.3f in the mean, at most %.3f of 255", 255 * sum / FLOATS, 255 * greatest);
}

/* Returns the number of parts that the plan of the frame names. */
static int count_parts(triptych *t)
{
    char *text = NULL;
    int parts = 1;
    assert_int_equal(triptych_begin(t), TRIPTYCH_OK);
    assert_int_equal(triptych_explain(t, &text), TRIPTYCH_OK);
    for (const char *at = text; (at = strstr(at, ", from depth ")); at++)
        parts++;
    free(text);
    triptych_end(t);
    return parts;
}

static const triptych_renderer renderers[] = {
    TRIPTYCH_RENDERER_CPU,
    TRIPTYCH_RENDERER_REFERENCE,
#ifndef TRIP_WITHOUT_GL
    TRIPTYCH_RENDERER_GL,
#endif
};

/* A gap or an overlap of one voxel would differ by up to 7 of 255. */
static void parts_join_without_a_seam(void **state)
{
    (void)state;
    static float truth[FLOATS], fine[FLOATS], parts[FLOATS];
    for (int e = 0; e < 2; e++) {
        triptych *t = open_at(TRIPTYCH_RENDERER_INTEGRAL, eyes[e]);
        draw_settings s = plain(0);
        draw(t, &s, truth);
        triptych_destroy(t);
        assert_true(truth[4 * (SIZE / 2 * SIZE + SIZE / 2) + 3] > 0.7F);
        for (size_t i = 0; i < sizeof renderers / sizeof *renderers; i++) {
            t = open_at(renderers[i], eyes[e]);
            s = plain(0);
            const uint64_t of_fine = draw(t, &s, fine);
            assert_near(fine, truth, 0.1, 1.5);
            s = plain(4);
            assert_true(draw(t, &s, parts) < of_fine);
            assert_int_equal(count_parts(t), 3);
            assert_near(parts, truth, 0.2, 1.5);
            triptych_destroy(t);
        }
    }
}

/* The background, normalised colours and several samples per pixel apply after the last part. */
static void the_background_is_added_after_the_last_part(void **state)
{
    (void)state;
    static float clear[FLOATS], other[FLOATS];
    triptych *t = open_at(TRIPTYCH_RENDERER_CPU, eyes[1]);
    draw_settings s = plain(4);
    draw(t, &s, clear);
    const double background[4] = { 0.9, 0.3, 0.6, 0.75 };
    memcpy(s.background, background, sizeof background);
    draw(t, &s, other);
    for (int i = 0; i < FLOATS; i++) {
        const double alpha = clear[i / 4 * 4 + 3];
        const double behind = (i % 4 < 3 ? background[i % 4] : 1) * background[3];
        assert_float_equal(other[i], clear[i] + (1 - alpha) * behind, 1e-6);
    }
    s.all.normalise = 1;
    draw(t, &s, other);
    for (int i = 0; i < FLOATS; i++)
        if (clear[i / 4 * 4 + 3] > 1e-3F)
            assert_float_equal(other[i], clear[i] / clear[i / 4 * 4 + 3], 1e-5);
    s = plain(8);
    s.all.samples = 2;
    draw(t, &s, other);
    assert_near(other, clear, 0.3, 12); /* the rim of the box is smoother */
    triptych_destroy(t);
}

/* Frames drawn in steps and at once are the same. Before the end, a picture holds only the parts
 * drawn so far. */
static void drawing_in_steps_gives_the_same_bits(void **state)
{
    (void)state;
    static float whole[FLOATS], again[FLOATS], on_the_way[FLOATS];
    triptych *t = open_at(TRIPTYCH_RENDERER_CPU, eyes[1]);
    const draw_settings s = plain(4);
    draw(t, &s, whole);
    int status = TRIPTYCH_STEP_MORE;
    assert_int_equal(triptych_begin(t), TRIPTYCH_OK);
    while (status > 0) {
        status = triptych_step(t, 0);
        if (status == TRIPTYCH_STEP_WAITS)
            triptych_await(t, 20000000);
        assert_true(status >= 0);
        assert_int_equal(triptych_picture(t, on_the_way), TRIPTYCH_OK);
        for (int i = 3; i < FLOATS; i += 4)
            assert_true(on_the_way[i] <= whole[i] + 1e-3F);
    }
    assert_int_equal(triptych_picture(t, again), TRIPTYCH_OK);
    triptych_end(t);
    assert_memory_equal(again, whole, sizeof again);
    triptych_destroy(t);
}

/* Returns the number of the part that the plan explains, counted from 1. Checks that only lists of
 * the level of this part are read. */
static int check_plan(triptych *t)
{
    static const char said[] = "3 pictures are drawn; the lines below explain number ";
    char *text = NULL;
    int number, read = 0;
    unsigned level;
    assert_int_equal(triptych_explain(t, &text), TRIPTYCH_OK);
    const char *at = strstr(text, said);
    assert_non_null(at);
    assert_int_equal(sscanf(at + strlen(said), "%d, at level %u", &number, &level), 2);
    for (at = text; (at = strstr(at, "\nlist ")); at++) {
        const unsigned of = at[7] > '0' && at[7] <= '9' ? (unsigned)(at[7] - '0') : 0;
        const char *end = strchr(at + 1, '\n');
        const char *other = strstr(at, ": the frame is drawn at another level\n");
        const char *reads = strstr(at, " read: ");
        assert_int_equal(other && other < end, of != level);
        read += reads && reads < end;
    }
    assert_true(read > 0);
    free(text);
    return number;
}

static void the_plan_explains_the_part_being_drawn(void **state)
{
    (void)state;
    triptych *t = open_at(TRIPTYCH_RENDERER_CPU, eyes[0]);
    const draw_settings s = plain(4);
    int status = TRIPTYCH_STEP_MORE, number = 0;
    assert_int_equal(draw_settings_use(t, &s), TRIPTYCH_OK);
    assert_int_equal(triptych_begin(t), TRIPTYCH_OK);
    assert_int_equal(check_plan(t), 1);
    while (status > 0) {
        status = triptych_step(t, 0);
        assert_true(status >= 0);
        const int now = check_plan(t);
        assert_in_range(now, number, 3);
        number = now;
        if (status == TRIPTYCH_STEP_WAITS)
            assert_int_equal(triptych_await(t, UINT64_MAX), TRIPTYCH_OK);
    }
    assert_int_equal(number, 3);
    triptych_end(t);
    triptych_destroy(t);
}

static void assert_levels(triptych *t, const draw_settings *s, const char *words)
{
    char *text = NULL;
    assert_int_equal(draw_settings_use(t, s), TRIPTYCH_OK);
    assert_int_equal(triptych_begin(t), TRIPTYCH_OK);
    assert_int_equal(triptych_explain(t, &text), TRIPTYCH_OK);
    assert_non_null(strstr(text, words));
    free(text);
    triptych_end(t);
}

static void the_plan_gives_the_reasons_for_the_levels(void **state)
{
    (void)state;
    triptych *t = open_at(TRIPTYCH_RENDERER_CPU, eyes[0]);
    draw_settings s = plain(4);
    assert_levels(t, &s, ": the coarsest with voxels at most 4 pixels wide\n");
    s.lod.voxel_px = 0.25;
    assert_levels(t, &s,
                  "do not run: level 0: coarser levels have voxels more than 0.25 pixels wide\n");
    s.lod.voxel_px = 0;
    s.lod.max_bytes = 100;
    assert_levels(t, &s, ": the coarsest level, with more bytes than the bound allows\n");
    triptych_destroy(t);
}

/* Distances and occlusion use one level in the whole frame, the finest that is needed anywhere. */
static void distances_and_effects_use_one_level(void **state)
{
    (void)state;
    triptych *t = open_at(TRIPTYCH_RENDERER_CPU, eyes[1]);
    draw_settings s = plain(4);
    assert_int_equal(draw_settings_use(t, &s), TRIPTYCH_OK);
    assert_int_equal(count_parts(t), 3);
    s.all.depth = 1;
    assert_int_equal(draw_settings_use(t, &s), TRIPTYCH_OK);
    assert_int_equal(count_parts(t), 1);
    s.all.depth = 0;
    s.effects.which = TRIPTYCH_EFFECT_OCCLUSION;
    s.light.no_shading = 0;
    assert_int_equal(draw_settings_use(t, &s), TRIPTYCH_OK);
    assert_int_equal(count_parts(t), 1);
    triptych_destroy(t);
}

/* A bound on bytes makes levels coarser, the nearest parts last. */
static void a_bound_on_bytes_makes_parts_coarser(void **state)
{
    (void)state;
    static float truth[FLOATS], bounded[FLOATS];
    triptych *t = open_at(TRIPTYCH_RENDERER_CPU, eyes[0]);
    draw_settings s = plain(0);
    const uint64_t of_fine = draw(t, &s, truth);
    uint64_t before = of_fine;
    for (double bytes = 1 << 20; bytes > 1 << 12; bytes /= 4) {
        s.lod.max_bytes = bytes;
        const uint64_t splats = draw(t, &s, bounded);
        assert_true(splats <= before);
        assert_near(bounded, truth, 0.5, 3);
        before = splats;
    }
    assert_true(before < of_fine / 100);
    triptych_destroy(t);
}

/* If the whole frame has one level, the bound applies to all bricks of this level, although the
 * nearest voxels are the widest. */
static void a_bound_on_bytes_applies_to_a_single_level(void **state)
{
    (void)state;
    static float picture[FLOATS];
    triptych *t = open_at(TRIPTYCH_RENDERER_CPU, eyes[1]);
    draw_settings s = plain(0);
    s.effects.which = TRIPTYCH_EFFECT_OCCLUSION;
    s.light.no_shading = 0;
    const uint64_t of_fine = draw(t, &s, picture);
    s.lod.max_bytes = 3.0 * 2 * NX * NY * NZ / 8;    /* level 1 in three lists */
    assert_true(draw(t, &s, picture) < of_fine / 4); /* wider bricks, more of them visible */
    assert_int_equal(count_parts(t), 1);
    triptych_destroy(t);
}

/* The grid is three voxels wide. Its level 2 is one voxel wide and has no cells, so that it is not
 * drawn. */
static void a_level_without_cells_is_not_drawn(void **state)
{
    (void)state;
    static float thin[FLOATS];
    assert_int_equal(brick_ramp(3), 0);
    triptych *t = open_at(TRIPTYCH_RENDERER_CPU, (double[]){ 10, 30, -500 });
    draw_settings s = plain(100);
    s.clip = (triptych_clip){ 0 };
    draw(t, &s, thin);
    float max = 0;
    for (int i = 3; i < FLOATS; i += 4)
        max = fmaxf(max, thin[i]);
    assert_true(max > 0.01F);
    triptych_destroy(t);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(parts_join_without_a_seam),
        cmocka_unit_test(the_background_is_added_after_the_last_part),
        cmocka_unit_test(drawing_in_steps_gives_the_same_bits),
        cmocka_unit_test(the_plan_explains_the_part_being_drawn),
        cmocka_unit_test(the_plan_gives_the_reasons_for_the_levels),
        cmocka_unit_test(distances_and_effects_use_one_level),
        cmocka_unit_test(a_bound_on_bytes_makes_parts_coarser),
        cmocka_unit_test(a_bound_on_bytes_applies_to_a_single_level),
        cmocka_unit_test(a_level_without_cells_is_not_drawn),
    };
    return cmocka_run_group_tests(tests, brick, remove_data);
}
