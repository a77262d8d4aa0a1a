#include "plot.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "new_file.h"
#include "report.h"
#include "table.h"

/* Margins in pixels, and the mean width of a character. */
enum { LEFT = 72, RIGHT = 24, TOP = 40, BOTTOM = 48, BOXES_MAX = 512 };
static const double character_px = 6.8;

typedef struct box {
    double x0, y0, x1, y1;
} box;

/* An axis in pixels: from the lowest to the highest decimal logarithm. */
typedef struct axis {
    double lo, hi, first_px, last_px;
} axis;

typedef struct drawing {
    const measure_plot *plot;
    FILE *f;
    axis x, y;
    box taken[BOXES_MAX]; /* keeps labels apart from marks, lines and other labels */
    int taken_count;
} drawing;

static double along(const axis *a, double value)
{
    return a->first_px + (log10(value) - a->lo) / (a->hi - a->lo) * (a->last_px - a->first_px);
}

static double x_of(const drawing *d, double x)
{
    const double width = d->x.last_px - d->x.first_px;
    return d->plot->names ? d->x.first_px + (x + 0.5) / d->plot->name_count * width
                          : along(&d->x, x);
}

static double y_of(const drawing *d, double y)
{
    return along(&d->y, fmax(y, d->plot->y_min));
}

/* ---- axes ---- */

static void include(axis *a, double value, double margin)
{
    a->lo = fmin(a->lo, log10(value) - 0.1);
    a->hi = fmax(a->hi, log10(value) + margin);
}

/* Includes all points, and at least half a decade, which has two ticks or more. */
static void find_edges(drawing *d)
{
    const measure_plot *p = d->plot;
    d->x = (axis){ INFINITY, -INFINITY, LEFT, p->width - RIGHT };
    d->y = (axis){ INFINITY, -INFINITY, p->height - BOTTOM, TOP };
    for (int s = 0; s < p->count; s++)
        for (int i = 0; i < p->series[s].count; i++) {
            if (!p->names)
                include(&d->x, p->series[s].points[i].x, 0.25);
            include(&d->y, fmax(p->series[s].points[i].y, p->y_min), 0.1);
        }
    for (axis *a = &d->x; a; a = a == &d->x ? &d->y : NULL) {
        const double more = fmax(0, 0.8 - (a->hi - a->lo)) / 2;
        a->lo = isfinite(a->lo) ? a->lo - more : 0;
        a->hi = isfinite(a->hi) ? a->hi + more : 1;
    }
}

static void write_text(const drawing *d, double x, double y, const char *anchor, const char *text)
{
    fprintf(d->f, "<text x='%.1f' y='%.1f' text-anchor='%s'>", x, y, anchor);
    measure_write_escaped(d->f, text);
    fputs("</text>\n", d->f);
}

static void draw_segment(const drawing *d, const char *colour, double x0, double y0, double x1,
                         double y1)
{
    fprintf(d->f, "<path stroke='%s' d='M%.1f %.1f L%.1f %.1f'/>\n", colour, x0, y0, x1, y1);
}

static void draw_tick(const drawing *d, const axis *a, double value)
{
    const bool is_y = a == &d->y;
    const double at = along(a, value);
    char text[32];
    if (log10(value) < a->lo || log10(value) > a->hi)
        return;
    const bool lowest = is_y && fabs(value / d->plot->y_min - 1) < 1e-9;
    snprintf(text, sizeof text, lowest ? "\342\211\244 %g" : "%g", value);
    if (is_y) {
        draw_segment(d, "#e0e0e0", d->x.first_px, at, d->x.last_px, at);
        write_text(d, LEFT - 6, at + 4, "end", text);
    } else {
        draw_segment(d, "#e0e0e0", at, d->y.last_px, at, d->y.first_px);
        write_text(d, at, d->y.first_px + 18, "middle", text);
    }
}

/* Draws ticks at powers of ten, and at 2 and 5 times these if there is room. */
static void draw_ticks(const drawing *d, const axis *a)
{
    static const double steps[] = { 1, 2, 5 };
    const double decade_px = fabs(a->last_px - a->first_px) / (a->hi - a->lo);
    const int count = decade_px > (a == &d->y ? 70 : 130) ? 3 : 1;
    for (int decade = -6; decade < 9; decade++)
        for (int k = 0; k < count; k++)
            draw_tick(d, a, steps[k] * pow(10, decade));
}

