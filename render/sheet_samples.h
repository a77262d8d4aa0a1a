/* How many slices of a sheet a view calls for (sheet.h), where none are given. A function of the
 * view and the grid alone. Pure. */
#ifndef TRIP_SHEET_SAMPLES_H
#define TRIP_SHEET_SAMPLES_H

#include <stdint.h>

#include "camera.h"
#include "settings.h"

typedef struct trip_view_samples_per_sheet {
    int samples_per_sheet;
    double slope;    /* the steepest ray with weight moves so far along u or v over a sheet */
    double voxel_px; /* of a voxel where the grid is nearest to the eye, as it is counted */
} trip_view_samples_per_sheet;

/* Between two slices values are taken to run straight. A ray along an axis meets them so; one of
 * slope s bends within a cell, and its error falls with the square of the slices. So it is
 *     1  where no ray is steeper than TRIP_SHEET_SAMPLES_STRAIGHT, else
 *     2  and one more for every TRIP_SHEET_SAMPLES_EACH_PX that a voxel is wide where the grid is
 * nearest, since a wider error shows as a shape, up to TRIP_SHEET_SAMPLES_LARGE. What is nearer
 * than TRIP_SHEET_SAMPLES_NEAR_VOXELS counts as there: few rays see much of it. Time grows by less
 * than the slices: at 6, pictures take at most three times those at 2. */
trip_view_samples_per_sheet trip_sheet_samples_of_view(const trip_camera *camera,
                                                       const trip_settings *settings,
                                                       const uint64_t dims[3]);

#define TRIP_SHEET_SAMPLES_STRAIGHT 0.125
#define TRIP_SHEET_SAMPLES_EACH_PX 4.0
#define TRIP_SHEET_SAMPLES_LARGE 6
#define TRIP_SHEET_SAMPLES_NEAR_VOXELS 16.0

#endif
