/* Grids with uneven spacing (coordinates.h). Compares the integral with closed forms, sheets of
 * all renderers with the integral, and splats of the renderers with the reference. */
#include "cpu/kernels/isa.h"
#include "cpu_scenes.h"
#include "test.h"

#include <stdlib.h>

enum { EDGE = 20 };

/* A grid with steps that differ by up to a given ratio. Each axis has its own steps. */
typedef struct uneven {
    double tables[3][EDGE];
    trip_coordinates coordinates;
} uneven;

static void make_uneven(uneven *u, double max)
{
    const double *along[3];
    const int64_t voxels[3] = { EDGE, EDGE, EDGE };
    for (int a = 0; a < 3; a++) {
        double *x = u->tables[a];
        x[0] = 0;
        for (int i = 1; i < EDGE; i++)
            x[i] = x[i - 1] + pow(max, (scene_hash(a, i, 7) % 1000) / 999.0);
        const double last = x[EDGE - 1];
        for (int i = 1; i < EDGE; i++)
            x[i] *= (EDGE - 1) / last;
        x[EDGE - 1] = EDGE - 1;
        along[a] = x;
    }
    u->coordinates = trip_coordinates_make(along, voxels);
}

static trip_settings plain(double tolerance)
{
    trip_settings s = trip_settings_default();
    s.shading = false;
    s.tolerance = tolerance;
    s.background[3] = 0;
    return s;
}

static trip_settings post(int samples_per_sheet)
{
    trip_settings s = plain(1e-5);
    s.classify = TRIP_CLASSIFY_POST;
    s.samples_per_sheet = samples_per_sheet;
    return s;
}

static trip_settings splats(void)
{
    trip_settings s = plain(1e-5);
    s.classify = TRIP_CLASSIFY_PRE;
    s.footprint = TRIP_FOOTPRINT_EWA;
    return s;
}

static scene_picture integrate(const scene *s, const trip_camera_params *view,
                               const trip_settings *settings)
{
    return scene_integrate(s, view, settings, &(scene_making){ 0 });
}

static trip_camera_params view_of(const scene *s, int number, int size)
{
    static const trip_vec3 directions[] = {
        { 1, 0, 0 }, { 0.3, 0.5, 0.2 }, { -1, 2, 0.7 }, { 0.1, -0.2, -1 }
    };
    trip_camera_params view = scene_view(s, directions[number % 4], 60, 30, size);
    view.ortho_height = number / 4 % 2 ? 25 : 0;
    return view;
}

/* The grid fills the same box, whatever the spacing inside. */
static void a_constant_body_has_the_opacity_of_the_path_in_it(void **state)
{
    (void)state;
    uneven u;
    make_uneven(&u, 20);
    for (int i = 0; i < 16; i++) {
        scene s;
        int crossed = 0;
        scene_create(&s, &(scene_params){ .dims = { EDGE, EDGE, EDGE },
                                          .coordinates = &u.coordinates,
                                          .index_to_world =
                                              i / 8 ? scene_sheared : trip_affine_identity() });
        for (int code = 0; code < 65536; code++)
            s.table[code] = (trip_tf_entry){ 1, 0.5F, 0.25F, 0.05F };
        const trip_camera_params view = view_of(&s, i, 9);
        const trip_settings exact = plain(1e-6);
        scene_picture p = integrate(&s, &view, &exact);
        for (int n = 0; n < 81; n++) {
            trip_vec3 o, d;
            double from, to, alpha = 0;
            scene_ray(&s, &view, n % 9, n / 9, &o, &d);
            if (scene_ray_in_grid(&s, o, d, &from, &to))
                alpha = 1 - exp(-0.05F * (to - from) * scene_ray_stretch(&s, d));
            crossed += alpha > 0;
            assert_close(scene_pixel(&p, n % 9, n / 9)[3], alpha, 1e-6);
            assert_close(scene_pixel(&p, n % 9, n / 9)[1], alpha / 2, 1e-6);
        }
        assert_in_range(crossed, 5, 81);
        scene_picture_free(&p);
        scene_destroy(&s);
    }
}

/* Codes are proportional to the position along i. */
static bool ramp(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    const uneven *u = user;
    (void)j;
    (void)k;
    (void)gradient;
    *code = (unsigned)lround(3000 * u->tables[0][i]);
    return true;
}

/* A function linear in the position stays linear between voxels at any positions, apart from the
 * rounding of codes. */
