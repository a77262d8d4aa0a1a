/* State for drawing in `post`, shared by cpu_sheets.c (whole sheets), windows.c (sheets that do not
 * fit in memory) and open_squares.c. Only the renderer's thread writes it, except for its jobs. */
#ifndef TRIP_CPU_SHEETS_STATE_H
#define TRIP_CPU_SHEETS_STATE_H

#include "cpu/sheets/store.h"
#include "cpu/cpu_state.h"
#include "cpu/kernels/kernel_sheets.h"
#include "cpu/sheets/integrals.h"
#include "plan.h"
#include "selection.h"

/* The memory that the sheets of a layer need at most. */
typedef struct trip_cpu_need {
    uint64_t rasters; /* maximum over consecutive sheets that are in memory together */
    uint64_t of_sheet, runs, words; /* maximum over single sheets */
} trip_cpu_need;

/* Maximum of `held_sheets` in trip_cpu_need_find(). */
enum { TRIP_CPU_AT_HAND_MAX = 6 };

/* Maximum number of runs decoded at a time, and of rasters taken for the runs. */
enum { TRIP_CPU_SHEETS_RUNS = 256, TRIP_CPU_SHEETS_TAKEN = 1024 };

/* A run to decode into a sheet of the store. */
typedef struct trip_cpu_sheet_run {
    const trip_run *run;
    const trip_cpu_sheet *sheet;
} trip_cpu_sheet_run;

typedef struct trip_cpu_kept_run {
    int32_t u, v;
    uint16_t kind, part; /* kind and part of the list */
    uint32_t count, words;
    bool has_deviations; /* they follow the block */
    size_t at;           /* offset in trip_cpu_kept_sheet.words */
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

struct trip_cpu_sheets {
    trip_cpu *of;
    trip_cpu_store store;
    trip_cpu_tfs functions;
    const trip_cpu_tf *function;       /* the frame's entry of `functions` */
    trip_cpu_sheet_kernel *sheet_pane; /* chosen by effects, closed form and nearest value */
    trip_cpu_group group;
    trip_cpu_about about[TRIP_CPU_SEGMENTS]; /* per segment, for kernels of 64 voxels */
    double last_index;                       /* of the group's last sample plane */
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

/* ---- windows.c ----
 *
 * Draws sheets window by window if the decoded sheets of a list do not fit in memory. A window is a
 * rectangle of rasters. The runs of the sheets that one interval depends on are kept as they are in
 * the file. For each window, the runs are decoded in the window and around it, as far as rays can
 * reach. Each ray is drawn in the window in which it starts, so that each segment is drawn once and
 * in order. */

/* trip_cpu_windows_min_bytes() returns the bytes of the smallest windows. trip_cpu_windows_fit()
 * makes room for the largest windows that fit `room` bytes. It returns false if `room` is too
 * small. */
uint64_t trip_cpu_windows_min_bytes(const trip_cpu_rasters *all, int64_t reach,
                                    const trip_cpu_need *need, int held_sheets,
                                    int samples_per_sheet, bool blurs);
bool trip_cpu_windows_fit(trip_cpu_sheets *s, const trip_cpu_rasters *all, int64_t reach,
                          const trip_cpu_need *need, uint64_t room);
void trip_cpu_windows_release(trip_cpu_windows *w, trip_budget *budget);

/* Add a run to the last sheet or a new one, and draw all remaining intervals of the row. Return 0,
 * TRIP_INTERRUPTED or TRIP_ERROR. */
int trip_cpu_windows_add_run(trip_cpu_sheets *s, const trip_run *run);
int trip_cpu_windows_finish_row(trip_cpu_sheets *s);

/* ---- open_squares.c ----
 *
 * Finds the squares of sheets from which rays of open pixels may read voxels. Other squares are
 * neither decoded nor prepared, which changes no picture. */

/* Sets the store's open squares for a sheet, before its first run. The squares are found for
 * several sheets at once, and again after pixels were drawn. */
void trip_cpu_open_squares_of_sheet(trip_cpu_sheets *s, int64_t number);

/* Returns whether a square in the tile of a run of the sheet is open. */
bool trip_cpu_open_squares_some_of_run(const trip_cpu_sheets *s, const trip_run *run);

/* Forgets the open squares. Call it after pixels were drawn, and before sheets of another row or
 * pass. */
void trip_cpu_open_squares_forget(trip_cpu_sheets *s);

/* ---- need.c ---- */

/* Returns the words that the deviations of `count` records take. */
static inline uint64_t trip_cpu_deviation_words(uint32_t count)
{
    return ((uint64_t)count + 7) / 8;
}

/* Finds the need of a layer. A sheet has at most `rasters` rasters, and `held_sheets` sheets are in
 * memory at a time. `words` covers deviations if `blurs`. Returns TRIP_ERROR if the budget has too
 * little left for the search. */
int trip_cpu_need_find(trip_cpu_need *need, const trip_plan_layer *layer, uint64_t rasters,
                       int held_sheets, bool blurs, trip_budget *budget);

/* ---- pass_view.c: the constants of a pass over sheets, in the form of kernel_sheets.h ---- */

/* Returns how far drawn rays move at most along u or v between two sheets, in index lengths. */
double trip_cpu_pass_steepest(const trip_frame *frame);

void trip_cpu_pass_view_make(trip_cpu_sheet_view *view, const trip_frame *frame, int axis,
                             bool descending, const trip_cpu_tf *function);

#endif
