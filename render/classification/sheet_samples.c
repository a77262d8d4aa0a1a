#include "sheet_samples.h"

/* Returns the index-space distance from the eye to the nearest point of the grid. */
static double distance_to(const trip_camera *c, const uint64_t dims[3])
{
    double sum = 0;
    for (int a = 0; a < 3; a++) {
        double eye = trip_component(c->eye, a), last = (double)dims[a] - 1;
        double beyond = eye < 0 ? -eye : eye > last ? eye - last : 0;
        sum += beyond * beyond;
    }
    return sqrt(sum);
}

/* Returns the width of a voxel in pixels. A pixel is as wide as the difference of neighbouring
 * rays, at depth 1 in perspective. */
static double voxel_px(const trip_camera *c, double distance)
{
    double pixel = fmin(trip_length(c->rx), trip_length(c->ry));
    return c->ortho ? 1 / pixel : 1 / (pixel * distance);
}

static int samples_per_sheet_of(double voxel_px)
{
    double more = floor(voxel_px / TRIP_SHEET_SAMPLES_EACH_PX);
    return 2 + (int)fmin(TRIP_SHEET_SAMPLES_LARGE - 2, more);
}

trip_view_samples_per_sheet trip_sheet_samples_of_view(const trip_camera *camera,
                                                       const uint64_t dims[3])
{
    const double distance = fmax(distance_to(camera, dims), TRIP_SHEET_SAMPLES_NEAR_VOXELS);
    const double px = voxel_px(camera, distance);
    return (trip_view_samples_per_sheet){ .samples_per_sheet = samples_per_sheet_of(px),
                                          .voxel_px = px };
}
