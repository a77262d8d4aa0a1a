#include "orientation.h"

#include "orientation_base.h"
#include "orientation_symmetry.h"
#include "report.h"

static trip_orientation look_at(const trip_occupancy *o)
{
    double scores[3], shares[6];
    for (int axis = 0; axis < 3; axis++)
        scores[axis] = trip_orientation_symmetry_score(o, axis);
    for (int side = 0; side < 6; side++)
        shares[side] = trip_orientation_base_share(o, side);
    return (trip_orientation){ trip_orientation_symmetry_axis(scores),
                               trip_orientation_base_side(shares) };
}

int trip_orientation_find(trip_orientation *u, trip_writer *w, const trip_occupancy_params *params,
                          trip_budget *budget)
{
    trip_occupancy *o = trip_budget_take(budget, sizeof *o);
    if (!o)
        return trip_fail(TRIP_ERROR, "brick", "orientation",
                         "guessing it takes 3 MiB of memory: raise --memory");
    int status = trip_occupancy_read(o, w, params, budget);
    if (status == 0)
        *u = look_at(o);
    trip_budget_release(budget, o, sizeof *o);
    return status;
}
