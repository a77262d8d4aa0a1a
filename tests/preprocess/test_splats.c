#include "brick_files.h"

#include <math.h>

#include "gradient.h"
#include "normal.h"
#include "run_builder.h"
#include "splats.h"

/* An open raw volume of floats with a splatter. gather() joins the splatter's pieces to the splats
 * of each list. */
typedef struct bench {
    int64_t dims[3];
    trip_budget *budget;
    trip_workers *workers;
    trip_volume *volume;
    trip_volume_info info; /* tests may change the map before start() */
    trip_splatter *splatter;
    trip_piece_format format;
    trip_quantiser quantiser;
    unsigned char *memory[TRIP_MAX_LISTS]; /* contiguous pieces */
    size_t used[TRIP_MAX_LISTS];
    int refusal; /* status that refuses pieces; 0 keeps them */
} bench;

enum { PIECE_MEMORY = 16 << 20 };

static int keep_piece(void *user, unsigned thread, unsigned list, size_t bytes, void **memory)
{
    bench *b = user;
    (void)thread;
    *memory = b->memory[list] + b->used[list];
    assert_true(b->used[list] + bytes <= PIECE_MEMORY);
    b->used[list] += bytes;
    return b->refusal;
}

static void open_bench(bench *b, const int64_t dims[3], const float *values, unsigned tile_log2,
                       bool quantised)
{
    size_t count = (size_t)(dims[0] * dims[1] * dims[2]);
    trip_volume_params p = { .raw_dims = { dims[0], dims[1], dims[2] }, .raw_type = "float" };
    *b = (bench){ .format = { tile_log2, quantised, true, false },
                  .quantiser = { .lo = -1000, .hi = 1000, .gradient_full = 12 } };
    memcpy(b->dims, dims, sizeof b->dims);
    test_write("v.raw", values, count * sizeof *values);
    assert_int_equal(trip_budget_create(&b->budget, (uint64_t)1 << 28), 0);
    assert_int_equal(trip_workers_create(&b->workers, 1), 0);
    assert_int_equal(trip_volume_open(&b->volume, test_path("v.raw"), &p, b->budget), 0);
    b->info = *trip_volume_get_info(b->volume);
    for (int list = 0; list < TRIP_MAX_LISTS; list++)
        b->memory[list] = aligned_alloc(8, PIECE_MEMORY);
}

static int splat_box(void *user, unsigned thread, const trip_box *box)
{
    bench *b = user;
    return trip_splatter_box(b->splatter, thread, box);
}

static int next_batch(void *user, uint64_t batches, uint64_t voxels)
{
    (void)user;
    (void)batches;
    (void)voxels;
    return 0;
}

static int try_splats(bench *b, const trip_envelope *e, int64_t slices)
{
    trip_splat_params p = { .info = &b->info,
                            .envelope = e,
                            .format = b->format,
                            .quantiser = b->quantiser,
                            .tally = true,
                            .threads = 1,
                            .reserve = keep_piece,
                            .user = b };
    trip_walk_params walk = { .slices = slices,
                              .edge = trip_splat_edge(&b->format),
                              .height = TRIP_SPLAT_HEIGHT,
                              .box = splat_box,
                              .batch = next_batch,
                              .user = b };
    assert_int_equal(trip_splatter_create(&b->splatter, &p, b->budget), 0);
    return trip_walk(b->volume, b->workers, &walk);
}

static void splat_all(bench *b, const trip_envelope *e, int64_t slices)
{
    assert_int_equal(try_splats(b, e, slices), 0);
}

static void close_bench(bench *b)
{
    trip_splatter_destroy(b->splatter);
    trip_volume_close(b->volume);
    trip_workers_destroy(b->workers);
    trip_budget_destroy(b->budget);
    for (int list = 0; list < TRIP_MAX_LISTS; list++)
        free(b->memory[list]);
}

/* Gathers the splats of a list by voxel. Voxels without a splat have all bits set. Lists of the
 * halo have no normals. */
