/* Tests that every renderer with post-classification must pass: closed forms, order, and
 * convergence to the integral with more samples per sheet. */
#include "scenes.h"
#include "test.h"

#include <string.h>

#include "shade.h"
#include "sheet.h"

enum { EDGE = 20 }; /* voxels of most volumes; EDGE - 1 between the outermost centres */

static void fill_table(scene *s, double r, double g, double b, double extinction)
{
    for (int code = 0; code < 65536; code++)
        s->table[code] = (trip_tf_entry){ (float)r, (float)g, (float)b, (float)extinction };
}

/* Returns a view from a direction in index space. */
static trip_camera_params view_along(const scene *s, trip_vec3 direction, double fov, int size)
{
    return scene_view(s, trip_affine_vector(&s->data->index_to_world, direction), 80, fov, size);
}

static bool is_at_face(const scene *s, trip_vec3 o, trip_vec3 d, double t, int axis)
{
    double x = trip_component(o, axis) + t * trip_component(d, axis);
    return fabs(x) < 1e-9 || fabs(x - (double)s->data->header.dims[axis] + 1) < 1e-9;
}

static void a_slab_has_the_opacity_of_the_path_through_it(void **state)
{
    (void)state;
    for (int i = 0; i < 48; i++) {
        int axis = i % 3;
        bool diagonal = i / 3 % 4 == 3; /* layers of two axes are merged */
        double d[3] = { diagonal ? 0.95 : 0.4, diagonal ? 0.95 : 0.4, diagonal ? 0.95 : 0.4 };
        scene_params params = { .dims = { 60, 60, 60 } };
        params.dims[axis] = 9;
        params.index_to_world = i / 12 % 2 ? scene_sheared : trip_affine_identity();
        d[axis] = i % 2 ? 1 : -1;
        d[(axis + 1) % 3] *= 0.3;
        scene s;
        scene_create(&s, &params);
        fill_table(&s, 1, 0.5, 0.25, 0.06);
        trip_camera_params view = view_along(&s, trip_v3(d[0], d[1], d[2]), 5, 5);
        view.ortho_height = i / 24 ? 3 : 0;
        trip_settings settings = scene_post(diagonal ? 16 : 1 + i / 3 % 4);
        scene_turn turn = scene_turns(scene_renderers_post(), &s, &view, &settings);
        while (scene_take_turn(&turn)) {
            for (int n = 0; n < 25; n++) {
                trip_vec3 o, ray;
                double from, to;
                scene_ray(&s, &view, n % 5, n / 5, &o, &ray);
                assert_true(scene_ray_in_grid(&s, o, ray, &from, &to));
                assert_true(is_at_face(&s, o, ray, from, axis) && is_at_face(&s, o, ray, to, axis));
                double alpha = 1 - exp(-0.06F * (to - from) * scene_ray_stretch(&s, ray));
                double tolerance = (diagonal ? 0.01 * alpha : 1e-6) + turn.renderer->tolerance;
                const float *c = scene_pixel(&turn.picture, n % 5, n / 5);
                assert_close(c[3], alpha, tolerance);
                assert_close(c[0], alpha, tolerance);
                assert_close(c[1], alpha / 2, tolerance);
                assert_close(c[2], alpha / 4, tolerance);
            }
        }
        scene_destroy(&s);
    }
}

/* Rays enter and leave a cube of one value through all its faces. Each ray loses light along its
 * whole length in the cube, whatever the kernel and the distance of the samples. */
static void a_cube_has_the_opacity_of_the_path_through_its_sides(void **state)
{
    (void)state;
    enum { PX = 14 };
    const trip_vec3 directions[] = { { 1, 0.3, -0.2 }, { -0.5, 0.8, 0.6 }, { 0.7, -0.75, 1 } };
    const trip_kernel kernels[] = { TRIP_KERNEL_LINEAR, TRIP_KERNEL_CUBIC };
    for (int i = 0; i < 24; i++) {
        scene s;
        int through_sides = 0;
        scene_create(&s, &(scene_params){ .dims = { EDGE, EDGE - 3, EDGE + 60 },
                                          .index_to_world =
                                              i / 12 ? scene_sheared : trip_affine_identity() });
        fill_table(&s, 1, 0.5, 0.25, 0.06);
        trip_camera_params view = view_along(&s, directions[i % 3], 40, PX);
        view.ortho_height = i / 3 % 2 ? 60 : 0;
        trip_settings settings = scene_post(1 + i % 4);
        settings.kernel = kernels[i / 6 % 2];
        scene_turn turn = scene_turns(scene_renderers_post(), &s, &view, &settings);
        while (scene_take_turn(&turn)) {
            for (int n = 0; n < PX * PX; n++) {
                trip_vec3 o, ray;
                double from, to, alpha = 0;
                scene_ray(&s, &view, n % PX, n / PX, &o, &ray);
                if (scene_ray_in_grid(&s, o, ray, &from, &to)) {
                    alpha = 1 - exp(-0.06F * (to - from) * scene_ray_stretch(&s, ray));
                    through_sides++;
                }
                const float *c = scene_pixel(&turn.picture, n % PX, n / PX);
                assert_close(c[3], alpha, 2e-5 + turn.renderer->tolerance);
                assert_close(c[1], alpha / 2, 2e-5 + turn.renderer->tolerance);
            }
        }
        assert_true(through_sides > 20);
        scene_destroy(&s);
    }
}

enum { RISE = 3000 }; /* codes per voxel */

/* Codes rise along the axis *user. */
static bool ramp(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    (void)gradient;
    *code = RISE * (unsigned)(const int[3]){ i, j, k }[*(int *)user];
    return true;
}

/* A peak much narrower than the distance between samples counts fully, wherever it lies between
 * them. Its optical depth is its integral over codes, divided by the codes that the ray passes per
 * unit length. */
static void a_narrow_peak_counts_fully_at_any_samples_per_sheet(void **state)
{
    (void)state;
    enum { HALF = 20 };
    for (int i = 0; i < 36; i++) {
        int axis = i % 3, peak = 30000 + 137 * i;
        scene s;
        scene_create(&s,
                     &(scene_params){ .dims = { EDGE, EDGE, EDGE }, .voxel = ramp, .user = &axis });
        for (int code = peak - HALF; code <= peak + HALF; code++) {
            double k = RISE * 0.7 * (HALF - abs(code - peak)) / (HALF * HALF);
            s.table[code] = (trip_tf_entry){ (float)code / 65535, 0, 0, (float)k };
        }
        trip_camera_params view =
            scene_view(&s, trip_v3(1, i / 3 % 2 ? 0.9 : -0.3, 0.4 - 0.1 * (i % 5)), 60, 10, 5);
        view.ortho_height = i / 6 % 2 ? 8 : 0;
        trip_settings settings = scene_post(1 + i / 12);
        scene_turn turn = scene_turns(scene_renderers_post(), &s, &view, &settings);
        while (scene_take_turn(&turn)) {
            for (int n = 0; n < 25; n++) {
                trip_vec3 o, d;
                double from, to;
                scene_ray(&s, &view, n % 5, n / 5, &o, &d);
                /* The ray's position at the peak, which must lie well inside the grid. */
                double t =
                    ((double)peak / RISE - trip_component(o, axis)) / trip_component(d, axis);
                if (!scene_ray_in_grid(&s, o, d, &from, &to) || t < from + 3 || t > to - 3 ||
                    fabs(trip_component(d, axis)) < 0.2)
                    continue;
                double alpha = 1 - exp(-0.7 / fabs(trip_component(d, axis)));
                const float *c = scene_pixel(&turn.picture, n % 5, n / 5);
                assert_close(c[3], alpha, 1e-5 + turn.renderer->tolerance);
                assert_close(c[0], alpha * peak / 65535, 4e-4 + turn.renderer->tolerance);
            }
        }
        scene_destroy(&s);
    }
}

