/* In place of the server where it is left out. */
#include "serve.h"

#include "report.h"

int trip_serve_run(const trip_serve_params *params)
{
    return trip_fail(TRIP_ERROR, "serve", params->input,
                     "this program was built without the server (-DTRIP_SERVE=OFF)");
}
