#include "plan_cull.h"

#include "brick_box.h"
#include "splat.h"
#include "sheet.h"
#include "weight.h"

/* Maximum number of voxels that a ray moves along u or v from one sheet to the next, unless the
 * list's weight sets a lower bound. Steeper rays have too little weight to be visible. */
#define TRIP_CULL_STEEPEST 64.0

/* Bounds of the voxel positions of a brick, relative to the eye. */
typedef struct box {
    double lo[3], hi[3];
} box;

/* As fmax(), without the call. The arguments are never NaN. */
static double larger(double a, double b)
{
    return a > b ? a : b;
}

static trip_cull_plane side(const trip_camera *c, trip_vec3 to, double pixel, double sign)
{
    trip_vec3 normal = c->ortho ? to : trip_sub(to, trip_scale(c->forward, pixel));
    double length = trip_length(normal);
    return (trip_cull_plane){ trip_scale(normal, sign / length),
                              c->ortho ? sign * pixel / length : 0 };
}

/* Returns the depth behind the eye up to which voxels count. In `post` the cells around the eye
 * have voxels behind it. */
static double behind_eye(const trip_camera *camera, const trip_settings *settings, bool sheets)
{
    if (sheets)
        return trip_sheet_radius(settings->kernel) * trip_length(camera->forward) * (1 + 1e-9);
    const trip_splat_frame f = trip_splat_frame_make(camera, settings);
    double behind = camera->ortho ? trip_splat_parallel_near(&f) : trip_splat_behind(&f);
    return behind * (1 + 1e-9);
}

/* Swan's scaling enlarges flat kernels seen edge-on without bound (splat.h). Only the reference
 * renderer draws them. */
static bool reaches_anywhere(const trip_settings *settings)
{
    return settings->low_pass == TRIP_LOW_PASS_UNIFORM && settings->flatten > 1;
}

trip_cull trip_cull_make(const trip_dataset *data, const trip_camera *camera,
                         const trip_list_grid *grid, const trip_settings *settings,
                         int axis_of_view, const trip_code_set *shown, trip_brick_ranges *about)
{
    double radius = about ? trip_sheet_radius(settings->kernel) : settings->kernel_radius, room = 1;
    if (settings->footprint == TRIP_FOOTPRINT_EWA && !camera->ortho)
        room = TRIP_SPLAT_AFFINE_REACH * TRIP_SPLAT_AFFINE_REACH;
    radius *= data->coordinates.widest;
    double pixel2 = trip_dot(camera->rx, camera->rx) + trip_dot(camera->ry, camera->ry);
    const bool fixed = settings->footprint == TRIP_FOOTPRINT_FIXED;
    double widest = fixed ? trip_splat_fixed_radius_px(settings)
                          : TRIP_CUTOFF * trip_settings_low_pass_px(settings);
    return (trip_cull){
        .camera = camera,
        .settings = settings,
        .grid = grid,
        .header = &data->header,
        .coordinates = &data->coordinates,
        .axis_of_view = axis_of_view,
        .sides = { side(camera, camera->to_x, 0.5, 1), side(camera, camera->to_y, 0.5, 1),
                   side(camera, camera->to_x, camera->width - 0.5, -1),
                   side(camera, camera->to_y, camera->height - 0.5, -1) },
        .radius2 = reaches_anywhere(settings) ? INFINITY
                   : fixed                    ? 0
                                              : room * radius * radius,
        /* The low-pass filter in index space: the largest eigenvalue of S^-1 (splat.h) is at
         * most
         *     z^2 (rx.rx + ry.ry) / sigma^2,  z = 1 in parallel views.
         * Fixed footprints have this term alone. */
        .low_pass2 = room * widest * widest * pixel2,
        .behind = data->coordinates.widest * behind_eye(camera, settings, about != NULL),
        .shown = shown,
        .about = about,
    };
}

