/* index.html: a self-contained page with all tables, plots and pictures. */
#include <math.h>
#include <stdlib.h>

#include "picture_data.h"
#include "accuracy_report.h"
#include "text.h"

const char accuracy_page_style[] =
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
    "svg{max-width:100%;height:auto;display:block}\n";

static void write_head(FILE *f, const accuracy_report *r)
{
    const accuracy_options *o = r->m->options;
    fputs("<!DOCTYPE html>\n<html lang=en><head><meta charset=utf-8>\n<title>Accuracy: ", f);
    measure_write_escaped(f, o->data[0]);
    fprintf(f, "</title>\n<style>\n%s</style></head><body>\n<h1>Accuracy and time: ",
            accuracy_page_style);
    measure_write_escaped(f, o->data[0]);
    fprintf(f,
            "</h1>\n<p>Pictures of %d x %d pixels from %d view%s, compared with the "
            "emission&ndash;absorption integral ",
            o->width, o->height, r->m->view_count, r->m->view_count == 1 ? "" : "s");
    if (o->source) {
        fputs("through the source volume ", f);
        measure_write_escaped(f, o->source);
    } else
        fputs("through the values in the data set (no figure includes the error of storing)", f);
    fprintf(
        f,
        ". The exact picture has the mean of the integral over the area of each pixel (box "
        "filter), with a tolerance of %g. Integrals along rays have a tolerance of %g. Errors "
        "are differences of red, green, blue (premultiplied) and alpha, of 255, over the pixels "
        "that the object covers. Load of the machine: %.1f before, %.1f after.</p>\n",
        o->tolerance, fmin(o->tolerance, ACCURACY_RAY_TOLERANCE), r->load_before, r->load_after);
}

static void write_svg(FILE *f, char *svg)
{
    fputs(svg ? svg : "", f);
    free(svg);
}

static void write_plots(FILE *f, const accuracy_report *r)
{
    fputs("<h2>Time and error</h2>\n<p>The line is the front: no other setting is both faster and "
          "closer to the exact picture.</p>\n",
          f);
    write_svg(
        f, accuracy_report_plot(r->shown, "error", "error of 255, 99 % of the pixels, worst view"));
    write_svg(f, accuracy_report_plot(r->shown, "total.mean", "mean error of 255"));
}

static void write_table(FILE *f, const accuracy_report *r)
{
    static const measure_column columns[] = {
        { "name", "settings", 0, 0 },        { "ms", "ms", 1, 0 },
        { "error", "error", 2, 0 },          { "splats", "million splats", 3, 1e6 },
        { "bytes_read", "MB read", 2, 1e6 }, { "total.max", "max", 1, 0 },
        { "total.mean", "mean", 2, 0 },      { "promise", "promise", 1, 0 },
        { "total.median", "median", 2, 0 },  { "total.percentile_99", "99 %", 2, 0 },
        { "total.psnr", "PSNR", 1, 0 },      { "total.ssim", "SSIM", 4, 0 },
        { "total.flip", "FLIP", 4, 0 },      { "pixel", "pixel", 2, 0 },
        { "rays", "along rays", 2, 0 },      { "storage", "storage", 2, 0 },
        { "model", "model", 2, 0 },          { "method", "method", 2, 0 },
        { "level", "level", 2, 0 },          { "precision", "precision", 2, 0 },
    };
    fputs("<h2>Settings</h2>\n", f);
    measure_table_html(f, &(measure_table){ .rows = r->shown,
                                            .columns = columns,
                                            .count = sizeof columns / sizeof *columns,
                                            .mark = "front",
                                            .tips = { "options", "version" } });
    fputs("<p><b>error</b> is the figure of render --error: 99 % of the pixels of the object "
          "are at most this far from the exact picture, of 255, in red, green, blue and opacity, "
          "in the "
          "worst view. Every setting that is faster than a bold one has a larger error. The other "
          "figures are over all views together, and over all channels. <b>promise</b> is the "
          "mean that a quality promises. The last columns split the "
          "error into steps, as mean / 99th percentile. <b>pixel</b> compares the integral along "
          "the rays of the setting with the exact picture. Only more rays per pixel make it "
          "smaller. <b>along rays</b> compares the picture with the integral along the same rays. "
          "Without --steps, only settings with one ray per pixel have these two figures. A quality "
          "chooses its rays by itself and has no steps. The other steps divide the error along "
          "the rays. <b>storage</b> compares "
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
    const cJSON *popping = cJSON_GetObjectItem(r->json, "popping"), *one;
    if (popping->child)
        fprintf(f,
                "<h2>Popping</h2>\n<p>The eye turns around the object in %d steps of %g degrees, "
                "through the direction with X and Y equally close to the central ray. The median "
                "change of a pixel over all steps is its <b>motion</b>. A jump is the change of a "
                "pixel in one step minus its motion. The figures are of 255, over the pixels that "
                "change, in the step with the largest jumps. A single list per frame (axis) jumps "
                "at the change of the axis; merged lists should not.</p>\n",
                MEASURE_POPPING_STEPS, MEASURE_POPPING_DEGREES);
    cJSON_ArrayForEach(one, popping)
    {
        fputs("<figure>\n", f);
        write_svg(f, measure_popping_svg(one));
        fprintf(f, "<figcaption>%s</figcaption></figure>\n", one->string);
    }
}

static void write_figure(FILE *f, const char *name, const char *picture, const char *difference,
                         measure_error_figures e)
{
    if (!picture || !difference)
        return;
    fprintf(f, "<figure><img alt='' src=\"%s\"><img alt='' src=\"%s\"><figcaption>", picture,
            difference);
    measure_write_escaped(f, name);
    fprintf(f, ": mean %.2f, 99 %% %.2f</figcaption></figure>\n", e.mean, e.percentile_99);
}

static void write_pictures(FILE *f, const accuracy_report *r)
{
    fprintf(
        f,
        "<h2>Pictures of the first view</h2>\n<p>Beside each picture is its difference from "
        "the exact picture, the maximum over the channels of a pixel: black is 0, and white is %g "
        "of 255 or more. The figures are over all views.</p>\n",
        ACCURACY_DIFFERENCE_MAX);
    if (r->m->truth)
        fprintf(f,
                "<figure><img alt='' src=\"%s\"><figcaption>exact picture</figcaption></figure>\n",
                r->m->truth);
    for (int i = 0; i < r->m->row_count; i++) {
        const accuracy_row *row = &r->m->rows[i];
        write_figure(f, row->setting.name, row->picture, row->difference,
                     measure_error_measure(&row->error[ACCURACY_TOTAL]));
    }
}

static void write_left_out(FILE *f, const accuracy_report *r)
{
    if (r->m->view_count == r->m->options->views &&
        !cJSON_GetObjectItem(r->json, "left_out")->child)
        return;
    fputs("<h2>Left out</h2>\n<ul>\n", f);
    accuracy_print_left_out(f, r, "<li>", measure_write_escaped);
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
    measure_write_escaped(f, text ? text : "");
    fputs("</pre>\n", f);
    free(text);
}

void accuracy_report_html(FILE *f, const accuracy_report *r)
{
    write_head(f, r);
    write_plots(f, r);
    write_table(f, r);
    write_popping(f, r);
    write_pictures(f, r);
    write_left_out(f, r);
    write_commands(f, r);
    fputs("</body></html>\n", f);
}
