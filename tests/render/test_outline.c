#include "scenes.h"
#include "test.h"

#include "mean.h"
#include "outline.h"

enum { N = 64, ROD = 144, CODE = 40000 };

#define MIDDLE 31.5
#define RADIUS 24.0

static bool ball(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    (void)user, (void)gradient;
    double x = i - MIDDLE, y = j - MIDDLE, z = k - MIDDLE;
    *code = CODE;
    return x * x + y * y + z * z <= RADIUS * RADIUS;
}

static void make_ball(scene *s, double scale, unsigned tile, unsigned slab, double opacity)
{
    scene_create(s, &(scene_params){ .dims = { N, N, N },
                                     .index_to_world = { { { scale, 0, 0, 7 },
                                                           { 0, scale, 0, -3 },
                                                           { 0, 0, scale, 2 } } },
                                     .tile_voxels = tile,
                                     .slab_sheets = slab,
                                     .voxel = ball });
    scene_colour(s, CODE, CODE, 1, 1, 1, opacity);
}

static trip_outline *make(const scene *s, double min_extinction, unsigned slots)
{
    trip_outline *o;
    trip_outline_params p = {
        .data = s->data, .budget = s->budget, .table = s->table, .min_extinction = min_extinction
    };
    assert_int_equal(
        trip_reader_create(&p.reader, s->data, &(trip_reader_params){ .slots = slots }, s->budget),
        0);
    assert_int_equal(trip_outline_make(&o, &p), 0);
    trip_reader_destroy(p.reader);
    return o;
}

/* Computes how far the outline reaches along a world direction, in voxels from the centre. */
static double reach(const trip_outline *o, trip_vec3 along, double scale)
{
    const trip_reach_origin origin = { .index = { MIDDLE, MIDDLE, MIDDLE } };
    const trip_reach wanted[1] = { { .along = along } };
    double value[1];
    trip_outline_reach(o, &origin, wanted, 1, value);
    return value[0] / scale;
}

/* A ray at distance d from the centre of the ball crosses 2 sqrt(R^2 - d^2) of it. Its opacity is
 * TRIP_OUTLINE_OPACITY at d. A voxel at distance r is nearer to the centre on rays that are not
 * across. From all but one of the seven directions it is visible up to a distance between d and
 * 1.07 d. On a diagonal, three of the directions have a sine of 0.943; on an axis, two have 1. */
static void faint_objects_end_where_their_rays_are_too_faint_to_see(void **state)
{
    (void)state;
    const double wanted[] = { 12, 18, 22 }, scales[] = { 1, 1e-12, 1e12 };
    const trip_vec3 along[] = { { 1, 0, 0 }, { 0, -1, 0 }, { 0, 0, 1 }, { 0.6, 0, -0.8 } };
    for (int i = 0; i < 9; i++) {
        scene s;
        double d = wanted[i % 3], scale = scales[i / 3];
        double k = -log1p(-TRIP_OUTLINE_OPACITY) / (2 * sqrt(RADIUS * RADIUS - d * d));
        make_ball(&s, scale, 32, 8, -expm1(-k));
        trip_outline *o = make(&s, 0, 4);
        assert_non_null(o);
        assert_true(trip_outline_splats(o) == s.data->lists[2].records);
        for (int n = 0; n < 4; n++) {
            const double got = reach(o, along[n], scale);
            assert_true(got >= d - 1 && got <= 1.07 * d + 0.7);
        }
        trip_outline_destroy(o);
        scene_destroy(&s);
    }
}

/* The farthest point of a ball of radius R along a vector v is at R |v|. The farthest voxel may be
 * half a voxel nearer. */
static void dense_objects_reach_to_their_surface(void **state)
{
    (void)state;
    scene s;
    make_ball(&s, 2, 64, 8, 0.5);
    trip_outline *o = make(&s, 0, 4);
    assert_non_null(o);
    for (int n = 0; n < 100; n++) {
        const trip_vec3 v = trip_v3(test_random() - 0.5, test_random() - 0.5, test_random() - 0.5);
        const double got = reach(o, v, 2), length = trip_length(v);
        assert_true(got >= (RADIUS - 0.5) * length && got <= RADIUS * length);
    }
    trip_outline_destroy(o);
    scene_destroy(&s);
}

/* A ball within a haze that fills the grid: no ray through the haze alone is visible. */
static bool ball_in_haze(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    *code = CODE;
    if (!ball(user, i, j, k, code, gradient))
        *code = 1;
    return true;
}

