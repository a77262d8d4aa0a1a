#include "sheet_samples.h"

#include "weight.h"

/* Returns the slope of a ray over a sheet of list `axis`, or 0 if the ray has no weight in the
 * list. */
static double slope_of(const trip_settings *s, int axis_of_view, trip_vec3 ray, int axis)
{
    if (!(trip_weight(s, axis_of_view, ray, axis) > 0))
        return 0;
    double along = fabs(trip_component(ray, axis)), max = 0;
    for (int a = 0; a < 3; a++)
        if (a != axis)
            max = fmax(max, fabs(trip_component(ray, a)) / along);
    return max;
}

/* Returns the maximum slope over a grid of pixel positions, corners included. The steepest rays lie
 * at corners or where lists meet, and their slopes are far above TRIP_SHEET_SAMPLES_STRAIGHT. */
static double steepest(const trip_camera *c, const trip_settings *s)
{
    enum { ACROSS = 16 };
    const int axis_of_view = trip_weight_axis_of_view(c);
    double max = 0;
    for (int i = 0; i < (ACROSS + 1) * (ACROSS + 1); i++) {
        double x = (double)(i % (ACROSS + 1)) / ACROSS, y = (double)(i / (ACROSS + 1)) / ACROSS;
        trip_vec3 ray = trip_camera_ray(c, x * c->width, y * c->height);
        for (int axis = 0; axis < 3; axis++)
            max = fmax(max, slope_of(s, axis_of_view, ray, axis));
    }
    return max;
}

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
                                                       const trip_settings *settings,
                                                       const uint64_t dims[3])
{
    const double distance = fmax(distance_to(camera, dims), TRIP_SHEET_SAMPLES_NEAR_VOXELS);
    trip_view_samples_per_sheet v = { .slope = steepest(camera, settings),
                                      .voxel_px = voxel_px(camera, distance) };
    v.samples_per_sheet =
        v.slope <= TRIP_SHEET_SAMPLES_STRAIGHT ? 1 : samples_per_sheet_of(v.voxel_px);
    return v;
}
