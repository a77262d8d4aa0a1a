/* Reads a volume from the caller's memory, or from a function that fills slices. */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "report.h"
#include "volume_reader.h"

typedef struct memory {
    trip_volume_memory from;
    const char *name; /* owned by the volume */
    int64_t next;     /* first slice that is not read yet */
} memory;

static int memory_list(const char *path, int (*visit)(void *user, const char *file), void *user)
{
    (void)path;
    (void)visit;
    (void)user;
    return 0;
}

static int memory_open(const char *path, const trip_volume_params *params, trip_budget *budget,
                       trip_volume_info *info, void **state)
{
    (void)budget;
    memory *m = calloc(1, sizeof *m);
    if (!m)
        return trip_fail(TRIP_ERROR, "read", path, "no memory to open it");
    *m = (memory){ .from = params->memory, .name = path };
    memcpy(info->dims, m->from.dims, sizeof info->dims);
    info->type = m->from.type;
    snprintf(info->name, sizeof info->name, "%s", path);
    for (int i = 0; i < 12; i++)
        info->oriented |= m->from.index_to_world.m[i / 4][i % 4] != 0;
    if (info->oriented)
        info->index_to_world = m->from.index_to_world;
    *state = m;
    return 0;
}

static int memory_rewind(void *state)
{
    memory *m = state;
    m->next = 0;
    return 0;
}

static int memory_skip_slices(void *state, int64_t count)
{
    memory *m = state;
    m->next += count;
    return 0;
}

static bool memory_swap(const void *state)
{
    (void)state;
    return false;
}

/* Copies `count` values of `bytes` bytes. */
static inline void copy_each(unsigned char *to, int64_t to_step, const unsigned char *from,
                             int64_t from_step, int64_t count, size_t bytes)
{
    for (int64_t i = 0; i < count; i++)
        memcpy(to + i * to_step, from + i * from_step, bytes);
}

/* The constants let the compiler copy each value with one instruction. */
static void copy_line(unsigned char *to, int64_t to_step, const unsigned char *from,
                      int64_t from_step, int64_t count, int64_t bytes)
{
    if (to_step == bytes && from_step == bytes)
        memcpy(to, from, (size_t)(count * bytes));
    else if (bytes == 1)
        copy_each(to, to_step, from, from_step, count, 1);
    else if (bytes == 2)
        copy_each(to, to_step, from, from_step, count, 2);
    else if (bytes == 4)
        copy_each(to, to_step, from, from_step, count, 4);
    else
        copy_each(to, to_step, from, from_step, count, 8);
}

static void order_axes(const int64_t stride[3], int axes[3])
{
    static const int pairs[3][2] = { { 0, 1 }, { 1, 2 }, { 0, 1 } };
    for (int i = 0; i < 3; i++) {
        int *a = &axes[pairs[i][0]], *b = &axes[pairs[i][1]], first = *a;
        if (llabs(stride[*a]) > llabs(stride[*b])) {
            *a = *b;
            *b = first;
        }
    }
}

/* Copies slices along the axis of the shortest stride first, so that caches are hit most often. */
static void copy_slices(const memory *m, int64_t count, unsigned char *values)
{
    const int64_t *dims = m->from.dims, *from = m->from.stride_bytes;
    const int64_t bytes = trip_scalar_bytes(m->from.type), size[3] = { dims[0], dims[1], count };
    const int64_t to[3] = { bytes, bytes * dims[0], bytes * dims[0] * dims[1] };
    int axes[3] = { 0, 1, 2 };
    order_axes(from, axes);
    const int a = axes[0], b = axes[1], c = axes[2];
    const unsigned char *data = (const unsigned char *)m->from.data + m->next * from[2];
    for (int64_t k = 0; k < size[c]; k++)
        for (int64_t j = 0; j < size[b]; j++)
            copy_line(values + k * to[c] + j * to[b], to[a], data + k * from[c] + j * from[b],
                      from[a], size[a], bytes);
}

static int memory_read_slices(void *state, int64_t count, void *values)
{
    memory *m = state;
    int result = 0;
    if (m->from.data)
        copy_slices(m, count, values);
    else
        result = m->from.read_slices(m->from.user, m->next, count, values);
    if (trip_interrupted())
        return trip_fail(TRIP_INTERRUPTED, "brick", "", "interrupted");
    if (result)
        return trip_fail(TRIP_ERROR, "read", m->name,
                         "read_slices() returned %d instead of 0 for %" PRId64
                         " slices from slice %" PRId64,
                         result, count, m->next);
    m->next += count;
    return 0;
}

const trip_volume_reader trip_read_memory = {
    .format = "memory",
    .list = memory_list,
    .open = memory_open,
    .close = free,
    .rewind = memory_rewind,
    .read_slices = memory_read_slices,
    .skip_slices = memory_skip_slices,
    .swap = memory_swap,
};