static bool is_within(int i, int j, int k, int lo, int hi)
{
    return i >= lo && j >= lo && k >= lo && i <= hi && j <= hi && k <= hi;
}

static bool body(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    (void)user;
    (void)gradient;
    *code = 40000;
    return is_within(i, j, k, 6, 13);
}

static bool around_body(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    (void)user;
    (void)gradient;
    *code = 0;
    return is_within(i, j, k, 5, 14) && !is_within(i, j, k, 6, 13);
}

static void values_fall_to_the_halo_and_end_without_it(void **state)
{
    (void)state;
    const scene_part halo = { .kind = TRIP_KIND_HALO, .by = { 1, 1, 1 }, .voxel = around_body };
    const trip_vec3 directions[] = { { 1, 0, 0 }, { 0, -1, 0 }, { 0, 0, 1 } };
    for (unsigned parts = 0; parts < 2; parts++) {
        scene s;
        scene_create(&s, &(scene_params){ .dims = { EDGE, EDGE, EDGE },
                                          .voxel = body,
                                          .parts = &halo,
                                          .part_count = parts });
        for (int code = 0; code < 65536; code++)
            s.table[code] = (trip_tf_entry){ 1, 1, 1, 0.1F * (float)code / 40000 };
        for (int i = 0; i < 9; i++) {
            trip_camera_params view = scene_view(&s, directions[i % 3], 60, 20, 1);
            view.ortho_height = 0.1;
            trip_settings settings = scene_post(1 + i / 3);
            scene_turn turn = scene_turns(scene_renderers_post(), &s, &view, &settings);
            while (scene_take_turn(&turn)) {
                assert_close(turn.picture.rgba[3], 1 - exp(-0.1 * (parts ? 8 : 7)),
                             1e-6 + turn.renderer->tolerance);
            }
        }
        scene_destroy(&s);
    }
}

/* Every voxel except (9, 9, 9) is present. */
static bool all_but_one(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    (void)user;
    (void)gradient;
    *code = 65535;
    return !(i == 9 && j == 9 && k == 9);
}

static void a_cell_without_a_corner_is_empty(void **state)
{
    (void)state;
    scene s;
    scene_create(&s, &(scene_params){ .dims = { EDGE, EDGE, EDGE }, .voxel = all_but_one });
    fill_table(&s, 1, 1, 1, 0.1);
    /* Rays pass through the cells around the missing voxel, then beside them. */
    for (int i = 0; i < 36; i++) {
        int axis = i % 3, beside = i / 3 % 3;
        double at[3], d[3] = { 0 };
        at[axis] = 9.5;
        at[(axis + 1) % 3] = 8.2 + beside;
        at[(axis + 2) % 3] = 9.4;
        d[axis] = i / 9 % 2 ? 50 : -50;
        trip_camera_params view = scene_view(&s, trip_v3(d[0], d[1], d[2]), 60, 20, 1);
        view.ortho_height = 0.01;
        view.look = trip_v3(at[0], at[1], at[2]);
        view.eye = trip_add(view.look, trip_v3(d[0], d[1], d[2]));
        trip_settings settings = scene_post(1 + i / 9);
        scene_turn turn = scene_turns(scene_renderers_post(), &s, &view, &settings);
        while (scene_take_turn(&turn)) {
            double length = beside < 2 ? EDGE - 3 : EDGE - 1;
            assert_close(turn.picture.rgba[3], 1 - exp(-0.1F * length),
                         1e-6 + turn.renderer->tolerance);
        }
    }
    scene_destroy(&s);
}

static void inside_the_volume_voxels_before_the_eye_are_visible(void **state)
{
    (void)state;
    /* The last eye looks along an axis from between two bricks. */
    const trip_vec3 eyes[] = { { 7.3, 9.1, 12.7 }, { 7, 9, 12 }, { 7.5, 7.6, 7.4 } };
    scene s;
    scene_create(&s, &(scene_params){ .dims = { EDGE, EDGE, EDGE }, .slab_sheets = 8 });
    fill_table(&s, 1, 1, 1, 0.1);
    for (int i = 0; i < 36; i++) {
        const double aside = i / 6 % 3 == 2 ? 0.01 : 1;
        double d[3] = { 0.1 * aside, -0.05 * aside, 0.07 * aside };
        d[i % 3] = i / 3 % 2 ? 1 : -1;
        trip_camera_params view = { .eye = eyes[i / 6 % 3],
                                    .up = { 0.3, 0.5, 0.7 },
                                    .fov_degrees = 30,
                                    .width = 5,
                                    .height = 5 };
        view.look = trip_add(view.eye, trip_v3(d[0], d[1], d[2]));
        trip_settings settings = scene_post(1 + i / 18 * 2);
        scene_turn turn = scene_turns(scene_renderers_post(), &s, &view, &settings);
        while (scene_take_turn(&turn)) {
            for (int n = 0; n < 25; n++) {
                trip_vec3 o, ray;
                double from, to;
                scene_ray(&s, &view, n % 5, n / 5, &o, &ray);
                assert_true(scene_ray_in_grid(&s, o, ray, &from, &to) && from == 0);
                assert_close(scene_pixel(&turn.picture, n % 5, n / 5)[3], 1 - exp(-0.1F * to),
                             1e-6 + turn.renderer->tolerance);
            }
        }
    }
    scene_destroy(&s);
}

/* Returns a parallel view of one pixel along an axis. The ray is at `u` and `v` along the next two
 * axes. */
static trip_camera_params pixel_along(int axis, double sign, double at, double u, double v)
{
    double eye[3], look[3];
    eye[axis] = at;
    look[axis] = at + sign;
    eye[(axis + 1) % 3] = look[(axis + 1) % 3] = u;
    eye[(axis + 2) % 3] = look[(axis + 2) % 3] = v;
    return (trip_camera_params){ .eye = { eye[0], eye[1], eye[2] },
                                 .look = { look[0], look[1], look[2] },
                                 .up = { 0.3, 0.5, 0.7 },
                                 .ortho_height = 1e-3,
                                 .width = 1,
                                 .height = 1 };
}

