#include "dense_file.h"

#include <stdlib.h>
#include <string.h>

#include "report.h"

typedef struct dense_file {
    trip_byte_source *sources; /* owns the copied paths */
    int64_t count, current;
    trip_byte_stream *stream; /* stream of the current source */
    uint64_t left_bytes;      /* bytes not read yet of the current source */
    uint64_t slice_bytes;
    bool swap;
} dense_file;

bool trip_machine_is_big_endian(void)
{
    const uint16_t one = 1;
    unsigned char first;
    memcpy(&first, &one, 1);
    return first == 0;
}

static int open_source(dense_file *d, int64_t index)
{
    trip_byte_stream_close(d->stream);
    d->stream = NULL;
    d->current = index;
    d->left_bytes = d->sources[index].size_bytes;
    return trip_byte_stream_open(&d->stream, &d->sources[index]);
}

/* Opens each source once, so that a missing or short file fails before hours of work. The first one
 * stays open. */
static int open_all(dense_file *d)
{
    for (int64_t i = d->count - 1; i >= 0; i--) {
        int status = open_source(d, i);
        if (status < 0)
            return status;
        d->sources[i].warned = true;
    }
    return 0;
}

static int copy_sources(dense_file *d, const trip_byte_source *sources, int64_t count,
                        uint64_t size_bytes)
{
    d->sources = calloc((size_t)count, sizeof *d->sources);
    if (!d->sources)
        return trip_fail(TRIP_ERROR, "read", sources[0].path, "no memory to open it");
    d->count = count;
    for (int64_t i = 0; i < count; i++) {
        d->sources[i] = sources[i];
        d->sources[i].size_bytes = size_bytes;
        if (!(d->sources[i].path = strdup(sources[i].path)))
            return trip_fail(TRIP_ERROR, "read", sources[i].path, "no memory to open it");
    }
    return 0;
}

int trip_dense_open(void **state, const trip_byte_source *sources, int64_t count,
                    const trip_volume_info *info, bool swap)
{
    int status = trip_volume_check_dims(sources[0].path, info);
    if (status < 0)
        return status;
    dense_file *d = calloc(1, sizeof *d);
    if (!d)
        return trip_fail(TRIP_ERROR, "read", sources[0].path, "no memory to open it");
    d->swap = swap;
    d->slice_bytes =
        (uint64_t)info->dims[0] * (uint64_t)info->dims[1] * trip_scalar_bytes(info->type);
    status =
        copy_sources(d, sources, count, d->slice_bytes * (uint64_t)info->dims[2] / (uint64_t)count);
    if (status == 0)
        status = open_all(d);
    if (status < 0) {
        trip_dense_close(d);
        return status;
    }
    *state = d;
    return 0;
}

void trip_dense_close(void *state)
{
    dense_file *d = state;
    trip_byte_stream_close(d->stream);
    for (int64_t i = 0; i < d->count; i++)
        free((char *)(uintptr_t)d->sources[i].path);
    free(d->sources);
    free(d);
}

int trip_dense_rewind(void *state)
{
    dense_file *d = state;
    if (d->current != 0 || !d->stream)
        return open_source(d, 0);
    d->left_bytes = d->sources[0].size_bytes;
    return trip_byte_stream_rewind(d->stream);
}

/* Bytes between checks for an interruption. */
#define READ_BYTES_MAX ((uint64_t)32 << 20)

/* Reads the next bytes, across sources if necessary. Skips them if `to` is NULL. */
static int take_bytes(dense_file *d, uint64_t bytes, char *to)
{
    while (bytes > 0) {
        int status = d->left_bytes == 0 ? open_source(d, d->current + 1) : 0;
        uint64_t n = bytes < d->left_bytes ? bytes : d->left_bytes;
        n = to && n > READ_BYTES_MAX ? READ_BYTES_MAX : n;
        if (status == 0 && trip_interrupted())
            status = trip_fail(TRIP_INTERRUPTED, "brick", "", "interrupted");
        if (status == 0)
            status = to ? trip_byte_stream_read(d->stream, to, (size_t)n)
                        : trip_byte_stream_skip(d->stream, n);
        if (status < 0)
            return status;
        d->left_bytes -= n;
        bytes -= n;
        to = to ? to + n : NULL;
    }
    return 0;
}

int trip_dense_read_slices(void *state, int64_t count, void *values)
{
    dense_file *d = state;
    return take_bytes(d, (uint64_t)count * d->slice_bytes, values);
}

int trip_dense_skip_slices(void *state, int64_t count)
{
    dense_file *d = state;
    return take_bytes(d, (uint64_t)count * d->slice_bytes, NULL);
}

bool trip_dense_swap(const void *state)
{
    const dense_file *d = state;
    return d->swap;
}
