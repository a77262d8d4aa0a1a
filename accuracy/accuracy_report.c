#include "accuracy_report.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "fastest.h"
#include "json.h"
#include "new_file.h"
#include "report.h"
#include "text.h"

bool accuracy_is_for_render(const cJSON *report, const cJSON *row)
{
    return cJSON_HasObjectItem(row, "options") &&
           cJSON_Compare(cJSON_GetObjectItem(row, "data_set"),
                         cJSON_GetObjectItem(report, "data_set"), true);
}

bool accuracy_is_on_front(const cJSON *rows, const cJSON *row, const char *error)
{
    const double ms = measure_number(row, "ms"), e = measure_number(row, error);
    const cJSON *other;
    bool front = cJSON_HasObjectItem(row, "options");
    cJSON_ArrayForEach(other, rows)
    {
        const double other_ms = measure_number(other, "ms"), other_e = measure_number(other, error);
        if (cJSON_HasObjectItem(other, "options") && other_ms <= ms && other_e <= e &&
            (other_ms < ms || other_e < e))
            front = false;
    }
    return front;
}

static int by_time(const void *a, const void *b)
{
    const double x = measure_number(*(cJSON *const *)a, "ms");
    const double y = measure_number(*(cJSON *const *)b, "ms");
    return (x > y) - (x < y);
}

/* Returns references to rows, the fastest first: the rows that `render --error` chooses from, or
 * the others. */
static cJSON *sorted_rows(const accuracy_report *r, bool chosen)
{
    const cJSON *row;
    const int count = cJSON_GetArraySize(r->shown);
    int taken = 0;
    cJSON *out = cJSON_CreateArray(), **rows = calloc((size_t)count + 1, sizeof(cJSON *));
    cJSON_ArrayForEach(row, r->shown) if (rows && accuracy_is_for_render(r->json, row) == chosen)
        memcpy(&rows[taken++], &row, sizeof row);
    if (rows)
        qsort(rows, (size_t)taken, sizeof *rows, by_time);
    for (int i = 0; i < taken; i++)
        cJSON_AddItemReferenceToArray(out, rows[i]);
    free(rows);
    return out;
}

static int out_of_memory(void)
{
    return trip_fail(TRIP_ERROR, "accuracy", "report", "out of memory");
}

int accuracy_report_make(accuracy_report *r, const accuracy_measured *m, const char *command)
{
    *r = (accuracy_report){ .m = m,
                            .command = command,
                            .load_before = r->load_before,
                            .json = cJSON_CreateObject(),
                            .shown = cJSON_CreateArray() };
    if (getloadavg(&r->load_after, 1) != 1)
        r->load_after = NAN;
    if (!r->json || !r->shown)
        return out_of_memory();
    accuracy_report_json(r);
    cJSON *row;
    cJSON *chosen = sorted_rows(r, true);
    cJSON_ArrayForEach(row, cJSON_GetObjectItem(r->json, "rows")) cJSON_AddBoolToObject(
        row, "front",
        accuracy_is_for_render(r->json, row) && accuracy_is_on_front(chosen, row, "error"));
    cJSON_Delete(chosen);
    return 0;
}

void accuracy_report_free(accuracy_report *r)
{
    cJSON_Delete(r->shown);
    cJSON_Delete(r->json);
    *r = (accuracy_report){ 0 };
}

static void write_json(FILE *f, const void *data)
{
    const accuracy_report *r = data;
    char *text = trip_json_print(r->json, true);
    fputs(text ? text : "", f);
    free(text);
}

/* Writes a line for each measured setting. */
static void write_csv(FILE *f, const void *data)
{
    const accuracy_report *r = data;
#define FIGURES(step) step ".max", step ".mean", step ".median", step ".percentile_99", step ".psnr"
    static const char *const keys[] = { "name",
                                        "data_set",
                                        "options",
                                        "views",
                                        "frames",
                                        "ms",
                                        "ms_min",
                                        "ms_max",
                                        "error",
                                        "splats",
                                        "splats_drawn",
                                        "bytes_read",
                                        "promise",
                                        FIGURES("total"),
                                        FIGURES("pixel"),
                                        FIGURES("rays"),
                                        FIGURES("storage"),
                                        FIGURES("model"),
                                        FIGURES("method"),
                                        FIGURES("level"),
                                        FIGURES("precision"),
                                        "total.ssim",
                                        "total.flip",
                                        "front" };
    measure_table_csv(f, cJSON_GetObjectItem(r->json, "rows"), keys, sizeof keys / sizeof *keys);
}

static void write_html(FILE *f, const void *data)
{
    accuracy_report_html(f, data);
}

int accuracy_write_part(const char *folder, const char *name,
                        void (*write)(FILE *f, const void *data), const void *data)
{
    char path[PATH_MAX + 32], *text = NULL;
    size_t bytes;
    FILE *f = open_memstream(&text, &bytes);
    snprintf(path, sizeof path, "%s/%s", folder, name);
    if (f)
        write(f, data);
    int status = !f || fclose(f) || !bytes ? out_of_memory()
                 : trip_interrupted()
                     ? trip_fail(TRIP_INTERRUPTED, "accuracy", folder, "interrupted")
                     : trip_new_file_of_text("write", path, text);
    free(text);
    return status;
}

