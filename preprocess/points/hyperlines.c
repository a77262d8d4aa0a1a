#include "hyperlines.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "brick_points.h"
#include "hyperline.h"
#include "image_helper.h"
#include "range_image.h"
#include "range_shape.h"
#include "report.h"
#include "workers.h"

enum { ROWS = 32 }; /* worked on at once */

#define LEAN 0.2 /* least cosine of the normal and the ray to another camera */
#define OFFSET 0.01
/* An earlier frame keeps a sample unless its pixels are so many times as wide. */
#define COARSER 1.25

/* A frame in memory. */
typedef struct held {
    trip_range_image image;
    uint32_t frame;
    bool used; /* beside the frame in hand */
    uint64_t bytes;
} held;

struct trip_hyperlines {
    const char *path;
    trip_range_frames list;
    trip_image_helper *helper;
    trip_workers *workers;
    trip_budget *budget;
    held held[TRIP_HYPERLINE_OTHERS + 1];
    unsigned held_count;
    uint32_t frame; /* in hand; its image and the images of the others are in memory */
    const held *own;
    const held *others[TRIP_HYPERLINE_OTHERS];
    unsigned other_count;
    int row; /* that comes next */
    double factor;
    trip_gaussian *made; /* of ROWS rows, `width` each */
    int width;
    unsigned counts[ROWS], samples[ROWS];
    unsigned given_row, given; /* of the rows made */
    unsigned rows;
    uint64_t sample_count, fused;
};

/* ---- frames ---- */

/* Returns how far two cameras are from each other: the angle, and the distance in units of the
 * extent of all cameras. */
static double apart(const trip_range_frame *a, const trip_range_frame *b, double extent)
{
    double dot = 0, square = 0;
    for (int i = 0; i < 3; i++) {
        const double d = a->pose[i][3] - b->pose[i][3];
        dot += a->pose[i][2] * b->pose[i][2];
        square += d * d;
    }
    return acos(fmin(1, fmax(-1, dot))) + (extent > 0 ? sqrt(square) / extent : 0);
}

static double extent_of(const trip_range_frames *list)
{
    double lo[3] = { INFINITY, INFINITY, INFINITY }, hi[3] = { -INFINITY, -INFINITY, -INFINITY };
    double square = 0;
    for (uint32_t i = 0; i < list->count; i++)
        for (int a = 0; a < 3; a++) {
            lo[a] = fmin(lo[a], list->frames[i].pose[a][3]);
            hi[a] = fmax(hi[a], list->frames[i].pose[a][3]);
        }
    for (int a = 0; a < 3; a++)
        square += (hi[a] - lo[a]) * (hi[a] - lo[a]);
    return sqrt(square);
}

/* Sets the frames beside a frame, by their number. Returns how many there are. */
static unsigned choose_others(const trip_hyperlines *h, uint32_t frame,
                              uint32_t others[TRIP_HYPERLINE_OTHERS])
{
    const trip_range_frame *all = h->list.frames;
    const double extent = extent_of(&h->list);
    double far[TRIP_HYPERLINE_OTHERS];
    unsigned count = 0;
    for (uint32_t i = 0; i < h->list.count; i++) {
        if (i == frame)
            continue;
        const double d = apart(&all[frame], &all[i], extent);
        unsigned at = count < TRIP_HYPERLINE_OTHERS ? count++ : TRIP_HYPERLINE_OTHERS;
        if (at == TRIP_HYPERLINE_OTHERS) {
            if (!(d < far[at - 1]))
                continue;
            at--;
        }
        for (; at > 0 && d < far[at - 1]; at--) {
            far[at] = far[at - 1];
            others[at] = others[at - 1];
        }
        far[at] = d;
        others[at] = i;
    }
    return count;
}

static held *find_held(trip_hyperlines *h, uint32_t frame)
{
    for (unsigned i = 0; i < h->held_count; i++)
        if (h->held[i].frame == frame)
            return &h->held[i];
    return NULL;
}

