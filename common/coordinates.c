#include "coordinates.h"

const char *trip_coordinates_fault(const double *table, int64_t count)
{
    for (int64_t i = 0; i < count; i++) {
        if (!isfinite(table[i]))
            return "a coordinate is not finite";
        if (i > 0 && !(table[i] - table[i - 1] >= TRIP_COORDINATES_NEAREST))
            return "coordinates must ascend by at least a millionth of their mean step";
    }
    if (table[0] != 0 || table[count - 1] != (double)(count - 1))
        return "coordinates must run from 0 to the number of voxels minus 1";
    return NULL;
}

trip_coordinates trip_coordinates_make(const double *const along[3], const int64_t voxels[3])
{
    trip_coordinates c = { .widest = 1, .nearest = 1 };
    for (int a = 0; a < 3; a++) {
        c.along[a] = along ? along[a] : NULL;
        c.voxels[a] = voxels[a];
        for (int64_t i = 0; along && i < voxels[a]; i++)
            c.widest = fmax(c.widest, trip_coordinates_width(&c, a, i));
        for (int64_t i = 1; along && i < voxels[a]; i++)
            c.nearest = fmin(c.nearest, along[a][i] - along[a][i - 1]);
    }
    return c;
}

/* Returns the last voxel at or before a position that has a voxel after it. */
static int64_t interval_of(const double *x, int64_t voxels, double position)
{
    int64_t lo = 0, hi = voxels - 1; /* x[lo] <= position < x[hi], except beyond the ends */
    while (hi - lo > 1) {
        int64_t middle = lo + (hi - lo) / 2;
        if (x[middle] <= position)
            lo = middle;
        else
            hi = middle;
    }
    return lo;
}

double trip_coordinates_position(const trip_coordinates *c, int axis, double index)
{
    const double *x = c->along[axis];
    const int64_t last = c->voxels[axis] - 1;
    if (!x || last < 1)
        return index;
    int64_t i = (int64_t)fmax(0, fmin(floor(index), (double)last - 1));
    /* Gives exactly x[last] at the last voxel, since the rounding error of the difference vanishes.
     */
    return x[i] + (index - (double)i) * (x[i + 1] - x[i]);
}

double trip_coordinates_index(const trip_coordinates *c, int axis, double position)
{
    const double *x = c->along[axis];
    if (!x || c->voxels[axis] < 2)
        return position;
    int64_t i = interval_of(x, c->voxels[axis], position);
    return (double)i + (position - x[i]) / (x[i + 1] - x[i]);
}

double trip_coordinates_width(const trip_coordinates *c, int axis, int64_t voxel)
{
    const double *x = c->along[axis];
    const int64_t last = c->voxels[axis] - 1;
    if (!x || last < 1)
        return 1;
    int64_t before = voxel > 0 ? voxel - 1 : voxel, after = voxel < last ? voxel + 1 : voxel;
    return (x[after] - x[before]) / (double)(after - before);
}
