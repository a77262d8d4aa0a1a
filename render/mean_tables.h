/* What the codes of coarse levels look like, as tables of 65536 entries: the value of a mean as the
 * transfer function shows it, with the extinction by which a splat shows the part of its cube that
 * was kept. Lists whose cubes are as long along their axes have one table. The caller may keep them
 * from frame to frame, and releases them where the function or the data set is another. Plain
 * values; one thread. */
#ifndef TRIP_MEAN_TABLES_H
#define TRIP_MEAN_TABLES_H

#include "budget.h"
#include "dataset.h"
#include "transfer_function.h"

enum { TRIP_MEAN_TABLES_MAX = 3 * 32 }; /* an axis and a level each */

/* Zeroed: there are none. */
typedef struct trip_mean_tables {
    unsigned count;
    double lengths[TRIP_MEAN_TABLES_MAX]; /* of cubes along the axis, in world space */
    trip_tf_entry *tables[TRIP_MEAN_TABLES_MAX];
} trip_mean_tables;

/* The table of a list of means where `function` is that of level 0; made where it is not there.
 * Fails, reported, without memory. */
int trip_mean_tables_get(trip_mean_tables *t, const trip_dataset *data, const trip_list *list,
                         const trip_tf_entry *function, trip_budget *budget,
                         const trip_tf_entry **table);
uint64_t trip_mean_tables_bytes(const trip_mean_tables *t);
void trip_mean_tables_release(trip_mean_tables *t, trip_budget *budget);

#endif
