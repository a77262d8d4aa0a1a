#include "fixture.h"

#include <errno.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <pthread.h>
#include <semaphore.h>
#include <stdio.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

/* Returns the index of the brick that holds a voxel, found by trying all bricks of the list. */
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

/* Lists the voxels of a selection in draw order, without the code under test. */
static size_t expect(const fixture *f, const trip_selection *s, fixture_voxel *out)
{
    size_t n = 0;
    int axis = s->list->axis;
    for (size_t i = 0; i < f->count; i++) {
        size_t at = s->descending ? f->count - 1 - i : i;
        const fixture_voxel *x = &f->lists[axis][at];
        if (x->p[axis] >= s->sheet_first && x->p[axis] <= s->sheet_last &&
            trip_selection_has(s, brick_of(s->data, axis, x)))
            out[n++] = *x;
    }
    return n;
}

static size_t decode(const trip_batch *batch, fixture_voxel *out)
{
    static uint32_t voxels[TRIP_RUN_RECORDS_MAX], normals[TRIP_RUN_RECORDS_MAX];
    size_t n = 0;
    for (size_t r = 0; r < batch->run_count; r++) {
        const trip_run *run = &batch->runs[r];
        int axis = trip_batch_list(batch, run)->axis;
        fixture_decode_run(batch, run, voxels, normals);
        for (uint32_t i = 0; i < run->count; i++) {
            uint32_t at = batch->pass->descending ? run->count - 1 - i : i;
            fixture_voxel *x = &out[n++];
            *x = (fixture_voxel){ .code = trip_voxel_code(voxels[at]), .normal = normals[at] };
            x->p[axis] = (uint32_t)run->sheet;
            x->p[(axis + 1) % 3] = (uint32_t)run->u + trip_voxel_u(voxels[at]);
            x->p[(axis + 2) % 3] = (uint32_t)run->v + trip_voxel_v(voxels[at]);
        }
    }
    return n;
}

/* Reads the same pass several times in a row. Keeps up to `hold` batches before it releases them,
 * fewer than there are slots. */
static int read_passes(trip_reader *r, const trip_selection *s, int passes, unsigned hold,
                       fixture_voxel *out, size_t *count)
{
    trip_batch held[64] = { 0 };
    trip_pass all[TRIP_READER_PASSES_MAX];
    unsigned first = 0, n = 0;
    int status;
    *count = 0;
    assert_int_equal(trip_reader_begin(r, NULL), TRIP_OK);
    for (int i = 0; i < passes; i++) {
        all[i] = trip_pass_of(&s[i]);
        assert_int_equal(trip_reader_then(r, &all[i]), TRIP_OK);
    }
    do {
        if (n > hold) {
            trip_reader_release(r, &held[first++ % 64]);
            n--;
        }
        status = trip_reader_next(r, &held[(first + n) % 64]);
        if (status == 1)
            *count += decode(&held[(first + n++) % 64], out + *count);
    } while (status == 1);
    while (n-- > 0)
        trip_reader_release(r, &held[first++ % 64]);
    return status;
}

static int read_pass(trip_reader *r, const trip_selection *s, unsigned hold, fixture_voxel *out,
                     size_t *count)
{
    return read_passes(r, s, 1, hold, out, count);
}

static void select_some(trip_selection *s, const trip_dataset *d, uint64_t *state)
{
    uint64_t r = fixture_random(state);
    int axis = (int)(r % 3);
    int64_t dim = (int64_t)d->header.dims[axis];
    int64_t first = r & 8 ? (int64_t)(r >> 8 & 63) % dim : 0;
    int64_t last = r & 16 ? (int64_t)(r >> 16 & 63) % dim : dim - 1;
    assert_int_equal(trip_selection_create(s, d, &d->lists[axis], r & 32, first, last, d->budget),
                     TRIP_OK);
    for (uint64_t b = 0; b < d->lists[axis].brick_count; b++)
        if (r & 64 || fixture_random(state) % 3 == 0)
            trip_selection_add(s, b);
}

/* Disturbs reads of any engine with random delays, short reads, EINTR and EAGAIN. */
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
        return r & 64 ? -EINTR : -EAGAIN;
    return result;
}

static void check_random_passes(const fixture *f, const trip_dataset *d,
                                const trip_reader_params *params, unsigned hold, int rounds)
{
    enum { PASSES = 3 };
    trip_reader *r;
    fixture_voxel *wanted = calloc(PASSES * f->count + 1, sizeof *wanted);
    fixture_voxel *got = calloc(PASSES * f->count + 1, sizeof *got);
    uint64_t state = 5;
    assert_int_equal(trip_reader_create(&r, d, params, f->budget), TRIP_OK);
    for (int i = 0; i < rounds; i++) {
        trip_selection s[PASSES];
        size_t n, n_wanted = 0;
        int passes = 1 + i % PASSES;
        for (int k = 0; k < passes; k++) {
            select_some(&s[k], d, &state);
            n_wanted += expect(f, &s[k], wanted + n_wanted);
        }
        assert_int_equal(read_passes(r, s, passes, hold, got, &n), 0);
        assert_int_equal(n, n_wanted);
        assert_int_equal(trip_reader_get_stats(r).splats, n);
        for (size_t k = 0; k < n && !(params->planes & 2); k++)
            wanted[k].normal = 0;
        assert_memory_equal(got, wanted, n * sizeof *got);
        for (int k = 0; k < passes; k++)
            trip_selection_destroy(&s[k], f->budget);
    }
    trip_reader_destroy(r);
    free(wanted);
    free(got);
}

static bool uring_works(const trip_dataset *d)
{
    trip_reader *r;
    fixture_catch_reports();
    int status =
        trip_reader_create(&r, d, &(trip_reader_params){ .engine = TRIP_ENGINE_URING }, d->budget);
    fixture_reports();
    if (status == TRIP_OK)
        trip_reader_destroy(r);
    else
        test_lacks("io_uring");
    return status == TRIP_OK;
}

/* Makes and opens a data set on a real disk, which allows direct reads. */
static void open_fixture(fixture *f, trip_dataset **d)
{
    fixture_make(f, &(fixture_params){ .dims = { 90, 70, 80 },
                                       .normals = true,
                                       .tile_voxels = 32,
                                       .slab_sheets = 4,
                                       .page_bytes = 4096 });
    assert_int_equal(trip_dataset_open(d, f->path, f->budget), TRIP_OK);
}

static void close_fixture(fixture *f, trip_dataset *d)
{
    trip_dataset_close(d);
    fixture_free(f);
}

/* At a skipped brick, the reader may read through the gap in one plane but not in another.
 * Two pieces of a file may then share a page. */
