#include "settings.h"

#include "report.h"

trip_settings trip_settings_default(void)
{
    return (trip_settings){
        .classify = TRIP_CLASSIFY_PRE,
        .samples_per_sheet = 2,
        .method = TRIP_METHOD_MERGE,
        .traversal = TRIP_TRAVERSAL_OUTWARD,
        .target = TRIP_TARGET_RGBA32F,
        .shading = true,
        .headlight = true,
        .light_direction = { 0, 0, 1 },
        .h = TRIP_H_AUTO,
        .early_termination = TRIP_EARLY_TERMINATION_AUTO,
        .kernel_radius = TRIP_KERNEL_RADIUS_VOXELS,
        .low_pass_px = TRIP_LOW_PASS_PX,
        .flatten = 1,
        .background = { 0, 0, 0, 1 },
        .deviations = true,
        .tolerance = 1e-4,
        .samples = 1,
        .effects = { .cells = TRIP_LIGHT_CELLS },
    };
}

/* Fails for settings that the forms of splatting from the papers exclude. */
static int check_forms(const trip_settings *s)
{
    const bool image = s->method == TRIP_METHOD_IMAGE;
    if ((image || s->footprint == TRIP_FOOTPRINT_FIXED) && trip_settings_has_levels(s))
        return trip_fail(
            TRIP_USAGE, "render", "levels",
            "fixed footprints and method image draw only the finest level; leave out the "
            "bounds on pixels and bytes");
    if (image && (s->traversal != TRIP_TRAVERSAL_OUTWARD || trip_settings_sum_sheets(s)))
        return trip_fail(TRIP_USAGE, "render", "method",
                         "image requires traversal outward and compositing splat");
    if (s->vertex_weights && (s->method != TRIP_METHOD_MERGE || trip_settings_sum_sheets(s)))
        return trip_fail(TRIP_USAGE, "render", "weights",
                         "vertex weights require method merge and compositing splat");
    if (s->classify == TRIP_CLASSIFY_POST && (image || s->vertex_weights))
        return trip_fail(TRIP_USAGE, "render", "method",
                         "method image and vertex weights draw splats; use classify pre");
    return 0;
}

int trip_settings_check(const trip_settings *s)
{
    int status = check_forms(s);
    if (status)
        return status;
    if (s->depth && s->target != TRIP_TARGET_RGBA32F)
        return trip_fail(TRIP_USAGE, "render", "depth",
                         "rounded layers have no depth; leave the target at rgba32f");
    if (trip_settings_stays(s) && trip_settings_has_levels(s))
        return trip_fail(TRIP_USAGE, "render", "levels",
                         "lists in GPU memory hold only the finest level; use --submit replicated");
    if (trip_settings_stays(s) && s->clip.count > 0)
        return trip_fail(TRIP_USAGE, "render", "clipping",
                         "lists in GPU memory cannot be clipped; use --submit replicated");
    if (s->effects.shadows && s->headlight)
        return trip_fail(TRIP_USAGE, "render", "shadows",
                         "light from the eye casts no visible shadows; give its direction");
    if (s->low_pass == TRIP_LOW_PASS_UNIFORM && s->footprint != TRIP_FOOTPRINT_EWA)
        return trip_fail(TRIP_USAGE, "render", "low-pass", "uniform scaling requires kernel ewa");
    if (s->flatten > 1 && s->footprint != TRIP_FOOTPRINT_EWA)
        return trip_fail(TRIP_USAGE, "render", "flatten", "flat kernels require kernel ewa");
    if (s->classify == TRIP_CLASSIFY_PRE)
        return 0;
    if (s->kernel == TRIP_KERNEL_NEAREST && s->samples_per_sheet != 2)
        return trip_fail(TRIP_USAGE, "render", "samples-per-sheet",
                         "nearest interpolation requires 2 samples per sheet");
    if (s->footprint != TRIP_FOOTPRINT_EXACT || s->low_pass != TRIP_LOW_PASS_EWA ||
        s->low_pass_px != TRIP_LOW_PASS_PX)
        return trip_fail(TRIP_USAGE, "render", "kernel",
                         "footprints and their low-pass filter apply to splats; use classify pre");
    if (s->traversal == TRIP_TRAVERSAL_ASCENDING)
        return trip_fail(TRIP_USAGE, "render", "traversal",
                         "classify post requires traversal outward");
    if (s->target != TRIP_TARGET_RGBA32F || trip_settings_stays(s) || s->triangles)
        return trip_fail(TRIP_USAGE, "render", "settings",
                         "targets and forms of submission apply to splats; use classify pre");
    return 0;
}
