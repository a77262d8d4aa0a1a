#include "gradient.h"

static double careful_difference(const float *value, int64_t step, double share)
{
    bool after = isfinite(value[step]), before = isfinite(value[-step]);
    double rise = (double)value[after ? step : 0] - (double)value[before ? -step : 0];
    return after && before ? share * rise : rise;
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

/* An index-space gradient has components of at most (hi - lo) / 2: its image in world space is
 * longest in one of the corners of that cube. */
double trip_gradient_bound(const trip_volume_info *info, double lo, double hi)
{
    trip_affine to_index;
    double most = 0;
    if (info->sparse) {
        lo = fmin(lo, info->background);
        hi = fmax(hi, info->background);
    }
    trip_affine_invert(&info->index_to_world, &to_index);
    for (int signs = 0; signs < 4; signs++) {
        trip_vec3 corner = { 1, signs & 1 ? 1 : -1, signs & 2 ? 1 : -1 };
        most = fmax(most, trip_length(trip_affine_transpose_vector(&to_index, corner)));
    }
    double bound = most * (hi - lo) / 2;
    return bound > 0 && isfinite(bound) ? bound : 1;
}
