#include "tf_colour.h"

#include <math.h>
#include <stddef.h>
#include <string.h>

static const double white[3] = { 0.9505, 1.0, 1.089 }; /* D65 in CIE XYZ, with the numbers of VTK */

static void mix(const double a[3], const double b[3], double s, double out[3])
{
    for (int i = 0; i < 3; i++)
        out[i] = a[i] + s * (b[i] - a[i]);
}

static void multiply(const double m[3][3], const double v[3], double out[3])
{
    for (int i = 0; i < 3; i++)
        out[i] = m[i][0] * v[0] + m[i][1] * v[1] + m[i][2] * v[2];
}

static double max3(const double v[3])
{
    return fmax(v[0], fmax(v[1], v[2]));
}

static double min3(const double v[3])
{
    return fmin(v[0], fmin(v[1], v[2]));
}

/* Converts to hue, saturation and value, all in [0, 1]. Grey has hue 0. */
static void rgb_to_hsv(const double rgb[3], double hsv[3])
{
    double high = max3(rgb), range = high - min3(rgb), hue = 0;
    if (range > 0) {
        if (rgb[0] == high)
            hue = (rgb[1] - rgb[2]) / range;
        else if (rgb[1] == high)
            hue = 2 + (rgb[2] - rgb[0]) / range;
        else
            hue = 4 + (rgb[0] - rgb[1]) / range;
    }
    hsv[0] = hue < 0 ? hue / 6 + 1 : hue / 6;
    hsv[1] = high > 0 ? range / high : 0;
    hsv[2] = high;
}

static void hsv_to_rgb(const double hsv[3], double rgb[3])
{
    for (int i = 0; i < 3; i++) {
        static const double phase[3] = { 5, 3, 1 };
        double k = fmod(phase[i] + 6 * hsv[0], 6);
        double dip = fmax(0, fmin(1, fmin(k, 4 - k)));
        rgb[i] = hsv[2] * (1 - hsv[1] * dip);
    }
}

static double lab_curve(double t)
{
    return t > 0.008856 ? cbrt(t) : 7.787 * t + 16.0 / 116.0;
}

static double lab_curve_inverse(double f)
{
    return f * f * f > 0.008856 ? f * f * f : (f - 16.0 / 116.0) / 7.787;
}

static void rgb_to_lab(const double rgb[3], double lab[3])
{
    static const double to_xyz[3][3] = { { 0.4124, 0.3576, 0.1805 },
                                         { 0.2126, 0.7152, 0.0722 },
                                         { 0.0193, 0.1192, 0.9505 } };
    double linear[3], xyz[3], f[3];
    for (int i = 0; i < 3; i++)
        linear[i] = rgb[i] > 0.04045 ? pow((rgb[i] + 0.055) / 1.055, 2.4) : rgb[i] / 12.92;
    multiply(to_xyz, linear, xyz);
    for (int i = 0; i < 3; i++)
        f[i] = lab_curve(xyz[i] / white[i]);
    lab[0] = 116 * f[1] - 16;
    lab[1] = 500 * (f[0] - f[1]);
    lab[2] = 200 * (f[1] - f[2]);
}

/* As in VTK, colours too bright for the display keep their hue, and negative components become 0.
 */
static void lab_to_rgb(const double lab[3], double rgb[3])
{
    static const double from_xyz[3][3] = { { 3.2406, -1.5372, -0.4986 },
                                           { -0.9689, 1.8758, 0.0415 },
                                           { 0.0557, -0.2040, 1.0570 } };
    double fy = (lab[0] + 16) / 116, f[3] = { fy + lab[1] / 500, fy, fy - lab[2] / 200 };
    double xyz[3], linear[3];
    for (int i = 0; i < 3; i++)
        xyz[i] = white[i] * lab_curve_inverse(f[i]);
    multiply(from_xyz, xyz, linear);
    for (int i = 0; i < 3; i++)
        rgb[i] =
            linear[i] > 0.0031308 ? 1.055 * pow(linear[i], 1 / 2.4) - 0.055 : 12.92 * linear[i];
    double high = fmax(1, max3(rgb));
    for (int i = 0; i < 3; i++)
        rgb[i] = fmax(0, rgb[i] / high);
}

