#include "upright.h"

#include "footing.h"
#include "mirror.h"
#include "report.h"

static trip_upright look_at(const trip_occupancy *o)
{
    double scores[3], shares[6];
    for (int axis = 0; axis < 3; axis++)
        scores[axis] = trip_mirror_score(o, axis);
    for (int side = 0; side < 6; side++)
        shares[side] = trip_footing_share(o, side);
    return (trip_upright){ trip_mirror_axis(scores), trip_footing_side(shares) };
}

int trip_upright_find(trip_upright *u, trip_writer *w, const trip_occupancy_params *params,
                      trip_budget *budget)
{
    trip_occupancy *o = trip_budget_take(budget, sizeof *o);
    if (!o)
        return trip_fail(TRIP_ERROR, "brick", "how the volume lies",
                         "finding it takes 3 MiB: give more with --memory");
    int status = trip_occupancy_read(o, w, params, budget);
    if (status == 0)
        *u = look_at(o);
    trip_budget_release(budget, o, sizeof *o);
    return status;
}