/* Loads a frame in an unused or a new place. */
static int hold(trip_hyperlines *h, uint32_t frame, const held **out)
{
    held *place = find_held(h, frame);
    int status = 0;
    if (!place) {
        for (unsigned i = 0; i < h->held_count && !place; i++)
            place = h->held[i].used ? NULL : &h->held[i];
        if (!place) {
            place = &h->held[h->held_count++];
            *place = (held){ .bytes = 0 };
        }
        trip_budget_discharge(h->budget, place->bytes);
        place->bytes = 0;
        place->frame = frame;
        status = trip_range_image_load(&place->image, &h->helper, &h->list.frames[frame]);
        const uint64_t bytes = trip_range_image_bytes(&place->image);
        if (status == 0 && !trip_budget_charge(h->budget, bytes))
            status = trip_fail(TRIP_ERROR, "brick", h->path,
                               "%u range images need more memory than --memory allows: raise "
                               "--memory",
                               h->held_count);
        else if (status == 0)
            place->bytes = bytes;
    }
    place->used = true;
    *out = place;
    return status;
}

/* Takes room for ROWS rows of a frame. */
static int take_room(trip_hyperlines *h, int width)
{
    if (h->made)
        trip_budget_release(h->budget, h->made, (size_t)ROWS * (size_t)h->width * sizeof *h->made);
    h->width = width;
    h->made = trip_budget_take(h->budget, (size_t)ROWS * (size_t)width * sizeof *h->made);
    return h->made ? 0
                   : trip_fail(TRIP_ERROR, "brick", h->path,
                               "bricking needs more memory than --memory allows: raise --memory");
}

/* Brings a frame and its others into memory. */
static int begin_frame(trip_hyperlines *h)
{
    uint32_t others[TRIP_HYPERLINE_OTHERS];
    h->other_count = choose_others(h, h->frame, others);
    for (unsigned i = 0; i < h->held_count; i++)
        h->held[i].used = h->held[i].frame == h->frame;
    for (unsigned i = 0; i < h->other_count; i++) {
        held *place = find_held(h, others[i]);
        if (place)
            place->used = true;
    }
    int status = hold(h, h->frame, &h->own);
    for (unsigned i = 0; i < h->other_count && status == 0; i++)
        status = hold(h, others[i], &h->others[i]);
    h->row = 0;
    return status == 0 && (!h->made || h->own->image.width != h->width)
               ? take_room(h, h->own->image.width)
               : status;
}

/* ---- points ---- */

/* A camera that sees a sample. */
typedef struct view {
    float rgb[3];
    double to[3];  /* direction of unit length to the camera */
    double moved;  /* of its surface from the sample, along the normal */
    double weight; /* 1 / sigma^2 */
    double size;   /* width of its pixels on the surface */
    uint32_t frame;
} view;

/* Returns the noise of a distance alone. */
static double noise_of(const trip_range_image *im, double z)
{
    return trip_range_sigma(&im->frame->noise, false, z, 1, 0);
}

/* Sets the mean distance of the four pixels about a place. Returns false if one has no distance, or
 * differs from z by more than `most`. */
static bool mean_distance(const trip_range_image *im, const double at[2], double z, double most,
                          double *out)
{
    const double x = at[0] - 0.5, y = at[1] - 0.5;
    if (!(x >= 0 && y >= 0 && x < im->width - 1 && y < im->height - 1))
        return false;
    const int u = (int)x, v = (int)y;
    *out = 0;
    for (int i = 0; i < 4; i++) {
        const int du = i & 1, dv = i >> 1;
        const double d = (double)im->z[(size_t)(v + dv) * (size_t)im->width + (size_t)(u + du)];
        if (!(fabs(d - z) <= most)) /* also NaN */
            return false;
        *out += (du ? x - u : u + 1 - x) * (dv ? y - v : v + 1 - y) * d;
    }
    return true;
}

/* Returns whether another frame sees a sample, and sets the view. */
static bool see(const held *from, const trip_range_sample *s, double sigma, view *out)
{
    const trip_range_image *im = &from->image;
    double at[2], z, found, dot = 0, length = 0;
    if (!trip_range_image_find(im, s->position, at, &z))
        return false;
    for (int a = 0; a < 3; a++) {
        out->to[a] = im->frame->pose[a][3] - s->position[a];
        length += out->to[a] * out->to[a];
        dot += out->to[a] * s->normal[a];
    }
    length = sqrt(length);
    if (!(dot > LEAN * length))
        return false;
    const double own = noise_of(im, z), most = 3 * sqrt(sigma * sigma + own * own) + OFFSET * z;
    if (!mean_distance(im, at, z, most, &found))
        return false;
    for (int a = 0; a < 3; a++)
        out->to[a] /= length;
    /* The surface lies farther along the ray by (found - z) / z of its length. */
    out->moved = -(found - z) / z * dot;
    out->weight = 1 / (own * own);
    out->size = z / sqrt(im->focal[0] * im->focal[1]) * length / dot;
    out->frame = from->frame;
    trip_range_image_colour(im, at, out->rgb);
    return true;
}

