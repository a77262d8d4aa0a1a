/* The definition of `post`, classification after interpolation, in formulas. All renderers follow
 * it; reference_sheets.c evaluates it in double precision as written. It extends Mueller, Moller &
 * Crawfis 1999 (splatting without the blur) by three lists and weights w^2.
 *
 * Field
 * -----
 * Each voxel (i, j, k) of level 0, kept or halo, has a code c and a gradient g (index space, codes
 * per index). Along each axis the gradient is
 * - the central difference if both neighbours are present,
 * - the difference to one neighbour if only that one is present,
 * - 0 without neighbours.
 *
 * A cell is the cube between eight voxels. It is empty unless all eight are present. Within a cell
 * settings.kernel (kernel.h) interpolates codes and gradients along each axis. It does so linearly
 * between the corners, or from the 4 x 4 x 4 voxels around as in field.h. `Nearest value` below
 * interpolates nothing. Beyond
 * the grid its edge repeats. Any other missing voxel counts as the corner next to it. A halo of one
 * voxel holds all corners of the cells with a kept voxel, but not all voxels around them.
 *
 * Samples
 * -------
 * Along a list's axis the samples lie in planes at the coordinates n / S, S =
 * settings.samples_per_sheet. In perspective the eye's own coordinate is one more. The planes cut a
 * layer's ray into segments. Each end of a segment is a sample (c, g) of the field at a plane. A
 * segment lies in the cell layer between two sheets. It is empty if one end lies in an empty cell
 * of the layer. Linear samples at a sheet (n / S is whole) are interpolated from the four voxels
 * around them there, and need no others. Rays begin at the eye, or at its plane in parallel views.
 * Everything behind is left out.
 *
 * Sides
 * -----
 * A ray may enter or leave the grid through a side, between two planes. Its segment is cut there,
 * as at a clipping plane: the code is linear between both ends. The end beyond the grid takes the
 * sample at the nearest position of its plane in the grid. The error of the code at the side is in
 * proportion to the segment's length, so the error of the picture falls with the square of S.
 *
 * Segments
 * --------
 * A segment goes from code a to code b and is L world units long. k and q are the extinction and
 * colour of the transfer function (transfer_function.h), linear between codes (segments.h). Then
 *     depth  = L mean of k over [a, b]
 *     alpha  = 1 - exp(-depth)
 *     colour = integral of k q over [a, b] / integral of k over [a, b]
 * A segment is lit at its middle, by the mean of the gradients of its ends (shade.h). Its distance
 * from the eye is the distance of its middle. Two errors follow:
 * - Values between the ends are assumed to change linearly from a to b. This error depends on S.
 * - Matter in front does not hide matter behind in the same segment. This error affects the colour
 *   of opaque segments.
 *
 * Two refinements are left out: light at the mean of the visible part, and colours attenuated
 * within the segment. They come closer to the integral with some volumes and less close with
 * others.
 *
 * The integrals are looked up in sums over the codes (segments.h). If extinction and colours are
 * linear in the value, or nearly, cpu and gl use a closed form instead, within 0.16/255 of a
 * picture (closed_form.h).
 *
 * Deviations
 * ----------
 * Voxels of a coarse level may have deviations beside their codes: the spread of the voxels below
 * them (deviation.h). The deviation codes d are interpolated like the codes, and kept within 0 and
 * 255. A segment has the mean d of the two samples at its planes, wherever it is cut. Blurred by
 * this deviation, k and k q replace k and k q in the formulas above (blurred_function.h). So thin
 * or noisy matter keeps its mean extinction. Voxels without a deviation have d = 0.
 *
 * The mean of the voxels' opacities along a ray is smaller than the opacity of their mean
 * extinction. The formula therefore suits matter that is thin in a coarse voxel's length, and
 * matter that is spread evenly.
 *
 * Light does not depend on deviations: a plane surface has a large deviation and a single normal.
 *
 * Nearest value
 * -------------
 * Values between two labels are no labels, and labels have no deviations. With TRIP_KERNEL_NEAREST
 * the field in a cell is the code of the nearest corner. So each voxel fills a box that ends
 * half-way to its neighbours. A point half-way between two voxels belongs to the voxel with the
 * greater index. A voxel beside a missing one, or at the edge of the grid, has only the part of its
 * box that lies in cells with all corners.
 *
 * S is 2, so that a plane lies half-way between two sheets, and no segment crosses it. A segment is
 * divided where the ray leaves a box through a face along u or v, and cut at the sides of the grid.
 * Each part has the code of its box, so it equals the integral. It is empty if the point at
 * TRIP_SHEET_BOX_POINT of it lies in an empty cell. The point is not the middle, since the middle
 * of a box is the face of two cells.
 *
 * Differences of label numbers are no gradient. A part is lit at its middle. Its gradient points
 * into its label. Along each axis it is the difference of an indicator between the voxel's
 * neighbours, over the voxel's length (trip_coordinates_width()). The indicator is 1 for the
 * voxel's code and 0 for any other code, visible or not, and for a missing voxel. If the gradient
 * is not 0, the segment is lit fully (trip_shade_outline_full()).
 *
 * Compositing
 * -----------
 * Segments are composited front to back, outward from the eye. A pixel takes no more segments once
 * its transmittance falls below trip_settings_early_termination(). Its colour is then divided by
 * its opacity, and the opacity becomes 1. With colours from 0 to 1 no component changes by more
 * than that transmittance. */
#ifndef TRIP_SHEET_H
#define TRIP_SHEET_H

#include "kernel.h"

/* Returns how far a voxel changes the picture, in indices along each axis. Cells around it are
 * interpolated from it, and the gradients of its neighbours depend on it. */
static inline int trip_sheet_reach(trip_kernel kernel)
{
    return trip_kernel_reach(kernel) + 1;
}
enum { TRIP_SHEET_REACH_MAX = 3 };

#define TRIP_SHEET_BOX_POINT 0.4

/* Returns the distance, in indices, of the farthest ray that a voxel changes. */
static inline double trip_sheet_radius(trip_kernel kernel)
{
    return trip_sheet_reach(kernel) * 1.7320508075688772;
}

#endif
