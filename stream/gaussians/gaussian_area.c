#include "gaussian_area.h"

#include <math.h>

#define ALPHA_MIN (1.0 / 255)
#define ALPHA_MAX 0.99
/* Li2(ALPHA_MAX), which most surfels need. */
#define ALPHA_MAX_DILOGARITHM 1.5886254480763753

double trip_dilogarithm(double x)
{
    if (x == ALPHA_MAX)
        return ALPHA_MAX_DILOGARITHM;
    if (x > 0.5) {
        const double rest = 1 - x;
        return M_PI * M_PI / 6 - (rest > 0 ? log(x) * log(rest) : 0) - trip_dilogarithm(rest);
    }
    double sum = 0, power = 1;
    for (int k = 1; k <= 48; k++) {
        power *= x;
        sum += power / (k * k);
    }
    return sum;
}

/* pow(1.0 / 3, 1 / 1.6075) */
#define DISC_AREA 0.50488272394865408

/* Knud Thomsen's formula for the surface of an ellipsoid. Its error is at most 1.1 %. */
double trip_gaussian_mean_area(const double s[3])
{
    const double p = 1.6075;
    const double most = fmax(s[0], fmax(s[1], s[2]));
    if (!(most > 0))
        return 0;
    if (s[0] == s[1] && s[2] == 0)
        return most * most * DISC_AREA;
    const double x = s[0] / most, y = s[1] / most, z = s[2] / most;
    return most * most * pow((pow(x * y, p) + pow(x * z, p) + pow(y * z, p)) / 3, 1 / p);
}

double trip_gaussian_mean_depth(const trip_gaussian *g)
{
    const double deviations[3] = { (double)g->deviations[0], (double)g->deviations[1],
                                   (double)g->deviations[2] };
    const double opacity = fmin((double)g->opacity, ALPHA_MAX);
    const double depth = trip_dilogarithm(opacity) - ALPHA_MIN;
    return opacity > ALPHA_MIN ? 2 * M_PI * trip_gaussian_mean_area(deviations) * depth : 0;
}
