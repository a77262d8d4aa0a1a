#include "bench_finer.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

#include "new_file.h"
#include "report.h"

/* Pixels: the picture, and the margins of the plot. */
enum { WIDTH = 560, HEIGHT = 360, LEFT = 70, RIGHT = 130, TOP = 40, BOTTOM = 50 };

typedef struct plot {
    const bench_finer_row *rows;
    int count;
    int lo, hi; /* powers of two of ms; both axes are logarithmic */
    FILE *file;
} plot;

static double x_of(const plot *p, int i)
{
    return LEFT + (WIDTH - LEFT - RIGHT) * (p->count > 1 ? (double)i / (p->count - 1) : 0.5);
}

static double y_of(const plot *p, double ms)
{
    return HEIGHT - BOTTOM - (HEIGHT - TOP - BOTTOM) * (log2(ms) - p->lo) / (p->hi - p->lo);
}

__attribute__((format(printf, 6, 7))) static void text(const plot *p, double x, double y,
                                                       const char *anchor, const char *colour,
                                                       const char *format, ...)
{
    va_list args;
    fprintf(p->file, "<text x=\"%.1f\" y=\"%.1f\" text-anchor=\"%s\" fill=\"%s\">", x, y, anchor,
            colour);
    va_start(args, format);
    vfprintf(p->file, format, args);
    va_end(args);
    fprintf(p->file, "</text>\n");
}

static void draw_axes(const plot *p)
{
    for (int power = p->lo; power <= p->hi; power++) {
        const double ms = ldexp(1, power), y = y_of(p, ms);
        fprintf(p->file, "<line x1=\"%d\" y1=\"%.1f\" x2=\"%d\" y2=\"%.1f\" stroke=\"#ddd\"/>\n",
                LEFT, y, WIDTH - RIGHT, y);
        text(p, LEFT - 8, y + 4, "end", "#333", "%g", ms);
    }
    for (int i = 0; i < p->count; i++)
        text(p, x_of(p, i), HEIGHT - BOTTOM + 20, "middle", "#333", "%d\302\263",
             p->rows[i].voxels);
    text(p, LEFT, TOP - 16, "end", "#333", "ms per frame");
    text(p, 0.5 * (LEFT + WIDTH - RIGHT), HEIGHT - 8, "middle", "#333", "voxels");
}

static void draw_line(const plot *p, const char *colour, const char *name, bool coarse)
{
    double ms = 0;
    fprintf(p->file, "<polyline fill=\"none\" stroke=\"%s\" stroke-width=\"2\" points=\"", colour);
    for (int i = 0; i < p->count; i++) {
        ms = coarse ? p->rows[i].ms : p->rows[i].fine_ms;
        fprintf(p->file, "%.1f,%.1f ", x_of(p, i), y_of(p, ms));
    }
    fprintf(p->file, "\"/>\n");
    text(p, WIDTH - RIGHT + 8, y_of(p, ms) + 4, "start", colour, "%s", name);
}

static void draw(const plot *p)
{
    fprintf(p->file,
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"%d\" height=\"%d\" "
            "font-family=\"sans-serif\" font-size=\"13\">\n"
            "<rect width=\"100%%\" height=\"100%%\" fill=\"white\"/>\n",
            WIDTH, HEIGHT);
    draw_axes(p);
    draw_line(p, "#b03020", "finest level", false);
    draw_line(p, "#2050b0", "coarse levels", true);
    fprintf(p->file, "</svg>\n");
}

int bench_finer_plot(const char *path, const bench_finer_row *rows, int count)
{
    double min = INFINITY, max = 0;
    char *svg = NULL;
    size_t bytes = 0;
    for (int i = 0; i < count; i++) {
        min = fmin(min, fmin(rows[i].ms, rows[i].fine_ms));
        max = fmax(max, fmax(rows[i].ms, rows[i].fine_ms));
    }
    plot p = { .rows = rows,
               .count = count,
               .lo = (int)floor(log2(min)),
               .hi = (int)floor(log2(max)) + 1,
               .file = open_memstream(&svg, &bytes) };
    if (!p.file)
        return trip_fail(TRIP_ERROR, "bench", path, "out of memory");
    draw(&p);
    int status = fclose(p.file) ? trip_fail(TRIP_ERROR, "bench", path, "out of memory")
                                : trip_new_file_of_text("bench", path, svg);
    free(svg);
    return status;
}
