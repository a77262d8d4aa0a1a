#include "renderer_choice.h"

#include <glob.h>

#include "report.h"

static void drop(const char *line, void *user)
{
    (void)line;
    (void)user;
}

/* Whether the machine has a graphics device: DRM, NVIDIA, WSL, Mali or Adreno. Without one, GL
 * could only draw on the processor, and loading GL to find that out takes about 60 MB and 0.1 s. */
static bool has_graphics_device(void)
{
    static const char *const patterns[] = { "/dev/dri/*", "/dev/nvidiactl", "/dev/dxg",
                                            "/dev/mali*", "/dev/kgsl-3d0" };
    bool found = false;
    for (size_t i = 0; i < sizeof patterns / sizeof *patterns && !found; i++) {
        glob_t nodes = { 0 };
        found = glob(patterns[i], GLOB_NOSORT, NULL, &nodes) == 0;
        globfree(&nodes);
    }
    return found;
}

/* Creates the fastest renderer of this machine. Failures of GL are not reported. */
static int create_best(trip_renderer **out, unsigned threads, trip_budget *budget)
{
    if (!has_graphics_device())
        return trip_cpu_create(out, budget, threads);
    trip_scope quiet = { .around = trip_scope_current(), .sink = drop };
    trip_scope *before = trip_scope_enter(&quiet);
    int status = trip_gl_create(out, budget);
    trip_scope_enter(before);
    if (!status && !(*out)->software)
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
