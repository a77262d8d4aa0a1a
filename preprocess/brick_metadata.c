#include "brick_metadata.h"

#include <cjson/cJSON.h>
#include <inttypes.h>
#include <math.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "anatomy.h"
#include "orientation.h"
#include "json.h"
#include "file_path.h"
#include "report.h"
#include "text.h"

/* Prints numbers in their shortest exact form, because cJSON's form differs between versions. */
static cJSON *number(double value)
{
    char text[32];
    return cJSON_CreateRaw(trip_text_from_double(value, text));
}

static void add_number(cJSON *object, const char *name, double value)
{
    cJSON_AddItemToObject(object, name, number(value));
}

static void add_function(cJSON *root, const char *name, const trip_tf *tf)
{
    char *text = tf ? trip_tf_to_text(tf) : NULL;
    if (text)
        cJSON_AddStringToObject(root, name, text);
    free(text);
}

static void add_envelope(cJSON *root, const trip_brick_metadata *t)
{
    cJSON *intervals = cJSON_AddArrayToObject(root, "envelope");
    for (size_t i = 0; i < t->envelope->count; i++) {
        cJSON *interval = cJSON_CreateArray();
        cJSON_AddItemToArray(interval, number(t->envelope->intervals[i].lo));
        cJSON_AddItemToArray(interval, number(t->envelope->intervals[i].hi));
        cJSON_AddItemToArray(intervals, interval);
    }
}

static void add_fills(cJSON *root, const trip_fills *fills)
{
    cJSON *values = fills->count ? cJSON_AddArrayToObject(root, "fills") : NULL;
    for (unsigned i = 0; i < fills->count; i++)
        cJSON_AddItemToArray(values, number(fills->values[i]));
}

static void add_histogram(cJSON *root, const trip_histogram *h, const trip_tally *t)
{
    cJSON *histogram = cJSON_AddObjectToObject(root, "histogram");
    add_number(histogram, "value_min", h->value_min);
    add_number(histogram, "value_max", h->value_max);
    if (t->below)
        add_number(histogram, "below", (double)t->below);
    if (t->above)
        add_number(histogram, "above", (double)t->above);
    cJSON *counts = cJSON_AddArrayToObject(histogram, "counts");
    for (size_t i = 0; i < sizeof h->counts / sizeof *h->counts; i++)
        cJSON_AddItemToArray(counts, number((double)h->counts[i]));
}

/* A transfer function for ranges only: values inside are visible, with opacity ascending with the
 * value. */
static int make_ramp(trip_tf **out, const trip_brick_metadata *t)
{
    enum { POINTS = 4 };
    const trip_rgba dark = { 0.45, 0.25, 0.1, 0.02 }, light = { 1, 0.95, 0.85, 0.5 };
    double lo = t->envelope->intervals[0].lo;
    double hi = t->envelope->intervals[t->envelope->count - 1].hi;
    lo = lo > t->histogram->value_min ? lo : t->histogram->value_min;
    hi = hi < t->histogram->value_max ? hi : t->histogram->value_max;
    hi = hi > lo ? hi : lo;
    trip_rgba before = dark, after = light;
    before.opacity = after.opacity = 0;
    const trip_tf_point points[POINTS] = {
        { lo, before }, { lo, dark }, { hi, light }, { nextafter(hi, INFINITY), after }
    };
    return trip_tf_from_points(out, points, POINTS, false, 0);
}

trip_tf_kind trip_brick_kind(const trip_volume_info *info, const trip_histogram *h)
{
    const trip_tf_origin origin = {
        .sparse = info->sparse,
        .integers = info->type < TRIP_F16 && info->slope == floor(info->slope) &&
                    info->inter == floor(info->inter),
        .modality = info->modality,
        .labels = info->labels,
        .named_labels = info->named_labels,
        .patient = info->space[0] || !strcmp(info->format, "nifti"),
    };
    return trip_tf_recognise(&origin, h);
}

