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

#include "image_helper.h"
#include "range_image.h"
#include "report.h"

typedef struct range {
    trip_range_frames list;
    trip_image_helper *helper;
    trip_range_image image; /* of frame `next` - 1, if `next` > 0 */
    uint32_t next;          /* frame that is loaded next */
    uint64_t pixel, pixels; /* next one of the image, and all of it */
} range;

static bool probe(const trip_point_head *head)
{
    return trip_range_is_json(head->bytes, head->count);
}

/* Loads the next frame. */
static int load(trip_point_file *f)
{
    range *r = f->state;
    const int status = trip_range_image_load(&r->image, &r->helper, &r->list.frames[r->next]);
    if (status < 0)
        return status;
    f->scans[r->next].width = (uint64_t)r->image.width;
    f->scans[r->next].height = (uint64_t)r->image.height;
    r->next++;
    r->pixel = 0;
    r->pixels = (uint64_t)r->image.width * (uint64_t)r->image.height;
    return 0;
}

static void set_point(const range *r, trip_point *p)
{
    const trip_range_image *im = &r->image;
    const int u = (int)(r->pixel % (uint64_t)im->width), v = (int)(r->pixel / (uint64_t)im->width);
    trip_range_sample s;
    if (!trip_range_image_sample(im, u, v, !r->list.noisy, &s)) {
        trip_point_drop(p);
        return;
    }
    memcpy(p->position, s.position, sizeof p->position);
    for (int a = 0; a < 3; a++)
        p->normal[a] = (float)s.normal[a];
    p->radius = (float)s.radius;
    p->scan = r->next - 1;
    p->footprint = (float)s.half;
    p->uncertainty = (float)s.sigma;
    if (im->colour)
        trip_range_image_colour(im, (double[]){ u + 0.5, v + 0.5 }, p->colour);
}

static int read_frames(trip_point_file *f, trip_point *out, size_t room, size_t *got_out)
{
    range *r = f->state;
    for (*got_out = 0; *got_out < room;) {
        if (r->pixel == r->pixels) {
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
    r->pixel = r->pixels = 0;
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
    trip_range_image_free(&r->image);
    free(r);
}

const trip_point_reader trip_read_range = { probe, open_frames, read_frames, rewind_frames,
                                            close_frames };
