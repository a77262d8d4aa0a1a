#include "tf_curves.h"

#include "report.h"
#include "text.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
    COLOUR_SAMPLES = 256,   /* over the whole curve, as in ParaView's tables */
    OPACITY_SAMPLES = 1024, /* over the whole curve; at least 8 per curved segment */
};

static double clamp_unit(double x)
{
    return fmin(1, fmax(0, x));
}

/* Accepts rounding errors below 0 and above 1 in exported numbers. */
static bool is_unit(double x)
{
    return x > -1e-6 && x < 1 + 1e-6;
}

static int out_of_memory(const char *where)
{
    return trip_fail(TRIP_ERROR, TRIP_TF_STAGE, where, "out of memory");
}

static int check_node(const trip_tf_nodes *n, const trip_tf_node *at, const char *where,
                      const char *key)
{
    if (!isfinite(at->value))
        return trip_fail(TRIP_ERROR, TRIP_TF_STAGE, where, "%s: a value is not finite", key);
    if (n->count && at->value < n->data[n->count - 1].value)
        return trip_fail(TRIP_ERROR, TRIP_TF_STAGE, where, "%s: values decrease at point %zu", key,
                         n->count + 1);
    if (!is_unit(at->part[0]) || !is_unit(at->part[1]) || !is_unit(at->part[2]))
        return trip_fail(TRIP_ERROR, TRIP_TF_STAGE, where,
                         "%s: point %zu has a number outside 0 to 1", key, n->count + 1);
    if (n->count == TRIP_TF_MAX_POINTS)
        return trip_fail(TRIP_ERROR, TRIP_TF_STAGE, where, "%s: more than %d points", key,
                         TRIP_TF_MAX_POINTS);
    return TRIP_OK;
}

int trip_tf_nodes_add(trip_tf_nodes *n, trip_tf_node node, const char *where, const char *key)
{
    int status = check_node(n, &node, where, key);
    if (status)
        return status;
    if (n->count == n->room) {
        size_t room = n->room ? 2 * n->room : 32;
        trip_tf_node *larger = realloc(n->data, room * sizeof *larger);
        if (!larger)
            return out_of_memory(where);
        n->data = larger;
        n->room = room;
    }
    for (int i = 0; i < 3; i++)
        node.part[i] = clamp_unit(node.part[i]);
    n->data[n->count++] = node;
    return TRIP_OK;
}

/* Returns the next number and moves *text behind it, or returns NAN. */
static double next_number(const char **text)
{
    char word[64];
    double number;
    const char *begin = *text + strspn(*text, " \t\r\n");
    size_t length = strcspn(begin, " \t\r\n");
    *text = begin + length;
    if (length == 0 || length >= sizeof word)
        return NAN;
    memcpy(word, begin, length);
    word[length] = 0;
    return trip_text_to_double(word, &number) ? number : NAN;
}

int trip_tf_nodes_add_text(trip_tf_nodes *n, const char *text, int numbers_per_node,
                           const char *where, const char *key)
{
    double numbers = next_number(&text);
    int status = TRIP_OK;
    if (!(numbers >= 0 && numbers <= 4 * TRIP_TF_MAX_POINTS) ||
        fmod(numbers, numbers_per_node) != 0)
        return trip_fail(TRIP_ERROR, TRIP_TF_STAGE, where,
                         "%s: must start with the number of numbers, a multiple of %d", key,
                         numbers_per_node);
    for (double i = 0; i < numbers && !status; i += numbers_per_node) {
        trip_tf_node node = { .part = { 0, 0.5, 0 } };
        node.value = next_number(&text);
        for (int k = 0; k + 1 < numbers_per_node; k++)
            node.part[k] = next_number(&text);
        status = trip_tf_nodes_add(n, node, where, key);
    }
    if (!status && text[strspn(text, " \t\r\n")])
        return trip_fail(TRIP_ERROR, TRIP_TF_STAGE, where,
                         "%s: more numbers than its first number says", key);
    return status;
}

/* Normalises values over the range of the nodes. */
static void normalise(trip_tf_nodes *n)
{
    double lo = n->count ? n->data[0].value : 0;
    double span = n->count ? n->data[n->count - 1].value - lo : 0;
    for (size_t i = 0; i < n->count; i++)
        n->data[i].value = span > 0 ? clamp_unit((n->data[i].value - lo) / span) : 0;
}

