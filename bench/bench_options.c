#include "bench_options.h"

#include <stdio.h>
#include <string.h>

#include "options.h"
#include "report.h"

enum {
    KEY_TF = 256,
    KEY_SIZE,
    KEY_RENDERER,
    KEY_THREADS,
    KEY_REPEAT,
    KEY_VIEWS,
    KEY_NO_SHADING,
    KEY_KERNEL_RADIUS,
    KEY_OCCLUDED,
    KEY_ENGINE,
    KEY_MEMORY,
    KEY_NO_COUNTS,
    KEY_CLASSIFY,
    KEY_COMPOSITING,
    KEY_SAMPLES_PER_SHEET,
    KEY_EARLY_TERMINATION,
    KEY_FIELD,
    KEY_FINEST,
    KEY_PLOT,
    KEY_SECONDS,
    KEY_FPS,
    KEY_JSON,
};

#define BIT(key) (1u << ((key)-KEY_TF))
#define OF_MODEL                                                                                   \
    (BIT(KEY_CLASSIFY) | BIT(KEY_COMPOSITING) | BIT(KEY_SAMPLES_PER_SHEET) |                       \
     BIT(KEY_EARLY_TERMINATION))
#define OF_FLIGHT (BIT(KEY_SECONDS) | BIT(KEY_FPS))
#define OF_LEVELS (BIT(KEY_FIELD) | BIT(KEY_FINEST))

static const struct argp_option options[] = {
    { "json", KEY_JSON, NULL, 0, "Prints JSON", 0 },
    TRIP_OPTION_MEMORY(KEY_MEMORY, 0),
    TRIP_OPTION_NO_SHADING(KEY_NO_SHADING, 0),
    { "renderer", KEY_RENDERER, "NAME[,...]", 0,
      "Selects the renderers: gl, cpu, reference or auto (default: auto; renderers: all available; "
      "popping, levels and ewa: cpu); submit is always gl, variants always reference",
      0 },
    { "repeat", KEY_REPEAT, "N", 0,
      "Sets the number of runs, 1 to 1000; a figure is their median (default: 5; renderers: 1)",
      0 },
    { "size", KEY_SIZE, "WxH[,...]", 0,
      "Sets the picture sizes in pixels (default: 512x512; renderers: 512x512,1024x1024; stream: "
      "1024x1024; popping and levels: 256x256; variants: 128x128; flight: 800x600)",
      0 },
    TRIP_OPTION_TF(KEY_TF, 0),
    { "threads", KEY_THREADS, "N[,...]", 0,
      "Sets the numbers of threads that draw and read, 1 to 256 (default: one per processor)", 0 },
    { NULL, 0, NULL, 0, "Options of some tables:", 1 },
    { "classify", KEY_CLASSIFY, "pre|post", 0,
      "Selects the classification, as in `triptych render` (default: pre); renderers, stream, "
      "popping and levels only",
      1 },
    { "early-termination", KEY_EARLY_TERMINATION, "T", 0,
      "Sets the transmittance below which a pixel stops, 0 to 0.1 (default: post 1/512, pre "
      "1/8192); renderers, stream, popping and levels only",
      1 },
    { "saturation", 0, NULL, OPTION_ALIAS | OPTION_HIDDEN, NULL, 1 },
    { "engine", KEY_ENGINE, "NAME", 0,
      "Selects how files are read: io_uring, pread or auto (default: auto); stream and flight only",
      1 },
    { "no-counts", KEY_NO_COUNTS, NULL, 0,
      "Measures only times, and does not count splats and pixels; renderers only", 1 },
    { "occluded", KEY_OCCLUDED, "skip|draw", 0,
      "Selects whether cpu reads bricks behind opaque ones (default: renderers skip, stream draw); "
      "renderers and stream only",
      1 },
    { "plot", KEY_PLOT, "FILE", 0,
      "Draws the table into an .svg file; popping, and levels without a data set, only", 1 },
    { "samples-per-sheet", KEY_SAMPLES_PER_SHEET, "N", 0,
      "Sets the samples per sheet of post, 1 to 16 (default: automatic); renderers, stream, "
      "popping and levels only",
      1 },
    { "slices", 0, NULL, OPTION_ALIAS | OPTION_HIDDEN, NULL, 1 },
    { "views", KEY_VIEWS, "N", 0,
      "Sets the number of views around the object, 1 to 1000 (default: 20; levels: 3); renderers "
      "and levels only",
      1 },
    { NULL, 0, NULL, 0, "levels without a data set:", 2 },
    { "field", KEY_FIELD, "NAME", 0,
      "Selects the object: marschner-lobb, cloud, shells or filaments (default: shells)", 2 },
    { "finest", KEY_FINEST, "N", 0,
      "Sets the largest number of voxels along each axis: 128, 256, 512 or 1024 (default: 512)",
      2 },
    { NULL, 0, NULL, 0, "flight:", 3 },
    { "fps", KEY_FPS, "N", 0,
      "Sets the target frames per second, 1 to 1000, as in `triptych view` (default: 30)", 3 },
    { "seconds", KEY_SECONDS, "N", 0,
      "Sets how long the eye moves, 0.1 to 600 seconds (default: 12)", 3 },
    { NULL, 0, NULL, 0, "Variants of the papers:", 4 },
    { "compositing", KEY_COMPOSITING, "splat|sheet", 0,
      "Selects the unit of compositing of pre, as in `triptych render` (default: splat); "
      "renderers, stream, "
      "popping and levels only",
      4 },
    { "kernel-radius", KEY_KERNEL_RADIUS, "VOXELS", 0,
      "Sets the radius of a splat, 0.1 to 100 (default: 2); not for flight", 4 },
    { 0 },
};

