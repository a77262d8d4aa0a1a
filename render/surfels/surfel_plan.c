#include "surfel_plan.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "gaussian_keys.h"
#include "report.h"
#include "surfel_footprint.h"
#include "weight.h"

enum { PLANES_MAX = TRIP_GAUSSIAN_SIDES + 1 + TRIP_CLIP_MAX };

/* Deviations that a surfel reaches, with room for rounding. */
#define REACH (2.4494897427831781 * (1 + 1e-5)) /* the root of TRIP_SURFEL_REACH */

/* A view of a set, in the set's space. */
typedef struct placed_view {
    const trip_placed_set *set;
    trip_gaussian_plane planes[PLANES_MAX];
    unsigned plane_count;
    trip_gaussian_lod lod;
    int axis;
} placed_view;

/* ---- history ---- */

void trip_surfel_history_drop(trip_surfel_history *h, trip_budget *budget)
{
    trip_budget_release(budget, h->bricks, h->count * sizeof *h->bricks);
    *h = (trip_surfel_history){ 0 };
}

/* Returns a number that tells bricks of all sets and lists apart. */
static uint64_t identity_of(const trip_surfel_brick *b)
{
    return (uint64_t)b->object << 40 | (uint64_t)b->axis << 38 | b->brick;
}

static int ascending(const void *a, const void *b)
{
    const uint64_t x = *(const uint64_t *)a, y = *(const uint64_t *)b;
    return (x > y) - (x < y);
}

static bool was_visible(const trip_surfel_history *h, const trip_surfel_brick *b)
{
    const uint64_t identity = identity_of(b);
    return h && h->count && bsearch(&identity, h->bricks, h->count, sizeof identity, ascending);
}

void trip_surfel_plan_keep_visible(const trip_surfel_plan *plan, trip_surfel_history *h,
                                   trip_budget *budget)
{
    size_t count = 0, at = 0;
    trip_surfel_history_drop(h, budget);
    for (size_t i = 0; i < plan->count; i++)
        count += plan->bricks[i].is_visible;
    h->bricks = count ? trip_budget_take(budget, count * sizeof *h->bricks) : NULL;
    if (!h->bricks)
        return;
    h->count = count;
    for (size_t i = 0; i < plan->count; i++)
        if (plan->bricks[i].is_visible)
            h->bricks[at++] = identity_of(&plan->bricks[i]);
    qsort(h->bricks, count, sizeof *h->bricks, ascending);
}

/* ---- culling ---- */

/* Sets the planes of the picture's sides, of the eye, and of the clip. */
static unsigned planes_of(const trip_camera *c, const trip_clip *clip, trip_gaussian_plane *planes)
{
    unsigned count = trip_gaussian_planes_of(c, planes);
    const double scale = 1 / trip_length(c->forward);
    trip_gaussian_plane *eye = &planes[TRIP_GAUSSIAN_SIDES];
    *eye = (trip_gaussian_plane){ .offset = -scale * trip_dot(c->forward, c->eye) };
    for (int a = 0; a < 3; a++)
        eye->normal[a] = scale * trip_component(c->forward, a);
    /* The sides count TRIP_GAUSSIAN_REACH deviations. */
    for (int i = 0; i < TRIP_GAUSSIAN_SIDES; i++)
        planes[i].reach *= REACH * TRIP_SURFEL_MERGED / TRIP_GAUSSIAN_REACH;
    for (int i = 0; i < clip->count; i++) {
        const trip_half_space *h = &clip->planes[i];
        planes[count++] =
            (trip_gaussian_plane){ { h->normal.x, h->normal.y, h->normal.z }, h->offset, 0 };
    }
    return count;
}

