#include "landscape_cells.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "report.h"

/* Percentiles bound a scene, since captures have strays far away. */
#define OUTER 0.02

static void find_turn(const char up[3], double m[3][3])
{
    const int axis = up[up[0] == '-'] - 'x', other = (axis + 1) % 3;
    memset(m, 0, 9 * sizeof m[0][0]);
    m[1][axis] = up[0] == '-' ? 1 : -1;
    m[2][other] = 1;
    for (int i = 0; i < 3; i++) /* y x z is x */
        m[0][i] = m[1][(i + 1) % 3] * m[2][(i + 2) % 3] - m[1][(i + 2) % 3] * m[2][(i + 1) % 3];
}

static int ascending(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

int trip_upright_find(trip_upright *u, const double *centres, size_t stride, uint64_t count,
                      const char up[3], const char *path)
{
    const size_t low = (size_t)(OUTER * (double)(count - 1)), high = count - 1 - low;
    double *along = malloc(count * sizeof *along);
    if (!along)
        return trip_fail(TRIP_ERROR, "generate", path, "out of memory");
    find_turn(up, u->turn);
    u->width = 0;
    for (int a = 0; a < 3; a++) {
        for (uint64_t n = 0; n < count; n++) {
            const double *c = (const void *)((const char *)centres + n * stride), *m = u->turn[a];
            along[n] = m[0] * c[0] + m[1] * c[1] + m[2] * c[2];
        }
        qsort(along, count, sizeof *along, ascending);
        u->middle[a] = a == 1 ? along[high] : (along[low] + along[high]) / 2; /* y points down */
        if (a != 1)
            u->width = fmax(u->width, along[high] - along[low]);
    }
    free(along);
    return u->width > 0 ? 0
                        : trip_fail(TRIP_ERROR, "generate", path,
                                    "has no width, so that it cannot stand on the ground");
}

double trip_cell_chance(uint64_t cell, unsigned use)
{
    return (double)(trip_scatter_hash(cell * 8 + use) >> 11) / (double)(UINT64_C(1) << 53);
}

double trip_landscape_height(double x, double z)
{
    return 0.8 * sin(0.35 * x + 0.6) * cos(0.27 * z) + 0.2 * sin(0.9 * z + 0.4 * x);
}

void trip_ground_colour(double x, double z, double rgb[3])
{
    static const double grass[3] = { 0.26, 0.36, 0.14 }, earth[3] = { 0.45, 0.36, 0.25 };
    const double share = 0.5 + 0.5 * sin(7 * x) * sin(5 * z + trip_landscape_height(x, z));
    for (int i = 0; i < 3; i++)
        rgb[i] = grass[i] + share * (earth[i] - grass[i]);
}

void trip_cell_transform(uint64_t cell, double x, double z, const trip_upright *u, double m[3][4])
{
    const double angle = 2 * M_PI * trip_cell_chance(cell, 1);
    const double scale =
        (TRIP_LANDSCAPE_SMALLEST +
         (TRIP_LANDSCAPE_LARGEST - TRIP_LANDSCAPE_SMALLEST) * trip_cell_chance(cell, 2)) /
        u->width;
    const double turn[3][3] = { { cos(angle), 0, sin(angle) },
                                { 0, 1, 0 },
                                { -sin(angle), 0, cos(angle) } };
    const double at[3] = { x, -trip_landscape_height(x, z), z };
    for (int i = 0; i < 3; i++) {
        m[i][3] = at[i];
        for (int k = 0; k < 3; k++) {
            m[i][k] = 0;
            for (int j = 0; j < 3; j++)
                m[i][k] += scale * turn[i][j] * u->turn[j][k];
            m[i][3] -= scale * turn[i][k] * u->middle[k];
        }
    }
}
