/* triptych view: shows data sets and volumes in a window. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "cache_folder.h"
#include "commands.h"
#include "draw_options.h"
#include "library.h"
#include "quality_options.h"
#include "read_data.h"
#include "report.h"
#include "viewed_volume.h"
#include "view.h"

typedef struct view_command {
    trip_view_params params;
    const char **inputs;
    view_options view;
    triptych_transfer_function look;
    triptych_resources resources;
    quality_options quality;
    int no_panel, fresh;
    read_files read; /* files that a script must not overwrite */
    viewed_volume volume;
} view_command;

#define AT(member) .at = offsetof(view_command, member)

static int read_size(const trip_option *row, const char *text, void *base)
{
    trip_view_params *p = &((view_command *)base)->params;
    (void)row;
    return trip_option_size("--size", text, &p->width, &p->height);
}

static const trip_option rows[] = {
    { "fps", "N", "Sets the target frames per second of a moving view", "30",
      .brief = "Sets the frames per second of a moving view", .group = DRAW_GROUP_WINDOW,
      .type = TRIP_OPTION_NUMBER, AT(params.frames_per_second), .lo = 1, .hi = 1000 },
    { "fresh", NULL, "Ignores the stored state of the data, and stores none",
      .brief = "Ignores the stored state of the data", .group = DRAW_GROUP_WINDOW,
      .type = TRIP_OPTION_FLAG, AT(fresh) },
    { "no-panel", NULL, "Starts without the panel; the key t shows it",
      .brief = "Starts without the panel", .group = DRAW_GROUP_WINDOW, .type = TRIP_OPTION_FLAG,
      AT(no_panel) },
    { "scale", "X", "Sets the scale of texts and controls", "the scale of the screen",
      .brief = "Sets the scale of texts and controls", .group = DRAW_GROUP_WINDOW,
      .type = TRIP_OPTION_NUMBER, AT(params.scale), .lo = 0.5, .hi = 8 },
    { "script", "FILE", "Replays the events in a file, then ends",
      .brief = "Replays the events in a file, then ends", .group = DRAW_GROUP_WINDOW,
      .type = TRIP_OPTION_TEXT, AT(params.script) },
    { "size", "WxH|N", "Sets the size of the window in pixels", "1100x720",
      .brief = "Sets the size of the window (default: 1100x720)", .group = DRAW_GROUP_WINDOW,
      .type = TRIP_OPTION_CUSTOM, AT(params.width), .read = read_size },
};

static const trip_option_table view_table = { rows, sizeof rows / sizeof *rows };

/* The tables of `view`. */
enum { OWN, VIEW, LOOK, SETTINGS, HEAT, QUALITY, RENDERER, RESOURCES, VOLUME, POINTS, SETS };

typedef struct parse {
    view_command *o;
    option_set sets[SETS];
} parse;

/* Options for reading files require an input that is a file, or no input: the user may then open a
 * file later. */
static int check_volume(const view_command *o)
{
    bool volumes = o->params.count == 0;
    for (int i = 0; i < o->params.count; i++)
        volumes = volumes || cached_volume_wanted(o->inputs[i]);
    return volumes ? 0 : cached_volume_check_options(o->inputs[0]);
}

static int add_input(void *user, char *path)
{
    view_command *o = ((parse *)user)->o;
    o->inputs[o->params.count++] = path;
    return 0;
}

static int check(void *user)
{
    const parse *p = user;
    view_command *o = p->o;
    if (o->quality.error > 0 && o->params.count != 1)
        return trip_option_fail("--error", "applies to one data set; name it");
    if (o->params.heat && o->params.count != 1)
        return trip_option_fail("--emission", "applies to one data set; name it");
    int status = view_options_check(&o->view);
    if (!status && (p->sets[VOLUME].given || p->sets[POINTS].given))
        status = check_volume(o);
    if (!status)
        status = look_options_check(p->sets[LOOK].given);
    if (!status)
        status = quality_options_check(&o->quality, &o->params.settings, o->resources.renderer);
    if (!status)
        status = heat_options_check(&o->params.settings, o->params.heat);
    return status ? status : draw_settings_check(&o->params.settings, &o->resources.renderer, true);
}

