#include "cpu/pool.h"

#include <assert.h>
#include <linux/futex.h>
#include <pthread.h>
#include <sched.h>
#include <stdatomic.h>
#include <stdint.h>
#include <stdlib.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "report.h"

enum { SLOTS = 2, MAX_THREADS = 256 };

/* How often a thread looks for work before it sleeps. LOOKS take 10 to 50 microseconds of busy
 * waiting. YIELDS take about 200 more and let other threads run first. Planning between two frames
 * of a small data set takes nearly as long. */
enum { LOOKS = 1000, YIELDS = 1500 };

/* One word holds a job's tickets: the number of tasks, the number of tasks given out, and a number
 * that differs between consecutive jobs of a slot. So one atomic step takes a task and checks that
 * the job is still the same. */
#define TICKET_BITS 24
#define TICKET_MASK ((UINT64_C(1) << TICKET_BITS) - 1)
#define NUMBER_ONE (UINT64_C(1) << 2 * TICKET_BITS)

typedef struct slot {
    _Atomic uint64_t tickets; /* tasks << TICKET_BITS | given out; the starter releases it */
    /* The starter writes these fields before it releases `tickets`. A thread reads them after
     * taking a ticket. */
    void (*run)(void *context, unsigned task, unsigned thread);
    void *context;
    trip_scope *scope;         /* scope of the starter */
    _Atomic uint32_t finished; /* each task releases it, the waiter acquires it */
    bool taken;                /* used by the starter only */
} slot;

struct trip_cpu_pool {
    unsigned threads;
    pthread_t *workers;
    unsigned started, looks;
    slot slots[SLOTS];
    _Atomic unsigned oldest; /* the slot that threads look at first */
    /* Words that threads sleep on. */
    _Atomic uint32_t version; /* number of starts; a thread sleeps only if it has seen all */
    _Atomic uint32_t sleepers;
    _Atomic bool waiting; /* the starter sleeps */
    _Atomic bool stop;
};

typedef struct worker {
    trip_cpu_pool *pool;
    unsigned thread;
} worker;

/* Sleeps until woken if the word still equals `seen`. May return early. */
static void sleep_on(_Atomic uint32_t *word, uint32_t seen)
{
    syscall(SYS_futex, word, FUTEX_WAIT_PRIVATE, seen, NULL, NULL, 0);
}

static void wake_one(_Atomic uint32_t *word)
{
    syscall(SYS_futex, word, FUTEX_WAKE_PRIVATE, 1, NULL, NULL, 0);
}

static void pause_a_little(void)
{
#if defined(__x86_64__)
    __builtin_ia32_pause();
#elif defined(__aarch64__)
    __asm__ volatile("yield");
#endif
}

static unsigned tasks_of(uint64_t tickets)
{
    return (unsigned)(tickets >> TICKET_BITS & TICKET_MASK);
}

/* Runs one task of the slot's job. Returns false if none is left. */
static bool run_task(trip_cpu_pool *pool, slot *s, unsigned thread)
{
    uint64_t tickets = atomic_load_explicit(&s->tickets, memory_order_acquire);
    do {
        if ((tickets & TICKET_MASK) >= tasks_of(tickets))
            return false;
    } while (!atomic_compare_exchange_weak_explicit(&s->tickets, &tickets, tickets + 1,
                                                    memory_order_acquire, memory_order_acquire));
    trip_scope *before = trip_scope_enter(s->scope);
    s->run(s->context, (unsigned)(tickets & TICKET_MASK), thread);
    trip_scope_enter(before);
    if (atomic_fetch_add(&s->finished, 1) + 1 == tasks_of(tickets) && atomic_load(&pool->waiting))
        wake_one(&s->finished);
    return true;
}

static bool run_any(trip_cpu_pool *pool, unsigned thread)
{
    unsigned oldest = atomic_load_explicit(&pool->oldest, memory_order_relaxed);
    for (unsigned i = 0; i < SLOTS; i++)
        if (run_task(pool, &pool->slots[(oldest + i) % SLOTS], thread))
            return true;
    return false;
}

/* Passes the time between two looks for work, after `looks` looks without success. */
static void pass_time(unsigned looks)
{
    if (looks < LOOKS)
        pause_a_little();
    else
        sched_yield();
}

