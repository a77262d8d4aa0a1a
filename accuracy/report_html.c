/* index.html: one page that holds all it shows. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "picture_data.h"
#include "accuracy_report.h"
#include "text.h"

static const char style[] =
    "body{font:15px/1.45 system-ui,sans-serif;max-width:1180px;margin:24px auto;padding:0 16px;"
    "color:#222}\n"
    "h1{font-size:24px}h2{font-size:19px;margin-top:32px}\n"
    "table{border-collapse:collapse;font-size:12px}td,th{padding:2px 5px;text-align:right;"
    "border-bottom:1px solid #ddd;white-space:nowrap}td:first-child,th:first-child{text-align:left}"
    "\n"
    "tr.front td:first-child{font-weight:bold}.wide{overflow-x:auto}\n"
    "pre{background:#f4f4f4;padding:8px;overflow-x:auto;font-size:12px}\n"
    "figure{display:inline-block;margin:0 12px 14px 0;font-size:12px;vertical-align:top}"
    "figcaption{max-width:262px}img{background:#000;image-rendering:pixelated;margin-right:4px}\n"
    "svg{max-width:100%;height:auto;font:11px system-ui,sans-serif;background:#fff}"
    ".grid{stroke:#e4e4e4;fill:none}.front{stroke:#222;fill:none}.leader{stroke:#bbb;fill:none}"
    "circle,rect{stroke:#fff}"
    ".program{fill:#7b3fa0}.post{fill:#1f6fc4}.pre{fill:#e07b1a}.gl{fill:#2a9d4e}.slow{fill:#888}."
    "quality{fill:#c21f3a}"
    ".key{display:inline-block;width:11px;height:11px;border-radius:6px;"
    "margin:0 4px 0 14px}\n";

static void write_escaped(FILE *f, const char *text)
{
    for (; *text; text++)
        switch (*text) {
        case '<':
            fputs("&lt;", f);
            break;
        case '>':
            fputs("&gt;", f);
            break;
        case '&':
            fputs("&amp;", f);
            break;
        case '"':
            fputs("&quot;", f);
            break;
        default:
            if ((unsigned char)*text >= ' ')
                fputc(*text, f);
        }
}

static void write_number(FILE *f, double value, int decimals)
{
    if (isfinite(value))
        fprintf(f, "<td>%.*f", decimals, value);
    else
        fputs("<td>-", f);
}

static void write_head(FILE *f, const accuracy_report *r)
{
    const accuracy_options *o = r->m->options;
    fputs("<!DOCTYPE html>\n<html lang=en><head><meta charset=utf-8>\n<title>Accuracy: ", f);
    write_escaped(f, o->data[0]);
    fprintf(f, "</title>\n<style>\n%s</style></head><body>\n<h1>What accuracy costs: ", style);
    write_escaped(f, o->data[0]);
    fprintf(f,
            "</h1>\n<p>Pictures of %d x %d pixels from %d view%s, held to the "
            "emission&ndash;absorption integral ",
            o->width, o->height, r->m->view_count, r->m->view_count == 1 ? "" : "s");
    if (o->source) {
        fputs("through the source volume ", f);
        write_escaped(f, o->source);
    } else
        fputs("through the values that the data set stores (what storing loses is in no figure)",
              f);
    fprintf(f,
            ", one ray for each of %d x %d places of a pixel, to a tolerance of %g. Errors are of "
            "255, of red, green, blue (premultiplied) and alpha over the pixels that the object "
            "covers. Load of the machine: %.1f before, %.1f after.</p>\n",
            o->samples, o->samples, o->tolerance, r->load_before, r->load_after);
}

static void write_plots(FILE *f, const accuracy_report *r)
{
    fprintf(f,
            "<h2>Time and error</h2>\n<p><span class='key post' style='background:#1f6fc4'></span>"
            "post<span class=key style='background:#e07b1a'></span>pre"
            "<span class=key style='background:#2a9d4e'></span>gl"
            "<span class=key style='background:#888'></span>reference, integral"
            "<span class=key style='background:#c21f3a'></span>quality"
            "%s. "
            "The line is the front: no setting is both faster and closer.</p>\n",
            r->m->options->program_count || r->m->vtk[0]
                ? "<span class=key style='background:#7b3fa0;border-radius:0'></span>"
                  "another program, with its own light"
                : "");
    accuracy_report_plot(f, r, false);
    accuracy_report_plot(f, r, true);
}

static void write_row(FILE *f, const accuracy_report *r, int i)
{
    const accuracy_row *row = &r->m->rows[i];
    const accuracy_error_figures *e = &r->figures[i][ACCURACY_TOTAL];
    fprintf(f, "<tr%s><td title=\"", r->front[i] ? " class=front" : "");
    if (row->program)
        write_escaped(f, row->program->about);
    else
        accuracy_write_options(f, &row->setting);
    fputs("\">", f);
    write_escaped(f, row->setting.name);
    write_number(f, r->ms[i], 1);
    write_number(f, row->splats / row->views / 1e6, 3);
    write_number(f, row->bytes_read / row->views / 1e6, 2);
    write_number(f, e->max, 1);
    write_number(f, e->mean, 2);
    write_number(f, e->median, 2);
    write_number(f, e->percentile_99, 2);
    write_number(f, e->psnr, 1);
    write_number(f, row->ssim / row->views, 4);
    write_number(f, row->flip / row->views, 4);
    for (int s = ACCURACY_STORAGE; s < ACCURACY_STEPS; s++) {
        const accuracy_error_figures *step = &r->figures[i][s];
        if (row->has[s])
            fprintf(f, "<td>%.2f / %.2f", step->mean, step->percentile_99);
        else
            fputs("<td>-", f);
    }
    fputs("\n", f);
}

static void write_table(FILE *f, const accuracy_report *r)
{
    fputs("<h2>Settings</h2>\n<div class=wide><table><tr><th>settings<th>ms<th>million splats"
          "<th>MB read<th>most<th>mean<th>median<th>99 %<th>PSNR<th>SSIM<th>FLIP<th>storage"
          "<th>model<th>method<th>level<th>precision\n",
          f);
    for (int i = 0; i < r->m->row_count; i++)
        if (r->m->rows[i].state == ACCURACY_MEASURED)
            write_row(f, r, i);
    fputs("</table></div>\n<p>Bold: on the front of the 99th percentile. The last columns are the "
          "steps of the ladder, as mean / 99th percentile: <b>storage</b>, the integral of the "
          "values stored to that of the source; <b>model</b>, the integral of what is drawn (the "
          "sum of splats with pre, values with post) to that of the values stored; <b>method</b>, "
          "the reference in double precision to that: order, sheets, slices, lists, merging; "
          "<b>level</b>, the reference at the levels drawn to that at the finest; "
          "<b>precision</b>, what ran to the reference. Steps do not add up where they make up for "
          "one another. Times are whole frames from the file on, the median of all views; splats "
          "(with post: voxels) and bytes are what a frame read. SSIM is that of Wang et al. (2004) "
          "and FLIP that of Andersson et al. (2020) at 67 pixels a degree, of whole pictures over "
          "black.</p>\n",
          f);
}

static void write_popping(FILE *f, const accuracy_report *r)
{
    bool any = false;
    for (int i = 0; i < r->m->popping_count; i++) {
        const accuracy_popping *p = &r->m->popping[i];
        if (p->state != ACCURACY_MEASURED)
            continue;
        if (!any)
            fprintf(
                f,
                "<h2>Popping</h2>\n<p>The eye goes round the object in %d steps of %g degrees, "
                "through where X and Y are equally near to the ray at the picture's centre. How "
                "much more a pixel changes in a step than in its median step, over the pixels "
                "that change at all, in the step where it is most; <b>motion</b> is the mean of "
                "that median. One list a frame (axis) jumps there; merged lists should not.</p>\n",
                BENCH_POPPING_STEPS, bench_popping_degrees(1) - bench_popping_degrees(0));
        any = true;
        fputs("<figure>\n", f);
        bench_popping_draw(f, p->rows, ACCURACY_POPPING_ROWS);
        fprintf(f, "<figcaption>%s</figcaption></figure>\n", p->name);
    }
}

static void write_figure(FILE *f, const char *name, const char *picture, const char *difference,
                         const accuracy_error_figures *e)
{
    if (!picture || !difference)
        return;
    fprintf(f, "<figure><img alt='' src=\"%s\"><img alt='' src=\"%s\"><figcaption>", picture,
            difference);
    write_escaped(f, name);
    fprintf(f, ": mean %.2f, 99 %% %.2f</figcaption></figure>\n", e->mean, e->percentile_99);
}

static void write_pictures(FILE *f, const accuracy_report *r)
{
    fprintf(
        f,
        "<h2>Pictures of the first view</h2>\n<p>Beside each how far it is from the integral, "
        "the most of a pixel's channels: black is none, white %g of 255 and more; figures are of "
        "all views.</p>\n",
        ACCURACY_DIFFERENCE_MAX);
    if (r->m->truth)
        fprintf(f, "<figure><img alt='' src=\"%s\"><figcaption>integral</figcaption></figure>\n",
                r->m->truth);
    for (int i = 0; i < r->m->row_count; i++) {
        const accuracy_row *row = &r->m->rows[i];
        write_figure(f, row->setting.name, row->picture, row->difference,
                     &r->figures[i][ACCURACY_TOTAL]);
    }
}

static void write_why(FILE *f, const char *name, accuracy_state state, const char *why)
{
    if (state == ACCURACY_MEASURED)
        return;
    fprintf(f, "<li>%s: ", name);
    write_escaped(f, state == ACCURACY_LEFT_OUT ? why : "the seconds given were over");
    fputs("\n", f);
}

static void write_left_out(FILE *f, const accuracy_report *r)
{
    bool any = r->m->view_count < r->m->options->views;
    for (int i = 0; i < r->m->row_count; i++)
        any |= r->m->rows[i].state != ACCURACY_MEASURED;
    for (int i = 0; i < r->m->popping_count; i++)
        any |= r->m->popping[i].state != ACCURACY_MEASURED;
    if (!any)
        return;
    fputs("<h2>Left out</h2>\n<ul>\n", f);
    if (r->m->view_count < r->m->options->views)
        fprintf(f, "<li>views %d to %d: the seconds given were over\n", r->m->view_count + 1,
                r->m->options->views);
    for (int i = 0; i < r->m->row_count; i++)
        write_why(f, r->m->rows[i].setting.name, r->m->rows[i].state, r->m->rows[i].why);
    for (int i = 0; i < r->m->popping_count; i++)
        write_why(f, r->m->popping[i].name, r->m->popping[i].state, r->m->popping[i].why);
    fputs("</ul>\n", f);
}

/* What a shell takes, through the escapes of HTML. */
static void write_commands(FILE *f, const accuracy_report *r)
{
    const accuracy_options *o = r->m->options;
    char *text = NULL;
    size_t bytes;
    FILE *memory = open_memstream(&text, &bytes);
    if (!memory)
        return;
    fprintf(memory, "%s\n\n", r->command);
    for (int i = 0; i < r->m->view_count; i++) {
        fprintf(memory, "view%d=\"", i + 1);
        accuracy_write_view(memory, &r->m->views[i]);
        fprintf(memory, "\" # %s\n", r->m->views[i].name);
    }
    for (int i = 0; i < r->m->row_count; i++) {
        const accuracy_row *row = &r->m->rows[i];
        if (row->state != ACCURACY_MEASURED || row->program)
            continue;
        fputs("triptych render ", memory);
        trip_text_write_word(memory, o->data[row->data]);
        fprintf(memory, " -o %s.exr $view1%s", row->setting.name,
                o->shading ? "" : " --no-shading");
        if (o->tf) {
            fputs(" --tf ", memory);
            trip_text_write_word(memory, o->tf);
        }
        fputc(' ', memory);
        accuracy_write_options(memory, &row->setting);
        fputc('\n', memory);
    }
    fclose(memory);
    fputs("<h2>To repeat</h2>\n<pre>", f);
    for (const char *line = text; line && *line; line++)
        if (*line == '\n')
            fputc('\n', f);
        else
            write_escaped(f, (const char[2]){ *line, 0 });
    fputs("</pre>\n", f);
    free(text);
}

char *accuracy_report_html(const accuracy_report *r)
{
    char *text = NULL;
    size_t bytes;
    FILE *f = open_memstream(&text, &bytes);
    if (!f)
        return NULL;
    write_head(f, r);
    write_plots(f, r);
    write_table(f, r);
    write_popping(f, r);
    write_pictures(f, r);
    write_left_out(f, r);
    write_commands(f, r);
    fputs("</body></html>\n", f);
    if (fclose(f) == 0)
        return text;
    free(text);
    return NULL;
}
