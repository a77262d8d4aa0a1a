/* Reads with io_uring. The reader's thread owns the submission queue. The checking threads own the
 * completion queue: one waits in the kernel while the others check earlier completions. */
#include "engine.h"

#include <assert.h>
#include <errno.h>
#include <liburing.h>
#include <pthread.h>
#include <stdlib.h>
#include <time.h>

enum { SUBMISSION_ENTRIES = 64, COMPLETION_ENTRIES_MAX = 32768 };

typedef struct uring_engine {
    struct io_uring ring;
    pthread_mutex_t completions; /* held by the thread that waits */
    unsigned thread_count;
    pthread_t threads[];
} uring_engine;

/* Submits the queue to the kernel. Retries if the kernel is short of memory or overloaded. */
static void submit_queue(uring_engine *e)
{
    while (io_uring_sq_ready(&e->ring) > 0)
        if (io_uring_submit(&e->ring) < 0)
            nanosleep(&(struct timespec){ .tv_nsec = 100000 }, NULL);
}

static struct io_uring_sqe *get_entry(uring_engine *e)
{
    struct io_uring_sqe *sqe;
    while (!(sqe = io_uring_get_sqe(&e->ring)))
        submit_queue(e);
    return sqe;
}

static void uring_submit(void *engine, trip_request *chain)
{
    uring_engine *e = engine;
    for (trip_request *q = chain, *next; q; q = next) {
        trip_read read = trip_request_read(q);
        struct io_uring_sqe *sqe = get_entry(e);
        next = q->next;
        if (q->cached)
            io_uring_prep_nop(sqe);
        else
            io_uring_prep_read(sqe, read.fd, read.data, (unsigned)read.bytes, read.offset);
        io_uring_sqe_set_data(sqe, q);
        /* Release, for the thread that reaps the request. The kernel is not specified to order the
         * two. */
        atomic_store_explicit(&q->given, true, memory_order_release);
    }
    submit_queue(e);
}

/* Waits for a completion. Returns NULL if the engine stops. */
static trip_request *reap(uring_engine *e, int *result)
{
    struct io_uring_cqe *cqe;
    pthread_mutex_lock(&e->completions);
    while (io_uring_wait_cqe(&e->ring, &cqe) < 0)
        ;
    trip_request *q = io_uring_cqe_get_data(cqe);
    *result = cqe->res;
    io_uring_cqe_seen(&e->ring, cqe);
    pthread_mutex_unlock(&e->completions);
    return q;
}

static void *work(void *engine)
{
    trip_request *q;
    int result;
    while ((q = reap(engine, &result))) {
        /* Acquires the writes released in uring_submit(). */
        bool given = atomic_load_explicit(&q->given, memory_order_acquire);
        assert(given);
        (void)given;
        if (q->cached || trip_request_step(q, result))
            trip_request_run(q);
    }
    return NULL;
}

static void submit_empty(uring_engine *e, unsigned count)
{
    while (count-- > 0) {
        struct io_uring_sqe *sqe = get_entry(e);
        io_uring_prep_nop(sqe);
        io_uring_sqe_set_data(sqe, NULL);
    }
    submit_queue(e);
}

static void uring_destroy(void *engine)
{
    uring_engine *e = engine;
    submit_empty(e, e->thread_count);
    for (unsigned i = 0; i < e->thread_count; i++)
        pthread_join(e->threads[i], NULL);
    io_uring_queue_exit(&e->ring);
    pthread_mutex_destroy(&e->completions);
    free(e);
}

/* Sets up the ring and sends an empty request through it, since a system call filter may allow one
 * but not the other. */
static int create_ring(struct io_uring *ring, unsigned depth)
{
    struct io_uring_params params = { .flags = IORING_SETUP_CQSIZE };
    struct io_uring_cqe *cqe;
    unsigned entries = SUBMISSION_ENTRIES;
    while (entries < depth && entries < COMPLETION_ENTRIES_MAX)
        entries *= 2;
    params.cq_entries = entries;
    int status = io_uring_queue_init_params(SUBMISSION_ENTRIES, ring, &params);
    if (status < 0)
        return status;
    io_uring_prep_nop(io_uring_get_sqe(ring));
    status = io_uring_submit_and_wait(ring, 1);
    if (status >= 0)
        status = io_uring_peek_cqe(ring, &cqe);
    if (status >= 0)
        io_uring_cqe_seen(ring, cqe);
    else
        io_uring_queue_exit(ring);
    return status;
}

static int uring_create(void **engine, unsigned depth, unsigned threads)
{
    uring_engine *e = calloc(1, sizeof *e + threads * sizeof *e->threads);
    if (!e)
        return -ENOMEM;
    int status = create_ring(&e->ring, depth);
    if (status < 0) {
        free(e);
        return status;
    }
    pthread_mutex_init(&e->completions, NULL);
    for (; e->thread_count < threads && status == 0; e->thread_count += status == 0)
        status = -pthread_create(&e->threads[e->thread_count], NULL, work, e);
    if (e->thread_count == 0) {
        uring_destroy(e);
        return status;
    }
    *engine = e;
    return 0;
}

const trip_engine_ops trip_engine_uring = {
    .name = "io_uring",
    .create = uring_create,
    .submit = uring_submit,
    .destroy = uring_destroy,
};
