#include "level_scenes.h"

#include <string.h>

#include "dataset_level.h"
#include "test.h"

enum { SIDE = 48 };

static bool nothing(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    (void)user, (void)i, (void)j, (void)k, (void)code, (void)gradient;
    return false;
}

void level_scene_create(level_scene *l, const level_contents *c)
{
    const scene_part part = { .level = 1,
                              .kind = TRIP_KIND_VALUES,
                              .by = { 2, 2, 2 },
                              .voxel = c->voxel,
                              .deviation = c->deviation,
                              .user = c->user };
    scene_params p = { .dims = { 2 * c->dims[0], 2 * c->dims[1], 2 * c->dims[2] },
                       .tile_voxels = c->tile ? c->tile : 64,
                       .slab_sheets = 8,
                       .codes = c->codes,
                       .voxel = nothing,
                       .parts = &part,
                       .part_count = 1 };
    if (c->index_to_world)
        p.index_to_world = *c->index_to_world;
    scene_create(&l->of, &p);
    l->at = l->of;
    l->at.level = 1;
    assert_int_equal(trip_dataset_level_open(&l->at.data, l->of.data, 1), 0);
}

void level_scene_destroy(level_scene *l)
{
    trip_dataset_level_close(l->at.data);
    scene_destroy(&l->of);
}

void level_scene_use_colours(level_scene *l)
{
    memcpy(l->at.table, l->of.table, 65536 * sizeof *l->of.table);
}

trip_settings level_scene_settings(void)
{
    trip_settings s = scene_post(2);
    s.lod_px = 1;
    return s;
}

static double wave(int i, int j, int k)
{
    return 0.5 + 0.25 * sin(0.31 * i + 0.2) + 0.25 * sin(0.27 * j) * cos(0.35 * k);
}

static bool wave_voxel(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    (void)user;
    (void)gradient;
    *code = (unsigned)(65535 * wave(i, j, k));
    return wave(i, j, k) > 0.2 && scene_hash(i, j, k) % 300 != 0;
}

static unsigned wave_deviation(void *user, int i, int j, int k)
{
    (void)user;
    const double at = sin(0.2 * i) * sin(0.23 * j + 1) * sin(0.17 * k + 2);
    return at > 0 ? (unsigned)(160 * at) : scene_hash(i, j, k) % 97 == 0 ? 200 : 0;
}

const level_contents level_waves = { wave_voxel, wave_deviation,
                                     .dims = { SIDE, SIDE - 8, SIDE - 6 } };

void level_scene_waves(level_scene *l, const level_contents *waves)
{
    level_scene_create(l, waves);
    scene_colour(&l->of, 33000, 36000, 0.2, 0.5, 1, 0.1);
    scene_colour(&l->of, 45001, 47000, 0.9, 0.4, 0.1, 0.15);
    scene_colour(&l->of, 57000, 65535, 1, 1, 0.6, 0.25);
    level_scene_use_colours(l);
}

static bool block_voxel(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    (void)user, (void)gradient;
    *code = (i / 3 + j / 4 + k / 5) % 2 ? 65535 : 0;
    return true;
}

void level_scene_blocks(level_scene *l)
{
    level_contents blocks = level_waves;
    blocks.voxel = block_voxel;
    level_scene_create(l, &blocks);
    scene_colour(&l->of, 0, 1500, 1, 0.3, 0.2, 0.05);
    scene_colour(&l->of, 62000, 65534, 0.2, 0.5, 1, 0.3);
    scene_colour(&l->of, 65535, 65535, 1, 1, 0.2, 0.9);
    level_scene_use_colours(l);
}

trip_camera_params level_scene_view(const level_scene *l, int number, int pixels)
{
    const trip_vec3 from[] = { { 1, 0.8, 0.6 }, { -0.2, 1, 0.1 }, { 0.5, -0.4, -1 } };
    trip_camera_params view =
        scene_view(&l->at, from[number % 3], number == 1 ? 20 : 190, number == 1 ? 80 : 40, pixels);
    if (number == 2)
        view.ortho_height = 90;
    return view;
}
