#include "reader.h"

#include "reader_state.h"
#include "report.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

enum {
    DEFAULT_SLOTS = 8,
    DEFAULT_SLOT_BYTES = 512 << 10,
    DEFAULT_GAP_BYTES = 32 << 10,
    DEFAULT_THREADS = 4,
    SLOT_BYTES_PER_RUN = 64, /* room for runs; where they are shorter, slots are not filled */
};

static size_t slot_total_bytes(const trip_reader *r)
{
    return r->params.slot_bytes * r->plane_count;
}

static size_t run_room(const trip_reader *r)
{
    return r->params.slot_bytes / SLOT_BYTES_PER_RUN;
}

static void set_defaults(trip_reader *r)
{
    trip_reader_params *p = &r->params;
    size_t page = (size_t)1 << r->data->header.page_log2;
    p->slots = p->slots ? p->slots : DEFAULT_SLOTS;
    if (!p->slot_bytes)
        p->slot_bytes = page > DEFAULT_SLOT_BYTES ? page : DEFAULT_SLOT_BYTES;
    p->gap_bytes = p->gap_bytes ? p->gap_bytes : DEFAULT_GAP_BYTES;
    p->gap_bytes = p->gap_bytes > page ? p->gap_bytes : page;
    p->planes |= 1u << TRIP_PLANE_VOXELS;
    for (int plane = 0; plane < TRIP_PLANES; plane++) {
        r->read_planes[plane] = p->planes >> plane & 1;
        r->plane_count += r->read_planes[plane];
    }
}

static int check_params(const trip_reader *r)
{
    const trip_reader_params *p = &r->params;
    const trip_file_header *h = &r->data->header;
    if (p->planes & ~h->planes)
        return trip_fail(TRIP_ERROR, "read", r->data->path, "the data set has no normals");
    if (p->slots < 2 || p->slots > 4096)
        return trip_fail(TRIP_USAGE, "read", r->data->path, "%u slots: 2 to 4096", p->slots);
    if (p->slot_bytes % ((size_t)1 << h->page_log2) || p->slot_bytes > 1 << 30)
        return trip_fail(TRIP_USAGE, "read", r->data->path,
                         "slots of %zu bytes: a multiple of the page size %u, up to 1 GiB",
                         p->slot_bytes, 1u << h->page_log2);
    return TRIP_OK;
}

int trip_reader_open_direct(int fd)
{
    char path[32];
    snprintf(path, sizeof path, "/proc/self/fd/%d", fd);
    return open(path, O_RDONLY | O_CLOEXEC | O_DIRECT);
}

static void open_direct_files(trip_reader *r)
{
    for (int axis = 0; axis < 3; axis++)
        for (int plane = 0; plane < TRIP_PLANES; plane++)
            r->direct_fd[axis][plane] =
                r->read_planes[plane] && !r->params.buffered
                    ? trip_reader_open_direct(r->data->plane_fd[axis][plane])
                    : -1;
}

static int take_memory(trip_reader *r)
{
    unsigned n = r->params.slots;
    r->slots = trip_budget_take(r->budget, n * sizeof *r->slots);
    r->queue = trip_budget_take(r->budget, n * sizeof *r->queue);
    r->runs = trip_budget_take(r->budget, n * run_room(r) * sizeof *r->runs);
    if (!r->params.slot_memory)
        r->slot_memory = trip_budget_take(r->budget, n * slot_total_bytes(r));
    if (!r->slots || !r->queue || !r->runs || (!r->params.slot_memory && !r->slot_memory))
        return trip_fail(TRIP_ERROR, "read", r->data->path,
                         "no memory for %u slots of %zu bytes: give more with --memory", n,
                         slot_total_bytes(r));
    for (unsigned i = 0; i < n; i++) {
        trip_slot *s = &r->slots[i];
        s->reader = r;
        s->memory = r->params.slot_memory ? r->params.slot_memory[i]
                                          : r->slot_memory + i * slot_total_bytes(r);
        s->extent.runs = r->runs + i * run_room(r);
        s->extent.run_room = run_room(r);
    }
    return TRIP_OK;
}

static void release_memory(trip_reader *r)
{
    unsigned n = r->params.slots;
    trip_budget_release(r->budget, r->slots, n * sizeof *r->slots);
    trip_budget_release(r->budget, r->queue, n * sizeof *r->queue);
    trip_budget_release(r->budget, r->runs, n * run_room(r) * sizeof *r->runs);
    trip_budget_release(r->budget, r->slot_memory, n * slot_total_bytes(r));
}

int trip_reader_start_engine(trip_engine engine, unsigned depth, unsigned threads,
                             const trip_engine_ops **ops, void **state)
{
    int status = -ENOSYS;
    if (engine == TRIP_ENGINE_AUTO || engine == TRIP_ENGINE_URING)
        status = (*ops = &trip_engine_uring)->create(state, depth, threads);
    if (status < 0 && engine != TRIP_ENGINE_URING)
        status = (*ops = &trip_engine_pread)->create(state, depth, threads);
    return status;
}

static int create_engine(trip_reader *r)
{
    const trip_engine_ops *ops;
    int status = trip_reader_start_engine(
        r->params.engine, r->params.slots * TRIP_SLOT_REQUESTS_MAX,
        r->params.threads ? r->params.threads : DEFAULT_THREADS, &ops, &r->engine);
    if (status == 0) {
        r->ops = ops;
        return TRIP_OK;
    }
    errno = -status;
    return trip_fail_errno("read", r->data->path,
                           r->params.engine == TRIP_ENGINE_URING
                               ? "io_uring is refused, use another engine"
                               : "cannot start threads");
}

