#include "viewed_volume.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "file_path.h"
#include "report.h"
#include "transfer_function.h"

/* For a volume with larger files, `view` first makes a small data set with at least this many
 * voxels. */
#define LARGE_BYTES (UINT64_C(8) << 20)
#define SMALL_VOXELS (UINT64_C(1) << 21)

/* --error applies to the first data set of a volume. Data sets that are made later hold more
 * voxels, and are not checked. */
static bool is_measured(const viewed_volume *s, const char *volume, bool keep_all)
{
    return !keep_all && s->measured && !strcmp(volume, s->measured_volume);
}

static cached_wish wish_of(const viewed_volume *s, const char *volume, bool keep_all)
{
    cached_wish wish = { .options = s->options };
    wish.options.functions = &s->function;
    wish.options.function_count = s->function && !keep_all;
    wish.options.automatic = !keep_all;
    wish.options.keep_all = keep_all;
    wish.checksum = is_measured(s, volume, keep_all) ? s->measured : NULL;
    return wish;
}

static int pass_file(void *user, const char *path)
{
    (void)user, (void)path;
    return 0;
}

int viewed_volume_choose(viewed_volume *s, quality_options *q, const char *input,
                         draw_settings *settings, triptych_renderer *renderer)
{
    if (q->error > 0 && input && triptych_is_scene_file(input))
        return library_fail_objects_option("error");
    int status =
        quality_options_use(q, &(quality_drawn){ input, s->function }, settings, renderer, false);
    /* A moving view is drawn from coarse levels by this classification. */
    const bool coarse_splats = draw_settings_classify(settings) == TRIPTYCH_CLASSIFY_PRE;
    s->options.levels_for = quality_options_levels(q, coarse_splats);
    s->measured_volume = input;
    s->measured = q->error > 0 ? q->measured : NULL;
    s->settings = settings;
    return status;
}

static int check_volume(const viewed_volume *s, triptych *t, const char *volume)
{
    trip_tf *tf = NULL;
    int status = triptych_list_files(t, volume, &s->options, pass_file, NULL);
    if (!status && access(volume, R_OK) != 0 && !strpbrk(volume, "*?[%"))
        status = trip_fail_errno("read", volume, "cannot open");
    if (!status && s->function)
        status = trip_tf_load(&tf, s->function);
    trip_tf_destroy(tf);
    return status;
}

/* Checks one object of a scene file. */
static int check_object(const viewed_volume *s, triptych *t, const triptych_object *o,
                        const triptych_resources *resources)
{
    viewed_volume one = { .options = s->options,
                          .function = o->function ? o->function : s->function };
    if (triptych_is_gaussians(t, o->path))
        one.function = NULL;
    if (cached_volume_wanted(o->path))
        return check_volume(&one, t, o->path);
    const int status = triptych_open(t, o->path, resources);
    triptych_close(t);
    return status;
}

static int check_objects(const viewed_volume *s, triptych *t, const char *input,
                         const triptych_resources *resources)
{
    placed_input p = { 0 };
    int status = triptych_read_scene_file(t, input, &p.given, &p.count);
    if (!status)
        status = library_check_scene_options(&s->options);
    if (!status)
        status = placed_input_check(&p, t, s->settings, resources,
                                    &(triptych_transfer_function){ .name = s->function });
    for (unsigned i = 0; i < p.count && !status; i++)
        if (!i || strcmp(p.given[i].path, p.given[i - 1].path) != 0 || p.given[i].function)
            status = check_object(s, t, &p.given[i], resources);
    placed_input_close(&p);
    return status;
}

/* A data set of a scene may hold a cloud, which has more settings. */
static int check_opened(const viewed_volume *s, triptych *t, const triptych_resources *resources)
{
    triptych_scene scene;
    const int status = triptych_get_scene(t, &scene);
    return status ? status
                  : draw_settings_check_kind(s->settings, resources,
                                             scene.clouds ? DRAW_KIND_CLOUD : DRAW_KIND_SCENE);
}

int viewed_volume_check(const viewed_volume *s, triptych *t, const char *input,
                        const triptych_resources *resources)
{
    if (triptych_is_scene_file(input))
        return check_objects(s, t, input, resources);
    const triptych_transfer_function function = { .name = s->function };
    const int is_scene = triptych_is_gaussians(t, input);
    int status = library_check_kind(t, input, s->settings, resources, &function);
    if (!status && is_scene && s->measured)
        status = library_fail_scene_option("error");
    if (!status && cached_volume_wanted(input))
        status = library_check_file_options(&s->options, is_scene);
    if (status)
        return status;
    if (cached_volume_wanted(input))
        return check_volume(s, t, input);
    status = triptych_open(t, input, resources);
    if (!status && is_scene)
        status = check_opened(s, t, resources);
    if (!status) /* the window prints the warnings later */
        status = library_set_function_quietly(t, &function);
    triptych_close(t);
    return status;
}

