/* What a layer's sheets take at most, by its plan, so that what does not suffice is known before
 * anything is drawn. Pure functions. */
#ifndef TRIP_CPU_SHEETS_NEED_H
#define TRIP_CPU_SHEETS_NEED_H

#include "budget.h"
#include "plan.h"

typedef struct trip_cpu_need {
    uint64_t rasters;               /* of the sheets at hand when an interval is drawn */
    uint64_t of_sheet, runs, words; /* rasters and so on of the sheet that has most */
} trip_cpu_need;

/* The most of `at_hand` of trip_cpu_need_find(). */
enum { TRIP_CPU_AT_HAND_MAX = 6 };

/* Of sheets of so many rasters each at most, so many at hand at a time; TRIP_ERROR without the
 * memory to find it. */
int trip_cpu_need_find(trip_cpu_need *need, const trip_plan_layer *layer, uint64_t rasters,
                       int at_hand, trip_budget *budget);

#endif
