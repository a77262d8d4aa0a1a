/* Chooses the number of samples per sheet (sheet.h) for a view, if the user gives none. The result
 * depends on the view and the grid alone. Pure. */
#ifndef TRIP_SHEET_SAMPLES_H
#define TRIP_SHEET_SAMPLES_H

#include <stdint.h>

#include "camera.h"
#include "settings.h"

typedef struct trip_view_samples_per_sheet {
    int samples_per_sheet;
    double slope;    /* maximum distance that a ray with weight moves along u or v over a sheet */
    double voxel_px; /* of a voxel where the grid is nearest to the eye, limited as below */
} trip_view_samples_per_sheet;

/* Returns the samples per sheet for a view. Between two samples values are assumed to change
 * linearly. They do so on a ray along an axis. On a ray of slope s they bend within a cell, and the
 * error falls with the square of the number of samples. The number is
 * - 1 if no ray is steeper than TRIP_SHEET_SAMPLES_STRAIGHT;
 * - otherwise 2, and one more for every TRIP_SHEET_SAMPLES_EACH_PX of a voxel's width where the
 *   grid is nearest, at most TRIP_SHEET_SAMPLES_LARGE. A wider error would be visible as a shape.
 *
 * A grid nearer than TRIP_SHEET_SAMPLES_NEAR_VOXELS counts as at that distance: few rays see much
 * of the nearer part. Time grows more slowly than the number: with 6 samples, pictures take at most
 * three times as long as with 2. */
trip_view_samples_per_sheet trip_sheet_samples_of_view(const trip_camera *camera,
                                                       const trip_settings *settings,
                                                       const uint64_t dims[3]);

#define TRIP_SHEET_SAMPLES_STRAIGHT 0.125
#define TRIP_SHEET_SAMPLES_EACH_PX 4.0
#define TRIP_SHEET_SAMPLES_LARGE 6
#define TRIP_SHEET_SAMPLES_NEAR_VOXELS 16.0

#endif
