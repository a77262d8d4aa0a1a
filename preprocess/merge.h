/* Pieces from several sorted sources as one sorted sequence. One thread a merge. */
#ifndef TRIP_MERGE_H
#define TRIP_MERGE_H

#include "piece.h"

/* Something that gives pieces by ascending key. Embedded in what knows how. */
typedef struct trip_piece_source {
    const trip_piece *piece; /* the present one; NULL at the end */
    /* Goes to the next piece; the present one may be gone then. */
    int (*advance)(struct trip_piece_source *s);
} trip_piece_source;

/* Gives all pieces of the sources, each standing at its first, to `take` by ascending key; those of
 * one key in any order. Reorders `sources`. */
int trip_merge(trip_piece_source **sources, size_t count,
               int (*take)(void *user, const trip_piece *piece), void *user);

#endif
