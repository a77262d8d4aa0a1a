#include "gaussian_transform.h"

#include <math.h>
#include <string.h>

#include "hyperline.h"

static double determinant(double m[3][3])
{
    return m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) -
           m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
           m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
}

/* Sets the unit quaternion of a rotation matrix, by its largest component. */
static void to_quaternion(double m[3][3], double q[4])
{
    const double squares[4] = { 1 + m[0][0] + m[1][1] + m[2][2], 1 + m[0][0] - m[1][1] - m[2][2],
                                1 - m[0][0] + m[1][1] - m[2][2], 1 - m[0][0] - m[1][1] + m[2][2] };
    int k = 0;
    for (int i = 1; i < 4; i++)
        k = squares[i] > squares[k] ? i : k;
    const double s = 2 * sqrt(squares[k]);
    if (k == 0) {
        q[1] = (m[2][1] - m[1][2]) / s;
        q[2] = (m[0][2] - m[2][0]) / s;
        q[3] = (m[1][0] - m[0][1]) / s;
    } else {
        const int i = k - 1, j = k % 3, l = (k + 1) % 3;
        q[0] = (m[l][j] - m[j][l]) / s;
        q[1 + j] = (m[j][i] + m[i][j]) / s;
        q[1 + l] = (m[l][i] + m[i][l]) / s;
    }
    q[k] = s / 4;
}

static void to_matrix(const float q[4], double m[3][3])
{
    const double w = q[0], x = q[1], y = q[2], z = q[3];
    const double made[3][3] = {
        { 1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y) },
        { 2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x) },
        { 2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y) },
    };
    memcpy(m, made, sizeof made);
}

bool trip_gaussian_transform_make(trip_gaussian_transform *t, const double m[3][4])
{
    static const double unit[3][4] = { { 1, 0, 0, 0 }, { 0, 1, 0, 0 }, { 0, 0, 1, 0 } };
    double r[3][3], length[3];
    *t = (trip_gaussian_transform){ .identity = true };
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 4; k++) {
            if (!isfinite(m[i][k]))
                return false;
            t->m[i][k] = m[i][k];
            t->identity = t->identity && fabs(m[i][k] - unit[i][k]) <= 0;
        }
    for (int k = 0; k < 3; k++) {
        length[k] = sqrt(m[0][k] * m[0][k] + m[1][k] * m[1][k] + m[2][k] * m[2][k]);
        if (!(length[k] > 0 && isfinite(length[k])))
            return false;
        for (int i = 0; i < 3; i++)
            r[i][k] = m[i][k] / length[k];
    }
    if (fabs(determinant(r) - 1) > 1e-4)
        return false;
    t->scale = length[0];
    t->even = fabs(length[1] - length[0]) <= 1e-6 * length[0] &&
              fabs(length[2] - length[0]) <= 1e-6 * length[0];
    to_quaternion(r, t->rotation);
    t->turned = fabs(t->rotation[0]) < 1;
    memcpy(t->turn, r, sizeof t->turn);
    trip_harmonics_rotation_make(&t->harmonics, (const double(*)[3])r);
    return true;
}

/* Turns two columns of m, and of the axes v, so that the columns of m are orthogonal (one-sided
 * Jacobi). Returns whether they were. */
static bool turn_columns(double m[3][3], int a, int b)
{
    double aa = 0, bb = 0, ab = 0;
    for (int i = 0; i < 3; i++) {
        aa += m[i][a] * m[i][a];
        bb += m[i][b] * m[i][b];
        ab += m[i][a] * m[i][b];
    }
    if (fabs(ab) <= 1e-14 * sqrt(aa * bb))
        return true;
    const double angle = 0.5 * atan2(2 * ab, aa - bb), c = cos(angle), s = sin(angle);
    for (int i = 0; i < 3; i++) {
        const double x = m[i][a], y = m[i][b];
        m[i][a] = c * x + s * y;
        m[i][b] = c * y - s * x;
    }
    return false;
}

/* Makes two orthogonal unit vectors beside a unit vector in column `k`. */
static void complete(double m[3][3], int k)
{
    const int a = (k + 1) % 3, b = (k + 2) % 3;
    const double v[3] = { m[0][k], m[1][k], m[2][k] };
    const int least = fabs(v[0]) < fabs(v[1]) ? (fabs(v[0]) < fabs(v[2]) ? 0 : 2)
                                              : (fabs(v[1]) < fabs(v[2]) ? 1 : 2);
    double sum = 0;
    for (int i = 0; i < 3; i++) {
        m[i][a] = (i == least) - v[least] * v[i];
        sum += m[i][a] * m[i][a];
    }
    for (int i = 0; i < 3; i++)
        m[i][a] /= sqrt(sum);
    for (int i = 0; i < 3; i++)
        m[i][b] = v[(i + 1) % 3] * m[(i + 2) % 3][a] - v[(i + 2) % 3] * m[(i + 1) % 3][a];
}

