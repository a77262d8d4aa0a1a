#include "range_image.h"

#include <inttypes.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "budget.h"
#include "image_helper.h"
#include "range_shape.h"
#include "report.h"

/* A disc seen from the side covers pixels only if it grows. It grows up to this angle. */
#define COSINE_LEAST 0.25
#define FARTHEST 1e9

static int request(trip_image_helper **helper, const char *path, enum trip_image_form form,
                   uint64_t *bytes_out)
{
    const int64_t numbers[5] = { (int64_t)(trip_memory_available_bytes() / 4), form };
    int status = *helper ? 0 : trip_image_helper_start(helper, "read");
    if (status == 0)
        status = trip_image_helper_request(*helper, TRIP_IMAGE_READ, path, numbers, -1);
    return status == 0 ? trip_image_helper_outcome(*helper, bytes_out) : status;
}

/* Checks a size that the helper states. */
static int check_size(trip_image_helper *helper, const char *path, int64_t width, int64_t height,
                      uint64_t pixel, uint64_t bytes)
{
    if (width < 1 || height < 1 || width > INT32_MAX || height > INT32_MAX ||
        (uint64_t)width > UINT64_MAX / pixel / (uint64_t)height ||
        (uint64_t)width * (uint64_t)height * pixel != bytes)
        return trip_image_helper_distrust(helper, "a picture whose size differs from its data");
    return width * height <= TRIP_RANGE_PIXELS_MAX
               ? 0
               : trip_fail(TRIP_ERROR, "read", path,
                           "has %" PRId64 " x %" PRId64 " pixels; a range image has at most %d",
                           width, height, TRIP_RANGE_PIXELS_MAX);
}

/* Loads distances in units of the scene. */
static int load_distances(trip_range_image *im, trip_image_helper **helper)
{
    const trip_range_frame *frame = im->frame;
    trip_image_distances head = { 0 };
    uint64_t bytes = 0;
    int status = request(helper, frame->depth, TRIP_IMAGE_FORM_DISTANCES, &bytes);
    if (status == 0 && bytes < sizeof head)
        status = trip_image_helper_distrust(*helper, "a picture without a size");
    if (status == 0)
        status = trip_image_helper_receive(*helper, &head, sizeof head);
    if (status == 0)
        status = check_size(*helper, frame->depth, head.width, head.height, sizeof(float),
                            bytes - sizeof head);
    if (status < 0)
        return status;
    const size_t pixels = (size_t)(head.width * head.height);
    float *z = realloc(im->z, pixels * sizeof *z);
    if (!z)
        return trip_fail(TRIP_ERROR, "read", frame->depth, "out of memory for its distances");
    im->z = z;
    im->width = (int)head.width;
    im->height = (int)head.height;
    status = trip_image_helper_receive(*helper, z, pixels * sizeof *z);
    const double scale = frame->scale > 0 ? frame->scale : head.integers ? 0.001 : 1;
    for (size_t i = 0; i < pixels && status == 0; i++) {
        const double d = (double)z[i] * scale;
        const bool good = d > 0 && d >= frame->nearest && d <= FARTHEST &&
                          (!(frame->farthest > 0) || d <= frame->farthest);
        z[i] = good ? (float)d : NAN;
    }
    return status;
}

/* Loads colours as bytes. */
static int load_colours(trip_range_image *im, trip_image_helper **helper)
{
    const char *path = im->frame->colour;
    trip_image_size head = { 0 };
    uint64_t bytes = 0;
    int status = request(helper, path, TRIP_IMAGE_FORM_RGBA, &bytes);
    if (status == 0 && bytes < sizeof head)
        status = trip_image_helper_distrust(*helper, "a picture without a size");
    if (status == 0)
        status = trip_image_helper_receive(*helper, &head, sizeof head);
    if (status == 0)
        status = check_size(*helper, path, head.width, head.height, 4 * sizeof(float),
                            bytes - sizeof head);
    if (status < 0)
        return status;
    const size_t width = (size_t)head.width, pixels = width * (size_t)head.height;
    unsigned char *colour = realloc(im->colour, 3 * pixels);
    float *row = malloc(4 * width * sizeof *row);
    if (colour)
        im->colour = colour;
    if (!colour || !row)
        status = trip_fail(TRIP_ERROR, "read", path, "out of memory for its colours");
    for (size_t i = 0; i < pixels && status == 0; i++) {
        if (i % width == 0)
            status = trip_image_helper_receive(*helper, row, 4 * width * sizeof *row);
        for (int c = 0; c < 3 && status == 0; c++) {
            const float v = row[4 * (i % width) + (size_t)c];
            colour[3 * i + (size_t)c] = (unsigned char)(v >= 1 ? 255 : v > 0 ? v * 255 + 0.5f : 0);
        }
    }
    free(row);
    im->colour_width = (int)head.width;
    im->colour_height = (int)head.height;
    return status;
}

/* Scales the camera to the size of the depth image. */
static void set_camera(trip_range_image *im)
{
    const trip_range_frame *frame = im->frame;
    const int size[2] = { im->width, im->height };
    for (int a = 0; a < 2; a++) {
        const double by = frame->size[a] > 0 ? size[a] / frame->size[a] : 1;
        im->focal[a] =
            frame->focal[a] > 0 ? frame->focal[a] * by : 0.5 * size[0] / tan(0.5 * frame->angle);
        im->centre[a] = isnan(frame->centre[a]) ? 0.5 * size[a] : frame->centre[a] * by;
    }
}

