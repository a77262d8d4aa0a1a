#include "cpu_scenes.h"

#include <math.h>

#include "test.h"

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

int cpu_scenes_draw_within(const scene *s, uint64_t bytes, const trip_settings *settings,
                           const trip_camera_params *view, float *rgba)
{
    trip_budget *budget;
    trip_renderer *renderer = NULL;
    trip_reader *reader = NULL;
    trip_plan plan = { 0 };
    trip_camera camera;
    assert_int_equal(trip_camera_make(&camera, view, &s->data->index_to_world), 0);
    assert_int_equal(trip_budget_create(&budget, bytes), 0);
    trip_frame frame = {
        .data = s->data, .camera = &camera, .settings = settings, .plan = &plan, .table = s->table
    };
    trip_frame_stats stats;
    int status = trip_plan_make(&plan, s->data, &camera, settings, s->table, budget);
    if (!status)
        status = trip_cpu_create(&renderer, budget, 2);
    if (!status)
        status = trip_reader_create(
            &reader, s->data,
            &(trip_reader_params){ .planes = plan.planes, .slots = 2, .slot_bytes = 65536 },
            budget);
    if (!status)
        status = trip_frame_draw(renderer, reader, &frame, rgba, NULL, &stats);
    trip_reader_destroy(reader);
    if (renderer)
        renderer->ops->destroy(renderer);
    trip_plan_release(&plan, budget);
    trip_budget_destroy(budget);
    return status;
}
