/* In the place of render/gl, where that is switched off. */
#include "renderer.h"
#include "report.h"

int trip_gl_create(trip_renderer **out, trip_budget *budget)
{
    (void)budget;
    *out = NULL;
    return trip_fail(TRIP_ERROR, "render", "--renderer gl",
                     "this program was built without OpenGL; --renderer cpu draws the same");
}
