#include "pixel_area.h"

#include <math.h>
#include <string.h>

typedef struct square {
    double x, y, size; /* of the top left corner, in pixels */
    const double *corner[4], *centre;
    int depth;
} square;

static int at(const trip_pixel_area *a, double x, double y, double out[4])
{
    return a->function(a->user, x, y, out);
}

static void corner_mean(const square *s, double out[4])
{
    for (int c = 0; c < 4; c++)
        out[c] = (s->corner[0][c] + s->corner[1][c] + s->corner[2][c] + s->corner[3][c]) / 4;
}

static void rule(const square *s, double out[4])
{
    corner_mean(s, out);
    for (int c = 0; c < 4; c++)
        out[c] = (2 * s->centre[c] + out[c]) / 3;
}

static double difference(const double a[4], const double b[4])
{
    double most = 0;
    for (int c = 0; c < 4; c++)
        most = fmax(most, fabs(a[c] - b[c]));
    return most;
}

/* Returns the difference that a square of a depth may have. */
static double allowed(const trip_pixel_area *a, int depth)
{
    return a->tolerance / 2 * a->first * exp2(depth);
}

static int mean_of(const trip_pixel_area *a, const square *s, double out[4]);

/* Writes the four parts of a square. `points` has room for the middles of the sides (top, left,
 * right, bottom) and the centres of the parts. */
static int divide(const trip_pixel_area *a, const square *s, double points[8][4], square parts[4])
{
    static const double along[8][2] = { { 0.5, 0 },     { 0, 0.5 },     { 1, 0.5 },
                                        { 0.5, 1 },     { 0.25, 0.25 }, { 0.75, 0.25 },
                                        { 0.25, 0.75 }, { 0.75, 0.75 } };
    const double half = s->size / 2;
    for (int i = 0; i < 8; i++) {
        int status = at(a, s->x + along[i][0] * s->size, s->y + along[i][1] * s->size, points[i]);
        if (status)
            return status;
    }
    const double *grid[3][3] = { { s->corner[0], points[0], s->corner[1] },
                                 { points[1], s->centre, points[2] },
                                 { s->corner[2], points[3], s->corner[3] } };
    for (int i = 0; i < 4; i++) {
        const int u = i & 1, v = i >> 1;
        parts[i] =
            (square){ .x = s->x + u * half,
                      .y = s->y + v * half,
                      .size = half,
                      .corner = { grid[v][u], grid[v][u + 1], grid[v + 1][u], grid[v + 1][u + 1] },
                      .centre = points[4 + i],
                      .depth = s->depth + 1 };
    }
    return 0;
}

static int mean_of_parts(const trip_pixel_area *a, const square *s, double out[4])
{
    double points[8][4], whole[4], part[4];
    square parts[4];
    int status = divide(a, s, points, parts);
    memset(out, 0, 4 * sizeof *out);
    for (int i = 0; i < 4 && !status; i++) {
        rule(&parts[i], part);
        for (int c = 0; c < 4; c++)
            out[c] += part[c] / 4;
    }
    rule(s, whole);
    if (status || difference(out, whole) <= allowed(a, s->depth))
        return status;
    memset(out, 0, 4 * sizeof *out);
    for (int i = 0; i < 4 && !status; i++) {
        status = mean_of(a, &parts[i], part);
        for (int c = 0; c < 4; c++)
            out[c] += part[c] / 4;
    }
    return status;
}

static int mean_of(const trip_pixel_area *a, const square *s, double out[4])
{
    double corners[4];
    corner_mean(s, corners);
    if (s->depth < TRIP_PIXEL_AREA_DEPTH && difference(corners, s->centre) > allowed(a, s->depth))
        return mean_of_parts(a, s, out);
    rule(s, out);
    return 0;
}

/* The values at the corners of a row of first squares. */
typedef double corner_row[TRIP_PIXEL_AREA_FIRST_MAX + 1][4];

static int fill_corners(const trip_pixel_area *a, double x, double y, corner_row row)
{
    int status = 0;
    for (int i = 0; i <= a->first && !status; i++)
        status = at(a, x + (double)i / a->first, y, row[i]);
    return status;
}

/* Adds the mean of a first square to `out`, by its share of the pixel. */
static int add_square(const trip_pixel_area *a, square *s, double out[4])
{
    double centre[4], mean[4];
    int status = at(a, s->x + s->size / 2, s->y + s->size / 2, centre);
    s->centre = centre;
    if (!status)
        status = mean_of(a, s, mean);
    for (int c = 0; c < 4 && !status; c++)
        out[c] += mean[c] * s->size * s->size;
    return status;
}

static int mean_of_squares(const trip_pixel_area *a, double x, double y, double out[4])
{
    corner_row rows[2];
    const double size = 1.0 / a->first;
    int status = fill_corners(a, x, y, rows[0]);
    memset(out, 0, 4 * sizeof *out);
    for (int v = 0; v < a->first && !status; v++) {
        double(*above)[4] = rows[v & 1], (*below)[4] = rows[(v + 1) & 1];
        status = fill_corners(a, x, y + (v + 1) * size, below);
        for (int u = 0; u < a->first && !status; u++) {
            square s = { .x = x + u * size,
                         .y = y + v * size,
                         .size = size,
                         .corner = { above[u], above[u + 1], below[u], below[u + 1] } };
            status = add_square(a, &s, out);
        }
    }
    return status;
}

int trip_pixel_area_mean(const trip_pixel_area *a, double x, double y,
                         const double *const corners[4], double out[4])
{
    if (a->first > 1)
        return mean_of_squares(a, x, y, out);
    square s = { .x = x, .y = y, .size = 1 };
    memcpy(s.corner, corners, sizeof s.corner);
    memset(out, 0, 4 * sizeof *out);
    return add_square(a, &s, out);
}
