/* Finds from a plan how much memory a layer's sheets need at most. So too little memory is reported
 * before anything is drawn. Any thread may call it with its own budget. */
#ifndef TRIP_CPU_SHEETS_NEED_H
#define TRIP_CPU_SHEETS_NEED_H

#include "budget.h"
#include "plan.h"

typedef struct trip_cpu_need {
    uint64_t rasters; /* maximum over consecutive sheets that are in memory together */
    uint64_t of_sheet, runs, words; /* maximum over single sheets */
} trip_cpu_need;

/* Maximum of `held_sheets` in trip_cpu_need_find(). */
enum { TRIP_CPU_AT_HAND_MAX = 6 };

/* Finds the need of a layer. A sheet has at most `rasters` rasters, and `held_sheets` sheets are in
 * memory at a time. Returns TRIP_ERROR if the budget has too little left for the search. */
int trip_cpu_need_find(trip_cpu_need *need, const trip_plan_layer *layer, uint64_t rasters,
                       int held_sheets, trip_budget *budget);

#endif
