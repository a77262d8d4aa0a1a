/* Frames of the CPU renderer in `post`. Threads, memory, tiles, batches and occlusion culling must
 * not change a bit of the picture. The kernels that prepare sheets are compared with sheet.h,
 * voxel by voxel. */
#include "cpu/cpu_renderer.h"
#include "cpu/kernels/isa.h"
#include "cpu/sheets/integrals.h"
#include "cpu_scenes.h"
#include "test.h"

#include <stdlib.h>
#include <string.h>

enum { SIDE_I = 70, SIDE_J = 45, SIDE_K = 40, PIXELS = TEST_BY_TURNS ? 64 : 120 };

/* Waves; the voxels of their crests are kept. */
static double wave(int i, int j, int k)
{
    return 0.5 + 0.25 * sin(0.31 * i + 0.2) + 0.25 * sin(0.27 * j) * cos(0.35 * k);
}

static bool is_kept(int i, int j, int k)
{
    return wave(i, j, k) > 0.5;
}

static bool crest(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    (void)user;
    (void)gradient;
    *code = (unsigned)(65535 * wave(i, j, k));
    return is_kept(i, j, k);
}

/* Stores the neighbours of crests, except for a few missing ones. */
static bool beside(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    bool some = false;
    crest(user, i, j, k, code, gradient);
    for (int n = 0; n < 27 && !some; n++) {
        int a = i + n % 3 - 1, b = j + n / 3 % 3 - 1, c = k + n / 9 - 1;
        some = a >= 0 && b >= 0 && c >= 0 && a < SIDE_I && b < SIDE_J && c < SIDE_K &&
               is_kept(a, b, c);
    }
    return some && !is_kept(i, j, k) && scene_hash(i, j, k) % 200 != 0;
}

static void make_waves(scene *s, unsigned tile, double opacity)
{
    const scene_part halo = { .kind = TRIP_KIND_HALO, .by = { 1, 1, 1 }, .voxel = beside };
    scene_create(s, &(scene_params){ .dims = { SIDE_I, SIDE_J, SIDE_K },
                                     .tile_voxels = tile,
                                     .slab_sheets = 8,
                                     .voxel = crest,
                                     .parts = &halo,
                                     .part_count = 1 });
    scene_colour(s, 33000, 45000, 0.2, 0.5, 1, opacity / 4);
    scene_colour(s, 45001, 55000, 0.9, 0.4, 0.1, opacity / 2);
    scene_colour(s, 57000, 65535, 1, 1, 0.6, opacity);
}

static trip_settings post(int samples_per_sheet)
{
    trip_settings settings = trip_settings_default();
    settings.classify = TRIP_CLASSIFY_POST;
    settings.samples_per_sheet = samples_per_sheet;
    return settings;
}

static trip_camera_params from_outside(const scene *s)
{
    return scene_view(s, trip_v3(1, 0.8, 0.6), 90, 50, PIXELS);
}

static trip_camera_params from_inside(const scene *s)
{
    return scene_view(s, trip_v3(1, 0.8, 0.6), 6.3, 100, PIXELS);
}

static trip_camera_params parallel(const scene *s)
{
    trip_camera_params view = from_outside(s);
    view.ortho_height = 60;
    return view;
}

static void assert_same(const scene_picture *a, const scene_picture *b)
{
    assert_memory_equal(a->rgba, b->rgba, 16 * (size_t)a->width * (size_t)a->height);
}

static void assert_shows(const scene_picture *p)
{
    double sum = 0;
    for (int i = 0; i < p->width * p->height; i++)
        sum += (double)p->rgba[4 * i];
    assert_true(sum > 0.01 * p->width * p->height);
}

static void check_view(const scene *a, const scene *b, unsigned threads,
                       const trip_reader_params *reader, const trip_camera_params *view,
                       const trip_settings *settings)
{
    cpu_scenes_threads = 1;
    scene_picture p = scene_draw(a, &cpu_scenes_cpu, view, settings);
    cpu_scenes_threads = threads;
    scene_picture q = scene_draw_with(b, &cpu_scenes_cpu, view, settings, reader);
    assert_shows(&p);
    assert_same(&p, &q);
    scene_picture_free(&p);
    scene_picture_free(&q);
}

/* Draws `a` with one thread and `b` as specified, and compares the bits. It does so with every
 * instruction set, or with one of them if they take turns. It also uses kernels of 64 voxels,
 * which have one instruction set. */
static void check_same(const scene *a, const scene *b, unsigned threads,
                       const trip_reader_params *reader)
{
    const trip_camera_params views[3] = { from_outside(a), from_inside(a), parallel(a) };
    trip_settings settings = post(2);
    for (const trip_cpu_kernels *const *isa = trip_cpu_isas(); *isa; isa++) {
        setenv("TRIPTYCH_ISA", (*isa)->isa, 1);
        for (int i = 0; i < 3; i++)
            check_view(a, b, threads, reader, &views[i], &settings);
        if (TEST_BY_TURNS)
            break;
    }
    unsetenv("TRIPTYCH_ISA");
    for (int i = 0; i < 3; i++) {
        trip_camera_params small = views[i];
        small.width = small.height = PIXELS / 2;
        settings.kernel = i == 0   ? TRIP_KERNEL_CUBIC
                          : i == 1 ? TRIP_KERNEL_GAUSSIAN
                                   : TRIP_KERNEL_NEAREST;
        check_view(a, b, threads, reader, &small, &settings);
    }
}

static void any_number_of_threads_draws_the_same(void **state)
{
    (void)state;
    scene s;
    make_waves(&s, 32, 0.4);
    for (unsigned threads = 2; threads <= (TEST_BY_TURNS ? 3 : 5); threads++)
        check_same(&s, &s, threads, &(trip_reader_params){ 0 });
    scene_destroy(&s);
}

