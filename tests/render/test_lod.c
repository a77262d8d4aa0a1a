/* Levels chosen by the width of their voxels. Each position is drawn once. A body of one value
 * looks the same at every level and where levels meet. Pictures do not depend on the size of
 * tiles. */
#include "scenes.h"

#include "test.h"

#include <string.h>

#include "dataset_level.h"
#include "lod_parts.h"
#include "mean.h"
#include "shade.h"

enum { NX = 192, NY = 128, NZ = 64, SIZE_PX = 40, LEVELS = 3 };

static bool all(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    (void)user;
    (void)gradient;
    (void)i;
    (void)j;
    (void)k;
    *code = 65535;
    return true;
}

/* Creates fog of one value with its levels. */
static void create(scene *s, unsigned tile, double opacity)
{
    const scene_part parts[LEVELS] = {
        { .level = 1, .kind = TRIP_KIND_MEANS, .by = { 2, 2, 2 }, .voxel = all },
        { .level = 2, .kind = TRIP_KIND_MEANS, .by = { 4, 4, 4 }, .voxel = all },
        { .level = 3, .kind = TRIP_KIND_MEANS, .by = { 8, 8, 8 }, .voxel = all },
    };
    scene_create(s, &(scene_params){ .dims = { NX, NY, NZ },
                                     .tile_voxels = tile,
                                     .slab_sheets = 8,
                                     .voxel = all,
                                     .parts = parts,
                                     .part_count = LEVELS });
    scene_colour(s, 65535, 65535, 1, 0.5, 0.25, opacity);
}

static trip_settings settings_at(double px)
{
    trip_settings s = trip_settings_default();
    s.background[3] = 0;
    s.shading = false;
    s.lod_px = px;
    return s;
}

static const scene_renderer *renderer_named(const char *name)
{
    const scene_renderer *r = scene_renderers();
    while (r->name && strcmp(r->name, name))
        r++;
    return r->name ? r : NULL;
}

static void levels_are_the_coarsest_that_are_narrow_enough(void **state)
{
    (void)state;
    assert_int_equal(trip_lod_level(0.5, 1, 5), 1);
    assert_int_equal(trip_lod_level(0.51, 1, 5), 0);
    assert_int_equal(trip_lod_level(0.124, 1, 5), 3);
    assert_int_equal(trip_lod_level(0.001, 1, 5), 5);
    assert_int_equal(trip_lod_level(HUGE_VAL, 1000, 5), 0);
}

/* At a field of view of 2 atan(1/2), a voxel at distance d is SIZE_PX / d pixels wide. */
static void width_is_that_of_similar_triangles(void **state)
{
    (void)state;
    trip_camera c;
    const trip_affine unit = trip_affine_identity();
    trip_camera_params view = { .eye = { 0, 0, 100 },
                                .up = { 0, 1, 0 },
                                .fov_degrees = 2 * atan(0.5) * 180 / M_PI,
                                .width = SIZE_PX,
                                .height = SIZE_PX };
    assert_int_equal(trip_camera_make(&c, &view, &unit), 0);
    double depth = trip_dot(c.forward, trip_sub(trip_v3(0, 0, 0), c.eye));
    assert_float_equal(trip_lod_width_px(&c, depth), SIZE_PX / 100.0, 1e-9);
    assert_float_equal(trip_lod_width_px(&c, 2 * depth), SIZE_PX / 200.0, 1e-9);
    view.ortho_height = 80;
    assert_int_equal(trip_camera_make(&c, &view, &unit), 0);
    assert_float_equal(trip_lod_width_px(&c, depth), SIZE_PX / 80.0, 1e-9);
    const trip_affine uneven = { { { 1, 0, 0, 0 }, { 0, 3, 0, 0 }, { 0, 0, 2, 0 } } };
    assert_int_equal(trip_camera_make(&c, &view, &uneven), 0);
    assert_float_equal(trip_lod_width_px(&c, depth), 3 * SIZE_PX / 80.0, 1e-9);
}

