#include "light_shares.h"

#include <math.h>

/* Steps equal to the mean spacing, up to rounding, are not divided. */
#define STEP_SLACK 1e-9

static int64_t next_to(const trip_light_shares *s, int64_t voxel, int way)
{
    const int64_t next = voxel + way;
    return next < 0 ? 0 : next < s->voxels ? next : s->voxels - 1;
}

/* Computes the first and last node at which a voxel can count. */
static void find_nodes(const trip_light_shares *s, const double *x, double spacing, int64_t voxel,
                       int32_t range[2])
{
    const double last = s->nodes - 1;
    range[0] = (int32_t)fmin(last, floor(x[next_to(s, voxel, -1)] / spacing));
    range[1] = (int32_t)fmin(last, ceil(x[next_to(s, voxel, 1)] / spacing));
}

static bool take(trip_light_shares *s, const double *x, double spacing, trip_budget *budget)
{
    size_t count = 0;
    for (int64_t i = 0; i < s->voxels; i++) {
        int32_t range[2];
        find_nodes(s, x, spacing, i, range);
        count += (size_t)(range[1] - range[0]) + 1;
    }
    s->first = trip_budget_take(budget, (size_t)s->voxels * sizeof *s->first);
    s->begin = trip_budget_take(budget, ((size_t)s->voxels + 1) * sizeof *s->begin);
    s->sums = trip_budget_take(budget, (size_t)s->nodes * sizeof *s->sums);
    if (!s->first || !s->begin || !s->sums)
        return false;
    s->begin[s->voxels] = count;
    s->shares = trip_budget_take(budget, count * sizeof *s->shares);
    return s->shares != NULL;
}

/* Adds a sample with `weight` for a voxel. */
static void add_point(trip_light_shares *s, int64_t voxel, double node, double weight)
{
    const double before = fmin(s->nodes - 1, floor(node)), part = node - before;
    double *shares = s->shares + s->begin[voxel];
    const int32_t at = (int32_t)before;
    shares[at - s->first[voxel]] += weight * (1 - part);
    s->sums[at] += weight * (1 - part);
    if (part > 0) {
        shares[at + 1 - s->first[voxel]] += weight * part;
        s->sums[at + 1] += weight * part;
    }
}

/* Adds the samples from a voxel towards its neighbour on one side. The voxel itself counts for half
 * a step on each side, also beyond the ends of the grid. */
static void add_side(trip_light_shares *s, const double *x, double spacing, int64_t voxel, int way)
{
    const int64_t next = next_to(s, voxel, way), behind = next_to(s, voxel, -way);
    if (next == voxel)
        return;
    const double whole = x[next] - x[voxel], count = fmax(1, ceil(fabs(whole) - STEP_SLACK));
    const double step = fabs(whole) / count;
    for (int64_t n = 0; n < (int64_t)count; n++) {
        const double part = (double)n / count;
        const double length = n == 0 && behind != voxel ? 0.5 * step : step;
        add_point(s, voxel, (x[voxel] + part * whole) / spacing, (1 - part) * length);
    }
}

bool trip_light_shares_make(trip_light_shares *s, const trip_coordinates *c, int axis,
                            double spacing, int nodes, trip_budget *budget)
{
    const double *x = c->along[axis];
    *s = (trip_light_shares){ .voxels = c->voxels[axis], .nodes = nodes };
    if (!take(s, x, spacing, budget)) {
        trip_light_shares_destroy(s, budget);
        return false;
    }
    size_t at = 0;
    for (int64_t i = 0; i < s->voxels; i++) {
        int32_t range[2];
        find_nodes(s, x, spacing, i, range);
        s->first[i] = range[0];
        s->begin[i] = at;
        at += (size_t)(range[1] - range[0]) + 1;
        if (s->voxels == 1)
            add_point(s, i, 0, 1);
        add_side(s, x, spacing, i, -1);
        add_side(s, x, spacing, i, 1);
    }
    return true;
}

void trip_light_shares_destroy(trip_light_shares *s, trip_budget *budget)
{
    if (s->shares)
        trip_budget_release(budget, s->shares, s->begin[s->voxels] * sizeof *s->shares);
    trip_budget_release(budget, s->first, (size_t)s->voxels * sizeof *s->first);
    trip_budget_release(budget, s->begin, ((size_t)s->voxels + 1) * sizeof *s->begin);
    trip_budget_release(budget, s->sums, (size_t)s->nodes * sizeof *s->sums);
    *s = (trip_light_shares){ 0 };
}
