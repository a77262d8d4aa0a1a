#include "scenes.h"
#include "test.h"

#include "ray_probe.h"

enum { NX = 70, NY = 45, NZ = 37 };

static bool wall(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    (void)user, (void)j, (void)k, (void)gradient;
    *code = i >= 10 && i < 20 ? 50000 : 20000;
    return true;
}

static bool ramp(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    (void)user, (void)gradient;
    *code = 1000 + 100u * (unsigned)i + 200u * (unsigned)j + 300u * (unsigned)k;
    return true;
}

static bool lone(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    (void)user, (void)gradient;
    *code = 60000;
    return i == 33 && j == 20 && k == 5;
}

static void make(scene *s, scene_voxel voxel, unsigned tile_voxels, unsigned slab_sheets)
{
    scene_create(s, &(scene_params){ .dims = { NX, NY, NZ },
                                     .tile_voxels = tile_voxels,
                                     .slab_sheets = slab_sheets,
                                     .voxel = voxel });
}

static trip_ray_hit find_by(bool nearest, const scene *s, trip_vec3 origin, trip_vec3 direction,
                            double world_per_z)
{
    trip_ray_probe p = { .nearest = nearest,
                         .data = s->data,
                         .budget = s->budget,
                         .table = s->table,
                         .origin = origin,
                         .direction = direction,
                         .world_per_z = world_per_z };
    trip_ray_hit hit;
    assert_int_equal(trip_reader_create(&p.reader, s->data, &(trip_reader_params){ 0 }, s->budget),
                     0);
    assert_int_equal(trip_ray_probe_find(&p, &hit), 0);
    trip_reader_destroy(p.reader);
    return hit;
}

static trip_ray_hit find(const scene *s, trip_vec3 origin, trip_vec3 direction, double world_per_z)
{
    return find_by(false, s, origin, direction, world_per_z);
}

/* A wall of constant extinction: light is lost exponentially from its face on. */
static void a_wall_is_hit_where_half_of_its_opacity_is_reached(void **state)
{
    (void)state;
    scene s;
    make(&s, wall, 16, 4);
    scene_colour(&s, 50000, 50000, 1, 1, 1, 0.1);
    double tau = (double)s.table[50000].extinction, opacity = 1 - exp(-tau * 0.5 * 10);
    double half = -log(1 - opacity / 2) / (tau * 0.5);
    trip_ray_hit hit = find(&s, trip_v3(-5, 12.3, 7.6), trip_v3(1, 0, 0), 0.5);
    assert_close(hit.opacity, opacity, 1e-12);
    assert_close(hit.first_z, 14.5, 1e-12);
    assert_close(hit.z, 14.5 + half, 1e-12);
    assert_close(hit.code, 50000, 0);
    /* From the other side, with a direction twice as long. */
    hit = find(&s, trip_v3(50, 12.3, 7.6), trip_v3(-2, 0, 0), 1);
    assert_close(hit.first_z, 30.5 / 2, 1e-12);
    assert_close(hit.z, 30.5 / 2 + half / 2, 1e-12);
    /* From inside. */
    hit = find(&s, trip_v3(15, 3, 3), trip_v3(1, 0, 0), 0.5);
    assert_close(hit.opacity, 1 - exp(-tau * 0.5 * 4.5), 1e-12);
    assert_close(hit.first_z, 0, 1e-12);
    scene_destroy(&s);
}

/* A ramp is interpolated exactly. The part that belongs to a sheet reaches half a sheet to both
 * sides. */