static void any_tile_of_the_data_and_any_batch_draw_the_same(void **state)
{
    (void)state;
    scene first;
    make_waves(&first, 16, 0.4);
    for (unsigned tile = 32; tile <= 128; tile *= TEST_BY_TURNS ? 4 : 2) {
        scene s;
        make_waves(&s, tile, 0.4);
        check_same(&first, &s, 3, &(trip_reader_params){ .slots = 2, .slot_bytes = 4096 });
        scene_destroy(&s);
    }
    scene_destroy(&first);
}

/* Draws with more and more memory, from too little on, in steps smaller than a sheet of the linear
 * kernel. Each frame either fails with a message or has the same bits, whether it holds one pair
 * of sheets at a time or all of them. */
static void check_memories(const scene *s, trip_kernel kernel, bool clipped, int pixels,
                           uint64_t step)
{
    trip_settings settings = post(kernel == TRIP_KERNEL_NEAREST ? 2 : 3);
    trip_camera_params view = from_outside(s);
    settings.kernel = kernel;
    if (clipped)
        trip_clip_add(&settings.clip, trip_v3(0.7, -0.2, 0.6), -28.3);
    view.width = view.height = pixels;
    size_t bytes = 16 * (size_t)view.width * (size_t)view.height;
    float *whole = malloc(bytes), *some = malloc(bytes);
    assert_int_equal(cpu_scenes_draw_within(s, UINT64_C(256) << 20, &settings, &view, whole), 0);
    int drawn = 0, refused = 0;
    for (uint64_t memory = 1 << 20; memory < 20 << 20; memory += step) {
        memset(some, 0, bytes);
        int status = cpu_scenes_draw_within(s, memory, &settings, &view, some);
        if (status == 0)
            assert_memory_equal(some, whole, bytes);
        drawn += status == 0;
        refused += status != 0;
    }
    print_message("%d memories drew, %d were too little\n", drawn, refused);
    assert_true(drawn > 1 && refused > 0);
    free(whole);
    free(some);
}

static void any_memory_draws_the_same_or_is_reported_as_too_little(void **state)
{
    (void)state;
    scene s;
    make_waves(&s, 32, 0.4);
    check_memories(&s, TRIP_KERNEL_LINEAR, false, PIXELS, TEST_BY_TURNS ? 4000000 : 200000);
    check_memories(&s, TRIP_KERNEL_LINEAR, true, PIXELS, TEST_BY_TURNS ? 4000000 : 1000000);
    check_memories(&s, TRIP_KERNEL_CUBIC, false, 40, TEST_BY_TURNS ? 4000000 : 1000000);
    check_memories(&s, TRIP_KERNEL_NEAREST, true, 40, TEST_BY_TURNS ? 4000000 : 1000000);
    scene_destroy(&s);
}

enum { WIDE_I = 640, WIDE_J = 320, WIDE_K = TEST_BY_TURNS ? 6 : 8 };

static bool wide(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    (void)user;
    (void)gradient;
    *code = (unsigned)(65535 * wave(i / 3, j / 2, k));
    return true;
}

/* The picture, buffers and table use up the memory. Three decoded sheets of the wide grid, at 8
 * bytes a voxel, and one sample plane would exceed it. */
static void make_wide(scene *s, const trip_coordinates *coordinates)
{
    scene_create(s, &(scene_params){ .dims = { WIDE_I, WIDE_J, WIDE_K },
                                     .coordinates = coordinates,
                                     .tile_voxels = 128,
                                     .slab_sheets = 4,
                                     .voxel = wide });
    scene_colour(s, 33000, 55000, 0.2, 0.5, 1, 0.1);
    scene_colour(s, 57000, 65535, 1, 1, 0.6, 0.4);
}

static void check_windows(const scene *s, trip_kernel kernel, int first, int end)
{
    enum { LITTLE = 9 << 20, SHEETS = 4 * 8 * WIDE_I * WIDE_J };
    /* The second and the last view are from inside. Some of the last view's first cells are
     * visible. */
    trip_camera_params views[4] = { scene_view(s, trip_v3(0.6, 0.3, 1), 700, 50, PIXELS),
                                    scene_view(s, trip_v3(0.2, 0.1, 1), 4.3, 120, PIXELS),
                                    scene_view(s, trip_v3(0.9, -0.7, 1), 700, 50, PIXELS),
                                    scene_view(s, trip_v3(-0.3, 0.2, -1), 2.6, 140, PIXELS) };
    views[3].eye.x += 7;
    views[3].look.x += 7;
    for (int i = first; i < end; i++) {
        trip_settings settings = post(2);
        trip_camera_params view = views[i];
        view.ortho_height = i == 2 ? 300 : 0;
        settings.h = i % 2 ? 0 : settings.h;
        settings.kernel = kernel;
        size_t bytes = 16 * (size_t)view.width * (size_t)view.height;
        float *much = malloc(bytes), *little = malloc(bytes);
        assert_int_equal(cpu_scenes_draw_within(s, UINT64_C(256) << 20, &settings, &view, much), 0);
        assert_int_equal(cpu_scenes_draw_within(s, LITTLE, &settings, &view, little), 0);
        const scene_picture p = { .width = view.width, .height = view.height, .rgba = much };
        assert_shows(&p);
        assert_memory_equal(much, little, bytes);
        free(much);
        free(little);
    }
    static_assert((int)SHEETS > (int)LITTLE - (4 << 20), "decoded whole it would fit");
}

