/* Draws fields with uneven codes and values that spread over decades. The truth is the picture of
 * the values themselves: the integral of a field of them, or a data set with a table that holds
 * every value. A window over any 1 % of the sorted values must give the same picture. */
#include "test.h"

#include "cpu/kernels/isa.h"
#include "cpu_scenes.h"
#include "dataset_level.h"
#include "ray_probe.h"
#include "shade.h"

#include <stdlib.h>
#include <string.h>

enum { EDGE = 40, VOXELS = EDGE * EDGE * EDGE, KNOTS = 257 };

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

/* Moves knots to the edges of wide gaps, so that no values share an interval with a gap. */
static void snap_knots(values *v)
{
    for (int n = 0; n + 1 < KNOTS; n++) {
        double *first = &v->knots[n], *last = &v->knots[n + 1], from = *first, to = *first;
        /* the widest part without values */
        for (unsigned i = 0; i + 1 < v->distinct; i++) {
            const double a = fmax(*first, v->sorted[i]), b = fmin(*last, v->sorted[i + 1]);
            if (b - a > to - from) {
                from = a;
                to = b;
            }
        }
        if (to - from < 0.5 * (*last - *first))
            continue;
        *first = n > 0 ? from : *first;
        *last = n + 2 < KNOTS ? to : *last;
    }
}

