#include "lod.h"

#include "brick_box.h"
#include "dataset_level.h"
#include "plan_cull.h"
#include "report.h"
#include "weight.h"

/* Inputs of the choice. Cubes are in the order of trip_lod.level. */
typedef struct limiting {
    trip_lod *lod;
    const trip_dataset *data;
    uint32_t *voxels; /* level 0 voxels in the cube; 0 if it is out of view */
    float *width;     /* width of its voxels, px */
    double bytes[1 + TRIP_DATASET_LEVELS_MAX]; /* bytes per level 0 voxel at each level, in all
                                                  lists read */
} limiting;

static int lists_read(const trip_camera *camera, const trip_settings *settings)
{
    const int axis_of_view = trip_weight_axis_of_view(camera);
    int lists = 0;
    for (int axis = 0; axis < 3; axis++)
        lists += trip_weight_is_somewhere(settings, camera, axis_of_view, axis, TRIP_WAY_ANY);
    return lists;
}

/* Returns the bytes of a record's code and of its deviation, if it has one. */
static double code_bytes(const trip_dataset *data, const trip_list *list)
{
    const trip_kind_info *of = trip_kind_of(list->kind);
    const double code = of->code_bytes && !of->steps ? of->code_bytes : data->header.code_bytes;
    return code + (list->planes >> TRIP_PLANE_DEVIATIONS & 1);
}

/* Returns whether a list along the third axis counts; the other two axes hold the same number of
 * voxels. Splats count voxels and means. Interpolation counts voxels, values and halo. */
static bool is_drawn(const trip_lod *lod, const trip_list *list)
{
    if (list->axis != 2 || list->level > lod->levels)
        return false;
    if (list->level > 0)
        return list->kind == lod->kind;
    return list->kind == TRIP_KIND_VOXELS ||
           (list->kind == TRIP_KIND_HALO && lod->kind == TRIP_KIND_VALUES);
}

static void weigh_levels(limiting *l, const trip_camera *camera, const trip_settings *settings)
{
    const bool splats = l->lod->kind == TRIP_KIND_MEANS;
    const double normals = settings->shading && splats && !l->data->computes_normals
                               ? l->data->header.normal_bytes
                               : 0;
    const double kept = (double)l->data->header.kept;
    const double lists = kept > 0 ? lists_read(camera, settings) / kept : 0;
    for (unsigned i = 0; i < l->data->list_count; i++) {
        const trip_list *list = &l->data->lists[i];
        if (is_drawn(l->lod, list))
            l->bytes[list->level] +=
                lists * (double)list->records * (code_bytes(l->data, list) + normals);
    }
}

static uint32_t *cube_at(const limiting *l, int64_t i, int64_t j, int64_t k)
{
    const trip_lod *lod = l->lod;
    const int log2 = lod->cube_log2;
    return &l->voxels[((k >> log2) * lod->cubes[1] + (j >> log2)) * lod->cubes[0] + (i >> log2)];
}

/* Counts the voxels of a brick in their cubes. A tile lies within one cube, and so does a sheet,
 * but a slab can cross cubes. */
static void count_brick(limiting *l, const trip_list *list, uint64_t index, int64_t slab_sheet)
{
    const trip_file_header *h = &l->data->header;
    const trip_file_brick *brick = &list->bricks[index];
    const int64_t u = (int64_t)brick->tile_u << h->tile_log2;
    const int64_t v = (int64_t)brick->tile_v << h->tile_log2;
    const int64_t first = slab_sheet + brick->sheet_min, last = slab_sheet + brick->sheet_max;
    if (first >> l->lod->cube_log2 == last >> l->lod->cube_log2) {
        *cube_at(l, u, v, first) += brick->records;
        return;
    }
    for (unsigned i = brick->sheet_min; i <= brick->sheet_max; i++)
        *cube_at(l, u, v, slab_sheet + i) += list->runs[index * h->slab_sheets + i].records;
}

static void count_voxels(limiting *l)
{
    const trip_list *list = trip_dataset_find(l->data, 2, 0, TRIP_KIND_VOXELS);
    for (uint64_t s = 0; s < list->slab_count; s++) {
        const trip_file_slab *slab = &list->slabs[s];
        for (uint64_t b = slab->first_brick; b < slab->first_brick + slab->brick_count; b++)
            count_brick(l, list, b, (int64_t)slab->slab * l->data->header.slab_sheets);
    }
}

/* Computes the width of a cube's voxels. Cubes out of view get no voxels. */
static void place_cube(limiting *l, const trip_cull *cull, const int64_t cube[3], size_t at)
{
    const trip_lod *lod = l->lod;
    const double edge = ldexp(1, lod->cube_log2);
    double lo[3], hi[3];
    for (int a = 0; a < 3; a++) {
        lo[a] = (double)cube[a] * edge - 0.5;
        hi[a] = fmin((double)(cube[a] + 1) * edge, (double)l->data->header.dims[a]) - 0.5;
    }
    if (!trip_cull_may_see(cull, lo, hi))
        l->voxels[at] = 0;
    const double nearest = trip_lod_width_px(cull->camera, TRIP_LOD_NEAREST_VOXELS);
    const double width = trip_lod_cube_width(lod, l->data, cull->camera, cube);
    l->width[at] = (float)(width < nearest || cull->camera->ortho ? width : nearest);
}

