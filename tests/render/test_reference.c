/* Tests that every renderer must pass: order, opacity, counts and geometry. */
#include "scenes.h"
#include "splat.h"
#include "test.h"
#include "weight.h"

#include <string.h>

static trip_settings unlit(trip_method method, double h)
{
    trip_settings s = trip_settings_default();
    s.method = method;
    s.h = h;
    s.shading = false;
    return s;
}

/* Codes of the sheets and walls below. */
enum { RED = 10, GREEN = 20, BLUE = 30 };

static void colour_codes(scene *s)
{
    scene_colour(s, RED, RED, 1, 0, 0, 0.9999);
    scene_colour(s, GREEN, GREEN, 0, 1, 0, 0.9999);
    scene_colour(s, BLUE, BLUE, 0, 0, 1, 0.9999);
}

/* Along *user: a red sheet at 5, a green one at 12, a blue one at 18. */
static bool three_sheets(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    const int at[3] = { i, j, k };
    int c = at[*(int *)user];
    (void)gradient;
    *code = c == 5 ? RED : c == 12 ? GREEN : BLUE;
    return c == 5 || c == 12 || c == 18;
}

static void the_nearest_sheet_is_in_front_for_every_axis_side_and_method(void **state)
{
    (void)state;
    for (int axis = 0; axis < 3; axis++) {
        scene s;
        scene_create(&s, &(scene_params){ .dims = { 24, 24, 24 },
                                          .tile_voxels = 16,
                                          .voxel = three_sheets,
                                          .user = &axis });
        colour_codes(&s);
        for (int i = 0; i < 12; i++) {
            double d[3] = { 0.5, 0.3, -0.4 };
            d[axis] = i % 2 ? 1 : -1;
            trip_camera_params view = scene_view(&s, trip_v3(d[0], d[1], d[2]), 60, 20, 16);
            view.ortho_height = i / 6 ? 8 : 0;
            trip_settings settings = unlit((trip_method)(i / 2 % 3), 0.3);
            for (const scene_renderer *r = scene_renderers(); r->name; r++) {
                scene_picture p = scene_draw(&s, r, &view, &settings);
                const float *c = scene_pixel(&p, 8, 8);
                assert_close(c[i % 2 ? 2 : 0], 1, 0.01);
                assert_close(c[i % 2 ? 0 : 2], 0, 0.01);
                assert_close(c[1], 0, 0.01);
                scene_picture_free(&p);
            }
        }
        scene_destroy(&s);
    }
}

/* Rays pass through voxels and between them, in a body of one extinction. Pixels are so small that
 * the low-pass filter has no effect. */
static void small_kernels_leave_the_ripple_that_the_formula_gives(void **state)
{
    (void)state;
    enum { SHEETS = 6 };
    scene s;
    scene_create(&s, &(scene_params){ .dims = { SHEETS, 16, 16 } });
    for (int i = 0; i < 5; i++) {
        const double radii[5] = { 0.5, 0.8, 1, 1.5, 2 };
        trip_settings settings = unlit(TRIP_METHOD_MERGE, 0.5);
        settings.kernel_radius = radii[i];
        trip_splat_ripple ripple = trip_splat_ripple_of(radii[i]);
        double max = ripple.through > 1 ? ripple.through : 1;
        s.table[65535] = (trip_tf_entry){ 1, 1, 1, (float)(0.2 / max) };
        for (int between = 0; between < 2; between++) {
            trip_camera_params view = { .eye = { -20, 8 - 0.5 * between, 8 - 0.5 * between },
                                        .up = { 0, 0, 1 },
                                        .ortho_height = 0.001,
                                        .width = 1,
                                        .height = 1 };
            view.look = trip_add(view.eye, trip_v3(1, 0, 0));
            for (const scene_renderer *r = scene_renderers(); r->name; r++) {
                scene_picture p = scene_draw(&s, r, &view, &settings);
                double depth = -log1p(-(double)p.rgba[3]);
                double sum = between ? ripple.between : ripple.through;
                assert_close(depth * max / (0.2 * SHEETS), sum, 1e-3);
                scene_picture_free(&p);
            }
        }
    }
    scene_destroy(&s);
}

static bool lone_voxel(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    (void)user;
    (void)gradient;
    *code = 65535;
    return i == 3 && j == 3 && k == 3;
}

