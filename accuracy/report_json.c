/* accuracy.json: all figures. */
#include <cjson/cJSON.h>
#include <math.h>

#include "bench_report.h"
#include "json.h"
#include "accuracy_report.h"
#include "fastest.h"

static void add_number(cJSON *to, const char *name, double value)
{
    if (isfinite(value))
        cJSON_AddNumberToObject(to, name, value);
    else
        cJSON_AddNullToObject(to, name); /* the PSNR of equal pictures is infinite */
}

static cJSON *add_figures(cJSON *to, const char *name, const accuracy_error_figures *f)
{
    cJSON *o = cJSON_AddObjectToObject(to, name);
    add_number(o, "max", f->max);
    add_number(o, "mean", f->mean);
    add_number(o, "median", f->median);
    add_number(o, "percentile_99", f->percentile_99);
    add_number(o, "psnr", f->psnr);
    return o;
}

static void add_options(cJSON *to, const accuracy_setting *s)
{
    accuracy_option options[ACCURACY_OPTIONS_MAX];
    int count = accuracy_setting_options(s, options);
    cJSON *o = cJSON_AddObjectToObject(to, "options");
    for (int i = 0; i < count; i++)
        cJSON_AddStringToObject(o, options[i].name, options[i].value);
}

static void add_times(cJSON *to, double median, const double *sorted, int frames)
{
    add_number(to, "ms", median);
    add_number(to, "ms_min", sorted[0]);
    add_number(to, "ms_max", sorted[frames - 1]);
    add_number(to, "frames", frames);
}

static void add_row(cJSON *rows, const accuracy_report *r, int i)
{
    const accuracy_row *row = &r->m->rows[i];
    cJSON *o = cJSON_CreateObject();
    cJSON_AddItemToArray(rows, o);
    cJSON_AddStringToObject(o, "name", row->setting.name);
    cJSON_AddStringToObject(o, "data_set", r->m->options->data[row->data]);
    if (row->program)
        cJSON_AddStringToObject(o, "version", row->program->about);
    else
        add_options(o, &row->setting);
    add_number(o, "views", row->views);
    add_times(o, r->ms[i], row->ms, row->frames);
    if (!row->program) {
        add_number(o, "splats", row->splats / row->views);
        add_number(o, "splats_drawn", row->splats_drawn >= 0 ? row->splats_drawn : NAN);
        add_number(o, "bytes_read", row->bytes_read / row->views);
    }
    cJSON *total = add_figures(o, "total", &r->figures[i][ACCURACY_TOTAL]);
    add_number(total, "worst_percentile_99", row->worst_percentile_99);
    add_number(total, "ssim", row->ssim / row->views);
    add_number(total, "flip", row->flip / row->views);
    for (int s = ACCURACY_TOTAL + 1; s < ACCURACY_STEPS; s++)
        if (row->has[s])
            add_figures(o, accuracy_step_names[s], &r->figures[i][s]);
    if (!row->program)
        cJSON_AddBoolToObject(o, "front", r->front[i]);
}

static void add_view(cJSON *views, const accuracy_view *view)
{
    const triptych_camera *c = &view->camera;
    cJSON *o = cJSON_CreateObject();
    cJSON_AddItemToArray(views, o);
    cJSON_AddStringToObject(o, "name", view->name);
    cJSON_AddItemToObject(o, "eye", cJSON_CreateDoubleArray(c->eye, 3));
    cJSON_AddItemToObject(o, "look", cJSON_CreateDoubleArray(c->look, 3));
    cJSON_AddItemToObject(o, "up", cJSON_CreateDoubleArray(c->up, 3));
    if (c->ortho_height > 0)
        cJSON_AddNumberToObject(o, "ortho_height", c->ortho_height);
    else
        cJSON_AddNumberToObject(o, "fov_degrees", c->fov_degrees);
}

