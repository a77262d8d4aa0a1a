/* Carries out requests on its own threads. The reader submits from one thread; requests come back
 * by their `done` in any order, on any of the engine's threads. */
#ifndef TRIP_ENGINE_H
#define TRIP_ENGINE_H

#include "request.h"

typedef struct trip_engine_ops {
    const char *name;
    /* 0, or -errno when the system refuses; nothing is reported. At most `depth` requests will be
     * under way at once. */
    int (*create)(void **engine, unsigned depth, unsigned threads);
    /* A chain by `next`, which is the engine's from here on. */
    void (*submit)(void *engine, trip_request *chain);
    /* Nothing may be under way. */
    void (*destroy)(void *engine);
} trip_engine_ops;

extern const trip_engine_ops trip_engine_pread;
extern const trip_engine_ops trip_engine_uring;

#endif
