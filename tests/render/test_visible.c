#include "scenes.h"
#include "test.h"

#include "visible.h"

enum { NX = 70, NY = 45, NZ = 37 };

static const double grid_lo[3], grid_hi[3] = { NX - 1, NY - 1, NZ - 1 };

/* An oblique cigar of random codes among scattered faint voxels. */
static bool cigar(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    (void)user, (void)gradient;
    double along = (i - 34) * 0.8 + (j - 20) * 0.6, across = (j - 20) * 0.8 - (i - 34) * 0.6;
    double r2 = along * along / 900 + across * across / 60 + (k - 18) * (k - 18) / 150.0;
    uint32_t noise = scene_hash(i, j, k);
    *code = r2 < 1 ? 40000 + noise % 20000 : noise % 30000;
    return r2 < 1 || noise % 5 == 0;
}

static void make(scene *s, unsigned tile_voxels, unsigned slab_sheets)
{
    scene_create(s, &(scene_params){ .dims = { NX, NY, NZ },
                                     .index_to_world = { { { 0.5, 0.2, -0.1, 3 },
                                                           { -0.3, 1.5, 0.4, -2 },
                                                           { 0.1, 0.2, 2.5, 7 } } },
                                     .tile_voxels = tile_voxels,
                                     .slab_sheets = slab_sheets,
                                     .voxel = cigar });
    scene_colour(s, 41000, 65535, 1, 1, 1, 0.3);
}

/* Checks the maximum values over the voxels with codes [first, last], one voxel at a time. */
static void expect(const scene *s, unsigned first, unsigned last, const trip_reach_origin *origin,
                   const trip_reach *wanted, int count, double *values)
{
    trip_vec3 o = trip_affine_point(&s->data->index_to_world, origin->index);
    for (int n = 0; n < count; n++)
        values[n] = -INFINITY;
    for (int i = 0; i < NX * NY * NZ; i++) {
        int x = i % NX, y = i / NX % NY, z = i / NX / NY;
        unsigned code;
        if (!cigar(NULL, x, y, z, &code, NULL) || code < first || code > last)
            continue;
        trip_vec3 p = trip_affine_point(&s->data->index_to_world, trip_v3(x, y, z));
        p = trip_sub(p, o);
        for (int n = 0; n < count; n++)
            values[n] =
                fmax(values[n], trip_dot(wanted[n].along, p) +
                                    wanted[n].around * trip_length(trip_cross(origin->axis, p)));
    }
}

static void find(const scene *s, const trip_reader_params *params, double kernel_radius,
                 const trip_reach_origin *origin, const trip_reach *wanted, int count,
                 double *values, uint64_t *splats)
{
    trip_visible v = {
        .data = s->data, .budget = s->budget, .table = s->table, .kernel_radius = kernel_radius
    };
    assert_int_equal(trip_reader_create(&v.reader, s->data, params, s->budget), 0);
    trip_visible_start(&v, grid_lo, grid_hi);
    assert_int_equal(trip_visible_reach(&v, origin, wanted, count, values), 0);
    *splats = v.splats;
    trip_reader_destroy(v.reader);
}

static void any_reaches(trip_reach_origin *origin, trip_reach *wanted)
{
    origin->index = trip_v3(test_random() * 70, test_random() * 45, test_random() * 37);
    origin->axis = trip_normalize(trip_v3(test_random(), test_random() - 0.5, test_random() - 0.5));
    for (int i = 0; i < TRIP_REACHES_MAX; i++)
        wanted[i] = (trip_reach){ { test_random() - 0.5, test_random() - 0.5, test_random() - 0.5 },
                                  i % 2 ? 0 : test_random() };
}

