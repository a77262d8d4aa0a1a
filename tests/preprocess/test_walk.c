#include "brick_files.h"

#include <zlib.h>

#include "walk.h"

enum { NX = 70, NY = 66, NZ = 50, N = NX * NY * NZ };

/* Counts how often a walk met each voxel, and notes wrong values. */
typedef struct seen {
    uint8_t times[N];
    uint64_t done, batches, voxels; /* the last progress report */
    int64_t edge, height;
    bool wrong;
    int stop_after; /* slices; 0 disables it */
} seen;

static uint8_t value_at(size_t i)
{
    return (uint8_t)(i * 2654435761u >> 13);
}

static void make_volume(bool compressed)
{
    static uint8_t values[N];
    for (size_t i = 0; i < N; i++)
        values[i] = value_at(i);
    if (!compressed) {
        test_write("v.raw", values, sizeof values);
        return;
    }
    gzFile f = gzopen(test_path("v.raw.gz"), "wb1");
    assert_int_equal(gzwrite(f, values, sizeof values), sizeof values);
    assert_int_equal(gzclose(f), Z_OK);
    static const char header[] = "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 70 66 50\n"
                                 "encoding: gzip\ndata file: v.raw.gz\n\n";
    test_write("v.nhdr", header, sizeof header - 1);
}

static int see_box(void *user, unsigned thread, const trip_box *box)
{
    seen *s = user;
    float values[64 * 64 * 16];
    (void)thread;
    assert_int_equal(
        trip_portion_decode(box->volume, box->portion, box->lo, box->size, values, NULL), 0);
    const int64_t step[3] = { s->edge, s->edge, s->height };
    for (int a = 0; a < 3; a++)
        s->wrong = s->wrong || box->lo[a] / step[a] != (box->lo[a] + box->size[a] - 1) / step[a];
    size_t n = 0;
    for (int64_t k = 0; k < box->size[2]; k++)
        for (int64_t j = 0; j < box->size[1]; j++)
            for (int64_t i = 0; i < box->size[0]; i++, n++) {
                int64_t at = ((box->lo[2] + k) * NY + box->lo[1] + j) * NX + box->lo[0] + i;
                s->times[at]++; /* boxes do not overlap, else the sanitizer reports a race */
                s->wrong = s->wrong || values[n] != value_at((size_t)at);
            }
    return 0;
}

static int see_batch(void *user, uint64_t done, uint64_t voxels)
{
    seen *s = user;
    s->wrong = s->wrong || done <= s->done || voxels <= s->voxels;
    s->done = done;
    s->batches++;
    s->voxels = voxels;
    return s->stop_after && done >= (uint64_t)s->stop_after ? -77 : 0;
}

static int walk_volume(const char *name, trip_walk_params p, seen *s)
{
    trip_budget *budget;
    trip_workers *workers;
    trip_volume *volume;
    trip_volume_params v = { .raw_dims = { NX, NY, NZ }, .raw_type = "uint8" };
    if (strcmp(name, "v.raw") != 0)
        v = (trip_volume_params){ 0 };
    p.box = see_box;
    p.batch = see_batch;
    p.user = s;
    s->edge = p.edge;
    s->height = p.height;
    assert_int_equal(trip_budget_create(&budget, (uint64_t)1 << 26), 0);
    assert_int_equal(trip_workers_create(&workers, 1), 0);
    assert_int_equal(trip_volume_open(&volume, test_path(name), &v, budget), 0);
    int status = trip_walk(volume, workers, &p);
    trip_volume_close(volume);
    trip_workers_destroy(workers);
    trip_budget_destroy(budget);
    return status;
}

static void every_voxel_is_visited_once(void **state)
{
    (void)state;
    make_volume(false);
    for (int64_t slices = 1; slices < 60; slices += 7)
        for (int way = 0; way < 4; way++) {
            seen s = { 0 };
            trip_walk_params p = {
                .slices = slices, .read_ahead = way & 1, .edge = way & 2 ? 16 : 64, .height = 8
            };
            assert_int_equal(walk_volume("v.raw", p, &s), 0);
            assert_false(s.wrong);
            assert_int_equal(s.voxels, N);
            assert_int_equal(s.batches, (NZ + slices - 1) / slices);
            assert_int_equal(s.done, NZ);
            for (size_t i = 0; i < N; i++)
                assert_int_equal(s.times[i], 1);
        }
}

/* Checks that the walk skips `skip` slices, then visits every stride-th portion of `slices` slices.
 */
static void check_passing(const char *name)
{
    static const struct {
        int64_t slices;
        uint64_t skip, stride;
    } ways[] = { { 4, 3, 1 }, { 1, 7, 1 },  { 3, 0, 2 }, { 1, 0, 2 },
                 { 2, 5, 4 }, { 7, 20, 1 }, { 1, 0, 9 }, { 50, 0, 3 } };
    for (size_t w = 0; w < sizeof ways / sizeof *ways; w++) {
        seen s = { 0 };
        uint64_t stride = ways[w].stride;
        trip_walk_params p = { .slices = ways[w].slices,
                               .read_ahead = w % 2,
                               .edge = 64,
                               .height = 16,
                               .skip = ways[w].skip,
                               .stride = stride };
        assert_int_equal(walk_volume(name, p, &s), 0);
        assert_false(s.wrong);
        for (size_t i = 0; i < N; i++) {
            uint64_t slice = i / (NX * NY), skip = ways[w].skip;
            bool looked_at =
                slice >= skip && (slice - skip) / (uint64_t)ways[w].slices % stride == 0;
            assert_int_equal(s.times[i], looked_at);
        }
    }
}

static void portions_can_be_skipped(void **state)
{
    (void)state;
    make_volume(false);
    check_passing("v.raw");
}

static void compressed_portions_can_be_skipped(void **state)
{
    (void)state;
    make_volume(true);
    check_passing("v.nhdr");
}

static void a_batch_may_end_the_walk(void **state)
{
    (void)state;
    seen s = { .stop_after = 6 };
    make_volume(false);
    trip_walk_params p = { .slices = 2, .read_ahead = true, .edge = 64, .height = 16 };
    assert_int_equal(walk_volume("v.raw", p, &s), -77);
    assert_int_equal(s.batches, 3);
    assert_int_equal(s.done, 6);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(every_voxel_is_visited_once, test_begin, test_end),
        cmocka_unit_test_setup_teardown(portions_can_be_skipped, test_begin, test_end),
        cmocka_unit_test_setup_teardown(compressed_portions_can_be_skipped, test_begin, test_end),
        cmocka_unit_test_setup_teardown(a_batch_may_end_the_walk, test_begin, test_end),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
