#include "accuracy_options.h"

#include <string.h>

#include "command_line.h"
#include "draw_settings.h"

/* The settings that people choose from. The others are variants of the papers, slow references and
 * other programs. */
#define ACCURACY_USUAL_SETTINGS                                                                    \
    "quality-*,post-samples-per-sheet-[2346],post-samples-[24]*,post-lod-*,pre,pre-sheet,gl-*"

/* State of parsing. */
typedef struct parse {
    accuracy_options *o;
    const char *also[ACCURACY_DATA_MAX];
    int also_count;
} parse;

static int read_size(const trip_option *row, const char *text, void *base)
{
    accuracy_options *o = ((parse *)base)->o;
    int status = trip_option_size("--size", text, &o->width, &o->height);
    (void)row;
    if (!status && (o->width < 32 || o->width > 4096 || o->height < 32 || o->height > 4096))
        return trip_option_fail("--size", "takes 32 to 4096 pixels a side");
    return status;
}

static int read_also(const trip_option *row, const char *text, void *base)
{
    parse *p = base;
    (void)row;
    if (p->also_count == ACCURACY_DATA_MAX - 1)
        return trip_option_fail("--also",
                                "given too often; at most 7 other data sets are possible");
    p->also[p->also_count++] = text;
    return 0;
}

static int read_compare(const trip_option *row, const char *text, void *base)
{
    accuracy_options *o = ((parse *)base)->o;
    (void)row;
    if (strcmp(text, "none") == 0)
        return o->no_programs = 1, 0;
    if (o->program_count == ACCURACY_COMPARED_PROGRAMS_MAX)
        return trip_option_fail("--compare", "given too often; at most 4 programs are possible");
    o->program[o->program_count++] = text;
    return 0;
}

#define CUSTOM(function) .type = TRIP_OPTION_CUSTOM, .read = (function)

/* Options that may be given several times. */
static const trip_option parse_rows[] = {
    { "also", "OTHER.trip",
      "Adds a data set of the same volume with another halo, code bits or normals; up to 7",
      .group = DRAW_GROUP_PICTURE, CUSTOM(read_also) },
    { "compare", "COMMAND",
      "Measures another program in the same views, up to 4; requires --source; none leaves out the "
      "ray caster of VTK",
      .group = DRAW_GROUP_PICTURE, CUSTOM(read_compare) },
    { "size", "WxH|N", "Sets the picture size in pixels, 32 to 4096 a side", "256x256",
      .group = DRAW_GROUP_MEASUREMENT, CUSTOM(read_size) },
};

static const trip_option_table parse_table = { parse_rows, sizeof parse_rows / sizeof *parse_rows };

#define AT(member) .at = offsetof(accuracy_options, member)
#define FLAG .type = TRIP_OPTION_FLAG
#define TEXT .type = TRIP_OPTION_TEXT