static void reaches_of_visible_voxels_do_not_depend_on_tiles_and_slots(void **state)
{
    (void)state;
    const unsigned tiles[][2] = { { 16, 4 }, { 64, 8 }, { 32, 1 }, { 128, 64 } };
    trip_reach_origin origin[3];
    trip_reach wanted[3][TRIP_REACHES_MAX];
    double first[3][TRIP_REACHES_MAX];
    for (int t = 0; t < 3; t++)
        any_reaches(&origin[t], wanted[t]);
    for (int i = 0; i < 4; i++) {
        scene s;
        make(&s, tiles[i][0], tiles[i][1]);
        const trip_reader_params params = { .slots = i % 2 ? 2 : 8 };
        for (int t = 0; t < 3; t++) {
            double values[TRIP_REACHES_MAX], expected[TRIP_REACHES_MAX];
            uint64_t splats;
            find(&s, &params, 0, &origin[t], wanted[t], TRIP_REACHES_MAX, values, &splats);
            expect(&s, 41000, 65535, &origin[t], wanted[t], TRIP_REACHES_MAX, expected);
            for (int n = 0; n < TRIP_REACHES_MAX; n++)
                assert_close(values[n], expected[n], 1e-12);
            if (i == 0)
                memcpy(first[t], values, sizeof values);
            assert_memory_equal(values, first[t], sizeof values);
        }
        scene_destroy(&s);
    }
}

/* The outline is made here a second time, and the voxels are examined one by one. The result does
 * not depend on the end of earlier searches. */
static void voxels_visible_alone_reach_beyond_the_outline(void **state)
{
    (void)state;
    scene s;
    make(&s, 16, 4);
    trip_visible v = { .data = s.data, .budget = s.budget, .table = s.table };
    trip_outline_params params = { .data = s.data, .budget = s.budget, .table = s.table };
    trip_outline *outline;
    const trip_vec3 diagonal = trip_affine_vector(&s.data->index_to_world, trip_v3(NX, NY, NZ));
    params.min_extinction = -log1p(-1 / 255.0) / (trip_length(diagonal) / 16);
    assert_int_equal(
        trip_reader_create(&v.reader, s.data,
                           &(trip_reader_params){ .skip = trip_visible_skip, .skip_user = &v },
                           s.budget),
        0);
    params.reader = v.reader;
    assert_int_equal(trip_outline_make(&outline, &params), 0);
    trip_visible_start(&v, grid_lo, grid_hi);
    assert_int_equal(trip_visible_outline(&v), 0);
    assert_true(outline && v.outline && v.splats == trip_outline_splats(outline));
    int farther = 0, nearer = 0;
    for (int t = 0; t < 12; t++) {
        trip_reach_origin origin;
        trip_reach wanted[TRIP_REACHES_MAX];
        double got[TRIP_REACHES_MAX], drawn[TRIP_REACHES_MAX], alone[TRIP_REACHES_MAX];
        any_reaches(&origin, wanted);
        for (int n = 0; n < TRIP_REACHES_MAX; n++)
            wanted[n].around = 0;
        v.kernel_radius = t % 2 ? 2 : 0;
        v.position_count = t % 3 ? v.position_count : 0;
        assert_int_equal(trip_visible_reach(&v, &origin, wanted, TRIP_REACHES_MAX, got), 0);
        trip_outline_reach(outline, &origin, wanted, TRIP_REACHES_MAX, drawn);
        expect(&s, 41000, 65535, &origin, wanted, TRIP_REACHES_MAX, alone);
        for (int n = 0; n < TRIP_REACHES_MAX; n++) {
            alone[n] +=
                v.kernel_radius *
                trip_length(trip_affine_transpose_vector(&s.data->index_to_world, wanted[n].along));
            farther += alone[n] > drawn[n];
            nearer += alone[n] < drawn[n];
            assert_close(got[n], fmax(drawn[n], alone[n]), 1e-12);
        }
    }
    assert_true(farther > 0 && nearer > 0);
    trip_outline_destroy(outline);
    trip_visible_end(&v);
    trip_reader_destroy(v.reader);
    scene_destroy(&s);
}

static void bounds_are_those_of_the_visible_voxels(void **state)
{
    (void)state;
    scene s;
    make(&s, 32, 8);
    trip_visible v = { .data = s.data, .budget = s.budget, .table = s.table, .kernel_radius = 2 };
    double lo[3], hi[3], min[3] = { NX, NY, NZ }, max[3] = { 0 };
    for (int i = 0; i < NX * NY * NZ; i++) {
        const int at[3] = { i % NX, i / NX % NY, i / NX / NY };
        unsigned code;
        bool there = cigar(NULL, at[0], at[1], at[2], &code, NULL) && code >= 41000;
        for (int a = 0; a < 3 && there; a++) {
            min[a] = fmin(min[a], at[a]);
            max[a] = fmax(max[a], at[a]);
        }
    }
    assert_int_equal(trip_reader_create(&v.reader, s.data, &(trip_reader_params){ 0 }, s.budget),
                     0);
    trip_visible_start(&v, grid_lo, grid_hi);
    assert_int_equal(trip_visible_bounds(&v, lo, hi), 0);
    assert_memory_equal(lo, min, sizeof lo);
    assert_memory_equal(hi, max, sizeof hi);
    trip_reader_destroy(v.reader);
    scene_destroy(&s);
}

