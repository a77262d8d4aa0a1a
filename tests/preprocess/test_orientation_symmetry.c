/* Tests of mirror symmetry, by hand-computed sums and by volumes that are symmetric across a known
 * axis. */
#include "brick_files.h"

#include <math.h>

#include "orientation.h"

static double score(int i, int j, int k, const uint16_t *weights, int axis)
{
    trip_occupancy o = { { i, j, k }, { 0 } };
    memcpy(o.weights, weights, (size_t)(i * j * k) * sizeof *weights);
    return trip_orientation_symmetry_score(&o, axis);
}

static void scores_are_the_maximum_overlap_with_the_mirror_image(void **state)
{
    (void)state;
    /* The row 1 2 overlaps its mirror image by 1, 4 or 4, depending on the position of the mirror.
     * The sum of squares is 5. */
    const uint16_t row[] = { 1, 2 };
    for (int axis = 0; axis < 3; axis++) {
        int n[3] = { 1, 1, 1 };
        n[axis] = 2;
        assert_float_equal(score(n[0], n[1], n[2], row, axis), 4.0 / 5, 1e-15);
        assert_float_equal(score(n[0], n[1], n[2], row, (axis + 1) % 3), 1, 0);
    }
    /* The mirror stands where the overlap is greatest, here beside the middle. */
    const uint16_t aside[] = { 0, 0, 0, 7, 9, 7, 0 };
    assert_float_equal(score(7, 1, 1, aside, 0), 1, 0);
    /* All rows share one mirror. At the best position, the first row has 9 of 9 and the second row
     * 9 of 10. */
    const uint16_t rows[] = { 0, 0, 3, 0, 1, 0, 3, 0 };
    assert_float_equal(score(4, 2, 1, rows, 0), 18.0 / 19, 1e-15);
    const uint16_t nothing[8] = { 0 };
    assert_float_equal(score(2, 2, 2, nothing, 1), 0, 0);
}

static void maximum_weights_do_not_overflow(void **state)
{
    (void)state;
    trip_occupancy full = { { TRIP_OCCUPANCY_EDGE, TRIP_OCCUPANCY_EDGE, TRIP_OCCUPANCY_EDGE },
                            { 0 } };
    memset(full.weights, 0xff, sizeof full.weights);
    for (int axis = 0; axis < 3; axis++)
        assert_float_equal(trip_orientation_symmetry_score(&full, axis), 1, 0);
}

static void an_axis_needs_a_clearly_best_score(void **state)
{
    (void)state;
    static const struct {
        double scores[3];
        int axis;
    } rows[] = {
        { { 0.95, 0.8, 0.75 }, 0 },  { { 0.8, 0.95, 0.75 }, 1 },  { { 0.75, 0.8, 0.95 }, 2 },
        { { 1, 1, 1 }, -1 },         { { 0.99, 0.95, 0.5 }, -1 }, /* two */
        { { 0.5, 0.6, 0.85 }, -1 },                               /* weak */
        { { 0.5, 0.86, 0.92 }, -1 }, /* the two best scores are too close */
        { { 0, 0, 0 }, -1 },         { { 1, 1, 0.3 }, -1 },
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++)
        assert_int_equal(trip_orientation_symmetry_axis(rows[i].scores), rows[i].axis);
}

/* Returns whether a point is in a wedge that is thin in front and at the top, and has rounded
 * sides. Coordinates are from -1 to 1 along each edge. The mirror image of a right triangle across
 * the direction of a leg covers at most 2/3 of the triangle. */
static bool is_in_wedge(double side, double front, double up)
{
    return side * side + 0.2 * up * up < 0.3 && front > -0.8 && up > -0.8 && front + up < 0.2;
}

enum { NX = 90, NY = 84, NZ = 76 };

static uint8_t wedge[NX * NY * NZ];

static void make_wedge(int axis, double aside, bool lopsided)
{
    const int dims[3] = { NX, NY, NZ };
    for (int n = 0; n < NX * NY * NZ; n++) {
        const int at[3] = { n % NX, n / NX % NY, n / NX / NY };
        double p[3];
        for (int a = 0; a < 3; a++)
            p[a] = 2 * (at[a] + 0.5) / dims[a] - 1;
        double side = p[axis] - aside;
        bool ear = lopsided && side > 0.2 && side < 0.8 && p[(axis + 1) % 3] < 0.8;
        wedge[n] = is_in_wedge(side, p[(axis + 1) % 3], p[(axis + 2) % 3]) || ear ? 200 : 10;
    }
}

static void assert_mirror(trip_brick_params p, const char *expected)
{
    trip_brick_summary s;
    char *text = test_brick_bytes(p, wedge, (const int[]){ NX, NY, NZ }, &s);
    assert_true((strstr(s.note, "mirror-symmetric across z") != NULL) ==
                (strstr(text, "\"mirror\":\"z\"") != NULL));
    if (expected ? !strstr(text, expected) : strstr(text, "\"mirror\"") != NULL)
        fail_msg("%s is not in: %.200s", expected ? expected : "no mirror", text);
    free(text);
}

static void a_wedge_is_symmetric_across_its_axis(void **state)
{
    (void)state;
    static const char *const expected[] = { "\"mirror\":\"x\"", "\"mirror\":\"y\"",
                                            "\"mirror\":\"z\"" };
    for (int axis = 0; axis < 3; axis++) {
        make_wedge(axis, axis * 0.04, false);
        assert_mirror((trip_brick_params){ 0 }, expected[axis]);
    }
    make_wedge(2, 0, true);
    assert_mirror((trip_brick_params){ 0 }, NULL);
}

static void the_axis_found_does_not_depend_on_bricking(void **state)
{
    (void)state;
    const trip_brick_params ways[] = {
        { .levels = -1 },
        { .levels = 1 },
        { .tile_voxels = 16, .slab_sheets = 3 },
        { .no_halo = true, .threads = 1 },
        { .threads = 1, .memory_bytes = 27 << 20 },
    };
    make_wedge(2, 0.05, false);
    for (size_t i = 0; i < sizeof ways / sizeof *ways; i++)
        assert_mirror(ways[i], "\"mirror\":\"z\"");
}

/* With uneven spacing, the mirror image of the voxels differs from the mirror image of the object.
 */
static void no_symmetry_is_found_across_uneven_spacing(void **state)
{
    (void)state;
    char table[16 * NZ] = "", files[160];
    for (int k = 0, used = 0; k < NZ; k++)
        used += snprintf(table + used, sizeof table - (size_t)used, "%d\n", k * (k + 10));
    test_write("z.txt", table, strlen(table));
    snprintf(files, sizeof files, ",,%s", test_path("z.txt"));
    make_wedge(2, 0, false);
    assert_mirror((trip_brick_params){ .volume.coordinates = files }, NULL);
}

static void nothing_is_guessed_if_the_orientation_is_given(void **state)
{
    (void)state;
    make_wedge(2, 0, false);
    assert_mirror((trip_brick_params){ .volume.axes = "PIR" }, NULL);
}

#define TEST(f) cmocka_unit_test_setup_teardown(f, test_begin, test_end)

int main(void)
{
    const struct CMUnitTest tests[] = {
        TEST(scores_are_the_maximum_overlap_with_the_mirror_image),
        TEST(maximum_weights_do_not_overflow),
        TEST(an_axis_needs_a_clearly_best_score),
        TEST(a_wedge_is_symmetric_across_its_axis),
        TEST(the_axis_found_does_not_depend_on_bricking),
        TEST(no_symmetry_is_found_across_uneven_spacing),
        TEST(nothing_is_guessed_if_the_orientation_is_given),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
