#include "dense_file.h"

#include <stdlib.h>
#include <string.h>

#include "report.h"

typedef struct dense_file {
    trip_byte_source *sources; /* owns the copied paths */
    int64_t count, current;
    trip_byte_stream *stream; /* stream of the current source */
    uint64_t left_bytes;      /* bytes not read yet of the current source */
    bool swap;

    trip_dense_layout layout;
    uint64_t value_bytes;              /* of a stored value */
    uint64_t run_values, runs;         /* a slice has `runs` runs of voxels with nothing between */
    uint64_t run_bytes, slice_bytes;   /* in the files, with the entries in a voxel */
    uint64_t step_bytes, volume_bytes; /* from a run, and from a volume, to the next */
    unsigned char *piece;              /* buffer, if voxels have several entries */
} dense_file;

/* Size of the buffer for voxels with several entries. Larger voxels are read one by one. */
#define PIECE_BYTES ((uint64_t)1 << 18)

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

/* Sets the sizes of runs, slices and volumes. *all_bytes gets the size of all values. */
static int measure(dense_file *d, const char *path, const trip_volume_info *info,
                   uint64_t *all_bytes)
{
    const int64_t *n = d->layout.count;
    const bool whole_slices = n[TRIP_DENSE_BETWEEN_I_J] == 1;
    int64_t bytes = trip_scalar_bytes(d->layout.luma ? d->layout.stored : info->type);
    bool possible = true;
    const int64_t factors[] = { n[TRIP_DENSE_IN_VOXEL],     info->dims[0],
                                n[TRIP_DENSE_BETWEEN_I_J],  info->dims[1],
                                n[TRIP_DENSE_BETWEEN_J_K],  info->dims[2],
                                n[TRIP_DENSE_AFTER_VOLUMES] };
    uint64_t products[sizeof factors / sizeof *factors];
    d->value_bytes = (uint64_t)bytes;
    for (size_t i = 0; i < sizeof factors / sizeof *factors; i++) {
        possible = possible && !__builtin_mul_overflow(bytes, factors[i], &bytes);
        products[i] = (uint64_t)bytes;
    }
    if (!possible)
        return trip_fail(TRIP_ERROR, "read", path, "has an impossible size");
    d->run_values = (uint64_t)info->dims[0] * (whole_slices ? (uint64_t)info->dims[1] : 1);
    d->runs = whole_slices ? 1 : (uint64_t)info->dims[1];
    d->run_bytes = products[whole_slices ? 3 : 1];
    d->step_bytes = products[whole_slices ? 3 : 2];
    d->slice_bytes = products[4];
    d->volume_bytes = products[5];
    *all_bytes = products[6];
    return 0;
}

/* Skips the volumes before the wanted one. */
static int begin_volume(dense_file *d);

int trip_dense_open(void **state, const trip_byte_source *sources, int64_t count,
                    const trip_volume_info *info, const trip_dense_layout *layout, bool swap)
{
    static const trip_dense_layout plain = { .count = { 1, 1, 1, 1 } };
    uint64_t all_bytes = 0;
    int status = trip_volume_check_dims(sources[0].path, info);
    if (status < 0)
        return status;
    dense_file *d = calloc(1, sizeof *d);
    if (!d)
        return trip_fail(TRIP_ERROR, "read", sources[0].path, "no memory to open it");
    d->swap = swap;
    d->layout = layout ? *layout : plain;
    status = measure(d, sources[0].path, info, &all_bytes);
    if (status == 0 && d->layout.count[TRIP_DENSE_IN_VOXEL] > 1 &&
        !(d->piece = malloc((size_t)PIECE_BYTES)))
        status = trip_fail(TRIP_ERROR, "read", sources[0].path, "no memory to open it");
    if (status == 0)
        status = copy_sources(d, sources, count, all_bytes / (uint64_t)count);
    if (status == 0)
        status = open_all(d);
    if (status == 0)
        status = begin_volume(d);
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
    free(d->piece);
    free(d);
}

/* Bytes between checks for an interruption. */
#define READ_BYTES_MAX ((uint64_t)32 << 20)

