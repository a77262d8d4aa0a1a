/* Tests the neighbours of points, and the radii and normals that follow from them. The expected
 * values are closed forms, or a search through all pairs. */
#include "test.h"

#include <unistd.h>

#include "geometry.h"
#include "point_tiles.h"
#include "surfel_shape.h"
#include "workers.h"

enum { K = 12, MIB = 1 << 20 };

static double random_of(uint64_t *state)
{
    *state = *state * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
    return (double)(*state >> 11) * 0x1p-53;
}

/* A normal deviate (Box and Muller). */
static double deviate(uint64_t *state)
{
    const double u = 1 - random_of(state), v = random_of(state);
    return sqrt(-2 * log(u)) * cos(2 * M_PI * v);
}

/* ---- searches ---- */

typedef struct cloud {
    double (*points)[3];
    size_t count;
    trip_budget *budget;
    trip_output spool;
    trip_octree octree;
    trip_point_tiles *tiles;
    trip_neighbours *found; /* of each row of the tiles */
    unsigned wanted;
} cloud;

static void make_tiles(cloud *c, uint64_t memory)
{
    assert_int_equal(trip_budget_create(&c->budget, memory), 0);
    assert_int_equal(trip_output_create(&c->spool,
                                        &(trip_output_params){ .folder = ".",
                                                               .name = "spool.XXXXXX",
                                                               .buffer_bytes = 1 << 16,
                                                               .unnamed = true },
                                        c->budget),
                     0);
    double lo[3] = { INFINITY, INFINITY, INFINITY }, hi[3] = { -INFINITY, -INFINITY, -INFINITY };
    trip_gaussian_sample sample = { .points = calloc(c->count, sizeof *sample.points) };
    for (size_t i = 0; i < c->count; i++) {
        trip_point_row row = { .head.number = i };
        memcpy(row.position, c->points[i], sizeof row.position);
        assert_int_equal(trip_output_append(&c->spool, &row, sizeof row), 0);
        if (trip_gaussian_is_sampled(i, c->count))
            memcpy(sample.points[sample.count++].centre, c->points[i], sizeof row.position);
        for (int a = 0; a < 3; a++) {
            lo[a] = fmin(lo[a], c->points[i][a]);
            hi[a] = fmax(hi[a], c->points[i][a]);
        }
    }
    assert_true(
        trip_octree_build(&c->octree, &sample, c->count, TRIP_OCTREE_LEAF_AIM, lo, hi, c->budget));
    assert_int_equal(trip_output_flush(&c->spool), 0);
    trip_workers *workers;
    assert_int_equal(trip_workers_create(&workers, 2), 0);
    const trip_point_tiles_params params = { .spool = &c->spool,
                                             .workers = workers,
                                             .records = c->count,
                                             .octree = &c->octree,
                                             .folder = ".",
                                             .name = "cloud" };
    assert_int_equal(trip_point_tiles_make(&c->tiles, &params, c->budget), 0);
    trip_workers_destroy(workers);
    free(sample.points);
}

static void release(cloud *c)
{
    trip_point_tiles_free(c->tiles);
    trip_octree_free(&c->octree);
    trip_output_close(&c->spool);
    assert_int_equal(trip_budget_left_bytes(c->budget), trip_budget_limit_bytes(c->budget));
    trip_budget_destroy(c->budget);
    free(c->points);
    free(c->found);
}

static int search_tile(void *user, unsigned thread, uint64_t tile)
{
    cloud *c = user;
    const trip_point_tile *at = trip_point_tiles_at(c->tiles, tile);
    trip_point_row *rows = calloc(at->count, sizeof *rows);
    int status = trip_point_tiles_read(c->tiles, tile, rows);
    for (uint32_t i = 0; i < at->count && status == 0; i++) {
        trip_neighbours *n = &c->found[at->first + i];
        n->wanted = c->wanted;
        memcpy(n->position, rows[i].position, sizeof n->position);
        status = trip_point_tiles_search(c->tiles, thread, tile, n);
    }
    free(rows);
    return status;
}

