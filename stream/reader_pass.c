/* Runs passes: plans and requests extents as slots become free, and hands them out in draw order.
 */
#include "reader.h"

#include "clock.h"
#include "reader_state.h"
#include "report.h"

#include <assert.h>
#include <stdatomic.h>
#include <stdio.h>
#include <string.h>
#include <time.h>

/* Interval of the checks for an interruption while waiting. */
#define LOOK_NS UINT64_C(20000000)

/* Runs on an engine's thread, as its last access to the request. */
static void request_done(trip_request *q)
{
    trip_slot *s = q->owner;
    trip_reader *r = s->reader;
    pthread_mutex_lock(&r->lock);
    if (--s->pending == 0)
        pthread_cond_signal(&r->ready);
    pthread_mutex_unlock(&r->lock);
}

static trip_request *add_request(trip_slot *s, const trip_source *source,
                                 const trip_byte_range *range, uint64_t offset, size_t bytes,
                                 unsigned char *data)
{
    trip_request *q = &s->requests[s->request_count++];
    uint64_t left = source->file_bytes - offset;
    q->source = source;
    q->data = data;
    q->offset = offset;
    q->bytes = bytes < left ? bytes : (size_t)left;
    q->done = request_done;
    q->owner = s;
    q->list = range->list;
    q->plane = range->plane;
    q->cached = q->keep = false;
    trip_request_start(q);
    return q;
}

/* Returns the bytes from `offset` on, at least a page, in which either all or no pages are cached.
 */
static size_t alike_bytes(trip_reader *r, const trip_source *source, uint64_t offset, size_t bytes,
                          bool cached)
{
    uint32_t page = source->first_page + (uint32_t)(offset >> source->page_log2);
    size_t page_bytes = (size_t)1 << source->page_log2, at = page_bytes;
    while (at < bytes && trip_cache_find(r->cache, ++page) == cached)
        at += page_bytes;
    return at;
}

static void reserve_pages(trip_reader *r, const trip_request *q)
{
    uint32_t page = q->source->first_page + (uint32_t)(q->offset >> q->source->page_log2);
    for (size_t at = 0; at < q->bytes; at += (size_t)1 << q->source->page_log2)
        trip_cache_reserve(r->cache, page++, q);
}

/* Adds requests for bytes [at, end) of a range. There is one request, or cached and other parts
 * alternate. The slot keeps at least one request for each following range. */
static void add_requests(trip_reader *r, trip_slot *s, const trip_byte_range *range, size_t at,
                         size_t end)
{
    const trip_source *source = &r->sources[range->list->index][range->plane];
    unsigned char *data = s->memory + range->slot_offset;
    unsigned last = TRIP_SLOT_REQUESTS_MAX - TRIP_RANGES_MAX;
    while (at < end) {
        uint64_t offset = range->offset + at;
        size_t bytes = end - at;
        uint32_t page = source->first_page + (uint32_t)(offset >> source->page_log2);
        bool split = r->cache && s->request_count < last;
        bool cached = split && trip_cache_find(r->cache, page);
        if (split)
            bytes = alike_bytes(r, source, offset, bytes, cached);
        trip_request *q = add_request(s, source, range, offset, bytes, data + at);
        q->cached = cached;
        q->keep = split && !cached;
        if (q->keep)
            reserve_pages(r, q);
        at += bytes;
    }
}

static void enqueue(trip_reader *r, trip_slot *s)
{
    s->state = TRIP_SLOT_READING;
    s->pending = s->request_count;
    r->queue[(r->queue_first + r->queue_count++) % r->params.slots] = s;
}

static void submit(trip_reader *r, trip_slot *s)
{
    size_t page = r->planner.page_bytes;
    for (unsigned i = 0; i < s->extent.range_count; i++) {
        const trip_byte_range *range = &s->extent.ranges[i];
        size_t first, end;
        trip_borders_trim(&r->borders, range, page, &s->from_borders, &first, &end);
        add_requests(r, s, range, first, end);
    }
    trip_borders_find(&s->borders, &s->extent, s->pass->descending, page);
    r->borders = s->borders;
    for (unsigned i = 0; i < s->request_count; i++)
        s->requests[i].next = i + 1 < s->request_count ? &s->requests[i + 1] : NULL;
    enqueue(r, s);
    if (s->request_count > 0)
        r->ops->submit(r->engine, s->requests);
}