static void a_ramp_is_equally_steep_for_any_voxel_positions(void **state)
{
    (void)state;
    uneven u;
    scene s;
    make_uneven(&u, 20);
    scene_create(&s, &(scene_params){ .dims = { EDGE, EDGE, EDGE },
                                      .coordinates = &u.coordinates,
                                      .voxel = ramp,
                                      .user = &u });
    for (int code = 0; code < 65536; code++)
        s.table[code] = (trip_tf_entry){ (float)code / 65535, 0, 0, 0.4F * (float)code / 65535 };
    for (int i = 0; i < 8; i++) {
        const trip_camera_params view = view_of(&s, i, 7);
        const trip_settings exact = plain(1e-6);
        scene_picture p = integrate(&s, &view, &exact);
        for (int n = 0; n < 49; n++) {
            trip_vec3 o, d;
            double from, to;
            scene_ray(&s, &view, n % 7, n / 7, &o, &d);
            if (!scene_ray_in_grid(&s, o, d, &from, &to))
                continue;
            double length = to - from, value = 3000 * (o.x + from * d.x) / 65535,
                   rise = 3000 * d.x / 65535;
            double through = exp(-0.4 * (value + rise * length / 2) * length);
            assert_close(scene_pixel(&p, n % 7, n / 7)[3], 1 - through, 5e-5);
        }
        scene_picture_free(&p);
    }
    scene_destroy(&s);
}

/* A ramp is lit like a plane at every voxel, because differences are divided by the distance of
 * the voxels. */
static void a_ramp_has_one_gradient(void **state)
{
    (void)state;
    uneven u;
    scene s;
    make_uneven(&u, 20);
    scene_create(&s, &(scene_params){ .dims = { EDGE, EDGE, EDGE },
                                      .coordinates = &u.coordinates,
                                      .normals = true,
                                      .voxel = ramp,
                                      .user = &u });
    for (int code = 0; code < 65536; code++)
        s.table[code] = (trip_tf_entry){ 0.5F, 0, 0, 0.4F };
    trip_camera_params view = scene_view(&s, trip_v3(0.6, 0.5, 0.2), 60, 20, 5);
    view.ortho_height = 8; /* every ray has the same light */
    trip_settings lit = plain(1e-6), sheets = post(2);
    lit.shading = sheets.shading = true;
    scene_picture p = integrate(&s, &view, &lit);
    scene_picture q = scene_draw(&s, &cpu_scenes_reference, &view, &sheets);
    double first = (double)p.rgba[0] / (double)p.rgba[3];
    assert_in_range(lround(1000 * fabs(first - 0.5)), 10, 500); /* the ramp is lit */
    for (int n = 0; n < 25; n++) {
        assert_close(p.rgba[4 * n] / p.rgba[4 * n + 3], first, 2e-4);
        assert_close(q.rgba[4 * n] / q.rgba[4 * n + 3], first, 2e-4);
    }
    scene_picture_free(&p);
    scene_picture_free(&q);
    scene_destroy(&s);
}

/* A blob about the grid's centre with a standard deviation of WIDTH. */
#define WIDTH 3.0
static bool blob(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    const uneven *u = user;
    const double middle = 0.5 * (EDGE - 1);
    const double x = u->tables[0][i] - middle, y = u->tables[1][j] - middle,
                 z = u->tables[2][k] - middle;
    const double value = 60000 * exp(-(x * x + y * y + z * z) / (2 * WIDTH * WIDTH));
    *code = (unsigned)lround(value);
    gradient[0] = -x * value * 1e-5;
    gradient[1] = -y * value * 1e-5;
    gradient[2] = -z * value * 1e-5;
    return true;
}

static void create_blob(scene *s, uneven *u, const trip_affine *map)
{
    scene_create(s, &(scene_params){ .dims = { EDGE, EDGE, EDGE },
                                     .index_to_world = map ? *map : trip_affine_identity(),
                                     .coordinates = &u->coordinates,
                                     .tile_voxels = 16,
                                     .normals = true,
                                     .voxel = blob,
                                     .user = u });
    for (int code = 0; code < 65536; code++)
        s->table[code] = (trip_tf_entry){ 1, (float)code / 65535, 0.25F, (float)code / 65535 };
}

/* The line integral of a Gaussian. Linear interpolation over a step h has an error of h^2 / 8
 * times the second derivative, which is at most 1 / WIDTH^2. */
