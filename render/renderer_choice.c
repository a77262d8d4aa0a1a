#include "renderer_choice.h"

#include "report.h"

static void drop(const char *line, void *user)
{
    (void)line;
    (void)user;
}

/* Whatever draws fastest here; a renderer that this machine lacks is passed over in silence. */
static int create_best(trip_renderer **out, trip_budget *budget)
{
    trip_report_redirect(drop, NULL);
    int status = trip_gl_create(out, budget);
    trip_report_redirect(NULL, NULL);
    return status ? trip_reference_create(out, budget) : 0;
}

int trip_renderer_create(trip_renderer **out, trip_renderer_kind kind, unsigned threads,
                         trip_budget *budget)
{
    (void)threads;
    switch (kind) {
    case TRIP_RENDERER_GL:
        return trip_gl_create(out, budget);
    case TRIP_RENDERER_REFERENCE:
        return trip_reference_create(out, budget);
    case TRIP_RENDERER_CPU:
        return trip_fail(TRIP_USAGE, "render", "--renderer cpu", "is not part of this build");
    case TRIP_RENDERER_AUTO:
        break;
    }
    return create_best(out, budget);
}
