#include "list_builder.h"

#include <assert.h>
#include <errno.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

#include "format.h"
#include "report.h"

enum {
    RADIX_BITS = 11,
    RADIX = 1 << RADIX_BITS,
    MIN_CHUNK_BYTES = 256 << 10,
    PROGRESS_MS = 200,
};

#define NONE UINT32_MAX
/* Pieces are linked by 32-bit counts of 8 bytes. */
#define MAX_POOL_BYTES ((uint64_t)8 * UINT32_MAX)

/* Memory comes in chunks, which hold pieces of one list one after the other. */
typedef struct chunk {
    uint32_t next; /* in the chain that the chunk is in */
    uint32_t used_bytes;
} chunk;

typedef struct chain {
    uint32_t first; /* NONE when empty */
    uint32_t chunks;
} chain;

/* What the background thread is to do: append a list in order, or spill what is in the chains. */
typedef struct job {
    struct job *next;
    bool ordered;
    chain chains[3];
} job;

struct trip_list_builder {
    trip_list_builder_params params;
    trip_budget *budget;
    size_t chunk_bytes, chunk_count;
    unsigned char *pool;
    chunk *chunks;
    uint32_t (*open)[3];       /* [producer][axis], a chunk being filled; the producer's own */
    trip_tile *tile[3];        /* one a list, used by whoever writes it */
    unsigned tile_bits;        /* of the Morton code of a tile, per list the most */
    _Atomic uint64_t appended; /* splats, all lists: progress only, relaxed */
    pthread_t thread;
    bool thread_runs;

    pthread_mutex_t lock; /* guards all below; entries of `chunks` go with their chain */
    pthread_cond_t work, freed;
    bool stopping;
    int status;
    chain free, filled[3];
    job *first_job, *last_job;
    unsigned jobs; /* waiting or being done */
};

static size_t chunk_bytes_for(const trip_piece_format *f)
{
    size_t bytes = MIN_CHUNK_BYTES;
    while (bytes < 4 * trip_piece_max_bytes(f))
        bytes *= 2;
    return bytes;
}

uint64_t trip_list_builder_min_bytes(const trip_piece_format *f, unsigned producers)
{
    /* Every producer fills a chunk of each list; as many again wait to be spilled. */
    return (uint64_t)chunk_bytes_for(f) * (6 * (uint64_t)producers + 6);
}

static unsigned bits_for(uint64_t count)
{
    unsigned bits = 0;
    while (bits < 64 && count > UINT64_C(1) << bits)
        bits++;
    return bits;
}

static void push(trip_list_builder *b, chain *c, uint32_t index)
{
    b->chunks[index].next = c->first;
    c->first = index;
    c->chunks++;
}

static uint32_t pop(trip_list_builder *b, chain *c)
{
    uint32_t index = c->first;
    c->first = b->chunks[index].next;
    c->chunks--;
    return index;
}

static void free_chain(trip_list_builder *b, chain *c)
{
    pthread_mutex_lock(&b->lock);
    while (c->first != NONE)
        push(b, &b->free, pop(b, c));
    pthread_cond_broadcast(&b->freed);
    pthread_mutex_unlock(&b->lock);
}

static const chain empty_chain = { .first = NONE };

static trip_piece *piece_at(const trip_list_builder *b, uint32_t link)
{
    return (trip_piece *)(void *)(b->pool + ((uint64_t)link - 1) * 8);
}

static uint32_t link_of(const trip_list_builder *b, const unsigned char *piece)
{
    return (uint32_t)((uint64_t)(piece - b->pool) / 8 + 1);
}

/* Sorted lists of pieces, link 0 at their ends. */
typedef struct buckets {
    uint32_t first[RADIX], last[RADIX];
} buckets;

static void put_in_bucket(const trip_list_builder *b, buckets *to, uint32_t link, unsigned shift)
{
    trip_piece *p = piece_at(b, link);
    uint64_t sheet = p->key >> TRIP_TILE_MORTON_BITS;
    uint64_t tile = p->key & ((UINT64_C(1) << TRIP_TILE_MORTON_BITS) - 1);
    uint64_t digit = ((sheet << b->tile_bits | tile) >> shift) & (RADIX - 1);
    p->next = 0;
    if (to->first[digit])
        piece_at(b, to->last[digit])->next = link;
    else
        to->first[digit] = link;
    to->last[digit] = link;
}