static trip_lod make_lod(const scene *s, const trip_camera_params *view,
                         const trip_settings *settings, trip_camera *c)
{
    trip_lod lod;
    assert_int_equal(trip_camera_make(c, view, &s->data->index_to_world), 0);
    assert_int_equal(trip_lod_make(&lod, s->data, TRIP_KIND_MEANS, c, settings, s->budget), 0);
    return lod;
}

/* The face that is turned to the eye lies half a voxel before the voxel's centre. */
static void cubes_are_as_wide_as_their_nearest_voxels(void **state)
{
    (void)state;
    scene s;
    trip_camera c;
    create(&s, 64, 0.01);
    trip_camera_params view = { .up = { 0, 1, 0 },
                                .fov_degrees = 2 * atan(0.5) * 180 / M_PI,
                                .width = SIZE_PX,
                                .height = SIZE_PX };
    const trip_settings settings = settings_at(0.7);
    for (int side = 0; side < 2; side++) {
        view.eye = trip_v3(side ? 300 : -100, 0, 0);
        trip_lod lod = make_lod(&s, &view, &settings, &c);
        assert_int_equal(lod.cube_log2, 6);
        for (int64_t i = 0; i < 3; i++) {
            const int64_t cube[3] = { i, 1, 0 };
            const double depth = side ? 300 - (64 * (double)i + 63.5) : 100 + 64 * (double)i - 0.5;
            assert_float_equal(trip_lod_cube_width(&lod, s.data, &c, cube), SIZE_PX / depth, 1e-9);
        }
        trip_lod_release(&lod, s.budget);
    }
    scene_destroy(&s);
}

static trip_camera_params view_along(const scene *s)
{
    return scene_view(s, trip_v3(1, 0.3, 0.2), 260, 40, SIZE_PX);
}

/* Returns true if the voxel is drawn. The answer must be the same for every list, by square and by
 * single voxel. */
static bool is_drawn(const trip_lod *lod, const trip_list *list, const int64_t voxel[3])
{
    int64_t sheet = voxel[list->axis] >> list->level;
    int64_t u = voxel[(list->axis + 1) % 3] >> list->level;
    int64_t v = voxel[(list->axis + 2) % 3] >> list->level;
    unsigned number = (unsigned)trip_morton((uint32_t)(u & 7), (uint32_t)(v & 7));
    bool drawn = trip_lod_has(lod, list, sheet, u, v);
    assert_int_equal(trip_lod_square(lod, list, sheet, u & ~7, v & ~7) >> number & 1, drawn);
    return drawn;
}

static void each_position_is_drawn_at_one_level(void **state)
{
    (void)state;
    scene s;
    trip_camera c;
    trip_lod lod;
    uint64_t counts[LEVELS + 1] = { 0 };
    create(&s, 64, 0.01);
    const trip_camera_params view = view_along(&s);
    const trip_settings settings = settings_at(0.7);
    assert_int_equal(trip_camera_make(&c, &view, &s.data->index_to_world), 0);
    assert_int_equal(trip_lod_make(&lod, s.data, TRIP_KIND_MEANS, &c, &settings, s.budget), 0);
    assert_int_equal(lod.levels, LEVELS);
    for (int64_t i = 0; i < (int64_t)NX * NY * NZ; i += 37) {
        const int64_t voxel[3] = { i % NX, i / NX % NY, i / NX / NY };
        int drawn[3] = { 0 };
        for (unsigned l = 0; l < s.data->list_count; l++) {
            const trip_list *list = &s.data->lists[l];
            assert_true(trip_lod_concerns(&lod, list));
            bool here = is_drawn(&lod, list, voxel);
            drawn[list->axis] += here;
            counts[list->level] += here;
        }
        assert_true(drawn[0] == 1 && drawn[1] == 1 && drawn[2] == 1);
    }
    assert_true((counts[0] > 0) + (counts[1] > 0) + (counts[2] > 0) + (counts[3] > 0) >= 2);
    trip_lod_release(&lod, s.budget);
    scene_destroy(&s);
}

