#include "mean_tables.h"

#include "mean.h"
#include "report.h"

enum { ENTRIES = 65536 };

static const size_t table_bytes = ENTRIES * sizeof(trip_tf_entry);

static void fill(trip_tf_entry *to, const trip_dataset *data, const trip_tf_entry *function,
                 double length)
{
    const trip_file_header *h = &data->header;
    const trip_mean_scale scale =
        trip_mean_scale_make(h->value_min, h->value_max, h->code_lo, h->code_hi);
    double extinctions[TRIP_MEAN_SHARES] = { 0 };
    float of_mean = 0;
    for (unsigned code = 0; code < ENTRIES; code += TRIP_MEAN_SHARES) {
        const trip_tf_entry mean = function[trip_mean_value(&scale, code)];
        if (mean.extinction != of_mean) {
            of_mean = mean.extinction;
            trip_mean_extinctions((double)of_mean, length, extinctions);
        }
        for (unsigned shares = 0; shares < TRIP_MEAN_SHARES; shares++) {
            to[code + shares] = mean;
            to[code + shares].extinction = (float)extinctions[shares];
        }
    }
}

int trip_mean_tables_get(trip_mean_tables *t, const trip_dataset *data, const trip_list *list,
                         const trip_tf_entry *function, trip_budget *budget,
                         const trip_tf_entry **table)
{
    const trip_affine *map = &list->index_to_world;
    const int a = list->axis;
    const double length = trip_length(trip_v3(map->m[0][a], map->m[1][a], map->m[2][a]));
    unsigned i = 0;
    while (i < t->count && t->lengths[i] != length)
        i++;
    if (i == t->count) {
        trip_tf_entry *made =
            i < TRIP_MEAN_TABLES_MAX ? trip_budget_take(budget, table_bytes) : NULL;
        if (!made)
            return trip_fail(TRIP_ERROR, "render", "plan",
                             "tables of coarse levels do not fit the memory given; raise --memory");
        fill(made, data, function, length);
        t->tables[i] = made;
        t->lengths[t->count++] = length;
    }
    *table = t->tables[i];
    return 0;
}

uint64_t trip_mean_tables_bytes(const trip_mean_tables *t)
{
    return t->count * table_bytes;
}

void trip_mean_tables_release(trip_mean_tables *t, trip_budget *budget)
{
    for (unsigned i = 0; i < t->count; i++)
        trip_budget_release(budget, t->tables[i], table_bytes);
    t->count = 0;
}