/* Sets deviations and rotation of a covariance m transpose(m). The largest column gives an axis,
 * the next one the second axis, and their product the third axis. */
static void set_shape(double m[3][3], trip_gaussian *g)
{
    double length[3], q[4];
    for (int sweep = 0, straight = 0; sweep < 30 && straight < 3; sweep++)
        straight = turn_columns(m, 0, 1) + turn_columns(m, 0, 2) + turn_columns(m, 1, 2);
    int first = 0;
    for (int k = 0; k < 3; k++) {
        length[k] = sqrt(m[0][k] * m[0][k] + m[1][k] * m[1][k] + m[2][k] * m[2][k]);
        g->deviations[k] = (float)length[k];
        first = length[k] > length[first] ? k : first;
    }
    int second = (first + 1) % 3, third = (first + 2) % 3;
    if (length[third] > length[second]) {
        second = third;
        third = (first + 1) % 3;
    }
    for (int i = 0; i < 3 && length[first] > 0; i++)
        m[i][first] /= length[first];
    if (length[first] <= 0) {
        g->rotation[0] = 1;
        g->rotation[1] = g->rotation[2] = g->rotation[3] = 0;
        return;
    }
    if (length[second] <= 1e-12 * length[first]) {
        complete(m, first);
    } else {
        const double sign = second == (first + 1) % 3 ? 1 : -1;
        for (int i = 0; i < 3; i++)
            m[i][second] /= length[second];
        for (int i = 0; i < 3; i++)
            m[i][third] = sign * (m[(i + 1) % 3][first] * m[(i + 2) % 3][second] -
                                  m[(i + 2) % 3][first] * m[(i + 1) % 3][second]);
    }
    to_quaternion(m, q);
    for (int i = 0; i < 4; i++)
        g->rotation[i] = (float)q[i];
}

static void normalise(float q[4])
{
    double sum = 0;
    for (int i = 0; i < 4; i++)
        sum += (double)q[i] * q[i];
    for (int i = 0; i < 4 && sum > 0; i++)
        q[i] = (float)(q[i] / sqrt(sum));
}

static void turn(const double a[4], float b[4])
{
    const double q[4] = { b[0], b[1], b[2], b[3] };
    b[0] = (float)(a[0] * q[0] - a[1] * q[1] - a[2] * q[2] - a[3] * q[3]);
    b[1] = (float)(a[0] * q[1] + a[1] * q[0] + a[2] * q[3] - a[3] * q[2]);
    b[2] = (float)(a[0] * q[2] - a[1] * q[3] + a[2] * q[0] + a[3] * q[1]);
    b[3] = (float)(a[0] * q[3] + a[1] * q[2] - a[2] * q[1] + a[3] * q[0]);
}

static void reshape(const trip_gaussian_transform *t, trip_gaussian *g)
{
    double r[3][3], m[3][3];
    to_matrix(g->rotation, r);
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++)
            m[i][k] = (t->m[i][0] * r[0][k] + t->m[i][1] * r[1][k] + t->m[i][2] * r[2][k]) *
                      g->deviations[k];
    set_shape(m, g);
}

void trip_gaussian_transform_apply(const trip_gaussian_transform *t, int degree, trip_gaussian *g)
{
    if (t->identity)
        return;
    normalise(g->rotation);
    const double c[3] = { g->centre[0], g->centre[1], g->centre[2] };
    for (int i = 0; i < 3; i++)
        g->centre[i] = t->m[i][0] * c[0] + t->m[i][1] * c[1] + t->m[i][2] * c[2] + t->m[i][3];
    if (t->even) {
        turn(t->rotation, g->rotation);
        for (int a = 0; a < 3; a++)
            g->deviations[a] = (float)(g->deviations[a] * t->scale);
    } else {
        reshape(t, g);
    }
    if (t->turned && g->hyperline)
        trip_hyperline_turn(g, (const double(*)[3])t->turn);
    else if (t->turned)
        trip_harmonics_rotate(&t->harmonics, degree, g->sh);
}
