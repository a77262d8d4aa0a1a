#include "brick_memory.h"

#include <inttypes.h>

#include "list_builder.h"
#include "report.h"
#include "splats.h"

enum { MOST_SLICES = 32 };

/* What the writer, the spill, the tiles and the readers' own buffers take. */
#define FIXED_BYTES ((uint64_t)14 << 20)

typedef struct needs {
    uint64_t slice_bytes;  /* as stored */
    uint64_t slice_splats; /* pieces of one slice, in one list, if all of it is kept */
    uint64_t fixed_bytes;
    uint64_t list_min_bytes;
} needs;

static needs needs_of(const trip_volume_info *info, const trip_piece_format *f, unsigned threads)
{
    uint64_t slice = (uint64_t)(info->dims[0] * info->dims[1]);
    uint64_t tile = UINT64_C(1) << 2 * f->tile_log2;
    needs n = { .fixed_bytes = FIXED_BYTES + threads * trip_splat_thread_bytes(f, info->sparse),
                .list_min_bytes = trip_list_builder_min_bytes(f, threads) };
    if (info->sparse)
        return n;
    n.slice_bytes = slice * trip_scalar_bytes(info->type);
    /* A quarter more for what is left empty at the ends of chunks. */
    n.slice_splats = slice / tile * trip_piece_max_bytes(f) / 4 * 5 + slice * 16;
    return n;
}

/* A block has a neighbour on each side, and two slices are kept for the next one. */
static uint64_t reader_bytes(const needs *n, int64_t slices, bool read_ahead)
{
    return (uint64_t)(slices + 2 + (read_ahead ? slices + 2 : 0) + 2) * n->slice_bytes;
}

/* Whether blocks of so many slices fit; fills the plan. */
static bool try_slices(trip_memory_plan *plan, const needs *n, uint64_t memory, int64_t slices,
                       bool read_ahead)
{
    uint64_t used = n->fixed_bytes + reader_bytes(n, slices, read_ahead);
    *plan = (trip_memory_plan){ .slices = slices, .read_ahead = read_ahead };
    if (used + n->list_min_bytes > memory)
        return false;
    plan->list_bytes = memory - used;
    plan->in_order = n->slice_splats > 0 &&
                     n->list_min_bytes + 2 * (uint64_t)slices * n->slice_splats <= plan->list_bytes;
    return true;
}

/* Large blocks cost less at their borders, but splats want most of the memory. */
static bool is_comfortable(const trip_memory_plan *plan, const needs *n, uint64_t memory)
{
    return plan->in_order && reader_bytes(n, plan->slices, plan->read_ahead) <= memory / 4;
}

static int refuse(const char *path, const trip_volume_info *info, const needs *n, unsigned threads,
                  int64_t slices)
{
    uint64_t least = n->fixed_bytes + reader_bytes(n, slices, false) + n->list_min_bytes;
    return trip_fail(TRIP_ERROR, "brick", path,
                     "slices of %" PRId64 " x %" PRId64 " with %u threads need --memory %" PRIu64
                     "M at least; fewer --threads need less",
                     info->dims[0], info->dims[1], threads, (least >> 20) + 1);
}

int trip_memory_plan_make(trip_memory_plan *plan, const char *path, const trip_volume_info *info,
                          const trip_piece_format *format, unsigned threads, uint64_t memory_bytes,
                          int64_t slices)
{
    needs n = needs_of(info, format, threads);
    if (info->sparse) {
        /* Readers of sparse formats took what they need when they were opened. */
        uint64_t memory = memory_bytes - memory_bytes / 16;
        return try_slices(plan, &n, memory, 1, true) ? 0 : refuse(path, info, &n, threads, 1);
    }
    for (int64_t s = slices ? slices : MOST_SLICES; s >= (slices ? slices : 1); s /= 2)
        if (try_slices(plan, &n, memory_bytes, s, true) && is_comfortable(plan, &n, memory_bytes))
            return 0;
    slices = slices ? slices : 1;
    if (try_slices(plan, &n, memory_bytes, slices, true) ||
        try_slices(plan, &n, memory_bytes, slices, false))
        return 0;
    return refuse(path, info, &n, threads, slices);
}