/* Steps are twice as long in the middle as at the ends, so that rays reach farther in voxels. */
static void grids_too_wide_for_the_memory_are_drawn_in_windows(void **state)
{
    static double tables[3][WIDE_I];
    const double *along[3];
    const int64_t voxels[3] = { WIDE_I, WIDE_J, WIDE_K };
    (void)state;
    for (int a = 0; a < 3; a++) {
        const double last = (double)(voxels[a] - 1);
        for (int64_t i = 0; i < voxels[a]; i++)
            tables[a][i] = (double)i - last / 20 * sin(2 * 3.14159265358979 * (double)i / last);
        tables[a][voxels[a] - 1] = last;
        along[a] = tables[a];
    }
    const trip_coordinates coordinates = trip_coordinates_make(along, voxels);
    scene even, uneven;
    make_wide(&even, NULL);
    make_wide(&uneven, &coordinates);
    check_windows(&even, TRIP_KERNEL_LINEAR, 0, 4);
    /* Other kernels and uneven spacing take more memory. */
    check_windows(&uneven, TRIP_KERNEL_LINEAR, TEST_BY_TURNS ? 2 : 1, 3);
    check_windows(&even, TRIP_KERNEL_CUBIC, TEST_BY_TURNS ? 2 : 1, 3);
    check_windows(&even, TRIP_KERNEL_NEAREST, 0, TEST_BY_TURNS ? 2 : 3);
    check_windows(&uneven, TRIP_KERNEL_NEAREST, 1, TEST_BY_TURNS ? 2 : 3);
    scene_destroy(&even);
    scene_destroy(&uneven);
}

/* Patches of a few squares are visible or not. So the rays of a small picture that are next to each
 * other are lit in different segments. */
static bool patchy(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    (void)user;
    (void)gradient;
    *code = scene_hash(i / 9, j / 7, k / 3) % 4 ? 20000 + 20 * (unsigned)(i + j)
                                                : 40000 + scene_hash(i, j, k) % 20000;
    return true;
}

/* With more memory, more sheets of an earlier group have left gradients in the pool. */
static void small_pictures_are_lit_by_gradients_of_their_own_sheets(void **state)
{
    enum { EDGE = 12 };
    static float much[4 * EDGE * EDGE], little[4 * EDGE * EDGE];
    (void)state;
    scene s;
    scene_create(
        &s, &(scene_params){
                .dims = { 140, 130, 40 }, .tile_voxels = 64, .slab_sheets = 4, .voxel = patchy });
    scene_colour(&s, 33000, 65535, 0.9, 0.4, 0.1, 0.05);
    for (int i = 0; i < 12; i++) {
        trip_settings settings = post(2 + i % 2);
        trip_camera_params view = i / 2 % 2 ? parallel(&s) : from_outside(&s);
        view.width = view.height = 8 + i / 4 * 2;
        const scene_picture p = { .width = view.width, .height = view.height, .rgba = much };
        assert_int_equal(cpu_scenes_draw_within(&s, UINT64_C(256) << 20, &settings, &view, much),
                         0);
        assert_int_equal(cpu_scenes_draw_within(&s, 6 << 20, &settings, &view, little), 0);
        assert_shows(&p);
        assert_memory_equal(much, little, 16 * (size_t)view.width * (size_t)view.height);
    }
    scene_destroy(&s);
}

static bool solid(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    (void)user;
    (void)gradient;
    *code = (unsigned)(i * 1000 + j * 300 + k);
    return true;
}

/* A wall hides the voxels behind its front face, seen also from the side on which the reader
 * begins. */
static void occlusion_culling_draws_the_same(void **state)
{
    (void)state;
    scene s;
    scene_create(&s,
                 &(scene_params){
                     .dims = { 48, 48, 48 }, .tile_voxels = 16, .slab_sheets = 4, .voxel = solid });
    scene_colour(&s, 0, 65535, 0.4, 0.7, 0.2, 0.95);
    trip_camera_params view = scene_view(&s, trip_v3(1, 0.5, 0.3), 70, 30, 100);
    trip_settings settings = post(2);
    trip_renderer *renderer;
    trip_reader *reader;
    trip_plan plan;
    trip_camera camera;
    trip_frame_stats stats;
    cpu_scenes_threads = 2;
    scene_picture all = scene_draw(&s, &cpu_scenes_cpu, &view, &settings);
    assert_int_equal(trip_camera_make(&camera, &view, &s.data->index_to_world), 0);
    assert_int_equal(trip_plan_make(&plan, s.data, &camera, &settings, s.table, s.budget), 0);
    assert_int_equal(trip_cpu_create(&renderer, s.budget, 2), 0);
    trip_frame frame = {
        .data = s.data, .camera = &camera, .settings = &settings, .plan = &plan, .table = s.table
    };
    const trip_reader_params params = { .planes = plan.planes,
                                        .slots = 2,
                                        .slot_bytes = 4096,
                                        .skip = trip_cpu_occluded,
                                        .skip_user = renderer };
    assert_int_equal(trip_reader_create(&reader, s.data, &params, s.budget), 0);
    size_t bytes = 16 * (size_t)view.width * (size_t)view.height;
    float *rgba = malloc(bytes);
    assert_int_equal(trip_frame_draw(renderer, reader, &frame, rgba, NULL, &stats), 0);
    assert_memory_equal(rgba, all.rgba, bytes);
    assert_true(stats.reader.runs_skipped > 0);
    free(rgba);
    trip_reader_destroy(reader);
    renderer->ops->destroy(renderer);
    trip_plan_release(&plan, s.budget);
    scene_picture_free(&all);
    scene_destroy(&s);
}

