#include "scenes.h"

#include "test.h"

#include <stdlib.h>
#include <string.h>

#include "splat.h"
#include "visible.h"
#include "weight.h"

/* Data sets of two levels. Most are one object made of cubes of 4 x 4 x 4 voxels of level 0. Level
 * 0 draws every second cube, level 1 the others. The levels alternate along every ray, and each
 * hides much of the other. */

enum { N = 24, CELL = 4, SIZE_PX = 44, CHANNELS = 5 };

/* Codes of the levels. */
enum { FINE = 20000, COARSE = 50000 };

typedef enum parting {
    IN_CELLS,
    APART,        /* level 0 in a box of its own, level 1 in another */
    COARSE_ALONE, /* level 0 is empty */
} parting;

/* The number of voxels of level 0 in one of level 1, and the cubes that each level draws. */
typedef struct coarseness {
    int by[3];
    parting parting;
} coarseness;

/* Returns true if `level` draws the position. */
static bool is_drawn_by(const coarseness *c, int level, const double at[3])
{
    int sum = 0;
    for (int a = 0; a < 3; a++)
        sum += (int)at[a] / CELL;
    switch (c->parting) {
    case IN_CELLS:
        return sum % 2 == level;
    case APART:
        return level ? at[0] >= 16 && at[2] >= 8 : at[0] < 8 && at[1] < 12;
    case COARSE_ALONE:
        return level && sum % 2;
    }
    return false;
}

static bool fine_voxel(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    (void)gradient;
    *code = FINE;
    return is_drawn_by(user, 0, (double[3]){ i, j, k });
}

static bool coarse_voxel(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    const coarseness *c = user;
    (void)gradient;
    *code = COARSE;
    return is_drawn_by(c, 1, (double[3]){ i * c->by[0], j * c->by[1], k * c->by[2] });
}

typedef struct levels {
    coarseness coarse;
    scene drawn; /* a data set of both */
} levels;

static void create(levels *l, coarseness coarse, double thickness)
{
    l->coarse = coarse;
    const int *by = coarse.by;
    const scene_part part = {
        .level = 1, .by = { by[0], by[1], by[2] }, .voxel = coarse_voxel, .user = &l->coarse
    };
    scene_create(&l->drawn, &(scene_params){ .dims = { N, N, N },
                                             .index_to_world = { { { 0, -1, 0, 3 },
                                                                   { 1, 0, 0, -2 },
                                                                   { 0, 0, thickness, 5 } } },
                                             .tile_voxels = 16,
                                             .slab_sheets = 4,
                                             .voxel = fine_voxel,
                                             .user = &l->coarse,
                                             .parts = &part,
                                             .part_count = 1 });
    scene_colour(&l->drawn, FINE, FINE, 1, 0.2, 0.1, 0.25);
    scene_colour(&l->drawn, COARSE, COARSE, 0.1, 0.7, 1, 0.1);
}

static void destroy(levels *l)
{
    scene_destroy(&l->drawn);
}

typedef struct item {
    double coordinate;
    trip_vec3 position; /* in world space */
    int level;
    uint64_t morton;
    const trip_tf_entry *entry;
    trip_splat splat;
} item;

static int by_position(const void *a, const void *b)
{
    const item *p = a, *q = b;
    if (p->coordinate != q->coordinate)
        return p->coordinate < q->coordinate ? -1 : 1;
    if (p->level != q->level)
        return p->level - q->level;
    return p->morton < q->morton ? -1 : p->morton > q->morton;
}

typedef struct brute {
    const levels *levels;
    trip_settings settings;
    trip_splat_frame frames[2];
    item *items;
    size_t count;
} brute;

static bool is_there(const levels *l, int level, const int at[3])
{
    unsigned code;
    double gradient[3];
    void *coarse = (void *)(uintptr_t)&l->coarse;
    return level ? coarse_voxel(coarse, at[0], at[1], at[2], &code, gradient)
                 : fine_voxel(coarse, at[0], at[1], at[2], &code, gradient);
}