/* The segment that contains the eye's plane begins behind it. */
static void a_parallel_view_from_inside_begins_at_the_next_sample(void **state)
{
    (void)state;
    scene s;
    scene_create(&s, &(scene_params){ .dims = { EDGE, EDGE, EDGE } });
    fill_table(&s, 1, 1, 1, 0.1);
    for (int i = 0; i < 36; i++) {
        const double at = (double[]){ 7.3, 7, 12.6 }[i / 12], sign = i / 3 % 2 ? 1 : -1;
        const int samples_per_sheet = 1 + i / 6 % 2 * 2;
        const double next = sign > 0 ? ceil(at * samples_per_sheet) / samples_per_sheet
                                     : floor(at * samples_per_sheet) / samples_per_sheet;
        trip_camera_params view = pixel_along(i % 3, sign, at, 9.4, 8.7);
        trip_settings settings = scene_post(samples_per_sheet);
        scene_turn turn = scene_turns(scene_renderers_post(), &s, &view, &settings);
        while (scene_take_turn(&turn))
            assert_close(turn.picture.rgba[3], 1 - exp(-0.1F * (sign > 0 ? EDGE - 1 - next : next)),
                         1e-6 + turn.renderer->tolerance);
    }
    scene_destroy(&s);
}

/* Rays along an axis, a hundredth of a voxel inside and outside the box of voxel centres. */
static void rays_beside_the_grid_are_empty(void **state)
{
    (void)state;
    const double last = EDGE - 1, beside[] = { -0.01, 0.01, last - 0.01, last + 0.01, last + 0.9 };
    scene s;
    scene_create(&s, &(scene_params){ .dims = { EDGE, EDGE, EDGE } });
    fill_table(&s, 1, 1, 1, 0.1);
    for (int i = 0; i < 30; i++) {
        const double position = beside[i / 3 % 5], other = 8.3;
        const bool within = position > 0 && position < last;
        trip_camera_params view =
            pixel_along(i % 3, 1, -20, i / 15 ? position : other, i / 15 ? other : position);
        trip_settings settings = scene_post(1 + i % 2);
        scene_turn turn = scene_turns(scene_renderers_post(), &s, &view, &settings);
        while (scene_take_turn(&turn))
            assert_close(turn.picture.rgba[3], within ? 1 - exp(-0.1F * last) : 0,
                         1e-6 + turn.renderer->tolerance);
    }
    scene_destroy(&s);
}

/* Colours opaque walls in a ramp. */
static void colour_walls(scene *s)
{
    for (int code = 4 * RISE; code < 5 * RISE; code++)
        s->table[code] = (trip_tf_entry){ 1, 0, 0, 50 };
    for (int code = 10 * RISE; code < 11 * RISE; code++)
        s->table[code] = (trip_tf_entry){ 0, 1, 0, 50 };
    for (int code = 15 * RISE; code < 16 * RISE; code++)
        s->table[code] = (trip_tf_entry){ 0, 0, 1, 50 };
}

static void expect_colour(const scene_picture *p, int channel, const char *name)
{
    for (int n = 0; n < p->width * p->height; n++)
        for (int c = 0; c < 3; c++)
            if (!(fabs((c == channel) - p->rgba[4 * n + c]) < 0.01))
                fail_msg("%s: component %d of pixel %d is %g", name, c, n, p->rgba[4 * n + c]);
}

static void the_nearest_wall_hides_those_behind_it(void **state)
{
    (void)state;
    for (int axis = 0; axis < 3; axis++) {
        scene s;
        scene_create(&s,
                     &(scene_params){ .dims = { EDGE, EDGE, EDGE }, .voxel = ramp, .user = &axis });
        colour_walls(&s);
        for (int i = 0; i < 24; i++) {
            double d[3] = { 0.5, 0.3, -0.4 };
            d[axis] = i % 2 ? 1 : -1;
            trip_camera_params view = scene_view(&s, trip_v3(d[0], d[1], d[2]), 60, 2, 3);
            view.ortho_height = i / 6 % 2 ? 2 : 0;
            trip_settings settings = scene_post(1 + i / 12);
            settings.method = (trip_method)(i / 2 % 3);
            settings.h = 0.5;
            scene_turn turn = scene_turns(scene_renderers_post(), &s, &view, &settings);
            while (scene_take_turn(&turn)) {
                expect_colour(&turn.picture, i % 2 ? 2 : 0, turn.renderer->name);
            }
        }
        scene_destroy(&s);
    }
}

static void walls_on_both_sides_of_the_eye_are_visible(void **state)
{
    (void)state;
    for (int i = 0; i < 12; i++) {
        int axis = i % 3;
        double d[3] = { 0.1, -0.1, 0.1 };
        scene s;
        scene_create(&s,
                     &(scene_params){ .dims = { EDGE, EDGE, EDGE }, .voxel = ramp, .user = &axis });
        colour_walls(&s);
        d[axis] = i / 3 % 2 ? 1 : -1;
        trip_camera_params view = { .eye = { 7.6, 7.3, 7.1 },
                                    .up = { 0.3, 0.5, 0.7 },
                                    .fov_degrees = 60,
                                    .width = 8,
                                    .height = 8 };
        view.look = trip_add(view.eye, trip_v3(d[0], d[1], d[2]));
        trip_settings settings = scene_post(1 + i / 6);
        scene_turn turn = scene_turns(scene_renderers_post(), &s, &view, &settings);
        while (scene_take_turn(&turn)) {
            expect_colour(&turn.picture, i / 3 % 2, turn.renderer->name);
        }
        scene_destroy(&s);
    }
}

/* One body is a little below the transmittance of early termination. The other is far below the
 * transmittance of a frame without early termination. */
static void a_terminated_pixel_is_opaque(void **state)
{
    (void)state;
    for (int i = 0; i < 5; i++) {
        scene s;
        scene_create(&s, &(scene_params){ .dims = { EDGE, EDGE, EDGE } });
        const double early_termination = i < 2 ? TRIP_EARLY_TERMINATION_POST : i < 4 ? 0.06 : 0;
        const double through = i < 4 ? early_termination * (i % 2 ? 0.9 : 1.1) : 1e-4;
        fill_table(&s, 0.75, 1, 1, -log(through) / (EDGE - 1));
        trip_camera_params view = scene_view(&s, trip_v3(1, 0, 0), 60, 20, 1);
        view.ortho_height = 0.1;
        trip_settings settings = scene_post(2);
        settings.early_termination = i < 2 ? TRIP_EARLY_TERMINATION_AUTO : early_termination;
        scene_turn turn = scene_turns(scene_renderers_post(), &s, &view, &settings);
        while (scene_take_turn(&turn)) {
            if (i % 2)
                assert_true(turn.picture.rgba[3] == 1);
            else
                assert_close(turn.picture.rgba[3], 1 - through,
                             1e-6 + turn.renderer->tolerance / 16);
            assert_close(turn.picture.rgba[0], 0.75 * (i % 2 ? 1 : 1 - through),
                         1e-6 + turn.renderer->tolerance);
        }
        scene_destroy(&s);
    }
}

