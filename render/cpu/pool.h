/* The threads of the CPU renderer, created once. A job consists of independent tasks. The workers
 * and the waiting thread run them. Only the renderer's thread starts jobs and waits for jobs. The
 * pool takes tasks of the older job first.
 *
 * Tasks see all writes of the starter before the start. After the wait, the starter sees all writes
 * of the tasks.
 *
 * A frame has many short jobs, and waking a thread can take longer than a job. So threads look for
 * work for a short time before they sleep. */
#ifndef TRIP_CPU_POOL_H
#define TRIP_CPU_POOL_H

#include <stdbool.h>

#include "budget.h"

typedef struct trip_cpu_job {
    /* `thread` is below trip_cpu_pool_threads(). Two tasks with the same `thread` never run at the
     * same time. */
    void (*run)(void *context, unsigned task, unsigned thread);
    void *context;
    unsigned tasks; /* below 2^20 */
    /* The pool writes these fields on the renderer's thread. */
    unsigned slot;
    bool active;
} trip_cpu_job;

typedef struct trip_cpu_pool trip_cpu_pool;

/* Creates a pool of `threads` threads, the caller included. 0 selects one for each processor that
 * the process may use. Fails with TRIP_ERROR if a thread cannot be started. */
int trip_cpu_pool_create(trip_cpu_pool **out, unsigned threads);
void trip_cpu_pool_destroy(trip_cpu_pool *pool);
unsigned trip_cpu_pool_threads(const trip_cpu_pool *pool);

/* Starts a job. At most two jobs may be active. The caller must not touch the job until
 * trip_cpu_pool_wait() returns. */
void trip_cpu_pool_start(trip_cpu_pool *pool, trip_cpu_job *job);
/* Runs tasks until the job is done. Returns at once if the job is not active. */
void trip_cpu_pool_wait(trip_cpu_pool *pool, trip_cpu_job *job);

#endif