/* Returns the bounds of a brick by index axis, relative to the eye. */
static box place_box(const trip_cull *cull, int axis, const trip_brick_box *b)
{
    box r;
    for (int i = 0; i < 3; i++) {
        int a = (axis + 1 + i) % 3;
        double eye = trip_component(cull->camera->eye, a);
        r.lo[a] = trip_coordinates_position(cull->coordinates, a, b->lo[i]) - eye;
        r.hi[a] = trip_coordinates_position(cull->coordinates, a, b->hi[i]) - eye;
    }
    return r;
}

/* Returns the largest n . p over the box. */
static double farthest_along(const box *b, trip_vec3 n)
{
    double sum = 0;
    for (int a = 0; a < 3; a++)
        sum += larger(trip_component(n, a) * b->lo[a], trip_component(n, a) * b->hi[a]);
    return sum;
}

static bool eye_within(const box *b, double margin)
{
    for (int a = 0; a < 3; a++)
        if (b->lo[a] > margin || b->hi[a] < -margin)
            return false;
    return true;
}

/* Whether a box lies outside the view. A splat that does not contain the eye touches a pixel
 * only if it lies within `radius` of a ray of the image, in front of the eye. */
static bool outside(const trip_cull *cull, const box *b, double radius)
{
    for (int i = 0; i < 4; i++)
        if (farthest_along(b, cull->sides[i].normal) + radius < cull->sides[i].offset)
            return true;
    return false;
}

/* Whether a ray near the box may have weight. All rays that come near its splats pass through
 * the box grown by the radius. */
static bool may_weigh(const trip_cull *cull, const box *b, double radius, int axis)
{
    double lo[3], hi[3];
    if (trip_settings_has_one_list(cull->settings) || cull->camera->ortho)
        return true; /* decided for the whole list */
    for (int a = 0; a < 3; a++) {
        lo[a] = (b->lo[a] - radius) * cull->grid->scale[a];
        hi[a] = (b->hi[a] + radius) * cull->grid->scale[a];
    }
    trip_ray_bounds bounds = trip_ray_bounds_of(lo, hi);
    return trip_weight_may_lie(cull->settings, cull->axis_of_view, &bounds, axis);
}

/* Whether no part of a brick is visible. Cells between the brick and its neighbours take values
 * between both, so the neighbours' codes count too. */
static bool is_transparent(trip_cull *cull, const trip_file_brick *brick,
                           const trip_file_slab *slab)
{
    trip_code_range range = { brick->code_min, brick->code_max };
    if (cull->about)
        range = trip_draw_codes_range(cull->about->draw, range.min, range.max);
    if (trip_code_set_has_some(cull->shown, range.min, range.max))
        return false;
    if (!cull->about)
        return true;
    range = trip_brick_ranges_about(cull->about, slab->slab, brick);
    return !trip_code_set_has_some(cull->shown, range.min, range.max);
}

/* Returns how far outside the clipping planes a voxel may lie and still count. Interpolation
 * reads voxels around a sample, and a segment inside the planes may end at a sample outside them.
 */
static double reach_over_clip(const trip_cull *cull)
{
    const trip_settings *s = cull->settings;
    double h = trip_settings_has_one_list(s) ? 0 : trip_weight_h(s);
    if (!cull->about)
        return 0;
    return cull->coordinates->widest * (trip_sheet_reach(s->kernel) +
                                        (h * TRIP_CULL_STEEPEST > 1 ? 1 / h : TRIP_CULL_STEEPEST));
}

static bool is_clipped(const trip_cull *cull, const box *b)
{
    return cull->clip && cull->clip->count > 0 &&
           trip_clip_misses(cull->clip, cull->camera->eye, b->lo, b->hi, reach_over_clip(cull));
}

/* Returns the radius of splats at a depth. */
static double radius_in(const trip_cull *cull, double depth)
{
    double low_pass2 = cull->low_pass2 * (cull->camera->ortho ? 1 : depth * depth);
    return sqrt(cull->radius2 + low_pass2) * (1 + 1e-9);
}

/* Returns the minimum slope of a ray with weight: the distance along the list's axis over the
 * distance along the ray's largest component. */
