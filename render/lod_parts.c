#include "lod_parts.h"

#include <math.h>

#include "dataset_level.h"
#include "lod_limit.h"
#include "report.h"

/* Octaves of distance over which a level gives way to the next where all has one. */
#define MIXED_OCTAVES 0.25

/* Depths of the whole grid. */
typedef struct range {
    double nearest, farthest;
} range;

static range depths_of(const trip_dataset *data, const trip_camera *camera)
{
    range r = { .nearest = -trip_dot(camera->forward, camera->eye) };
    r.farthest = r.nearest;
    for (int a = 0; a < 3; a++) {
        const double along = trip_component(camera->forward, a);
        const double lo = -0.5, hi = (double)data->header.dims[a] - 0.5;
        r.nearest += fmin(along * lo, along * hi);
        r.farthest += fmax(along * lo, along * hi);
    }
    return r;
}

static double width_at(const trip_camera *camera, double depth)
{
    return camera->ortho || depth > 0 ? trip_lod_width_px(camera, depth) : HUGE_VAL;
}

/* How wide voxels may be; 0: there is no coarse level then. */
static int find_px(trip_lod_parts *parts, const trip_dataset *data, const trip_camera *camera,
                   const trip_settings *settings, trip_budget *budget, double *px)
{
    trip_lod cubes;
    *px = settings->lod_px * settings->samples;
    if (!(settings->max_bytes > 0))
        return 0;
    int status = trip_lod_make(&cubes, data, TRIP_KIND_VALUES, camera, settings, budget);
    if (status)
        return status;
    parts->limit = cubes.limit;
    *px = fmax(*px, cubes.limit.px * (1 + 1e-6)); /* it was found from rounded widths */
    trip_lod_release(&cubes, budget);
    return 0;
}

static void add_part(trip_lod_parts *parts, unsigned level)
{
    parts->level[parts->count++] = level;
}

/* All has one level, but for what is mixed in of the next. */
static void choose_one(trip_lod_parts *parts, double width, double px, unsigned most, bool mixes)
{
    const unsigned level = px > 0 ? trip_lod_level(width, px, most) : 0;
    add_part(parts, level);
    if (!mixes || !(px > 0) || level >= most)
        return;
    const double share = 1 - log2(ldexp(width, (int)level + 1) / px) / MIXED_OCTAVES;
    if (!(share > 0))
        return;
    parts->share = fmin(share, 1);
    add_part(parts, level + 1);
}

/* What lies at least so deep, in the world. */
static trip_half_space half_space_from(const trip_camera *camera, double depth)
{
    trip_affine to_index; /* the map was checked on opening */
    trip_clip clip = { 0 };
    trip_clip_add(&clip, camera->forward, -trip_dot(camera->forward, camera->eye) - depth);
    trip_affine_invert(&camera->index_to_world, &to_index);
    return trip_clip_before(&clip, &to_index).planes[0];
}

static void divide(trip_lod_parts *parts, const trip_camera *camera, range depths, double px,
                   unsigned most)
{
    const double unit = trip_camera_ray_length(camera, camera->width / 2.0, camera->height / 2.0);
    const double width = trip_lod_width_px(camera, 1);
    const double nearest =
        parts->limit.px > 0 ? fmax(depths.nearest, TRIP_LOD_NEAREST_VOXELS) : depths.nearest;
    unsigned level = trip_lod_level(width_at(camera, nearest), px, most);
    add_part(parts, level);
    while (level < most && parts->count < TRIP_LOD_PARTS_MOST) {
        const double depth = ldexp(width, (int)++level) / px;
        if (!(depth < depths.farthest))
            return;
        parts->begin[parts->count] = half_space_from(camera, depth);
        parts->distance[parts->count] = depth * unit;
        add_part(parts, level);
    }
}

/* Levels with values, and with cells to interpolate them in. */
static unsigned count_levels(const trip_dataset *data)
{
    unsigned levels = trip_dataset_levels(data, TRIP_KIND_VALUES);
    for (int a = 0; a < 3; a++)
        while (levels > 0 && (data->header.dims[a] - 1) >> levels == 0)
            levels--;
    return levels;
}

int trip_lod_parts_make(trip_lod_parts *parts, const trip_dataset *data, const trip_camera *camera,
                        const trip_settings *settings, bool one, trip_budget *budget)
{
    const unsigned most = trip_settings_has_levels(settings) ? count_levels(data) : 0;
    const range depths = depths_of(data, camera);
    const bool thin = camera->ortho || (depths.nearest > 0 &&
                                        depths.farthest < depths.nearest * exp2(MIXED_OCTAVES));
    double px = 0;
    *parts = (trip_lod_parts){ 0 };
    int status = most > 0 ? find_px(parts, data, camera, settings, budget, &px) : 0;
    if (status)
        return status;
    if (one || thin || !(px > 0))
        choose_one(parts, width_at(camera, depths.nearest), px, most,
                   !one && !(parts->limit.px > 0));
    else
        divide(parts, camera, depths, px, most);
    return 0;
}

void trip_lod_parts_clip(const trip_lod_parts *parts, int part, trip_clip *clip)
{
    if (parts->share > 0)
        return;
    if (part > 0)
        trip_clip_add(clip, parts->begin[part].normal, parts->begin[part].offset);
    if (part + 1 < parts->count)
        trip_clip_add(clip, trip_scale(parts->begin[part + 1].normal, -1),
                      -parts->begin[part + 1].offset);
}

void trip_lod_parts_add(const trip_lod_parts *parts, const float *before, const float *picture,
                        bool done, size_t pixels, float *out)
{
    const double share = done ? parts->share : 0;
    const bool mixes = parts->share > 0;
    for (size_t i = 0; i < 4 * pixels; i += 4) {
        const double of_picture = mixes ? share : 1 - (double)before[i + 3];
        const double of_before = mixes ? 1 - share : 1;
        for (size_t c = 0; c < 4; c++)
            out[i + c] = (float)(of_before * before[i + c] + of_picture * picture[i + c]);
    }
}
