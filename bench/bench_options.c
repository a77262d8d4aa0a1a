#include "bench_options.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "command_line.h"
#include "draw_settings.h"
#include "report.h"

/* Calls `one` with each item of a list joined by commas. */
static int read_list(const char *option, const char *text, bench_options *o, int *count,
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

static int add_size(const char *text, bench_options *o, int i)
{
    return trip_option_size("--size", text, &o->sizes[i][0], &o->sizes[i][1]);
}

static int add_renderer(const char *text, bench_options *o, int i)
{
    static const char *const names[] = { "auto", "gl", "cpu", "reference", NULL };
    int which = 0, status = trip_option_choice("--renderer", text, names, &which);
    o->renderers[i] = (trip_renderer_kind)which;
    return status;
}

static int add_threads(const char *text, bench_options *o, int i)
{
    return trip_option_integer("--threads", text, 1, 256, &o->threads[i]);
}

static int read_sizes(const trip_option *row, const char *text, void *base)
{
    bench_options *o = base;
    (void)row;
    return read_list("--size", text, o, &o->size_count, add_size);
}

static int read_renderers(const trip_option *row, const char *text, void *base)
{
    bench_options *o = base;
    (void)row;
    return read_list("--renderer", text, o, &o->renderer_count, add_renderer);
}

static int read_threads(const trip_option *row, const char *text, void *base)
{
    bench_options *o = base;
    (void)row;
    return read_list("--threads", text, o, &o->thread_count, add_threads);
}

static int read_no_shading(const trip_option *row, const char *text, void *base)
{
    (void)row, (void)text;
    ((bench_options *)base)->settings.shading = false;
    return 0;
}

static const char *const fields[] = { "marschner-lobb", "cloud", "shells", "filaments", NULL };

static int read_culling(const trip_option *row, const char *text, void *base)
{
    static const char *const names[] = { "reach", "two-points", NULL };
    int which = 0, status = trip_option_choice("--culling", text, names, &which);
    (void)row;
    ((bench_options *)base)->settings.two_point_culling = which == 1;
    return status;
}

static int read_field(const trip_option *row, const char *text, void *base)
{
    int which = 0, status = trip_option_choice("--field", text, fields, &which);
    (void)row;
    ((bench_options *)base)->field = fields[which];
    return status;
}

static int read_finest(const trip_option *row, const char *text, void *base)
{
    static const char *const names[] = { "128", "256", "512", "1024", NULL };
    int which = 0, status = trip_option_choice("--finest", text, names, &which);
    (void)row;
    ((bench_options *)base)->finest = 128 << which;
    return status;
}

/* The rows of the table of options. */
enum {
    JSON,
    MEMORY,
    NO_SHADING,
    RENDERER,
    REPEAT,
    SIZE,
    TF,
    THREADS,
    CLASSIFY,
    EARLY_TERMINATION,
    ENGINE,
    NO_COUNTS,
    OCCLUDED,
    PLOT,
    SAMPLES_PER_SHEET,
    VIEWS,
    FIELD,
    FINEST,
    FPS,
    SECONDS,
    COMPOSITING,
    CULLING,
    KERNEL_RADIUS,
    ROWS
};

static const char *const classifies[] = { "auto", "pre", "post", NULL };
static const char *const engines[] = { "auto", "io_uring", "pread", NULL };
static const char *const occluded[] = { "skip", "draw", NULL };
static const char *const compositings[] = { "splat", "sheet", NULL };

/* The names are in the order of the renderers' values. */
_Static_assert(TRIP_COMPOSITING_SPLAT == 0 && TRIP_COMPOSITING_SHEET == 1, "compositings");
_Static_assert(TRIP_ENGINE_AUTO == 0 && TRIP_ENGINE_PREAD == 2, "engines");

#define AT(member) .at = offsetof(bench_options, member)
#define CUSTOM(function) .type = TRIP_OPTION_CUSTOM, .read = (function)
#define CHOICE(names) .type = TRIP_OPTION_CHOICE, .choices = (names)
#define FLAG .type = TRIP_OPTION_FLAG
#define TABLES .group = DRAW_GROUP_TABLES

static const trip_option rows[ROWS] = {
    [JSON] = { "json", NULL, "Prints JSON", FLAG, AT(json) },
    [MEMORY] = { "memory", "SIZE", "Limits the memory for data, for example 256M (MiB) or 2G (GiB)",
                 "a quarter of the memory that the process may use", .type = TRIP_OPTION_BYTES_64,
                 AT(memory_bytes) },
    [NO_SHADING] = { "no-shading", NULL,
                     "Draws the plain colours of the transfer function, and reads no normals",
                     .type = TRIP_OPTION_CUSTOM, .read = read_no_shading },
    [RENDERER] = { "renderer", "NAME[,...]", "Selects the renderers: gl, cpu, reference or auto",
                   "auto; renderers: all available; popping, levels and ewa: cpu",
                   "submit is always gl, variants always reference", CUSTOM(read_renderers) },
    [REPEAT] = { "repeat", "N", "Sets the number of runs; a figure is their median",
                 "5; renderers: 1", .type = TRIP_OPTION_INTEGER, AT(repeat), .lo = 1, .hi = 1000 },
    [SIZE] = { "size", "WxH|N[,...]", "Sets the picture sizes in pixels",
               "512x512; renderers: 512x512,1024x1024; stream: 1024x1024; popping and levels: "
               "256x256; variants: 128x128; flight: 800x600",
               CUSTOM(read_sizes) },
    [TF] = { "tf", "NAME|FILE", "Selects the transfer function, a preset or a file",
             "the one in the data set", .type = TRIP_OPTION_TEXT, AT(tf) },
    [THREADS] = { "threads", "N[,...]", "Sets the numbers of threads that draw and read, 1 to 256",
                  "one per processor", CUSTOM(read_threads) },
    [CLASSIFY] = { "classify", "auto|pre|post",
                   "Selects the classification, as in `triptych render`", "auto",
                   "renderers, stream, popping and levels only", TABLES, AT(classify),
                   CHOICE(classifies) },
    [EARLY_TERMINATION] = { "early-termination", "T",
                            "Sets the transmittance below which a pixel stops",
                            "post 1/512, pre 1/8192", "renderers, stream, popping and levels only",
                            "saturation", TABLES, .type = TRIP_OPTION_NUMBER,
                            AT(settings.early_termination), .lo = 0,
                            .hi = TRIP_EARLY_TERMINATION_MAX },
    [ENGINE] = { "engine", "NAME", "Selects how files are read: io_uring, pread or auto", "auto",
                 "stream and flight only", TABLES, AT(engine), CHOICE(engines) },
    [NO_COUNTS] = { "no-counts", NULL, "Measures only times, and does not count splats and pixels",
                    NULL, "renderers only", TABLES, FLAG, AT(no_counts) },
    [OCCLUDED] = { "occluded", "skip|draw", "Selects whether cpu reads bricks behind opaque ones",
                   "renderers skip, stream draw", "renderers and stream only", TABLES,
                   AT(draw_occluded), CHOICE(occluded) },
    [PLOT] = { "plot", "FILE", "Draws the table into an .svg file", NULL,
               "popping, and levels without a data set, only", TABLES, .type = TRIP_OPTION_TEXT,
               AT(plot) },
    [SAMPLES_PER_SHEET] = { "samples-per-sheet", "N", "Sets the samples per sheet of post",
                            "automatic", "renderers, stream, popping and levels only", "slices",
                            TABLES, .type = TRIP_OPTION_INTEGER, AT(settings.samples_per_sheet),
                            .lo = 1, .hi = TRIP_SHEET_SAMPLES_MAX },
    [VIEWS] = { "views", "N", "Sets the number of views around the object", "20; levels: 3",
                "renderers and levels only", TABLES, .type = TRIP_OPTION_INTEGER, AT(views),
                .lo = 1, .hi = 1000 },
    [FIELD] = { "field", "NAME", "Selects the object: marschner-lobb, cloud, shells or filaments",
                "shells", .group = DRAW_GROUP_LEVELS, CUSTOM(read_field) },
    [FINEST] = { "finest", "N",
                 "Sets the largest number of voxels along each axis: 128, 256, 512 or 1024", "512",
                 .group = DRAW_GROUP_LEVELS, CUSTOM(read_finest) },
    [FPS] = { "fps", "N", "Sets the target frames per second, as in `triptych view`", "30",
              .group = DRAW_GROUP_FLIGHT, .type = TRIP_OPTION_NUMBER, AT(frames_per_second),
              .lo = 1, .hi = 1000 },
    [SECONDS] = { "seconds", "N", "Sets how long the eye moves", "12", .group = DRAW_GROUP_FLIGHT,
                  .type = TRIP_OPTION_NUMBER, AT(seconds), .lo = 0.1, .hi = 600 },
    [COMPOSITING] = { "compositing", "splat|sheet",
                      "Selects the unit of compositing of pre, as in `triptych render`", "splat",
                      "renderers, stream, popping and levels only", .group = DRAW_GROUP_PAPERS,
                      AT(settings.compositing), CHOICE(compositings) },
    [CULLING] = { "culling", "reach|two-points",
                  "Selects how splats without weight are culled: by the reach of each, which loses "
                  "none, or by the weights of two points, as in 2008",
                  "reach", "submit only", .group = DRAW_GROUP_PAPERS, CUSTOM(read_culling) },
    [KERNEL_RADIUS] = { "kernel-radius", "VOXELS", "Sets the radius of a splat", "2",
                        "not for flight", .group = DRAW_GROUP_PAPERS, .type = TRIP_OPTION_NUMBER,
                        AT(settings.kernel_radius), .lo = 0.1, .hi = 100 },
};

static const trip_option_table bench_table = { rows, ROWS };

#define BIT(row) (UINT64_C(1) << (row))
#define OF_MODEL                                                                                   \
    (BIT(CLASSIFY) | BIT(COMPOSITING) | BIT(SAMPLES_PER_SHEET) | BIT(EARLY_TERMINATION))
#define OF_FLIGHT (BIT(SECONDS) | BIT(FPS))
/* These options change the drawing. The renderers, sizes and threads only add rows. */
#define OF_DRAWING (OF_MODEL | BIT(NO_SHADING) | BIT(OCCLUDED) | BIT(KERNEL_RADIUS))
#define OF_LEVELS (BIT(FIELD) | BIT(FINEST))

static const struct table {
    const char *name;
    uint64_t refused; /* options that this table refuses */
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
        .refused = OF_FLIGHT | OF_LEVELS | BIT(PLOT) | OF_MODEL | BIT(VIEWS) | BIT(NO_COUNTS) |
                   BIT(ENGINE) | BIT(OCCLUDED),
        .draw_occluded = true,
        .repeat = 5,
        .sizes = { { 512, 512 } },
        .size_count = 1,
        .renderers = { TRIP_RENDERER_AUTO },
        .renderer_count = 1,
    },
    {
        .name = "submit",
        .refused = OF_FLIGHT | OF_LEVELS | BIT(PLOT) | OF_MODEL | BIT(VIEWS) | BIT(NO_COUNTS) |
                   BIT(ENGINE) | BIT(OCCLUDED) | BIT(RENDERER) | BIT(THREADS),
        .draw_occluded = true,
        .repeat = 5,
        .sizes = { { 512, 512 } },
        .size_count = 1,
        .renderers = { TRIP_RENDERER_GL },
        .renderer_count = 1,
    },
    {
        .name = "stream",
        .refused = OF_FLIGHT | OF_LEVELS | BIT(PLOT) | BIT(VIEWS) | BIT(NO_COUNTS),
        .draw_occluded = true,
        .repeat = 5,
        .sizes = { { 1024, 1024 } },
        .size_count = 1,
        .renderers = { TRIP_RENDERER_AUTO },
        .renderer_count = 1,
    },
    {
        .name = "renderers",
        .refused = OF_FLIGHT | OF_LEVELS | BIT(PLOT) | BIT(ENGINE),
        .lists = true,
        .repeat = 1,
        .sizes = { { 512, 512 }, { 1024, 1024 } },
        .size_count = 2,
        .renderers = { TRIP_RENDERER_CPU, TRIP_RENDERER_GL, TRIP_RENDERER_REFERENCE },
        .renderer_count = 3,
    },
    {
        .name = "popping",
        .refused = OF_FLIGHT | OF_LEVELS | BIT(ENGINE) | BIT(OCCLUDED) | BIT(NO_COUNTS) |
                   BIT(VIEWS) | BIT(REPEAT),
        .draw_occluded = true,
        .repeat = 1,
        .sizes = { { 256, 256 } },
        .size_count = 1,
        .renderers = { TRIP_RENDERER_CPU },
        .renderer_count = 1,
    },
    {
        .name = "levels",
        .refused = OF_FLIGHT | BIT(ENGINE) | BIT(OCCLUDED) | BIT(NO_COUNTS),
        .repeat = 5,
        .views = 3,
        .sizes = { { 256, 256 } },
        .size_count = 1,
        .renderers = { TRIP_RENDERER_CPU },
        .renderer_count = 1,
    },
    {
        .name = "flight",
        .refused = OF_LEVELS | BIT(PLOT) | OF_MODEL | BIT(VIEWS) | BIT(REPEAT) | BIT(NO_COUNTS) |
                   BIT(OCCLUDED) | BIT(NO_SHADING) | BIT(KERNEL_RADIUS),
        .repeat = 1,
        .sizes = { { 800, 600 } },
        .size_count = 1,
        .renderers = { TRIP_RENDERER_AUTO },
        .renderer_count = 1,
    },
    {
        .name = "variants",
        .refused = OF_FLIGHT | OF_LEVELS | BIT(PLOT) | OF_MODEL | BIT(VIEWS) | BIT(NO_COUNTS) |
                   BIT(ENGINE) | BIT(OCCLUDED) | BIT(RENDERER) | BIT(THREADS) | BIT(REPEAT),
        .draw_occluded = true,
        .repeat = 1,
        .sizes = { { 128, 128 } },
        .size_count = 1,
        .renderers = { TRIP_RENDERER_REFERENCE },
        .renderer_count = 1,
    },
    {
        .name = "ewa",
        .refused = OF_FLIGHT | BIT(PLOT) | OF_LEVELS | OF_MODEL | BIT(ENGINE) | BIT(OCCLUDED) |
                   BIT(NO_COUNTS) | BIT(VIEWS),
        .repeat = 5,
        .sizes = { { 512, 512 } },
        .size_count = 1,
        .renderers = { TRIP_RENDERER_CPU },
        .renderer_count = 1,
    },
    {
        .name = "surfels",
        .refused = OF_FLIGHT | BIT(PLOT) | OF_LEVELS | OF_DRAWING | BIT(ENGINE) | BIT(NO_COUNTS) |
                   BIT(VIEWS) | BIT(RENDERER) | BIT(TF),
        .repeat = 3,
        .sizes = { { 512, 512 } },
        .size_count = 1,
        .renderers = { TRIP_RENDERER_CPU },
        .renderer_count = 1,
    },
};

