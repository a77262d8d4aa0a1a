#include "list_merge.h"

#include <pthread.h>
#include <stdatomic.h>
#include <stdlib.h>

#include "report.h"

enum { PROGRESS_MS = 200 };

/* The user data of spill_piece(). */
typedef struct spilling {
    trip_spill *spill;
    const trip_piece_format *format;
} spilling;

static int spill_piece(void *user, const trip_piece *piece)
{
    const spilling *s = user;
    if (trip_interrupted())
        return trip_fail(TRIP_INTERRUPTED, "brick", "", "interrupted");
    return trip_spill_append(s->spill, piece, trip_piece_get_parts(s->format, piece).bytes);
}

static int spill_sources(trip_spill *spill, unsigned list, const trip_piece_format *format,
                         trip_piece_source **sources, size_t count)
{
    int status = trip_spill_begin(spill, list);
    if (status == 0)
        status = trip_merge(sources, count, spill_piece, &(spilling){ spill, format });
    return status == 0 ? trip_spill_end(spill) : status;
}

int trip_spill_chain(trip_spill *spill, unsigned list, const trip_piece_pool *pool,
                     const trip_chain *chain)
{
    if (chain->first == TRIP_NO_CHUNK)
        return 0;
    trip_pool_source memory = trip_pool_source_make(pool, list, chain);
    trip_piece_source *source = &memory.source;
    return spill_sources(spill, list, &pool->formats[list], &source, 1);
}

/* Shared by all workers. */
typedef struct merge_job {
    const trip_list_merge *merge;
    unsigned lists[TRIP_MAX_LISTS];
    pthread_mutex_t lock; /* guards the free chunks of the pool */
} merge_job;

static size_t sequences_of(const trip_list_merge *m, unsigned list)
{
    size_t count = 0;
    for (size_t i = 0; i < trip_spill_count(m->spill); i++) {
        const trip_sequence *s = trip_spill_sequence(m->spill, i);
        count += s->list == list && !s->retired;
    }
    return count;
}

/* Readers of several sequences of one list. Each reader has a chunk of the pool as its buffer. */
typedef struct source_set {
    merge_job *job;
    trip_sequence_reader *readers;
    size_t *sequences; /* index in the spill of each reader's sequence */
    trip_piece_source **sources;
    size_t count;
    trip_chain buffers;
} source_set;

static void close_sources(source_set *s)
{
    for (size_t i = 0; i < s->count; i++)
        trip_sequence_reader_close(&s->readers[i]);
    pthread_mutex_lock(&s->job->lock);
    trip_chain_free(s->job->merge->pool, &s->buffers);
    pthread_mutex_unlock(&s->job->lock);
    free(s->readers);
    free(s->sequences);
    free(s->sources);
}

static int open_sequence(source_set *s, size_t index, unsigned list)
{
    const trip_list_merge *m = s->job->merge;
    trip_piece_pool *pool = m->pool;
    pthread_mutex_lock(&s->job->lock);
    uint32_t buffer = trip_chain_pop(pool, &pool->free);
    trip_chain_push(pool, &s->buffers, buffer);
    pthread_mutex_unlock(&s->job->lock);
    trip_sequence_reader *r = &s->readers[s->count];
    int status = trip_sequence_reader_open(r, m->spill, index, &pool->formats[list],
                                           trip_chunk_memory(pool, buffer), pool->chunk_bytes);
    s->sequences[s->count] = index;
    s->sources[s->count++] = &r->source;
    return status;
}

