/* Colour interpolation as VTK and ParaView define it (vtkColorTransferFunction, vtkMath; the
 * diverging form is Moreland 2009, "Diverging Color Maps for Scientific Visualization"). Components
 * are sRGB display values in [0, 1]. */
#ifndef TRIP_TF_COLOUR_H
#define TRIP_TF_COLOUR_H

#include <stdbool.h>

typedef enum trip_colour_space {
    TRIP_COLOUR_RGB,
    TRIP_COLOUR_HSV,      /* hue the direct way, through the numbers between */
    TRIP_COLOUR_HSV_WRAP, /* hue the shorter way round */
    TRIP_COLOUR_LAB,
    TRIP_COLOUR_DIVERGING,
    TRIP_COLOUR_STEP, /* the upper colour up to and including its own value */
} trip_colour_space;

/* The colour at 0 <= s <= 1 between `a` and `b`. */
void trip_colour_between(trip_colour_space space, const double a[3], const double b[3], double s,
                         double out[3]);

#endif