static int place_cubes(limiting *l, const trip_camera *camera, const trip_settings *settings)
{
    const trip_lod *lod = l->lod;
    const trip_list *list = trip_dataset_find(l->data, 2, 0, TRIP_KIND_VOXELS);
    trip_list_grid grid;
    int64_t cube[3];
    size_t at = 0;
    int status = trip_list_grid_make(&grid, l->data, list);
    if (status)
        return status;
    const trip_cull cull = trip_cull_make(l->data, camera, &grid, settings,
                                          trip_weight_axis_of_view(camera), NULL, NULL);
    for (cube[2] = 0; cube[2] < lod->cubes[2]; cube[2]++)
        for (cube[1] = 0; cube[1] < lod->cubes[1]; cube[1]++)
            for (cube[0] = 0; cube[0] < lod->cubes[0]; cube[0]++)
                place_cube(l, &cull, cube, at++);
    return 0;
}

/* Returns the level of a cube for a maximum voxel width. */
static unsigned level_at(const limiting *l, size_t cube, double px)
{
    const unsigned level = trip_lod_level((double)l->width[cube], px, l->lod->levels);
    return level > l->lod->level[cube] ? level : l->lod->level[cube];
}

static double bytes_at(const limiting *l, double px)
{
    double bytes = 0;
    for (size_t i = 0; i < l->lod->bytes; i++)
        if (l->voxels[i])
            bytes += l->voxels[i] * l->bytes[level_at(l, i, px)];
    return bytes;
}

/* Returns the minimum voxel width, to 1/64, that keeps the bound on bytes, or `max` if none does.
 */
static double min_px(const limiting *l, double bytes, double max)
{
    enum { PARTS = 64, DOUBLINGS = 40 };
    int enough = PARTS * DOUBLINGS, too_little = 0;
    while (enough - too_little > 1) {
        const int middle = (enough + too_little) / 2;
        if (bytes_at(l, max * exp2((double)middle / PARTS - DOUBLINGS)) <= bytes)
            enough = middle;
        else
            too_little = middle;
    }
    return max * exp2((double)enough / PARTS - DOUBLINGS);
}

static void choose(limiting *l, double max_bytes)
{
    trip_lod *lod = l->lod;
    double widest = 0;
    for (size_t i = 0; i < lod->bytes; i++)
        widest = fmax(widest, l->voxels[i] ? (double)l->width[i] : 0);
    lod->limit.full_bytes = lod->limit.bytes = bytes_at(l, 0);
    if (lod->limit.full_bytes <= max_bytes || !(widest > 0))
        return;
    const double px = min_px(l, max_bytes, ldexp(widest, (int)lod->levels));
    lod->limit.px = px;
    lod->limit.bytes = bytes_at(l, px);
    for (size_t i = 0; i < lod->bytes; i++)
        lod->level[i] = (uint8_t)level_at(l, i, px);
}

int trip_lod_bound(trip_lod *lod, const trip_dataset *data, const trip_camera *camera,
                   const trip_settings *settings, trip_budget *budget)
{
    const size_t cubes = lod->bytes;
    limiting l = { .lod = lod, .data = data };
    l.voxels = trip_budget_take(budget, cubes * sizeof *l.voxels);
    l.width = trip_budget_take(budget, cubes * sizeof *l.width);
    int status =
        l.voxels && l.width
            ? 0
            : trip_fail(TRIP_ERROR, "render", "levels",
                        "the widths of %zu cubes do not fit the memory given; raise --memory",
                        cubes);
    if (!status) {
        count_voxels(&l);
        weigh_levels(&l, camera, settings);
        status = place_cubes(&l, camera, settings);
    }
    if (!status)
        choose(&l, settings->max_bytes);
    if (l.voxels)
        trip_budget_release(budget, l.voxels, cubes * sizeof *l.voxels);
    if (l.width)
        trip_budget_release(budget, l.width, cubes * sizeof *l.width);
    return status;
}

double trip_lod_values_bytes(const trip_dataset *data, const trip_camera *camera,
                             const trip_settings *settings, unsigned level)
{
    const trip_lod lod = { .kind = TRIP_KIND_VALUES, .levels = level };
    double bytes = 0;
    for (unsigned i = 0; i < data->list_count; i++) {
        const trip_list *list = &data->lists[i];
        if (list->level == level && is_drawn(&lod, list))
            bytes += (double)list->records * code_bytes(data, list);
    }
    return bytes * lists_read(camera, settings);
}
