/* State for drawing in `post`, shared by cpu_sheets.c (whole sheets), windows.c (sheets that do not
 * fit in memory) and open_squares.c. Only the renderer's thread writes it, except for its jobs. */
#ifndef TRIP_CPU_SHEETS_STATE_H
#define TRIP_CPU_SHEETS_STATE_H

#include "cpu/sheets/store.h"
#include "cpu/sheets/windows.h"
#include "cpu/cpu_state.h"

/* Maximum number of runs decoded at a time, and of rasters taken for the runs. */
enum { TRIP_CPU_SHEETS_RUNS = 256, TRIP_CPU_SHEETS_TAKEN = 1024 };

/* A run to decode into a sheet of the store. */
typedef struct trip_cpu_sheet_run {
    const trip_run *run;
    const trip_cpu_sheet *sheet;
} trip_cpu_sheet_run;

struct trip_cpu_sheets {
    trip_cpu *of;
    trip_cpu_store store;
    trip_cpu_tfs functions;
    const trip_cpu_tf *function;       /* the frame's entry of `functions` */
    trip_cpu_sheet_kernel *sheet_pane; /* chosen by effects and closed form */
    trip_cpu_group group;
    trip_cpu_about about[TRIP_CPU_SEGMENTS]; /* per segment, for kernels of 64 voxels */
    trip_cpu_sheet_view view;
    int axis;
    const trip_pass *pass; /* current pass, or NULL */
    int64_t way;           /* step of the sheet number: 1 or -1 */
    double eye;            /* position along the axis, in sheet numbers */
    /* Consecutive sheets, as indices of store.sheets. The last sheet may be incomplete. Everything
     * up to held[front] is drawn. Interpolation still reads the sheets before held[front]. */
    int held[TRIP_CPU_SHEETS_MAX];
    int front;
    int count, max;          /* number of held sheets, and its maximum */
    uint64_t sample_rasters; /* rasters set aside for sample planes */
    const trip_batch *batch;
    trip_cpu_sheet_run runs[TRIP_CPU_SHEETS_RUNS]; /* runs to decode */
    unsigned run_count;
    int32_t taken[TRIP_CPU_SHEETS_TAKEN]; /* rasters to clear before decoding */
    unsigned taken_count;
    int open_sheets; /* further sheets for which store.open is valid */
    trip_cpu_windows windows;
};

/* Returns the number of sheets on each side of an interval that its picture depends on. Gradients
 * and kernels of 64 voxels read them. */
int trip_cpu_sheets_about(const trip_frame *frame);
/* Returns the number of sheets that an interval's picture depends on, including its own two. */
int trip_cpu_sheets_held(const trip_frame *frame);

/* Draws from held[front] at most to held[last] and moves `front` along. `front` stays if not even
 * one interval fits in memory. The caller has found visible squares and gradients before. */
void trip_cpu_sheets_draw_some(trip_cpu_sheets *s, int last);
/* Returns whether a part of the interval that ends at sheet `to` lies in front of the eye. */
bool trip_cpu_sheets_are_ahead(const trip_cpu_sheets *s, int64_t to);
/* Returns whether the ends of a segment may lie in cells that do not touch. Then a segment may be
 * visible although neither of its two cells is. */
bool trip_cpu_sheets_leap(const trip_cpu_sheets *s);
/* Returns whether sheets and sample planes are made completely before drawing, instead of on
 * demand. True for uneven spacing and for kernels of 64 voxels. */
bool trip_cpu_sheets_at_once(const trip_cpu_sheets *s);
/* Finds the gradients of sheets, or sets up making them on demand. work[i].other and .third are the
 * neighbours. */
void trip_cpu_sheets_find_gradients(trip_cpu_sheets *s, const trip_cpu_sheet_work *work,
                                    unsigned count);

#endif
