/* triptych view: shows data sets and volumes in a window. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "clip_options.h"
#include "commands.h"
#include "effects_options.h"
#include "geometry.h"
#include "library.h"
#include "options.h"
#include "quality_options.h"
#include "read_data.h"
#include "report.h"
#include "viewed_volume.h"
#include "view.h"
#include "volume_options.h"

enum {
    KEY_SIZE = 256,
    KEY_EYE,
    KEY_LOOK,
    KEY_UP,
    KEY_FOV,
    KEY_ORTHO,
    KEY_VIEW,
    KEY_TF,
    KEY_OPACITY_SCALE,
    KEY_QUALITY,
    KEY_ERROR,
    KEY_REPORT,
    KEY_CLASSIFY,
    KEY_LIGHT,
    KEY_EFFECTS,
    KEY_ANISOTROPY,
    KEY_CUEING,
    KEY_LIGHT_CELLS,
    KEY_EMISSION,
    KEY_TEMPERATURE,
    KEY_CLIP_BOX,
    KEY_CLIP_PLANE,
    KEY_FPS,
    KEY_SCALE,
    KEY_NO_PANEL,
    KEY_SCRIPT,
    KEY_FRESH,
    KEY_RENDERER,
    KEY_MEMORY,
    KEY_ENGINE,
    KEY_THREADS,
    KEY_GRID,
    KEY_LEVEL_SET,
    KEY_SPACING,
    KEY_AXES,
    KEY_COORDINATES,
    KEY_ALLOW_GAPS,
};

static const struct argp_option options[] = {
    { NULL, 0, NULL, 0, "Window:", 1 },
    { "fps", KEY_FPS, "N", 0,
      "Sets the target frames per second of a moving view, 1 to 1000 (default: 30)", 1 },
    { "fresh", KEY_FRESH, NULL, 0, "Ignores the stored state of the data, and stores none", 1 },
    { "no-panel", KEY_NO_PANEL, NULL, 0, "Starts without the panel; the key t shows it", 1 },
    { "scale", KEY_SCALE, "X", 0,
      "Sets the scale of texts and controls, 0.5 to 8 (default: the scale of the screen)", 1 },
    { "script", KEY_SCRIPT, "FILE", 0, "Replays the events in a file, then ends", 1 },
    { "size", KEY_SIZE, "WxH", 0, "Sets the size of the window in pixels (default: 1100x720)", 1 },
    { NULL, 0, NULL, 0, "View:", 2 },
    { "eye", KEY_EYE, "X,Y,Z", 0,
      "Sets the position of the eye (default: so that the whole object is in view); excludes "
      "--view",
      2 },
    { "fov", KEY_FOV, "DEGREES", 0,
      "Sets the vertical angle of view, up to 179.999 (default: 30); excludes --ortho", 2 },
    { "look", KEY_LOOK, "X,Y,Z", 0,
      "Sets the point that the eye looks at (default: the middle of the visible object)", 2 },
    { "ortho", KEY_ORTHO, "HEIGHT", 0, "Starts with a parallel view, HEIGHT world units high", 2 },
    { "up", KEY_UP, "X,Y,Z", 0,
      "Sets the direction that is up in the picture (default: as in `triptych render`)", 2 },
    { "view", KEY_VIEW, "SIDE", 0,
      "Selects the side that you see: front, back, left, right, top, bottom or iso (default: "
      "front, a little from the left and from above)",
      2 },
    { NULL, 0, NULL, 0, "Look (the panel changes it):", 3 },
    { "opacity-scale", KEY_OPACITY_SCALE, "X", 0,
      "Multiplies the extinction: opacity o becomes 1-(1-o)^X (default: 1)", 3 },
    { "tf", KEY_TF, "NAME|FILE", 0,
      "Selects the transfer function, a preset or a file (default: the one in the data set)", 3 },
    TRIP_OPTION_LIGHT(3),
    TRIP_OPTIONS_EFFECTS(3),
    TRIP_OPTIONS_EMISSION(3),
    TRIP_OPTIONS_CLIP(3),
    { NULL, 0, NULL, 0, "Accuracy and speed:", 4 },
    { "classify", KEY_CLASSIFY, "pre|post|auto", 0,
      "Selects when values become colours: pre (before splatting), post (after interpolation) or "
      "auto (default: auto, as in `triptych render`); excludes --error",
      4 },
    TRIP_OPTIONS_QUALITY(4),
    { NULL, 0, NULL, 0, "Renderer and resources:", 5 },
    TRIP_OPTION_ENGINE(KEY_ENGINE, 5),
    TRIP_OPTION_MEMORY(KEY_MEMORY, 5),
    { "renderer", KEY_RENDERER, "NAME", 0,
      "Selects the renderer: gl, cpu or auto, which is gl on graphics hardware, else cpu (default: "
      "auto)",
      5 },
    TRIP_OPTION_THREADS(KEY_THREADS, 5),
    { NULL, 0, NULL, 0, "Volume (not for data sets, which have these fixed):", 6 },
    TRIP_OPTIONS_VOLUME(6),
    { 0 },
};

typedef struct view_options {
    trip_view_params params;
    const char **inputs;
    int argc;
    double eye[3], look[3], up[3];
    quality_options quality;
    bool classify_given;
    triptych_classify classify;
    read_files read; /* files that a script must not overwrite */
    viewed_volume volume;
} view_options;