static void add(brute *b, int level, int axis, const int at[3])
{
    const levels *l = b->levels;
    item *i = &b->items[b->count];
    int scale = level ? l->coarse.by[axis] : 1;
    if (!is_there(l, level, at) ||
        !trip_splat_project(&b->frames[level], trip_v3(at[0], at[1], at[2]), &i->splat))
        return;
    i->coordinate = scale * at[axis] + 0.5 * (scale - 1);
    i->position =
        trip_affine_point(&b->frames[level].camera.index_to_world, trip_v3(at[0], at[1], at[2]));
    i->level = level;
    i->morton = trip_morton((unsigned)at[(axis + 1) % 3], (unsigned)at[(axis + 2) % 3]);
    i->entry = &l->drawn.table[level ? COARSE : FINE];
    b->count++;
}

static void collect(brute *b, int axis)
{
    b->count = 0;
    for (int level = 0; level < 2; level++) {
        const int *by = b->levels->coarse.by;
        const int dims[3] = { level ? N / by[0] : N, level ? N / by[1] : N, level ? N / by[2] : N };
        for (int i = 0; i < dims[0] * dims[1] * dims[2]; i++)
            add(b, level, axis,
                (int[3]){ i % dims[0], i / dims[0] % dims[1], i / dims[0] / dims[1] });
    }
    qsort(b->items, b->count, sizeof *b->items, by_position);
}

/* Returns the distance along a pixel's ray to the plane through the splat's centre that faces the
 * eye. It is never negative. */
static double distance_of(const brute *b, const item *i, double x, double y)
{
    const trip_camera *c = &b->frames[0].camera;
    trip_vec3 ray = trip_affine_vector(&c->index_to_world, trip_camera_ray(c, x, y));
    trip_vec3 from_eye = trip_sub(i->position, c->params.eye);
    return fmax(0, trip_dot(from_eye, c->world_forward)) * trip_length(ray) /
           trip_dot(ray, c->world_forward);
}

static void put_behind(const brute *b, const item *i, double x, double y, double layer[CHANNELS])
{
    const trip_splat_frame *f = &b->frames[i->level];
    const trip_splat *s = &i->splat;
    double m = trip_splat_radius2(f, s, x, y);
    if (x < s->x0 || x > s->x1 || y < s->y0 || y > s->y1 || m > f->cutoff2 ||
        1 - layer[3] < TRIP_EARLY_TERMINATION_PRE)
        return;
    double depth = (double)i->entry->extinction * trip_splat_stretch(f, x, y) * s->amplitude *
                   (exp(-m / 2) - f->edge) * trip_splat_front(f, s, x, y);
    double add = (1 - layer[3]) * -expm1(-depth);
    const float rgb[3] = { i->entry->r, i->entry->g, i->entry->b };
    for (int c = 0; c < 3; c++)
        layer[c] += (double)rgb[c] * add;
    layer[3] += add;
    layer[4] += distance_of(b, i, x, y) * add;
}

/* Composites the sheets in the order in which the ray meets them, up or down the axis. */
static void composite(const brute *b, int axis, double x, double y, double layer[CHANNELS])
{
    const bool up = trip_component(trip_camera_ray(&b->frames[0].camera, x, y), axis) > 0;
    for (size_t i = 0; i < b->count; i++)
        put_behind(b, &b->items[up ? i : b->count - 1 - i], x, y, layer);
}

