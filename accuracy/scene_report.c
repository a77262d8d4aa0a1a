#include "scene_report.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "accuracy_report.h"
#include "clock.h"
#include "command_line.h"
#include "draw_settings.h"
#include "json.h"
#include "machine.h"
#include "median.h"
#include "picture_data.h"
#include "report.h"

enum { ORDERS = 4, INTEGRAL = 3, PAIRS = ORDERS * (ORDERS - 1) / 2, SHOWN_PX = 512 };

/* Every fourth view of views.h is a whole view in perspective. */
enum { KIND = 4 };

static const char *const order_names[ORDERS] = { "depth", "lists", "sheets", "integral" };
static const char *const order_options[ORDERS] = { "--order depth", "--order lists",
                                                   "--order sheets", "--renderer integral" };

typedef struct measured {
    const accuracy_options *o;
    const char *command;
    triptych *cpu, *integral;
    float *pictures[ORDERS];
    accuracy_view *views;
    measure_error *errors; /* of pairs */
    double *all;           /* of pairs: sums over all pixels, covered or not */
    double *ms[ORDERS];
    int runs[ORDERS];
    triptych_frame_stats stats[ORDERS];
    char *shown[ORDERS], *differences[PAIRS]; /* of the first view, as data URLs */
    cJSON *json, *orders, *pairs;
} measured;

static int fail(triptych *t)
{
    trip_report_line(triptych_error(t));
    return TRIP_ERROR;
}

static size_t floats_of(const measured *m)
{
    return 4 * (size_t)m->o->width * (size_t)m->o->height;
}

static int open_context(const measured *m, triptych_renderer renderer, triptych **t)
{
    const triptych_resources resources = { .memory_bytes = m->o->memory_bytes / 2,
                                           .threads = m->o->threads,
                                           .renderer = renderer };
    if (triptych_create(t))
        return trip_fail(TRIP_ERROR, "accuracy", m->o->data[0], "out of memory");
    return triptych_open(*t, m->o->data[0], &resources) ? fail(*t) : 0;
}

static int take_memory(measured *m)
{
    const accuracy_options *o = m->o;
    bool all = (m->views = calloc((size_t)o->views, sizeof *m->views)) &&
               (m->errors = calloc(PAIRS, sizeof *m->errors)) &&
               (m->all = calloc(PAIRS, sizeof *m->all));
    for (int i = 0; i < ORDERS && all; i++)
        all = (m->pictures[i] = malloc(floats_of(m) * sizeof(float))) &&
              (m->ms[i] = calloc((size_t)o->views * (size_t)o->repeat, sizeof(double)));
    m->json = cJSON_CreateObject();
    return all && m->json ? 0 : trip_fail(TRIP_ERROR, "accuracy", o->data[0], "out of memory");
}

static void free_all(measured *m)
{
    triptych_destroy(m->cpu);
    triptych_destroy(m->integral);
    for (int i = 0; i < ORDERS; i++) {
        free(m->pictures[i]);
        free(m->ms[i]);
        free(m->shown[i]);
    }
    for (int i = 0; i < PAIRS; i++)
        free(m->differences[i]);
    free(m->views);
    free(m->errors);
    free(m->all);
    cJSON_Delete(m->json);
}

/* ---- measuring ---- */

/* Draws an order. The time is the one of the whole frame. */
static int draw(measured *m, int order)
{
    triptych *t = order == INTEGRAL ? m->integral : m->cpu;
    const draw_settings s = {
        .scene.order = order == INTEGRAL ? TRIPTYCH_ORDER_DEFAULT
                                         : TRIPTYCH_ORDER_DEPTH + (triptych_order)order,
        .has_background = 1, /* transparent */
    };
    if (draw_settings_use(t, &s) || triptych_draw(t, m->pictures[order]) ||
        triptych_get_frame_stats(t, &m->stats[order]))
        return fail(t);
    m->ms[order][m->runs[order]++] = m->stats[order].ms;
    return 0;
}

/* Draws a view: an order as often as --repeat says, the integral once. */
static int draw_view(measured *m, int view)
{
    int status = accuracy_view_find(m->cpu, m->o->width, m->o->height, KIND * view,
                                    KIND * m->o->views, &m->views[view])
                     ? fail(m->cpu)
                     : 0;
    if (!status && accuracy_view_use(m->cpu, &m->views[view]))
        status = fail(m->cpu);
    if (!status && accuracy_view_use(m->integral, &m->views[view]))
        status = fail(m->integral);
    for (int run = 0; run < m->o->repeat && !status; run++)
        for (int order = 0; order < INTEGRAL && !status; order++)
            status = draw(m, order);
    return status ? status : draw(m, INTEGRAL);
}