static void set_sources(trip_reader *r)
{
    for (int axis = 0; axis < 3; axis++)
        for (int plane = 0; plane < TRIP_PLANES; plane++)
            r->sources[axis][plane] = (trip_source){
                .fd = r->data->plane_fd[axis][plane],
                .direct_fd = r->direct_fd[axis][plane],
                .direct_refused = &r->direct_refused,
                .file_bytes = r->data->lists[axis].splats * TRIP_RECORD_BYTES,
                .page_log2 = r->data->header.page_log2,
                .checksums = r->data->lists[axis].page_checksums[plane],
                .cache = r->cache,
                .first_page = r->cache ? trip_cache_page(r->cache, axis, plane, 0) : 0,
                .fault = r->params.fault,
                .fault_user = r->params.fault_user,
            };
}

static int create_cache(trip_reader *r)
{
    size_t bytes = r->params.cache_bytes;
    if (r->params.engine == TRIP_ENGINE_NULL)
        bytes = trip_cache_full_bytes(r->data, r->params.planes);
    return bytes ? trip_cache_create(&r->cache, r->data, r->params.planes, bytes, r->budget)
                 : TRIP_OK;
}

static int load_list(trip_reader *r, int axis)
{
    trip_selection s;
    trip_batch batch;
    int status = trip_selection_create(&s, r->data, axis, false, 0, INT32_MAX, r->budget);
    if (status < 0)
        return status;
    for (uint64_t b = 0; b < r->data->lists[axis].brick_count; b++)
        trip_selection_add(&s, b);
    status = trip_reader_begin(r, &s);
    while (status == TRIP_OK && (status = trip_reader_next(r, &batch)) == 1) {
        trip_reader_release(r, &batch);
        status = TRIP_OK;
        if (trip_interrupted())
            status = trip_fail(TRIP_INTERRUPTED, "read", r->data->path, "interrupted");
    }
    trip_reader_drain(r);
    trip_selection_destroy(&s, r->budget);
    return status;
}

/* For the null engine: passes that leave everything in the cache. */
static int load_lists(trip_reader *r)
{
    bool (*skip)(void *, const trip_selection *, uint32_t) = r->params.skip;
    int status = TRIP_OK;
    r->params.skip = NULL;
    for (int axis = 0; axis < 3 && status == TRIP_OK; axis++)
        status = load_list(r, axis);
    r->params.skip = skip;
    r->in_memory = status == TRIP_OK && !r->params.slot_memory;
    return status;
}

int trip_reader_create(trip_reader **out, const trip_dataset *d, const trip_reader_params *params,
                       trip_budget *budget)
{
    *out = NULL;
    trip_reader *r = calloc(1, sizeof *r);
    if (!r)
        return trip_fail(TRIP_ERROR, "read", d->path, "out of memory");
    r->data = d;
    r->params = *params;
    r->budget = budget;
    pthread_mutex_init(&r->lock, NULL);
    pthread_cond_init(&r->ready, NULL);
    set_defaults(r);
    open_direct_files(r);
    int status = check_params(r);
    if (status == TRIP_OK)
        status = take_memory(r);
    if (status == TRIP_OK)
        status = create_cache(r);
    set_sources(r);
    if (status == TRIP_OK)
        status = create_engine(r);
    if (status == TRIP_OK && r->params.engine == TRIP_ENGINE_NULL)
        status = load_lists(r);
    if (status < 0) {
        trip_reader_destroy(r);
        return status;
    }
    *out = r;
    return TRIP_OK;
}

unsigned trip_reader_slots(const trip_reader *r)
{
    return r->params.slots;
}

bool trip_reader_in_place(const trip_reader *r)
{
    return r->params.slot_memory;
}

trip_reader_stats trip_reader_get_stats(const trip_reader *r)
{
    trip_reader_stats stats = r->stats;
    stats.runs_skipped = r->planner.runs_skipped;
    stats.bytes_skipped = r->planner.splats_skipped * TRIP_RECORD_BYTES * r->plane_count;
    return stats;
}

const char *trip_reader_engine_name(const trip_reader *r)
{
    if (r->params.engine == TRIP_ENGINE_NULL)
        return "null";
    bool uring = r->ops == &trip_engine_uring;
    bool direct = r->direct_fd[0][TRIP_PLANE_VOXELS] >= 0 &&
                  !atomic_load_explicit(&r->direct_refused, memory_order_relaxed);
    return uring ? direct ? "io_uring+O_DIRECT" : "io_uring" : direct ? "pread+O_DIRECT" : "pread";
}

void trip_reader_destroy(trip_reader *r)
{
    if (!r)
        return;
    if (r->ops) {
        trip_reader_drain(r);
        r->ops->destroy(r->engine);
    }
    for (int axis = 0; axis < 3; axis++)
        for (int plane = 0; plane < TRIP_PLANES; plane++)
            if (r->direct_fd[axis][plane] >= 0)
                close(r->direct_fd[axis][plane]);
    trip_cache_destroy(r->cache);
    release_memory(r);
    pthread_cond_destroy(&r->ready);
    pthread_mutex_destroy(&r->lock);
    free(r);
}
