#include "fixture.h"

#include <math.h>

#include "normal.h"

static double angle_degrees(const double a[3], const double b[3])
{
    double c[3] = { a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2],
                    a[0] * b[1] - a[1] * b[0] };
    double sine = sqrt(c[0] * c[0] + c[1] * c[1] + c[2] * c[2]);
    return atan2(sine, a[0] * b[0] + a[1] * b[1] + a[2] * b[2]) * 180 / M_PI;
}

static double length(const double a[3])
{
    return sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]);
}

static double random_coordinate(uint64_t *state)
{
    return (double)(fixture_random(state) >> 11) * 0x1p-52 - 1;
}

/* Returns direction i. The first directions are along axes and diagonals, all others are random. */
static void direction_of(int i, uint64_t *random, double a[3])
{
    for (int k = 0; k < 3; k++)
        a[k] = i < 27 ? (int[]){ i, i / 3, i / 9 }[k] % 3 - 1 : random_coordinate(random);
}

static void directions_are_exact_within_six_hundredths_of_a_degree(void **state)
{
    uint64_t random = 1;
    double worst = 0, worst_alone = 0;
    (void)state;
    for (int i = 0; i < 1000000; i++) {
        double a[3], b[3], alone[3];
        direction_of(i, &random, a);
        if (length(a) == 0)
            continue;
        trip_normal_unpack(trip_normal_pack(a, length(a) * 0.999), length(a), b);
        worst = fmax(worst, angle_degrees(a, b));
        trip_direction_unpack(trip_direction_pack(a), alone);
        worst_alone = fmax(worst_alone, angle_degrees(a, alone));
        assert_true(fabs(length(alone) - 1) < 1e-12);
    }
    assert_true(worst < 0.06 && worst_alone < 0.004);
}

/* No point is further from a body-centred cubic lattice than sqrt(5) / 4 of the edge. From a simple
 * cubic lattice, some points are sqrt(3) / 2 of the edge away. */
static void weak_gradients_are_exact_within_a_body_centred_lattice(void **state)
{
    uint64_t random = 5;
    double worst = 0;
    (void)state;
    for (int i = 0; i < 1000000; i++) {
        double a[3], b[3];
        direction_of(i, &random, a);
        if (length(a) >= 1)
            continue;
        double g[3] = { 3 * a[0], 3 * a[1], 3 * a[2] };
        trip_normal_unpack(trip_normal_pack(g, 3), 3, b);
        const double off[3] = { b[0] - g[0], b[1] - g[1], b[2] - g[2] };
        worst = fmax(worst, length(off) / 3 * 511);
    }
    assert_true(worst <= sqrt(5) / 4 + 1e-9 && worst > 0.54);
}

/* The square root of the length is rounded to steps of 1/32, so the error is at most half a step.
 */
static void long_gradients_are_exact_within_half_a_step_of_the_root(void **state)
{
    (void)state;
    for (double m = 2; m <= 49; m += 0.001) {
        double a[3] = { 0, -m, 0 }, b[3];
        trip_normal_unpack(trip_normal_pack(a, 2), 2, b);
        assert_true(fabs(sqrt(length(b) / 2) - sqrt(m / 2)) <= 0.5 / 32 + 1e-9);
        assert_true(length(b) >= 2 - 1e-9);
    }
}

/* Packing in single precision has the errors of the lattice, of 0.06 degrees and of half a step of
 * the root, plus rounding. */
static void gradients_packed_together_are_as_exact_as_alone(void **state)
{
    uint64_t random = 9;
    double lattice = 0, angle = 0, root = 0;
    (void)state;
    for (int block = 0; block < 10000; block++) {
        float part[3][64];
        uint32_t normals[64];
        for (int i = 0; i < 64; i++) {
            double a[3];
            direction_of(block == 0 ? i : 27, &random, a);
            const double scale = block % 2 ? 0.55 : ldexp(1, i % 5);
            for (int k = 0; k < 3; k++)
                part[k][i] = (float)(scale * a[k]);
        }
        trip_normals_pack_64(part[0], part[1], part[2], normals);
        for (int i = 0; i < 64; i++) {
            const double a[3] = { (double)part[0][i], (double)part[1][i], (double)part[2][i] };
            double b[3];
            trip_normal_unpack(normals[i], 1, b);
            const double apart[3] = { a[0] - b[0], a[1] - b[1], a[2] - b[2] };
            if (length(a) == 0)
                assert_int_equal(normals[i], 0);
            else if (length(a) < 0.9999)
                lattice = fmax(lattice, length(apart));
            else if (length(a) > 1.0001 && length(a) < 24)
                angle = fmax(angle, angle_degrees(a, b));
            if (length(a) > 1.0001 && length(a) < 24)
                root = fmax(root, fabs(sqrt(length(a)) - sqrt(length(b))));
        }
    }
    assert_true(lattice > 0.9 * sqrt(5) / 4 / 511 && lattice < 1.01 * sqrt(5) / 4 / 511);
    assert_true(angle > 0.03 && angle < 0.061);
    assert_true(root < 1.01 / 64);
}