static void values_are_interpolated_for_any_tile_size(void **state)
{
    (void)state;
    const unsigned tiles[][2] = { { 16, 4 }, { 64, 8 }, { 32, 1 }, { 128, 64 } };
    trip_ray_hit hits[2][30];
    for (int t = 0; t < 4; t++) {
        scene s;
        make(&s, ramp, tiles[t][0], tiles[t][1]);
        scene_colour(&s, 0, 65535, 1, 1, 1, 0.2);
        for (int n = 0; n < 30; n++) {
            double angle = n * 0.7;
            trip_vec3 inside = trip_v3(20 + n, 10 + n % 20, 8 + n % 13);
            trip_vec3 d = trip_v3(cos(angle), sin(angle) * cos(n), sin(angle) * sin(n));
            trip_vec3 eye = trip_sub(inside, trip_scale(d, 3 + n % 5));
            trip_ray_hit hit = find(&s, eye, d, 1);
            trip_vec3 p = trip_add(eye, trip_scale(d, hit.z));
            double max = fmax(fabs(d.x), fmax(fabs(d.y), fabs(d.z)));
            double slope = fabs(100 * d.x + 200 * d.y + 300 * d.z) / max;
            double value = 1000 + 100 * p.x + 200 * p.y + 300 * p.z;
            assert_true(fabs(hit.code - value) <= slope / 2 + 1e-6);
            assert_true(hit.opacity > 0.5);
            hits[t > 0][n] = hit;
        }
        assert_memory_equal(hits[t > 0], hits[0], sizeof hits[0]);
        scene_destroy(&s);
    }
}

static void a_lone_voxel_reaches_half_way_to_its_neighbours(void **state)
{
    (void)state;
    scene s;
    make(&s, lone, 16, 4);
    scene_colour(&s, 60000, 60000, 1, 1, 1, 0.5);
    static const double aside[] = { -0.6, -0.4, 0, 0.4, 0.6 };
    for (int i = 0; i < 5; i++)
        for (int j = 0; j < 5; j++) {
            trip_ray_hit hit =
                find(&s, trip_v3(33 + aside[i], 20 + aside[j], -7), trip_v3(0, 0, 1), 1);
            bool meets = i % 4 && j % 4;
            assert_close(hit.opacity, meets ? 0.5 : 0, 1e-7);
            if (meets)
                assert_close(hit.first_z, 11.5, 1e-12);
        }
    scene_destroy(&s);
}

/* Voxel distances grow linearly along x, halve along y and are constant along z. */
static void voxels_lie_at_the_coordinates_of_the_tables(void **state)
{
    (void)state;
    double x[NX], y[NY], z[NZ];
    for (int i = 0; i < NX; i++)
        x[i] = (double)i * i / (NX - 1);
    for (int j = 0; j < NY; j++)
        y[j] = (NY - 1) * (1 - exp2(-j / 20.0)) / (1 - exp2(-(NY - 1) / 20.0));
    for (int k = 0; k < NZ; k++)
        z[k] = k;
    y[NY - 1] = NY - 1;
    const trip_coordinates uneven =
        trip_coordinates_make((const double *const[]){ x, y, z }, (const int64_t[]){ NX, NY, NZ });
    scene s;
    scene_create(&s, &(scene_params){ .dims = { NX, NY, NZ },
                                      .tile_voxels = 16,
                                      .slab_sheets = 4,
                                      .voxel = wall,
                                      .coordinates = &uneven });
    scene_colour(&s, 50000, 50000, 1, 1, 1, 0.1);
    /* From midway between voxels 9 and 10 to midway between 19 and 20. */
    const double from = (9.0 * 9 + 10 * 10) / 2 / (NX - 1),
                 to = (19.0 * 19 + 20 * 20) / 2 / (NX - 1);
    const double tau = (double)s.table[50000].extinction,
                 opacity = 1 - exp(-tau * 0.5 * (to - from));
    trip_ray_hit hit = find(&s, trip_v3(-5, 12.3, 7.6), trip_v3(1, 0, 0), 0.5);
    assert_close(hit.opacity, opacity, 1e-12);
    assert_close(hit.first_z, 5 + from, 1e-12);
    assert_close(hit.z, 5 + from - log(1 - opacity / 2) / (tau * 0.5), 1e-12);
    /* Obliquely, with sheets along y. */
    hit = find(&s, trip_v3(-1, -4, 7.6), trip_v3(0.5, 1, 0.1), 1);
    assert_true(hit.opacity > 0);
    assert_close(-1 + 0.5 * hit.first_z, from, 0.5 * (y[1] - y[0]));
    assert_close(hit.code, 50000, 0);
    scene_destroy(&s);
}

