/* Checks that the pictures of the reference and the CPU renderer have the same bits for all sizes
 * of tiles, slabs, rings and caches. Reader engines, numbers of threads, and the order in which
 * reads end must not matter either. */
#include "cpu/cpu_renderer.h"
#include "renderer_choice.h"
#include "rounds.h"
#include "scenes.h"
#include "test.h"

#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { SIZE = 64, VIEWS = 3, TRIALS = 13, FEW_TRIALS = 7 };

static const size_t picture_bytes = (size_t)SIZE * SIZE * 4 * sizeof(float);

static uint64_t next_random(uint64_t *state)
{
    *state += 0x9e3779b97f4a7c15u;
    uint64_t x = *state;
    x = (x ^ x >> 30) * 0xbf58476d1ce4e5b9u;
    x = (x ^ x >> 27) * 0x94d049bb133111ebu;
    return x ^ x >> 31;
}

static unsigned pick(uint64_t *state, unsigned count)
{
    return (unsigned)(next_random(state) % count);
}

/* A solid core in a translucent, ragged cloud. Some bricks hide others, and some bricks are
 * transparent. */
static bool cloudy(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    double x = (i - 35) / 35.0, y = (j - 20) / 20.0, z = (k - 25) / 25.0;
    uint32_t hash = scene_hash(i, j, k);
    (void)user;
    gradient[0] = x;
    gradient[1] = y;
    gradient[2] = z;
    *code = x * x + y * y + z * z < 0.7 ? 65535 : hash % 50000;
    return *code == 65535 || hash % 3 != 0;
}

static void create_scene(scene *s, unsigned tile, unsigned slab)
{
    scene_create(s, &(scene_params){ .dims = { 70, 40, 50 },
                                     .tile_voxels = tile,
                                     .slab_sheets = slab,
                                     .normals = true,
                                     .voxel = cloudy });
    scene_colour(s, 10000, 49999, 1, 0.4, 0.1, 0.02);
    scene_colour(s, 65535, 65535, 0.2, 0.6, 1, 0.99);
}

/* Returns a view from far away, from nearby or from inside. From inside, the camera splits a list
 * into two sides. */
static trip_camera_params view_of(const scene *s, int view)
{
    static const struct {
        trip_vec3 direction;
        double distance, fov_degrees;
    } views[VIEWS] = { { { 1, 0.9, -0.8 }, 110, 40 },
                       { { -0.1, 1, 0.05 }, 45, 40 },
                       { { 0.5, -0.4, 1 }, 21, 110 } };
    return scene_view(s, views[view].direction, views[view].distance, views[view].fov_degrees,
                      SIZE);
}

/* Delays one in eight reads by up to two milliseconds. */
static long delay(void *user, void *data, uint64_t offset, size_t bytes, long result)
{
    static _Atomic uint32_t calls;
    uint64_t state = offset + bytes + calls++ + *(const uint64_t *)user;
    (void)data;
    if (next_random(&state) % 8 == 0)
        nanosleep(&(struct timespec){ .tv_nsec = (long)(next_random(&state) % 2000000) }, NULL);
    return result;
}

/* Parameters of one picture. */
typedef struct trial {
    unsigned tile, slab, threads;
    bool skip;
    int frames;            /* frames drawn by the same reader; the test compares the last */
    uint64_t memory_bytes; /* memory of the renderer; a small memory blends few splats at a time */
    trip_reader_params reader;
} trial;

/* Cycles through tiles, slots, engines, threads and delays. All other parameters are random. */
static trial make_trial(unsigned number, uint64_t *random)
{
    static const unsigned tiles[] = { 16, 32, 64, 128 }, slabs[] = { 1, 5, 8, 64 };
    static const unsigned slots[] = { 2, 64, 3, 5, 8, 17 };
    static const trip_engine engines[] = { TRIP_ENGINE_AUTO, TRIP_ENGINE_PREAD, TRIP_ENGINE_NULL };
    trial t = { .tile = tiles[number % 4],
                .slab = slabs[pick(random, 4)],
                .threads = 1 + number % 8,
                .skip = pick(random, 2),
                .frames = 1 + (int)pick(random, 2),
                .memory_bytes = UINT64_C(16) << 6 * pick(random, 2) << 20 };
    t.reader = (trip_reader_params){ .engine = engines[number % 3],
                                     .slots = slots[number % 6],
                                     .slot_bytes = (size_t)16384 << pick(random, 3),
                                     .gap_bytes = (size_t)4096 << pick(random, 8),
                                     .threads = 1 + pick(random, 8),
                                     .buffered = pick(random, 2),
                                     .cache_bytes = (size_t)pick(random, 3) << 20,
                                     .fault = number / 3 % 2 ? delay : NULL };
    return t;
}

/* Blends and reads little at a time, so that the renderer finds occluded bricks before it reads
 * them. */