static void shading_uses_differences_of_values(void **state)
{
    double max = 0;
    (void)state;
    for (int i = 0; i < 12; i++) {
        int axis = i % 3;
        scene s;
        scene_create(&s, &(scene_params){ .dims = { EDGE, EDGE, EDGE },
                                          .index_to_world =
                                              i / 3 % 2 ? scene_sheared : trip_affine_identity(),
                                          .voxel = ramp,
                                          .user = &axis });
        fill_table(&s, 0.6, 0.3, 0.1, 0.05);
        double d[3] = { 0.3, 0.2, -0.3 };
        d[axis] = 1;
        trip_camera_params view = view_along(&s, trip_v3(d[0], d[1], d[2]), 5, 1);
        view.ortho_height = 0.1;
        trip_settings settings = scene_post(2);
        settings.shading = true;
        settings.headlight = i / 6;
        settings.light_direction = trip_normalize(trip_v3(0.5, 0.6, 0.7));

        trip_camera camera;
        trip_affine to_index;
        const trip_affine *map = &s.data->index_to_world;
        double rgb[3] = { 0.6F, 0.3F, 0.1F }, unlit[3] = { rgb[0], rgb[1], rgb[2] };
        assert_int_equal(trip_camera_make(&camera, &view, map), 0);
        assert_true(trip_affine_invert(map, &to_index));
        const double *row = to_index.m[axis]; /* the world gradient of the index along the axis */
        const double rise = RISE / 65535.0, g[3] = { row[0] * rise, row[1] * rise, row[2] * rise };
        trip_shade(&settings, &camera,
                   trip_shade_gradient_full(&s.data->header, &settings, camera.voxel_world, 0),
                   trip_v3(0, 0, 0), g, rgb);
        max = fmax(max, fabs(rgb[0] - unlit[0]));
        scene_turn turn = scene_turns(scene_renderers_post(), &s, &view, &settings);
        while (scene_take_turn(&turn)) {
            for (int c = 0; c < 3; c++)
                assert_close(turn.picture.rgba[c] / turn.picture.rgba[3], rgb[c],
                             1e-5 + 2 * turn.renderer->tolerance);
        }
        scene_destroy(&s);
    }
    assert_true(max > 0.1); /* lit, not zero */
}

/* On the far left are two cells with a gap between them, one below the visible codes and one
 * above. Visible voxels are on the far right. */
static bool gap(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    static const unsigned left[] = { 1000, 20000, 0, 45000, 64000 };
    (void)user, (void)j, (void)k, (void)gradient;
    if (i == 2 || (i > 4 && i < 40))
        return false;
    *code = i < 5 ? left[i] : 32000;
    return true;
}

/* With one sample per sheet, a steep ray passes from one cell to the other in one segment. Every
 * value between the two cells is visible. The gradients that light it come from transparent cells.
 */
static void voxels_skipped_by_a_segment_are_visible_and_lit(void **state)
{
    (void)state;
    scene s;
    scene_create(&s, &(scene_params){ .dims = { 48, 48, 16 }, .voxel = gap });
    for (int code = 30000; code <= 35000; code++)
        s.table[code] = (trip_tf_entry){ 0.6F, 0.3F, 0.1F, 0.5F };
    trip_camera_params view = scene_view(&s, trip_v3(0, 0, -1), 60, 150, 8);
    view.eye = trip_v3(21.8, 24.3, -2);
    view.look = trip_v3(21.8, 24.3, 8);
    trip_settings settings = scene_post(1);
    settings.method = TRIP_METHOD_AXIS;
    for (int lit = 0; lit < 2; lit++) {
        settings.shading = lit;
        scene_picture expected = { 0 };
        scene_turn turn = scene_turns(scene_renderers_post(), &s, &view, &settings);
        while (scene_take_turn(&turn)) {
            if (!expected.rgba) {
                expected = turn.picture; /* the picture of the reference */
                assert_true(scene_pixel(&expected, 6, 4)[3] > 0.01F); /* between the cells */
                turn.picture = (scene_picture){ 0 };
                continue;
            }
            assert_true(scene_difference(&expected, &turn.picture) <= turn.renderer->tolerance);
        }
        scene_picture_free(&expected);
    }
    scene_destroy(&s);
}

/* Returns the mean distance of the visible part of a constant body. */
static void depth_is_the_mean_visible_distance(void **state)
{
    (void)state;
    for (int i = 0; i < 12; i++) {
        scene s;
        scene_create(&s, &(scene_params){ .dims = { EDGE, EDGE, EDGE },
                                          .index_to_world =
                                              i % 2 ? scene_sheared : trip_affine_identity() });
        fill_table(&s, 1, 1, 1, 0.1);
        double d[3] = { 0.2, 0.1, -0.2 };
        d[i / 4] = i / 2 % 2 ? 1 : -1;
        trip_camera_params view = view_along(&s, trip_v3(d[0], d[1], d[2]), 4, 5);
        view.ortho_height = i % 3 == 0 ? 2 : 0;
        trip_settings settings = scene_post(2);
        settings.depth = true;
        scene_turn turn = scene_turns(scene_renderers_post(), &s, &view, &settings);
        while (scene_take_turn(&turn)) {
            for (int n = 0; n < 25; n++) {
                trip_vec3 o, ray;
                double from, to;
                scene_ray(&s, &view, n % 5, n / 5, &o, &ray);
                assert_true(scene_ray_in_grid(&s, o, ray, &from, &to));
                double unit = scene_ray_stretch(&s, ray), k = 0.1F, length = (to - from) * unit;
                double expected = from * unit + 1 / k - length / expm1(k * length);
                /* A segment counts with the distance of its centre. */
                assert_close(turn.picture.depth[n] - expected, 0,
                             0.01 + 40 * turn.renderer->tolerance);
            }
        }
        scene_destroy(&s);
    }
}

/* A volume with one axis mirrored, with permuted axes, or turned and moved in world space. */
typedef struct arrangement {
    int64_t dims[3]; /* before mirroring and turning */
    int mirrored;    /* axis; -1 for none */
    int turned;      /* axis a of the arrangement is axis a + turned of the volume */
    bool moved;
} arrangement;

/* A rotation and a translation. */
static const trip_affine elsewhere = {
    { { 0.36, 0.48, -0.8, 300 }, { -0.8, 0.6, 0, -90 }, { 0.48, 0.64, 0.6, 40 } }
};

static trip_vec3 arrange(const arrangement *to, trip_vec3 p, bool direction)
{
    double first[3] = { p.x, p.y, p.z }, n[3];
    if (to->mirrored >= 0)
        first[to->mirrored] =
            (direction ? 0 : (double)to->dims[to->mirrored] - 1) - first[to->mirrored];
    for (int a = 0; a < 3; a++)
        n[a] = first[(a + to->turned) % 3];
    p = trip_v3(n[0], n[1], n[2]);
    if (!to->moved)
        return p;
    return direction ? trip_affine_vector(&elsewhere, p) : trip_affine_point(&elsewhere, p);
}

/* Smooth lumps. */
static double lumps(double x, double y, double z)
{
    return 30000 + 9000 * sin(0.5 * x + 0.3) + 9000 * sin(0.4 * y + 0.2 * z) +
           9000 * cos(0.6 * z - 0.1 * x * y);
}

