#include "test.h"

#include "geometry.h"

/* Makes a quarter turn about z, scales the axes by 2, 3 and 4, then moves by (10, 20, 30). */
static const trip_affine turned = { { { 0, -2, 0, 10 }, { 3, 0, 0, 20 }, { 0, 0, 4, 30 } } };

static void assert_vec(trip_vec3 actual, double x, double y, double z)
{
    assert_close(actual.x, x, 1e-12);
    assert_close(actual.y, y, 1e-12);
    assert_close(actual.z, z, 1e-12);
}

static void products_follow_the_right_hand_rule(void **state)
{
    (void)state;
    assert_vec(trip_cross(trip_v3(1, 0, 0), trip_v3(0, 1, 0)), 0, 0, 1);
    assert_close(trip_dot(trip_v3(1, 2, 3), trip_v3(4, 5, 6)), 32, 0);
    assert_close(trip_length(trip_v3(2, 3, 6)), 7, 0);
    assert_vec(trip_normalize(trip_v3(0, 0, 5)), 0, 0, 1);
    assert_vec(trip_normalize(trip_v3(0, 0, 0)), 0, 0, 0);
}

static void translation_moves_points_but_not_vectors(void **state)
{
    (void)state;
    assert_vec(trip_affine_point(&turned, trip_v3(1, 2, 3)), 6, 23, 42);
    assert_vec(trip_affine_vector(&turned, trip_v3(1, 2, 3)), -4, 3, 12);
}

static void a_product_applies_the_right_map_first(void **state)
{
    (void)state;
    trip_affine shift = trip_affine_identity();
    shift.m[0][3] = 5;
    trip_affine both = trip_affine_multiply(&turned, &shift);
    trip_vec3 p = trip_v3(1, 2, 3), expected = trip_affine_point(&turned, trip_v3(6, 2, 3));
    assert_vec(trip_affine_point(&both, p), expected.x, expected.y, expected.z);
}

static void determinant_is_the_volume_of_a_voxel(void **state)
{
    (void)state;
    assert_close(trip_affine_determinant(&turned), 24, 1e-12);
}

static void similarities_rotate_mirror_and_scale_uniformly(void **state)
{
    (void)state;
    const trip_affine turns = { { { 0.6, -0.8, 0, 5 }, { 0.8, 0.6, 0, -9 }, { 0, 0, -1, 2 } } };
    for (double size = 1e-9; size < 1e10; size *= 1e6) {
        trip_affine a = turns;
        for (int i = 0; i < 9; i++)
            a.m[i / 3][i % 3] *= size;
        assert_true(trip_affine_is_similarity(&a));
        a.m[2][2] *= 1 + 1e-6;
        assert_false(trip_affine_is_similarity(&a));
        a.m[2][2] = size;
        a.m[0][2] = 1e-6 * size; /* sheared */
        assert_false(trip_affine_is_similarity(&a));
    }
}

static void inverse_undoes_a_sheared_map(void **state)
{
    (void)state;
    trip_affine a = { { { 1, 0.5, 0.1, -3 }, { 0.2, 2, 0.3, 7 }, { -0.4, 0.6, 0.5, 11 } } }, b;
    assert_true(trip_affine_invert(&a, &b));
    trip_vec3 p = trip_affine_point(&b, trip_affine_point(&a, trip_v3(1.5, -2.5, 3.5)));
    assert_vec(p, 1.5, -2.5, 3.5);
}

static void singular_and_infinite_maps_have_no_inverse(void **state)
{
    (void)state;
    trip_affine flat = { { { 1, 2, 3, 0 }, { 2, 4, 6, 0 }, { 0, 0, 1, 0 } } }, out;
    trip_affine infinite = trip_affine_identity();
    infinite.m[1][1] = INFINITY;
    assert_false(trip_affine_invert(&flat, &out));
    assert_false(trip_affine_invert(&infinite, &out));
}

/* f(world) = n . world has the gradient n in world space, and linear^T n in index space. */
static void gradients_map_by_the_transpose(void **state)
{
    (void)state;
    trip_vec3 n = trip_v3(0.3, -0.7, 1.1), g = trip_affine_transpose_vector(&turned, n);
    trip_vec3 step = trip_v3(0.25, 0.5, -2);
    assert_close(trip_dot(g, step), trip_dot(n, trip_affine_vector(&turned, step)), 1e-12);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(products_follow_the_right_hand_rule),
        cmocka_unit_test(translation_moves_points_but_not_vectors),
        cmocka_unit_test(a_product_applies_the_right_map_first),
        cmocka_unit_test(determinant_is_the_volume_of_a_voxel),
        cmocka_unit_test(similarities_rotate_mirror_and_scale_uniformly),
        cmocka_unit_test(inverse_undoes_a_sheared_map),
        cmocka_unit_test(singular_and_infinite_maps_have_no_inverse),
        cmocka_unit_test(gradients_map_by_the_transpose),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
