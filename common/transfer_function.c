#include "tf_internal.h"

#include "report.h"
#include "text.h"

#include <assert.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static bool in_unit_interval(double x)
{
    return x >= 0 && x <= 1; /* false for NaN */
}

const char *trip_tf_point_fault(const trip_tf_point *point, const trip_tf_point *before,
                                bool normalised)
{
    const trip_rgba *c = &point->colour;
    if (!isfinite(point->value))
        return "the value is not a finite number";
    if (normalised && !in_unit_interval(point->value))
        return "a normalised value is outside 0 to 1";
    if (!in_unit_interval(c->r) || !in_unit_interval(c->g) || !in_unit_interval(c->b))
        return "a colour component is outside 0 to 1";
    if (!in_unit_interval(c->opacity))
        return "the opacity is outside 0 to 1";
    if (before && point->value < before->value)
        return "the value is smaller than the one before; list the points by increasing value";
    return NULL;
}

static int check_points(const trip_tf_point *points, size_t count, bool normalised)
{
    if (count == 0 || count > TRIP_TF_MAX_POINTS)
        return trip_fail(TRIP_ERROR, TRIP_TF_STAGE, "",
                         "%zu points; a transfer function has 1 to %d", count, TRIP_TF_MAX_POINTS);
    for (size_t i = 0; i < count; i++) {
        const char *fault = trip_tf_point_fault(&points[i], i ? &points[i - 1] : NULL, normalised);
        if (fault)
            return trip_fail(TRIP_ERROR, TRIP_TF_STAGE, "", "point %zu: %s", i + 1, fault);
    }
    return TRIP_OK;
}

int trip_tf_from_points(trip_tf **out, const trip_tf_point *points, size_t count, bool normalised,
                        double unit_world)
{
    *out = NULL;
    int status = check_points(points, count, normalised);
    if (status)
        return status;
    if (!isfinite(unit_world) || unit_world < 0)
        return trip_fail(TRIP_ERROR, TRIP_TF_STAGE, "", "the unit of length must be positive");
    trip_tf *tf = calloc(1, sizeof *tf);
    trip_tf_point *copy = calloc(count, sizeof *copy);
    if (!tf || !copy) {
        free(tf);
        free(copy);
        return trip_fail(TRIP_ERROR, TRIP_TF_STAGE, "", "out of memory");
    }
    memcpy(copy, points, count * sizeof *copy);
    *tf = (trip_tf){
        .points = copy, .count = count, .normalised = normalised, .unit_world = unit_world
    };
    *out = tf;
    return TRIP_OK;
}

void trip_tf_destroy(trip_tf *tf)
{
    if (tf)
        free(tf->points);
    free(tf);
}

bool trip_tf_is_normalised(const trip_tf *tf)
{
    return tf->normalised;
}

void trip_tf_denormalise(trip_tf *tf, double value_min, double value_max)
{
    if (!tf->normalised)
        return;
    for (size_t i = 0; i < tf->count; i++) {
        double t = tf->points[i].value, value = value_min * (1 - t) + value_max * t;
        /* Rounding must not put a point before its predecessor. */
        tf->points[i].value = i ? fmax(value, tf->points[i - 1].value) : value;
    }
    tf->normalised = false;
}

double trip_tf_unit_world(const trip_tf *tf)
{
    return tf->unit_world;
}

const trip_tf_point *trip_tf_points(const trip_tf *tf, size_t *count)
{
    *count = tf->count;
    return tf->points;
}

/* Returns the index of the first point above `value`, or tf->count if there is none. */
static size_t first_above(const trip_tf *tf, double value)
{
    size_t low = 0, high = tf->count;
    while (low < high) {
        size_t middle = low + (high - low) / 2;
        if (tf->points[middle].value > value)
            high = middle;
        else
            low = middle + 1;
    }
    return low;
}

/* Returns the position of `value` between a < b, 0 to 1. Halves the terms if b - a overflows. */
static double fraction_between(double a, double b, double value)
{
    double span = b - a;
    return isfinite(span) ? (value - a) / span : (value / 2 - a / 2) / (b / 2 - a / 2);
}

static trip_rgba interpolate(const trip_tf_point *p, const trip_tf_point *q, double value)
{
    double t = fraction_between(p->value, q->value, value);
    const trip_rgba *a = &p->colour, *b = &q->colour;
    return (trip_rgba){ a->r + t * (b->r - a->r), a->g + t * (b->g - a->g),
                        a->b + t * (b->b - a->b), a->opacity + t * (b->opacity - a->opacity) };
}

trip_rgba trip_tf_evaluate(const trip_tf *tf, double value)
{
    if (isnan(value))
        return (trip_rgba){ 0, 0, 0, 0 };
    size_t above = first_above(tf, value);
    if (above == 0)
        return tf->points[0].colour;
    if (above == tf->count)
        return tf->points[tf->count - 1].colour;
    return interpolate(&tf->points[above - 1], &tf->points[above], value);
}

