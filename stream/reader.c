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
    DEFAULT_SLOT_BYTES = 512 << 10, /* per plane */
    SLOT_BYTES_MAX = 1 << 30,
    DEFAULT_GAP_BYTES = 32 << 10,
    DEFAULT_THREADS = 4,
    SLOT_BYTES_PER_RUN = 128, /* room for runs; slots with shorter runs are not filled */
};

static size_t run_room(const trip_reader *r)
{
    return r->params.slot_bytes / SLOT_BYTES_PER_RUN;
}

static size_t border_bytes(const trip_reader *r)
{
    return (size_t)TRIP_BORDERS_MAX << r->data->header.page_log2;
}

size_t trip_reader_slot_bytes(const trip_dataset *d, unsigned planes, size_t wanted)
{
    size_t page = (size_t)1 << d->header.page_log2, min = trip_planner_min_slot(d, planes);
    size_t bytes = wanted
                       ? wanted
                       : DEFAULT_SLOT_BYTES * (size_t)__builtin_popcount(planes & d->header.planes);
    bytes = (bytes + page - 1) / page * page;
    return bytes > min ? bytes : min;
}

static void set_defaults(trip_reader *r)
{
    trip_reader_params *p = &r->params;
    size_t page = (size_t)1 << r->data->header.page_log2;
    p->planes |= 1u << TRIP_PLANE_VOXELS;
    if (r->data->computes_normals)
        p->planes &= ~(1u << TRIP_PLANE_NORMALS);
    p->slots = p->slots ? p->slots : DEFAULT_SLOTS;
    if (!p->slot_memory && p->slot_bytes <= SLOT_BYTES_MAX)
        p->slot_bytes = trip_reader_slot_bytes(r->data, p->planes, p->slot_bytes);
    p->gap_bytes = p->gap_bytes ? p->gap_bytes : DEFAULT_GAP_BYTES;
    p->gap_bytes = p->gap_bytes > page ? p->gap_bytes : page;
    for (int plane = 0; plane < TRIP_PLANES; plane++)
        r->read_planes[plane] = p->planes >> plane & 1;
}

static int check_params(const trip_reader *r)
{
    const trip_reader_params *p = &r->params;
    const trip_file_header *h = &r->data->header;
    if (p->planes & ~h->planes)
        return trip_fail(TRIP_ERROR, "read", r->data->path, "the data set has no normals");
    if (p->slots < 2 || p->slots > 4096)
        return trip_fail(TRIP_USAGE, "read", r->data->path, "%u slots; use 2 to 4096", p->slots);
    size_t min = trip_planner_min_slot(r->data, p->planes);
    if (p->slot_bytes % ((size_t)1 << h->page_log2) || p->slot_bytes < min ||
        p->slot_bytes > SLOT_BYTES_MAX)
        return trip_fail(TRIP_USAGE, "read", r->data->path,
                         "slots of %zu bytes; use a multiple of the page size %u, %zu to %zu",
                         p->slot_bytes, 1u << h->page_log2, min, (size_t)SLOT_BYTES_MAX);
    return TRIP_OK;
}

int trip_reader_open_direct(int fd)
{
    char path[32];
    snprintf(path, sizeof path, "/proc/self/fd/%d", fd);
    return open(path, O_RDONLY | O_CLOEXEC | O_DIRECT);
}

static int take_memory(trip_reader *r)
{
    unsigned n = r->params.slots;
    r->slots = trip_budget_take(r->budget, n * sizeof *r->slots);
    r->queue = trip_budget_take(r->budget, n * sizeof *r->queue);
    r->runs = trip_budget_take(r->budget, n * run_room(r) * sizeof *r->runs);
    r->cursors = trip_budget_take(r->budget, r->data->list_count * sizeof *r->cursors);
    r->border_memory = trip_budget_take(r->budget, border_bytes(r));
    r->list_bytes = trip_budget_take(r->budget, r->data->list_count * sizeof *r->list_bytes);
    if (!r->params.slot_memory)
        r->slot_memory = trip_budget_take(r->budget, n * r->params.slot_bytes);
    if (!r->slots || !r->queue || !r->runs || !r->cursors || !r->border_memory || !r->list_bytes ||
        (!r->params.slot_memory && !r->slot_memory))
        return trip_fail(TRIP_ERROR, "read", r->data->path,
                         "no memory for %u slots of %zu bytes; raise --memory", n,
                         r->params.slot_bytes);
    for (unsigned i = 0; i < n; i++) {
        trip_slot *s = &r->slots[i];
        s->reader = r;
        s->memory = r->params.slot_memory ? r->params.slot_memory[i]
                                          : r->slot_memory + i * r->params.slot_bytes;
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
    trip_budget_release(r->budget, r->cursors, r->data->list_count * sizeof *r->cursors);
    trip_budget_release(r->budget, r->border_memory, border_bytes(r));
    trip_budget_release(r->budget, r->list_bytes, r->data->list_count * sizeof *r->list_bytes);
    trip_budget_release(r->budget, r->slot_memory, n * r->params.slot_bytes);
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
                               ? "the system refuses io_uring; use another engine"
                               : "cannot start threads");
}

