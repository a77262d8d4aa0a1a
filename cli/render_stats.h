/* The results of `triptych render` besides its pictures, as JSON for programs and lines for people.
 * Times, reads and bytes are from the frames that the user gets. Exact counts of splats are from
 * frames that are drawn once more. The functions read statistics from a libtriptych context with a
 * complete picture. Main thread only. */
#ifndef TRIP_RENDER_STATS_H
#define TRIP_RENDER_STATS_H

#include <stdbool.h>
#include <stdio.h>

#include "render_options.h"

typedef struct render_stats render_stats;

int render_stats_create(render_stats **out);
void render_stats_destroy(render_stats *s);
/* Adds the last frame of the context. */
int render_stats_add_frame(render_stats *s, triptych *t);
/* Adds exact counts to frame `index`, which the context has drawn once more. */
int render_stats_add_count(render_stats *s, int index, triptych *t);
/* Adds the renderer, the settings and the memory. Called after all frames are drawn, and before
 * they are counted. */
int render_stats_describe(render_stats *s, const render_options *o, triptych *t);
/* Returns whether a path is a device, pipe or link. The program writes into it instead of
 * replacing it. */
bool render_stats_is_special(const char *path);
/* Writes the JSON to stdout or to the file of --stats. A regular file is replaced by a rename when
 * it is complete. */
int render_stats_write(render_stats *s, const render_options *o);

/* Prints the view as options, the number of splats examined to fit it, and the plan of the
 * frame. */
int render_stats_explain_plan(triptych *t, FILE *out);
/* Prints the cost of each part of the last frame, one line for each. */
int render_stats_explain_cost(const render_options *o, triptych *t, FILE *out);
/* Prints the exact counts of each list, one line for each. */
int render_stats_explain_count(triptych *t, FILE *out);
/* Prints a line such as "image.png: 1024 x 1024, 1.2 million splats, 34 MB read, 0.32 s". It counts
 * voxels if values are interpolated. */
int render_stats_summary(const char *path, const render_options *o, triptych *t, FILE *out);

/* The pictures of an orbit or a path. */
typedef struct render_sequence {
    const char *first, *last; /* names of files; `last` is NULL for a video */
    int frames;
    double seconds;
} render_sequence;

/* Prints a line such as "a-000.png to a-059.png: 60 pictures of 512 x 512, 0.034 s each, 2.0 s in
 * all, 190 MB of memory at peak". */
void render_stats_sequence(const render_sequence *s, const render_options *o, FILE *out);

#endif