static placed_view place_view(const trip_surfel_plan_params *p, const trip_placed_set *set,
                              const trip_gaussian_plane *planes, unsigned count)
{
    const trip_gaussian_transform *t = &set->placement;
    placed_view v = { .set = set, .plane_count = count };
    for (unsigned i = 0; i < count; i++) {
        trip_place_function(t, planes[i].normal, planes[i].offset, v.planes[i].normal,
                            &v.planes[i].offset);
        v.planes[i].reach = planes[i].reach * (t->identity ? 1 : t->scale);
    }
    v.lod = trip_gaussian_lod_of(p->camera, p->lod_px);
    trip_place_lod(&v.lod, t);
    v.axis = trip_place_axis(t, trip_weight_axis_of_view(p->camera));
    return v;
}

/* Returns whether a box of centres with deviations up to `deviation` may meet the view. */
static bool meets_view(const placed_view *v, const double lo[3], const double hi[3],
                       double deviation)
{
    for (unsigned i = 0; i < v->plane_count; i++) {
        const trip_gaussian_plane *p = &v->planes[i];
        double most = p->offset, size = fabs(p->offset);
        for (int a = 0; a < 3; a++) {
            const double part = p->normal[a] * (p->normal[a] > 0 ? hi[a] : lo[a]);
            most += part;
            size += fabs(part);
        }
        if (most + p->reach * TRIP_GAUSSIAN_REACH * deviation + 1e-12 * size < 0)
            return false;
    }
    return true;
}

static double deviation_of(const trip_file_gaussian_brick *b)
{
    return exp((double)b->log_hi) * (1 + 1e-6);
}

/* Returns the largest deviation of a list. */
static double largest_deviation(const trip_gaussian_set *set, int axis)
{
    float most = -INFINITY;
    for (uint64_t i = 0; i < set->lists[axis].brick_count; i++)
        most = fmaxf(most, set->lists[axis].bricks[i].log_hi);
    return exp((double)most) * (1 + 1e-6);
}

/* ---- bounds ---- */

const trip_file_gaussian_brick *trip_surfel_plan_brick(const trip_surfel_plan *plan,
                                                       const trip_surfel_brick *b)
{
    return &plan->sets[b->object].set->lists[b->axis].bricks[b->brick];
}

/* Returns a corner of a placed box. */
static trip_vec3 corner_of(const trip_gaussian_transform *t, const double lo[3], const double hi[3],
                           int number)
{
    double from[3], to[3];
    for (int a = 0; a < 3; a++)
        from[a] = number >> a & 1 ? hi[a] : lo[a];
    for (int a = 0; a < 3; a++)
        to[a] = t->identity ? from[a]
                            : t->m[a][0] * from[0] + t->m[a][1] * from[1] + t->m[a][2] * from[2] +
                                  t->m[a][3];
    return trip_v3(to[0], to[1], to[2]);
}

/* Returns the least depth of a placed box. */
static double nearest_of(const trip_camera *c, const trip_gaussian_transform *t, const double lo[3],
                         const double hi[3])
{
    double nearest = INFINITY;
    for (int i = 0; i < 8; i++)
        nearest = fmin(nearest, trip_dot(c->forward, trip_sub(corner_of(t, lo, hi, i), c->eye)));
    return nearest;
}

