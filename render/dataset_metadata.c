#include "dataset_metadata.h"

#include <stdlib.h>
#include <string.h>

#include <cjson/cJSON.h>

#include "anatomy.h"
#include "json.h"
#include "report.h"

enum { MAX_BINS = 65536 };

typedef struct interval {
    double lo, hi; /* closed */
} interval;

struct trip_dataset_metadata {
    trip_json json;
    const cJSON *root;
    const char *path;   /* path of the data set, for messages */
    interval *envelope; /* ascending and disjoint; NULL if the text has none */
    size_t envelope_count;
};

static double number_of(const cJSON *item)
{
    return cJSON_IsNumber(item) ? item->valuedouble : NAN;
}

static int by_lower_end(const void *a, const void *b)
{
    const interval *p = a, *q = b;
    return (p->lo > q->lo) - (p->lo < q->lo);
}

/* Sorts the intervals and merges touching ones, so that bisection finds the interval of a value. */
static size_t join(interval *ranges, size_t count)
{
    size_t joined = 0;
    qsort(ranges, count, sizeof *ranges, by_lower_end);
    for (size_t i = 0; i < count; i++) {
        if (joined && ranges[i].lo <= ranges[joined - 1].hi)
            ranges[joined - 1].hi = fmax(ranges[joined - 1].hi, ranges[i].hi);
        else
            ranges[joined++] = ranges[i];
    }
    return joined;
}

static int read_envelope(trip_dataset_metadata *t)
{
    const cJSON *list = cJSON_GetObjectItemCaseSensitive(t->root, "envelope"), *item;
    if (!cJSON_IsArray(list))
        return 0;
    t->envelope = calloc((size_t)cJSON_GetArraySize(list) + 1, sizeof *t->envelope);
    if (!t->envelope)
        return trip_fail(TRIP_ERROR, "read", t->path, "out of memory");
    cJSON_ArrayForEach(item, list)
    {
        interval range = { number_of(cJSON_GetArrayItem(item, 0)),
                           number_of(cJSON_GetArrayItem(item, 1)) };
        if (range.lo <= range.hi) /* false if one is NaN */
            t->envelope[t->envelope_count++] = range;
    }
    t->envelope_count = join(t->envelope, t->envelope_count);
    return 0;
}

int trip_dataset_metadata_parse(trip_dataset_metadata **out, const trip_dataset *d)
{
    trip_dataset_metadata *t = calloc(1, sizeof *t);
    *out = NULL;
    if (!t)
        return trip_fail(TRIP_ERROR, "read", d->path, "out of memory");
    t->path = d->path;
    int status = trip_json_parse(&t->json, d->text, d->path, d->budget);
    t->root = t->json.root;
    if (status == 0 && !cJSON_IsObject(t->root))
        status = trip_fail(TRIP_ERROR, "read", d->path,
                           "its metadata is not a JSON object; brick the volume again");
    if (status == 0)
        status = read_envelope(t);
    if (status < 0)
        trip_dataset_metadata_destroy(t);
    else
        *out = t;
    return status;
}

void trip_dataset_metadata_destroy(trip_dataset_metadata *t)
{
    if (!t)
        return;
    trip_json_free(&t->json);
    free(t->envelope);
    free(t);
}

static const char *string_at(const trip_dataset_metadata *t, const char *key)
{
    return cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(t->root, key));
}

trip_tf_kind trip_dataset_metadata_kind(const trip_dataset_metadata *t)
{
    trip_tf_kind kind = trip_tf_kind_from_name(string_at(t, "function_kind"));
    return kind == TRIP_TF_AUTOMATIC ? TRIP_TF_SIMULATION : kind;
}

