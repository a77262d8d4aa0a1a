#include "accuracy_options.h"

#include <stdio.h>
#include <string.h>

#include "options.h"
#include "report.h"

enum {
    KEY_SOURCE = 256,
    KEY_ALSO,
    KEY_COMPARE,
    KEY_TF,
    KEY_NO_SHADING,
    KEY_SETTINGS,
    KEY_LIST,
    KEY_VIEWS,
    KEY_SIZE,
    KEY_SAMPLES,
    KEY_REPEAT,
    KEY_TOLERANCE,
    KEY_NO_LADDER,
    KEY_BUDGET,
    KEY_THREADS,
    KEY_MEMORY,
    KEY_PICTURES,
    KEY_FORCE,
    KEY_QUIET,
};

static const struct argp_option options[] = {
    { "force", KEY_FORCE, NULL, 0, "Replaces an existing report", 0 },
    { "output", 'o', "REPORT/", 0,
      "Names the folder of the report: accuracy.json, accuracy.csv and index.html (default: "
      "NAME.accuracy)",
      0 },
    { "quiet", KEY_QUIET, NULL, 0, "Prints no progress", 0 },
    { NULL, 0, NULL, 0, "Settings and data:", 1 },
    { "also", KEY_ALSO, "OTHER.trip", 0,
      "Adds a data set of the same volume with another halo, code bits or normals; up to 7", 1 },
    { "compare", KEY_COMPARE, "COMMAND", 0,
      "Measures another program in the same views, up to 4; requires --source; none leaves out the "
      "ray caster of VTK",
      1 },
    { "list", KEY_LIST, NULL, 0, "Prints the names of all settings, and ends", 1 },
    TRIP_OPTION_NO_SHADING(KEY_NO_SHADING, 1),
    { "settings", KEY_SETTINGS, "PATTERN[,...]", 0,
      "Measures only settings with such names, with the wildcards of a shell: "
      "'post*,pre,quality-*' (default: all)",
      1 },
    { "source", KEY_SOURCE, "VOLUME", 0,
      "Compares with the integral through this volume, from which the data set was made, and "
      "measures the error of storing",
      1 },
    TRIP_OPTION_TF(KEY_TF, 1),
    { NULL, 0, NULL, 0, "Measurement:", 2 },
    { "budget", KEY_BUDGET, "SECONDS", 0,
      "Starts no setting after this time, and lists those left out (default: unlimited)", 2 },
    TRIP_OPTION_MEMORY(KEY_MEMORY, 2),
    { "no-ladder", KEY_NO_LADDER, NULL, 0,
      "Measures only total errors, without the steps that each error consists of; the steps take "
      "most of the time",
      2 },
    { "pictures", KEY_PICTURES, NULL, 0, "Keeps every picture, as OpenEXR", 2 },
    { "repeat", KEY_REPEAT, "N", 0,
      "Sets the timed frames per view and setting, 1 to 1000 (default: 3)", 2 },
    { "samples", KEY_SAMPLES, "N", 0,
      "Draws the integral with N x N rays per pixel, 1 to 16 (default: 1)", 2 },
    { "size", KEY_SIZE, "WxH", 0,
      "Sets the picture size in pixels, 32 to 4096 a side (default: 256x256)", 2 },
    TRIP_OPTION_THREADS(KEY_THREADS, 2),
    { "tolerance", KEY_TOLERANCE, "E", 0,
      "Bounds the error of each component of the integral, 1e-8 to 0.01 (default: 1e-4)", 2 },
    { "views", KEY_VIEWS, "N", 0,
      "Sets the number of views around the object, 1 to 1000: perspective, parallel, from inside "
      "and wide in turns (default: 4)",
      2 },
    { 0 },
};

static int parse_size(const char *text, accuracy_options *o)
{
    int status = trip_option_size("--size", text, &o->width, &o->height);
    if (!status && (o->width < 32 || o->width > 4096 || o->height < 32 || o->height > 4096))
        return trip_option_fail("--size", "takes 32 to 4096 pixels a side");
    return status;
}

static int add_data(const char *path, accuracy_options *o)
{
    if (o->data_count == ACCURACY_DATA_MAX)
        return trip_option_fail("--also",
                                "given too often; at most 7 other data sets are possible");
    o->data[o->data_count++] = path;
    return 0;
}