/* Instruction sets differ only by rounding. */
static void instruction_sets_agree(void **state)
{
    (void)state;
    scene s;
    make_waves(&s, 32, 0.4);
    trip_settings settings = post(2);
    const trip_camera_params views[3] = { from_outside(&s), from_inside(&s), parallel(&s) };
    for (int i = 0; i < (TEST_BY_TURNS ? 1 : 3); i++) {
        setenv("TRIPTYCH_ISA", "plain", 1);
        scene_picture plain = scene_draw(&s, &cpu_scenes_cpu, &views[i], &settings);
        for (const trip_cpu_kernels *const *isa = trip_cpu_isas(); *isa; isa++) {
            setenv("TRIPTYCH_ISA", (*isa)->isa, 1);
            scene_picture p = scene_draw(&s, &cpu_scenes_cpu, &views[i], &settings);
            print_message("%s: %g\n", (*isa)->isa, scene_difference(&plain, &p));
            assert_true(scene_difference(&plain, &p) < 0.5 / 255);
            scene_picture_free(&p);
        }
        scene_picture_free(&plain);
    }
    unsetenv("TRIPTYCH_ISA");
    scene_destroy(&s);
}

enum { RASTERS = 5 }; /* here, to the left, above, the sheets before and behind */

static trip_cpu_voxels rasters[RASTERS], out;

static int code_at(int raster, int u, int v)
{
    return rasters[raster].codes[v * TRIP_CPU_RASTER_STRIDE + u];
}

/* Fills the rasters with few different codes, among them the minimum and maximum, and with missing
 * ones. */
static void fill_rasters(void)
{
    static const int16_t codes[] = { TRIP_CPU_CODE_MIN,    -20000, -1, 0, 1, 2, 300, INT16_MAX,
                                     TRIP_CPU_CODE_MISSING };
    memset(rasters, 0, sizeof rasters);
    for (int b = 0; b < RASTERS; b++)
        for (int i = 0; i < TRIP_CPU_RASTER_VOXELS; i++) {
            uint32_t x = scene_hash(i, b, 7);
            bool smooth = i / 1000 % 2;
            rasters[b].codes[i] = smooth ? (int16_t)(x % 900) : codes[x % 9];
            for (int k = 0; k < 3; k++)
                rasters[b].gradients[i].along[k] = (int16_t)(scene_hash(i, b, 8 + k) % 65536);
        }
}

static bool is_missing(int code)
{
    return code == TRIP_CPU_CODE_MISSING;
}

/* Half of the difference is an index, rounded down (sheets.h). */
static int difference(int below, int here, int above)
{
    if (!is_missing(below) && !is_missing(above))
        return (above - below) >> 2;
    return (!is_missing(above) ? above - here : !is_missing(below) ? here - below : 0) >> 1;
}

static void check_gradients(const trip_cpu_kernels *k, uint64_t squares)
{
    out = rasters[0];
    k->sheet_gradients(&out, squares, &rasters[1], &rasters[2], &rasters[3], &rasters[4]);
    assert_memory_equal(out.codes, rasters[0].codes, sizeof out.codes);
    for (int v = 0; v < 64; v++)
        for (int u = 0; u < 64; u++) {
            int here = code_at(0, u, v), i = v * TRIP_CPU_RASTER_STRIDE + u;
            const int16_t *along = out.gradients[i].along;
            if (!(squares >> (v / 8 * 8 + u / 8) & 1)) {
                assert_memory_equal(along, rasters[0].gradients[i].along, sizeof out.gradients[i]);
                continue;
            }
            if (is_missing(here))
                continue;
            int left = u ? code_at(0, u - 1, v) : code_at(1, 63, v);
            int above = v ? code_at(0, u, v - 1) : code_at(2, u, 63);
            assert_int_equal(along[0], difference(left, here, code_at(0, u + 1, v)));
            assert_int_equal(along[1], difference(above, here, code_at(0, u, v + 1)));
            assert_int_equal(along[2], difference(code_at(3, u, v), here, code_at(4, u, v)));
        }
}

/* Voxel n of a square in Morton order has the column of its even bits and the row of its odd bits.
 * Code 0 counts as 1. */
static void check_decode(const trip_cpu_kernels *k, uint64_t mask)
{
    uint16_t codes[64 + 32];
    int next = 0;
    for (int i = 0; i < 64 + 32; i++)
        codes[i] =
            (uint16_t)(i % 5 ? scene_hash(i, 3, 11) % 65536 : 65535u * (unsigned)(i / 5 % 2));
    out = rasters[0];
    k->sheet_decode(codes, mask, out.codes + 8 * TRIP_CPU_RASTER_STRIDE + 16);
    for (int n = 0; n < 64; n++) {
        const int u = 16 + (n & 1) + (n >> 1 & 2) + (n >> 2 & 4);
        const int v = 8 + (n >> 1 & 1) + (n >> 2 & 2) + (n >> 3 & 4);
        int16_t *at = &out.codes[v * TRIP_CPU_RASTER_STRIDE + u];
        if (!(mask >> n & 1))
            continue;
        const int code = codes[next++];
        assert_int_equal(*at, (code ? code : 1) - TRIP_CPU_CODE_BIAS);
        *at = (int16_t)code_at(0, u, v);
    }
    assert_memory_equal(&out, &rasters[0], sizeof out); /* no other voxel is written */
}

static void check_ranges(const trip_cpu_kernels *k, uint64_t squares)
{
    trip_cpu_square_ranges ranges;
    k->sheet_ranges(&rasters[0], squares, &ranges);
    for (int square = 0; square < 64; square++) {
        int min = INT16_MAX, max = INT16_MIN;
        for (int i = 0; i < 81 && squares >> square & 1; i++) {
            int code = code_at(0, square % 8 * 8 + i % 9, square / 8 * 8 + i / 9);
            min = !is_missing(code) && code < min ? code : min;
            max = code > max ? code : max;
        }
        assert_int_equal(ranges.min[square], min);
        assert_int_equal(ranges.max[square], max);
    }
}

