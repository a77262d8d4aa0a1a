/* Culling of splats over terminated cells, with every instruction set. A splat is left out exactly
 * if no pixel of its support lies in an open cell. The test checks this cell by cell. */
#include "cpu/kernels/isa.h"
#include "cpu/cpu_view.h"
#include "scenes.h"
#include "test.h"

#include <stdlib.h>
#include <string.h>

/* 4 x 3 panes. The last pane of each row and column is smaller. */
enum { WIDTH = 109, HEIGHT = 90, ACROSS = 4, PANES = 12, LEFT_OVER = 16 };

typedef struct fixture {
    scene scene;
    trip_camera camera;
    trip_settings settings;
    trip_plan plan;
    trip_frame frame;
    trip_cpu_view view;
    trip_cpu_staged staged;
    trip_cpu_lanes lanes;
    _Atomic uint64_t open[PANES];
    trip_cpu_splat all[TRIP_CPU_STAGED + LEFT_OVER], some[TRIP_CPU_STAGED + LEFT_OVER];
    uint32_t occluded, visible, kept_occluded;
} fixture;

static int set_up(void **state)
{
    fixture *f = aligned_alloc(64, (sizeof *f + 63) / 64 * 64);
    assert_non_null(f);
    memset(f, 0, sizeof *f);
    scene_create(&f->scene, &(scene_params){ .dims = { 32, 32, 32 }, .tile_voxels = 32 });
    scene_colour(&f->scene, 0, 65535, 0.2, 0.5, 0.9, 0.7);
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

static void look(fixture *f, double distance, double ortho_height, int axis)
{
    trip_camera_params view = scene_view(&f->scene, trip_v3(1, 0.6, -0.4), distance, 50, WIDTH);
    view.height = HEIGHT;
    view.ortho_height = ortho_height;
    f->settings = trip_settings_default();
    assert_int_equal(trip_camera_make(&f->camera, &view, &f->scene.data->index_to_world), 0);
    f->frame = (trip_frame){ .data = f->scene.data,
                             .camera = &f->camera,
                             .settings = &f->settings,
                             .plan = &f->plan,
                             .table = f->scene.table };
    trip_cpu_layer_view_make(&f->view, &f->frame, axis, true);
    f->occluded = f->visible = f->kept_occluded = 0;
}

/* Projects voxels from random positions. In half of the panes, one cell in sixteen is open. */
static uint32_t stage_some(fixture *f, int seed)
{
    uint32_t count = TRIP_CPU_STAGED - (uint32_t)seed % 40;
    for (uint32_t i = 0; i < count; i++) {
        uint32_t h = scene_hash((int)i, seed, 1);
        f->staged.u[i] = h % 32;
        f->staged.v[i] = h / 32 % 32;
        f->staged.sheet[i] = h / 1024 % 32;
        f->staged.code[i] = 65535;
    }
    for (int t = 0; t < PANES; t++) {
        uint64_t bits = 0;
        for (int i = 0; i < 64; i++)
            bits |= (uint64_t)(scene_hash(t, i, seed) % 16 == 0) << i;
        f->open[t] = scene_hash(t, seed, 5) % 2 ? bits : 0;
    }
    return count;
}

static bool is_open(const fixture *f, int x, int y)
{
    int cell = y % TRIP_CPU_PANE / 4 * 8 + x % TRIP_CPU_PANE / 4;
    return f->open[y / TRIP_CPU_PANE * ACROSS + x / TRIP_CPU_PANE] >> cell & 1;
}

static bool shows(const fixture *f, const trip_cpu_splat *s)
{
    for (int y = s->y0; y <= s->y1; y++)
        for (int x = s->x0; x <= s->x1; x++)
            if (is_open(f, x, y))
                return true;
    return false;
}

static void check(fixture *f, const trip_cpu_kernels *k, int seed)
{
    uint32_t voxels = stage_some(f, seed), next = 0;
    uint32_t all = k->project(&f->view, NULL, &f->staged, voxels, &f->lanes, f->all, NULL);
    uint32_t some = k->project(&f->view, f->open, &f->staged, voxels, &f->lanes, f->some, NULL);
    for (uint32_t i = 0; i < all; i++) {
        bool kept = next < some && !memcmp(&f->all[i], &f->some[next], sizeof f->all[i]);
        next += kept;
        if (shows(f, &f->all[i])) {
            assert_true(kept);
            f->visible++;
        } else {
            f->occluded++;
            f->kept_occluded += kept;
            if (kept)
                assert_true(f->all[i].panes & (TRIP_CPU_PANES_MORE | TRIP_CPU_PANES_NEAR));
        }
    }
    assert_int_equal(next, some);
}

static void splats_stay_exactly_if_they_have_an_open_cell(void **state)
{
    fixture *f = *state;
    for (const trip_cpu_kernels *const *isa = trip_cpu_isas(); *isa; isa++)
        for (int view = 0; view < 4; view++) {
            look(f, 70 + 40 * view, view == 3 ? 50 : 0, view % 3);
            for (int seed = 0; seed < 50; seed++)
                check(f, *isa, 50 * view + seed);
            assert_true(f->visible > 1000);
            assert_true(f->occluded > 1000);
            assert_int_equal(f->kept_occluded, 0);
        }
}

/* Splats are up to as large as the image. A splat in more than two by two panes may stay. */
static void large_splats_stay_where_visible(void **state)
{
    fixture *f = *state;
    for (const trip_cpu_kernels *const *isa = trip_cpu_isas(); *isa; isa++) {
        look(f, 24, 4, 1);
        for (int seed = 0; seed < 50; seed++)
            check(f, *isa, seed);
        assert_true(f->visible > 100);
        assert_true(f->kept_occluded < f->occluded);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(splats_stay_exactly_if_they_have_an_open_cell, set_up,
                                        tear_down),
        cmocka_unit_test_setup_teardown(large_splats_stay_where_visible, set_up, tear_down),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