/* Widths are in pixels of the picture, even if more samples per pixel are drawn. */
static void levels_do_not_depend_on_samples(void **state)
{
    (void)state;
    scene s;
    trip_camera c;
    trip_lod lods[2];
    create(&s, 64, 0.01);
    for (int i = 0; i < 2; i++) {
        trip_settings settings = settings_at(0.7);
        trip_camera_params view = view_along(&s);
        settings.samples = i + 1;
        view.width *= i + 1;
        view.height *= i + 1;
        lods[i] = make_lod(&s, &view, &settings, &c);
    }
    assert_true(lods[0].chosen & (lods[0].chosen - 1)); /* several levels */
    assert_memory_equal(lods[0].level, lods[1].level, lods[0].bytes);
    for (int i = 0; i < 2; i++)
        trip_lod_release(&lods[i], s.budget);
    scene_destroy(&s);
}

/* Coarse levels of large grids have cubes that are a few voxels wide. */
static void squares_have_the_voxels_of_cubes_smaller_than_they_are(void **state)
{
    (void)state;
    enum { ACROSS = 4, DOWN = 5, DEEP = 3, LEVEL = 5 };
    uint8_t level[ACROSS * DOWN * DEEP];
    const trip_lod lod = { .kind = TRIP_KIND_MEANS,
                           .levels = 6,
                           .cube_log2 = 6,
                           .cubes = { ACROSS, DOWN, DEEP },
                           .level = level };
    for (int i = 0; i < ACROSS * DOWN * DEEP; i++)
        level[i] = scene_hash(i, 0, 0) % 3 ? LEVEL : LEVEL + 1;
    for (int axis = 0; axis < 3; axis++) {
        const trip_list list = { .axis = axis,
                                 .level = LEVEL,
                                 .dims = { 2 * ACROSS - 1, 2 * DOWN, 2 * DEEP } };
        const int64_t across = list.dims[(axis + 1) % 3], down = list.dims[(axis + 2) % 3];
        for (int64_t v = 0; v < down; v += 8)
            for (int64_t u = 0; u < across; u += 8) {
                uint64_t expected = 0;
                for (int64_t n = 0; n < 64; n++)
                    if (u + n % 8 < across && v + n / 8 < down &&
                        trip_lod_has(&lod, &list, 1, u + n % 8, v + n / 8))
                        expected |= UINT64_C(1) << trip_morton((uint32_t)n % 8, (uint32_t)n / 8);
                assert_int_equal(trip_lod_square(&lod, &list, 1, u, v), expected);
            }
    }
}

/* 64 voxels of one extinction, seen along z by parallel rays. */
static void fog_is_as_thick_at_every_level(void **state)
{
    (void)state;
    scene s;
    create(&s, 64, 0.02);
    trip_camera_params view = scene_view(&s, trip_v3(0, 0, 1), 300, 40, SIZE_PX);
    view.ortho_height = 60; /* a voxel is 2/3 of a pixel wide */
    for (const scene_renderer *r = scene_renderers(); r->name; r++) {
        for (double px = 0; px < 12; px = 2 * px + 0.7) { /* 0, 0.7, 2.1, 4.9: 0, 0, 1, 2 and 3 */
            const trip_settings settings = settings_at(px);
            scene_picture p = scene_draw(&s, r, &view, &settings);
            float alpha = scene_pixel(&p, SIZE_PX / 2, SIZE_PX / 2)[3];
            if (!(fabs((double)alpha - (1 - pow(0.98, NZ))) < 4e-3))
                fail_msg("%s, %g px: %g", r->name, px, (double)alpha);
            scene_picture_free(&p);
        }
    }
    scene_destroy(&s);
}

/* Cells of several levels in one picture must look like the finest level alone, within a bound.
 * The wider kernels beyond a border need the bound, which does not grow with the number of splats.
 */
static void no_seam_shows_where_levels_meet(void **state)
{
    (void)state;
    scene s;
    create(&s, 64, 0.03);
    const scene_renderer *cpu = renderer_named("cpu");
    const trip_camera_params view = view_along(&s);
    const trip_settings finest = settings_at(0), mixed = settings_at(0.7);
    scene_picture a = scene_draw(&s, cpu, &view, &finest), b = scene_draw(&s, cpu, &view, &mixed);
    assert_true(b.stats.all.splats_read < a.stats.all.splats_read / 2);
    double max = 0, sum = 0;
    int inside = 0;
    for (int i = 0; i < SIZE_PX * SIZE_PX; i++) {
        double off = fabs((double)a.rgba[4 * i + 3] - (double)b.rgba[4 * i + 3]);
        if (a.rgba[4 * i + 3] < 0.5f)
            continue;
        max = fmax(max, off);
        sum += off;
        inside++;
    }
    assert_true(inside > 200);
    if (!(max < 0.1 && sum / inside < 4e-3))
        fail_msg("off by %g, by %g in the mean", max, sum / inside);
    scene_picture_free(&a);
    scene_picture_free(&b);
    scene_destroy(&s);
}

