/* Threads of the CPU renderer, made once: jobs of independent tasks, run by the workers and by
 * the thread that waits for them. Jobs are started and waited for by one thread, the renderer's;
 * tasks of the job started first are taken first. Everything the starter wrote before the start is
 * seen by the tasks, and everything they wrote is seen after the wait.
 *
 * A frame has many short jobs, and waking a thread can take longer than one of them: so threads
 * look for work a little while before they sleep. */
#ifndef TRIP_CPU_POOL_H
#define TRIP_CPU_POOL_H

#include <stdbool.h>

#include "budget.h"

typedef struct trip_cpu_job {
    /* `thread` is below trip_cpu_pool_threads(), and no two run with the same at a time. */
    void (*run)(void *context, unsigned task, unsigned thread);
    void *context;
    unsigned tasks; /* below 2^20 */
    /* The pool's, on the renderer's thread. */
    unsigned slot;
    bool active;
} trip_cpu_job;

typedef struct trip_cpu_pool trip_cpu_pool;

/* threads 0: one for each processor that this process may run on. */
int trip_cpu_pool_create(trip_cpu_pool **out, unsigned threads);
void trip_cpu_pool_destroy(trip_cpu_pool *pool);
unsigned trip_cpu_pool_threads(const trip_cpu_pool *pool);

/* The job must not be touched until it has been waited for. At most two at a time. */
void trip_cpu_pool_start(trip_cpu_pool *pool, trip_cpu_job *job);
/* Returns at once for a job that is not started. */
void trip_cpu_pool_wait(trip_cpu_pool *pool, trip_cpu_job *job);

#endif
