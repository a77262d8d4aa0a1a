/* Tests the positions of ticks, marks and labels in a plot. */
#include <math.h>
#include <stdlib.h>

#include "plot.h"
#include "test.h"

/* Returns the vertical position of the mark with this tooltip. */
static double mark_y(const char *svg, const char *title)
{
    const char *at = strstr(svg, title);
    assert_non_null(at);
    while (at > svg && strncmp(at, "cy='", 4) != 0)
        at--;
    return strtod(at + 4, NULL);
}

/* Returns the vertical position of the tick with this text. */
static double tick_y(const char *svg, const char *text)
{
    char end[32];
    snprintf(end, sizeof end, "'end'>%s</text>", text);
    const char *at = strstr(svg, end);
    assert_non_null(at);
    while (strncmp(at, "y='", 3) != 0)
        at--;
    return strtod(at + 3, NULL) - 4; /* the base line is 4 below the middle of the text */
}

static char *draw(const measure_point *points, int count, const char *const *names)
{
    const measure_series series = {
        .name = "<s>", .colour = "#000", .points = points, .count = count
    };
    return measure_plot_svg(&(measure_plot){ .width = 400,
                                             .height = 300,
                                             .x_title = "x",
                                             .y_title = "y",
                                             .names = names,
                                             .name_count = names ? count : 0,
                                             .y_min = 0.1,
                                             .series = &series,
                                             .count = 1 });
}

static void marks_are_at_the_ticks_of_their_values(void **state)
{
    static const measure_point points[] = { { .x = 1, .y = 10, .label = "one" },
                                            { .x = 100, .y = 1000, .label = "two" },
                                            { .x = 10, .y = 100, .label = "three" } };
    (void)state;
    char *svg = draw(points, 3, NULL);
    assert_true(fabs(mark_y(svg, "one: 1, 10<") - tick_y(svg, "10")) < 0.2);
    assert_true(fabs(mark_y(svg, "two: 100, 1e+03<") - tick_y(svg, "1000")) < 0.2);
    /* Both axes are logarithmic. */
    assert_true(fabs(2 * mark_y(svg, "three: ") - tick_y(svg, "10") - tick_y(svg, "1000")) < 0.4);
    assert_non_null(strstr(svg, "&lt;s&gt;</text>"));
    assert_true(!strncmp(svg, "<svg ", 5) && strstr(svg, "</svg>\n"));
    free(svg);
}

static void small_values_are_drawn_at_the_minimum(void **state)
{
    static const measure_point points[] = { { .x = 0, .y = 0 }, { .x = 1, .y = 10 } };
    static const char *const names[] = { "first", "second" };
    (void)state;
    char *svg = draw(points, 2, names);
    assert_true(fabs(mark_y(svg, "&lt;s&gt;, first: 0<") - tick_y(svg, "\342\211\244 0.1")) < 0.2);
    assert_non_null(strstr(svg, ">second</text>"));
    free(svg);
}

/* Many marks at one place have labels at different places. */
static void labels_do_not_overlap(void **state)
{
    measure_point points[8];
    char names[8][8];
    double x[8], y[8];
    (void)state;
    for (int i = 0; i < 8; i++) {
        snprintf(names[i], sizeof names[i], "mark-%d", i);
        points[i] = (measure_point){ .x = 10, .y = 10, .label = names[i] };
    }
    char *svg = draw(points, 8, NULL);
    int count = 0;
    for (const char *at = svg; (at = strstr(at, "<text x='")); at++) {
        int number;
        if (sscanf(at, "<text x='%lf' y='%lf' text-anchor='start'>mark-%d", &x[count], &y[count],
                   &number) == 3)
            count++;
    }
    assert_int_equal(count, 8);
    for (int i = 0; i < count; i++)
        for (int k = 0; k < i; k++)
            assert_true(fabs(x[i] - x[k]) > 30 || fabs(y[i] - y[k]) >= 12);
    free(svg);
}

static void no_points_give_an_empty_plot(void **state)
{
    (void)state;
    char *svg = draw(NULL, 0, NULL);
    assert_null(strstr(svg, "nan"));
    assert_null(strstr(svg, "inf"));
    free(svg);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(marks_are_at_the_ticks_of_their_values),
        cmocka_unit_test(small_values_are_drawn_at_the_minimum),
        cmocka_unit_test(labels_do_not_overlap),
        cmocka_unit_test(no_points_give_an_empty_plot),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