/* Integrates the opacity of a splat without low-pass filter over the plane. It uses Simpson's rule
 * over the squared radius, because area is proportional to it. */
static double area_covered(double extinction)
{
    enum { STEPS = 20000 };
    const double k2 = TRIP_CUTOFF * TRIP_CUTOFF, edge = exp(-k2 / 2), pi = 3.14159265358979323846;
    const double sigma2 = TRIP_KERNEL_RADIUS_VOXELS * TRIP_KERNEL_RADIUS_VOXELS / k2;
    double amplitude = 1 / (2 * pi * sigma2) / (1 - edge * (1 + k2 / 2)), sum = 0;
    for (int i = 0; i <= STEPS; i++) {
        double m = k2 * i / STEPS, weight = i == 0 || i == STEPS ? 1 : 2 + 2 * (i % 2);
        sum -= weight * expm1(-extinction * amplitude * (exp(-m / 2) - edge));
    }
    return pi * sigma2 * sum * k2 / STEPS / 3;
}

static void a_lone_voxel_covers_its_area_where_it_is_a_few_pixels_wide(void **state)
{
    (void)state;
    enum { SIZE = 64, VOXEL_PX = 8 };
    scene s;
    scene_create(&s, &(scene_params){ .dims = { 7, 7, 7 }, .voxel = lone_voxel });
    trip_settings settings = unlit(TRIP_METHOD_MERGE, 0.5);
    settings.background[3] = 0;
    trip_camera_params view = scene_view(&s, trip_v3(1, 0.2, 0.3), 20, 0, SIZE);
    view.ortho_height = (double)SIZE / VOXEL_PX;
    for (double extinction = 0.1; extinction < 2000; extinction *= 10) {
        s.table[65535] = (trip_tf_entry){ 1, 1, 1, (float)extinction };
        for (const scene_renderer *r = scene_renderers(); r->name; r++) {
            scene_picture p = scene_draw(&s, r, &view, &settings);
            double sum = 0;
            for (int n = 0; n < SIZE * SIZE; n++)
                sum += (double)p.rgba[4 * n + 3];
            double area = area_covered(extinction);
            assert_true(fabs(sum / (VOXEL_PX * VOXEL_PX) - area) < 0.02 * area);
            scene_picture_free(&p);
        }
    }
    scene_destroy(&s);
}

/* The picture of the sheet may be very small. */
static void a_sheet_of_voxels_has_its_opacity_at_any_zoom(void **state)
{
    (void)state;
    scene s;
    scene_create(&s, &(scene_params){ .dims = { 1, 200, 200 } });
    trip_settings settings = unlit(TRIP_METHOD_MERGE, 0.5);
    settings.background[3] = 0;
    for (int i = 0; i < 12; i++) {
        const double opacities[3] = { 0.05, 0.5, 0.9 }, pixels[4] = { 0.05, 0.3, 1, 2 };
        double opacity = opacities[i % 3], size = 9 / pixels[i / 3];
        scene_colour(&s, 0, 65535, 1, 1, 1, opacity);
        trip_camera_params view = scene_view(&s, trip_v3(1, 0, 0), 20, 0, 9);
        view.ortho_height = size;
        for (const scene_renderer *r = scene_renderers(); r->name; r++) {
            scene_picture p = scene_draw(&s, r, &view, &settings);
            assert_close(scene_pixel(&p, 4, 4)[3] / opacity, 1, 0.01);
            scene_picture_free(&p);
        }
    }
    scene_destroy(&s);
}

/* A room with green walls, and red ones behind them. */
static bool double_walls(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    const int at[3] = { i, j, k };
    int nearest = 100;
    (void)user;
    (void)gradient;
    for (int a = 0; a < 3; a++)
        nearest = at[a] < nearest ? at[a] : 79 - at[a] < nearest ? 79 - at[a] : nearest;
    *code = nearest >= 6 ? GREEN : RED;
    return nearest == 2 || nearest == 6 || nearest == 7;
}

/* Returns the share of pixels that show the outer, red walls. In the corners of the room, where
 * kernels of two walls overlap, the red walls shine through the inner ones with less than 0.1. */
