/* Recognises the kind of a volume from its histogram and the header of its file.
 * TRANSFER_FUNCTIONS.md has the rules. */
#include "tf_internal.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { BINS = 1024 };

static const char *const names[TRIP_TF_KINDS] = {
    "auto", "ct", "mr", "fog", "labels", "simulation"
};

const char *trip_tf_kind_name(trip_tf_kind kind)
{
    return names[kind];
}

const char *trip_tf_kind_title(trip_tf_kind kind)
{
    static const char *const titles[TRIP_TF_KINDS] = {
        "what it is", "CT in Hounsfield units",       "magnetic resonance", "smoke, clouds or fog",
        "labels",     "measured or simulated values",
    };
    return titles[kind];
}

trip_tf_kind trip_tf_kind_from_name(const char *name)
{
    for (int i = 0; i < TRIP_TF_KINDS; i++)
        if (name && !strcmp(name, names[i]))
            return (trip_tf_kind)i;
    return TRIP_TF_AUTOMATIC;
}

/* Returns the number of voxels per unit of value in [lo, hi], as a fraction of all voxels. */
static double density_in(const trip_histogram *h, double lo, double hi)
{
    double range = h->value_max - h->value_min, sum = 0;
    for (int i = 0; i < BINS; i++) {
        double centre = h->value_min + range * (i + 0.5) / BINS;
        sum += centre >= lo && centre < hi ? (double)h->counts[i] : 0;
    }
    return sum / (double)h->total / (hi - lo);
}

/* Whether air and soft tissue occur at their values, far more often than the values between them.
 */
static bool is_ct(const trip_histogram *h)
{
    const double air = density_in(h, -1100, -850), tissue = density_in(h, -150, 150);
    const double between = density_in(h, -700, -250);
    return h->value_min >= -32768 && h->value_max >= 150 && h->value_max <= 65535 &&
           air * 250 >= 0.01 && tissue * 300 >= 0.02 && air > 2 * between && tissue > 2 * between;
}

static int compare(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return x < y ? -1 : x > y;
}

/* Measures how much the counts differ from one frequent value to the next, as the median of
 * |ln(ratio)|. Returns 0 if few values are frequent. Counts vary smoothly in images, but not in
 * labels. */
static double roughness(const trip_histogram *h)
{
    double steps[BINS], before = 0;
    size_t count = 0;
    for (int i = 1; i < BINS; i++) { /* the lowest value is the background */
        if (h->counts[i] < 100)
            continue;
        if (before > 0)
            steps[count++] = fabs(log((double)h->counts[i] / before));
        before = (double)h->counts[i];
    }
    qsort(steps, count, sizeof *steps, compare);
    return count >= 8 ? steps[count / 2] : 0;
}

static bool are_labels(const trip_histogram *h)
{
    double range = h->value_max - h->value_min;
    int occurring = 0;
    for (int i = 0; i < BINS; i++)
        occurring += h->counts[i] > 0;
    if (h->value_min < 0 || !(range >= 1 && range < 16384))
        return false;
    if (occurring <= 6 || range < 32)
        return true;
    return occurring <= 512 && roughness(h) > 0.5;
}

/* Whether there is a broad mass of tissue above the background at the lowest values, with a valley
 * between them. */
static bool is_mr(const trip_histogram *h)
{
    trip_tf_tissue t;
    return h->value_min >= 0 && trip_tf_find_tissue(&t, h) && t.fraction >= 0.18 &&
           t.sharpest < 0.3;
}

/* DICOM's modality CT means Hounsfield units, unless rescaling was lost. Without rescaling, no
 * value is below zero, although the air around a patient is. */
static bool is_stated_ct(const char *modality, const trip_histogram *h)
{
    return !strcmp(modality, "CT") && h->value_min >= -32768 && h->value_min <= -100 &&
           h->value_max <= 65535;
}

trip_tf_kind trip_tf_recognise(const trip_tf_origin *o, const trip_histogram *h)
{
    const char *modality = o->modality ? o->modality : "";
    bool values = h->total > 0 && h->value_min < h->value_max;
    if (h->id_count)
        return TRIP_TF_LABELS;
    if (o->sparse)
        return h->value_min >= 0 ? TRIP_TF_FOG : TRIP_TF_SIMULATION;
    if (!values)
        return TRIP_TF_SIMULATION;
    if (!strcmp(modality, "MR") && h->value_min >= 0)
        return TRIP_TF_MR;
    if (is_stated_ct(modality, h))
        return TRIP_TF_CT;
    if (!strcmp(modality, "SEG") || (o->integers && are_labels(h)))
        return TRIP_TF_LABELS;
    if (strcmp(modality, "MR") != 0 && is_ct(h))
        return TRIP_TF_CT;
    return o->patient && !*modality && is_mr(h) ? TRIP_TF_MR : TRIP_TF_SIMULATION;
}

int trip_tf_make_automatic(trip_tf **out, trip_tf_kind kind, const trip_histogram *h)
{
    switch (kind) {
    case TRIP_TF_CT:
        return trip_tf_ct_from_histogram(out, h);
    case TRIP_TF_MR:
        return trip_tf_mr_from_histogram(out, h);
    case TRIP_TF_FOG:
        return trip_tf_fog_from_histogram(out, h);
    case TRIP_TF_LABELS:
        return trip_tf_labels_from_histogram(out, h);
    default:
        return trip_tf_from_histogram(out, h);
    }
}