bool trip_dataset_metadata_histogram(const trip_dataset_metadata *t, trip_histogram *out)
{
    const cJSON *histogram = cJSON_GetObjectItemCaseSensitive(t->root, "histogram");
    const cJSON *counts = cJSON_GetObjectItemCaseSensitive(histogram, "counts");
    const int bins = sizeof out->counts / sizeof *out->counts;
    *out = (trip_histogram){
        .value_min = number_of(cJSON_GetObjectItemCaseSensitive(histogram, "value_min")),
        .value_max = number_of(cJSON_GetObjectItemCaseSensitive(histogram, "value_max")),
    };
    if (!cJSON_IsArray(counts) || cJSON_GetArraySize(counts) != bins ||
        !isfinite(out->value_max - out->value_min) || out->value_min > out->value_max)
        return false;
    int i = 0;
    const cJSON *count;
    cJSON_ArrayForEach(count, counts)
    {
        double n = number_of(count);
        if (!(n >= 0 && n < 0x1p53))
            return false;
        out->counts[i++] = (uint64_t)n;
        out->total += (uint64_t)n;
    }
    return out->total > 0;
}

int trip_dataset_metadata_adapt(const trip_dataset_metadata *t, const trip_dataset *d, trip_tf *tf,
                                const char *where)
{
    trip_histogram histogram;
    bool given = trip_tf_needs_data(tf) && trip_dataset_metadata_histogram(t, &histogram);
    const trip_tf_data data = { d->header.typical_min, d->header.typical_max,
                                given ? &histogram : NULL, trip_dataset_metadata_kind(t) };
    if (given && trip_codes_ids(&d->codes)) {
        histogram.ids = d->codes.table;
        histogram.id_count = d->codes.entries;
    }
    return trip_tf_adapt(tf, &data, where);
}

const char *trip_dataset_metadata_source(const trip_dataset_metadata *t)
{
    return string_at(t, "source");
}

const char *trip_dataset_metadata_source_path(const trip_dataset_metadata *t)
{
    return string_at(t, "source_path");
}

const char *trip_dataset_metadata_source_option(const trip_dataset_metadata *t, int i)
{
    enum { MAX_OPTIONS = 32 };
    const cJSON *options = cJSON_GetObjectItemCaseSensitive(t->root, "source_options");
    if (i >= MAX_OPTIONS)
        return NULL;
    return cJSON_GetStringValue(cJSON_GetArrayItem(options, i));
}

int trip_dataset_metadata_tf(const trip_dataset_metadata *t, const trip_dataset *d, trip_tf **out)
{
    const char *text = string_at(t, "transfer_function");
    if (text)
        return trip_tf_parse(out, t->path, text, strlen(text));
    const trip_file_header *h = &d->header;
    const bool range = h->typical_max > h->typical_min;
    const trip_tf_point ramp[2] = {
        { range ? h->typical_min : h->code_lo, { 0.2, 0.2, 0.2, 0.001 } },
        { range ? h->typical_max : h->code_hi, { 1, 1, 1, 0.05 } },
    };
    return trip_tf_from_points(out, ramp, 2, false, 0);
}

bool trip_dataset_metadata_keeps(const trip_dataset_metadata *t, double lo, double hi)
{
    size_t begin = 0, end = t->envelope_count; /* the last interval that starts at or before `lo` */
    while (begin < end) {
        size_t middle = begin + (end - begin) / 2;
        if (t->envelope[middle].lo <= lo)
            begin = middle + 1;
        else
            end = middle;
    }
    return begin > 0 && t->envelope[begin - 1].hi >= hi;
}

/* Returns the sampled share of [lo, hi] that the transfer function shows but the envelope lacks. */
static double culled_share(const trip_dataset_metadata *t, const trip_tf *tf, double lo, double hi)
{
    enum { SAMPLES = 16 };
    int culled = 0;
    if (!trip_tf_visible_in(tf, lo, hi) || trip_dataset_metadata_keeps(t, lo, hi))
        return 0;
    for (int i = 0; i < SAMPLES; i++) {
        double value = lo + (hi - lo) * (i + 0.5) / SAMPLES;
        culled += trip_tf_evaluate(tf, value).opacity > 0 &&
                  !trip_dataset_metadata_keeps(t, value, value);
    }
    return (double)culled / SAMPLES;
}

