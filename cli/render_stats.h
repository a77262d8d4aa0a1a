/* What `triptych render` tells of its frames: JSON for programs, lines for people. Times, reads and
 * bytes are those of the frames that the user got; exact counts of splats come from frames of their
 * own, drawn once more. */
#ifndef TRIP_RENDER_STATS_H
#define TRIP_RENDER_STATS_H

#include "frame.h"
#include "render_options.h"

typedef struct render_stats render_stats;

int render_stats_create(render_stats **out);
void render_stats_destroy(render_stats *s);
/* `plan` as drawn, not yet released. */
int render_stats_add_frame(render_stats *s, const trip_dataset *data, const trip_plan *plan,
                           const trip_frame_stats *frame);
/* What drawing frame `index` once more counted. */
int render_stats_add_count(render_stats *s, int index, const trip_frame_stats *counted);
/* What drew the frames and the memory it took: once they are drawn, before they are counted. */
int render_stats_describe(render_stats *s, const render_options *o, const trip_renderer *renderer,
                          const trip_reader *reader, const trip_budget *budget);
/* Adds the options that give the last frame's view again. */
int render_stats_add_camera(render_stats *s, const trip_camera_params *view);
/* Writes the JSON to the file of --stats, by another name and a rename, or to stdout. */
int render_stats_write(render_stats *s, const render_options *o);

/* The view as options, and how many splats were looked at to fit it. */
void render_stats_explain_camera(const trip_camera_params *view, uint64_t splats, FILE *out);
/* What the parts of a plan cost, a line each. */
void render_stats_explain(const trip_frame_stats *frame, const trip_renderer *renderer,
                          const trip_reader *reader, FILE *out);
/* The exact counts of a frame's lists, a line each. */
void render_stats_explain_count(const trip_frame_stats *counted, FILE *out);
/* "image.png: 1024 x 1024, 1.2 million splats, 34 MB read, 0.32 s" */
void render_stats_summary(const char *path, const render_options *o, const trip_frame_stats *frame,
                          FILE *out);

#endif
