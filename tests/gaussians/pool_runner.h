/* Runs the tasks of a trip_task_runner on a pool of threads. */
#ifndef TRIP_POOL_RUNNER_H
#define TRIP_POOL_RUNNER_H

#include "cpu/pool.h"

typedef struct job {
    void (*task)(void *context, unsigned number);
    void *context;
} job;

static void run_one(void *context, unsigned task, unsigned thread)
{
    (void)thread;
    const job *j = context;
    j->task(j->context, task);
}

static void run_all(void *user, void (*task)(void *context, unsigned number), void *context,
                    unsigned count)
{
    job j = { task, context };
    trip_cpu_job pool_job = { .run = run_one, .context = &j, .tasks = count };
    trip_cpu_pool_start(user, &pool_job);
    trip_cpu_pool_wait(user, &pool_job);
}

#endif
