#include "integrand.h"

#include <stdlib.h>
#include <string.h>

#include "report.h"
#include "shade.h"
#include "splat.h"

enum { FIRST_ROOM = 4096 };

/* A ray through the splats. */
typedef struct passage {
    const trip_integrand *in;
    const trip_ray *ray;
    trip_splat_hits *hits;
    double sigma, radius, amplitude; /* in index space; amplitude of the density */
    size_t first;                    /* earlier hits end before the current position */
} passage;

void trip_splat_hits_free(trip_splat_hits *h)
{
    if (h->hits)
        trip_budget_release(h->budget, h->hits, h->room * sizeof *h->hits);
    h->hits = NULL;
    h->count = h->room = 0;
}

static int make_room(trip_splat_hits *h)
{
    size_t room = h->room ? 2 * h->room : FIRST_ROOM;
    trip_splat_hit *hits = trip_budget_take(h->budget, room * sizeof *hits);
    if (!hits)
        return trip_fail(TRIP_ERROR, "render", "integral",
                         "the splats of a ray do not fit the memory given; raise --memory");
    if (h->hits) {
        memcpy(hits, h->hits, h->count * sizeof *hits);
        trip_budget_release(h->budget, h->hits, h->room * sizeof *hits);
    }
    h->hits = hits;
    h->room = room;
    return 0;
}

/* Returns the squared distance of a point from the ray's line, in a space where a voxel of this
 * width has edges of 1. Also computes t of the nearest point, and the length of the ray's direction
 * there. */
static double distance2(const trip_ray *ray, trip_vec3 point, trip_vec3 width, double *t,
                        double *length)
{
    const trip_vec3 from = trip_vec3_over(trip_sub(point, ray->origin), width);
    const trip_vec3 d = trip_vec3_over(ray->direction, width);
    const trip_vec3 across = trip_cross(from, d);
    *length = trip_length(d);
    *t = trip_dot(from, d) / (*length * *length);
    return trip_dot(across, across) / (*length * *length);
}

static void colour(const trip_integrand *in, trip_vec3 at, const trip_field_voxel *v,
                   const trip_tf_entry *entry, double rgb[3])
{
    const double gradient[3] = { v->gradient[0], v->gradient[1], v->gradient[2] };
    rgb[0] = entry->r;
    rgb[1] = entry->g;
    rgb[2] = entry->b;
    if (in->shaded)
        trip_shade(in->settings, in->camera, in->gradient_full, at, gradient, rgb);
}

static int add_hit(passage *p, const int64_t at[3], const trip_field_voxel *v)
{
    const trip_tf_entry *entry = &p->in->classes->table[(unsigned)v->code];
    const trip_coordinates *c = p->in->coordinates;
    const trip_vec3 voxel = trip_v3((double)at[0], (double)at[1], (double)at[2]);
    const trip_vec3 centre = trip_coordinates_point(c, voxel);
    const int64_t *dims = trip_field_dims(p->in->field);
    trip_splat_hit hit = { .extinction = entry->extinction };
    if (!(entry->extinction > 0))
        return 0;
    hit.distance2 =
        distance2(p->ray, centre, trip_coordinates_widths(c, voxel), &hit.middle, &hit.length);
    double half2 = p->radius * p->radius - hit.distance2;
    if (!(half2 > 0 && trip_clip_has(p->in->clip, centre)))
        return 0;
    hit.enter = fmax(0, hit.middle - sqrt(half2) / hit.length);
    hit.leave = hit.middle + sqrt(half2) / hit.length;
    hit.voxel = ((uint64_t)at[2] * (uint64_t)dims[1] + (uint64_t)at[1]) * (uint64_t)dims[0] +
                (uint64_t)at[0];
    if (hit.leave <= hit.enter)
        return 0;
    if (p->hits->count == p->hits->room && make_room(p->hits))
        return TRIP_ERROR;
    colour(p->in, centre, v, entry, hit.rgb);
    p->hits->hits[p->hits->count++] = hit;
    return 0;
}

/* Whether no splat of a cube's voxels reaches the ray. */
static bool is_missed(const passage *p, const trip_field_cube *cube)
{
    const trip_coordinates *c = p->in->coordinates;
    const int64_t *dims = trip_field_dims(p->in->field);
    double half[3], middle[3], t, length;
    for (int a = 0; a < 3; a++) {
        const int64_t end = cube->at[a] + TRIP_FIELD_EDGE,
                      last = end < dims[a] ? end - 1 : dims[a] - 1;
        const double from = trip_coordinates_at(c, a, cube->at[a]),
                     to = trip_coordinates_at(c, a, last);
        half[a] = 0.5 * (to - from);
        middle[a] = 0.5 * (to + from);
    }
    const double reach =
        p->radius * c->widest + sqrt(half[0] * half[0] + half[1] * half[1] + half[2] * half[2]);
    return distance2(p->ray, trip_v3(middle[0], middle[1], middle[2]), trip_v3(1, 1, 1), &t,
                     &length) > reach * reach;
}

