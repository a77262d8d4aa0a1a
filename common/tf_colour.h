/* Colour interpolation as defined by VTK and ParaView (vtkColorTransferFunction, vtkMath). The
 * diverging space is from Moreland 2009, "Diverging Color Maps for Scientific Visualization".
 * Components are sRGB display values in [0, 1]. */
#ifndef TRIP_TF_COLOUR_H
#define TRIP_TF_COLOUR_H

#include <stdbool.h>

typedef enum trip_colour_space {
    TRIP_COLOUR_RGB,
    TRIP_COLOUR_HSV,      /* hue changes directly from one number to the other */
    TRIP_COLOUR_HSV_WRAP, /* hue changes the shorter way round */
    TRIP_COLOUR_LAB,
    TRIP_COLOUR_DIVERGING,
    TRIP_COLOUR_STEP, /* the upper colour holds up to and including its own value */
} trip_colour_space;

/* Computes the colour at 0 <= s <= 1 between `a` and `b`. */
void trip_colour_between(trip_colour_space space, const double a[3], const double b[3], double s,
                         double out[3]);

#endif