static void a_gaussian_has_its_line_integral(void **state)
{
    (void)state;
    uneven u;
    scene s;
    make_uneven(&u, 3);
    create_blob(&s, &u, NULL);
    const double middle = 0.5 * (EDGE - 1), h = u.coordinates.widest;
    for (int i = 0; i < 8; i++) {
        const trip_camera_params view = view_of(&s, i, 7);
        const trip_settings exact = plain(1e-6);
        scene_picture p = integrate(&s, &view, &exact);
        for (int n = 0; n < 49; n++) {
            trip_vec3 o, d;
            scene_ray(&s, &view, n % 7, n / 7, &o, &d);
            trip_vec3 to = trip_sub(trip_v3(middle, middle, middle), o), across = trip_cross(to, d);
            double r2 = trip_dot(across, across), along = sqrt(2 * 3.14159265358979) * WIDTH;
            double depth = 60000.0 / 65535 * along * exp(-r2 / (2 * WIDTH * WIDTH));
            /* The constant allows for the end of the box. */
            double slack = 3 * h * h / (8 * WIDTH * WIDTH) * along + 0.01;
            double alpha = (double)scene_pixel(&p, n % 7, n / 7)[3];
            assert_true(alpha >= -expm1(-depth + slack) && alpha <= -expm1(-depth - slack));
        }
        assert_true((double)scene_pixel(&p, 3, 3)[3] > 0.99);
        scene_picture_free(&p);
    }
    scene_destroy(&s);
}

static double away_from(const scene_picture *truth, const scene *s, const scene_renderer *renderer,
                        const trip_camera_params *view, const trip_settings *settings)
{
    scene_picture p = scene_draw(s, renderer, view, settings);
    double away = scene_difference(truth, &p);
    scene_picture_free(&p);
    return away;
}

static void more_samples_per_sheet_converge_to_the_integral(void **state)
{
    (void)state;
    for (int i = 0; i < 20; i += TEST_BY_TURNS ? 3 : 1) {
        scene s;
        uneven u;
        make_uneven(&u, i < 10 ? 6 : 20);
        create_blob(&s, &u, i % 2 ? &scene_sheared : NULL);
        trip_camera_params view = view_of(&s, i % 10, 12);
        if (i % 10 >= 8) /* from inside */
            view.eye = trip_affine_point(&s.data->index_to_world, trip_v3(9.3, 7.7, 12.1));
        trip_settings fine = post(8), coarse = post(1), exact = plain(1e-6);
        fine.shading = coarse.shading = exact.shading = i / 2 % 2;
        scene_picture p = integrate(&s, &view, &exact);
        for (const scene_renderer *r = scene_renderers_post(); r->name; r++) {
            assert_true(away_from(&p, &s, r, &view, &fine) < (i < 10 ? 0.004 : 0.008));
            assert_true(away_from(&p, &s, r, &view, &coarse) < 0.15);
        }
        scene_picture_free(&p);
        scene_destroy(&s);
    }
}

/* If no ray is cut off, the optical depths of all splats add up to their masses. The mass of a
 * splat is its extinction times the volume of its own voxel. */
static void splats_have_the_mass_of_their_voxels(void **state)
{
    (void)state;
    enum { SIZE = 64 };
    uneven u;
    scene s;
    make_uneven(&u, 6);
    create_blob(&s, &u, NULL);
    for (int code = 0; code < 65536; code++)
        s.table[code].extinction = 1e-3F * (float)code / 65535;
    trip_camera_params view = scene_view(&s, trip_v3(0.3, 0.5, 0.2), 60, 30, SIZE);
    view.ortho_height = 60;
    trip_settings settings = splats();
    settings.field = TRIP_FIELD_SPLATS; /* selects the splats for the integral */
    double mass = 0;
    for (int n = 0; n < EDGE * EDGE * EDGE; n++) {
        const int at[3] = { n % EDGE, n / EDGE % EDGE, n / EDGE / EDGE };
        unsigned code;
        double gradient[3], volume = 1;
        blob(&u, at[0], at[1], at[2], &code, gradient);
        for (int a = 0; a < 3; a++)
            volume *= (u.tables[a][at[a] < EDGE - 1 ? at[a] + 1 : at[a]] -
                       u.tables[a][at[a] > 0 ? at[a] - 1 : at[a]]) /
                      (at[a] > 0 && at[a] < EDGE - 1 ? 2 : 1);
        mass += volume * (double)s.table[code].extinction;
    }
    const scene_renderer *const renderers[] = { &cpu_scenes_reference, &cpu_scenes_cpu };
    for (int i = 0; i < 3; i++) {
        scene_picture p = i < 2 ? scene_draw(&s, renderers[i], &view, &settings)
                                : integrate(&s, &view, &settings);
        double sum = 0, pixel = 60.0 / SIZE;
        for (int n = 0; n < SIZE * SIZE; n++)
            sum -= log1p(-(double)p.rgba[4 * n + 3]) * pixel * pixel;
        assert_close(sum / mass, 1, 2e-3);
        scene_picture_free(&p);
    }
    scene_destroy(&s);
}

