/* Facts that frames need of a data set, a transfer function and a kernel, and that do not depend on
 * the view. They are the visible codes and, for post, the range of all codes and the closed form of
 * segments. The caller keeps them from frame to frame. It must forget the transfer function when
 * the table changes, and everything when the data set changes. Plain values. */
#ifndef TRIP_CLASSIFICATION_H
#define TRIP_CLASSIFICATION_H

#include "budget.h"
#include "closed_form.h"
#include "code_set.h"
#include "dataset.h"
#include "draw_codes.h"
#include "settings.h"
#include "transfer_function.h"

/* Zero-initialised, it knows nothing yet. */
typedef struct trip_classification {
    /* The draw codes of frames that interpolate; the caller's. NULL stands for the stored codes. */
    const trip_draw_codes *draw;
    /* The range of interpolated draw codes with the last kernel. It covers all bricks of the data
     * set, not only the frame's, so that a picture does not depend on the size of bricks. */
    unsigned code_min, code_max; /* code_min > code_max if there are none */
    trip_closed_form_fault not_closed;
    trip_closed_form closed; /* valid if not_closed is TRIP_CLOSED_FORM_FOUND */
    trip_code_set shown;     /* codes with extinction in the table `shown_by` */
    const trip_tf_entry *shown_by;
    /* Whether the stored codes, the range of codes, the closed form and the visible codes are
     * known. */
    bool has_held, has_codes, has_form, has_shown;
    unsigned held_min, held_max; /* range of stored codes in the data set */
    trip_kernel kernel;
} trip_classification;

/* Finds the range of codes, unless known. */
void trip_classification_codes(trip_classification *c, const trip_dataset *data,
                               trip_kernel kernel);
/* Finds the range of codes and whether `table` has a closed form over it, unless known. */
void trip_classification_form(trip_classification *c, const trip_dataset *data, trip_kernel kernel,
                              const trip_tf_entry *table);
/* Returns the codes visible in `table`, and finds them unless known. */
const trip_code_set *trip_classification_shown(trip_classification *c, const trip_tf_entry *table);
/* Forgets the transfer function. Call it after the table or the draw codes have changed. */
void trip_classification_forget_table(trip_classification *c);

/* ---- tables of coarse levels ----
 *
 * A table has 65536 entries that map a code of means to colour and extinction. The colour is the
 * transfer function's at the mean. The extinction makes a splat as opaque as the kept part of its
 * cube. Lists with equally long cubes along their axes share a table. The caller may keep the
 * tables from frame to frame, and releases them when the transfer function or the data set changes.
 */

enum { TRIP_MEAN_TABLES_MAX = 3 * 32 }; /* one per axis and level */

/* Zero-initialise it. */
typedef struct trip_mean_tables {
    unsigned count;
    double lengths[TRIP_MEAN_TABLES_MAX]; /* length of cubes along the axis, world units */
    trip_tf_entry *tables[TRIP_MEAN_TABLES_MAX];
} trip_mean_tables;

/* Returns the table of a list of means, and makes it if it is missing. `function` is the table of
 * level 0. Fails, reported, if memory is exhausted. */
int trip_mean_tables_get(trip_mean_tables *t, const trip_dataset *data, const trip_list *list,
                         const trip_tf_entry *function, trip_budget *budget,
                         const trip_tf_entry **table);
uint64_t trip_mean_tables_bytes(const trip_mean_tables *t);
void trip_mean_tables_release(trip_mean_tables *t, trip_budget *budget);

#endif
