/* What `triptych render` tells of its frames: JSON for programs, lines for people. */
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
/* Writes the JSON to the file of --stats, by another name and a rename, or to stdout. */
int render_stats_write(render_stats *s, const render_options *o, const trip_renderer *renderer,
                       const trip_reader *reader, const trip_budget *budget);

/* What the parts of a plan cost, a line each. */
void render_stats_explain(const trip_frame_stats *frame, const trip_renderer *renderer,
                          const trip_reader *reader, FILE *out);
/* "image.png: 1024 x 1024, 1.2 million splats, 34 MB read, 0.32 s" */
void render_stats_summary(const char *path, const render_options *o, const trip_frame_stats *frame,
                          FILE *out);

#endif