static void gradients_without_direction_are_zero(void **state)
{
    const double none[][3] = { { 0, 0, 0 }, { NAN, 1, 0 }, { INFINITY, 0, 0 }, { 1e-9, 0, 0 } };
    double b[3];
    (void)state;
    for (int i = 0; i < 4; i++)
        assert_int_equal(trip_normal_pack(none[i], 1), 0);
    for (int i = 0; i < 3; i++)
        assert_int_equal(trip_direction_pack(none[i]), 0);
    assert_int_equal(trip_normal_pack((double[]){ 1, 2, 3 }, 0), 0);
    trip_normal_unpack(0, 5, b);
    assert_true(b[0] == 0 && b[1] == 0 && b[2] == 0);
}

static void the_longest_gradients_are_clamped(void **state)
{
    double b[3], max = 3 * (1 + 127.0 / 32) * (1 + 127.0 / 32);
    (void)state;
    trip_normal_unpack(trip_normal_pack((double[]){ 0, 0, 1e300 }, 3), 3, b);
    assert_true(fabs(b[2] - max) < 1e-2 * max);
}

static trip_affine stretched(double x, double y, double z)
{
    trip_affine m = trip_affine_identity();
    m.m[0][0] = x;
    m.m[1][1] = y;
    m.m[2][2] = z;
    return m;
}

/* Compares two gradients up to their sign, which normals do not store. */
static bool is_same_or_opposite(const double a[3], const double b[3])
{
    return (a[0] == b[0] && a[1] == b[1] && a[2] == b[2]) ||
           (a[0] == -b[0] && a[1] == -b[1] && a[2] == -b[2]);
}

/* The voxels have 1 x 2 x 4. All factors are powers of two, so equality is exact. */
static void central_differences_of_bytes_are_exact_below_full(void **state)
{
    (void)state;
    const trip_affine m = stretched(1, 2, 4);
    const double full = 0.04 * 255 / 2;
    double step[3];
    unsigned weak = 0;
    assert_true(trip_compact_normals_choose(&m, full, 0.5, step));
    /* 127 steps cover the range, and 127 half steps do not. */
    for (int a = 0; a < 3; a++)
        assert_true(step[a] * 127 >= full * (1 << a) && step[a] / 2 * 127 < full * (1 << a));
    trip_compact_normals c = trip_compact_normals_make(&m, full, step);
    for (int z = -50; z <= 50; z++)
        for (int y = -30; y <= 30; y++)
            for (int x = -15; x <= 15; x++) {
                double index[3] = { x / 2.0, y / 2.0, z / 2.0 }, back[3];
                double world[3] = { x / 2.0, y / 4.0, z / 8.0 };
                if (length(world) >= full)
                    continue;
                trip_compact_normal_unpack(&c, trip_compact_normal_pack(&c, index), back);
                assert_true(is_same_or_opposite(back, world));
                weak++;
            }
    assert_true(weak > 30000);
}

/* The factors are 1 and 8. Eight times finer steps along one axis do not cover its range. */
static void gradients_are_exact_only_if_every_axis_is(void **state)
{
    (void)state;
    double step[3];
    for (int axis = 0; axis < 3; axis++) {
        const trip_affine m = stretched(axis == 0 ? 8 : 1, axis == 1 ? 8 : 1, axis == 2 ? 8 : 1);
        assert_true(trip_compact_normals_choose(&m, 127, 8, step));
        assert_false(trip_compact_normals_choose(&m, 127, 1, step));
    }
}

/* Components of gradients below full are limited to 127 steps. */
static void components_beyond_the_steps_are_clamped(void **state)
{
    (void)state;
    const trip_affine m = trip_affine_identity();
    const trip_compact_normals c = trip_compact_normals_make(&m, 1024, (const double[]){ 1, 1, 1 });
    for (int i = 0; i < 27; i++) {
        double g[3], expected[3], back[3];
        for (int a = 0; a < 3; a++) {
            g[a] = ((int[]){ i, i / 3, i / 9 }[a] % 3 - 1) * 300 + 5;
            expected[a] = fmin(127, fmax(-127, g[a]));
        }
        trip_compact_normal_unpack(&c, trip_compact_normal_pack(&c, g), back);
        assert_true(is_same_or_opposite(back, expected));
    }
}