/* Returns CHANNELS floats per pixel. */
static float *draw_by_hand(brute *b)
{
    const trip_camera *c = &b->frames[0].camera;
    int axis_of_view = trip_weight_axis_of_view(c);
    float *merged = calloc((size_t)CHANNELS * SIZE_PX * SIZE_PX, sizeof *merged);
    double *weights = calloc((size_t)SIZE_PX * SIZE_PX, sizeof *weights);
    for (int axis = 0; axis < 3; axis++) {
        collect(b, axis);
        for (int p = 0; p < SIZE_PX * SIZE_PX; p++) {
            double x = p % SIZE_PX + 0.5, y = p / SIZE_PX + 0.5, layer[CHANNELS] = { 0 };
            double w = trip_weight(&b->settings, axis_of_view, trip_camera_ray(c, x, y), axis);
            if (!(w > 0))
                continue;
            composite(b, axis, x, y, layer);
            for (int i = 0; i < CHANNELS; i++)
                merged[CHANNELS * p + i] += (float)(w * w * layer[i]);
            weights[p] += w * w;
        }
    }
    for (int p = 0; p < SIZE_PX * SIZE_PX; p++)
        for (int i = 0; i < CHANNELS; i++)
            merged[CHANNELS * p + i] = (float)((double)merged[CHANNELS * p + i] / weights[p]);
    free(weights);
    return merged;
}

static double largest_difference(const scene_picture *p, const float *merged)
{
    double max = 0;
    for (int i = 0; i < SIZE_PX * SIZE_PX; i++)
        for (int c = 0; c < 4; c++)
            max = fmax(max, fabs((double)p->rgba[4 * i + c] - (double)merged[CHANNELS * i + c]));
    return max;
}

/* Returns the largest difference of distance times opacity, relative to the object's size. */
static double largest_depth_difference(const scene_picture *p, const float *merged)
{
    double max = 0;
    for (int i = 0; i < SIZE_PX * SIZE_PX; i++) {
        double alpha = (double)merged[CHANNELS * i + 3], sum = (double)merged[CHANNELS * i + 4];
        if (alpha > 1e-3)
            max = fmax(max, fabs((double)p->depth[i] * alpha - sum) / N);
    }
    return max;
}

static void expect_close(const levels *l, const scene_renderer *r, const trip_camera_params *view,
                         const trip_settings *settings, const float *expected)
{
    scene_picture p = scene_draw(&l->drawn, r, view, settings);
    double off = fmax(largest_difference(&p, expected), largest_depth_difference(&p, expected));
    if (!(off <= (strcmp(r->name, "reference") ? r->tolerance : 1e-6)))
        fail_msg("%s%s: off by %g", r->name, settings->indexed ? ", indexed" : "", off);
    scene_picture_free(&p);
}

static void expect_right(levels *l, const trip_camera_params *view)
{
    brute b = { .levels = l, .settings = trip_settings_default() };
    const trip_affine *fine = &l->drawn.data->index_to_world;
    trip_affine maps[2] = { *fine, scene_coarse_map(fine, l->coarse.by) };
    b.settings.shading = false;
    b.settings.h = 0.6;
    b.settings.background[3] = 0;
    for (int level = 0; level < 2; level++) {
        trip_camera c;
        assert_int_equal(trip_camera_make(&c, view, &maps[level]), 0);
        b.frames[level] = trip_splat_frame_make(&c, &b.settings);
    }
    b.items = calloc((size_t)2 * N * N * N, sizeof *b.items);
    assert_non_null(b.items);
    float *expected = draw_by_hand(&b);
    b.settings.depth = true;
    for (const scene_renderer *r = scene_renderers(); r->name; r++) {
        expect_close(l, r, view, &b.settings, expected);
        b.settings.indexed = true;
        if (!strcmp(r->name, "gl"))
            expect_close(l, r, view, &b.settings, expected);
        b.settings.indexed = false;
    }
    free(expected);
    free(b.items);
}

static void expect_right_from_everywhere(levels *l)
{
    static const double from[][3] = {
        { 1, 0.6, 0.4 }, { -1, -0.6, -0.4 }, { 0.1, -0.2, 1 }, { 0.3, 1, -0.2 }, { -0.05, 0.1, -1 }
    };
    for (size_t i = 0; i < sizeof from / sizeof *from; i++) {
        trip_camera_params view =
            scene_view(&l->drawn, trip_v3(from[i][0], from[i][1], from[i][2]), 60, 40, SIZE_PX);
        expect_right(l, &view);
    }
    trip_camera_params inside = scene_view(&l->drawn, trip_v3(0.3, 0.2, 0.5), 2.3, 100, SIZE_PX);
    expect_right(l, &inside);
    trip_camera_params parallel = scene_view(&l->drawn, trip_v3(1, 0.6, -0.7), 60, 40, SIZE_PX);
    parallel.ortho_height = 30;
    expect_right(l, &parallel);
}