static const trip_option rows[] = {
    { "force", NULL, "Replaces an existing report", .group = DRAW_GROUP_OUTPUT, FLAG, AT(force) },
    { "output", "REPORT/",
      "Names the folder of the report: accuracy.json, accuracy.csv and index.html", "NAME.accuracy",
      .short_name = 'o', .group = DRAW_GROUP_OUTPUT, TEXT, AT(output) },
    { "list", NULL, "Prints the names of all settings, and ends", .group = DRAW_GROUP_PICTURE, FLAG,
      AT(list) },
    { "no-shading", NULL, "Draws the plain colours of the transfer function, and reads no normals",
      .group = DRAW_GROUP_PICTURE, FLAG, AT(no_shading) },
    { "settings", "PATTERN[,...]",
      "Measures the settings with such names, with the wildcards of a shell: 'post*,pre'; all "
      "selects all",
      ACCURACY_USUAL_SETTINGS, .group = DRAW_GROUP_PICTURE, TEXT, AT(settings) },
    { "source", "VOLUME",
      "Compares with the integral through this volume, from which the data set was made",
      .group = DRAW_GROUP_PICTURE, TEXT, AT(source) },
    { "tf", "NAME|FILE", "Selects the transfer function, a preset or a file",
      "the one in the data set", .group = DRAW_GROUP_PICTURE, TEXT, AT(tf) },
    { "budget", "SECONDS", "Starts no setting after this time, and lists those left out",
      "unlimited", .group = DRAW_GROUP_MEASUREMENT, .type = TRIP_OPTION_NUMBER, AT(budget_seconds),
      .lo = 0, .hi = 1e9 },
    { "memory", "SIZE", "Limits the memory for data, for example 256M (MiB) or 2G (GiB)",
      "a quarter of the memory that the process may use", .group = DRAW_GROUP_MEASUREMENT,
      .type = TRIP_OPTION_BYTES_64, AT(memory_bytes) },
    { "pictures", NULL, "Keeps every picture, as OpenEXR", .group = DRAW_GROUP_MEASUREMENT, FLAG,
      AT(pictures) },
    { "repeat", "N", "Sets the timed frames per view and setting", "3",
      .group = DRAW_GROUP_MEASUREMENT, .type = TRIP_OPTION_INTEGER, AT(repeat), .lo = 1,
      .hi = 1000 },
    { "steps", NULL,
      "Divides each error into steps: pixel, storage, model, method, level and precision; takes "
      "many times as long",
      .group = DRAW_GROUP_MEASUREMENT, FLAG, AT(steps) },
    { "threads", "N", "Sets the number of threads that draw and read", "one per processor",
      .group = DRAW_GROUP_MEASUREMENT, .type = TRIP_OPTION_INTEGER, AT(threads), .lo = 1,
      .hi = 256 },
    { "tolerance", "E", "Bounds the error of each component of the integral over a pixel", "4e-3",
      .group = DRAW_GROUP_MEASUREMENT, .type = TRIP_OPTION_NUMBER, AT(tolerance), .lo = 1e-8,
      .hi = 0.01 },
    { "views", "N",
      "Sets the number of views around the object: perspective, parallel, from inside and wide in "
      "turns",
      "4", .group = DRAW_GROUP_MEASUREMENT, .type = TRIP_OPTION_INTEGER, AT(views), .lo = 1,
      .hi = 1000 },
};

static const trip_option_table accuracy_table = { rows, sizeof rows / sizeof *rows };

static int add_data(void *user, char *path)
{
    accuracy_options *o = ((parse *)user)->o;
    if (o->data_count)
        return trip_option_fail(path, "only one data set is possible; --also adds others");
    o->data[o->data_count++] = path;
    return 0;
}

static int check(void *user)
{
    const parse *p = user;
    accuracy_options *o = p->o;
    if (o->list)
        return 0;
    if (!o->data_count)
        return trip_option_fail("NAME.trip",
                                "no data set given; use `triptych accuracy NAME.trip -o REPORT/`");
    if (o->no_programs && o->program_count)
        return trip_option_fail("--compare", "none excludes other programs");
    for (int i = 0; i < p->also_count; i++)
        o->data[o->data_count++] = p->also[i];
    o->tolerance_given = o->tolerance > 0;
    if (!o->tolerance_given)
        o->tolerance = 4e-3;
    o->shading = !o->no_shading;
    o->usual = !o->settings;
    if (o->usual)
        o->settings = ACCURACY_USUAL_SETTINGS;
    else if (!strcmp(o->settings, "all"))
        o->settings = "*";
    return 0;
}

int accuracy_options_parse(accuracy_options *o, int argc, char **argv)
{
    *o = (accuracy_options){
        .width = 256, .height = 256, .views = 4, .repeat = 3, .budget_seconds = 1e9
    };
    parse p = { .o = o };
    option_set sets[] = { { .table = &parse_table, .base = &p },
                          { .table = &accuracy_table, .base = o } };
    const command_line c = {
        .args_doc = "NAME.trip",
        .doc =
            "Measures the time and the error of settings that trade accuracy for time, on one data "
            "set. The error is the difference from the emission-absorption integral, as its mean "
            "over the area of each pixel. "
            "Prints a table and writes a report: JSON, CSV and a page. `triptych render --error` "
            "reads it.",
        .sets = sets,
        .set_count = 2,
        .argument = add_data,
        .end = check,
        .user = &p,
    };
    return command_line_parse(&c, argc, argv);
}
