/* Whether the records of a run are what the index says of their brick. Readers look before they
 * hand out anything, so that what draws need not: a record outside its brick would be drawn outside
 * the grid, or where the plan culls it. Pure functions. */
#ifndef TRIP_RECORD_CHECK_H
#define TRIP_RECORD_CHECK_H

#include <stddef.h>

#include "format.h"

/* The first of `count` records that is not inside the brick's bounds or whose code is not in its
 * range; `count` where all are. */
size_t trip_record_check(const trip_file_brick *brick, const uint32_t *records, size_t count);

/* What is wrong with a record so found. */
const char *trip_record_fault(const trip_file_brick *brick, uint32_t record);

#endif
