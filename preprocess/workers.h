/* Threads that share out the items of one loop at a time. The thread that starts a loop is free
 * until it waits; items are handed out in ascending order and may finish in any. One owner; the
 * work functions run on the pool's threads. */
#ifndef TRIP_WORKERS_H
#define TRIP_WORKERS_H

#include <stdbool.h>
#include <stdint.h>

typedef struct trip_workers trip_workers;

/* One item; `thread` is 0 .. count - 1. A negative status stops the loop: items not begun are left
 * out. The first failure only is reported. A signal to stop ends the loop as a failure does. */
typedef int (*trip_work)(void *user, unsigned thread, uint64_t item);

/* Processors that the process may run on. */
unsigned trip_workers_processors(void);

/* threads 0: one for every processor. */
int trip_workers_create(trip_workers **out, unsigned threads);
void trip_workers_destroy(trip_workers *w);
unsigned trip_workers_count(const trip_workers *w);

void trip_workers_start(trip_workers *w, trip_work work, void *user, uint64_t items);
/* True when the loop that was started is over, false after timeout_ms (0: no limit). *status is
 * then the first failure, or 0. */
bool trip_workers_wait(trip_workers *w, unsigned timeout_ms, int *status);
/* Start and wait. */
int trip_workers_run(trip_workers *w, trip_work work, void *user, uint64_t items);

#endif