static double red_share(const scene_picture *p)
{
    int red = 0;
    for (int i = 0; i < p->width * p->height; i++)
        red += p->rgba[4 * i] > 0.2F;
    return (double)red / (p->width * p->height);
}

static void inside_a_room_outward_order_is_right_and_ascending_order_fails(void **state)
{
    (void)state;
    scene s;
    scene_create(&s, &(scene_params){ .dims = { 80, 80, 80 }, .voxel = double_walls });
    colour_codes(&s);
    const double fields[] = { 100, 130, 160 };
    const trip_vec3 view_directions[] = {
        { 1, 0.1, 0.2 }, { 0.1, -1, 0.1 }, { 0.1, 1, -0.2 }, { 0.1, 0.2, -1 }
    };
    for (int i = 0; i < 12; i++) {
        trip_camera_params view = scene_view(&s, trip_v3(1, 0, 0), 1, fields[i % 3], 96);
        view.eye = trip_v3(38.3, 40.1, 41.2);
        view.look = trip_add(view.eye, view_directions[i / 3]);
        view.up = trip_v3(0.3, 0.2, 0.5);
        trip_settings outward = unlit((trip_method)(i % 2), 0.85), ascending = outward;
        ascending.traversal = TRIP_TRAVERSAL_ASCENDING;
        for (const scene_renderer *r = scene_renderers(); r->name; r++) {
            scene_picture right = scene_draw(&s, r, &view, &outward);
            scene_picture wrong = scene_draw(&s, r, &view, &ascending);
            assert_true(red_share(&right) == 0);
            assert_true(red_share(&wrong) > 0.02);
            scene_picture_free(&right);
            scene_picture_free(&wrong);
        }
    }
    scene_destroy(&s);
}

/* Opaque specks of eight colours in random order. */
static bool confetti(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    (void)user;
    (void)gradient;
    *code = scene_hash(i, j, k) % 8;
    return true;
}

static int max_aligned_axis(const trip_camera *c, int x, int y)
{
    trip_settings clip = unlit(TRIP_METHOD_CLIP, 0);
    trip_vec3 ray = trip_camera_ray(c, x + 0.5, y + 0.5);
    for (int axis = 0; axis < 2; axis++)
        if (trip_weight(&clip, 0, ray, axis) > 0)
            return axis;
    return 2;
}

/* Returns the mean step between neighbouring pixels where the most aligned axis changes, divided
 * by the mean step elsewhere. */
static double step_across_lines(const scene_picture *p, const trip_camera *c)
{
    double sum[2] = { 0, 0 };
    int count[2] = { 0, 0 };
    for (int y = 0; y < p->height; y++) {
        for (int x = 0; x + 1 < p->width; x++) {
            const float *a = scene_pixel(p, x, y), *b = scene_pixel(p, x + 1, y);
            int line = max_aligned_axis(c, x, y) != max_aligned_axis(c, x + 1, y);
            sum[line] += fabs(a[0] - b[0]) + fabs(a[1] - b[1]) + fabs(a[2] - b[2]);
            count[line]++;
        }
    }
    assert_true(count[0] > 0 && count[1] > 0);
    return sum[1] / count[1] / (sum[0] / count[0]);
}

/* Hofsetz & Max 2005, section 5.2 and Figure 10: once large kernels overlap in a zoomed view,
 * `clip` shows a line where the regions of two lists meet. `merge` does not. */
static void large_kernels_show_lines_when_clipped_and_none_when_merged(void **state)
{
    (void)state;
    scene s;
    scene_create(&s, &(scene_params){ .dims = { 24, 24, 24 }, .voxel = confetti });
    for (unsigned code = 0; code < 8; code++)
        scene_colour(&s, code, code, code & 1, code >> 1 & 1, code >> 2, 0.8);
    trip_camera_params view = scene_view(&s, trip_v3(1, 0.98, 0.3), 30, 24, 120);
    trip_camera camera;
    assert_int_equal(trip_camera_make(&camera, &view, &s.data->index_to_world), 0);
    for (const scene_renderer *r = scene_renderers(); r->name; r++) {
        trip_settings clip = unlit(TRIP_METHOD_CLIP, 0.85), merge = unlit(TRIP_METHOD_MERGE, 0.85);
        clip.kernel_radius = merge.kernel_radius = 5;
        scene_picture clipped = scene_draw(&s, r, &view, &clip);
        scene_picture merged = scene_draw(&s, r, &view, &merge);
        assert_true(step_across_lines(&clipped, &camera) > 4);
        assert_true(step_across_lines(&merged, &camera) < 1.5);
        scene_picture_free(&clipped);
        scene_picture_free(&merged);
    }
    scene_destroy(&s);
}

