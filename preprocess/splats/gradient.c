#include "gradient.h"

static double careful_difference(const float *value, int64_t step, double share)
{
    bool after = isfinite(value[step]), before = isfinite(value[-step]);
    double rise = (double)value[after ? step : 0] - (double)value[before ? -step : 0];
    return (after && before ? share : 2 * share) * rise;
}

void trip_gradient_careful(const float *value, const int64_t step[3], const double share[3],
                           double gradient[3])
{
    for (int a = 0; a < 3; a++)
        gradient[a] = careful_difference(value, step[a], share[a]);
}

double trip_gradient_unit(const trip_affine *index_to_world)
{
    double voxel = cbrt(fabs(trip_affine_determinant(index_to_world)));
    return voxel > 0 && isfinite(voxel) ? ldexp(1, ilogb(voxel)) : 1;
}