static void two_levels_are_drawn_in_one_order(void **state)
{
    (void)state;
    levels l;
    create(&l, (coarseness){ { 2, 2, 2 }, IN_CELLS }, 1);
    expect_right_from_everywhere(&l);
    destroy(&l);
}

/* Every pixel of these views has a ray of its own direction. Sheets of both levels coincide along
 * the last axis. */
static void levels_of_voxels_of_other_shapes_are_drawn_in_one_order(void **state)
{
    (void)state;
    levels l;
    create(&l, (coarseness){ { 2, 4, 1 }, IN_CELLS }, 1.25);
    expect_right_from_everywhere(&l);
    destroy(&l);
}

static void levels_with_other_boxes_are_drawn_in_one_order(void **state)
{
    (void)state;
    levels l;
    create(&l, (coarseness){ { 2, 2, 2 }, APART }, 1);
    expect_right_from_everywhere(&l);
    destroy(&l);
}

/* Framing uses level 0, or the grid if level 0 is empty. */
static void expect_bounds_of_the_grid(const levels *l)
{
    double kept_lo[3], kept_hi[3], lo[3], hi[3];
    trip_visible visible = { .data = l->drawn.data,
                             .budget = l->drawn.budget,
                             .table = l->drawn.table };
    const trip_reader_params params = { .planes = 1u << TRIP_PLANE_VOXELS };
    assert_int_equal(trip_reader_create(&visible.reader, l->drawn.data, &params, l->drawn.budget),
                     0);
    trip_dataset_kept_bounds(l->drawn.data, kept_lo, kept_hi);
    trip_visible_start(&visible, kept_lo, kept_hi);
    assert_int_equal(trip_visible_bounds(&visible, lo, hi), 0);
    for (int a = 0; a < 3; a++) {
        assert_true(kept_lo[a] == 0 && kept_hi[a] == N - 1);
        assert_true(lo[a] == 0 && hi[a] == N - 1);
    }
    trip_reader_destroy(visible.reader);
}

static void a_data_set_of_level_1_alone_is_drawn_and_framed(void **state)
{
    (void)state;
    levels l;
    create(&l, (coarseness){ { 2, 2, 2 }, COARSE_ALONE }, 1);
    assert_int_equal(l.drawn.data->lists[0].records, 0);
    assert_true(l.drawn.data->lists[3].records > 0);
    expect_right_from_everywhere(&l);
    expect_bounds_of_the_grid(&l);
    destroy(&l);
}

static trip_plan make_plan(const levels *l, const trip_camera_params *view)
{
    trip_camera c;
    trip_plan plan;
    trip_settings settings = trip_settings_default();
    assert_int_equal(trip_camera_make(&c, view, &l->drawn.data->index_to_world), 0);
    assert_int_equal(
        trip_plan_make(&plan, l->drawn.data, &c, &settings, l->drawn.table, l->drawn.budget), 0);
    return plan;
}

static void a_plan_names_lists_by_axis_and_level(void **state)
{
    (void)state;
    levels l;
    create(&l, (coarseness){ { 2, 2, 2 }, IN_CELLS }, 1);
    char *text;
    size_t bytes;
    FILE *f = open_memstream(&text, &bytes);
    trip_settings settings = trip_settings_default();
    trip_camera_params view = scene_view(&l.drawn, trip_v3(0, 0, 1), 60, 20, SIZE_PX);
    trip_plan plan = make_plan(&l, &view);
    assert_int_equal(plan.layers[2].pass_count, 1);
    assert_int_equal(plan.layers[2].passes[0].pass.selection_count, 2);
    assert_int_equal(trip_plan_splats(&plan),
                     l.drawn.data->lists[2].records + l.drawn.data->lists[5].records);
    trip_plan_explain(&plan, l.drawn.data, &settings, f);
    fclose(f);
    assert_non_null(strstr(text, "list x1     not read: no ray of the view has weight in it\n"));
    assert_non_null(strstr(text, "list z      read: "));
    assert_non_null(strstr(text, "list z1     read: "));
    assert_non_null(strstr(text, "sheets 0 to 11 descending, front to back\n"));
    free(text);
    trip_plan_release(&plan, l.drawn.budget);
    destroy(&l);
}

