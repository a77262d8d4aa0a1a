/* A plot of time and error, both logarithmic. A line connects the settings on the front. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "accuracy_report.h"

enum { WIDTH = 860, HEIGHT = 480, LEFT = 64, RIGHT = 20, TOP = 16, BOTTOM = 48, LABELS_MAX = 256 };

static const double min_error = 0.01; /* smaller errors are drawn at this one */

typedef struct box {
    double x0, y0, x1, y1;
} box;

typedef struct plot {
    FILE *f;
    const accuracy_report *r;
    bool mean;
    double x0, x1, y0, y1; /* decimal logarithms at the edges */
    box taken[LABELS_MAX];
    int taken_count;
} plot;

static bool is_shown(const plot *p, int i)
{
    return p->r->m->rows[i].state == ACCURACY_MEASURED;
}

static double error_of(const plot *p, const accuracy_error_figures *f)
{
    return fmax(min_error, p->mean ? f->mean : f->percentile_99);
}

static double row_error(const plot *p, int i)
{
    return error_of(p, &p->r->figures[i][ACCURACY_TOTAL]);
}

static void include(plot *p, double ms, double error)
{
    p->x0 = fmin(p->x0, log10(ms) - 0.1);
    p->x1 = fmax(p->x1, log10(ms) + 0.25);
    p->y0 = fmin(p->y0, log10(error) - 0.1);
    p->y1 = fmax(p->y1, log10(error) + 0.1);
}

static void find_edges(plot *p)
{
    p->x0 = p->y0 = INFINITY;
    p->x1 = p->y1 = -INFINITY;
    for (int i = 0; i < p->r->m->row_count; i++)
        if (is_shown(p, i))
            include(p, p->r->ms[i], row_error(p, i));
}

static double position_x(const plot *p, double ms)
{
    return LEFT + (log10(ms) - p->x0) / (p->x1 - p->x0) * (WIDTH - LEFT - RIGHT);
}

static double position_y(const plot *p, double error)
{
    return HEIGHT - BOTTOM - (log10(error) - p->y0) / (p->y1 - p->y0) * (HEIGHT - TOP - BOTTOM);
}

/* Draws lines at 1, 2 and 5 times each power of ten between the edges. */
static void draw_ticks(const plot *p)
{
    static const double steps[] = { 1, 2, 5 };
    for (int decade = -4; decade < 8; decade++)
        for (int k = 0; k < 3; k++) {
            double value = steps[k] * pow(10, decade), x = position_x(p, value),
                   y = position_y(p, value);
            if (log10(value) >= p->x0 && log10(value) <= p->x1)
                fprintf(p->f,
                        "<path class=grid d='M%.1f %d V%d'/><text x='%.1f' y='%d' "
                        "text-anchor='middle'>%g</text>\n",
                        x, TOP, HEIGHT - BOTTOM, x, HEIGHT - BOTTOM + 16, value);
            if (log10(value) >= p->y0 && log10(value) <= p->y1)
                fprintf(p->f,
                        "<path class=grid d='M%d %.1f H%d'/><text x='%d' y='%.1f' "
                        "text-anchor='end'>%g</text>\n",
                        LEFT, y, WIDTH - RIGHT, LEFT - 6, y + 4, value);
        }
    fprintf(p->f,
            "<text x='%d' y='%d' text-anchor='middle'>median ms per frame</text>\n<text "
            "transform='translate(16 %d) rotate(-90)' text-anchor='middle'>%s</text>\n",
            (LEFT + WIDTH - RIGHT) / 2, HEIGHT - 10, (TOP + HEIGHT - BOTTOM) / 2,
            p->mean ? "mean error of 255" : "error of 255, 99th percentile");
}

/* Returns the family of a setting, which selects its colour. */
static const char *family(const char *name)
{
    static const struct {
        const char *prefix, *family;
    } families[] = { { "quality", "quality" }, { "gl", "gl" },     { "reference", "slow" },
                     { "integral", "slow" },   { "post", "post" }, { "pre", "pre" } };
    for (size_t i = 0; i < sizeof families / sizeof *families; i++)
        if (!strncmp(name, families[i].prefix, strlen(families[i].prefix)))
            return families[i].family;
    return "pre";
}

static bool overlaps(const plot *p, box b)
{
    for (int i = 0; i < p->taken_count; i++) {
        const box *t = &p->taken[i];
        if (b.x0 < t->x1 && b.x1 > t->x0 && b.y0 < t->y1 && b.y1 > t->y0)
            return true;
    }
    return b.x0 < LEFT || b.x1 > WIDTH || b.y0 < 0 || b.y1 > HEIGHT - BOTTOM;
}

static void take(plot *p, box b)
{
    if (p->taken_count < LABELS_MAX)
        p->taken[p->taken_count++] = b;
}

/* Keeps names away from a segment of the front's line. */
static void take_line(plot *p, double x0, double y0, double x1, double y1)
{
    take(p, (box){ fmin(x0, x1) - 1, fmin(y0, y1) - 1, fmax(x0, x1) + 1, fmax(y0, y1) + 1 });
}

