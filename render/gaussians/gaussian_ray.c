#include "gaussian_ray.h"

#include <math.h>
#include <stdbool.h>

enum { DEPTH_MAX = 60, MEANS_PER_CUT = 8 };

void trip_normal_table_make(trip_normal_table *t)
{
    for (int i = 0; i <= TRIP_NORMAL_CELLS; i++) {
        const double x = (double)i / TRIP_NORMAL_STEPS - TRIP_NORMAL_REACH;
        t->at[i][0] = 0.5 * erfc(-x * M_SQRT1_2);
        t->at[i][1] = exp(-0.5 * x * x) * (0.5 * M_2_SQRTPI * M_SQRT1_2);
    }
}

/* Cubic Hermite interpolation: its error is at most 1.4 h^4 / 384. */
double trip_normal_integral(const trip_normal_table *t, double x)
{
    const double h = 1.0 / TRIP_NORMAL_STEPS;
    if (!(x > -TRIP_NORMAL_REACH))
        return 0;
    if (x >= TRIP_NORMAL_REACH)
        return 1;
    const double at = (x + TRIP_NORMAL_REACH) * TRIP_NORMAL_STEPS;
    const int i = at < TRIP_NORMAL_CELLS ? (int)at : TRIP_NORMAL_CELLS - 1;
    const double u = at - i, v = 1 - u;
    const double *a = t->at[i], *b = t->at[i + 1];
    return v * v * ((1 + 2 * u) * a[0] + u * h * a[1]) +
           u * u * ((1 + 2 * v) * b[0] - v * h * b[1]);
}

/* ---- memory ---- */

size_t trip_ray_scratch_bytes(size_t room)
{
    return room *
           (2 * sizeof(trip_ray_part) + sizeof(double) + 2 * sizeof(trip_key) + sizeof(uint32_t));
}

trip_ray_scratch trip_ray_scratch_in(void *memory, size_t room)
{
    trip_ray_scratch s = { .parts = memory, .room = room };
    s.sorted = s.parts + room;
    s.keys = (void *)(s.sorted + room);
    s.key_scratch = s.keys + room;
    s.means = (void *)(s.key_scratch + room);
    s.active = (void *)(s.means + room);
    return s;
}

/* ---- the integral ---- */

/* The sums over all densities up to a depth: of tau, and of tau times colour. */
typedef struct sums {
    double z, tau, rgb[3];
} sums;

typedef struct ray {
    const trip_normal_table *table;
    const trip_ray_part *parts; /* by ascending beginning */
    uint32_t *active;           /* numbers of parts that are neither complete nor still to come */
    size_t active_count;
    sums complete; /* of parts that end before the interval */
    double tolerance, brightest;
    double transmittance, rgb[3];
} ray;

static double begin_of(const trip_ray_part *p)
{
    return p->mean - TRIP_NORMAL_REACH * p->deviation;
}

static double end_of(const trip_ray_part *p)
{
    return p->mean + TRIP_NORMAL_REACH * p->deviation;
}

static void add_share(sums *s, const trip_ray_part *p, double share)
{
    const double tau = share * p->tau;
    s->tau += tau;
    for (int c = 0; c < 3; c++)
        s->rgb[c] += tau * p->rgb[c];
}

static sums sums_at(const ray *r, double z)
{
    sums s = r->complete;
    s.z = z;
    for (size_t i = 0; i < r->active_count; i++) {
        const trip_ray_part *p = &r->parts[r->active[i]];
        add_share(&s, p, trip_normal_integral(r->table, (z - p->mean) / p->deviation));
    }
    return s;
}

/* Adds the light of an interval in which the mixture is constant. */
static void add_light(const sums *a, const sums *b, double *transmittance, double rgb[3])
{
    const double tau = b->tau - a->tau;
    if (!(tau > 0))
        return;
    const double absorbed = *transmittance * -expm1(-tau);
    for (int c = 0; c < 3; c++)
        rgb[c] += absorbed / tau * (b->rgb[c] - a->rgb[c]);
    *transmittance -= absorbed;
}

/* Returns the greatest component of the difference. */
static double apart(const double a[3], const double b[3])
{
    return fmax(fabs(a[0] - b[0]), fmax(fabs(a[1] - b[1]), fabs(a[2] - b[2])));
}

/* Whether the pieces of an interval can tell its densities apart: at most one is thinner than the
 * interval. Several thin ones in one piece would look like a mixture, whatever their order. */
static bool is_resolved(const ray *r, double begin, double end)
{
    const double thin = end - begin;
    int count = 0;
    for (size_t i = 0; i < r->active_count && count < 2; i++) {
        const trip_ray_part *p = &r->parts[r->active[i]];
        count += p->deviation < thin && begin_of(p) < end && end_of(p) > begin;
    }
    return count < 2;
}