static void gaps_may_be_small_in_one_plane_and_large_in_another(void **state)
{
    fixture f;
    trip_dataset *d;
    trip_reader *r;
    size_t n;
    (void)state;
    fixture_make(&f, &(fixture_params){ .dims = { 160, 160, 4 },
                                        .density = 1,
                                        .normals = true,
                                        .in_memory = true,
                                        .tile_voxels = 16,
                                        .page_bytes = 4096 });
    assert_int_equal(trip_dataset_open(&d, f.path, f.budget), TRIP_OK);
    fixture_voxel *wanted = calloc(f.count, sizeof *wanted), *got = calloc(f.count, sizeof *got);
    const trip_reader_params params = { .planes = 3, .gap_bytes = 4096 };
    assert_int_equal(trip_reader_create(&r, d, &params, f.budget), TRIP_OK);
    for (unsigned step = 2; step < 14; step++) {
        trip_selection s;
        int status = trip_selection_create(&s, d, &d->lists[2], step % 2, 0, 3, f.budget);
        assert_int_equal(status, TRIP_OK);
        for (uint64_t b = 0; b < s.list->brick_count; b += step)
            trip_selection_add(&s, b);
        size_t all = expect(&f, &s, wanted);
        assert_int_equal(read_pass(r, &s, 1, got, &n), 0);
        assert_int_equal(n, all);
        assert_memory_equal(got, wanted, n * sizeof *got);
        trip_selection_destroy(&s, f.budget);
    }
    trip_reader_destroy(r);
    free(wanted);
    free(got);
    close_fixture(&f, d);
}

static void every_engine_and_ring_returns_the_same_runs(void **state)
{
    fixture f;
    trip_dataset *d;
    (void)state;
    open_fixture(&f, &d);
    unsigned slots[] = { 2, 3, 8, 64 };
    size_t slot_bytes[] = { 4096, 16384, 1 << 20 };
    bool uring = uring_works(d);
    for (int i = 0; i < 36; i++) {
        _Atomic uint64_t counter = (uint64_t)i;
        trip_reader_params params = { .engine = (trip_engine)(i % 4),
                                      .planes = i / 4 % 2 ? 3 : 0,
                                      .slots = slots[i / 2 % 4],
                                      .slot_bytes = slot_bytes[i % 3],
                                      .gap_bytes = i % 5 ? 4096 : 0,
                                      .threads = (unsigned)(i % 5),
                                      .buffered = i % 7 == 0,
                                      .cache_bytes = i % 3 ? 0 : 100000,
                                      .fault = i / 4 % 3 ? disturb : NULL,
                                      .fault_user = &counter };
        if (params.engine != TRIP_ENGINE_URING || uring)
            check_random_passes(&f, d, &params, (unsigned)i % params.slots, 3);
    }
    close_fixture(&f, d);
}

static void select_all(trip_selection *s, const trip_dataset *d, int axis, bool descending)
{
    assert_int_equal(
        trip_selection_create(s, d, &d->lists[axis], descending, 0, INT32_MAX, d->budget), 0);
    for (uint64_t b = 0; b < d->lists[axis].brick_count; b++)
        trip_selection_add(s, b);
}

static void the_reader_reads_into_memory_of_the_caller(void **state)
{
    fixture f;
    trip_dataset *d;
    trip_reader *r;
    trip_selection s;
    trip_batch batch;
    void *memory[3];
    enum { SLOT_BYTES = 16384 };
    (void)state;
    open_fixture(&f, &d);
    for (int i = 0; i < 3; i++)
        memory[i] = aligned_alloc(4096, 2 * SLOT_BYTES);
    trip_reader_params params = {
        .planes = 3, .slots = 3, .slot_bytes = 2 * SLOT_BYTES, .slot_memory = memory
    };
    check_random_passes(&f, d, &params, 2, 4);
    assert_int_equal(trip_reader_create(&r, d, &params, f.budget), TRIP_OK);
    select_all(&s, d, 1, true);
    assert_int_equal(trip_reader_begin(r, &(trip_pass){ &s, 1, s.descending, NULL }), TRIP_OK);
    while (trip_reader_next(r, &batch) == 1) {
        bool own = false;
        for (int i = 0; i < 3; i++)
            own |= batch.planes[0] == memory[i] &&
                   batch.planes[1] == (unsigned char *)memory[i] + batch.plane_bytes[0] &&
                   batch.plane_bytes[0] + batch.plane_bytes[1] <= 2 * SLOT_BYTES;
        assert_true(own);
        trip_reader_release(r, &batch);
    }
    trip_selection_destroy(&s, f.budget);
    trip_reader_destroy(r);
    for (int i = 0; i < 3; i++)
        free(memory[i]);
    close_fixture(&f, d);
}