static const struct table {
    const char *name;
    unsigned refused; /* options that this table refuses */
    bool lists;       /* accepts several sizes, renderers and thread counts */
    int repeat;
    int views; /* 0 selects 20 */
    bool draw_occluded;
    int sizes[2][2], size_count;
    trip_renderer_kind renderers[3];
    int renderer_count;
} tables[] = {
    {
        .name = "orders",
        .refused = OF_FLIGHT | OF_LEVELS | BIT(KEY_PLOT) | OF_MODEL | BIT(KEY_VIEWS) |
                   BIT(KEY_NO_COUNTS) | BIT(KEY_ENGINE) | BIT(KEY_OCCLUDED),
        .draw_occluded = true,
        .repeat = 5,
        .sizes = { { 512, 512 } },
        .size_count = 1,
        .renderers = { TRIP_RENDERER_AUTO },
        .renderer_count = 1,
    },
    {
        .name = "submit",
        .refused = OF_FLIGHT | OF_LEVELS | BIT(KEY_PLOT) | OF_MODEL | BIT(KEY_VIEWS) |
                   BIT(KEY_NO_COUNTS) | BIT(KEY_ENGINE) | BIT(KEY_OCCLUDED) | BIT(KEY_RENDERER) |
                   BIT(KEY_THREADS),
        .draw_occluded = true,
        .repeat = 5,
        .sizes = { { 512, 512 } },
        .size_count = 1,
        .renderers = { TRIP_RENDERER_GL },
        .renderer_count = 1,
    },
    {
        .name = "stream",
        .refused = OF_FLIGHT | OF_LEVELS | BIT(KEY_PLOT) | BIT(KEY_VIEWS) | BIT(KEY_NO_COUNTS),
        .draw_occluded = true,
        .repeat = 5,
        .sizes = { { 1024, 1024 } },
        .size_count = 1,
        .renderers = { TRIP_RENDERER_AUTO },
        .renderer_count = 1,
    },
    {
        .name = "renderers",
        .refused = OF_FLIGHT | OF_LEVELS | BIT(KEY_PLOT) | BIT(KEY_ENGINE),
        .lists = true,
        .repeat = 1,
        .sizes = { { 512, 512 }, { 1024, 1024 } },
        .size_count = 2,
        .renderers = { TRIP_RENDERER_CPU, TRIP_RENDERER_GL, TRIP_RENDERER_REFERENCE },
        .renderer_count = 3,
    },
    {
        .name = "popping",
        .refused = OF_FLIGHT | OF_LEVELS | BIT(KEY_ENGINE) | BIT(KEY_OCCLUDED) |
                   BIT(KEY_NO_COUNTS) | BIT(KEY_VIEWS) | BIT(KEY_REPEAT),
        .draw_occluded = true,
        .repeat = 1,
        .sizes = { { 256, 256 } },
        .size_count = 1,
        .renderers = { TRIP_RENDERER_CPU },
        .renderer_count = 1,
    },
    {
        .name = "levels",
        .refused = OF_FLIGHT | BIT(KEY_ENGINE) | BIT(KEY_OCCLUDED) | BIT(KEY_NO_COUNTS),
        .repeat = 5,
        .views = 3,
        .sizes = { { 256, 256 } },
        .size_count = 1,
        .renderers = { TRIP_RENDERER_CPU },
        .renderer_count = 1,
    },
    {
        .name = "flight",
        .refused = OF_LEVELS | BIT(KEY_PLOT) | OF_MODEL | BIT(KEY_VIEWS) | BIT(KEY_REPEAT) |
                   BIT(KEY_NO_COUNTS) | BIT(KEY_OCCLUDED) | BIT(KEY_NO_SHADING) |
                   BIT(KEY_KERNEL_RADIUS),
        .repeat = 1,
        .sizes = { { 800, 600 } },
        .size_count = 1,
        .renderers = { TRIP_RENDERER_AUTO },
        .renderer_count = 1,
    },
    {
        .name = "variants",
        .refused = OF_FLIGHT | OF_LEVELS | BIT(KEY_PLOT) | OF_MODEL | BIT(KEY_VIEWS) |
                   BIT(KEY_NO_COUNTS) | BIT(KEY_ENGINE) | BIT(KEY_OCCLUDED) | BIT(KEY_RENDERER) |
                   BIT(KEY_THREADS) | BIT(KEY_REPEAT),
        .draw_occluded = true,
        .repeat = 1,
        .sizes = { { 128, 128 } },
        .size_count = 1,
        .renderers = { TRIP_RENDERER_REFERENCE },
        .renderer_count = 1,
    },
    {
        .name = "ewa",
        .refused = OF_FLIGHT | BIT(KEY_PLOT) | OF_LEVELS | OF_MODEL | BIT(KEY_ENGINE) |
                   BIT(KEY_OCCLUDED) | BIT(KEY_NO_COUNTS) | BIT(KEY_VIEWS),
        .repeat = 5,
        .sizes = { { 512, 512 } },
        .size_count = 1,
        .renderers = { TRIP_RENDERER_CPU },
        .renderer_count = 1,
    },
};

