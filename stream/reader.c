#include "reader.h"

#include "engine.h"
#include "extent.h"
#include "report.h"

#include <assert.h>
#include <errno.h>
#include <fcntl.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

enum {
    DEFAULT_SLOTS = 8,
    DEFAULT_SLOT_BYTES = 1 << 20,
    DEFAULT_GAP_BYTES = 128 << 10,
    DEFAULT_PREAD_THREADS = 4,
    DEFAULT_URING_THREADS = 2,
    SLOT_BYTES_PER_RUN = 128, /* room for runs; where they are shorter, slots are not filled */
    REQUESTS_MAX = TRIP_SEGMENTS_MAX * TRIP_PLANES,
};

typedef enum slot_state {
    SLOT_FREE,
    SLOT_READING, /* ready when nothing is pending */
    SLOT_DRAWING,
} slot_state;

typedef struct slot {
    trip_reader *reader;
    slot_state state;
    unsigned pending; /* under the reader's lock: requests not done */
    unsigned char *memory;
    trip_extent extent;
    trip_request requests[REQUESTS_MAX];
    unsigned request_count;
} slot;

struct trip_reader {
    const trip_dataset *data;
    trip_reader_params params;
    trip_budget *budget;
    const trip_engine_ops *ops;
    void *engine;
    bool read_planes[TRIP_PLANES];
    unsigned plane_count;
    int direct_fd[3][TRIP_PLANES];
    _Atomic bool direct_refused;
    trip_source sources[TRIP_PLANES]; /* of the pass */
    const trip_selection *selection;
    trip_planner planner;
    bool planned; /* no runs are left to plan */
    int failed;   /* status that ended the pass */
    trip_reader_stats stats;
    slot *slots;
    unsigned char *slot_memory; /* NULL where it is the caller's */
    trip_run *runs;
    /* Slots being read, in draw order, from queue[queue_first % slots] on. */
    slot **queue;
    unsigned queue_first, queue_count;
    pthread_mutex_t lock;
    pthread_cond_t ready; /* a slot has nothing pending any more */
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

/* The same open file once more, with O_DIRECT; by its descriptor, so that it is the same file even
 * when another has taken its name. -1 where the file system, or a missing /proc, does not allow it:
 * then reads go through the page cache. */
static int open_direct(int fd)
{
    char path[32];
    snprintf(path, sizeof path, "/proc/self/fd/%d", fd);
    return open(path, O_RDONLY | O_CLOEXEC | O_DIRECT);
}

static void open_direct_files(trip_reader *r)
{
    for (int axis = 0; axis < 3; axis++)
        for (int plane = 0; plane < TRIP_PLANES; plane++)
            r->direct_fd[axis][plane] = r->read_planes[plane] && !r->params.buffered
                                            ? open_direct(r->data->plane_fd[axis][plane])
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
        slot *s = &r->slots[i];
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

static int start_engine(trip_reader *r, const trip_engine_ops *ops, unsigned threads)
{
    int status = ops->create(&r->engine, r->params.slots * REQUESTS_MAX,
                             r->params.threads ? r->params.threads : threads);
    if (status == 0)
        r->ops = ops;
    return status;
}

static int create_engine(trip_reader *r)
{
    int status = -ENOSYS;
    trip_engine engine = r->params.engine;
    if (engine == TRIP_ENGINE_AUTO || engine == TRIP_ENGINE_URING)
        status = start_engine(r, &trip_engine_uring, DEFAULT_URING_THREADS);
    if (status < 0 && engine != TRIP_ENGINE_URING)
        status = start_engine(r, &trip_engine_pread, DEFAULT_PREAD_THREADS);
    if (status == 0)
        return TRIP_OK;
    errno = -status;
    return trip_fail_errno("read", r->data->path,
                           engine == TRIP_ENGINE_URING ? "io_uring is refused, use another engine"
                                                       : "cannot start threads");
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
        status = create_engine(r);
    if (status < 0) {
        trip_reader_destroy(r);
        return status;
    }
    *out = r;
    return TRIP_OK;
}

/* On an engine's thread: the last thing it does with the request. */
static void request_done(trip_request *q)
{
    slot *s = q->owner;
    trip_reader *r = s->reader;
    pthread_mutex_lock(&r->lock);
    if (--s->pending == 0)
        pthread_cond_signal(&r->ready);
    pthread_mutex_unlock(&r->lock);
}

static void add_request(trip_reader *r, slot *s, const trip_segment *segment, int plane,
                        size_t plane_offset)
{
    const trip_source *source = &r->sources[plane];
    trip_request *q = &s->requests[s->request_count++];
    uint64_t left = source->file_bytes - segment->offset;
    q->source = source;
    q->data = s->memory + plane_offset + segment->slot_offset;
    q->offset = segment->offset;
    q->bytes = segment->bytes < left ? segment->bytes : (size_t)left;
    q->done = request_done;
    q->owner = s;
    q->plane = plane;
    trip_request_start(q);
}

/* One request for every segment and plane, the planes of a segment side by side. */
static void submit(trip_reader *r, slot *s)
{
    s->request_count = 0;
    for (unsigned i = 0; i < s->extent.segment_count; i++) {
        size_t plane_offset = 0;
        for (int plane = 0; plane < TRIP_PLANES; plane++)
            if (r->read_planes[plane]) {
                add_request(r, s, &s->extent.segments[i], plane, plane_offset);
                plane_offset += r->params.slot_bytes;
            }
    }
    for (unsigned i = 0; i < s->request_count; i++)
        s->requests[i].next = i + 1 < s->request_count ? &s->requests[i + 1] : NULL;
    s->state = SLOT_READING;
    s->pending = s->request_count;
    r->queue[(r->queue_first + r->queue_count++) % r->params.slots] = s;
    r->ops->submit(r->engine, s->requests);
}

/* Plans and requests as much as there are free slots for. */
static void fill_slots(trip_reader *r)
{
    for (unsigned i = 0; i < r->params.slots && !r->planned; i++) {
        slot *s = &r->slots[i];
        if (s->state != SLOT_FREE)
            continue;
        if (trip_planner_fill(&r->planner, &s->extent))
            submit(r, s);
        else
            r->planned = true;
    }
}

static uint64_t now_ns(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (uint64_t)t.tv_sec * 1000000000u + (uint64_t)t.tv_nsec;
}

static void count_requests(trip_reader *r, const slot *s)
{
    for (unsigned i = 0; i < s->request_count; i++) {
        r->stats.reads += s->requests[i].reads;
        r->stats.bytes_read += s->requests[i].done_bytes;
    }
}

/* Takes the first slot of the queue when it has been read. */
static slot *wait_first(trip_reader *r)
{
    slot *s = r->queue[r->queue_first];
    pthread_mutex_lock(&r->lock);
    if (s->pending > 0) {
        uint64_t start = now_ns();
        while (s->pending > 0)
            pthread_cond_wait(&r->ready, &r->lock);
        r->stats.wait_ns += now_ns() - start;
    }
    pthread_mutex_unlock(&r->lock);
    r->queue_first = (r->queue_first + 1) % r->params.slots;
    r->queue_count--;
    count_requests(r, s);
    return s;
}

static void drain(trip_reader *r)
{
    while (r->queue_count > 0)
        wait_first(r)->state = SLOT_FREE;
}

static void set_sources(trip_reader *r, int axis)
{
    for (int plane = 0; plane < TRIP_PLANES; plane++)
        r->sources[plane] = (trip_source){
            .fd = r->data->plane_fd[axis][plane],
            .direct_fd = r->direct_fd[axis][plane],
            .direct_refused = &r->direct_refused,
            .file_bytes = r->data->lists[axis].splats * TRIP_RECORD_BYTES,
            .page_log2 = r->data->header.page_log2,
            .checksums = r->data->lists[axis].page_checksums[plane],
            .fault = r->params.fault,
            .fault_user = r->params.fault_user,
        };
}

int trip_reader_begin(trip_reader *r, const trip_selection *s)
{
    drain(r);
    for (unsigned i = 0; i < r->params.slots; i++)
        assert(r->slots[i].state == SLOT_FREE);
    r->stats = (trip_reader_stats){ 0 };
    r->selection = s;
    r->planned = false;
    r->failed = 0;
    r->planner = (trip_planner){ .page_bytes = (size_t)1 << r->data->header.page_log2,
                                 .slot_bytes = r->params.slot_bytes,
                                 .gap_bytes = r->params.gap_bytes,
                                 .skip = r->params.skip,
                                 .skip_user = r->params.skip_user };
    trip_planner_begin(&r->planner, s);
    set_sources(r, s->axis);
    fill_slots(r);
    return TRIP_OK;
}

static int report_fault(const trip_reader *r, const trip_request *q)
{
    char name[32], where[4096];
    unsigned long long at = q->fault_at;
    snprintf(where, sizeof where, "%s/%s", r->data->path,
             trip_dataset_plane_name(r->selection->axis, q->plane, name));
    if (q->fault == TRIP_REQUEST_CHECKSUM)
        return trip_fail(TRIP_ERROR, "read", where,
                         "byte %llu: the page that starts here is damaged (checksum): make the "
                         "data set again",
                         at);
    if (q->fault == TRIP_REQUEST_SHORT)
        return trip_fail(TRIP_ERROR, "read", where, "byte %llu: the file ends early", at);
    return trip_fail(TRIP_ERROR, "read", where, "byte %llu: cannot read: %s", at,
                     strerrordesc_np(q->fault_errno));
}

static int check_slot(const trip_reader *r, const slot *s)
{
    for (unsigned i = 0; i < s->request_count; i++)
        if (s->requests[i].fault != TRIP_REQUEST_OK)
            return report_fault(r, &s->requests[i]);
    return TRIP_OK;
}

static void fill_batch(trip_reader *r, slot *s, trip_batch *batch)
{
    bool normals = r->read_planes[TRIP_PLANE_NORMALS];
    *batch = (trip_batch){
        .selection = r->selection,
        .voxels = (const uint32_t *)(const void *)s->memory,
        .normals =
            normals ? (const uint32_t *)(const void *)(s->memory + r->params.slot_bytes) : NULL,
        .splats = s->extent.bytes / TRIP_RECORD_BYTES,
        .runs = s->extent.runs,
        .run_count = s->extent.run_count,
        .slot = s,
    };
    r->stats.splats += s->extent.splats;
}

int trip_reader_next(trip_reader *r, trip_batch *batch)
{
    if (r->failed)
        return r->failed;
    fill_slots(r);
    if (r->queue_count == 0 && !r->planned)
        return trip_fail(TRIP_ERROR, "read", r->data->path,
                         "all %u slots of the ring are held: release one first", r->params.slots);
    if (r->queue_count == 0)
        return 0;
    slot *s = wait_first(r);
    r->failed = check_slot(r, s);
    if (r->failed) {
        s->state = SLOT_FREE;
        return r->failed;
    }
    s->state = SLOT_DRAWING;
    fill_batch(r, s, batch);
    return 1;
}

void trip_reader_release(trip_reader *r, trip_batch *batch)
{
    slot *s = batch->slot;
    (void)r;
    assert(s->state == SLOT_DRAWING);
    s->state = SLOT_FREE;
    batch->slot = NULL;
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
        drain(r);
        r->ops->destroy(r->engine);
    }
    for (int axis = 0; axis < 3; axis++)
        for (int plane = 0; plane < TRIP_PLANES; plane++)
            if (r->direct_fd[axis][plane] >= 0)
                close(r->direct_fd[axis][plane]);
    release_memory(r);
    pthread_cond_destroy(&r->ready);
    pthread_mutex_destroy(&r->lock);
    free(r);
}
