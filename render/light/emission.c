#include "emission.h"

#include <stdlib.h>

#include "black_body.h"
#include "dataset.h"
#include "report.h"

enum { CODES = 65536 };

struct trip_emission {
    trip_budget *budget;
    trip_dataset *data;
    trip_tf_entry *table; /* the table holds v / V, not extinction */
    trip_settings settings;
    trip_clip none;
    trip_light_map *map;
    trip_affine to_heat;
    double kelvin[2];
    float rgb[TRIP_EMISSION_STEPS + 1][4];
};

static void set_table(trip_emission *e)
{
    const trip_file_header *h = &e->data->header;
    for (int code = 0; code < CODES; code++) {
        const double value = trip_codes_value(&e->data->codes, code);
        e->table[code] =
            (trip_tf_entry){ .extinction = (float)fmin(1, fmax(0, value / h->typical_max)) };
    }
}

static int check(const trip_dataset *data, const char *path)
{
    if (!(data->header.typical_max > 0))
        return trip_fail(TRIP_USAGE, "render", path,
                         "holds no value above 0; choose a data set of temperatures");
    return 0;
}

int trip_emission_create(trip_emission **out, const char *path, trip_budget *budget)
{
    trip_emission *e = *out = trip_budget_take(budget, sizeof *e);
    if (!e)
        return trip_fail(TRIP_ERROR, "render", path, "out of memory; raise --memory");
    *e = (trip_emission){ .budget = budget, .settings = trip_settings_default() };
    int status = trip_dataset_open(&e->data, path, budget);
    if (!status)
        status = check(e->data, path);
    if (!status) {
        e->table = trip_budget_take(budget, CODES * sizeof *e->table);
        status =
            e->table ? 0 : trip_fail(TRIP_ERROR, "render", path, "out of memory; raise --memory");
    }
    if (!status) {
        set_table(e);
        return 0;
    }
    trip_emission_destroy(e);
    *out = NULL;
    return status;
}

void trip_emission_destroy(trip_emission *e)
{
    if (!e)
        return;
    trip_emission_drop(e);
    if (e->table)
        trip_budget_release(e->budget, e->table, CODES * sizeof *e->table);
    trip_dataset_close(e->data);
    trip_budget_release(e->budget, e, sizeof *e);
}

void trip_emission_drop(trip_emission *e)
{
    trip_light_map_destroy(e->map);
    e->map = NULL;
}

/* Maps between the first voxels of both grids, so that large numbers do not cancel. */
static trip_affine map_between(const trip_affine *from, const trip_affine *to)
{
    trip_affine inverse, out;
    trip_affine_invert(to, &inverse); /* checked when opened */
    for (int k = 0; k < 4; k++) {
        const bool origin = k == 3;
        const trip_vec3 world = trip_v3(from->m[0][k] - (origin ? to->m[0][k] : 0),
                                        from->m[1][k] - (origin ? to->m[1][k] : 0),
                                        from->m[2][k] - (origin ? to->m[2][k] : 0));
        const trip_vec3 index = trip_affine_vector(&inverse, world);
        for (int a = 0; a < 3; a++)
            out.m[a][k] = trip_component(index, a);
    }
    return out;
}

static void set_colours(trip_emission *e, const double kelvin[2])
{
    for (int i = 0; i <= TRIP_EMISSION_STEPS; i++) {
        const double t = kelvin[0] + (kelvin[1] - kelvin[0]) * i / TRIP_EMISSION_STEPS;
        double rgb[3];
        trip_black_body(t, rgb);
        for (int k = 0; k < 3; k++)
            e->rgb[i][k] = (float)trip_display_of_linear(rgb[k] * pow(t / kelvin[1], 4));
    }
    e->kelvin[0] = kelvin[0];
    e->kelvin[1] = kelvin[1];
}

static int voxels_along(const trip_dataset *data)
{
    uint64_t max = 1;
    for (int a = 0; a < 3; a++)
        max = data->header.dims[a] > max ? data->header.dims[a] : max;
    return max < INT32_MAX ? (int)max : INT32_MAX;
}

int trip_emission_begin(trip_emission *e, const trip_emission_params *p)
{
    e->settings.classify = TRIP_CLASSIFY_POST; /* gathers the halo too */
    e->settings.effects.cells = p->cells ? p->cells : voxels_along(e->data);
    e->to_heat = map_between(p->index_to_world, &e->data->index_to_world);
    if (e->kelvin[0] != p->kelvin[0] || e->kelvin[1] != p->kelvin[1])
        set_colours(e, p->kelvin);
    int status = e->map ? 0 : trip_light_map_create(&e->map, e->budget);
    return status ? status
                  : trip_light_map_begin(e->map, &(trip_light_source){ .data = e->data,
                                                                       .settings = &e->settings,
                                                                       .clip = &e->none,
                                                                       .table = e->table,
                                                                       .engine = p->engine,
                                                                       .threads = p->threads });
}

trip_light_map *trip_emission_map(const trip_emission *e)
{
    return e->map;
}

trip_emission_view trip_emission_view_of(const trip_emission *e)
{
    const uint64_t *dims = e->data->header.dims;
    return (trip_emission_view){
        .heat = trip_light_map_gathered(e->map),
        .to_heat = e->to_heat,
        .last = { (double)dims[0] - 1, (double)dims[1] - 1, (double)dims[2] - 1 },
        .rgb = e->rgb[0],
    };
}