/* State of parsing: the options that were given, for the check against the table. */
typedef struct parse {
    bench_options *o;
    unsigned given;
} parse;

/* Calls `one` with each item of a list joined by commas. */
static int parse_list(const char *option, const char *text, bench_options *o, int *count,
                      int (*one)(const char *, bench_options *, int))
{
    int status = 0;
    *count = 0;
    for (const char *rest = text; rest && !status;) {
        char item[64];
        const char *comma = strchr(rest, ',');
        size_t length = comma ? (size_t)(comma - rest) : strlen(rest);
        if (*count == BENCH_LIST_MAX || length >= sizeof item)
            return trip_fail(TRIP_USAGE, "usage", option,
                             "\"%s\" has too many items, or an item that is too long", text);
        memcpy(item, rest, length);
        item[length] = 0;
        status = one(item, o, (*count)++);
        rest = comma ? comma + 1 : NULL;
    }
    return status;
}

static int parse_size(const char *text, bench_options *o, int i)
{
    return trip_option_size("--size", text, &o->sizes[i][0], &o->sizes[i][1]);
}

static int parse_renderer(const char *text, bench_options *o, int i)
{
    int which = 0, status = trip_option_renderer(text, 4, &which);
    o->renderers[i] = (trip_renderer_kind)which;
    return status;
}

static int parse_threads(const char *text, bench_options *o, int i)
{
    return trip_option_threads(text, &o->threads[i]);
}

static int parse_engine(const char *text, bench_options *o)
{
    int which = 0, status = trip_option_engine(text, 3, &which);
    o->engine = (trip_engine)which;
    return status;
}