static void enter_pass(trip_reader *r)
{
    if (r->pass == r->pass_count)
        return;
    trip_planner_begin(&r->planner, r->passes[r->pass], r->cursors);
    if (r->cache)
        r->cache_pass = trip_cache_begin_pass(r->cache);
}

/* Plans the content of the slot, from the current pass or the passes after it. Returns false if no
 * runs are left. */
static bool plan_slot(trip_reader *r, trip_slot *s)
{
    for (; r->pass < r->pass_count; r->pass++, enter_pass(r)) {
        s->pass = r->passes[r->pass];
        if (trip_planner_fill(&r->planner, &s->extent))
            return true;
    }
    return false;
}

/* Frees the slots that were given up and have nothing pending. */
static void reclaim_slots(trip_reader *r)
{
    uint32_t first_pass = UINT32_MAX;
    pthread_mutex_lock(&r->lock);
    for (unsigned i = 0; i < r->params.slots; i++) {
        trip_slot *s = &r->slots[i];
        if (s->state != TRIP_SLOT_GIVEN_UP)
            continue;
        if (s->pending == 0) {
            s->state = TRIP_SLOT_FREE;
            r->given_up_count--;
        } else if (s->cache_pass < first_pass) {
            first_pass = s->cache_pass;
        }
    }
    pthread_mutex_unlock(&r->lock);
    if (r->cache)
        trip_cache_end_passes(r->cache, first_pass);
}

/* Plans and requests as many slots as are free. If no reads need to run ahead, plans only the next
 * slot, since later more runs may be skipped. */
static void fill_slots(trip_reader *r)
{
    if (r->given_up_count > 0)
        reclaim_slots(r);
    for (unsigned i = 0; i < r->params.slots && !(r->in_memory && r->queue_count); i++) {
        trip_slot *s = &r->slots[i];
        if (s->state != TRIP_SLOT_FREE)
            continue;
        if (!plan_slot(r, s))
            break;
        s->request_count = s->borders.count = s->from_borders.count = 0;
        s->cache_pass = r->cache_pass;
        if (r->runs_only || r->in_memory)
            enqueue(r, s);
        else
            submit(r, s);
    }
}

static void count_requests(trip_reader *r, const trip_slot *s)
{
    for (unsigned i = 0; i < s->request_count; i++) {
        const trip_request *q = &s->requests[i];
        r->stats.reads += q->reads;
        *(q->cached ? &r->stats.bytes_cached : &r->stats.bytes_read) += q->done_bytes;
        r->list_bytes[q->list->index] += q->cached ? 0 : q->done_bytes;
    }
}

/* Gives up the slots being read, without waiting. */
static void give_up_slots(trip_reader *r)
{
    for (; r->queue_count > 0; r->queue_count--) {
        trip_slot *s = r->queue[r->queue_first];
        r->queue_first = (r->queue_first + 1) % r->params.slots;
        for (unsigned i = 0; i < s->request_count; i++)
            atomic_store_explicit(&s->requests[i].given_up, true, memory_order_relaxed);
        s->state = TRIP_SLOT_GIVEN_UP;
        r->given_up_count++;
    }
}

/* Whether the first slot of the queue has been read, or a slot that was given up can be used again.
 * Requires the lock. */
static bool slot_is_ready(const trip_reader *r)
{
    if (r->queue_count > 0 && r->queue[r->queue_first]->pending == 0)
        return true;
    for (unsigned i = 0; i < r->params.slots; i++)
        if (r->slots[i].state == TRIP_SLOT_GIVEN_UP && r->slots[i].pending == 0)
            return true;
    return false;
}

/* Waits until slot_is_ready(). Returns false after the timeout. */
static bool wait_for_slot(trip_reader *r, const struct timespec *until)
{
    int late = 0;
    uint64_t start = trip_now_ns();
    pthread_mutex_lock(&r->lock);
    while (!slot_is_ready(r) && !late)
        late = pthread_cond_timedwait(&r->ready, &r->lock, until);
    bool ready = slot_is_ready(r);
    pthread_mutex_unlock(&r->lock);
    r->stats.wait_ns += trip_now_ns() - start;
    return ready;
}

/* Whether trip_reader_next() would not wait. */
static bool has_answer(trip_reader *r)
{
    if (r->queue_count == 0)
        return r->given_up_count == 0 || r->pass == r->pass_count;
    pthread_mutex_lock(&r->lock);
    bool read = r->queue[r->queue_first]->pending == 0;
    pthread_mutex_unlock(&r->lock);
    return read;
}