static void check_cells(const trip_cpu_kernels *k, int16_t min, int16_t max)
{
    const uint64_t squares = UINT64_C(0xfedcba9876543210);
    trip_cpu_cells cells;
    k->sheet_cells(&rasters[0], &rasters[4], squares, min, max, &cells);
    for (int v = 0; v < 64; v++)
        for (int u = 0; u < 64; u++) {
            int low = INT16_MAX, high = INT16_MIN, corners[2] = { 0 };
            for (int i = 0; i < 8; i++) {
                int code = code_at(i & 4 ? 4 : 0, u + (i & 1), v + (i >> 1 & 1));
                corners[i >> 2] += !is_missing(code);
                low = !is_missing(code) && code < low ? code : low;
                high = code > high ? code : high;
            }
            bool expected = (corners[0] == 4 || corners[1] == 4) && low <= max && high >= min;
            expected = expected && squares >> (v / 8 * 8 + u / 8) & 1;
            assert_int_equal(cells.rows[v] >> u & 1, expected);
        }
}

static int64_t between(int a, int b, int w)
{
    return ((int64_t)a * (16384 - w) + (int64_t)b * w) >> 14;
}

/* Squares at the right and lower edge use voxels beyond the edge. All others are left unchanged. */
static void check_between(const trip_cpu_kernels *k, int w, unsigned parts, uint64_t squares)
{
    out = rasters[0];
    k->sheet_between(&rasters[3], &rasters[4], squares, w << 16 | (16384 - w), parts, &out);
    for (int v = 0; v <= 64; v++)
        for (int u = 0; u <= 64; u++) {
            int a = code_at(3, u, v), b = code_at(4, u, v), i = v * TRIP_CPU_RASTER_STRIDE + u;
            const int square = (v < 64 ? v / 8 : 7) * 8 + (u < 64 ? u / 8 : 7);
            if (!(squares >> square & 1)) {
                assert_int_equal(out.codes[i], rasters[0].codes[i]);
                assert_memory_equal(&out.gradients[i], &rasters[0].gradients[i],
                                    sizeof out.gradients[i]);
                continue;
            }
            const bool missing = is_missing(a) || is_missing(b);
            assert_int_equal(out.codes[i], !(parts & TRIP_CPU_PART_CODES) ? rasters[0].codes[i]
                                           : missing                      ? TRIP_CPU_CODE_MISSING
                                                                          : between(a, b, w));
            for (int n = 0; n < 3 && !missing; n++) {
                const int16_t *from = rasters[3].gradients[i].along;
                const int16_t *to = rasters[4].gradients[i].along;
                assert_int_equal(out.gradients[i].along[n], parts & TRIP_CPU_PART_GRADIENTS
                                                                ? between(from[n], to[n], w)
                                                                : rasters[0].gradients[i].along[n]);
            }
        }
}

static trip_cpu_deviations deviations[3];

static void fill_deviations(void)
{
    for (int b = 0; b < 3; b++)
        for (int i = 0; i < TRIP_CPU_RASTER_VOXELS; i++)
            deviations[b][i] =
                (int16_t)(scene_hash(i, b, 11) % (255 * TRIP_CPU_DEVIATION_PARTS + 1)) *
                (i / 500 % 2);
}

static void check_deviations(const trip_cpu_kernels *k, int w, uint64_t squares)
{
    static trip_cpu_deviations between_both;
    uint8_t rows[64];
    memcpy(between_both, deviations[2], sizeof between_both);
    k->sheet_deviations_between(deviations[0], deviations[1], squares, w << 16 | (16384 - w),
                                between_both);
    k->sheet_rows(deviations[0], squares, rows);
    for (int v = 0; v <= 64; v++)
        for (int u = 0; u <= 64; u++) {
            const int square = (v < 64 ? v / 8 : 7) * 8 + (u < 64 ? u / 8 : 7);
            const int i = v * TRIP_CPU_RASTER_STRIDE + u;
            const int64_t expected = between(deviations[0][i], deviations[1][i], w);
            assert_int_equal(between_both[i], squares >> square & 1 ? expected : deviations[2][i]);
        }
    for (int square = 0; square < 64; square++) {
        double max = 0;
        for (int i = 0; i < 81 && squares >> square & 1; i++)
            max = fmax(max, deviations[0][(square / 8 * 8 + i / 9) * TRIP_CPU_RASTER_STRIDE +
                                          square % 8 * 8 + i % 9]);
        const double d = max / TRIP_CPU_DEVIATION_PARTS;
        assert_true(rows[square] < TRIP_BLURRED_ROWS);
        assert_true(trip_blurred_d_of_row(rows[square]) >= d);
        assert_true(rows[square] == 0 || trip_blurred_d_of_row(rows[square] - 1u) < 1.001 * d);
    }
}

static void kernels_prepare_sheets_like_plain_code(void **state)
{
    const unsigned both = TRIP_CPU_PART_CODES | TRIP_CPU_PART_GRADIENTS;
    (void)state;
    fill_rasters();
    fill_deviations();
    for (const trip_cpu_kernels *const *isa = trip_cpu_isas(); *isa; isa++) {
        check_decode(*isa, UINT64_MAX);
        check_decode(*isa, UINT64_C(0xf00f123480000001));
        check_decode(*isa, 1);
        check_ranges(*isa, UINT64_MAX);
        check_ranges(*isa, UINT64_C(0x8040201008040281));
        check_gradients(*isa, UINT64_MAX);
        check_gradients(*isa, UINT64_C(0x8040201008040281));
        check_cells(*isa, -5, 1);
        check_cells(*isa, TRIP_CPU_CODE_MIN, INT16_MAX);
        check_cells(*isa, 2, 290);
        check_between(*isa, 8192, both, UINT64_MAX);
        check_between(*isa, 5461, both, UINT64_C(0x8040201008040281));
        check_between(*isa, 0, TRIP_CPU_PART_CODES, UINT64_MAX);
        check_between(*isa, 8192, TRIP_CPU_PART_CODES, UINT64_C(0x8040201008040281));
        check_between(*isa, 8192, TRIP_CPU_PART_GRADIENTS, UINT64_C(0x8040201008040281));
        check_deviations(*isa, 8192, UINT64_MAX);
        check_deviations(*isa, 5461, UINT64_C(0x8040201008040281));
    }
}

