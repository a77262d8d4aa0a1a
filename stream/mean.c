#include "mean.h"

#include <math.h>

enum { COVERS = 8, DEPTHS = 8, VALUES = 1024 };

static const double covers[COVERS] = { 1.0 / 64, 1.0 / 32, 1.0 / 16, 1.0 / 8,
                                       1.0 / 4,  1.0 / 2,  3.0 / 4,  1 };

trip_mean_scale trip_mean_scale_make(double value_min, double value_max, const trip_codes *codes)
{
    const double per_value = codes->hi > codes->lo ? 65535 / (codes->hi - codes->lo) : 0;
    double lo = fmin(65535, fmax(0, (value_min - codes->lo) * per_value));
    double hi = fmin(65535, fmax(lo, (value_max - codes->lo) * per_value));
    if (!trip_codes_even(codes)) {
        lo = trip_codes_code(codes, value_min);
        hi = trip_codes_code(codes, value_max);
    }
    return (trip_mean_scale){ lo, hi - lo };
}

unsigned trip_mean_value(const trip_mean_scale *scale, unsigned code)
{
    const unsigned m = code >> TRIP_MEAN_AXIS_BITS;
    return (unsigned)floor(scale->lo + scale->width * m / (VALUES - 1) + 0.5);
}

double trip_mean_cover(unsigned shares)
{
    return covers[shares % COVERS];
}

double trip_mean_depth(unsigned shares)
{
    return (shares / COVERS % DEPTHS + 1) / (double)DEPTHS;
}

unsigned trip_mean_pack_value(const trip_mean_scale *scale, double value)
{
    const double part = scale->width > 0 ? (value - scale->lo) / scale->width : 0;
    return (unsigned)rint(fmin(1, fmax(0, part)) * (VALUES - 1)) << TRIP_MEAN_AXIS_BITS;
}

unsigned trip_mean_pack_shares(double cover, double depth)
{
    unsigned c = 0;
    double d = rint(depth * DEPTHS) - 1;
    while (c + 1 < COVERS && cover >= 0.5 * (covers[c] + covers[c + 1]))
        c++;
    d = fmax(0, fmin(DEPTHS - 1, d));
    return (unsigned)d * COVERS | c;
}

unsigned trip_mean_pack(const trip_mean_scale *scale, double value, double cover, double depth)
{
    return trip_mean_pack_value(scale, value) | trip_mean_pack_shares(cover, depth);
}

/* `column` is minus the opacity of a column. */
static double extinction_of(double cover, double extinction, double column, double length)
{
    return cover < 1 ? -log1p(cover * column) / length : extinction;
}

double trip_mean_extinction(unsigned shares, double extinction, double length)
{
    const double own = extinction * trip_mean_depth(shares);
    return extinction_of(trip_mean_cover(shares), own, expm1(-own * length), length);
}

void trip_mean_extinctions(double extinction, double length, double out[TRIP_MEAN_SHARES])
{
    for (unsigned shares = 0; shares < TRIP_MEAN_SHARES; shares += COVERS) {
        const double own = extinction * trip_mean_depth(shares), column = expm1(-own * length);
        for (unsigned c = 0; c < COVERS; c++)
            out[shares + c] = extinction_of(covers[c], own, column, length);
    }
}
