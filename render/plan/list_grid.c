#include "list_grid.h"

#include <string.h>

#include "report.h"

static const double ROUNDING = 1e-6;

static bool is_close(double a, double b, double unit)
{
    return fabs(a - b) <= ROUNDING * unit;
}

/* Returns whether a map is a positive scale along each axis plus an offset. */
static bool is_along_axes(const trip_affine *map)
{
    for (int i = 0; i < 3; i++) {
        if (!(map->m[i][i] > 0))
            return false;
        for (int j = 0; j < 3; j++)
            if (i != j && !is_close(map->m[i][j], 0, map->m[i][i]))
                return false;
    }
    return true;
}

static int fail(const trip_dataset *data, const trip_list *list, const char *why)
{
    return trip_fail(TRIP_ERROR, "render", data->path, "list %u (%c, level %u): %s", list->index,
                     "xyz"[list->axis], list -> level, why);
}

int trip_list_grid_make(trip_list_grid *g, const trip_dataset *data, const trip_list *list)
{
    trip_affine inverse, map;
    *g = (trip_list_grid){ { 1, 1, 1 }, { 0, 0, 0 } };
    if (memcmp(&list->index_to_world, &data->index_to_world, sizeof map) != 0) {
        if (!trip_affine_invert(&data->index_to_world, &inverse))
            return fail(data, list, "the map of level 0 is singular");
        map = trip_affine_multiply(&inverse, &list->index_to_world);
        if (!is_along_axes(&map))
            return fail(data, list, "its grid is not parallel to the grid of level 0");
        for (int i = 0; i < 3; i++) {
            g->scale[i] = map.m[i][i];
            g->offset[i] = map.m[i][3];
        }
    }
    double step = list->sheet_step;
    if (!is_close(g->scale[list->axis], step, step) ||
        !is_close(g->offset[list->axis], list->sheet_first,
                  step * (double)(list->dims[list->axis] + 1)))
        return fail(data, list, "its sheet coordinates contradict its map");
    return TRIP_OK;
}