static void gather(bench *b, unsigned list, uint32_t *voxels, uint32_t *normals)
{
    trip_run_builder *builder;
    const int axis = trip_list_axis(list);
    const trip_piece_format format = trip_piece_format_of(&b->format, list);
    trip_quantiser q = b->quantiser;
    q.gradient_unit = trip_gradient_unit(&b->info.index_to_world);
    size_t count = (size_t)(b->dims[0] * b->dims[1] * b->dims[2]);
    memset(voxels, 0xff, count * sizeof *voxels);
    memset(normals, 0xff, count * sizeof *normals);
    assert_int_equal(trip_run_builder_create(&builder, &format, b->budget), 0);
    for (size_t at = 0; at < b->used[list];) {
        const trip_piece *piece = (const void *)(b->memory[list] + at);
        const uint32_t *v, *n;
        size_t bytes = trip_piece_get_parts(&format, piece).bytes;
        assert_true(trip_piece_check(piece, &format, bytes));
        at += bytes;
        trip_run_builder_add(builder, piece);
        uint32_t splats = trip_run_builder_take(builder, &q, &v, &n);
        uint64_t morton = piece->key & ((UINT64_C(1) << TRIP_TILE_MORTON_BITS) - 1);
        int64_t tile_u = 0, tile_v = 0, p[3];
        while (trip_morton((uint32_t)tile_u, 0) != (morton & UINT64_C(0x5555555555555555)))
            tile_u++;
        while (trip_morton(0, (uint32_t)tile_v) != (morton & UINT64_C(0xaaaaaaaaaaaaaaaa)))
            tile_v++;
        for (uint32_t i = 0; i < splats; i++) {
            p[axis] = (int64_t)(piece->key >> TRIP_TILE_MORTON_BITS);
            p[(axis + 1) % 3] = (tile_u << b->format.tile_log2) + trip_voxel_u(v[i]);
            p[(axis + 2) % 3] = (tile_v << b->format.tile_log2) + trip_voxel_v(v[i]);
            size_t to = (size_t)((p[2] * b->dims[1] + p[1]) * b->dims[0] + p[0]);
            assert_true(to < count && voxels[to] == UINT32_MAX);
            voxels[to] = trip_voxel_code(v[i]);
            normals[to] = n ? n[i] : UINT32_MAX;
        }
    }
    trip_run_builder_destroy(builder);
}

static void every_list_has_each_kept_voxel_once(void **state)
{
    (void)state;
    enum { NX = 131, NY = 70, NZ = 37, N = NX * NY * NZ };
    const int64_t dims[3] = { NX, NY, NZ };
    static float values[N];
    static uint32_t voxels[N], normals[N];
    trip_envelope e = { 0 };
    uint64_t random = 9;
    for (int i = 0; i < N; i++)
        values[i] = (float)(test_random(&random) % 1000);
    assert_int_equal(trip_envelope_add_range(&e, 300, 349), 0);
    for (unsigned log2 = 4; log2 <= 7; log2++) {
        bench b;
        open_bench(&b, dims, values, log2, true);
        b.quantiser.lo = 0;
        b.quantiser.hi = 65535;
        splat_all(&b, &e, 1 + log2);
        uint64_t expected = 0;
        for (int i = 0; i < N; i++)
            expected += values[i] >= 300 && values[i] <= 349;
        assert_int_equal(trip_splatter_kept(b.splatter), expected);
        for (int axis = 0; axis < 3; axis++) {
            gather(&b, axis, voxels, normals);
            for (int i = 0; i < N; i++)
                assert_int_equal(voxels[i], values[i] >= 300 && values[i] <= 349
                                                ? (uint32_t)values[i]
                                                : UINT32_MAX);
        }
        close_bench(&b);
    }
    trip_envelope_destroy(&e);
}

/* Returns whether voxel i or one of its neighbours has a value in [lo, hi]. */
static bool is_near(const float *values, const int64_t dims[3], int64_t i, float lo, float hi)
{
    int64_t at[3] = { i % dims[0], i / dims[0] % dims[1], i / dims[0] / dims[1] };
    for (int n = 0; n < 27; n++) {
        int64_t x = at[0] + n % 3 - 1, y = at[1] + n / 3 % 3 - 1, z = at[2] + n / 9 - 1;
        if (x < 0 || y < 0 || z < 0 || x >= dims[0] || y >= dims[1] || z >= dims[2])
            continue;
        float value = values[(z * dims[1] + y) * dims[0] + x];
        if (value >= lo && value <= hi)
            return true;
    }
    return false;
}

static void check_halo(bench *b, const float *values, float lo, float hi)
{
    size_t count = (size_t)(b->dims[0] * b->dims[1] * b->dims[2]);
    uint32_t *voxels = malloc(count * sizeof *voxels), *normals = malloc(count * sizeof *normals);
    uint64_t halo = 0;
    assert_true(voxels && normals);
    for (unsigned list = TRIP_HALO_LISTS; list < TRIP_MAX_LISTS; list++) {
        gather(b, list, voxels, normals);
        for (size_t i = 0; i < count; i++) {
            bool kept = values[i] >= lo && values[i] <= hi;
            bool wanted =
                !kept && isfinite(values[i]) && is_near(values, b->dims, (int64_t)i, lo, hi);
            assert_int_equal(voxels[i], wanted ? (uint32_t)values[i] : UINT32_MAX);
            halo += wanted;
        }
    }
    assert_int_equal(3 * trip_splatter_halo(b->splatter), halo);
    free(voxels);
    free(normals);
}

