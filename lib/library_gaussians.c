/* Describes and bricks Gaussian scenes for triptych_brick.h. */
#include "triptych_brick.h"

#include <cjson/cJSON.h>
#include <dirent.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "brick_gaussians.h"
#include "gaussian_file.h"
#include "gaussian_format.h"
#include "gaussian_set.h"
#include "library_points.h"
#include "json.h"
#include "library_context.h"
#include "point_file.h"
#include "source.h"
#include "report.h"

enum { BATCH = 1024 };

static void begin_description(const trip_gaussian_info *info, triptych_gaussians *out)
{
    *out = (triptych_gaussians){ .degree = info->degree,
                                 .antialiased = info->antialiased,
                                 .flat = info->flat };
    snprintf(out->format, sizeof out->format, "%s", info->format);
    memcpy(out->trainer, info->trainer, sizeof out->trainer);
    memcpy(out->up, info->up, sizeof out->up);
}

static void note_centre(triptych_gaussians *out, const double centre[3])
{
    for (int a = 0; a < 3; a++) {
        out->lo[a] = out->count ? fmin(out->lo[a], centre[a]) : centre[a];
        out->hi[a] = out->count ? fmax(out->hi[a], centre[a]) : centre[a];
    }
    out->count++;
}

static int read_all(trip_gaussian_file *f, const char *path, triptych_gaussians *out)
{
    trip_gaussian *batch = malloc(BATCH * sizeof *batch);
    int status = batch ? 0 : trip_fail(TRIP_ERROR, "read", path, "out of memory");
    size_t got = 1;
    while (status == 0 && got > 0) {
        status = trip_gaussian_file_read(f, batch, BATCH, &got);
        for (size_t i = 0; i < got && status == 0; i++)
            note_centre(out, batch[i].centre);
    }
    out->left_out = trip_gaussian_file_left_out(f);
    free(batch);
    return status;
}

static int describe(const char *path, triptych_gaussians *out)
{
    trip_gaussian_file *f;
    int status = trip_gaussian_file_open(path, &f);
    if (status < 0)
        return status;
    const trip_gaussian_info *info = trip_gaussian_file_info(f);
    begin_description(info, out);
    status = read_all(f, path, out);
    trip_gaussian_file_close(f);
    if (status == 0 && out->count == 0)
        status = trip_fail(TRIP_ERROR, "read", path, "holds no Gaussian with finite values");
    return status;
}

/* ---- files ---- */

static bool ends_in(const char *name, const char *end)
{
    const size_t length = strlen(name), tail = strlen(end);
    return length >= tail && !strcmp(name + length - tail, end);
}

/* Adds the files of a folder that a scene can be read from, in the order of their names. */
static int add_parts(trip_source *s, const char *folder, const char *end)
{
    struct dirent **names = NULL;
    int status = 0;
    const int count = scandir(folder, &names, NULL, alphasort);
    for (int i = 0; i < count; i++) {
        char *part = NULL;
        if (!status && ends_in(names[i]->d_name, end))
            status = asprintf(&part, "%s/%s", folder, names[i]->d_name) < 0
                         ? trip_fail(TRIP_ERROR, "read", folder, "out of memory")
                         : trip_source_add(s, part);
        free(part);
        free(names[i]);
    }
    free(names);
    return status;
}

/* A .gltf file has its numbers in .bin files beside it, and the meta.json of SOG its pictures. */
static int add_files(trip_source *s, const char *path)
{
    const char *slash = strrchr(path, '/');
    char *folder = slash ? strndup(path, (size_t)(slash - path) + 1) : strdup(".");
    int status =
        folder ? trip_source_add(s, path) : trip_fail(TRIP_ERROR, "read", path, "out of memory");
    if (!status && (ends_in(path, ".gltf") || ends_in(path, ".json")))
        status = add_parts(s, folder, ends_in(path, ".gltf") ? ".bin" : ".webp");
    free(folder);
    return status;
}

static int add_part(void *source, const char *path)
{
    return trip_source_add(source, path);
}

int trip_context_find_files(trip_source *s, const char *path, const trip_volume_params *params)
{
    const bool is_scene = trip_gaussian_file_is(path);
    if (!is_scene && !trip_point_file_is(path))
        return trip_source_find(s, path, params);
    *s = (trip_source){ .format = is_scene ? "gaussians" : "points" };
    const int status = is_scene ? add_files(s, path) : trip_point_file_list(path, add_part, s);
    if (status)
        trip_source_free(s);
    return status;
}

/* ---- bricking ---- */

typedef struct bricking {
    triptych *t;
    trip_gaussian_file *file;
    triptych_gaussians seen;
} bricking;

