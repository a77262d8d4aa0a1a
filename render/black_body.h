/* The colour of a black body: Planck's law by the observer of CIE 1931, as Wyman, Sloan & Shirley
 * 2013 fit it (Simple analytic approximations to the CIE XYZ color matching functions, multi-lobe),
 * in sRGB. */
#ifndef TRIP_BLACK_BODY_H
#define TRIP_BLACK_BODY_H

/* CIE 1931 X, Y, Z of a temperature in kelvin, with Y = 1; below 1000 K the same as there. */
void trip_black_body_xyz(double kelvin, double xyz[3]);
/* Linear light of the primaries of sRGB, the most of them 1; what lies outside of these is cut off,
 * as the blue of all below about 1900 K. */
void trip_black_body(double kelvin, double rgb[3]);

/* What sRGB (IEC 61966-2-1) shows linear light from 0 to 1 by. */
double trip_display_of_linear(double light);

#endif
