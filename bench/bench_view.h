/* The views of the benchmarks. Pure functions. */
#ifndef TRIP_BENCH_VIEW_H
#define TRIP_BENCH_VIEW_H

#include "library_session.h"

/* Returns a perspective view along the diagonal of index space. The regions of all three lists meet
 * at the centre of the picture, which shows all splats. */
trip_camera_params bench_view_oblique(const session *s, const int size[2]);

/* Returns a parallel view along Z of index space. The image plane is parallel to X-Y, and one list
 * has all the weight. */
trip_camera_params bench_view_lateral(const session *s, const int size[2]);

/* Returns a perspective view from an angle in index space, from X towards Y, slightly above. The
 * distance is the same for all angles. The picture shows all splats at angles near 45 degrees. */
trip_camera_params bench_view_between(const session *s, const int size[2], double degrees);

/* Returns perspective view `index` of `count` around the object, starting at the default view of
 * `render`. All views have the same distance and show all splats. */
trip_camera_params bench_view_round(const session *s, const int size[2], int index, int count);

#endif
