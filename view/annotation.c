#include "annotation.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define NEAREST                                                                                    \
    1e-6 /* share of the distance to the point looked at: edges are cut there, in front of the eye \
          */
#define TICKS_APART_PX 50
#define TICK_PX 6
#define LABEL_PX 20
#define TITLE_PX 44

trip_annotation_box trip_annotation_box_of(const triptych_info *info)
{
    trip_annotation_box box;
    for (int n = 0; n < 8; n++)
        for (int row = 0; row < 3; row++) {
            const double *m = info->index_to_world[row];
            box.corners[n][row] = m[3];
            for (int a = 0; a < 3; a++)
                box.corners[n][row] += m[a] * info->edges[n >> a & 1][a];
        }
    return box;
}

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void difference(const double a[3], const double b[3], double out[3])
{
    for (int i = 0; i < 3; i++)
        out[i] = a[i] - b[i];
}

/* Returns whether the upper or lower face across `axis` is turned to the eye. */
static bool faces_eye(const trip_annotation_box *box, const trip_navigation *n, int axis, int upper)
{
    const double(*c)[3] = box->corners;
    int base = upper << axis, other = 1 << (axis + 1) % 3, third = 1 << (axis + 2) % 3;
    double u[3], v[3], along[3], to_eye[3];
    difference(c[base | other], c[base], u);
    difference(c[base | third], c[base], v);
    difference(c[1 << axis], c[0], along);
    double normal[3] = { u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2],
                         u[0] * v[1] - u[1] * v[0] };
    bool outward = (dot(normal, along) > 0) == (upper == 1);
    if (n->ortho_height > 0)
        difference(n->eye, n->look, to_eye);
    else
        difference(n->eye, c[base], to_eye);
    return outward ? dot(normal, to_eye) > 0 : dot(normal, to_eye) < 0;
}

/* Projects the part of an edge in front of the eye. Returns false if there is none. */
static bool project(const trip_navigation *n, int width, int height, const double a[3],
                    const double b[3], double from[2], double to[2])
{
    double za = trip_navigation_project(n, width, height, a, from);
    double zb = trip_navigation_project(n, width, height, b, to);
    double nearest = NEAREST * trip_navigation_distance(n), p[3];
    if (n->ortho_height > 0 || (za >= nearest && zb >= nearest))
        return true;
    if (za < nearest && zb < nearest)
        return false;
    double t = (nearest - za) / (zb - za);
    for (int i = 0; i < 3; i++)
        p[i] = a[i] + t * (b[i] - a[i]);
    trip_navigation_project(n, width, height, p, za < nearest ? from : to);
    return true;
}

/* Returns the lower corner of edge k of an axis. */
static int corner_of(int axis, int k)
{
    return (k & 1) << (axis + 1) % 3 | (k >> 1) << (axis + 2) % 3;
}

void trip_annotation_edges(const trip_annotation_box *box, const trip_navigation *n, int width,
                           int height, trip_annotation_edge edges[TRIP_ANNOTATION_EDGES])
{
    bool seen[3][2];
    for (int i = 0; i < 6; i++)
        seen[i / 2][i % 2] = faces_eye(box, n, i / 2, i % 2);
    for (int i = 0; i < TRIP_ANNOTATION_EDGES; i++) {
        int axis = i / 4, k = i % 4, corner = corner_of(axis, k);
        bool one = seen[(axis + 1) % 3][k & 1], other = seen[(axis + 2) % 3][k >> 1];
        trip_annotation_edge *e = &edges[i];
        *e = (trip_annotation_edge){ .axis = axis,
                                     .hidden = !one && !other,
                                     .outline = one != other };
        e->drawn = project(n, width, height, box->corners[corner], box->corners[corner | 1 << axis],
                           e->from, e->to);
    }
}

double trip_annotation_round(double min)
{
    double power = pow(10, floor(log10(min)));
    static const double steps[] = { 1, 2, 5, 10, 20 };
    int i = 0;
    while (i < 4 && steps[i] * power < min * (1 - 1e-12))
        i++;
    return steps[i] * power;
}

/* Returns the largest round number that is at most `max`. */
static double round_down(double max)
{
    double power = pow(10, floor(log10(max * (1 + 1e-12)))), lead = max * (1 + 1e-12) / power;
    return (lead >= 5 ? 5 : lead >= 2 ? 2 : 1) * power;
}

/* Returns the number of decimals that multiples of the step need. */
static int digits_of(double step)
{
    double digits = -floor(log10(step) + 1e-9);
    return digits > 0 ? (int)fmin(digits, 12) : 0;
}

static void print(char *text, size_t bytes, double value, double step)
{
    bool plain = fabs(value) < 1e7 && step >= 1e-6;
    if (fabs(value) < step / 2)
        value = 0;
    if (plain)
        snprintf(text, bytes, "%.*f", digits_of(step), value);
    else
        snprintf(text, bytes, "%.6g", value);
}

trip_annotation_bar trip_annotation_scale_bar(const trip_navigation *n, int height, double depth,
                                              double max_px, const char *unit)
{
    double size = trip_navigation_pixel(n, height, depth), max = size * max_px;
    trip_annotation_bar bar = { 0 };
    char number[32];
    if (!(max > 1e-290 && max < 1e290))
        return bar;
    bar.length = round_down(max);
    bar.px = bar.length / size;
    print(number, sizeof number, bar.length, bar.length);
    snprintf(bar.text, sizeof bar.text, "%s%s%.6s", number, unit ? " " : "", unit ? unit : "");
    return bar;
}