static void renderers_agree_on_mixed_levels(void **state)
{
    (void)state;
    scene s;
    create(&s, 64, 0.03);
    const trip_camera_params view = view_along(&s);
    const trip_settings mixed = settings_at(2);
    scene_picture expected = scene_draw(&s, renderer_named("reference"), &view, &mixed);
    for (const scene_renderer *r = scene_renderers(); r->name; r++) {
        scene_picture p = scene_draw(&s, r, &view, &mixed);
        double off = scene_difference(&expected, &p);
        if (!(off <= r->tolerance))
            fail_msg("%s: off by %g", r->name, off);
        scene_picture_free(&p);
    }
    scene_picture_free(&expected);
    scene_destroy(&s);
}

static void tiles_make_no_difference(void **state)
{
    (void)state;
    scene_picture p[2];
    for (int i = 0; i < 2; i++) {
        scene s;
        create(&s, i ? 16 : 128, 0.03);
        const trip_camera_params view = view_along(&s);
        const trip_settings mixed = settings_at(0.7);
        p[i] = scene_draw(&s, renderer_named("cpu"), &view, &mixed);
        scene_destroy(&s);
    }
    assert_true(scene_difference(&p[0], &p[1]) == 0);
    scene_picture_free(&p[0]);
    scene_picture_free(&p[1]);
}

/* `post` draws one level, between the outermost voxel centres. */
static void interpolated_fog_is_as_thick_at_a_coarse_level(void **state)
{
    (void)state;
    scene s, at;
    const scene_part part = {
        .level = 1, .kind = TRIP_KIND_VALUES, .by = { 2, 2, 2 }, .voxel = all
    };
    scene_create(&s, &(scene_params){ .dims = { 64, 64, NZ },
                                      .tile_voxels = 64,
                                      .slab_sheets = 8,
                                      .voxel = all,
                                      .parts = &part,
                                      .part_count = 1 });
    scene_colour(&s, 0, 65535, 1, 0.5, 0.25, 0.02);
    trip_camera_params view = scene_view(&s, trip_v3(0, 0, 1), 300, 40, SIZE_PX);
    view.ortho_height = 60;
    trip_settings settings = settings_at(2);
    settings.classify = TRIP_CLASSIFY_POST;
    trip_camera c;
    assert_int_equal(trip_camera_make(&c, &view, &s.data->index_to_world), 0);
    assert_int_equal(trip_dataset_levels(s.data, TRIP_KIND_VALUES), 1);
    trip_lod_parts parts;
    assert_int_equal(trip_lod_parts_make(&parts, s.data, &c, &settings, true, s.budget), 0);
    assert_int_equal(parts.count, 1);
    assert_int_equal(parts.level[0], 1);
    at = s;
    assert_int_equal(trip_dataset_level_open(&at.data, s.data, 1), 0);
    assert_int_equal(at.data->header.dims[2], NZ / 2);
    for (const scene_renderer *r = scene_renderers_post(); r->name; r++) {
        scene_picture fine = scene_draw(&s, r, &view, &settings);
        scene_picture coarse = scene_draw(&at, r, &view, &settings);
        float a = scene_pixel(&fine, SIZE_PX / 2, SIZE_PX / 2)[3];
        float b = scene_pixel(&coarse, SIZE_PX / 2, SIZE_PX / 2)[3];
        assert_float_equal(a, 1 - pow(0.98, NZ - 1), 1e-3);
        assert_float_equal(b, 1 - pow(0.98, NZ - 2), 1e-3);
        scene_picture_free(&fine);
        scene_picture_free(&coarse);
    }
    trip_dataset_level_close(at.data);
    scene_destroy(&s);
}

