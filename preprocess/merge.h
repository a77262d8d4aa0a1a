/* Merges the pieces of several sorted sources into one sorted sequence. One thread for each merge.
 */
#ifndef TRIP_MERGE_H
#define TRIP_MERGE_H

#include "piece.h"

/* A sequence of pieces by ascending key. Implementations have it as their first member. */
typedef struct trip_piece_source {
    const trip_piece *piece; /* the present one; NULL at the end */
    /* Moves to the next piece, after which the present one is not valid any more. */
    int (*advance)(struct trip_piece_source *s);
} trip_piece_source;

/* Calls `take` for all pieces of the sources by ascending key, in any order where keys are equal;
 * ends with the first negative status. Each source is at its first piece before. Reorders
 * `sources`. */
int trip_merge(trip_piece_source **sources, size_t count,
               int (*take)(void *user, const trip_piece *piece), void *user);

#endif
