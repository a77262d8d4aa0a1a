/* The results of `triptych render` besides its pictures: JSON for programs, lines for people.
 * Times, reads and bytes are those of the frames that the user got; exact counts of splats come
 * from frames of their own, drawn once more. Frames are those of a library's context, whose
 * pictures are complete. */
#ifndef TRIP_RENDER_STATS_H
#define TRIP_RENDER_STATS_H

#include <stdbool.h>
#include <stdio.h>

#include "render_options.h"

typedef struct render_stats render_stats;

int render_stats_create(render_stats **out);
void render_stats_destroy(render_stats *s);
/* The context's last frame. */
int render_stats_add_frame(render_stats *s, triptych *t);
/* The same, drawn once more as frame `index` with exact counts. */
int render_stats_add_count(render_stats *s, int index, triptych *t);
/* What drew the frames and the memory it took: once they are drawn, before they are counted. */
int render_stats_describe(render_stats *s, const render_options *o, triptych *t);
/* What is written to as it is, and stays what it is: devices, pipes and links. */
bool render_stats_is_special(const char *path);
/* Writes the JSON to the file of --stats, by another name and a rename, or to stdout. */
int render_stats_write(render_stats *s, const render_options *o);

/* The view as options, how many splats were looked at to fit it, and the plan of a frame that is
 * begun. */
int render_stats_explain_plan(triptych *t, FILE *out);
/* What the parts of the last frame cost, a line each. */
int render_stats_explain_cost(const render_options *o, triptych *t, FILE *out);
/* The exact counts of its lists, a line each. */
int render_stats_explain_count(triptych *t, FILE *out);
/* "image.png: 1024 x 1024, 1.2 million splats, 34 MB read, 0.32 s"; voxels, where values are
 * interpolated */
int render_stats_summary(const char *path, const render_options *o, triptych *t, FILE *out);

#endif