/* Writes the default transfer function. */
static int add_default_function(cJSON *root, const trip_brick_metadata *t)
{
    trip_tf *made = NULL;
    const trip_brick_params *p = t->params;
    bool given = p->function_count > 0 && !p->automatic;
    bool ranges = p->range_count > 0 && t->envelope->count > 0 && !p->automatic;
    int status = 0;
    if (!given && ranges)
        status = make_ramp(&made, t);
    else if (!given)
        status =
            trip_tf_make_automatic(&made, trip_brick_kind(t->info, t->histogram), t->histogram);
    if (status == 0)
        add_function(root, "transfer_function", made ? made : t->functions[0]);
    trip_tf_destroy(made);
    return status;
}

static void add_functions(cJSON *root, const trip_brick_metadata *t)
{
    cJSON *functions = cJSON_AddArrayToObject(root, "functions");
    for (size_t i = 0; i < t->params->function_count; i++) {
        char *text = trip_tf_to_text(t->functions[i]);
        if (text)
            cJSON_AddItemToArray(functions, cJSON_CreateString(text));
        free(text);
    }
}

/* Adds one option in the command line's form, "--name=value". */
__attribute__((format(printf, 2, 3))) static void add_option(cJSON *options, const char *form, ...)
{
    char *text;
    va_list args;
    va_start(args, form);
    int length = vasprintf(&text, form, args);
    va_end(args);
    if (length < 0)
        return;
    cJSON_AddItemToArray(options, cJSON_CreateString(text));
    free(text);
}

/* Writes the options for reading the input. */
static void add_volume_options(cJSON *options, const trip_volume_params *v)
{
    char number[3][32];
    if (v->grid)
        add_option(options, "--grid=%s", v->grid);
    if (v->level_set)
        add_option(options, "--level-set=%s",
                   v->level_set == TRIP_LEVEL_SET_BAND ? "band" : "filled");
    if (v->raw_dims[0])
        add_option(options, "--size=%" PRId64 ",%" PRId64 ",%" PRId64, v->raw_dims[0],
                   v->raw_dims[1], v->raw_dims[2]);
    if (v->raw_type)
        add_option(options, "--type=%s", v->raw_type);
    if (v->raw_endian)
        add_option(options, "--endian=%s", v->raw_endian == 2 ? "big" : "little");
    if (v->raw_offset_bytes)
        add_option(options, "--offset=%" PRIu64, v->raw_offset_bytes);
    if (v->spacing[0] > 0)
        add_option(options, "--spacing=%s,%s,%s", trip_text_from_double(v->spacing[0], number[0]),
                   trip_text_from_double(v->spacing[1], number[1]),
                   trip_text_from_double(v->spacing[2], number[2]));
    if (v->axes)
        add_option(options, "--axes=%s", v->axes);
    if (v->coordinates)
        add_option(options, "--coordinates=%s", v->coordinates);
    if (v->allow_gaps)
        add_option(options, "--allow-gaps");
    if (v->series)
        add_option(options, "--series=%d", v->series);
    if (v->channel)
        add_option(options, "--channel=%d", v->channel);
    if (v->time)
        add_option(options, "--time=%d", v->time);
    if (v->fill)
        add_option(options, "--fill=%s", v->fill);
}

static void add_region(cJSON *options, const trip_region *r)
{
    char sides[3][64];
    if (trip_region_is_whole(r))
        return;
    for (int a = 0; a < 3; a++)
        if (r->past[a])
            snprintf(sides[a], sizeof sides[a], "%" PRId64 ":%" PRId64, r->first[a], r->past[a]);
        else
            snprintf(sides[a], sizeof sides[a], "%" PRId64 ":", r->first[a]);
    add_option(options, "--region=%s,%s,%s", sides[0], sides[1], sides[2]);
}

