/* Compares the halo of data sets with a plain search of all neighbours. */
#include "brick_files.h"

#include <math.h>

enum { NX = 97, NY = 70, NZ = 61, N = NX * NY * NZ };

static uint8_t bytes[N];

/* Makes a kept ball, and keeps one voxel in `rare` at random positions. */
static void make_bytes(uint64_t seed, unsigned rare)
{
    uint64_t random = seed;
    for (int i = 0; i < N; i++) {
        int x = i % NX - 20, y = i / NX % NY - 30, z = i / NX / NY - 25;
        bool ball = x * x + y * y + z * z < 200;
        bool kept = ball || test_random(&random) % rare == 0;
        bytes[i] = (uint8_t)(kept ? 200 + test_random(&random) % 56 : test_random(&random) % 200);
    }
    test_write("v.raw", bytes, sizeof bytes);
}

static const trip_value_range high = { 200, 255 };

static trip_brick_params params_for(const char *input)
{
    static char path[128];
    strcpy(path, test_path(input));
    return (trip_brick_params){ .input = path,
                                .ranges = &high,
                                .range_count = 1,
                                .memory_bytes = (uint64_t)1 << 28,
                                .threads = 2,
                                .replace = true };
}

static trip_brick_params params_for_bytes(void)
{
    trip_brick_params p = params_for("v.raw");
    p.volume = (trip_volume_params){ .raw_dims = { NX, NY, NZ }, .raw_type = "uint8" };
    return p;
}

static trip_brick_summary brick_to(trip_brick_params p, const char *output)
{
    trip_brick_summary s;
    p.output = test_path(output);
    if (trip_brick(&p, &s) != 0)
        fail_msg("%s", test_report);
    return s;
}

/* Returns whether a voxel is not kept but has a kept neighbour in the grid. */
static bool is_halo(const int32_t *kept, const int64_t dims[3], int64_t x, int64_t y, int64_t z)
{
    if (kept[(z * dims[1] + y) * dims[0] + x] >= 0)
        return false;
    for (int n = 0; n < 27; n++) {
        int64_t i = x + n % 3 - 1, j = y + n / 3 % 3 - 1, k = z + n / 9 - 1;
        if (i >= 0 && j >= 0 && k >= 0 && i < dims[0] && j < dims[1] && k < dims[2] &&
            kept[(k * dims[1] + j) * dims[0] + i] >= 0)
            return true;
    }
    return false;
}

/* Checks that the halo consists of exactly the neighbours of kept voxels. `value` gives their
 * codes. */
static void check_halo(const test_lists *l, int32_t (*value)(const test_lists *l, size_t voxel))
{
    const int64_t dims[3] = { (int64_t)l->header.dims[0], (int64_t)l->header.dims[1],
                              (int64_t)l->header.dims[2] };
    uint64_t halo = 0;
    test_check_lists(l);
    assert_int_equal(l->lists, 6);
    for (int64_t z = 0, at = 0; z < dims[2]; z++)
        for (int64_t y = 0; y < dims[1]; y++)
            for (int64_t x = 0; x < dims[0]; x++, at++) {
                bool wanted = is_halo(l->codes[0], dims, x, y, z);
                assert_int_equal(l->codes[3][at], wanted ? value(l, (size_t)at) : -1);
                halo += wanted;
            }
    assert_int_equal(l->header.halo, halo);
    assert_true(halo > 0);
}

static int32_t code_of_byte(const test_lists *l, size_t voxel)
{
    (void)l;
    return 85 * (258 + bytes[voxel]);
}

static void the_halo_has_all_neighbours_for_any_tile(void **state)
{
    (void)state;
    for (unsigned tile = 16; tile <= 128; tile *= 2) {
        test_lists l;
        trip_brick_params p = params_for_bytes();
        make_bytes(tile, tile % 32 ? 10 : 3000);
        p.tile_voxels = tile;
        trip_brick_summary s = brick_to(p, "a.trip");
        test_read_lists("a.trip", &l);
        check_halo(&l, code_of_byte);
        assert_int_equal(s.halo, l.header.halo);
        test_free_lists(&l);
    }
}