static int parse_number(int key, char *arg, accuracy_options *o)
{
    int threads = 0, status;
    switch (key) {
    case KEY_VIEWS:
        return trip_option_views(arg, &o->views);
    case KEY_SIZE:
        return parse_size(arg, o);
    case KEY_SAMPLES:
        return trip_option_integer("--samples", arg, 1, 16, &o->samples);
    case KEY_REPEAT:
        return trip_option_repeat(arg, &o->repeat);
    case KEY_TOLERANCE:
        return trip_option_number("--tolerance", arg, 1e-8, 0.01, &o->tolerance);
    case KEY_BUDGET:
        return trip_option_number("--budget", arg, 0, 1e9, &o->budget_seconds);
    case KEY_THREADS:
        status = trip_option_threads(arg, &threads);
        o->threads = (unsigned)threads;
        return status;
    case KEY_MEMORY:
        return trip_option_memory(arg, &o->memory_bytes);
    default:
        return ARGP_ERR_UNKNOWN;
    }
}

static int parse_word(int key, char *arg, accuracy_options *o)
{
    switch (key) {
    case 'o':
        o->output = arg;
        return 0;
    case KEY_SOURCE:
        o->source = arg;
        return 0;
    case KEY_COMPARE:
        if (strcmp(arg, "none") == 0)
            return o->no_programs = true, 0;
        if (o->program_count == ACCURACY_COMPARED_PROGRAMS_MAX)
            return trip_option_fail("--compare",
                                    "given too often; at most 4 programs are possible");
        o->program[o->program_count++] = arg;
        return 0;
    case KEY_TF:
        o->tf = arg;
        return 0;
    case KEY_SETTINGS:
        o->settings = arg;
        return 0;
    case KEY_NO_SHADING:
        o->shading = false;
        return 0;
    case KEY_NO_LADDER:
        o->ladder = false;
        return 0;
    case KEY_PICTURES:
        return o->pictures = true, 0;
    case KEY_FORCE:
        return o->force = true, 0;
    case KEY_QUIET:
        return o->quiet = true, 0;
    case KEY_LIST:
        return o->list = true, 0;
    default:
        return ARGP_ERR_UNKNOWN;
    }
}

/* State of parsing. */
typedef struct parse {
    accuracy_options *o;
    const char *also[ACCURACY_DATA_MAX];
    int also_count;
} parse;

static int check(parse *p)
{
    accuracy_options *o = p->o;
    if (o->list)
        return 0;
    if (!o->data_count)
        return trip_option_fail("NAME.trip",
                                "no data set given; use `triptych accuracy NAME.trip -o REPORT/`");
    int status = 0;
    if (o->no_programs && o->program_count)
        return trip_option_fail("--compare", "none excludes other programs");
    for (int i = 0; i < p->also_count && !status; i++)
        status = add_data(p->also[i], o);
    return status;
}

static error_t parse_key(int key, char *arg, struct argp_state *state)
{
    parse *p = state->input;
    if (key == ARGP_KEY_ARG)
        return p->o->data_count
                   ? trip_option_fail(arg, "only one data set is possible; --also adds others")
                   : add_data(arg, p->o);
    if (key == ARGP_KEY_END)
        return check(p);
    if (key == KEY_ALSO) {
        if (p->also_count == ACCURACY_DATA_MAX - 1)
            return trip_option_fail("--also",
                                    "given too often; at most 7 other data sets are possible");
        p->also[p->also_count++] = arg;
        return 0;
    }
    int status = parse_number(key, arg, p->o);
    return status == ARGP_ERR_UNKNOWN ? parse_word(key, arg, p->o) : status;
}

int accuracy_options_parse(accuracy_options *o, int argc, char **argv)
{
    static const struct argp argp = {
        .options = options,
        .parser = parse_key,
        .args_doc = "NAME.trip",
        .doc = "Measures the time and the error of every setting that trades accuracy for time, on "
               "one data set. The error is the difference from the emission-absorption integral. "
               "Writes a report: JSON, CSV and a page. `triptych render --error` reads it.",
    };
    *o = (accuracy_options){ .width = 256,
                             .height = 256,
                             .views = 4,
                             .repeat = 3,
                             .samples = 1,
                             .tolerance = 1e-4,
                             .budget_seconds = 1e9,
                             .shading = true,
                             .ladder = true };
    parse p = { .o = o };
    return trip_options_parse(&argp, argc, argv, &p);
}
