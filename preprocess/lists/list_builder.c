#include "list_builder.h"

#include <assert.h>
#include <errno.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>

#include "list_merge.h"
#include "piece_pool.h"
#include "report.h"

enum { ORDERED_LIST = TRIP_ORDERED_LIST };

/* A job of the background thread: appends chunks of the ordered list, or spills chunks of the
 * others. */
typedef struct job {
    struct job *next;
    bool ordered;
    trip_chain chains[TRIP_MAX_LISTS];
    trip_checkpoint *checkpoint; /* written after the job; may be NULL */
} job;

struct trip_list_builder {
    trip_list_builder_params params;
    unsigned lists;
    uint32_t (*open)[TRIP_MAX_LISTS];         /* [producer][list]: a producer's current chunk */
    trip_list_output outputs[TRIP_MAX_LISTS]; /* until the merge, only the background thread uses
                                                 the ordered list's output */
    pthread_t thread;
    bool thread_runs;
    trip_scope *scope; /* scope of the creating thread */

    pthread_mutex_t lock; /* guards all members below, and the chunks in their chains */
    pthread_cond_t work, freed;
    trip_piece_pool pool;
    bool stopping, has_spilled;
    int status;
    trip_chain filled[TRIP_MAX_LISTS];
    job *first_job, *last_job;
    unsigned jobs; /* queued or in progress */
};

uint64_t trip_list_builder_min_bytes(const trip_piece_format *f, unsigned producers)
{
    /* Every producer fills one chunk of each list, while the same number of chunks waits for
     * spilling. */
    return (uint64_t)trip_chunk_bytes(f) * 2 * trip_piece_list_count(f) * ((uint64_t)producers + 1);
}

static bool is_spilled(const trip_list_builder *b, unsigned list)
{
    return !(b->params.in_order && list == ORDERED_LIST);
}

static int append_chain(trip_list_builder *b, unsigned list, const trip_chain *chain)
{
    trip_pool_source memory = trip_pool_source_make(&b->pool, list, chain);
    trip_piece_source *source = &memory.source;
    return trip_list_output_merge(&b->outputs[list], &b->params.quantiser, &source, 1);
}

static void free_chain(trip_list_builder *b, trip_chain *c)
{
    pthread_mutex_lock(&b->lock);
    trip_chain_free(&b->pool, c);
    pthread_cond_broadcast(&b->freed);
    pthread_mutex_unlock(&b->lock);
}

/* Writes the checkpoint. Runs on the thread that appends to the ordered list, because the
 * checkpoint contains the lengths of this list. */
static int note_checkpoint(trip_list_builder *b, trip_checkpoint *c)
{
    for (int plane = 0; plane < TRIP_PLANES_OF_VOXELS; plane++)
        c->ordered_bytes[plane] = trip_writer_plane_bytes(b->params.writer, ORDERED_LIST, plane);
    return trip_journal_write_checkpoint(b->params.journal, c, b->params.spill);
}

/* Does a job list by list, and frees each list's chunks, also on failure. */
static int do_chains(trip_list_builder *b, job *j, int status)
{
    for (unsigned list = 0; list < b->lists; list++) {
        if (status == 0 && j->ordered)
            status = append_chain(b, list, &j->chains[list]);
        else if (status == 0)
            status = trip_spill_chain(b->params.spill, list, &b->pool, &j->chains[list]);
        free_chain(b, &j->chains[list]);
    }
    return status == 0 && j->checkpoint ? note_checkpoint(b, j->checkpoint) : status;
}

static void do_job(trip_list_builder *b, job *j, int status)
{
    status = do_chains(b, j, status);
    pthread_mutex_lock(&b->lock);
    if (status < 0 && b->status == 0)
        b->status = status;
    b->jobs--;
    pthread_cond_broadcast(&b->freed);
    pthread_mutex_unlock(&b->lock);
    free(j->checkpoint);
    free(j);
}

static void *thread_main(void *arg)
{
    trip_list_builder *b = arg;
    trip_scope_enter(b->scope);
    pthread_mutex_lock(&b->lock);
    for (;;) {
        while (!b->first_job && !b->stopping)
            pthread_cond_wait(&b->work, &b->lock);
        job *j = b->first_job;
        int status = b->status;
        if (!j)
            break;
        b->first_job = j->next;
        pthread_mutex_unlock(&b->lock);
        do_job(b, j, status);
        pthread_mutex_lock(&b->lock);
    }
    pthread_mutex_unlock(&b->lock);
    return NULL;
}

/* Under the lock: queues the filled chunks of the ordered list or of all others. Frees the
 * checkpoint after the job or on failure. */
