/* ParaView colour maps (JSON) as piecewise-linear functions. Colours and opacities come as separate
 * curves, each bent in its own way (vtkColorTransferFunction, vtkPiecewiseFunction); both are
 * sampled where they bend and then merged. */
#include "tf_internal.h"

#include "report.h"
#include "tf_colour.h"

#include <cjson/cJSON.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum {
    MOST_NODES = 2048,      /* of either curve */
    COLOUR_SAMPLES = 256,   /* over the whole curve, as ParaView's own tables */
    OPACITY_SAMPLES = 1024, /* over the whole curve; at least 8 a bent segment */
};

/* RGBPoints: value, r, g, b. Points: value, opacity, midpoint, sharpness. */
typedef struct node {
    double value, part[3];
} node;

typedef struct nodes {
    node *data;
    size_t count;
} nodes;

typedef struct map_reader {
    char where[512];
    const cJSON *map;
    trip_colour_space space;
    bool normalised;
    nodes colours, opacities;
} map_reader;

static double clamp_unit(double x)
{
    return fmin(1, fmax(0, x));
}

/* Exported numbers may pass 0 or 1 by a rounding error. */
static bool is_unit(double x)
{
    return x > -1e-6 && x < 1 + 1e-6;
}

static int check_node(const map_reader *r, const char *key, const nodes *n, size_t i)
{
    const node *at = &n->data[i];
    if (!isfinite(at->value))
        return trip_fail(TRIP_ERROR, TRIP_TF_STAGE, r->where, "%s: a value is not finite", key);
    if (i && at->value < at[-1].value)
        return trip_fail(TRIP_ERROR, TRIP_TF_STAGE, r->where, "%s: values decrease at point %zu",
                         key, i + 1);
    if (!is_unit(at->part[0]) || !is_unit(at->part[1]) || !is_unit(at->part[2]))
        return trip_fail(TRIP_ERROR, TRIP_TF_STAGE, r->where,
                         "%s: point %zu has a number outside 0 to 1", key, i + 1);
    return TRIP_OK;
}

/* The numbers of `array`, four to a node. */
static int read_nodes(const map_reader *r, const cJSON *array, const char *key, nodes *out)
{
    int numbers = cJSON_IsArray(array) ? cJSON_GetArraySize(array) : -1;
    if (numbers <= 0 || numbers % 4 != 0 || numbers > 4 * MOST_NODES)
        return trip_fail(TRIP_ERROR, TRIP_TF_STAGE, r->where,
                         "%s is not an array of 1 to %d points of four numbers", key, MOST_NODES);
    out->count = (size_t)numbers / 4;
    out->data = calloc(out->count, sizeof *out->data);
    if (!out->data)
        return trip_fail(TRIP_ERROR, TRIP_TF_STAGE, r->where, "out of memory");
    int status = TRIP_OK;
    const cJSON *item = array->child;
    for (size_t i = 0; i < out->count && !status; i++) {
        double n[4];
        for (int j = 0; j < 4; j++, item = item->next)
            n[j] = cJSON_IsNumber(item) ? item->valuedouble : NAN;
        out->data[i] = (node){ n[0], { n[1], n[2], n[3] } };
        status = check_node(r, key, out, i);
        for (int j = 0; j < 3; j++)
            out->data[i].part[j] = clamp_unit(out->data[i].part[j]);
    }
    return status;
}

static bool is_set(const cJSON *map, const char *key)
{
    const cJSON *item = cJSON_GetObjectItemCaseSensitive(map, key);
    return cJSON_IsTrue(item) || (cJSON_IsNumber(item) && item->valuedouble != 0);
}

static int read_space(map_reader *r)
{
    static const struct {
        const char *name;
        trip_colour_space space;
    } spaces[] = {
        { "RGB", TRIP_COLOUR_RGB },   { "HSV", TRIP_COLOUR_HSV },
        { "Lab", TRIP_COLOUR_LAB },   { "CIELAB", TRIP_COLOUR_LAB },
        { "Step", TRIP_COLOUR_STEP }, { "Diverging", TRIP_COLOUR_DIVERGING },
    };
    const cJSON *item = cJSON_GetObjectItemCaseSensitive(r->map, "ColorSpace");
    const char *name = cJSON_IsString(item) ? item->valuestring : item ? "" : "RGB";
    for (size_t i = 0; i < sizeof spaces / sizeof *spaces; i++) {
        if (strcmp(name, spaces[i].name) == 0) {
            bool wrap = spaces[i].space == TRIP_COLOUR_HSV && is_set(r->map, "HSVWrap");
            r->space = wrap ? TRIP_COLOUR_HSV_WRAP : spaces[i].space;
            return TRIP_OK;
        }
    }
    if (strstr(name, "CIEDE2000")) {
        trip_warn(r->where, "colour space %s is drawn as Lab", name);
        r->space = TRIP_COLOUR_LAB;
        return TRIP_OK;
    }
    return trip_fail(TRIP_ERROR, TRIP_TF_STAGE, r->where,
                     "unknown ColorSpace `%.40s`; known are RGB, HSV, Lab, Diverging, Step", name);
}