static void haze_around_an_object_does_not_count(void **state)
{
    (void)state;
    scene s;
    scene_create(&s, &(scene_params){ .dims = { N, N, N }, .voxel = ball_in_haze });
    scene_colour(&s, CODE, CODE, 1, 1, 1, 0.5);
    scene_colour(&s, 1, 1, 1, 1, 1, 1e-5);
    trip_outline *o = make(&s, 1e-4, 4);
    assert_close(reach(o, trip_v3(1, 0, 0), 1), RADIUS - 0.25, 0.5);
    assert_close(reach(o, trip_v3(0, 0, -1), 1), RADIUS - 0.25, 0.5);
    trip_outline_destroy(o);
    scene_destroy(&s);
}

static void outlines_are_the_same_for_any_tiles_and_slots(void **state)
{
    (void)state;
    const unsigned tiles[][2] = { { 16, 4 }, { 64, 8 }, { 128, 1 } };
    double first[3], got[3];
    for (int i = 0; i < 3; i++) {
        scene s;
        make_ball(&s, 1, tiles[i][0], tiles[i][1], 8e-4);
        trip_outline *o = make(&s, 0, i == 1 ? 2 : 8);
        got[0] = reach(o, trip_v3(1, 0.2, 0.3), 1);
        got[1] = reach(o, trip_v3(-0.1, 0.7, 0), 1);
        got[2] = reach(o, trip_v3(0, -0.5, -2), 1);
        if (i == 0)
            memcpy(first, got, sizeof got);
        assert_memory_equal(first, got, sizeof got);
        trip_outline_destroy(o);
        scene_destroy(&s);
    }
}

/* Voxels 10 to 133 along x at the finest level, and 2 * 20 to 2 * 59 + 1 at the next level. */
static bool rod(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    (void)user, (void)j, (void)k, (void)gradient;
    *code = CODE;
    return i >= 10 && i < 134;
}

static bool coarse_rod(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    (void)j, (void)k, (void)gradient;
    *code = trip_mean_pack(user, CODE, 1, 1);
    return i >= 20 && i < 60;
}

static void make_rod(scene *s, bool coarse)
{
    trip_mean_scale scale = { 0, 65535 };
    const scene_part part = { 1, TRIP_KIND_MEANS, { 2, 2, 2 }, coarse_rod, &scale, NULL };
    scene_create(s, &(scene_params){ .dims = { ROD, 8, 8 },
                                     .tile_voxels = 64,
                                     .slab_sheets = 8,
                                     .voxel = rod,
                                     .parts = &part,
                                     .part_count = coarse ? 1 : 0 });
    scene_colour(s, 30000, 50000, 1, 1, 1, 0.5);
}

static void a_coarse_level_of_large_data_sets_is_read(void **state)
{
    (void)state;
    scene s;
    const trip_reach_origin origin = { .index = { 0, 3.5, 3.5 } };
    const trip_reach wanted[2] = { { .along = { 1, 0, 0 } }, { .along = { -1, 0, 0 } } };
    double got[2];
    make_rod(&s, true);
    trip_outline *o = make(&s, 0, 2);
    assert_non_null(o);
    assert_int_equal(trip_outline_splats(o), 40 * 4 * 4);
    trip_outline_reach(o, &origin, wanted, 2, got);
    assert_close(got[0], 2 * 59 + 0.5, 1e-9);
    assert_close(got[1], -(2 * 20 + 0.5), 1e-9);
    trip_outline_destroy(o);
    scene_destroy(&s);
}

static void without_the_level_or_visible_voxels_there_is_no_outline(void **state)
{
    (void)state;
    scene s;
    make_rod(&s, false);
    assert_null(make(&s, 0, 2));
    scene_destroy(&s);
    make_ball(&s, 1, 64, 8, 1e-5);
    assert_null(make(&s, 0, 4));
    scene_destroy(&s);
    make_ball(&s, 1, 64, 8, 0.5);
    assert_null(make(&s, 1, 4)); /* -ln(1 - 0.5) is below 1 */
    scene_destroy(&s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(faint_objects_end_where_their_rays_are_too_faint_to_see),
        cmocka_unit_test(dense_objects_reach_to_their_surface),
        cmocka_unit_test(haze_around_an_object_does_not_count),
        cmocka_unit_test(outlines_are_the_same_for_any_tiles_and_slots),
        cmocka_unit_test(a_coarse_level_of_large_data_sets_is_read),
        cmocka_unit_test(without_the_level_or_visible_voxels_there_is_no_outline),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