static void search_all(cloud *c, unsigned threads)
{
    trip_workers *workers;
    c->found = calloc(c->count, sizeof *c->found);
    assert_int_equal(trip_workers_create(&workers, threads), 0);
    assert_int_equal(trip_point_tiles_begin_searches(c->tiles, threads), 0);
    assert_int_equal(trip_workers_run(workers, search_tile, c, trip_point_tiles_count(c->tiles)),
                     0);
    trip_workers_destroy(workers);
}

/* Compares every `step`th search with all pairs. */
static void expect_all_pairs(const cloud *c, size_t step)
{
    trip_neighbours *n = calloc(1, sizeof *n);
    for (size_t i = 0; i < c->count; i += step) {
        const trip_neighbours *found = &c->found[i];
        n->wanted = c->wanted;
        n->count = 0;
        for (size_t k = 0; k < c->count; k++) {
            double d2 = 0;
            for (int a = 0; a < 3; a++)
                d2 +=
                    (found->position[a] - c->points[k][a]) * (found->position[a] - c->points[k][a]);
            trip_neighbours_add(n, d2, c->points[k]);
        }
        assert_int_equal(n->count, found->count);
        for (unsigned k = 0; k < n->count; k++)
            assert_memory_equal(&n->nearest[k], &found->nearest[k], sizeof n->nearest[k]);
    }
    free(n);
}

static void check_cloud(cloud *c, uint64_t memory, unsigned threads, size_t step)
{
    c->wanted = K;
    make_tiles(c, memory);
    search_all(c, threads);
    expect_all_pairs(c, step);
    release(c);
}

/* A surface with dense and sparse parts, duplicates and strays. */
static cloud uneven_cloud(void)
{
    cloud c = { .count = 30000 };
    uint64_t state = 5;
    c.points = calloc(c.count, sizeof *c.points);
    for (size_t i = 0; i < c.count; i++) {
        const double x = random_of(&state), y = random_of(&state);
        c.points[i][0] = 636000 + 100 * x * x * x;
        c.points[i][1] = 850000 + 50 * y;
        c.points[i][2] = sin(9 * x) + cos(7 * y);
        if (i % 1000 == 999)
            for (int a = 0; a < 3; a++)
                c.points[i][a] = 1e7 * (random_of(&state) - 0.5);
        if (i % 10 == 9)
            memcpy(c.points[i], c.points[i - 5], sizeof c.points[i]);
    }
    return c;
}

static void neighbours_are_those_of_all_pairs(void **state)
{
    (void)state;
    cloud c = uneven_cloud();
    check_cloud(&c, 64 * MIB, 1, 37);
    c = uneven_cloud();
    check_cloud(&c, 14 * MIB, 3, 101);
}

/* In a grid, many neighbours have the same distance. */
static void equal_distances_have_one_order(void **state)
{
    (void)state;
    cloud c = { .count = 24 * 24 * 24 };
    c.points = calloc(c.count, sizeof *c.points);
    for (size_t i = 0; i < c.count; i++) {
        c.points[i][0] = (double)(i % 24);
        c.points[i][1] = (double)(i / 24 % 24);
        c.points[i][2] = (double)(i / 576);
    }
    check_cloud(&c, 32 * MIB, 2, 41);
}

static void few_points_have_few_neighbours(void **state)
{
    (void)state;
    for (size_t count = 1; count < 6; count++) {
        cloud c = { .count = count };
        c.points = calloc(count, sizeof *c.points);
        for (size_t i = 0; i < count; i++)
            c.points[i][0] = (double)(i / 2);
        check_cloud(&c, 32 * MIB, 1, 1);
    }
}

static void many_equal_points_end_soon(void **state)
{
    (void)state;
    cloud c = { .count = 20000 };
    c.points = calloc(c.count, sizeof *c.points);
    c.points[77][1] = 3;
    check_cloud(&c, 32 * MIB, 2, 9000);
}

/* ---- shapes ---- */

static trip_neighbours neighbours_of(const double (*points)[3], size_t count, size_t of)
{
    trip_neighbours n = { .wanted = K };
    memcpy(n.position, points[of], sizeof n.position);
    for (size_t k = 0; k < count; k++) {
        double d2 = 0;
        for (int a = 0; a < 3; a++)
            d2 += (n.position[a] - points[k][a]) * (n.position[a] - points[k][a]);
        trip_neighbours_add(&n, d2, points[k]);
    }
    return n;
}

