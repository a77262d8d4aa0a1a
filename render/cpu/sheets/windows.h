/* Sheets drawn window by window, where those of a list are too large to be at hand decoded: their
 * runs are kept as they are in the file, of the sheets that one interval depends on, and for
 * each window, a rectangle of rasters, decoded with as much about it as rays can reach. Each ray is
 * drawn in the window that it starts in, so that each segment is drawn once, and in order. Called
 * by the renderer's thread. */
#ifndef TRIP_CPU_SHEETS_WINDOWS_H
#define TRIP_CPU_SHEETS_WINDOWS_H

#include "cpu/sheets/need.h"
#include "cpu/sheets/store.h"
#include "selection.h"

struct trip_cpu_sheets;

typedef struct trip_cpu_kept_run {
    int32_t u, v;
    uint16_t kind, part; /* of the list */
    uint32_t count, words;
    size_t at; /* in words */
} trip_cpu_kept_run;

typedef struct trip_cpu_kept_sheet {
    int64_t number;
    trip_cpu_kept_run *runs;
    uint64_t *words;
    size_t run_count, word_count;
} trip_cpu_kept_sheet;

typedef struct trip_cpu_windows {
    bool used; /* in this layer */
    trip_cpu_rasters all;
    int64_t size[2]; /* rasters of a window along u and v */
    int64_t reach;   /* rasters about it */
    char *memory;
    size_t bytes;
    /* In a row, the last may not be complete: those that an interval depends on. */
    trip_cpu_kept_sheet sheets[TRIP_CPU_AT_HAND_MAX];
    int room, about; /* sheets at most; before and behind the interval */
    int count;
    int from; /* the interval to be drawn next begins at this: `about`, but at first */
} trip_cpu_windows;

/* What the smallest windows take; and readies the largest that do not take more than `room`: false
 * where that is too little. */
uint64_t trip_cpu_windows_min_bytes(const trip_cpu_rasters *all, int64_t reach,
                                    const trip_cpu_need *need, int at_hand, int samples_per_sheet);
bool trip_cpu_windows_fit(struct trip_cpu_sheets *s, const trip_cpu_rasters *all, int64_t reach,
                          const trip_cpu_need *need, uint64_t room);
void trip_cpu_windows_release(trip_cpu_windows *w, trip_budget *budget);

/* As those of sheets.c. */
int trip_cpu_windows_add_run(struct trip_cpu_sheets *s, const trip_run *run);
int trip_cpu_windows_finish_row(struct trip_cpu_sheets *s);

#endif