static bool arranged_lumps(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    const arrangement *as = user;
    const int at[3] = { i, j, k };
    int first[3];
    (void)gradient;
    for (int a = 0; a < 3; a++)
        first[(a + as->turned) % 3] = at[a];
    if (as->mirrored >= 0)
        first[as->mirrored] = (int)as->dims[as->mirrored] - 1 - first[as->mirrored];
    *code = (unsigned)lround(lumps(first[0], first[1], first[2]));
    return true;
}

static void create_lumps(scene *s, arrangement *as)
{
    scene_params params = { .voxel = arranged_lumps, .user = as };
    if (as->moved)
        params.index_to_world = elsewhere;
    for (int a = 0; a < 3; a++)
        params.dims[a] = as->dims[(a + as->turned) % 3];
    scene_create(s, &params);
    for (int code = 30000; code < 65536; code++)
        s->table[code] = code < 45000 ? (trip_tf_entry){ 0.9F, 0.5F, 0.2F, 0.05F }
                                      : (trip_tf_entry){ 0.2F, 0.6F, 1, 0.8F };
}

/* Draws a view of the arranged volume. The camera is arranged in the same way. */
static scene_picture draw_lumps(const scene_renderer *r, arrangement as, bool parallel)
{
    scene s;
    create_lumps(&s, &as);
    trip_settings settings = scene_post(2);
    settings.shading = true;
    settings.h = 0.3;
    trip_camera_params view = { .eye = arrange(&as, trip_v3(40, -27, 35), false),
                                .look = arrange(&as, trip_v3(8.2, 11.1, 12.7), false),
                                .up = arrange(&as, trip_v3(0.1, 0.2, 1), true),
                                .fov_degrees = 30,
                                .ortho_height = parallel ? 25 : 0,
                                .width = 32,
                                .height = 32 };
    scene_picture p = scene_draw(&s, r, &view, &settings);
    scene_destroy(&s);
    return p;
}

static void flip(scene_picture *p)
{
    for (int y = 0; y < p->height; y++)
        for (int x = 0; x < p->width / 2; x++)
            for (int c = 0; c < 4; c++) {
                float *a = &p->rgba[4 * (y * p->width + x) + c];
                float *b = &p->rgba[4 * (y * p->width + p->width - 1 - x) + c];
                float kept = *a;
                *a = *b;
                *b = kept;
            }
}

static double mean_apart(const scene_picture *a, const scene_picture *b)
{
    double sum = 0;
    int count = 4 * a->width * a->height;
    for (int n = 0; n < count; n++)
        sum += fabs((double)a->rgba[n] - (double)b->rgba[n]);
    return sum / count;
}

static void mirrored_turned_and_moved_volumes_look_the_same(void **state)
{
    (void)state;
    for (const scene_renderer *r = scene_renderers_post(); r->name; r++) {
        for (int parallel = 0; parallel < 2; parallel++) {
            arrangement as = { { 18, 22, 26 }, -1, 0, false };
            scene_picture first = draw_lumps(r, as, parallel);
            for (int i = 1; i < 7; i++) {
                as.mirrored = i < 4 ? i - 1 : -1;
                as.turned = i == 4 || i == 5 ? i - 3 : 0;
                as.moved = i == 6;
                scene_picture p = draw_lumps(r, as, parallel);
                if (as.mirrored >= 0)
                    flip(&p);
                assert_true(scene_difference(&p, &first) < 1e-5 + r->tolerance);
                assert_true(mean_apart(&p, &first) < 0.1 / 255);
                scene_picture_free(&p);
            }
            scene_picture_free(&first);
        }
    }
}

/* Waves that the sides of the grid cut off. */
static bool waves(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    (void)user;
    (void)gradient;
    *code = (unsigned)lround(20000 + 9000 * sin(0.45 * i + 0.3 * j) * cos(0.4 * k) +
                             6000 * sin(0.5 * j - 0.2 * k));
    return true;
}

/* Three lumps. Values at the border are 0. */
static bool blobs(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    const double at[3][3] = { { 11, 12, 9 }, { 17, 14, 15 }, { 12, 18, 18 } };
    double sum = 0;
    (void)user;
    (void)gradient;
    for (int n = 0; n < 3; n++) {
        double x = i - at[n][0], y = j - at[n][1], z = k - at[n][2];
        sum += 40000 * exp(-(x * x + y * y + z * z) / 14);
    }
    *code = (unsigned)lround(sum);
    return true;
}

static void put_voxels(trip_field **field, const scene *s, scene_voxel voxel)
{
    const int edge = (int)s->data->header.dims[0];
    assert_int_equal(trip_field_create(field, (int64_t[3]){ edge, edge, edge }, s->budget), 0);
    for (int n = 0; n < edge * edge * edge; n++) {
        const int at[3] = { n % edge, n / edge % edge, n / edge / edge };
        unsigned code;
        voxel(NULL, at[0], at[1], at[2], &code, NULL);
        assert_int_equal(trip_field_put(*field, (int64_t[3]){ at[0], at[1], at[2] }, code, NULL),
                         0);
    }
    const trip_field_map map = { .index_to_world = s->data->index_to_world,
                                 .value_per_code = 1.0 / 65535 };
    assert_int_equal(trip_field_finish(*field, &map), 0);
}

/* Compares 1, 4 and 16 samples per sheet with the integral of the same field with the same light.
 * The volume is translucent, so that no pixel terminates early. */
static void compare_with_integral(scene_voxel voxel, trip_kernel kernel, bool lit, bool parallel,
                                  trip_vec3 direction)
{
    trip_field *field;
    scene s;
    scene_create(&s, &(scene_params){ .dims = { 28, 28, 28 }, .normals = true, .voxel = voxel });
    put_voxels(&field, &s, voxel);
    for (int code = 0; code < 65536; code++)
        s.table[code] = (trip_tf_entry){ (float)code / 65535, 0.5F, 1 - (float)code / 65535,
                                         0.25F * (float)fmax(0, code - 10000) / 30000 };
    trip_settings settings = scene_post(1);
    settings.kernel = kernel;
    settings.tolerance = 1e-6;
    settings.shading = lit;
    trip_camera_params view = scene_view(&s, direction, 60, 18, 20);
    view.ortho_height = parallel ? 18 : 0;
    scene_picture truth =
        scene_integrate(&s, &view, &settings, &(scene_making){ .threads = 1, .field = field });
    double errors[3] = { 0 };
    for (const scene_renderer *r = scene_renderers_post(); r->name; r++) {
        for (int n = 0; n < 3; n++) {
            settings.samples_per_sheet = 1 << 2 * n;
            scene_picture p = scene_draw(&s, r, &view, &settings);
            double error = mean_apart(&p, &truth);
            if (r->tolerance > 0) /* after the reference */
                assert_true(error < errors[n] + r->tolerance);
            else
                errors[n] = error;
            scene_picture_free(&p);
        }
    }
    assert_true(errors[0] < 2.0 / 255 && errors[0] > 0.05 / 255);
    assert_true(errors[1] < errors[0] / 12 && errors[2] < errors[1] / 12);
    scene_picture_free(&truth);
    trip_field_destroy(field);
    scene_destroy(&s);
}