static int parse_point(const char *option, const char *text, double point[3],
                       const double **position)
{
    int count;
    *position = point;
    return trip_option_numbers(option, text, 3, 3, point, &count);
}

static int parse_up(const char *text, view_options *o)
{
    int status = parse_point("--up", text, o->up, &o->params.start.up);
    const trip_vec3 up = trip_v3(o->up[0], o->up[1], o->up[2]);
    if (!status && !(trip_length(up) > 0))
        return trip_option_fail("--up", "the direction is zero");
    return status;
}

static int parse_view(int key, char *arg, view_options *o)
{
    static const char *const sides[] = { "front", "back",   "left", "right",
                                         "top",   "bottom", "iso",  NULL };
    triptych_view *v = &o->params.start;
    int which = 0, status;
    o->params.start_given |= key >= KEY_EYE && key <= KEY_VIEW;
    switch (key) {
    case KEY_VIEW:
        status = trip_option_choice("--view", arg, sides, &which);
        v->side = (triptych_side)(TRIPTYCH_FRONT + which);
        return status;
    case KEY_EYE:
        return parse_point("--eye", arg, o->eye, &v->eye);
    case KEY_LOOK:
        return parse_point("--look", arg, o->look, &v->look);
    case KEY_UP:
        return parse_up(arg, o);
    case KEY_FOV:
        return trip_option_number("--fov", arg, TRIPTYCH_FOV_MIN_DEGREES, TRIPTYCH_FOV_MAX_DEGREES,
                                  &v->fov_degrees);
    case KEY_ORTHO:
        return trip_option_number("--ortho", arg, 1e-100, 1e100, &v->ortho_height);
    default:
        return ARGP_ERR_UNKNOWN;
    }
}

static int parse_effects(int key, char *arg, view_options *o)
{
    triptych_settings *s = &o->params.settings;
    o->params.settings_given |= key >= KEY_LIGHT && key <= KEY_TEMPERATURE;
    switch (key) {
    case KEY_LIGHT:
        return trip_option_light(arg, s);
    case KEY_EFFECTS:
        return trip_option_effects(arg, s);
    case KEY_ANISOTROPY:
        return trip_option_anisotropy(arg, s);
    case KEY_CUEING:
        return trip_option_cueing(arg, s);
    case KEY_LIGHT_CELLS:
        return trip_option_light_cells(arg, s);
    case KEY_EMISSION:
        o->params.heat = arg;
        return 0;
    case KEY_TEMPERATURE:
        return trip_option_temperature(arg, s);
    default:
        return parse_view(key, arg, o);
    }
}