int accuracy_report_write(const accuracy_report *r, const char *folder)
{
    int status = accuracy_write_part(folder, "accuracy.json", write_json, r);
    if (!status)
        status = accuracy_write_part(folder, "accuracy.csv", write_csv, r);
    return status ? status : accuracy_write_part(folder, "index.html", write_html, r);
}

static void write_point(FILE *f, const char *name, const double p[3])
{
    fprintf(f, " --%s=%.17g,%.17g,%.17g", name, p[0], p[1], p[2]);
}

void accuracy_write_view(FILE *f, const accuracy_view *view)
{
    const triptych_camera *c = &view->camera;
    fprintf(f, "--size %dx%d", c->width, c->height);
    write_point(f, "eye", c->eye);
    write_point(f, "look", c->look);
    write_point(f, "up", c->up);
    if (c->ortho_height > 0)
        fprintf(f, " --ortho %.17g", c->ortho_height);
    else
        fprintf(f, " --fov %.17g", c->fov_degrees);
}

void accuracy_write_options(FILE *f, const accuracy_setting *s)
{
    accuracy_option options[ACCURACY_OPTIONS_MAX];
    int count = accuracy_setting_options(s, options);
    for (int i = 0; i < count; i++)
        fprintf(f, "%s--%s %s", i ? " " : "", options[i].name, options[i].value);
}

/* Returns whether an earlier entry has the same reason. */
static bool is_repeated(const cJSON *list, const cJSON *one)
{
    const char *why = cJSON_GetObjectItem(one, "why")->valuestring;
    const cJSON *other = list->child;
    while (other != one && strcmp(cJSON_GetObjectItem(other, "why")->valuestring, why))
        other = other->next;
    return other != one;
}

/* Writes the names of an entry and of all later ones with the same reason. */
static void write_names(FILE *f, const cJSON *one, void (*write)(FILE *f, const char *text))
{
    const char *why = cJSON_GetObjectItem(one, "why")->valuestring;
    for (const cJSON *other = one; other; other = other->next)
        if (!strcmp(cJSON_GetObjectItem(other, "why")->valuestring, why)) {
            fputs(other == one ? "" : ", ", f);
            write(f, cJSON_GetObjectItem(other, "name")->valuestring);
        }
}

void accuracy_print_left_out(FILE *f, const accuracy_report *r, const char *before,
                             void (*write)(FILE *f, const char *text))
{
    const cJSON *list = cJSON_GetObjectItem(r->json, "left_out"), *one;
    cJSON_ArrayForEach(one, list)
    {
        if (is_repeated(list, one))
            continue;
        fputs(before, f);
        write_names(f, one, write);
        fputs(": ", f);
        write(f, cJSON_GetObjectItem(one, "why")->valuestring);
        fputc('\n', f);
    }
    if (r->m->view_count < r->m->options->views)
        fprintf(f, "%sviews %d to %d: --budget was used up\n", before, r->m->view_count + 1,
                r->m->options->views);
}

static void print_rows(FILE *f, const cJSON *rows, const char *title)
{
    static const measure_column columns[] = {
        { "name", "setting", 0, 0 },    { "ms", "ms", 1, 0 },
        { "error", "error", 2, 0 },     { "total.mean", "mean", 2, 0 },
        { "promise", "promise", 1, 0 }, { "rays.mean", "along rays", 2, 0 },
    };
    if (rows && rows->child)
        measure_table_print(f, &(measure_table){ .title = title,
                                                 .rows = rows,
                                                 .columns = columns,
                                                 .count = sizeof columns / sizeof *columns,
                                                 .mark = "front" });
}

static void print_explanation(FILE *f, const accuracy_report *r)
{
    const accuracy_options *o = r->m->options;
    char *usual = accuracy_report_path(o->data[0]);
    fprintf(f,
            "\nerror: 99 %% of the pixels of the object are at most this far from the exact "
            "picture, of 255,\n       in red, green, blue and opacity, in the worst of the views.\n"
            "       The exact picture has the mean of the integral over the area of each pixel.\n"
            "mean:  the mean difference from the exact picture, over all views.\n"
            "promise: the mean that the quality promises.\n"
            "along rays: the mean difference from the integral along the same rays, one per "
            "pixel.\n"
            "ms:    the median time of a frame, in milliseconds. The fastest setting comes first.\n"
            "*      every faster setting has a larger error.\n\n"
            "`triptych render ");
    trip_text_write_word(f, o->data[0]);
    fputs(" --error E", f);
    if (!usual || strcmp(usual, o->output)) {
        fputs(" --report ", f);
        trip_text_write_word(f, o->output);
    }
    fputs("` uses the first setting with an error of at most E.\n"
          "`triptych accuracy --list` prints the options of each setting.\n",
          f);
    free(usual);
}

void accuracy_report_print(FILE *f, const accuracy_report *r)
{
    cJSON *chosen = sorted_rows(r, true), *others = sorted_rows(r, false);
    fputc('\n', f);
    print_rows(f, chosen, NULL);
    print_rows(f, others, "For comparison, never used by `render --error`:");
    print_explanation(f, r);
    accuracy_print_left_out(f, r, "left out: ", trip_text_write);
    cJSON_Delete(chosen);
    cJSON_Delete(others);
}
