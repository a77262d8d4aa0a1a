/* Occlusion culling: an occluded voxel must have no pixel of its support in an open cell. The test
 * evaluates the definition of splats in double precision. */
#include "cpu/kernels/isa.h"
#include "cpu/cpu_view.h"
#include "cpu/cull.h"
#include "scenes.h"
#include "test.h"

#include <stdlib.h>
#include <string.h>

enum { SIZE = 96, ACROSS = 3 };

typedef struct looks {
    trip_camera camera;
    trip_settings settings;
    trip_plan plan;
    trip_frame frame;
    trip_cpu_view view;
    _Atomic uint64_t open[ACROSS * ACROSS];
    trip_cpu_mask mask;
} looks;

static void look(looks *l, const scene *s, const trip_camera_params *params, int axis)
{
    memset(l, 0, sizeof *l);
    l->settings = trip_settings_default();
    assert_int_equal(trip_camera_make(&l->camera, params, &s->data->index_to_world), 0);
    l->frame = (trip_frame){ .data = s->data,
                             .camera = &l->camera,
                             .settings = &l->settings,
                             .plan = &l->plan,
                             .table = s->table };
    trip_cpu_layer_view_make(&l->view, &l->frame, axis, true);
    l->view.list = trip_dataset_find(s->data, axis, 0, TRIP_KIND_VOXELS);
    l->mask = (trip_cpu_mask){ { ACROSS, ACROSS, 0 }, l->open };
}

static void open_only(looks *l, unsigned cell_x, unsigned cell_y)
{
    for (int i = 0; i < ACROSS * ACROSS; i++)
        l->open[i] = 0;
    l->open[cell_y / 8 * ACROSS + cell_x / 8] = UINT64_C(1) << (8 * (cell_y % 8) + cell_x % 8);
}

static bool reaches(const looks *l, const double at[3], unsigned cell_x, unsigned cell_y)
{
    double p[3];
    trip_splat s;
    p[l->view.u_axis] = at[0];
    p[l->view.v_axis] = at[1];
    p[l->view.axis] = at[2];
    if (!trip_splat_project(&l->view.splat, trip_v3(p[0], p[1], p[2]), &s))
        return false;
    for (unsigned i = 0; i < 16; i++)
        if (trip_splat_radius2(&l->view.splat, &s, 4 * cell_x + i % 4 + 0.5,
                               4 * cell_y + i / 4 + 0.5) <= l->view.splat.cutoff2)
            return true;
    return false;
}

/* Tests each voxel of the box. Returns true if one of them reaches the cell. */
static bool any_reaches(const looks *l, const trip_cpu_box *box, unsigned x, unsigned y)
{
    for (double u = -box->half[0]; u <= box->half[0]; u++)
        for (double v = -box->half[1]; v <= box->half[1]; v++)
            for (double s = -box->half[2]; s <= box->half[2]; s++) {
                const double at[3] = { box->middle[0] + u, box->middle[1] + v, box->middle[2] + s };
                if (reaches(l, at, x, y))
                    return true;
            }
    return false;
}

static void check_boxes(looks *l, unsigned seed, unsigned *occluded, unsigned *reaching)
{
    for (unsigned i = 0; i < 400; i++) {
        uint32_t h = scene_hash((int)i, (int)seed, l->view.axis);
        unsigned x = h % (SIZE / 4), y = h / 64 % (SIZE / 4);
        trip_cpu_box box = { { h / 131072 % 5 * 8 + 3.5, (h >> 24 & 8) + 3.5, h / 4096 % 32 },
                             { 3.5, 3.5, 0 } };
        open_only(l, x, y);
        bool is_occluded = trip_cpu_box_occlusion(&l->view, &l->mask, &box) == TRIP_CPU_OCCLUDED;
        bool reached = any_reaches(l, &box, x, y);
        assert_false(is_occluded && reached);
        *occluded += is_occluded;
        *reaching += reached;
    }
}

