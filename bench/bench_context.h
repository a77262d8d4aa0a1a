/* Draws pictures by the library, as `triptych render` does, for tables about the decisions of a
 * frame. Data stays in memory after its first read. One thread. */
#ifndef TRIP_BENCH_CONTEXT_H
#define TRIP_BENCH_CONTEXT_H

#include <triptych.h>

#include "bench_options.h"
#include "draw_settings.h"

typedef struct bench_context {
    triptych *t;
    draw_settings settings;     /* from the options, without background */
    measure_progress *progress; /* each picture is a step */
} bench_context;

/* Returns the first renderer of the options. */
triptych_renderer bench_context_renderer(const bench_options *o);

/* Opens a data set and reports failures. The caller closes the context even after a failure. */
int bench_context_open(bench_context *c, const char *path, const bench_options *o);
void bench_context_close(bench_context *c);

/* Sets a view and computes its camera. */
int bench_context_find(bench_context *c, const triptych_view *view, triptych_camera *camera);
/* Sets the view of *camera. */
int bench_context_look(bench_context *c, const triptych_camera *camera);

/* Creates a picture of 4 floats per pixel. It ends with the context, or earlier by
 * triptych_release_picture(). */
int bench_context_picture(bench_context *c, int width, int height, float **rgba);
/* Draws the view into `rgba` (width * height * 4 floats). `lod_px` selects the levels, and each
 * pixel has samples * samples rays. The time of planning, drawing and merging is stored in *ms,
 * which may be NULL. */
int bench_context_draw(bench_context *c, double lod_px, int samples, float *rgba, double *ms);

/* Returns the largest voxel spacing of level 0 along a grid axis, in world units. */
int bench_context_voxel(bench_context *c, double *width);
/* Returns the number of coarse levels for the classification of the settings. */
int bench_context_levels(bench_context *c, unsigned *levels);

#endif
