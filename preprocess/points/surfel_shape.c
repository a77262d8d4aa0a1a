#include "surfel_shape.h"

#include <assert.h>
#include <math.h>
#include <string.h>

#include "clones.h"
#include "geometry.h"

enum { SWEEPS = 12, NEWTON_STEPS = 12 };

/* Newton's method ends with a step of this part of the sum of the variances. */
#define NEWTON_LAST 1e-14
/* The result is precise if the two lower variances differ by this part of the sum. */
#define APART 0.01

/* A matrix is diagonal if the other values are at most this part of its diagonal. */
#define DIAGONAL 1e-14

/* Neighbours are on a line if the second variance is at most this part of the greatest. */
#define LINE 1e-8

/* Turns a symmetric matrix to a diagonal one by Jacobi's rotations. The columns of `axes` become
 * its eigenvectors. */
static void diagonalise(double m[3][3], double axes[3][3])
{
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            axes[i][j] = i == j;
    for (int sweep = 0; sweep < SWEEPS; sweep++) {
        const double beside = fabs(m[0][1]) + fabs(m[0][2]) + fabs(m[1][2]);
        if (beside <= DIAGONAL * (fabs(m[0][0]) + fabs(m[1][1]) + fabs(m[2][2])))
            return;
        for (int p = 0; p < 2; p++)
            for (int q = p + 1; q < 3; q++) {
                if (m[p][q] == 0)
                    continue;
                const double theta = (m[q][q] - m[p][p]) / (2 * m[p][q]);
                const double t = copysign(1, theta) / (fabs(theta) + sqrt(theta * theta + 1));
                const double c = 1 / sqrt(t * t + 1), s = t * c, all = m[p][q];
                const int r = 3 - p - q;
                const double rp = m[r][p], rq = m[r][q];
                m[p][p] -= t * all;
                m[q][q] += t * all;
                m[p][q] = m[q][p] = 0;
                m[r][p] = m[p][r] = c * rp - s * rq;
                m[r][q] = m[q][r] = s * rp + c * rq;
                for (int i = 0; i < 3; i++) {
                    const double ip = axes[i][p], iq = axes[i][q];
                    axes[i][p] = c * ip - s * iq;
                    axes[i][q] = s * ip + c * iq;
                }
            }
    }
}

static trip_vec3 column(const double axes[3][3], int i)
{
    return trip_v3(axes[0][i], axes[1][i], axes[2][i]);
}

/* Returns a direction of unit length across a line, as near to `towards` as possible. */
static trip_vec3 across(trip_vec3 line, trip_vec3 towards)
{
    const trip_vec3 side = trip_sub(towards, trip_scale(line, trip_dot(towards, line)));
    if (trip_length(side) > 1e-6 * trip_length(towards))
        return trip_normalize(side);
    const trip_vec3 other = fabs(line.z) < 0.7 ? trip_v3(0, 0, 1) : trip_v3(1, 0, 0);
    return trip_normalize(trip_sub(other, trip_scale(line, trip_dot(other, line))));
}

static trip_vec3 longer(trip_vec3 a, trip_vec3 b)
{
    return trip_dot(a, a) >= trip_dot(b, b) ? a : b;
}

/* Finds the direction of least variance if the variances differ enough that the closed form is
 * precise. The least variance is the least root of the characteristic polynomial, which Newton's
 * steps from 0 approach from below. */
static bool find_least(double m[3][3], trip_vec3 *axis)
{
    const double trace = m[0][0] + m[1][1] + m[2][2], unit = 1 / trace;
    if (!(trace > 0) || !isfinite(unit))
        return false;
    const double xx = m[0][0] * unit, yy = m[1][1] * unit, zz = m[2][2] * unit;
    const double xy = m[0][1] * unit, xz = m[0][2] * unit, yz = m[1][2] * unit;
    const double minors = xx * yy - xy * xy + (xx * zz - xz * xz) + (yy * zz - yz * yz);
    const double determinant =
        xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz);
    double least = 0, step = 1;
    for (int i = 0; i < NEWTON_STEPS && fabs(step) > NEWTON_LAST; i++) {
        const double value = ((least - 1) * least + minors) * least - determinant;
        const double slope = (3 * least - 2) * least + minors;
        if (!(slope > 0))
            return false;
        step = value / slope;
        least -= step;
    }
    const double half = (1 - least) / 2, product = minors - least * (1 - least);
    const double middle = half - sqrt(fmax(0, half * half - product));
    if (!(fabs(step) <= NEWTON_LAST) || !(middle - least > APART))
        return false;
    const trip_vec3 u = trip_v3(xx - least, xy, xz), v = trip_v3(xy, yy - least, yz),
                    w = trip_v3(xz, yz, zz - least);
    *axis = trip_normalize(longer(trip_cross(u, v), longer(trip_cross(u, w), trip_cross(v, w))));
    return true;
}

