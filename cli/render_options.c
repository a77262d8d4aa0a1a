#include "render_options.h"

#include <string.h>
#include <strings.h>

#include "cached_volume.h"
#include "report.h"
#include "video.h"

static const char *const fields[] = { "stored", "source", "splats", NULL };

#define AT(member) .at = offsetof(render_options, member)

static const trip_option rows[] = {
    { "output", "FILE",
      "Writes this file: .png, .jpg, .tif or .exr; with --orbit or --path also a video, .mp4, "
      ".mov, "
      ".mkv or .webm, which needs ffmpeg",
      .brief = "Writes .png, .jpg, .tif or .exr, or a video", .short_name = 'o',
      .group = DRAW_GROUP_PICTURE, .type = TRIP_OPTION_TEXT, AT(output) },
    { "fps", "N", "Sets the frames per second of a video", "from the path, else 30",
      .group = DRAW_GROUP_PATHS, .type = TRIP_OPTION_NUMBER, AT(fps), .lo = 0.001, .hi = 1000 },
    { "in-flight", "N", "Draws N pictures at once; all of them share --memory",
      "2; with --stats or --explain 1", .group = DRAW_GROUP_PATHS, .type = TRIP_OPTION_INTEGER,
      AT(in_flight), .lo = 1, .hi = 16 },
    { "orbit", "N", "Draws N pictures once around the object: FILE-000.png and so on, or a video",
      .brief = "Draws N pictures once around the object", .group = DRAW_GROUP_PATHS,
      .type = TRIP_OPTION_INTEGER, AT(orbit), .lo = 1, .hi = 100000 },
    { "path", "FILE.json",
      "Draws pictures along a camera path, which triptych-render(1) describes: FILE-000.png and so "
      "on, or a video",
      NULL, "excludes --orbit and the options of the view",
      .brief = "Draws pictures along a camera path", .group = DRAW_GROUP_PATHS,
      .type = TRIP_OPTION_TEXT, AT(path) },
    { "place", "X,Y,Z[,SCALE][;...]",
      "Moves and scales each input in the picture, in the order of the inputs; ';' stands between "
      "them",
      NULL, "a scene file places its objects itself", .brief = "Moves and scales each input",
      .group = DRAW_GROUP_VIEW, .type = TRIP_OPTION_TEXT, AT(place) },
    { "depth", "FILE",
      "Writes the mean distance from the eye to the visible object at each pixel, in world units: "
      ".exr or .tif",
      NULL, "requires --samples 1; not with integral", .group = DRAW_GROUP_RESULTS,
      .type = TRIP_OPTION_TEXT, AT(depth) },
    { "explain", NULL, "Prints the view as options, the plan of the frame and its cost",
      .brief = "Prints the plan of the frame and its cost", .group = DRAW_GROUP_RESULTS,
      .type = TRIP_OPTION_FLAG, AT(explain) },
    { "stats", "FILE", "Writes counts and times as JSON; - is standard output",
      .group = DRAW_GROUP_RESULTS, .type = TRIP_OPTION_TEXT, AT(stats) },
    { "field", "NAME",
      "Selects the integrand: stored values, the values of the source (requires a volume, not a "
      "data set) or splats",
      "stored", .group = DRAW_GROUP_INTEGRAL, .type = TRIP_OPTION_CHOICE, AT(field),
      .choices = fields, .first = RENDER_FIELD_STORED },
};

static const trip_option_table render_table = { rows, sizeof rows / sizeof *rows };

/* The tables of `render`. */
enum { OWN, VIEW, LOOK, SETTINGS, HEAT, QUALITY, RESOURCES, VOLUME, POINTS, SETS };

typedef struct parse {
    render_options *o;
    option_set sets[SETS];
} parse;

triptych_view render_options_view(const render_options *o)
{
    triptych_view view = view_options_view(&o->view);
    view.turntable = o->orbit > 0;
    return view;
}

/* Checks that no option contradicts the views of a path. */
static int check_path(const parse *p)
{
    const uint64_t views = p->sets[VIEW].given & ~(UINT64_C(1) << VIEW_SIZE);
    if (p->o->path && (views || p->o->orbit))
        return trip_option_fail("--path",
                                "excludes --orbit and all options of the view except --size");
    return 0;
}

static int check_sequence(const parse *p)
{
    const render_options *o = p->o;
    bool several = o->orbit || o->path, moving = video_is_named(o->output);
    if (moving && !several)
        return trip_option_fail(o->output, "is a video, which requires --orbit or --path");
    if (o->fps > 0 && !moving)
        return trip_option_fail("--fps", "requires a video, -o NAME.mp4");
    if (o->in_flight && !several)
        return trip_option_fail("--in-flight", "requires --orbit or --path");
    if (o->in_flight > 1 && (o->stats || o->explain))
        return trip_option_fail("--in-flight", "must be 1 with --stats or --explain");
    return check_path(p);
}

static int add_input(void *user, char *path)
{
    render_options *o = ((parse *)user)->o;
    if (!o->input) {
        o->input = path;
        return 0;
    }
    if (o->more_count == RENDER_MORE_MAX)
        return trip_option_fail(path, "too many data sets; at most 64 are possible");
    o->more[o->more_count++] = path;
    return 0;
}

static int check_more(const render_options *o)
{
    if (o->place)
        return 0;
    if (o->more_count && draw_settings_has_levels(&o->settings))
        return trip_option_fail(
            "--lod, --max-bytes, --max-ms",
            "do not apply to several data sets, which are drawn at the finest level");
    if (o->more_count && o->quality.error > 0)
        return trip_option_fail(
            "--error", "does not apply to several data sets; its settings were measured on one");
    return 0;
}

