#include "sequence.h"

#include <float.h>
#include <stdlib.h>
#include <string.h>

#include "library.h"
#include "report.h"

/* Loads a path. --fps keeps its duration and changes its number of frames. */
static int load_path(sequence *s)
{
    const double fps = s->o->fps;
    int status = trip_camera_path_load(&s->path, s->o->path);
    if (status)
        return status;
    if (fps > 0)
        s->path.frames_per_second = fps;
    s->frames = trip_camera_path_frames(&s->path);
    return fps > 0 && s->frames == TRIP_CAMERA_PATH_FRAMES
               ? trip_fail(TRIP_USAGE, "usage", "--fps",
                           "makes the path %d frames long or longer; use a lower rate",
                           TRIP_CAMERA_PATH_FRAMES)
               : 0;
}

int sequence_load(sequence *s, const render_options *o)
{
    s->o = o;
    s->frames = o->orbit ? o->orbit : 1;
    return o->path ? load_path(s) : 0;
}

bool sequence_has_functions(const sequence *s)
{
    for (size_t i = 0; i < s->path.count; i++)
        if (s->path.keys[i].function || s->path.keys[i].text)
            return true;
    return false;
}

static int parse_text(const sequence *s, const char *text, trip_tf **out)
{
    int status = trip_tf_parse(out, s->o->path, text, strlen(text));
    if (!status && trip_tf_is_normalised(*out))
        return trip_fail(TRIP_ERROR, "path", s->o->path,
                         "\"function_text\" must be in data units, not over the range of the data");
    return status;
}

/* ---- visible values ---- */

static int fail_memory(void)
{
    return trip_fail(TRIP_ERROR, "render", "function", "out of memory");
}

static void add_name(sequence *s, const char *name)
{
    bool known = false;
    for (size_t i = 0; i < s->name_count; i++)
        known = known || !strcmp(s->names[i], name);
    if (!known)
        s->names[s->name_count++] = name;
}

static int add_range(sequence *s, const char *text)
{
    double span[2];
    trip_tf *tf = NULL;
    int status = parse_text(s, text, &tf);
    if (!status && trip_tf_visible_span(tf, -DBL_MAX, DBL_MAX, span))
        s->ranges[s->range_count++] = (triptych_range){ span[0], span[1] };
    trip_tf_destroy(tf);
    return status;
}

int sequence_find_shown(sequence *s)
{
    const char *text = NULL;
    int status = 0;
    s->names = calloc(s->path.count + 1, sizeof *s->names);
    s->ranges = calloc(s->path.count + 1, sizeof *s->ranges);
    if (!s->names || !s->ranges)
        return fail_memory();
    if (s->o->function.name)
        add_name(s, s->o->function.name);
    for (size_t i = 0; i < s->path.count && !status; i++) {
        const trip_path_key *key = &s->path.keys[i];
        if (key->function)
            add_name(s, key->function);
        if (key->text && !(text && !strcmp(text, key->text))) /* skips text equal to the previous
                                                                 key's, which is the common case */
            status = add_range(s, text = key->text);
    }
    return status;
}

double sequence_frames_per_second(const sequence *s)
{
    enum { DEFAULT = 30 };
    double own = s->path.frames_per_second;
    return s->o->fps > 0 ? s->o->fps : own > 0 ? own : DEFAULT;
}

/* ---- views ---- */

int sequence_set_view(const sequence *s, triptych *t)
{
    const triptych_view view = render_options_view(s->o);
    return s->o->path ? 0 : triptych_set_view(t, &view);
}

static int find_cameras(sequence *s, triptych *t)
{
    int status = 0;
    triptych_camera camera;
    s->cameras = calloc((size_t)s->frames, sizeof *s->cameras);
    if (!s->cameras)
        return trip_fail(TRIP_ERROR, "render", "frames", "out of memory");
    for (int i = 0; i < s->frames && !status; i++) {
        if (s->path.count) {
            s->cameras[i] = trip_camera_path_view(&s->path, trip_camera_path_seconds(&s->path, i));
            continue;
        }
        status = triptych_turn(t, s->o->orbit ? 360.0 * i / s->o->orbit : 0);
        if (!status)
            status = triptych_get_camera(t, &camera);
        if (!status)
            s->cameras[i] = trip_navigation_from_camera(&camera, NULL);
    }
    return status;
}

