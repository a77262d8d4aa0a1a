/* The transfer function's integrals over codes, as the kernels take them (kernels/sheets.h). Set
 * for every frame, read-only then; those of frames before are kept where nothing they depend on
 * has changed: of several, since the parts of a picture may have levels of their own. */
#ifndef TRIP_CPU_SHEETS_INTEGRALS_H
#define TRIP_CPU_SHEETS_INTEGRALS_H

#include "budget.h"
#include "closed_form.h"
#include "cpu/kernels/kernel_sheets.h"
#include "cpu/sheets/codes.h"
#include "transfer_function.h"

typedef struct trip_cpu_tf {
    trip_cpu_integrals integrals;
    trip_cpu_codes codes; /* whose integrals they are, and so below */
    /* Codes that may show: those with extinction, and as many beside as an entry reaches. */
    bool in_a_row; /* they are first_visible to last_visible, biased */
    int16_t first_visible, last_visible;
    uint32_t *next_visible; /* 65536: the first such code from here on, or 65536 */
    /* What all of this was made of, with the codes above. */
    uint64_t table_hash[2];
    double voxel_world; /* 0: nothing was made yet */
} trip_cpu_tf;

/* What it takes. */
uint64_t trip_cpu_tf_bytes(void);
/* Memory from the budget; false where it does not suffice. */
bool trip_cpu_tf_create(trip_cpu_tf *f, trip_budget *budget);
void trip_cpu_tf_destroy(trip_cpu_tf *f, trip_budget *budget);

/* Of a table of 65536 entries of the data set's codes, whose extinction is per world unit; with
 * `closed`, its form, no integrals are made. */
void trip_cpu_tf_set(trip_cpu_tf *f, const trip_tf_entry *table, const trip_closed_form *closed,
                     trip_cpu_codes codes, double voxel_world);

enum { TRIP_CPU_TFS = 6 };

typedef struct trip_cpu_tfs {
    trip_cpu_tf kept[TRIP_CPU_TFS];     /* of the first there is memory from the start */
    uint64_t turn, turns[TRIP_CPU_TFS]; /* when each was last taken */
} trip_cpu_tfs;

/* Memory for one; false where the budget does not suffice. */
bool trip_cpu_tfs_create(trip_cpu_tfs *f, trip_budget *budget);
void trip_cpu_tfs_destroy(trip_cpu_tfs *f, trip_budget *budget);
/* As set by trip_cpu_tf_set(): one that is kept, else in the place of the one that was not
 * taken for longest, or in memory of its own where that is a small part of what is left. */
const trip_cpu_tf *trip_cpu_tfs_take(trip_cpu_tfs *f, trip_budget *budget,
                                     const trip_tf_entry *table, const trip_closed_form *closed,
                                     trip_cpu_codes codes, double voxel_world);

/* Whether some code of [least, most] may show; biased codes. */
static inline bool trip_cpu_tf_shows(const trip_cpu_tf *f, int16_t min, int16_t max)
{
    return min <= max &&
           f->next_visible[min + TRIP_CPU_CODE_BIAS] <= (uint32_t)(max + TRIP_CPU_CODE_BIAS);
}

#endif
