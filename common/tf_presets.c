/* The built-in presets, all over the data's range. Opacities are per voxel and meant for volumes of
 * some 256 voxels across, drawn with shading. */
#include "tf_internal.h"

#include "report.h"

#include <assert.h>
#include <stdio.h>
#include <string.h>

enum { MOST_POINTS = 10 };

typedef struct preset {
    const char *name;
    trip_tf_point points[MOST_POINTS]; /* ends at the point of value 1 */
} preset;

static const preset presets[] = {
    { "grey",
      { { 0.00, { 0.00, 0.00, 0.00, 0.000 } },
        { 0.10, { 0.25, 0.25, 0.25, 0.000 } },
        { 0.40, { 0.60, 0.60, 0.60, 0.030 } },
        { 1.00, { 1.00, 1.00, 1.00, 0.300 } } } },
    /* Skin and muscle as a faint red veil, bone ivory and solid. */
    { "bone",
      { { 0.00, { 0.55, 0.25, 0.15, 0.000 } },
        { 0.22, { 0.62, 0.28, 0.18, 0.000 } },
        { 0.32, { 0.80, 0.45, 0.32, 0.010 } },
        { 0.40, { 0.86, 0.62, 0.45, 0.015 } },
        { 0.50, { 0.95, 0.87, 0.72, 0.300 } },
        { 1.00, { 1.00, 0.98, 0.92, 0.800 } } } },
    { "hot-metal",
      { { 0.00, { 0.00, 0.00, 0.00, 0.000 } },
        { 0.15, { 0.25, 0.00, 0.00, 0.000 } },
        { 0.40, { 0.80, 0.10, 0.00, 0.020 } },
        { 0.65, { 1.00, 0.55, 0.00, 0.080 } },
        { 0.85, { 1.00, 0.90, 0.35, 0.300 } },
        { 1.00, { 1.00, 1.00, 0.90, 0.600 } } } },
    /* Colours: matplotlib's viridis (CC0) at equal steps. */
    { "viridis",
      { { 0.000, { 0.267, 0.005, 0.329, 0.000 } },
        { 0.125, { 0.279, 0.175, 0.483, 0.000 } },
        { 0.250, { 0.230, 0.322, 0.546, 0.008 } },
        { 0.375, { 0.173, 0.449, 0.558, 0.018 } },
        { 0.500, { 0.128, 0.567, 0.551, 0.035 } },
        { 0.625, { 0.158, 0.684, 0.502, 0.070 } },
        { 0.750, { 0.369, 0.789, 0.383, 0.130 } },
        { 0.875, { 0.678, 0.864, 0.190, 0.250 } },
        { 1.000, { 0.993, 0.906, 0.144, 0.400 } } } },
    /* Extinction proportional to density, as in real fog. */
    { "fog", { { 0.00, { 0.90, 0.93, 0.97, 0.000 } }, { 1.00, { 1.00, 1.00, 1.00, 0.200 } } } },
    { "vessels",
      { { 0.00, { 0.35, 0.02, 0.02, 0.000 } },
        { 0.12, { 0.45, 0.03, 0.03, 0.000 } },
        { 0.30, { 0.78, 0.10, 0.08, 0.150 } },
        { 0.55, { 0.95, 0.35, 0.22, 0.500 } },
        { 1.00, { 1.00, 0.85, 0.65, 0.900 } } } },
    /* Faint everywhere, so that depths add up; best without shading. */
    { "xray",
      { { 0.00, { 1.00, 1.00, 1.00, 0.000 } },
        { 0.05, { 1.00, 1.00, 1.00, 0.000 } },
        { 1.00, { 1.00, 1.00, 1.00, 0.030 } } } },
};

enum { PRESETS = sizeof presets / sizeof *presets };

static const char *const names[] = { "grey", "bone",    "hot-metal", "viridis",
                                     "fog",  "vessels", "xray",      NULL };
static_assert(sizeof names / sizeof *names == PRESETS + 1, "a name for every preset");

const char *const *trip_tf_preset_names(void)
{
    return names;
}

static int fail_unknown(const char *name)
{
    char known[256] = "";
    for (int i = 0; i < PRESETS; i++) {
        size_t used = strlen(known);
        snprintf(known + used, sizeof known - used, "%s%s", i ? ", " : "", presets[i].name);
    }
    return trip_fail(TRIP_USAGE, TRIP_TF_STAGE, "preset", "no preset `%s`; there are %s", name,
                     known);
}

int trip_tf_from_preset(trip_tf **out, const char *name)
{
    for (int i = 0; i < PRESETS; i++) {
        if (strcmp(name, presets[i].name) != 0)
            continue;
        size_t count = 1;
        while (presets[i].points[count - 1].value < 1)
            count++;
        return trip_tf_from_points(out, presets[i].points, count, true, 0);
    }
    return fail_unknown(name);
}
