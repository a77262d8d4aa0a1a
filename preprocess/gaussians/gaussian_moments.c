#include "gaussian_moments.h"

#include <math.h>
#include <string.h>

#include "gaussian_area.h"

#define ALPHA_MIN (1.0 / 255)
#define ALPHA_MAX 0.99
/* The coefficient of a colour of 0. Drawing raises lower colours to it. */
#define BLACK (-0.5 / 0.28209479177387814)
#define SWEEPS 16
#define NEWTON_STEPS 20
/* A covariance is diagonal if the other values are at most this part of its diagonal. */
#define DIAGONAL 1e-18

static void covariance_of(const trip_gaussian *g, double s[6])
{
    const double w = (double)g->rotation[0], x = (double)g->rotation[1], y = (double)g->rotation[2],
                 z = (double)g->rotation[3];
    const double r[3][3] = {
        { 1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y) },
        { 2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x) },
        { 2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y) },
    };
    for (int i = 0, at = 0; i < 3; i++)
        for (int j = i; j < 3; j++, at++) {
            s[at] = 0;
            for (int k = 0; k < 3; k++)
                s[at] += r[i][k] * r[j][k] * (double)g->deviations[k] * (double)g->deviations[k];
        }
}

/* The deviations are floats, so the product of two positive ones is positive as a double. */
bool trip_gaussian_has_mass(const trip_gaussian *g)
{
    int positive = 0;
    for (int a = 0; a < 3; a++)
        positive += g->deviations[a] > 0;
    return positive >= 2 && (double)g->opacity > ALPHA_MIN;
}

void trip_gaussian_moments_of(const trip_gaussian *g, int degree, trip_gaussian_moments *out)
{
    const double deviations[3] = { (double)g->deviations[0], (double)g->deviations[1],
                                   (double)g->deviations[2] };
    const double a = 2 * M_PI * trip_gaussian_mean_area(deviations);
    const double opacity = fmin((double)g->opacity, ALPHA_MAX);
    memset(out, 0, trip_gaussian_moments_bytes(degree));
    out->count = 1;
    out->mass = fmax(0, a * (opacity - ALPHA_MIN));
    if (!(out->mass > 0))
        return;
    out->optical = a * (trip_dilogarithm(opacity) - ALPHA_MIN);
    memcpy(out->centre, g->centre, sizeof out->centre);
    covariance_of(g, out->spread);
    for (int i = 0; i < 6; i++)
        out->spread[i] *= out->mass;
    if (g->deviations[2] == 0) {
        const trip_vec3 n = trip_surfel_principal(g, 2);
        for (int c = 0; c < 3; c++)
            out->normal[c] = out->mass * trip_component(n, c);
    }
    for (int k = 0; k < trip_sh_count(degree); k++)
        for (int c = 0; c < 3; c++)
            out->colours[k][c] = out->mass * (double)g->sh[k][c];
    for (int c = 0; c < 3 && degree == 0; c++)
        out->colours[0][c] = fmax(out->colours[0][c], out->mass * BLACK);
}

void trip_gaussian_moments_add(trip_gaussian_moments *to, const trip_gaussian_moments *from,
                               int degree)
{
    if (!to->count) {
        memcpy(to, from, trip_gaussian_moments_bytes(degree));
        return;
    }
    const double mass = to->mass + from->mass, both = to->mass * (from->mass / mass);
    double apart[3];
    for (int a = 0; a < 3; a++) {
        apart[a] = from->centre[a] - to->centre[a];
        to->centre[a] += apart[a] * (from->mass / mass);
        to->normal[a] += from->normal[a];
    }
    for (int i = 0, at = 0; i < 3; i++)
        for (int j = i; j < 3; j++, at++)
            to->spread[at] += from->spread[at] + apart[i] * apart[j] * both;
    for (int k = 0; k < trip_sh_count(degree); k++)
        for (int c = 0; c < 3; c++)
            to->colours[k][c] += from->colours[k][c];
    to->count += from->count;
    to->mass = mass;
    to->optical += from->optical;
}

/* Turns axes p and q of a symmetric matrix, so that its element (p, q) becomes 0 (Jacobi). */
static void turn(double m[3][3], double axes[3][3], int p, int q)
{
    if (m[p][q] == 0)
        return;
    const double theta = (m[q][q] - m[p][p]) / (2 * m[p][q]);
    const double t = (theta < 0 ? -1 : 1) / (fabs(theta) + sqrt(theta * theta + 1));
    const double c = 1 / sqrt(t * t + 1), s = t * c;
    for (int k = 0; k < 3; k++) {
        const double x = m[k][p], y = m[k][q];
        m[k][p] = c * x - s * y;
        m[k][q] = s * x + c * y;
    }
    for (int k = 0; k < 3; k++) {
        const double x = m[p][k], y = m[q][k], u = axes[k][p], v = axes[k][q];
        m[p][k] = c * x - s * y;
        m[q][k] = s * x + c * y;
        axes[k][p] = c * u - s * v;
        axes[k][q] = s * u + c * v;
    }
}