/* A map without opacities gets ParaView's default, a ramp from 0 to 1. */
static int make_ramp(map_reader *r)
{
    double lo = r->colours.data[0].value, hi = r->colours.data[r->colours.count - 1].value;
    r->opacities.data = calloc(2, sizeof *r->opacities.data);
    if (!r->opacities.data)
        return trip_fail(TRIP_ERROR, TRIP_TF_STAGE, r->where, "out of memory");
    r->opacities.count = 2;
    r->opacities.data[0] = (node){ lo, { 0, 0.5, 0 } };
    r->opacities.data[1] = (node){ hi, { 1, 0.5, 0 } };
    return TRIP_OK;
}

/* Over 0 to 1 or -1 to 1 a map is meant to be stretched over the data, as ParaView does on loading
 * one; over any other range it was made for certain data. */
static bool spans_generic_range(const nodes *n)
{
    double lo = n->data[0].value, hi = n->data[n->count - 1].value;
    return hi == 1 && (lo == 0 || lo == -1);
}

static void normalise(nodes *n)
{
    double lo = n->data[0].value, span = n->data[n->count - 1].value - lo;
    for (size_t i = 0; i < n->count; i++)
        n->data[i].value = span > 0 ? clamp_unit((n->data[i].value - lo) / span) : 0;
}

static int read_map(map_reader *r)
{
    const cJSON *colours = cJSON_GetObjectItemCaseSensitive(r->map, "RGBPoints");
    const cJSON *opacities = cJSON_GetObjectItemCaseSensitive(r->map, "Points");
    if (!colours)
        return trip_fail(TRIP_ERROR, TRIP_TF_STAGE, r->where,
                         "no RGBPoints; maps of categories (IndexedColors) cannot be used");
    int status = read_space(r);
    if (!status)
        status = read_nodes(r, colours, "RGBPoints", &r->colours);
    if (!status)
        status = opacities ? read_nodes(r, opacities, "Points", &r->opacities) : make_ramp(r);
    if (status)
        return status;
    if (is_set(r->map, "UseLogScale"))
        trip_warn(r->where, "UseLogScale is not supported; the map is used on a linear scale");
    r->normalised = spans_generic_range(&r->colours);
    if (r->normalised) {
        normalise(&r->colours);
        normalise(&r->opacities);
    }
    return TRIP_OK;
}

/* How many equal parts a segment is cut into, when `total` are to cover all nodes. */
static int parts_of(const nodes *n, size_t i, int total, int least)
{
    double span = n->data[n->count - 1].value - n->data[0].value;
    double share = (n->data[i + 1].value - n->data[i].value) / span;
    int parts = share >= 0 && share <= 1 ? (int)ceil(share * total) : 1; /* span may overflow */
    return parts > least ? parts : least;
}

static double along(const nodes *n, size_t i, double s)
{
    double a = n->data[i].value, b = n->data[i + 1].value;
    return fmin(b, fmax(a, a * (1 - s) + b * s));
}

static void add(trip_tf *curve, double value, const double rgb[3], double opacity)
{
    curve->points[curve->count++] = (trip_tf_point){ value, { rgb[0], rgb[1], rgb[2], opacity } };
}

static const double black[3];

static void sample_colours(const map_reader *r, trip_tf *curve)
{
    const nodes *n = &r->colours;
    for (size_t i = 0; i < n->count; i++) {
        const node *at = &n->data[i];
        add(curve, at->value, at->part, 0);
        if (i + 1 == n->count || at[1].value == at->value || r->space == TRIP_COLOUR_RGB)
            continue;
        if (r->space == TRIP_COLOUR_STEP)
            add(curve, at->value, at[1].part, 0);
        int parts = r->space == TRIP_COLOUR_STEP ? 1 : parts_of(n, i, COLOUR_SAMPLES, 1);
        for (int k = 1; k < parts; k++) {
            double s = (double)k / parts, rgb[3];
            trip_colour_between(r->space, at->part, at[1].part, s, rgb);
            add(curve, along(n, i, s), rgb, 0);
        }
    }
}

/* vtkPiecewiseFunction::GetTable: s is 0.5 at the midpoint; sharpness in [0.01, 0.99]. */
static double sharpened(double y1, double y2, double s, double sharpness)
{
    double exponent = 1 + 10 * sharpness, t = (1 - sharpness) * (y2 - y1);
    s = s < 0.5 ? 0.5 * pow(2 * s, exponent) : 1 - 0.5 * pow(2 * (1 - s), exponent);
    double s2 = s * s, s3 = s2 * s;
    double y = (2 * s3 - 3 * s2 + 1) * y1 + (3 * s2 - 2 * s3) * y2 + (2 * s3 - 3 * s2 + s) * t;
    return fmin(fmax(y1, y2), fmax(fmin(y1, y2), y));
}