static void the_error_falls_with_the_square_of_the_samples_per_sheet(void **state)
{
    (void)state;
    const trip_kernel linear = TRIP_KERNEL_LINEAR;
    compare_with_integral(blobs, linear, false, false, trip_v3(1, 0.2, -0.3));
    compare_with_integral(blobs, linear, false, true, trip_v3(-1, 0.9, 0.8));
    compare_with_integral(blobs, linear, true, false, trip_v3(0.3, 1, -0.9));
    compare_with_integral(blobs, linear, true, true, trip_v3(0.2, 0.1, -1));
}

static void values_at_the_sides_converge_to_the_integral(void **state)
{
    (void)state;
    const trip_kernel linear = TRIP_KERNEL_LINEAR;
    compare_with_integral(waves, linear, false, false, trip_v3(1, 0.2, -0.3));
    compare_with_integral(waves, linear, true, true, trip_v3(-1, 0.9, 0.8));
    compare_with_integral(waves, TRIP_KERNEL_CUBIC, false, false, trip_v3(0.3, 1, -0.9));
}

static void the_cubic_kernel_gives_the_cubic_integral(void **state)
{
    (void)state;
    compare_with_integral(blobs, TRIP_KERNEL_CUBIC, false, true, trip_v3(-1, 0.9, 0.8));
    compare_with_integral(blobs, TRIP_KERNEL_CUBIC, true, false, trip_v3(0.3, 1, -0.9));
}

/* Random values, one per sheet along an axis. */
typedef struct layers {
    int axis;
    unsigned codes[EDGE];
} layers;

static bool layer_code(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    const layers *l = user;
    (void)gradient;
    *code = l->codes[(const int[3]){ i, j, k }[l->axis]];
    return true;
}

/* Evaluates a spline in Hermite's form, and the profile of a splat by its formula. Values repeat
 * beyond the ends. */
static double value_at(const layers *l, trip_kernel kernel, double z)
{
    int cell = (int)fmin(floor(z), EDGE - 2);
    double v[4], x = z - cell, sum = 0, weights = 0;
    for (int i = 0; i < 4; i++)
        v[i] = l->codes[(int)fmin(EDGE - 1, fmax(0, cell + i - 1))];
    if (kernel == TRIP_KERNEL_CUBIC)
        return v[1] * (1 + 2 * x) * (1 - x) * (1 - x) + v[2] * x * x * (3 - 2 * x) +
               (v[2] - v[0]) / 2 * x * (1 - x) * (1 - x) - (v[3] - v[1]) / 2 * x * x * (1 - x);
    for (int i = 0; i < 4; i++) {
        double d = x - (i - 1), w = exp(-d * d / 0.72) - exp(-50.0 / 9);
        sum += fmax(0, w) * v[i];
        weights += fmax(0, w);
    }
    return sum / weights;
}

/* The codes along z are 0, 60000, 60000 and 0, or 65535 minus these. */
static bool peak_voxel(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    const bool *low = user;
    (void)i, (void)j, (void)gradient;
    const unsigned high = k == 1 || k == 2 ? 60000 : 0;
    *code = *low ? 65535 - high : high;
    return true;
}

/* The cubic kernel has 60000 (1 + (t - t^2) / 2) between the two voxels of 60000, and 67500 in the
 * middle. With two samples per sheet, codes are linear from 60000 to 67500. The function is
 * constant beyond 65535. It is a step at the end of the table, or a ramp over the table. */
static void the_end_of_the_function_counts_beyond_the_table(void **state)
{
    (void)state;
    for (int i = 0; i < 4; i++) {
        bool low = i % 2;
        const bool ramp = i / 2;
        scene s;
        scene_create(&s, &(scene_params){ .dims = { 8, 8, 4 }, .voxel = peak_voxel, .user = &low });
        for (int n = 0; n < 65536; n++) {
            const float k = ramp ? (float)n / 65535 : n == 65535;
            s.table[low ? 65535 - n : n] = (trip_tf_entry){ 1, 1, 1, k };
        }
        const double step = (67500 - 65534.5) / 7500;
        const double mean = ((60000 + 65535) * 0.5 * 5535 + 65535.0 * 1965) / 7500 / 65535;
        const double depth = ramp ? mean + 2 * 30000 / 65535.0 : step;
        trip_camera_params view = view_along(&s, trip_v3(0, 0, 1), 20, 3);
        view.ortho_height = 2;
        trip_settings settings = scene_post(2);
        settings.kernel = TRIP_KERNEL_CUBIC;
        scene_turn turn = scene_turns(scene_renderers_post(), &s, &view, &settings);
        while (scene_take_turn(&turn))
            assert_close(scene_pixel(&turn.picture, 1, 1)[3], 1 - exp(-depth),
                         2e-4 + turn.renderer->tolerance);
        scene_destroy(&s);
    }
}

/* Rays follow the axis. Extinction is linear in the code, so that the optical depth is the sum of
 * the trapezoids between samples. */
static void samples_between_sheets_have_the_values_of_the_kernel(void **state)
{
    (void)state;
    for (int i = 0; i < 12; i++) {
        const trip_kernel kernel = i / 3 % 2 ? TRIP_KERNEL_CUBIC : TRIP_KERNEL_GAUSSIAN;
        const int samples_per_sheet = 2 + i / 6 * 3;
        layers l = { .axis = i % 3 };
        double sum = 0;
        for (int n = 0; n < EDGE; n++)
            l.codes[n] = 20000 + scene_hash(n, i, 7) % 20000;
        for (int n = 0; n <= (EDGE - 1) * samples_per_sheet; n++)
            sum += value_at(&l, kernel, (double)n / samples_per_sheet) / samples_per_sheet /
                   (n % ((EDGE - 1) * samples_per_sheet) ? 1 : 2);
        scene s;
        scene_create(
            &s, &(scene_params){ .dims = { EDGE, EDGE, EDGE }, .voxel = layer_code, .user = &l });
        for (int code = 0; code < 65536; code++)
            s.table[code] = (trip_tf_entry){ 1, 1, 1, 0.05F * (float)code / 30000 };
        trip_vec3 direction = { l.axis == 0, l.axis == 1, l.axis == 2 };
        trip_camera_params view = scene_view(&s, direction, 60, 20, 1);
        view.ortho_height = 0.1;
        trip_settings settings = scene_post(samples_per_sheet);
        settings.kernel = kernel;
        for (const scene_renderer *r = scene_renderers_post(); r->name; r++) {
            scene_picture p = scene_draw(&s, r, &view, &settings);
            assert_close(p.rgba[3], 1 - exp(-0.05 * sum / 30000), 1e-6 + 0.01 * r->tolerance);
            scene_picture_free(&p);
        }
        scene_destroy(&s);
    }
}

/* Clipping leaves one segment between two sheets with different gradients, 300 and 1250 codes a
 * voxel. The mean of the two gradients lights the segment. */