/* The rise of values along z per voxel, as a share of their range: half of the gradient at which
 * shading is full. */
#define RISE (0.5 * TRIP_GRADIENT_FULL)

static bool rising(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    const unsigned *level = user;
    const double edge = ldexp(1, (int)*level);
    (void)gradient;
    (void)i;
    (void)j;
    *code = (unsigned)(65535 * RISE * (edge * k + 0.5 * (edge - 1)) + 0.5);
    return true;
}

/* A surface that faces the light has a highlight that depends on its steepness. Steepness is the
 * same at every level. */
static void shading_is_as_strong_at_a_coarse_level(void **state)
{
    (void)state;
    enum { SHEETS = 32 };
    unsigned levels[2] = { 0, 1 };
    scene s, at;
    const scene_part part = {
        .level = 1, .kind = TRIP_KIND_VALUES, .by = { 2, 2, 2 }, .voxel = rising, .user = &levels[1]
    };
    scene_create(&s, &(scene_params){ .dims = { 64, 64, SHEETS },
                                      .voxel = rising,
                                      .user = &levels[0],
                                      .parts = &part,
                                      .part_count = 1 });
    scene_colour(&s, 0, 65535, 0.5, 0.5, 0.5, 0.9);
    trip_camera_params view = scene_view(&s, trip_v3(0, 0, 1), 300, 40, SIZE_PX);
    view.ortho_height = 60;
    trip_settings settings = settings_at(0);
    settings.classify = TRIP_CLASSIFY_POST;
    settings.shading = true;
    settings.headlight = true;
    at = s;
    at.level = 1;
    assert_int_equal(trip_dataset_level_open(&at.data, s.data, 1), 0);
    for (const scene_renderer *r = scene_renderers_post(); r->name; r++)
        for (int level = 0; level < 2; level++) {
            scene_picture p = scene_draw(level ? &at : &s, r, &view, &settings);
            const float *pixel = scene_pixel(&p, SIZE_PX / 2, SIZE_PX / 2);
            assert_float_equal(pixel[0], 0.5 + 0.5 * TRIP_SPECULAR, 2e-3);
            scene_picture_free(&p);
        }
    trip_dataset_level_close(at.data);
    scene_destroy(&s);
}

static bool is_chosen(const trip_lod *lod, unsigned level)
{
    for (size_t i = 0; i < lod->bytes; i++)
        if (lod->level[i] == level)
            return true;
    return false;
}

/* A mean code that covers one half shows one half. Thin parts show as much as was kept. Lists of
 * levels without cubes need no table. */
static void check_tables(const scene *s, const trip_plan *plan, bool seen[LEVELS + 1])
{
    const trip_mean_scale scale = { 0, 65535 };
    const unsigned code = trip_mean_pack(&scale, 65535, 0.5, 0.75);
    for (unsigned i = 0; i < s->data->list_count; i++) {
        const trip_list *list = &s->data->lists[i];
        const double length = (double)(1u << list->level), k = -log(0.5);
        if (!plan->lists[i].drawn)
            continue;
        const bool own = list->level > 0 && is_chosen(&plan->lod, list->level);
        assert_int_equal(plan->lists[i].table != s->table, own);
        if (!own)
            continue;
        double depth = (double)plan->lists[i].table[code].extinction * length;
        assert_float_equal(1 - exp(-depth), 0.5 * (1 - exp(-k * 0.75 * length)), 1e-6);
        assert_float_equal(plan->lists[i].table[code].r, 1, 0);
        seen[list->level] = true;
    }
}

static void tables_of_means_have_their_opacity(void **state)
{
    (void)state;
    scene s;
    trip_camera c;
    bool seen[LEVELS + 1] = { true };
    create(&s, 64, 0.5);
    const trip_camera_params view = view_along(&s);
    assert_int_equal(trip_camera_make(&c, &view, &s.data->index_to_world), 0);
    for (double px = 0.7; px < 100; px *= 3) {
        trip_plan plan;
        const trip_settings settings = settings_at(px);
        assert_int_equal(trip_plan_make(&plan, s.data, &c, &settings, s.table, s.budget), 0);
        check_tables(&s, &plan, seen);
        trip_plan_release(&plan, s.budget);
    }
    for (unsigned level = 0; level <= LEVELS; level++)
        assert_true(seen[level]);
    scene_destroy(&s);
}