/* Waits until a job starts after version `seen`. Each woken thread wakes the next one, so the
 * starter wakes only one. */
static void await_start(trip_cpu_pool *pool, uint32_t seen)
{
    for (unsigned i = 0; i < pool->looks; i++) {
        if (atomic_load_explicit(&pool->version, memory_order_relaxed) != seen)
            return;
        pass_time(i);
    }
    atomic_fetch_add(&pool->sleepers, 1);
    while (atomic_load(&pool->version) == seen)
        sleep_on(&pool->version, seen);
    if (atomic_fetch_sub(&pool->sleepers, 1) > 1)
        wake_one(&pool->version);
}

static void *work(void *argument)
{
    worker self = *(worker *)argument;
    free(argument);
    for (;;) {
        uint32_t seen = atomic_load(&self.pool->version);
        if (atomic_load(&self.pool->stop))
            return NULL;
        while (run_any(self.pool, self.thread))
            continue;
        await_start(self.pool, seen);
    }
}

/* Announces new work and wakes one sleeping thread. await_start() wakes the others. */
static void announce(trip_cpu_pool *pool)
{
    atomic_fetch_add(&pool->version, 1);
    if (atomic_load(&pool->sleepers) > 0)
        wake_one(&pool->version);
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
    pool->looks = pool->threads <= processors() ? LOOKS + YIELDS : 0;
    pool->workers = calloc(pool->threads, sizeof *pool->workers);
    for (unsigned i = 1; i < pool->threads; i++) {
        if (!pool->workers || start_worker(pool, i)) {
            threads = pool->threads;
            trip_cpu_pool_destroy(pool);
            return trip_fail(TRIP_ERROR, "render", "threads",
                             "cannot start %u threads; use a smaller --threads", threads);
        }
    }
    *out = pool;
    return 0;
}

void trip_cpu_pool_destroy(trip_cpu_pool *pool)
{
    if (!pool)
        return;
    atomic_store(&pool->stop, true);
    announce(pool);
    for (unsigned i = 0; i < pool->started; i++)
        pthread_join(pool->workers[i], NULL);
    free(pool->workers);
    free(pool);
}

unsigned trip_cpu_pool_threads(const trip_cpu_pool *pool)
{
    return pool->threads;
}

void trip_cpu_pool_start(trip_cpu_pool *pool, trip_cpu_job *job)
{
    unsigned at = pool->slots[0].taken;
    slot *s = &pool->slots[at];
    assert(!s->taken && job->tasks <= TICKET_MASK);
    job->slot = at;
    job->active = s->taken = true;
    s->run = job->run;
    s->context = job->context;
    s->scope = trip_scope_current();
    atomic_store_explicit(&s->finished, 0, memory_order_relaxed);
    atomic_store_explicit(&pool->oldest, pool->slots[1 - at].taken ? 1 - at : at,
                          memory_order_relaxed);
    uint64_t number = atomic_load_explicit(&s->tickets, memory_order_relaxed) / NUMBER_ONE + 1;
    atomic_store_explicit(&s->tickets, number * NUMBER_ONE | (uint64_t)job->tasks << TICKET_BITS,
                          memory_order_release);
    announce(pool);
}

/* Waits until all tasks of the slot's job are done. */
static void await_finish(trip_cpu_pool *pool, slot *s, uint32_t tasks)
{
    uint32_t finished;
    for (unsigned i = 0; i < pool->looks; i++) {
        if (atomic_load_explicit(&s->finished, memory_order_acquire) == tasks)
            return;
        pass_time(i);
    }
    atomic_store(&pool->waiting, true);
    while ((finished = atomic_load(&s->finished)) != tasks)
        sleep_on(&s->finished, finished);
    atomic_store(&pool->waiting, false);
}

void trip_cpu_pool_wait(trip_cpu_pool *pool, trip_cpu_job *job)
{
    if (!job->active)
        return;
    slot *s = &pool->slots[job->slot];
    while (run_task(pool, s, 0))
        continue;
    /* While other threads run the last tasks, this thread runs tasks of the other job. */
    while (atomic_load_explicit(&s->finished, memory_order_acquire) != job->tasks &&
           run_any(pool, 0))
        continue;
    await_finish(pool, s, job->tasks);
    job->active = s->taken = false;
    atomic_store_explicit(&pool->oldest, 1 - job->slot, memory_order_relaxed);
}
