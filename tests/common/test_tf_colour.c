#include "test.h"

#include "tf_colour.h"

typedef struct mixture {
    trip_colour_space space;
    double a[3], b[3], s, expected[3];
} mixture;

/* The expected values are from GetColor(s) of vtkColorTransferFunction of VTK 9.1, after
 * AddRGBPoint(0, a), AddRGBPoint(1, b) and SetHSVWrap(space is HSV_WRAP). */
static const mixture by_vtk[] = {
    { TRIP_COLOUR_RGB,
      { 0.231373, 0.298039, 0.752941 },
      { 0.705882, 0.0156863, 0.14902 },
      0.2,
      { 0.3262748, 0.24156846, 0.6321568 } },
    { TRIP_COLOUR_RGB,
      { 0.231373, 0.298039, 0.752941 },
      { 0.705882, 0.0156863, 0.14902 },
      0.75,
      { 0.58725475, 0.086274475, 0.30000025 } },
    { TRIP_COLOUR_RGB, { 0.1, 0.2, 0.05 }, { 0.9, 0.7, 0.95 }, 0.2, { 0.26, 0.3, 0.23 } },
    { TRIP_COLOUR_RGB, { 0.1, 0.2, 0.05 }, { 0.9, 0.7, 0.95 }, 0.75, { 0.7, 0.575, 0.725 } },
    { TRIP_COLOUR_RGB, { 0.5, 0.5, 0.5 }, { 0.8, 0.1, 0.3 }, 0.2, { 0.56, 0.42, 0.46 } },
    { TRIP_COLOUR_RGB, { 0.5, 0.5, 0.5 }, { 0.8, 0.1, 0.3 }, 0.75, { 0.725, 0.2, 0.35 } },
    { TRIP_COLOUR_RGB, { 0.9, 0.9, 0.9 }, { 0.4, 0.1, 0.5 }, 0.2, { 0.8, 0.74, 0.82 } },
    { TRIP_COLOUR_RGB, { 0.9, 0.9, 0.9 }, { 0.4, 0.1, 0.5 }, 0.75, { 0.525, 0.3, 0.6 } },
    { TRIP_COLOUR_RGB, { 0.9, 0.1, 0.2 }, { 0.5, 0.2, 0.8 }, 0.2, { 0.82, 0.12, 0.32 } },
    { TRIP_COLOUR_RGB, { 0.9, 0.1, 0.2 }, { 0.5, 0.2, 0.8 }, 0.75, { 0.6, 0.175, 0.65 } },
    { TRIP_COLOUR_RGB, { 0, 1, 1 }, { 1, 0.2, 0.1 }, 0.2, { 0.2, 0.84, 0.82 } },
    { TRIP_COLOUR_RGB, { 0, 1, 1 }, { 1, 0.2, 0.1 }, 0.75, { 0.75, 0.4, 0.325 } },
    { TRIP_COLOUR_HSV,
      { 0.231373, 0.298039, 0.752941 },
      { 0.705882, 0.0156863, 0.14902 },
      0.2,
      { 0.330526824, 0.186089242, 0.7435292 } },
    { TRIP_COLOUR_HSV,
      { 0.231373, 0.298039, 0.752941 },
      { 0.705882, 0.0156863, 0.14902 },
      0.75,
      { 0.71764675, 0.0670926414, 0.507414626 } },
    { TRIP_COLOUR_HSV,
      { 0.1, 0.2, 0.05 },
      { 0.9, 0.7, 0.95 },
      0.2,
      { 0.121578947, 0.35, 0.188582456 } },
    { TRIP_COLOUR_HSV,
      { 0.1, 0.2, 0.05 },
      { 0.9, 0.7, 0.95 },
      0.75,
      { 0.473928865, 0.469037829, 0.7625 } },
    { TRIP_COLOUR_HSV, { 0.5, 0.5, 0.5 }, { 0.8, 0.1, 0.3 }, 0.2, { 0.546, 0.56, 0.462 } },
    { TRIP_COLOUR_HSV,
      { 0.5, 0.5, 0.5 },
      { 0.8, 0.1, 0.3 },
      0.75,
      { 0.38515625, 0.24921875, 0.725 } },
    { TRIP_COLOUR_HSV, { 0.9, 0.9, 0.9 }, { 0.4, 0.1, 0.5 }, 0.2, { 0.82, 0.81344, 0.6888 } },
    { TRIP_COLOUR_HSV, { 0.9, 0.9, 0.9 }, { 0.4, 0.1, 0.5 }, 0.75, { 0.24, 0.3975, 0.6 } },
    { TRIP_COLOUR_HSV,
      { 0.9, 0.1, 0.2 },
      { 0.5, 0.2, 0.8 },
      0.2,
      { 0.88, 0.122222222, 0.425333333 } },
    { TRIP_COLOUR_HSV,
      { 0.9, 0.1, 0.2 },
      { 0.5, 0.2, 0.8 },
      0.75,
      { 0.723844401, 0.177604167, 0.825 } },
    { TRIP_COLOUR_HSV, { 0, 1, 1 }, { 1, 0.2, 0.1 }, 0.2, { 0.02, 1, 0.433777778 } },
    { TRIP_COLOUR_HSV, { 0, 1, 1 }, { 1, 0.2, 0.1 }, 0.75, { 1, 0.845833333, 0.075 } },
    { TRIP_COLOUR_LAB,
      { 0.231373, 0.298039, 0.752941 },
      { 0.705882, 0.0156863, 0.14902 },
      0.2,
      { 0.43526277, 0.26238697, 0.626264944 } },
    { TRIP_COLOUR_LAB,
      { 0.231373, 0.298039, 0.752941 },
      { 0.705882, 0.0156863, 0.14902 },
      0.75,
      { 0.65388351, 0.138599115, 0.296020041 } },
    { TRIP_COLOUR_LAB,
      { 0.1, 0.2, 0.05 },
      { 0.9, 0.7, 0.95 },
      0.2,
      { 0.254029136, 0.295607823, 0.211219081 } },
    { TRIP_COLOUR_LAB,
      { 0.1, 0.2, 0.05 },
      { 0.9, 0.7, 0.95 },
      0.75,
      { 0.6883816, 0.569714279, 0.702082898 } },
    { TRIP_COLOUR_LAB,
      { 0.5, 0.5, 0.5 },
      { 0.8, 0.1, 0.3 },
      0.2,
      { 0.580185363, 0.450009275, 0.458022295 } },
    { TRIP_COLOUR_LAB,
      { 0.5, 0.5, 0.5 },
      { 0.8, 0.1, 0.3 },
      0.75,
      { 0.742248006, 0.267417431, 0.347363455 } },
    { TRIP_COLOUR_LAB,
      { 0.9, 0.9, 0.9 },
      { 0.4, 0.1, 0.5 },
      0.2,
      { 0.804690839, 0.738477051, 0.819442237 } },
    { TRIP_COLOUR_LAB,
      { 0.9, 0.9, 0.9 },
      { 0.4, 0.1, 0.5 },
      0.75,
      { 0.532234992, 0.311724936, 0.599386759 } },
    { TRIP_COLOUR_LAB,
      { 0.9, 0.1, 0.2 },
      { 0.5, 0.2, 0.8 },
      0.2,
      { 0.851195971, 0.114092847, 0.322834593 } },
    { TRIP_COLOUR_LAB,
      { 0.9, 0.1, 0.2 },
      { 0.5, 0.2, 0.8 },
      0.75,
      { 0.65632374, 0.168725817, 0.647486273 } },
    { TRIP_COLOUR_LAB,
      { 0, 1, 1 },
      { 1, 0.2, 0.1 },
      0.2,
      { 0.616357581, 0.872331216, 0.811452441 } },
    { TRIP_COLOUR_LAB,
      { 0, 1, 1 },
      { 1, 0.2, 0.1 },
      0.75,
      { 0.949726354, 0.480426579, 0.323573343 } },
    { TRIP_COLOUR_DIVERGING,
      { 0.231373, 0.298039, 0.752941 },
      { 0.705882, 0.0156863, 0.14902 },
      0.2,
      { 0.484323636, 0.622024954, 0.975245369 } },
    { TRIP_COLOUR_DIVERGING,
      { 0.231373, 0.298039, 0.752941 },
      { 0.705882, 0.0156863, 0.14902 },
      0.5,
      { 0.865395197, 0.86541021, 0.865395561 } },
    { TRIP_COLOUR_DIVERGING,
      { 0.231373, 0.298039, 0.752941 },
      { 0.705882, 0.0156863, 0.14902 },
      0.75,
      { 0.958417217, 0.60311624, 0.48168512 } },
    { TRIP_COLOUR_DIVERGING,
      { 0.1, 0.2, 0.05 },
      { 0.9, 0.7, 0.95 },
      0.2,
      { 0, 0.47755138, 0.485633618 } },
    { TRIP_COLOUR_DIVERGING,
      { 0.1, 0.2, 0.05 },
      { 0.9, 0.7, 0.95 },
      0.5,
      { 0.865395197, 0.86541021, 0.865395561 } },
    { TRIP_COLOUR_DIVERGING,
      { 0.1, 0.2, 0.05 },
      { 0.9, 0.7, 0.95 },
      0.75,
      { 0.911954, 0.806963655, 0.935188216 } },
    { TRIP_COLOUR_DIVERGING,
      { 0.5, 0.5, 0.5 },
      { 0.8, 0.1, 0.3 },
      0.2,
      { 0.63344046, 0.519592097, 0.52595668 } },
    { TRIP_COLOUR_DIVERGING,
      { 0.5, 0.5, 0.5 },
      { 0.8, 0.1, 0.3 },
      0.5,
      { 0.783881749, 0.476892778, 0.505297061 } },
    { TRIP_COLOUR_DIVERGING,
      { 0.5, 0.5, 0.5 },
      { 0.8, 0.1, 0.3 },
      0.75,
      { 0.836042749, 0.359052259, 0.427782597 } },
    { TRIP_COLOUR_DIVERGING,
      { 0.9, 0.9, 0.9 },
      { 0.4, 0.1, 0.5 },
      0.2,
      { 0.979318608, 0.77333314, 0.801781974 } },
    { TRIP_COLOUR_DIVERGING,
      { 0.9, 0.9, 0.9 },
      { 0.4, 0.1, 0.5 },
      0.5,
      { 0.904329009, 0.513840315, 0.688926701 } },
    { TRIP_COLOUR_DIVERGING,
      { 0.9, 0.9, 0.9 },
      { 0.4, 0.1, 0.5 },
      0.75,
      { 0.69561058, 0.287204752, 0.603667725 } },
    { TRIP_COLOUR_DIVERGING,
      { 0.9, 0.1, 0.2 },
      { 0.5, 0.2, 0.8 },
      0.2,
      { 1, 0.544146957, 0.48075652 } },
    { TRIP_COLOUR_DIVERGING,
      { 0.9, 0.1, 0.2 },
      { 0.5, 0.2, 0.8 },
      0.5,
      { 0.974127135, 0.974143922, 0.974127543 } },
    { TRIP_COLOUR_DIVERGING,
      { 0.9, 0.1, 0.2 },
      { 0.5, 0.2, 0.8 },
      0.75,
      { 0.84779041, 0.658754877, 1 } },
    { TRIP_COLOUR_DIVERGING, { 0, 1, 1 }, { 1, 0.2, 0.1 }, 0.2, { 0.642542828, 1, 0.961481111 } },
    { TRIP_COLOUR_DIVERGING, { 0, 1, 1 }, { 1, 0.2, 0.1 }, 0.5, { 0.99998289, 1, 0.999983305 } },
    { TRIP_COLOUR_DIVERGING, { 0, 1, 1 }, { 1, 0.2, 0.1 }, 0.75, { 1, 0.620035728, 0.523325487 } },
    { TRIP_COLOUR_HSV, { 0.9, 0.1, 0.2 }, { 0.9, 0.7, 0.1 }, 0.2, { 0.78, 0.1, 0.9 } },
    { TRIP_COLOUR_HSV_WRAP, { 0.9, 0.1, 0.2 }, { 0.9, 0.7, 0.1 }, 0.2, { 0.9, 0.14, 0.1 } },
    { TRIP_COLOUR_HSV, { 0.9, 0.7, 0.1 }, { 0.9, 0.1, 0.2 }, 0.2, { 0.28, 0.9, 0.1 } },
    { TRIP_COLOUR_HSV_WRAP, { 0.9, 0.7, 0.1 }, { 0.9, 0.1, 0.2 }, 0.2, { 0.9, 0.56, 0.1 } },
};