static void other_weak_gradients_are_exact_within_half_a_step(void **state)
{
    uint64_t random = 7;
    (void)state;
    const trip_affine m = { { { 0.5, 0.1, 0, 0 }, { 0, 3, -0.2, 0 }, { 0.3, 0, 1, 0 } } };
    trip_affine inverse;
    double step[3];
    assert_true(trip_affine_invert(&m, &inverse));
    assert_false(trip_compact_normals_choose(&m, 2, 0, step));
    trip_compact_normals c = trip_compact_normals_make(&m, 2, step);
    for (int i = 0; i < 100000; i++) {
        double w[3], back[3];
        for (int k = 0; k < 3; k++)
            w[k] = 2 * random_coordinate(&random);
        if (length(w) >= 2)
            continue;
        trip_vec3 g = trip_affine_transpose_vector(&m, trip_v3(w[0], w[1], w[2]));
        uint32_t normal = trip_compact_normal_pack(&c, (const double[]){ g.x, g.y, g.z });
        trip_compact_normal_unpack(&c, normal, back);
        trip_vec3 b = trip_affine_transpose_vector(&m, trip_v3(back[0], back[1], back[2]));
        double sign = g.z < -step[2] / 2 ? -1 : 1;
        assert_true(fabs(b.x - sign * g.x) <= step[0] * 0.5000001);
        assert_true(fabs(b.y - sign * g.y) <= step[1] * 0.5000001);
        assert_true(fabs(b.z - sign * g.z) <= step[2] * 0.5000001);
        assert_int_equal(normal >> 23, 0);
    }
}

static void strong_gradients_keep_direction_within_a_tenth_of_a_degree(void **state)
{
    uint64_t random = 1;
    double worst = 0;
    (void)state;
    const trip_affine m = trip_affine_identity();
    trip_compact_normals c = trip_compact_normals_make(&m, 2, (const double[]){ 1, 1, 1 });
    for (int i = 0; i < 1000000; i++) {
        double a[3], b[3];
        for (int k = 0; k < 3; k++)
            a[k] = i < 27 ? 2 * ((int[]){ i, i / 3, i / 9 }[k] % 3 - 1)
                          : 9 * random_coordinate(&random);
        if (length(a) < 2)
            continue;
        trip_compact_normal_unpack(&c, trip_compact_normal_pack(&c, a), b);
        double angle = angle_degrees(a, b);
        worst = fmax(worst, fmin(angle, 180 - angle));
        assert_true(fabs(length(b) - 2) < 1e-12);
    }
    assert_true(worst < 0.1);
}

static void compact_normals_of_non_finite_gradients_are_zero(void **state)
{
    const double none[][3] = { { NAN, 1, 0 }, { 0, INFINITY, 0 }, { 0, 0, 0 } };
    double b[3];
    (void)state;
    const trip_affine m = trip_affine_identity();
    trip_compact_normals c = trip_compact_normals_make(&m, 1, (const double[]){ 1, 1, 1 });
    for (int i = 0; i < 3; i++)
        assert_int_equal(trip_compact_normal_pack(&c, none[i]), 0);
    trip_compact_normal_unpack(&c, 0, b);
    assert_true(b[0] == 0 && b[1] == 0 && b[2] == 0);
}

static void morton_codes_interleave_all_bits_reversibly(void **state)
{
    uint64_t random = 3;
    (void)state;
    for (int i = 0; i < 1000; i++) {
        uint32_t u = (uint32_t)fixture_random(&random),
                 v = (uint32_t)(fixture_random(&random) >> i % 40);
        uint64_t m = trip_morton(u, v);
        for (int b = 0; b < 32; b++) {
            assert_int_equal(m >> 2 * b & 1, u >> b & 1);
            assert_int_equal(m >> (2 * b + 1) & 1, v >> b & 1);
        }
        assert_int_equal(trip_morton_even(m), u);
        assert_int_equal(trip_morton_even(m >> 1), v);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(directions_are_exact_within_six_hundredths_of_a_degree),
        cmocka_unit_test(weak_gradients_are_exact_within_a_body_centred_lattice),
        cmocka_unit_test(long_gradients_are_exact_within_half_a_step_of_the_root),
        cmocka_unit_test(gradients_packed_together_are_as_exact_as_alone),
        cmocka_unit_test(gradients_without_direction_are_zero),
        cmocka_unit_test(the_longest_gradients_are_clamped),
        cmocka_unit_test(central_differences_of_bytes_are_exact_below_full),
        cmocka_unit_test(gradients_are_exact_only_if_every_axis_is),
        cmocka_unit_test(components_beyond_the_steps_are_clamped),
        cmocka_unit_test(other_weak_gradients_are_exact_within_half_a_step),
        cmocka_unit_test(strong_gradients_keep_direction_within_a_tenth_of_a_degree),
        cmocka_unit_test(compact_normals_of_non_finite_gradients_are_zero),
        cmocka_unit_test(morton_codes_interleave_all_bits_reversibly),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
