#include "dataset_text.h"

#include <stdlib.h>
#include <string.h>

#include <cjson/cJSON.h>

#include "anatomy.h"
#include "report.h"
#include "settings.h"

struct trip_dataset_text {
    cJSON *root;
    const char *path; /* of the data set, for messages */
};

int trip_dataset_text_parse(trip_dataset_text **out, const trip_dataset *d)
{
    trip_dataset_text *t = calloc(1, sizeof *t);
    *out = NULL;
    if (!t)
        return trip_fail(TRIP_ERROR, "read", d->path, "out of memory");
    t->path = d->path;
    t->root = cJSON_Parse(d->text);
    if (!cJSON_IsObject(t->root)) {
        trip_dataset_text_destroy(t);
        return trip_fail(TRIP_ERROR, "read", d->path, "its text is not a JSON object");
    }
    *out = t;
    return 0;
}

void trip_dataset_text_destroy(trip_dataset_text *t)
{
    if (!t)
        return;
    cJSON_Delete(t->root);
    free(t);
}

static const char *string_at(const trip_dataset_text *t, const char *key)
{
    return cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(t->root, key));
}

static double number_of(const cJSON *item)
{
    return cJSON_IsNumber(item) ? item->valuedouble : NAN;
}

int trip_dataset_text_tf(const trip_dataset_text *t, const trip_dataset *d, trip_tf **out)
{
    const char *text = string_at(t, "transfer_function");
    if (text)
        return trip_tf_parse(out, t->path, text, strlen(text));
    const trip_tf_point ramp[2] = {
        { d->header.code_lo, { 0.2, 0.2, 0.2, 0.001 } },
        { d->header.code_hi, { 1, 1, 1, 0.05 } },
    };
    return trip_tf_from_points(out, ramp, 2, false, 0);
}

/* Whether the envelope keeps all of [lo, hi]. */
static bool envelope_holds(const cJSON *envelope, double lo, double hi)
{
    const cJSON *range;
    cJSON_ArrayForEach(range, envelope)
    {
        if (number_of(cJSON_GetArrayItem(range, 0)) <= lo &&
            number_of(cJSON_GetArrayItem(range, 1)) >= hi)
            return true;
    }
    return false;
}

/* Share of [lo, hi] that the function shows and the envelope leaves out, by samples. */
static double culled_share(const cJSON *envelope, const trip_tf *tf, double lo, double hi)
{
    enum { SAMPLES = 16 };
    int culled = 0;
    if (!trip_tf_visible_in(tf, lo, hi) || envelope_holds(envelope, lo, hi))
        return 0;
    for (int i = 0; i < SAMPLES; i++) {
        double value = lo + (hi - lo) * (i + 0.5) / SAMPLES;
        culled +=
            trip_tf_evaluate(tf, value).opacity > 0 && !envelope_holds(envelope, value, value);
    }
    return (double)culled / SAMPLES;
}

double trip_dataset_text_culled(const trip_dataset_text *t, const trip_tf *tf, double range[2])
{
    const cJSON *envelope = cJSON_GetObjectItemCaseSensitive(t->root, "envelope");
    const cJSON *histogram = cJSON_GetObjectItemCaseSensitive(t->root, "histogram");
    const cJSON *counts = cJSON_GetObjectItemCaseSensitive(histogram, "counts");
    double first = number_of(cJSON_GetObjectItemCaseSensitive(histogram, "value_min"));
    double last = number_of(cJSON_GetObjectItemCaseSensitive(histogram, "value_max"));
    double voxels = 0, lo = first;
    if (!cJSON_IsArray(envelope) || !cJSON_IsArray(counts) || !(first <= last))
        return 0;
    double width = (last - first) / cJSON_GetArraySize(counts);
    const cJSON *count;
    range[0] = INFINITY;
    range[1] = -INFINITY;
    cJSON_ArrayForEach(count, counts)
    {
        double share = count->valuedouble > 0 ? culled_share(envelope, tf, lo, lo + width) : 0;
        if (share > 0) {
            voxels += share * count->valuedouble;
            range[0] = fmin(range[0], lo);
            range[1] = fmax(range[1], lo + width);
        }
        lo += width;
    }
    return voxels;
}

/* "+x" ... "-z" as a unit vector; zero when it is none of them. */
static trip_vec3 direction_at(const trip_dataset_text *t, const char *key)
{
    const char *text = string_at(t, key);
    if (!text || strlen(text) != 2 || !strchr("+-", text[0]) || !strchr("xyz", text[1]))
        return trip_v3(0, 0, 0);
    double sign = text[0] == '-' ? -1 : 1;
    return trip_v3(text[1] == 'x' ? sign : 0, text[1] == 'y' ? sign : 0, text[1] == 'z' ? sign : 0);
}

/* Sheets that lie further apart than the voxels in them are those of a scan, and where no
 * orientation was given, scans are mostly stored from the top of the head down, with the face in
 * the first rows. */
static bool is_scan_from_above(const trip_affine *m)
{
    double least = INFINITY, most = 0;
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 4; j++)
            if (i != j && m->m[i][j] != 0)
                return false;
        least = fmin(least, m->m[i][i]);
        most = fmax(most, m->m[i][i]);
    }
    return least > 0 && most >= 1.5 * least;
}

/* Which way is up and where the front is: as the text has it, else as the patient stands, else by
 * the format's custom, else by a guess. */
static void orient(const trip_dataset_text *t, const trip_dataset *d, trip_vec3 *up,
                   trip_vec3 *front)
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
    bool scan = !oriented && !y_up && !patient && is_scan_from_above(&d->index_to_world);
    *up = y_up ? trip_v3(0, 1, 0) : trip_v3(0, 0, scan ? -1 : 1);
    if (!(trip_length(*front) > 0) && (patient || scan))
        *front = trip_v3(0, patient ? 1 : -1, 0);
}

void trip_dataset_text_frame(const trip_dataset_text *t, const trip_dataset *d,
                             trip_camera_framing *framing)
{
    trip_dataset_kept_bounds(d, framing->lo, framing->hi);
    for (int a = 0; a < 3; a++) {
        framing->lo[a] -= TRIP_KERNEL_RADIUS_VOXELS;
        framing->hi[a] += TRIP_KERNEL_RADIUS_VOXELS;
    }
    orient(t, d, &framing->up, &framing->front);
}
