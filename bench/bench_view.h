/* The views that benchmarks draw. */
#ifndef TRIP_BENCH_VIEW_H
#define TRIP_BENCH_VIEW_H

#include "library_session.h"

/* Perspective, along the diagonal of the index space, where the regions of all three lists meet in
 * the image's centre; all splats in the picture. */
trip_camera_params bench_view_oblique(const session *s, const int size[2]);

/* Parallel, along Z of the index space: the image plane lies parallel to X-Y and one list has all
 * the weight. */
trip_camera_params bench_view_lateral(const session *s, const int size[2]);

/* Perspective, from so many degrees of index space from X towards Y and a little above, at a
 * distance that does not depend on them; all splats in the picture but where they are far from 45.
 */
trip_camera_params bench_view_between(const session *s, const int size[2], double degrees);

/* View `index` of `count` once round the object, from where `render` looks by default; perspective,
 * all splats in each picture. */
trip_camera_params bench_view_round(const session *s, const int size[2], int index, int count);

#endif
