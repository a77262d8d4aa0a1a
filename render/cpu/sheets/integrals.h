/* The transfer function's integrals over codes, in the form of kernel_sheets.h. The renderer's
 * thread sets them for every frame; while drawing they are read-only. Integrals of earlier frames
 * are kept and used again for the same inputs. Several are kept, because parts of a picture may
 * have different levels of detail. */
#ifndef TRIP_CPU_SHEETS_INTEGRALS_H
#define TRIP_CPU_SHEETS_INTEGRALS_H

#include "budget.h"
#include "blurred_function.h"
#include "closed_form.h"
#include "cpu/kernels/kernel_sheets.h"
#include "transfer_function.h"

/* ---- codes of sheets ----
 *
 * Sheets and sample planes store integer codes. If a data set uses few of the 65536 codes, a power
 * of two stretches them. So rounding changes a value by at most 1/32768 of the range of values.
 * Samples that use every fourth code (TRIP_CPU_ENTRIES) change by at most 1/16384. */

/* Code c of the data set becomes (c - first) 2^shift, below 65536. */
typedef struct trip_cpu_codes {
    uint16_t first;
    unsigned shift;
} trip_cpu_codes;

/* Returns the stretch for frames with codes in [min, max]. min > max stands for no codes. */
trip_cpu_codes trip_cpu_codes_of(unsigned min, unsigned max);

static inline uint16_t trip_cpu_code(trip_cpu_codes c, uint16_t code)
{
    return (uint16_t)((uint32_t)(uint16_t)(code - c.first) << c.shift);
}

/* ---- integrals ---- */

typedef struct trip_cpu_tf {
    trip_cpu_integrals integrals;
    trip_cpu_codes codes; /* the codes of `integrals` and of the fields below */
    /* Codes that may be visible: codes with extinction, and the codes beside them within an entry's
     * reach. */
    bool in_a_row; /* exactly the biased codes from first_visible to last_visible */
    int16_t first_visible, last_visible;
    uint32_t *next_visible; /* 65536 entries: the first visible code from here on, or 65536 */
    /* Blurred functions only. Codes beyond `codes` may be visible too: the nearest ones below 0 and
     * above 65535. */
    bool blurs;
    trip_cpu_blurred blurred;
    int64_t visible_below, visible_above;
    /* With `codes`, the inputs from which everything was made. */
    uint64_t table_hash[2];
    double voxel_world; /* 0 if nothing was made yet */
} trip_cpu_tf;

/* Returns the bytes that trip_cpu_tf_create() takes, and further bytes of a blurred function. */
uint64_t trip_cpu_tf_bytes(void);
uint64_t trip_cpu_tf_blurred_bytes(void);
/* Takes memory from the budget. Returns false if the budget has too little left. */
bool trip_cpu_tf_create(trip_cpu_tf *f, trip_budget *budget);
void trip_cpu_tf_destroy(trip_cpu_tf *f, trip_budget *budget);

/* Sets everything from a table of 65536 entries, one for each code of the data set. Extinction is
 * per world unit. With a closed form `closed`, no integrals are made; NULL stands for no closed
 * form. */
void trip_cpu_tf_set(trip_cpu_tf *f, const trip_tf_entry *table, const trip_closed_form *closed,
                     trip_cpu_codes codes, double voxel_world);
/* Also sets `blurred`, and takes its memory. Returns false if the budget has too little left. */
bool trip_cpu_tf_set_blurred(trip_cpu_tf *f, const trip_tf_entry *table, trip_cpu_codes codes,
                             double voxel_world, trip_budget *budget);

enum { TRIP_CPU_TFS = 6 };

typedef struct trip_cpu_tfs {
    trip_cpu_tf kept[TRIP_CPU_TFS];     /* kept[0] has memory from the start */
    uint64_t turn, turns[TRIP_CPU_TFS]; /* turns[i]: the turn at which kept[i] was last taken */
} trip_cpu_tfs;

/* Takes memory for one function. Returns false if the budget has too little left. */
bool trip_cpu_tfs_create(trip_cpu_tfs *f, trip_budget *budget);
void trip_cpu_tfs_destroy(trip_cpu_tfs *f, trip_budget *budget);
/* Returns a function as set by trip_cpu_tf_set(), or if `blurs` by trip_cpu_tf_set_blurred(), if
 * possible one that is kept. Otherwise sets a new one: in new memory if that is a small part of the
 * free memory, else over the one taken longest ago. Returns NULL if the budget has too little left
 * for a blurred one. */
const trip_cpu_tf *trip_cpu_tfs_take(trip_cpu_tfs *f, trip_budget *budget,
                                     const trip_tf_entry *table, const trip_closed_form *closed,
                                     trip_cpu_codes codes, double voxel_world, bool blurs);

/* Returns how far values reach in `codes` at a row of the blurred function or below
 * (trip_blurred_reach()). */
int64_t trip_cpu_tf_reach(const trip_cpu_tf *f, unsigned row);
/* Returns whether a code in [min, max] may be visible at deviations with this reach. */
bool trip_cpu_tf_shows_within(const trip_cpu_tf *f, int16_t min, int16_t max, int64_t reach);

/* Returns whether a code in [min, max] may be visible. Both are biased codes. */
static inline bool trip_cpu_tf_shows(const trip_cpu_tf *f, int16_t min, int16_t max)
{
    return min <= max &&
           f->next_visible[min + TRIP_CPU_CODE_BIAS] <= (uint32_t)(max + TRIP_CPU_CODE_BIAS);
}

#endif
