#include "mean.h"

#include <math.h>

enum { COVERS = 8, DEPTHS = 8 };

static const double covers[COVERS] = { 1.0 / 64, 1.0 / 32, 1.0 / 16, 1.0 / 8,
                                       1.0 / 4,  1.0 / 2,  3.0 / 4,  1 };

double trip_mean_cover(unsigned shares)
{
    return covers[shares % COVERS];
}

double trip_mean_depth(unsigned shares)
{
    return (shares / COVERS % DEPTHS + 1) / (double)DEPTHS;
}

unsigned trip_mean_pack(unsigned value, double cover, double depth)
{
    unsigned m = (value * 1023 + 32767) / 65535, c = 0;
    double d = rint(depth * DEPTHS) - 1;
    while (c + 1 < COVERS && cover >= 0.5 * (covers[c] + covers[c + 1]))
        c++;
    d = fmax(0, fmin(DEPTHS - 1, d));
    return m << TRIP_MEAN_AXIS_BITS | (unsigned)d * COVERS | c;
}

double trip_mean_extinction(unsigned shares, double extinction, double length)
{
    double cover = trip_mean_cover(shares), depth = trip_mean_depth(shares);
    if (cover >= 1)
        return extinction * depth;
    return -log1p(cover * expm1(-extinction * depth * length)) / length;
}