static void draw_front(plot *p)
{
    const bool *front = p->mean ? p->r->front_of_mean : p->r->front;
    bool begun = false;
    double last = -INFINITY, before_x = 0, before_y = 0;
    fputs("<path class=front d='", p->f);
    for (;;) {
        int next = -1;
        for (int i = 0; i < p->r->m->row_count; i++)
            if (front[i] && p->r->ms[i] > last && (next < 0 || p->r->ms[i] < p->r->ms[next]))
                next = i;
        if (next < 0)
            break;
        double x = position_x(p, p->r->ms[next]), y = position_y(p, row_error(p, next));
        fprintf(p->f, begun ? " H%.1f V%.1f" : "M%.1f %.1f", x, y);
        if (begun) {
            take_line(p, before_x, before_y, x, before_y);
            take_line(p, x, before_y, x, y);
        }
        begun = true;
        before_x = x;
        before_y = y;
        last = p->r->ms[next];
    }
    fputs("'/>\n", p->f);
}

/* Draws a line from a mark to its name, unless the name is beside the mark. */
static void draw_leader(const plot *p, double x, double y, box b)
{
    double to_x = fmin(fmax(x, b.x0), b.x1), to_y = y < b.y0 ? b.y0 : b.y1;
    if (hypot(to_x - x, to_y - y) > 14)
        fprintf(p->f, "<path class=leader d='M%.1f %.1f L%.1f %.1f'/>\n", x, y, to_x, to_y);
}

/* Writes a name as near to its mark as there is room. Without room, only the mark's title has the
 * name. */
static void write_label(plot *p, double x, double y, const char *name)
{
    const double width = 6.4 * (double)strlen(name), height = 12;
    for (int ring = 0; ring < 5; ring++) {
        const double up = -4 - 14 * ring, down = 14 + 14 * ring;
        const double positions[][2] = { { 8, up },
                                        { 8, down },
                                        { -8 - width, up },
                                        { -8 - width, down },
                                        { -width / 2, up - 6 },
                                        { -width / 2, down + 6 } };
        for (size_t i = 0; i < sizeof positions / sizeof *positions; i++) {
            box b = { x + positions[i][0], y + positions[i][1] - height + 2,
                      x + positions[i][0] + width, y + positions[i][1] + 2 };
            if (overlaps(p, b))
                continue;
            take(p, b);
            draw_leader(p, x, y, b);
            fprintf(p->f, "<text x='%.1f' y='%.1f'>%s</text>\n", b.x0, b.y1 - 2, name);
            return;
        }
    }
}

static void draw_rows(plot *p)
{
    const bool *front = p->mean ? p->r->front_of_mean : p->r->front;
    for (int i = 0; i < p->r->m->row_count; i++) {
        if (!is_shown(p, i))
            continue;
        const char *name = p->r->m->rows[i].setting.name;
        double x = position_x(p, p->r->ms[i]), y = position_y(p, row_error(p, i));
        if (p->r->m->rows[i].program)
            fprintf(
                p->f,
                "<rect class=program x='%.1f' y='%.1f' width='9' height='9'><title>%s: %.1f ms, "
                "%.2f</title></rect>\n",
                x - 4.5, y - 4.5, name, p->r->ms[i], row_error(p, i));
        else
            fprintf(p->f,
                    "<circle class=%s cx='%.1f' cy='%.1f' r='%d'><title>%s: %.1f ms, %.2f"
                    "</title></circle>\n",
                    family(name), x, y, front[i] ? 6 : 4, name, p->r->ms[i], row_error(p, i));
        take(p, (box){ x - 5, y - 5, x + 5, y + 5 });
    }
}

/* Writes the names on the front first, so that they get room, then the qualities, then the
 * others. */
static void write_labels(plot *p)
{
    const bool *front = p->mean ? p->r->front_of_mean : p->r->front;
    for (int pass = 0; pass < 3; pass++)
        for (int i = 0; i < p->r->m->row_count; i++) {
            const char *name = p->r->m->rows[i].setting.name;
            int rank = front[i] || p->r->m->rows[i].program ? 0
                       : !strcmp(family(name), "quality")   ? 1
                                                            : 2;
            if (is_shown(p, i) && rank == pass)
                write_label(p, position_x(p, p->r->ms[i]), position_y(p, row_error(p, i)), name);
        }
}

void accuracy_report_plot(FILE *f, const accuracy_report *r, bool mean)
{
    plot *p = calloc(1, sizeof *p);
    if (!p)
        return;
    *p = (plot){ .f = f, .r = r, .mean = mean };
    find_edges(p);
    fprintf(f, "<svg viewBox='0 0 %d %d' width='%d' height='%d' role='img'>\n", WIDTH, HEIGHT,
            WIDTH, HEIGHT);
    if (isfinite(p->x0)) {
        draw_ticks(p);
        draw_front(p);
        draw_rows(p);
        write_labels(p);
    }
    fputs("</svg>\n", f);
    free(p);
}