static trip_vec3 normal_of(double variance[3][3], trip_vec3 towards)
{
    trip_vec3 least;
    if (find_least(variance, &least))
        return trip_dot(least, towards) < 0 ? trip_scale(least, -1) : least;
    double axes[3][3];
    int order[3] = { 0, 1, 2 };
    diagonalise(variance, axes);
    for (int i = 0; i < 2; i++)
        for (int j = 0; j < 2 - i; j++)
            if (variance[order[j]][order[j]] > variance[order[j + 1]][order[j + 1]]) {
                const int other = order[j];
                order[j] = order[j + 1];
                order[j + 1] = other;
            }
    const double middle = variance[order[1]][order[1]], most = variance[order[2]][order[2]];
    if (!(most > 0))
        return trip_normalize(towards);
    if (!(middle > LINE * most))
        return across(trip_normalize(column(axes, order[2])), towards);
    const trip_vec3 n = trip_normalize(column(axes, order[0]));
    return trip_dot(n, towards) < 0 ? trip_scale(n, -1) : n;
}

/* A value without meaning, then x, y and z. */
typedef double vector __attribute__((vector_size(32)));

static_assert(sizeof(trip_neighbour) == sizeof(vector), "a neighbour is a vector");

/* y, z, x. A function would pass vectors in other registers on other processors. */
#define TURNED(v) __builtin_shufflevector(v, v, 0, 2, 3, 1)

/* Sums over the neighbours' offsets from the point, in units of their reach. The point adds 0. */
typedef struct sums {
    vector offset;
    vector squares; /* xx, yy, zz */
    vector crosses; /* xy, yz, zx */
} sums;

static inline void sum_offsets(const trip_neighbours *n, double unit, sums *s)
{
    const vector from = { 0, n->position[0], n->position[1], n->position[2] };
    const double part = 1 / unit;
    *s = (sums){ .offset = { 0 } };
    for (unsigned i = 0; i < n->count; i++) {
        vector v;
        memcpy(&v, &n->nearest[i], sizeof v);
        v = (v - from) * part;
        s->offset += v;
        s->squares += v * v;
        s->crosses += v * TURNED(v);
    }
}

/* Returns the mean square distance of the neighbours from their mean. */
static inline double spread2(const sums *s, double count)
{
    const vector o = s->offset * s->offset;
    return fmax(0, (s->squares[1] + s->squares[2] + s->squares[3]) / count -
                       (o[1] + o[2] + o[3]) / (count * count));
}

/* Sets the covariances of the neighbours and the point. */
static inline void set_variance(const sums *s, double count, double variance[3][3])
{
    const vector along = s->squares / count - s->offset * s->offset / count / count;
    const vector across = s->crosses / count - s->offset * TURNED(s->offset) / count / count;
    for (int a = 0; a < 3; a++)
        variance[a][a] = along[a + 1];
    variance[0][1] = variance[1][0] = across[1];
    variance[1][2] = variance[2][1] = across[2];
    variance[2][0] = variance[0][2] = across[3];
}

static double variance_along(const double variance[3][3], trip_vec3 axis)
{
    double sum = 0;
    for (int a = 0; a < 3; a++)
        for (int b = 0; b < 3; b++)
            sum += variance[a][b] * trip_component(axis, a) * trip_component(axis, b);
    return fmax(0, sum);
}

TRIP_ALSO_V3
trip_surfel_shape trip_surfel_shape_of(const trip_neighbours *n, const double towards[3])
{
    trip_vec3 to = trip_v3(towards[0], towards[1], towards[2]);
    if (!(trip_length(to) > 0))
        to = trip_v3(0, 0, 1);
    to = trip_normalize(to);
    trip_surfel_shape s = { .radius = INFINITY, .normal = { to.x, to.y, to.z } };
    if (n->count == 0)
        return s;
    double variance[3][3], turned[3][3], reach = sqrt(n->nearest[n->count - 1].distance2);
    const double unit = reach;
    sums all;
    sum_offsets(n, reach, &all);
    set_variance(&all, n->count + 1, variance);
    memcpy(turned, variance, sizeof turned);
    if (n->count >= TRIP_NEIGHBOURS_MIN)
        reach *= fmin(1, TRIP_SURFEL_SPREAD * sqrt(spread2(&all, n->count)));
    s.radius = reach * sqrt(M_PI / 2 / n->count);
    const trip_vec3 normal = normal_of(turned, to);
    s.roughness = unit * sqrt(variance_along(variance, normal));
    s.normal[0] = normal.x;
    s.normal[1] = normal.y;
    s.normal[2] = normal.z;
    return s;
}

double trip_surfel_density(const trip_neighbours *n)
{
    return n->count ? n->count / (M_PI * n->nearest[n->count - 1].distance2) : 1;
}

double trip_surfel_spread(const trip_neighbours *n)
{
    double sum = 0;
    for (unsigned i = 0; i < n->count; i++)
        sum += sqrt(n->nearest[i].distance2);
    return n->count ? sum / n->count : 0;
}
