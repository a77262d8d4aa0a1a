/* Frames that are timed: planned, drawn and merged, in turns with those they are compared with. */
#ifndef TRIP_BENCH_FRAME_H
#define TRIP_BENCH_FRAME_H

#include "bench_options.h"
#include "bench_report.h"
#include "frame.h"
#include "library_session.h"

typedef struct bench_frame {
    const session *session;
    trip_renderer *renderer; /* NULL: left out */
    trip_reader *reader;
    trip_camera_params view;
    trip_settings settings;
    float *rgba;
    /* The reader leaves out what lies behind what this one has drawn; NULL: reads everything. */
    trip_renderer **occluder;
    bench_progress *progress; /* a step of it is each frame; may be NULL */
} bench_frame;

/* What most tables draw with: the first renderer, size and number of threads of the options, and
 * the data set in memory. Says in the report what draws. Close it also after a failure. */
typedef struct bench_scene {
    bench_frame frame; /* without view */
    int size[2];
} bench_scene;

int bench_scene_open(bench_scene *b, const session *s, const bench_options *o, bench_report *r);
void bench_scene_close(bench_scene *b);

/* Of one frame; ms is everything, planning included. */
typedef struct bench_cost {
    double ms, plan_ms, wait_ms, draw_ms, merge_ms;
    trip_frame_stats stats;
} bench_cost;

/* `count`: the counts of the stats are exact, which may cost time. */
int bench_frame_draw(const bench_frame *f, bool count, bench_cost *cost);

/* The runs of some frames: costs[frame * repeat + run]. */
typedef struct bench_runs {
    int frames, repeat;
    bench_cost *costs;
} bench_runs;

/* Draws all frames, then all again, `repeat` times. */
int bench_runs_take(bench_runs *r, const bench_frame *frames, int count, int repeat);
void bench_runs_free(bench_runs *r);
/* Sorts the runs of a frame by time and returns them; the middle one (the faster of two) stands at
 * (repeat - 1) / 2. */
const bench_cost *bench_runs_sorted(bench_runs *r, int frame);

/* Adds ms, ms_min, ms_max, fps, the parts of the middle run and which bounds it. */
void bench_runs_describe(bench_runs *r, int frame, cJSON *row);

double bench_now_ms(void);
/* Splats over the lists. */
uint64_t bench_splats_drawn(const trip_frame_stats *s);
uint64_t bench_splats_read(const trip_frame_stats *s);
/* A reader of what the frames of the options read; `renderer` as in session_reader, `occluder` as
 * in bench_frame, either may be NULL. */
int bench_reader_create(const session *s, trip_reader **out, const bench_options *o,
                        trip_engine engine, trip_renderer *renderer, trip_renderer **occluder);
/* What the session's data and the settings have to be read: bit per trip_plane. */
unsigned bench_planes(const session *s, const trip_settings *settings);

/* Makes a renderer. Where this machine cannot, *out is NULL and `why` the reason, unless `needed`:
 * then that is a failure. */
int bench_renderer_create(const session *s, trip_renderer **out, trip_renderer_kind kind,
                          int threads, bool needed, char why[256]);
/* From here on what is reported goes to `why` (256 bytes), the last line only; NULL: to stderr. */
void bench_keep_report(char *why);
void bench_renderer_destroy(trip_renderer *r);

#endif
