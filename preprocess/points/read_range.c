/* Reads range images: a sequence of depth images with cameras (range_frames.h). Each pixel with a
 * distance is a point. It has the normal of the surface in the image, a radius that covers the
 * spacing of pixels, the colour of the colour image, and an uncertainty (range_shape.h). One frame
 * is in memory at a time. The helper program (image_helper.h) decodes the images. */
#include "point_file_internal.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "budget.h"
#include "image_helper.h"
#include "range_shape.h"
#include "report.h"

enum { PIXELS_MAX = 1 << 25 };
#define FARTHEST 1e9

/* A disc seen from the side covers pixels only if it grows. It grows up to this angle. */
#define COSINE_LEAST 0.25

typedef struct range {
    trip_range_frames list;
    trip_image_helper *helper;
    uint32_t next; /* frame that is loaded next */
    uint32_t at;   /* frame in memory, if width > 0 */
    int width, height;
    float *z;              /* NaN: no distance */
    unsigned char *colour; /* red, green, blue; NULL: none */
    int colour_width, colour_height;
    uint64_t pixel; /* next one of the frame in memory */
    double focal[2], centre[2];
} range;

static bool probe(const trip_point_head *head)
{
    return trip_range_is_json(head->bytes, head->count);
}

static int64_t helper_bytes(void)
{
    return (int64_t)(trip_memory_available_bytes() / 4);
}

static int request(range *r, const char *path, enum trip_image_form form, uint64_t *bytes_out)
{
    const int64_t numbers[5] = { helper_bytes(), form };
    int status = r->helper ? 0 : trip_image_helper_start(&r->helper, "read");
    if (status == 0)
        status = trip_image_helper_request(r->helper, TRIP_IMAGE_READ, path, numbers, -1);
    return status == 0 ? trip_image_helper_outcome(r->helper, bytes_out) : status;
}

/* Checks a size that the helper states. */
static int check_size(range *r, const char *path, int64_t width, int64_t height, uint64_t pixel,
                      uint64_t bytes)
{
    if (width < 1 || height < 1 || width > INT32_MAX || height > INT32_MAX ||
        (uint64_t)width > UINT64_MAX / pixel / (uint64_t)height ||
        (uint64_t)width * (uint64_t)height * pixel != bytes)
        return trip_image_helper_distrust(r->helper, "a picture whose size differs from its data");
    return width * height <= PIXELS_MAX
               ? 0
               : trip_fail(TRIP_ERROR, "read", path,
                           "has %" PRId64 " x %" PRId64 " pixels; a range image has at most %d",
                           width, height, PIXELS_MAX);
}

