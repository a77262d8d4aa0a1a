#include "gauges.h"

#include <cjson/cJSON.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "json.h"
#include "report.h"
#include "scene.h"

void trip_gauges_note_answer(trip_gauges *g, double ms)
{
    g->answers[g->answered++ % TRIP_GAUGES_ANSWERS] = (float)ms;
}

static int compare(const void *a, const void *b)
{
    const float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

double trip_gauges_quantile(float *values, int count, double part)
{
    if (count < 1)
        return 0;
    qsort(values, (size_t)count, sizeof *values, compare);
    const int at = (int)(part * (count - 1) + 0.5);
    return (double)values[at];
}

static void add_times(cJSON *root, const char *name, float *ms, int count)
{
    cJSON *times = cJSON_AddObjectToObject(root, name);
    cJSON_AddNumberToObject(times, "count", count);
    cJSON_AddNumberToObject(times, "median", trip_gauges_quantile(ms, count, 0.5));
    cJSON_AddNumberToObject(times, "percentile_99", trip_gauges_quantile(ms, count, 0.99));
    cJSON_AddNumberToObject(times, "most", trip_gauges_quantile(ms, count, 1));
}

static void add_status(cJSON *root, const trip_frames_status *s)
{
    cJSON_AddBoolToObject(root, "open", s->open);
    cJSON_AddBoolToObject(root, "exact", s->exact);
    cJSON_AddBoolToObject(root, "failed", s->failed);
    cJSON_AddStringToObject(root, "message", s->message);
    cJSON_AddNumberToObject(root, "frames", (double)s->frames);
    cJSON_AddNumberToObject(root, "whole_ms", s->whole_ms);
    cJSON_AddNumberToObject(root, "scale", s->scale);
    cJSON_AddNumberToObject(root, "lod_px", s->lod_px);
    cJSON_AddNumberToObject(root, "splats", (double)s->stats.splats);
    cJSON_AddNumberToObject(root, "bytes_read", (double)s->stats.bytes_read);
    cJSON_AddNumberToObject(root, "bytes_cached", (double)s->stats.bytes_cached);
    cJSON_AddNumberToObject(root, "memory_bytes", (double)s->stats.memory_bytes);
    cJSON_AddNumberToObject(root, "peak_memory_bytes", (double)s->stats.peak_memory_bytes);
    cJSON_AddStringToObject(root, "renderer", s->renderer);
    cJSON_AddStringToObject(root, "device", s->device);
    cJSON_AddStringToObject(root, "engine", s->engine);
}

static void add_document(cJSON *root, trip_viewer *v)
{
    const trip_document *d = trip_viewer_document(v);
    char *camera = trip_viewer_options(v);
    cJSON_AddNumberToObject(root, "documents", v->count);
    if (d)
        cJSON_AddStringToObject(root, "input", d->input);
    if (d && d->kind) {
        cJSON_AddNumberToObject(root, "objects", d->scene.objects);
        cJSON_AddNumberToObject(root, "volumes", d->scene.volumes);
        cJSON_AddNumberToObject(root, "gaussians", (double)d->scene.gaussians);
        cJSON_AddStringToObject(root, "order", trip_scene_order(&d->scene, &d->settings));
    }
    cJSON *dims = d && d->opened && !d->kind ? cJSON_AddArrayToObject(root, "dims") : NULL;
    for (int a = 0; a < 3 && dims; a++)
        cJSON_AddItemToArray(dims, cJSON_CreateNumber((double)d->info.dims[a]));
    if (camera)
        cJSON_AddStringToObject(root, "camera", camera);
    cJSON_AddNumberToObject(root, "width", v->width);
    cJSON_AddNumberToObject(root, "height", v->height);
    cJSON_AddItemToObject(root, "pointer", cJSON_CreateDoubleArray(v->at, 2));
    free(camera);
}

/* `path` may be any file, also a device or a pipe. */
static int write_text(const char *path, const char *text)
{
    FILE *f = fopen(path, "w");
    if (!f)
        return trip_fail_errno("view", path, "cannot write");
    const bool good = fputs(text, f) >= 0 && fputc('\n', f) != EOF;
    return fclose(f) == 0 && good ? 0 : trip_fail_errno("view", path, "cannot write");
}

int trip_gauges_write(const trip_gauges *g, trip_viewer *v, const char *const *labels, int count,
                      const char *path)
{
    const int max = (int)(TRIP_FRAMES_TIMES + TRIP_GAUGES_ANSWERS);
    cJSON *root = cJSON_CreateObject();
    float *ms = malloc((size_t)max * sizeof *ms);
    char *text = NULL;
    if (root && ms) {
        const trip_frames_status status = trip_frames_get_status(v->frames);
        add_document(root, v);
        add_status(root, &status);
        cJSON_AddItemToObject(root, "controls", cJSON_CreateStringArray(labels, count));
        add_times(root, "moving_ms", ms, trip_frames_get_times(v->frames, max, ms));
        const int answers =
            (int)(g->answered < TRIP_GAUGES_ANSWERS ? g->answered : TRIP_GAUGES_ANSWERS);
        memcpy(ms, g->answers, (size_t)answers * sizeof *ms);
        add_times(root, "answer_ms", ms, answers);
        text = trip_json_print(root, true);
    }
    const int status =
        text ? write_text(path, text) : trip_fail(TRIP_ERROR, "view", path, "out of memory");
    cJSON_Delete(root);
    free(ms);
    free(text);
    return status;
}
