/* triptych serve: starts a server that shows a data set in a browser on this machine. */
#include <stdio.h>
#include <string.h>

#include "clip_options.h"
#include "commands.h"
#include "effects_options.h"
#include "library.h"
#include "options.h"
#include "quality_options.h"
#include "report.h"
#include "volume_options.h"
#include "viewed_volume.h"
#include "serve.h"

enum {
    KEY_PORT = 256,
    KEY_FPS,
    KEY_TF,
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

typedef struct serve_options {
    trip_serve_params params;
    quality_options quality;
    bool classify_given;
    triptych_classify classify;
    viewed_volume volume;
} serve_options;

static const struct argp_option options[] = {
    { NULL, 0, NULL, 0, "Server:", 1 },
    { "fps", KEY_FPS, "N", 0,
      "Sets the target frames per second of a moving view, 1 to 1000 (default: 30)", 1 },
    { "port", KEY_PORT, "N", 0,
      "Sets the port of 127.0.0.1, 0 to 65535; 0 selects a free port (default: 0)", 1 },
    { NULL, 0, NULL, 0, "Look (the page changes it):", 2 },
    { "tf", KEY_TF, "NAME|FILE", 0,
      "Selects the transfer function, a preset or a file (default: the one in the data set)", 2 },
    TRIP_OPTION_LIGHT(2),
    TRIP_OPTIONS_EFFECTS(2),
    TRIP_OPTIONS_EMISSION(2),
    TRIP_OPTIONS_CLIP(2),
    { NULL, 0, NULL, 0, "Accuracy and speed:", 3 },
    { "classify", KEY_CLASSIFY, "pre|post|auto", 0,
      "Selects when values become colours: pre (before splatting), post (after interpolation) or "
      "auto (default: auto, as in `triptych render`); excludes --error",
      3 },
    TRIP_OPTIONS_QUALITY(3),
    { NULL, 0, NULL, 0, "Renderer and resources:", 4 },
    TRIP_OPTION_ENGINE(KEY_ENGINE, 4),
    TRIP_OPTION_MEMORY(KEY_MEMORY, 4),
    { "renderer", KEY_RENDERER, "NAME", 0,
      "Selects the renderer: gl, cpu or auto, which is gl on graphics hardware, else cpu (default: "
      "auto)",
      4 },
    TRIP_OPTION_THREADS(KEY_THREADS, 4),
    { NULL, 0, NULL, 0, "Volume (not for a data set, which has these fixed):", 5 },
    TRIP_OPTIONS_VOLUME(5),
    { 0 },
};

static int parse_renderer(int key, char *arg, trip_serve_params *p)
{
    int which = 0, status;
    switch (key) {
    case KEY_RENDERER:
        status = trip_option_renderer(arg, 3, &which);
        p->renderer = (triptych_renderer)which;
        return status;
    case KEY_MEMORY:
        return trip_option_memory(arg, &p->memory_bytes);
    case KEY_ENGINE:
        status = trip_option_engine(arg, 4, &which);
        p->engine = (triptych_engine)which;
        return status;
    case KEY_THREADS:
        status = trip_option_threads(arg, &which);
        p->threads = (unsigned)which;
        return status;
    default:
        return ARGP_ERR_UNKNOWN;
    }
}

static int parse_effects(int key, char *arg, trip_serve_params *p)
{
    switch (key) {
    case KEY_LIGHT:
        return trip_option_light(arg, &p->settings);
    case KEY_EFFECTS:
        return trip_option_effects(arg, &p->settings);
    case KEY_ANISOTROPY:
        return trip_option_anisotropy(arg, &p->settings);
    case KEY_CUEING:
        return trip_option_cueing(arg, &p->settings);
    case KEY_LIGHT_CELLS:
        return trip_option_light_cells(arg, &p->settings);
    case KEY_EMISSION:
        p->heat = arg;
        return 0;
    case KEY_TEMPERATURE:
        return trip_option_temperature(arg, &p->settings);
    default:
        return parse_renderer(key, arg, p);
    }
}

static int parse_rest(int key, char *arg, serve_options *o)
{
    trip_serve_params *p = &o->params;
    int which = 0, status;
    switch (key) {
    case KEY_PORT:
        return trip_option_integer("--port", arg, 0, 65535, &p->port);
    case KEY_FPS:
        return trip_option_number("--fps", arg, 1, 1000, &p->frames_per_second);
    case KEY_TF:
        p->function = arg;
        return 0;
    case KEY_CLASSIFY:
        status = trip_option_classify(arg, 3, &which);
        o->classify = (triptych_classify)which;
        o->classify_given = true;
        o->quality.measurable = "classify";
        return status;
    case KEY_CLIP_BOX:
        return trip_option_clip_box(arg, &p->settings.clip);
    case KEY_CLIP_PLANE:
        return trip_option_clip_plane(arg, &p->settings.clip);
    case KEY_QUALITY:
        return quality_option_quality(arg, &o->quality);
    case KEY_ERROR:
        return quality_option_error(arg, &o->quality);
    case KEY_REPORT:
        o->quality.report = arg;
        return 0;
    default:
        return parse_effects(key, arg, p);
    }
}

static int parse_volume(int key, char *arg, serve_options *o)
{
    triptych_brick_options *v = &o->volume.options;
    switch (key) {
    case KEY_GRID:
        return trip_option_grid(arg, &v->grid);
    case KEY_LEVEL_SET:
        return trip_option_level_set(arg, &v->level_set);
    case KEY_SPACING:
        return trip_option_spacing(arg, v->spacing);
    case KEY_AXES:
        return trip_option_axes(arg, &v->axes);
    case KEY_COORDINATES:
        v->coordinates = arg;
        return 0;
    case KEY_ALLOW_GAPS:
        v->allow_gaps = 1;
        return 0;
    default:
        return parse_rest(key, arg, o);
    }
}

static int check(const serve_options *o)
{
    if (!o->params.input)
        return trip_option_fail("VOLUME", "no volume given; use `triptych serve VOLUME`");
    int status = trip_option_check_volume(&o->volume.options, o->params.input);
    return status ? status : quality_options_check(&o->quality);
}

static error_t parse_key(int key, char *arg, struct argp_state *state)
{
    serve_options *o = state->input;
    trip_serve_params *p = &o->params;
    switch (key) {
    case ARGP_KEY_ARG:
        if (p->input)
            return trip_option_fail(arg, TRIP_ONE_VOLUME);
        p->input = arg;
        return 0;
    case ARGP_KEY_END:
        return check(o);
    default:
        return parse_volume(key, arg, o);
    }
}

static int choose_settings(serve_options *o)
{
    trip_serve_params *p = &o->params;
    const quality_drawn drawn = { p->input, p->function };
    int status = quality_options_use(&o->quality, &drawn, &p->settings, &p->renderer, false);
    if (o->classify_given)
        p->settings.classify = o->classify;
    /* A moving view is drawn from coarse levels by this classification. */
    const bool coarse_splats = p->settings.classify == TRIPTYCH_PRE;
    o->volume.options.levels_for = quality_options_levels(&o->quality, coarse_splats);
    o->volume.measured_volume = drawn.input;
    o->volume.measured = o->quality.error > 0 ? o->quality.measured : NULL;
    return status;
}

/* Reports an unusable input or transfer function before the server starts. */
static int check_input(const serve_options *o)
{
    const trip_serve_params *p = &o->params;
    triptych *t = NULL;
    const triptych_resources resources = { .memory_bytes = p->memory_bytes };
    int status = library_create(&t, NULL);
    if (!status)
        status = viewed_volume_check(&o->volume, t, p->input, &resources);
    if (!status)
        status = library_check_heat(t, p->heat, &resources);
    triptych_destroy(t);
    return status;
}

static void say(void *user, const char *address)
{
    (void)user;
    puts(address);
    fflush(stdout);
}

int trip_command_serve(int argc, char **argv)
{
    static const struct argp argp = {
        .options = options,
        .parser = parse_key,
        .args_doc = "VOLUME|NAME.trip",
        .doc = "Shows a volume or a data set in a browser, at the address that this command "
               "prints, until it is interrupted. A moving view is sent as JPEG. At rest the page "
               "gets the picture of `triptych render` as PNG. The server listens to 127.0.0.1 "
               "only, and answers only requests with the token in the address. To look from "
               "another machine, forward the port with ssh -L to the same number. A volume is "
               "first bricked into a cache; `triptych cache` lists and clears the cache.",
    };
    serve_options o = {
        .params = { .settings = triptych_default_settings(),
                    .ready = say,
                    .find = viewed_volume_find,
                    .release = viewed_volume_release,
                    .find_user = &o.volume },
    };
    int status = trip_options_parse(&argp, argc, argv, &o);
    o.volume.function = o.params.function;
    o.volume.options.memory_bytes = o.params.memory_bytes;
    o.volume.options.threads = o.params.threads;
    if (!status)
        status = choose_settings(&o);
    if (!status)
        status = trip_option_check_effects(&o.params.settings, o.params.heat);
    if (!status)
        status = check_input(&o);
    return trip_exit_status(status ? status : trip_serve_run(&o.params));
}
