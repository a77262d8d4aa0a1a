/* Pictures drawn by the library, as `triptych render` draws them: what tables about a frame's
 * choices measure. What was read is kept in memory. One thread. */
#ifndef TRIP_BENCH_CONTEXT_H
#define TRIP_BENCH_CONTEXT_H

#include <triptych.h>

#include "bench_options.h"

typedef struct bench_context {
    triptych *t;
    triptych_settings settings; /* those of the options, without background */
    bench_progress *progress;   /* a step of it is each picture */
} bench_context;

/* The one renderer of the options. */
triptych_renderer bench_context_renderer(const bench_options *o);

/* Failures are reported. Close it also after one. */
int bench_context_open(bench_context *c, const char *path, const bench_options *o);
void bench_context_close(bench_context *c);

/* `eye`, `look` and `up` from *camera, the rest of the view as given. */
int bench_context_look(bench_context *c, const triptych_camera *camera);

/* Draws the view at levels chosen by `lod_px`, with samples * samples rays a pixel, into `rgba`
 * (width * height * 4). *ms: planning, drawing and merging; may be NULL. */
int bench_context_draw(bench_context *c, double lod_px, int samples, float *rgba, double *ms);

/* How wide voxels of level 0 are along the grid's longest step, in world space. */
int bench_context_voxel(bench_context *c, double *width);
/* So many coarse levels are drawn, of splats or of values. */
int bench_context_levels(bench_context *c, unsigned *levels);

#endif