static int parse_look(int key, char *arg, view_options *o)
{
    int which = 0, status;
    switch (key) {
    case KEY_TF:
        o->params.function = arg;
        return 0;
    case KEY_OPACITY_SCALE:
        return trip_option_number("--opacity-scale", arg, 1e-6, 1e6, &o->params.opacity_scale);
    case KEY_CLASSIFY:
        status = trip_option_classify(arg, 3, &which);
        o->classify = (triptych_classify)which;
        o->classify_given = true;
        o->quality.measurable = "classify";
        return status;
    case KEY_CLIP_BOX:
        o->params.settings_given = true;
        return trip_option_clip_box(arg, &o->params.settings.clip);
    case KEY_CLIP_PLANE:
        o->params.settings_given = true;
        return trip_option_clip_plane(arg, &o->params.settings.clip);
    case KEY_QUALITY:
        return quality_option_quality(arg, &o->quality);
    case KEY_ERROR:
        return quality_option_error(arg, &o->quality);
    case KEY_REPORT:
        o->quality.report = arg;
        return 0;
    default:
        return parse_effects(key, arg, o);
    }
}

static int parse_renderer(int key, char *arg, view_options *o)
{
    int which = 0, status;
    switch (key) {
    case KEY_RENDERER:
        status = trip_option_renderer(arg, 3, &which);
        o->params.renderer = (triptych_renderer)which;
        return status;
    case KEY_MEMORY:
        return trip_option_memory(arg, &o->params.memory_bytes);
    case KEY_ENGINE:
        status = trip_option_engine(arg, 4, &which);
        o->params.engine = (triptych_engine)which;
        return status;
    case KEY_THREADS:
        status = trip_option_threads(arg, &which);
        o->params.threads = (unsigned)which;
        return status;
    default:
        return parse_look(key, arg, o);
    }
}

static int parse_volume(int key, char *arg, view_options *o)
{
    switch (key) {
    case KEY_GRID:
        return trip_option_grid(arg, &o->volume.options.grid);
    case KEY_LEVEL_SET:
        return trip_option_level_set(arg, &o->volume.options.level_set);
    case KEY_SPACING:
        return trip_option_spacing(arg, o->volume.options.spacing);
    case KEY_AXES:
        return trip_option_axes(arg, &o->volume.options.axes);
    case KEY_COORDINATES:
        o->volume.options.coordinates = arg;
        return 0;
    case KEY_ALLOW_GAPS:
        o->volume.options.allow_gaps = 1;
        return 0;
    default:
        return parse_renderer(key, arg, o);
    }
}

/* Options for reading volumes require an input that is a volume, or no input: the user may then
 * open a volume later. */
static int check_volume(const view_options *o)
{
    bool volumes = o->params.count == 0;
    for (int i = 0; i < o->params.count; i++)
        volumes = volumes || cached_volume_wanted(o->inputs[i]);
    return volumes ? 0 : trip_option_check_volume(&o->volume.options, o->inputs[0]);
}

static int check(const view_options *o)
{
    const triptych_view *v = &o->params.start;
    if (v->fov_degrees > 0 && v->ortho_height > 0)
        return trip_option_fail("--fov", "does not apply to a parallel view (--ortho)");
    if (v->eye && v->side)
        return trip_option_fail("--eye", "excludes --view; give one of them");
    if (o->quality.error > 0 && o->params.count != 1)
        return trip_option_fail("--error", "applies to one data set; name it");
    if (o->params.heat && o->params.count != 1)
        return trip_option_fail("--emission", "applies to one data set; name it");
    int status = check_volume(o);
    return status ? status : quality_options_check(&o->quality);
}

static int choose_settings(view_options *o)
{
    trip_view_params *p = &o->params;
    const quality_drawn drawn = { o->inputs[0], p->function };
    int status = quality_options_use(&o->quality, &drawn, &p->settings, &p->renderer, false);
    if (o->classify_given)
        p->settings.classify = o->classify;
    /* A moving view is drawn from coarse levels by this classification. */
    const bool coarse_splats = p->settings.classify == TRIPTYCH_PRE;
    o->volume.options.levels_for = quality_options_levels(&o->quality, coarse_splats);
    p->settings_given |= o->classify_given || quality_options_given(&o->quality);
    o->volume.measured_volume = drawn.input;
    o->volume.measured = o->quality.error > 0 ? o->quality.measured : NULL;
    return status;
}

