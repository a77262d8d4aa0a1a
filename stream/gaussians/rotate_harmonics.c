#include "rotate_harmonics.h"

#include <math.h>
#include <string.h>

/* Computes the real spherical harmonics with the Condon-Shortley phase, as trainers use them. */
static void evaluate(const double d[3], double y[TRIP_SH_MAX])
{
    const double x = d[0], v = d[1], z = d[2], xx = x * x, vv = v * v, zz = z * z;
    const double c1 = sqrt(3 / (4 * M_PI)), c2 = sqrt(15 / (4 * M_PI));
    const double c30 = sqrt(35 / (32 * M_PI)), c31 = sqrt(105 / (4 * M_PI));
    const double c32 = sqrt(21 / (32 * M_PI));
    y[0] = sqrt(1 / (4 * M_PI));
    y[1] = -c1 * v;
    y[2] = c1 * z;
    y[3] = -c1 * x;
    y[4] = c2 * x * v;
    y[5] = -c2 * v * z;
    y[6] = sqrt(5 / (16 * M_PI)) * (2 * zz - xx - vv);
    y[7] = -c2 * x * z;
    y[8] = c2 / 2 * (xx - vv);
    y[9] = -c30 * v * (3 * xx - vv);
    y[10] = c31 * x * v * z;
    y[11] = -c32 * v * (4 * zz - xx - vv);
    y[12] = sqrt(7 / (16 * M_PI)) * z * (2 * zz - 3 * xx - 3 * vv);
    y[13] = -c32 * x * (4 * zz - xx - vv);
    y[14] = c31 / 2 * z * (xx - vv);
    y[15] = -c30 * x * (xx - 3 * vv);
}

/* Adds the product of all pairs of harmonics at a direction d, one of them turned back. */
static void add_direction(trip_harmonics_rotation *r, const double rotation[3][3],
                          const double d[3], double weight)
{
    double back[3], y[TRIP_SH_MAX], turned[TRIP_SH_MAX];
    for (int a = 0; a < 3; a++)
        back[a] = rotation[0][a] * d[0] + rotation[1][a] * d[1] + rotation[2][a] * d[2];
    evaluate(d, y);
    evaluate(back, turned);
    for (int l = 1; l <= TRIP_SH_DEGREE_MAX; l++)
        for (int i = 0; i <= 2 * l; i++)
            for (int j = 0; j <= 2 * l; j++)
                r->m[l - 1][i][j] += weight * y[l * l + i] * turned[l * l + j];
}

void trip_harmonics_rotation_make(trip_harmonics_rotation *r, const double rotation[3][3])
{
    /* Gauss-Legendre points for z and even steps around it integrate polynomials up to the degree 7
     * exactly. */
    enum { STEPS = 8 };
    const double root = sqrt(6.0 / 5);
    const double z[] = { sqrt((3 - 2 * root) / 7), sqrt((3 + 2 * root) / 7) };
    const double weights[] = { (18 + sqrt(30)) / 36, (18 - sqrt(30)) / 36 };
    *r = (trip_harmonics_rotation){ 0 };
    for (int i = 0; i < 4; i++)
        for (int k = 0; k < STEPS; k++) {
            const double height = i & 1 ? z[i / 2] : -z[i / 2], radius = sqrt(1 - height * height);
            const double angle = 2 * M_PI * k / STEPS;
            const double d[3] = { radius * cos(angle), radius * sin(angle), height };
            add_direction(r, rotation, d, weights[i / 2] * 2 * M_PI / STEPS);
        }
}

void trip_harmonics_rotate(const trip_harmonics_rotation *r, int degree, float sh[TRIP_SH_MAX][3])
{
    for (int l = 1; l <= degree; l++) {
        float before[7][3];
        memcpy(before, sh + l * l, (size_t)(2 * l + 1) * sizeof *sh);
        for (int i = 0; i <= 2 * l; i++)
            for (int c = 0; c < 3; c++) {
                double sum = 0;
                for (int j = 0; j <= 2 * l; j++)
                    sum += r->m[l - 1][i][j] * before[j][c];
                sh[l * l + i][c] = (float)sum;
            }
    }
}
