#include "renderer_choice.h"

#include <string.h>

#include "report.h"

static void drop(const char *line, void *user)
{
    (void)line;
    (void)user;
}

/* GL that runs on the processor, by the names that Mesa's and SwiftShader's devices give. */
static bool is_software(const trip_renderer *gl)
{
    static const char *const names[] = { "llvmpipe", "softpipe", "swrast", "SwiftShader" };
    const char *device = gl->ops->device(gl);
    for (size_t i = 0; i < sizeof names / sizeof *names; i++)
        if (strstr(device, names[i]))
            return true;
    return false;
}

/* Whatever draws fastest here; a renderer that this machine lacks is passed over in silence. */
static int create_best(trip_renderer **out, unsigned threads, trip_budget *budget)
{
    trip_scope quiet = { .around = trip_scope_current(), .sink = drop };
    trip_scope *before = trip_scope_enter(&quiet);
    int status = trip_gl_create(out, budget);
    trip_scope_enter(before);
    if (!status && !is_software(*out))
        return 0;
    if (!status)
        (*out)->ops->destroy(*out);
    return trip_cpu_create(out, budget, threads);
}

int trip_renderer_create(trip_renderer **out, trip_renderer_kind kind, unsigned threads,
                         trip_budget *budget)
{
    switch (kind) {
    case TRIP_RENDERER_GL:
        return trip_gl_create(out, budget);
    case TRIP_RENDERER_REFERENCE:
        return trip_reference_create(out, budget);
    case TRIP_RENDERER_CPU:
        return trip_cpu_create(out, budget, threads);
    case TRIP_RENDERER_INTEGRAL:
        return trip_integral_create(out, budget, threads);
    case TRIP_RENDERER_AUTO:
        break;
    }
    return create_best(out, threads, budget);
}