static void draw_axes(const drawing *d)
{
    const measure_plot *p = d->plot;
    draw_ticks(d, &d->y);
    if (!p->names)
        draw_ticks(d, &d->x);
    for (int i = 0; i < p->name_count; i++)
        write_text(d, x_of(d, i), d->y.first_px + 18, "middle", p->names[i]);
    draw_segment(d, "#999", d->x.first_px, d->y.first_px, d->x.last_px, d->y.first_px);
    draw_segment(d, "#999", d->x.first_px, d->y.first_px, d->x.first_px, d->y.last_px);
    write_text(d, (d->x.first_px + d->x.last_px) / 2, p->height - 10, "middle", p->x_title);
    fprintf(d->f, "<text transform='translate(14 %.1f) rotate(-90)' text-anchor='middle'>",
            (d->y.first_px + d->y.last_px) / 2);
    measure_write_escaped(d->f, p->y_title);
    fputs("</text>\n", d->f);
}

/* ---- series ---- */

static void take(drawing *d, double x0, double y0, double x1, double y1)
{
    if (d->taken_count < BOXES_MAX)
        d->taken[d->taken_count++] =
            (box){ fmin(x0, x1) - 1, fmin(y0, y1) - 1, fmax(x0, x1) + 1, fmax(y0, y1) + 1 };
}

static void draw_line(drawing *d, const measure_series *s)
{
    double last_x = 0, last_y = 0;
    fprintf(d->f, "<path fill='none' stroke='%s' stroke-width='%g' d='", s->colour,
            s->steps ? 1.2 : 2);
    for (int i = 0; i < s->joined && i < s->count; i++) {
        const double x = x_of(d, s->points[i].x), y = y_of(d, s->points[i].y);
        fprintf(d->f, i == 0 ? "M%.1f %.1f" : s->steps ? " H%.1f V%.1f" : " L%.1f %.1f", x, y);
        if (i > 0 && s->steps) {
            take(d, last_x, last_y, x, last_y);
            take(d, x, last_y, x, y);
        }
        last_x = x;
        last_y = y;
    }
    fputs("'/>\n", d->f);
}

/* Draws a mark with an open tag, for a title. */
static void begin_mark(const drawing *d, const measure_series *s, double x, double y, double radius)
{
    if (s->square)
        fprintf(d->f, "<rect fill='%s' stroke='#fff' x='%.1f' y='%.1f' width='%g' height='%g'>",
                s->colour, x - radius, y - radius, 2 * radius, 2 * radius);
    else
        fprintf(d->f, "<circle fill='%s' stroke='#fff' cx='%.1f' cy='%.1f' r='%g'>", s->colour, x,
                y, radius);
}

static void draw_marks(drawing *d, const measure_series *s)
{
    for (int i = 0; i < s->count && !s->steps; i++) {
        const measure_point *p = &s->points[i];
        const double x = x_of(d, p->x), y = y_of(d, p->y);
        begin_mark(d, s, x, y, p->large ? 6 : 4.5);
        fputs("<title>", d->f);
        measure_write_escaped(d->f, p->label ? p->label : s->name);
        if (d->plot->names)
            fprintf(d->f, ", %s: %.3g</title>", d->plot->names[(int)p->x], p->y);
        else
            fprintf(d->f, ": %.3g, %.3g</title>", p->x, p->y);
        fputs(s->square ? "</rect>\n" : "</circle>\n", d->f);
        take(d, x - 4, y - 4, x + 4, y + 4);
    }
}

/* Writes the names of all series above the plot. */
static void draw_legend(const drawing *d)
{
    double x = LEFT;
    for (int i = 0; i < d->plot->count; i++) {
        const measure_series *s = &d->plot->series[i];
        if (s->count == 0)
            continue;
        if (s->steps) {
            draw_segment(d, s->colour, x - 7, 16, x + 7, 16);
        } else {
            begin_mark(d, s, x, 16, 5);
            fputs(s->square ? "</rect>\n" : "</circle>\n", d->f);
        }
        write_text(d, x + 10, 20, "start", s->name);
        x += 36 + character_px * (double)strlen(s->name);
    }
}

/* ---- labels ---- */

