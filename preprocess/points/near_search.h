/* The nearest neighbours of many positions that lie together. Candidates are sorted into a grid. A
 * search that the candidates cannot decide is left to the caller. One thread. */
#ifndef TRIP_NEAR_SEARCH_H
#define TRIP_NEAR_SEARCH_H

#include "neighbours.h"

typedef struct trip_near_search trip_near_search;

/* Returns the bytes of a search with so many candidates. */
size_t trip_near_search_bytes(uint32_t candidates);
/* Sets up a search in zeroed memory of so many bytes. */
trip_near_search *trip_near_search_make(void *memory, uint32_t candidates);

/* Removes all candidates. `lo` to `hi` is a box that holds the positions of the searches. All
 * positions at most `margin` outside of it must become candidates. `spacing` is about the distance
 * of neighbouring positions. */
void trip_near_search_begin(trip_near_search *s, const double lo[3], const double hi[3],
                            double margin, double spacing);
/* Adds a candidate if it is at most `margin` outside of the box. Returns false if the room is full.
 */
bool trip_near_search_add(trip_near_search *s, const double position[3]);
/* Sorts the candidates. */
void trip_near_search_sort(trip_near_search *s);
/* Finds the neighbours of n->position, which lies in the box, as trip_neighbours_add() would from
 * all positions. Returns false, with n->count 0, if they may lie further than the margin. */
bool trip_near_search_find(trip_near_search *s, trip_neighbours *n);

#endif
