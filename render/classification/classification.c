#include "classification.h"

#include <float.h>
#include <math.h>

#include "field.h"
#include "kind.h"
#include "geometry.h"
#include "mean.h"
#include "report.h"

/* Finds the range of codes in all lists that frames of level 0 read. */
static void find_held(trip_classification *c, const trip_dataset *data)
{
    unsigned min = UINT16_MAX, max = 0;
    for (unsigned i = 0; i < data->list_count; i++) {
        const trip_list *list = &data->lists[i];
        if (list->level > 0 || !trip_kind_of(list->kind)->lattice)
            continue;
        for (uint64_t n = 0; n < list->brick_count; n++) {
            min = list->bricks[n].code_min < min ? list->bricks[n].code_min : min;
            max = list->bricks[n].code_max > max ? list->bricks[n].code_max : max;
        }
    }
    c->held_min = min;
    c->held_max = max;
    c->has_held = true;
}

void trip_classification_codes(trip_classification *c, const trip_dataset *data, trip_kernel kernel)
{
    double bounds[2];
    if (!c->has_held)
        find_held(c, data);
    else if (c->has_codes && c->kernel == kernel)
        return;
    c->kernel = kernel;
    c->has_codes = true;
    c->has_form = false;
    c->code_min = c->held_min;
    c->code_max = c->held_max;
    if (c->held_min > c->held_max)
        return;
    if (c->draw) {
        c->code_min = trip_draw_code(c->draw, c->held_min);
        c->code_max = trip_draw_code(c->draw, c->held_max);
    }
    trip_field_code_bounds(kernel, c->code_min, c->code_max, bounds);
    c->code_min = (unsigned)fmax(0, floor(bounds[0]));
    c->code_max = (unsigned)fmin(UINT16_MAX, ceil(bounds[1]));
}

/* Returns an upper bound on the length of a ray in the volume, world units. */
static double longest_ray(const trip_dataset *data)
{
    const trip_affine *map = &data->index_to_world;
    double sum = 0;
    for (int a = 0; a < 3; a++)
        sum += (double)data->header.dims[a] *
               trip_length(trip_v3(map->m[0][a], map->m[1][a], map->m[2][a]));
    return sum;
}

void trip_classification_form(trip_classification *c, const trip_dataset *data, trip_kernel kernel,
                              const trip_tf_entry *table)
{
    trip_classification_codes(c, data, kernel);
    if (!c->has_form)
        c->not_closed =
            trip_closed_form_find(&c->closed, table, c->code_min, c->code_max, longest_ray(data));
    c->has_form = true;
}

const trip_code_set *trip_classification_shown(trip_classification *c, const trip_tf_entry *table)
{
    if (!c->has_shown || c->shown_by != table)
        trip_code_set_make(&c->shown, table, FLT_TRUE_MIN);
    c->shown_by = table;
    c->has_shown = true;
    return &c->shown;
}

void trip_classification_forget_table(trip_classification *c)
{
    c->has_codes = c->has_form = c->has_shown = false;
}

enum { ENTRIES = 65536 };

static const size_t table_bytes = ENTRIES * sizeof(trip_tf_entry);

static void fill(trip_tf_entry *to, const trip_dataset *data, const trip_tf_entry *function,
                 double length)
{
    const trip_file_header *h = &data->header;
    const trip_mean_scale scale =
        trip_mean_scale_make(h->typical_min, h->typical_max, &data->codes);
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