static void a_segment_is_lit_by_the_mean_of_both_gradients(void **state)
{
    (void)state;
    for (int i = 0; i < 6; i++) {
        layers l = { .axis = i % 3 };
        for (int n = 0; n < EDGE; n++)
            l.codes[n] = n < 3 ? 19900 : n == 3 ? 20000 : n == 4 ? 20500 : 22500;
        scene s;
        scene_create(
            &s, &(scene_params){ .dims = { EDGE, EDGE, EDGE }, .voxel = layer_code, .user = &l });
        fill_table(&s, 0.6, 0.3, 0.1, 1);
        const trip_vec3 along = { l.axis == 0, l.axis == 1, l.axis == 2 };
        trip_camera_params view = scene_view(&s, trip_scale(along, i < 3 ? 1 : -1), 60, 20, 1);
        view.ortho_height = 0.1;
        trip_settings settings = scene_post(1);
        settings.shading = true;
        settings.headlight = false;
        settings.light_direction = trip_normalize(trip_v3(0.5, 0.6, 0.7));
        trip_clip_add(&settings.clip, along, -3);
        trip_clip_add(&settings.clip, trip_scale(along, -1), 4);

        trip_camera camera;
        const trip_vec3 mean = trip_scale(along, (300 + 1250) / 2.0 / 65535);
        double rgb[3] = { 0.6F, 0.3F, 0.1F };
        assert_int_equal(trip_camera_make(&camera, &view, &s.data->index_to_world), 0);
        trip_shade(&settings, &camera, trip_shade_gradient_full(&s.data->header, &settings, 1, 0),
                   trip_v3(0, 0, 0), (const double[3]){ mean.x, mean.y, mean.z }, rgb);
        scene_turn turn = scene_turns(scene_renderers_post(), &s, &view, &settings);
        while (scene_take_turn(&turn)) {
            const float *c = turn.picture.rgba;
            assert_close(c[3], 1 - exp(-1), 1e-6 + turn.renderer->tolerance);
            for (int k = 0; k < 3; k++)
                assert_close(c[k] / c[3], rgb[k], 1e-5 + 0.5 * turn.renderer->tolerance);
        }
        scene_destroy(&s);
    }
}

static bool is_inside(double x, double y, double z)
{
    return x * x + y * y + z * z < 50;
}

/* A ball of rising values, and its adjacent voxels. */
static bool ball(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    const double x = i - 10.2, y = j - 9.7, z = k - 9.9;
    (void)user;
    (void)gradient;
    *code = (unsigned)fmax(0, 52000 - 800 * (x * x + y * y + z * z));
    return is_inside(x, y, z);
}

static bool around_ball(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    bool some = false;
    for (int n = 0; n < 27; n++)
        some |= ball(user, i + n % 3 - 1, j + n / 3 % 3 - 1, k + n / 9 - 1, code, gradient);
    return !ball(user, i, j, k, code, gradient) && some;
}

/* A halo of one voxel lacks some voxels. The integral of the data set uses the same rule for them.
 */
static void voxels_beyond_the_halo_repeat_their_neighbours(void **state)
{
    (void)state;
    const scene_part halo = { .kind = TRIP_KIND_HALO, .by = { 1, 1, 1 }, .voxel = around_ball };
    scene s;
    scene_create(&s, &(scene_params){ .dims = { EDGE, EDGE, EDGE },
                                      .normals = true,
                                      .voxel = ball,
                                      .parts = &halo,
                                      .part_count = 1 });
    for (int code = 8000; code < 65536; code++)
        s.table[code] = (trip_tf_entry){ 0.9F, 0.6F, 0.3F, 0.5F * (float)(code - 8000) / 30000 };
    trip_settings settings = scene_post(16);
    settings.kernel = TRIP_KERNEL_CUBIC;
    settings.tolerance = 1e-6;
    settings.shading = true;
    trip_camera_params view = scene_view(&s, trip_v3(1, 0.7, -0.4), 60, 18, 20);
    scene_picture truth = scene_integrate(&s, &view, &settings, &(scene_making){ .threads = 1 });
    settings.kernel = TRIP_KERNEL_LINEAR;
    scene_picture linear = scene_integrate(&s, &view, &settings, &(scene_making){ .threads = 1 });
    settings.kernel = TRIP_KERNEL_CUBIC;
    for (const scene_renderer *r = scene_renderers_post(); r->name; r++) {
        scene_picture p = scene_draw(&s, r, &view, &settings);

        assert_true(mean_apart(&p, &truth) < 0.05 / 255);
        assert_true(mean_apart(&p, &truth) < 0.2 * mean_apart(&p, &linear));
        scene_picture_free(&p);
    }
    scene_picture_free(&truth);
    scene_picture_free(&linear);
    scene_destroy(&s);
}

/* Noise. Each cell borders on visible and transparent voxels on every side. */
enum { NOISE_MIN = 30000, NOISE_MAX = 38000 };

static unsigned noise_code(int i, int j, int k)
{
    return scene_hash(i, j, k) % 65536;
}

static bool noise_shows(int i, int j, int k)
{
    const unsigned code = noise_code(i, j, k);
    return is_within(i, j, k, 0, EDGE - 1) && code >= NOISE_MIN && code < NOISE_MAX;
}

static bool noise(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    (void)user;
    (void)gradient;
    *code = noise_code(i, j, k);
    return noise_shows(i, j, k) && scene_hash(k, i, j) % 8 == 0;
}

static bool around_noise(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    bool some = false;
    for (int n = 0; n < 27; n++)
        some |= noise(user, i + n % 3 - 1, j + n / 3 % 3 - 1, k + n / 9 - 1, code, gradient);
    const bool kept = noise(user, i, j, k, code, gradient);
    return some && !kept;
}

/* Rays leave the halo at any position of a sheet. All renderers must draw the same part of each
 * ray. */
static void renderers_leave_out_the_same_voxels_beyond_the_halo(void **state)
{
    (void)state;
    const scene_part halo = { .kind = TRIP_KIND_HALO, .by = { 1, 1, 1 }, .voxel = around_noise };
    scene s;
    scene_create(
        &s, &(scene_params){
                .dims = { EDGE, EDGE, EDGE }, .voxel = noise, .parts = &halo, .part_count = 1 });
    scene_colour(&s, NOISE_MIN, NOISE_MAX, 0.9, 0.6, 0.3, 0.6);
    for (int i = 0; i < 8; i++) {
        trip_settings settings = scene_post(1 + i / 4);
        trip_camera_params view =
            scene_view(&s, trip_v3(i & 1 ? -1 : 1, 0.9, i & 2 ? 0.8 : -0.8), 60, 20, 64);
        scene_picture expected = scene_draw(&s, scene_renderers_post(), &view, &settings);
        scene_turn turn = scene_turns(scene_renderers_post() + 1, &s, &view, &settings);
        while (scene_take_turn(&turn)) {
            assert_true(scene_difference(&turn.picture, &expected) <= 1.0 / 255);
        }
        scene_picture_free(&expected);
    }
    scene_destroy(&s);
}

enum { ONE_VALUE = 40001 };

static bool one_value(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    (void)user;
    (void)j;
    (void)k;
    (void)gradient;
    *code = i < 6 ? 0 : ONE_VALUE;
    return true;
}

/* Rounded weights must not matter in a region of one value, at the first or last visible code of
 * the transfer function. Voxels outside the picture hold another value. */