static values *make_values(field_value of)
{
    values *v = calloc(1, sizeof *v);
    assert_non_null(v);
    for (int n = 0; n < VOXELS; n++)
        v->sorted[n] = v->at[n] = of(n % EDGE, n / EDGE % EDGE, n / EDGE / EDGE);
    qsort(v->sorted, VOXELS, sizeof *v->sorted, by_value);
    for (int n = 0; n < VOXELS; n++)
        if (v->distinct == 0 || v->sorted[n] > v->sorted[v->distinct - 1])
            v->sorted[v->distinct++] = v->sorted[n];
    make_knots(v);
    snap_knots(v);
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

/* The typical range leaves out one value in a thousand on either side. */
static void write_tiled(scene *s, const values *v, const trip_codes *codes, unsigned tile_voxels)
{
    writing w = { v, codes };
    const unsigned tail = v->distinct / 1000;
    scene_create(s,
                 &(scene_params){ .dims = { EDGE, EDGE, EDGE },
                                  .codes = codes,
                                  .typical = { fmax(codes->lo, v->sorted[tail]),
                                               fmin(codes->hi, v->sorted[v->distinct - 1 - tail]) },
                                  .voxel = voxel,
                                  .user = &w,
                                  .tile_voxels = tile_voxels });
}

static bool lone_voxel(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    (void)user, (void)gradient;
    *code = 0;
    return i + j + k == 0;
}

static void write_scene(scene *s, const values *v, const trip_codes *codes)
{
    write_tiled(s, v, codes, 16);
}

/* A window over 1 % of the sorted values: from transparent to nearly opaque. */
static void window_at(const values *v, double part, trip_tf_point points[2])
{
    const unsigned first = (unsigned)(part * 0.99 * (v->distinct - 1));
    points[0] = (trip_tf_point){ v->sorted[first], { 0, 0, 0, 0 } };
    points[1] = (trip_tf_point){ v->sorted[first + v->distinct / 100], { 1, 0.8, 0.3, 0.6 } };
}

enum { WINDOWS = 5 };

/* Returns the mean difference of a component, in 255ths. */
static double mean_difference(const scene_picture *a, const scene_picture *b)
{
    double sum = 0;
    const int count = 4 * a->width * a->height;
    for (int i = 0; i < count; i++)
        sum += fabs((double)a->rgba[i] - (double)b->rgba[i]);
    return 255 * sum / count;
}

static trip_camera_params view_of(const scene *s)
{
    return scene_view(s, trip_v3(1, 0.4, 0.7), 90, 30, 48);
}

/* A data set with its tables and its picture by one renderer. */
typedef struct drawn {
    scene s;
    scene_function *f;
} drawn;

static drawn write_drawn(const values *v, const trip_codes *codes)
{
    drawn d = { .f = calloc(1, sizeof *d.f) };
    assert_non_null(d.f);
    write_scene(&d.s, v, codes);
    return d;
}

static void end_drawn(drawn *d)
{
    scene_destroy(&d->s);
    free(d->f);
}

/* Returns settings with the shading range of a session that has this window. */
static trip_settings settings_for(const trip_settings *settings, const trip_tf_point points[2])
{
    trip_settings s = *settings;
    s.shading_range = TRIP_SHADING_WIDTHS * (points[1].value - points[0].value);
    return s;
}

static scene_picture draw(drawn *d, const scene_renderer *renderer, const trip_tf_point points[2],
                          const trip_settings *settings)
{
    const trip_camera_params view = view_of(&d->s);
    const trip_settings s = settings_for(settings, points);
    scene_use_function(&d->s, d->f, points, 2);
    return scene_draw(&d->s, renderer, &view, &s);
}

/* ---- windows over few values ---- */

/* Compares every renderer with the reference of the exact values. The CPU renderer clamps values
 * outside of its draw codes, so its bound is larger. With shading, gradients beyond the range keep
 * their direction only roughly. */
static double bound_of(const scene_renderer *r, const trip_settings *settings, bool post)
{
    return strcmp(r->name, "cpu") != 0 || !post ? 0.25 : settings->shading ? 1.2 : 0.5;
}

static void compare_windows(field_value of, const trip_settings *settings, bool post)
{
    values *v = make_values(of);
    drawn exact = write_drawn(v, &v->exact), uneven = write_drawn(v, &v->uneven);
    for (int w = 0; w < WINDOWS; w++) {
        trip_tf_point points[2];
        window_at(v, w / (WINDOWS - 1.0), points);
        scene_picture truth = draw(&exact, scene_renderers(), points, settings);
        assert_true(scene_max_opaque(&truth) > 0.2);
        for (const scene_renderer *r = post ? scene_renderers_post() : scene_renderers(); r->name;
             r++) {
            scene_picture p = draw(&uneven, r, points, settings);
            const double off = mean_difference(&p, &truth);
            if (!(off <= bound_of(r, settings, post)))
                fail_msg("%s: window %g to %g: the picture is %.3f / 255 off", r->name,
                         points[0].value, points[1].value, off);
            scene_picture_free(&p);
        }
        scene_picture_free(&truth);
    }
    end_drawn(&exact);
    end_drawn(&uneven);
    free(v);
}

static const field_value fields[] = { exponential, hot_voxel, clusters };

static void a_window_over_few_values_shows_the_values(void **state)
{
    (void)state;
    for (int f = 0; f < 3; f++) {
        const trip_settings settings = scene_post(2);
        compare_windows(fields[f], &settings, true);
    }
}

static void a_lit_window_over_few_values_shows_the_values(void **state)
{
    (void)state;
    for (int f = 0; f < 3; f++) {
        trip_settings settings = scene_post(2);
        settings.shading = true;
        compare_windows(fields[f], &settings, true);
    }
}

static void kernels_of_64_voxels_show_the_values(void **state)
{
    (void)state;
    for (int kernel = TRIP_KERNEL_CUBIC; kernel <= TRIP_KERNEL_GAUSSIAN; kernel++) {
        trip_settings settings = scene_post(2);
        settings.kernel = (trip_kernel)kernel;
        settings.shading = kernel == TRIP_KERNEL_GAUSSIAN;
        compare_windows(exponential, &settings, true);
    }
}

static void shadows_fall_from_the_values(void **state)
{
    (void)state;
    trip_settings settings = scene_with_shadows(trip_v3(0.3, 1, 0.2));
    settings.samples_per_sheet = 2;
    compare_windows(exponential, &settings, true);
}

static void splats_have_the_colours_of_their_values(void **state)
{
    (void)state;
    for (int f = 0; f < 3; f++) {
        trip_settings settings = trip_settings_default();
        settings.shading = false;
        compare_windows(fields[f], &settings, false);
    }
}

/* Even codes clipped far outside of the window need no table. Even codes of the whole range show
 * that the comparison can fail. */
static void compare_with_clipped(field_value of, double before)
{
    const trip_settings settings = scene_post(2);
    values *v = make_values(of);
    drawn exact = write_drawn(v, &v->exact);
    const trip_codes whole = { .lo = v->exact.lo, .hi = v->exact.hi };
    drawn coarse = write_drawn(v, &whole);
    double max = 0;
    for (int w = 0; w < WINDOWS; w++) {
        trip_tf_point points[2];
        window_at(v, w / (WINDOWS - 1.0), points);
        const double width = points[1].value - points[0].value;
        const trip_codes near = { .lo = fmax(whole.lo, points[0].value - 200 * width),
                                  .hi = fmin(whole.hi, points[1].value + 200 * width) };
        drawn clipped = write_drawn(v, &near);
        scene_picture a = draw(&exact, scene_renderers(), points, &settings);
        scene_picture b = draw(&clipped, scene_renderers(), points, &settings);
        scene_picture c = draw(&coarse, scene_renderers(), points, &settings);
        assert_true(mean_difference(&a, &b) < 0.1);
        max = fmax(max, mean_difference(&a, &c));
        end_drawn(&clipped);
        scene_picture_free(&a);
        scene_picture_free(&b);
        scene_picture_free(&c);
    }
    if (max < before)
        fail_msg("even codes of the whole range are only %g / 255 off", max);
    end_drawn(&exact);
    end_drawn(&coarse);
    free(v);
}

static void exact_values_equal_a_clipped_data_set_with_even_codes(void **state)
{
    (void)state;
    compare_with_clipped(exponential, 0);
    compare_with_clipped(hot_voxel, 1.5);
}

/* Makes a field of the values. Code 0 stands for `lo` and 65535 for `hi`. */
static trip_field *field_of(const scene *s, const values *v, double lo, double hi)
{
    trip_field *field;
    assert_int_equal(trip_field_create(&field, (int64_t[3]){ EDGE, EDGE, EDGE }, s->budget), 0);
    for (int n = 0; n < VOXELS; n++) {
        const int64_t at[3] = { n % EDGE, n / EDGE % EDGE, n / EDGE / EDGE };
        assert_int_equal(trip_field_put(field, at, (v->at[n] - lo) / (hi - lo) * 65535, NULL), 0);
    }
    const trip_field_map map = { .index_to_world = s->data->index_to_world,
                                 .value_per_code = (hi - lo) / 65535 };
    assert_int_equal(trip_field_finish(field, &map), 0);
    return field;
}

/* The truth has codes of the window alone, which reach far beyond 0 and 65535. */
static void the_integral_shows_the_values(void **state)
{
    (void)state;
    trip_settings settings = scene_post(2);
    settings.tolerance = 1e-5;
    for (int f = 0; f < 3; f++) {
        values *v = make_values(fields[f]);
        drawn uneven = write_drawn(v, &v->uneven);
        const trip_camera_params view = view_of(&uneven.s);
        for (int w = 0; w < WINDOWS; w++) {
            trip_tf_point points[2];
            window_at(v, w / (WINDOWS - 1.0), points);
            const trip_codes window = { .lo = points[0].value, .hi = points[1].value };
            drawn alone = write_drawn(v, &window);
            scene_use_function(&alone.s, alone.f, points, 2);
            scene_use_function(&uneven.s, uneven.f, points, 2);
            trip_field *field = field_of(&alone.s, v, window.lo, window.hi);
            scene_picture truth =
                scene_integrate(&alone.s, &view, &settings, &(scene_making){ .field = field });
            scene_picture p = scene_integrate(&uneven.s, &view, &settings, &(scene_making){ 0 });
            assert_true(scene_max_opaque(&truth) > 0.2);
            assert_true(mean_difference(&p, &truth) < 0.1);
            scene_picture_free(&truth);
            scene_picture_free(&p);
            trip_field_destroy(field);
            end_drawn(&alone);
        }
        end_drawn(&uneven);
        free(v);
    }
}

/* A field of values with a unit gives the picture of a field of codes. */
static void a_field_of_values_is_converted_when_it_is_drawn(void **state)
{
    (void)state;
    trip_settings settings = scene_post(2);
    settings.tolerance = 1e-5;
    values *v = make_values(exponential);
    drawn uneven = write_drawn(v, &v->uneven);
    const trip_camera_params view = view_of(&uneven.s);
    trip_field *field = field_of(&uneven.s, v, 0, 65535); /* codes equal values */
    for (int w = 0; w < WINDOWS; w++) {
        trip_tf_point points[2];
        window_at(v, w / (WINDOWS - 1.0), points);
        scene_use_function(&uneven.s, uneven.f, points, 2);
        const trip_draw_codes *d = uneven.s.draw;
        trip_field_set_unit(field, (trip_field_unit){ d->lo, 1 / trip_draw_value_per_code(d) });
        scene_picture p =
            scene_integrate(&uneven.s, &view, &settings, &(scene_making){ .field = field });
        scene_picture q = scene_integrate(&uneven.s, &view, &settings, &(scene_making){ 0 });
        assert_true(scene_max_opaque(&q) > 0.2);
        assert_true(mean_difference(&p, &q) < 0.1);
        scene_picture_free(&p);
        scene_picture_free(&q);
    }
    trip_field_destroy(field);
    end_drawn(&uneven);
    free(v);
}

/* ---- coarse levels ---- */

/* Writes the same values as the coarse level of a grid of twice the size along each axis. */
static void write_coarse(scene *fine, const values *v, const trip_codes *codes)
{
    writing w = { v, codes };
    const scene_part part = {
        .level = 1, .kind = TRIP_KIND_VALUES, .by = { 2, 2, 2 }, .voxel = voxel, .user = &w
    };
    scene_create(fine, &(scene_params){ .dims = { 2 * EDGE, 2 * EDGE, 2 * EDGE },
                                        .codes = codes,
                                        .voxel = lone_voxel,
                                        .tile_voxels = 16,
                                        .parts = &part,
                                        .part_count = 1 });
}

static void coarse_levels_show_the_values(void **state)
{
    (void)state;
    static scene_function f[2];
    const trip_settings settings = scene_post(2);
    values *v = make_values(exponential);
    const trip_codes *codes[2] = { &v->exact, &v->uneven };
    scene fine[2], coarse[2];
    trip_tf_point points[2];
    window_at(v, 0.25, points);
    for (int n = 0; n < 2; n++) {
        write_coarse(&fine[n], v, codes[n]);
        coarse[n] = fine[n];
        assert_int_equal(trip_dataset_level_open(&coarse[n].data, fine[n].data, 1), 0);
        coarse[n].level = 1;
        scene_use_function(&coarse[n], &f[n], points, 2);
    }
    trip_camera_params view = scene_view(&fine[0], trip_v3(1, 0.4, 0.7), 180, 30, 48);
    scene_picture truth = scene_draw(&coarse[0], scene_renderers(), &view, &settings);
    assert_true(scene_max_opaque(&truth) > 0.2);
    for (const scene_renderer *r = scene_renderers_post(); r->name; r++) {
        scene_picture p = scene_draw(&coarse[1], r, &view, &settings);
        assert_true(mean_difference(&p, &truth) < 0.25);
        scene_picture_free(&p);
    }
    scene_picture_free(&truth);
    for (int n = 0; n < 2; n++) {
        trip_dataset_level_close(coarse[n].data);
        scene_destroy(&fine[n]);
    }
    free(v);
}

/* ---- one hot voxel ---- */

/* Whether a ray passes a voxel within the cells and gradients that the voxel is part of. */
static bool is_reached(const scene *s, const trip_camera_params *view, int x, int y,
                       trip_vec3 voxel)
{
    trip_vec3 origin, direction;
    scene_ray(s, view, x, y, &origin, &direction);
    const trip_vec3 to = trip_sub(voxel, origin);
    return trip_length(trip_cross(to, direction)) < 2 * sqrt(3);
}

static void a_hot_voxel_changes_only_the_pixels_of_its_cells(void **state)
{
    (void)state;
    trip_settings settings = scene_post(2);
    settings.shading = true;
    values *with = make_values(hot_voxel), *without = make_values(without_hot_voxel);
    drawn a = write_drawn(with, &with->uneven), b = write_drawn(without, &without->uneven);
    const trip_camera_params view = view_of(&a.s);
    for (int w = 0; w < WINDOWS; w++) {
        trip_tf_point points[2];
        window_at(without, w / (WINDOWS - 1.0), points);
        for (const scene_renderer *r = scene_renderers_post(); r->name; r++) {
            scene_picture p = draw(&a, r, points, &settings);
            scene_picture q = draw(&b, r, points, &settings);
            for (int i = 0; i < 4 * p.width * p.height; i++) {
                const int x = i / 4 % p.width, y = i / 4 / p.width;
                if (!is_reached(&a.s, &view, x, y, trip_v3(20, 12, 15)))
                    assert_close(p.rgba[i], q.rgba[i], 2.0 / 255);
            }
            scene_picture_free(&p);
            scene_picture_free(&q);
        }
    }
    end_drawn(&a);
    end_drawn(&b);
    free(with);
    free(without);
}

/* ---- the CPU renderer ---- */

static void threads_tiles_and_kernels_of_the_cpu_draw_the_same(void **state)
{
    (void)state;
    values *v = make_values(exponential);
    trip_tf_point points[2];
    window_at(v, 0.25, points);
    trip_settings settings = scene_post(3);
    settings.shading = true;
    settings = settings_for(&settings, points);
    drawn first = write_drawn(v, &v->uneven);
    const trip_camera_params view = view_of(&first.s);
    for (const trip_cpu_kernels *const *isa = trip_cpu_isas(); *isa; isa++) {
        setenv("TRIPTYCH_ISA", (*isa)->isa, 1);
        cpu_scenes_threads = 1;
        scene_picture truth = draw(&first, &cpu_scenes_cpu, points, &settings);
        assert_non_null(first.f->draw.of_stored);
        for (unsigned threads = 1; threads < 6; threads += 2) {
            drawn d = { .f = first.f };
            cpu_scenes_threads = threads;
            write_tiled(&d.s, v, &v->uneven, 16 << threads / 2);
            scene_use_function(&d.s, d.f, points, 2);
            scene_picture p = scene_draw(&d.s, &cpu_scenes_cpu, &view, &settings);
            assert_memory_equal(p.rgba, truth.rgba, 16 * (size_t)p.width * (size_t)p.height);
            scene_picture_free(&p);
            scene_destroy(&d.s);
        }
        scene_picture_free(&truth);
    }
    unsetenv("TRIPTYCH_ISA");
    cpu_scenes_threads = 3;
    end_drawn(&first);
    free(v);
}

/* ---- draw codes ---- */

/* The typical range reaches up to `typical_max`. */
static trip_draw_codes codes_about(const trip_codes *stored, double typical_max,
                                   const trip_tf_point *points, size_t count,
                                   uint16_t map[TRIP_CODES])
{
    trip_tf *tf;
    const double typical[2] = { stored->lo, typical_max };
    assert_int_equal(trip_tf_from_points(&tf, points, count, false, 0), 0);
    const trip_draw_codes d = trip_draw_codes_for(tf, stored, typical, map);
    trip_tf_destroy(tf);
    return d;
}

static trip_draw_codes codes_for(const trip_codes *stored, const trip_tf_point *points,
                                 size_t count, uint16_t map[TRIP_CODES])
{
    return codes_about(stored, stored->hi, points, count, map);
}

static void even_codes_are_drawn_as_stored(void **state)
{
    (void)state;
    const trip_codes even = { .lo = -5, .hi = 7 };
    const trip_tf_point points[2] = { { 1, { 0, 0, 0, 0 } }, { 1.001, { 1, 1, 1, 1 } } };
    const trip_draw_codes d = codes_for(&even, points, 2, NULL);
    assert_null(d.of_stored);
    assert_true(d.lo == -5 && d.hi == 7);
    assert_int_equal(trip_draw_code(&d, 1234), 1234);
    assert_true(trip_draw_code_exact(&d, 1234) == 1234);
}

/* Values from 0 to 1000, with half of the codes below 1. */
static const double hockey[3] = { 0, 1, 1000 };

static void the_range_of_draw_codes_holds_the_function_and_a_wide_margin(void **state)
{
    (void)state;
    static uint16_t map[TRIP_CODES];
    const trip_codes stored = trip_codes_from_table(hockey, 3, 15);
    const trip_tf_point narrow[2] = { { 0.5, { 0, 0, 0, 0 } }, { 0.51, { 1, 1, 1, 1 } } };
    trip_draw_codes d = codes_for(&stored, narrow, 2, map);
    assert_true(d.lo == 0);
    assert_close((0.51 - 0.5) / trip_draw_value_per_code(&d), 32, 0.1);
    for (unsigned code = 1; code < TRIP_CODES; code++)
        assert_true(map[code] >= map[code - 1]);
    assert_int_equal(map[0], 0);
    assert_int_equal(map[65535], 65535);
    assert_close(trip_draw_code_exact(&d, 65535), 65535 * (trip_codes_value(&stored, 65535) / d.hi),
                 1e-6);

    /* If the typical values fit into the range, there are more codes. */
    d = codes_about(&stored, 1, narrow, 2, map);
    assert_true(d.lo == 0);
    assert_close(d.hi, 3, 1e-12); /* the typical width three times */
    d = codes_about(&stored, 9, narrow, 2, map);
    assert_close((0.51 - 0.5) / trip_draw_value_per_code(&d), 64, 0.1);

    /* Three points have more codes, but not more than stored codes, 1 / 32768 apart. */
    const trip_tf_point tent[3] = { { 0.5, { 0, 0, 0, 0 } },
                                    { 0.501, { 1, 1, 1, 1 } },
                                    { 0.51, { 0, 0, 0, 0 } } };
    d = codes_for(&stored, tent, 3, map);
    assert_close(0.001 / trip_draw_value_per_code(&d), 0.001 * 32768 / 2, 0.1);

    /* Equal ends of the function do not count. */
    const trip_tf_point flat[4] = { { -1e6, { 1, 0, 0, 0 } },
                                    { 0.5, { 0, 1, 0, 0 } },
                                    { 0.51, { 1, 1, 1, 1 } },
                                    { 1e6, { 1, 1, 1, 1 } } };
    d = codes_for(&stored, flat, 4, map);
    assert_close(0.01 / trip_draw_value_per_code(&d), 32, 0.1);

    /* A function of the whole range needs the whole range. */
    const trip_tf_point wide[2] = { { 0, { 0, 0, 0, 0 } }, { 1000, { 1, 1, 1, 1 } } };
    d = codes_for(&stored, wide, 2, map);
    assert_true(d.lo == 0 && d.hi == stored.hi);

    /* A step takes the distance of the stored codes, 1 / 32768. */
    const trip_tf_point step[2] = { { 0.5, { 0, 0, 0, 0 } }, { 0.5, { 1, 1, 1, 1 } } };
    d = codes_for(&stored, step, 2, map);
    assert_close(trip_draw_value_per_code(&d), 2.0 / 32768, 1e-9);

    /* A part of few stored codes has as many draw codes. */
    const double apart = (1000 - 1) / 32768.0;
    const trip_tf_point sparse[2] = { { 500, { 0, 0, 0, 0 } },
                                      { 500 + 9 * apart, { 1, 1, 1, 1 } } };
    d = codes_for(&stored, sparse, 2, map);
    assert_true(d.lo == 0 && d.hi == stored.hi); /* 65536 such codes hold all values */

    /* No value is where the function changes. */
    const trip_tf_point outside[2] = { { 2000, { 0, 0, 0, 0 } }, { 2001, { 1, 1, 1, 1 } } };
    d = codes_for(&stored, outside, 2, map);
    assert_true(d.lo == 0 && d.hi == stored.hi);
}

static void a_part_that_draw_codes_lose_is_reported(void **state)
{
    (void)state;
    static uint16_t map[TRIP_CODES];
    const trip_codes stored = trip_codes_from_table(hockey, 3, 15);
    const trip_tf_point points[3] = { { 0.5, { 0, 0, 0, 0 } },
                                      { 0.6, { 1, 0, 0, 0.2 } },
                                      { 900, { 0, 1, 0, 0.9 } } };
    for (size_t count = 2; count <= 3; count++) {
        trip_tf *tf;
        trip_draw_loss loss;
        const trip_draw_codes d = codes_for(&stored, points, count, map);
        assert_int_equal(trip_tf_from_points(&tf, points, count, false, 0), 0);
        assert_int_equal(trip_draw_codes_loss(&d, tf, &loss), count == 3);
        trip_tf_destroy(tf);
        if (count < 3)
            continue;
        assert_true(loss.lo == 0.5 && loss.hi == 0.6 && loss.first == 0.5 && loss.last == 900);
        assert_close(loss.codes, 0.1 * 65535 / d.hi, 0.01);
    }
}

/* Neighbouring ids lie far apart, or differ by 1. */
static void ids_have_the_colours_of_their_points(void **state)
{
    (void)state;
    static trip_tf_entry table[TRIP_CODES];
    const double ids[4] = { 0, 7, 8, 0x1p40 };
    const trip_codes stored = trip_codes_from_table(ids, 4, 0);
    const trip_tf_point points[4] = { { 0, { 0, 0, 0, 0 } },
                                      { 7, { 1, 0, 0, 0.5 } },
                                      { 8, { 0, 1, 0, 0.25 } },
                                      { 0x1p40, { 0, 0, 1, 0.75 } } };
    trip_tf *tf;
    assert_int_equal(trip_tf_from_points(&tf, points, 4, false, 0), 0);
    const trip_draw_codes d = trip_draw_codes_as_stored(&stored);
    trip_draw_codes_stored_table(&d, tf, 2, table);
    for (int n = 0; n < 4; n++) {
        const trip_rgba *c = &points[n].colour;
        assert_true(table[n].r == (float)c->r && table[n].g == (float)c->g &&
                    table[n].b == (float)c->b);
        assert_close(table[n].extinction, -log(1 - c->opacity) / 2, 1e-7);
    }
    trip_tf_destroy(tf);
}

/* ---- the point under the pointer, heat ---- */

/* Along the ray, values are the means of their neighbours, not the values of mean codes. */
static void the_probe_interpolates_values(void **state)
{
    (void)state;
    values *v = make_values(exponential);
    drawn exact = write_drawn(v, &v->exact);
    trip_tf_point points[2] = { { v->exact.lo, { 1, 1, 1, 0.9999 } },
                                { v->exact.hi, { 1, 1, 1, 0.9999 } } };
    const double at[2] = { 10.25, 20.5 };
    scene_use_function(&exact.s, exact.f, points, 2);
    trip_ray_probe p = { .data = exact.s.data,
                         .budget = exact.s.budget,
                         .table = exact.s.table,
                         .draw = *exact.s.draw,
                         .origin = { -3, at[0], at[1] },
                         .direction = { 1, 0, 0 },
                         .world_per_z = 1 };
    trip_ray_hit hit;
    double sum = 0;
    for (int n = 0; n < 4; n++) {
        const int j = (int)at[0] + (n & 1), k = (int)at[1] + (n >> 1);
        sum += v->at[(k * EDGE + j) * EDGE] * (n & 1 ? 0.25 : 0.75) * 0.5;
    }
    assert_int_equal(
        trip_reader_create(&p.reader, exact.s.data, &(trip_reader_params){ 0 }, exact.s.budget), 0);
    assert_int_equal(trip_ray_probe_find(&p, &hit), 0);
    trip_reader_destroy(p.reader);
    const double value = p.draw.lo + hit.code * trip_draw_value_per_code(&p.draw);
    assert_close(value / sum, 1, 1e-9);
    end_drawn(&exact);
    free(v);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(even_codes_are_drawn_as_stored),
        cmocka_unit_test(the_range_of_draw_codes_holds_the_function_and_a_wide_margin),
        cmocka_unit_test(a_part_that_draw_codes_lose_is_reported),
        cmocka_unit_test(ids_have_the_colours_of_their_points),
        cmocka_unit_test(a_window_over_few_values_shows_the_values),
        cmocka_unit_test(a_lit_window_over_few_values_shows_the_values),
        cmocka_unit_test(kernels_of_64_voxels_show_the_values),
        cmocka_unit_test(shadows_fall_from_the_values),
        cmocka_unit_test(splats_have_the_colours_of_their_values),
        cmocka_unit_test(exact_values_equal_a_clipped_data_set_with_even_codes),
        cmocka_unit_test(the_integral_shows_the_values),
        cmocka_unit_test(a_field_of_values_is_converted_when_it_is_drawn),
        cmocka_unit_test(coarse_levels_show_the_values),
        cmocka_unit_test(a_hot_voxel_changes_only_the_pixels_of_its_cells),
        cmocka_unit_test(threads_tiles_and_kernels_of_the_cpu_draw_the_same),
        cmocka_unit_test(the_probe_interpolates_values),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