static double angle_between(const double a[3], const double b[3])
{
    const trip_vec3 u = trip_v3(a[0], a[1], a[2]), v = trip_v3(b[0], b[1], b[2]);
    return atan2(trip_length(trip_cross(u, v)), trip_dot(u, v)) * 180 / M_PI;
}

static void a_square_grid_has_its_radius_and_normal(void **state)
{
    (void)state;
    double points[81][3];
    for (int i = 0; i < 81; i++) {
        points[i][0] = 5 * (i % 9);
        points[i][1] = 5 * (i / 9);
        points[i][2] = 7;
    }
    const trip_neighbours n = neighbours_of((const double(*)[3])points, 81, 40);
    const double up[3] = { 0.3, 0, 1 }, down[3] = { 0, 0, -1 };
    /* The twelfth neighbour is two steps of 5 away. */
    const trip_surfel_shape s = trip_surfel_shape_of(&n, up), t = trip_surfel_shape_of(&n, down);
    assert_close(s.radius, 10 * sqrt(M_PI / 24), 1e-12);
    assert_close(s.normal[2], 1, 1e-12);
    assert_close(t.normal[2], -1, 1e-12);
}

enum { POINTS = 12000 };

/* Fills a square of area POINTS with one random point per unit of area. */
static void fill_plane(double (*points)[3], double noise)
{
    uint64_t state = 11;
    for (int i = 0; i < POINTS; i++) {
        points[i][0] = sqrt(POINTS) * random_of(&state);
        points[i][1] = sqrt(POINTS) * random_of(&state);
        points[i][2] = noise * deviate(&state);
    }
}

static int is_inner(const double p[3])
{
    return p[0] > 5 && p[1] > 5 && p[0] < sqrt(POINTS) - 5 && p[1] < sqrt(POINTS) - 5;
}

/* The mean of the squared distance of the k-th neighbour is k / pi, for one point in a unit of
 * area. The bound by
 * the spread takes a bit of 1 / 2, the mean squared radius. */
static void random_points_have_the_radius_of_their_density(void **state)
{
    (void)state;
    double(*points)[3] = calloc(POINTS, sizeof *points), sum = 0;
    const double up[3] = { 0, 0, 1 };
    int count = 0;
    fill_plane(points, 0);
    for (size_t i = 0; i < POINTS; i += 7) {
        const trip_neighbours n = neighbours_of((const double(*)[3])points, POINTS, i);
        const trip_surfel_shape s = trip_surfel_shape_of(&n, up);
        assert_true(s.normal[2] > 1 - 1e-9);
        if (is_inner(points[i])) {
            sum += s.radius * s.radius;
            count++;
        }
    }
    assert_close(sum / count, 0.5, 0.02);
    free(points);
}

/* A plane is fitted to 13 points with noise e of the heights, which vary by v along each axis. Its
 * slope along an axis has the deviation e / sqrt(13 v). In a disc of radius R, v is R^2 / 4. The
 * mean of 1 / R^2 is pi / 11. The angle follows Rayleigh's distribution, with the mean
 * sqrt(pi / 2) deviations. */
static void noise_turns_normals_as_a_fit_of_planes_does(void **state)
{
    (void)state;
    double(*points)[3] = calloc(POINTS, sizeof *points), sum = 0;
    const double up[3] = { 0, 0, 1 }, noise = 0.1;
    int count = 0;
    fill_plane(points, noise);
    for (size_t i = 0; i < POINTS; i += 7) {
        const trip_neighbours n = neighbours_of((const double(*)[3])points, POINTS, i);
        const trip_surfel_shape s = trip_surfel_shape_of(&n, up);
        if (is_inner(points[i])) {
            sum += angle_between(s.normal, up);
            count++;
        }
    }
    const double slope = noise / sqrt(13 * 11 / (4 * M_PI));
    assert_close(sum / count, slope * sqrt(M_PI / 2) * 180 / M_PI, 0.3);
    free(points);
}