/* Adds the differences of a view. Colours count, and opacity does not. */
static void compare_view(measured *m)
{
    const size_t pixels = floats_of(m) / 4;
    measure_error *alpha = calloc(1, sizeof *alpha);
    int pair = 0;
    for (int a = 0; a < ORDERS && alpha; a++)
        for (int b = a + 1; b < ORDERS; b++, pair++) {
            measure_error_add_apart(&m->errors[pair], alpha, m->pictures[a], m->pictures[b],
                                    pixels);
            double sum = 0;
            for (size_t i = 0; i < floats_of(m); i++)
                if (i % 4 != 3)
                    sum += fabs((double)m->pictures[a][i] - (double)m->pictures[b][i]);
            m->all[pair] += 255 * sum / (3.0 * (double)pixels);
        }
    free(alpha);
}

static void keep_pictures(measured *m)
{
    const int w = m->o->width, h = m->o->height;
    int pair = 0;
    for (int a = 0; a < ORDERS; a++) {
        m->shown[a] = accuracy_picture_data(m->pictures[a], w, h, SHOWN_PX);
        for (int b = a + 1; b < ORDERS; b++, pair++)
            m->differences[pair] =
                accuracy_difference_data(m->pictures[a], m->pictures[b], w, h, SHOWN_PX);
    }
}

static int measure(measured *m)
{
    int status = take_memory(m);
    if (!status)
        status = open_context(m, TRIPTYCH_RENDERER_CPU, &m->cpu);
    if (!status)
        status = open_context(m, TRIPTYCH_RENDERER_INTEGRAL, &m->integral);
    measure_progress *progress = command_line_quiet() ? NULL : measure_progress_start("accuracy");
    measure_progress_expect(progress, m->o->views);
    for (int view = 0; view < m->o->views && !status; view++) {
        measure_progress_step(progress, "views");
        status = draw_view(m, view);
        if (!status)
            compare_view(m);
        if (!status && view == 0)
            keep_pictures(m);
    }
    measure_progress_end(progress);
    return status;
}

/* ---- the report ---- */

static void describe_orders(measured *m)
{
    m->orders = cJSON_AddArrayToObject(m->json, "orders");
    for (int i = 0; i < ORDERS; i++) {
        cJSON *row = measure_new_row(m->orders);
        cJSON_AddStringToObject(row, "order", order_names[i]);
        cJSON_AddStringToObject(row, "options", order_options[i]);
        measure_add(row, { "ms", measure_median(m->ms[i], m->runs[i]) }, { "runs", m->runs[i] },
                    { "gaussians", (double)m->stats[i].splats },
                    { "bytes_read", (double)m->stats[i].bytes_read });
    }
}

static void describe_pairs(measured *m)
{
    int pair = 0;
    m->pairs = cJSON_AddArrayToObject(m->json, "differences");
    for (int a = 0; a < ORDERS; a++)
        for (int b = a + 1; b < ORDERS; b++, pair++) {
            const measure_error_figures e = measure_error_measure(&m->errors[pair]);
            char name[32];
            cJSON *row = measure_new_row(m->pairs);
            snprintf(name, sizeof name, "%s, %s", order_names[a], order_names[b]);
            cJSON_AddStringToObject(row, "pair", name);
            measure_add(row, { "mean", e.mean }, { "max", e.max },
                        { "percentile_99", e.percentile_99 },
                        { "mean_of_all", m->all[pair] / m->o->views });
        }
}

static void describe(measured *m)
{
    triptych_scene scene;
    cJSON_AddNumberToObject(m->json, "triptych_scene_accuracy", 1);
    cJSON_AddStringToObject(m->json, "version", triptych_version());
    cJSON_AddStringToObject(m->json, "command", m->command);
    cJSON_AddStringToObject(m->json, "data_set", m->o->data[0]);
    if (!triptych_get_scene(m->cpu, &scene))
        cJSON_AddNumberToObject(m->json, "gaussians", (double)scene.gaussians);
    measure_add(m->json, { "width", m->o->width }, { "height", m->o->height },
                { "views", m->o->views }, { "repeat", m->o->repeat });
    measure_describe_machine(cJSON_AddObjectToObject(m->json, "machine"));
    describe_orders(m);
    describe_pairs(m);
}

static measure_table table_of_orders(const measured *m)
{
    static const measure_column columns[] = {
        { "order", "order", 0, 0 },
        { "ms", "median ms", 1, 0 },
        { "runs", "runs", 0, 0 },
        { "gaussians", "Gaussians read", 0, 0 },
        { "bytes_read", "MB read", 2, 1e6 },
    };
    return (measure_table){ .rows = m->orders,
                            .columns = columns,
                            .count = sizeof columns / sizeof *columns,
                            .tips = { "options" } };
}

static measure_table table_of_pairs(const measured *m)
{
    static const measure_column columns[] = {
        { "pair", "orders", 0, 0 },
        { "mean", "mean", 2, 0 },
        { "percentile_99", "99 %", 2, 0 },
        { "max", "max", 1, 0 },
        { "mean_of_all", "mean of all pixels", 3, 0 },
    };
    return (measure_table){ .rows = m->pairs,
                            .columns = columns,
                            .count = sizeof columns / sizeof *columns };
}