static const int lone[3] = { 9, 12, 6 };

static bool one_voxel(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    (void)user;
    (void)gradient;
    *code = 7;
    return i == lone[0] && j == lone[1] && k == lone[2];
}

/* The splat has the kernel of even spacing, stretched along each axis like the voxel. */
static void a_splat_is_as_wide_as_its_voxel(void **state)
{
    (void)state;
    enum { SIZE = 15 };
    const double cutoff = TRIP_CUTOFF, edge = exp(-cutoff * cutoff / 2), extinction = 3;
    uneven u;
    double position[3], width[3];
    make_uneven(&u, 6);
    for (int a = 0; a < 3; a++) {
        const double *x = u.tables[a] + lone[a];
        position[a] = x[0];
        width[a] = (x[1] - x[-1]) / 2;
    }
    for (int i = 0; i < 8; i++) {
        scene s;
        int covered = 0;
        scene_create(&s, &(scene_params){ .dims = { EDGE, EDGE, EDGE },
                                          .coordinates = &u.coordinates,
                                          .voxel = one_voxel });
        s.table[7] = (trip_tf_entry){ 0.2F, 0.4F, 1, (float)extinction };
        trip_settings settings = plain(1e-7);
        settings.field = TRIP_FIELD_SPLATS;
        settings.kernel_radius = i % 2 ? 3 : 2;
        const double sigma = settings.kernel_radius / cutoff;
        trip_camera_params view = view_of(&s, i / 2, SIZE);
        view.look = trip_v3(position[0], position[1], position[2]);
        view.eye = trip_add(view.look, trip_scale(trip_sub(view.look, view.eye), 0.3));
        view.fov_degrees = 30;
        view.ortho_height = i / 4 ? 8 : 0;
        scene_picture p = integrate(&s, &view, &settings);
        for (int n = 0; n < SIZE * SIZE; n++) {
            trip_vec3 o, d;
            scene_ray(&s, &view, n % SIZE, n / SIZE, &o, &d);
            const trip_vec3 w = trip_v3(width[0], width[1], width[2]);
            const trip_vec3 own = trip_vec3_over(d, w),
                            to = trip_vec3_over(trip_sub(view.look, o), w);
            const trip_vec3 across = trip_cross(to, trip_scale(own, 1 / trip_length(own)));
            const double d2 = trip_dot(across, across) / (sigma * sigma);
            double footprint = d2 < cutoff * cutoff ? exp(-d2 / 2) - edge : 0;
            footprint /=
                2 * 3.14159265358979323846 * sigma * sigma * (1 - edge * (1 + cutoff * cutoff / 2));
            const double world = trip_length(d) / trip_length(own); /* of a voxel's step */
            const double alpha = -expm1(-extinction * world * footprint);
            covered += alpha > 0.01;
            assert_close(scene_pixel(&p, n % SIZE, n / SIZE)[3], alpha, 1e-6);
            assert_close(scene_pixel(&p, n % SIZE, n / SIZE)[1], 0.4F * alpha, 1e-6);
        }
        assert_in_range(covered, 5, SIZE * SIZE - 1);
        scene_picture_free(&p);
        scene_destroy(&s);
    }
}

static bool noise(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    (void)user;
    (void)gradient;
    *code = scene_hash(i, j, k) % 65536;
    return true;
}

/* Splats have one colour, so that their order does not matter. The low-pass filter adds a variance
 * that falls with the square of the pixel size. */