/* Returns the edge for a scale, the outline edge with the lowest centre, or -1. */
static int choose_edge(const trip_annotation_edge *edges, int axis)
{
    int found = -1;
    double lowest = -INFINITY;
    for (int i = 4 * axis; i < 4 * axis + 4; i++) {
        double middle = edges[i].from[1] + edges[i].to[1];
        if (edges[i].drawn && edges[i].outline && middle > lowest) {
            lowest = middle;
            found = i;
        }
    }
    return found;
}

/* Returns the world axis parallel to an axis of the box, or -1. */
static int world_axis(const double along[3])
{
    double length = sqrt(dot(along, along));
    for (int a = 0; a < 3; a++)
        if (fabs(along[a]) > length * (1 - 1e-9))
            return a;
    return -1;
}

/* A scale on an edge from `start` in direction `along`, world space. */
typedef struct scale {
    const trip_navigation *n;
    int width, height;
    const double *start;
    double along[3];
    double first, last; /* numbers at both ends */
    double out[2];      /* unit length in pixels, away from the centre of the box */
} scale;

static void place_label(const double at[2], const double out[2], double px, double label[2])
{
    for (int i = 0; i < 2; i++)
        label[i] = at[i] + out[i] * px;
}

static void add_tick(const scale *s, double value, double step, trip_annotation_axis *axis)
{
    trip_annotation_tick *tick = &axis->ticks[axis->count];
    double t = (value - s->first) / (s->last - s->first), p[3];
    for (int i = 0; i < 3; i++)
        p[i] = s->start[i] + t * s->along[i];
    double depth = trip_navigation_project(s->n, s->width, s->height, p, tick->from);
    if (!(s->n->ortho_height > 0) && depth < NEAREST * trip_navigation_distance(s->n))
        return;
    place_label(tick->from, s->out, TICK_PX, tick->to);
    place_label(tick->from, s->out, LABEL_PX, tick->label);
    print(tick->text, sizeof tick->text, value, step);
    axis->count++;
}

static void fill_axis(const scale *s, const trip_annotation_edge *edge, trip_annotation_axis *axis)
{
    double px = hypot(edge->to[0] - edge->from[0], edge->to[1] - edge->from[1]);
    double lo = fmin(s->first, s->last), hi = fmax(s->first, s->last);
    double max = fmin(px / TICKS_APART_PX, TRIP_ANNOTATION_TICKS - 2);
    if (!(max >= 1) || !(hi > lo))
        return;
    double step = trip_annotation_round((hi - lo) / max), slack = 1e-9 * step;
    for (double k = ceil((lo - slack) / step);
         k * step <= hi + slack && axis->count < TRIP_ANNOTATION_TICKS; k++)
        add_tick(s, k * step, step, axis);
    for (int i = 0; i < 2; i++)
        axis->title[i] = (edge->from[i] + edge->to[i]) / 2 + s->out[i] * TITLE_PX;
}

static void find_outward(const trip_annotation_box *box, scale *s, const trip_annotation_edge *edge)
{
    double middle[3] = { 0 }, pixel[2];
    for (int c = 0; c < 8; c++)
        for (int i = 0; i < 3; i++)
            middle[i] += box->corners[c][i] / 8;
    trip_navigation_project(s->n, s->width, s->height, middle, pixel);
    double d[2] = { edge->to[0] - edge->from[0], edge->to[1] - edge->from[1] };
    double length = hypot(d[0], d[1]);
    s->out[0] = -d[1] / length;
    s->out[1] = d[0] / length;
    double side = (pixel[0] - edge->from[0]) * s->out[0] + (pixel[1] - edge->from[1]) * s->out[1];
    for (int i = 0; i < 2 && side > 0; i++)
        s->out[i] = -s->out[i];
}

void trip_annotation_axes(const trip_annotation_box *box, const trip_navigation *n, int width,
                          int height, const char *unit, trip_annotation_axis axes[3])
{
    trip_annotation_edge edges[TRIP_ANNOTATION_EDGES];
    trip_annotation_edges(box, n, width, height, edges);
    for (int a = 0; a < 3; a++) {
        int e = choose_edge(edges, a);
        axes[a] = (trip_annotation_axis){ .count = 0 };
        if (e < 0 ||
            hypot(edges[e].to[0] - edges[e].from[0], edges[e].to[1] - edges[e].from[1]) < 1)
            continue;
        int corner = corner_of(a, e % 4);
        scale s = { .n = n, .width = width, .height = height, .start = box->corners[corner] };
        difference(box->corners[corner | 1 << a], s.start, s.along);
        int w = world_axis(s.along);
        s.first = w < 0 ? 0 : s.start[w];
        s.last = w < 0 ? sqrt(dot(s.along, s.along)) : s.start[w] + s.along[w];
        snprintf(axes[a].name, sizeof axes[a].name, unit ? "%c (%.6s)" : "%c",
                 w < 0 ? "ijk"[a] : "xyz"[w], unit);
        find_outward(box, &s, &edges[e]);
        fill_axis(&s, &edges[e], &axes[a]);
    }
}