static uint32_t join_buckets(const trip_list_builder *b, const buckets *from)
{
    uint32_t first = 0, last = 0;
    for (unsigned d = 0; d < RADIX; d++) {
        if (!from->first[d])
            continue;
        if (last)
            piece_at(b, last)->next = from->first[d];
        else
            first = from->first[d];
        last = from->last[d];
    }
    return first;
}

/* Links the pieces of a chain by ascending key (radix sort, least digit first); returns the first.
 */
static uint32_t sort_chain(const trip_list_builder *b, const chain *c, int axis)
{
    unsigned bits = b->tile_bits + bits_for((uint64_t)b->params.dims[axis]);
    buckets now = { 0 };
    for (uint32_t i = c->first; i != NONE; i = b->chunks[i].next) {
        const unsigned char *at = b->pool + i * b->chunk_bytes, *end = at + b->chunks[i].used_bytes;
        while (at < end) {
            put_in_bucket(b, &now, link_of(b, at), 0);
            at += trip_piece_get_parts(&b->params.format, (const void *)at).bytes;
        }
    }
    uint32_t first = join_buckets(b, &now);
    for (unsigned shift = RADIX_BITS; shift < bits; shift += RADIX_BITS) {
        memset(&now, 0, sizeof now);
        for (uint32_t link = first, next; link; link = next) {
            next = piece_at(b, link)->next;
            put_in_bucket(b, &now, link, shift);
        }
        first = join_buckets(b, &now);
    }
    return first;
}

/* Sorted pieces in memory as a source. */
typedef struct memory_source {
    trip_piece_source source; /* first */
    const trip_list_builder *builder;
} memory_source;

static int advance_memory(trip_piece_source *source)
{
    const memory_source *m = (const memory_source *)source;
    source->piece = source->piece->next ? piece_at(m->builder, source->piece->next) : NULL;
    return 0;
}

static memory_source memory_source_of(const trip_list_builder *b, const chain *c, int axis)
{
    uint32_t first = sort_chain(b, c, axis);
    return (memory_source){ { first ? piece_at(b, first) : NULL, advance_memory }, b };
}

/* One list on its way to the data set: a tile is put together until the key changes. */
typedef struct list_output {
    trip_list_builder *builder;
    int axis;
    const trip_quantiser *quantiser;
    uint64_t key;
    bool pending;
    unsigned pieces; /* since the last look for a signal */
} list_output;

/* Every second bit of a Morton code, from bit 0. */
static uint32_t even_bits(uint64_t m)
{
    uint32_t x = 0;
    for (unsigned i = 0; i < TRIP_TILE_MORTON_BITS / 2; i++)
        x |= (uint32_t)(m >> 2 * i & 1) << i;
    return x;
}

static int flush_tile(list_output *o)
{
    trip_list_builder *b = o->builder;
    const uint32_t *voxels, *normals;
    if (!o->pending)
        return 0;
    uint64_t tile = o->key & ((UINT64_C(1) << TRIP_TILE_MORTON_BITS) - 1);
    uint32_t splats = trip_tile_take(b->tile[o->axis], o->quantiser, &voxels, &normals);
    o->pending = false;
    atomic_fetch_add_explicit(&b->appended, splats, memory_order_relaxed);
    return trip_writer_append(b->params.writer, o->axis,
                              (uint32_t)(o->key >> TRIP_TILE_MORTON_BITS), even_bits(tile),
                              even_bits(tile >> 1), voxels, normals, splats);
}

static int output_piece(void *user, const trip_piece *piece)
{
    list_output *o = user;
    int status = 0;
    if (o->pending && piece->key != o->key)
        status = flush_tile(o);
    trip_tile_add(o->builder->tile[o->axis], piece);
    o->key = piece->key;
    o->pending = true;
    if (++o->pieces % 4096 == 0 && trip_interrupted() && status == 0)
        status = trip_fail(TRIP_INTERRUPTED, "brick", "", "interrupted");
    return status;
}

static int output_sources(trip_list_builder *b, int axis, const trip_quantiser *quantiser,
                          trip_piece_source **sources, size_t count)
{
    list_output o = { .builder = b, .axis = axis, .quantiser = quantiser };
    int status = trip_merge(sources, count, output_piece, &o);
    return status == 0 ? flush_tile(&o) : status;
}

static int append_ordered(trip_list_builder *b, const chain *c)
{
    int axis = b->params.ordered_axis;
    memory_source memory = memory_source_of(b, c, axis);
    trip_piece_source *source = &memory.source;
    return output_sources(b, axis, &b->params.quantiser, &source, 1);
}

