#include "lod_parts.h"

#include <math.h>

#include "dataset_level.h"

/* Octaves of distance over which one level for the whole volume blends into the next. */
#define MIXED_OCTAVES 0.25

/* The depth range of the whole grid. */
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

static void add_part(trip_lod_parts *parts, unsigned level)
{
    parts->level[parts->count++] = level;
}

/* Inputs of the choice. */
typedef struct choosing {
    const trip_dataset *data;
    const trip_camera *camera;
    const trip_settings *settings;
    double px;    /* maximum voxel width, px; 0 means level 0 everywhere */
    unsigned max; /* the coarsest level that may be used */
} choosing;

static double values_bytes(const choosing *c, unsigned level)
{
    return trip_lod_values_bytes(c->data, c->camera, c->settings, level);
}

/* Returns the share of the next coarser level's picture, from the width of level 0 voxels. The
 * share is 0 if the bound on bytes has room for only one picture. */
static double share_of_next(const choosing *c, double width, unsigned level)
{
    const double room = c->settings->max_bytes;
    if (!(c->px > 0) || level >= c->max)
        return 0;
    const double share = 1 - log2(ldexp(width, (int)level + 1) / c->px) / MIXED_OCTAVES;
    if (!(share > 0) || (room > 0 && values_bytes(c, level) + values_bytes(c, level + 1) > room))
        return 0;
    return fmin(share, 1);
}

/* Uses one level for the whole volume, plus a share of the next. `width` is the maximum width of
 * level 0 voxels. */
static void choose_one(trip_lod_parts *parts, const choosing *c, double width, bool mixes)
{
    const double room = c->settings->max_bytes;
    const unsigned wanted = c->px > 0 ? trip_lod_level(width, c->px, c->max) : 0;
    unsigned level = wanted;
    while (room > 0 && level < c->max && values_bytes(c, level) > room)
        level++;
    add_part(parts, level);
    parts->bounded = level > wanted;
    if (room > 0 && c->max > 0)
        parts->bytes = values_bytes(c, level);
    parts->share = mixes && !parts->bounded ? share_of_next(c, width, level) : 0;
    if (parts->share > 0)
        add_part(parts, level + 1);
}

/* Returns the half-space of points at least at a depth, in world space. */
static trip_half_space half_space_from(const trip_camera *camera, double depth)
{
    trip_affine to_index; /* the map is invertible: checked when opened */
    trip_clip clip = { 0 };
    trip_clip_add(&clip, camera->forward, -trip_dot(camera->forward, camera->eye) - depth);
    trip_affine_invert(&camera->index_to_world, &to_index);
    return trip_clip_before(&clip, &to_index).planes[0];
}

/* Raises the maximum voxel width until the bound on bytes holds. */
static int bound(trip_lod_parts *parts, choosing *c, trip_budget *budget)
{
    trip_lod cubes;
    if (!(c->settings->max_bytes > 0))
        return 0;
    int status = trip_lod_make(&cubes, c->data, TRIP_KIND_VALUES, c->camera, c->settings, budget);
    if (status)
        return status;
    parts->bounded = cubes.limit.px > 0;
    parts->bytes = cubes.limit.bytes;
    c->px = fmax(c->px, cubes.limit.px);
    trip_lod_release(&cubes, budget);
    return 0;
}

static void divide(trip_lod_parts *parts, const choosing *c, range depths)
{
    const trip_camera *camera = c->camera;
    const double unit = trip_camera_ray_length(camera, camera->width / 2.0, camera->height / 2.0);
    const double width = trip_lod_width_px(camera, 1);
    const double nearest =
        parts->bounded ? fmax(depths.nearest, TRIP_LOD_NEAREST_VOXELS) : depths.nearest;
    unsigned level = trip_lod_level(width_at(camera, nearest), c->px, c->max);
    add_part(parts, level);
    while (level < c->max) {
        const double depth = ldexp(width, (int)++level) / c->px;
        if (!(depth < depths.farthest))
            return;
        parts->begin[parts->count] = half_space_from(camera, depth);
        parts->distance[parts->count] = depth * unit;
        add_part(parts, level);
    }
}

/* Returns the number of levels with values and cells to interpolate in. */
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
    choosing c = { data, camera, settings, settings->lod_px * settings->samples, 0 };
    const range depths = depths_of(data, camera);
    const bool thin = camera->ortho || (depths.nearest > 0 &&
                                        depths.farthest < depths.nearest * exp2(MIXED_OCTAVES));
    *parts = (trip_lod_parts){ 0 };
    if (trip_settings_has_levels(settings))
        c.max = count_levels(data);
    if (one || thin || c.max == 0) {
        choose_one(parts, &c, width_at(camera, depths.nearest), !one);
        return 0;
    }
    int status = bound(parts, &c, budget);
    if (!status)
        divide(parts, &c, depths);
    return status;
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
    const float share = done ? (float)parts->share : 0;
    const bool mixes = parts->share > 0;
    const float of_before = mixes ? 1 - share : 1;
    for (size_t i = 0; i < 4 * pixels; i += 4) {
        const float of_picture = mixes ? share : 1 - before[i + 3];
        for (size_t c = 0; c < 4; c++)
            out[i + c] = of_before * before[i + c] + of_picture * picture[i + c];
    }
}