/* Adds the light of an interval. The error of the light from n pieces falls as 1 / n^2. */
static void add_interval(ray *r, const sums *begin, const sums *middle, const sums *end, int depth)
{
    sums p[5];
    p[0] = *begin;
    p[2] = *middle;
    p[4] = *end;
    const double tau = p[4].tau - p[0].tau, before = r->transmittance;
    /* The error is at most the range of the colours times tau^2 / 8. */
    if (!(tau > 8 * r->tolerance / r->brightest) || depth == DEPTH_MAX) {
        add_light(&p[0], &p[4], &r->transmittance, r->rgb);
        return;
    }
    p[1] = sums_at(r, 0.5 * (p[0].z + p[2].z));
    p[3] = sums_at(r, 0.5 * (p[2].z + p[4].z));
    double rgb[3][3] = { { 0 } }, after = before;
    for (int level = 0; level < 3; level++) { /* 1, 2 and 4 pieces */
        const int step = 4 >> level;
        after = before;
        for (int i = 0; i < 4; i += step)
            add_light(&p[i], &p[i + step], &after, rgb[level]);
    }
    const double allowed = r->tolerance * (before - after);
    if (tau < 1 && apart(rgb[1], rgb[0]) <= 12 * allowed && apart(rgb[2], rgb[1]) <= 3 * allowed &&
        is_resolved(r, p[0].z, p[4].z)) {
        for (int c = 0; c < 3; c++)
            r->rgb[c] += rgb[2][c] + (rgb[2][c] - rgb[1][c]) / 3;
        r->transmittance = after;
        return;
    }
    add_interval(r, &p[0], &p[1], &p[2], depth + 1);
    add_interval(r, &p[2], &p[3], &p[4], depth + 1);
}

/* Sorts the parts by their beginnings, and their means. */
static void sort(trip_ray_scratch *s, size_t count)
{
    for (size_t i = 0; i < count; i++)
        s->keys[i] = (trip_key){ trip_key_of(begin_of(&s->parts[i])), i };
    trip_key_sort(s->keys, s->key_scratch, count);
    for (size_t i = 0; i < count; i++)
        s->sorted[i] = s->parts[s->keys[i].number];
    for (size_t i = 0; i < count; i++)
        s->keys[i] = (trip_key){ trip_key_of(s->parts[i].mean), i };
    trip_key_sort(s->keys, s->key_scratch, count);
    for (size_t i = 0; i < count; i++)
        s->means[i] = s->parts[s->keys[i].number].mean;
}

/* Drops the active parts that end up to a depth. */
static void complete_parts(ray *r, double z)
{
    size_t left = 0;
    for (size_t i = 0; i < r->active_count; i++) {
        const trip_ray_part *p = &r->parts[r->active[i]];
        if (end_of(p) > z)
            r->active[left++] = r->active[i];
        else
            add_share(&r->complete, p, 1);
    }
    r->active_count = left;
}

/* Returns the next depth that divides the ray: one of the means, or the end of all densities. */
static double next_cut(const trip_ray_scratch *s, size_t count, size_t *mean, double z, double end)
{
    while (*mean < count && !(s->means[*mean] > z))
        *mean += MEANS_PER_CUT;
    return *mean < count ? s->means[*mean] : end;
}

static void integrate(ray *r, const trip_ray_scratch *s, size_t count, double from, double end)
{
    size_t next = 0, mean = 0;
    double z = fmax(from, begin_of(&s->sorted[0]));
    sums a = { 0 };
    while (z < end && r->transmittance * r->brightest > 0.5 * r->tolerance) {
        const double cut = fmin(next_cut(s, count, &mean, z, end), end);
        for (; next < count && begin_of(&s->sorted[next]) < cut; next++)
            r->active[r->active_count++] = (uint32_t)next;
        complete_parts(r, z);
        a = sums_at(r, z);
        if (z == from) /* the part behind the eye */
            add_light(&(sums){ 0 }, &a, &r->transmittance, r->rgb);
        const sums middle = sums_at(r, 0.5 * (z + cut)), b = sums_at(r, cut);
        add_interval(r, &a, &middle, &b, 0);
        a = b;
        z = cut;
    }
    /* The rest of the ray, if it is not yet drawn. */
    sums all = { 0 };
    for (size_t i = 0; i < count; i++)
        add_share(&all, &s->sorted[i], 1);
    add_light(&a, &all, &r->transmittance, r->rgb);
}

void trip_ray_integrate(const trip_normal_table *t, trip_ray_scratch *s, size_t count, double from,
                        double tolerance, double rgba[4])
{
    ray r = { .table = t,
              .parts = s->sorted,
              .active = s->active,
              .tolerance = tolerance,
              .brightest = 1,
              .transmittance = 1 };
    double end = -INFINITY;
    for (size_t i = 0; i < count; i++) {
        trip_ray_part *p = &s->parts[i];
        /* Depths have so many digits. */
        p->deviation = fmax(p->deviation, 1e-9 * fabs(p->mean) + 1e-300);
        for (int c = 0; c < 3; c++)
            r.brightest = fmax(r.brightest, p->rgb[c]);
    }
    if (count) {
        sort(s, count);
        for (size_t i = 0; i < count; i++)
            end = fmax(end, end_of(&s->sorted[i]));
        integrate(&r, s, count, from, end);
    }
    for (int c = 0; c < 3; c++)
        rgba[c] = r.rgb[c];
    rgba[3] = 1 - r.transmittance;
}