static trip_source make_source(trip_reader *r, const trip_list *list, int plane)
{
    bool direct = r->read_planes[plane] && list->plane_fd[plane] >= 0 && !r->params.buffered;
    return (trip_source){
        .fd = list->plane_fd[plane],
        .direct_fd = direct ? trip_reader_open_direct(list->plane_fd[plane]) : -1,
        .direct_refused = &r->direct_refused,
        .file_bytes = list->plane_bytes[plane],
        .page_log2 = r->data->header.page_log2,
        .checksums = list->page_checksums[plane],
        .cache = r->cache,
        .first_page = r->cache ? trip_cache_page(r->cache, list->index, plane, 0) : 0,
        .fault = r->params.fault,
        .fault_user = r->params.fault_user,
    };
}

static int make_sources(trip_reader *r)
{
    unsigned lists = r->data->list_count;
    r->sources = trip_budget_take(r->budget, lists * sizeof *r->sources);
    if (!r->sources)
        return trip_fail(TRIP_ERROR, "read", r->data->path,
                         "no memory for its %u lists; raise --memory", lists);
    for (unsigned i = 0; i < lists; i++)
        for (int plane = 0; plane < TRIP_PLANES; plane++)
            r->sources[i][plane] = make_source(r, &r->data->lists[i], plane);
    return TRIP_OK;
}

static void release_sources(trip_reader *r)
{
    for (unsigned i = 0; r->sources && i < r->data->list_count; i++)
        for (int plane = 0; plane < TRIP_PLANES; plane++)
            if (r->sources[i][plane].direct_fd >= 0)
                close(r->sources[i][plane].direct_fd);
    trip_budget_release(r->budget, r->sources, r->data->list_count * sizeof *r->sources);
}

static int create_cache(trip_reader *r)
{
    size_t bytes = r->params.cache_bytes;
    if (r->params.engine == TRIP_ENGINE_NULL)
        bytes = trip_cache_full_bytes(r->data, r->params.planes);
    return bytes ? trip_cache_create(&r->cache, r->data, r->params.planes, bytes, r->budget)
                 : TRIP_OK;
}

static int load_list(trip_reader *r, const trip_list *list)
{
    trip_selection s;
    trip_batch batch;
    int status = trip_selection_create_whole(&s, r->data, list, false, r->budget);
    if (status < 0)
        return status;
    trip_pass pass = trip_pass_of(&s);
    status = trip_reader_begin(r, &pass);
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

/* For the null engine: runs passes that leave all pages in the cache. */
static int load_lists(trip_reader *r)
{
    bool (*skip)(void *, const trip_selection *, const trip_run *) = r->params.skip;
    int status = TRIP_OK;
    r->params.skip = NULL;
    for (unsigned i = 0; i < r->data->list_count && status == TRIP_OK; i++)
        status = load_list(r, &r->data->lists[i]);
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
    pthread_condattr_t clock;
    pthread_condattr_init(&clock);
    pthread_condattr_setclock(&clock, CLOCK_MONOTONIC);
    pthread_cond_init(&r->ready, &clock);
    pthread_condattr_destroy(&clock);
    set_defaults(r);
    int status = check_params(r);
    if (status == TRIP_OK)
        status = take_memory(r);
    if (status == TRIP_OK)
        status = create_cache(r);
    if (status == TRIP_OK)
        status = make_sources(r);
    if (status == TRIP_OK)
        status = create_engine(r);
    if (status == TRIP_OK && r->params.engine == TRIP_ENGINE_NULL)
        status = load_lists(r);
    if (status == TRIP_OK && d->computes_normals && params->planes >> TRIP_PLANE_NORMALS & 1)
        status = trip_computed_normals_create(
            &r->normals, d,
            &(trip_computed_normals_params){ params->runner, params->skip, params->skip_user },
            budget);
    if (status < 0) {
        trip_reader_destroy(r);
        return status;
    }
    *out = r;
    return TRIP_OK;
}

unsigned trip_reader_slots(const trip_reader *r)
{
    return r->computing ? 1 : r->params.slots;
}

bool trip_reader_in_place(const trip_reader *r)
{
    return r->params.slot_memory;
}

uint64_t trip_reader_list_bytes(const trip_reader *r, unsigned list)
{
    return r->list_bytes[list];
}

trip_reader_stats trip_reader_get_stats(const trip_reader *r)
{
    trip_reader_stats stats = r->stats;
    stats.runs_skipped = r->planner.runs_skipped;
    if (r->computing) {
        stats.runs_skipped += trip_computed_normals_skipped(r->normals);
        stats.normals_ns = trip_computed_normals_ns(r->normals);
    }
    stats.bytes_skipped = r->planner.bytes_skipped;
    return stats;
}

const char *trip_reader_engine_name(const trip_reader *r)
{
    if (r->params.engine == TRIP_ENGINE_NULL)
        return "null";
    bool uring = r->ops == &trip_engine_uring;
    bool direct = r->sources[0][TRIP_PLANE_VOXELS].direct_fd >= 0 &&
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
    trip_computed_normals_destroy(r->normals);
    release_sources(r);
    trip_cache_destroy(r->cache);
    release_memory(r);
    pthread_cond_destroy(&r->ready);
    pthread_mutex_destroy(&r->lock);
    free(r);
}
