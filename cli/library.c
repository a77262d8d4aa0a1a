#include "library.h"

#include <cjson/cJSON.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "command_line.h"
#include "draw_options.h"
#include "json.h"
#include "report.h"

static void pass_message(void *user, const char *line)
{
    (void)user;
    if (!command_line_quiet() || !command_line_is_note(line))
        trip_report_line(line);
}

static const char *things_of(const char *stage)
{
    if (!strcmp(stage, "splat") || !strcmp(stage, "count") || !strcmp(stage, "merge"))
        return "splats";
    if (!strcmp(stage, "integrate"))
        return "pixels";
    return strcmp(stage, "look") ? "voxels" : "bytes";
}

static void show_progress(void *user, const char *stage, uint64_t done, uint64_t total)
{
    trip_progress_show(user, stage, done, total, things_of(stage));
}

int library_create(triptych **out, trip_progress *progress)
{
    if (triptych_create(out))
        return trip_fail(TRIP_ERROR, "usage", "library", "out of memory");
    triptych_set_messages(*out, pass_message, NULL);
    if (progress)
        triptych_set_progress(*out, show_progress, progress);
    return 0;
}

int library_add(triptych *t, const char *const *paths, int count, const char *heat)
{
    int status = 0;
    for (int i = 0; i < count && !status; i++)
        status = triptych_add(t, paths[i]);
    return status || !heat ? status : triptych_set_heat(t, heat);
}

int library_check_heat(triptych *t, const char *heat, const triptych_resources *resources)
{
    int status = heat ? triptych_open(t, heat, resources) : 0;
    return status || !heat ? status : triptych_set_heat(t, heat);
}

int library_fail_scene_option(const char *name)
{
    char option[64];
    snprintf(option, sizeof option, "--%s", name);
    return trip_option_fail(option, "does not apply to Gaussian scenes");
}

int library_fail_objects_option(const char *name)
{
    char option[64];
    snprintf(option, sizeof option, "--%s", name);
    return trip_option_fail(option, "does not apply to several objects in one picture");
}

int library_check_cloud_options(const triptych_brick_options *options)
{
    if (options->spacing[0] != 0)
        return trip_option_fail("--spacing", "does not apply to clouds of points");
    for (size_t i = 0; i < volume_options_table.count; i++)
        if (i != VOLUME_AXES && trip_option_is_set(&volume_options_table.rows[i], options)) {
            char option[64];
            snprintf(option, sizeof option, "--%s", volume_options_table.rows[i].name);
            return trip_option_fail(option, "does not apply to clouds of points");
        }
    return 0;
}

int library_check_scene_options(const triptych_brick_options *options)
{
    if (options->spacing[0] != 0) /* the table looks at a part of a number */
        return library_fail_scene_option("spacing");
    for (size_t i = 0; i < volume_options_table.count; i++)
        if (trip_option_is_set(&volume_options_table.rows[i], options))
            return library_fail_scene_option(volume_options_table.rows[i].name);
    return 0;
}

/* The table of points looks at a part of the option --radius. */
static int check_no_cloud_options(const triptych_brick_options *options)
{
    const char *name = options->point_radius_factor > 0 ? "radius" : NULL;
    for (size_t i = 0; i < point_options_table.count && !name; i++)
        if (trip_option_is_set(&point_options_table.rows[i], options))
            name = point_options_table.rows[i].name;
    char option[64];
    snprintf(option, sizeof option, "--%s", name ? name : "");
    return name ? trip_option_fail(option, "applies to clouds of points only") : 0;
}

int library_check_file_options(const triptych_brick_options *options, int kind)
{
    if (kind == 3)
        return library_check_cloud_options(options);
    const int status = check_no_cloud_options(options);
    return !status && kind ? library_check_scene_options(options) : status;
}

bool library_is_scene(triptych *t, const char *input)
{
    return triptych_is_scene_file(input) || triptych_is_gaussians(t, input);
}

int library_fail_scene(const char *input)
{
    return trip_fail(TRIP_USAGE, "usage", input, "is a %s; `triptych render` draws it",
                     triptych_is_scene_file(input) ? "scene file" : "Gaussian scene");
}

int library_check_kind(triptych *t, const char *input, const draw_settings *settings,
                       const triptych_resources *resources,
                       const triptych_transfer_function *function)
{
    const int is_scene = triptych_is_gaussians(t, input);
    /* The library checks a data set of a scene. It may hold a cloud. */
    const draw_kind kind = !is_scene       ? DRAW_KIND_VOLUME
                           : is_scene == 1 ? DRAW_KIND_SCENE
                                           : DRAW_KIND_CLOUD;
    int status = draw_settings_check_kind(settings, resources, kind);
    if (!status && is_scene && (function->name || function->window > 0))
        status = library_fail_scene_option(function->name ? "tf" : "window");
    return status;
}

void library_hush(triptych *t, bool quiet)
{
    triptych_set_messages(t, quiet ? NULL : pass_message, NULL);
}

int library_set_function_quietly(triptych *t, const triptych_transfer_function *function)
{
    library_hush(t, true);
    int status = triptych_set_transfer_function(t, function);
    library_hush(t, false);
    if (status)
        trip_report_line(triptych_error(t));
    return status;
}

void library_sample_values(triptych *t, const char *volume, const triptych_brick_options *options,
                           triptych_values *v)
{
    triptych_set_messages(t, NULL, NULL);
    if (triptych_sample_values(t, volume, options, v))
        trip_report_line(triptych_error(t));
    triptych_set_messages(t, pass_message, NULL);
}

char *library_note(triptych *t, const char *key)
{
    triptych_info info;
    trip_json notes = { 0 };
    char *text = NULL;
    if (triptych_get_info(t, &info) == 0 && trip_json_parse(&notes, info.notes, "", NULL) == 0) {
        const char *found = cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(notes.root, key));
        text = found ? strdup(found) : NULL;
    }
    trip_json_free(&notes);
    return text;
}