static void splats_of_one_colour_converge_to_their_integral(void **state)
{
    (void)state;
    enum { SIZE = 12, FINENESSES = 3 };
    uneven u;
    scene s;
    double errors[FINENESSES] = { 0 };
    make_uneven(&u, 6);
    scene_create(&s, &(scene_params){ .dims = { EDGE, EDGE, EDGE },
                                      .coordinates = &u.coordinates,
                                      .voxel = noise });
    for (int code = 0; code < 65536; code++)
        s.table[code] = (trip_tf_entry){ 0.9F, 0.6F, 0.3F, code > 40000 ? 0.1F : 0 };
    trip_settings settings = splats();
    settings.h = 0;
    settings.tolerance = 1e-6;
    settings.field = TRIP_FIELD_SPLATS;
    trip_camera_params view = scene_view(&s, trip_v3(1, 0.3, -0.4), 60, 0, SIZE);
    view.ortho_height = 6;
    scene_picture truth = integrate(&s, &view, &settings);
    for (int i = 0, finer = 1; i < FINENESSES; i++, finer *= 3) { /* the same rays */
        view.width = view.height = SIZE * finer;
        scene_picture p = scene_draw(&s, &cpu_scenes_reference, &view, &settings);
        for (int n = 0; n < SIZE * SIZE; n++) {
            const float *drawn =
                scene_pixel(&p, n % SIZE * finer + finer / 2, n / SIZE * finer + finer / 2);
            errors[i] = fmax(errors[i], test_max_apart(drawn, truth.rgba + 4 * n, 4));
        }
        scene_picture_free(&p);
    }
    assert_true(errors[0] > 1e-3);
    assert_close(errors[1] / errors[0], 1.0 / 9, 0.05);
    assert_close(errors[2] / errors[1], 1.0 / 9, 0.05);
    scene_picture_free(&truth);
    scene_destroy(&s);
}

static void compare(const scene *s, const trip_camera_params *view, const trip_settings *settings,
                    double max)
{
    scene_picture p = scene_draw(s, &cpu_scenes_reference, view, settings);
    for (unsigned threads = 1; threads <= 3; threads += 2) {
        cpu_scenes_threads = threads;
        scene_picture q = scene_draw(s, &cpu_scenes_cpu, view, settings);
        assert_true(scene_difference(&p, &q) <= max);
        scene_picture_free(&q);
    }
    cpu_scenes_threads = 3;
    scene_turn turn = scene_turns(scene_renderers() + 2, s, view, settings); /* gl */
    while (scene_take_turn(&turn)) {
        assert_true(scene_difference(&p, &turn.picture) <= max);
        const bool counted = settings->flatten <= 1 && settings->clip.count == 0;
        for (unsigned i = 0; i < s->data->list_count && counted; i++)
            scene_compare_counts(&p.lists[i], &turn.picture.lists[i], turn.renderer->name);
    }
    scene_picture_free(&p);
}

static void renderers_draw_the_splats_of_the_reference(void **state)
{
    (void)state;
    uneven u;
    make_uneven(&u, 6);
    for (int i = 0; i < 16; i++) {
        scene s;
        create_blob(&s, &u, i % 2 ? &scene_sheared : NULL);
        const trip_camera_params view = view_of(&s, i / 2, 40);
        trip_settings settings = splats();
        settings.shading = i % 3 == 0;
        settings.flatten = i % 4 == 1 ? 3 : 1;
        settings.compositing = i % 5 == 0 ? TRIP_COMPOSITING_SHEET : TRIP_COMPOSITING_SPLAT;
        settings.depth = i == 6;
        if (i / 2 % 2 && settings.flatten <= 1 && i % 5)
            settings.footprint = TRIP_FOOTPRINT_EXACT;
        compare(&s, &view, &settings, 2e-3);
        scene_destroy(&s);
    }
}

/* The test draws exact kernels in every form, and kernels near the eye. Each ray has its own
 * length in the index space of each near kernel. */
static bool in_the_middle(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    (void)user;
    (void)gradient;
    *code = 65535;
    return i == EDGE / 2 && j == EDGE / 2 && k == EDGE / 2;
}

