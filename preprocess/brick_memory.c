#include "brick_memory.h"

#include <inttypes.h>

#include "list_builder.h"
#include "report.h"
#include "splats.h"

enum { MAX_SLICES = 32 };

/* Allocated by the input before the plan. */
#define TAKEN_BYTES ((uint64_t)1 << 20)
/* Allocated by the writer and the spill. A halo needs more files, with smaller buffers. */
#define OPENED_BYTES ((uint64_t)18 << 20)
#define HALO_OPENED_BYTES ((uint64_t)16 << 20)
/* Allocated by the list builder, without its pieces, and by readers. */
#define LATE_BYTES ((uint64_t)2 << 20)
/* Index bytes of the writer per tile of a sheet. */
#define TILE_BYTES 400
/* Bytes of a lone splat in its pieces, in three lists. */
#define LONE_SPLAT_BYTES (3 * 48)

typedef struct needs {
    uint64_t slice_bytes;  /* bytes of a slice in the type of the file */
    uint64_t slice_splats; /* bytes of the pieces of one fully kept slice, in one list */
    uint64_t opened_bytes; /* allocated before the lists */
    uint64_t late_bytes;   /* allocated after the lists */
    uint64_t list_min_bytes, list_max_bytes;
} needs;

static uint64_t tiles_of_largest_sheet(const trip_volume_info *info, const trip_piece_format *f)
{
    uint64_t max = 0;
    for (int a = 0; a < 3; a++) {
        uint64_t tiles = (uint64_t)((info->dims[a] >> f->tile_log2) + 1) *
                         (uint64_t)((info->dims[(a + 1) % 3] >> f->tile_log2) + 1);
        max = tiles > max ? tiles : max;
    }
    return max;
}

static needs needs_of(const trip_volume_info *info, const trip_piece_format *f, unsigned threads)
{
    uint64_t slice = (uint64_t)(info->dims[0] * info->dims[1]);
    uint64_t tile = UINT64_C(1) << 2 * f->tile_log2;
    const uint64_t kinds = f->halo ? 2 : 1;
    needs n = { .opened_bytes = (f->halo ? HALO_OPENED_BYTES : OPENED_BYTES) +
                                threads * trip_splat_thread_bytes(f, info->sparse),
                .late_bytes = kinds * (LATE_BYTES + TILE_BYTES * tiles_of_largest_sheet(info, f)),
                .list_min_bytes = trip_list_builder_min_bytes(f, threads) };
    if (__builtin_mul_overflow(slice * LONE_SPLAT_BYTES, (uint64_t)info->dims[2],
                               &n.list_max_bytes) ||
        __builtin_add_overflow(n.list_max_bytes, n.list_min_bytes, &n.list_max_bytes))
        n.list_max_bytes = UINT64_MAX;
    if (info->sparse)
        return n;
    n.slice_bytes = slice * trip_scalar_bytes(info->type);
    /* Adds a quarter, because the ends of chunks stay empty. */
    n.slice_splats = slice / tile * trip_piece_max_bytes(f) / 4 * 5 + slice * 16;
    return n;
}

/* A portion needs one slice on each side, and keeps two for the next portion. */
static uint64_t reader_bytes(const needs *n, int64_t slices, bool read_ahead)
{
    return (uint64_t)(slices + 2 + (read_ahead ? slices + 2 : 0) + 2) * n->slice_bytes;
}

/* Divides the rest between the reader and the lists. Returns false if it is too little. */
static bool divide(trip_memory_plan *plan, const needs *n, uint64_t left)
{
    uint64_t used = n->late_bytes + reader_bytes(n, plan->slices, plan->read_ahead);
    if (used + n->list_min_bytes > left)
        return false;
    plan->list_bytes = left - used < n->list_max_bytes ? left - used : n->list_max_bytes;
    /* One batch is made while the previous one is written. */
    uint64_t splats = 2 * (uint64_t)plan->slices * n->slice_splats;
    plan->in_order = splats > 0 && n->list_min_bytes + splats <= plan->list_bytes;
    return true;
}

/* Fills the plan for portions of `slices` slices. Returns false if they do not fit. */
static bool try_slices(trip_memory_plan *plan, const needs *n, uint64_t memory, int64_t slices,
                       bool read_ahead)
{
    *plan = (trip_memory_plan){ .slices = slices, .read_ahead = read_ahead };
    return n->opened_bytes <= memory && divide(plan, n, memory - n->opened_bytes);
}

/* Returns whether the ordered list can be written in order and the reader takes at most a quarter
 * of the memory. Large portions reduce repeated work at their borders, but the rest of the memory
 * serves splats better. */
static bool is_comfortable(const trip_memory_plan *plan, const needs *n, uint64_t memory)
{
    return plan->in_order && reader_bytes(n, plan->slices, plan->read_ahead) <= memory / 4;
}

static int refuse(const char *path, const trip_volume_info *info, const needs *n, unsigned threads,
                  int64_t slices)
{
    uint64_t min = TAKEN_BYTES + n->opened_bytes + n->late_bytes + reader_bytes(n, slices, false) +
                   n->list_min_bytes;
    return trip_fail(TRIP_ERROR, "brick", path,
                     "slices of %" PRId64 " x %" PRId64 " and %u thread%s need --memory %" PRIu64
                     "M or more%s",
                     info->dims[0], info->dims[1], threads, threads > 1 ? "s" : "", (min >> 20) + 1,
                     threads > 1 ? "; fewer --threads need less" : "");
}

unsigned trip_memory_plan_threads(const trip_piece_format *format, uint64_t memory_bytes)
{
    uint64_t each = trip_splat_thread_bytes(format, true) + trip_list_builder_min_bytes(format, 2) -
                    trip_list_builder_min_bytes(format, 1);
    uint64_t fixed = OPENED_BYTES + LATE_BYTES, processors = trip_workers_processors();
    uint64_t max = memory_bytes > fixed ? (memory_bytes - fixed) / 2 / each : 0;
    return (unsigned)(max < 1 ? 1 : max < processors ? max : processors);
}

int trip_memory_plan_make(trip_memory_plan *plan, const char *path, const trip_volume_info *info,
                          const trip_piece_format *format, unsigned threads, uint64_t memory_bytes,
                          int64_t slices)
{
    needs n = needs_of(info, format, threads);
    if (info->sparse) /* readers of sparse formats allocated their memory when opened */
        return try_slices(plan, &n, memory_bytes, 1, true) ? 0 : refuse(path, info, &n, threads, 1);
    for (int64_t s = slices ? slices : MAX_SLICES; s >= (slices ? slices : 1); s /= 2)
        if (try_slices(plan, &n, memory_bytes, s, true) && is_comfortable(plan, &n, memory_bytes))
            return 0;
    slices = slices ? slices : 1;
    if (try_slices(plan, &n, memory_bytes, slices, true) ||
        try_slices(plan, &n, memory_bytes, slices, false))
        return 0;
    return refuse(path, info, &n, threads, slices);
}

int trip_memory_plan_update(trip_memory_plan *plan, const char *path, const trip_volume_info *info,
                            const trip_piece_format *format, unsigned threads, uint64_t left_bytes)
{
    needs n = needs_of(info, format, threads);
    return divide(plan, &n, left_bytes) ? 0 : refuse(path, info, &n, threads, plan->slices);
}