static int check_input(const parse *p)
{
    const render_options *o = p->o;
    if (!o->input)
        return trip_option_fail("VOLUME",
                                "no volume given; use `triptych render VOLUME -o PICTURE.png`");
    if (!o->output)
        return trip_option_fail("-o",
                                "no picture given; use `triptych render VOLUME -o PICTURE.png`");
    int status =
        p->sets[VOLUME].given || p->sets[POINTS].given ? cached_volume_check_options(o->input) : 0;
    return status ? status : check_more(o);
}

/* Refuses a transparent background for a file without alpha. */
static int check_background(const render_options *o)
{
    const char *extension = strrchr(o->output, '.');
    const bool jpeg =
        extension && (!strcasecmp(extension, ".jpg") || !strcasecmp(extension, ".jpeg"));
    if (draw_settings_background(&o->settings)[3] >= 1 || (!jpeg && !video_is_named(o->output)))
        return 0;
    return trip_fail(TRIP_USAGE, "usage", "--background",
                     "%s cannot hold a transparent background; use .png, .tif or .exr, or a "
                     "background without transparency",
                     o->output);
}

/* Sets the settings that options of this command imply, and checks all of them. */
static int check_settings(render_options *o, uint64_t given)
{
    const char *extension = strrchr(o->output, '.');
    const bool asks_occluded = given >> RESOURCE_OCCLUDED & 1;
    triptych_resources *r = &o->resources;
    o->settings.all.depth = o->depth != NULL;
    o->settings.integral.field = o->field == RENDER_FIELD_SPLATS  ? TRIPTYCH_FIELD_SPLATS
                                 : o->field != RENDER_FIELD_UNSET ? TRIPTYCH_FIELD_VALUES
                                                                  : TRIPTYCH_FIELD_DEFAULT;
    if (o->field == RENDER_FIELD_SOURCE && !cached_volume_wanted(o->input))
        return trip_option_fail(
            "--field",
            "source requires a volume as input, because a data set does not hold its source");
    int status = draw_settings_check(&o->settings, &r->renderer, true);
    if (status)
        return status;
    if (asks_occluded && r->renderer != TRIPTYCH_RENDERER_AUTO &&
        r->renderer != TRIPTYCH_RENDERER_CPU)
        return trip_option_fail("--occluded", "requires --renderer cpu");
    if (asks_occluded)
        r->renderer = TRIPTYCH_RENDERER_CPU;
    o->count = o->settings.all.count_exactly;
    if (o->count) /* the timed frames, which do not count, draw splats too */
        o->settings.all.classify = TRIPTYCH_CLASSIFY_PRE;
    if (o->count && !o->stats && !o->explain)
        return trip_option_fail("--count", "requires --stats or --explain");
    if (!o->settings.has_background && extension && !strcasecmp(extension, ".exr"))
        o->settings.has_background = 1; /* transparent */
    return check_background(o);
}

static int check(void *user)
{
    parse *p = user;
    render_options *o = p->o;
    int status = check_input(p);
    if (!status)
        status = view_options_check(&o->view);
    if (!status)
        status = check_sequence(p);
    if (!status)
        status = quality_options_check(&o->quality, &o->settings, o->resources.renderer);
    if (!status)
        status = heat_options_check(&o->settings, o->heat);
    if (!status)
        status = look_options_check(p->sets[LOOK].given);
    return status ? status : check_settings(o, p->sets[RESOURCES].given);
}

/* Takes the settings of --error from its report. */
static int use_report(render_options *o, uint64_t given)
{
    if (o->quality.error > 0 && (triptych_is_scene_file(o->input) || o->place))
        return library_fail_objects_option("error");
    int status = quality_options_use(&o->quality, &(quality_drawn){ o->input, o->function.name },
                                     &o->settings, &o->resources.renderer, true);
    return status ? status : check_settings(o, given);
}

int render_options_parse(render_options *o, int argc, char **argv)
{
    *o = (render_options){ .view.view = { .width = 1024, .height = 1024 } };
    parse p = { .o = o,
                .sets = {
                    [OWN] = { .table = &render_table, .base = o },
                    [VIEW] = { .table = &view_options_table, .base = &o->view },
                    [LOOK] = { .table = &look_table, .base = &o->function },
                    [SETTINGS] = { .table = &draw_settings_table,
                                   .base = &o->settings,
                                   .without = UINT64_C(1) << DRAW_DEPTH | UINT64_C(1)
                                                                              << DRAW_FIELD },
                    [HEAT] = { .table = &heat_table, .base = &o->heat },
                    [QUALITY] = { .table = &quality_table, .base = &o->quality },
                    [RESOURCES] = { .table = &resource_table, .base = &o->resources },
                    [VOLUME] = { .table = &volume_options_table, .base = &o->volume },
                    [POINTS] = { .table = &point_options_table, .base = &o->volume },
                } };
    const command_line c = {
        .args_doc = "VOLUME|NAME.trip [NAME.trip...]",
        .doc =
            "Draws a volume, or a data set made by `triptych brick`, into an image file. A volume "
            "is first bricked into a cache, so that its next picture starts at once; `triptych "
            "cache` lists and clears the cache. Several data sets are drawn in one picture if they "
            "are regions of one volume.\vPoints and lengths are in the world units of the data.",
        .sets = p.sets,
        .set_count = SETS,
        .argument = add_input,
        .end = check,
        .user = &p,
    };
    int status = command_line_parse(&c, argc, argv);
    if (!status && o->quality.error > 0)
        status = use_report(o, p.sets[RESOURCES].given);
    const bool coarse_splats =
        o->settings.all.classify == TRIPTYCH_CLASSIFY_PRE && draw_settings_has_levels(&o->settings);
    o->levels_for = quality_options_levels(&o->quality, coarse_splats);
    o->settings.all.count_exactly = 0;
    return status;
}