static void every_kernel_preserves_a_constant_value(void **state)
{
    (void)state;
    scene s;
    scene_create(&s, &(scene_params){ .dims = { EDGE, EDGE, EDGE }, .voxel = one_value });
    for (int i = 0; i < 6; i++) {
        const bool ends = i / 3;
        for (int code = 0; code < 65536; code++) {
            const bool shows = ends ? code <= ONE_VALUE : code >= ONE_VALUE;
            s.table[code] = (trip_tf_entry){ 1, 1, 1, shows ? 0.1F : 0 };
        }
        trip_camera_params view = scene_view(&s, trip_v3(0, 0, 1), 60, 20, 16);
        view.ortho_height = 7.34;
        view.look.x += 4;
        view.eye.x += 4;
        trip_settings settings = scene_post(3);
        settings.kernel = (trip_kernel)(i % 3);
        scene_turn turn = scene_turns(scene_renderers_post(), &s, &view, &settings);
        while (scene_take_turn(&turn))
            for (int n = 0; n < 16 * 16; n++)
                assert_close(turn.picture.rgba[4 * n + 3], 1 - exp(-0.1F * (EDGE - 1)), 1e-5);
    }
    scene_destroy(&s);
}

/* Returns the largest change of a pixel between successive pictures. The camera turns in steps of
 * 0.1 degrees across 45 degrees, where the layer with the largest weight changes. */
static double max_change(const scene *s, const scene_renderer *r, const trip_settings *settings)
{
    scene_picture last = { 0 };
    double max = 0;
    for (int step = -8; step <= 8; step++) {
        double angle = (45 + 0.1 * step) * 3.14159265358979323846 / 180;
        trip_camera_params view = scene_view(s, trip_v3(cos(angle), sin(angle), 0.3), 60, 17, 32);
        scene_picture p = scene_draw(s, r, &view, settings);
        if (last.rgba)
            max = fmax(max, scene_difference(&p, &last));
        scene_picture_free(&last);
        last = p;
    }
    scene_picture_free(&last);
    return max;
}

/* Edges with one sample per sheet are the worst case. */
static void turning_across_45_degrees_does_not_pop(void **state)
{
    (void)state;
    scene s;
    scene_create(&s, &(scene_params){ .dims = { 28, 28, 28 }, .voxel = blobs });
    for (int code = 20000; code < 65536; code++)
        s.table[code] = (trip_tf_entry){ 0.9F, 0.6F, 0.3F, 2 };
    trip_settings settings = scene_post(1);
    settings.shading = true;
    for (const scene_renderer *r = scene_renderers_post(); r->name; r++) {
        settings.method = TRIP_METHOD_MERGE;
        double merged = max_change(&s, r, &settings);
        settings.method = TRIP_METHOD_AXIS;
        double popped = max_change(&s, r, &settings);
        assert_true(popped > 0.5);
        assert_true(merged < 0.15 + r->tolerance); /* as much as the object's own motion causes */
    }
    scene_destroy(&s);
}

/* Opaque, at half the resolution. */
static bool coarse(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    (void)user;
    (void)i;
    (void)j;
    (void)k;
    (void)gradient;
    *code = 40000;
    return true;
}

/* Bricks that a plan leaves out change nothing, and neither do lists of other levels. */
static void bricks_and_coarser_levels_change_no_bit(void **state)
{
    (void)state;
    const scene_part level = { .level = 1, .by = { 2, 2, 2 }, .voxel = coarse };
    const trip_vec3 directions[] = { { 1, 0.7, 0.2 }, { -0.5, 0.6, 0.6 }, { 0.1, -0.3, -1 } };
    for (const scene_renderer *r = scene_renderers_post(); r->name; r++) {
        for (int view = 0; view < 6; view++) {
            scene_picture first = { 0 };
            for (int form = 0; form < 3; form++) {
                scene s;
                scene_create(&s, &(scene_params){ .dims = { 44, 44, 44 },
                                                  .tile_voxels = form == 1 ? 16 : 64,
                                                  .slab_sheets = form == 1 ? 1 : 64,
                                                  .voxel = blobs,
                                                  .parts = &level,
                                                  .part_count = form == 2 });
                for (int code = 30000; code < 65536; code++)
                    s.table[code] = (trip_tf_entry){ 0.9F, 0.6F, 0.3F, 1 };
                trip_settings settings = scene_post(2);
                settings.shading = true;
                trip_camera_params params =
                    scene_view(&s, directions[view % 3], view / 3 ? 20 : 60, view / 3 ? 50 : 8, 24);
                params.look = trip_v3(12, 14, 11);
                scene_picture p = scene_draw(&s, r, &params, &settings);
                if (form == 0)
                    first = p;
                if (form == 1)
                    assert_true(p.stats.all.splats_read < first.stats.all.splats_read);
                if (form > 0)
                    assert_memory_equal(p.rgba, first.rgba, 24 * 24 * 4 * sizeof *p.rgba);
                if (form > 0)
                    scene_picture_free(&p);
                scene_destroy(&s);
            }
            scene_picture_free(&first);
        }
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_slab_has_the_opacity_of_the_path_through_it),
        cmocka_unit_test(a_cube_has_the_opacity_of_the_path_through_its_sides),
        cmocka_unit_test(a_narrow_peak_counts_fully_at_any_samples_per_sheet),
        cmocka_unit_test(values_fall_to_the_halo_and_end_without_it),
        cmocka_unit_test(a_cell_without_a_corner_is_empty),
        cmocka_unit_test(inside_the_volume_voxels_before_the_eye_are_visible),
        cmocka_unit_test(a_parallel_view_from_inside_begins_at_the_next_sample),
        cmocka_unit_test(rays_beside_the_grid_are_empty),
        cmocka_unit_test(the_nearest_wall_hides_those_behind_it),
        cmocka_unit_test(walls_on_both_sides_of_the_eye_are_visible),
        cmocka_unit_test(a_terminated_pixel_is_opaque),
        cmocka_unit_test(shading_uses_differences_of_values),
        cmocka_unit_test(a_segment_is_lit_by_the_mean_of_both_gradients),
        cmocka_unit_test(voxels_skipped_by_a_segment_are_visible_and_lit),
        cmocka_unit_test(depth_is_the_mean_visible_distance),
        cmocka_unit_test(mirrored_turned_and_moved_volumes_look_the_same),
        cmocka_unit_test(the_error_falls_with_the_square_of_the_samples_per_sheet),
        cmocka_unit_test(values_at_the_sides_converge_to_the_integral),
        cmocka_unit_test(the_cubic_kernel_gives_the_cubic_integral),
        cmocka_unit_test(the_end_of_the_function_counts_beyond_the_table),
        cmocka_unit_test(samples_between_sheets_have_the_values_of_the_kernel),
        cmocka_unit_test(voxels_beyond_the_halo_repeat_their_neighbours),
        cmocka_unit_test(renderers_leave_out_the_same_voxels_beyond_the_halo),
        cmocka_unit_test(every_kernel_preserves_a_constant_value),
        cmocka_unit_test(turning_across_45_degrees_does_not_pop),
        cmocka_unit_test(bricks_and_coarser_levels_change_no_bit),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
