/* Draws sheets window by window if the decoded sheets of a list do not fit in memory. A window is a
 * rectangle of rasters. The runs of the sheets that one interval depends on are kept as they are in
 * the file. For each window, the runs are decoded in the window and around it, as far as rays can
 * reach. Each ray is drawn in the window in which it starts, so that each segment is drawn once and
 * in order. The sheets object owns the windows; the renderer's thread calls all functions. */
#ifndef TRIP_CPU_SHEETS_WINDOWS_H
#define TRIP_CPU_SHEETS_WINDOWS_H

#include "cpu/sheets/need.h"
#include "cpu/sheets/store.h"
#include "selection.h"

struct trip_cpu_sheets;

typedef struct trip_cpu_kept_run {
    int32_t u, v;
    uint16_t kind, part; /* kind and part of the list */
    uint32_t count, words;
    size_t at; /* offset in trip_cpu_kept_sheet.words */
} trip_cpu_kept_run;

typedef struct trip_cpu_kept_sheet {
    int64_t number;
    trip_cpu_kept_run *runs;
    uint64_t *words;
    size_t run_count, word_count;
} trip_cpu_kept_sheet;

typedef struct trip_cpu_windows {
    bool used; /* the current layer is drawn in windows */
    trip_cpu_rasters all;
    int64_t size[2]; /* size of a window along u and v, in rasters */
    int64_t reach;   /* margin around a window, in rasters */
    char *memory;
    size_t bytes;
    /* The consecutive sheets on which an interval depends. The last one may be incomplete. */
    trip_cpu_kept_sheet sheets[TRIP_CPU_AT_HAND_MAX];
    int room, about; /* maximum of `count`; sheets on each side of the interval */
    int count;
    int from; /* first sheet of the next interval; at most `about` */
} trip_cpu_windows;

/* trip_cpu_windows_min_bytes() returns the bytes of the smallest windows. trip_cpu_windows_fit()
 * makes room for the largest windows that fit `room` bytes. It returns false if `room` is too
 * small. */
uint64_t trip_cpu_windows_min_bytes(const trip_cpu_rasters *all, int64_t reach,
                                    const trip_cpu_need *need, int held_sheets,
                                    int samples_per_sheet);
bool trip_cpu_windows_fit(struct trip_cpu_sheets *s, const trip_cpu_rasters *all, int64_t reach,
                          const trip_cpu_need *need, uint64_t room);
void trip_cpu_windows_release(trip_cpu_windows *w, trip_budget *budget);

/* Add a run to the last sheet or a new one, and draw all remaining intervals of the row. Return 0,
 * TRIP_INTERRUPTED or TRIP_ERROR. */
int trip_cpu_windows_add_run(struct trip_cpu_sheets *s, const trip_run *run);
int trip_cpu_windows_finish_row(struct trip_cpu_sheets *s);

#endif
