/* Carries out requests on threads of its own. The reader submits from one thread. Requests return
 * through `done`, in any order and on any of the engine's threads. */
#ifndef TRIP_ENGINE_H
#define TRIP_ENGINE_H

#include "request.h"

typedef struct trip_engine_ops {
    const char *name;
    /* Returns 0, or -errno if the system refuses; reports nothing. At most `depth` requests run at
     * once. */
    int (*create)(void **engine, unsigned depth, unsigned threads);
    /* Submits a chain linked by `next`. The engine owns it until `done`. */
    void (*submit)(void *engine, trip_request *chain);
    /* No request may be running. */
    void (*destroy)(void *engine);
} trip_engine_ops;

extern const trip_engine_ops trip_engine_pread;
extern const trip_engine_ops trip_engine_uring;

#endif