/* Returns the path of a file that is named relative to a data set, or NULL if it cannot be read. */
static char *readable(const char *data_set, const char *name)
{
    char *path = name ? trip_path_beside(data_set, name) : NULL;
    if (path && access(path, R_OK) == 0)
        return path;
    free(path);
    return NULL;
}

/* Returns the path of the volume that a data set was made of; the caller frees it. Returns NULL
 * after reporting that the volume is neither at its recorded place nor beside the data set. */
static char *source_of(triptych *t, const char *data_set)
{
    const bool opened = triptych_open(t, data_set, NULL) == 0;
    char *name = opened ? library_note(t, "source") : NULL;
    char *recorded = opened ? library_note(t, "source_path") : NULL;
    char *path = readable(data_set, recorded);
    triptych_close(t);
    if (!path)
        path = readable(data_set, name);
    if (!path)
        trip_fail(TRIP_ERROR, "brick", name ? name : data_set,
                  "the volume of this data set is not beside it");
    free(recorded);
    free(name);
    return path;
}

/* Checks a data set against the report of --error. */
static int check_measured(const viewed_volume *s, triptych *t, const char *path, const char *volume)
{
    int status = triptych_open(t, path, NULL);
    if (!status)
        status = quality_options_check_data(s->measured, t, volume);
    triptych_close(t);
    return status;
}

static int open_volume(const viewed_volume *s, cached_volume *cached, triptych *t,
                       const char *input, bool keep_all)
{
    char *volume = cached_volume_wanted(input) ? strdup(input) : source_of(t, input);
    if (!volume)
        return TRIP_ERROR;
    const cached_wish wish = wish_of(s, volume, keep_all);
    int status = cached_volume_open(cached, t, volume, &wish);
    if (!status && is_measured(s, volume, keep_all))
        status = check_measured(s, t, cached->path, volume);
    free(volume);
    return status;
}

/* Returns 1 if a small data set must be made first. Scenes have none. */
static int is_large(const viewed_volume *s, triptych *t, const char *volume)
{
    if (triptych_is_gaussians(t, volume))
        return 0;
    const cached_wish wish = wish_of(s, volume, false);
    cached_volume found = { .hold = -1 };
    triptych_identity identity;
    int there = cached_volume_find(&found, t, volume, &wish);
    if (there > 0)
        cached_volume_close(&found);
    if (there)
        return there < 0 ? there : 0;
    int status = triptych_identify(t, volume, &wish.options, 0, &identity);
    return status ? status : identity.bytes > LARGE_BYTES;
}

static int open_small(viewed_volume *s, triptych *t, const char *volume)
{
    cached_wish wish = wish_of(s, volume, false);
    wish.options.max_voxels = SMALL_VOXELS;
    wish.options.levels = -1;
    wish.checksum = NULL;
    return cached_volume_open(&s->cached, t, volume, &wish);
}

int viewed_volume_find(void *user, triptych *t, const char *input, bool keep_all, bool *small,
                       const char **path)
{
    viewed_volume *s = user;
    *path = input;
    if (triptych_is_scene_file(input)) {
        const cached_wish wish = wish_of(s, input, false);
        return placed_input_read(&s->placed, t, input, &wish.options);
    }
    if (!keep_all && !cached_volume_wanted(input))
        return 0;
    int status = s->samples && !keep_all ? is_large(s, t, input) : 0;
    *small = status > 0;
    if (*small)
        status = open_small(s, t, input);
    else if (!status)
        status = open_volume(s, &s->cached, t, input, keep_all);
    *path = s->cached.path;
    return status;
}

void viewed_volume_release(void *user)
{
    viewed_volume *s = user;
    cached_volume_close(&s->cached);
    placed_input_close(&s->placed);
}

int viewed_volume_open(void *user, triptych *t, const char *path,
                       const triptych_resources *resources)
{
    const viewed_volume *s = user;
    return placed_input_open(&s->placed, t, path, resources);
}

int viewed_volume_make(void *user, triptych *t, const char *input, bool keep_all)
{
    cached_volume made = { .hold = -1 };
    if (triptych_is_scene_file(input))
        return trip_fail(
            TRIP_USAGE, "brick", input,
            "is a scene file; brick its volumes with --keep-all and name the data sets");
    const int status = open_volume(user, &made, t, input, keep_all);
    cached_volume_close(&made);
    return status;
}
