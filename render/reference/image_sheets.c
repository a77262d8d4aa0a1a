#include "reference_sheets.h"

#include <math.h>
#include <string.h>

#include "report.h"

struct trip_image_sheets {
    trip_budget *budget;
    int width, height, first, count; /* size in pixels; slabs from `first` on */
    unsigned channels;
    double thickness; /* of a slab, as a difference of depths */
    size_t bytes;
    double *sums;
};

/* Computes the minimum and maximum depth of a grid's kernels. */
static void find_depths(const trip_camera *camera, const trip_settings *settings,
                        const uint64_t dims[3], double depths[2])
{
    const double reach = settings->kernel_radius * trip_length(camera->forward);
    depths[0] = depths[1] = -trip_dot(camera->forward, camera->eye);
    for (int a = 0; a < 3; a++) {
        double along = trip_component(camera->forward, a) * ((double)dims[a] - 1);
        depths[0] += fmin(0, along);
        depths[1] += fmax(0, along);
    }
    depths[0] -= reach;
    depths[1] += reach;
}

/* Returns the depth of one voxel length along the view direction. The map is invertible: this was
 * checked when the data set was opened. */
static double voxel_depth(const trip_camera *camera)
{
    trip_affine to_index;
    trip_affine_invert(&camera->index_to_world, &to_index);
    trip_vec3 step = trip_affine_vector(&to_index, camera->world_forward);
    return camera->voxel_world * trip_dot(camera->forward, step);
}

int trip_image_sheets_create(trip_image_sheets **out, const trip_camera *camera,
                             const trip_settings *settings, const uint64_t dims[3],
                             trip_budget *budget)
{
    const double max = 1e6;
    double depths[2];
    trip_image_sheets *s = *out = trip_budget_take(budget, sizeof *s);
    if (!s)
        return trip_fail(TRIP_ERROR, "render", "reference renderer",
                         "out of memory; raise --memory");
    *s = (trip_image_sheets){ .budget = budget,
                              .width = camera->width,
                              .height = camera->height,
                              .channels = trip_layer_channels(settings),
                              .thickness = voxel_depth(camera) };
    find_depths(camera, settings, dims, depths);
    double first = floor(fmax(0, depths[0]) / s->thickness), end = ceil(depths[1] / s->thickness);
    s->first = (int)fmin(first, INT32_MAX);
    s->count = end > first ? (int)fmin(end - first, max) : 0;
    s->bytes =
        (size_t)s->width * (size_t)s->height * (size_t)s->count * s->channels * sizeof *s->sums;
    s->sums = s->bytes && end - first <= max ? trip_budget_take(budget, s->bytes) : NULL;
    if (s->sums || !s->bytes)
        return 0;
    size_t bytes = s->bytes;
    trip_image_sheets_destroy(s);
    *out = NULL;
    return trip_fail(TRIP_ERROR, "render", "reference renderer",
                     "%zu bytes of image-aligned sheets do not fit the memory given; raise "
                     "--memory or draw a smaller image",
                     bytes);
}

void trip_image_sheets_destroy(trip_image_sheets *s)
{
    if (!s)
        return;
    if (s->sums)
        trip_budget_release(s->budget, s->sums, s->bytes);
    trip_budget_release(s->budget, s, sizeof *s);
}

int trip_image_sheets_count(const trip_image_sheets *s)
{
    return s->count;
}

static double *at(const trip_image_sheets *s, int x, int y, int n)
{
    size_t pixel = (size_t)y * (size_t)s->width + (size_t)x;
    return &s->sums[(pixel * (size_t)s->count + (size_t)n) * s->channels];
}

const double *trip_image_sheets_at(const trip_image_sheets *s, int x, int y, int n)
{
    return at(s, x, y, n);
}

/* Evaluates F at a distance along the ray, in standard deviations. */
static double share_before(const trip_splat_frame *f, double distance)
{
    double t = distance * sqrt(0.5), end = sqrt(0.5 * f->cutoff2);
    return t >= end ? 1 : t <= -end ? 0 : 0.5 + 0.5 * f->front * erf(t);
}

void trip_image_sheets_add(trip_image_sheets *s, const trip_splat_frame *f, trip_vec3 voxel, int x,
                           int y, const double fragment[TRIP_CHANNELS_MAX], double depth)
{
    const trip_camera *c = &f->camera;
    trip_vec3 ray = trip_camera_ray(c, x + 0.5, y + 0.5), from = trip_sub(voxel, c->eye);
    if (c->ortho)
        from = trip_sub(from, trip_add(trip_scale(c->rx, x + 0.5), trip_scale(c->ry, y + 0.5)));
    const double length = trip_length(ray), nearest = trip_dot(from, ray) / length;
    const double reach = sqrt(f->cutoff2) * f->sigma, slab = s->thickness * length;
    double n = fmax(s->first, floor((nearest - reach) / slab));
    double end = fmin((double)s->first + s->count, ceil((nearest + reach) / slab));
    double before = share_before(f, (n * slab - nearest) / f->sigma);
    for (; n < end; n++) {
        double up_to = share_before(f, ((n + 1) * slab - nearest) / f->sigma);
        double *sums = at(s, x, y, (int)n - s->first);
        for (unsigned i = 0; i < s->channels; i++)
            sums[i] += depth * (up_to - before) * fragment[i];
        before = up_to;
    }
}
