/* index.html: a self-contained page with all tables, plots and pictures. */
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
    fprintf(f, "</title>\n<style>\n%s</style></head><body>\n<h1>Accuracy and time: ", style);
    write_escaped(f, o->data[0]);
    fprintf(f,
            "</h1>\n<p>Pictures of %d x %d pixels from %d view%s, compared with the "
            "emission&ndash;absorption integral ",
            o->width, o->height, r->m->view_count, r->m->view_count == 1 ? "" : "s");
    if (o->source) {
        fputs("through the source volume ", f);
        write_escaped(f, o->source);
    } else
        fputs("through the values in the data set (no figure includes the error of storing)", f);
    fprintf(f,
            ". The integral has %d x %d rays per pixel and a tolerance of %g. Errors are "
            "differences of red, green, blue (premultiplied) and alpha, of 255, over the pixels "
            "that the object covers. Load of the machine: %.1f before, %.1f after.</p>\n",
            o->samples, o->samples, o->tolerance, r->load_before, r->load_after);
}

static void write_plots(FILE *f, const accuracy_report *r)
{
    fprintf(f,
            "<h2>Time and error</h2>\n<p><span class='key post' "
            "style='background:#1f6fc4'></span>post<span class=key "
            "style='background:#e07b1a'></span>pre<span class=key "
            "style='background:#2a9d4e'></span>gl<span class=key "
            "style='background:#888'></span>reference, integral<span class=key "
            "style='background:#c21f3a'></span>quality%s. The line is the front: no other setting "
            "is both faster and closer to the integral.</p>\n",
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
    fputs("<h2>Settings</h2>\n<div class=wide><table><tr><th>settings<th>ms<th>million "
          "splats<th>MB read<th>max<th>mean<th>median<th>99 "
          "%<th>PSNR<th>SSIM<th>FLIP<th>storage<th>model<th>method<th>level<th>precision\n",
          f);
    for (int i = 0; i < r->m->row_count; i++)
        if (r->m->rows[i].state == ACCURACY_MEASURED)
            write_row(f, r, i);
    fputs("</table></div>\n<p>Bold settings are on the front of the 99th percentile. The last "
          "columns split the error into steps, as mean / 99th percentile. <b>storage</b> compares "
          "the integral of the stored values with the integral of the source. <b>model</b> "
          "compares the integral of the drawn field (the sum of splats with pre, values with post) "
          "with the integral of the stored values. <b>method</b> compares the reference in double "
          "precision with the integral of the drawn field: order, sheets, samples, lists and "
          "merging. <b>level</b> compares the reference at the drawn levels with the reference at "
          "the finest level. <b>precision</b> compares the picture with the reference. The steps "
          "do not add up where errors cancel each other. Times are medians of whole frames, "
          "including reading, over all views. Splats (voxels with post) and bytes are read per "
          "frame. SSIM (Wang et al. 2004) and FLIP (Andersson et al. 2020, at 67 pixels per "
          "degree) are over whole pictures on black.</p>\n",
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
                "<h2>Popping</h2>\n<p>The eye turns around the object in %d steps of %g degrees, "
                "through the direction with X and Y equally close to the central ray. The median "
                "change of a pixel over all steps is its <b>motion</b>. A jump is the change of a "
                "pixel in one step minus its motion. The figures are of 255, over the pixels that "
                "change, in the step with the largest jumps. A single list per frame (axis) jumps "
                "at the change of the axis; merged lists should not.</p>\n",
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
    fprintf(f,
            "<h2>Pictures of the first view</h2>\n<p>Beside each picture is its difference from "
            "the integral, the maximum over the channels of a pixel: black is 0, and white is %g "
            "of 255 or more. The figures are over all views.</p>\n",
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
    write_escaped(f, state == ACCURACY_LEFT_OUT ? why : "--budget was used up");
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
        fprintf(f, "<li>views %d to %d: --budget was used up\n", r->m->view_count + 1,
                r->m->options->views);
    for (int i = 0; i < r->m->row_count; i++)
        write_why(f, r->m->rows[i].setting.name, r->m->rows[i].state, r->m->rows[i].why);
    for (int i = 0; i < r->m->popping_count; i++)
        write_why(f, r->m->popping[i].name, r->m->popping[i].state, r->m->popping[i].why);
    fputs("</ul>\n", f);
}

/* Writes the shell commands that repeat the measurement, with the characters of HTML escaped. */
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
    fputs("<h2>Commands</h2>\n<pre>", f);
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