void trip_tf_curves_stretch(trip_tf_curves *c)
{
    const trip_tf_nodes *n = &c->colours;
    double lo = n->count ? n->data[0].value : 0, hi = n->count ? n->data[n->count - 1].value : 0;
    if (hi != 1 || (lo != 0 && lo != -1))
        return;
    c->normalised = true;
    normalise(&c->opacities);
    normalise(&c->colours);
}

void trip_tf_curves_drop_opaque(trip_tf_curves *c)
{
    for (size_t i = 0; i < c->opacities.count; i++)
        if (c->opacities.data[i].part[0] < 1)
            return;
    c->opacities.count = 0;
}

/* A growing list of points. */
typedef struct samples {
    trip_tf curve;
    size_t room;
    bool failed; /* memory is exhausted */
} samples;

static void add(samples *s, double value, trip_rgba colour)
{
    if (s->curve.count == s->room) {
        size_t room = s->room ? 2 * s->room : 256;
        trip_tf_point *larger = realloc(s->curve.points, room * sizeof *larger);
        if (!larger) {
            s->failed = true;
            return;
        }
        s->curve.points = larger;
        s->room = room;
    }
    s->curve.points[s->curve.count++] = (trip_tf_point){ value, colour };
}

static void add_colour(samples *s, double value, const double rgb[3])
{
    add(s, value, (trip_rgba){ rgb[0], rgb[1], rgb[2], 0 });
}

static void add_opacity(samples *s, double value, double opacity)
{
    add(s, value, (trip_rgba){ 0, 0, 0, opacity });
}

/* Returns the number of equal parts of a segment, if `total` parts cover all nodes. */
static int parts_of(const trip_tf_nodes *n, size_t i, int total, int min)
{
    double span = n->data[n->count - 1].value - n->data[0].value;
    double fraction = (n->data[i + 1].value - n->data[i].value) / span;
    int parts = fraction >= 0 && fraction <= 1 ? (int)ceil(fraction * total)
                                               : 1; /* the span may overflow */
    return parts > min ? parts : min;
}

static double along(const trip_tf_nodes *n, size_t i, double s)
{
    double a = n->data[i].value, b = n->data[i + 1].value;
    return fmin(b, fmax(a, a * (1 - s) + b * s));
}

static void sample_colours(const trip_tf_curves *c, samples *out)
{
    const trip_tf_nodes *n = &c->colours;
    for (size_t i = 0; i < n->count; i++) {
        const trip_tf_node *at = &n->data[i];
        add_colour(out, at->value, at->part);
        if (i + 1 == n->count || at[1].value == at->value || c->space == TRIP_COLOUR_RGB)
            continue;
        if (c->space == TRIP_COLOUR_STEP)
            add_colour(out, at->value, at[1].part);
        int parts = c->space == TRIP_COLOUR_STEP ? 1 : parts_of(n, i, COLOUR_SAMPLES, 1);
        for (int k = 1; k < parts; k++) {
            double s = (double)k / parts, rgb[3];
            trip_colour_between(c->space, at->part, at[1].part, s, rgb);
            add_colour(out, along(n, i, s), rgb);
        }
    }
}

/* As vtkPiecewiseFunction::GetTable: s is 0.5 at the midpoint; sharpness is in [0.01, 0.99]. */
static double sharpened(double y1, double y2, double s, double sharpness)
{
    double exponent = 1 + 10 * sharpness, t = (1 - sharpness) * (y2 - y1);
    s = s < 0.5 ? 0.5 * pow(2 * s, exponent) : 1 - 0.5 * pow(2 * (1 - s), exponent);
    double s2 = s * s, s3 = s2 * s;
    double y = (2 * s3 - 3 * s2 + 1) * y1 + (3 * s2 - 2 * s3) * y2 + (2 * s3 - 3 * s2 + s) * t;
    return fmin(fmax(y1, y2), fmax(fmin(y1, y2), y));
}