static void write_json(FILE *f, const void *data)
{
    char *text = trip_json_print(((const measured *)data)->json, true);
    fputs(text ? text : "", f);
    free(text);
}

/* Writes the orders, an empty line, and the differences. */
static void write_csv(FILE *f, const void *data)
{
    static const char *const orders[] = { "order", "ms", "runs", "gaussians", "bytes_read" };
    static const char *const pairs[] = { "pair", "mean", "percentile_99", "max", "mean_of_all" };
    const measured *m = data;
    measure_table_csv(f, m->orders, orders, sizeof orders / sizeof *orders);
    fputs("\r\n", f);
    measure_table_csv(f, m->pairs, pairs, sizeof pairs / sizeof *pairs);
}

static void write_figure(FILE *f, const char *name, const char *picture)
{
    if (picture)
        fprintf(f, "<figure><img alt='' src=\"%s\"><figcaption>%s</figcaption></figure>\n", picture,
                name);
}

static void write_views(FILE *f, const measured *m)
{
    char *text = NULL;
    size_t bytes;
    FILE *memory = open_memstream(&text, &bytes);
    if (!memory)
        return;
    fprintf(memory, "%s\n\n", m->command);
    for (int i = 0; i < m->o->views; i++) {
        accuracy_write_view(memory, &m->views[i]);
        fprintf(memory, " # %s\n", m->views[i].name);
    }
    fclose(memory);
    fputs("<h2>Commands</h2>\n<pre>", f);
    measure_write_escaped(f, text ? text : "");
    fputs("</pre>\n", f);
    free(text);
}

static const char meaning[] =
    "Differences are those of red, green and blue, of 255, over the pixels that the scene covers "
    "in "
    "either picture, and all views. The last column takes all pixels. Times are medians of whole "
    "frames; the integral is drawn once for each view.";

static void write_html(FILE *f, const void *data)
{
    const measured *m = data;
    const measure_table orders = table_of_orders(m), pairs = table_of_pairs(m);
    fputs("<!DOCTYPE html>\n<html lang=en><head><meta charset=utf-8>\n<title>Orders: ", f);
    measure_write_escaped(f, m->o->data[0]);
    fprintf(f, "</title>\n<style>\n%s</style></head><body>\n<h1>Orders of a Gaussian scene: ",
            accuracy_page_style);
    measure_write_escaped(f, m->o->data[0]);
    fprintf(f, "</h1>\n<p>Pictures of %d x %d pixels from %d view%s. %s</p>\n", m->o->width,
            m->o->height, m->o->views, m->o->views == 1 ? "" : "s", meaning);
    fputs("<h2>Differences</h2>\n", f);
    measure_table_html(f, &pairs);
    fputs("<h2>Times</h2>\n", f);
    measure_table_html(f, &orders);
    fputs("<h2>Pictures of the first view</h2>\n", f);
    for (int i = 0; i < ORDERS; i++)
        write_figure(f, order_names[i], m->shown[i]);
    fprintf(f, "<h2>Their differences</h2>\n<p>Black is 0, and white is %g of 255 or more.</p>\n",
            ACCURACY_DIFFERENCE_MAX);
    const cJSON *row = m->pairs->child;
    for (int i = 0; i < PAIRS && row; i++, row = row->next)
        write_figure(f, cJSON_GetObjectItem(row, "pair")->valuestring, m->differences[i]);
    write_views(f, m);
    fputs("</body></html>\n", f);
}

static int write_report(const measured *m, const char *folder)
{
    int status = accuracy_write_part(folder, "accuracy.json", write_json, m);
    if (!status)
        status = accuracy_write_part(folder, "accuracy.csv", write_csv, m);
    return status ? status : accuracy_write_part(folder, "index.html", write_html, m);
}

static void print_report(const measured *m)
{
    const measure_table orders = table_of_orders(m), pairs = table_of_pairs(m);
    fputc('\n', stdout);
    measure_table_print(stdout, &pairs);
    fputc('\n', stdout);
    measure_table_print(stdout, &orders);
    printf("\n%s\n", meaning);
}

int accuracy_scene_report(const accuracy_options *o, const char *folder, const char *command)
{
    measured m = { .o = o, .command = command };
    int status = measure(&m);
    if (!status) {
        describe(&m);
        status = write_report(&m, folder);
    }
    if (!status)
        print_report(&m);
    free_all(&m);
    return status;
}

int accuracy_scene_check(const accuracy_options *o)
{
    const char *option = o->data_count > 1                    ? "--also"
                         : o->program_count || o->no_programs ? "--compare"
                         : !o->usual                          ? "--settings"
                         : o->source                          ? "--source"
                         : o->tf                              ? "--tf"
                         : o->no_shading                      ? "--no-shading"
                         : o->steps                           ? "--steps"
                         : o->pictures                        ? "--pictures"
                         : o->budget_seconds < 1e9            ? "--budget"
                         : o->tolerance_given                 ? "--tolerance"
                                                              : NULL;
    return option ? trip_option_fail(option, "does not apply to Gaussian scenes") : 0;
}