/* Along an axis, all voxels of the axis's two lists are in the picture. No other list is read. */
static void every_list_has_counts_of_its_own(void **state)
{
    (void)state;
    levels l;
    create(&l, (coarseness){ { 2, 2, 2 }, IN_CELLS }, 1);
    const trip_list *lists = l.drawn.data->lists;
    trip_settings settings = trip_settings_default();
    trip_vec3 along = trip_affine_vector(&l.drawn.data->index_to_world, trip_v3(0, 0, 1));
    trip_camera_params view = scene_view(&l.drawn, along, 60, 40, SIZE_PX);
    view.ortho_height = 40;
    for (const scene_renderer *r = scene_renderers(); r->name; r++) {
        scene_picture p = scene_draw(&l.drawn, r, &view, &settings);
        uint64_t bytes = 0, splats = 0;
        for (unsigned i = 0; i < l.drawn.data->list_count; i++) {
            uint64_t expected = i % 3 == 2 ? lists[i].records : 0;
            assert_int_equal(p.lists[i].splats_read, expected);
            assert_int_equal(p.lists[i].splats_projected, expected);
            assert_int_equal(p.lists[i].splats_drawn, expected);
            assert_int_equal(p.lists[i].bytes_read > 0, expected > 0);
            assert_true(p.lists[i].bytes_read <= lists[i].plane_bytes[TRIP_PLANE_VOXELS]);
            bytes += p.lists[i].bytes_read;
            splats += expected;
        }
        assert_int_equal(p.stats.all.splats_drawn, splats);
        assert_int_equal(p.stats.all.bytes_read, bytes);
        assert_int_equal(p.stats.reader.bytes_read, bytes);
        scene_picture_free(&p);
    }
    destroy(&l);
}

static void lists_that_do_not_lie_along_level_0_are_refused(void **state)
{
    (void)state;
    levels l;
    create(&l, (coarseness){ { 2, 2, 2 }, IN_CELLS }, 1);
    trip_camera_params view = scene_view(&l.drawn, trip_v3(0.1, 0, 1), 60, 20, SIZE_PX);
    trip_camera c;
    trip_plan plan;
    trip_settings settings = trip_settings_default();
    assert_int_equal(trip_camera_make(&c, &view, &l.drawn.data->index_to_world), 0);
    trip_list *list = &l.drawn.data->lists[5];
    trip_affine straight = list->index_to_world;
    test_catch_reports();
    list->index_to_world.m[0][0] += 0.01;
    assert_int_equal(
        trip_plan_make(&plan, l.drawn.data, &c, &settings, l.drawn.table, l.drawn.budget),
        TRIP_ERROR);
    assert_one_report("is not parallel to the grid of level 0");
    list->index_to_world = straight;
    list->sheet_first += 1;
    test_catch_reports();
    assert_int_equal(
        trip_plan_make(&plan, l.drawn.data, &c, &settings, l.drawn.table, l.drawn.budget),
        TRIP_ERROR);
    assert_one_report("its sheet coordinates contradict");
    destroy(&l);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(two_levels_are_drawn_in_one_order),
        cmocka_unit_test(levels_of_voxels_of_other_shapes_are_drawn_in_one_order),
        cmocka_unit_test(levels_with_other_boxes_are_drawn_in_one_order),
        cmocka_unit_test(a_data_set_of_level_1_alone_is_drawn_and_framed),
        cmocka_unit_test(a_plan_names_lists_by_axis_and_level),
        cmocka_unit_test(every_list_has_counts_of_its_own),
        cmocka_unit_test(lists_that_do_not_lie_along_level_0_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
