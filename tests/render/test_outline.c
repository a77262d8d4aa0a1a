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

static trip_outline *make(const scene *s, const trip_camera_params *view, double half,
                          unsigned slots)
{
    trip_outline *o;
    trip_outline_params p = { .data = s->data,
                              .budget = s->budget,
                              .table = s->table,
                              .lo = { MIDDLE - half, MIDDLE - half, MIDDLE - half },
                              .hi = { MIDDLE + half, MIDDLE + half, MIDDLE + half },
                              .view = view };
    assert_int_equal(
        trip_reader_create(&p.reader, s->data, &(trip_reader_params){ .slots = slots }, s->budget),
        0);
    assert_int_equal(trip_outline_make(&o, &p), 0);
    trip_reader_destroy(p.reader);
    return o;
}

/* Computes how far the outline reaches to the right and up, in voxels from the centre. If `cone`
 * is not zero, it also computes the reach within cones with this tangent. */
static void reaches(const trip_outline *o, const trip_camera_params *view, double scale,
                    double cone, double values[2])
{
    const trip_reach_origin origin = { .index = { MIDDLE, MIDDLE, MIDDLE } };
    trip_vec3 view_direction = trip_normalize(trip_sub(view->look, view->eye));
    trip_vec3 right = trip_normalize(trip_cross(view_direction, view->up)),
              up = trip_cross(right, view_direction);
    trip_vec3 nearer = trip_scale(view_direction, -cone);
    const trip_reach wanted[2] = { { .along = trip_add(right, nearer) },
                                   { .along = trip_sub(nearer, up) } };
    trip_outline_reach(o, &origin, wanted, 2, values);
    for (int i = 0; i < 2; i++)
        values[i] /= scale;
}

/* A ray that passes the centre of the ball at distance d crosses 2 sqrt(R^2 - d^2) of it. The ball
 * ends where the opacity of this path is TRIP_OUTLINE_OPACITY. */
static void faint_objects_end_where_their_rays_are_too_faint_to_see(void **state)
{
    (void)state;
    const double wanted[] = { 12, 18, 23 }, scales[] = { 1, 1e-12, 1e12 };
    for (int i = 0; i < 9; i++) {
        scene s;
        double d = wanted[i % 3], scale = scales[i / 3], got[2];
        double k = -log1p(-TRIP_OUTLINE_OPACITY) / (2 * sqrt(RADIUS * RADIUS - d * d));
        make_ball(&s, scale, 32, 8, -expm1(-k));
        trip_camera_params view = scene_view(&s, trip_v3(0.4, -1, 0.3), 100 * scale, 20, N);
        view.ortho_height = 64 * scale;
        trip_outline *o = make(&s, &view, 30, 4);
        assert_non_null(o);
        assert_true(trip_outline_splats(o) == s.data->lists[2].records);
        reaches(o, &view, scale, 0, got);
        assert_close(got[0], d, 1);
        assert_close(got[1], d, 1);
        trip_outline_destroy(o);
        scene_destroy(&s);
    }
}

/* The farthest point of a ball of radius R along a vector v is at R |v|. This holds from every
 * distance, although the outline was seen from one. */
static void dense_objects_reach_as_far_from_other_distances(void **state)
{
    (void)state;
    scene s;
    make_ball(&s, 2, 64, 8, 0.5);
    trip_camera_params view = scene_view(&s, trip_v3(0.4, -1, 0.3), 300, 40, N);
    trip_outline *o = make(&s, &view, 24, 4);
    assert_non_null(o);
    for (double cone = 0; cone < 0.5; cone += 0.1) {
        double got[2];
        reaches(o, &view, 2, cone, got);
        assert_close(got[0], RADIUS * hypot(1, cone), 1);
        assert_close(got[1], RADIUS * hypot(1, cone), 1);
    }
    trip_outline_destroy(o);
    scene_destroy(&s);
}

static void outlines_are_the_same_for_any_tiles_and_slots(void **state)
{
    (void)state;
    const unsigned tiles[][2] = { { 16, 4 }, { 64, 8 }, { 128, 1 } };
    double first[2], got[2];
    for (int i = 0; i < 3; i++) {
        scene s;
        make_ball(&s, 1, tiles[i][0], tiles[i][1], 8e-4);
        trip_camera_params view = scene_view(&s, trip_v3(1, -1, 0.3), 150, 30, N);
        trip_outline *o = make(&s, &view, 28, i == 1 ? 2 : 8);
        reaches(o, &view, 1, 0.2, got);
        if (i == 0)
            memcpy(first, got, sizeof got);
        assert_memory_equal(first, got, sizeof got);
        trip_outline_destroy(o);
        scene_destroy(&s);
    }
}

