/* The sRGB colour of a black body: Planck's law, seen by the CIE 1931 observer. Wyman, Sloan &
 * Shirley 2013 give the fit of the observer (Simple analytic approximations to the CIE XYZ color
 * matching functions, multi-lobe). Pure functions. */
#ifndef TRIP_BLACK_BODY_H
#define TRIP_BLACK_BODY_H

/* Returns CIE 1931 X, Y, Z of a temperature in kelvin, with Y = 1. Below 1000 K the colour is
 * constant. */
void trip_black_body_xyz(double kelvin, double xyz[3]);
/* Returns linear sRGB with maximum component 1. Negative components are cut to 0, such as the blue
 * below about 1900 K. */
void trip_black_body(double kelvin, double rgb[3]);

/* Converts linear light, 0 to 1, to sRGB (IEC 61966-2-1). */
double trip_display_of_linear(double light);

#endif