/* Sets the unit quaternion of a rotation. */
static void set_rotation(const double r[3][3], float rotation[4])
{
    const double squares[4] = { 1 + r[0][0] + r[1][1] + r[2][2], 1 + r[0][0] - r[1][1] - r[2][2],
                                1 - r[0][0] + r[1][1] - r[2][2], 1 - r[0][0] - r[1][1] + r[2][2] };
    int most = 0;
    for (int i = 1; i < 4; i++)
        if (squares[i] > squares[most])
            most = i;
    const double d[4][4] = {
        { squares[0], r[2][1] - r[1][2], r[0][2] - r[2][0], r[1][0] - r[0][1] },
        { r[2][1] - r[1][2], squares[1], r[0][1] + r[1][0], r[0][2] + r[2][0] },
        { r[0][2] - r[2][0], r[0][1] + r[1][0], squares[2], r[1][2] + r[2][1] },
        { r[1][0] - r[0][1], r[0][2] + r[2][0], r[1][2] + r[2][1], squares[3] },
    };
    double length = 0;
    for (int i = 0; i < 4; i++)
        length += d[most][i] * d[most][i];
    for (int i = 0; i < 4; i++)
        rotation[i] = (float)(d[most][i] / sqrt(length));
}

/* Sets the rotation of a covariance, and the deviations along its axes. */
static void set_axes(const double s[6], float rotation[4], double deviations[3])
{
    double m[3][3] = { { s[0], s[1], s[2] }, { s[1], s[3], s[4] }, { s[2], s[4], s[5] } };
    double axes[3][3] = { { 1, 0, 0 }, { 0, 1, 0 }, { 0, 0, 1 } };
    for (int i = 0; i < SWEEPS; i++) {
        const double beside = fabs(m[0][1]) + fabs(m[0][2]) + fabs(m[1][2]);
        if (beside <= DIAGONAL * (m[0][0] + m[1][1] + m[2][2]))
            break;
        turn(m, axes, 0, 1);
        turn(m, axes, 0, 2);
        turn(m, axes, 1, 2);
    }
    for (int k = 0; k < 3; k++)
        deviations[k] = sqrt(fmax(0, m[k][k]));
    set_rotation(axes, rotation);
}

/* Returns the opacity o from 0 to ALPHA_MAX with Li2(o) = depth, by Newton's method. Li2 is convex
 * and ascends, and its slope is -ln(1 - o) / o. So the steps from above never pass the root. */
static double opacity_of(double depth)
{
    double o = fmin(depth, ALPHA_MAX);
    for (int i = 0; i < NEWTON_STEPS && o > 0; i++) {
        const double step = (trip_dilogarithm(o) - depth) * o / -log1p(-o);
        o = fmin(o - step, ALPHA_MAX);
        if (fabs(step) < 1e-13)
            break;
    }
    return fmax(o, 0);
}

/* Turns a surfel by half a turn, so that the other side becomes its front side. */
static void turn_over(trip_gaussian *g, int normal)
{
    const float w = g->rotation[0], x = g->rotation[1], y = g->rotation[2], z = g->rotation[3];
    const float about_x[4] = { -x, w, z, -y }, about_y[4] = { -y, -z, w, x };
    memcpy(g->rotation, normal == 0 ? about_y : about_x, sizeof g->rotation);
}

/* Chooses the front side of a merged surfel. */
static void set_side(const trip_gaussian_moments *m, trip_gaussian *g)
{
    const int axis = trip_surfel_axis(g);
    const double along =
        trip_dot(trip_surfel_principal(g, axis), trip_v3(m->normal[0], m->normal[1], m->normal[2]));
    g->two_sided = fabs(along) < TRIP_MERGED_SIDE * m->mass;
    if (along < 0)
        turn_over(g, axis);
}

trip_gaussian trip_gaussian_moments_merge(const trip_gaussian_moments *m, int degree)
{
    trip_gaussian g = { .opacity = 0 };
    double covariance[6], deviations[3];
    for (int i = 0; i < 6; i++)
        covariance[i] = m->spread[i] / m->mass;
    set_axes(covariance, g.rotation, deviations);
    const double a = 2 * M_PI * trip_gaussian_mean_area(deviations);
    const double depth = fmin(m->optical / a, 2 * TRIP_MERGED_DEPTH_MAX) + ALPHA_MIN;
    const double most = trip_dilogarithm(ALPHA_MAX), grow = depth > most ? sqrt(depth / most) : 1;
    memcpy(g.centre, m->centre, sizeof g.centre);
    g.opacity = (float)(depth > most ? ALPHA_MAX : opacity_of(depth));
    for (int k = 0; k < 3; k++)
        g.deviations[k] = (float)(deviations[k] * grow);
    set_side(m, &g);
    for (int k = 0; k < trip_sh_count(degree); k++)
        for (int c = 0; c < 3; c++)
            g.sh[k][c] = (float)(m->colours[k][c] / m->mass);
    return g;
}
