/* Gradients of sheets on grids with uneven spacing: differences of codes divided by differences of
 * positions. Pure functions. */
#ifndef TRIP_CPU_SHEETS_UNEVEN_H
#define TRIP_CPU_SHEETS_UNEVEN_H

#include "coordinates.h"
#include "cpu/kernels/kernel_sheets.h"

/* Returns the unit of stored gradients: the 16-bit value of one code per unit of position. The unit
 * is half the smallest distance between voxels, so the steepest gradient fits 16 bits. The distance
 * counts as at least 1/64, so that a few close voxels do not cost the others precision. Steeper
 * gradients are clamped. With even spacing the unit is 0.5. */
double trip_cpu_gradient_unit(const trip_coordinates *c);

/* Returns the 16-bit value of 1 per unit of position in the gradients of outlines. */
double trip_cpu_outline_unit(const trip_coordinates *c);

/* A raster and its neighbours, as for the kernel sheet_gradients(). */
typedef struct trip_cpu_uneven_raster {
    trip_cpu_voxels *raster;
    const trip_cpu_voxels *left, *above, *sheet_before, *sheet_behind;
    int64_t first[3]; /* index of the first voxel: u, v, sheet */
    int axis;         /* axis of the list */
} trip_cpu_uneven_raster;

/* Sets the gradients of the raster's present voxels, or of their outlines. sheet_gradients() and
 * sheet_outlines() do the same for even spacing. */
void trip_cpu_uneven_gradients(const trip_coordinates *c, const trip_cpu_uneven_raster *r,
                               bool outlines);

#endif