static void occluded_boxes_reach_no_open_cell(void **state)
{
    (void)state;
    scene s;
    looks l;
    unsigned occluded = 0, reaching = 0;
    scene_create(&s, &(scene_params){ .dims = { 32, 32, 32 }, .tile_voxels = 32 });
    for (int i = 0; i < 12; i++) {
        trip_vec3 from = { cos(1.1 * i), sin(1.1 * i), 0.5 * sin(3.3 * i) };
        trip_camera_params view = scene_view(&s, from, 90 - 8 * i, 60, SIZE);
        view.ortho_height = i % 3 == 2 ? 40 : 0;
        look(&l, &s, &view, i % 3);
        check_boxes(&l, (unsigned)i, &occluded, &reaching);
    }
    print_message("%u occluded, %u reach\n", occluded, reaching);
    assert_true(occluded > 1000);
    assert_true(reaching > 200);
    scene_destroy(&s);
}

/* Checks single voxels with tight bounds. Open cells are near the voxel's projection. */
static void check_voxels(looks *l, int seed, unsigned *occluded, unsigned *reaching)
{
    for (int i = 0; i < 4000; i++) {
        uint32_t h = scene_hash(i, seed, l->view.axis);
        double p[3];
        const trip_cpu_box box = { { h % 32, h / 32 % 32, h / 1024 % 32 }, { 0, 0, 0 } };
        trip_splat s;
        p[l->view.u_axis] = box.middle[0];
        p[l->view.v_axis] = box.middle[1];
        p[l->view.axis] = box.middle[2];
        if (!trip_splat_project(&l->view.splat, trip_v3(p[0], p[1], p[2]), &s) || s.near)
            continue;
        double x = floor(s.x / 4) + (h >> 15) % 7 - 3, y = floor(s.y / 4) + (h >> 20) % 7 - 3;
        if (!(x >= 0 && y >= 0 && x < SIZE / 4 && y < SIZE / 4))
            continue;
        open_only(l, (unsigned)x, (unsigned)y);
        bool is_occluded = trip_cpu_box_occlusion(&l->view, &l->mask, &box) == TRIP_CPU_OCCLUDED;
        bool reached = reaches(l, box.middle, (unsigned)x, (unsigned)y);
        assert_false(is_occluded && reached);
        *occluded += is_occluded;
        *reaching += reached;
    }
}

/* The voxels are near the eye and at wide angles, where supports are largest compared with the
 * centre of the picture. */
static void occluded_voxels_reach_no_open_cell(void **state)
{
    (void)state;
    unsigned occluded = 0, reaching = 0;
    for (int i = 0; i < 12; i++) {
        scene s;
        looks l;
        scene_create(
            &s, &(scene_params){ .dims = { 32, 32, 32 },
                                 .index_to_world = i % 2 ? scene_sheared : trip_affine_identity(),
                                 .tile_voxels = 32 });
        trip_vec3 from = { cos(1.1 * i), sin(1.1 * i), 0.5 * sin(3.3 * i) };
        trip_camera_params view = scene_view(&s, from, 30 + 4 * i, 120 - 6 * i, SIZE);
        view.ortho_height = i % 6 == 5 ? 40 : 0;
        look(&l, &s, &view, i % 3);
        check_voxels(&l, i, &occluded, &reaching);
        scene_destroy(&s);
    }
    print_message("%u occluded, %u reach\n", occluded, reaching);
    assert_true(occluded > 1000);
    assert_true(reaching > 1000);
}

static void without_terminated_texels_every_voxel_is_visible(void **state)
{
    (void)state;
    scene s;
    looks l;
    scene_create(&s, &(scene_params){ .dims = { 32, 32, 32 }, .tile_voxels = 32 });
    trip_camera_params view = scene_view(&s, trip_v3(1, 0.2, 0.1), 90, 40, SIZE);
    look(&l, &s, &view, 0);
    for (int i = 0; i < ACROSS * ACROSS; i++)
        l.open[i] = UINT64_MAX;
    trip_cpu_box box = { { 15.5, 15.5, 16 }, { 3.5, 3.5, 0 } };
    assert_int_equal(trip_cpu_box_occlusion(&l.view, &l.mask, &box), TRIP_CPU_VISIBLE);
    l.open[4] = ~(UINT64_C(1) << 36); /* in the centre of the image */
    assert_int_equal(trip_cpu_box_occlusion(&l.view, &l.mask, &box), TRIP_CPU_PARTLY);
    scene_destroy(&s);
}

