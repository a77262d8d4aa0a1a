/* Compares the pixels that the kernels assign to a splat with the splat's support in double
 * precision. Grids have any shape, kernels any size and views any angle. Voxels are up to 10^5
 * pixels large. */
#include "cpu/kernels/isa.h"
#include "cpu/cpu_view.h"
#include "scenes.h"
#include "splat.h"
#include "test.h"

#include <string.h>

enum { EDGE = 32, SIZE = 200, VIEWS = 3000, VOXELS = 16 };

typedef struct fixture {
    trip_camera camera;
    trip_settings settings;
    trip_plan plan;
    trip_frame frame;
    trip_cpu_view view;
    trip_cpu_staged staged;
    trip_cpu_lanes lanes;
    trip_cpu_splat out[TRIP_CPU_STAGED + 16];
    trip_vec3 looked_at;
    int checked, near;
} fixture;

/* Returns a grid of cubes, a grid 4000 times as long along one axis, a sheared grid, or one with
 * both. */
static trip_affine grid_of(int i)
{
    trip_affine m = trip_affine_identity();
    for (int a = 0; a < 3; a++)
        m.m[a][a] = i % 4 == a + 1 ? 4000 : 1;
    for (int n = 0; n < 9 && i / 4 % 2; n++)
        if (n / 3 != n % 3)
            m.m[n / 3][n % 3] += 0.5 * (test_random() - 0.5);
    return m;
}

static trip_vec3 random_position(void)
{
    return trip_v3(EDGE * test_random(), EDGE * test_random(), EDGE * test_random());
}

static trip_vec3 random_direction(void)
{
    trip_vec3 v = { test_random() - 0.5, test_random() - 0.5, test_random() - 0.5 };
    return trip_normalize(v);
}

/* Returns a view from a random position in the grid towards a voxel, or from far away. The cube
 * root of a voxel's volume is 10^-2 to 10^5 pixels. */
static trip_camera_params random_view(int i, const trip_affine *grid, trip_vec3 look)
{
    const double angles[6] = { 1e-3, 0.1, 10, 90, 150, 170 };
    trip_camera_params p = { .eye = trip_affine_point(grid, random_position()),
                             .look = trip_affine_point(grid, look),
                             .up = { 0.31, 0.2, 0.93 },
                             .fov_degrees = angles[i % 6],
                             .width = SIZE,
                             .height = SIZE / 2 };
    if (i % 3 == 0)
        return p;
    double voxel = cbrt(fabs(trip_affine_determinant(grid)));
    double height = voxel * p.height / pow(10, -2 + 7 * test_random()), distance = 1e6 * voxel;
    p.eye = trip_add(p.look, trip_scale(random_direction(), distance));
    p.fov_degrees = 2 * atan(0.5 * height / distance) / 3.14159265358979323846 * 180;
    if (i % 3 == 1)
        p.ortho_height = height;
    return p;
}

static void look(fixture *f, const scene *s, int i)
{
    const double radii[4] = { 2, 0.7, 6, 25 };
    trip_affine grid = grid_of(i);
    f->looked_at = random_position();
    trip_camera_params view = random_view(i, &grid, f->looked_at);
    f->settings = trip_settings_default();
    f->settings.kernel_radius = radii[i % 4];
    assert_int_equal(trip_camera_make(&f->camera, &view, &grid), 0);
    f->frame = (trip_frame){ .data = s->data,
                             .camera = &f->camera,
                             .settings = &f->settings,
                             .plan = &f->plan,
                             .table = s->table };
    trip_cpu_layer_view_make(&f->view, &f->frame, 2, true);
}

/* The pixels with centres in [lo, hi] and in the image. The range is empty if `first` exceeds
 * `last`. */
typedef struct range {
    double first, last;
} range;

static range centres(double lo, double hi, int size)
{
    return (range){ fmax(0, ceil(lo - 0.5)), fmin(size - 1, floor(hi - 0.5)) };
}

/* Checks that the bounds contain few other pixels. */
static bool is_tight(double lo, double hi, int size, int first, int last)
{
    double room = 3 + 0.003 * (hi - lo) + 1e-5 * fmax(fabs(lo), fabs(hi));
    return first >= fmin(size - 1, fmax(0, lo - room)) && last <= fmax(0, fmin(size, hi + room));
}

static void check(fixture *f, const trip_cpu_kernels *k, int u, int v, int sheet)
{
    trip_splat s;
    f->staged.u[0] = u;
    f->staged.v[0] = v;
    f->staged.sheet[0] = sheet;
    f->staged.code[0] = 65535;
    bool drawn = k->project(&f->view, NULL, &f->staged, 1, &f->lanes, f->out, NULL) > 0;
    const trip_cpu_splat *o = &f->out[0];
    if (!trip_splat_project(&f->view.splat, trip_v3(u, v, sheet), &s)) {
        assert_false(drawn);
        return;
    }
    range x = centres(s.x0, s.x1, f->camera.width), y = centres(s.y0, s.y1, f->camera.height);
    bool some = x.first <= x.last && y.first <= y.last;
    bool all = drawn && o->x0 <= x.first && o->x1 >= x.last && o->y0 <= y.first && o->y1 >= y.last;
    if (some && !all)
        fail_msg("%s: [%g, %g] x [%g, %g] holds more than [%d, %d] x [%d, %d]%s", k->isa, s.x0,
                 s.x1, s.y0, s.y1, o->x0, o->x1, o->y0, o->y1, drawn ? "" : ", which is not drawn");
    if (drawn && !s.near) {
        assert_true(is_tight(s.x0, s.x1, f->camera.width, o->x0, o->x1));
        assert_true(is_tight(s.y0, s.y1, f->camera.height, o->y0, o->y1));
    }
    f->checked += drawn;
    f->near += drawn && s.near;
}

/* Checks a list along z, so that u is x and v is y. */
static void check_some(fixture *f, const trip_cpu_kernels *k, trip_vec3 position)
{
    check(f, k, (int)position.x + (int)(3 * test_random()) - 1, (int)position.y,
          (int)position.z + (int)(3 * test_random()) - 1);
}

static void every_pixel_of_a_support_is_among_those_of_the_splat(void **state)
{
    (void)state;
    scene s;
    fixture *f = aligned_alloc(64, (sizeof *f + 63) / 64 * 64);
    assert_non_null(f);
    memset(f, 0, sizeof *f);
    scene_create(&s, &(scene_params){ .dims = { EDGE, EDGE, EDGE } });
    scene_colour(&s, 0, 65535, 0.2, 0.5, 0.9, 0.7);
    for (const trip_cpu_kernels *const *isa = trip_cpu_isas(); *isa; isa++)
        for (int i = 0; i < VIEWS; i++) {
            look(f, &s, i);
            for (int n = 0; n < VOXELS; n++)
                check_some(f, *isa, n % 2 ? f->looked_at : random_position());
        }
    assert_true(f->checked > 10000 && f->near > 1000);
    scene_destroy(&s);
    free(f);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_pixel_of_a_support_is_among_those_of_the_splat),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