static void from_outside_ascending_order_draws_the_same_picture(void **state)
{
    (void)state;
    scene s;
    int axis = 1;
    scene_create(&s,
                 &(scene_params){ .dims = { 24, 24, 24 }, .voxel = three_sheets, .user = &axis });
    colour_codes(&s);
    scene_colour(&s, GREEN, GREEN, 0, 1, 0, 0.3);
    scene_colour(&s, RED, RED, 1, 0, 0, 0.4);
    const trip_vec3 directions[] = { { 1, 2, -1.5 }, { -2, 1, 3 }, { -1, -2, -1 } };
    for (int i = 0; i < 3; i++) {
        trip_camera_params view = scene_view(&s, directions[i], 70, 25, 32);
        trip_settings outward = unlit(TRIP_METHOD_MERGE, 0.5), ascending = outward;
        ascending.traversal = TRIP_TRAVERSAL_ASCENDING;
        for (const scene_renderer *r = scene_renderers(); r->name; r++) {
            scene_picture a = scene_draw(&s, r, &view, &outward);
            scene_picture b = scene_draw(&s, r, &view, &ascending);
            /* Early termination affects front-to-back drawing only. */
            assert_true(scene_difference(&a, &b) < 2 * TRIP_EARLY_TERMINATION_PRE + r->tolerance);
            scene_picture_free(&a);
            scene_picture_free(&b);
        }
    }
    scene_destroy(&s);
}

static const trip_affine grids[] = {
    { { { 1, 0, 0, 0 }, { 0, 1, 0, 0 }, { 0, 0, 1, 0 } } },
    { { { 0.5, 0, 0, 7 }, { 0, 0.8, 0, 1 }, { 0, 0, 2, -3 } } },
    { { { 0.6, 0.2, 0.1, 2 }, { -0.3, 0.9, 0.2, 1 }, { 0.1, -0.2, 1.1, 0 } } }, /* sheared */
    { { { -1, 0, 0, 0 }, { 0, 0, 1, 0 }, { 0, 1, 0, 0 } } },
};

/* Returns the world length of a line through the body's centre inside the body of `dims` voxels. */
static double length_inside(const trip_affine *grid, const int64_t dims[3], trip_vec3 direction)
{
    trip_affine inverse;
    assert_true(trip_affine_invert(grid, &inverse));
    trip_vec3 d = trip_affine_vector(&inverse, trip_normalize(direction));
    double t = 1e9;
    for (int a = 0; a < 3; a++)
        t = fmin(t, (double)dims[a] / fabs(trip_component(d, a)));
    return t;
}

/* Checks the opacity 1 - (1 - o)^L of a constant body, with L in voxel lengths. */
static void check_body(const int64_t dims[3], const trip_affine *grid, trip_vec3 direction,
                       double distance, bool ortho, trip_method method)
{
    const double opacity = 0.06;
    scene s;
    scene_create(&s,
                 &(scene_params){ .dims = { dims[0], dims[1], dims[2] }, .index_to_world = *grid });
    scene_colour(&s, 0, 65535, 1, 0.5, 0.25, opacity);
    double voxel = cbrt(fabs(trip_affine_determinant(grid)));
    double expected = 1 - pow(1 - opacity, length_inside(grid, dims, direction) / voxel);
    trip_camera_params view = scene_view(&s, direction, distance, 20, 33);
    view.ortho_height = ortho ? distance * 0.4 : 0;
    trip_settings settings = unlit(method, 0.5);
    settings.background[3] = 0;
    for (const scene_renderer *r = scene_renderers(); r->name; r++) {
        scene_picture p = scene_draw(&s, r, &view, &settings);
        const float *c = scene_pixel(&p, 16, 16);
        assert_close(c[3], expected, 0.01 * expected);
        assert_close(c[0], expected, 0.01 * expected);
        assert_close(c[1], 0.5 * expected, 0.01 * expected);
        scene_picture_free(&p);
    }
    scene_destroy(&s);
}

