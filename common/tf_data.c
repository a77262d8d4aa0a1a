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
    return tf->normalised || tf->made || tf->ramp;
}

bool trip_tf_needs_histogram(const trip_tf *tf)
{
    return tf->made;
}

bool trip_tf_spans_window(const trip_tf *tf)
{
    return tf->normalised || tf->ramp;
}

/* ---- ramps ---- */

/* Returns where `value` lies between the ends of a ramp, 0 to 1. */
static double share(double value, double from, double to)
{
    return fmin(1, fmax(0, (value - from) / (to - from)));
}

/* Sets opacities that rise from 0 at `from` to 1 at `to`. */
static int set_ramp(trip_tf *tf, double from, double to)
{
    const trip_rgba at_bend = trip_tf_evaluate(tf, from);
    trip_tf_point *points = realloc(tf->points, (tf->count + 1) * sizeof *points);
    size_t at = tf->count;
    if (!points)
        return trip_fail(TRIP_ERROR, TRIP_TF_STAGE, "ramp", "out of memory");
    tf->points = points;
    for (; at > 0 && points[at - 1].value > from; at--)
        points[at] = points[at - 1];
    points[at] = (trip_tf_point){ from, at_bend };
    tf->count++;
    for (size_t i = 0; i < tf->count; i++)
        points[i].colour.opacity = share(points[i].value, from, to);
    return TRIP_OK;
}

/* Starts the ramp of a colour map at the edge of the background, and says so. */
static int adapt_ramp(trip_tf *tf, const trip_histogram *h, const char *where)
{
    const double lo = tf->points[0].value, hi = tf->points[tf->count - 1].value;
    double edge, extreme, from = lo, to = hi;
    if (!tf->ramp)
        return TRIP_OK;
    tf->ramp = false;
    if (h && trip_tf_find_foreground(h, &edge, &extreme)) {
        from = fmax(lo, fmin(hi, edge));
        to = extreme > edge ? hi : lo;
        from = from == to ? lo : from; /* all values of the map are background */
        to = from == to ? hi : to;
    }
    const int status = from != to && from != lo ? set_ramp(tf, from, to) : TRIP_OK;
    if (!status)
        trip_note(where,
                  "the transfer function has colours without opacities; its opacity rises from 0 "
                  "at %.4g to 1 at %.4g, and --window and --level move it",
                  from, to);
    return status;
}

/* ---- data ---- */

int trip_tf_adapt(trip_tf *tf, const trip_tf_data *data, const char *where)
{
    trip_tf *made;
    if (!tf->made) {
        trip_tf_denormalise(tf, data->value_min, data->value_max);
        return adapt_ramp(tf, data->histogram, where);
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
    tf->normalised = tf->ramp = false;
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
