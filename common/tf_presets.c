/* The built-in presets: functions over the data's range, functions in Hounsfield units, and
 * functions made from the volume's histogram. Opacities are per voxel, for volumes about 256 voxels
 * across, drawn with shading. */
#include "tf_internal.h"

#include "report.h"
#include "text.h"

#include <assert.h>
#include <stdio.h>
#include <string.h>

enum { MAX_POINTS = 10, PRESETS = 16 };

/* The units of a preset's values. */
typedef enum basis {
    OVER_RANGE, /* 0 to 1 over the data's range */
    HOUNSFIELD,
    HISTOGRAM, /* made by `kind` from the volume's histogram */
} basis;

typedef struct preset {
    const char *name, *summary;
    basis basis;
    trip_tf_point points[MAX_POINTS]; /* ends before the first point of all zeros */
    trip_tf_kind kind;
} preset;

static const preset presets[PRESETS] = {
    { "grey", "a first look", OVER_RANGE,
      .points = { { 0.00, { 0.00, 0.00, 0.00, 0.000 } },
                  { 0.10, { 0.25, 0.25, 0.25, 0.000 } },
                  { 0.40, { 0.60, 0.60, 0.60, 0.030 } },
                  { 1.00, { 1.00, 1.00, 1.00, 0.300 } } } },
    { "bone", "CT of any scale: soft tissue as a veil, bone solid", OVER_RANGE,
      .points = { { 0.00, { 0.55, 0.25, 0.15, 0.000 } },
                  { 0.22, { 0.62, 0.28, 0.18, 0.000 } },
                  { 0.32, { 0.80, 0.45, 0.32, 0.010 } },
                  { 0.40, { 0.86, 0.62, 0.45, 0.015 } },
                  { 0.50, { 0.95, 0.87, 0.72, 0.300 } },
                  { 1.00, { 1.00, 0.98, 0.92, 0.800 } } } },
    { "hot-metal", "CT of machine parts: black body colours, dense parts solid", OVER_RANGE,
      .points = { { 0.00, { 0.00, 0.00, 0.00, 0.000 } },
                  { 0.15, { 0.25, 0.00, 0.00, 0.000 } },
                  { 0.40, { 0.80, 0.10, 0.00, 0.020 } },
                  { 0.65, { 1.00, 0.55, 0.00, 0.080 } },
                  { 0.85, { 1.00, 0.90, 0.35, 0.300 } },
                  { 1.00, { 1.00, 1.00, 0.90, 0.600 } } } },
    /* Colours: matplotlib's viridis (CC0) at equal steps. */
    { "viridis", "simulations: even steps in lightness, safe for colour-blind eyes", OVER_RANGE,
      .points = { { 0.000, { 0.267, 0.005, 0.329, 0.000 } },
                  { 0.125, { 0.279, 0.175, 0.483, 0.000 } },
                  { 0.250, { 0.230, 0.322, 0.546, 0.008 } },
                  { 0.375, { 0.173, 0.449, 0.558, 0.018 } },
                  { 0.500, { 0.128, 0.567, 0.551, 0.035 } },
                  { 0.625, { 0.158, 0.684, 0.502, 0.070 } },
                  { 0.750, { 0.369, 0.789, 0.383, 0.130 } },
                  { 0.875, { 0.678, 0.864, 0.190, 0.250 } },
                  { 1.000, { 0.993, 0.906, 0.144, 0.400 } } } },
    { "vessels", "angiograms", OVER_RANGE,
      .points = { { 0.00, { 0.35, 0.02, 0.02, 0.000 } },
                  { 0.12, { 0.45, 0.03, 0.03, 0.000 } },
                  { 0.30, { 0.78, 0.10, 0.08, 0.150 } },
                  { 0.55, { 0.95, 0.35, 0.22, 0.500 } },
                  { 1.00, { 1.00, 0.85, 0.65, 0.900 } } } },
    { "xray", "faint everywhere, so that depths add up; best with --no-shading", OVER_RANGE,
      .points = { { 0.00, { 1.00, 1.00, 1.00, 0.000 } },
                  { 0.05, { 1.00, 1.00, 1.00, 0.000 } },
                  { 1.00, { 1.00, 1.00, 1.00, 0.030 } } } },
    { "ct-bone", "CT in Hounsfield units: bone alone", HOUNSFIELD,
      .points = { { 130, { 0.78, 0.45, 0.32, 0.000 } },
                  { 220, { 0.88, 0.66, 0.47, 0.040 } },
                  { 350, { 0.95, 0.86, 0.70, 0.300 } },
                  { 1200, { 1.00, 0.98, 0.92, 0.800 } },
                  { 3000, { 1.00, 1.00, 1.00, 0.950 } } } },
    { "ct-soft", "CT in Hounsfield units: muscle, organs and vessels, fat as a veil, bone",
      HOUNSFIELD,
      .points = { { -150, { 0.85, 0.65, 0.35, 0.000 } },
                  { -60, { 0.90, 0.72, 0.45, 0.003 } },
                  { 0, { 0.80, 0.38, 0.30, 0.015 } },
                  { 60, { 0.74, 0.24, 0.20, 0.100 } },
                  { 180, { 0.90, 0.52, 0.40, 0.250 } },
                  { 350, { 0.97, 0.90, 0.78, 0.500 } },
                  { 1500, { 1.00, 1.00, 0.96, 0.900 } } } },
    /* The walls of lungs and airways: values between air and tissue only. */
    { "ct-lung", "CT in Hounsfield units: lungs and airways", HOUNSFIELD,
      .points = { { -960, { 0.35, 0.55, 0.80, 0.000 } },
                  { -860, { 0.45, 0.65, 0.85, 0.004 } },
                  { -700, { 0.65, 0.75, 0.85, 0.020 } },
                  { -550, { 0.90, 0.70, 0.65, 0.080 } },
                  { -400, { 0.92, 0.50, 0.42, 0.080 } },
                  { -300, { 0.85, 0.40, 0.35, 0.000 } } } },
    { "ct-skin", "CT in Hounsfield units: the surface of the body", HOUNSFIELD,
      .points = { { -500, { 0.70, 0.45, 0.35, 0.000 } },
                  { -300, { 0.85, 0.62, 0.50, 0.200 } },
                  { -100, { 0.93, 0.72, 0.60, 0.600 } },
                  { 100, { 0.95, 0.74, 0.62, 0.800 } },
                  { 3000, { 1.00, 0.85, 0.75, 0.900 } } } },
    { "auto", "the one of the following that suits the volume", HISTOGRAM,
      .kind = TRIP_TF_AUTOMATIC },
    { "ct", "CT in Hounsfield units", HISTOGRAM, .kind = TRIP_TF_CT },
    { "mr", "magnetic resonance", HISTOGRAM, .kind = TRIP_TF_MR },
    { "fog", "smoke, clouds, fog", HISTOGRAM, .kind = TRIP_TF_FOG },
    { "labels", "integers that name objects", HISTOGRAM, .kind = TRIP_TF_LABELS },
    { "simulation", "anything else", HISTOGRAM, .kind = TRIP_TF_SIMULATION },
};