static void assert_same_function(const trip_cpu_tf *a, const trip_cpu_tf *b)
{
    const trip_cpu_integrals *p = &a->integrals, *q = &b->integrals;
    const size_t entries = (65536u >> q->entry_log2) + 1;
    assert_int_equal(p->entry_log2, q->entry_log2);
    assert_memory_equal(p->sums, q->sums, entries * sizeof *p->sums);
    assert_memory_equal(p->at, q->at, entries * sizeof *p->at);
    assert_memory_equal(&p->extinction, &q->extinction, sizeof p->extinction);
    assert_int_equal(p->first, q->first);
    assert_int_equal(p->last, q->last);
    assert_int_equal(a->first_visible, b->first_visible);
    assert_int_equal(a->last_visible, b->last_visible);
    assert_memory_equal(a->next_visible, b->next_visible, 65536 * sizeof *a->next_visible);
}

/* Draws frame after frame, each with one change or none. */
static void kept_integrals_equal_recomputed_ones(void **state)
{
    static trip_tf_entry table[65536];
    static const struct {
        int visible;
        trip_cpu_codes codes;
        double voxel_world;
    } frames[] = {
        { 900, { 0, 0 }, 1 },   { 900, { 0, 0 }, 1 },   { 901, { 0, 0 }, 1 },
        { 901, { 800, 0 }, 1 }, { 901, { 800, 4 }, 1 }, { 901, { 800, 4 }, 2 },
    };
    (void)state;
    trip_budget *budget;
    trip_cpu_tf kept, anew;
    assert_int_equal(trip_budget_create(&budget, 4 * trip_cpu_tf_bytes()), 0);
    assert_true(trip_cpu_tf_create(&kept, budget));
    for (size_t i = 0; i < sizeof frames / sizeof *frames; i++) {
        memset(table, 0, sizeof table);
        table[frames[i].visible] = (trip_tf_entry){ 0.2f, 0.5f, 1, 3 };
        assert_true(trip_cpu_tf_create(&anew, budget));
        trip_cpu_tf_set(&kept, table, NULL, frames[i].codes, frames[i].voxel_world);
        trip_cpu_tf_set(&anew, table, NULL, frames[i].codes, frames[i].voxel_world);
        assert_same_function(&kept, &anew);
        trip_cpu_tf_destroy(&anew, budget);
    }
    trip_cpu_tf_destroy(&kept, budget);
    trip_budget_destroy(budget);
}

enum { FEW_FIRST = 1000, FEW = 40 };

static bool of_few_codes(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    (void)user;
    (void)gradient;
    *code = FEW_FIRST + (unsigned)(FEW * wave(i, j, k));
    return true;
}

/* Values between voxels are rounded more finely than the codes of voxels. */
static void volumes_with_few_codes_are_drawn_as_accurately(void **state)
{
    (void)state;
    scene s;
    scene_create(&s, &(scene_params){ .dims = { 24, 20, 22 },
                                      .tile_voxels = 32,
                                      .slab_sheets = 8,
                                      .voxel = of_few_codes });
    for (int i = 0; i <= FEW; i++)
        scene_colour(&s, (unsigned)(FEW_FIRST + i), (unsigned)(FEW_FIRST + i), 0.2 + 0.02 * i, 0.5,
                     1 - 0.02 * i, i < FEW / 2 ? 0 : 0.01 * (i - FEW / 2));
    const trip_camera_params view = scene_view(&s, trip_v3(1, 0.8, 0.6), 70, 30, 48);
    for (int samples_per_sheet = 1; samples_per_sheet <= 4; samples_per_sheet += 3) {
        const trip_settings settings = post(samples_per_sheet);
        scene_picture p = scene_draw(&s, &cpu_scenes_cpu, &view, &settings);
        scene_picture q = scene_draw(&s, &cpu_scenes_reference, &view, &settings);
        assert_shows(&q);
        assert_true(scene_difference(&p, &q) < 0.3 / 255);
        scene_picture_free(&p);
        scene_picture_free(&q);
    }
    scene_destroy(&s);
}

enum { LABEL = 30001, LABELS = 3, LABEL_VOXELS = 20 };

/* Two voxels force the codes to have 16 bits. */
static bool labelled(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    (void)user;
    (void)gradient;
    *code = LABEL + (unsigned)(i / LABEL_VOXELS);
    if (i == 0 && k == 0 && j % 19 == 0)
        *code = j ? 65535 : 0;
    return true;
}

static double mean_difference(const scene_picture *a, const scene_picture *b)
{
    const int floats = 4 * a->width * a->height;
    double sum = 0;
    for (int i = 0; i < floats; i++)
        sum += fabs((double)a->rgba[i] - (double)b->rgba[i]);
    return sum / floats;
}

/* Neighbouring codes may mean unrelated things. A value is rounded to a code only between two
 * different labels. */
