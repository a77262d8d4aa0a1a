/* Measures the modules beneath the library one by one: reading alone, drawing alone, and several
 * renderers over one copy of the data in memory. The library only draws whole frames. */
#include "bench.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "bench_sample.h"
#include "bench_tables.h"
#include "command_line.h"
#include "gaussian_file.h"
#include "gaussian_set.h"
#include "machine.h"
#include "new_file.h"
#include "read_files.h"

static const struct {
    const char *name;
    int (*run)(const session *s, const bench_options *o, bench_report *r);
    /* Runs instead with an open scene. */
    int (*run_scene)(bench_scene *scene, const bench_options *o, bench_report *r);
    bool from_disk;     /* the frames of the scene read from disk, not from memory */
    bool makes_volumes; /* makes its own volumes if no data set is named */
    bool opens;         /* opens the data set itself */
    bool of_scenes;     /* also measures data sets of Gaussian scenes */
    bool of_clouds;     /* only measures data sets of clouds of points */
} tables[] = {
    { .name = "orders", .run_scene = bench_orders, .of_scenes = true },
    { .name = "submit", .run_scene = bench_submit },
    { .name = "stream", .run_scene = bench_stream, .from_disk = true },
    { .name = "renderers", .run = bench_renderers },
    { .name = "popping", .run_scene = bench_popping },
    { .name = "levels", .run = bench_levels, .makes_volumes = true },
    { .name = "flight", .run = bench_flight, .opens = true, .of_scenes = true },
    { .name = "ewa", .run = bench_ewa },
    { .name = "variants", .run_scene = bench_variants },
    { .name = "surfels", .run = bench_surfels, .opens = true, .of_clouds = true },
};

/* Returns whether the frames are shaded: pre by the stored normals, post by differences of
 * values. */
static bool is_lit(const session *s, const trip_settings *settings)
{
    bool post = settings->classify == TRIP_CLASSIFY_POST;
    return post ? settings->shading : bench_planes(s, settings) >> TRIP_PLANE_NORMALS & 1;
}

static void describe(const session *s, const bench_options *o, bool included, bench_report *r)
{
    cJSON *settings = r->settings;
    const trip_file_header *h = &s->data->header;
    char text[64], render[256];
    snprintf(text, sizeof text, "%llu x %llu x %llu", (unsigned long long)h->dims[0],
             (unsigned long long)h->dims[1], (unsigned long long)h->dims[2]);
    cJSON_AddStringToObject(settings, "data_set", included ? "tooth, included" : o->input);
    cJSON_AddStringToObject(settings, "grid", text);
    cJSON_AddNumberToObject(settings, "kept_voxels", (double)h->kept);
    cJSON_AddStringToObject(settings, "transfer_function",
                            o->tf ? o->tf : "stored in the data set");
    if (o->size_count == 1)
        bench_report_add_size(settings, o->sizes[0]);
    bench_options_write(o, render, sizeof render);
    cJSON_AddStringToObject(settings, "options_of_render", render);
    cJSON_AddBoolToObject(settings, "shading", is_lit(s, &o->settings));
    cJSON_AddNumberToObject(settings, "repeat", o->repeat);
}

/* Returns the index of the table, a valid name after parsing. */
static size_t table_of(const bench_options *o)
{
    size_t i = 0;
    while (i + 1 < sizeof tables / sizeof tables[0] && strcmp(tables[i].name, o->table) != 0)
        i++;
    return i;
}

static int run_scene(size_t table, const session *s, const bench_options *o, bench_report *r)
{
    bench_scene scene;
    int status = bench_scene_open(&scene, s, o, tables[table].from_disk, r);
    if (!status)
        status = tables[table].run_scene(&scene, o, r);
    bench_scene_close(&scene);
    return status;
}