static bool one(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    (void)user, (void)gradient;
    *code = CODE;
    return i == 4 && j == 4 && k == 4;
}

/* The voxel reaches half its width to each side of its centre, within a pixel. */
static void the_outline_of_a_voxel_has_its_width(void **state)
{
    (void)state;
    scene s;
    trip_outline *o;
    scene_create(&s, &(scene_params){ .dims = { 9, 9, 9 }, .voxel = one });
    scene_colour(&s, CODE, CODE, 1, 1, 1, 0.5);
    trip_camera_params view = scene_view(&s, trip_v3(0, -1, 0), 40, 30, N);
    view.ortho_height = 10;
    trip_outline_params p = {
        .data = s.data, .budget = s.budget, .table = s.table, .hi = { 8, 8, 8 }, .view = &view
    };
    assert_int_equal(trip_reader_create(&p.reader, s.data, &(trip_reader_params){ 0 }, s.budget),
                     0);
    assert_int_equal(trip_outline_make(&o, &p), 0);
    assert_non_null(o);
    const trip_reach_origin origin = { .index = { 4, 4, 4 } };
    const trip_reach wanted[4] = { { .along = { 1, 0, 0 } },
                                   { .along = { -1, 0, 0 } },
                                   { .along = { 0, 0, 1 } },
                                   { .along = { 0, 0, -1 } } };
    double got[4];
    trip_outline_reach(o, &origin, wanted, 4, got);
    for (int i = 0; i < 4; i++)
        assert_close(got[i], 0.5, 0.1);
    trip_outline_destroy(o);
    trip_reader_destroy(p.reader);
    scene_destroy(&s);
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
    const scene_part part = { 1, TRIP_KIND_MEANS, { 2, 2, 2 }, coarse_rod, &scale };
    scene_create(s, &(scene_params){ .dims = { ROD, 8, 8 },
                                     .tile_voxels = 64,
                                     .slab_sheets = 8,
                                     .voxel = rod,
                                     .parts = &part,
                                     .part_count = coarse ? 1 : 0 });
    scene_colour(s, 30000, 50000, 1, 1, 1, 0.5);
}

static trip_outline *rod_outline(const scene *s, trip_camera_params *view)
{
    trip_outline *o;
    trip_outline_params p = { .data = s->data,
                              .budget = s->budget,
                              .table = s->table,
                              .lo = { 10, 0, 0 },
                              .hi = { 133, 7, 7 },
                              .view = view };
    *view = scene_view(s, trip_v3(0, -1, 0), 400, 30, N);
    view->ortho_height = 100;
    assert_int_equal(trip_reader_create(&p.reader, s->data, &(trip_reader_params){ 0 }, s->budget),
                     0);
    assert_int_equal(trip_outline_make(&o, &p), 0);
    trip_reader_destroy(p.reader);
    return o;
}

static void a_coarse_level_of_large_data_sets_is_read(void **state)
{
    (void)state;
    scene s;
    trip_camera_params view;
    const trip_reach_origin origin = { .index = { 0, 3.5, 3.5 } };
    const trip_reach wanted[2] = { { .along = { 1, 0, 0 } }, { .along = { -1, 0, 0 } } };
    double got[2];
    make_rod(&s, true);
    trip_outline *o = rod_outline(&s, &view);
    assert_non_null(o);
    assert_int_equal(trip_outline_splats(o), 40 * 4 * 4);
    trip_outline_reach(o, &origin, wanted, 2, got);
    assert_close(got[0], 119.5, 1);
    assert_close(got[1], -39.5, 1);
    trip_outline_destroy(o);
    scene_destroy(&s);
}

static void without_the_level_or_visible_voxels_there_is_no_outline(void **state)
{
    (void)state;
    scene s;
    trip_camera_params view;
    make_rod(&s, false);
    assert_null(rod_outline(&s, &view));
    scene_destroy(&s);
    make_ball(&s, 1, 64, 8, 1e-5);
    view = scene_view(&s, trip_v3(1, -1, 0.3), 150, 30, N);
    assert_null(make(&s, &view, 28, 4));
    scene_destroy(&s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(faint_objects_end_where_their_rays_are_too_faint_to_see),
        cmocka_unit_test(dense_objects_reach_as_far_from_other_distances),
        cmocka_unit_test(the_outline_of_a_voxel_has_its_width),
        cmocka_unit_test(outlines_are_the_same_for_any_tiles_and_slots),
        cmocka_unit_test(a_coarse_level_of_large_data_sets_is_read),
        cmocka_unit_test(without_the_level_or_visible_voxels_there_is_no_outline),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
