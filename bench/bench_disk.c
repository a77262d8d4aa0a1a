#include "bench_disk.h"

#include <assert.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "bench_frame.h"
#include "plain_disk.h"
#include "report.h"

enum { LISTS = 8, FILES = LISTS * TRIP_PLANES };
static_assert((int)FILES <= 32, "bench_files has a bit for each");

/* The first lists: level 0's come first. */
static int lists_of(const trip_dataset *data)
{
    return data->list_count < LISTS ? (int)data->list_count : LISTS;
}

bench_files bench_files_of_plan(const trip_dataset *data, const trip_plan *plan)
{
    bench_files files = 0;
    for (int i = 0; i < lists_of(data); i++)
        for (int plane = 0; plane < TRIP_PLANES; plane++)
            if (plan->lists[i].drawn && plan->layers[data->lists[i].axis].pass_count &&
                plan->planes & data->lists[i].planes & 1u << plane)
                files |= UINT32_C(1) << (i * TRIP_PLANES + plane);
    return files;
}

uint64_t bench_files_bytes(const session *s, bench_files files)
{
    uint64_t bytes = 0;
    for (int i = 0; i < FILES; i++)
        if (files >> i & 1)
            bytes += s->data->lists[i / TRIP_PLANES].plane_bytes[i % TRIP_PLANES];
    return bytes;
}

void bench_files_forget(const session *s, bench_files files)
{
    for (int i = 0; i < FILES; i++)
        if (files >> i & 1)
            posix_fadvise(s->data->lists[i / TRIP_PLANES].plane_fd[i % TRIP_PLANES], 0, 0,
                          POSIX_FADV_DONTNEED);
}

static int read_plane(const session *s, int list, int plane, plain_disk *d, void *memory)
{
    char path[4096], name[32];
    if (snprintf(path, sizeof path, "%s/%s", s->data->path,
                 trip_list_plane_name(&s->data->lists[list], plane, name)) >= (int)sizeof path)
        return trip_fail(TRIP_ERROR, "read", s->data->path, "the name is too long");
    return plain_disk_read(d, path, memory);
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
    void *memory = aligned_alloc(PLAIN_DISK_TRANSFER_BYTES, bytes);
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

int bench_files_read(const session *s, bench_files files, bench_plain how, bench_disk_read *out)
{
    plain_disk d = { .direct = true, .look = how == BENCH_PLAIN };
    bool large_pages = how != BENCH_PLAIN_SMALL;
    void *memory = take_memory(s, PLAIN_DISK_MEMORY_BYTES, large_pages);
    int status = 0;
    if (!memory)
        return trip_fail(TRIP_ERROR, "bench", s->input,
                         "%zu bytes to read into do not fit the memory given; raise --memory",
                         PLAIN_DISK_MEMORY_BYTES);
    for (int i = 0; i < FILES && !status; i++)
        if (files >> i & 1)
            status = read_plane(s, i / TRIP_PLANES, i % TRIP_PLANES, &d, memory);
    *out = (bench_disk_read){ d.seconds * 1e3, d.bytes, d.direct };
    release_memory(s, memory, PLAIN_DISK_MEMORY_BYTES, large_pages);
    return status;
}

static bool has_list(bench_files files, int list)
{
    return files >> list * TRIP_PLANES & ((1u << TRIP_PLANES) - 1);
}

static int stream_lists(trip_reader *reader, const trip_pass passes[LISTS], bench_files files)
{
    trip_batch batch;
    int status = trip_reader_begin(reader, NULL);
    for (int i = 0; i < LISTS && !status; i++)
        if (has_list(files, i))
            status = trip_reader_then(reader, &passes[i]);
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
    trip_selection lists[LISTS] = { 0 };
    trip_pass passes[LISTS];
    int status = 0;
    for (int i = 0; i < LISTS && !status; i++)
        if (has_list(files, i))
            status = trip_selection_create_whole(&lists[i], s->data, &s->data->lists[i], false,
                                                 s->budget);
    for (int i = 0; i < LISTS; i++)
        passes[i] = trip_pass_of(&lists[i]);
    double start = bench_now_ms();
    if (!status)
        status = stream_lists(reader, passes, files);
    out->ms = bench_now_ms() - start;
    out->bytes = trip_reader_get_stats(reader).bytes_read;
    out->direct = strstr(trip_reader_engine_name(reader), "O_DIRECT");
    for (int i = 0; i < LISTS; i++)
        trip_selection_destroy(&lists[i], s->budget);
    return status;
}
