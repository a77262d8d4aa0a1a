#include "glance.h"

#include <math.h>
#include <stdlib.h>

#include "clock.h"
#include "report.h"
#include "typical.h"

/* Limits of a look. */
static const double max_seconds = 1;
static const int64_t max_bytes = INT64_C(64) << 20; /* of values, and of one skip */
static const int64_t max_slice_bytes = INT64_C(32) << 20;

typedef struct look {
    trip_volume *volume;
    const trip_volume_info *info;
    trip_tally *tally;
    trip_budget *budget;
    double until;
    int64_t done; /* slices passed */
    double read;  /* slices read */
} look;

static bool is_over(const look *l)
{
    return trip_now_seconds() > l->until || trip_interrupted();
}

/* Adds the rows of a portion. `rows` of them are decoded at once. */
static int add_portion(look *l, const trip_volume_portion *p, int64_t rows, float *values,
                       uint8_t *active)
{
    int status = 0;
    for (int64_t row = 0; row < p->size[1] * p->size[2] && !status; row += rows) {
        const int64_t lo[3] = { p->origin[0], p->origin[1] + row % p->size[1],
                                p->origin[2] + row / p->size[1] };
        const int64_t size[3] = { p->size[0], rows, 1 };
        status = trip_portion_decode(l->volume, p, lo, size, values, active);
        for (int64_t j = 0; j < rows && !status; j++)
            trip_tally_row(l->tally, values + j * size[0], active + j * size[0], (size_t)size[0],
                           (const int64_t[3]){ lo[0], lo[1] + j, lo[2] });
    }
    return status;
}

/* Reads the next portion. Returns 1, or 0 if there is none. */
static int add_next(look *l)
{
    trip_volume_portion p = { 0 };
    int status = trip_volume_next(l->volume, 1, &p);
    if (status != 1)
        return status;
    const int64_t rows = l->info->sparse ? p.size[1] : 1; /* portions of sparse volumes are small */
    const size_t voxels = (size_t)(p.size[0] * rows);
    float *values = malloc(voxels * (sizeof *values + 1));
    status = values ? add_portion(l, &p, rows, values, (uint8_t *)(values + voxels)) : 0;
    l->done += p.size[2];
    l->read += (double)p.size[2];
    free(values);
    trip_portion_release(l->volume, &p);
    return status ? status : 1;
}

/* Skips slices in steps, because skipping may decompress them. */
static int skip(look *l, int64_t slices, int64_t step)
{
    while (slices > 0 && !is_over(l)) {
        const int64_t skipped = trip_volume_skip(l->volume, slices < step ? slices : step);
        if (skipped <= 0)
            return (int)skipped;
        slices -= skipped;
        l->done += skipped;
    }
    return 0;
}

static int read_slices(look *l)
{
    const int64_t *dims = l->info->dims;
    const int64_t slice_bytes = dims[0] * dims[1] * (int64_t)trip_scalar_bytes(l->info->type);
    const int64_t most = max_bytes / slice_bytes > 1 ? max_bytes / slice_bytes : 1;
    const int64_t stride = dims[2] > most ? dims[2] / most : 1;
    /* A portion has a slice on each side, and the volume keeps two for the next portion. */
    const bool fits = slice_bytes <= max_slice_bytes &&
                      (double)trip_budget_left_bytes(l->budget) > 6 * (double)slice_bytes;
    int status = fits ? 1 : 0;
    while (status == 1 && !is_over(l)) {
        status = add_next(l);
        if (status == 1 && stride > 1) {
            const int skipped = skip(l, stride - 1, most);
            status = skipped < 0 ? skipped : 1;
        }
    }
    return status;
}

static int read_portions(look *l)
{
    int status = 1;
    while (status == 1 && !is_over(l))
        status = add_next(l);
    l->read = status == 0 ? (double)l->info->dims[2] : 0;
    return status;
}

/* Sparse portions do not tell their share of the volume. A look that does not reach their end
 * counts as a thousandth. */
static double share_of(const look *l)
{
    if (l->info->sparse && l->read == 0)
        return 0.001;
    return fmin(1, l->read / (double)l->info->dims[2]);
}

static int look_at(look *l, trip_glance *out, const char *path)
{
    trip_tally_clear(l->tally);
    int status = l->info->sparse ? read_portions(l) : read_slices(l);
    if (status < 0)
        return status;
    if (l->tally->finite == 0)
        return 0;
    status = trip_typical_set(l->tally, path);
    if (status == 0)
        *out = (trip_glance){ .share = share_of(l),
                              .value_min = l->tally->value_min,
                              .value_max = l->tally->value_max,
                              .typical_min = l->tally->typical_min,
                              .typical_max = l->tally->typical_max };
    if (status == 0)
        status = trip_typical_find_fills(l->tally, l->info, &out->fills, path);
    return status < 0 ? status : 0;
}

int trip_glance_at(trip_glance *out, trip_volume *volume, const char *path, trip_budget *budget)
{
    look l = { .volume = volume,
               .info = trip_volume_get_info(volume),
               .budget = budget,
               .until = trip_now_seconds() + max_seconds };
    *out = (trip_glance){ 0 };
    if (!(l.tally = trip_budget_take(budget, sizeof *l.tally)))
        return 0;
    int status = look_at(&l, out, path);
    trip_budget_release(budget, l.tally, sizeof *l.tally);
    return status;
}