/* Two by two regions. */
enum { TILE = 128 };

typedef struct run_looks {
    looks looks;
    trip_cpu_lanes lanes;
    uint32_t voxels[TILE * TILE];
    uint64_t bytes[TRIP_BLOCK_WORDS_MAX];
    trip_block block;
    /* left_in counts voxels that remain without reaching an open cell. */
    uint32_t count, occluded, left_in;
} run_looks;

/* Fills a tile with every third voxel, in Morton order. */
static void fill_run(run_looks *r)
{
    r->count = 0;
    for (uint32_t i = 0; i < TILE * TILE; i++) {
        uint32_t u = 0, v = 0;
        for (unsigned bit = 0; bit < 7; bit++) {
            u |= (i >> 2 * bit & 1) << bit;
            v |= (i >> (2 * bit + 1) & 1) << bit;
        }
        if (scene_hash((int)i, 1, 2) % 3 == 0)
            r->voxels[r->count++] = u | v << 8;
    }
    const trip_block_form form = { .tile_log2 = 7, .code_bytes = 2 };
    uint32_t words = trip_block_pack(&form, r->voxels, r->count, r->bytes);
    assert_true(words > 0);
    r->block = trip_block_make(&form, r->count, words, r->bytes, NULL);
}

static bool stays_in(const trip_cpu_part *part, uint32_t voxel)
{
    unsigned u = trip_voxel_u(voxel) / TRIP_CPU_SQUARE, v = trip_voxel_v(voxel) / TRIP_CPU_SQUARE;
    return part->voxels > 0 && trip_cpu_part_has(part, (unsigned)trip_morton(u, v));
}

static void check_run(run_looks *r, const trip_cpu_kernels *kernels, int sheet, unsigned x,
                      unsigned y)
{
    trip_run run = { .count = r->count, .sheet = sheet };
    const trip_cpu_culling culling = { kernels, &r->looks.view, &r->looks.mask, &r->lanes };
    trip_cpu_part part;
    trip_cpu_part_make(&part, &run, &r->block, false, 0, r->count);
    uint32_t staying = 0;
    trip_cpu_cull(&culling, &part);
    for (uint32_t i = 0; i < r->count; i++) {
        const double at[3] = { trip_voxel_u(r->voxels[i]), trip_voxel_v(r->voxels[i]), sheet };
        bool reached = reaches(&r->looks, at, x, y), stays = stays_in(&part, r->voxels[i]);
        assert_false(reached && !stays);
        r->occluded += !stays;
        r->left_in += stays && !reached;
        staying += stays;
    }
    assert_int_equal(part.voxels, staying);
}

static void runs_keep_every_voxel_that_reaches_an_open_cell(void **state)
{
    (void)state;
    scene s;
    run_looks *r = aligned_alloc(64, (sizeof *r + 63) / 64 * 64);
    assert_non_null(r);
    r->occluded = r->left_in = 0;
    scene_create(&s, &(scene_params){ .dims = { TILE, TILE, 8 }, .tile_voxels = TILE });
    fill_run(r);
    for (int i = 0; i < 4; i++) {
        trip_vec3 from = { 0.3 * i, -0.2 * i, i % 2 ? 1 : -1 };
        trip_camera_params view = scene_view(&s, from, 300 - 50 * i, 30, SIZE);
        view.ortho_height = i == 2 ? 110 : 0;
        look(&r->looks, &s, &view, 2);
        for (unsigned k = 0; k < 12; k++) {
            unsigned x = 2 * k, y = (5 * k + 7) % 24;
            open_only(&r->looks, x, y);
            for (const trip_cpu_kernels *const *isa = trip_cpu_isas(); *isa; isa++)
                check_run(r, *isa, (int)k % 8, x, y);
        }
    }
    print_message("%u occluded, %u left in\n", r->occluded, r->left_in);
    assert_true(r->occluded > 10 * r->left_in);
    scene_destroy(&s);
    free(r);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(occluded_boxes_reach_no_open_cell),
        cmocka_unit_test(occluded_voxels_reach_no_open_cell),
        cmocka_unit_test(without_terminated_texels_every_voxel_is_visible),
        cmocka_unit_test(runs_keep_every_voxel_that_reaches_an_open_cell),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