static void a_constant_body_has_its_opacity_from_any_side_at_any_zoom(void **state)
{
    (void)state;
    const int64_t flat[3] = { 30, 30, 9 }, cube[3] = { 26, 26, 26 };
    const double distances[] = { 32, 60, 200, 800 };
    const trip_vec3 directions[] = {
        { 0, 0, 1 }, { 0.2, -0.1, -1 }, { 0.3, 0.2, 1 }, { 1, 0.15, 0.1 }, { -0.2, 1, -0.1 }
    };
    for (int i = 0; i < 24; i++) {
        const trip_affine *grid = &grids[i % 4];
        /* The directions pass through opposite faces only, because edges and corners blur. */
        trip_vec3 d = trip_affine_vector(grid, directions[i % 3]);
        check_body(flat, grid, d, distances[i / 2 % 4], i % 2, (trip_method)(i % 3));
        d = trip_affine_vector(grid, directions[i % 5]);
        check_body(cube, grid, d, distances[i / 2 % 4], i % 2, (trip_method)(i % 3));
    }
}

static void a_larger_kernel_blurs_but_keeps_the_opacity(void **state)
{
    (void)state;
    scene s;
    scene_create(&s, &(scene_params){ .dims = { 40, 40, 12 } });
    scene_colour(&s, 0, 65535, 1, 1, 1, 0.1);
    trip_camera_params view = scene_view(&s, trip_v3(0, 0, 1), 60, 20, 17);
    for (int i = 0; i < 3; i++) {
        trip_settings settings = unlit(TRIP_METHOD_MERGE, 0.85);
        settings.kernel_radius = 1.8 + i;
        for (const scene_renderer *r = scene_renderers(); r->name; r++) {
            scene_picture p = scene_draw(&s, r, &view, &settings);
            assert_close(scene_pixel(&p, 8, 8)[0], 1 - pow(0.9, 12), 0.01);
            scene_picture_free(&p);
        }
    }
    scene_destroy(&s);
}

static uint64_t drawn(const scene_picture *p)
{
    return p->stats.all.splats_drawn;
}

static uint64_t count_drawn(const scene *s, const scene_renderer *r, const trip_camera_params *view,
                            trip_method method, double h)
{
    trip_settings settings = unlit(method, h);
    scene_picture p = scene_draw(s, r, view, &settings);
    uint64_t n = drawn(&p);
    scene_picture_free(&p);
    return n;
}

static bool half_random(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    uint32_t x = scene_hash(i, j, k);
    (void)user;
    *code = 1 + x % 65535;
    for (int a = 0; a < 3; a++)
        gradient[a] = ((double)(x >> 8 * a & 255) - 127) / 256;
    return x & 1 << 20;
}

static void
with_h_zero_all_lists_are_drawn_and_a_parallel_view_along_an_axis_draws_one(void **state)
{
    (void)state;
    scene s;
    scene_create(&s, &(scene_params){ .dims = { 20, 30, 25 }, .voxel = half_random });
    scene_colour(&s, 1, 65535, 1, 1, 1, 0.1);
    uint64_t kept = s.data->header.kept;
    assert_true(kept > 5000 && kept < 10000);
    for (const scene_renderer *r = scene_renderers(); r->name; r++) {
        trip_camera_params view = scene_view(&s, trip_v3(1, -2, 0.7), 90, 30, 64);
        assert_int_equal(count_drawn(&s, r, &view, TRIP_METHOD_MERGE, 0), 3 * kept);
        for (int axis = 0; axis < 3; axis++) {
            view = scene_view(&s, trip_v3(axis == 0, axis == 1, axis == 2), 90, 30, 64);
            view.ortho_height = 45;
            assert_int_equal(count_drawn(&s, r, &view, TRIP_METHOD_MERGE, 0), kept);
        }
    }
    scene_destroy(&s);
}

