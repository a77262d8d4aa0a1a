/* Chooses the number of samples per sheet (sheet.h) for a view, if the user gives none. The result
 * depends on the view and the grid alone. Pure. */
#ifndef TRIP_SHEET_SAMPLES_H
#define TRIP_SHEET_SAMPLES_H

#include <stdint.h>

#include "camera.h"

typedef struct trip_view_samples_per_sheet {
    int samples_per_sheet;
    double voxel_px; /* of a voxel where the grid is nearest to the eye, limited as below */
} trip_view_samples_per_sheet;

/* Returns the samples per sheet for a view. Between two samples, matter in front does not hide
 * matter behind, and values are assumed to change linearly. The first error exists on every ray.
 * The second is 0 on rays along an axis, because linear interpolation is linear there. Both fall
 * with the number of samples. The number is 2, and one more for every TRIP_SHEET_SAMPLES_EACH_PX of
 * a voxel's width where the grid is nearest, at most TRIP_SHEET_SAMPLES_LARGE. A wider error would
 * be visible as a shape.
 *
 * A grid nearer than TRIP_SHEET_SAMPLES_NEAR_VOXELS counts as at that distance: few rays see much
 * of the nearer part. Time grows more slowly than the number: with 6 samples, pictures take at most
 * three times as long as with 2. */
trip_view_samples_per_sheet trip_sheet_samples_of_view(const trip_camera *camera,
                                                       const uint64_t dims[3]);

#define TRIP_SHEET_SAMPLES_EACH_PX 4.0
#define TRIP_SHEET_SAMPLES_LARGE 6
#define TRIP_SHEET_SAMPLES_NEAR_VOXELS 16.0

#endif
