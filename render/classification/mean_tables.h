/* The tables of coarse levels: 65536 entries that map a code of means to colour and extinction. The
 * colour is the transfer function's at the mean. The extinction makes a splat as opaque as the kept
 * part of its cube. Lists with equally long cubes along their axes share a table. The caller may
 * keep the tables from frame to frame, and releases them when the transfer function or the data set
 * changes. Plain values; one thread at a time. */
#ifndef TRIP_MEAN_TABLES_H
#define TRIP_MEAN_TABLES_H

#include "budget.h"
#include "dataset.h"
#include "transfer_function.h"

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