static void add_left_out(cJSON *list, const char *name, accuracy_state state, const char *why)
{
    cJSON *o = cJSON_CreateObject();
    cJSON_AddItemToArray(list, o);
    cJSON_AddStringToObject(o, "name", name);
    cJSON_AddStringToObject(o, "why", state == ACCURACY_LEFT_OUT ? why : "--budget was used up");
}

static void add_popping(cJSON *to, const accuracy_popping *p)
{
    cJSON *rows = cJSON_AddArrayToObject(to, p->name);
    for (int i = 0; i < ACCURACY_POPPING_ROWS; i++) {
        const bench_popping_row *row = &p->rows[i];
        cJSON *o = cJSON_CreateObject();
        cJSON_AddItemToArray(rows, o);
        cJSON_AddStringToObject(o, "settings", bench_popping_settings[i].name);
        add_number(o, "mean", row->mean);
        add_number(o, "percentile_99", row->percentile_99);
        add_number(o, "max", row->max);
        add_number(o, "motion", row->motion);
    }
}

static void add_facts(cJSON *root, const accuracy_report *r)
{
    const accuracy_options *o = r->m->options;
    char checksum[ACCURACY_CHECKSUM_BYTES];
    accuracy_checksum_text(r->m->checksum, checksum);
    cJSON_AddNumberToObject(root, "triptych_accuracy", 1);
    cJSON_AddStringToObject(root, "version", triptych_version());
    cJSON_AddStringToObject(root, "command", r->command);
    cJSON_AddStringToObject(root, "data_set", o->data[0]);
    cJSON_AddStringToObject(root, "checksum", checksum);
    cJSON_AddStringToObject(root, "levels_for", r->m->levels_for);
    cJSON_AddItemToObject(root, "source",
                          o->source ? cJSON_CreateString(o->source) : cJSON_CreateNull());
    cJSON_AddItemToObject(root, "transfer_function",
                          o->tf ? cJSON_CreateString(o->tf) : cJSON_CreateNull());
    cJSON_AddBoolToObject(root, "shading", o->shading);
    cJSON_AddNumberToObject(root, "width", o->width);
    cJSON_AddNumberToObject(root, "height", o->height);
    cJSON_AddNumberToObject(root, "samples", o->samples);
    cJSON_AddNumberToObject(root, "tolerance", o->tolerance);
    cJSON_AddNumberToObject(root, "repeat", o->repeat);
    add_number(root, "load_before", r->load_before);
    add_number(root, "load_after", r->load_after);
    add_number(root, "seconds", r->m->seconds);
    bench_describe_machine(cJSON_AddObjectToObject(root, "machine"));
}

char *accuracy_report_json(const accuracy_report *r)
{
    cJSON *root = cJSON_CreateObject();
    add_facts(root, r);
    cJSON *views = cJSON_AddArrayToObject(root, "views");
    cJSON *rows = cJSON_AddArrayToObject(root, "rows");
    cJSON *programs = cJSON_AddArrayToObject(root, "compared");
    cJSON *popping = cJSON_AddObjectToObject(root, "popping");
    cJSON *left_out = cJSON_AddArrayToObject(root, "left_out");
    for (int i = 0; i < r->m->view_count; i++)
        add_view(views, &r->m->views[i]);
    for (int i = 0; i < r->m->row_count; i++)
        if (r->m->rows[i].state == ACCURACY_MEASURED)
            add_row(r->m->rows[i].program ? programs : rows, r, i);
        else
            add_left_out(left_out, r->m->rows[i].setting.name, r->m->rows[i].state,
                         r->m->rows[i].why);
    for (int i = 0; i < r->m->popping_count; i++) {
        const accuracy_popping *p = &r->m->popping[i];
        if (p->state == ACCURACY_MEASURED)
            add_popping(popping, p);
        else
            add_left_out(left_out, p->name, p->state, p->why);
    }
    cJSON_AddNumberToObject(root, "views_left_out", r->m->options->views - r->m->view_count);
    char *text = trip_json_print(root, true);
    cJSON_Delete(root);
    return text;
}