/* Splats may be of any thickness. */
static void splats_are_zero_outside_their_support(void **state)
{
    (void)state;
    uneven u;
    scene s;
    make_uneven(&u, 3);
    scene_create(&s, &(scene_params){ .dims = { EDGE, EDGE, EDGE },
                                      .coordinates = &u.coordinates,
                                      .tile_voxels = 16,
                                      .voxel = in_the_middle });
    s.table[65535] = (trip_tf_entry){ 1, 1, 1, 1e6F };
    trip_settings settings = splats();
    trip_camera_params view = scene_view(&s, trip_v3(0.3, 0.5, 0.2), 60, 30, 40);
    view.ortho_height = 9;
    scene_picture expected = scene_draw(&s, &cpu_scenes_reference, &view, &settings);
    for (const trip_cpu_kernels *const *isa = trip_cpu_isas(); *isa; isa++) {
        setenv("TRIPTYCH_ISA", (*isa)->isa, 1);
        scene_picture p = scene_draw(&s, &cpu_scenes_cpu, &view, &settings);
        int outside = 0, left = 0;
        for (int i = 0; i < 40 * 40; i++)
            if (expected.rgba[4 * i + 3] == 0) {
                outside++;
                left += p.rgba[4 * i + 3] > 0;
            }
        assert_true(outside > 100 && outside < 1500);
        if (left > 0)
            fail_msg("%s: %d of %d pixels outside are not empty", (*isa)->isa, left, outside);
        scene_picture_free(&p);
    }
    unsetenv("TRIPTYCH_ISA");
    scene_picture_free(&expected);
    scene_destroy(&s);
}

static void gl_draws_exact_and_near_kernels(void **state)
{
    (void)state;
    for (int i = 0; i < 24; i += TEST_BY_TURNS ? 7 : 1) {
        scene s;
        uneven u;
        make_uneven(&u, i % 3 ? 6 : 20);
        create_blob(&s, &u, i % 2 ? &scene_sheared : NULL);
        trip_camera_params view = view_of(&s, i % 8, 40);
        if (i >= 16) /* from inside */
            view.eye = trip_affine_point(&s.data->index_to_world, trip_v3(9.3, 7.7, 12.1));
        trip_settings settings = splats();
        settings.footprint = i / 2 % 2 ? TRIP_FOOTPRINT_EXACT : TRIP_FOOTPRINT_EWA;
        settings.triangles = i % 3 == 1;
        settings.indexed = i % 5 == 1;
        settings.effects.cueing = i % 7 == 3 ? 0.6 : 0;
        settings.shading = i % 4 == 1;
        scene_picture p = scene_draw(&s, &cpu_scenes_reference, &view, &settings);
        scene_turn turn = scene_turns(scene_renderers() + 2, &s, &view, &settings);
        while (scene_take_turn(&turn)) {
            assert_true(scene_difference(&p, &turn.picture) <= 2e-3);
            for (unsigned n = 0; n < s.data->list_count && !settings.indexed; n++)
                scene_compare_counts(&p.lists[n], &turn.picture.lists[n], turn.renderer->name);
        }
        scene_picture_free(&p);
        scene_destroy(&s);
    }
}

/* Compares the renderers with the reference. */
static void compare_sheets(const scene *s, const trip_camera_params *view,
                           const trip_settings *settings, double max)
{
    scene_picture p = { 0 };
    scene_turn turn = scene_turns(scene_renderers_post(), s, view, settings);
    while (scene_take_turn(&turn))
        if (p.rgba) {
            assert_true(scene_difference(&p, &turn.picture) <= max);
        } else {
            p = turn.picture; /* the picture of the reference */
            turn.picture = (scene_picture){ 0 };
        }
    scene_picture_free(&p);
}

static void renderers_draw_the_sheets_of_the_reference(void **state)
{
    (void)state;
    for (int i = 0; i < 20; i++) {
        scene s;
        uneven u;
        make_uneven(&u, i % 3 ? 20 : 6);
        create_blob(&s, &u, i % 2 ? &scene_sheared : NULL);
        trip_camera_params view = view_of(&s, i / 2, 40);
        if (i >= 16) /* from inside */
            view.eye = trip_affine_point(&s.data->index_to_world, trip_v3(9.3, 7.7, 12.1));
        trip_settings settings = post(1 + i % 4);
        settings.shading = i % 3 == 0;
        settings.effects.cueing = i % 7 == 3 ? 0.6 : 0;
        settings.depth = i == 6;
        compare_sheets(&s, &view, &settings, 1e-3);
        scene_destroy(&s);
    }
}

/* Two layers across i with a gap between them. Voxels are close together there, and the second
 * layer is faintly visible. */
static bool gap(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    (void)user, (void)j, (void)k;
    (void)gradient;
    *code = i < 5 ? 1000 : 32000;
    return i < 5 || i >= 16;
}

/* Between two distant sheets, a segment passes many cells from the first layer to the second.
 * Every value between its ends is visible. */
