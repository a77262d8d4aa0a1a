/* The values of three consecutive sheets of each level, and the normals of voxels in the middle
 * sheet. A normal packs the gradient of the field of sheet.h:
 *
 * - the central difference along each axis if both neighbours are in the lists
 * - the difference to one neighbour if the lists hold only that one
 * - 0 without neighbours
 *
 * At level 0 voxels and halo have values; at coarse levels values, or means if there are no values.
 * Several threads may compute normals while no thread adds values. */
#ifndef TRIP_NORMAL_SHEETS_H
#define TRIP_NORMAL_SHEETS_H

#include "block.h"
#include "selection.h"

typedef struct trip_normal_sheets trip_normal_sheets;

/* Returns the bytes of the sheets of a data set; 0 if there are too many tiles. */
uint64_t trip_normal_sheets_bytes(const trip_dataset *d);
int trip_normal_sheets_create(trip_normal_sheets **out, const trip_dataset *d, trip_budget *budget);
void trip_normal_sheets_destroy(trip_normal_sheets *n);
/* Drops all values. */
void trip_normal_sheets_clear(trip_normal_sheets *n);

/* Adds the values of a run to its sheet. Drops the values of the sheet three sheets away. */
void trip_normal_sheets_put(trip_normal_sheets *n, const trip_list *list, const trip_run *run,
                            const trip_block *block);
/* Computes the normals of a run, 4 bytes each, from the values added so far. */
void trip_normal_sheets_compute(const trip_normal_sheets *n, const trip_list *list,
                                const trip_run *run, const trip_block *block,
                                unsigned char *normals);

#endif