/* ---- transfer functions ---- */

/* Loads a preset or a file, in data units. Without a name, loads the data set's own transfer
 * function. */
static int find_function(triptych *t, const char *name, trip_tf **out)
{
    char *text = NULL;
    int status = triptych_convert(t, &(triptych_conversion){ .function = name }, &text);
    if (!status)
        status = trip_tf_parse(out, name ? name : "data set", text, strlen(text));
    free(text);
    return status;
}

static triptych_transfer_function look_of(const sequence *s, const char *text)
{
    triptych_transfer_function f = s->o->function;
    f.name = NULL;
    f.text = text;
    return f;
}

/* Sets a key's transfer function once, so that the library prints its warnings. */
static int try_function(const sequence *s, triptych *t, const trip_path_key *key)
{
    triptych_transfer_function f = look_of(s, key->text);
    f.name = key->function;
    return triptych_set_transfer_function(t, &f);
}

static int find_functions(sequence *s, triptych *t)
{
    if (!sequence_has_functions(s))
        return 0;
    s->functions = calloc(s->path.count + 1, sizeof *s->functions);
    if (!s->functions)
        return fail_memory();
    int status = find_function(t, s->o->function.name, &s->functions[0]);
    for (size_t i = 0; i < s->path.count && !status; i++) {
        const trip_path_key *key = &s->path.keys[i];
        trip_tf **own = &s->functions[i + 1];
        if (key->function)
            status = find_function(t, key->function, own);
        else if (key->text)
            status = parse_text(s, key->text, own);
        if (!status && *own)
            status = try_function(s, t, key);
    }
    return status;
}

/* Returns a frame's transfer function as text; the caller frees it. */
static int mix_text(const sequence *s, int frame, char **text)
{
    trip_path_mix mix = trip_camera_path_mix(&s->path, trip_camera_path_seconds(&s->path, frame));
    const trip_tf *from = s->functions[mix.from + 1], *to = s->functions[mix.to + 1];
    trip_tf *between = NULL;
    int status = mix.t > 0 ? trip_tf_mix(&between, from, to, mix.t) : 0;
    *text = status ? NULL : trip_tf_to_text(between ? between : from);
    trip_tf_destroy(between);
    if (!status && !*text)
        return fail_memory();
    return status;
}

static int set_function(const sequence *s, triptych *t, int frame, bool quiet)
{
    char *text;
    int status = mix_text(s, frame, &text);
    const triptych_transfer_function f = look_of(s, text);
    if (!status)
        status =
            quiet ? triptych_set_transfer_function(t, &f) : library_set_function_quietly(t, &f);
    free(text);
    return status;
}

/* ---- clipping ---- */

/* Applies the clipping of the path, if it has any, instead of the clipping on the command line. */
static int set_clip(const sequence *s, triptych *t, int frame)
{
    draw_settings settings = s->o->settings;
    if (!trip_camera_path_clip(&s->path, trip_camera_path_seconds(&s->path, frame), &settings.clip))
        return 0;
    return draw_settings_use(t, &settings);
}

/* ---- frames ---- */

int sequence_prepare(sequence *s, triptych *t)
{
    int status = find_cameras(s, t);
    return status ? status : find_functions(s, t);
}

void sequence_release(sequence *s)
{
    for (size_t i = 0; s->functions && i <= s->path.count; i++)
        trip_tf_destroy(s->functions[i]);
    free(s->functions);
    free(s->names);
    free(s->ranges);
    free(s->cameras);
    trip_camera_path_release(&s->path);
}

int sequence_set_frame(const sequence *s, triptych *t, int frame, bool quiet)
{
    const triptych_view view =
        trip_navigation_view(&s->cameras[frame], s->o->view.view.width, s->o->view.view.height);
    int status = s->functions ? set_function(s, t, frame, quiet) : 0;
    if (!status && s->path.count)
        status = set_clip(s, t, frame);
    return status ? status : triptych_set_view(t, &view);
}