/* Adds the inner points of the opacity segment after node i. */
static void sample_segment(const trip_tf_nodes *n, size_t i, samples *out)
{
    const trip_tf_node *at = &n->data[i];
    double y1 = at->part[0], y2 = at[1].part[0], sharpness = at->part[2];
    double midpoint = fmin(0.99999, fmax(0.00001, at->part[1]));
    if (sharpness > 0.99) {
        add_opacity(out, along(n, i, midpoint), y1);
        add_opacity(out, along(n, i, midpoint), y2);
    } else if (sharpness < 0.01) {
        if (midpoint != 0.5)
            add_opacity(out, along(n, i, midpoint), (y1 + y2) / 2);
    } else {
        int parts = parts_of(n, i, OPACITY_SAMPLES, 8);
        parts += parts % 2; /* an even number has a sample at the midpoint */
        for (int k = 1; k < parts; k++) {
            double s = (double)k / parts;
            double x = s < 0.5 ? 2 * s * midpoint : midpoint + (2 * s - 1) * (1 - midpoint);
            add_opacity(out, along(n, i, x), sharpened(y1, y2, s, sharpness));
        }
    }
}

static void sample_opacities(const trip_tf_curves *c, samples *out)
{
    const trip_tf_nodes *n = &c->opacities;
    for (size_t i = 0; i < n->count; i++) {
        add_opacity(out, n->data[i].value, n->data[i].part[0]);
        if (i + 1 < n->count && n->data[i + 1].value > n->data[i].value &&
            n->data[i + 1].part[0] != n->data[i].part[0])
            sample_segment(n, i, out);
    }
    if (n->count == 0) {
        add_opacity(out, c->colours.data[0].value, 0);
        add_opacity(out, c->colours.data[c->colours.count - 1].value, 1);
    }
}

static trip_rgba join(trip_rgba colour, trip_rgba opacity)
{
    colour.opacity = opacity.opacity;
    return colour;
}

static bool same_rgba(const trip_rgba *a, const trip_rgba *b)
{
    return a->r == b->r && a->g == b->g && a->b == b->b && a->opacity == b->opacity;
}

/* Merges the curves. The result has each value of either curve once, or twice if a curve has a step
 * there. */
static void merge_curves(const trip_tf *colour, const trip_tf *opacity, samples *merged)
{
    size_t i = 0, j = 0;
    while (i < colour->count || j < opacity->count) {
        double x = i == colour->count    ? opacity->points[j].value
                   : j == opacity->count ? colour->points[i].value
                                         : fmin(colour->points[i].value, opacity->points[j].value);
        trip_rgba below =
            join(trip_tf_evaluate_below(colour, x), trip_tf_evaluate_below(opacity, x));
        trip_rgba from = join(trip_tf_evaluate(colour, x), trip_tf_evaluate(opacity, x));
        if (!same_rgba(&below, &from))
            add(merged, x, below);
        add(merged, x, from);
        while (i < colour->count && colour->points[i].value <= x)
            i++;
        while (j < opacity->count && opacity->points[j].value <= x)
            j++;
    }
}

int trip_tf_curves_build(trip_tf **out, const trip_tf_curves *c, const char *where)
{
    samples colour = { 0 }, opacity = { 0 }, merged = { 0 };
    int status = TRIP_OK;
    *out = NULL;
    if (c->colours.count == 0)
        return trip_fail(TRIP_ERROR, TRIP_TF_STAGE, where, "the function has no colours");
    sample_colours(c, &colour);
    sample_opacities(c, &opacity);
    if (!colour.failed && !opacity.failed)
        merge_curves(&colour.curve, &opacity.curve, &merged);
    if (colour.failed || opacity.failed || merged.failed)
        status = out_of_memory(where);
    else if (merged.curve.count > TRIP_TF_MAX_POINTS)
        status = trip_fail(TRIP_ERROR, TRIP_TF_STAGE, where, "takes more than %d points",
                           TRIP_TF_MAX_POINTS);
    else
        status = trip_tf_from_points(out, merged.curve.points, merged.curve.count, c->normalised,
                                     c->unit_world);
    if (!status)
        (*out)->ramp = c->opacities.count == 0;
    free(colour.curve.points);
    free(opacity.curve.points);
    free(merged.curve.points);
    return status;
}

void trip_tf_curves_free(trip_tf_curves *c)
{
    free(c->colours.data);
    free(c->opacities.data);
    *c = (trip_tf_curves){ 0 };
}
