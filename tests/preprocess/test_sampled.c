/* Reads every n-th voxel of volumes, from slices and from the portions of a reader that this test
 * defines. */
#include "test.h"

#include <unistd.h>

#include "sampled.h"
#include "volume.h"

/* Returns the value of voxel (i, j, k). */
static unsigned value_at(int64_t i, int64_t j, int64_t k)
{
    return (unsigned)(1 + (i + 5 * j + 11 * k) % 250);
}

static const int64_t dims[3] = { 23, 17, 13 };

static trip_budget *new_budget(void)
{
    trip_budget *budget;
    assert_int_equal(trip_budget_create(&budget, 64 << 20), 0);
    return budget;
}

static void write_raw(const char *path)
{
    FILE *f = fopen(path, "wb");
    assert_non_null(f);
    for (int64_t k = 0; k < dims[2]; k++)
        for (int64_t j = 0; j < dims[1]; j++)
            for (int64_t i = 0; i < dims[0]; i++)
                fputc((int)value_at(i, j, k), f);
    assert_int_equal(fclose(f), 0);
}

/* Checks that the portions contain each voxel exactly once. */
static void assert_samples(trip_volume *v, int64_t step, int64_t slices)
{
    const trip_volume_info *info = trip_volume_get_info(v);
    trip_volume_portion p;
    int64_t seen = 0;
    while (trip_volume_next(v, slices, &p) > 0) {
        const int64_t n = p.size[0] * p.size[1] * p.size[2];
        float *values = malloc((size_t)n * sizeof *values);
        uint8_t *active = malloc((size_t)n);
        assert_int_equal(trip_portion_decode(v, &p, p.origin, p.size, values, active), 0);
        for (int64_t x = 0; x < n; x++) {
            const int64_t i = p.origin[0] + x % p.size[0];
            const int64_t j = p.origin[1] + x / p.size[0] % p.size[1];
            const int64_t k = p.origin[2] + x / (p.size[0] * p.size[1]);
            assert_true((unsigned)values[x] == value_at(i * step, j * step, k * step));
            assert_int_equal(active[x], 1);
        }
        seen += n;
        free(values);
        free(active);
        trip_portion_release(v, &p);
    }
    assert_int_equal(seen, info->dims[0] * info->dims[1] * info->dims[2]);
}

static void slices_are_sampled_along_each_axis(void **state)
{
    (void)state;
    const trip_volume_params plain = { .raw_dims = { 23, 17, 13 },
                                       .raw_type = "uint8",
                                       .spacing = { 2, 3, 0.5 } };
    write_raw("v.raw");
    for (int64_t step = 1; step <= 4; step++) {
        trip_volume *v;
        trip_budget *budget = new_budget();
        trip_volume_params params = plain;
        params.max_voxels = 1;
        for (int a = 0; a < 3; a++) /* exactly the voxels at this step */
            params.max_voxels *= (uint64_t)((dims[a] - 1) / step + 1);
        assert_int_equal(trip_volume_open(&v, "v.raw", &params, budget), 0);
        const trip_volume_info *info = trip_volume_get_info(v);
        for (int a = 0; a < 3; a++) {
            assert_int_equal(info->dims[a], (dims[a] - 1) / step + 1);
            assert_true(info->index_to_world.m[a][a] == plain.spacing[a] * (double)step);
            assert_true(info->index_to_world.m[a][3] == 0);
        }
        for (int64_t slices = 0; slices < 4; slices++) {
            assert_samples(v, step, slices);
            assert_int_equal(trip_volume_rewind(v), 0);
        }
        trip_volume_close(v);
        trip_budget_destroy(budget);
    }
    unlink("v.raw");
}

static void sampling_skips_slices(void **state)
{
    (void)state;
    const trip_volume_params params = { .raw_dims = { 23, 17, 13 },
                                        .raw_type = "uint8",
                                        .max_voxels = 12 * 9 * 7 };
    trip_volume *v;
    trip_budget *budget = new_budget();
    trip_volume_portion p;
    float value;
    write_raw("v.raw");
    assert_int_equal(trip_volume_open(&v, "v.raw", &params, budget), 0);
    assert_int_equal(trip_volume_skip(v, 3), 3);
    assert_int_equal(trip_volume_next(v, 1, &p), 1);
    assert_int_equal(p.origin[2], 3);
    const int64_t at[3] = { 5, 4, 3 }, one[3] = { 1, 1, 1 };
    assert_int_equal(trip_portion_decode(v, &p, at, one, &value, NULL), 0);
    assert_true((unsigned)value == value_at(10, 8, 6));
    trip_portion_release(v, &p);
    trip_volume_close(v);
    trip_budget_destroy(budget);
    unlink("v.raw");
}

