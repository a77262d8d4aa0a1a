/* What a sheet classified after interpolation is, in numbers. This page is the definition of `post`
 * that all renderers follow; reference_sheets.c evaluates it in double precision as written. After
 * Mueller, Moller & Crawfis 1999 (splatting without the blur), with the three lists and w^2.
 *
 * Field. Voxel (i, j, k) of level 0, kept or of the halo, has its code c and a gradient g (index
 * space, codes per index): along each axis the central difference where both neighbours are there,
 * the difference to the one that is there otherwise, 0 without neighbours. A cell is the cube
 * between eight voxels, and is empty unless all of them are there. Within it codes and gradients
 * are interpolated by settings.kernel (kernel.h) along each axis: linearly between its corners, or
 * from the 4 x 4 x 4 voxels around, as in field.h: beyond the grid its edge repeats, and another
 * voxel that is missing counts as the corner next to it. A halo of one voxel has all corners of
 * cells with a voxel that was kept; what it lacks of those around counts so.
 *
 * Slices. Along the axis of a list slices lie at the coordinates n / S, S = settings.slices; in
 * perspective the eye's own coordinate is one more. A layer's ray is cut by them into segments, and
 * only the field at the slices is used: at one lies the sample (c, g) of each end of a segment. A
 * segment is in the cell layer between two sheets; it is empty where either end lies in an empty
 * cell of that layer, or beyond the grid. Linear samples at a sheet (n / S is whole) are
 * interpolated from the four voxels around them there, and need no others.
 * Rays begin at the eye, in parallel views at its plane: what begins behind that is left out.
 *
 * A segment from code a to code b, L world units long, has with the extinction k and the colour q
 * of the transfer function (transfer_function.h), linear between codes (segments.h),
 *     depth  = L mean of k over [a, b]
 *     alpha  = 1 - exp(-depth)
 *     colour = integral of k q over [a, b] / integral of k over [a, b]
 * and is lit at its middle, by the mean of the gradients of its ends (shade.h); its distance from
 * the eye is that of its middle, too. Values between the ends are taken to run straight from a to
 * b, which is the error of a slice; what lies in front within the segment does not hide what lies
 * behind in it, which is the error of an opaque segment's colour. Light where the mean of what is
 * seen of the segment lies, or colours attenuated within it, come closer to the integral with some
 * volumes and less close with others.
 *
 * These are looked up in sums over the codes (segments.h), but by cpu and gl where extinction and
 * colours are linear in the value, or nearly: then they have a closed form, within 0.16/255 of a
 * picture (closed_form.h).
 *
 * Segments are composited front to back, outward from the eye. A pixel whose transmittance falls
 * below trip_settings_early_termination() takes no more: its colour is divided by its opacity,
 * which is then 1, so that no component is off by more than that, of colours from 0 to 1. */
#ifndef TRIP_SHEET_H
#define TRIP_SHEET_H

#include "kernel.h"

/* How far in indices, along each axis, a voxel changes what is drawn: cells about it are
 * interpolated from it, and the gradients of its neighbours depend on it. */
static inline int trip_sheet_reach(trip_kernel kernel)
{
    return trip_kernel_reach(kernel) + 1;
}
enum { TRIP_SHEET_REACH_MAX = 3 };

/* The distance in indices of the farthest ray that a voxel changes. */
static inline double trip_sheet_radius(trip_kernel kernel)
{
    return trip_sheet_reach(kernel) * 1.7320508075688772;
}

#endif