static void labels_keep_their_colours(void **state)
{
    (void)state;
    scene s;
    scene_create(&s, &(scene_params){ .dims = { LABEL_VOXELS * LABELS, 20, 22 },
                                      .tile_voxels = 32,
                                      .slab_sheets = 8,
                                      .voxel = labelled });
    for (unsigned i = 0; i < LABELS; i++)
        scene_colour(&s, LABEL + i, LABEL + i, i % 3 == 0, i % 3 == 1, i % 3 == 2, 0.9);
    trip_camera_params view = scene_view(&s, trip_v3(0.2, 1, 0.1), 70, 30, 48);
    const trip_settings settings = post(2);
    scene_picture p = scene_draw(&s, &cpu_scenes_cpu, &view, &settings);
    scene_picture q = scene_draw(&s, &cpu_scenes_reference, &view, &settings);
    assert_shows(&q);
    assert_true(mean_difference(&p, &q) < 2.0 / 255);
    scene_picture_free(&p);
    scene_picture_free(&q);
    scene_destroy(&s);
}

static bool not_kept(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    return !crest(user, i, j, k, code, gradient);
}

/* The view is so far away that floats cannot distinguish the distances of neighbouring sheets from
 * the eye. */
static void the_narrowest_views_agree_with_the_reference(void **state)
{
    (void)state;
    scene s;
    const scene_part halo = { .kind = TRIP_KIND_HALO, .by = { 1, 1, 1 }, .voxel = not_kept };
    scene_create(&s, &(scene_params){ .dims = { SIDE_I, SIDE_J, SIDE_K },
                                      .tile_voxels = 32,
                                      .slab_sheets = 8,
                                      .voxel = crest,
                                      .parts = &halo,
                                      .part_count = 1 });
    scene_colour(&s, 33000, 65535, 0.9, 0.5, 0.1, 0.4);
    const double degrees[] = { 1e-6, 1e-4 };
    for (int i = 0; i < 4; i++) {
        trip_settings settings = post(i < 2 ? 1 : 3);
        double slope = tan(degrees[i % 2] * 3.14159265358979323846 / 360);
        trip_camera_params view =
            scene_view(&s, trip_v3(1, 0.8, 0.6), 30 / slope, degrees[i % 2], PIXELS);
        scene_picture expected = scene_draw(&s, scene_renderers_post(), &view, &settings);
        scene_picture p = scene_draw(&s, &cpu_scenes_cpu, &view, &settings);
        assert_shows(&expected);
        assert_true(scene_difference(&expected, &p) <= 1.0 / 255);
        scene_picture_free(&p);
        scene_picture_free(&expected);
    }
    scene_destroy(&s);
}

enum { HOLED = 20 };

/* One voxel in a given number is missing. Codes are smooth. */
static bool holed(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    const unsigned *one_in = user;
    (void)gradient;
    *code = (unsigned)(65535 * wave(2 * i, 2 * j, 2 * k));
    return scene_hash(i, j, k) % *one_in != 0;
}

/* Compares every instruction set with the reference. */
static void expect_as_in_the_reference(const scene *s, const trip_camera_params *view,
                                       const trip_settings *settings)
{
    scene_picture expected = scene_draw(s, &cpu_scenes_reference, view, settings);
    assert_shows(&expected);
    for (const trip_cpu_kernels *const *isa = trip_cpu_isas(); *isa; isa++) {
        setenv("TRIPTYCH_ISA", (*isa)->isa, 1);
        scene_picture p = scene_draw(s, &cpu_scenes_cpu, view, settings);
        const double apart = 255 * scene_difference(&expected, &p);
        print_message("%s: %.3f of 1/255\n", (*isa)->isa, apart);
        assert_true(apart <= 0.5);
        scene_picture_free(&p);
    }
    scene_picture_free(&expected);
    unsetenv("TRIPTYCH_ISA");
}

/* Cells with a missing corner are not drawn, whichever corner is missing. The test draws with one
 * and with more samples per sheet, along both directions of each list, and from inside. */
static void cells_beside_holes_agree_with_the_reference(void **state)
{
    (void)state;
    unsigned seldom = 40, often = 15, *const one_in[] = { &seldom, &often };
    const struct {
        trip_vec3 from;
        double distance, fov_degrees, ortho_height;
        int samples_per_sheet;
    } views[] = {
        { { 1, 0.83, 0.61 }, 50, 35, 0, 1 },    { { -0.57, -1, 0.71 }, 50, 35, 0, 2 },
        { { 0.37, 0.53, -1 }, 50, 35, 0, 1 },   { { -0.53, 0.41, 0.97 }, 6.3, 100, 0, 1 },
        { { 1, 0.83, -0.61 }, 6.3, 100, 0, 3 }, { { -1, 0.23, 0.31 }, 50, 35, 25, 1 },
    };
    for (int n = 0; n < 2; n++) {
        scene s;
        scene_create(&s, &(scene_params){ .dims = { HOLED, HOLED, HOLED },
                                          .tile_voxels = 16,
                                          .slab_sheets = 8,
                                          .voxel = holed,
                                          .user = one_in[n] });
        scene_colour(&s, 20000, 65535, 0.2, 0.5, 1, 0.05);
        for (size_t i = 0; i < sizeof views / sizeof views[0]; i++) {
            trip_settings settings = post(views[i].samples_per_sheet);
            trip_camera_params view =
                scene_view(&s, views[i].from, views[i].distance, views[i].fov_degrees, 48);
            view.ortho_height = views[i].ortho_height;
            settings.shading = n == 0;
            expect_as_in_the_reference(&s, &view, &settings);
            view.width = view.height = 24;
            settings.kernel = i % 2 ? TRIP_KERNEL_CUBIC : TRIP_KERNEL_GAUSSIAN;
            expect_as_in_the_reference(&s, &view, &settings);
        }
        scene_destroy(&s);
    }
}

/* Codes are minimum or maximum, also at the border of the grid. */
static bool mask(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    const bool halo = *(const bool *)user, kept = scene_hash(i / 4, j / 3, k / 5) % 3 == 0;
    (void)gradient;
    *code = kept ? 65535 : 0;
    return kept != halo;
}

