/* Threads that are lent for independent tasks. */
#ifndef TRIP_TASK_RUNNER_H
#define TRIP_TASK_RUNNER_H

#include <stddef.h>

/* Does `count` tasks on any threads, and returns when all are done; what the caller wrote before is
 * seen by the tasks, and what they wrote is seen after. `run` NULL: there are no threads. */
typedef struct trip_task_runner {
    void (*run)(void *user, void (*task)(void *context, unsigned number), void *context,
                unsigned count);
    void *user;
} trip_task_runner;

/* By the caller's thread where there are no others. */
static inline void trip_run_tasks(const trip_task_runner *runner,
                                  void (*task)(void *context, unsigned number), void *context,
                                  unsigned count)
{
    if (runner && runner->run) {
        runner->run(runner->user, task, context, count);
        return;
    }
    for (unsigned i = 0; i < count; i++)
        task(context, i);
}

#endif
