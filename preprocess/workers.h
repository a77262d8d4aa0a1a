/* A pool of threads that runs one parallel loop at a time. The thread that starts a loop may do
 * other work until it waits for the end. Items begin in ascending order and may finish in any
 * order. One thread owns the pool. The work functions run on the pool's threads, in the owner's
 * scope. */
#ifndef TRIP_WORKERS_H
#define TRIP_WORKERS_H

#include <stdbool.h>
#include <stdint.h>

typedef struct trip_workers trip_workers;

/* Processes one item; `thread` is 0 .. count - 1. A negative status or an interruption ends the
 * loop; items that have not begun are left out. Only the first failure is reported. */
typedef int (*trip_work)(void *user, unsigned thread, uint64_t item);

/* Returns the number of processors that the process may run on. */
unsigned trip_workers_processors(void);

/* Creates a pool. `threads` 0 selects one thread for each processor. */
int trip_workers_create(trip_workers **out, unsigned threads);
void trip_workers_destroy(trip_workers *w);
unsigned trip_workers_count(const trip_workers *w);

void trip_workers_start(trip_workers *w, trip_work work, void *user, uint64_t items);
/* Waits for the loop. Returns true after its end and sets *status to the first failure or 0.
 * Returns false after timeout_ms; 0 waits without limit. */
bool trip_workers_wait(trip_workers *w, unsigned timeout_ms, int *status);
/* Starts a loop, waits for its end and returns its status. */
int trip_workers_run(trip_workers *w, trip_work work, void *user, uint64_t items);

#endif