/* Reads the next bytes, across sources if necessary. Skips them if `to` is NULL. */
static int take_bytes(dense_file *d, uint64_t bytes, char *to)
{
    while (bytes > 0) {
        int status = 0;
        if (!to && bytes >= d->left_bytes && d->current + 1 < d->count) { /* the rest of a source */
            bytes -= d->left_bytes;
            d->current++;
            d->left_bytes = d->sources[d->current].size_bytes;
            trip_byte_stream_close(d->stream);
            d->stream = NULL;
            continue;
        }
        if (d->left_bytes == 0)
            status = open_source(d, d->current + 1);
        else if (!d->stream)
            status = open_source(d, d->current);
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

static int begin_volume(dense_file *d)
{
    const int place = TRIP_DENSE_AFTER_VOLUMES;
    return take_bytes(d, (uint64_t)d->layout.index[place] * d->volume_bytes, NULL);
}

int trip_dense_rewind(void *state)
{
    dense_file *d = state;
    int status;
    if (d->current != 0 || !d->stream) {
        status = open_source(d, 0);
    } else {
        d->left_bytes = d->sources[0].size_bytes;
        status = trip_byte_stream_rewind(d->stream);
    }
    return status < 0 ? status : begin_volume(d);
}

/* Takes the wanted entry, or the luma, of `count` voxels in memory. */
static void pick(const dense_file *d, const unsigned char *from, size_t count, char *to)
{
    const size_t bytes = (size_t)d->value_bytes;
    const size_t step = bytes * (size_t)d->layout.count[TRIP_DENSE_IN_VOXEL];
    if (d->layout.luma) {
        for (size_t i = 0; i < count; i++) {
            const float luma = trip_scalar_luma(d->layout.stored, d->swap, from + i * step);
            memcpy(to + i * sizeof luma, &luma, sizeof luma);
        }
        return;
    }
    from += bytes * (size_t)d->layout.index[TRIP_DENSE_IN_VOXEL];
    for (size_t i = 0; i < count; i++)
        memcpy(to + i * bytes, from + i * step, bytes);
}

/* Reads `count` voxels that have several entries each. */
static int take_voxels(dense_file *d, uint64_t count, char *to)
{
    const uint64_t step = d->value_bytes * (uint64_t)d->layout.count[TRIP_DENSE_IN_VOXEL];
    const uint64_t before = d->value_bytes * (uint64_t)d->layout.index[TRIP_DENSE_IN_VOXEL];
    const uint64_t room = PIECE_BYTES / step;
    const uint64_t result_bytes = d->layout.luma ? sizeof(float) : d->value_bytes;
    int status = 0;
    while (count > 0 && status == 0) {
        const uint64_t n = room == 0 ? 1 : count < room ? count : room;
        if (room > 0) {
            status = take_bytes(d, n * step, (char *)d->piece);
            if (status == 0)
                pick(d, d->piece, (size_t)n, to);
        } else { /* a voxel larger than the piece */
            status = take_bytes(d, before, NULL);
            if (status == 0)
                status = take_bytes(d, d->value_bytes, to);
            if (status == 0)
                status = take_bytes(d, step - before - d->value_bytes, NULL);
        }
        to += n * result_bytes;
        count -= n;
    }
    return status;
}

static int take_slice(dense_file *d, char *to)
{
    const int64_t *n = d->layout.count, *index = d->layout.index;
    const uint64_t result_bytes = d->layout.luma ? sizeof(float) : d->value_bytes;
    const uint64_t before_run = (uint64_t)index[TRIP_DENSE_BETWEEN_I_J] * d->run_bytes;
    const uint64_t block = d->slice_bytes / (uint64_t)n[TRIP_DENSE_BETWEEN_J_K];
    const uint64_t before = (uint64_t)index[TRIP_DENSE_BETWEEN_J_K] * block;
    int status = take_bytes(d, before, NULL);
    for (uint64_t run = 0; run < d->runs && status == 0; run++) {
        status = take_bytes(d, before_run, NULL);
        if (status == 0)
            status = n[TRIP_DENSE_IN_VOXEL] == 1 ? take_bytes(d, d->run_bytes, to)
                                                 : take_voxels(d, d->run_values, to);
        if (status == 0)
            status = take_bytes(d, d->step_bytes - before_run - d->run_bytes, NULL);
        to += d->run_values * result_bytes;
    }
    return status < 0 ? status : take_bytes(d, d->slice_bytes - before - block, NULL);
}

/* Returns whether the files hold the slices one after the other, with nothing between. */
static bool is_contiguous(const dense_file *d)
{
    const int64_t *n = d->layout.count;
    return n[TRIP_DENSE_IN_VOXEL] == 1 && n[TRIP_DENSE_BETWEEN_I_J] == 1 &&
           n[TRIP_DENSE_BETWEEN_J_K] == 1;
}

int trip_dense_read_slices(void *state, int64_t count, void *values)
{
    dense_file *d = state;
    if (is_contiguous(d))
        return take_bytes(d, (uint64_t)count * d->slice_bytes, values);
    const uint64_t bytes =
        d->run_values * d->runs * (d->layout.luma ? sizeof(float) : d->value_bytes);
    int status = 0;
    for (int64_t i = 0; i < count && status == 0; i++)
        status = take_slice(d, (char *)values + (uint64_t)i * bytes);
    return status;
}

int trip_dense_skip_slices(void *state, int64_t count)
{
    dense_file *d = state;
    return take_bytes(d, (uint64_t)count * d->slice_bytes, NULL);
}

bool trip_dense_swap(const void *state)
{
    const dense_file *d = state;
    return d->swap && !d->layout.luma;
}
