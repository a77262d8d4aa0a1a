/* accuracy.csv: a line for each measured setting, in the format of RFC 4180. */
#include <math.h>
#include <stdlib.h>

#include "accuracy_report.h"

static void write_text(FILE *f, const char *text)
{
    fputc('"', f);
    for (; *text; text++) {
        if (*text == '"')
            fputc('"', f);
        fputc(*text, f);
    }
    fputc('"', f);
}

/* Writes an empty field for infinite or missing numbers. */
static void write_number(FILE *f, double value)
{
    if (isfinite(value))
        fprintf(f, ",%.9g", value);
    else
        fputc(',', f);
}

static void write_head(FILE *f)
{
    fputs("name,data_set,options,views,frames,ms,ms_min,ms_max,splats,splats_drawn,bytes_read", f);
    for (int s = 0; s < ACCURACY_STEPS; s++) {
        static const char *const figures[] = { "max", "mean", "median", "percentile_99", "psnr" };
        for (int i = 0; i < 5; i++)
            fprintf(f, ",%s_%s", accuracy_step_names[s], figures[i]);
    }
    fputs(",total_worst_percentile_99,total_ssim,total_flip,front\r\n", f);
}

static void write_options(FILE *f, const accuracy_setting *s)
{
    char *text = NULL;
    size_t bytes;
    FILE *memory = open_memstream(&text, &bytes);
    if (!memory)
        return;
    accuracy_write_options(memory, s);
    fclose(memory);
    write_text(f, text ? text : "");
    free(text);
}

static void write_row(FILE *f, const accuracy_report *r, int i)
{
    const accuracy_row *row = &r->m->rows[i];
    write_text(f, row->setting.name);
    fputc(',', f);
    write_text(f, r->m->options->data[row->data]);
    fputc(',', f);
    write_options(f, &row->setting);
    fprintf(f, ",%d,%d", row->views, row->frames);
    write_number(f, r->ms[i]);
    write_number(f, row->ms[0]);
    write_number(f, row->ms[row->frames - 1]);
    write_number(f, row->splats / row->views);
    write_number(f, row->splats_drawn >= 0 ? row->splats_drawn : NAN);
    write_number(f, row->bytes_read / row->views);
    for (int s = 0; s < ACCURACY_STEPS; s++) {
        const accuracy_error_figures *e = &r->figures[i][s];
        const double figures[] = { e->max, e->mean, e->median, e->percentile_99, e->psnr };
        for (int k = 0; k < 5; k++)
            write_number(f, row->has[s] ? figures[k] : NAN);
    }
    write_number(f, row->worst_percentile_99);
    write_number(f, row->ssim / row->views);
    write_number(f, row->flip / row->views);
    fprintf(f, ",%d\r\n", r->front[i]);
}

char *accuracy_report_csv(const accuracy_report *r)
{
    char *text = NULL;
    size_t bytes;
    FILE *f = open_memstream(&text, &bytes);
    if (!f)
        return NULL;
    write_head(f);
    for (int i = 0; i < r->m->row_count; i++)
        if (r->m->rows[i].state == ACCURACY_MEASURED && !r->m->rows[i].program)
            write_row(f, r, i);
    if (fclose(f) == 0)
        return text;
    free(text);
    return NULL;
}
