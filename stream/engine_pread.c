/* Reads with pread(2) on threads. Works on every kernel and file system. */
#include "engine.h"

#include <errno.h>
#include <pthread.h>
#include <stdlib.h>

typedef struct pread_engine {
    pthread_mutex_t lock;
    pthread_cond_t work;
    trip_request *first, *last; /* guarded by lock: requests that no thread has taken yet */
    bool stop;                  /* guarded by lock */
    unsigned thread_count;
    pthread_t threads[];
} pread_engine;

/* Returns the next request in order, or NULL if the engine stops. */
static trip_request *take(pread_engine *e)
{
    pthread_mutex_lock(&e->lock);
    while (!e->first && !e->stop)
        pthread_cond_wait(&e->work, &e->lock);
    trip_request *q = e->first;
    if (q)
        e->first = q->next;
    pthread_mutex_unlock(&e->lock);
    return q;
}

static void *work(void *engine)
{
    trip_request *q;
    while ((q = take(engine)))
        trip_request_run(q);
    return NULL;
}

static void pread_submit(void *engine, trip_request *chain)
{
    pread_engine *e = engine;
    trip_request *last = chain;
    while (last->next)
        last = last->next;
    pthread_mutex_lock(&e->lock);
    if (e->first)
        e->last->next = chain;
    else
        e->first = chain;
    e->last = last;
    pthread_cond_broadcast(&e->work);
    pthread_mutex_unlock(&e->lock);
}

static void pread_destroy(void *engine)
{
    pread_engine *e = engine;
    pthread_mutex_lock(&e->lock);
    e->stop = true;
    pthread_cond_broadcast(&e->work);
    pthread_mutex_unlock(&e->lock);
    for (unsigned i = 0; i < e->thread_count; i++)
        pthread_join(e->threads[i], NULL);
    pthread_cond_destroy(&e->work);
    pthread_mutex_destroy(&e->lock);
    free(e);
}

static int pread_create(void **engine, unsigned depth, unsigned threads)
{
    pread_engine *e = calloc(1, sizeof *e + threads * sizeof *e->threads);
    (void)depth;
    if (!e)
        return -ENOMEM;
    pthread_mutex_init(&e->lock, NULL);
    pthread_cond_init(&e->work, NULL);
    for (; e->thread_count < threads; e->thread_count++) {
        int number = pthread_create(&e->threads[e->thread_count], NULL, work, e);
        if (number && e->thread_count == 0) {
            pread_destroy(e);
            return -number;
        }
        if (number)
            break;
    }
    *engine = e;
    return 0;
}

const trip_engine_ops trip_engine_pread = {
    .name = "pread",
    .create = pread_create,
    .submit = pread_submit,
    .destroy = pread_destroy,
};
