/* Gradients of sheets of grids with uneven spacing: differences of codes over those of places. Pure
 * functions of their arguments. */
#ifndef TRIP_CPU_SHEETS_UNEVEN_H
#define TRIP_CPU_SHEETS_UNEVEN_H

#include "coordinates.h"
#include "cpu/kernels/kernel_sheets.h"

/* What a gradient of one code over a unit of place is as it is kept, in 16 bits: half of what the
 * nearest voxels are apart, since steeper than over those no difference is; but of at least 1/64,
 * so that a few that are nearer leave others their precision, and steeper ones count as so steep.
 * Half where spacing is even. */
double trip_cpu_gradient_unit(const trip_coordinates *c);

/* A raster and what lies beside it, as for the kernel sheet_gradients(). */
typedef struct trip_cpu_uneven_raster {
    trip_cpu_voxels *raster;
    const trip_cpu_voxels *left, *above, *sheet_before, *sheet_behind;
    int64_t first[3]; /* its first voxel: u, v, sheet */
    int axis;         /* of its list */
} trip_cpu_uneven_raster;

/* Of its voxels, as sheet_gradients() finds those of even spacing. */
void trip_cpu_uneven_gradients(const trip_coordinates *c, const trip_cpu_uneven_raster *r);

#endif