/* Writes the options that make the data set again, except the options for kept values. */
static void add_source_options(cJSON *root, const trip_brick_params *p)
{
    cJSON *options = cJSON_AddArrayToObject(root, "source_options");
    add_volume_options(options, &p->volume);
    add_region(options, &p->region);
    static const char *const code_bits[] = { NULL, "8", "16" };
    if (p->code_bits)
        add_option(options, "--code-bits=%s", code_bits[p->code_bits]);
    static const char *const normals[] = { NULL, "compact", "full", "none", "stored" };
    if (p->normals)
        add_option(options, "--normals=%s", normals[p->normals]);
    if (p->no_halo)
        add_option(options, "--halo=0");
    if (p->tile_voxels)
        add_option(options, "--tile=%u", p->tile_voxels);
    if (p->slab_sheets)
        add_option(options, "--slab-sheets=%u", p->slab_sheets);
    if (p->levels)
        add_option(options, "--levels=%d", p->levels > 0 ? p->levels : 0);
    static const char *const levels_for[] = { NULL, "post", "pre", "both" };
    if (p->levels_for && p->levels >= 0)
        add_option(options, "--levels-for=%s", levels_for[p->levels_for]);
}

static const char *base_name(const char *path)
{
    const char *slash = strrchr(path, '/');
    return slash && slash[1] ? slash + 1 : path;
}

/* ---- orientation ---- */

/* How the world direction that is up was found. */
typedef struct orientation {
    const char *from;       /* value of the key "orientation" */
    const char *up, *front; /* world directions */
    const char *why;        /* reason of a guess that needs a note; otherwise NULL */
    bool stored;            /* drawing needs the key "up" */
} orientation;

/* Returns the length of the grid along an axis in world units. */
static double length_along(const trip_volume_info *info, int a)
{
    const double(*m)[4] = info->index_to_world.m;
    return (double)info->dims[a] * trip_length(trip_v3(m[0][a], m[1][a], m[2][a]));
}

/* Some programs that write OpenVDB have y up, others z. Smoke rises, so a grid that is much longer
 * along one of the two stands on end. */
static orientation orient_vdb(const trip_volume_info *info, trip_orientation u)
{
    static const double much = 1.5;
    const double y = length_along(info, 1), z = length_along(info, 2);
    const bool y_base = u.footing == TRIP_ORIENTATION_BASE_LOW_Y;
    orientation o = { .up = "+y", .stored = true };
    if (info->up[0]) {
        o.from = "program";
        o.up = info->up;
    } else if (y_base || u.footing == TRIP_ORIENTATION_BASE_LOW_Z) {
        o.from = "base";
        o.up = y_base ? "+y" : "+z";
        o.why = "being level at one end alone, it is taken to stand there";
    } else if (z > much * y || y > much * z) {
        o.from = "length";
        o.up = z > y ? "+z" : "+y";
        o.why = "being much longer along one of y and z, it is taken to stand on end";
    } else {
        o.from = "format";
        o.why = "OpenVDB is taken to be as in most programs";
    }
    return o;
}

/* Finds the orientation of a volume without one in its file. */
static orientation guess(const trip_volume_info *info, trip_orientation u)
{
    if (!strcmp(info->format, "openvdb"))
        return orient_vdb(info, u);
    if (info->up[0])
        return (orientation){ "format", info->up, NULL, NULL, true };
    if (!strcmp(info->format, "nifti"))
        return (orientation){ "format", "+z", "+y", "NIfTI is taken to be in its usual space",
                              false };
    if (u.mirror == 2)
        return (orientation){ "symmetry", "-y", "-x",
                              "being mirror-symmetric across z, its slices are taken for views "
                              "from the side",
                              false };
    if (trip_anatomy_is_scan_from_above(&info->index_to_world))
        return (orientation){ "voxels", "-z", "-y",
                              "its voxels being longer along one axis, its slices are taken to run "
                              "from the top of a head down",
                              false };
    if (u.footing >= 0 && u.footing != TRIP_ORIENTATION_BASE_LOW_Z)
        return (orientation){ "base", trip_orientation_base_name(u.footing ^ 1), NULL,
                              "being level at the other end alone, it is taken to stand there",
                              false };
    return (orientation){ u.footing >= 0 ? "base" : "none", "+z", NULL, NULL, false };
}

/* Matches trip_dataset_metadata_orient() in render/dataset_metadata.c. */
static orientation orientation_of(const trip_volume_info *info, const trip_volume_params *params,
                                  trip_orientation upright)
{
    if (params->axes)
        return (orientation){ .from = "axes" };
    if (info->space[0] || info->oriented)
        return (orientation){ .from = info->space[0] ? "space" : "file" };
    return guess(info, upright);
}

