#include "bench_disk.h"

#include <errno.h>
#include <fcntl.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "bench_frame.h"
#include "report.h"

enum { READERS = 8, BLOCK_BYTES = 1 << 20, FILES = 3 * TRIP_PLANES };

/* One file at a time, its blocks shared out among threads. */
typedef struct job {
    int fd;
    uint64_t blocks;
    atomic_uint_fast64_t next;
    atomic_uint_fast64_t bytes;
    atomic_int error; /* errno of the first fault */
    unsigned char *memory;
    atomic_uint taken; /* parts of the memory */
} job;

bench_files bench_files_of_plan(const trip_plan *plan)
{
    bench_files files = 0;
    for (int axis = 0; axis < 3; axis++)
        for (int plane = 0; plane < TRIP_PLANES; plane++)
            if (plan->lists[axis].pass_count && plan->planes >> plane & 1)
                files |= 1u << (axis * TRIP_PLANES + plane);
    return files;
}

uint64_t bench_files_bytes(const session *s, bench_files files)
{
    uint64_t bytes = 0;
    for (int i = 0; i < FILES; i++)
        if (files >> i & 1)
            bytes += s->data->lists[i / TRIP_PLANES].splats * TRIP_RECORD_BYTES;
    return bytes;
}

void bench_files_forget(const session *s, bench_files files)
{
    for (int i = 0; i < FILES; i++)
        if (files >> i & 1)
            posix_fadvise(s->data->plane_fd[i / TRIP_PLANES][i % TRIP_PLANES], 0, 0,
                          POSIX_FADV_DONTNEED);
}

static void *read_blocks(void *argument)
{
    job *j = argument;
    unsigned char *block = j->memory + (size_t)BLOCK_BYTES * atomic_fetch_add(&j->taken, 1);
    uint64_t i;
    while ((i = atomic_fetch_add(&j->next, 1)) < j->blocks && !atomic_load(&j->error)) {
        ssize_t n = pread(j->fd, block, BLOCK_BYTES, (off_t)(i * BLOCK_BYTES));
        if (n < 0)
            atomic_store(&j->error, errno);
        else
            atomic_fetch_add(&j->bytes, (uint64_t)n);
    }
    return NULL;
}

static int read_file(job *j, const char *path)
{
    struct stat file;
    pthread_t threads[READERS];
    int started = 0, error = 0;
    if (fstat(j->fd, &file) != 0)
        return trip_fail_errno("read", path, NULL);
    j->blocks = ((uint64_t)file.st_size + BLOCK_BYTES - 1) / BLOCK_BYTES;
    atomic_store(&j->next, 0);
    atomic_store(&j->taken, 0);
    for (; started < READERS && !error; started += !error)
        error = pthread_create(&threads[started], NULL, read_blocks, j);
    for (int i = 0; i < started; i++)
        pthread_join(threads[i], NULL);
    errno = error ? error : atomic_load(&j->error);
    return errno ? trip_fail_errno("read", path, NULL) : 0;
}

/* With O_DIRECT, or without where that is refused. */
static int open_file(const char *path, bool *direct)
{
    int fd = open(path, O_RDONLY | O_CLOEXEC | O_DIRECT);
    if (fd < 0 && errno == EINVAL) {
        *direct = false;
        fd = open(path, O_RDONLY | O_CLOEXEC);
    }
    return fd < 0 ? trip_fail_errno("read", path, "cannot open") : fd;
}

static int read_plane(const session *s, int axis, int plane, job *j, bool *direct)
{
    char path[4096], name[32];
    if (snprintf(path, sizeof path, "%s/%s", s->data->path,
                 trip_dataset_plane_name(axis, plane, name)) >= (int)sizeof path)
        return trip_fail(TRIP_ERROR, "read", s->data->path, "the name is too long");
    j->fd = open_file(path, direct);
    if (j->fd < 0)
        return j->fd;
    int status = read_file(j, path);
    close(j->fd);
    return status;
}

/* The budget's memory is in large pages. */
static void *take_memory(const session *s, size_t bytes, bool large_pages)
{
    if (large_pages) {
        void *large = trip_budget_take(s->budget, bytes);
        return large ? memset(large, 0, bytes) : NULL;
    }
    if (!trip_budget_charge(s->budget, bytes))
        return NULL;
    void *memory = aligned_alloc(BLOCK_BYTES, bytes);
    if (memory)
        return memset(memory, 0, bytes);
    trip_budget_discharge(s->budget, bytes);
    return NULL;
}

static void release_memory(const session *s, void *memory, size_t bytes, bool large_pages)
{
    if (large_pages) {
        trip_budget_release(s->budget, memory, bytes);
        return;
    }
    free(memory);
    trip_budget_discharge(s->budget, bytes);
}

int bench_files_read(const session *s, bench_files files, bool large_pages, bench_disk_read *out)
{
    const size_t memory_bytes = (size_t)READERS * BLOCK_BYTES;
    job j = { .memory = take_memory(s, memory_bytes, large_pages) };
    int status = 0;
    if (!j.memory)
        return trip_fail(TRIP_ERROR, "bench", s->input,
                         "%zu bytes to read into do not fit the memory given; raise --memory",
                         memory_bytes);
    out->direct = true;
    double start = bench_now_ms();
    for (int i = 0; i < FILES && !status; i++)
        if (files >> i & 1)
            status = read_plane(s, i / TRIP_PLANES, i % TRIP_PLANES, &j, &out->direct);
    out->ms = bench_now_ms() - start;
    out->bytes = atomic_load(&j.bytes);
    release_memory(s, j.memory, memory_bytes, large_pages);
    return status;
}

static bool has_list(bench_files files, int axis)
{
    return files >> axis * TRIP_PLANES & ((1u << TRIP_PLANES) - 1);
}

static int select_list(const session *s, int axis, trip_selection *all)
{
    const trip_list *list = &s->data->lists[axis];
    int status = trip_selection_create(all, s->data, axis, false, 0, INT64_MAX, s->budget);
    for (uint64_t i = 0; i < list->brick_count && !status; i++)
        trip_selection_add(all, i);
    return status;
}

static int stream_lists(trip_reader *reader, const trip_selection lists[3], bench_files files)
{
    trip_batch batch;
    int status = trip_reader_begin(reader, NULL);
    for (int axis = 0; axis < 3 && !status; axis++)
        if (has_list(files, axis))
            status = trip_reader_then(reader, &lists[axis]);
    while (!status && (status = trip_reader_next(reader, &batch)) > 0) {
        trip_reader_release(reader, &batch);
        status =
            trip_interrupted() ? trip_fail(TRIP_INTERRUPTED, "bench", "lists", "interrupted") : 0;
    }
    return status;
}

int bench_files_stream(const session *s, bench_files files, trip_reader *reader,
                       bench_disk_read *out)
{
    trip_selection lists[3] = { 0 };
    int status = 0;
    for (int axis = 0; axis < 3 && !status; axis++)
        if (has_list(files, axis))
            status = select_list(s, axis, &lists[axis]);
    double start = bench_now_ms();
    if (!status)
        status = stream_lists(reader, lists, files);
    out->ms = bench_now_ms() - start;
    out->bytes = trip_reader_get_stats(reader).bytes_read;
    out->direct = strstr(trip_reader_engine_name(reader), "O_DIRECT");
    for (int axis = 0; axis < 3; axis++)
        trip_selection_destroy(&lists[axis], s->budget);
    return status;
}