static int queue_job(trip_list_builder *b, bool ordered, trip_checkpoint *checkpoint)
{
    job *j = malloc(sizeof *j);
    if (!j) {
        free(checkpoint);
        return b->status = trip_fail(TRIP_ERROR, "brick", "lists", "out of memory");
    }
    *j = (job){ .ordered = ordered, .checkpoint = checkpoint };
    b->has_spilled |= !ordered;
    for (unsigned list = 0; list < b->lists; list++) {
        bool included = is_spilled(b, list) != ordered;
        j->chains[list] = included ? b->filled[list] : trip_chain_empty();
        if (included)
            b->filled[list] = trip_chain_empty();
    }
    if (b->first_job)
        b->last_job->next = j;
    else
        b->first_job = j;
    b->last_job = j;
    b->jobs++;
    pthread_cond_signal(&b->work);
    return 0;
}

/* Under the lock: returns the number of chunks that a spill would free. */
static uint32_t spillable(const trip_list_builder *b)
{
    uint32_t chunks = 0;
    for (unsigned list = 0; list < b->lists; list++)
        chunks += is_spilled(b, list) ? b->filled[list].chunks : 0;
    return chunks;
}

/* Under the lock: waits for a free chunk. */
static int take_chunk(trip_list_builder *b, uint32_t *chunk)
{
    while (b->pool.free.first == TRIP_NO_CHUNK && b->status == 0) {
        if (b->jobs == 0 && spillable(b) == 0)
            b->status =
                trip_fail(TRIP_ERROR, "brick", "lists",
                          "the splats of one slice exceed the memory allowed; raise --memory");
        else if (b->jobs == 0)
            queue_job(b, false, NULL);
        else
            pthread_cond_wait(&b->freed, &b->lock);
    }
    if (b->status == 0)
        *chunk = trip_chain_pop(&b->pool, &b->pool.free);
    return b->status;
}

/* Under the lock: moves a producer's current chunk to the filled chunks. */
static void close_chunk(trip_list_builder *b, unsigned producer, unsigned list)
{
    uint32_t chunk = b->open[producer][list];
    if (chunk != TRIP_NO_CHUNK)
        trip_chain_push(&b->pool, &b->filled[list], chunk);
    b->open[producer][list] = TRIP_NO_CHUNK;
}

static void close_list(trip_list_builder *b, unsigned list)
{
    for (unsigned i = 0; i < b->params.producers; i++)
        close_chunk(b, i, list);
}

static int open_chunk(trip_list_builder *b, unsigned producer, unsigned list)
{
    uint32_t *chunk = &b->open[producer][list];
    pthread_mutex_lock(&b->lock);
    close_chunk(b, producer, list);
    int status = take_chunk(b, chunk);
    pthread_mutex_unlock(&b->lock);
    if (status == 0)
        b->pool.chunks[*chunk].used_bytes = 0;
    return status;
}

int trip_list_builder_reserve(trip_list_builder *b, unsigned producer, unsigned list, size_t bytes,
                              void **memory)
{
    const uint32_t *chunk = &b->open[producer][list];
    int status = 0;
    assert(bytes <= b->pool.chunk_bytes);
    if (*chunk == TRIP_NO_CHUNK || b->pool.chunks[*chunk].used_bytes + bytes > b->pool.chunk_bytes)
        status = open_chunk(b, producer, list);
    if (status < 0)
        return status;
    *memory = trip_chunk_memory(&b->pool, *chunk) + b->pool.chunks[*chunk].used_bytes;
    b->pool.chunks[*chunk].used_bytes += (uint32_t)bytes;
    return 0;
}

/* Under the lock: returns whether a spill is due. It is due when half of the memory is full, so
 * that producers can fill the other half. If all splats seem to fit, it is due only when memory is
 * nearly full. */
static bool is_time_to_spill(const trip_list_builder *b, double done)
{
    const double max = 0.9 * (double)b->pool.chunk_count, now = spillable(b);
    bool fits = !b->has_spilled && now <= max * done;
    return now >= (fits ? max : (double)b->pool.chunk_count / 2);
}

int trip_list_builder_end_batch(trip_list_builder *b, double done)
{
    pthread_mutex_lock(&b->lock);
    if (b->params.in_order) {
        close_list(b, ORDERED_LIST);
        if (b->filled[ORDERED_LIST].first != TRIP_NO_CHUNK)
            queue_job(b, true, NULL);
    }
    int status = b->status;
    bool full = is_time_to_spill(b, done);
    pthread_mutex_unlock(&b->lock);
    return status < 0 ? status : full;
}

