#include "surfels_reference.h"

#include <string.h>

#include "pixels.h"
#include "renderer.h"
#include "surfel_footprint.h"
#include "surfel_light.h"

/* The surfel that a cell selects. */
typedef struct cell {
    trip_surfel_footprint f;
    double rgb[3];
    uint32_t number;
    bool taken;
} cell;

typedef struct sum {
    double rgb[3], tolerance, weight, coverage;
} sum;

struct trip_surfels_reference {
    trip_camera camera;
    trip_gaussian_settings settings;
    trip_budget *budget;
    double *depths; /* D */
    cell *cells;
    sum *sums;
    size_t pixels, cell_count;
    int pitch; /* cells of a row */
};

static size_t cells_along(int size)
{
    return (size_t)size + (size_t)2 * TRIP_SURFEL_GUARD;
}

int trip_surfels_reference_begin(trip_surfels_reference **out, const trip_camera *camera,
                                 const trip_gaussian_settings *settings, trip_budget *budget)
{
    trip_surfels_reference *r = *out = trip_budget_take(budget, sizeof *r);
    bool all = r != NULL;
    if (all) {
        *r = (trip_surfels_reference){
            .camera = *camera,
            .settings = *settings,
            .budget = budget,
            .pixels = (size_t)camera->width * (size_t)camera->height,
            .cell_count = cells_along(camera->width) * cells_along(camera->height),
            .pitch = (int)cells_along(camera->width),
        };
        r->depths = trip_budget_take(budget, r->pixels * sizeof *r->depths);
        r->sums = trip_budget_take(budget, r->pixels * sizeof *r->sums);
        r->cells = trip_budget_take(budget, r->cell_count * sizeof *r->cells);
        all = r->depths && r->sums && r->cells;
    }
    for (size_t i = 0; all && i < r->pixels; i++)
        r->depths[i] = INFINITY;
    if (all)
        return 0;
    trip_surfels_reference_end(r);
    *out = NULL;
    return trip_fail(TRIP_ERROR, "render", "memory",
                     "a picture of %d x %d px does not fit; raise --memory or draw a smaller "
                     "picture",
                     camera->width, camera->height);
}

void trip_surfels_reference_end(trip_surfels_reference *r)
{
    if (!r)
        return;
    trip_budget *budget = r->budget;
    trip_budget_release(budget, r->depths, r->pixels * sizeof *r->depths);
    trip_budget_release(budget, r->sums, r->pixels * sizeof *r->sums);
    trip_budget_release(budget, r->cells, r->cell_count * sizeof *r->cells);
    trip_budget_release(budget, r, sizeof *r);
}

/* ---- visibility and selection ---- */

/* Sets the pixels that a surfel may reach. */
static void bounds_of(const trip_surfels_reference *r, const trip_surfel_footprint *f,
                      trip_pixels *columns, trip_pixels *rows)
{
    const double x = f->reach_x + 1e-6, y = f->reach_y + 1e-6;
    *columns = trip_pixels_within(f->x - x, f->x + x, r->camera.width);
    *rows = trip_pixels_within(f->y - y, f->y + y, r->camera.height);
}

static void lower_depths(trip_surfels_reference *r, const trip_surfel_footprint *f)
{
    trip_pixels columns, rows;
    bounds_of(r, f, &columns, &rows);
    for (int y = rows.first; y <= rows.last; y++)
        for (int x = columns.first; x <= columns.last; x++) {
            const double dx = x + 0.5 - f->x, dy = y + 0.5 - f->y;
            double *depth = &r->depths[(size_t)y * (size_t)r->camera.width + (size_t)x];
            if (trip_surfel_radius2(&f->disc, dx, dy) <= TRIP_SURFEL_RIM)
                *depth = fmin(*depth, trip_surfel_depth(f, r->camera.ortho, dx, dy));
        }
}

static void select_for_cell(trip_surfels_reference *r, const trip_surfel_footprint *f,
                            const trip_gaussian *lit, uint32_t number)
{
    const int x = trip_surfel_cell(f->x, r->camera.width) + TRIP_SURFEL_GUARD;
    const int y = trip_surfel_cell(f->y, r->camera.height) + TRIP_SURFEL_GUARD;
    cell *to = &r->cells[(size_t)y * (size_t)r->pitch + (size_t)x];
    if (to->taken && (to->f.front < f->front || (to->f.front <= f->front && to->number < number)))
        return;
    *to = (cell){ .f = *f, .number = number, .taken = true };
    trip_gaussian_colour(lit, r->settings.degree, trip_gaussian_direction(&r->camera, lit),
                         to->rgb);
}

int trip_surfels_reference_add(trip_surfels_reference *r, const trip_gaussian *surfels,
                               size_t count, uint32_t first)
{
    int status = 0;
    for (size_t i = 0; i < count && !status; i++) {
        trip_surfel_footprint f;
        trip_gaussian lit = surfels[i];
        if (trip_surfel_footprint_of(&r->camera, &r->settings, &lit, &f)) {
            trip_surfel_light(r->settings.light, &r->camera, &lit, 1);
            lower_depths(r, &f);
            select_for_cell(r, &f, &lit, first + (uint32_t)i);
        }
        if (i % 64 == 63)
            status = trip_frame_poll();
    }
    return status;
}

/* ---- blending ---- */

