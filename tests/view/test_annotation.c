#include "test.h"

#include "annotation.h"

enum { WIDTH = 800, HEIGHT = 600 };

/* Returns a parallel view of the origin from (x, y, z), 60 units high. */
static trip_navigation parallel(double x, double y, double z)
{
    const triptych_camera camera = { .eye = { x, y, z }, .up = { 0, 0, 1 }, .ortho_height = 60 };
    return trip_navigation_from_camera(&camera, NULL);
}

static trip_annotation_box box(void)
{
    const triptych_info info = { .edges = { { -0.5, -0.5, -0.5 }, { 9.5, 9.5, 9.5 } },
                                 .index_to_world = {
                                     { 1, 0, 0, -4.5 }, { 0, 2, 0, -9 }, { 0, 0, 3, -13.5 } } };
    return trip_annotation_box_of(&info);
}

static void a_box_includes_whole_voxels_at_its_border(void **state)
{
    (void)state;
    trip_annotation_box b = box();
    const double half[3] = { 5, 10, 15 };
    for (int n = 0; n < 8; n++)
        for (int a = 0; a < 3; a++)
            assert_close(b.corners[n][a], n >> a & 1 ? half[a] : -half[a], 1e-12);
}

/* The view is from the front, at 10 px per unit. */
static void edges_of_the_box_are_projected(void **state)
{
    (void)state;
    trip_annotation_box b = box();
    trip_navigation n = parallel(0, -100, 0);
    trip_annotation_edge edges[TRIP_ANNOTATION_EDGES];
    trip_annotation_edges(&b, &n, WIDTH, HEIGHT, edges);
    for (int i = 0; i < TRIP_ANNOTATION_EDGES; i++) {
        assert_true(edges[i].drawn);
        assert_int_equal(edges[i].axis, i / 4);
        for (int end = 0; end < 2; end++) {
            const double *p = end ? edges[i].to : edges[i].from;
            assert_close(fabs(p[0] - 400), 50, 1e-12);
            assert_close(fabs(p[1] - 300), 150, 1e-12);
        }
    }
    /* Edge 1 is parallel to x, at the lower end of z and the upper end of y. */
    assert_close(edges[1].from[0], 350, 1e-12);
    assert_close(edges[1].to[0], 450, 1e-12);
}

static int count(const trip_annotation_edge *edges, int hidden, int outline)
{
    int n = 0;
    for (int i = 0; i < TRIP_ANNOTATION_EDGES; i++)
        n += edges[i].hidden == hidden && edges[i].outline == outline;
    return n;
}

/* From outside, three faces of the box are visible. The three edges at their common corner are not
 * part of the outline. The three edges at the opposite corner are hidden. From inside, all edges
 * are hidden. */
static void three_edges_are_hidden_from_outside_and_all_from_inside(void **state)
{
    (void)state;
    trip_annotation_box b = box();
    trip_annotation_edge edges[TRIP_ANNOTATION_EDGES];
    for (int perspective = 0; perspective < 2; perspective++) {
        trip_navigation n = parallel(60, -50, 40);
        trip_navigation_set_parallel(&n, !perspective);
        trip_annotation_edges(&b, &n, WIDTH, HEIGHT, edges);
        assert_int_equal(count(edges, true, false), 3);
        assert_int_equal(count(edges, false, true), 6);
        assert_int_equal(count(edges, false, false), 3);
        /* The lower, the left and the back face meet in the hidden edges. */
        assert_true(edges[1].hidden && edges[4].hidden && edges[10].hidden);
    }
    const triptych_camera inside = { .eye = { 1, 0, 0 }, .up = { 0, 0, 1 }, .fov_degrees = 40 };
    trip_navigation n = trip_navigation_from_camera(&inside, NULL);
    trip_annotation_edges(&b, &n, WIDTH, HEIGHT, edges);
    assert_int_equal(count(edges, true, false), 12);
    /* The view is along -x. The edges at x = 5 are behind the eye. The edges parallel to x begin
     * behind the eye. */
    int drawn = 0;
    for (int i = 0; i < TRIP_ANNOTATION_EDGES; i++) {
        drawn += edges[i].drawn;
        for (int a = 0; a < 2 && edges[i].drawn; a++)
            assert_true(isfinite(edges[i].from[a]) && isfinite(edges[i].to[a]));
    }
    assert_int_equal(drawn, 8);
}

static void steps_are_rounded_up_to_1_2_or_5(void **state)
{
    (void)state;
    assert_close(trip_annotation_round(1), 1, 1e-15);
    assert_close(trip_annotation_round(1.01), 2, 1e-15);
    assert_close(trip_annotation_round(2.5), 5, 1e-15);
    assert_close(trip_annotation_round(7), 10, 1e-15);
    assert_close(trip_annotation_round(0.0021), 0.005, 1e-15);
    assert_close(trip_annotation_round(1e-100) / 1e-100, 1, 1e-12);
}