static void memory_threads_and_slabs_do_not_change_the_result(void **state)
{
    (void)state;
    make_bytes(5, 100);
    for (int normals = 0; normals < 2; normals++) {
        trip_brick_params p = params_for_bytes();
        p.normals = normals ? TRIP_NORMALS_STORED : TRIP_NORMALS_NONE;
        brick_to(p, "a.trip");
        for (int way = 0; way < 5; way++) {
            p.threads = (unsigned[]){ 1, 1, 4, 3, 2 }[way];
            p.slices = (int64_t[]){ 0, 1, 5, 23, 64 }[way];
            p.memory_bytes = (uint64_t[]){ 0, 28 << 20, 48 << 20, 64 << 20, 256 << 20 }[way];
            brick_to(p, "b.trip");
            test_same_dataset("a.trip", "b.trip");
        }
    }
}

static void splats_have_the_same_bytes_with_and_without_a_halo(void **state)
{
    (void)state;
    static const char *const planes[] = { "voxels", "normals" };
    test_lists l;
    trip_brick_params p = params_for_bytes();
    make_bytes(6, 50);
    p.normals = TRIP_NORMALS_STORED;
    brick_to(p, "a.trip");
    p.no_halo = true;
    trip_brick_summary s = brick_to(p, "b.trip");
    assert_int_equal(s.halo, 0);
    assert_int_equal(s.halo_bytes, 0);
    test_read_lists("b.trip", &l);
    assert_int_equal(l.lists, 3);
    assert_int_equal(l.header.halo, 0);
    assert_false(test_exists("b.trip/x0.halo"));
    for (int i = 0; i < 6; i++) {
        char a[64], b[64];
        snprintf(a, sizeof a, "a.trip/%c0.%s", 'x' + i % 3, planes[i / 3]);
        snprintf(b, sizeof b, "b.trip/%c0.%s", 'x' + i % 3, planes[i / 3]);
        assert_true(test_same_file(test_path(a), test_path(b)));
    }
    test_free_lists(&l);
}

static void non_finite_values_are_not_in_the_halo(void **state)
{
    (void)state;
    enum { EDGE = 20, COUNT = EDGE * EDGE * EDGE };
    static float values[COUNT];
    test_lists l;
    for (int i = 0; i < COUNT; i++)
        values[i] = i % 3 ? (float)(i % 100) : NAN;
    values[COUNT / 2 + EDGE * EDGE / 2 + EDGE / 2] = 250;
    test_write("f.raw", values, sizeof values);
    trip_brick_params p = params_for("f.raw");
    p.volume = (trip_volume_params){ .raw_dims = { EDGE, EDGE, EDGE }, .raw_type = "float" };
    trip_brick_summary s = brick_to(p, "a.trip");
    test_read_lists("a.trip", &l);
    test_check_lists(&l);
    assert_int_equal(l.header.kept, 1);
    assert_int_equal(s.halo, l.header.halo);
    uint64_t finite = 0;
    for (int n = 0; n < 27; n++) {
        int at = COUNT / 2 + EDGE * EDGE / 2 + EDGE / 2 + n % 3 - 1 + (n / 3 % 3 - 1) * EDGE +
                 (n / 9 - 1) * EDGE * EDGE;
        bool wanted = n != 13 && at % 3;
        assert_int_equal(l.codes[3][at] >= 0, wanted);
        finite += wanted;
    }
    assert_int_equal(l.header.halo, finite);
    test_free_lists(&l);
}

/* A field written to two files. The sparse grid has the voxels above 0, the raw file has all
 * voxels. */
enum { EDGE = 100 };

static float field[EDGE * EDGE * EDGE];
static int64_t corner[3]; /* position of the sparse grid in the field */

static void generate(const char *name)
{
    char command[512];
    snprintf(command, sizeof command,
             "%.*s-generate cloud --size %d --type float -o %s >/dev/null 2>&1",
             (int)strlen(TRIP_PROGRAM), TRIP_PROGRAM, EDGE, test_path(name));
    assert_int_equal(system(command), 0);
}

static void read_field(void)
{
    FILE *f = fopen(test_path("v.raw"), "rb");
    assert_non_null(f);
    assert_int_equal(fread(field, sizeof *field, sizeof field / sizeof *field, f),
                     sizeof field / sizeof *field);
    fclose(f);
    int64_t lo[3] = { EDGE, EDGE, EDGE };
    for (int64_t i = 0; i < EDGE * EDGE * EDGE; i++)
        for (int a = 0; a < 3 && field[i] > 0; a++) {
            int64_t at[3] = { i % EDGE, i / EDGE % EDGE, i / EDGE / EDGE };
            lo[a] = at[a] < lo[a] ? at[a] : lo[a];
        }
    for (int a = 0; a < 3; a++)
        corner[a] = lo[a] - 1;
}

