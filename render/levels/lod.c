#include "lod.h"

#include "dataset_level.h"
#include "report.h"

/* log2 of the cube size in voxels: about a level 0 brick, and larger if there would be too many
 * cubes. With a bound on bytes, cubes are at least as large as the largest tiles. */
enum { CUBE_LOG2 = 6, LIMITED_CUBE_LOG2 = 7, MAX_CUBES = 1 << 22 };

bool trip_lod_concerns(const trip_lod *lod, const trip_list *list)
{
    return lod->level && list->level <= lod->levels &&
           list->kind == (list->level ? TRIP_KIND_MEANS : TRIP_KIND_VOXELS);
}

static void choose_cubes(trip_lod *lod, const trip_dataset *data, int min_log2)
{
    double cubes;
    lod->cube_log2 = (int)lod->levels > min_log2 ? (int)lod->levels : min_log2;
    lod->cube_log2--;
    do {
        lod->cube_log2++;
        cubes = 1;
        for (int a = 0; a < 3; a++) {
            lod->cubes[a] = (((int64_t)data->header.dims[a] - 1) >> lod->cube_log2) + 1;
            cubes *= (double)lod->cubes[a];
        }
    } while (cubes > MAX_CUBES);
}

double trip_lod_width_px(const trip_camera *camera, double depth)
{
    const trip_affine *map = &camera->index_to_world;
    double voxel = 0, pixel = fmin(trip_length(trip_affine_vector(map, camera->rx)),
                                   trip_length(trip_affine_vector(map, camera->ry)));
    for (int a = 0; a < 3; a++)
        voxel = fmax(voxel, trip_length(trip_v3(map->m[0][a], map->m[1][a], map->m[2][a])));
    return voxel / (pixel * (camera->ortho ? 1 : depth));
}

unsigned trip_lod_level(double width_px, double px, unsigned levels)
{
    unsigned level = 0;
    while (level < levels && width_px * 2 <= px) {
        width_px *= 2;
        level++;
    }
    return level;
}

/* Returns the width of level 0 voxels in pixels at the minimum depth of the voxels from `first` to
 * before `past`. */
static double width_in(const trip_camera *camera, const int64_t first[3], const int64_t past[3])
{
    double depth = -trip_dot(camera->forward, camera->eye);
    for (int a = 0; a < 3; a++) {
        double along = trip_component(camera->forward, a);
        depth += fmin(along * ((double)first[a] - 0.5), along * ((double)past[a] - 0.5));
    }
    return camera->ortho || depth > 0 ? trip_lod_width_px(camera, depth) : HUGE_VAL;
}

double trip_lod_cube_width(const trip_lod *lod, const trip_dataset *data, const trip_camera *camera,
                           const int64_t cube[3])
{
    int64_t first[3], past[3];
    for (int a = 0; a < 3; a++) {
        first[a] = cube[a] << lod->cube_log2;
        past[a] = (cube[a] + 1) << lod->cube_log2;
        past[a] = past[a] < (int64_t)data->header.dims[a] ? past[a] : (int64_t)data->header.dims[a];
    }
    return width_in(camera, first, past);
}

static void fill_levels(trip_lod *lod, const trip_dataset *data, const trip_camera *camera,
                        double px)
{
    uint8_t *to = lod->level;
    int64_t cube[3];
    for (cube[2] = 0; cube[2] < lod->cubes[2]; cube[2]++)
        for (cube[1] = 0; cube[1] < lod->cubes[1]; cube[1]++)
            for (cube[0] = 0; cube[0] < lod->cubes[0]; cube[0]++) {
                double width = trip_lod_cube_width(lod, data, camera, cube);
                *to++ = (uint8_t)trip_lod_level(width, px, lod->levels);
            }
}

int trip_lod_make(trip_lod *lod, const trip_dataset *data, trip_kind kind,
                  const trip_camera *camera, const trip_settings *settings, trip_budget *budget)
{
    *lod = (trip_lod){ .kind = kind };
    if (trip_settings_has_levels(settings))
        lod->levels = trip_dataset_levels(data, kind);
    if (lod->levels == 0)
        return 0;
    choose_cubes(lod, data, settings->max_bytes > 0 ? LIMITED_CUBE_LOG2 : CUBE_LOG2);
    lod->bytes = (size_t)(lod->cubes[0] * lod->cubes[1] * lod->cubes[2]);
    lod->level = trip_budget_take(budget, lod->bytes);
    if (!lod->level)
        return trip_fail(TRIP_ERROR, "render", "levels",
                         "the levels of %zu cubes do not fit the memory given; raise --memory",
                         lod->bytes);
    fill_levels(lod, data, camera, settings->lod_px * settings->samples);
    int status = settings->max_bytes > 0 ? trip_lod_bound(lod, data, camera, settings, budget) : 0;
    for (size_t i = 0; i < lod->bytes && !status; i++)
        lod->chosen |= 1u << lod->level[i];
    if (status)
        trip_lod_release(lod, budget);
    return status;
}

void trip_lod_release(trip_lod *lod, trip_budget *budget)
{
    if (lod->level)
        trip_budget_release(budget, lod->level, lod->bytes);
    *lod = (trip_lod){ 0 };
}

uint64_t trip_lod_square(const trip_lod *lod, const trip_list *list, int64_t sheet, int64_t u,
                         int64_t v)
{
    const int shift = lod->cube_log2 - (int)list->level;
    const int64_t u_end = list->dims[(list->axis + 1) % 3],
                  v_end = list->dims[(list->axis + 2) % 3];
    uint64_t mask = 0;
    if (shift >= 3)
        return trip_lod_has(lod, list, sheet, u, v) ? UINT64_MAX : 0;
    for (unsigned n = 0; n < 64; n++) {
        int64_t at_u = u + (n & 1) + (n >> 1 & 2) + (n >> 2 & 4);
        int64_t at_v = v + (n >> 1 & 1) + (n >> 2 & 2) + (n >> 3 & 4);
        if (at_u < u_end && at_v < v_end && trip_lod_has(lod, list, sheet, at_u, at_v))
            mask |= UINT64_C(1) << n;
    }
    return mask;
}

bool trip_lod_brick(const trip_lod *lod, const trip_list *list, const trip_file_header *header,
                    const trip_file_brick *brick, int64_t slab)
{
    const int shift = lod->cube_log2 - (int)list->level, axis = list->axis;
    const int64_t sheet = slab * header->slab_sheets;
    const int64_t u = (int64_t)brick->tile_u << header->tile_log2;
    const int64_t v = (int64_t)brick->tile_v << header->tile_log2;
    int64_t lo[3], hi[3], cube[3];
    lo[axis] = (sheet + brick->sheet_min) >> shift;
    hi[axis] = (sheet + brick->sheet_max) >> shift;
    lo[(axis + 1) % 3] = (u + brick->u_min) >> shift;
    hi[(axis + 1) % 3] = (u + brick->u_max) >> shift;
    lo[(axis + 2) % 3] = (v + brick->v_min) >> shift;
    hi[(axis + 2) % 3] = (v + brick->v_max) >> shift;
    for (cube[2] = lo[2]; cube[2] <= hi[2]; cube[2]++)
        for (cube[1] = lo[1]; cube[1] <= hi[1]; cube[1]++)
            for (cube[0] = lo[0]; cube[0] <= hi[0]; cube[0]++)
                if (trip_lod_at(lod, cube) == list->level)
                    return true;
    return false;
}