static void see_own(const held *from, int u, int v, const trip_range_sample *s, double sigma,
                    view *out)
{
    double length = 0;
    for (int a = 0; a < 3; a++) {
        out->to[a] = from->image.frame->pose[a][3] - s->position[a];
        length += out->to[a] * out->to[a];
    }
    for (int a = 0; a < 3; a++)
        out->to[a] /= sqrt(length);
    out->moved = 0;
    out->weight = 1 / (sigma * sigma);
    out->size = 2 * s->half / fmax(s->cosine, LEAN);
    out->frame = from->frame;
    trip_range_image_colour(&from->image, (double[]){ u + 0.5, v + 0.5 }, out->rgb);
}

static double cosine_of(const view *a, const view *b)
{
    return a->to[0] * b->to[0] + a->to[1] * b->to[1] + a->to[2] * b->to[2];
}

/* Moves the views that are kept to the front: the first, then each time the one farthest from
 * these. Returns their number. */
static unsigned spread(view *views, unsigned count)
{
    const unsigned most = TRIP_HYPERLINE_CAMERAS;
    for (unsigned n = 1; n < count && n < most; n++) {
        unsigned best = n;
        double least = INFINITY;
        for (unsigned i = n; i < count; i++) {
            double near = -1;
            for (unsigned k = 0; k < n; k++)
                near = fmax(near, cosine_of(&views[i], &views[k]));
            if (near < least) {
                least = near;
                best = i;
            }
        }
        const view kept = views[best];
        views[best] = views[n];
        views[n] = kept;
    }
    return count < most ? count : most;
}

/* Sets the colours of a point. */
static void set_colours(const view *views, unsigned count, trip_gaussian *g)
{
    double mean[3] = { 0 };
    for (unsigned i = 0; i < count; i++)
        for (int c = 0; c < 3; c++)
            mean[c] += (double)views[i].rgb[c] / count;
    for (int c = 0; c < 3; c++)
        g->sh[0][c] = trip_sh_of_colour(mean[c]);
    for (unsigned i = 0; i < count; i++)
        for (int c = 0; c < 3; c++) {
            g->sh[trip_hyperline_at((int)i)][c] = (float)(TRIP_HYPERLINE_LENGTH * views[i].to[c]);
            g->sh[trip_hyperline_at((int)i) + 1][c] = (float)((double)views[i].rgb[c] - mean[c]);
        }
}

/* Returns the radius of a point. A disc reaches across the steps of the noise to the four pixels
 * beside it. */
static double radius_of(const trip_range_image *im, int u, int v, const trip_range_sample *s)
{
    const double most = 2 * noise_of(im, s->z);
    double step = 0;
    for (int i = 0; i < 4; i++) {
        const int x = u + (i == 0) - (i == 1), y = v + (i == 2) - (i == 3);
        if (x < 0 || y < 0 || x >= im->width || y >= im->height)
            continue;
        const double d = fabs((double)im->z[(size_t)y * (size_t)im->width + (size_t)x] - s->z);
        if (d <= most) /* not NaN */
            step = fmax(step, d);
    }
    return fmax(s->radius, M_SQRT1_2 * sqrt(4 * s->half * s->half + step * step));
}

/* Makes the point of a pixel. Returns false if another frame has it. */
static bool make_point(const trip_hyperlines *h, int u, int v, const trip_range_sample *s,
                       trip_gaussian *g)
{
    view views[TRIP_HYPERLINE_OTHERS + 1];
    const double sigma = fmax(noise_of(&h->own->image, s->z), 1e-12 * s->z);
    unsigned count = 1;
    see_own(h->own, u, v, s, sigma, &views[0]);
    for (unsigned i = 0; i < h->other_count; i++) {
        view *found = &views[count];
        if (!see(h->others[i], s, sigma, found))
            continue;
        count++;
        if (found->frame < h->frame && found->size < COARSER * views[0].size)
            return false;
    }
    double moved = 0, all = 0;
    for (unsigned i = 0; i < count; i++) {
        moved += views[i].weight * views[i].moved;
        all += views[i].weight;
    }
    const float deviation =
        (float)(radius_of(&h->own->image, u, v, s) * h->factor * TRIP_SURFEL_DEVIATIONS);
    const float normal[3] = { (float)s->normal[0], (float)s->normal[1], (float)s->normal[2] };
    memset(g, 0, sizeof *g);
    for (int a = 0; a < 3; a++)
        g->centre[a] = s->position[a] + moved / all * s->normal[a];
    g->deviations[0] = g->deviations[1] = deviation;
    trip_point_turn_to(normal, g->rotation);
    g->opacity = 1;
    set_colours(views, spread(views, count), g);
    return true;
}