/* State of parsing: the options that were given, for the check against the table. */
typedef struct parse {
    bench_options *o;
    option_set set;
} parse;

static uint64_t given(const parse *p)
{
    return p->set.given;
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
    if (!(given(p) & BIT(VIEWS)))
        o->views = 3;
}

static int check(void *user)
{
    parse *p = user;
    static const char *const names[] = { "orders",  "submit",  "stream", "renderers",
                                         "popping", "levels",  "flight", "variants",
                                         "ewa",     "surfels", NULL };
    bench_options *o = p->o;
    int which;
    if (!o->table)
        be_short(p);
    int status = trip_option_choice("TABLE", o->table, names, &which);
    if (status)
        return status;
    const struct table *t = &tables[which];
    const uint64_t refused = t->refused | (strcmp(t->name, "submit") ? BIT(CULLING) : 0);
    for (int i = 0; i < ROWS; i++)
        if (given(p) & refused & UINT64_C(1) << i)
            return trip_fail(TRIP_USAGE, "usage", t->name, "--%s does not apply to this table",
                             rows[i].name);
    if (o->input && !strcmp(t->name, "levels") && given(p) & (OF_LEVELS | BIT(PLOT)))
        return trip_option_fail("--field, --finest, --plot", "apply only without a data set");
    if (!(given(p) & BIT(OCCLUDED)))
        o->draw_occluded = t->draw_occluded;
    o->usual = !(given(p) & OF_DRAWING);
    o->chosen = given(p) & BIT(RENDERER);
    if (t->refused & BIT(CLASSIFY) || given(p) & (BIT(COMPOSITING) | BIT(KERNEL_RADIUS)))
        o->classify = o->classify ? o->classify : BENCH_CLASSIFY_PRE;
    fill_defaults(o, t);
    if (!t->lists && (o->size_count > 1 || o->renderer_count > 1 || o->thread_count > 1))
        return trip_fail(TRIP_USAGE, "usage", t->name,
                         "takes one size, one renderer and one number of threads");
    return given(p) & BIT(OCCLUDED) && !o->draw_occluded ? check_occluded(o, t) : 0;
}

