/* Merges the pieces of several sorted sources into one sorted sequence. Each merge runs on one
 * thread. */
#ifndef TRIP_MERGE_H
#define TRIP_MERGE_H

#include "piece.h"

/* A sequence of pieces sorted by ascending key. Implementations embed it as their first member. */
typedef struct trip_piece_source {
    const trip_piece *piece; /* current piece; NULL at the end */
    /* Moves to the next piece. The previous piece is then invalid. */
    int (*advance)(struct trip_piece_source *s);
} trip_piece_source;

/* Calls `take` for all pieces of the sources by ascending key, in any order among equal keys. Stops
 * at the first negative status and returns it. Each source must be at its first piece. Reorders
 * `sources`. */
int trip_merge(trip_piece_source **sources, size_t count,
               int (*take)(void *user, const trip_piece *piece), void *user);

#endif
