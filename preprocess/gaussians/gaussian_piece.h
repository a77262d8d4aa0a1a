/* A piece of a list: splats of one node and class, in the order of the list. It becomes a brick, or
 * several if it has wide gaps. Any thread, but each room serves one at a time. */
#ifndef TRIP_GAUSSIAN_PIECE_H
#define TRIP_GAUSSIAN_PIECE_H

#include <stdbool.h>

#include "gaussian_writer.h"
#include "key_sort.h"

typedef struct trip_gaussian_piece {
    int axis, size_class;
    uint64_t node;  /* of the data set */
    unsigned count; /* splats, at most TRIP_GAUSSIAN_BRICK_RECORDS_MAX */
} trip_gaussian_piece;

/* Room for TRIP_GAUSSIAN_BRICK_RECORDS_MAX entries each. */
typedef struct trip_piece_room {
    trip_key *keys, *scratch;
    const unsigned char **others;
} trip_piece_room;

/* Returns the number of splats of the next piece of so many in a leaf. A leaf with too many splats
 * becomes several pieces with about equal numbers. */
static inline unsigned trip_piece_count(uint64_t left)
{
    const uint64_t pieces =
        (left + TRIP_GAUSSIAN_BRICK_RECORDS_MAX - 1) / TRIP_GAUSSIAN_BRICK_RECORDS_MAX;
    return (unsigned)((left + pieces - 1) / pieces);
}

/* Returns whether the splats, which stand behind the heads at these addresses, have a wide gap. */
bool trip_piece_has_gap(const trip_gaussian_piece *p, const unsigned char **splats,
                        const trip_piece_room *room);
/* Encodes and writes a piece with gaps. Strays get bricks of their own, so that no other loses
 * precision. `codes` has room for the piece. The order of `splats` is lost. */
int trip_piece_write_divided(trip_gaussian_writer *w, const trip_gaussian_piece *p,
                             const unsigned char **splats, const trip_piece_room *room,
                             unsigned char *codes);

#endif