static void voxels_skipped_by_a_segment_are_visible(void **state)
{
    (void)state;
    uneven u;
    scene s;
    make_uneven(&u, 1);
    for (int i = 1; i < EDGE - 1; i++) {
        u.tables[0][i] = i < 5 ? i : i < 16 ? 4 + 0.05 * (i - 4) : 4.6 + (i - 16) * 4.8;
        u.tables[2][i] = i < 10 ? 0.5 * i : 14.5 + 0.5 * (i - 10);
    }
    scene_create(&s, &(scene_params){ .dims = { EDGE, EDGE, EDGE },
                                      .coordinates = &u.coordinates,
                                      .voxel = gap });
    for (int code = 20000; code <= 32000; code++)
        s.table[code] = (trip_tf_entry){ 0.6F, 0.3F, 0.1F, code < 31000 ? 0.2F : 1e-4F };
    trip_camera_params view = scene_view(&s, trip_v3(7, 0.3, 11), 60, 30, 40);
    trip_settings settings = post(2);
    for (int lit = 0; lit < 2; lit++) {
        settings.shading = lit;
        scene_picture p = scene_draw(&s, &cpu_scenes_reference, &view, &settings);
        double sum = 0;
        for (int n = 0; n < 40 * 40; n++)
            sum += (double)p.rgba[4 * n + 3];
        assert_true(sum > 10);
        scene_picture_free(&p);
        compare_sheets(&s, &view, &settings, 1.0 / 255);
    }
    scene_destroy(&s);
}

/* The eye is among the splats. The lengths of rays differ in the index spaces of the splats near
 * the eye. When the CPU renderer sums splats, it takes these lengths from the ray through each
 * centre. */
static void from_inside_renderers_draw_the_splats_of_the_reference(void **state)
{
    (void)state;
    for (int i = 0; i < 16; i += TEST_BY_TURNS ? 5 : 1) {
        uneven u;
        make_uneven(&u, i % 4 ? i % 4 * 6 : 3);
        scene s;
        create_blob(&s, &u, i % 2 ? &scene_sheared : NULL);
        trip_camera_params view = scene_view(&s, trip_v3(0.3, 0.5, 0.2), 60, 60 + 2 * i, 40);
        view.eye = trip_affine_point(&s.data->index_to_world,
                                     i % 3 ? trip_v3(9.3, 7.7, 12.1) : trip_v3(4.2, 5.1, 14.7));
        trip_settings settings = splats();
        settings.footprint = i / 4 % 2 ? TRIP_FOOTPRINT_EXACT : TRIP_FOOTPRINT_EWA;
        settings.shading = i % 4 == 1;
        settings.depth = i == 5;
        settings.compositing = i == 3 ? TRIP_COMPOSITING_SHEET : TRIP_COMPOSITING_SPLAT;
        compare(&s, &view, &settings, i == 3 ? 0.06 : 1.0 / 255);
        scene_destroy(&s);
    }
}

static void create_body(scene *s, const uneven *u, unsigned tile, unsigned slab)
{
    scene_create(s, &(scene_params){ .dims = { EDGE, EDGE, EDGE },
                                     .coordinates = &u->coordinates,
                                     .tile_voxels = tile,
                                     .slab_sheets = slab });
    scene_colour(s, 65535, 65535, 1, 0.5, 0.25, 0.05);
}

/* A single brick is always read completely. Narrow views from anywhere need only some of many
 * bricks. */
static void culled_bricks_contain_nothing_visible(void **state)
{
    (void)state;
    uneven u;
    scene whole, parts;
    uint64_t left_out = 0;
    make_uneven(&u, 20);
    create_body(&whole, &u, 32, 32);
    create_body(&parts, &u, 16, 1);
    for (int i = 0; i < 40; i++) {
        trip_camera_params view = {
            .eye = { 24 * test_random() - 2, 24 * test_random() - 2, 24 * test_random() - 2 },
            .look = { 19 * test_random(), 19 * test_random(), 19 * test_random() },
            .up = { 0.1, 0.2, 1 },
            .fov_degrees = 10 + i,
            .ortho_height = i % 4 ? 0 : 3,
            .width = 8,
            .height = 12
        };
        trip_settings settings = i % 2 ? post(2) : splats();
        settings.footprint = i % 4 == 2 ? TRIP_FOOTPRINT_EWA : TRIP_FOOTPRINT_EXACT;
        scene_picture p = scene_draw(&whole, &cpu_scenes_reference, &view, &settings);
        scene_picture q = scene_draw(&parts, &cpu_scenes_reference, &view, &settings);
        assert_true(scene_difference(&p, &q) <= 1e-6);
        left_out += q.stats.all.splats_read < p.stats.all.splats_read;
        scene_picture_free(&p);
        scene_picture_free(&q);
    }
    assert_true(left_out > 10);
    scene_destroy(&whole);
    scene_destroy(&parts);
}

