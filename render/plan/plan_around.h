/* Adds the runs to a plan that computed normals need (computed_normals.h): the bricks beside the
 * selected bricks, in all lists with values, one sheet ahead. A part of the plan. */
#ifndef TRIP_PLAN_AROUND_H
#define TRIP_PLAN_AROUND_H

#include "plan.h"

/* Adds passes around the passes of the layers, if the plan reads normals that the data set does not
 * store. */
int trip_plan_around_make(trip_plan *plan, const trip_dataset *data, trip_budget *budget);
void trip_plan_around_release(trip_plan *plan, trip_budget *budget);

#endif
