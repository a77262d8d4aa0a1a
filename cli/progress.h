/* One line on a terminal that shows how far a long run is, how fast it goes and how long it has to
 * go on; nothing where stderr is not a terminal. Main thread only. */
#ifndef TRIP_PROGRESS_H
#define TRIP_PROGRESS_H

#include <stdbool.h>
#include <stdint.h>

typedef struct trip_progress {
    bool shown; /* on a terminal, and wanted */
    bool line;  /* something stands there now */
    char stage[16];
    double stage_begin, last_shown; /* seconds */
} trip_progress;

trip_progress trip_progress_start(bool quiet);
/* `done` of `total` things of a kind ("voxels") in this stage; at most a few lines a second appear.
 */
void trip_progress_show(trip_progress *p, const char *stage, uint64_t done, uint64_t total,
                        const char *things);
/* Clears the line, so that results and errors stand alone. */
void trip_progress_end(trip_progress *p);

#endif