static void a_scale_bar_is_the_longest_that_fits(void **state)
{
    (void)state;
    trip_navigation n = parallel(0, -100, 0); /* 10 px per unit */
    static const struct {
        double max_px, length;
        const char *text;
    } bars[] = { { 200, 20, "20 mm" }, { 199, 10, "10 mm" },   { 99, 5, "5 mm" },
                 { 49, 2, "2 mm" },    { 9.9, 0.5, "0.5 mm" }, { 12000, 1000, "1000 mm" } };
    for (size_t i = 0; i < sizeof bars / sizeof *bars; i++) {
        trip_annotation_bar bar = trip_annotation_scale_bar(&n, HEIGHT, 100, bars[i].max_px, "mm");
        assert_close(bar.length, bars[i].length, 1e-12);
        assert_close(bar.px, 10 * bars[i].length, 1e-9);
        assert_string_equal(bar.text, bars[i].text);
    }
    assert_string_equal(trip_annotation_scale_bar(&n, HEIGHT, 100, 200, NULL).text, "20");
    /* In perspective, the length depends on the distance. */
    trip_navigation_set_parallel(&n, false);
    double depth = trip_navigation_distance(&n);
    assert_close(trip_annotation_scale_bar(&n, HEIGHT, depth / 2, 200, NULL).length, 10, 1e-12);
}

/* In a view from the front and above, the ticks of x are below the box. */
static void ticks_are_round_numbers_on_the_lowest_edge(void **state)
{
    (void)state;
    trip_annotation_box b = box();
    trip_navigation n = parallel(0, -100, 50);
    trip_annotation_axis axes[3];
    trip_annotation_axes(&b, &n, WIDTH, HEIGHT, "mm", axes);
    assert_string_equal(axes[0].name, "x (mm)");
    assert_string_equal(axes[2].name, "z (mm)");
    static const char *const texts[] = { "-5", "0", "5" };
    assert_int_equal(axes[0].count, 3); /* 100 px hold two steps of 50 px */
    for (int i = 0; i < 3; i++) {
        const trip_annotation_tick *t = &axes[0].ticks[i];
        const double p[3] = { 5 * (i - 1), -10, -15 };
        double pixel[2];
        trip_navigation_project(&n, WIDTH, HEIGHT, p, pixel);
        assert_string_equal(t->text, texts[i]);
        assert_close(t->from[0], pixel[0], 1e-9);
        assert_close(t->from[1], pixel[1], 1e-9);
        assert_close(t->to[1], pixel[1] + 6, 1e-9);
        assert_true(t->label[1] > t->to[1]);
    }
    assert_true(axes[0].title[1] > axes[0].ticks[0].label[1]);
    /* In a view along y, the scale of y has no room. */
    n = parallel(0, -100, 0);
    trip_annotation_axes(&b, &n, WIDTH, HEIGHT, NULL, axes);
    assert_int_equal(axes[1].count, 0);
    assert_string_equal(axes[0].name, "x");
}

static void scales_of_oblique_axes_begin_at_the_corner(void **state)
{
    (void)state;
    const triptych_info info = { .edges = { { -0.5, -0.5, -0.5 }, { 9.5, 9.5, 9.5 } },
                                 .index_to_world = {
                                     { 3, -4, 0, 0 }, { 4, 3, 0, 7 }, { 0, 0, 5, 0 } } };
    trip_annotation_box b = trip_annotation_box_of(&info);
    const triptych_camera camera = { .eye = { 200, -300, 150 },
                                     .up = { 0, 0, 1 },
                                     .ortho_height = 90 };
    trip_navigation n = trip_navigation_from_camera(&camera, NULL);
    trip_annotation_axis axes[3];
    trip_annotation_axes(&b, &n, WIDTH, HEIGHT, "m", axes);
    assert_string_equal(axes[0].name, "i (m)");
    assert_string_equal(axes[1].name, "j (m)");
    assert_string_equal(axes[2].name, "z (m)");
    assert_string_equal(axes[0].ticks[0].text, "0");
    assert_string_equal(axes[0].ticks[axes[0].count - 1].text, "50"); /* 10 voxels of length 5 */
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_box_includes_whole_voxels_at_its_border),
        cmocka_unit_test(edges_of_the_box_are_projected),
        cmocka_unit_test(three_edges_are_hidden_from_outside_and_all_from_inside),
        cmocka_unit_test(steps_are_rounded_up_to_1_2_or_5),
        cmocka_unit_test(a_scale_bar_is_the_longest_that_fits),
        cmocka_unit_test(ticks_are_round_numbers_on_the_lowest_edge),
        cmocka_unit_test(scales_of_oblique_axes_begin_at_the_corner),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