static void mixtures_equal_the_mixtures_of_vtk(void **state)
{
    (void)state;
    for (size_t i = 0; i < sizeof by_vtk / sizeof *by_vtk; i++) {
        const mixture *m = &by_vtk[i];
        double c[3];
        trip_colour_between(m->space, m->a, m->b, m->s, c);
        for (int k = 0; k < 3; k++)
            assert_close(c[k], m->expected[k], 1e-6);
    }
}

/* Greys are not tested, because the diverging space gives them the hue of the other end. */
static void every_space_keeps_its_end_colours(void **state)
{
    (void)state;
    static const double ends[][3] = { { 0.9, 0.1, 0.2 }, { 0.1, 0.3, 0.8 }, { 0.2, 0.7, 0.3 },
                                      { 0.5, 0.2, 0.6 }, { 0.8, 0.7, 0.1 }, { 0.1, 0.6, 0.6 } };
    enum { ENDS = sizeof ends / sizeof *ends };
    for (int i = 0; i < ENDS * ENDS * (TRIP_COLOUR_STEP + 1); i++) {
        const double *a = ends[i % ENDS], *b = ends[i / ENDS % ENDS];
        trip_colour_space space = (trip_colour_space)(i / ENDS / ENDS);
        double from[3], to[3];
        trip_colour_between(space, a, b, 0, from);
        trip_colour_between(space, a, b, 1, to);
        for (int k = 0; k < 3; k++) {
            assert_close(from[k], a[k], 1e-3); /* VTK's matrices are rounded */
            assert_close(to[k], b[k], 1e-3);
        }
    }
}

