/* Mixes two transfer functions. */
#include <stdlib.h>

#include "report.h"
#include "tf_internal.h"

static trip_rgba mix(trip_rgba a, trip_rgba b, double t)
{
    return (trip_rgba){ a.r + t * (b.r - a.r), a.g + t * (b.g - a.g), a.b + t * (b.b - a.b),
                        a.opacity + t * (b.opacity - a.opacity) };
}

/* Returns the next value at which `a` or `b` has a point, and moves i and j behind its points. */
static double next_value(const trip_tf *a, const trip_tf *b, size_t *i, size_t *j)
{
    bool first = *j == b->count || (*i < a->count && a->points[*i].value <= b->points[*j].value);
    double value = first ? a->points[*i].value : b->points[*j].value;
    while (*i < a->count && a->points[*i].value == value)
        ++*i;
    while (*j < b->count && b->points[*j].value == value)
        ++*j;
    return value;
}

/* Mixes the points. Both functions are linear between values at which one of them has a point. At
 * such a value, each may have a step. */
static size_t mix_points(const trip_tf *a, const trip_tf *b, double t, trip_tf_point *out)
{
    size_t i = 0, j = 0, count = 0;
    while (i < a->count || j < b->count) {
        double value = next_value(a, b, &i, &j);
        out[count++] = (trip_tf_point){ value, mix(trip_tf_evaluate_below(a, value),
                                                   trip_tf_evaluate_below(b, value), t) };
        out[count++] = (trip_tf_point){ value, mix(trip_tf_evaluate(a, value),
                                                   trip_tf_evaluate(b, value), t) };
        const trip_rgba *p = &out[count - 2].colour, *q = &out[count - 1].colour;
        if (p->r == q->r && p->g == q->g && p->b == q->b && p->opacity == q->opacity)
            count--;
    }
    return count;
}

int trip_tf_mix(trip_tf **out, const trip_tf *a, const trip_tf *b, double t)
{
    *out = NULL;
    if (a->normalised || b->normalised || a->unit_world != b->unit_world)
        return trip_fail(
            TRIP_ERROR, TRIP_TF_STAGE, "",
            "transfer functions with different units of opacity cannot be interpolated");
    trip_tf_point *points = malloc(2 * (a->count + b->count) * sizeof *points);
    if (!points)
        return trip_fail(TRIP_ERROR, TRIP_TF_STAGE, "", "out of memory");
    size_t count = mix_points(a, b, t, points);
    int status = trip_tf_from_points(out, points, count, false, a->unit_world);
    free(points);
    return status;
}