static double min_slope(const trip_cull *cull, int axis)
{
    const double *scale = cull->grid->scale;
    double h = trip_settings_has_one_list(cull->settings) ? 0 : trip_weight_h(cull->settings);
    return h * fmin(scale[0], fmin(scale[1], scale[2])) / scale[axis];
}

/* Derivation of the bound. Let c be the splat's centre relative to the eye, and z its depth. Let
 * p be the point of the ray nearest to c, at most R(z) away. A ray of the other direction has
 * p_a <= 0, so
 *
 *     c_a <= R.
 *
 * Its slope gives p_a <= -slope |p|, where |p| is the largest component. So also
 *
 *     c_a <= R - slope (|c| - R),
 *
 * where |c| is at least z over the sum of |forward|. Both bounds are equal where R = |c|. Nearer
 * than that the first applies, farther away the second. The second is convex, so its maximum
 * lies there or at the farthest depth. For splats around the eye p may also lie behind the eye
 * by a radius, which gives the factor 2. */
double trip_cull_reach_over_eye(const trip_cull *cull, int axis, const int64_t dims[3])
{
    const trip_vec3 f = cull->camera->forward;
    const double depth = fabs(f.x) + fabs(f.y) + fabs(f.z), slope = min_slope(cull, axis);
    const double turn2 = cull->low_pass2 * depth * depth; /* R grows by its square root per |c| */
    const double radius2 = 2 * cull->radius2;
    trip_brick_box all = { .lo = { 0, 0, 0 } };
    for (int i = 0; i < 3; i++)
        all.hi[i] = (double)(dims[(axis + 1 + i) % 3] - 1);
    const box b = place_box(cull, axis, &all);
    const double away = larger(farthest_along(&b, f), 0);
    const double farthest = sqrt(radius2 + cull->low_pass2 * away * away);
    if (!(turn2 < 1))
        return farthest * (1 + 1e-9);
    const double about = sqrt(radius2 / (1 - turn2));
    return larger(about, (1 + slope) * farthest - slope * away / depth) * (1 + 1e-9);
}

bool trip_cull_may_see(const trip_cull *cull, const double lo[3], const double hi[3])
{
    box b;
    for (int a = 0; a < 3; a++) {
        b.lo[a] = lo[a] - trip_component(cull->camera->eye, a);
        b.hi[a] = hi[a] - trip_component(cull->camera->eye, a);
    }
    double depth = farthest_along(&b, cull->camera->forward);
    return depth > -cull->behind && !outside(cull, &b, radius_in(cull, larger(depth, 0)));
}

trip_cull_reason trip_cull_brick(trip_cull *cull, int axis, const trip_file_brick *brick,
                                 const trip_file_slab *slab)
{
    if (cull->settings->unculled)
        return TRIP_CULL_KEEP;
    if (is_transparent(cull, brick, slab))
        return TRIP_CULL_TRANSPARENT;
    trip_brick_box position = trip_brick_box_of(cull->header, slab, brick);
    box b = place_box(cull, axis, &position);
    if (is_clipped(cull, &b))
        return TRIP_CULL_CLIPPED;
    double depth = farthest_along(&b, cull->camera->forward), front = larger(depth, 0);
    if (!(depth > -cull->behind))
        return TRIP_CULL_OUTSIDE;
    double low_pass2 = cull->camera->ortho ? cull->low_pass2 : cull->low_pass2 * front * front;
    double room = 1 + 1e-9; /* for rounding */
    double radius = sqrt(cull->radius2 + low_pass2) * room;
    /* Any ray may be near a splat around the eye, and its nearest point may lie behind the eye. */
    if (!cull->camera->ortho && eye_within(&b, sqrt(2 * cull->radius2 + low_pass2) * room))
        return TRIP_CULL_KEEP;
    if (outside(cull, &b, radius))
        return TRIP_CULL_OUTSIDE;
    return may_weigh(cull, &b, radius, axis) ? TRIP_CULL_KEEP : TRIP_CULL_NO_WEIGHT;
}