static int add_word(void *user, char *word)
{
    bench_options *o = ((parse *)user)->o;
    if (!o->table) {
        o->table = word;
        return 0;
    }
    if (o->input)
        return trip_option_fail(word, "only one data set is possible at a time");
    o->input = word;
    return 0;
}

void bench_options_choose(bench_options *o, bool needs_splats)
{
    if (o->classify == BENCH_CLASSIFY_AUTO)
        o->classify = needs_splats ? BENCH_CLASSIFY_PRE : BENCH_CLASSIFY_POST;
    o->settings.classify =
        o->classify == BENCH_CLASSIFY_POST ? TRIP_CLASSIFY_POST : TRIP_CLASSIFY_PRE;
}

void bench_options_write(const bench_options *o, char *text, size_t bytes)
{
    static const char *const renderers[] = { "auto", "gl", "cpu", "reference" };
    const trip_settings *s = &o->settings;
    char *buffer = NULL;
    size_t length;
    FILE *f = open_memstream(&buffer, &length);
    if (!f)
        return;
    fprintf(f, "--classify %s", s->classify == TRIP_CLASSIFY_POST ? "post" : "pre");
    if (s->classify == TRIP_CLASSIFY_PRE)
        fprintf(f, " --compositing %s --kernel-radius %g", compositings[s->compositing],
                s->kernel_radius);
    if (s->classify == TRIP_CLASSIFY_POST && s->samples_per_sheet)
        fprintf(f, " --samples-per-sheet %d", s->samples_per_sheet);
    if (s->early_termination >= 0)
        fprintf(f, " --early-termination %g", s->early_termination);
    if (!s->shading)
        fputs(" --no-shading", f);
    if (o->size_count == 1)
        fprintf(f, " --size %dx%d", o->sizes[0][0], o->sizes[0][1]);
    if (o->renderer_count == 1)
        fprintf(f, " --renderer %s", renderers[o->renderers[0]]);
    if (o->thread_count == 1 && o->threads[0])
        fprintf(f, " --threads %d", o->threads[0]);
    fclose(f);
    snprintf(text, bytes, "%s", buffer ? buffer : "");
    free(buffer);
}

int bench_options_parse(bench_options *o, int argc, char **argv)
{
    *o = (bench_options){ .field = "shells",
                          .finest = 512,
                          .seconds = 12,
                          .frames_per_second = 30,
                          .settings = trip_settings_default() };
    o->settings.samples_per_sheet = 0;
    parse p = { .o = o, .set = { .table = &bench_table, .base = o } };
    const command_line c = {
        .args_doc = "[TABLE [NAME.trip]]",
        .doc = "Measures how fast this machine draws a data set, and prints a table:\n" BENCH_TABLES
               "\vWithout NAME.trip, bench measures the included tooth. Without TABLE it measures "
               "the default of `render` and the renderers, in less than a minute. Compared "
               "settings take turns, so "
               "that other load slows all of them.",
        .sets = &p.set,
        .set_count = 1,
        .argument = add_word,
        .end = check,
        .user = &p,
    };
    return command_line_parse(&c, argc, argv);
}