static int read_some(void *user, trip_gaussian *out, size_t room, size_t *got)
{
    bricking *b = user;
    int status = trip_gaussian_file_read(b->file, out, room, got);
    for (size_t i = 0; i < *got && status == 0; i++)
        note_centre(&b->seen, out[i].centre);
    return status;
}

static void show_passed(void *user, uint64_t passed)
{
    enum { PASSES = 6 };
    const bricking *b = user;
    const uint64_t all = PASSES * trip_gaussian_file_info(b->file)->count;
    if (b->t->show)
        trip_context_show_stage(b->t, "brick", passed < all ? passed : all, all);
}

/* Returns the notes of the data set: JSON for free(). */
char *trip_context_scene_notes(const char *path, const triptych_gaussians *g)
{
    const char *name = strrchr(path, '/');
    cJSON *root = cJSON_CreateObject();
    cJSON_AddStringToObject(root, "input", name ? name + 1 : path);
    cJSON_AddStringToObject(root, "format", g->format);
    if (*g->trainer)
        cJSON_AddStringToObject(root, "trainer", g->trainer);
    cJSON_AddStringToObject(root, "up", g->up);
    cJSON_AddStringToObject(root, "program", "triptych " TRIP_VERSION);
    char *text = trip_json_print(root, false);
    cJSON_Delete(root);
    return text;
}

static int brick(bricking *b, const char *path, const char *data_set,
                 const triptych_brick_options *options, trip_budget *budget)
{
    const trip_gaussian_info *info = trip_gaussian_file_info(b->file);
    char *notes = trip_context_scene_notes(path, &b->seen);
    if (!notes)
        return trip_fail(TRIP_ERROR, "brick", path, "out of memory");
    const trip_brick_gaussians_params params = {
        .path = data_set,
        .replace = options->replace,
        .source = read_some,
        .source_user = b,
        .source_name = path,
        .degree = info->degree,
        .harmonics = (trip_brick_harmonics)options->harmonics,
        .flags = (info->antialiased ? TRIP_GAUSSIAN_ANTIALIASED : 0) |
                 (info->flat ? TRIP_GAUSSIAN_FLAT : 0) |
                 (!strcmp(info->up, "-y") ? TRIP_GAUSSIAN_Y_DOWN : 0),
        .text = notes,
        .threads = trip_context_threads(options->threads),
        .progress = show_passed,
        .progress_user = b,
    };
    trip_brick_gaussians_result made;
    int status = trip_brick_gaussians(&params, budget, &made);
    b->seen.count = status ? 0 : made.records;
    b->seen.coarse = made.coarse;
    b->seen.palette = made.palette;
    b->seen.palette_error = made.palette_error;
    b->seen.left_out = trip_gaussian_file_left_out(b->file);
    free(notes);
    return status;
}

int triptych_brick_gaussians(triptych *t, const char *path, const char *data_set,
                             const triptych_brick_options *options, triptych_gaussians *out)
{
    trip_scope *before = trip_context_enter_anew(t);
    const triptych_brick_options defaults = { 0 };
    const triptych_brick_options *o = options ? options : &defaults;
    bricking b = { .t = t };
    trip_budget *budget = NULL;
    if (!trip_gaussian_file_is(path) && trip_point_file_is(path))
        return trip_context_leave(before, trip_context_brick_points(t, path, data_set, o, out));
    int status = trip_context_check_no_points(path, o);
    if (!status)
        status = o->harmonics < TRIPTYCH_STORED_HARMONICS_AUTO ||
                         o->harmonics > TRIPTYCH_STORED_HARMONICS_WHOLE
                     ? trip_fail(TRIP_USAGE, "brick", path, "unknown kind of stored harmonics")
                     : trip_gaussian_file_open(path, &b.file);
    if (!status)
        status = trip_budget_create(&budget, o->memory_bytes);
    if (!status) {
        begin_description(trip_gaussian_file_info(b.file), &b.seen);
        status = brick(&b, path, data_set, o, budget);
    }
    if (out)
        *out = status ? (triptych_gaussians){ 0 } : b.seen;
    trip_budget_destroy(budget);
    trip_gaussian_file_close(b.file);
    return trip_context_leave(before, status);
}

int triptych_is_gaussians(triptych *t, const char *path)
{
    trip_scope *before = trip_context_enter_anew(t);
    return trip_context_leave(before, trip_gaussian_set_is(path)    ? 2
                                      : trip_gaussian_file_is(path) ? 1
                                      : trip_point_file_is(path)    ? 3
                                                                    : 0);
}

int triptych_describe_gaussians(triptych *t, const char *path, triptych_gaussians *out)
{
    trip_scope *before = trip_context_enter_anew(t);
    *out = (triptych_gaussians){ 0 };
    return trip_context_leave(before, describe(path, out));
}
