/* accuracy.json: all figures. */
#include "accuracy_report.h"

#include <math.h>

#include "fastest.h"
#include "machine.h"
#include "median.h"

static const char *const step_names[ACCURACY_STEPS] = { "total", "pixel",  "rays",  "storage",
                                                        "model", "method", "level", "precision" };

/* The PSNR of equal pictures is infinite, which becomes null. */
static cJSON *add_step(cJSON *to, const accuracy_row *row, accuracy_step step)
{
    const measure_error_figures f = measure_error_measure(&row->error[step]);
    cJSON *o = cJSON_AddObjectToObject(to, step_names[step]);
    measure_add(o, { "max", f.max }, { "mean", f.mean }, { "median", f.median },
                { "percentile_99", f.percentile_99 }, { "psnr", f.psnr });
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

static cJSON *add_row(cJSON *rows, const accuracy_report *r, const accuracy_row *row)
{
    cJSON *o = measure_new_row(rows);
    const double views = row->views, median = measure_median(row->ms, row->frames);
    cJSON_AddStringToObject(o, "name", row->setting.name);
    cJSON_AddStringToObject(o, "data_set", r->m->options->data[row->data]);
    if (row->program)
        cJSON_AddStringToObject(o, "version", row->program->about);
    else
        add_options(o, &row->setting);
    if (!row->program && accuracy_setting_promise(&row->setting) > 0)
        measure_add(o, { "promise", accuracy_setting_promise(&row->setting) });
    measure_add(o, { "views", views }, { "ms", median }, { "error", row->bound },
                { "ms_min", row->ms[0] }, { "ms_max", row->ms[row->frames - 1] },
                { "frames", row->frames });
    if (!row->program)
        measure_add(o, { "splats", row->splats / views },
                    { "splats_drawn", row->splats_drawn >= 0 ? row->splats_drawn : NAN },
                    { "bytes_read", row->bytes_read / views });
    measure_add(add_step(o, row, ACCURACY_TOTAL), { "ssim", row->ssim / views },
                { "flip", row->flip / views });
    for (int s = ACCURACY_TOTAL + 1; s < ACCURACY_STEPS; s++)
        if (row->has[s])
            add_step(o, row, (accuracy_step)s);
    return o;
}

static void add_view(cJSON *views, const accuracy_view *view)
{
    const triptych_camera *c = &view->camera;
    cJSON *o = measure_new_row(views);
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
    cJSON *o = measure_new_row(list);
    cJSON_AddStringToObject(o, "name", name);
    cJSON_AddStringToObject(o, "why", state == ACCURACY_LEFT_OUT ? why : "--budget was used up");
}

static void add_facts(cJSON *root, const accuracy_report *r)
{
    const accuracy_options *o = r->m->options;
    char checksum[ACCURACY_CHECKSUM_BYTES];
    accuracy_checksum_text(r->m->checksum, checksum);
    cJSON_AddNumberToObject(root, "triptych_accuracy", ACCURACY_VERSION);
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
    measure_add(root, { "width", o->width }, { "height", o->height }, { "tolerance", o->tolerance },
                { "repeat", o->repeat }, { "load_before", r->load_before },
                { "load_after", r->load_after }, { "seconds", r->m->seconds });
    measure_describe_machine(cJSON_AddObjectToObject(root, "machine"));
}

void accuracy_report_json(accuracy_report *r)
{
    const accuracy_measured *m = r->m;
    cJSON *root = r->json;
    add_facts(root, r);
    cJSON *views = cJSON_AddArrayToObject(root, "views");
    cJSON *rows = cJSON_AddArrayToObject(root, "rows");
    cJSON *programs = cJSON_AddArrayToObject(root, "compared");
    cJSON *popping = cJSON_AddObjectToObject(root, "popping");
    cJSON *left_out = cJSON_AddArrayToObject(root, "left_out");
    for (int i = 0; i < m->view_count; i++)
        add_view(views, &m->views[i]);
    for (int i = 0; i < m->row_count; i++) {
        const accuracy_row *row = &m->rows[i];
        if (row->state == ACCURACY_MEASURED)
            cJSON_AddItemReferenceToArray(r->shown,
                                          add_row(row->program ? programs : rows, r, row));
        else
            add_left_out(left_out, row->setting.name, row->state, row->why);
    }
    for (int i = 0; i < m->popping_count; i++) {
        const accuracy_popping *p = &m->popping[i];
        if (p->state == ACCURACY_MEASURED)
            cJSON_AddItemReferenceToObject(popping, p->name, p->rows);
        else
            add_left_out(left_out, p->name, p->state, p->why);
    }
    cJSON_AddNumberToObject(root, "views_left_out", m->options->views - m->view_count);
}
