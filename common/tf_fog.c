/* Makes a transfer function for a density of unknown scale: smoke, clouds, fog. Extinction is
 * proportional to density, as in nature. The histogram alone sets its scale: a ray through a cube
 * of all existing voxels has the optical depth `ray_depth`. Colours vary little, cool in thin parts
 * and warm in dense parts, so that the eye sees the shape and not the values. */
#include "tf_internal.h"

#include <math.h>

enum { BINS = 1024, POINTS = 32 };

static const double ray_depth = 4; /* optical depth at the mean density */
static const double thinnest =
    1.0 / 64; /* fraction of the mean density below which nothing is visible */
static const double strongest_opacity = 0.8; /* per voxel */
static const double solid_opacity = 0.3;     /* if most voxels have the maximum density */

static double bin_centre(const trip_histogram *h, int bin)
{
    return h->value_min + (h->value_max - h->value_min) * (bin + 0.5) / BINS;
}

static double mean_density(const trip_histogram *h, double *voxels)
{
    double sum = 0;
    *voxels = 0;
    for (int i = 0; i < BINS; i++) {
        *voxels += (double)h->counts[i];
        sum += (double)h->counts[i] * bin_centre(h, i);
    }
    return sum / *voxels;
}

static trip_rgba colour_at(double density, double mean, double extinction)
{
    static const double thin[3] = { 0.70, 0.75, 0.83 }, dense[3] = { 1.00, 0.975, 0.94 };
    double f = 1 - exp(-density / mean), c[3];
    for (int k = 0; k < 3; k++)
        c[k] = thin[k] + f * (dense[k] - thin[k]);
    return (trip_rgba){ c[0], c[1], c[2], fmin(strongest_opacity, 1 - exp(-extinction)) };
}

int trip_tf_fog_from_histogram(trip_tf **out, const trip_histogram *h)
{
    double voxels, mean = mean_density(h, &voxels), low = mean * thinnest;
    if (!(h->value_min >= 0 && h->value_min < h->value_max && low < h->value_max))
        return trip_tf_from_histogram(out, h);
    trip_tf_point points[POINTS];
    double per_density = ray_depth / (cbrt(voxels) * mean);
    if ((double)h->counts[BINS - 1] > voxels / 2)
        per_density = fmax(per_density, trip_extinction(solid_opacity) / h->value_max);
    for (int i = 0; i < POINTS; i++) {
        double t = (double)i / (POINTS - 1), above = (h->value_max - low) * t * t;
        points[i] =
            (trip_tf_point){ low + above, colour_at(low + above, mean, per_density * above) };
    }
    return trip_tf_from_points(out, points, POINTS, false, 0);
}