static void fewer_splats_are_drawn_as_h_rises_fewer_by_clip_and_fewest_by_axis(void **state)
{
    (void)state;
    scene s;
    scene_create(&s, &(scene_params){ .dims = { 30, 30, 30 }, .voxel = half_random });
    scene_colour(&s, 1, 65535, 1, 1, 1, 0.1);
    uint64_t kept = s.data->header.kept;
    trip_camera_params view = scene_view(&s, trip_v3(1, 1.05, 0.95), 70, 45, 100);
    for (const scene_renderer *r = scene_renderers(); r->name; r++) {
        const double hs[] = { 0, 0.5, 0.75, 0.85, 0.95 };
        uint64_t before = 3 * kept + 1, n = 0;
        for (int i = 0; i < 5; i++) {
            n = count_drawn(&s, r, &view, TRIP_METHOD_MERGE, hs[i]);
            assert_true(n < before);
            before = n;
        }
        uint64_t clip = count_drawn(&s, r, &view, TRIP_METHOD_CLIP, 0.85);
        uint64_t axis = count_drawn(&s, r, &view, TRIP_METHOD_AXIS, 0.85);
        assert_true(clip < n);
        assert_true(axis < clip);
        assert_int_equal(axis, kept);
    }
    scene_destroy(&s);
}

/* A ball in world space on any grid. */
typedef struct ball {
    const trip_affine *grid;
    trip_vec3 centre;
    double radius;
} ball;

static bool in_ball(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    const ball *b = user;
    trip_vec3 d = trip_sub(trip_affine_point(b->grid, trip_v3(i, j, k)), b->centre);
    (void)gradient;
    *code = RED;
    return trip_length(d) <= b->radius;
}

/* Mass, mean and covariance of the picture's optical depth, in pixels. */
typedef struct moments {
    double mass, x, y, xx, xy, yy;
} moments;

static moments measure(const scene_picture *p)
{
    moments m = { 0 };
    for (int i = 0; i < p->width * p->height; i++) {
        double depth = -log1p(-(double)p->rgba[4 * i + 3]);
        double x = i % p->width + 0.5, y = (double)(i / p->width) + 0.5;
        m.mass += depth;
        m.x += depth * x;
        m.y += depth * y;
        m.xx += depth * x * x;
        m.xy += depth * x * y;
        m.yy += depth * y * y;
    }
    m.x /= m.mass;
    m.y /= m.mass;
    m.xx = m.xx / m.mass - m.x * m.x;
    m.xy = m.xy / m.mass - m.x * m.y;
    m.yy = m.yy / m.mass - m.y * m.y;
    return m;
}

/* Returns the covariance that one kernel adds, in world units: sigma^2 J J^T seen along a and b. */
static double kernel_covariance(const trip_affine *grid, trip_vec3 a, trip_vec3 b)
{
    double sigma = TRIP_KERNEL_RADIUS_VOXELS / TRIP_CUTOFF;
    return sigma * sigma *
           trip_dot(trip_affine_transpose_vector(grid, a), trip_affine_transpose_vector(grid, b));
}

static void check_ball(const scene *s, const ball *b, double ortho_height, const scene_picture *p)
{
    double px = p->height / ortho_height; /* per world unit */
    trip_vec3 forward = trip_normalize(trip_v3(-1, 0.6, -0.5));
    trip_vec3 right = trip_normalize(trip_cross(forward, trip_v3(0, 0, 1)));
    trip_vec3 down = trip_scale(trip_cross(right, forward), -1);
    double variance = b->radius * b->radius / 5 * px * px + TRIP_LOW_PASS_PX * TRIP_LOW_PASS_PX;
    double voxel = cbrt(fabs(trip_affine_determinant(b->grid)));
    double tau = trip_extinction(0.01) / voxel;
    moments m = measure(p);
    assert_close(m.mass, (double)s->data->header.kept * tau * voxel * voxel * voxel * px * px,
                 5e-3);
    assert_close(m.x, 0.5 * p->width, 5e-3);
    assert_close(m.y, 0.5 * p->height, 5e-3);
    assert_close(m.xx, variance + kernel_covariance(b->grid, right, right) * px * px, 0.03);
    assert_close(m.yy, variance + kernel_covariance(b->grid, down, down) * px * px, 0.03);
    assert_true(fabs(m.xy - kernel_covariance(b->grid, right, down) * px * px) < 0.03 * m.xx);
}

