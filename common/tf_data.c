/* Adapts functions to their data, and stretches functions over a window of values. */
#include "tf_internal.h"

#include "report.h"

#include <math.h>
#include <stdlib.h>

int trip_tf_from_kind(trip_tf **out, trip_tf_kind kind)
{
    const trip_tf_point none = { 0 };
    int status = trip_tf_from_points(out, &none, 1, false, 0);
    if (!status) {
        (*out)->made = true;
        (*out)->as = kind;
    }
    return status;
}

bool trip_tf_needs_data(const trip_tf *tf)
{
    return tf->normalised || tf->made;
}

int trip_tf_adapt(trip_tf *tf, const trip_tf_data *data, const char *where)
{
    trip_tf *made;
    if (!tf->made) {
        trip_tf_denormalise(tf, data->value_min, data->value_max);
        return TRIP_OK;
    }
    trip_tf_kind kind = tf->as == TRIP_TF_AUTOMATIC ? data->kind : tf->as;
    if (!data->histogram)
        return trip_fail(
            TRIP_ERROR, TRIP_TF_STAGE, where,
            "has no histogram to make a transfer function from; give a file or another preset");
    int status = trip_tf_make_automatic(&made, kind, data->histogram);
    if (status)
        return status;
    free(tf->points);
    *tf = *made;
    free(made);
    return TRIP_OK;
}

int trip_tf_window(trip_tf *tf, double width, double level)
{
    double lo = tf->normalised ? 0 : tf->points[0].value;
    double hi = tf->normalised ? 1 : tf->points[tf->count - 1].value;
    double from = level - width / 2, to = level + width / 2;
    if (!isfinite(from) || !isfinite(to) || !(from < to))
        return trip_fail(TRIP_USAGE, TRIP_TF_STAGE, "--window",
                         "the window from %g to %g is empty or invalid", from, to);
    if (!(lo < hi))
        return trip_fail(TRIP_USAGE, TRIP_TF_STAGE, "--window",
                         "the transfer function has a single value, which cannot be stretched");
    for (size_t i = 0; i < tf->count; i++) {
        double t = tf->points[i].value / 2 - lo / 2; /* halves, since the span may overflow */
        t /= hi / 2 - lo / 2;
        double value = from * (1 - t) + to * t;
        /* Rounding must not put a point before its predecessor. */
        tf->points[i].value = i ? fmax(value, tf->points[i - 1].value) : value;
    }
    tf->normalised = false;
    tf->hounsfield = false;
    return TRIP_OK;
}

/* Air is about -1000, water 0, bone some hundreds, metal thousands. */
static bool may_be_hounsfield(double value_min, double value_max)
{
    return value_min >= -32768 && value_min <= -150 && value_max >= 100 && value_max <= 65535;
}

void trip_tf_check_range(const trip_tf *tf, double value_min, double value_max, const char *where)
{
    if (tf->hounsfield && !may_be_hounsfield(value_min, value_max))
        trip_warn(where,
                  "the values from %g to %g do not look like the Hounsfield units of the transfer "
                  "function; --window and --level move it",
                  value_min, value_max);
    else if (value_min <= value_max && !trip_tf_visible_in(tf, value_min, value_max))
        trip_warn(where, "no value from %g to %g is visible with the transfer function", value_min,
                  value_max);
}
