/* The surface and the uncertainty about a sample of a range image, from its neighbourhood. Pure
 * functions.
 *
 * Coordinates (x, y) are (u - centre) / focal, without distortion. A plane has the inverse distance
 * 1 / z = A x + B y + C, exactly. A, B and C are fitted by least squares to the square of
 * (2 TRIP_RANGE_WINDOW + 1)^2 pixels about the sample. A neighbour beyond a jump, where distances
 * differ by more than TRIP_RANGE_JUMP of the distance, does not count. The normal is -(A, B, C).
 * With fewer than 6 neighbours, or with all on a line, the normal points to the camera.
 *
 * The standard deviation of a distance has three parts:
 *
 *     sigma^2 = (a + b z + c z^2 + g(theta) / sqrt(z))^2 + n^2
 *     g(theta) = 0.0001 theta^2 / (pi/2 - theta)^2
 *
 * theta is the angle between the normal and the ray to the camera, at most TRIP_RANGE_GRAZING. The
 * first part is by Nguyen, Izadi and Lovell 2012 (Modeling Kinect Sensor Noise for Improved 3D
 * Reconstruction and Tracking), who measured the first Kinect:
 *
 *     a + b z + c z^2 = 0.0012 + 0.0019 (z - 0.4)^2    in metres
 *
 * A data set may state other coefficients. Then g is 0.
 *
 * n is the root mean square distance of the 8 neighbours from the plane, along their rays. Each
 * counts TRIP_RANGE_JUMP z at most, and so does one without a distance. Thus n is large beside
 * jumps and holes, where a distance may belong to either surface. */
#ifndef TRIP_RANGE_SHAPE_H
#define TRIP_RANGE_SHAPE_H

#include <math.h>

#include "range_frames.h"

#define TRIP_RANGE_JUMP 0.05
#define TRIP_RANGE_GRAZING 1.5 /* radians */

enum { TRIP_RANGE_WINDOW = 3 };

/* The plane about a sample, at offsets (du, dv) in pixels: 1 / z = q + a du + b dv. */
typedef struct trip_range_plane {
    double q, a, b;
    int count; /* neighbours that decide it, 0 without a plane */
} trip_range_plane;

/* Fits the plane about pixel (u, v) of a finite distance. Distances are NaN where there is none. */
static inline trip_range_plane trip_range_fit(const float *z, int width, int height, int u, int v)
{
    const double middle = (double)z[(long)v * width + u], most = TRIP_RANGE_JUMP * middle;
    double s1 = 0, su = 0, sv = 0, suu = 0, suv = 0, svv = 0, sq = 0, suq = 0, svq = 0;
    const trip_range_plane none = { .q = 1 / middle };
    for (int dv = -TRIP_RANGE_WINDOW; dv <= TRIP_RANGE_WINDOW; dv++) {
        if (v + dv < 0 || v + dv >= height)
            continue;
        const float *row = z + (long)(v + dv) * width;
        for (int du = -TRIP_RANGE_WINDOW; du <= TRIP_RANGE_WINDOW; du++) {
            if (u + du < 0 || u + du >= width)
                continue;
            const double d = (double)row[u + du];
            if (!(fabs(d - middle) <= most)) /* also NaN */
                continue;
            const double q = 1 / d - none.q;
            s1 += 1;
            su += du;
            sv += dv;
            suu += du * du;
            suv += du * dv;
            svv += dv * dv;
            sq += q;
            suq += du * q;
            svq += dv * q;
        }
    }
    if (s1 < 7)
        return none;
    const double uu = suu - su * su / s1, uv = suv - su * sv / s1, vv = svv - sv * sv / s1;
    const double uq = suq - su * sq / s1, vq = svq - sv * sq / s1, det = uu * vv - uv * uv;
    if (!(det > 0.5))
        return none;
    const double a = (uq * vv - vq * uv) / det, b = (vq * uu - uq * uv) / det;
    const double q = none.q + (sq - a * su - b * sv) / s1;
    return q > 0 ? (trip_range_plane){ .q = q, .a = a, .b = b, .count = (int)s1 - 1 } : none;
}

/* Sets the normal of unit length in the camera's coordinates, and returns the cosine of its angle
 * with the ray to the camera. */
static inline double trip_range_normal(const trip_range_plane *p, const double focal[2], double x,
                                       double y, double normal[3])
{
    const double ray = sqrt(x * x + y * y + 1);
    double n[3] = { x, y, 1 };
    if (p->count > 0) {
        n[0] = p->a * focal[0];
        n[1] = p->b * focal[1];
        n[2] = p->q - n[0] * x - n[1] * y;
    }
    const double length = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    for (int i = 0; i < 3; i++)
        normal[i] = -n[i] / length;
    return p->count > 0 ? p->q / (length * ray) : 1;
}

/* Returns the root mean square distance of the 8 neighbours from the plane. */
static inline double trip_range_roughness(const float *z, int width, int height, int u, int v,
                                          const trip_range_plane *p)
{
    const double most = TRIP_RANGE_JUMP * (double)z[(long)v * width + u];
    double sum = 0;
    int count = 0;
    for (int dv = -1; dv <= 1; dv++)
        for (int du = -1; du <= 1; du++) {
            if ((!du && !dv) || u + du < 0 || u + du >= width || v + dv < 0 || v + dv >= height)
                continue;
            const double q = p->q + p->a * du + p->b * dv;
            const double away = fabs((double)z[(long)(v + dv) * width + u + du] - 1 / q);
            const double counted = q > 0 && away <= most ? away : most; /* also for NaN */
            sum += counted * counted;
            count++;
        }
    return count > 0 ? sqrt(sum / count) : 0;
}

/* Returns the standard deviation of a distance. */
static inline double trip_range_sigma(const trip_range_noise *noise, bool grazing, double z,
                                      double cosine, double roughness)
{
    const double theta = fmin(acos(fmin(1, fmax(0, cosine))), TRIP_RANGE_GRAZING);
    const double ratio = theta / (M_PI / 2 - theta);
    const double sensor = fmax(0, noise->a + noise->b * z + noise->c * z * z) +
                          (grazing ? 0.0001 * ratio * ratio / sqrt(z) : 0);
    return sqrt(sensor * sensor + roughness * roughness);
}

#endif