const char *trip_tf_preset_name(size_t i)
{
    return i < PRESETS ? presets[i].name : NULL;
}

const char *trip_tf_preset_summary(size_t i)
{
    return i < PRESETS ? presets[i].summary : NULL;
}

const char *trip_tf_preset_basis(size_t i)
{
    static const char *const names[] = { "data's range", "Hounsfield", "histogram" };
    return i < PRESETS ? names[presets[i].basis] : NULL;
}

bool trip_tf_is_preset(const char *name)
{
    for (size_t i = 0; i < PRESETS; i++)
        if (!strcmp(name, presets[i].name))
            return true;
    return false;
}

const char *trip_tf_nearest_preset(const char *name)
{
    trip_text_nearest nearest = { .text = name };
    for (size_t i = 0; i < PRESETS; i++)
        trip_text_nearest_try(&nearest, presets[i].name);
    return nearest.name;
}

static int fail_unknown(const char *name)
{
    const char *nearest = trip_tf_nearest_preset(name);
    return trip_fail(TRIP_USAGE, TRIP_TF_STAGE, "preset",
                     "no preset `%s`;%s%s%s `triptych tf list` lists the presets", name,
                     nearest ? " did you mean preset:" : "", nearest ? nearest : "",
                     nearest ? "?" : "");
}

static bool is_end(const trip_tf_point *p)
{
    static const trip_tf_point end;
    return memcmp(p, &end, sizeof end) == 0;
}

int trip_tf_from_preset(trip_tf **out, const char *name)
{
    for (size_t i = 0; i < PRESETS; i++) {
        const preset *p = &presets[i];
        if (strcmp(name, p->name) != 0)
            continue;
        if (p->basis == HISTOGRAM)
            return trip_tf_from_kind(out, p->kind);
        size_t count = 0;
        while (count < MAX_POINTS && !(count && is_end(&p->points[count])))
            count++;
        int status = trip_tf_from_points(out, p->points, count, p->basis == OVER_RANGE, 0);
        if (!status)
            (*out)->hounsfield = p->basis == HOUNSFIELD;
        return status;
    }
    return fail_unknown(name);
}