/* Steps over the whole range of codes are lit like in the reference. */
static void masks_are_lit_as_in_the_reference(void **state)
{
    (void)state;
    bool no = false, yes = true;
    const scene_part halo = {
        .kind = TRIP_KIND_HALO, .by = { 1, 1, 1 }, .voxel = mask, .user = &yes
    };
    scene s;
    scene_create(&s, &(scene_params){ .dims = { 18, 19, 17 },
                                      .tile_voxels = 16,
                                      .slab_sheets = 8,
                                      .voxel = mask,
                                      .user = &no,
                                      .parts = &halo,
                                      .part_count = 1 });
    scene_colour(&s, 10000, 65535, 0.2, 0.5, 0.8, 0.6);
    for (int n = 0; n < 2; n++) {
        trip_settings settings = post(2);
        trip_camera_params view = scene_view(&s, trip_v3(1, n ? 0.83 : -0.7, 0.61), 50, 32, 48);
        expect_as_in_the_reference(&s, &view, &settings);
    }
    scene_destroy(&s);
}

/* Keeps all sheets except the first along Z, which is the halo. */
static bool ramp_to_the_faces(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    const bool halo = *(const bool *)user;
    (void)gradient;
    *code = 30000 + 800 * (unsigned)i + 700 * (unsigned)j + 600 * (unsigned)k;
    return (k == 0) == halo;
}

/* Single visible voxels, no two adjacent. They cover all positions within squares of eight voxels
 * and within rasters of squares. */
static bool sparks(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    (void)user;
    (void)gradient;
    static const int positions[3] = { 62 % 21, 63 % 21, 65 % 21 }; /* beside a raster's border */
    const bool shows =
        k % 3 == 1 && i % 21 == positions[k / 9 % 3] && j % 21 == positions[k / 3 % 3];
    *code = shows ? 65535 : 0;
    return true;
}

/* A segment near such a voxel may end in a neighbouring square without visible voxels. */
static void visible_voxels_beside_a_square_agree_with_the_reference(void **state)
{
    (void)state;
    const double ways[4][2] = { { 0.96, 0.95 }, { -0.96, 0.3 }, { 0.2, -0.96 }, { -0.95, -0.96 } };
    scene s;
    scene_create(&s, &(scene_params){ .dims = { 150, 150, 27 }, .voxel = sparks });
    scene_colour(&s, 5000, 65535, 1, 0.6, 0.3, 0.25);
    for (int i = 0; i < 8; i++) {
        trip_camera_params view =
            scene_view(&s, trip_v3(ways[i % 4][0], ways[i % 4][1], 1), 90, 30, 64);
        trip_settings settings = post(2 + i % 3);
        settings.shading = false;
        view.ortho_height = i < 4 ? 60 : 30;
        view.eye.x += i / 4 ? -10 : 0;
        view.look.x += i / 4 ? -10 : 0;
        expect_as_in_the_reference(&s, &view, &settings);
    }
    scene_destroy(&s);
}

/* Visible voxels reach the grid's faces. Nothing is drawn beyond the faces, with any kernel. */
static void nothing_is_visible_beyond_the_grids_faces(void **state)
{
    (void)state;
    static const trip_kernel kernels[] = { TRIP_KERNEL_LINEAR, TRIP_KERNEL_CUBIC,
                                           TRIP_KERNEL_GAUSSIAN };
    bool no = false, yes = true;
    const scene_part halo = {
        .kind = TRIP_KIND_HALO, .by = { 1, 1, 1 }, .voxel = ramp_to_the_faces, .user = &yes
    };
    scene s;
    scene_create(&s, &(scene_params){ .dims = { 13, 16, 11 },
                                      .tile_voxels = 16,
                                      .slab_sheets = 8,
                                      .voxel = ramp_to_the_faces,
                                      .user = &no,
                                      .parts = &halo,
                                      .part_count = 1 });
    scene_colour(&s, 30000, 65535, 0.2, 0.5, 1, 0.05);
    for (int n = 0; n < 3; n++)
        for (int parallel = 0; parallel < 2; parallel++) {
            trip_settings settings = post(2);
            trip_camera_params view = scene_view(&s, trip_v3(1, 0.83, 0.61), 40, 40, 36);
            view.ortho_height = parallel ? 28 : 0;
            settings.kernel = kernels[n];
            expect_as_in_the_reference(&s, &view, &settings);
        }
    scene_destroy(&s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(kernels_prepare_sheets_like_plain_code),
        cmocka_unit_test(any_number_of_threads_draws_the_same),
        cmocka_unit_test(any_tile_of_the_data_and_any_batch_draw_the_same),
        cmocka_unit_test(any_memory_draws_the_same_or_is_reported_as_too_little),
        cmocka_unit_test(grids_too_wide_for_the_memory_are_drawn_in_windows),
        cmocka_unit_test(small_pictures_are_lit_by_gradients_of_their_own_sheets),
        cmocka_unit_test(occlusion_culling_draws_the_same),
        cmocka_unit_test(instruction_sets_agree),
        cmocka_unit_test(kept_integrals_equal_recomputed_ones),
        cmocka_unit_test(volumes_with_few_codes_are_drawn_as_accurately),
        cmocka_unit_test(labels_keep_their_colours),
        cmocka_unit_test(masks_are_lit_as_in_the_reference),
        cmocka_unit_test(the_narrowest_views_agree_with_the_reference),
        cmocka_unit_test(visible_voxels_beside_a_square_agree_with_the_reference),
        cmocka_unit_test(nothing_is_visible_beyond_the_grids_faces),
        cmocka_unit_test(cells_beside_holes_agree_with_the_reference),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