static bool is_free(const drawing *d, box b)
{
    for (int i = 0; i < d->taken_count; i++) {
        const box *t = &d->taken[i];
        if (b.x0 < t->x1 && b.x1 > t->x0 && b.y0 < t->y1 && b.y1 > t->y0)
            return false;
    }
    return b.x0 >= LEFT && b.x1 <= d->plot->width && b.y0 >= TOP - 14 && b.y1 <= d->y.first_px;
}

/* Draws a line from a mark to its label, unless the label is beside the mark. */
static void draw_leader(const drawing *d, double x, double y, box b)
{
    const double to_x = fmin(fmax(x, b.x0), b.x1), to_y = y < b.y0 ? b.y0 : b.y1;
    if (hypot(to_x - x, to_y - y) > 14)
        draw_segment(d, "#bbb", x, y, to_x, to_y);
}

/* Writes a label as near to its mark as there is room. Without room, only the mark's title has
 * it. */
static void write_label(drawing *d, const measure_point *p)
{
    const double x = x_of(d, p->x), y = y_of(d, p->y);
    const double width = character_px * (double)strlen(p->label);
    for (int ring = 0; ring < 5; ring++) {
        const double up = -4 - 14 * ring, down = 14 + 14 * ring;
        const double positions[][2] = { { 8, up },
                                        { 8, down },
                                        { -8 - width, up },
                                        { -8 - width, down },
                                        { -width / 2, up - 6 },
                                        { -width / 2, down + 6 } };
        for (size_t i = 0; i < sizeof positions / sizeof *positions; i++) {
            const double left = x + positions[i][0], base = y + positions[i][1];
            const box b = { left, base - 10, left + width, base + 2 };
            if (!is_free(d, b))
                continue;
            take(d, b.x0, b.y0, b.x1, b.y1);
            draw_leader(d, x, y, b);
            write_text(d, left, base, "start", p->label);
            return;
        }
    }
}

static void write_labels(drawing *d)
{
    for (int rank = 0; rank < 3; rank++)
        for (int s = 0; s < d->plot->count; s++)
            for (int i = 0; i < d->plot->series[s].count; i++) {
                const measure_point *p = &d->plot->series[s].points[i];
                if (p->label && p->rank == rank)
                    write_label(d, p);
            }
}

char *measure_plot_svg(const measure_plot *p)
{
    char *svg = NULL;
    size_t bytes;
    drawing *d = calloc(1, sizeof *d);
    if (!d || !(d->f = open_memstream(&svg, &bytes))) {
        free(d);
        return NULL;
    }
    d->plot = p;
    find_edges(d);
    fprintf(d->f,
            "<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 %d %d' width='%d' height='%d' "
            "role='img' font-family='system-ui,sans-serif' font-size='12' fill='#333'>\n"
            "<rect width='100%%' height='100%%' fill='#fff'/>\n",
            p->width, p->height, p->width, p->height);
    draw_axes(d);
    for (int i = 0; i < p->count; i++)
        draw_line(d, &p->series[i]);
    for (int i = p->count - 1; i >= 0; i--)
        draw_marks(d, &p->series[i]);
    draw_legend(d);
    write_labels(d);
    fputs("</svg>\n", d->f);
    const bool whole = fclose(d->f) == 0;
    free(d);
    if (whole)
        return svg;
    free(svg);
    return NULL;
}

char *measure_plot_rows(const measure_plot *p, const cJSON *rows, const measure_curve *curves,
                        int count, int joined)
{
    measure_plot plot = *p;
    measure_series *series = calloc((size_t)count, sizeof *series);
    measure_point *points = calloc((size_t)count * (size_t)p->name_count, sizeof *points);
    for (int c = 0; series && points && c < count; c++) {
        measure_point *own = &points[c * p->name_count];
        const cJSON *row = rows->child;
        for (int i = 0; i < p->name_count; i++, row = row->next)
            own[i] = (measure_point){ .x = i, .y = measure_number(row, curves[c].key) };
        series[c] = (measure_series){ .name = curves[c].name,
                                      .colour = curves[c].colour,
                                      .points = own,
                                      .count = p->name_count,
                                      .joined = joined };
    }
    plot.series = series;
    plot.count = count;
    char *svg = series && points ? measure_plot_svg(&plot) : NULL;
    free(series);
    free(points);
    return svg;
}

int measure_plot_save(char *svg, const char *path)
{
    int status = svg ? trip_new_file_of_text("bench", path, svg)
                     : trip_fail(TRIP_ERROR, "bench", path, "out of memory");
    free(svg);
    return status;
}