trip_rgba trip_tf_evaluate_below(const trip_tf *tf, double value)
{
    size_t i = first_above(tf, value);
    if (i == 0 || tf->points[i - 1].value < value)
        return trip_tf_evaluate(tf, value);
    while (i > 1 && tf->points[i - 2].value == value)
        i--;
    return tf->points[i - 1].colour;
}

/* Opacities are never negative. Between two points, a value is visible exactly if one of the points
 * is visible. At single values (the ends, the points), trip_tf_evaluate() decides. */
bool trip_tf_visible_in(const trip_tf *tf, double lo, double hi)
{
    if (!(lo <= hi))
        return false;
    if (trip_tf_evaluate(tf, lo).opacity > 0 || trip_tf_evaluate(tf, hi).opacity > 0)
        return true;
    size_t i = first_above(tf, lo);
    for (i = i ? i : 1; i < tf->count && tf->points[i - 1].value < hi; i++) {
        const trip_tf_point *p = &tf->points[i - 1], *q = &tf->points[i];
        double from = p->value > lo ? p->value : lo, to = q->value < hi ? q->value : hi;
        if (from < to && (p->colour.opacity > 0 || q->colour.opacity > 0))
            return true;
    }
    return false;
}

bool trip_tf_visible_span(const trip_tf *tf, double lo, double hi, double span[2])
{
    size_t first = 0, last = tf->count;
    while (first < tf->count && !(tf->points[first].colour.opacity > 0))
        first++;
    while (last > 0 && !(tf->points[last - 1].colour.opacity > 0))
        last--;
    span[0] = first > 0 && first < tf->count ? fmax(lo, tf->points[first - 1].value) : lo;
    span[1] = last > 0 && last < tf->count ? fmin(hi, tf->points[last].value) : hi;
    return trip_tf_visible_in(tf, lo, hi);
}

/* Opacities below half of 1/255 are not visible in a picture. */
static const double faint = 0.5 / 255;

bool trip_tf_lost_peak(const trip_tf *tf, double lo, double hi, trip_tf_point *out)
{
    double step = (hi - lo) / 65535;
    for (size_t i = 0; i < tf->count && step > 0; i++) {
        const trip_tf_point *p = &tf->points[i];
        double code = (p->value - lo) / step;
        if (!(p->value > lo && p->value < hi) || p->colour.opacity <= faint)
            continue;
        double below = trip_tf_evaluate(tf, lo + step * floor(code)).opacity;
        double above = trip_tf_evaluate(tf, lo + step * ceil(code)).opacity;
        if (fmax(below, above) < p->colour.opacity / 2) {
            *out = *p;
            return true;
        }
    }
    return false;
}

static void write_number(FILE *f, double number, char end)
{
    char text[32];
    fputs(trip_text_from_double(number, text), f);
    fputc(end, f);
}

char *trip_tf_to_text(const trip_tf *tf)
{
    char *text = NULL;
    size_t bytes = 0;
    FILE *f = open_memstream(&text, &bytes);
    if (!f)
        return NULL;
    if (tf->made)
        fprintf(f, "# made from the histogram: %s\n", trip_tf_kind_name(tf->as));
    if (tf->ramp)
        fputs("# opacity: a ramp that starts above the background\n", f);
    fputs("unit ", f);
    if (tf->unit_world > 0)
        write_number(f, tf->unit_world, '\n');
    else
        fputs("voxel\n", f);
    fputs(tf->normalised ? "values normalised\n" : "values data\n", f);
    for (size_t i = 0; i < tf->count; i++) {
        const trip_tf_point *p = &tf->points[i];
        write_number(f, p->value, ' ');
        write_number(f, p->colour.r, ' ');
        write_number(f, p->colour.g, ' ');
        write_number(f, p->colour.b, ' ');
        write_number(f, p->colour.opacity, '\n');
    }
    if (fclose(f) != 0) {
        free(text);
        return NULL;
    }
    return text;
}

double trip_extinction(double opacity)
{
    return -log1p(-fmin(opacity, TRIP_OPACITY_MAX));
}

trip_tf_entry trip_tf_entry_at(const trip_tf *tf, double value, double voxel_world)
{
    const double unit = tf->unit_world > 0 ? tf->unit_world : voxel_world;
    assert(!tf->normalised && unit > 0);
    const trip_rgba c = trip_tf_evaluate(tf, value);
    return (trip_tf_entry){ (float)c.r, (float)c.g, (float)c.b,
                            (float)(trip_extinction(c.opacity) / unit) };
}

void trip_tf_fill_table(const trip_tf *tf, double lo, double hi, double voxel_world,
                        trip_tf_entry table[65536])
{
    for (int code = 0; code < 65536; code++)
        table[code] = trip_tf_entry_at(tf, lo + (hi - lo) * code / 65535, voxel_world);
}