/* Keeps a few random voxels, some of them at the borders of boxes. Some values are not finite. */
static void the_halo_is_the_neighbours_of_kept_voxels(void **state)
{
    (void)state;
    enum { NX = 131, NY = 70, NZ = 37, N = NX * NY * NZ };
    const int64_t dims[3] = { NX, NY, NZ };
    static float values[N];
    for (unsigned log2 = 4; log2 <= 7; log2++)
        for (int normals = 0; normals < 2; normals++) {
            trip_envelope e = { 0 };
            uint64_t random = 9 + log2;
            bench b;
            unsigned rare = log2 % 2 ? 1000 : 20;
            for (int i = 0; i < N; i++)
                values[i] = test_random(&random) % rare == 0 ? 1000 : (float)(i % 900);
            for (int i = 5; i < N; i += 997)
                values[i] = i % 2 ? NAN : INFINITY;
            assert_int_equal(trip_envelope_add_range(&e, 950, 1001), 0);
            open_bench(&b, dims, values, log2, true);
            b.format.halo = true;
            b.format.normals = normals;
            b.quantiser.lo = 0;
            b.quantiser.hi = 65535;
            splat_all(&b, &e, 1 + 3 * log2);
            check_halo(&b, values, 950, 1001);
            close_bench(&b);
            trip_envelope_destroy(&e);
        }
}

static void volumes_without_a_border_of_kept_voxels_have_no_halo(void **state)
{
    (void)state;
    enum { N = 20 };
    const int64_t dims[3] = { N, N, N };
    static float values[N * N * N];
    for (int all = 0; all < 2; all++) {
        trip_envelope e = { 0 };
        bench b;
        assert_int_equal(trip_envelope_add_range(&e, all ? 0 : 1, 2), 0);
        open_bench(&b, dims, values, 6, true);
        b.format.halo = true;
        splat_all(&b, &e, 7);
        assert_int_equal(trip_splatter_halo(b.splatter), 0);
        for (unsigned list = TRIP_HALO_LISTS; list < TRIP_MAX_LISTS; list++)
            assert_int_equal(b.used[list], 0);
        assert_int_equal(trip_splatter_kept(b.splatter), all ? N * N * N : 0);
        close_bench(&b);
        trip_envelope_destroy(&e);
    }
}

static void the_status_that_refuses_a_piece_ends_the_run(void **state)
{
    (void)state;
    static const float values[8] = { 1, 2, 3, 4, 5, 6, 7, 8 };
    trip_envelope e = { 0 };
    bench b;
    assert_int_equal(trip_envelope_add_all(&e), 0);
    open_bench(&b, (const int64_t[3]){ 2, 2, 2 }, values, 6, true);
    b.refusal = TRIP_INTERRUPTED;
    assert_int_equal(try_splats(&b, &e, 2), TRIP_INTERRUPTED);
    close_bench(&b);
    trip_envelope_destroy(&e);
}

/* A rotation, a shear and unequal spacings. */
static const trip_affine sheared = {
    { { 0.8, -0.3, 0.1, 5 }, { 0.5, 1.1, -0.2, -7 }, { 0.05, 0.4, 2.5, 11 } }
};

/* Fails if a normal record is further from `expected` than its format allows. */
static void check_normal(const bench *b, uint32_t normal, trip_vec3 expected)
{
    double g[3];
    double full = b->quantiser.gradient_full, length = trip_length(expected);
    trip_normal_unpack(normal, full, g);
    trip_vec3 got = { g[0], g[1], g[2] };
    /* Below `full` the error is at most half of sqrt(5) / 4 times 2 / 511. Above, the error of the
     * length's square root is at most half of 1/32. */
    double roots = fabs(sqrt(trip_length(got) / full) - sqrt(length / full)) * 32;
    double sine = trip_length(trip_cross(got, expected)) / (trip_length(got) * length);
    bool bad = length < full * 0.999 ? trip_length(trip_sub(got, expected)) > 0.00111 * full
                                     : roots > 0.51 || sine > 0.0012 || trip_dot(got, expected) < 0;
    if (bad)
        fail_msg("gradient %g %g %g instead of %g %g %g", g[0], g[1], g[2], expected.x, expected.y,
                 expected.z);
}