double trip_dataset_metadata_culled(const trip_dataset_metadata *t, const trip_tf *tf,
                                    double range[2])
{
    const cJSON *histogram = cJSON_GetObjectItemCaseSensitive(t->root, "histogram");
    const cJSON *counts = cJSON_GetObjectItemCaseSensitive(histogram, "counts");
    double first = number_of(cJSON_GetObjectItemCaseSensitive(histogram, "value_min"));
    double last = number_of(cJSON_GetObjectItemCaseSensitive(histogram, "value_max"));
    double voxels = 0, lo = first;
    if (!t->envelope || !cJSON_IsArray(counts) || cJSON_GetArraySize(counts) > MAX_BINS ||
        !(first <= last))
        return 0;
    double width = (last - first) / cJSON_GetArraySize(counts);
    const cJSON *count;
    range[0] = INFINITY;
    range[1] = -INFINITY;
    cJSON_ArrayForEach(count, counts)
    {
        double share = count->valuedouble > 0 ? culled_share(t, tf, lo, lo + width) : 0;
        if (share > 0) {
            voxels += share * count->valuedouble;
            range[0] = fmin(range[0], lo);
            range[1] = fmax(range[1], lo + width);
        }
        lo += width;
    }
    return voxels;
}

/* Converts "+x" ... "-z" to a unit vector; other texts give zero. */
static trip_vec3 direction_at(const trip_dataset_metadata *t, const char *key)
{
    const char *text = string_at(t, key);
    if (!text || strlen(text) != 2 || !strchr("+-", text[0]) || !strchr("xyz", text[1]))
        return trip_v3(0, 0, 0);
    double sign = text[0] == '-' ? -1 : 1;
    return trip_v3(text[1] == 'x' ? sign : 0, text[1] == 'y' ? sign : 0, text[1] == 'z' ? sign : 0);
}

size_t trip_dataset_metadata_fills(const trip_dataset_metadata *t, double *values, size_t max)
{
    const cJSON *fills = cJSON_GetObjectItemCaseSensitive(t->root, "fills"), *item;
    size_t count = 0;
    cJSON_ArrayForEach(item, fills)
    {
        if (count < max && isfinite(number_of(item)))
            values[count++] = number_of(item);
    }
    return count;
}

/* If the object is mirror-symmetric across z, its slices are views from the side. They usually run
 * from the top down and from the front to the back. The left side is unknown. */
static bool is_mirrored_across_z(const trip_dataset_metadata *t)
{
    const char *mirror = string_at(t, "mirror");
    return mirror && !strcmp(mirror, "z");
}

void trip_dataset_metadata_orient(const trip_dataset_metadata *t, const trip_dataset *d,
                                  trip_vec3 *up, trip_vec3 *front)
{
    const char *format = string_at(t, "format");
    const char *space = string_at(t, "space");
    bool oriented = cJSON_IsTrue(cJSON_GetObjectItemCaseSensitive(t->root, "oriented"));
    bool y_up = format && !strcmp(format, "openvdb");
    bool patient = format && !strcmp(format, "nifti"); /* +y is anterior, +z superior */
    *up = direction_at(t, "up");
    *front = direction_at(t, "front");
    if (trip_length(*up) > 0)
        return;
    if (trip_anatomy_known(space)) {
        *up = trip_anatomy_direction(space, 'S');
        *front = trip_anatomy_direction(space, 'A');
        return;
    }
    bool unknown = !oriented && !y_up && !patient;
    if (unknown && is_mirrored_across_z(t)) {
        *up = trip_v3(0, -1, 0);
        *front = trip_length(*front) > 0 ? *front : trip_v3(-1, 0, 0);
        return;
    }
    bool scan = unknown && trip_anatomy_is_scan_from_above(&d->index_to_world);
    trip_vec3 footing = direction_at(t, "footing");
    *up = y_up ? trip_v3(0, 1, 0) : trip_v3(0, 0, scan ? -1 : 1);
    if (unknown && !scan && trip_length(footing) > 0)
        *up = trip_scale(footing, -1);
    if (!(trip_length(*front) > 0) && (patient || scan))
        *front = trip_v3(0, patient ? 1 : -1, 0);
}
