/* Occlusion culling of squares in sheets. A square must stay if a ray through an open pixel centre
 * samples one of its voxels. The test follows each ray in double precision. */
#include "cpu/sheets/cpu_sheets_state.h"
#include "scenes.h"
#include "sheet.h"
#include "test.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Three by three panes. The last pane of each row and column is smaller. */
enum { SIZE = 90, ACROSS = 3, PANES = ACROSS * ACROSS };

/* A grid of two by two rasters, with the rasters around it. It serves for any list. */
enum { RASTERS = 4, SHEETS_AT_ONCE = 8 };
static const int64_t dims[3] = { 90, 70, 100 };

typedef struct fixture {
    scene scene;
    trip_camera camera;
    trip_settings settings;
    trip_plan plan;
    trip_frame frame;
    trip_cpu cpu;
    trip_cpu_sheets sheets;
    _Atomic uint64_t panes[PANES];
    uint8_t layers[PANES];
    uint64_t open[RASTERS * RASTERS];
    uint64_t taken, closed; /* sampled voxels, and squares left out */
} fixture;

static int set_up(void **state)
{
    fixture *f = calloc(1, sizeof *f);
    assert_non_null(f);
    scene_create(&f->scene, &(scene_params){ .dims = { dims[0], dims[1], dims[2] },
                                             .index_to_world = scene_sheared,
                                             .tile_voxels = 64 });
    *state = f;
    return 0;
}

static int tear_down(void **state)
{
    fixture *f = *state;
    scene_destroy(&f->scene);
    free(f);
    return 0;
}

/* Looks at one list of a view. `way` is the order of its sheets along the ray. */
static void look(fixture *f, const trip_camera_params *params, int axis, int64_t way,
                 trip_kernel kernel)
{
    static const trip_cpu_tf function;
    f->settings = trip_settings_default();
    f->settings.kernel = kernel;
    assert_int_equal(trip_camera_make(&f->camera, params, &f->scene.data->index_to_world), 0);
    f->frame = (trip_frame){ .data = f->scene.data,
                             .camera = &f->camera,
                             .settings = &f->settings,
                             .plan = &f->plan,
                             .table = f->scene.table };
    memset(f->layers, 7, sizeof f->layers);
    f->cpu = (trip_cpu){ .frame = &f->frame,
                         .mask = { { ACROSS, ACROSS }, f->panes },
                         .layers = f->layers };
    f->sheets = (trip_cpu_sheets){ .of = &f->cpu, .axis = axis, .way = way };
    f->sheets.store.first_u = f->sheets.store.first_v = -1;
    f->sheets.store.across = f->sheets.store.down = RASTERS;
    f->sheets.store.open = f->open;
    trip_cpu_pass_view_make(&f->sheets.view, &f->frame, axis, way < 0, &function);
}

/* Makes each pane open, terminated, or open at one texel in a given number. */
static void open_some(fixture *f, int seed)
{
    for (int pane = 0; pane < PANES; pane++) {
        uint64_t bits = 0;
        for (int i = 0; i < 64; i++)
            bits |= (uint64_t)(scene_hash(pane, i, seed) % 32 == 0) << i;
        const uint32_t kind = scene_hash(pane, seed, 7) % 4;
        f->panes[pane] = kind == 0 ? 0 : kind == 1 && seed % 3 == 0 ? UINT64_MAX : bits;
    }
}

static bool pixel_is_open(const fixture *f, int x, int y)
{
    const int texel = y % TRIP_CPU_PANE / 4 * 8 + x % TRIP_CPU_PANE / 4;
    return f->panes[y / TRIP_CPU_PANE * ACROSS + x / TRIP_CPU_PANE] >> texel & 1;
}

/* Finds the point of a pixel's ray at a coordinate along the list. Returns false if that point is
 * not before the eye, or if the ray is not drawn. */
static bool ray_at(const fixture *f, int x, int y, double coordinate, double at[2])
{
    const trip_camera *c = &f->camera;
    const int axis = f->sheets.axis;
    double from[3], along[3];
    for (int i = 0; i < 3; i++) {
        const int k = (axis + 1 + i) % 3;
        const double beside =
            (x + 0.5) * trip_component(c->rx, k) + (y + 0.5) * trip_component(c->ry, k);
        from[i] = trip_component(c->eye, k) + (c->ortho ? beside : 0);
        along[i] = trip_component(c->r0, k) + (c->ortho ? 0 : beside);
    }
    const double t = (coordinate - from[2]) / along[2];
    for (int a = 0; a < 2; a++) {
        at[a] = from[a] + t * along[a];
        if (fabs(along[a] / along[2]) > f->sheets.view.steepest)
            return false;
    }
    return along[2] * (double)f->sheets.way > 0 && t > 0;
}

