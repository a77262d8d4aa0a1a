#include "plan_cull.h"

#include "brick_box.h"
#include "splat.h"
#include "sheet.h"
#include "weight.h"

/* Voxels along u or v that a ray of a list moves at most from one sheet to the next, where its
 * weight has no bound of its own that is lower: beyond, it is too little to show. */
#define TRIP_CULL_STEEPEST 64.0

/* Bounds of the voxel positions of a brick, from the eye. */
typedef struct box {
    double lo[3], hi[3];
} box;

/* fmax() without the call: nothing here is not a number. */
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

/* Of sheets the cells about the eye have voxels behind it. */
static double behind_eye(const trip_camera *camera, const trip_settings *settings, bool sheets)
{
    if (sheets)
        return trip_sheet_radius(settings->kernel) * trip_length(camera->forward) * (1 + 1e-9);
    const trip_splat_frame f = trip_splat_frame_make(camera, settings);
    double behind = camera->ortho ? trip_splat_parallel_near(&f) : trip_splat_behind(&f);
    return behind * (1 + 1e-9);
}

/* Flat kernels seen edge-on are scaled up to any size (splat.h), by the reference alone. */
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
    double widest = fixed ? trip_splat_fixed_radius_px(settings) : TRIP_CUTOFF * TRIP_LOW_PASS_PX;
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
        /* The low-pass in index space: the largest eigenvalue of S^-1 (splat.h) is at most
         * z^2 (rx.rx + ry.ry) / sigma^2, z = 1 in parallel views. Of fixed footprints all there
         * is. */
        .low_pass2 = room * widest * widest * pixel2,
        .behind = data->coordinates.widest * behind_eye(camera, settings, about != NULL),
        .shown = shown,
        .about = about,
    };
}

/* By index axes, from the eye. */
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

/* Largest n . p over the box. */
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

/* A splat that is not about the eye touches a pixel only when it lies within `radius` of a ray of
 * the image, in front of the eye. */
static bool outside(const trip_cull *cull, const box *b, double radius)
{
    for (int i = 0; i < 4; i++)
        if (farthest_along(b, cull->sides[i].normal) + radius < cull->sides[i].offset)
            return true;
    return false;
}

/* The points of the box, grown by the radius, are those that carry rays near its splats. */
static bool may_weigh(const trip_cull *cull, const box *b, double radius, int axis)
{
    double lo[3], hi[3];
    if (trip_settings_has_one_list(cull->settings) || cull->camera->ortho)
        return true; /* decided for the list as a whole */
    for (int a = 0; a < 3; a++) {
        lo[a] = (b->lo[a] - radius) * cull->grid->scale[a];
        hi[a] = (b->hi[a] + radius) * cull->grid->scale[a];
    }
    trip_ray_bounds bounds = trip_ray_bounds_of(lo, hi);
    return trip_weight_may_lie(cull->settings, cull->axis_of_view, &bounds, axis);
}

/* Cells between the brick's voxels and its neighbours' may show what neither of them does. */
static bool is_transparent(trip_cull *cull, const trip_file_brick *brick,
                           const trip_file_slab *slab)
{
    if (trip_code_set_has_some(cull->shown, brick->code_min, brick->code_max))
        return false;
    if (!cull->about)
        return true;
    trip_code_range range = trip_brick_ranges_about(cull->about, slab->slab, brick);
    return !trip_code_set_has_some(cull->shown, range.min, range.max);
}

/* Of sheets a value counts that is within reach of a slice that a ray inside the clip, or its
 * segment's other end, passes. */
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

/* The radius of splats that lie as deep as the farthest of the box. */
static double radius_in(const trip_cull *cull, double depth)
{
    double low_pass2 = cull->low_pass2 * (cull->camera->ortho ? 1 : depth * depth);
    return sqrt(cull->radius2 + low_pass2) * (1 + 1e-9);
}

/* The least that a ray with weight goes along the axis for each step along that which it goes
 * farthest along. */
static double min_slope(const trip_cull *cull, int axis)
{
    const double *scale = cull->grid->scale;
    double h = trip_settings_has_one_list(cull->settings) ? 0 : trip_weight_h(cull->settings);
    return h * fmin(scale[0], fmin(scale[1], scale[2])) / scale[axis];
}

/* With c from the eye and p the point of the ray that is nearest to c, at most R(z) away at the
 * depth z of c, a ray of the other way has p_a <= 0, and so c_a <= R; and p_a <= -slope |p|, |p|
 * the largest of its components, so that also c_a <= R - slope (|c| - R), with |c| at least z over
 * the sum of |forward|. The two are equal where R is as long as |c|. Below that the first holds,
 * beyond it the second, which is convex: largest there or at the farthest depth. Of splats about
 * the eye p may lie behind it by a radius too, which the 2 is for. */
double trip_cull_reach_over_eye(const trip_cull *cull, int axis, const int64_t dims[3])
{
    const trip_vec3 f = cull->camera->forward;
    const double depth = fabs(f.x) + fabs(f.y) + fabs(f.z), slope = min_slope(cull, axis);
    const double turn2 = cull->low_pass2 * depth * depth; /* R grows by its root for each |c| */
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
    /* Of splats about the eye the nearest point of a ray may lie behind, and any ray may be near.
     */
    if (!cull->camera->ortho && eye_within(&b, sqrt(2 * cull->radius2 + low_pass2) * room))
        return TRIP_CULL_KEEP;
    if (outside(cull, &b, radius))
        return TRIP_CULL_OUTSIDE;
    return may_weigh(cull, &b, radius, axis) ? TRIP_CULL_KEEP : TRIP_CULL_NO_WEIGHT;
}
