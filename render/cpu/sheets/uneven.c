#include "cpu/sheets/uneven.h"

double trip_cpu_gradient_unit(const trip_coordinates *c)
{
    return 0.5 * (trip_coordinates_uneven(c) ? fmax(c->nearest, 1.0 / 64) : 1);
}

double trip_cpu_outline_unit(const trip_coordinates *c)
{
    return trip_coordinates_uneven(c) ? 16384 * c->nearest : 1;
}

/* The codes of a voxel and of its neighbours along one axis. */
typedef struct row {
    int16_t before, here, behind;
} row;

static int16_t slope(const double *x, int64_t at, row codes, double unit)
{
    const bool has_before = codes.before != TRIP_CPU_CODE_MISSING;
    const bool has_behind = codes.behind != TRIP_CPU_CODE_MISSING;
    if (!has_before && !has_behind)
        return 0;
    const int rise =
        (has_behind ? codes.behind : codes.here) - (has_before ? codes.before : codes.here);
    const double run = x[has_behind ? at + 1 : at] - x[has_before ? at - 1 : at];
    return (int16_t)fmax(INT16_MIN, fmin(INT16_MAX, floor(rise * unit / run)));
}

/* Returns the gradient of an outline along an axis. A width is at least c->nearest. */
static int16_t outline(const trip_coordinates *c, int axis, int64_t at, row codes)
{
    const int rise = (codes.behind == codes.here) - (codes.before == codes.here);
    return (int16_t)lrint(rise * trip_cpu_outline_unit(c) / trip_coordinates_width(c, axis, at));
}

static trip_cpu_gradient gradient_of(const trip_coordinates *c, const trip_cpu_uneven_raster *r,
                                     int u, int v, double unit, bool outlines)
{
    enum { STRIDE = TRIP_CPU_RASTER_STRIDE, LAST = TRIP_CPU_RASTER - 1 };
    const int i = v * STRIDE + u;
    const int16_t *at = r->raster->codes + i;
    const row rows[3] = {
        { u ? at[-1] : r->left->codes[i + LAST], *at, at[1] },
        { v ? at[-STRIDE] : r->above->codes[i + LAST * STRIDE], *at, at[STRIDE] },
        { r->sheet_before->codes[i], *at, r->sheet_behind->codes[i] },
    };
    const int64_t voxel[3] = { r->first[0] + u, r->first[1] + v, r->first[2] };
    trip_cpu_gradient g;
    for (int a = 0; a < 3; a++) {
        const int axis = (r->axis + 1 + a) % 3;
        g.along[a] = outlines ? outline(c, axis, voxel[a], rows[a])
                              : slope(c->along[axis], voxel[a], rows[a], unit);
    }
    return g;
}

void trip_cpu_uneven_gradients(const trip_coordinates *c, const trip_cpu_uneven_raster *r,
                               bool outlines)
{
    const double unit = trip_cpu_gradient_unit(c);
    for (int v = 0; v < TRIP_CPU_RASTER; v++)
        for (int u = 0; u < TRIP_CPU_RASTER; u++) {
            const int at = v * TRIP_CPU_RASTER_STRIDE + u;
            if (r->raster->codes[at] != TRIP_CPU_CODE_MISSING)
                r->raster->gradients[at] = gradient_of(c, r, u, v, unit, outlines);
        }
}