/* The three axes share one table, because their cubes have equal length. The next frame uses the
 * same table. */
static void tables_are_kept_by_the_caller(void **state)
{
    (void)state;
    scene s;
    trip_camera c;
    trip_plan plan, alone;
    trip_classification known = { 0 };
    trip_mean_tables kept = { 0 };
    create(&s, 64, 0.5);
    const trip_camera_params view = view_along(&s);
    assert_int_equal(trip_camera_make(&c, &view, &s.data->index_to_world), 0);
    const trip_settings settings = settings_at(100);
    unsigned count = 0;
    for (int frame = 0; frame < 2; frame++) {
        assert_int_equal(
            trip_plan_make_next(&plan, s.data, &c, &settings, s.table, &known, &kept, s.budget), 0);
        assert_int_equal(trip_plan_make(&alone, s.data, &c, &settings, s.table, s.budget), 0);
        assert_true(kept.count > 0 && kept.count <= LEVELS);
        assert_true(frame == 0 || kept.count == count);
        count = kept.count;
        for (unsigned i = 0; i < s.data->list_count; i++)
            if (plan.lists[i].drawn)
                assert_memory_equal(plan.lists[i].table, alone.lists[i].table,
                                    65536 * sizeof(trip_tf_entry));
        trip_plan_release(&plan, s.budget);
        trip_plan_release(&alone, s.budget);
    }
    trip_mean_tables_release(&kept, s.budget);
    assert_int_equal(trip_mean_tables_bytes(&kept), 0);
    scene_destroy(&s);
}

/* Returns the bytes of dense fog with 2-byte codes in up to three lists. Each level has an eighth
 * of the voxels. */
static double bytes_of(const trip_lod *lod, const scene *s, int lists)
{
    double bytes = 0;
    int64_t cube[3];
    for (cube[2] = 0; cube[2] < lod->cubes[2]; cube[2]++)
        for (cube[1] = 0; cube[1] < lod->cubes[1]; cube[1]++)
            for (cube[0] = 0; cube[0] < lod->cubes[0]; cube[0]++) {
                double voxels = 1;
                for (int a = 0; a < 3; a++)
                    voxels *=
                        fmin(ldexp(1, lod->cube_log2), (double)s->data->header.dims[a] -
                                                           ldexp((double)cube[a], lod->cube_log2));
                bytes += lists * 2 * ldexp(voxels, -3 * (int)trip_lod_at(lod, cube));
            }
    return bytes;
}

static trip_lod bounded(scene *s, double max_bytes)
{
    trip_lod lod;
    trip_camera c;
    trip_settings settings = settings_at(0);
    const trip_camera_params view = view_along(s);
    settings.method = TRIP_METHOD_AXIS;
    settings.max_bytes = max_bytes;
    assert_int_equal(trip_camera_make(&c, &view, &s->data->index_to_world), 0);
    assert_int_equal(trip_lod_make(&lod, s->data, TRIP_KIND_MEANS, &c, &settings, s->budget), 0);
    return lod;
}

static void bounds_hold_and_the_nearest_cubes_are_finest(void **state)
{
    (void)state;
    scene s;
    const double full = 2.0 * NX * NY * NZ;
    bool mixed = false;
    create(&s, 64, 0.01);
    assert_int_equal(s.data->header.code_bytes, 2);
    for (double part = 2; part > 1.0 / 512; part /= 1.5) {
        trip_lod lod = bounded(&s, part * full);
        const int64_t far_cube[3] = { 0, 0, 0 }, near_cube[3] = { 1, 0, 0 };
        const unsigned farther = trip_lod_at(&lod, far_cube), nearer = trip_lod_at(&lod, near_cube);
        const double bytes = bytes_of(&lod, &s, 1);
        assert_float_equal(lod.limit.bytes, bytes, 1e-6 * full);
        assert_float_equal(lod.limit.full_bytes, full, 1e-6 * full);
        assert_true(bytes <= part * full);
        assert_true(nearer <= farther && farther - nearer <= 1);
        assert_true((lod.limit.px > 0) == (part < 1));
        mixed |= nearer < farther;
        trip_lod_release(&lod, s.budget);
    }
    assert_true(mixed);
    trip_lod all_coarse = bounded(&s, 1);
    assert_float_equal(bytes_of(&all_coarse, &s, 1), ldexp(full, -9), 1);
    trip_lod_release(&all_coarse, s.budget);
    scene_destroy(&s);
}