static void most_of_a_list_is_not_visited(void **state)
{
    (void)state;
    scene s;
    make(&s, 16, 4);
    trip_reach_origin origin = { .index = { 34, 20, 18 } };
    trip_reach wanted[2] = { { { 1, 0.2, 0.3 }, 0 }, { { -1, -0.2, -0.3 }, 0 } };
    double values[2];
    uint64_t splats;
    find(&s, &(trip_reader_params){ 0 }, 0, &origin, wanted, 2, values, &splats);
    assert_true(splats > 0 && splats < s.data->header.kept / 4);
    scene_destroy(&s);
}

/* A splat of radius r about a voxel reaches farther by r times the normal's length in index space.
 */
static void kernels_reach_beyond_their_voxels(void **state)
{
    (void)state;
    scene s;
    make(&s, 64, 8);
    trip_reach_origin origin = { .axis = { 0, 0, 1 } };
    trip_reach wanted[1] = { { { 0, 0, 1 }, 0 } };
    double without[1], with[1];
    uint64_t splats;
    find(&s, &(trip_reader_params){ 0 }, 0, &origin, wanted, 1, without, &splats);
    find(&s, &(trip_reader_params){ 0 }, 2, &origin, wanted, 1, with, &splats);
    /* World z is (0.1, 0.2, 2.5) . index. */
    assert_close(with[0] - without[0], 2 * sqrt(0.01 + 0.04 + 6.25), 1e-9);
    scene_destroy(&s);
}

static void without_visible_voxels_all_bounds_count(void **state)
{
    (void)state;
    scene s;
    make(&s, 64, 8);
    scene_colour(&s, 0, 65535, 1, 1, 1, 0);
    trip_reach_origin origin = { .index = { 0, 0, 0 } };
    trip_reach wanted[1] = { { { 0, 0, 1 }, 0 } };
    double values[1];
    uint64_t splats;
    find(&s, &(trip_reader_params){ 0 }, 0, &origin, wanted, 1, values, &splats);
    assert_close(values[0], 0.1 * (NX - 1) + 0.2 * (NY - 1) + 2.5 * (NZ - 1), 1e-9);
    assert_int_equal(splats, 0);
    scene_destroy(&s);
}

/* A sixteenth of the diagonal is about 6. An opacity of 0.5/255 over this length counts, a
 * thousandth of it does not. */
static void voxels_too_faint_to_see_do_not_count(void **state)
{
    (void)state;
    trip_reach_origin origin = { .index = { 0, 0, 0 } };
    trip_reach wanted[1] = { { { 0, 0, 1 }, 0 } };
    const double opacities[2] = { 2e-3, 2e-6 };
    for (int i = 0; i < 2; i++) {
        scene s;
        double values[1], expected[1];
        uint64_t splats;
        make(&s, 64, 8);
        scene_colour(&s, 0, 40999, 1, 1, 1, opacities[i]);
        find(&s, &(trip_reader_params){ 0 }, 0, &origin, wanted, 1, values, &splats);
        expect(&s, i ? 41000 : 0, 65535, &origin, wanted, 1, expected);
        assert_close(values[0], expected[0], 1e-12);
        scene_destroy(&s);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(reaches_of_visible_voxels_do_not_depend_on_tiles_and_slots),
        cmocka_unit_test(voxels_visible_alone_reach_beyond_the_outline),
        cmocka_unit_test(bounds_are_those_of_the_visible_voxels),
        cmocka_unit_test(most_of_a_list_is_not_visited),
        cmocka_unit_test(kernels_reach_beyond_their_voxels),
        cmocka_unit_test(without_visible_voxels_all_bounds_count),
        cmocka_unit_test(voxels_too_faint_to_see_do_not_count),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