/* The box of voxel 20 begins at 19.5 and includes that point. */
static void the_nearest_voxel_gives_the_value_in_its_box(void **state)
{
    (void)state;
    const double next_below = nextafter(19.5, 0);
    scene s;
    make(&s, wall, 16, 4);
    scene_colour(&s, 0, 65535, 1, 1, 1, 0.1);
    for (int below = 0; below < 2; below++) {
        const trip_vec3 eye = trip_v3(below ? next_below : 19.5, 12.3, -5);
        const double expected = below ? 50000 : 20000;
        assert_close(find_by(true, &s, eye, trip_v3(0, 0, 1), 1).code, expected, 0);
        assert_close(find(&s, eye, trip_v3(0, 0, 1), 1).code, 35000, 1);
    }
    /* The wall's boxes span x from 9.5 to 19.5, where this ray has z 3.125 and 128.125. */
    scene_colour(&s, 0, 65535, 0, 0, 0, 0);
    scene_colour(&s, 50000, 50000, 1, 1, 1, 0.1);
    const trip_ray_hit hit = find_by(true, &s, trip_v3(9.25, 12.3, -1), trip_v3(0.08, 0, 1), 1);
    assert_close(hit.first_z, 3.125, 1e-12);
    /* Obliquely in two directions, from the far end: x is 19.5 at 2.875, within a sheet of z. */
    const trip_ray_hit back = find_by(true, &s, trip_v3(21.8, 30, NZ), trip_v3(-0.8, -0.3, -1), 1);
    assert_close(back.first_z, 2.875, 1e-12);
    assert_close(back.code, 50000, 0);
    scene_destroy(&s);
}

/* Neighbours have codes far apart. */
static bool mixed(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    (void)user, (void)gradient;
    *code = ((unsigned)i * 7919 + (unsigned)j * 104729 + (unsigned)k * 1299709) % 60000 + 1;
    return true;
}

static void the_nearest_value_belongs_to_the_voxel_at_the_hit(void **state)
{
    (void)state;
    scene s;
    make(&s, mixed, 32, 4);
    scene_colour(&s, 0, 65535, 1, 1, 1, 0.2);
    for (int n = 0; n < 60; n++) {
        const double angle = n * 0.7;
        const trip_vec3 d = trip_v3(cos(angle), sin(angle) * cos(n), sin(angle) * sin(n));
        const trip_vec3 inside = trip_v3(20.3 + 0.37 * n, 10.1 + n % 20, 8.2 + n % 13);
        const trip_vec3 eye = trip_sub(inside, trip_scale(d, 3 + n % 5));
        const trip_ray_hit hit = find_by(true, &s, eye, d, 1);
        const trip_vec3 p = trip_add(eye, trip_scale(d, hit.z));
        unsigned code = 0;
        mixed(NULL, (int)floor(p.x + 0.5), (int)floor(p.y + 0.5), (int)floor(p.z + 0.5), &code,
              NULL);
        assert_close(hit.code, code, 0);
    }
    scene_destroy(&s);
}

static void rays_hit_nothing_behind_the_eye_or_beside_the_grid(void **state)
{
    (void)state;
    scene s;
    make(&s, wall, 16, 4);
    scene_colour(&s, 50000, 50000, 1, 1, 1, 0.1);
    assert_true(find(&s, trip_v3(25, 12, 7), trip_v3(1, 0, 0), 1).opacity == 0);
    assert_true(find(&s, trip_v3(-5, NY, 7), trip_v3(1, 0, 0), 1).opacity == 0);
    assert_true(find(&s, trip_v3(-5, 3, -1), trip_v3(1, 0, 0), 1).opacity == 0);
    assert_true(find(&s, trip_v3(-5, 100, 7), trip_v3(1, 1, 0), 1).opacity == 0);
    assert_true(find(&s, trip_v3(-5, 3, 7), trip_v3(1, 0, 0), 1).opacity > 0);
    scene_destroy(&s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_wall_is_hit_where_half_of_its_opacity_is_reached),
        cmocka_unit_test(values_are_interpolated_for_any_tile_size),
        cmocka_unit_test(a_lone_voxel_reaches_half_way_to_its_neighbours),
        cmocka_unit_test(voxels_lie_at_the_coordinates_of_the_tables),
        cmocka_unit_test(the_nearest_voxel_gives_the_value_in_its_box),
        cmocka_unit_test(the_nearest_value_belongs_to_the_voxel_at_the_hit),
        cmocka_unit_test(rays_hit_nothing_behind_the_eye_or_beside_the_grid),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
