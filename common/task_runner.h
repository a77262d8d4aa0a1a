/* Lends threads for independent tasks. */
#ifndef TRIP_TASK_RUNNER_H
#define TRIP_TASK_RUNNER_H

#include <stddef.h>

/* `run` does `count` tasks on any threads and returns when all are done. Tasks see the caller's
 * earlier writes, and the caller sees the tasks' writes afterwards. NULL for `run` means that there
 * are no threads. */
typedef struct trip_task_runner {
    void (*run)(void *user, void (*task)(void *context, unsigned number), void *context,
                unsigned count);
    void *user;
} trip_task_runner;

/* Runs the tasks, on the calling thread if the runner has no threads. */
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
