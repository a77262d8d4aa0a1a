/* Timed frames: planned, drawn and merged, alternately with the frames that they are compared with.
 * One thread. */
#ifndef TRIP_BENCH_FRAME_H
#define TRIP_BENCH_FRAME_H

#include "bench_options.h"
#include "bench_report.h"
#include "frame.h"
#include "library_session.h"

typedef struct bench_frame {
    const session *session;
    trip_renderer *renderer; /* NULL leaves the frame out */
    trip_reader *reader;
    trip_camera_params view;
    trip_settings settings;
    float *rgba;
    /* The reader skips runs that *occluder has already covered. NULL reads everything. */
    trip_renderer **occluder;
    measure_progress *progress; /* each frame is a step; may be NULL */
} bench_frame;

/* A renderer and a reader for most tables: the first renderer, size and number of threads of the
 * options, and the data set in memory or on disk. Adds the renderer to the report. The caller
 * closes it even after a failure. */
typedef struct bench_scene {
    bench_frame frame; /* without a view */
    int size[2];
    trip_renderer *occluder; /* from disk: renderer of the current frame, unless occluded bricks are
                                drawn */
} bench_scene;

int bench_scene_open(bench_scene *b, const session *s, const bench_options *o, bool from_disk,
                     bench_report *r);
void bench_scene_close(bench_scene *b);

/* Cost of one frame. ms is the whole time, with planning. */
typedef struct bench_cost {
    double ms, plan_ms, wait_ms, draw_ms, merge_ms;
    trip_frame_stats stats;
} bench_cost;

/* Draws a frame. `count` makes the counts in the stats exact, which may take time. */
int bench_frame_draw(const bench_frame *f, bool count, bench_cost *cost);

/* Runs of several frames: costs[frame * repeat + run]. */
typedef struct bench_runs {
    int frames, repeat;
    bench_cost *costs;
} bench_runs;

/* Draws all frames once, then again, `repeat` times in total. */
int bench_runs_take(bench_runs *r, const bench_frame *frames, int count, int repeat);
void bench_runs_free(bench_runs *r);
/* Adds the counts of an untimed frame, then ms, ms_min, ms_max, fps and the parts of the median
 * run. Adds its largest part, and its speed relative to the frame `base`. `kept` is the number of
 * kept voxels. */
void bench_runs_describe(bench_runs *r, int frame, int base, const bench_cost *counted, double kept,
                         cJSON *row);

/* Creates a reader for the frames of the options. `renderer` is as in session_reader and `occluder`
 * as in bench_frame; both may be NULL. */
int bench_reader_create(const session *s, trip_reader **out, const bench_options *o,
                        trip_engine engine, trip_renderer *renderer, trip_renderer **occluder);
/* Names the classification and the unit of compositing. */
const char *bench_classified(const trip_settings *settings);
/* Returns the planes that the settings read, a bit per trip_plane. */
unsigned bench_planes(const session *s, const trip_settings *settings);

/* Creates a renderer. If this machine cannot run it, *out is NULL and `why` has the reason. With
 * `needed` this is a failure. */
int bench_renderer_create(const session *s, trip_renderer **out, trip_renderer_kind kind,
                          int threads, bool needed, char why[256]);
/* Redirects reports to `why` (256 bytes), which keeps the last line. NULL restores stderr. */
void bench_keep_report(char *why);
void bench_renderer_destroy(trip_renderer *r);

#endif