static struct timespec time_after(uint64_t timeout_ns)
{
    uint64_t end;
    if (__builtin_add_overflow(trip_now_ns(), timeout_ns, &end) || end > INT64_MAX)
        end = INT64_MAX;
    return (struct timespec){ .tv_sec = (time_t)(end / 1000000000u),
                              .tv_nsec = (long)(end % 1000000000u) };
}

/* Waits for the next slot, at most for the timeout. */
static bool await_slot(trip_reader *r, uint64_t timeout_ns)
{
    const uint64_t begin = trip_now_ns();
    while (!r->failed) {
        fill_slots(r);
        if (has_answer(r))
            return true;
        const uint64_t passed = trip_now_ns() - begin;
        if (passed >= timeout_ns || trip_interrupted())
            return false;
        const uint64_t left = timeout_ns - passed;
        const struct timespec until = time_after(left < LOOK_NS ? left : LOOK_NS);
        wait_for_slot(r, &until);
    }
    return true;
}

/* Takes the first slot of the queue, which has been read. */
static trip_slot *take_first(trip_reader *r)
{
    trip_slot *s = r->queue[r->queue_first];
    r->queue_first = (r->queue_first + 1) % r->params.slots;
    r->queue_count--;
    count_requests(r, s);
    return s;
}

void trip_reader_drain(trip_reader *r)
{
    const struct timespec until = time_after(UINT64_MAX);
    give_up_slots(r);
    for (reclaim_slots(r); r->given_up_count > 0; reclaim_slots(r))
        wait_for_slot(r, &until);
}

void trip_reader_set_runs_only(trip_reader *r, bool runs_only)
{
    give_up_slots(r);
    r->runs_only = runs_only;
}

static void release_slot(trip_batch *batch)
{
    trip_slot *s = batch->slot;
    assert(s->state == TRIP_SLOT_DRAWING);
    s->state = TRIP_SLOT_FREE;
    batch->slot = NULL;
}

/* Releases the slot that the computation of normals uses. */
static void release_read(trip_reader *r)
{
    if (r->read.slot)
        release_slot(&r->read);
}

int trip_reader_begin(trip_reader *r, const trip_pass *pass)
{
    if (r->normals)
        trip_computed_normals_begin(r->normals);
    release_read(r);
    r->computing = false;
    give_up_slots(r);
    for (unsigned i = 0; i < r->params.slots; i++)
        assert(r->slots[i].state != TRIP_SLOT_DRAWING);
    r->stats = (trip_reader_stats){ 0 };
    memset(r->list_bytes, 0, r->data->list_count * sizeof *r->list_bytes);
    r->pass = r->pass_count = 0;
    r->borders.count = 0;
    r->failed = 0;
    r->planner = (trip_planner){ .planes = r->params.planes,
                                 .normal_bytes = r->data->header.normal_bytes,
                                 .page_bytes = (size_t)1 << r->data->header.page_log2,
                                 .slot_bytes = r->params.slot_bytes,
                                 .gap_bytes = r->in_memory ? SIZE_MAX : r->params.gap_bytes,
                                 .one_piece = r->in_memory,
                                 .skip = r->params.skip,
                                 .skip_user = r->params.skip_user };
    if (r->cache)
        trip_cache_begin_frame(r->cache);
    reclaim_slots(r);
    return pass ? trip_reader_then(r, pass) : TRIP_OK;
}

int trip_reader_then(trip_reader *r, const trip_pass *pass)
{
    if (r->pass_count == TRIP_READER_PASSES_MAX)
        return trip_fail(TRIP_ERROR, "read", r->data->path, "more than %d passes at a time",
                         TRIP_READER_PASSES_MAX);
    if (pass->selection_count > r->data->list_count)
        return trip_fail(TRIP_ERROR, "read", r->data->path,
                         "%u selections in a pass, more than the data set has lists",
                         pass->selection_count);
    r->computing = r->normals && pass->around && !r->runs_only;
    if (r->computing) {
        r->drawn_passes[r->pass_count] = pass;
        pass = pass->around;
    }
    r->passes[r->pass_count++] = pass;
    if (r->pass == r->pass_count - 1)
        enter_pass(r);
    fill_slots(r);
    return TRIP_OK;
}