static void a_ball_is_round_and_in_place_on_anisotropic_and_sheared_grids(void **state)
{
    (void)state;
    for (int g = 0; g < 4; g++) {
        ball b = { .grid = &grids[g], .radius = 8 };
        b.centre = trip_affine_point(b.grid, trip_v3(23.5, 23.5, 23.5));
        scene s;
        scene_create(&s, &(scene_params){ .dims = { 48, 48, 48 },
                                          .index_to_world = *b.grid,
                                          .voxel = in_ball,
                                          .user = &b });
        scene_colour(&s, RED, RED, 1, 0, 0, 0.01);
        trip_camera_params view = scene_view(&s, trip_v3(1, -0.6, 0.5), 90, 30, 100);
        view.ortho_height = 30;
        trip_settings settings = unlit(TRIP_METHOD_MERGE, 0.85);
        settings.background[3] = 0;
        for (const scene_renderer *r = scene_renderers(); r->name; r++) {
            scene_picture p = scene_draw(&s, r, &view, &settings);
            check_ball(&s, &b, view.ortho_height, &p);
            scene_picture_free(&p);
        }
        scene_destroy(&s);
    }
}

static bool one_voxel(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    (void)user;
    (void)gradient;
    *code = i == 3 ? RED : GREEN;
    return (i == 3 || i == 13) && j == 7 && k == 5;
}

static void two_splats_in_line_composite_front_over_back_over_background(void **state)
{
    (void)state;
    scene s;
    scene_create(&s, &(scene_params){ .dims = { 16, 16, 16 }, .voxel = one_voxel });
    scene_colour(&s, RED, RED, 1, 0, 0, 0.7);
    scene_colour(&s, GREEN, GREEN, 0, 1, 0, 0.9);
    trip_settings settings = unlit(TRIP_METHOD_MERGE, 0.85);
    settings.background[2] = 0.5;
    settings.background[3] = 0.8;
    trip_camera_params view = { .eye = { -30, 7, 5 },
                                .look = { 0, 7, 5 },
                                .up = { 0, 0, 1 },
                                .ortho_height = 4,
                                .width = 401,
                                .height = 401 };
    /* The ray passes through both centres. At 100 px per voxel the low-pass filter hardly matters.
     */
    double sigma = 2 / TRIP_CUTOFF, k2 = TRIP_CUTOFF * TRIP_CUTOFF, edge = exp(-k2 / 2);
    /* The splat is a Gaussian that is cut off at a radius of k sigma and lowered to reach 0 there.
     */
    double volume = 6.28318530717958647692 * sigma * sigma * (1 - edge * (1 + k2 / 2));
    double peak = (1 - edge) / volume;
    double red = 1 - pow(0.3, peak), green = 1 - pow(0.1, peak);
    for (const scene_renderer *r = scene_renderers(); r->name; r++) {
        scene_picture p = scene_draw(&s, r, &view, &settings);
        const float *c = scene_pixel(&p, 200, 200);
        double behind = (1 - red) * (1 - green);
        assert_close(c[0], red, 1e-4);
        assert_close(c[1], (1 - red) * green, 1e-4);
        assert_close(c[2], behind * 0.5 * 0.8, 1e-4);
        assert_close(c[3], 1 - behind + behind * 0.8, 1e-4);
        /* One voxel radius beside the centre. */
        c = scene_pixel(&p, 300, 200);
        double beside = (exp(-1 / (2 * sigma * sigma)) - edge) / volume;
        assert_close(c[0], 1 - pow(0.3, beside), 1e-3);
        assert_close(scene_pixel(&p, 0, 0)[0], 0, 0);
        scene_picture_free(&p);
    }
    scene_destroy(&s);
}

static void undrawn_lists_keep_their_share_of_the_merge(void **state)
{
    (void)state;
    /* All bricks are transparent, so that the picture is the background. */
    scene s;
    scene_create(&s, &(scene_params){ .dims = { 20, 20, 20 }, .voxel = half_random });
    trip_settings settings = unlit(TRIP_METHOD_MERGE, 0);
    const double background[4] = { 0.25, 0.5, 1, 0.5 };
    memcpy(settings.background, background, sizeof background);
    trip_camera_params view = scene_view(&s, trip_v3(1, 1, 1), 50, 30, 8);
    for (const scene_renderer *r = scene_renderers(); r->name; r++) {
        scene_picture p = scene_draw(&s, r, &view, &settings);
        assert_int_equal(drawn(&p), 0);
        for (int i = 0; i < 64; i++) {
            assert_close(p.rgba[4 * i], 0.125, 1e-6);
            assert_close(p.rgba[4 * i + 1], 0.25, 1e-6);
            assert_close(p.rgba[4 * i + 2], 0.5, 1e-6);
            assert_close(p.rgba[4 * i + 3], 0.5, 1e-6);
        }
        scene_picture_free(&p);
    }
    scene_destroy(&s);
}