bool trip_surfel_plan_bounds(const trip_surfel_plan *plan, const trip_camera *c,
                             const trip_surfel_brick *b, double lo[2], double hi[2], double *depth)
{
    const trip_file_gaussian_brick *of = trip_surfel_plan_brick(plan, b);
    const trip_gaussian_transform *t = &plan->sets[b->object].placement;
    const double deviation = deviation_of(of) * (t->identity ? 1 : t->scale * (1 + 1e-6)) *
                             (b->is_coarse ? TRIP_SURFEL_MERGED : 1);
    const double nearest = nearest_of(c, t, of->centre_lo, of->centre_hi);
    const double radius = TRIP_SURFEL_RADIUS * deviation * trip_length(c->forward);
    const double growth = (1 + TRIP_SURFEL_STEEP) * trip_surfel_pixel_width(c, 1);
    if (!(nearest > 0 && (c->ortho || growth < 1)))
        return false;
    lo[0] = lo[1] = INFINITY;
    hi[0] = hi[1] = -INFINITY;
    for (int i = 0; i < 8; i++) {
        const trip_vec3 from_eye = trip_sub(corner_of(t, of->centre_lo, of->centre_hi, i), c->eye);
        const double by = c->ortho ? 1 : trip_dot(c->forward, from_eye);
        const double at[2] = { trip_dot(c->to_x, from_eye) / by, trip_dot(c->to_y, from_eye) / by };
        for (int k = 0; k < 2; k++) {
            lo[k] = fmin(lo[k], at[k]);
            hi[k] = fmax(hi[k], at[k]);
        }
    }
    for (int k = 0; k < 2; k++) {
        const double stretch =
            trip_gaussian_stretch(c, k ? c->to_y : c->to_x, k ? c->height : c->width);
        const double wide = deviation * stretch / (c->ortho ? 1 : nearest);
        const double reach = REACH * sqrt(wide * wide + TRIP_SURFEL_LOW_PASS) + 0.01;
        lo[k] -= reach;
        hi[k] += reach;
    }
    /* The depth of a surfel may be less by its extent, and its front by its tolerance, too. Both
     * grow with the width of a pixel, more slowly than the depth. */
    *depth = nearest - (TRIP_SURFEL_WIDEN + TRIP_SURFEL_OFFSET) * radius -
             growth * (c->ortho ? 1 : nearest);
    *depth -= 1e-6 * nearest;
    return *depth > 0;
}

/* ---- sides ---- */

/* Turns a vector by a quaternion. */
static trip_vec3 turned_by(const double q[4], trip_vec3 v)
{
    const trip_vec3 u = trip_v3(q[1], q[2], q[3]);
    const trip_vec3 t = trip_scale(trip_cross(u, v), 2);
    return trip_add(v, trip_add(trip_scale(t, q[0]), trip_cross(u, t)));
}

/* Returns whether all surfels of a brick face away, in spite of rounding. */
static bool faces_away(const trip_camera *c, const trip_gaussian_transform *t,
                       const trip_file_gaussian_brick *b)
{
    trip_vec3 axis =
        trip_v3((double)b->cone_axis[0], (double)b->cone_axis[1], (double)b->cone_axis[2]);
    const double cosine = (double)b->cone_cosine;
    double sine = sqrt(1 - cosine * cosine) + 1e-5;
    if (!(cosine > 0))
        return false;
    axis = trip_normalize(axis);
    if (!t->identity) {
        const double *q = t->rotation;
        const double square = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3];
        axis = turned_by(q, axis);
        sine += 4 * fabs(1 - square); /* normals turn by a quaternion that may not be quite unit */
    }
    if (c->ortho)
        return trip_dot(axis, c->r0) > sine * trip_length(c->r0);
    bool away = true;
    for (int i = 0; i < 8 && away; i++) {
        const trip_vec3 corner = corner_of(t, b->centre_lo, b->centre_hi, i);
        const trip_vec3 from_eye = trip_sub(corner, c->eye);
        const double rounding = 1e-12 * (trip_length(corner) + trip_length(c->eye));
        away = trip_dot(axis, from_eye) > sine * trip_length(from_eye) + rounding;
    }
    return away;
}

/* ---- the plan ---- */

/* Returns how many bricks the levels of a set have. */
static uint64_t bricks_of(const placed_view *v)
{
    uint64_t count = 0;
    trip_gaussian_walk walk = { 0 };
    while (trip_gaussian_walk_next(v->set->set, &v->lod, &walk))
        count += v->set->set->nodes[walk.node].brick_count[v->axis];
    return count;
}