static int report_fault(const trip_request *q)
{
    char name[32], where[4096];
    unsigned long long at = q->fault_at;
    snprintf(where, sizeof where, "%s/%s", q->list->path,
             trip_list_plane_name(q->list, q->plane, name));
    if (q->fault == TRIP_REQUEST_CHECKSUM)
        return trip_fail(
            TRIP_ERROR, "read", where,
            "byte %llu: the page that starts here is damaged (checksum); make the data set again",
            at);
    if (q->fault == TRIP_REQUEST_SHORT)
        return trip_fail(TRIP_ERROR, "read", where, "byte %llu: the file ends early", at);
    char reason[256];
    return trip_fail(TRIP_ERROR, "read", where, "byte %llu: cannot read: %s", at,
                     trip_errno_text(q->fault_errno, reason, sizeof reason));
}

static int check_slot(const trip_slot *s)
{
    for (unsigned i = 0; i < s->request_count; i++)
        if (s->requests[i].fault != TRIP_REQUEST_OK)
            return report_fault(&s->requests[i]);
    return TRIP_OK;
}

/* Returns the address of a slot's part of a plane. With in_memory, an extent is one piece in the
 * cache. */
static const unsigned char *plane_memory(const trip_reader *r, const trip_slot *s, int plane)
{
    if (r->runs_only || !r->read_planes[plane])
        return NULL;
    if (!r->in_memory)
        return s->memory + s->extent.plane_at[plane];
    for (unsigned i = 0; i < s->extent.range_count; i++) {
        const trip_byte_range *range = &s->extent.ranges[i];
        if (range->plane == plane)
            return trip_cache_bytes(r->cache, range->list->index, plane, range->offset);
    }
    return NULL;
}

/* Returns the offset of a run's block in its file. */
static unsigned long long block_offset(const trip_slot *s, const trip_run *run)
{
    size_t at = s->extent.plane_at[TRIP_PLANE_VOXELS] + run->at[TRIP_PLANE_VOXELS];
    const trip_byte_range *range = s->extent.ranges;
    while (at < range->slot_offset || at - range->slot_offset >= range->bytes)
        range++;
    return range->offset + (at - range->slot_offset);
}

static int report_block(const trip_batch *b, const trip_run *run, const char *why)
{
    const trip_list *list = trip_batch_list(b, run);
    char name[32], where[4096];
    snprintf(where, sizeof where, "%s/%s", list->path,
             trip_list_plane_name(list, TRIP_PLANE_VOXELS, name));
    return trip_fail(TRIP_ERROR, "read", where, "byte %llu: %s; make the data set again",
                     block_offset(b->slot, run), why);
}

static const char *fault_of(const trip_batch *b, const trip_run *run)
{
    const trip_block block = trip_block_of(b, run);
    const trip_list *list = trip_batch_list(b, run);
    return trip_kind_of(list->kind)->check(&block, &list->bricks[run->brick]);
}

/* Number of runs that one task checks. */
enum { CHECKED_AT_ONCE = 32 };

typedef struct block_check {
    const trip_batch *batch;
    _Atomic size_t first; /* first faulty run found so far */
} block_check;

static void check_some(void *context, unsigned number)
{
    block_check *check = context;
    const trip_batch *b = check->batch;
    const size_t from = (size_t)number * CHECKED_AT_ONCE, end = from + CHECKED_AT_ONCE;
    for (size_t i = from; i < end && i < b->run_count; i++) {
        if (!fault_of(b, &b->runs[i]))
            continue;
        size_t first = atomic_load(&check->first);
        while (i < first && !atomic_compare_exchange_weak(&check->first, &first, i))
            ;
        return;
    }
}

/* Renderers use blocks without further checks, so blocks that disagree with their bricks are
 * refused here. Blocks in memory were checked when they were loaded. */
static int check_blocks(const trip_reader *r, const trip_batch *b)
{
    block_check check = { .batch = b, .first = b->run_count };
    if (r->in_memory || !b->planes[TRIP_PLANE_VOXELS])
        return TRIP_OK;
    trip_run_tasks(&r->params.runner, check_some, &check,
                   (unsigned)((b->run_count + CHECKED_AT_ONCE - 1) / CHECKED_AT_ONCE));
    if (check.first == b->run_count)
        return TRIP_OK;
    const trip_run *run = &b->runs[check.first];
    return report_block(b, run, fault_of(b, run));
}

static void copy_borders(trip_reader *r, const trip_slot *s)
{
    size_t page = r->planner.page_bytes;
    trip_borders_fetch(&s->from_borders, r->border_memory, s->memory, page);
    trip_borders_keep(&s->borders, r->border_memory, s->memory, page);
}

