#include "bench_disk.h"

#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "clock.h"
#include "plain_disk.h"
#include "report.h"

enum { AXES = 3 };

/* Returns the planes of a list with a file. Computed normals have none. */
static unsigned stored_planes(const trip_dataset *data, const trip_list *list)
{
    return data->computes_normals ? list->planes & ~(1u << TRIP_PLANE_NORMALS) : list->planes;
}

static bool has_file(const bench_files *files, unsigned list, int plane)
{
    return files->planes[list] >> plane & 1;
}

void bench_files_of_plan(const trip_dataset *data, const trip_plan *plan, bench_files *out)
{
    *out = (bench_files){ 0 };
    for (unsigned i = 0; i < data->list_count; i++)
        if (plan->lists[i].drawn && plan->layers[data->lists[i].axis].pass_count)
            out->planes[i] = (uint8_t)(plan->planes & stored_planes(data, &data->lists[i]));
}

void bench_files_forget(const session *s, const bench_files *files)
{
    for (unsigned i = 0; i < s->data->list_count; i++)
        for (int plane = 0; plane < TRIP_PLANES; plane++)
            if (has_file(files, i, plane))
                posix_fadvise(s->data->lists[i].plane_fd[plane], 0, 0, POSIX_FADV_DONTNEED);
}

static int read_plane(const session *s, unsigned list, int plane, plain_disk *d, void *memory)
{
    char path[4096], name[32];
    if (snprintf(path, sizeof path, "%s/%s", s->data->path,
                 trip_list_plane_name(&s->data->lists[list], plane, name)) >= (int)sizeof path)
        return trip_fail(TRIP_ERROR, "read", s->data->path, "the name is too long");
    return plain_disk_read(d, path, memory);
}

/* Memory from the budget has large pages. */
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

/* Reads all files, one after the other. */
static int read_files(const session *s, const bench_files *files, plain_disk *d, void *memory)
{
    int status = 0;
    for (unsigned i = 0; i < s->data->list_count; i++)
        for (int plane = 0; plane < TRIP_PLANES && !status; plane++)
            if (has_file(files, i, plane))
                status = read_plane(s, i, plane, d, memory);
    return status;
}

int bench_files_read(const session *s, const bench_files *files, bench_plain how,
                     bench_disk_read *out)
{
    plain_disk d = { .direct = true, .look = how == BENCH_PLAIN };
    bool large_pages = how != BENCH_PLAIN_SMALL;
    void *memory = take_memory(s, PLAIN_DISK_MEMORY_BYTES, large_pages);
    if (!memory)
        return trip_fail(
            TRIP_ERROR, "bench", s->input,
            "needs %zu bytes to read into, which do not fit the memory; raise --memory",
            PLAIN_DISK_MEMORY_BYTES);
    int status = read_files(s, files, &d, memory);
    *out = (bench_disk_read){ d.seconds * 1e3, d.bytes, d.direct };
    release_memory(s, memory, PLAIN_DISK_MEMORY_BYTES, large_pages);
    return status;
}

static int stream_passes(trip_reader *reader, const trip_pass passes[AXES])
{
    trip_batch batch;
    int status = trip_reader_begin(reader, NULL);
    for (int axis = 0; axis < AXES && !status; axis++)
        if (passes[axis].selection_count)
            status = trip_reader_then(reader, &passes[axis]);
    while (!status && (status = trip_reader_next(reader, &batch)) > 0) {
        trip_reader_release(reader, &batch);
        status =
            trip_interrupted() ? trip_fail(TRIP_INTERRUPTED, "bench", "lists", "interrupted") : 0;
    }
    return status;
}

/* Selects all lists of an axis with files, starting at `selections`. */
static int select_axis(const session *s, const bench_files *files, int axis,
                       trip_selection *selections, trip_pass *pass)
{
    int status = 0;
    *pass = (trip_pass){ .selections = selections };
    for (unsigned i = 0; i < s->data->list_count && !status; i++)
        if (files->planes[i] && s->data->lists[i].axis == axis)
            status = trip_selection_create_whole(&selections[pass->selection_count++], s->data,
                                                 &s->data->lists[i], false, s->budget);
    return status;
}

int bench_files_stream(const session *s, const bench_files *files, trip_reader *reader,
                       bench_disk_read *out)
{
    const unsigned lists = s->data->list_count;
    trip_pass passes[AXES];
    trip_selection *selections = calloc(lists, sizeof *selections);
    if (!selections)
        return trip_fail(TRIP_ERROR, "bench", s->input, "out of memory");
    unsigned count = 0;
    int status = 0;
    for (int axis = 0; axis < AXES && !status; axis++) {
        status = select_axis(s, files, axis, selections + count, &passes[axis]);
        count += passes[axis].selection_count;
    }
    double start = trip_now_ms();
    if (!status)
        status = stream_passes(reader, passes);
    out->ms = trip_now_ms() - start;
    out->bytes = trip_reader_get_stats(reader).bytes_read;
    out->direct = strstr(trip_reader_engine_name(reader), "O_DIRECT");
    for (unsigned i = 0; i < lists; i++)
        trip_selection_destroy(&selections[i], s->budget);
    free(selections);
    return status;
}