/* Returns the code of the field's value. */
static int32_t code_of_field(const test_lists *l, size_t voxel)
{
    int64_t x = (int64_t)(voxel % l->header.dims[0]) + corner[0];
    int64_t y = (int64_t)(voxel / l->header.dims[0] % l->header.dims[1]) + corner[1];
    int64_t z = (int64_t)(voxel / l->header.dims[0] / l->header.dims[1]) + corner[2];
    bool within = x >= 0 && y >= 0 && z >= 0 && x < EDGE && y < EDGE && z < EDGE;
    double value = within ? field[(z * EDGE + y) * EDGE + x] : 0;
    return (int32_t)trip_codes_nearest(&l->scale, value);
}

static void a_sparse_volume_has_background_around_kept_voxels(void **state)
{
    (void)state;
    static const trip_value_range ranges[] = { { 1e-6, 2 }, { 0.2, 2 } };
#ifndef TEST_OPENVDB
    skip();
#endif
    generate("v.vdb");
    generate("v.raw");
    read_field();
    for (int i = 0; i < 2; i++)
        for (unsigned tile = 16; tile <= 128; tile *= 8) {
            test_lists l;
            trip_brick_params p = params_for("v.vdb");
            p.ranges = &ranges[i];
            p.tile_voxels = tile;
            brick_to(p, "a.trip");
            test_read_lists("a.trip", &l);
            check_halo(&l, code_of_field);
            test_free_lists(&l);
            p.threads = 1;
            p.memory_bytes = 64 << 20;
            brick_to(p, "b.trip");
            test_same_dataset("a.trip", "b.trip");
        }
}

/* Takes every voxel, every second voxel, and so on. Some samples keep the last voxel along an axis,
 * with no neighbour behind it. */
static void a_sampled_sparse_volume_has_its_halo_within_the_grid(void **state)
{
    (void)state;
    static const trip_value_range all = { 1e-6, 2 };
    bool some_kept_at_the_end = false;
    int64_t whole[3];
    test_lists l;
    trip_brick_params p = params_for("v.vdb");
#ifndef TEST_OPENVDB
    skip();
#endif
    generate("v.vdb");
    p.ranges = &all;
    for (int64_t step = 1; step < 8; step++) {
        p.volume.max_voxels = 0;
        for (int a = 0; a < 3 && step > 1; a++)
            p.volume.max_voxels =
                (a ? p.volume.max_voxels : 1) * (uint64_t)((whole[a] - 1) / step + 1);
        brick_to(p, "a.trip");
        test_read_lists("a.trip", &l);
        test_check_lists(&l);
        const int64_t dims[3] = { (int64_t)l.header.dims[0], (int64_t)l.header.dims[1],
                                  (int64_t)l.header.dims[2] };
        if (step == 1)
            memcpy(whole, dims, sizeof dims);
        for (int64_t at = 0; at < dims[0] * dims[1] * dims[2]; at++) {
            const int64_t x = at % dims[0], y = at / dims[0] % dims[1], z = at / dims[0] / dims[1];
            assert_int_equal(l.codes[3][at] >= 0, is_halo(l.codes[0], dims, x, y, z));
            if (l.codes[0][at] >= 0 && (x + 1 == dims[0] || y + 1 == dims[1] || z + 1 == dims[2]))
                some_kept_at_the_end = true;
        }
        test_free_lists(&l);
    }
    assert_true(some_kept_at_the_end);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(the_halo_has_all_neighbours_for_any_tile, test_begin,
                                        test_end),
        cmocka_unit_test_setup_teardown(memory_threads_and_slabs_do_not_change_the_result,
                                        test_begin, test_end),
        cmocka_unit_test_setup_teardown(splats_have_the_same_bytes_with_and_without_a_halo,
                                        test_begin, test_end),
        cmocka_unit_test_setup_teardown(non_finite_values_are_not_in_the_halo, test_begin,
                                        test_end),
        cmocka_unit_test_setup_teardown(a_sparse_volume_has_background_around_kept_voxels,
                                        test_begin, test_end),
        cmocka_unit_test_setup_teardown(a_sampled_sparse_volume_has_its_halo_within_the_grid,
                                        test_begin, test_end),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