/* Points of a sphere of radius 1 have the direction of their position. `noise` moves them. */
static double mean_angle_on_sphere(double noise)
{
    double(*points)[3] = calloc(POINTS, sizeof *points), sum = 0;
    uint64_t state = 3;
    int count = 0;
    for (int i = 0; i < POINTS; i++) {
        const double z = 2 * random_of(&state) - 1, turn = 2 * M_PI * random_of(&state);
        const double r = 1 + noise * deviate(&state), w = sqrt(1 - z * z);
        points[i][0] = 100 + r * w * cos(turn);
        points[i][1] = r * w * sin(turn);
        points[i][2] = r * z;
    }
    for (size_t i = 0; i < POINTS; i += 11) {
        const trip_neighbours n = neighbours_of((const double(*)[3])points, POINTS, i);
        const double outwards[3] = { points[i][0] - 100, points[i][1], points[i][2] };
        sum += angle_between(trip_surfel_shape_of(&n, outwards).normal, outwards);
        count++;
    }
    free(points);
    return sum / count;
}

static void a_sphere_has_its_normals(void **state)
{
    (void)state;
    /* Points have a mean distance of sqrt(4 pi / 12000) = 0.032, so 13 of them span 3.6 degrees. */
    assert_true(mean_angle_on_sphere(0) < 0.6);
    /* Noise of a tenth of the distance: 2.1 degrees in a plane. */
    assert_true(mean_angle_on_sphere(0.0032) < 2.8);
}

static void expect_sane(const trip_surfel_shape *s)
{
    double length2 = 0;
    for (int a = 0; a < 3; a++)
        length2 += s->normal[a] * s->normal[a];
    assert_close(length2, 1, 1e-9);
    assert_true(s->radius > 0);
}

static void lines_and_lone_points_have_sane_shapes(void **state)
{
    (void)state;
    double points[20][3] = { { 0 } };
    const double towards[3] = { 3, 4, 0 }, none[3] = { 0 }, along[3] = { 1, 0, 0 };
    trip_neighbours n = neighbours_of((const double(*)[3])points, 20, 0);
    trip_surfel_shape s = trip_surfel_shape_of(&n, towards);
    expect_sane(&s); /* all equal: no neighbour */
    assert_true(isinf(s.radius));
    assert_close(s.normal[0], 0.6, 1e-12);
    s = trip_surfel_shape_of(&n, none);
    expect_sane(&s);
    for (double step = 1e-7; step < 1e15; step *= 1e7) {
        for (int i = 0; i < 20; i++)
            points[i][0] = step * i;
        n = neighbours_of((const double(*)[3])points, 20, 10);
        s = trip_surfel_shape_of(&n, towards);
        expect_sane(&s);
        assert_close(s.normal[1], 1, 1e-9); /* across the line, towards the scanner */
        s = trip_surfel_shape_of(&n, along);
        expect_sane(&s);
        assert_close(s.normal[0], 0, 1e-9);
    }
    n = neighbours_of((const double(*)[3])points, 2, 0);
    s = trip_surfel_shape_of(&n, towards);
    expect_sane(&s);
}

/* A point far from a cloud has the radius of the points that it is nearest to, not its distance. */
static void a_stray_gets_no_large_radius(void **state)
{
    (void)state;
    double(*points)[3] = calloc(401, sizeof *points);
    for (int i = 0; i < 400; i++) {
        points[i][0] = i % 20;
        points[i][1] = i / 20;
    }
    points[400][2] = 1e7;
    const double up[3] = { 0, 0, 1 };
    const trip_neighbours n = neighbours_of((const double(*)[3])points, 401, 400);
    const trip_surfel_shape s = trip_surfel_shape_of(&n, up);
    expect_sane(&s);
    assert_true(s.radius < 5);
    free(points);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(neighbours_are_those_of_all_pairs),
        cmocka_unit_test(equal_distances_have_one_order),
        cmocka_unit_test(few_points_have_few_neighbours),
        cmocka_unit_test(many_equal_points_end_soon),
        cmocka_unit_test(a_square_grid_has_its_radius_and_normal),
        cmocka_unit_test(random_points_have_the_radius_of_their_density),
        cmocka_unit_test(noise_turns_normals_as_a_fit_of_planes_does),
        cmocka_unit_test(a_sphere_has_its_normals),
        cmocka_unit_test(lines_and_lone_points_have_sane_shapes),
        cmocka_unit_test(a_stray_gets_no_large_radius),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