static trial skipping_trial(void)
{
    return (trial){ .tile = 16,
                    .slab = 8,
                    .threads = 2,
                    .skip = true,
                    .frames = 1,
                    .memory_bytes = 16 << 20,
                    .reader = { .slots = 2, .slot_bytes = 16384, .gap_bytes = 4096 } };
}

static void print_trial(const trial *t)
{
    const trip_reader_params *r = &t->reader;
    print_message("tile %u slab %u, %u threads, skip %d, frames %d, %llu bytes; engine %d, "
                  "%u slots of %zu, gap %zu, %u threads, buffered %d, cache %zu, delays %d\n",
                  t->tile, t->slab, t->threads, t->skip, t->frames,
                  (unsigned long long)t->memory_bytes, (int)r->engine, r->slots, r->slot_bytes,
                  r->gap_bytes, r->threads, r->buffered, r->cache_bytes, r->fault != NULL);
}

/* The renderer and its settings. */
typedef struct drawing {
    trip_renderer_kind kind;
    trip_classify classify;
} drawing;

static void draw(const scene *s, drawing by, const trial *t, int view, float *rgba,
                 trip_frame_stats *stats)
{
    trip_camera camera;
    trip_plan plan;
    trip_budget *budget;
    trip_renderer *renderer;
    trip_reader *reader;
    uint64_t random = t->slab + t->tile;
    trip_reader_params params = t->reader;
    trip_settings settings = trip_settings_default();
    trip_camera_params looking = view_of(s, view);
    settings.h = 0.4;
    settings.classify = by.classify;
    assert_int_equal(trip_camera_make(&camera, &looking, &s->data->index_to_world), 0);
    assert_int_equal(trip_plan_make(&plan, s->data, &camera, &settings, s->table, s->budget), 0);
    assert_int_equal(trip_budget_create(&budget, t->memory_bytes), 0);
    assert_int_equal(trip_renderer_create(&renderer, by.kind, t->threads, budget), 0);
    params.planes = plan.planes;
    params.skip = t->skip ? trip_cpu_occluded : NULL;
    params.skip_user = renderer;
    params.fault_user = &random;
    assert_int_equal(trip_reader_create(&reader, s->data, &params, s->budget), 0);
    trip_frame frame = {
        .data = s->data, .camera = &camera, .settings = &settings, .plan = &plan, .table = s->table
    };
    for (int i = 0; i < t->frames; i++)
        assert_int_equal(trip_frame_draw(renderer, reader, &frame, rgba, NULL, stats), 0);
    trip_reader_destroy(reader);
    renderer->ops->destroy(renderer);
    trip_budget_destroy(budget);
    trip_plan_release(&plan, s->budget);
}

static void check_renderer(drawing by, int trials)
{
    static float wanted[VIEWS][SIZE * SIZE * 4], rgba[SIZE * SIZE * 4];
    trip_frame_stats stats;
    uint64_t skipped = 0, random = (uint64_t)by.kind;
    scene s;
    create_scene(&s, 64, 8);
    for (int view = 0; view < VIEWS; view++)
        draw(&s, by, &(trial){ .threads = 1, .frames = 1, .memory_bytes = 1 << 30 }, view,
             wanted[view], &stats);
    scene_destroy(&s);
    for (int i = 0; i < limits_rounds(trials); i++) {
        trial t = i ? make_trial((unsigned)i, &random) : skipping_trial();
        create_scene(&s, t.tile, t.slab);
        for (int view = 0; view < VIEWS; view++) {
            draw(&s, by, &t, view, rgba, &stats);
            skipped += stats.reader.bytes_skipped;
            if (memcmp(rgba, wanted[view], picture_bytes) != 0)
                print_trial(&t);
            assert_memory_equal(rgba, wanted[view], picture_bytes);
        }
        scene_destroy(&s);
    }
    assert_int_equal(skipped > 0, by.kind == TRIP_RENDERER_CPU);
}

/* The reference has no settings for threads and memory. */
static void the_reference_picture_does_not_depend_on_reading(void **state)
{
    (void)state;
    check_renderer((drawing){ TRIP_RENDERER_REFERENCE, TRIP_CLASSIFY_PRE }, FEW_TRIALS);
    check_renderer((drawing){ TRIP_RENDERER_REFERENCE, TRIP_CLASSIFY_POST }, FEW_TRIALS);
}

static void the_cpu_picture_does_not_depend_on_reading(void **state)
{
    (void)state;
    check_renderer((drawing){ TRIP_RENDERER_CPU, TRIP_CLASSIFY_PRE }, TRIALS);
    check_renderer((drawing){ TRIP_RENDERER_CPU, TRIP_CLASSIFY_POST }, TRIALS);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_reference_picture_does_not_depend_on_reading),
        cmocka_unit_test(the_cpu_picture_does_not_depend_on_reading),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
