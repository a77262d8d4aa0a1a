/* Where the squares of voxels begin and end. That nothing is left out that shows: test_cpu_cover.c
 * and test_cpu_same.c. */
#include "cpu_show.h"
#include "scenes.h"
#include "test.h"

/* Voxels in Morton order of 16 x 16, without every third. */
static void squares_hold_the_voxels_that_share_their_high_bits(void **state)
{
    (void)state;
    uint32_t voxels[256], n = 0;
    for (uint32_t i = 0; i < 256; i++) {
        uint32_t u = 0, v = 0;
        for (unsigned bit = 0; bit < 4; bit++) {
            u |= (i >> 2 * bit & 1) << bit;
            v |= (i >> (2 * bit + 1) & 1) << bit;
        }
        if (i >= 64 ? i % 3 != 0 : true)
            voxels[n++] = u | v << 8 | scene_hash((int)i, 0, 0) << 16;
    }
    assert_int_equal(trip_cpu_square_count(voxels, n, 8, false), 64);
    assert_int_equal(trip_cpu_square_count(voxels, n, 16, true), n);
    assert_int_equal(trip_cpu_square_count(voxels + 5, n - 5, 4, false), 11);
    assert_int_equal(trip_cpu_square_count(voxels + 60, n - 60, 8, false), 4);
    assert_int_equal(trip_cpu_square_count(voxels, 10, 8, false), 10);
    assert_int_equal(trip_cpu_square_count(voxels + 64, n - 64, 8, false), 43);
    assert_int_equal(trip_cpu_square_count(voxels, 64, 8, true), 64);
    assert_int_equal(trip_cpu_square_count(voxels, 65, 8, true), 1);
    assert_int_equal(trip_cpu_square_count(voxels, 64 + 43, 8, true), 43);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(squares_hold_the_voxels_that_share_their_high_bits),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