/* The inner points of the opacity segment after node i. */
static void sample_segment(const nodes *n, size_t i, trip_tf *curve)
{
    const node *at = &n->data[i];
    double y1 = at->part[0], y2 = at[1].part[0], sharpness = at->part[2];
    double midpoint = fmin(0.99999, fmax(0.00001, at->part[1]));
    if (sharpness > 0.99) {
        add(curve, along(n, i, midpoint), black, y1);
        add(curve, along(n, i, midpoint), black, y2);
    } else if (sharpness < 0.01) {
        add(curve, along(n, i, midpoint), black, (y1 + y2) / 2);
    } else {
        int parts = parts_of(n, i, OPACITY_SAMPLES, 8);
        parts += parts % 2; /* so that the midpoint is a sample */
        for (int k = 1; k < parts; k++) {
            double s = (double)k / parts;
            double x = s < 0.5 ? 2 * s * midpoint : midpoint + (2 * s - 1) * (1 - midpoint);
            add(curve, along(n, i, x), black, sharpened(y1, y2, s, sharpness));
        }
    }
}

static void sample_opacities(const map_reader *r, trip_tf *curve)
{
    const nodes *n = &r->opacities;
    for (size_t i = 0; i < n->count; i++) {
        add(curve, n->data[i].value, black, n->data[i].part[0]);
        if (i + 1 < n->count && n->data[i + 1].value > n->data[i].value &&
            n->data[i + 1].part[0] != n->data[i].part[0])
            sample_segment(n, i, curve);
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

/* Every value of either curve once, twice where one of them steps. */
static void merge_curves(const trip_tf *colour, const trip_tf *opacity, trip_tf *merged)
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
            merged->points[merged->count++] = (trip_tf_point){ x, below };
        merged->points[merged->count++] = (trip_tf_point){ x, from };
        while (i < colour->count && colour->points[i].value <= x)
            i++;
        while (j < opacity->count && opacity->points[j].value <= x)
            j++;
    }
}

static int build(trip_tf **out, const map_reader *r)
{
    size_t most_colours = 2 * r->colours.count + COLOUR_SAMPLES;
    size_t most_opacities = 10 * r->opacities.count + OPACITY_SAMPLES;
    trip_tf colour = { .points = calloc(most_colours, sizeof(trip_tf_point)) };
    trip_tf opacity = { .points = calloc(most_opacities, sizeof(trip_tf_point)) };
    trip_tf merged = { .points =
                           calloc(2 * (most_colours + most_opacities), sizeof(trip_tf_point)) };
    int status;
    if (colour.points && opacity.points && merged.points) {
        sample_colours(r, &colour);
        sample_opacities(r, &opacity);
        merge_curves(&colour, &opacity, &merged);
        status = trip_tf_from_points(out, merged.points, merged.count, r->normalised, 0);
    } else {
        status = trip_fail(TRIP_ERROR, TRIP_TF_STAGE, r->where, "out of memory");
    }
    free(colour.points);
    free(opacity.points);
    free(merged.points);
    return status;
}

static const char *name_of(const cJSON *map)
{
    const cJSON *name = cJSON_GetObjectItemCaseSensitive(map, "Name");
    return cJSON_IsString(name) ? name->valuestring : "";
}

static int pick_map(const cJSON *root, const char *name, const char *preset, const cJSON **map)
{
    const cJSON *first = cJSON_IsArray(root) ? root->child : root;
    for (const cJSON *m = first; m; m = m->next) {
        if (cJSON_IsObject(m) && (!preset || strcmp(name_of(m), preset) == 0)) {
            *map = m;
            return TRIP_OK;
        }
    }
    if (!preset)
        return trip_fail(TRIP_ERROR, TRIP_TF_STAGE, name, "holds no colour map");
    return trip_fail(TRIP_ERROR, TRIP_TF_STAGE, name, "holds no colour map named `%s`", preset);
}

static void report_syntax(const char *name, const char *text, const char *at)
{
    char where[512];
    long line_number = 1;
    for (const char *p = text; p < at; p++)
        line_number += *p == '\n';
    snprintf(where, sizeof where, "%.400s: line %ld", name, line_number);
    trip_fail(TRIP_ERROR, TRIP_TF_STAGE, where, "not JSON from here on");
}

/* NULL, and a report, where the text is not JSON from end to end. */
static cJSON *parse_json(const char *name, const char *text, size_t bytes)
{
    const char *end = text;
    cJSON *root = cJSON_ParseWithLengthOpts(text, bytes, &end, 0);
    if (root)
        while (end < text + bytes && (*end == ' ' || (*end >= '\t' && *end <= '\r')))
            end++;
    if (root && (end == text + bytes || *end == 0))
        return root;
    cJSON_Delete(root);
    report_syntax(name, text, end);
    return NULL;
}

int trip_tf_parse_colormap(trip_tf **out, const char *name, const char *text, size_t bytes,
                           const char *preset)
{
    map_reader r = { .map = NULL };
    *out = NULL;
    cJSON *root = parse_json(name, text, bytes);
    int status = root ? pick_map(root, name, preset, &r.map) : TRIP_ERROR;
    if (!status) {
        const char *own = name_of(r.map);
        snprintf(r.where, sizeof r.where, "%.300s%s%.100s", name, *own ? ": " : "", own);
        status = read_map(&r);
    }
    if (!status)
        status = build(out, &r);
    free(r.colours.data);
    free(r.opacities.data);
    cJSON_Delete(root);
    return status;
}
