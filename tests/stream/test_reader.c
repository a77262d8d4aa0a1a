#include "fixture.h"

#include <stdio.h>
#include <unistd.h>

/* Index of the brick that holds a voxel, found by trying all of the list. */
static uint64_t brick_of(const trip_dataset *d, int axis, const fixture_voxel *x)
{
    const trip_list *l = &d->lists[axis];
    unsigned log2 = d->header.tile_log2;
    for (uint64_t s = 0; s < l->slab_count; s++) {
        if (l->slabs[s].slab != x->p[axis] / d->header.slab_sheets)
            continue;
        for (uint64_t b = l->slabs[s].first_brick;; b++)
            if (l->bricks[b].tile_u == x->p[(axis + 1) % 3] >> log2 &&
                l->bricks[b].tile_v == x->p[(axis + 2) % 3] >> log2)
                return b;
    }
    fail();
    return 0;
}

/* The voxels of a selection in draw order, without the code under test. */
static size_t expect(const fixture *f, const trip_selection *s, fixture_voxel *out)
{
    size_t n = 0;
    for (size_t i = 0; i < f->count; i++) {
        size_t at = s->descending ? f->count - 1 - i : i;
        const fixture_voxel *x = &f->lists[s->axis][at];
        if (x->p[s->axis] >= s->sheet_first && x->p[s->axis] <= s->sheet_last &&
            trip_selection_has(s, brick_of(s->data, s->axis, x)))
            out[n++] = *x;
    }
    return n;
}

static size_t decode(const trip_batch *batch, int axis, fixture_voxel *out)
{
    size_t n = 0;
    for (size_t r = 0; r < batch->run_count; r++) {
        const trip_run *run = &batch->runs[r];
        for (uint32_t i = 0; i < run->count; i++) {
            uint64_t at = run->first + (batch->selection->descending ? run->count - 1 - i : i);
            fixture_voxel *x = &out[n++];
            assert_true(at < batch->splats);
            *x = (fixture_voxel){ .code = trip_voxel_code(batch->voxels[at]),
                                  .normal = batch->normals ? batch->normals[at] : 0 };
            x->p[axis] = (uint32_t)run->sheet;
            x->p[(axis + 1) % 3] = (uint32_t)run->u + trip_voxel_u(batch->voxels[at]);
            x->p[(axis + 2) % 3] = (uint32_t)run->v + trip_voxel_v(batch->voxels[at]);
        }
    }
    return n;
}

/* One pass; batches are held for a while, up to one less than there are slots. */
static int read_pass(trip_reader *r, const trip_selection *s, unsigned hold, fixture_voxel *out,
                     size_t *count)
{
    trip_batch held[64] = { 0 };
    unsigned first = 0, n = 0;
    int status;
    *count = 0;
    assert_int_equal(trip_reader_begin(r, s), TRIP_OK);
    do {
        if (n > hold) {
            trip_reader_release(r, &held[first++ % 64]);
            n--;
        }
        status = trip_reader_next(r, &held[(first + n) % 64]);
        if (status == 1)
            *count += decode(&held[(first + n++) % 64], s->axis, out + *count);
    } while (status == 1);
    while (n-- > 0)
        trip_reader_release(r, &held[first++ % 64]);
    return status;
}

static void select_some(trip_selection *s, const trip_dataset *d, uint64_t *state)
{
    uint64_t r = fixture_random(state);
    int axis = (int)(r % 3);
    int64_t dim = (int64_t)d->header.dims[axis];
    int64_t first = r & 8 ? (int64_t)(r >> 8 & 63) % dim : 0;
    int64_t last = r & 16 ? (int64_t)(r >> 16 & 63) % dim : dim - 1;
    assert_int_equal(trip_selection_create(s, d, axis, r & 32, first, last, d->budget), TRIP_OK);
    for (uint64_t b = 0; b < d->lists[axis].brick_count; b++)
        if (r & 64 || fixture_random(state) % 3 == 0)
            trip_selection_add(s, b);
}

/* Random delays, short reads, interruptions and calls to try again, on any engine. */
static long disturb(void *user, void *data, uint64_t offset, size_t bytes, long result)
{
    _Atomic uint64_t *counter = user;
    uint64_t state = offset + (*counter)++ * 7919;
    uint64_t r = fixture_random(&state);
    (void)data;
    (void)bytes;
    if (r % 4 == 0)
        usleep((unsigned)(r >> 8) % 300);
    if (r % 5 == 0 && result > 1)
        return 1 + (long)(r >> 16) % (result - 1);
    if (r % 7 == 0)
        return r & 64 ? -4 : -11; /* EINTR, EAGAIN */
    return result;
}

static void check_random_passes(const fixture *f, const trip_dataset *d,
                                const trip_reader_params *params, unsigned hold, int passes)
{
    trip_reader *r;
    fixture_voxel *wanted = calloc(f->count + 1, sizeof *wanted);
    fixture_voxel *got = calloc(f->count + 1, sizeof *got);
    uint64_t state = 5;
    assert_int_equal(trip_reader_create(&r, d, params, f->budget), TRIP_OK);
    for (int i = 0; i < passes; i++) {
        trip_selection s;
        size_t n;
        select_some(&s, d, &state);
        size_t n_wanted = expect(f, &s, wanted);
        assert_int_equal(read_pass(r, &s, hold, got, &n), 0);
        assert_int_equal(n, n_wanted);
        for (size_t k = 0; k < n && !(params->planes & 2); k++)
            wanted[k].normal = 0;
        assert_memory_equal(got, wanted, n * sizeof *got);
        trip_selection_destroy(&s, f->budget);
    }
    trip_reader_destroy(r);
    free(wanted);
    free(got);
}

static void every_engine_and_ring_hands_out_the_same_runs(void **state)
{
    fixture f;
    trip_dataset *d;
    (void)state;
    fixture_make(&f, &(fixture_params){ .dims = { 90, 70, 80 },
                                        .normals = true,
                                        .tile_voxels = 32,
                                        .slab_sheets = 4,
                                        .page_bytes = 4096 });
    assert_int_equal(trip_dataset_open(&d, f.path, f.budget), TRIP_OK);
    unsigned slots[] = { 2, 3, 8, 64 };
    size_t slot_bytes[] = { 4096, 16384, 1 << 20 };
    for (int i = 0; i < 24; i++) {
        _Atomic uint64_t counter = (uint64_t)i;
        trip_reader_params params = { .engine = (trip_engine)(i % 4),
                                      .planes = i % 2 ? 3 : 0,
                                      .slots = slots[i / 2 % 4],
                                      .slot_bytes = slot_bytes[i % 3],
                                      .gap_bytes = i % 5 ? 4096 : 0,
                                      .threads = (unsigned)(i % 5),
                                      .buffered = i % 7 == 0,
                                      .cache_bytes = i % 3 ? 0 : 100000,
                                      .fault = i % 2 ? disturb : NULL,
                                      .fault_user = &counter };
        check_random_passes(&f, d, &params, (unsigned)i % params.slots, 6);
    }
    trip_dataset_close(d);
    fixture_free(&f);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_engine_and_ring_hands_out_the_same_runs),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