/* Opens the first `limit` sequences of a list. The arrays have room for one more source. */
static int open_sources(source_set *s, merge_job *job, unsigned list, size_t limit)
{
    const trip_list_merge *m = job->merge;
    size_t wanted = sequences_of(m, list);
    wanted = wanted < limit ? wanted : limit;
    *s = (source_set){ .job = job, .buffers = trip_chain_empty() };
    s->readers = calloc(wanted + 1, sizeof *s->readers);
    s->sequences = calloc(wanted + 1, sizeof *s->sequences);
    s->sources = calloc(wanted + 1, sizeof(trip_piece_source *));
    if (!s->readers || !s->sequences || !s->sources)
        return trip_fail(TRIP_ERROR, "brick", "lists", "out of memory");
    int status = 0;
    for (size_t i = 0; s->count < wanted && status == 0; i++) {
        const trip_sequence *sequence = trip_spill_sequence(m->spill, i);
        if (sequence->list == list && !sequence->retired)
            status = open_sequence(s, i, list);
    }
    return status;
}

static int merge_list(void *user, unsigned thread, uint64_t item)
{
    merge_job *job = user;
    const trip_list_merge *m = job->merge;
    unsigned list = job->lists[item];
    source_set s;
    (void)thread;
    int status = open_sources(&s, job, list, SIZE_MAX);
    if (status == 0) {
        trip_pool_source memory = trip_pool_source_make(m->pool, list, &m->in_memory[list]);
        s.sources[s.count] = &memory.source;
        status = trip_list_output_merge(&m->outputs[list], m->quantiser, s.sources, s.count + 1);
    }
    close_sources(&s);
    return status;
}

/* Merges sequences of a list into one. Each needs a free chunk as its buffer, which limits their
 * number. */
static int consolidate(merge_job *job, unsigned list)
{
    const trip_list_merge *m = job->merge;
    source_set s;
    int status = open_sources(&s, job, list, m->pool->free.chunks);
    if (status == 0)
        status = spill_sources(m->spill, list, &m->pool->formats[list], s.sources, s.count);
    for (size_t i = 0; i < s.count && status == 0; i++)
        trip_spill_retire(m->spill, s.sequences[i]);
    close_sources(&s);
    return status;
}

/* Ensures that there is a free chunk for every sequence. If there are too few, spills all pieces in
 * memory, then merges sequences until the free chunks suffice. */
static int make_room(merge_job *job)
{
    const trip_list_merge *m = job->merge;
    size_t sequences = 0;
    int status = 0;
    unsigned lists = 0;
    for (unsigned list = 0; list < TRIP_MAX_LISTS; list++) {
        sequences += m->lists[list] ? sequences_of(m, list) : 0;
        lists += m->lists[list];
    }
    if (sequences <= m->pool->free.chunks)
        return 0;
    for (unsigned list = 0; list < TRIP_MAX_LISTS && status == 0; list++) {
        status = trip_spill_chain(m->spill, list, m->pool, &m->in_memory[list]);
        trip_chain_free(m->pool, &m->in_memory[list]);
    }
    for (unsigned list = 0; list < TRIP_MAX_LISTS && status == 0; list++)
        while (status == 0 && sequences_of(m, list) > m->pool->free.chunks / (size_t)lists)
            status = consolidate(job, list);
    return status;
}

static uint64_t splats_so_far(const trip_list_merge *m)
{
    uint64_t splats = 0;
    for (unsigned list = 0; list < TRIP_MAX_LISTS; list++)
        splats += atomic_load_explicit(&m->outputs[list].splats, memory_order_relaxed);
    return splats;
}

int trip_list_merge_run(const trip_list_merge *m, trip_workers *workers,
                        void (*progress)(void *user, uint64_t splats), void *user)
{
    merge_job job = { .merge = m };
    unsigned lists = 0;
    for (unsigned list = 0; list < TRIP_MAX_LISTS; list++)
        if (m->lists[list])
            job.lists[lists++] = list;
    pthread_mutex_init(&job.lock, NULL);
    int status = make_room(&job);
    if (status == 0) {
        trip_workers_start(workers, merge_list, &job, lists);
        while (!trip_workers_wait(workers, PROGRESS_MS, &status))
            if (progress)
                progress(user, splats_so_far(m));
    }
    pthread_mutex_destroy(&job.lock);
    return status;
}
