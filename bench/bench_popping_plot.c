/* Plots the jumps over h from 0 towards 1, then for the methods without h. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "bench_popping.h"
#include "new_file.h"
#include "report.h"

enum { WIDTH = 620, HEIGHT = 380, LEFT = 70, RIGHT = 130, TOP = 44, BOTTOM = 56 };

static const double min = 0.01; /* of 255; smaller changes are drawn here */

typedef struct curve {
    const char *name, *colour;
    double (*of)(const bench_popping_row *row);
} curve;

static double max_of(const bench_popping_row *r)
{
    return r->max;
}

static double percentile_99_of(const bench_popping_row *r)
{
    return r->percentile_99;
}

static double mean_of(const bench_popping_row *r)
{
    return r->mean;
}

static double motion_of(const bench_popping_row *r)
{
    return r->motion;
}

static const curve curves[] = {
    { "max", "#b03020", max_of },
    { "99 %", "#c08010", percentile_99_of },
    { "mean", "#2050b0", mean_of },
    { "motion", "#777", motion_of },
};

enum { CURVES = sizeof curves / sizeof *curves };

typedef struct plot {
    const bench_popping_row *rows;
    int count;
    int lo, hi; /* powers of ten, of 255 */
    FILE *file;
} plot;

static double x_of(const plot *p, int i)
{
    return LEFT + (WIDTH - LEFT - RIGHT) * (p->count > 1 ? (double)i / (p->count - 1) : 0.5);
}

static double y_of(const plot *p, double change)
{
    double share = (log10(fmax(min, change)) - p->lo) / (p->hi - p->lo);
    return HEIGHT - BOTTOM - (HEIGHT - TOP - BOTTOM) * share;
}

static void text(const plot *p, double x, double y, const char *anchor, const char *colour,
                 const char *stage)
{
    fprintf(p->file, "<text x=\"%.1f\" y=\"%.1f\" text-anchor=\"%s\" fill=\"%s\">%s</text>\n", x, y,
            anchor, colour, stage);
}

static void draw_axes(const plot *p)
{
    char label[32];
    for (int power = p->lo; power <= p->hi; power++) {
        const double y = y_of(p, pow(10, power));
        fprintf(p->file, "<line x1=\"%d\" y1=\"%.1f\" x2=\"%d\" y2=\"%.1f\" stroke=\"#ddd\"/>\n",
                LEFT, y, WIDTH - RIGHT, y);
        snprintf(label, sizeof label, power == p->lo ? "\342\211\244 %g" : "%g", pow(10, power));
        text(p, LEFT - 8, y + 4, "end", "#333", label);
    }
    for (int i = 0; i < p->count; i++)
        text(p, x_of(p, i), HEIGHT - BOTTOM + 20, "middle", "#333", p->rows[i].label);
    text(p, 8, TOP - 20, "start", "#333", "change of a pixel beyond the motion, of 255");
    text(p, 0.5 * (LEFT + WIDTH - RIGHT), HEIGHT - 10, "middle", "#333",
         "merge by h, then the other methods");
}

/* Draws a line through the rows with an h, and a mark for every row. */
static void draw_curve(const plot *p, const curve *c)
{
    fprintf(p->file, "<polyline fill=\"none\" stroke=\"%s\" stroke-width=\"2\" points=\"",
            c->colour);
    for (int i = 0; i < p->count; i++)
        if (p->rows[i].has_h)
            fprintf(p->file, "%.1f,%.1f ", x_of(p, i), y_of(p, c->of(&p->rows[i])));
    fprintf(p->file, "\"/>\n");
    for (int i = 0; i < p->count; i++)
        fprintf(p->file, "<circle cx=\"%.1f\" cy=\"%.1f\" r=\"4\" fill=\"%s\"/>\n", x_of(p, i),
                y_of(p, c->of(&p->rows[i])), c->colour);
}

/* Writes the names beside the last marks, one below the other if the marks are close. */
static void draw_names(const plot *p)
{
    double last = -INFINITY;
    bool done[CURVES] = { false };
    for (int n = 0; n < CURVES; n++) {
        int next = -1;
        for (int c = 0; c < CURVES; c++)
            if (!done[c] && (next < 0 || curves[c].of(&p->rows[p->count - 1]) >
                                             curves[next].of(&p->rows[p->count - 1])))
                next = c;
        double y = fmax(y_of(p, curves[next].of(&p->rows[p->count - 1])) + 4, last + 15);
        text(p, WIDTH - RIGHT + 12, y, "start", curves[next].colour, curves[next].name);
        done[next] = true;
        last = y;
    }
}

void bench_popping_draw(FILE *f, const bench_popping_row *rows, int count)
{
    double max = 10 * min;
    for (int i = 0; i < count; i++)
        max = fmax(max, fmax(rows[i].max, rows[i].motion));
    const plot p = { .rows = rows,
                     .count = count,
                     .lo = (int)floor(log10(min)),
                     .hi = (int)ceil(log10(max)),
                     .file = f };
    fprintf(f,
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"%d\" height=\"%d\" "
            "font-family=\"sans-serif\" font-size=\"13\">\n"
            "<rect width=\"100%%\" height=\"100%%\" fill=\"white\"/>\n",
            WIDTH, HEIGHT);
    draw_axes(&p);
    for (int c = CURVES - 1; c >= 0; c--)
        draw_curve(&p, &curves[c]);
    draw_names(&p);
    fprintf(f, "</svg>\n");
}

int bench_popping_plot(const char *path, const bench_popping_row *rows, int count)
{
    char *svg = NULL;
    size_t bytes = 0;
    FILE *f = open_memstream(&svg, &bytes);
    if (!f)
        return trip_fail(TRIP_ERROR, "bench", path, "out of memory");
    bench_popping_draw(f, rows, count);
    int status = fclose(f) ? trip_fail(TRIP_ERROR, "bench", path, "out of memory")
                           : trip_new_file_of_text("bench", path, svg);
    free(svg);
    return status;
}
