/* Computes normals from values, for data sets that store none. A reader passes it the runs of
 * trip_pass.around. It hands out the runs of the pass with a plane of normals, in the same order.
 * normal_sheets.h defines the normals. The sheets before, at and behind a run are in memory, so
 * memory does not depend on the number of sheets. The reader owns it; one thread. */
#ifndef TRIP_COMPUTED_NORMALS_H
#define TRIP_COMPUTED_NORMALS_H

#include "batch.h"
#include "task_runner.h"

typedef struct trip_computed_normals trip_computed_normals;

typedef enum trip_normals_state {
    TRIP_NORMALS_WANT,  /* the batch added last is used up; add another, or the end */
    TRIP_NORMALS_READY, /* a batch is ready */
    TRIP_NORMALS_OVER,  /* all runs were handed out */
} trip_normals_state;

/* Returns the bytes that the computation takes for a data set. */
uint64_t trip_computed_normals_bytes(const trip_dataset *d);
/* As in trip_reader_params. */
typedef struct trip_computed_normals_params {
    trip_task_runner runner;
    bool (*skip)(void *user, const trip_selection *s, const trip_run *run);
    void *skip_user;
} trip_computed_normals_params;

int trip_computed_normals_create(trip_computed_normals **out, const trip_dataset *d,
                                 const trip_computed_normals_params *params, trip_budget *budget);
void trip_computed_normals_destroy(trip_computed_normals *n);

/* Forgets all runs. */
void trip_computed_normals_begin(trip_computed_normals *n);
/* Adds a batch of `pass->around`. It must exist until the state is TRIP_NORMALS_WANT. */
void trip_computed_normals_add(trip_computed_normals *n, const trip_batch *batch,
                               const trip_pass *pass);
/* Adds the end of the last pass. */
void trip_computed_normals_end(trip_computed_normals *n);
/* Works until a batch is ready or there is nothing left to do. Must not be called while a batch is
 * handed out. */
trip_normals_state trip_computed_normals_work(trip_computed_normals *n);
/* Hands out the batch that is ready. */
void trip_computed_normals_take(trip_computed_normals *n, trip_batch *batch);
/* Takes back the batch. */
void trip_computed_normals_release(trip_computed_normals *n);
/* Whether a batch is handed out. */
bool trip_computed_normals_is_held(const trip_computed_normals *n);
/* Returns the runs left out by the skip callback, and the time spent, since begin. */
uint64_t trip_computed_normals_skipped(const trip_computed_normals *n);
uint64_t trip_computed_normals_ns(const trip_computed_normals *n);

#endif