/* Measures the named data set, or makes a data set of the included volume. */
static int measure_data(bench_options *o, size_t table, bench_report *r)
{
    session s = { 0 };
    bench_sample sample = { 0 };
    bool included = !o->input;
    int status = 0;
    if (included) {
        status = bench_sample_make(&sample);
        o->input = sample.data;
    }
    if (!status && !tables[table].opens)
        status = session_open(&s, o->input, &(session_look){ .tf = o->tf }, o->memory_bytes);
    if (!status && !tables[table].opens)
        bench_options_choose(o, session_needs_splats(&s) != NULL);
    if (!status && !tables[table].opens)
        describe(&s, o, included, r);
    if (!status)
        status = tables[table].run_scene ? run_scene(table, &s, o, r)
                                         : tables[table].run(tables[table].opens ? NULL : &s, o, r);
    session_close(&s);
    bench_sample_remove(&sample);
    return status;
}

/* Checks before any work that the plot can be written and would replace no input. */
static int check_plot(const bench_options *o)
{
    read_files r = { 0 };
    if (!o->plot)
        return 0;
    int status = trip_new_file_check("bench", o->plot);
    if (!status)
        status = read_files_add(&r, o->input);
    if (!status)
        status = read_files_add_function(&r, o->tf);
    if (!status)
        status = read_files_check(&r, o->plot);
    read_files_release(&r);
    return status;
}

/* Checks the options for a Gaussian scene. */
static int check_scene(const bench_options *o, size_t table)
{
    if (!tables[table].of_scenes && !tables[table].of_clouds)
        return trip_fail(TRIP_USAGE, "usage", o->input,
                         "is a Gaussian scene; only the tables orders and flight measure it, and "
                         "surfels for clouds");
    if (tables[table].opens)
        return 0;
    if (!o->usual || o->tf)
        return trip_fail(TRIP_USAGE, "usage", o->input,
                         "is a Gaussian scene; only --json, --memory, --repeat, --size and "
                         "--threads apply");
    if (o->renderers[0] != TRIP_RENDERER_CPU && o->renderers[0] != TRIP_RENDERER_AUTO)
        return trip_option_fail("--renderer", "must be cpu for a Gaussian scene");
    return 0;
}

static int measure(bench_options *o, bench_report *r)
{
    const size_t table = table_of(o);
    const bool scene = o->input && trip_gaussian_set_is(o->input);
    int status = scene ? check_scene(o, table) : 0;
    if (!scene && tables[table].of_clouds)
        status = trip_fail(TRIP_USAGE, "usage", o->table,
                           "measures a data set that `triptych brick` made of a cloud of points");
    if (o->input && !scene && trip_gaussian_file_is(o->input))
        status = trip_fail(TRIP_USAGE, "usage", o->input,
                           "is a Gaussian scene; `triptych brick` makes a data set of it");
    if (status)
        return status;
    if (!o->input && tables[table].makes_volumes)
        bench_options_choose(o, false);
    o->progress = command_line_quiet() ? NULL : measure_progress_start(o->table);
    status = scene && !tables[table].opens              ? bench_gaussians(o, r)
             : !o->input && tables[table].makes_volumes ? tables[table].run(NULL, o, r)
                                                        : measure_data(o, table, r);
    measure_progress_end(o->progress);
    return status;
}

static void print_tables(void)
{
    printf("`triptych bench TABLE NAME.trip` measures a data set. The tables are:\n%s\n"
           "A short run of the table renderers follows, on the included tooth:\n\n",
           BENCH_TABLES);
    fflush(stdout);
}

int trip_bench(int argc, char **argv)
{
    char *command = measure_command_line(argc, argv);
    bench_options o;
    bench_report *report = NULL;
    int status = bench_options_parse(&o, argc, argv);
    if (!status)
        status = check_plot(&o);
    if (!status && o.in_short && !o.json && !command_line_quiet())
        print_tables();
    if (!status)
        status = bench_report_create(&report, o.table, command ? command : "");
    if (!status)
        status = measure(&o, report);
    if (!status)
        status = bench_report_print(report, o.json);
    bench_report_destroy(report);
    free(command);
    return status;
}