static error_t parse_key(int key, char *arg, struct argp_state *state)
{
    view_options *o = state->input;
    switch (key) {
    case KEY_SIZE:
        return trip_option_size("--size", arg, &o->params.width, &o->params.height);
    case KEY_SCALE:
        return trip_option_number("--scale", arg, 0.5, 8, &o->params.scale);
    case KEY_NO_PANEL:
        o->params.no_panel = true;
        return 0;
    case KEY_FPS:
        return trip_option_number("--fps", arg, 1, 1000, &o->params.frames_per_second);
    case KEY_FRESH:
        o->params.fresh = true;
        return 0;
    case KEY_SCRIPT:
        o->params.script = arg;
        return 0;
    case ARGP_KEY_ARG:
        o->inputs[o->params.count++] = arg;
        return 0;
    case ARGP_KEY_END:
        return check(o);
    default:
        return parse_volume(key, arg, o);
    }
}

static int parse(view_options *o, int argc, char **argv)
{
    static const struct argp argp = {
        .options = options,
        .parser = parse_key,
        .args_doc = "[VOLUME|NAME.trip...]",
        .doc = "Shows volumes or data sets in a window, where you turn, cut, classify and fly "
               "through them. A moving view is drawn with as little detail as keeps to --fps. At "
               "rest the picture equals the picture of `triptych render`, bit for bit. A volume is "
               "first bricked into a cache; `triptych cache` lists and clears the cache.\vF1 lists "
               "the keys. Files can be dropped on the window.",
    };
    o->params.settings = triptych_default_settings();
    int status = trip_options_parse(&argp, argc, argv, o);
    return status ? status : trip_option_check_effects(&o->params.settings, o->params.heat);
}

static int note_read(view_options *o, triptych *t)
{
    int status = read_files_add(&o->read, o->params.script);
    if (!status)
        status = read_files_add(&o->read, o->params.heat);
    if (!status)
        status = read_files_add_function(&o->read, o->params.function);
    for (int i = 0; i < o->params.count && !status; i++)
        status = read_files_add_data(&o->read, t, o->inputs[i], &o->volume.options);
    return status;
}

static int check_output(void *user, const char *path)
{
    return read_files_check(user, path);
}

/* Reports an unusable input or transfer function before the window opens. */
static int check_inputs(view_options *o)
{
    triptych *t = NULL;
    const triptych_resources resources = { .memory_bytes = o->params.memory_bytes };
    int status = library_create(&t, NULL);
    for (int i = 0; i < o->params.count && !status; i++)
        status = viewed_volume_check(&o->volume, t, o->inputs[i], &resources);
    if (!status)
        status = library_check_heat(t, o->params.heat, &resources);
    if (!status && o->params.script)
        status = note_read(o, t);
    triptych_destroy(t);
    return status;
}

int trip_command_view(int argc, char **argv)
{
    view_options o = { .inputs = calloc((size_t)argc + 1, sizeof *o.inputs) };
    if (!o.inputs)
        return trip_exit_status(trip_fail(TRIP_ERROR, "usage", "view", "out of memory"));
    int status = parse(&o, argc, argv);
    if (!status)
        status = choose_settings(&o);
    o.params.inputs = o.inputs;
    o.volume.function = o.params.function;
    o.volume.samples = true;
    o.volume.options.memory_bytes = o.params.memory_bytes;
    o.volume.options.threads = o.params.threads;
    o.params.user = &o.volume;
    o.params.check_output = check_output;
    o.params.check_user = &o.read;
    o.params.find = viewed_volume_find;
    o.params.make = viewed_volume_make;
    o.params.release = viewed_volume_release;
    if (!status)
        status = check_inputs(&o);
    if (!status)
        status = trip_view_run(&o.params);
    read_files_release(&o.read);
    free(o.inputs);
    return trip_exit_status(status);
}