static void between_equal_ends_the_colour_is_constant(void **state)
{
    (void)state;
    static const double grey[3] = { 0.5, 0.5, 0.5 }, black[3] = { 0 };
    for (int space = 0; space <= TRIP_COLOUR_STEP; space++) {
        double c[3];
        trip_colour_between((trip_colour_space)space, grey, grey, 0.3, c);
        assert_close(c[0], 0.5, 1e-3);
        trip_colour_between((trip_colour_space)space, black, black, 0.3, c);
        assert_close(c[0] + c[1] + c[2], 0, 1e-12);
    }
}

static void the_step_space_has_the_upper_colour_above_the_lower_value(void **state)
{
    (void)state;
    static const double a[3] = { 1, 0, 0 }, b[3] = { 0, 1, 0 };
    double c[3];
    trip_colour_between(TRIP_COLOUR_STEP, a, b, 0, c);
    assert_true(c[0] == 1 && c[1] == 0);
    trip_colour_between(TRIP_COLOUR_STEP, a, b, 0.01, c);
    assert_true(c[0] == 0 && c[1] == 1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(mixtures_equal_the_mixtures_of_vtk),
        cmocka_unit_test(every_space_keeps_its_end_colours),
        cmocka_unit_test(between_equal_ends_the_colour_is_constant),
        cmocka_unit_test(the_step_space_has_the_upper_colour_above_the_lower_value),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