/* A grid with tables of even steps must draw the same picture as a grid without tables. */
static void even_coordinates_change_nothing(void **state)
{
    (void)state;
    uneven u;
    make_uneven(&u, 1);
    for (int i = 0; i < 8; i++) {
        scene with, without;
        uneven none = u;
        none.coordinates = (trip_coordinates){ .along = { NULL }, .widest = 1 };
        create_blob(&with, &u, i / 4 ? &scene_sheared : NULL);
        create_blob(&without, &none, i / 4 ? &scene_sheared : NULL);
        assert_true(trip_coordinates_uneven(&with.data->coordinates));
        assert_false(trip_coordinates_uneven(&without.data->coordinates));
        const trip_camera_params view = view_of(&with, i, 20);
        trip_settings settings[] = { post(2), splats() };
        settings[0].shading = i % 2;
        for (int n = 0; n < 4; n++) {
            const scene_renderer *r = n < 2 ? &cpu_scenes_reference : &cpu_scenes_cpu;
            scene_picture p = scene_draw(&with, r, &view, &settings[n % 2]);
            scene_picture q = scene_draw(&without, r, &view, &settings[n % 2]);
            assert_true(scene_difference(&p, &q) <= (n < 2 ? 1e-6 : n < 3 ? 1e-4 : 1e-3));
            scene_picture_free(&p);
            scene_picture_free(&q);
        }
        scene_picture p = integrate(&with, &view, &settings[0]);
        scene_picture q = integrate(&without, &view, &settings[0]);
        assert_true(scene_difference(&p, &q) <= 1e-6);
        scene_picture_free(&p);
        scene_picture_free(&q);
        scene_destroy(&with);
        scene_destroy(&without);
    }
}

/* Clipping uses the position of a voxel. */
static void voxels_are_clipped_by_position(void **state)
{
    (void)state;
    uneven u;
    make_uneven(&u, 6);
    scene s;
    create_blob(&s, &u, NULL);
    const trip_camera_params view = view_of(&s, 1, 32);
    trip_settings settings = splats(), sheets = post(8), exact = plain(1e-6);
    const trip_vec3 normal = { 0.8, 0.6, 0 };
    trip_clip_add(&settings.clip, normal, -13);
    sheets.clip = exact.clip = settings.clip;
    compare(&s, &view, &settings, 2e-3);
    scene_picture p = integrate(&s, &view, &exact);
    scene_picture q = scene_draw(&s, &cpu_scenes_reference, &view, &sheets);
    assert_true(scene_difference(&p, &q) < 0.006);
    compare_sheets(&s, &view, &sheets, 1e-3);
    scene_picture_free(&p);
    scene_picture_free(&q);
    scene_destroy(&s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_constant_body_has_the_opacity_of_the_path_in_it),
        cmocka_unit_test(a_ramp_is_equally_steep_for_any_voxel_positions),
        cmocka_unit_test(a_ramp_has_one_gradient),
        cmocka_unit_test(a_gaussian_has_its_line_integral),
        cmocka_unit_test(more_samples_per_sheet_converge_to_the_integral),
        cmocka_unit_test(splats_have_the_mass_of_their_voxels),
        cmocka_unit_test(a_splat_is_as_wide_as_its_voxel),
        cmocka_unit_test(splats_of_one_colour_converge_to_their_integral),
        cmocka_unit_test(renderers_draw_the_splats_of_the_reference),
        cmocka_unit_test(splats_are_zero_outside_their_support),
        cmocka_unit_test(gl_draws_exact_and_near_kernels),
        cmocka_unit_test(renderers_draw_the_sheets_of_the_reference),
        cmocka_unit_test(voxels_skipped_by_a_segment_are_visible),
        cmocka_unit_test(from_inside_renderers_draw_the_splats_of_the_reference),
        cmocka_unit_test(culled_bricks_contain_nothing_visible),
        cmocka_unit_test(even_coordinates_change_nothing),
        cmocka_unit_test(voxels_are_clipped_by_position),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
