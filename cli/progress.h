/* One line on a terminal with the progress of a long run, its rate and the time left. Shows nothing
 * if stderr is not a terminal. Main thread only. */
#ifndef TRIP_PROGRESS_H
#define TRIP_PROGRESS_H

#include <stdbool.h>
#include <stdint.h>

typedef struct trip_progress {
    bool shown; /* stderr is a terminal, and the user has not asked for silence */
    bool line;  /* the line is on the terminal now */
    char stage[16];
    int done, pictures;             /* of a sequence; 0 pictures without one */
    double begin;                   /* of the sequence */
    double stage_begin, last_shown; /* seconds of the monotonic clock */
} trip_progress;

trip_progress trip_progress_start(void);
/* Shows `done` of `total` items in this stage, at most four times a second. `things` names the
 * items, for example "voxels". */
void trip_progress_show(trip_progress *p, const char *stage, uint64_t done, uint64_t total,
                        const char *things);
/* Shows the finished pictures of a sequence and the time left. The first call, with done 0, starts
 * the clock. Any thread, if one at a time. */
void trip_progress_pictures(trip_progress *p, int done, int pictures);
/* Clears the line before results or errors are printed. */
void trip_progress_end(trip_progress *p);

#endif