/* The size of tiles, 16 or 128 voxels, must not matter. */
static void tiles_make_no_difference_to_bounds(void **state)
{
    (void)state;
    scene_picture p[2];
    for (int i = 0; i < 2; i++) {
        scene s;
        create(&s, i ? 16 : 128, 0.03);
        const trip_camera_params view = view_along(&s);
        trip_settings settings = settings_at(0);
        settings.max_bytes = 1.0 * NX * NY * NZ;
        p[i] = scene_draw(&s, renderer_named("cpu"), &view, &settings);
        assert_true(p[i].stats.all.splats_read < (uint64_t)NX * NY * NZ);
        scene_destroy(&s);
    }
    assert_true(scene_difference(&p[0], &p[1]) == 0);
    scene_picture_free(&p[0]);
    scene_picture_free(&p[1]);
}

static void values_of_a_level_are_an_eighth(void **state)
{
    (void)state;
    scene s;
    trip_camera c;
    const scene_part part = {
        .level = 1, .kind = TRIP_KIND_VALUES, .by = { 2, 2, 2 }, .voxel = all
    };
    scene_create(&s, &(scene_params){ .dims = { 64, 64, NZ },
                                      .tile_voxels = 64,
                                      .slab_sheets = 8,
                                      .voxel = all,
                                      .parts = &part,
                                      .part_count = 1 });
    trip_settings settings = settings_at(0);
    settings.classify = TRIP_CLASSIFY_POST;
    settings.method = TRIP_METHOD_AXIS;
    const trip_camera_params view = scene_view(&s, trip_v3(0, 0, 1), 300, 40, SIZE_PX);
    assert_int_equal(trip_camera_make(&c, &view, &s.data->index_to_world), 0);
    trip_lod_parts parts;
    settings.max_bytes = 2.0 * 64 * 64 * NZ;
    assert_int_equal(trip_lod_parts_make(&parts, s.data, &c, &settings, true, s.budget), 0);
    assert_int_equal(parts.level[0], 0);
    settings.max_bytes -= 1;
    assert_int_equal(trip_lod_parts_make(&parts, s.data, &c, &settings, true, s.budget), 0);
    assert_int_equal(parts.level[0], 1);
    assert_true(parts.bounded);
    assert_float_equal(parts.bytes, 2.0 * 32 * 32 * NZ / 2, 1);
    scene_destroy(&s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(levels_are_the_coarsest_that_are_narrow_enough),
        cmocka_unit_test(width_is_that_of_similar_triangles),
        cmocka_unit_test(cubes_are_as_wide_as_their_nearest_voxels),
        cmocka_unit_test(levels_do_not_depend_on_samples),
        cmocka_unit_test(squares_have_the_voxels_of_cubes_smaller_than_they_are),
        cmocka_unit_test(each_position_is_drawn_at_one_level),
        cmocka_unit_test(fog_is_as_thick_at_every_level),
        cmocka_unit_test(no_seam_shows_where_levels_meet),
        cmocka_unit_test(renderers_agree_on_mixed_levels),
        cmocka_unit_test(tiles_make_no_difference),
        cmocka_unit_test(interpolated_fog_is_as_thick_at_a_coarse_level),
        cmocka_unit_test(shading_is_as_strong_at_a_coarse_level),
        cmocka_unit_test(tables_of_means_have_their_opacity),
        cmocka_unit_test(tables_are_kept_by_the_caller),
        cmocka_unit_test(bounds_hold_and_the_nearest_cubes_are_finest),
        cmocka_unit_test(tiles_make_no_difference_to_bounds),
        cmocka_unit_test(values_of_a_level_are_an_eighth),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
