#include "cpu_pool.h"

#include <pthread.h>
#include <sched.h>
#include <stdlib.h>
#include <string.h>

#include "report.h"

enum { MAX_JOBS = 2, MAX_THREADS = 256 };

struct trip_cpu_pool {
    unsigned threads;
    pthread_t *workers;
    unsigned started;
    pthread_mutex_t lock;
    /* Under the lock. */
    pthread_cond_t work, done;
    trip_cpu_job *jobs[MAX_JOBS]; /* active ones, oldest first */
    unsigned job_count;
    bool stop;
};

typedef struct worker {
    trip_cpu_pool *pool;
    unsigned thread;
} worker;

/* Under the lock: the next task of the oldest job that has one. */
static trip_cpu_job *take_task(trip_cpu_pool *pool, unsigned *task)
{
    for (unsigned i = 0; i < pool->job_count; i++) {
        trip_cpu_job *job = pool->jobs[i];
        if (job->next < job->tasks) {
            *task = job->next++;
            return job;
        }
    }
    return NULL;
}

/* Under the lock, which is given up while the task runs. */
static void run_task(trip_cpu_pool *pool, trip_cpu_job *job, unsigned task, unsigned thread)
{
    pthread_mutex_unlock(&pool->lock);
    job->run(job->context, task, thread);
    pthread_mutex_lock(&pool->lock);
    if (++job->finished == job->tasks)
        pthread_cond_signal(&pool->done);
}

static void *work(void *argument)
{
    worker self = *(worker *)argument;
    trip_cpu_pool *pool = self.pool;
    free(argument);
    pthread_mutex_lock(&pool->lock);
    while (!pool->stop) {
        unsigned task;
        trip_cpu_job *job = take_task(pool, &task);
        if (job)
            run_task(pool, job, task, self.thread);
        else
            pthread_cond_wait(&pool->work, &pool->lock);
    }
    pthread_mutex_unlock(&pool->lock);
    return NULL;
}

static unsigned processors(void)
{
    cpu_set_t set;
    if (sched_getaffinity(0, sizeof set, &set))
        return 1;
    int n = CPU_COUNT(&set);
    return n < 1 ? 1 : (unsigned)n;
}

static int start_worker(trip_cpu_pool *pool, unsigned thread)
{
    worker *w = malloc(sizeof *w);
    if (!w)
        return -1;
    *w = (worker){ pool, thread };
    if (pthread_create(&pool->workers[pool->started], NULL, work, w)) {
        free(w);
        return -1;
    }
    pool->started++;
    return 0;
}

int trip_cpu_pool_create(trip_cpu_pool **out, unsigned threads)
{
    *out = NULL;
    trip_cpu_pool *pool = calloc(1, sizeof *pool);
    if (!pool)
        return trip_fail(TRIP_ERROR, "render", "threads", "out of memory");
    pool->threads = threads ? threads : processors();
    if (pool->threads > MAX_THREADS)
        pool->threads = MAX_THREADS;
    pthread_mutex_init(&pool->lock, NULL);
    pthread_cond_init(&pool->work, NULL);
    pthread_cond_init(&pool->done, NULL);
    pool->workers = calloc(pool->threads, sizeof *pool->workers);
    for (unsigned i = 1; i < pool->threads; i++) {
        if (!pool->workers || start_worker(pool, i)) {
            trip_cpu_pool_destroy(pool);
            return trip_fail(TRIP_ERROR, "render", "threads",
                             "cannot start %u threads; ask for fewer with --threads", threads);
        }
    }
    *out = pool;
    return 0;
}

void trip_cpu_pool_destroy(trip_cpu_pool *pool)
{
    if (!pool)
        return;
    pthread_mutex_lock(&pool->lock);
    pool->stop = true;
    pthread_cond_broadcast(&pool->work);
    pthread_mutex_unlock(&pool->lock);
    for (unsigned i = 0; i < pool->started; i++)
        pthread_join(pool->workers[i], NULL);
    pthread_cond_destroy(&pool->done);
    pthread_cond_destroy(&pool->work);
    pthread_mutex_destroy(&pool->lock);
    free(pool->workers);
    free(pool);
}

unsigned trip_cpu_pool_threads(const trip_cpu_pool *pool)
{
    return pool->threads;
}

void trip_cpu_pool_start(trip_cpu_pool *pool, trip_cpu_job *job)
{
    pthread_mutex_lock(&pool->lock);
    job->next = job->finished = 0;
    job->active = true;
    pool->jobs[pool->job_count++] = job;
    pthread_cond_broadcast(&pool->work);
    pthread_mutex_unlock(&pool->lock);
}

/* Under the lock. */
static void retire(trip_cpu_pool *pool, trip_cpu_job *job)
{
    unsigned kept = 0;
    for (unsigned i = 0; i < pool->job_count; i++)
        if (pool->jobs[i] != job)
            pool->jobs[kept++] = pool->jobs[i];
    pool->job_count = kept;
    job->active = false;
}

void trip_cpu_pool_wait(trip_cpu_pool *pool, trip_cpu_job *job)
{
    if (!job->active)
        return;
    pthread_mutex_lock(&pool->lock);
    while (job->next < job->tasks)
        run_task(pool, job, job->next++, 0);
    while (job->finished < job->tasks)
        pthread_cond_wait(&pool->done, &pool->lock);
    retire(pool, job);
    pthread_mutex_unlock(&pool->lock);
}