static void the_probe_finds_memory_that_reads_do_not_reach(void **state)
{
    fixture f;
    trip_dataset *d;
    (void)state;
    open_fixture(&f, &d);
    bool uring = uring_works(d);
    void *memory = mmap(NULL, 4096, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    assert_ptr_not_equal(memory, MAP_FAILED);
    fixture_catch_reports();
    for (int engine = TRIP_ENGINE_AUTO; engine <= TRIP_ENGINE_NULL; engine++) {
        if (engine == TRIP_ENGINE_URING && !uring)
            continue;
        assert_true(trip_reader_probe(d, (trip_engine)engine, memory));
        mprotect(memory, 4096, PROT_READ);
        assert_false(trip_reader_probe(d, (trip_engine)engine, memory));
        mprotect(memory, 4096, PROT_READ | PROT_WRITE);
    }
    fixture_run_command("printf x | dd of=%s/x0.voxels bs=1 seek=99 conv=notrunc 2>/dev/null",
                        f.path);
    /* The read does not return the page. */
    assert_false(trip_reader_probe(d, TRIP_ENGINE_PREAD, memory));
    assert_string_equal(fixture_reports(), "");
    munmap(memory, 4096);
    close_fixture(&f, d);
}

/* Counts the calls and skips no brick. */
static bool count_calls(void *user, const trip_selection *s, const trip_run *run)
{
    (void)s;
    (void)run;
    ++*(unsigned *)user;
    return false;
}

static void a_data_set_in_memory_is_returned_in_place(void **state)
{
    fixture f;
    trip_dataset *d;
    trip_reader *r;
    trip_selection s;
    trip_batch batch, next;
    unsigned calls = 0;
    (void)state;
    open_fixture(&f, &d);
    trip_reader_params params = { .engine = TRIP_ENGINE_NULL,
                                  .slots = 3,
                                  .slot_bytes = 4096,
                                  .planes = 1u << TRIP_PLANE_NORMALS,
                                  .skip = count_calls,
                                  .skip_user = &calls };
    assert_int_equal(trip_reader_create(&r, d, &params, f.budget), TRIP_OK);
    assert_int_equal(calls, 0);
    select_all(&s, d, 1, false);
    assert_int_equal(trip_reader_begin(r, &(trip_pass){ &s, 1, s.descending, NULL }), TRIP_OK);
    assert_int_equal(trip_reader_next(r, &batch), 1);
    unsigned first = calls;
    assert_int_equal(trip_reader_next(r, &next), 1);
    assert_true(calls > first); /* the reader asks late, when more bricks may be occluded */
    for (int plane = 0; plane < 2; plane++) { /* two batches may share a page */
        size_t bytes = (size_t)(next.planes[plane] - batch.planes[plane]);
        assert_true(bytes > 0 && bytes <= batch.plane_bytes[plane]);
    }
    const unsigned char *voxels = batch.planes[0];
    trip_reader_release(r, &next);
    trip_reader_release(r, &batch);
    assert_int_equal(trip_reader_begin(r, &(trip_pass){ &s, 1, s.descending, NULL }), TRIP_OK);
    assert_int_equal(trip_reader_next(r, &batch), 1);
    assert_ptr_equal(batch.planes[0], voxels);
    assert_int_equal(trip_reader_get_stats(r).bytes_read, 0);
    trip_reader_release(r, &batch);
    trip_reader_destroy(r);
    trip_selection_destroy(&s, f.budget);
    close_fixture(&f, d);
}

/* Posts the semaphore after each read. */
static long post_read(void *user, void *data, uint64_t offset, size_t bytes, long result)
{
    (void)data;
    (void)offset;
    (void)bytes;
    sem_post(user);
    return result;
}

static void a_pass_is_read_while_the_previous_pass_is_drawn(void **state)
{
    fixture f;
    trip_dataset *d;
    trip_reader *r;
    trip_selection s[3];
    trip_batch batch;
    sem_t reads;
    uint64_t bytes;
    (void)state;
    open_fixture(&f, &d);
    sem_init(&reads, 0, 0);
    trip_reader_params params = { .slots = 3, .fault = post_read, .fault_user = &reads };
    assert_int_equal(trip_reader_create(&r, d, &params, f.budget), TRIP_OK);
    for (int i = 0; i < 3; i++)
        select_all(&s[i], d, i, i == 1);
    const trip_pass passes[3] = { trip_pass_of(&s[0]), trip_pass_of(&s[1]), trip_pass_of(&s[2]) };
    assert_int_equal(trip_reader_begin(r, &passes[0]), TRIP_OK);
    assert_int_equal(trip_reader_then(r, &passes[1]), TRIP_OK);
    assert_int_equal(trip_reader_then(r, &passes[2]), TRIP_OK);
    assert_int_equal(trip_reader_next(r, &batch), 1);
    assert_ptr_equal(batch.pass, &passes[0]);
    for (int i = 0; i < 3; i++) /* every list fits a slot; the first slot is still held */
        sem_wait(&reads);
    trip_reader_release(r, &batch);
    bytes = d->lists[0].plane_bytes[0];
    for (int i = 1; i < 3; i++) {
        assert_int_equal(trip_reader_next(r, &batch), 1);
        assert_ptr_equal(batch.pass, &passes[i]);
        bytes += d->lists[i].plane_bytes[0];
        assert_int_equal(trip_reader_get_stats(r).bytes_read, bytes);
        trip_reader_release(r, &batch);
    }
    assert_int_equal(trip_reader_next(r, &batch), 0);
    trip_reader_destroy(r);
    for (int i = 0; i < 3; i++)
        trip_selection_destroy(&s[i], f.budget);
    sem_destroy(&reads);
    close_fixture(&f, d);
}

static void runs_only_passes_read_nothing(void **state)
{
    fixture f;
    trip_dataset *d;
    trip_reader *r;
    trip_selection s;
    trip_batch batch;
    trip_run run;
    sem_t reads;
    int ended;
    (void)state;
    open_fixture(&f, &d);
    sem_init(&reads, 0, 0);
    trip_reader_params params = {
        .planes = 3, .slots = 3, .fault = post_read, .fault_user = &reads
    };
    fixture_voxel *out = calloc(f.count, sizeof *out);
    size_t n;
    assert_int_equal(trip_reader_create(&r, d, &params, f.budget), TRIP_OK);
    select_all(&s, d, 1, true);
    trip_run_iterator it = trip_run_begin(&s);
    trip_reader_set_runs_only(r, true);
    assert_int_equal(trip_reader_begin(r, &(trip_pass){ &s, 1, s.descending, NULL }), TRIP_OK);
    while (trip_reader_next(r, &batch) == 1) {
        assert_null(batch.planes[0]);
        assert_null(batch.planes[1]);
        for (size_t i = 0; i < batch.run_count; i++) { /* a slot holds whole runs */
            assert_true(trip_run_next(&it, &run));
            assert_int_equal(batch.runs[i].brick, run.brick);
            assert_int_equal(batch.runs[i].sheet, run.sheet);
            assert_int_equal(batch.runs[i].count, run.count);
        }
        trip_reader_release(r, &batch);
    }
    assert_false(trip_run_next(&it, &run));
    assert_int_equal(trip_reader_get_stats(r).bytes_read, 0);
    assert_int_equal(trip_reader_get_stats(r).splats, f.count);
    sem_getvalue(&reads, &ended);
    assert_int_equal(ended, 0);
    trip_reader_set_runs_only(r, false);
    assert_int_equal(read_pass(r, &s, 0, out, &n), 0);
    assert_int_equal(n, f.count);
    trip_selection_destroy(&s, f.budget);
    trip_reader_destroy(r);
    sem_destroy(&reads);
    free(out);
    close_fixture(&f, d);
}

static void too_many_passes_are_refused(void **state)
{
    fixture f;
    trip_dataset *d;
    trip_reader *r;
    trip_selection s;
    (void)state;
    open_fixture(&f, &d);
    assert_int_equal(trip_reader_create(&r, d, &(trip_reader_params){ 0 }, f.budget), TRIP_OK);
    select_all(&s, d, 0, false);
    const trip_pass pass = trip_pass_of(&s);
    assert_int_equal(trip_reader_begin(r, NULL), TRIP_OK);
    for (int i = 0; i < TRIP_READER_PASSES_MAX; i++)
        assert_int_equal(trip_reader_then(r, &pass), TRIP_OK);
    fixture_catch_reports();
    assert_int_equal(trip_reader_then(r, &pass), TRIP_ERROR);
    assert_non_null(strstr(fixture_reports(), "passes"));
    trip_reader_destroy(r);
    trip_selection_destroy(&s, f.budget);
    close_fixture(&f, d);
}

/* A fault in the read of a pass that `countdown` reads precede. */
typedef struct sabotage {
    _Atomic int countdown;
    enum { FAIL_EIO, FAIL_END, FAIL_BYTE, FAIL_EINVAL, FAIL_SHORT } kind;
} sabotage;

static long sabotage_read(void *user, void *data, uint64_t offset, size_t bytes, long result)
{
    sabotage *s = user;
    (void)offset;
    (void)bytes;
    if (s->countdown-- != 0)
        return result;
    if (s->kind == FAIL_BYTE && result > 100)
        ((unsigned char *)data)[result - 77] ^= 16;
    return s->kind == FAIL_EIO      ? -EIO
           : s->kind == FAIL_END    ? 0
           : s->kind == FAIL_EINVAL ? -EINVAL
           : s->kind == FAIL_SHORT  ? result / 3
                                    : result;
}

static void check_sabotage(const fixture *f, const trip_dataset *d, trip_engine engine, int kind,
                           const char *why)
{
    trip_reader *r;
    trip_selection s;
    size_t n, n_after;
    sabotage fault = { .kind = kind };
    fixture_voxel *out = calloc(f->count, sizeof *out);
    trip_reader_params params = { .engine = engine,
                                  .planes = 3,
                                  .slots = 4,
                                  .slot_bytes = 8192,
                                  .fault = sabotage_read,
                                  .cache_bytes = 65536,
                                  .fault_user = &fault };
    fault.countdown = -1;
    assert_int_equal(trip_reader_create(&r, d, &params, f->budget), TRIP_OK);
    select_all(&s, d, 2, false);
    for (int at = 0; at < 40; at += 13) {
        fault.countdown = at;
        fixture_catch_reports();
        int status = read_pass(r, &s, 1, out, &n);
        assert_int_equal(status, TRIP_ERROR);
        /* The batches before the fault are correct. */
        assert_memory_equal(out, f->lists[2], n * sizeof *out);
        trip_batch batch;
        assert_int_equal(trip_reader_next(r, &batch), TRIP_ERROR);
        const char *reports = fixture_reports();
        assert_non_null(strstr(reports, "/z0."));
        assert_non_null(strstr(reports, why));
        assert_int_equal(strchr(reports, '\n')[1], 0);
        assert_int_equal(read_pass(r, &s, 0, out, &n_after), 0); /* the next pass is complete */
        assert_int_equal(n_after, f->count);
        assert_memory_equal(out, f->lists[2], n_after * sizeof *out);
    }
    trip_selection_destroy(&s, f->budget);
    trip_reader_destroy(r);
    free(out);
}

static void a_failed_read_ends_the_pass_with_one_line(void **state)
{
    fixture f;
    trip_dataset *d;
    (void)state;
    open_fixture(&f, &d);
    for (int engine = TRIP_ENGINE_URING; engine <= TRIP_ENGINE_PREAD; engine++) {
        if (engine == TRIP_ENGINE_URING && !uring_works(d))
            continue;
        check_sabotage(&f, d, (trip_engine)engine, FAIL_EIO, "Input/output error");
        check_sabotage(&f, d, (trip_engine)engine, FAIL_END, "ends early");
        check_sabotage(&f, d, (trip_engine)engine, FAIL_BYTE, "damaged (checksum)");
    }
    close_fixture(&f, d);
}

static void run_backwards(void *user, void (*task)(void *context, unsigned number), void *context,
                          unsigned count)
{
    unsigned *max = user;
    *max = count > *max ? count : *max;
    while (count-- > 0)
        task(context, count);
}

/* Stores the report of a pass in which blocks contradict some bricks of the index. */
static void report_of_pass(const fixture *f, trip_dataset *d, trip_task_runner runner, char *report,
                           size_t room)
{
    const trip_reader_params params = { .planes = 3, .runner = runner };
    fixture_voxel *out = calloc(f->count, sizeof *out);
    trip_reader *r;
    trip_selection s;
    size_t n;
    assert_int_equal(trip_reader_create(&r, d, &params, f->budget), TRIP_OK);
    select_all(&s, d, 2, false);
    fixture_catch_reports();
    assert_int_equal(read_pass(r, &s, 0, out, &n), TRIP_ERROR);
    snprintf(report, room, "%s", fixture_reports());
    assert_non_null(strstr(report, "outside its brick's range"));
    trip_selection_destroy(&s, f->budget);
    trip_reader_destroy(r);
    free(out);
}

/* The second and the last brick of the Z list have codes outside their ranges. */
static void the_first_faulty_block_is_reported_by_any_checker(void **state)
{
    fixture f;
    trip_dataset *d;
    char alone[1024], by_others[1024];
    unsigned tasks = 0;
    (void)state;
    open_fixture(&f, &d);
    trip_file_brick *bricks = (trip_file_brick *)(uintptr_t)d->lists[2].bricks;
    const uint64_t last = d->lists[2].brick_count - 1;
    bricks[1].code_max--;
    bricks[last].code_max--;
    report_of_pass(&f, d, (trip_task_runner){ 0 }, alone, sizeof alone);
    report_of_pass(&f, d, (trip_task_runner){ run_backwards, &tasks }, by_others, sizeof by_others);
    assert_true(tasks > 1);
    assert_string_equal(alone, by_others);
    bricks[1].code_max++;
    report_of_pass(&f, d, (trip_task_runner){ run_backwards, &tasks }, by_others, sizeof by_others);
    assert_string_not_equal(alone, by_others);
    close_fixture(&f, d);
}

/* A slot has two pieces of a file. The second piece has the fault. */
static void a_report_gives_the_file_offset_of_a_faulty_block(void **state)
{
    fixture f;
    trip_dataset *d;
    trip_reader *r;
    trip_selection s;
    trip_run run;
    trip_batch batch;
    char byte[64];
    (void)state;
    open_fixture(&f, &d);
    const uint64_t last = d->lists[2].brick_count - 1;
    trip_file_brick *brick = (trip_file_brick *)(uintptr_t)&d->lists[2].bricks[last];
    assert_int_equal(trip_selection_create(&s, d, &d->lists[2], false, 0, INT32_MAX, f.budget), 0);
    trip_selection_add(&s, last);
    trip_run_iterator it = trip_run_begin(&s);
    assert_true(trip_run_next(&it, &run) && run.sheet > 4);
    snprintf(byte, sizeof byte,
             "z0.voxels: byte %llu: ", (unsigned long long)run.at[TRIP_PLANE_VOXELS]);
    trip_selection_add(&s, 0);
    const trip_reader_params params = { .gap_bytes = 4096 };
    assert_int_equal(trip_reader_create(&r, d, &params, f.budget), TRIP_OK);
    const trip_pass pass = trip_pass_of(&s);
    brick->u_max = brick->u_min = brick->v_max = brick->v_min = 0;
    fixture_catch_reports();
    assert_int_equal(trip_reader_begin(r, &pass), TRIP_OK);
    assert_int_equal(trip_reader_next(r, &batch), TRIP_ERROR);
    assert_non_null(strstr(fixture_reports(), byte));
    trip_selection_destroy(&s, f.budget);
    trip_reader_destroy(r);
    close_fixture(&f, d);
}

static void refused_direct_reads_continue_through_the_page_cache(void **state)
{
    fixture f;
    trip_dataset *d;
    trip_reader *r;
    trip_selection s;
    size_t n;
    sabotage fault = { .kind = FAIL_EINVAL };
    (void)state;
    open_fixture(&f, &d);
    fixture_voxel *out = calloc(f.count, sizeof *out);
    assert_int_equal(
        trip_reader_create(
            &r, d, &(trip_reader_params){ .fault = sabotage_read, .fault_user = &fault }, f.budget),
        TRIP_OK);
    if (!strstr(trip_reader_engine_name(r), "O_DIRECT"))
        test_lacks("direct reads from this file system");
    select_all(&s, d, 0, false);
    if (strstr(trip_reader_engine_name(r), "O_DIRECT")) {
        assert_int_equal(read_pass(r, &s, 0, out, &n), 0);
        assert_int_equal(n, f.count);
        assert_null(strstr(trip_reader_engine_name(r), "O_DIRECT"));
    }
    trip_selection_destroy(&s, f.budget);
    trip_reader_destroy(r);
    free(out);
    close_fixture(&f, d);
}

/* The rest of a short read begins inside a sector, where the system refuses direct reads. */
static void a_short_direct_read_does_not_disable_direct_reads(void **state)
{
    fixture f;
    trip_dataset *d;
    trip_reader *r;
    trip_selection s;
    size_t n;
    sabotage fault = { .kind = FAIL_SHORT };
    (void)state;
    open_fixture(&f, &d);
    fixture_voxel *out = calloc(f.count, sizeof *out);
    const trip_reader_params params = { .planes = 3, .fault = sabotage_read, .fault_user = &fault };
    assert_int_equal(trip_reader_create(&r, d, &params, f.budget), TRIP_OK);
    const bool direct = strstr(trip_reader_engine_name(r), "O_DIRECT");
    if (!direct)
        test_lacks("direct reads from this file system");
    select_all(&s, d, 0, false);
    assert_int_equal(read_pass(r, &s, 0, out, &n), 0);
    assert_int_equal(n, f.count);
    assert_memory_equal(out, f.lists[0], n * sizeof *out);
    assert_true(fault.countdown < 0);
    assert_int_equal(strstr(trip_reader_engine_name(r), "O_DIRECT") != NULL, direct);
    trip_selection_destroy(&s, f.budget);
    trip_reader_destroy(r);
    free(out);
    close_fixture(&f, d);
}

static uint64_t read_bytes(trip_reader *r, const trip_selection *s, fixture_voxel *out)
{
    size_t n;
    assert_int_equal(read_pass(r, s, 1, out, &n), 0);
    return trip_reader_get_stats(r).bytes_read;
}

static void a_second_pass_reads_only_uncached_pages(void **state)
{
    fixture f;
    trip_dataset *d;
    trip_selection s;
    (void)state;
    open_fixture(&f, &d);
    fixture_voxel *out = calloc(f.count, sizeof *out);
    uint64_t whole = d->lists[1].plane_bytes[0], pages = (whole + 4095) / 4096;
    select_all(&s, d, 1, true);
    for (uint64_t cached = 0; cached <= pages + 1; cached += (pages + 1) / 4) {
        trip_reader *r;
        trip_reader_params params = { .cache_bytes = cached * 4096 }; /* a slot holds all */
        assert_int_equal(trip_reader_create(&r, d, &params, f.budget), TRIP_OK);
        assert_int_equal(read_bytes(r, &s, out), whole);
        for (int again = 0; again < 10; again++) {
            uint64_t left = cached >= pages ? 0 : whole - cached * 4096;
            uint64_t bytes = read_bytes(r, &s, out);
            /* The cache may hold the short last page. */
            assert_in_range(bytes, left, left ? left + 4096 : 0);
            assert_int_equal(trip_reader_get_stats(r).bytes_cached, whole - bytes);
        }
        trip_reader_destroy(r);
    }
    trip_selection_destroy(&s, f.budget);
    free(out);
    close_fixture(&f, d);
}

static void a_cache_adapts_when_other_lists_are_read(void **state)
{
    fixture f;
    trip_dataset *d;
    trip_reader *r;
    trip_selection x, y;
    (void)state;
    open_fixture(&f, &d);
    fixture_voxel *out = calloc(f.count, sizeof *out);
    trip_reader_params params = { .cache_bytes = d->lists[0].plane_bytes[0] + 4096 };
    assert_int_equal(trip_reader_create(&r, d, &params, f.budget), TRIP_OK);
    select_all(&x, d, 0, false);
    select_all(&y, d, 1, false);
    read_bytes(r, &x, out);
    assert_int_equal(read_bytes(r, &x, out), 0);
    for (int pass = 0; pass < 20; pass++)
        read_bytes(r, &y, out);
    assert_int_equal(read_bytes(r, &y, out), 0);
    trip_selection_destroy(&x, f.budget);
    trip_selection_destroy(&y, f.budget);
    trip_reader_destroy(r);
    free(out);
    close_fixture(&f, d);
}

/* Delays of a read and of a planning step. With slow planning, each read ends before the next plan.
 */
typedef struct pace {
    unsigned read_us, plan_us;
} pace;

static long pace_read(void *user, void *data, uint64_t offset, size_t bytes, long result)
{
    (void)data;
    (void)offset;
    (void)bytes;
    usleep(((pace *)user)->read_us);
    return result;
}

static bool pace_plan(void *user, const trip_selection *s, const trip_run *run)
{
    (void)s;
    (void)run;
    usleep(((pace *)user)->plan_us);
    return false;
}

/* Reads frames of two passes, one on each side of a sheet. Both passes share the pages at the
 * border. */
static void count_frames(const fixture *f, const trip_dataset *d, pace *speed, size_t cache_bytes,
                         trip_reader_stats stats[4])
{
    trip_reader *r;
    trip_selection sides[2];
    fixture_voxel *out = calloc(f->count, sizeof *out);
    size_t n;
    trip_reader_params params = { .slots = 3,
                                  .slot_bytes = 1, /* rounds up to the minimum */
                                  .planes = 3,
                                  .cache_bytes = cache_bytes,
                                  .skip = pace_plan,
                                  .skip_user = speed,
                                  .fault = pace_read,
                                  .fault_user = speed };
    assert_int_equal(trip_reader_create(&r, d, &params, f->budget), TRIP_OK);
    for (int frame = 0; frame < 4; frame++) {
        for (int side = 0; side < 2; side++) {
            const trip_list *list = &d->lists[frame % 2];
            int status = trip_selection_create(&sides[side], d, list, side, side ? 0 : 33,
                                               side ? 32 : INT32_MAX, f->budget);
            assert_int_equal(status, TRIP_OK);
            for (uint64_t b = 0; b < list->brick_count; b++)
                trip_selection_add(&sides[side], b);
        }
        assert_int_equal(read_passes(r, sides, 2, 0, out, &n), 0);
        assert_int_equal(n, f->count);
        stats[frame] = trip_reader_get_stats(r);
        for (int side = 0; side < 2; side++)
            trip_selection_destroy(&sides[side], f->budget);
    }
    trip_reader_destroy(r);
    free(out);
}

static void byte_counts_do_not_depend_on_read_times(void **state)
{
    fixture f;
    trip_dataset *d;
    pace slow_reads = { 1500, 0 }, slow_plans = { 0, 100 };
    trip_reader_stats a[4], b[4];
    (void)state;
    open_fixture(&f, &d);
    for (int i = 0; i < 2; i++) {
        size_t cache_bytes = i ? 8 << 20 : 100000; /* holds both lists, or part of one list */
        count_frames(&f, d, &slow_reads, cache_bytes, a);
        count_frames(&f, d, &slow_plans, cache_bytes, b);
        for (int frame = 0; frame < 4; frame++) {
            assert_int_equal(a[frame].bytes_read, b[frame].bytes_read);
            assert_int_equal(a[frame].bytes_cached, b[frame].bytes_cached);
            assert_true((a[frame].bytes_cached > 0) == (i ? frame >= 2 : frame == 2));
            assert_true((a[frame].bytes_read > 0) == (frame < 2 || i == 0));
        }
    }
    close_fixture(&f, d);
}

/* Counts the reads of each page of a file. */
typedef struct page_counts {
    _Atomic unsigned times[4096];
} page_counts;

static long count_pages(void *user, void *data, uint64_t offset, size_t bytes, long result)
{
    (void)data;
    for (size_t at = 0; at < bytes; at += 4096)
        ((page_counts *)user)->times[(offset + at) / 4096]++;
    return result;
}

static void check_pages_once(const fixture *f, const trip_dataset *d, unsigned slots)
{
    trip_reader *r;
    static page_counts counts;
    uint64_t state = slots;
    fixture_voxel *out = calloc(f->count, sizeof *out), *wanted = calloc(f->count, sizeof *out);
    size_t n;
    trip_reader_params params = { .slots = slots,
                                  .slot_bytes = 1, /* rounds up to the minimum */
                                  .gap_bytes = 4096,
                                  .fault = count_pages,
                                  .fault_user = &counts };
    assert_int_equal(trip_reader_create(&r, d, &params, f->budget), TRIP_OK);
    for (int i = 0; i < 12; i++) {
        trip_selection s;
        memset(&counts, 0, sizeof counts);
        select_some(&s, d, &state);
        assert_int_equal(read_pass(r, &s, slots / 2, out, &n), 0);
        assert_int_equal(n, expect(f, &s, wanted));
        for (size_t k = 0; k < n; k++)
            wanted[k].normal = 0;
        assert_memory_equal(out, wanted, n * sizeof *out);
        for (int page = 0; page < 4096; page++)
            assert_true(counts.times[page] <= 1);
        trip_selection_destroy(&s, f->budget);
    }
    trip_reader_destroy(r);
    free(out);
    free(wanted);
}

static void pages_at_the_borders_of_slots_are_read_once(void **state)
{
    fixture f;
    trip_dataset *d;
    (void)state;
    open_fixture(&f, &d);
    fixture_voxel *out = calloc(f.count, sizeof *out);
    for (unsigned slots = 2; slots <= 8; slots += 3)
        check_pages_once(&f, d, slots);
    for (int i = 0; i < 6; i++) { /* both planes of all lists, in both directions */
        trip_reader *r;
        trip_selection s;
        trip_reader_params params = { .slots = 3, .slot_bytes = 1, .planes = 3 };
        assert_int_equal(trip_reader_create(&r, d, &params, f.budget), TRIP_OK);
        select_all(&s, d, i / 2, i % 2);
        assert_int_equal(read_bytes(r, &s, out),
                         d->lists[i / 2].plane_bytes[0] + d->lists[i / 2].plane_bytes[1]);
        trip_selection_destroy(&s, f.budget);
        trip_reader_destroy(r);
    }
    free(out);
    close_fixture(&f, d);
}

static bool skip_odd(void *user, const trip_selection *s, const trip_run *run)
{
    (void)s;
    ++*(int *)user;
    return run->brick % 2;
}

static void skipped_bricks_are_left_out_and_counted(void **state)
{
    fixture f;
    trip_dataset *d;
    trip_reader *r;
    trip_selection s;
    int calls = 0;
    size_t n;
    (void)state;
    open_fixture(&f, &d);
    fixture_voxel *out = calloc(f.count, sizeof *out);
    fixture_voxel *wanted = calloc(f.count, sizeof *out);
    trip_reader_params params = { .skip = skip_odd, .skip_user = &calls, .planes = 3 };
    assert_int_equal(trip_reader_create(&r, d, &params, f.budget), TRIP_OK);
    select_all(&s, d, 2, true);
    assert_int_equal(read_pass(r, &s, 0, out, &n), 0);
    assert_true(calls > 0);
    uint64_t skipped = 0;
    for (uint64_t b = 1; b < d->lists[2].brick_count; b += 2) {
        s.bricks[b / 64] &= ~(UINT64_C(1) << b % 64);
        for (uint32_t sheet = 0; sheet < d->header.slab_sheets; sheet++)
            skipped += 8 * (uint64_t)d->lists[2].runs[b * d->header.slab_sheets + sheet].words;
        skipped += 4 * (uint64_t)d->lists[2].bricks[b].records;
    }
    assert_int_equal(n, expect(&f, &s, wanted));
    assert_memory_equal(out, wanted, n * sizeof *out);
    trip_reader_stats stats = trip_reader_get_stats(r);
    assert_int_equal(stats.splats, n);
    assert_int_equal(stats.bytes_skipped, skipped);
    trip_selection_destroy(&s, f.budget);
    trip_reader_destroy(r);
    free(out);
    free(wanted);
    close_fixture(&f, d);
}

static void only_small_gaps_are_read_through(void **state)
{
    fixture f;
    trip_dataset *d;
    (void)state;
    open_fixture(&f, &d);
    fixture_voxel *out = calloc(f.count, sizeof *out);
    uint64_t bytes[2];
    for (int i = 0; i < 2; i++) {
        trip_reader *r;
        trip_selection s;
        trip_reader_params params = { .gap_bytes = i ? 1 << 20 : 4096 };
        assert_int_equal(trip_reader_create(&r, d, &params, f.budget), TRIP_OK);
        assert_int_equal(trip_selection_create(&s, d, &d->lists[0], false, 0, INT32_MAX, f.budget),
                         TRIP_OK);
        trip_selection_add(&s, 0);
        trip_selection_add(&s, d->lists[0].brick_count - 1);
        bytes[i] = read_bytes(r, &s, out);
        trip_selection_destroy(&s, f.budget);
        trip_reader_destroy(r);
    }
    /* The two bricks at the ends of the list have a few kilobytes each. */
    uint64_t whole = d->lists[0].plane_bytes[0];
    assert_true(bytes[0] < whole / 4);
    assert_int_equal(bytes[1], whole);
    free(out);
    close_fixture(&f, d);
}

static void an_abandoned_pass_leaves_the_reader_ready(void **state)
{
    fixture f;
    trip_dataset *d;
    trip_reader *r;
    trip_selection s;
    trip_batch batch;
    size_t n;
    _Atomic uint64_t counter = 1;
    (void)state;
    open_fixture(&f, &d);
    fixture_voxel *out = calloc(f.count, sizeof *out);
    trip_reader_params params = { .slot_bytes = 4096, .fault = disturb, .fault_user = &counter };
    assert_int_equal(trip_reader_create(&r, d, &params, f.budget), TRIP_OK);
    select_all(&s, d, 0, false);
    for (int i = 0; i < 5; i++) {
        assert_int_equal(trip_reader_begin(r, &(trip_pass){ &s, 1, s.descending, NULL }), TRIP_OK);
        for (int k = 0; k < i; k++) {
            assert_int_equal(trip_reader_next(r, &batch), 1);
            trip_reader_release(r, &batch);
        }
    }
    assert_int_equal(read_pass(r, &s, 0, out, &n), 0);
    assert_int_equal(n, f.count);
    assert_int_equal(trip_reader_begin(r, &(trip_pass){ &s, 1, s.descending, NULL }), TRIP_OK);
    trip_selection_destroy(&s, f.budget);
    trip_reader_destroy(r); /* reads still run */
    free(out);
    close_fixture(&f, d);
}

/* A gate at which reads wait. After GATE_SECONDS it opens by itself and has failed. */
typedef struct gate {
    pthread_mutex_t lock;
    pthread_cond_t changed;
    unsigned waiting, times_opened;
    bool open, failed;
    int kind; /* outcome of reads that waited: 0, FLIP_A_BIT or an errno value */
} gate;

enum { GATE_SECONDS = 20, FLIP_A_BIT = -1 };

static void wait_at(gate *g)
{
    struct timespec until;
    clock_gettime(CLOCK_REALTIME, &until);
    until.tv_sec += GATE_SECONDS;
    g->waiting++;
    pthread_cond_broadcast(&g->changed);
    for (unsigned before = g->times_opened; g->times_opened == before && !g->failed;)
        g->failed = pthread_cond_timedwait(&g->changed, &g->lock, &until) != 0;
}

static long pass_gate(void *user, void *data, uint64_t offset, size_t bytes, long result)
{
    gate *g = user;
    (void)offset;
    (void)bytes;
    pthread_mutex_lock(&g->lock);
    bool waits = !g->open;
    int kind = g->kind;
    if (waits)
        wait_at(g);
    pthread_mutex_unlock(&g->lock);
    if (waits && kind == FLIP_A_BIT && result > 0)
        ((unsigned char *)data)[result / 2] ^= 4;
    return waits && kind > 0 ? -kind : result;
}

static void close_gate(gate *g, int kind)
{
    pthread_mutex_lock(&g->lock);
    g->open = false;
    g->kind = kind;
    g->waiting = 0;
    pthread_mutex_unlock(&g->lock);
}

/* Waits until a read waits at the gate. */
static void meet_at_gate(gate *g)
{
    pthread_mutex_lock(&g->lock);
    while (!g->waiting)
        pthread_cond_wait(&g->changed, &g->lock);
    pthread_mutex_unlock(&g->lock);
}

/* Checks that no read passed the gate. Reads that arrive from here on have no fault. */
static void assert_closed(gate *g)
{
    pthread_mutex_lock(&g->lock);
    assert_false(g->open || g->failed);
    g->kind = 0;
    pthread_mutex_unlock(&g->lock);
}

static void *open_later(void *user)
{
    gate *g = user;
    usleep(20000);
    pthread_mutex_lock(&g->lock);
    g->open = true;
    g->times_opened++;
    pthread_cond_broadcast(&g->changed);
    pthread_mutex_unlock(&g->lock);
    return NULL;
}

/* Abandons two passes during their reads. Then reads a third pass to its end while the reads of the
 * first two still run. */
static void give_up_and_read(trip_reader *r, gate *g, const trip_selection *s, int kind,
                             const fixture *f, fixture_voxel *out)
{
    const trip_pass pass = trip_pass_of(&s[0]), other = trip_pass_of(&s[1]);
    pthread_t opener;
    size_t n;
    close_gate(g, kind);
    assert_int_equal(trip_reader_begin(r, &pass), TRIP_OK);
    meet_at_gate(g);
    assert_int_equal(trip_reader_begin(r, &other), TRIP_OK);
    assert_false(trip_reader_await(r, 0));
    assert_int_equal(trip_reader_begin(r, NULL), TRIP_OK);
    assert_true(trip_reader_await(r, 0)); /* no pass is left to wait for */
    assert_closed(g);
    assert_int_equal(pthread_create(&opener, NULL, open_later, g), 0);
    assert_int_equal(read_pass(r, s, 1, out, &n), 0);
    assert_int_equal(n, f->count);
    assert_memory_equal(out, f->lists[s->list->axis], n * sizeof *out);
    assert_int_equal(trip_reader_get_stats(r).splats, n);
    pthread_join(opener, NULL);
}

static void check_giving_up(const fixture *f, const trip_dataset *d, trip_reader_params params,
                            int kind)
{
    gate g = { PTHREAD_MUTEX_INITIALIZER, PTHREAD_COND_INITIALIZER, .kind = kind };
    trip_reader *r;
    trip_selection s[3];
    pthread_t opener;
    fixture_voxel *out = calloc(f->count, sizeof *out);
    params.planes = 3;
    params.fault = pass_gate;
    params.fault_user = &g;
    for (int axis = 0; axis < 3; axis++)
        select_all(&s[axis], d, axis, false);
    fixture_catch_reports();
    assert_int_equal(trip_reader_create(&r, d, &params, f->budget), TRIP_OK);
    for (int first = 0; first < 2; first++) /* a list with no page in the cache */
        give_up_and_read(r, &g, &s[first], kind, f, out);
    assert_string_equal(fixture_reports(), "");
    const trip_pass pass = trip_pass_of(&s[2]);
    close_gate(&g, 0);
    assert_int_equal(trip_reader_begin(r, &pass), TRIP_OK);
    meet_at_gate(&g);
    assert_int_equal(pthread_create(&opener, NULL, open_later, &g), 0);
    trip_reader_destroy(r); /* waits for the reads into its memory */
    pthread_join(opener, NULL);
    assert_false(g.failed);
    for (int axis = 0; axis < 3; axis++)
        trip_selection_destroy(&s[axis], f->budget);
    free(out);
}

/* The reader must not write to the caller's memory once it is destroyed. */
static void check_giving_up_in_place(const fixture *f, const trip_dataset *d, trip_engine engine)
{
    void *memory[4];
    size_t bytes = trip_reader_slot_bytes(d, 3, 1);
    for (int i = 0; i < 4; i++)
        memory[i] = aligned_alloc(4096, bytes);
    const trip_reader_params params = {
        .engine = engine, .slots = 4, .slot_bytes = bytes, .slot_memory = memory
    };
    check_giving_up(f, d, params, 0);
    for (int i = 0; i < 4; i++)
        free(memory[i]);
}

static void abandoning_a_pass_waits_for_no_read(void **state)
{
    fixture f;
    trip_dataset *d;
    (void)state;
    open_fixture(&f, &d);
    bool uring = uring_works(d);
    const int kinds[] = { 0, EIO, FLIP_A_BIT };
    for (int i = 0; i < 18; i++) {
        trip_reader_params params = { .engine = i % 2 ? TRIP_ENGINE_PREAD : TRIP_ENGINE_URING,
                                      .slots = i % 3 ? 3 : 8,
                                      .slot_bytes = 1, /* rounds up to the minimum */
                                      .cache_bytes = i / 2 % 3 == 0   ? 0
                                                     : i / 2 % 3 == 1 ? 300000
                                                                      : 8 << 20 };
        if (uring || params.engine != TRIP_ENGINE_URING)
            check_giving_up(&f, d, params, kinds[i / 6]);
    }
    check_giving_up_in_place(&f, d, TRIP_ENGINE_PREAD);
    if (uring)
        check_giving_up_in_place(&f, d, TRIP_ENGINE_URING);
    close_fixture(&f, d);
}

/* Abandons passes at random. Reads every seventh pass to its end and compares it. */
static void check_random_giving_up(const fixture *f, const trip_dataset *d,
                                   const trip_reader_params *params)
{
    trip_reader *r;
    uint64_t state = 77;
    size_t n;
    fixture_voxel *wanted = calloc(f->count, sizeof *wanted), *got = calloc(f->count, sizeof *got);
    assert_int_equal(trip_reader_create(&r, d, params, f->budget), TRIP_OK);
    for (int i = 0; i < 150; i++) {
        trip_selection s;
        trip_batch batch;
        select_some(&s, d, &state);
        const trip_pass pass = trip_pass_of(&s);
        if (i % 7 == 6) {
            size_t n_wanted = expect(f, &s, wanted);
            assert_int_equal(read_pass(r, &s, 1, got, &n), 0);
            assert_int_equal(n, n_wanted);
            assert_memory_equal(got, wanted, n * sizeof *got);
        } else {
            assert_int_equal(trip_reader_begin(r, &pass), TRIP_OK);
            for (uint64_t k = fixture_random(&state) % 4; k > 0; k--)
                if (trip_reader_next(r, &batch) == 1)
                    trip_reader_release(r, &batch);
            assert_int_equal(trip_reader_begin(r, NULL), TRIP_OK);
        }
        trip_selection_destroy(&s, f->budget);
    }
    trip_reader_destroy(r);
    free(wanted);
    free(got);
}

static void passes_after_abandoned_passes_are_complete(void **state)
{
    fixture f;
    trip_dataset *d;
    (void)state;
    open_fixture(&f, &d);
    bool uring = uring_works(d);
    for (int i = 0; i < 8; i++) {
        _Atomic uint64_t counter = (uint64_t)i;
        trip_reader_params params = { .engine = i % 2 ? TRIP_ENGINE_PREAD : TRIP_ENGINE_URING,
                                      .planes = 3,
                                      .slots = i % 3 ? 8 : 2,
                                      .slot_bytes = 1, /* rounds up to the minimum */
                                      .cache_bytes = i / 2 ? (size_t)100000 << i : 0,
                                      .fault = disturb,
                                      .fault_user = &counter };
        if (uring || params.engine != TRIP_ENGINE_URING)
            check_random_giving_up(&f, d, &params);
    }
    close_fixture(&f, d);
}

static void holding_every_slot_is_an_error(void **state)
{
    fixture f;
    trip_dataset *d;
    trip_reader *r;
    trip_selection s;
    trip_batch batches[3];
    (void)state;
    open_fixture(&f, &d);
    trip_reader_params params = { .slot_bytes = 4096, .slots = 2 };
    assert_int_equal(trip_reader_create(&r, d, &params, f.budget), TRIP_OK);
    select_all(&s, d, 0, false);
    assert_int_equal(trip_reader_begin(r, &(trip_pass){ &s, 1, s.descending, NULL }), TRIP_OK);
    assert_int_equal(trip_reader_next(r, &batches[0]), 1);
    assert_int_equal(trip_reader_next(r, &batches[1]), 1);
    fixture_catch_reports();
    assert_int_equal(trip_reader_next(r, &batches[2]), TRIP_ERROR);
    fixture_reports();
    trip_reader_release(r, &batches[0]);
    trip_reader_release(r, &batches[1]);
    trip_selection_destroy(&s, f.budget);
    trip_reader_destroy(r);
    close_fixture(&f, d);
}

static void parameters_out_of_range_are_refused(void **state)
{
    fixture f;
    trip_dataset *d;
    trip_reader *r;
    trip_budget *small;
    trip_reader_params bad[] = {
        { .slots = 1 }, { .slots = 5000 }, { .slot_bytes = (1 << 30) + 1 }, { .planes = 4 }
    };
    (void)state;
    open_fixture(&f, &d);
    fixture_catch_reports();
    for (int i = 0; i < 4; i++)
        assert_true(trip_reader_create(&r, d, &bad[i], f.budget) < 0);
    assert_int_equal(trip_budget_create(&small, 1 << 20), TRIP_OK);
    assert_true(trip_reader_create(&r, d, &(trip_reader_params){ 0 }, small) < 0);
    assert_true(trip_reader_create(
                    &r, d,
                    &(trip_reader_params){
                        .slots = 2, .slot_bytes = 4096, .planes = 3, .engine = TRIP_ENGINE_NULL },
                    small) < 0);
    assert_non_null(strstr(fixture_reports(), "raise --memory"));
    trip_budget_destroy(small);
    close_fixture(&f, d);
}

/* Makes the kernel refuse io_uring from here on, as filters of containers do. */
static void refuse_uring(void)
{
    struct sock_filter code[] = {
        BPF_STMT(BPF_LD | BPF_W | BPF_ABS, 0 /* number of the system call */),
        BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, SYS_io_uring_setup, 0, 1),
        BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ERRNO | EPERM),
        BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW),
    };
    struct sock_fprog filter = { .len = 4, .filter = code };
    if (prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) < 0 ||
        prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &filter) < 0)
        _exit(77);
}

