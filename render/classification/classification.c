#include "classification.h"

#include <float.h>
#include <math.h>

#include "field.h"
#include "kind.h"
#include "geometry.h"

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
    c->has_codes = true;
}

void trip_classification_codes(trip_classification *c, const trip_dataset *data, trip_kernel kernel)
{
    double bounds[2];
    if (!c->has_codes)
        find_held(c, data);
    else if (c->kernel == kernel)
        return;
    c->kernel = kernel;
    c->has_form = false;
    c->code_min = c->held_min;
    c->code_max = c->held_max;
    if (c->held_min > c->held_max)
        return;
    trip_field_code_bounds(kernel, c->held_min, c->held_max, bounds);
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
    if (!c->has_shown)
        trip_code_set_make(&c->shown, table, FLT_TRUE_MIN);
    c->has_shown = true;
    return &c->shown;
}

void trip_classification_forget_table(trip_classification *c)
{
    c->has_form = c->has_shown = false;
}
