/* triptych serve: starts a server that shows a data set in a browser on this machine. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "cache_folder.h"
#include "commands.h"
#include "draw_options.h"
#include "library.h"
#include "quality_options.h"
#include "report.h"
#include "viewed_volume.h"
#include "serve.h"

typedef struct serve_options {
    trip_serve_params params;
    triptych_transfer_function look;
    triptych_resources resources;
    quality_options quality;
    viewed_volume volume;
} serve_options;

#define AT(member) .at = offsetof(serve_options, member)

static const trip_option rows[] = {
    { "fps", "N", "Sets the target frames per second of a moving view", "30",
      .brief = "Sets the frames per second of a moving view", .group = DRAW_GROUP_SERVER,
      .type = TRIP_OPTION_NUMBER, AT(params.frames_per_second), .lo = 1, .hi = 1000 },
    { "port", "N", "Sets the port of 127.0.0.1, 0 to 65535; 0 selects a free port", "0",
      .brief = "Sets the port of 127.0.0.1 (default: a free one)", .group = DRAW_GROUP_SERVER,
      .type = TRIP_OPTION_INTEGER, AT(params.port), .lo = 0, .hi = 65535 },
};

static const trip_option_table serve_table = { rows, sizeof rows / sizeof *rows };

/* The tables of `serve`. */
enum { OWN, LOOK, SETTINGS, HEAT, QUALITY, RENDERER, RESOURCES, VOLUME, POINTS, SETS };

typedef struct parse {
    serve_options *o;
    option_set sets[SETS];
} parse;

static int add_input(void *user, char *path)
{
    trip_serve_params *p = &((parse *)user)->o->params;
    if (p->input)
        return trip_option_fail(path, TRIP_ONE_VOLUME);
    p->input = path;
    return 0;
}

static int check(void *user)
{
    const parse *p = user;
    serve_options *o = p->o;
    trip_serve_params *s = &o->params;
    if (!s->input)
        return trip_option_fail("VOLUME", "no volume given; use `triptych serve VOLUME`");
    const bool reads = p->sets[VOLUME].given || p->sets[POINTS].given;
    int status = reads ? cached_volume_check_options(s->input) : 0;
    if (!status)
        status = quality_options_check(&o->quality, &s->settings, o->resources.renderer);
    if (!status)
        status = heat_options_check(&s->settings, s->heat);
    return status ? status : draw_settings_check(&s->settings, &o->resources.renderer, true);
}

static int parse_options(serve_options *o, int argc, char **argv)
{
    const uint64_t only_tf = ~(UINT64_C(1) << LOOK_TF);
    const uint64_t files = UINT64_C(1) << DRAW_DEPTH | UINT64_C(1) << DRAW_COUNT;
    const uint64_t integral = UINT64_C(1) << DRAW_FIELD | UINT64_C(1) << DRAW_TOLERANCE;
    const uint64_t others = UINT64_C(1) << RESOURCE_RENDERER | UINT64_C(1) << RESOURCE_OCCLUDED;
    parse p = { .o = o,
                .sets = {
                    [OWN] = { .table = &serve_table, .base = o },
                    [LOOK] = { .table = &look_table, .base = &o->look, .without = only_tf },
                    [SETTINGS] = { .table = &draw_settings_table,
                                   .base = &o->params.settings,
                                   .without = files | integral },
                    [HEAT] = { .table = &heat_table, .base = &o->params.heat },
                    [QUALITY] = { .table = &quality_table, .base = &o->quality },
                    [RENDERER] = { .table = &viewer_renderer_table, .base = &o->resources },
                    [RESOURCES] = { .table = &resource_table,
                                    .base = &o->resources,
                                    .without = others },
                    [VOLUME] = { .table = &volume_options_table, .base = &o->volume.options },
                    [POINTS] = { .table = &point_options_table, .base = &o->volume.options },
                } };
    const command_line c = {
        .args_doc = "VOLUME|NAME.trip",
        .doc = "Shows a volume, a Gaussian scene, a data set or a scene file in a browser, at the "
               "address that "
               "this command "
               "prints, until it is interrupted. A moving view is sent as JPEG. At rest the page "
               "gets the picture of `triptych render` as PNG. The server listens to 127.0.0.1 "
               "only, and answers only requests with the token in the address. To look from "
               "another machine, forward the port with ssh -L to the same number. A volume is "
               "first bricked into a cache; `triptych cache` lists and clears the cache.",
        .sets = p.sets,
        .set_count = SETS,
        .argument = add_input,
        .end = check,
        .user = &p,
    };
    int status = command_line_parse(&c, argc, argv);
    o->params.function = o->volume.function = o->look.name;
    return status ? status
                  : viewed_volume_choose(&o->volume, &o->quality, o->params.input,
                                         &o->params.settings, &o->resources.renderer);
}

/* Reports an unusable input or transfer function before the server starts. */
static int check_input(const serve_options *o)
{
    const trip_serve_params *p = &o->params;
    triptych *t = NULL;
    int status = library_create(&t, NULL);
    if (!status)
        status = viewed_volume_check(&o->volume, t, p->input, &o->resources);
    if (!status && p->heat && triptych_is_scene_file(p->input))
        status = library_fail_objects_option("emission");
    if (!status)
        status = library_check_heat(t, p->heat, &o->resources);
    triptych_destroy(t);
    return status;
}

static void say(void *user, const char *address)
{
    (void)user;
    puts(address);
    if (isatty(STDOUT_FILENO) == 1 && !command_line_quiet())
        puts("Open this address in a browser. Ctrl-C ends the server.");
    fflush(stdout);
}

int trip_command_serve(int argc, char **argv)
{
    serve_options o = {
        .params = { .ready = say,
                    .find = viewed_volume_find,
                    .open = viewed_volume_open,
                    .release = viewed_volume_release,
                    .find_user = &o.volume },
    };
    int status = parse_options(&o, argc, argv);
    char *choices_folder = status ? NULL : cache_folder_choices();
    o.params.choices_folder = choices_folder;
    o.params.memory_bytes = o.volume.options.memory_bytes = o.resources.memory_bytes;
    o.params.threads = o.volume.options.threads = o.resources.threads;
    o.params.renderer = o.resources.renderer;
    o.params.engine = o.resources.engine;
    if (!status)
        status = check_input(&o);
    if (!status)
        status = trip_serve_run(&o.params);
    free(choices_folder);
    return trip_exit_status(status);
}