static void blend(trip_surfels_reference *r, const cell *from)
{
    const trip_surfel_footprint *f = &from->f;
    trip_pixels columns, rows;
    bounds_of(r, f, &columns, &rows);
    for (int y = rows.first; y <= rows.last; y++)
        for (int x = columns.first; x <= columns.last; x++) {
            const double dx = x + 0.5 - f->x, dy = y + 0.5 - f->y;
            const double q = trip_surfel_radius2(&f->blend, dx, dy);
            const size_t at = (size_t)y * (size_t)r->camera.width + (size_t)x;
            sum *to = &r->sums[at];
            if (!(q < TRIP_SURFEL_REACH && fabs(trip_surfel_depth(f, r->camera.ortho, dx, dy) -
                                                r->depths[at]) <= f->tolerance))
                continue;
            const double weight = trip_surfel_weight(f, q);
            for (int k = 0; k < 3; k++)
                to->rgb[k] += weight * from->rgb[k];
            to->tolerance += weight * f->tolerance;
            to->weight += weight;
            if (trip_surfel_radius2(&f->disc, dx, dy) <= TRIP_SURFEL_RIM)
                to->coverage += trip_surfel_coverage(&f->disc, dx, dy);
        }
}

static void blend_all(trip_surfels_reference *r)
{
    const int width = r->camera.width, height = r->camera.height;
    memset(r->sums, 0, r->pixels * sizeof *r->sums);
    for (size_t i = 0; i < r->cell_count; i++) {
        const int column = (int)(i % (size_t)r->pitch) - TRIP_SURFEL_GUARD;
        const int row = (int)(i / (size_t)r->pitch) - TRIP_SURFEL_GUARD;
        const size_t pixel = (size_t)trip_surfel_pixel(row, height) * (size_t)width +
                             (size_t)trip_surfel_pixel(column, width);
        if (r->cells[i].taken && r->cells[i].f.front <= r->depths[pixel])
            blend(r, &r->cells[i]);
    }
    for (size_t i = 0; i < r->pixels; i++) {
        sum *s = &r->sums[i];
        s->coverage = fmin(1, s->coverage);
        for (int k = 0; k < 3 && s->weight > 0; k++)
            s->rgb[k] /= s->weight;
        if (s->weight > 0)
            s->tolerance /= s->weight;
    }
}

/* ---- edges ---- */

/* Returns the pixel with weights, up to `reach` pixels away, with the least difference to a depth,
 * or -1 for none. */
static long nearest_within(const trip_surfels_reference *r, int x, int y, int reach, double depth)
{
    const int width = r->camera.width, height = r->camera.height;
    double least = INFINITY;
    long found = -1;
    for (int row = y - reach; row <= y + reach; row++)
        for (int column = x - reach; column <= x + reach; column++) {
            const long next = (long)row * width + column;
            if (row < 0 || row >= height || column < 0 || column >= width ||
                !(r->sums[next].weight > 0))
                continue;
            const double apart = fabs(r->depths[next] - depth);
            if (apart < least)
                found = next;
            least = fmin(least, apart);
        }
    return found;
}

/* Returns the pixel that gives pixel (x, y) its colour, or -1 for none. */
static long donor_of(const trip_surfels_reference *r, int x, int y)
{
    const long at = (long)y * r->camera.width + x;
    long found = -1;
    if (isinf(r->depths[at]))
        return -1;
    if (r->sums[at].weight > 0)
        return at;
    for (int reach = 1; reach <= TRIP_SURFEL_DONORS && found < 0; reach++)
        found = nearest_within(r, x, y, reach, r->depths[at]);
    return found;
}

/* Sets the premultiplied colour of pixel (x, y). Returns false if it is empty. */
static bool finish(const trip_surfels_reference *r, int x, int y, double rgba[4])
{
    const int width = r->camera.width, height = r->camera.height;
    const long at = (long)y * width + x, own = donor_of(r, x, y);
    double behind[4] = { 0 };
    int count = 0;
    memset(rgba, 0, 4 * sizeof *rgba);
    if (own < 0)
        return false;
    const double limit = r->depths[at] + r->sums[own].tolerance;
    for (int row = y - 1; row <= y + 1; row++)
        for (int column = x - 1; column <= x + 1; column++) {
            const long next = (long)row * width + column;
            if (row < 0 || row >= height || column < 0 || column >= width ||
                !(r->depths[next] > limit))
                continue;
            if (isinf(r->depths[next]))
                count++;
            if (!(r->sums[next].weight > 0))
                continue;
            count++;
            behind[3] += 1;
            for (int k = 0; k < 3; k++)
                behind[k] += r->sums[next].rgb[k];
        }
    const double opacity = count ? r->sums[at].coverage : 1;
    for (int k = 0; k < 4; k++)
        rgba[k] = opacity * (k < 3 ? r->sums[own].rgb[k] : 1) +
                  (count ? (1 - opacity) * behind[k] / count : 0);
    return true;
}

void trip_surfels_reference_picture(trip_surfels_reference *r, float *rgba, float *depth)
{
    const trip_camera *c = &r->camera;
    const double *behind = r->settings.background;
    blend_all(r);
    for (int y = 0; y < c->height; y++)
        for (int x = 0; x < c->width; x++) {
            const size_t at = (size_t)y * (size_t)c->width + (size_t)x;
            double own[4];
            const bool any = finish(r, x, y, own);
            for (int k = 0; k < 4; k++)
                own[k] *= trip_surfel_opacity(&r->settings);
            const double rest = (1 - own[3]) * behind[3];
            for (int k = 0; k < 3; k++)
                rgba[4 * at + (size_t)k] = (float)(own[k] + rest * behind[k]);
            rgba[4 * at + 3] = (float)(own[3] + rest);
            if (depth)
                depth[at] =
                    (float)(any ? r->depths[at] * trip_camera_ray_length(c, x + 0.5, y + 0.5)
                                : INFINITY);
        }
}