static void take_options(view_command *o, const option_set sets[SETS])
{
    trip_view_params *p = &o->params;
    p->start = view_options_view(&o->view);
    p->start_given = sets[VIEW].given != 0;
    p->settings_given = (sets[SETTINGS].given | sets[HEAT].given) != 0 || o->quality.error > 0;
    p->function = o->volume.function = o->look.name;
    p->opacity_scale = o->look.opacity_scale;
    p->no_panel = o->no_panel;
    p->fresh = o->fresh;
}

static int parse_options(view_command *o, int argc, char **argv)
{
    const uint64_t window = UINT64_C(1) << LOOK_LEVEL | UINT64_C(1) << LOOK_WINDOW;
    const uint64_t files = UINT64_C(1) << DRAW_DEPTH | UINT64_C(1) << DRAW_COUNT;
    const uint64_t integral = UINT64_C(1) << DRAW_FIELD | UINT64_C(1) << DRAW_TOLERANCE;
    const uint64_t others = UINT64_C(1) << RESOURCE_RENDERER | UINT64_C(1) << RESOURCE_OCCLUDED;
    parse p = { .o = o,
                .sets = {
                    [OWN] = { .table = &view_table, .base = o },
                    [VIEW] = { .table = &view_options_table,
                               .base = &o->view,
                               .without = UINT64_C(1) << VIEW_SIZE },
                    [LOOK] = { .table = &look_table, .base = &o->look, .without = window },
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
        .args_doc = "[VOLUME|NAME.trip...]",
        .doc = "Shows volumes, Gaussian scenes, data sets or scene files in a window, where you "
               "turn, cut, "
               "classify and fly "
               "through them. A moving view is drawn with as little detail as keeps to --fps. At "
               "rest the picture equals the picture of `triptych render`, bit for bit. A volume is "
               "first bricked into a cache; `triptych cache` lists and clears the cache.\vF1 lists "
               "the keys. Files can be dropped on the window.",
        .sets = p.sets,
        .set_count = SETS,
        .argument = add_input,
        .end = check,
        .user = &p,
    };
    int status = command_line_parse(&c, argc, argv);
    if (!status)
        take_options(o, p.sets);
    return status ? status
                  : viewed_volume_choose(&o->volume, &o->quality, o->inputs[0], &o->params.settings,
                                         &o->resources.renderer);
}

static int note_read(view_command *o, triptych *t)
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
static int check_inputs(view_command *o)
{
    triptych *t = NULL;
    int status = library_create(&t, NULL);
    for (int i = 0; i < o->params.count && !status; i++)
        status = viewed_volume_check(&o->volume, t, o->inputs[i], &o->resources);
    if (!status && o->params.heat && triptych_is_scene_file(o->inputs[0]))
        status = library_fail_objects_option("emission");
    if (!status)
        status = library_check_heat(t, o->params.heat, &o->resources);
    if (!status && o->params.script)
        status = note_read(o, t);
    triptych_destroy(t);
    return status;
}

int trip_command_view(int argc, char **argv)
{
    view_command o = { .inputs = calloc((size_t)argc + 1, sizeof *o.inputs) };
    if (!o.inputs)
        return trip_exit_status(trip_fail(TRIP_ERROR, "usage", "view", "out of memory"));
    int status = parse_options(&o, argc, argv);
    char *choices_folder = status ? NULL : cache_folder_choices();
    o.params.inputs = o.inputs;
    o.volume.samples = true;
    o.params.memory_bytes = o.volume.options.memory_bytes = o.resources.memory_bytes;
    o.params.threads = o.volume.options.threads = o.resources.threads;
    o.params.renderer = o.resources.renderer;
    o.params.engine = o.resources.engine;
    o.params.choices_folder = choices_folder;
    o.params.user = &o.volume;
    o.params.check_output = check_output;
    o.params.check_user = &o.read;
    o.params.find = viewed_volume_find;
    o.params.open = viewed_volume_open;
    o.params.make = viewed_volume_make;
    o.params.release = viewed_volume_release;
    if (!status)
        status = check_inputs(&o);
    if (!status)
        status = trip_view_run(&o.params);
    read_files_release(&o.read);
    free(choices_folder);
    free(o.inputs);
    return trip_exit_status(status);
}
