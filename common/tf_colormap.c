/* Reads colour maps of ParaView (JSON), and volume properties of 3D Slicer in JSON. */
#include "tf_curves.h"

#include "report.h"

#include <cjson/cJSON.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct map_reader {
    char where[512];
    const cJSON *map;
    trip_tf_curves curves;
} map_reader;

static double number_of(const cJSON *item)
{
    return cJSON_IsNumber(item) ? item->valuedouble : NAN;
}

/* Reads the numbers of `array`, four per node. */
static int read_nodes(const map_reader *r, const cJSON *array, const char *key, trip_tf_nodes *out)
{
    int numbers = cJSON_IsArray(array) ? cJSON_GetArraySize(array) : -1, status = TRIP_OK;
    if (numbers <= 0 || numbers % 4 != 0)
        return trip_fail(TRIP_ERROR, TRIP_TF_STAGE, r->where,
                         "%s is not an array of points of four numbers", key);
    const cJSON *item = array->child;
    for (int i = 0; i < numbers && !status; i += 4) {
        double n[4];
        for (int j = 0; j < 4; j++, item = item->next)
            n[j] = number_of(item);
        status =
            trip_tf_nodes_add(out, (trip_tf_node){ n[0], { n[1], n[2], n[3] } }, r->where, key);
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
            r->curves.space = wrap ? TRIP_COLOUR_HSV_WRAP : spaces[i].space;
            return TRIP_OK;
        }
    }
    if (strstr(name, "CIEDE2000")) {
        trip_warn(r->where, "colour space %s is drawn as Lab", name);
        r->curves.space = TRIP_COLOUR_LAB;
        return TRIP_OK;
    }
    return trip_fail(TRIP_ERROR, TRIP_TF_STAGE, r->where,
                     "unknown ColorSpace `%.40s`; known are RGB, HSV, Lab, Diverging, Step", name);
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
        status = read_nodes(r, colours, "RGBPoints", &r->curves.colours);
    if (!status && opacities)
        status = read_nodes(r, opacities, "Points", &r->curves.opacities);
    if (status)
        return status;
    if (is_set(r->map, "UseLogScale"))
        trip_warn(r->where, "UseLogScale is not supported; the map is used on a linear scale");
    trip_tf_curves_drop_opaque(&r->curves);
    trip_tf_curves_stretch(&r->curves);
    return TRIP_OK;
}

/* Reads { "points": [ { "x": X, "y": OPACITY } or { "x": X, "color": [R, G, B] }, ... ] }. */
static int read_slicer_points(const map_reader *r, const cJSON *component, const char *key,
                              trip_tf_nodes *out)
{
    const cJSON *function = cJSON_GetObjectItemCaseSensitive(component, key), *point;
    const cJSON *points = cJSON_GetObjectItemCaseSensitive(function, "points");
    int status = TRIP_OK;
    if (!cJSON_IsArray(points) || !points->child)
        return trip_fail(TRIP_ERROR, TRIP_TF_STAGE, r->where, "%s has no points", key);
    for (point = points->child; point && !status; point = point->next) {
        const cJSON *color = cJSON_GetObjectItemCaseSensitive(point, "color");
        trip_tf_node node = { number_of(cJSON_GetObjectItemCaseSensitive(point, "x")),
                              { number_of(cJSON_GetObjectItemCaseSensitive(point, "y")), 0.5, 0 } };
        for (int i = 0; i < 3 && cJSON_IsArray(color); i++)
            node.part[i] = number_of(cJSON_GetArrayItem(color, i));
        status = trip_tf_nodes_add(out, node, r->where, key);
    }
    return status;
}

/* Reads the first component of a Slicer volume property. */
static int read_slicer(map_reader *r)
{
    const cJSON *components = cJSON_GetObjectItemCaseSensitive(r->map, "components");
    const cJSON *first = cJSON_GetArrayItem(components, 0);
    const cJSON *unit = cJSON_GetObjectItemCaseSensitive(first, "scalarOpacityUnitDistance");
    if (unit && !(number_of(unit) > 0))
        return trip_fail(TRIP_ERROR, TRIP_TF_STAGE, r->where,
                         "scalarOpacityUnitDistance is not a positive length");
    r->curves.unit_world = unit ? number_of(unit) : 0;
    int status = read_slicer_points(r, first, "rgbTransferFunction", &r->curves.colours);
    return status ? status : read_slicer_points(r, first, "scalarOpacity", &r->curves.opacities);
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

/* Parses JSON. Returns NULL after a report if any part of the text is not JSON. */
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
    const cJSON *slicer = cJSON_GetObjectItemCaseSensitive(root, "volumeProperties");
    int status = root ? pick_map(slicer ? slicer : root, name, preset, &r.map) : TRIP_ERROR;
    if (!status) {
        const char *own = name_of(r.map);
        snprintf(r.where, sizeof r.where, "%.300s%s%.100s", name, *own ? ": " : "", own);
        status = slicer ? read_slicer(&r) : read_map(&r);
    }
    if (!status)
        status = trip_tf_curves_build(out, &r.curves, r.where);
    trip_tf_curves_free(&r.curves);
    cJSON_Delete(root);
    return status;
}
