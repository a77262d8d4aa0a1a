/* In place of the viewer where it is left out. */
#include "view.h"

#include "report.h"

int trip_view_run(const trip_view_params *params)
{
    (void)params;
    return trip_fail(TRIP_ERROR, "view", "window",
                     "this program was built without the viewer (-DTRIP_VIEW=OFF)");
}
