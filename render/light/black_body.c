#include "black_body.h"

#include <math.h>

/* Nanometres. */
enum { FIRST = 360, LAST = 830, STEP = 5 };

/* Kelvin. Below it almost nothing is visible, and the fit is invalid for such deep red. */
#define COLDEST_KELVIN 1000.0

/* Evaluates one lobe of a colour matching function; its width differs on the two sides. */
static double lobe(double nm, double middle, double below, double above)
{
    const double t = (nm - middle) * (nm < middle ? below : above);
    return exp(-0.5 * t * t);
}

/* Evaluates the observer's matching functions at a wavelength. */
static void match(double nm, double xyz[3])
{
    xyz[0] = 0.362 * lobe(nm, 442.0, 0.0624, 0.0374) + 1.056 * lobe(nm, 599.8, 0.0264, 0.0323) -
             0.065 * lobe(nm, 501.1, 0.0490, 0.0382);
    xyz[1] = 0.821 * lobe(nm, 568.8, 0.0213, 0.0247) + 0.286 * lobe(nm, 530.9, 0.0613, 0.0322);
    xyz[2] = 1.217 * lobe(nm, 437.0, 0.0845, 0.0278) + 0.681 * lobe(nm, 459.0, 0.0385, 0.0725);
}

/* Planck's law up to a constant factor. */
static double radiance(double nm, double kelvin)
{
    const double second_constant = 1.438776877e7; /* h c / k, nm K */
    return 1e13 / (pow(nm, 5) * expm1(second_constant / (nm * kelvin)));
}

void trip_black_body_xyz(double kelvin, double xyz[3])
{
    const double t = fmax(kelvin, COLDEST_KELVIN);
    double sum[3] = { 0, 0, 0 };
    for (int nm = FIRST; nm <= LAST; nm += STEP) {
        double matched[3];
        match(nm, matched);
        for (int i = 0; i < 3; i++)
            sum[i] += matched[i] * radiance(nm, t);
    }
    for (int i = 0; i < 3; i++)
        xyz[i] = sum[i] / sum[1];
}

void trip_black_body(double kelvin, double rgb[3])
{
    static const double from_xyz[3][3] = { { 3.2406, -1.5372, -0.4986 },
                                           { -0.9689, 1.8758, 0.0415 },
                                           { 0.0557, -0.2040, 1.0570 } };
    double xyz[3], max = 0;
    trip_black_body_xyz(kelvin, xyz);
    for (int i = 0; i < 3; i++) {
        const double *row = from_xyz[i];
        rgb[i] = fmax(0, row[0] * xyz[0] + row[1] * xyz[1] + row[2] * xyz[2]);
        max = fmax(max, rgb[i]);
    }
    for (int i = 0; i < 3; i++)
        rgb[i] /= max;
}

double trip_display_of_linear(double light)
{
    return light <= 0.0031308 ? 12.92 * light : 1.055 * pow(light, 1 / 2.4) - 0.055;
}