static int parse_occluded(const char *text, bench_options *o)
{
    static const char *const names[] = { "skip", "draw", NULL };
    int which = 0, status = trip_option_choice("--occluded", text, names, &which);
    o->draw_occluded = which == 1;
    return status;
}

static int parse_classify(const char *text, bench_options *o)
{
    int which = 0, status = trip_option_classify(text, 2, &which);
    o->settings.classify = which ? TRIP_CLASSIFY_POST : TRIP_CLASSIFY_PRE;
    return status;
}

static int parse_compositing(const char *text, bench_options *o)
{
    static const char *const names[] = { "splat", "sheet", NULL };
    int which = 0, status = trip_option_choice("--compositing", text, names, &which);
    o->settings.compositing = (trip_compositing)which;
    return status;
}

static int parse_field(const char *text, bench_options *o)
{
    static const char *const names[] = { "marschner-lobb", "cloud", "shells", "filaments", NULL };
    int which = 0, status = trip_option_choice("--field", text, names, &which);
    o->field = names[which];
    return status;
}

static int parse_finest(const char *text, bench_options *o)
{
    static const char *const names[] = { "128", "256", "512", "1024", NULL };
    int which = 0, status = trip_option_choice("--finest", text, names, &which);
    o->finest = 128 << which;
    return status;
}

static int parse_option(int key, char *arg, bench_options *o)
{
    switch (key) {
    case KEY_TF:
        o->tf = arg;
        return 0;
    case KEY_SIZE:
        return parse_list("--size", arg, o, &o->size_count, parse_size);
    case KEY_RENDERER:
        return parse_list("--renderer", arg, o, &o->renderer_count, parse_renderer);
    case KEY_THREADS:
        return parse_list("--threads", arg, o, &o->thread_count, parse_threads);
    case KEY_REPEAT:
        return trip_option_repeat(arg, &o->repeat);
    case KEY_VIEWS:
        return trip_option_views(arg, &o->views);
    case KEY_NO_SHADING:
        o->settings.shading = false;
        return 0;
    case KEY_KERNEL_RADIUS:
        return trip_option_number("--kernel-radius", arg, 0.1, 100, &o->settings.kernel_radius);
    case KEY_OCCLUDED:
        return parse_occluded(arg, o);
    case KEY_ENGINE:
        return parse_engine(arg, o);
    case KEY_MEMORY:
        return trip_option_memory(arg, &o->memory_bytes);
    case KEY_NO_COUNTS:
        o->no_counts = true;
        return 0;
    case KEY_CLASSIFY:
        return parse_classify(arg, o);
    case KEY_COMPOSITING:
        return parse_compositing(arg, o);
    case KEY_SAMPLES_PER_SHEET:
        return trip_option_integer("--samples-per-sheet", arg, 1, TRIP_SHEET_SAMPLES_MAX,
                                   &o->settings.samples_per_sheet);
    case KEY_EARLY_TERMINATION:
        return trip_option_number("--early-termination", arg, 0, TRIP_EARLY_TERMINATION_MAX,
                                  &o->settings.early_termination);
    case KEY_FIELD:
        return parse_field(arg, o);
    case KEY_FINEST:
        return parse_finest(arg, o);
    case KEY_PLOT:
        o->plot = arg;
        return 0;
    case KEY_SECONDS:
        return trip_option_number("--seconds", arg, 0.1, 600, &o->seconds);
    case KEY_FPS:
        return trip_option_number("--fps", arg, 1, 1000, &o->frames_per_second);
    case KEY_JSON:
        o->json = true;
        return 0;
    default:
        return ARGP_ERR_UNKNOWN;
    }
}

static void fill_defaults(bench_options *o, const struct table *t)
{
    if (!o->views)
        o->views = t->views ? t->views : 20;
    if (!o->repeat)
        o->repeat = t->repeat;
    if (!o->size_count)
        for (int i = 0; i < t->size_count; i++, o->size_count++)
            memcpy(o->sizes[i], t->sizes[i], sizeof o->sizes[i]);
    if (!o->renderer_count)
        for (int i = 0; i < t->renderer_count; i++, o->renderer_count++)
            o->renderers[i] = t->renderers[i];
    if (!o->thread_count)
        o->thread_count = 1;
}

