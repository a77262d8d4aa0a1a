#include "accuracy_report.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "new_file.h"
#include "report.h"

const char *const accuracy_step_names[ACCURACY_STEPS] = { "total",  "storage", "model",
                                                          "method", "level",   "precision" };

static bool is_measured(const accuracy_report *r, int i)
{
    return r->m->rows[i].state == ACCURACY_MEASURED;
}

/* Excludes rows of other programs. */
static bool is_setting(const accuracy_report *r, int i)
{
    return is_measured(r, i) && !r->m->rows[i].program;
}

static double error_of(const accuracy_report *r, int i, bool mean)
{
    const accuracy_error_figures *f = &r->figures[i][ACCURACY_TOTAL];
    return mean ? f->mean : f->percentile_99;
}

/* Finds the Pareto front: the settings that no other setting beats in time or error without being
 * worse in the other. */
static void find_front(const accuracy_report *r, bool mean, bool *front)
{
    for (int i = 0; i < r->m->row_count; i++) {
        front[i] = is_setting(r, i);
        for (int j = 0; j < r->m->row_count && front[i]; j++) {
            double e = error_of(r, i, mean), other = error_of(r, j, mean);
            if (is_setting(r, j) && r->ms[j] <= r->ms[i] && other <= e &&
                (r->ms[j] < r->ms[i] || other < e))
                front[i] = false;
        }
    }
}

static int out_of_memory(void)
{
    return trip_fail(TRIP_ERROR, "accuracy", "report", "out of memory");
}

int accuracy_report_make(accuracy_report *r, const accuracy_measured *m, const char *command)
{
    size_t rows = (size_t)m->row_count;
    double load_before = r->load_before;
    *r = (accuracy_report){ .m = m, .command = command, .load_before = load_before };
    r->figures = calloc(rows, sizeof *r->figures);
    r->ms = calloc(rows, sizeof *r->ms);
    r->front = calloc(rows, sizeof *r->front);
    r->front_of_mean = calloc(rows, sizeof *r->front_of_mean);
    if (getloadavg(&r->load_after, 1) != 1)
        r->load_after = NAN;
    if (!r->figures || !r->ms || !r->front || !r->front_of_mean)
        return out_of_memory();
    for (int i = 0; i < m->row_count; i++) {
        for (int s = 0; s < ACCURACY_STEPS; s++)
            r->figures[i][s] = accuracy_error_measure(&m->rows[i].error[s]);
        r->ms[i] = accuracy_median(m->rows[i].ms, m->rows[i].frames);
    }
    find_front(r, false, r->front);
    find_front(r, true, r->front_of_mean);
    return 0;
}

void accuracy_report_free(accuracy_report *r)
{
    free(r->figures);
    free(r->ms);
    free(r->front);
    free(r->front_of_mean);
    *r = (accuracy_report){ 0 };
}

int accuracy_report_write(const accuracy_report *r, const char *folder)
{
    static const struct {
        const char *name;
        char *(*text)(const accuracy_report *r);
    } parts[] = { { "accuracy.json", accuracy_report_json },
                  { "accuracy.csv", accuracy_report_csv },
                  { "index.html", accuracy_report_html } };
    int status = 0;
    for (size_t i = 0; i < sizeof parts / sizeof *parts && !status; i++) {
        char path[PATH_MAX + 32];
        char *text = parts[i].text(r);
        snprintf(path, sizeof path, "%s/%s", folder, parts[i].name);
        status = !text ? out_of_memory()
                 : trip_interrupted()
                     ? trip_fail(TRIP_INTERRUPTED, "accuracy", folder, "interrupted")
                     : trip_new_file_of_text("write", path, text);
        free(text);
    }
    return status;
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

static void print_why(FILE *f, const char *name, accuracy_state state, const char *why)
{
    if (state != ACCURACY_MEASURED)
        fprintf(f, "left out: %s: %s\n", name,
                state == ACCURACY_LEFT_OUT ? why : "--budget was used up");
}

void accuracy_report_print(FILE *f, const accuracy_report *r)
{
    fprintf(f, "\n| settings | median ms | error of 255: mean | 99 %% | max | PSNR, dB | SSIM | "
               "FLIP |\n|---|--:|--:|--:|--:|--:|--:|--:|\n");
    for (int i = 0; i < r->m->row_count; i++) {
        const accuracy_error_figures *e = &r->figures[i][ACCURACY_TOTAL];
        const accuracy_row *row = &r->m->rows[i];
        if (is_measured(r, i))
            fprintf(f, "| %s%s | %.1f | %.2f | %.2f | %.2f | %.1f | %.4f | %.4f |\n",
                    row->setting.name, r->front[i] ? " *" : "", r->ms[i], e->mean, e->percentile_99,
                    e->max, e->psnr, row->ssim / row->views, row->flip / row->views);
    }
    fprintf(f,
            "\n* on the front: no other setting is as fast and as close at the 99th percentile.\n");
    for (int i = 0; i < r->m->row_count; i++)
        print_why(f, r->m->rows[i].setting.name, r->m->rows[i].state, r->m->rows[i].why);
    for (int i = 0; i < r->m->popping_count; i++)
        print_why(f, r->m->popping[i].name, r->m->popping[i].state, r->m->popping[i].why);
    if (r->m->view_count < r->m->options->views)
        fprintf(f, "left out: views %d to %d: --budget was used up\n", r->m->view_count + 1,
                r->m->options->views);
}
