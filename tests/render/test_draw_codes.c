/* Draws fields whose values spread over decades, with uneven codes. The truth is the picture of the
 * values themselves: the integral of a field of them, or a data set with a table that holds every
 * value. A window over any 1 % of the sorted values must give the same picture. */
#include "test.h"

#include "scenes.h"

#include <stdlib.h>
#include <string.h>

enum { EDGE = 36, VOXELS = EDGE * EDGE * EDGE, KNOTS = 257 };

typedef struct values {
    double at[VOXELS];     /* i fastest */
    double sorted[VOXELS]; /* without repetitions */
    unsigned distinct;
    double knots[KNOTS];
    trip_codes exact, uneven;
} values;

typedef double (*field_value)(int i, int j, int k);

static double smooth(int i, int j, int k)
{
    const double x = (i - 17.3) / 18, y = (j - 17.8) / 18, z = (k - 16.9) / 18;
    return 0.5 + 0.25 * sin(2.1 * x + 0.7 * y) + 0.2 * cos(1.7 * z - 1.1 * x * y) +
           0.04 * sin(3 * y * z);
}

/* From about 1 to 162755 = e^12. */
static double exponential(int i, int j, int k)
{
    return exp(12 * smooth(i, j, k));
}

static double hot_voxel(int i, int j, int k)
{
    return i == 20 && j == 12 && k == 15 ? 1e6 : 800 * smooth(i, j, k);
}

static double without_hot_voxel(int i, int j, int k)
{
    return 800 * smooth(i, j, k);
}

/* A ball of values about 10^6 within values from 0 to 1. */
static double clusters(int i, int j, int k)
{
    const double x = i - 17.3, y = j - 17.8, z = k - 16.9;
    return smooth(i, j, k) + (x * x + y * y + z * z < 121 ? 1e6 : 0);
}

static int by_value(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Half of the codes follow the sorted values, half lie evenly between the extremes. */
static void make_knots(values *v)
{
    const double lo = v->sorted[0], hi = v->sorted[v->distinct - 1];
    for (int n = 0; n < KNOTS; n++) {
        double below = lo, above = hi;
        for (int step = 0; step < 200; step++) {
            const double middle = 0.5 * (below + above);
            unsigned less = 0, more = v->distinct;
            while (less < more) {
                const unsigned at = (less + more) / 2;
                if (v->sorted[at] < middle)
                    less = at + 1;
                else
                    more = at;
            }
            /* the rank between two values, linear so that knots do not repeat */
            double rank = less;
            if (less > 0 && less < v->distinct)
                rank = less - 1 +
                       (middle - v->sorted[less - 1]) / (v->sorted[less] - v->sorted[less - 1]);
            const double share = 0.5 * rank / (v->distinct - 1) + 0.5 * (middle - lo) / (hi - lo);
            if (share * (KNOTS - 1) < n)
                below = middle;
            else
                above = middle;
        }
        v->knots[n] = n == 0 ? lo : n == KNOTS - 1 ? hi : 0.5 * (below + above);
    }
}

static values *make_values(field_value of)
{
    values *v = calloc(1, sizeof *v);
    assert_non_null(v);
    for (int n = 0; n < VOXELS; n++)
        v->sorted[n] = v->at[n] = (float)of(n % EDGE, n / EDGE % EDGE, n / EDGE / EDGE);
    qsort(v->sorted, VOXELS, sizeof *v->sorted, by_value);
    for (int n = 0; n < VOXELS; n++)
        if (v->distinct == 0 || v->sorted[n] > v->sorted[v->distinct - 1])
            v->sorted[v->distinct++] = v->sorted[n];
    make_knots(v);
    v->exact = trip_codes_from_table(v->sorted, v->distinct, 0);
    v->uneven = trip_codes_from_table(v->knots, KNOTS, 8);
    return v;
}

typedef struct writing {
    const values *v;
    const trip_codes *codes;
} writing;

static bool voxel(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    const writing *w = user;
    (void)gradient;
    *code = trip_codes_nearest(w->codes, w->v->at[(k * EDGE + j) * EDGE + i]);
    return true;
}

static void write_scene(scene *s, const values *v, const trip_codes *codes)
{
    writing w = { v, codes };
    scene_create(s, &(scene_params){ .dims = { EDGE, EDGE, EDGE },
                                     .codes = codes,
                                     .voxel = voxel,
                                     .user = &w,
                                     .tile_voxels = 16 });
}

/* A window over 1 % of the sorted values: from transparent black to white. */
static void window_at(const values *v, double part, trip_tf_point points[2])
{
    const unsigned first = (unsigned)(part * 0.99 * v->distinct);
    points[0] = (trip_tf_point){ v->sorted[first], { 0, 0, 0, 0 } };
    points[1] = (trip_tf_point){ v->sorted[first + v->distinct / 100], { 1, 0.8, 0.3, 0.6 } };
}

static double mean_difference(const scene_picture *a, const scene_picture *b, double *max)
{
    double sum = 0;
    const int count = 4 * a->width * a->height;
    *max = 0;
    for (int i = 0; i < count; i++) {
        const double d = fabs((double)a->rgba[i] - (double)b->rgba[i]);
        sum += d;
        *max = fmax(*max, d);
    }
    return 255 * sum / count;
}

static void measure(const char *name, field_value of, bool shading)
{
    values *v = make_values(of);
    scene exact, uneven;
    write_scene(&exact, v, &v->exact);
    write_scene(&uneven, v, &v->uneven);
    static scene_function f, g;
    for (int w = 0; w < 5; w++) {
        trip_tf_point points[2];
        window_at(v, w / 4.0, points);
        scene_use_function(&exact, &f, points, 2);
        scene_use_function(&uneven, &g, points, 2);
        trip_camera_params view = scene_view(&exact, trip_v3(1, 0.4, 0.7), 90, 30, 48);
        trip_settings settings = scene_post(2);
        settings.shading = shading;
        scene_picture truth = scene_draw(&exact, scene_renderers(), &view, &settings);
        trip_settings fine = settings;
        fine.tolerance = 1e-5;
        scene_picture a = scene_integrate(&exact, &view, &fine, &(scene_making){ 0 });
        scene_picture b = scene_integrate(&uneven, &view, &fine, &(scene_making){ 0 });
        double max, mean = mean_difference(&a, &b, &max);
        printf("%s window %g..%g draw %g..%g opaque %.3f\n  integral mean %.3f max %.2f\n", name,
               points[0].value, points[1].value, g.draw.lo, g.draw.hi, scene_max_opaque(&truth),
               mean, 255 * max);
        mean = mean_difference(&a, &truth, &max);
        printf("  ref exact vs integral mean %.3f max %.2f\n", mean, 255 * max);
        for (const scene_renderer *r = scene_renderers_post(); r->name; r++) {
            scene_picture p = scene_draw(&uneven, r, &view, &settings);
            mean = mean_difference(&p, &truth, &max);
            printf("  %s mean %.3f max %.2f\n", r->name, mean, 255 * max);
            scene_picture_free(&p);
        }
        scene_picture_free(&truth);
        scene_picture_free(&a);
        scene_picture_free(&b);
    }
    scene_destroy(&exact);
    scene_destroy(&uneven);
    free(v);
}

static void m(void **state)
{
    (void)state;
    for (int s = 0; s < 2; s++) {
        measure("exp", exponential, s);
        measure("hot", hot_voxel, s);
        measure("clusters", clusters, s);
    }
}

int main(void)
{
    (void)without_hot_voxel;
    const struct CMUnitTest tests[] = { cmocka_unit_test(m) };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
