/* The runs that a plan reads to compute normals (computed_normals.h): the bricks beside the
 * selected bricks, in all lists with values, one sheet ahead. A part of the plan. */
#ifndef TRIP_PLAN_AROUND_H
#define TRIP_PLAN_AROUND_H

#include "selection.h"

typedef struct trip_plan_around {
    trip_selection *selections; /* of all passes; NULL if normals are not computed */
    unsigned count, room;
    uint64_t bytes; /* bytes of the bricks that only these selections read */
} trip_plan_around;

/* Makes room for two selections per list. */
int trip_plan_around_create(trip_plan_around *a, unsigned lists, trip_budget *budget);
/* Makes the pass to read for a pass that is drawn, along the axis of its lists. */
int trip_plan_around_add(trip_plan_around *a, const trip_pass *drawn, trip_pass *around,
                         trip_budget *budget);
void trip_plan_around_release(trip_plan_around *a, trip_budget *budget);

#endif