static int spill_piece(void *user, const trip_piece *piece)
{
    const trip_list_builder *b = user;
    if (trip_interrupted())
        return trip_fail(TRIP_INTERRUPTED, "brick", "", "interrupted");
    return trip_spill_append(b->params.spill, piece,
                             trip_piece_get_parts(&b->params.format, piece).bytes);
}

static int spill_sources(trip_list_builder *b, int axis, trip_piece_source **sources, size_t count)
{
    int status = trip_spill_begin(b->params.spill, axis);
    if (status == 0)
        status = trip_merge(sources, count, spill_piece, b);
    return status == 0 ? trip_spill_end(b->params.spill) : status;
}

static int spill_chain(trip_list_builder *b, int axis, const chain *c)
{
    if (c->first == NONE)
        return 0;
    memory_source memory = memory_source_of(b, c, axis);
    trip_piece_source *source = &memory.source;
    return spill_sources(b, axis, &source, 1);
}

static void do_job(trip_list_builder *b, job *j, int status)
{
    for (int axis = 0; axis < 3; axis++) {
        if (status == 0)
            status = j->ordered ? append_ordered(b, &j->chains[axis])
                                : spill_chain(b, axis, &j->chains[axis]);
        free_chain(b, &j->chains[axis]);
        if (j->ordered)
            break;
    }
    pthread_mutex_lock(&b->lock);
    if (status < 0 && b->status == 0)
        b->status = status;
    b->jobs--;
    pthread_cond_broadcast(&b->freed);
    pthread_mutex_unlock(&b->lock);
    free(j);
}