/* Draws a scene, shaded and translucent, from views that read all lists from both sides. */
static scene_picture draw_variant(unsigned tile, unsigned slab, const trip_reader_params *reader,
                                  int view_number)
{
    scene s;
    scene_create(&s, &(scene_params){ .dims = { 70, 40, 50 },
                                      .tile_voxels = tile,
                                      .slab_sheets = slab,
                                      .normals = true,
                                      .voxel = half_random });
    scene_colour(&s, 1, 20000, 1, 0.2, 0.1, 0.01);
    scene_colour(&s, 30000, 65535, 0.2, 0.4, 1, 0.2);
    trip_camera_params view =
        scene_view(&s, trip_v3(1, 0.9, -0.8), view_number ? 20 : 110, view_number ? 110 : 40, 48);
    trip_settings settings = trip_settings_default();
    settings.h = 0.4;
    scene_picture p = scene_draw_with(&s, scene_renderers(), &view, &settings, reader);
    scene_destroy(&s);
    return p;
}

static void the_reference_picture_is_the_same_to_the_bit_however_it_is_stored_and_read(void **state)
{
    (void)state;
    const struct {
        unsigned tile, slab;
        trip_reader_params reader;
    } variants[] = {
        { 16, 8, { 0 } },
        { 32, 1, { .slots = 2, .slot_bytes = 4096 } },
        { 128, 64, { .slots = 64, .slot_bytes = 8192 } },
        { 64, 5, { .engine = TRIP_ENGINE_PREAD, .threads = 1 } },
        { 64, 8, { .engine = TRIP_ENGINE_PREAD, .threads = 8, .slots = 3, .slot_bytes = 4096 } },
        { 64, 8, { .engine = TRIP_ENGINE_NULL } },
        { 64, 8, { .buffered = true, .gap_bytes = 4096 } },
    };
    for (int view = 0; view < 2; view++) {
        scene_picture first = draw_variant(64, 8, &(trip_reader_params){ 0 }, view);
        size_t bytes = (size_t)first.width * (size_t)first.height * 4 * sizeof(float);
        for (size_t i = 0; i < sizeof variants / sizeof variants[0]; i++) {
            scene_picture p =
                draw_variant(variants[i].tile, variants[i].slab, &variants[i].reader, view);
            assert_memory_equal(p.rgba, first.rgba, bytes);
            scene_picture_free(&p);
        }
        scene_picture_free(&first);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(small_kernels_leave_the_ripple_that_the_formula_gives),
        cmocka_unit_test(a_lone_voxel_covers_its_area_where_it_is_a_few_pixels_wide),
        cmocka_unit_test(a_sheet_of_voxels_has_its_opacity_at_any_zoom),
        cmocka_unit_test(the_nearest_sheet_is_in_front_for_every_axis_side_and_method),
        cmocka_unit_test(inside_a_room_outward_order_is_right_and_ascending_order_fails),
        cmocka_unit_test(large_kernels_show_lines_when_clipped_and_none_when_merged),
        cmocka_unit_test(from_outside_ascending_order_draws_the_same_picture),
        cmocka_unit_test(a_constant_body_has_its_opacity_from_any_side_at_any_zoom),
        cmocka_unit_test(a_larger_kernel_blurs_but_keeps_the_opacity),
        cmocka_unit_test(
            with_h_zero_all_lists_are_drawn_and_a_parallel_view_along_an_axis_draws_one),
        cmocka_unit_test(fewer_splats_are_drawn_as_h_rises_fewer_by_clip_and_fewest_by_axis),
        cmocka_unit_test(a_ball_is_round_and_in_place_on_anisotropic_and_sheared_grids),
        cmocka_unit_test(two_splats_in_line_composite_front_over_back_over_background),
        cmocka_unit_test(undrawn_lists_keep_their_share_of_the_merge),
        cmocka_unit_test(
            the_reference_picture_is_the_same_to_the_bit_however_it_is_stored_and_read),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