static int add_hits_of_cube(passage *p, const trip_field_cube *cube)
{
    enum { EDGE = TRIP_FIELD_EDGE };
    if (is_missed(p, cube))
        return 0;
    for (int n = 0; n < EDGE * EDGE * EDGE; n++) {
        const int64_t at[3] = { cube->at[0] + n % EDGE, cube->at[1] + n / EDGE % EDGE,
                                cube->at[2] + n / (EDGE * EDGE) };
        if (!isnan(cube->voxels[n].code) && add_hit(p, at, &cube->voxels[n]))
            return TRIP_ERROR;
    }
    return 0;
}

static int by_entry(const void *a, const void *b)
{
    const trip_splat_hit *x = a, *y = b;
    if (x->enter != y->enter)
        return x->enter < y->enter ? -1 : 1;
    return x->voxel < y->voxel ? -1 : x->voxel > y->voxel;
}

static int gather_hits(passage *p)
{
    int status = 0;
    p->hits->count = 0;
    for (size_t i = 0; i < trip_field_cubes(p->in->field) && !status; i++)
        status = add_hits_of_cube(p, trip_field_cube_by_number(p->in->field, i));
    if (p->hits->count > 0)
        qsort(p->hits->hits, p->hits->count, sizeof *p->hits->hits, by_entry);
    return status;
}

static double density(const passage *p, const trip_splat_hit *hit, double t)
{
    double along = (t - hit->middle) * hit->length;
    double r2 = hit->distance2 + along * along, left = p->radius * p->radius - r2;
    if (!(left > 0))
        return 0;
    return p->amplitude * exp(-r2 / (2 * p->sigma * p->sigma)) * erf(sqrt(left / 2) / p->sigma);
}

static void sample(void *user, double t, trip_ray_sample *out)
{
    const passage *p = user;
    const trip_splat_hit *end = p->hits->hits + p->hits->count;
    *out = (trip_ray_sample){ 0 };
    for (const trip_splat_hit *hit = p->hits->hits + p->first; hit < end && hit->enter <= t;
         hit++) {
        double extinction = hit->extinction * density(p, hit, t) * p->ray->world_per_t;
        out->extinction += extinction;
        for (int i = 0; i < 3; i++)
            out->rgb[i] += extinction * hit->rgb[i];
    }
    for (int i = 0; i < 3 && out->extinction > 0; i++)
        out->rgb[i] /= out->extinction;
}

/* Integrates piece by piece. Pieces are as long as the smallest voxel, and gaps between splats are
 * skipped. */
static void add_pieces(passage *p, trip_ray_sum *sum)
{
    const trip_splat_hit *hits = p->hits->hits;
    const size_t count = p->hits->count;
    double end = 0, step = INFINITY, longest = 0;
    for (size_t i = 0; i < count; i++) {
        end = fmax(end, hits[i].leave);
        step = fmin(step, 1 / hits[i].length);
        longest = fmax(longest, 2 * p->radius / hits[i].length);
    }
    sum->length = end - hits[0].enter;
    trip_ray_end from = trip_ray_end_at(hits[0].enter, sample, p);
    while (from.t < end && !trip_ray_sum_is_over(sum)) {
        while (p->first < count && hits[p->first].enter < from.t - longest)
            p->first++;
        if (p->first < count && hits[p->first].enter > from.t)
            from = trip_ray_end_at(hits[p->first].enter, sample, p);
        const trip_ray_end to = trip_ray_end_at(fmin(from.t + step, end), sample, p);
        trip_ray_sum_add(sum, &from, &to, sample, p);
        from = to;
    }
}

int trip_integrate_splats(const trip_integrand *in, const trip_ray *ray, trip_splat_hits *hits,
                          trip_ray_sum *out)
{
    const double two_pi = 6.28318530717958647692;
    const trip_splat_frame f = trip_splat_frame_make(in->camera, in->settings);
    passage p = { .in = in,
                  .ray = ray,
                  .hits = hits,
                  .sigma = f.sigma,
                  .radius = f.sigma * TRIP_CUTOFF,
                  .amplitude = f.amplitude / (sqrt(two_pi) * f.sigma) };
    *out = trip_ray_sum_begin(in->tolerance, 1);
    int status = gather_hits(&p);
    if (!status && hits->count > 0)
        add_pieces(&p, out);
    return status;
}
