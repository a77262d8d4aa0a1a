#include "source_field.h"

#include <math.h>
#include <string.h>

#include "dataset_metadata.h"
#include "report.h"

enum { EDGE = 64, SLICES = 16 };

static const size_t values_bytes = (size_t)EDGE * EDGE * SLICES * sizeof(float);

typedef struct reading {
    const trip_dataset *data;
    trip_volume *volume;
    trip_field *field;
    float *values; /* of one box */
    trip_budget *budget;
} reading;

/* Returns the code of a value. If codes are uneven, returns the value. */
static double number_of(const trip_dataset *data, double value)
{
    const trip_codes *c = &data->codes;
    const double range = c->hi - c->lo;
    if (!trip_codes_even(c))
        return value;
    return range > 0 ? (value - c->lo) / range * 65535 : 0;
}

static int put_box(reading *r, const int64_t lo[3], const int64_t size[3])
{
    int status = 0;
    const float *value = r->values;
    for (int64_t k = lo[2]; k < lo[2] + size[2]; k++)
        for (int64_t j = lo[1]; j < lo[1] + size[1]; j++)
            for (int64_t i = lo[0]; i < lo[0] + size[0] && !status; i++, value++) {
                const int64_t at[3] = { i, j, k };
                if (isfinite(*value) && !trip_field_at(r->field, i, j, k))
                    status = trip_field_put(r->field, at, number_of(r->data, *value), NULL);
            }
    return status;
}

static int64_t smaller(int64_t a, int64_t b)
{
    return a < b ? a : b;
}

static int put_range(reading *r, const trip_volume_portion *portion, const int64_t lo[3],
                     const int64_t hi[3])
{
    int64_t at[3], size[3];
    int status = 0;
    for (at[2] = lo[2]; at[2] < hi[2]; at[2] += SLICES)
        for (at[1] = lo[1]; at[1] < hi[1]; at[1] += EDGE)
            for (at[0] = lo[0]; at[0] < hi[0] && !status; at[0] += EDGE) {
                for (int a = 0; a < 3; a++)
                    size[a] = smaller(a == 2 ? SLICES : EDGE, hi[a] - at[a]);
                status = trip_portion_decode(r->volume, portion, at, size, r->values, NULL);
                if (!status)
                    status = put_box(r, at, size);
                if (!status && trip_interrupted())
                    status = trip_fail(TRIP_INTERRUPTED, "read", "volume", "interrupted");
            }
    return status;
}

/* In a sparse volume, one voxel around the portion belongs to it. */
static int put_portion(reading *r, const trip_volume_portion *portion)
{
    const trip_volume_info *info = trip_volume_get_info(r->volume);
    int64_t lo[3], hi[3], around = info->sparse;
    for (int a = 0; a < 3; a++) {
        lo[a] = portion->origin[a] > around ? portion->origin[a] - around : 0;
        hi[a] = smaller(portion->origin[a] + portion->size[a] + around, info->dims[a]);
    }
    return put_range(r, portion, lo, hi);
}

static int put_volume(reading *r)
{
    trip_volume_portion portion;
    int status;
    while ((status = trip_volume_next(r->volume, SLICES, &portion)) > 0) {
        status = put_portion(r, &portion);
        trip_portion_release(r->volume, &portion);
        if (status)
            return status;
    }
    return status;
}

static bool same_coordinates(const double *a, const double *b, int64_t count)
{
    return a && b ? memcmp(a, b, (size_t)count * sizeof *a) == 0 : a == b;
}

static int check_grid(const reading *r, const char *path)
{
    const trip_volume_info *info = trip_volume_get_info(r->volume);
    const trip_affine *map = &r->data->index_to_world;
    bool same = memcmp(&info->index_to_world, map, sizeof *map) == 0;
    for (int a = 0; a < 3; a++)
        same &= info->dims[a] == (int64_t)r->data->header.dims[a];
    for (int a = 0; a < 3 && same; a++)
        same = same_coordinates(info->coordinates[a], r->data->coordinates.along[a], info->dims[a]);
    return same ? 0
                : trip_fail(TRIP_ERROR, "read", path,
                            "is not the volume that %s was made of, since the grids differ",
                            r->data->path);
}

static int read_volume(reading *r, const char *path)
{
    const int64_t *dims = trip_volume_get_info(r->volume)->dims;
    const trip_codes *c = &r->data->codes;
    int status = check_grid(r, path);
    if (!status)
        status = trip_field_create(&r->field, dims, r->budget);
    if (!status)
        status = put_volume(r);
    return status ? status
                  : trip_field_finish(
                        r->field,
                        &(trip_field_map){ .index_to_world = r->data->index_to_world,
                                           .coordinates = &r->data->coordinates,
                                           .value_per_code =
                                               trip_codes_even(c) ? (c->hi - c->lo) / 65535 : 1 });
}

/* Makes the volume lack the values that bricking took for fill values. */
static int use_fills(const reading *r)
{
    trip_dataset_metadata *text;
    trip_fills fills = { 0 };
    int status = trip_dataset_metadata_parse(&text, r->data);
    if (status)
        return status;
    fills.count = trip_dataset_metadata_fills(text, fills.values, TRIP_FILLS_MAX);
    trip_dataset_metadata_destroy(text);
    trip_volume_set_fills(r->volume, &fills);
    return 0;
}

int trip_source_field_read(trip_field **out, const trip_dataset *data, const char *path,
                           const trip_volume_params *params, trip_budget *budget)
{
    reading r = { .data = data,
                  .budget = budget,
                  .values = trip_budget_take(budget, values_bytes) };
    *out = NULL;
    if (!r.values)
        return trip_fail(TRIP_ERROR, "read", path, "out of memory; raise --memory");
    int status = trip_volume_open(&r.volume, path, params, budget);
    if (!status && !params->fill)
        status = use_fills(&r);
    if (!status)
        status = read_volume(&r, path);
    trip_volume_close(r.volume);
    trip_budget_release(budget, r.values, values_bytes);
    if (status)
        trip_field_destroy(r.field);
    else
        *out = r.field;
    return status;
}