/* ---- portions: boxes of 5 voxels a side that fill the grid ---- */

typedef struct boxes {
    int next, held;
} boxes;

static int rewind_boxes(void *state)
{
    ((boxes *)state)->next = 0;
    return 0;
}

static void close_boxes(void *state)
{
    assert_int_equal(((boxes *)state)->held, 0);
}

static int next_box(void *state, trip_volume_portion *p)
{
    enum { EDGE = 5, ACROSS = 5, DOWN = 4, DEEP = 3 };
    boxes *b = state;
    if (b->next == ACROSS * DOWN * DEEP)
        return 0;
    const int64_t cell[3] = { b->next % ACROSS, b->next / ACROSS % DOWN,
                              b->next / (ACROSS * DOWN) };
    for (int a = 0; a < 3; a++) {
        p->origin[a] = EDGE * cell[a];
        p->size[a] = p->origin[a] + EDGE < dims[a] ? EDGE : dims[a] - p->origin[a];
    }
    b->next++;
    b->held++;
    return 1;
}

/* Decodes any box. Voxels beyond the grid are background. */
static int decode_box(const void *state, const trip_volume_portion *p, const int64_t lo[3],
                      const int64_t size[3], float *values, uint8_t *active)
{
    (void)state;
    (void)p;
    assert_true(size[0] > 0 && size[1] > 0 && size[2] > 0);
    for (int64_t n = 0; n < size[0] * size[1] * size[2]; n++) {
        const int64_t i = lo[0] + n % size[0], j = lo[1] + n / size[0] % size[1],
                      k = lo[2] + n / (size[0] * size[1]);
        const bool in = i >= 0 && j >= 0 && k >= 0 && i < dims[0] && j < dims[1] && k < dims[2];
        values[n] = in ? (float)value_at(i, j, k) : 0;
        active[n] = in;
    }
    return 0;
}

static void release_box(void *state, trip_volume_portion *p)
{
    (void)p;
    ((boxes *)state)->held--;
}

static const trip_volume_reader boxes_reader = {
    .close = close_boxes,
    .rewind = rewind_boxes,
    .next = next_box,
    .decode = decode_box,
    .release = release_box,
};

static void portions_have_their_samples_and_neighbours(void **state)
{
    (void)state;
    for (int64_t step = 2; step <= 7; step++) {
        boxes b = { 0, 0 };
        void *of = &b;
        const trip_volume_reader *reader = &boxes_reader;
        trip_budget *budget = new_budget();
        trip_volume_info info = { .dims = { dims[0], dims[1], dims[2] },
                                  .index_to_world = trip_affine_identity(),
                                  .type = TRIP_F32 };
        uint64_t max = 1;
        for (int a = 0; a < 3; a++)
            max *= (uint64_t)((dims[a] - 1) / step + 1);
        assert_int_equal(trip_sampled_wrap(&reader, &of, &info, max, budget), 0);
        trip_volume_portion p;
        int64_t seen = 0;
        while (reader->next(of, &p) > 0) {
            int64_t lo[3], size[3];
            float values[512];
            uint8_t active[512];
            for (int a = 0; a < 3; a++) {
                lo[a] = p.origin[a] - 1;
                size[a] = p.size[a] + 2;
            }
            assert_int_equal(reader->decode(of, &p, lo, size, values, active), 0);
            for (int64_t n = 0; n < size[0] * size[1] * size[2]; n++) {
                const int64_t i = (lo[0] + n % size[0]) * step;
                const int64_t j = (lo[1] + n / size[0] % size[1]) * step;
                const int64_t k = (lo[2] + n / (size[0] * size[1])) * step;
                const bool in =
                    i >= 0 && j >= 0 && k >= 0 && i < dims[0] && j < dims[1] && k < dims[2];
                assert_int_equal(active[n], in);
                assert_true(values[n] == (in ? (float)value_at(i, j, k) : 0));
            }
            seen += p.size[0] * p.size[1] * p.size[2];
            reader->release(of, &p);
        }
        assert_int_equal(seen, max);
        assert_int_equal(seen, info.dims[0] * info.dims[1] * info.dims[2]);
        reader->close(of);
        trip_budget_destroy(budget);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(slices_are_sampled_along_each_axis),
        cmocka_unit_test(sampling_skips_slices),
        cmocka_unit_test(portions_have_their_samples_and_neighbours),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