/* Only cpu can skip occluded bricks. Selects it if --renderer is auto, and fails if no renderer
 * can. */
static int check_occluded(bench_options *o, const struct table *t)
{
    int able = 0;
    for (int i = 0; i < o->renderer_count; i++) {
        if (o->renderers[i] == TRIP_RENDERER_AUTO && !t->lists)
            o->renderers[i] = TRIP_RENDERER_CPU;
        able += o->renderers[i] == TRIP_RENDERER_CPU || o->renderers[i] == TRIP_RENDERER_AUTO;
    }
    return able ? 0 : trip_option_fail("--occluded", "skip requires --renderer cpu");
}

/* Without a table, selects a short run of the table renderers. */
static void be_short(parse *p)
{
    bench_options *o = p->o;
    o->table = "renderers";
    o->in_short = true;
    if (!o->size_count)
        o->sizes[o->size_count++][0] = o->sizes[0][1] = 512;
    if (!o->renderer_count) {
        o->renderers[o->renderer_count++] = TRIP_RENDERER_CPU;
        o->renderers[o->renderer_count++] = TRIP_RENDERER_GL;
    }
    if (!(p->given & BIT(KEY_VIEWS)))
        o->views = 5;
}

static int check(parse *p)
{
    static const char *const names[] = { "orders", "submit", "stream",   "renderers", "popping",
                                         "levels", "flight", "variants", "ewa",       NULL };
    bench_options *o = p->o;
    int which;
    if (!o->table)
        be_short(p);
    int status = trip_option_choice("TABLE", o->table, names, &which);
    if (status)
        return status;
    const struct table *t = &tables[which];
    for (size_t i = 0; i < sizeof options / sizeof *options; i++)
        if (options[i].key && p->given & t->refused & BIT(options[i].key))
            return trip_fail(TRIP_USAGE, "usage", t->name, "--%s does not apply to this table",
                             options[i].name);
    if (o->input && !strcmp(t->name, "levels") && p->given & (OF_LEVELS | BIT(KEY_PLOT)))
        return trip_option_fail("--field, --finest, --plot", "apply only without a data set");
    if (!(p->given & BIT(KEY_OCCLUDED)))
        o->draw_occluded = t->draw_occluded;
    fill_defaults(o, t);
    if (!t->lists && (o->size_count > 1 || o->renderer_count > 1 || o->thread_count > 1))
        return trip_fail(TRIP_USAGE, "usage", t->name,
                         "takes one size, one renderer and one number of threads");
    return p->given & BIT(KEY_OCCLUDED) && !o->draw_occluded ? check_occluded(o, t) : 0;
}

static error_t parse_key(int key, char *arg, struct argp_state *state)
{
    parse *p = state->input;
    if (key == ARGP_KEY_ARG && !p->o->table) {
        p->o->table = arg;
        return 0;
    }
    if (key == ARGP_KEY_ARG) {
        if (p->o->input)
            return trip_option_fail(arg, "only one data set is possible at a time");
        p->o->input = arg;
        return 0;
    }
    if (key == ARGP_KEY_END)
        return check(p);
    int status = parse_option(key, arg, p->o);
    if (key >= KEY_TF && key <= KEY_JSON)
        p->given |= BIT(key);
    return status;
}

int bench_options_parse(bench_options *o, int argc, char **argv)
{
    static const struct argp argp = {
        .options = options,
        .parser = parse_key,
        .args_doc = "[TABLE [NAME.trip]]",
        .doc = "Measures how fast this machine draws a data set, and prints a table:\n" BENCH_TABLES
               "\vWithout NAME.trip, bench measures the included tooth. Without TABLE it measures "
               "the renderers cpu and gl, in less than a minute. Compared settings take turns, so "
               "that other load slows all of them.",
    };
    *o = (bench_options){ .field = "shells",
                          .finest = 512,
                          .seconds = 12,
                          .frames_per_second = 30,
                          .settings = trip_settings_default() };
    o->settings.samples_per_sheet = 0;
    parse p = { .o = o };
    return trip_options_parse(&argp, argc, argv, &p);
}