static void add_node(trip_surfel_plan *plan, trip_key *keys, const trip_surfel_plan_params *p,
                     const placed_view *v, const trip_gaussian_walk *walk)
{
    const trip_gaussian_set *set = v->set->set;
    const trip_file_gaussian_node *n = &set->nodes[walk->node];
    const uint64_t first = n->first_brick[v->axis], end = first + n->brick_count[v->axis];
    for (uint64_t i = first; i < end; i++) {
        const trip_file_gaussian_brick *from = &set->lists[v->axis].bricks[i];
        if (!meets_view(v, from->centre_lo, from->centre_hi, deviation_of(from))) {
            plan->outside_records += from->records;
            continue;
        }
        plan->coarse_records += n->nodes > 1 ? from->records : 0;
        if (p->front && faces_away(p->camera, &v->set->placement, from)) {
            plan->away_records += from->records;
            continue;
        }
        trip_surfel_brick *b = &plan->bricks[plan->count];
        *b = (trip_surfel_brick){ .brick = i,
                                  .object = (uint32_t)(v->set - p->sets),
                                  .first = (uint32_t)plan->records,
                                  .share = (float)walk->share,
                                  .axis = (uint8_t)v->axis,
                                  .is_coarse = n->nodes > 1 };
        const double nearest =
            nearest_of(p->camera, &v->set->placement, from->centre_lo, from->centre_hi);
        uint64_t key = trip_key_of(fmax(0, nearest));
        if (was_visible(p->history, b))
            key &= ~(UINT64_C(1) << 63); /* before all others */
        keys[plan->count] = (trip_key){ key, plan->count };
        plan->count++;
        plan->records += from->records;
    }
}

/* Calls add_node() for all nodes of all sets that meet the view, or counts their bricks if the plan
 * has no memory yet. */
static uint64_t go_through(trip_surfel_plan *plan, trip_key *keys, const trip_surfel_plan_params *p)
{
    trip_gaussian_plane planes[PLANES_MAX];
    const unsigned plane_count = planes_of(p->camera, p->clip, planes);
    const trip_gaussian_set *before = NULL;
    double largest = 0;
    int axis = -1;
    uint64_t count = 0;
    plan->objects = 0;
    for (unsigned i = 0; i < p->set_count; i++) {
        const placed_view v = place_view(p, &p->sets[i], planes, plane_count);
        const trip_gaussian_set *set = p->sets[i].set;
        if (set != before || axis != v.axis)
            largest = largest_deviation(set, v.axis);
        before = set;
        axis = v.axis;
        if (!meets_view(&v, set->header.centre_lo, set->header.centre_hi, largest))
            continue;
        plan->objects++;
        trip_gaussian_walk walk = { 0 };
        if (!plan->memory)
            count += bricks_of(&v);
        else
            while (trip_gaussian_walk_next(set, &v.lod, &walk))
                add_node(plan, keys, p, &v, &walk);
    }
    return count;
}

int trip_surfel_plan_make(trip_surfel_plan *plan, const trip_surfel_plan_params *p)
{
    *plan = (trip_surfel_plan){ .sets = p->sets };
    const uint64_t room = go_through(plan, NULL, p) + 1;
    plan->bytes = room * (sizeof *plan->bricks + 2 * sizeof *plan->order);
    plan->memory = trip_budget_take(p->budget, plan->bytes);
    if (!plan->memory)
        return trip_fail(TRIP_ERROR, "read", "scenes",
                         "no memory for the order of %llu bricks; raise --memory",
                         (unsigned long long)room);
    plan->bricks = plan->memory;
    plan->order = (void *)(plan->bricks + room);
    go_through(plan, plan->order, p);
    if (plan->records > UINT32_MAX)
        return trip_fail(TRIP_ERROR, "render", "scenes",
                         "this view has %llu surfels, and a deferred picture at most 4294967295: "
                         "raise --lod, or use --order depth",
                         (unsigned long long)plan->records);
    trip_key_sort(plan->order, plan->order + room, plan->count);
    return 0;
}

void trip_surfel_plan_drop(trip_surfel_plan *plan, trip_budget *budget)
{
    trip_budget_release(budget, plan->memory, plan->bytes);
    *plan = (trip_surfel_plan){ 0 };
}