const char *trip_brick_orientation(const trip_volume_info *info, const trip_volume_params *params)
{
    const orientation o =
        orientation_of(info, params, (trip_orientation){ .mirror = -1, .footing = -1 });
    const bool decided = strcmp(o.from, "none") && strcmp(o.from, "voxels") &&
                         (strcmp(info->format, "openvdb") != 0 || info->up[0]);
    return decided ? o.from : "values";
}

void trip_brick_metadata_note(const trip_brick_metadata *t, char note[TRIP_BRICK_NOTE_BYTES])
{
    const trip_volume_info *info = t->info;
    const orientation o = orientation_of(t->info, &t->params->volume, t->upright);
    const size_t length = (size_t)snprintf(note, TRIP_BRICK_NOTE_BYTES, "%s%s", info->note,
                                           o.why && info->note[0] ? "; " : "");
    if (o.why)
        snprintf(note + length, TRIP_BRICK_NOTE_BYTES - length,
                 "its file does not say what is up: %s, with up at %s%s%s; --up, --view and --axes "
                 "say otherwise",
                 o.why, o.up, o.front ? " and the front at " : "", o.front ? o.front : "");
}

static void add_orientation(cJSON *root, const trip_brick_metadata *t)
{
    static const char *const axes[] = { "x", "y", "z" };
    const orientation o = orientation_of(t->info, &t->params->volume, t->upright);
    cJSON_AddStringToObject(root, "orientation", o.from);
    if (t->info->space[0])
        cJSON_AddStringToObject(root, "space", t->info->space);
    if (t->info->oriented)
        cJSON_AddTrueToObject(root, "oriented");
    if (o.stored)
        cJSON_AddStringToObject(root, "up", o.up);
    if (t->upright.mirror >= 0)
        cJSON_AddStringToObject(root, "mirror", axes[t->upright.mirror]);
    if (t->upright.footing >= 0)
        cJSON_AddStringToObject(root, "footing", trip_orientation_base_name(t->upright.footing));
}

/* Adds the path of the source relative to the data set, unless the source lies beside it. The data
 * sets in the cache are not beside their volume, and serve every copy of it. */
static void add_source_path(cJSON *root, const trip_brick_params *p)
{
    char *path = p->max_bytes ? NULL : trip_path_relative(p->output, p->input);
    if (path && strchr(path, '/'))
        cJSON_AddStringToObject(root, "source_path", path);
    free(path);
}

char *trip_brick_metadata_make(const trip_brick_metadata *t)
{
    char note[TRIP_BRICK_NOTE_BYTES];
    trip_brick_metadata_note(t, note);
    cJSON *root = cJSON_CreateObject();
    if (strcmp(t->info->format, "memory") != 0) {
        cJSON_AddStringToObject(root, "source", base_name(t->params->input));
        add_source_path(root, t->params);
    }
    add_source_options(root, t->params);
    cJSON_AddStringToObject(root, "format", t->info->format);
    if (t->info->name[0])
        cJSON_AddStringToObject(root, "grid", t->info->name);
    if (note[0])
        cJSON_AddStringToObject(root, "note", note);
    add_orientation(root, t);
    cJSON_AddStringToObject(root, "type", trip_scalar_name(t->info->type));
    cJSON_AddStringToObject(root, "function_kind",
                            trip_tf_kind_name(trip_brick_kind(t->info, t->histogram)));
    cJSON_AddBoolToObject(root, "keep_all", t->params->keep_all);
    if (t->info->sparse)
        add_number(root, "background", t->info->background);
    add_envelope(root, t);
    add_functions(root, t);
    int status = add_default_function(root, t);
    add_fills(root, t->fills);
    add_histogram(root, t->histogram, t->tally);
    char *text = status == 0 ? trip_json_print(root, false) : NULL;
    cJSON_Delete(root);
    if (status == 0 && !text)
        trip_fail(TRIP_ERROR, "brick", t->params->output, "out of memory");
    return text;
}