int trip_list_builder_spill(trip_list_builder *b, trip_checkpoint *checkpoint)
{
    pthread_mutex_lock(&b->lock);
    for (unsigned list = 0; list < b->lists; list++)
        close_list(b, list);
    int status = queue_job(b, false, checkpoint);
    pthread_mutex_unlock(&b->lock);
    return status;
}

trip_list_output *trip_list_builder_ordered(trip_list_builder *b)
{
    return &b->outputs[ORDERED_LIST];
}

static int note_run(void *user, uint64_t key, const uint32_t *voxels, const uint32_t *normals,
                    uint32_t splats)
{
    trip_run_record run = { key, splats, trip_run_checksum(voxels, normals, splats) };
    return trip_journal_add_run(user, &run);
}

static int create_parts(trip_list_builder *b, trip_budget *budget)
{
    const trip_list_builder_params *p = &b->params;
    int status = trip_piece_pool_create(&b->pool, &p->format, p->dims, p->memory_bytes, budget);
    for (unsigned list = p->from; list < b->lists && status == 0; list++) {
        status = trip_list_output_create(&b->outputs[list], p->first_list + (list - p->from),
                                         &b->pool.formats[list], p->writer, budget);
    }
    b->outputs[ORDERED_LIST].run = p->in_order ? note_run : NULL;
    b->outputs[ORDERED_LIST].run_user = p->journal;
    if (status < 0)
        return status;
    b->open = calloc(p->producers, sizeof *b->open);
    if (!b->open)
        return trip_fail(TRIP_ERROR, "brick", "lists", "out of memory");
    for (unsigned i = 0; i < p->producers; i++)
        for (unsigned list = 0; list < b->lists; list++)
            b->open[i][list] = TRIP_NO_CHUNK;
    return 0;
}

static int start_thread(trip_list_builder *b)
{
    b->scope = trip_scope_current();
    errno = pthread_create(&b->thread, NULL, thread_main, b);
    b->thread_runs = errno == 0;
    return b->thread_runs ? 0 : trip_fail_errno("brick", "threads", "cannot start");
}

int trip_list_builder_create(trip_list_builder **out, const trip_list_builder_params *params,
                             trip_budget *budget)
{
    trip_list_builder *b = calloc(1, sizeof *b);
    *out = NULL;
    if (!b)
        return trip_fail(TRIP_ERROR, "brick", "lists", "out of memory");
    b->params = *params;
    b->lists = trip_piece_list_count(&params->format);
    b->has_spilled = trip_spill_count(params->spill) > 0;
    pthread_mutex_init(&b->lock, NULL);
    pthread_cond_init(&b->work, NULL);
    pthread_cond_init(&b->freed, NULL);
    for (unsigned list = 0; list < TRIP_MAX_LISTS; list++)
        b->filled[list] = trip_chain_empty();
    int status = create_parts(b, budget);
    if (status == 0)
        status = start_thread(b);
    if (status < 0)
        trip_list_builder_destroy(b);
    else
        *out = b;
    return status;
}

/* Ends the background thread, after the queued jobs or, with `now`, at once. */
static void stop_thread(trip_list_builder *b, bool now)
{
    if (!b->thread_runs)
        return;
    pthread_mutex_lock(&b->lock);
    b->stopping = true;
    if (now && b->status == 0)
        b->status = TRIP_ERROR;
    pthread_cond_signal(&b->work);
    pthread_mutex_unlock(&b->lock);
    pthread_join(b->thread, NULL);
    b->thread_runs = false;
}

void trip_list_builder_destroy(trip_list_builder *b)
{
    if (!b)
        return;
    stop_thread(b, true);
    for (unsigned list = 0; list < TRIP_MAX_LISTS; list++)
        trip_list_output_destroy(&b->outputs[list]);
    trip_piece_pool_destroy(&b->pool);
    free(b->open);
    pthread_mutex_destroy(&b->lock);
    pthread_cond_destroy(&b->work);
    pthread_cond_destroy(&b->freed);
    free(b);
}

int trip_list_builder_finish(trip_list_builder *b, const trip_quantiser *quantiser,
                             trip_workers *workers, void (*progress)(void *user, uint64_t splats),
                             void *user)
{
    stop_thread(b, false);
    if (b->status < 0)
        return b->status;
    trip_list_merge merge = { .pool = &b->pool,
                              .in_memory = b->filled,
                              .spill = b->params.spill,
                              .outputs = b->outputs,
                              .quantiser = quantiser };
    for (unsigned list = b->params.from; list < b->lists; list++) {
        close_list(b, list);
        merge.lists[list] = is_spilled(b, list);
    }
    return trip_list_merge_run(&merge, workers, progress, user);
}
