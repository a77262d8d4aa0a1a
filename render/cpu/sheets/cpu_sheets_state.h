/* What the parts of frames that classify after interpolation share: sheets.c (sheets as they come),
 * windows.c (where memory does not suffice for these) and need.c (what suffices). Of the renderer's
 * thread alone, but for what its jobs say. */
#ifndef TRIP_CPU_SHEETS_STATE_H
#define TRIP_CPU_SHEETS_STATE_H

#include "cpu/sheets/store.h"
#include "cpu/sheets/windows.h"
#include "cpu/cpu_state.h"

/* Runs decoded at a time, and rasters that are taken for them. */
enum { TRIP_CPU_SHEETS_RUNS = 256, TRIP_CPU_SHEETS_TAKEN = 1024 };

/* A run to be decoded into a sheet of the store. */
typedef struct trip_cpu_sheet_run {
    const trip_run *run;
    const trip_cpu_sheet *sheet;
} trip_cpu_sheet_run;

struct trip_cpu_sheets {
    trip_cpu *of;
    trip_cpu_store store;
    trip_cpu_tfs functions;
    const trip_cpu_tf *function;       /* of these the frame's */
    trip_cpu_sheet_kernel *sheet_pane; /* by whether segments have a closed form */
    trip_cpu_group group;
    trip_cpu_about about[TRIP_CPU_SEGMENTS]; /* of its segments, with kernels of 64 voxels */
    trip_cpu_sheet_view view;
    int axis;
    const trip_pass *pass; /* being drawn; NULL: none */
    int64_t way;           /* from one sheet to the next: 1 or -1 */
    double eye;            /* along the sheets, as they are numbered */
    /* Sheets in a row, as indices of store.sheets; the last may not be complete. Up to held[front]
     * all is drawn; those before are still interpolated from. */
    int held[TRIP_CPU_SHEETS_MAX];
    int front;
    int count, max;         /* held; and drawn at a time, at most */
    uint64_t slice_rasters; /* set aside for slices */
    const trip_batch *batch;
    trip_cpu_sheet_run runs[TRIP_CPU_SHEETS_RUNS]; /* to be decoded */
    unsigned run_count;
    int32_t taken[TRIP_CPU_SHEETS_TAKEN]; /* rasters that are to be cleared before */
    unsigned taken_count;
    int open_sheets; /* to come, for which the store's open squares hold */
    trip_cpu_windows windows;
};

/* How many sheets on each side of an interval its picture depends on: for gradients, and with
 * kernels of 64 voxels for values. */
int trip_cpu_sheets_about(const trip_frame *frame);
/* Sheets that an interval's picture depends on, its own two among them. */
int trip_cpu_sheets_at_hand(const trip_frame *frame);

/* Draws from held[front] on, at most to held[last], and moves `front` along: not at all when not
 * one interval fits the memory. What is visible was found, and gradients or what they
 * will be made of. */
void trip_cpu_sheets_draw_some(trip_cpu_sheets *s, int last);
/* Whether something between two sheets lies before the eye; of the first, `to` is the farther. */
bool trip_cpu_sheets_are_ahead(const trip_cpu_sheets *s, int64_t to);
/* Whether the ends of a segment may lie in cells that do not touch. Then something may show between
 * two cells in neither of which anything does. */
bool trip_cpu_sheets_leap(const trip_cpu_sheets *s);
/* Whether all that rays may take of sheets and slices is made before any is drawn, in place of when
 * they first meet it: of uneven spacing, and with kernels of 64 voxels. */
bool trip_cpu_sheets_at_once(const trip_cpu_sheets *s);
/* Gradients, or what they will be made of, of sheets with those beside them. */
void trip_cpu_sheets_find_gradients(trip_cpu_sheets *s, const trip_cpu_sheet_work *work,
                                    unsigned count);

#endif
