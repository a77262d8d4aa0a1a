#include "cpu_scenes.h"

#include <math.h>

unsigned cpu_scenes_threads = 3;

static int create_cpu(trip_renderer **out, trip_budget *budget)
{
    return trip_cpu_create(out, budget, cpu_scenes_threads);
}

const scene_renderer cpu_scenes_cpu = { "cpu", create_cpu, 1.0 / 255 };
const scene_renderer cpu_scenes_reference = { "reference", trip_reference_create, 0 };

static bool blob(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    double x = i - 19.5, y = j - 15.2, z = k - 17.1, r = sqrt(x * x + y * y + z * z);
    double value = 0.5 + 0.5 * sin(0.45 * i) * cos(0.38 * j + 0.2) * sin(0.41 * k);
    (void)user;
    gradient[0] = 0.05 * x / (r + 1);
    gradient[1] = 0.05 * y / (r + 1);
    gradient[2] = 0.05 * z / (r + 1);
    *code = (unsigned)(65535 * value);
    return value > 0.55 || (r > 12 && r < 13.5);
}

void cpu_scenes_blobs(scene *s, unsigned tile_voxels, const trip_affine *index_to_world)
{
    scene_params p = { .dims = { 40, 33, 36 },
                       .tile_voxels = tile_voxels,
                       .slab_sheets = 8,
                       .normals = true,
                       .voxel = blob };
    if (index_to_world)
        p.index_to_world = *index_to_world;
    scene_create(s, &p);
    scene_colour(s, 0, 36000, 0.2, 0.5, 1, 0.05);
    scene_colour(s, 36001, 50000, 0.9, 0.4, 0.1, 0.3);
    scene_colour(s, 50001, 60000, 1, 1, 0.6, 0.97);
    scene_colour(s, 60001, 65535, 0.5, 1, 0.3, 0.9999);
}

trip_affine cpu_scenes_sheared(void)
{
    return (trip_affine){ { { 0.8, 0.1, 0.05, 3 }, { -0.05, 1.1, 0.2, -7 }, { 0, 0.1, 1.9, 1 } } };
}