static void fill_batch(trip_reader *r, trip_slot *s, trip_batch *batch)
{
    *batch = (trip_batch){
        .pass = s->pass,
        .splats = s->extent.records,
        .runs = s->extent.runs,
        .run_count = s->extent.run_count,
        .slot = s,
    };
    for (int plane = 0; plane < TRIP_PLANES; plane++) {
        batch->planes[plane] = plane_memory(r, s, plane);
        batch->plane_bytes[plane] = batch->planes[plane] ? s->extent.plane_bytes[plane] : 0;
    }
}

/* Takes the next slot as a batch. Returns as trip_reader_next(). */
static int next_slot(trip_reader *r, trip_batch *batch)
{
    const bool answered = await_slot(r, UINT64_MAX);
    if (r->failed)
        return r->failed;
    if (!answered)
        return trip_fail(TRIP_INTERRUPTED, "read", r->data->path, "interrupted");
    if (r->queue_count == 0 && r->pass == r->pass_count)
        return 0;
    if (r->queue_count == 0)
        return trip_fail(TRIP_ERROR, "read", r->data->path,
                         "all %u slots of the ring are in use; release one first", r->params.slots);
    trip_slot *s = take_first(r);
    r->failed = check_slot(s);
    if (!r->failed) {
        copy_borders(r, s);
        fill_batch(r, s, batch);
        r->failed = check_blocks(r, batch);
    }
    s->state = r->failed ? TRIP_SLOT_FREE : TRIP_SLOT_DRAWING;
    if (r->failed)
        *batch = (trip_batch){ 0 };
    return r->failed ? r->failed : 1;
}

/* ---- computed normals ---- */

/* Returns the pass that is drawn, by the pass that is read for it. */
static const trip_pass *drawn_pass(const trip_reader *r, const trip_pass *around)
{
    for (unsigned i = 0; i < r->pass_count; i++)
        if (r->passes[i] == around)
            return r->drawn_passes[i];
    return NULL;
}

/* Passes the next slot, or the end, on to the computation. */
static void read_values(trip_reader *r)
{
    const int status = next_slot(r, &r->read);
    if (status > 0)
        trip_computed_normals_add(r->normals, &r->read, drawn_pass(r, r->read.pass));
    else if (status == 0)
        trip_computed_normals_end(r->normals);
}

/* Reads and computes until a batch is ready, or all runs were handed out. Works on at least one
 * slot, then until the timeout. */
static bool await_normals(trip_reader *r, uint64_t timeout_ns)
{
    const uint64_t begin = trip_now_ns();
    uint64_t passed = 0;
    if (trip_computed_normals_is_held(r->normals))
        return false;
    do {
        if (r->failed || trip_computed_normals_work(r->normals) != TRIP_NORMALS_WANT)
            return true;
        release_read(r);
        if (!await_slot(r, timeout_ns - passed))
            return false;
        read_values(r);
        passed = trip_now_ns() - begin;
    } while (passed < timeout_ns);
    return false;
}

static int next_with_normals(trip_reader *r, trip_batch *batch)
{
    const bool answered = await_normals(r, UINT64_MAX);
    if (r->failed)
        return r->failed;
    if (!answered && trip_computed_normals_is_held(r->normals))
        return trip_fail(TRIP_ERROR, "read", r->data->path,
                         "normals are computed one batch at a time; release the batch first");
    if (!answered)
        return trip_fail(TRIP_INTERRUPTED, "read", r->data->path, "interrupted");
    if (trip_computed_normals_work(r->normals) == TRIP_NORMALS_OVER)
        return 0;
    trip_computed_normals_take(r->normals, batch);
    return 1;
}

/* ---- batches ---- */

bool trip_reader_await(trip_reader *r, uint64_t timeout_ns)
{
    return r->computing ? await_normals(r, timeout_ns) : await_slot(r, timeout_ns);
}

int trip_reader_next(trip_reader *r, trip_batch *batch)
{
    const int status = r->computing ? next_with_normals(r, batch) : next_slot(r, batch);
    if (status > 0)
        r->stats.splats += batch->splats;
    return status;
}

void trip_reader_release(trip_reader *r, trip_batch *batch)
{
    if (r->computing)
        trip_computed_normals_release(r->normals);
    else
        release_slot(batch);
}