static void *thread_main(void *arg)
{
    trip_list_builder *b = arg;
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

/* Under the lock: hands the filled chunks over, those of the ordered list or all others'. */
static int queue_job(trip_list_builder *b, bool ordered)
{
    job *j = malloc(sizeof *j);
    if (!j)
        return b->status = trip_fail(TRIP_ERROR, "brick", "lists", "out of memory");
    *j = (job){ .ordered = ordered, .chains = { empty_chain, empty_chain, empty_chain } };
    for (int axis = 0; axis < 3; axis++) {
        if ((axis == b->params.ordered_axis) != ordered)
            continue;
        j->chains[ordered ? 0 : axis] = b->filled[axis];
        b->filled[axis] = empty_chain;
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

/* Under the lock: chunks that a spill would free. */
static uint32_t spillable(const trip_list_builder *b)
{
    uint32_t chunks = 0;
    for (int axis = 0; axis < 3; axis++)
        if (axis != b->params.ordered_axis)
            chunks += b->filled[axis].chunks;
    return chunks;
}

/* Under the lock: a free chunk, NONE on failure. */
static uint32_t take_chunk(trip_list_builder *b)
{
    while (b->free.first == NONE && b->status == 0) {
        if (b->jobs == 0 && spillable(b) == 0)
            b->status = trip_fail(TRIP_ERROR, "brick", "lists",
                                  "one slice of splats does not fit: give more with --memory");
        else if (b->jobs == 0)
            queue_job(b, false);
        else
            pthread_cond_wait(&b->freed, &b->lock);
    }
    return b->status < 0 ? NONE : pop(b, &b->free);
}

static void close_chunk(trip_list_builder *b, unsigned producer, int axis)
{
    uint32_t index = b->open[producer][axis];
    if (index != NONE)
        push(b, &b->filled[axis], index);
    b->open[producer][axis] = NONE;
}

static uint32_t open_chunk(trip_list_builder *b, unsigned producer, int axis)
{
    pthread_mutex_lock(&b->lock);
    close_chunk(b, producer, axis);
    uint32_t index = take_chunk(b);
    pthread_mutex_unlock(&b->lock);
    if (index != NONE)
        b->chunks[index].used_bytes = 0;
    return b->open[producer][axis] = index;
}

void *trip_list_builder_reserve(trip_list_builder *b, unsigned producer, int axis, size_t bytes)
{
    uint32_t index = b->open[producer][axis];
    assert(bytes <= b->chunk_bytes);
    if (index == NONE || b->chunks[index].used_bytes + bytes > b->chunk_bytes)
        index = open_chunk(b, producer, axis);
    if (index == NONE)
        return NULL;
    void *at = b->pool + index * b->chunk_bytes + b->chunks[index].used_bytes;
    b->chunks[index].used_bytes += (uint32_t)bytes;
    return at;
}

static void close_list(trip_list_builder *b, int axis)
{
    for (unsigned i = 0; i < b->params.producers; i++)
        close_chunk(b, i, axis);
}

/* Half of the memory is spilled in the background while producers fill the other. */
int trip_list_builder_end_batch(trip_list_builder *b)
{
    pthread_mutex_lock(&b->lock);
    for (int axis = 0; axis < 3; axis++)
        if (axis == b->params.ordered_axis || spillable(b) >= b->chunk_count / 2)
            close_list(b, axis);
    if (b->params.ordered_axis >= 0 && b->filled[b->params.ordered_axis].first != NONE)
        queue_job(b, true);
    if (spillable(b) >= b->chunk_count / 2)
        queue_job(b, false);
    int status = b->status;
    pthread_mutex_unlock(&b->lock);
    return status;
}

static int create_tiles(trip_list_builder *b)
{
    int status = 0;
    for (int axis = 0; axis < 3 && status == 0; axis++)
        status = trip_tile_create(&b->tile[axis], &b->params.format, b->budget);
    return status;
}

static int create_pool(trip_list_builder *b)
{
    uint64_t bytes =
        b->params.memory_bytes < MAX_POOL_BYTES ? b->params.memory_bytes : MAX_POOL_BYTES;
    b->chunk_bytes = chunk_bytes_for(&b->params.format);
    b->chunk_count = bytes / b->chunk_bytes;
    b->pool = trip_budget_take(b->budget, b->chunk_count * b->chunk_bytes);
    b->chunks = calloc(b->chunk_count, sizeof *b->chunks);
    b->open = calloc(b->params.producers, sizeof *b->open);
    if (!b->pool || !b->chunks || !b->open)
        return trip_fail(TRIP_ERROR, "brick", "lists",
                         "the memory allowed cannot be had: try less --memory");
    for (size_t i = b->chunk_count; i-- > 0;)
        push(b, &b->free, (uint32_t)i);
    for (unsigned i = 0; i < b->params.producers; i++)
        for (int axis = 0; axis < 3; axis++)
            b->open[i][axis] = NONE;
    return 0;
}

static int start_thread(trip_list_builder *b)
{
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
    b->budget = budget;
    pthread_mutex_init(&b->lock, NULL);
    pthread_cond_init(&b->work, NULL);
    pthread_cond_init(&b->freed, NULL);
    b->free = b->filled[0] = b->filled[1] = b->filled[2] = empty_chain;
    for (int axis = 0; axis < 3; axis++) {
        unsigned bits =
            2 * bits_for((uint64_t)(params->dims[axis] >> params->format.tile_log2) + 1);
        b->tile_bits = bits > b->tile_bits ? bits : b->tile_bits;
    }
    int status = create_pool(b);
    if (status == 0)
        status = create_tiles(b);
    if (status == 0)
        status = start_thread(b);
    if (status < 0)
        trip_list_builder_destroy(b);
    else
        *out = b;
    return status;
}

/* Lets the background thread end; with `now`, without doing what is left. */
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
    for (int axis = 0; axis < 3; axis++)
        trip_tile_destroy(b->tile[axis]);
    trip_budget_release(b->budget, b->pool, b->chunk_count * b->chunk_bytes);
    free(b->chunks);
    free(b->open);
    pthread_mutex_destroy(&b->lock);
    pthread_cond_destroy(&b->work);
    pthread_cond_destroy(&b->freed);
    free(b);
}

/* The merge at the end: one list a worker. */
typedef struct last_merge {
    trip_list_builder *builder;
    const trip_quantiser *quantiser;
    int axes[3];
    unsigned count;
} last_merge;

static size_t segments_of(const trip_list_builder *b, int axis)
{
    size_t count = 0;
    for (size_t i = 0; i < trip_spill_count(b->params.spill); i++) {
        const trip_segment *s = trip_spill_segment(b->params.spill, i);
        count += s->axis == (uint32_t)axis && !s->retired;
    }
    return count;
}

/* Sources of one list: its segments on disk, the first `limit`, and what is in memory. */
typedef struct source_set {
    trip_list_builder *builder;
    int axis;
    memory_source memory;
    trip_segment_reader *readers;
    size_t *segments; /* index of each reader's */
    trip_piece_source **sources;
    size_t readers_open, count;
    chain buffers;
} source_set;

static void close_sources(source_set *s)
{
    for (size_t i = 0; i < s->readers_open; i++)
        trip_segment_reader_close(&s->readers[i]);
    free_chain(s->builder, &s->buffers);
    free(s->readers);
    free(s->segments);
    free(s->sources);
}

static int open_segment(source_set *s, size_t index)
{
    trip_list_builder *b = s->builder;
    pthread_mutex_lock(&b->lock);
    uint32_t buffer = pop(b, &b->free);
    push(b, &s->buffers, buffer);
    pthread_mutex_unlock(&b->lock);
    trip_segment_reader *r = &s->readers[s->readers_open];
    int status = trip_segment_reader_open(r, b->params.spill, index, &b->params.format,
                                          b->pool + buffer * b->chunk_bytes, b->chunk_bytes);
    s->segments[s->readers_open++] = index;
    s->sources[s->count++] = &r->source;
    return status;
}

static int open_sources(source_set *s, trip_list_builder *b, int axis, size_t limit)
{
    size_t wanted = segments_of(b, axis);
    wanted = wanted < limit ? wanted : limit;
    *s = (source_set){ .builder = b, .axis = axis, .buffers = empty_chain };
    s->readers = calloc(wanted + 1, sizeof *s->readers);
    s->segments = calloc(wanted + 1, sizeof *s->segments);
    s->sources = calloc(wanted + 1, sizeof(trip_piece_source *));
    if (!s->readers || !s->segments || !s->sources)
        return trip_fail(TRIP_ERROR, "brick", "lists", "out of memory");
    int status = 0;
    for (size_t i = 0; s->readers_open < wanted && status == 0; i++) {
        const trip_segment *segment = trip_spill_segment(b->params.spill, i);
        if (segment->axis == (uint32_t)axis && !segment->retired)
            status = open_segment(s, i);
    }
    return status;
}

static int merge_list(void *user, unsigned thread, uint64_t item)
{
    const last_merge *m = user;
    trip_list_builder *b = m->builder;
    int axis = m->axes[item];
    source_set s;
    (void)thread;
    int status = open_sources(&s, b, axis, SIZE_MAX);
    s.memory = memory_source_of(b, &b->filled[axis], axis);
    if (status == 0)
        s.sources[s.count++] = &s.memory.source;
    if (status == 0)
        status = output_sources(b, axis, m->quantiser, s.sources, s.count);
    close_sources(&s);
    return status;
}

/* Merges as many segments of a list as there are buffers for into one. */
static int consolidate(trip_list_builder *b, int axis, size_t limit)
{
    source_set s;
    int status = open_sources(&s, b, axis, limit);
    if (status == 0)
        status = spill_sources(b, axis, s.sources, s.count);
    for (size_t i = 0; i < s.readers_open && status == 0; i++)
        trip_spill_retire(b->params.spill, s.segments[i]);
    close_sources(&s);
    return status;
}

static size_t segments_of_all(const trip_list_builder *b)
{
    return segments_of(b, 0) + segments_of(b, 1) + segments_of(b, 2);
}

/* Every segment needs a chunk to be read through: makes room for that, then merges segments. */
static int make_room(trip_list_builder *b)
{
    int status = 0;
    if (segments_of_all(b) <= b->free.chunks)
        return 0;
    for (int axis = 0; axis < 3 && status == 0; axis++) {
        status = spill_chain(b, axis, &b->filled[axis]);
        free_chain(b, &b->filled[axis]);
    }
    for (int axis = 0; axis < 3 && status == 0; axis++)
        while (status == 0 && segments_of(b, axis) > b->free.chunks / 3)
            status = consolidate(b, axis, b->free.chunks);
    return status;
}

static void close_all(trip_list_builder *b)
{
    pthread_mutex_lock(&b->lock);
    for (int axis = 0; axis < 3; axis++)
        close_list(b, axis);
    pthread_mutex_unlock(&b->lock);
}

int trip_list_builder_finish(trip_list_builder *b, const trip_quantiser *quantiser,
                             trip_workers *workers, void (*progress)(void *user, uint64_t splats),
                             void *user)
{
    last_merge m = { .builder = b, .quantiser = quantiser };
    stop_thread(b, false);
    close_all(b);
    int status = b->status == 0 ? make_room(b) : b->status;
    if (status < 0)
        return status;
    for (int axis = 0; axis < 3; axis++)
        if (axis != b->params.ordered_axis)
            m.axes[m.count++] = axis;
    trip_workers_start(workers, merge_list, &m, m.count);
    while (!trip_workers_wait(workers, PROGRESS_MS, &status))
        if (progress)
            progress(user, atomic_load_explicit(&b->appended, memory_order_relaxed));
    return status;
}