/* Checks the voxels of a sheet that an interpolated value at (u, v) reads. */
static void check_position(fixture *f, const double at[2])
{
    const int reach = trip_sheet_reach(f->settings.kernel), axis = f->sheets.axis;
    const int64_t u0 = (int64_t)floor(at[0]), v0 = (int64_t)floor(at[1]);
    for (int64_t v = v0 - reach + 1; v <= v0 + reach; v++)
        for (int64_t u = u0 - reach + 1; u <= u0 + reach; u++) {
            if (u < 0 || v < 0 || u >= dims[(axis + 1) % 3] || v >= dims[(axis + 2) % 3])
                continue;
            const uint64_t open = f->open[(v / 64 + 1) * RASTERS + u / 64 + 1];
            assert_true(open >> (v % 64 / 8 * 8 + u % 64 / 8) & 1);
            f->taken++;
        }
}

/* Checks sheets from `first` on; open squares are found once for all of them. */
static void check_sheets(fixture *f, int64_t first)
{
    const int reach = trip_sheet_reach(f->settings.kernel);
    trip_cpu_open_squares_forget(&f->sheets);
    for (int n = 0; n < SHEETS_AT_ONCE; n++)
        trip_cpu_open_squares_of_sheet(&f->sheets, first + n * f->sheets.way);
    for (int i = 0; i < 4; i++)
        f->closed +=
            64 - (uint64_t)__builtin_popcountll(f->open[(i / 2 + 1) * RASTERS + i % 2 + 1]);
    for (int y = 0; y < SIZE; y++)
        for (int x = 0; x < SIZE; x++)
            for (int n = -4 * reach; pixel_is_open(f, x, y) && n <= 4 * (7 + reach); n++) {
                double at[2];
                if (ray_at(f, x, y, (double)first + 0.25 * n * (double)f->sheets.way, at))
                    check_position(f, at);
            }
}

static void check_view(fixture *f, const trip_camera_params *params, trip_kernel kernel)
{
    uint64_t taken = 0, closed = 0;
    for (int axis = 0; axis < 3; axis++)
        for (int64_t way = -1; way <= 1; way += 2)
            for (int seed = 0; seed < 4; seed++) {
                f->taken = f->closed = 0;
                look(f, params, axis, way, kernel);
                open_some(f, seed);
                check_sheets(f, 3 + scene_hash(seed, axis, 2) % 60);
                taken += f->taken;
                closed += f->closed;
            }
    assert_true(taken > 0);
    assert_true(closed > 0);
}

static trip_camera_params view_from(const fixture *f, trip_vec3 from, double distance, double fov)
{
    trip_camera_params view = scene_view(&f->scene, from, distance, fov, SIZE);
    view.height = SIZE;
    return view;
}

static void rays_from_afar_find_their_voxels_decoded(void **state)
{
    fixture *f = *state;
    const trip_vec3 from[] = { { 1, 0.6, -0.4 }, { -0.2, 1, 0.1 }, { 0.1, -0.3, 1 } };
    for (int i = 0; i < 3; i++) {
        trip_camera_params view = view_from(f, from[i], 200, 40);
        check_view(f, &view, TRIP_KERNEL_LINEAR);
        check_view(f, &view, TRIP_KERNEL_CUBIC);
    }
}

static void parallel_rays_find_their_voxels_decoded(void **state)
{
    fixture *f = *state;
    trip_camera_params view = view_from(f, trip_v3(0.7, 0.5, 0.6), 150, 40);
    view.ortho_height = 60;
    check_view(f, &view, TRIP_KERNEL_LINEAR);
}

static void rays_from_inside_find_their_voxels_decoded(void **state)
{
    fixture *f = *state;
    trip_camera_params view = view_from(f, trip_v3(0.4, -0.8, 0.3), 5, 120);
    check_view(f, &view, TRIP_KERNEL_LINEAR);
}

static void everything_is_decoded_while_nothing_is_terminated(void **state)
{
    fixture *f = *state;
    trip_camera_params view = view_from(f, trip_v3(1, 0.6, -0.4), 200, 40);
    look(f, &view, 0, 1, TRIP_KERNEL_LINEAR);
    for (int pane = 0; pane < PANES; pane++)
        f->panes[pane] = UINT64_MAX;
    trip_cpu_open_squares_forget(&f->sheets);
    trip_cpu_open_squares_of_sheet(&f->sheets, 5);
    for (int i = 0; i < RASTERS * RASTERS; i++)
        assert_int_equal(f->open[i], UINT64_MAX);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(rays_from_afar_find_their_voxels_decoded),
        cmocka_unit_test(parallel_rays_find_their_voxels_decoded),
        cmocka_unit_test(rays_from_inside_find_their_voxels_decoded),
        cmocka_unit_test(everything_is_decoded_while_nothing_is_terminated),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