/* Converts to Moreland's polar form of Lab: magnitude, saturation angle, hue angle. */
static void rgb_to_msh(const double rgb[3], double msh[3])
{
    double lab[3];
    rgb_to_lab(rgb, lab);
    msh[0] = sqrt(lab[0] * lab[0] + lab[1] * lab[1] + lab[2] * lab[2]);
    msh[1] = msh[0] > 0.001 ? acos(lab[0] / msh[0]) : 0;
    msh[2] = msh[1] > 0.001 ? atan2(lab[2], lab[1]) : 0;
}

static void msh_to_rgb(const double msh[3], double rgb[3])
{
    double lab[3] = { msh[0] * cos(msh[1]), msh[0] * sin(msh[1]) * cos(msh[2]),
                      msh[0] * sin(msh[1]) * sin(msh[2]) };
    lab_to_rgb(lab, rgb);
}

static double angle_between(double a, double b)
{
    double d = fmod(fabs(a - b), 2 * M_PI);
    return d > M_PI ? 2 * M_PI - d : d;
}

/* Returns the hue of an unsaturated colour of magnitude m that makes the transition to `msh` look
 * even. */
static double adjusted_hue(const double msh[3], double m)
{
    if (msh[0] >= m - 0.1)
        return msh[2];
    double spin = msh[1] * sqrt(m * m - msh[0] * msh[0]) / (msh[0] * sin(msh[1]));
    return msh[2] > -0.3 * M_PI ? msh[2] + spin : msh[2] - spin;
}

static void mix_diverging(const double a[3], const double b[3], double s, double out[3])
{
    double p[3], q[3], between[3];
    rgb_to_msh(a, p);
    rgb_to_msh(b, q);
    if (p[1] > 0.05 && q[1] > 0.05 && angle_between(p[2], q[2]) > 0.33 * M_PI) {
        double middle[3] = { fmax(88, fmax(p[0], q[0])), 0, 0 };
        memcpy(s < 0.5 ? q : p, middle, sizeof middle);
        s = s < 0.5 ? 2 * s : 2 * s - 1;
    }
    if (p[1] < 0.05 && q[1] > 0.05)
        p[2] = adjusted_hue(q, p[0]);
    else if (q[1] < 0.05 && p[1] > 0.05)
        q[2] = adjusted_hue(p, q[0]);
    mix(p, q, s, between);
    msh_to_rgb(between, out);
}

static void mix_lab(const double a[3], const double b[3], double s, double out[3])
{
    double p[3], q[3], between[3];
    rgb_to_lab(a, p);
    rgb_to_lab(b, q);
    mix(p, q, s, between);
    lab_to_rgb(between, out);
}

static void mix_hsv(const double a[3], const double b[3], bool wrap, double s, double out[3])
{
    double p[3], q[3], between[3];
    rgb_to_hsv(a, p);
    rgb_to_hsv(b, q);
    if (wrap && fabs(p[0] - q[0]) > 0.5)
        (p[0] > q[0] ? p : q)[0] -= 1;
    mix(p, q, s, between);
    between[0] += between[0] < 0;
    hsv_to_rgb(between, out);
}

void trip_colour_between(trip_colour_space space, const double a[3], const double b[3], double s,
                         double out[3])
{
    switch (space) {
    case TRIP_COLOUR_RGB:
        mix(a, b, s, out);
        break;
    case TRIP_COLOUR_HSV:
    case TRIP_COLOUR_HSV_WRAP:
        mix_hsv(a, b, space == TRIP_COLOUR_HSV_WRAP, s, out);
        break;
    case TRIP_COLOUR_LAB:
        mix_lab(a, b, s, out);
        break;
    case TRIP_COLOUR_DIVERGING:
        mix_diverging(a, b, s, out);
        break;
    case TRIP_COLOUR_STEP:
        memcpy(out, s > 0 ? b : a, 3 * sizeof *out);
        break;
    }
    for (int i = 0; i < 3; i++)
        out[i] = fmin(1, fmax(0, out[i])); /* NaN becomes 0 */
}