int trip_range_image_load(trip_range_image *im, trip_image_helper **helper,
                          const trip_range_frame *frame)
{
    im->frame = frame;
    int status = load_distances(im, helper);
    if (status == 0 && frame->colour) {
        status = load_colours(im, helper);
    } else {
        free(im->colour);
        im->colour = NULL;
    }
    if (status == 0)
        set_camera(im);
    return status;
}

void trip_range_image_free(trip_range_image *im)
{
    free(im->z);
    free(im->colour);
    *im = (trip_range_image){ 0 };
}

uint64_t trip_range_image_bytes(const trip_range_image *im)
{
    return (im->z ? (uint64_t)im->width * (uint64_t)im->height * sizeof *im->z : 0) +
           (im->colour ? 3 * (uint64_t)im->colour_width * (uint64_t)im->colour_height : 0);
}

/* ---- geometry ---- */

/* Sets the part of OpenCV's distortion that is not radial, and returns the radial factor. */
static double distort(const double k[4], double x, double y, double aside[2])
{
    const double rr = x * x + y * y;
    aside[0] = 2 * k[2] * x * y + k[3] * (rr + 2 * x * x);
    aside[1] = k[2] * (rr + 2 * y * y) + 2 * k[3] * x * y;
    return 1 + (k[1] * rr + k[0]) * rr;
}

/* Removes the distortion by OpenCV's iteration. */
static void straighten(const double k[4], double *x, double *y)
{
    enum { ROUNDS = 10 };
    const double x0 = *x, y0 = *y;
    for (int i = 0; i < ROUNDS; i++) {
        double aside[2];
        const double radial = distort(k, *x, *y, aside);
        *x = (x0 - aside[0]) / radial;
        *y = (y0 - aside[1]) / radial;
    }
}

static void turn(const double m[3][4], const double v[3], double out[3])
{
    for (int i = 0; i < 3; i++)
        out[i] = m[i][0] * v[0] + m[i][1] * v[1] + m[i][2] * v[2];
}

bool trip_range_image_sample(const trip_range_image *im, int u, int v, bool grazing,
                             trip_range_sample *out)
{
    const trip_range_frame *f = im->frame;
    const double z = (double)im->z[(size_t)v * (size_t)im->width + (size_t)u];
    double x = (u + 0.5 - im->centre[0]) / im->focal[0];
    double y = (v + 0.5 - im->centre[1]) / im->focal[1], normal[3];
    if (!(z > 0))
        return false;
    straighten(f->distortion, &x, &y);
    const trip_range_plane plane = trip_range_fit(im->z, im->width, im->height, u, v);
    out->z = z;
    out->cosine = trip_range_normal(&plane, im->focal, x, y, normal);
    turn(f->pose, (double[]){ x * z, y * z, z }, out->position);
    turn(f->pose, normal, out->normal);
    for (int a = 0; a < 3; a++)
        out->position[a] += f->pose[a][3];
    out->half = 0.5 * z / sqrt(im->focal[0] * im->focal[1]);
    /* Discs of a square grid with this radius cover the plane (surfel_shape.h). */
    out->radius = M_SQRT2 * out->half / fmax(COSINE_LEAST, out->cosine);
    out->sigma = trip_range_sigma(&f->noise, grazing, z, out->cosine,
                                  trip_range_roughness(im->z, im->width, im->height, u, v, &plane));
    return true;
}

bool trip_range_image_find(const trip_range_image *im, const double position[3], double at[2],
                           double *z)
{
    const trip_range_frame *f = im->frame;
    double to[3], local[3], aside[2];
    for (int a = 0; a < 3; a++)
        to[a] = position[a] - f->pose[a][3];
    for (int a = 0; a < 3; a++)
        local[a] = f->pose[0][a] * to[0] + f->pose[1][a] * to[1] + f->pose[2][a] * to[2];
    if (!(local[2] > 0))
        return false;
    const double x = local[0] / local[2], y = local[1] / local[2];
    const double radial = distort(f->distortion, x, y, aside);
    at[0] = im->centre[0] + im->focal[0] * (x * radial + aside[0]);
    at[1] = im->centre[1] + im->focal[1] * (y * radial + aside[1]);
    *z = local[2];
    return true;
}

void trip_range_image_colour(const trip_range_image *im, const double at[2], float rgb[3])
{
    const double x = at[0] * im->colour_width / im->width - 0.5;
    const double y = at[1] * im->colour_height / im->height - 0.5;
    const double left = floor(x), top = floor(y);
    for (int c = 0; c < 3; c++) {
        double sum = 0;
        for (int i = 0; i < 4; i++) {
            const int dx = i & 1, dy = i >> 1;
            const double wx = dx ? x - left : left + 1 - x, wy = dy ? y - top : top + 1 - y;
            const size_t cx = (size_t)fmin(im->colour_width - 1, fmax(0, left + dx));
            const size_t cy = (size_t)fmin(im->colour_height - 1, fmax(0, top + dy));
            sum += wx * wy * im->colour[3 * (cy * (size_t)im->colour_width + cx) + (size_t)c];
        }
        rgb[c] = (float)(sum / 255);
    }
}
