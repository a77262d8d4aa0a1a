#include "workers.h"

#include <assert.h>
#include <errno.h>
#include <pthread.h>
#include <sched.h>
#include <stdlib.h>
#include <time.h>

#include "report.h"

enum { MAX_THREADS = 256 };

struct trip_workers {
    unsigned count;
    pthread_t threads[MAX_THREADS];

    pthread_mutex_t lock; /* guards all further fields */
    pthread_cond_t started, finished;
    bool stopping;
    uint64_t loop;     /* number of the loop, by which threads notice a new one */
    trip_scope *scope; /* of the thread that started the loop */
    trip_work work;
    void *user;
    uint64_t items, next_item;
    unsigned busy; /* threads that have not yet left the loop */
    int status;
    bool reported; /* a failure of this loop was reported */
};

typedef struct seat {
    trip_workers *workers;
    unsigned thread;
} seat;

unsigned trip_workers_processors(void)
{
    cpu_set_t set;
    if (sched_getaffinity(0, sizeof set, &set) != 0)
        return 1;
    int count = CPU_COUNT(&set);
    return count < 1 ? 1 : (unsigned)count;
}

static bool take_item(trip_workers *w, uint64_t *item)
{
    pthread_mutex_lock(&w->lock);
    if (w->status == 0 && w->next_item < w->items && trip_interrupted())
        w->status = trip_fail(TRIP_INTERRUPTED, "brick", "", "interrupted");
    bool some = w->status == 0 && w->next_item < w->items;
    if (some)
        *item = w->next_item++;
    pthread_mutex_unlock(&w->lock);
    return some;
}

/* Notes a failure. Returns true for the first report of a loop. A failure may come without a
 * report, if another thread has the report and has not ended yet. */
static bool note_failure(trip_workers *w, int status, const trip_held_report *report)
{
    pthread_mutex_lock(&w->lock);
    bool first = *report->line && !w->reported;
    w->reported |= first;
    if (w->status == 0)
        w->status = status;
    pthread_mutex_unlock(&w->lock);
    return first;
}

static void run_loop(trip_workers *w, unsigned thread)
{
    trip_held_report report;
    uint64_t item;
    while (take_item(w, &item)) {
        trip_report_hold(&report);
        int status = w->work(w->user, thread, item);
        trip_report_release(&report);
        if (status < 0 && note_failure(w, status, &report))
            trip_report_print(&report);
    }
}

/* Waits for a loop later than `seen`. Returns false when the pool is being destroyed. */
static bool await_loop(trip_workers *w, uint64_t *seen)
{
    pthread_mutex_lock(&w->lock);
    while (!w->stopping && w->loop == *seen)
        pthread_cond_wait(&w->started, &w->lock);
    *seen = w->loop;
    bool go = !w->stopping;
    trip_scope_enter(w->scope);
    pthread_mutex_unlock(&w->lock);
    return go;
}

static void *thread_main(void *arg)
{
    seat s = *(seat *)arg;
    free(arg);
    uint64_t seen = 0;
    while (await_loop(s.workers, &seen)) {
        run_loop(s.workers, s.thread);
        pthread_mutex_lock(&s.workers->lock);
        if (--s.workers->busy == 0)
            pthread_cond_signal(&s.workers->finished);
        pthread_mutex_unlock(&s.workers->lock);
    }
    return NULL;
}

static int start_thread(trip_workers *w)
{
    seat *s = malloc(sizeof *s);
    if (s) {
        *s = (seat){ w, w->count };
        errno = pthread_create(&w->threads[w->count], NULL, thread_main, s);
        if (errno == 0) {
            w->count++;
            return 0;
        }
        free(s);
    }
    return trip_fail_errno("brick", "threads", "cannot start");
}

int trip_workers_create(trip_workers **out, unsigned threads)
{
    trip_workers *w = calloc(1, sizeof *w);
    *out = NULL;
    if (!w)
        return trip_fail(TRIP_ERROR, "brick", "threads", "out of memory");
    pthread_condattr_t clock;
    pthread_condattr_init(&clock);
    pthread_condattr_setclock(&clock, CLOCK_MONOTONIC);
    pthread_mutex_init(&w->lock, NULL);
    pthread_cond_init(&w->started, NULL);
    pthread_cond_init(&w->finished, &clock);
    pthread_condattr_destroy(&clock);
    if (threads == 0)
        threads = trip_workers_processors();
    int status = 0;
    while (status == 0 && w->count < threads && w->count < MAX_THREADS)
        status = start_thread(w);
    if (status < 0) {
        trip_workers_destroy(w);
        return status;
    }
    *out = w;
    return 0;
}

void trip_workers_destroy(trip_workers *w)
{
    if (!w)
        return;
    pthread_mutex_lock(&w->lock);
    w->stopping = true;
    pthread_cond_broadcast(&w->started);
    pthread_mutex_unlock(&w->lock);
    for (unsigned i = 0; i < w->count; i++)
        pthread_join(w->threads[i], NULL);
    pthread_mutex_destroy(&w->lock);
    pthread_cond_destroy(&w->started);
    pthread_cond_destroy(&w->finished);
    free(w);
}

unsigned trip_workers_count(const trip_workers *w)
{
    return w->count;
}

void trip_workers_start(trip_workers *w, trip_work work, void *user, uint64_t items)
{
    pthread_mutex_lock(&w->lock);
    assert(w->busy == 0);
    w->scope = trip_scope_current();
    w->work = work;
    w->user = user;
    w->items = items;
    w->next_item = 0;
    w->status = 0;
    w->reported = false;
    w->busy = w->count;
    w->loop++;
    pthread_cond_broadcast(&w->started);
    pthread_mutex_unlock(&w->lock);
}

static struct timespec deadline(unsigned timeout_ms)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    t.tv_sec += timeout_ms / 1000;
    t.tv_nsec += (long)(timeout_ms % 1000) * 1000000;
    if (t.tv_nsec >= 1000000000) {
        t.tv_sec++;
        t.tv_nsec -= 1000000000;
    }
    return t;
}

bool trip_workers_wait(trip_workers *w, unsigned timeout_ms, int *status)
{
    struct timespec until = deadline(timeout_ms);
    int timed_out = 0;
    pthread_mutex_lock(&w->lock);
    while (w->busy > 0 && timed_out == 0)
        timed_out = timeout_ms ? pthread_cond_timedwait(&w->finished, &w->lock, &until)
                               : pthread_cond_wait(&w->finished, &w->lock);
    bool over = w->busy == 0;
    *status = w->status;
    pthread_mutex_unlock(&w->lock);
    return over;
}

int trip_workers_run(trip_workers *w, trip_work work, void *user, uint64_t items)
{
    int status;
    trip_workers_start(w, work, user, items);
    trip_workers_wait(w, 0, &status);
    return status;
}