static int make_row(void *user, unsigned thread, uint64_t item)
{
    trip_hyperlines *h = user;
    const int v = h->row + (int)item;
    unsigned made = 0, samples = 0;
    (void)thread;
    for (int u = 0; u < h->own->image.width; u++) {
        trip_range_sample s;
        if (!trip_range_image_sample(&h->own->image, u, v, !h->list.noisy, &s))
            continue;
        samples++;
        made += make_point(h, u, v, &s, &h->made[item * (size_t)h->width + made]);
    }
    h->counts[item] = made;
    h->samples[item] = samples;
    return 0;
}

/* Makes the next rows. Sets h->rows to 0 at the end. */
static int make_rows(trip_hyperlines *h)
{
    h->rows = h->given_row = h->given = 0;
    int status = 0;
    if (h->own && h->row >= h->own->image.height) {
        h->frame++;
        h->own = NULL;
    }
    if (h->frame == h->list.count)
        return 0;
    if (!h->own)
        status = begin_frame(h);
    if (status < 0)
        return status;
    const int left = h->own->image.height - h->row;
    h->rows = (unsigned)(left < ROWS ? left : ROWS);
    status = trip_workers_run(h->workers, make_row, h, h->rows);
    h->row += (int)h->rows;
    for (unsigned i = 0; i < h->rows && status == 0; i++) {
        h->sample_count += h->samples[i];
        h->fused += h->samples[i] - h->counts[i];
    }
    return status;
}

int trip_hyperlines_read(void *hyperlines, trip_gaussian *out, size_t room, size_t *got)
{
    trip_hyperlines *h = hyperlines;
    for (*got = 0; *got < room;) {
        if (h->given_row == h->rows) {
            const int status = make_rows(h);
            if (status < 0 || h->rows == 0)
                return status;
        }
        const unsigned left = h->counts[h->given_row] - h->given;
        const size_t want = room - *got, count = left < want ? left : want;
        memcpy(out + *got, h->made + h->given_row * (size_t)h->width + h->given,
               count * sizeof *out);
        *got += count;
        h->given += (unsigned)count;
        if (h->given == h->counts[h->given_row]) {
            h->given_row++;
            h->given = 0;
        }
    }
    return 0;
}

void trip_hyperlines_set_factor(trip_hyperlines *h, double factor)
{
    h->factor = factor;
}

uint64_t trip_hyperlines_samples(const trip_hyperlines *h)
{
    return h->sample_count;
}

uint64_t trip_hyperlines_fused(const trip_hyperlines *h)
{
    return h->fused;
}

int trip_hyperlines_open(trip_hyperlines **out, const char *path, unsigned threads,
                         trip_budget *budget)
{
    trip_hyperlines *h = *out = calloc(1, sizeof *h);
    if (!h)
        return trip_fail(TRIP_ERROR, "brick", path, "out of memory");
    h->path = path;
    h->budget = budget;
    h->factor = 1;
    int status = trip_range_frames_find(&h->list, path);
    for (uint32_t i = 0; i < h->list.count && status == 0; i++)
        if (!h->list.frames[i].colour)
            status = trip_fail(TRIP_ERROR, "brick", h->list.frames[i].depth,
                               "has no colour image; --hyperlines needs one for each depth image");
    return status == 0 ? trip_workers_create(&h->workers, threads) : status;
}

void trip_hyperlines_close(trip_hyperlines *h)
{
    if (!h)
        return;
    for (unsigned i = 0; i < h->held_count; i++) {
        trip_budget_discharge(h->budget, h->held[i].bytes);
        trip_range_image_free(&h->held[i].image);
    }
    if (h->made)
        trip_budget_release(h->budget, h->made, (size_t)ROWS * (size_t)h->width * sizeof *h->made);
    trip_workers_destroy(h->workers);
    trip_image_helper_stop(h->helper);
    trip_range_frames_free(&h->list);
    free(h);
}