/* Loads distances in units of the scene. */
static int load_distances(range *r, const trip_range_frame *frame)
{
    trip_image_distances head = { 0 };
    uint64_t bytes = 0;
    int status = request(r, frame->depth, TRIP_IMAGE_FORM_DISTANCES, &bytes);
    if (status == 0 && bytes < sizeof head)
        status = trip_image_helper_distrust(r->helper, "a picture without a size");
    if (status == 0)
        status = trip_image_helper_receive(r->helper, &head, sizeof head);
    if (status == 0)
        status = check_size(r, frame->depth, head.width, head.height, sizeof(float),
                            bytes - sizeof head);
    if (status < 0)
        return status;
    const size_t pixels = (size_t)(head.width * head.height);
    float *z = realloc(r->z, pixels * sizeof *z);
    if (!z)
        return trip_fail(TRIP_ERROR, "read", frame->depth, "out of memory for its distances");
    r->z = z;
    r->width = (int)head.width;
    r->height = (int)head.height;
    status = trip_image_helper_receive(r->helper, z, pixels * sizeof *z);
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
static int load_colours(range *r, const trip_range_frame *frame)
{
    trip_image_size head = { 0 };
    uint64_t bytes = 0;
    int status = request(r, frame->colour, TRIP_IMAGE_FORM_RGBA, &bytes);
    if (status == 0 && bytes < sizeof head)
        status = trip_image_helper_distrust(r->helper, "a picture without a size");
    if (status == 0)
        status = trip_image_helper_receive(r->helper, &head, sizeof head);
    if (status == 0)
        status = check_size(r, frame->colour, head.width, head.height, 4 * sizeof(float),
                            bytes - sizeof head);
    if (status < 0)
        return status;
    const size_t width = (size_t)head.width, pixels = width * (size_t)head.height;
    unsigned char *colour = realloc(r->colour, 3 * pixels);
    float *row = malloc(4 * width * sizeof *row);
    if (colour)
        r->colour = colour;
    if (!colour || !row)
        status = trip_fail(TRIP_ERROR, "read", frame->colour, "out of memory for its colours");
    for (size_t i = 0; i < pixels && status == 0; i++) {
        if (i % width == 0)
            status = trip_image_helper_receive(r->helper, row, 4 * width * sizeof *row);
        for (int c = 0; c < 3 && status == 0; c++) {
            const float v = row[4 * (i % width) + (size_t)c];
            colour[3 * i + (size_t)c] = (unsigned char)(v >= 1 ? 255 : v > 0 ? v * 255 + 0.5f : 0);
        }
    }
    free(row);
    r->colour_width = (int)head.width;
    r->colour_height = (int)head.height;
    return status;
}

/* Scales the camera to the size of the depth image. */
static void set_camera(range *r, const trip_range_frame *frame)
{
    const int size[2] = { r->width, r->height };
    for (int a = 0; a < 2; a++) {
        const double by = frame->size[a] > 0 ? size[a] / frame->size[a] : 1;
        const double given =
            frame->focal[a] > 0 ? frame->focal[a] * by : 0.5 * size[0] / tan(0.5 * frame->angle);
        r->focal[a] = given;
        r->centre[a] = isnan(frame->centre[a]) ? 0.5 * size[a] : frame->centre[a] * by;
    }
}

/* Loads the next frame. */
static int load(trip_point_file *f)
{
    range *r = f->state;
    const trip_range_frame *frame = &r->list.frames[r->next];
    int status = load_distances(r, frame);
    if (status == 0 && frame->colour) {
        status = load_colours(r, frame);
    } else if (status == 0) {
        free(r->colour);
        r->colour = NULL;
    }
    if (status < 0)
        return status;
    set_camera(r, frame);
    f->scans[r->next].width = (uint64_t)r->width;
    f->scans[r->next].height = (uint64_t)r->height;
    r->at = r->next++;
    r->pixel = 0;
    return 0;
}

/* Removes the distortion of a lens by OpenCV's iteration. */
static void straighten(const double k[4], double *x, double *y)
{
    enum { ROUNDS = 10 };
    const double x0 = *x, y0 = *y;
    for (int i = 0; i < ROUNDS; i++) {
        const double rr = *x * *x + *y * *y;
        const double radial = 1 + (k[1] * rr + k[0]) * rr;
        const double dx = 2 * k[2] * *x * *y + k[3] * (rr + 2 * *x * *x);
        const double dy = k[2] * (rr + 2 * *y * *y) + 2 * k[3] * *x * *y;
        *x = (x0 - dx) / radial;
        *y = (y0 - dy) / radial;
    }
}

static void turn(const double m[3][4], const double v[3], double out[3])
{
    for (int i = 0; i < 3; i++)
        out[i] = m[i][0] * v[0] + m[i][1] * v[1] + m[i][2] * v[2];
}

/* Sets the colour between the pixels of the colour image, which shows the same view. */
static void set_colour(const range *r, int u, int v, float out[3])
{
    const double x = (u + 0.5) * r->colour_width / r->width - 0.5;
    const double y = (v + 0.5) * r->colour_height / r->height - 0.5;
    const double left = floor(x), top = floor(y);
    for (int c = 0; c < 3; c++) {
        double sum = 0;
        for (int i = 0; i < 4; i++) {
            const int dx = i & 1, dy = i >> 1;
            const double wx = dx ? x - left : left + 1 - x, wy = dy ? y - top : top + 1 - y;
            const long cx = (long)fmin(r->colour_width - 1, fmax(0, left + dx));
            const long cy = (long)fmin(r->colour_height - 1, fmax(0, top + dy));
            sum += wx * wy * r->colour[3 * (cy * r->colour_width + cx) + c];
        }
        out[c] = (float)(sum / 255);
    }
}

static void set_point(const range *r, trip_point *p)
{
    const trip_range_frame *frame = &r->list.frames[r->at];
    const int u = (int)(r->pixel % (uint64_t)r->width), v = (int)(r->pixel / (uint64_t)r->width);
    const double z = (double)r->z[r->pixel];
    if (!(z > 0)) {
        trip_point_drop(p);
        return;
    }
    double x = (u + 0.5 - r->centre[0]) / r->focal[0], y = (v + 0.5 - r->centre[1]) / r->focal[1];
    double normal[3], turned[3], at[3];
    straighten(frame->distortion, &x, &y);
    const trip_range_plane plane = trip_range_fit(r->z, r->width, r->height, u, v);
    const double cosine = trip_range_normal(&plane, r->focal, x, y, normal);
    const double half = 0.5 * z / sqrt(r->focal[0] * r->focal[1]);
    turn(frame->pose, (double[]){ x * z, y * z, z }, at);
    turn(frame->pose, normal, turned);
    for (int a = 0; a < 3; a++) {
        p->position[a] = at[a] + frame->pose[a][3];
        p->normal[a] = (float)turned[a];
    }
    /* Discs of a square grid with this radius cover the plane (surfel_shape.h). */
    p->radius = (float)(M_SQRT2 * half / fmax(COSINE_LEAST, cosine));
    p->scan = r->at;
    p->footprint = (float)half;
    p->uncertainty =
        (float)trip_range_sigma(&frame->noise, !r->list.noisy, z, cosine,
                                trip_range_roughness(r->z, r->width, r->height, u, v, &plane));
    if (r->colour)
        set_colour(r, u, v, p->colour);
}

static int read_frames(trip_point_file *f, trip_point *out, size_t room, size_t *got_out)
{
    range *r = f->state;
    for (*got_out = 0; *got_out < room;) {
        if (r->pixel == (uint64_t)r->width * (uint64_t)r->height) {
            if (r->next == r->list.count)
                break;
            const int status = load(f);
            if (status < 0)
                return status;
        }
        set_point(r, &out[(*got_out)++]);
        r->pixel++;
    }
    return 0;
}

static int rewind_frames(trip_point_file *f)
{
    range *r = f->state;
    r->next = 0;
    r->width = r->height = 0;
    r->pixel = 0;
    return 0;
}

/* Sets the axis that points up: the one that is nearest to the mean of the cameras' own. */
static void find_up(trip_point_file *f, const trip_range_frames *list)
{
    double sum[3] = { 0 };
    for (uint32_t i = 0; i < list->count; i++)
        for (int a = 0; a < 3; a++)
            sum[a] -= list->frames[i].pose[a][1];
    const bool z = sum[2] > fabs(sum[1]);
    snprintf(f->info.up, sizeof f->info.up, "%s", z ? "z" : sum[1] < 0 ? "-y" : "y");
}

static void describe(trip_point_file *f)
{
    const range *r = f->state;
    const trip_range_frames *l = &r->list;
    bool coloured = false;
    for (uint32_t i = 0; i < l->count; i++)
        coloured = coloured || l->frames[i].colour;
    snprintf(f->info.format, sizeof f->info.format, "range images (%s)", l->layout);
    f->info.attributes = TRIP_POINT_NORMAL | TRIP_POINT_RADIUS | TRIP_POINT_SCAN |
                         TRIP_POINT_UNCERTAINTY | (coloured ? TRIP_POINT_COLOUR : 0);
    if (l->without_pose)
        trip_point_note(f, "%" PRIu32 " of %" PRIu32 " frames have no pose; they are left out",
                        l->without_pose, l->without_pose + l->without_depth + l->count);
    if (l->without_depth)
        trip_point_note(f,
                        "%" PRIu32 " of %" PRIu32 " frames have no depth image; they are left "
                        "out",
                        l->without_depth, l->without_pose + l->without_depth + l->count);
    if (l->default_camera)
        trip_point_note(f,
                        "states no camera; focal lengths of 585 pixels and the middle (320, 240) "
                        "are used");
    find_up(f, l);
}

static int open_frames(trip_point_file *f)
{
    range *r = f->state = calloc(1, sizeof *r);
    int status = r ? trip_range_frames_find(&r->list, f->path) : trip_point_no_memory(f);
    for (uint32_t i = 0; status == 0 && i < r->list.count; i++) {
        trip_point_scan *scan = trip_point_add_scan(f);
        if (!scan)
            return TRIP_ERROR;
        scan->posed = true;
        for (int a = 0; a < 3; a++)
            scan->scanner[a] = r->list.frames[i].pose[a][3];
    }
    if (status < 0)
        return status;
    f->gaps = true;
    describe(f);
    return rewind_frames(f);
}

static void close_frames(trip_point_file *f)
{
    range *r = f->state;
    if (!r)
        return;
    trip_image_helper_stop(r->helper);
    trip_range_frames_free(&r->list);
    free(r->z);
    free(r->colour);
    free(r);
}

const trip_point_reader trip_read_range = { probe, open_frames, read_frames, rewind_frames,
                                            close_frames };
