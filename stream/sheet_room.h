/* The room that sheets of a level take, by the index of a data set. Pure functions. */
#ifndef TRIP_SHEET_ROOM_H
#define TRIP_SHEET_ROOM_H

#include "dataset.h"

/* Number of levels of a data set. */
enum { TRIP_SHEET_LEVELS = 32 };

/* The largest sheet of all axes. Lists with values count in `tiles` and `squares`, lists of splats
 * in `runs` and `block_bytes`. */
typedef struct trip_sheet_room {
    bool used; /* the level has splats */
    uint64_t tiles, squares, runs, block_bytes;
} trip_sheet_room;

/* Fills in the rooms of all levels. Fails without memory. */
int trip_sheet_rooms_find(const trip_dataset *d, trip_sheet_room rooms[TRIP_SHEET_LEVELS],
                          trip_budget *budget);

/* Returns the next `count` elements of `base`, and advances *used. With a NULL base it only counts
 * the size. */
void *trip_sheet_room_carve(unsigned char *base, size_t *used, uint64_t count, size_t each_bytes);

#endif