/* Checks the gradients of the voxels that are at least `inside` voxels from the border. */
static void check_gradients(bool quantised, double bend, int inside)
{
    enum { NX = 20, NY = 17, NZ = 18, N = NX * NY * NZ };
    const int64_t dims[3] = { NX, NY, NZ };
    static float values[N];
    static uint32_t voxels[N], normals[N];
    trip_envelope e = { 0 };
    bench b;
    /* f = s . p + bend q . p^2 in world space, p relative to the middle. */
    const trip_vec3 s = { 3, -2, 1.5 }, q = { 0.3, 0.2, -0.25 };
    for (int i = 0; i < N; i++) {
        trip_vec3 index = { i % NX - NX / 2, i / NX % NY - NY / 2, i / NX / NY - NZ / 2 };
        trip_vec3 p = trip_affine_vector(&sheared, index);
        values[i] =
            (float)(trip_dot(s, p) + bend * (q.x * p.x * p.x + q.y * p.y * p.y + q.z * p.z * p.z));
    }
    assert_int_equal(trip_envelope_add_all(&e), 0);
    open_bench(&b, dims, values, 6, quantised);
    b.info.index_to_world = sheared;
    splat_all(&b, &e, 5);
    gather(&b, 1, voxels, normals);
    for (int k = inside; k < NZ - inside; k++)
        for (int j = inside; j < NY - inside; j++)
            for (int i = inside; i < NX - inside; i++) {
                trip_vec3 index = { i - NX / 2, j - NY / 2, k - NZ / 2 };
                trip_vec3 p = trip_affine_vector(&sheared, index);
                trip_vec3 bent = { 2 * q.x * p.x, 2 * q.y * p.y, 2 * q.z * p.z };
                check_normal(&b, normals[(k * NY + j) * NX + i],
                             trip_add(s, trip_scale(bent, bend)));
            }
    close_bench(&b);
    trip_envelope_destroy(&e);
}

static void gradients_of_a_linear_field_are_right_up_to_the_border_in_a_sheared_space(void **state)
{
    (void)state;
    check_gradients(true, 0, 0);
    check_gradients(false, 0, 0);
}

/* Central differences are exact for quadratic fields, too. */
static void gradients_of_a_quadratic_field_are_right_under_shear(void **state)
{
    (void)state;
    check_gradients(true, 1, 1);
    check_gradients(false, 1, 1);
}

static void differences_at_a_border_are_one_sided(void **state)
{
    (void)state;
    enum { N = 4 };
    const int64_t dims[3] = { N, 1, 1 };
    const float values[N] = { 0, 8, 10, 40 };
    uint32_t voxels[N], normals[N];
    trip_envelope e = { 0 };
    bench b;
    assert_int_equal(trip_envelope_add_all(&e), 0);
    open_bench(&b, dims, values, 4, false);
    splat_all(&b, &e, 1);
    gather(&b, 0, voxels, normals);
    const double expected[N] = { 8, 5, 16, 30 };
    for (int i = 0; i < N; i++)
        check_normal(&b, normals[i], trip_v3(expected[i], 0, 0));
    close_bench(&b);
    trip_envelope_destroy(&e);
}

static void differences_use_the_finite_neighbour(void **state)
{
    (void)state;
    enum { N = 5 };
    const int64_t dims[3] = { 1, N, 1 };
    const float values[N] = { 3, 7, NAN, 10, INFINITY };
    uint32_t voxels[N], normals[N];
    trip_envelope e = { 0 };
    trip_tally tally;
    bench b;
    assert_int_equal(trip_envelope_add_all(&e), 0);
    open_bench(&b, dims, values, 4, true);
    splat_all(&b, &e, 1);
    gather(&b, 2, voxels, normals);
    check_normal(&b, normals[1], trip_v3(0, 4, 0));
    assert_int_equal(normals[3], 0); /* no gradient, because neither neighbour is finite */
    assert_int_equal(normals[2], UINT32_MAX);
    trip_splatter_tally(b.splatter, &tally);
    assert_int_equal(tally.voxels, N);
    assert_int_equal(tally.finite, 3);
    close_bench(&b);
    trip_envelope_destroy(&e);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(every_list_has_each_kept_voxel_once, test_begin, test_end),
        cmocka_unit_test_setup_teardown(the_status_that_refuses_a_piece_ends_the_run, test_begin,
                                        test_end),
        cmocka_unit_test_setup_teardown(the_halo_is_the_neighbours_of_kept_voxels, test_begin,
                                        test_end),
        cmocka_unit_test_setup_teardown(volumes_without_a_border_of_kept_voxels_have_no_halo,
                                        test_begin, test_end),
        cmocka_unit_test_setup_teardown(
            gradients_of_a_linear_field_are_right_up_to_the_border_in_a_sheared_space, test_begin,
            test_end),
        cmocka_unit_test_setup_teardown(gradients_of_a_quadratic_field_are_right_under_shear,
                                        test_begin, test_end),
        cmocka_unit_test_setup_teardown(differences_at_a_border_are_one_sided, test_begin,
                                        test_end),
        cmocka_unit_test_setup_teardown(differences_use_the_finite_neighbour, test_begin, test_end),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
