#include "dataset_normals.h"

#include <assert.h>
#include <math.h>
#include <string.h>

#include "normal.h"
#include "report.h"

/* Returns the gradient of full shading, which a data set with normals stores. */
static double gradient_full(const trip_dataset *d)
{
    const trip_file_header *h = &d->header;
    const double range =
        h->typical_max > h->typical_min ? h->typical_max - h->typical_min : h->code_hi - h->code_lo;
    return TRIP_GRADIENT_FULL * range / cbrt(fabs(trip_affine_determinant(&d->index_to_world)));
}

int trip_dataset_normals_open(trip_dataset **out, const trip_dataset *d, trip_budget *budget)
{
    const size_t lists = d->list_count * sizeof *d->lists;
    assert(!(d->header.planes >> TRIP_PLANE_NORMALS & 1));
    trip_dataset *with = *out = trip_budget_take(budget, sizeof *with + lists);
    if (!with)
        return trip_fail(TRIP_ERROR, "open", d->path, "no memory for its lists; raise --memory");
    *with = *d;
    with->budget = budget;
    with->computes_normals = true;
    with->header.planes |= 1u << TRIP_PLANE_NORMALS;
    with->header.normal_bytes = 4;
    with->header.gradient_full = gradient_full(d);
    with->lists = (trip_list *)(void *)(with + 1);
    memcpy(with->lists, d->lists, lists);
    for (unsigned i = 0; i < with->list_count; i++)
        if (trip_kind_of(with->lists[i].kind)->splatted)
            with->lists[i].planes |= 1u << TRIP_PLANE_NORMALS;
    return TRIP_OK;
}

void trip_dataset_normals_close(trip_dataset *d)
{
    if (d)
        trip_budget_release(d->budget, d, sizeof *d + d->list_count * sizeof *d->lists);
}

bool trip_dataset_has_gradients_of(const trip_dataset *d, const trip_list *list)
{
    return trip_kind_of(list->kind)->lattice ||
           !trip_dataset_find(d, list->axis, list->level, TRIP_KIND_VALUES);
}
