#include "accuracy_report.h"

#include <math.h>
#include <stdlib.h>

#include "json.h"
#include "new_file.h"
#include "report.h"
#include "text.h"

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
    cJSON_ArrayForEach(row, cJSON_GetObjectItem(r->json, "rows")) cJSON_AddBoolToObject(
        row, "front", accuracy_is_on_front(r->shown, row, "total.percentile_99"));
    return 0;
}

void accuracy_report_free(accuracy_report *r)
{
    cJSON_Delete(r->shown);
    cJSON_Delete(r->json);
    *r = (accuracy_report){ 0 };
}

static void write_json(FILE *f, const accuracy_report *r)
{
    char *text = trip_json_print(r->json, true);
    fputs(text ? text : "", f);
    free(text);
}

/* Writes a line for each measured setting. */
static void write_csv(FILE *f, const accuracy_report *r)
{
#define FIGURES(step) step ".max", step ".mean", step ".median", step ".percentile_99", step ".psnr"
    static const char *const keys[] = { "name",
                                        "data_set",
                                        "options",
                                        "views",
                                        "frames",
                                        "ms",
                                        "ms_min",
                                        "ms_max",
                                        "splats",
                                        "splats_drawn",
                                        "bytes_read",
                                        FIGURES("total"),
                                        FIGURES("storage"),
                                        FIGURES("model"),
                                        FIGURES("method"),
                                        FIGURES("level"),
                                        FIGURES("precision"),
                                        "total.worst_percentile_99",
                                        "total.ssim",
                                        "total.flip",
                                        "front" };
    measure_table_csv(f, cJSON_GetObjectItem(r->json, "rows"), keys, sizeof keys / sizeof *keys);
}

/* Writes a part of the report into a file. */
static int write_part(const accuracy_report *r, const char *folder, const char *name,
                      void (*write)(FILE *f, const accuracy_report *r))
{
    char path[PATH_MAX + 32], *text = NULL;
    size_t bytes;
    FILE *f = open_memstream(&text, &bytes);
    snprintf(path, sizeof path, "%s/%s", folder, name);
    if (f)
        write(f, r);
    int status = !f || fclose(f) || !bytes ? out_of_memory()
                 : trip_interrupted()
                     ? trip_fail(TRIP_INTERRUPTED, "accuracy", folder, "interrupted")
                     : trip_new_file_of_text("write", path, text);
    free(text);
    return status;
}

int accuracy_report_write(const accuracy_report *r, const char *folder)
{
    int status = write_part(r, folder, "accuracy.json", write_json);
    if (!status)
        status = write_part(r, folder, "accuracy.csv", write_csv);
    return status ? status : write_part(r, folder, "index.html", accuracy_report_html);
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

void accuracy_print_left_out(FILE *f, const accuracy_report *r, const char *before,
                             void (*write)(FILE *f, const char *text))
{
    const cJSON *one;
    cJSON_ArrayForEach(one, cJSON_GetObjectItem(r->json, "left_out"))
    {
        fputs(before, f);
        write(f, cJSON_GetObjectItem(one, "name")->valuestring);
        fputs(": ", f);
        write(f, cJSON_GetObjectItem(one, "why")->valuestring);
        fputc('\n', f);
    }
    if (r->m->view_count < r->m->options->views)
        fprintf(f, "%sviews %d to %d: --budget was used up\n", before, r->m->view_count + 1,
                r->m->options->views);
}

void accuracy_report_print(FILE *f, const accuracy_report *r)
{
    static const measure_column columns[] = {
        { "name", "settings", 0, 0 },
        { "ms", "median ms", 1, 0 },
        { "total.mean", "error of 255: mean", 2, 0 },
        { "total.percentile_99", "99 %", 2, 0 },
        { "total.max", "max", 2, 0 },
        { "total.psnr", "PSNR, dB", 1, 0 },
        { "total.ssim", "SSIM", 4, 0 },
        { "total.flip", "FLIP", 4, 0 },
    };
    fputc('\n', f);
    measure_table_print(f, &(measure_table){ .rows = r->shown,
                                             .columns = columns,
                                             .count = sizeof columns / sizeof *columns,
                                             .mark = "front" });
    fprintf(f,
            "\n* on the front: no other setting is as fast and as close at the 99th percentile.\n");
    accuracy_print_left_out(f, r, "left out: ", trip_text_write);
}