static int read_without_uring(const fixture *f, const trip_dataset *d)
{
    trip_reader *r;
    refuse_uring();
    fixture_catch_reports();
    if (trip_reader_create(&r, d, &(trip_reader_params){ .engine = TRIP_ENGINE_URING },
                           f->budget) == TRIP_OK)
        return 1;
    if (!strstr(fixture_reports(), "the system refuses io_uring"))
        return 2;
    if (trip_reader_create(&r, d, &(trip_reader_params){ 0 }, f->budget) < 0)
        return 3;
    int status = strncmp(trip_reader_engine_name(r), "pread", 5) ? 4 : 0;
    trip_reader_destroy(r);
    check_random_passes(f, d, &(trip_reader_params){ 0 }, 1, 2);
    return status;
}

static void threads_read_if_io_uring_is_refused(void **state)
{
    fixture f;
    trip_dataset *d;
    int status;
    (void)state;
    open_fixture(&f, &d);
    pid_t child = fork();
    if (child == 0)
        _exit(read_without_uring(&f, d));
    waitpid(child, &status, 0);
    close_fixture(&f, d);
    if (WEXITSTATUS(status) == 77) {
        print_message("skipped: system call filters are not allowed here\n");
        skip();
    }
    assert_int_equal(status, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_engine_and_ring_returns_the_same_runs),
        cmocka_unit_test(gaps_may_be_small_in_one_plane_and_large_in_another),
        cmocka_unit_test(the_reader_reads_into_memory_of_the_caller),
        cmocka_unit_test(the_probe_finds_memory_that_reads_do_not_reach),
        cmocka_unit_test(a_pass_is_read_while_the_previous_pass_is_drawn),
        cmocka_unit_test(runs_only_passes_read_nothing),
        cmocka_unit_test(too_many_passes_are_refused),
        cmocka_unit_test(a_failed_read_ends_the_pass_with_one_line),
        cmocka_unit_test(the_first_faulty_block_is_reported_by_any_checker),
        cmocka_unit_test(a_report_gives_the_file_offset_of_a_faulty_block),
        cmocka_unit_test(refused_direct_reads_continue_through_the_page_cache),
        cmocka_unit_test(a_short_direct_read_does_not_disable_direct_reads),
        cmocka_unit_test(a_second_pass_reads_only_uncached_pages),
        cmocka_unit_test(a_data_set_in_memory_is_returned_in_place),
        cmocka_unit_test(a_cache_adapts_when_other_lists_are_read),
        cmocka_unit_test(byte_counts_do_not_depend_on_read_times),
        cmocka_unit_test(pages_at_the_borders_of_slots_are_read_once),
        cmocka_unit_test(skipped_bricks_are_left_out_and_counted),
        cmocka_unit_test(only_small_gaps_are_read_through),
        cmocka_unit_test(an_abandoned_pass_leaves_the_reader_ready),
        cmocka_unit_test(abandoning_a_pass_waits_for_no_read),
        cmocka_unit_test(passes_after_abandoned_passes_are_complete),
        cmocka_unit_test(holding_every_slot_is_an_error),
        cmocka_unit_test(parameters_out_of_range_are_refused),
        cmocka_unit_test(threads_read_if_io_uring_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
