/* Bricks a cloud of points: each point becomes a flat Gaussian, a surfel. Its opacity is 1, and
 * falls to about one half at the radius of the point. Points without a radius or a normal get them
 * from their nearest neighbours (surfel_shape.h). The data set depends on the cloud and the
 * parameters alone, not on memory or threads. */
#ifndef TRIP_BRICK_POINTS_H
#define TRIP_BRICK_POINTS_H

#include "brick_gaussians.h"
#include "point_colour.h"

/* Deviations of a surfel in radii: exp(-(1 / 0.85)^2 / 2) is one half. */
#define TRIP_SURFEL_DEVIATIONS 0.85

enum { TRIP_POINT_NEIGHBOURS = 12 };

/* Zero means the default. */
typedef struct trip_brick_points_params {
    const char *path; /* of the data set */
    bool replace;
    trip_point_file *file; /* surveyed */
    const char *file_name;
    uint32_t flags;                 /* trip_gaussian_flag: the axis that points up */
    double up[3];                   /* the same */
    const char *text;               /* JSON that the data set keeps */
    trip_point_colouring colouring; /* not TRIP_POINT_BY_AUTO */
    unsigned neighbours;            /* default: TRIP_POINT_NEIGHBOURS */
    double radius;                  /* of all points; 0: of the file, or from neighbours */
    double radius_factor;           /* default: 1 */
    /* Leaves out points with neighbours farther away on average than the mean of all points and
     * this many standard deviations (Rusu et al. 2008). 0 keeps all points. */
    double outliers;
    uint64_t *outliers_out; /* their number; or NULL */
    /* Ellipsoids along the rays of the scanner (point_ellipsoid.h): of range images, or of scans
     * that all have poses. */
    bool uncertain;
    unsigned threads;
    /* Called by the bricking thread with the number of rows that have passed, and of all. */
    void (*progress)(void *user, uint64_t passed, uint64_t all);
    void *progress_user;
} trip_brick_points_params;

/* Sets a rotation that takes the third axis to a normal of unit length. */
void trip_point_turn_to(const float normal[3], float rotation[4]);

int trip_brick_points(const trip_brick_points_params *params, trip_budget *budget,
                      trip_brick_gaussians_result *result);

#endif
