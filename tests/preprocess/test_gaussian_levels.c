/* Tests the coarse levels of Gaussian scenes: moments against closed forms, and the nodes of a
 * bricked scene. */
#include "test.h"

#include "brick_gaussians.h"
#include "gaussian_code.h"
#include "gaussian_area.h"
#include "gaussian_moments.h"
#include "gaussian_set.h"
#include "gaussian_stream.h"

#define NAME "gaussian_levels.trip"
#define ALPHA_MIN (1.0 / 255)

enum { MIB = 1 << 20 };

/* ---- moments ---- */

static trip_gaussian ball(double x, double y, double z, double deviation, double opacity)
{
    const float s = (float)deviation;
    return (trip_gaussian){ .centre = { x, y, z },
                            .deviations = { s, s, s },
                            .rotation = { 1, 0, 0, 0 },
                            .opacity = (float)opacity };
}

static trip_gaussian merge(const trip_gaussian *g, size_t count, int degree)
{
    trip_gaussian_moments all = { .count = 0 }, one;
    for (size_t i = 0; i < count; i++) {
        trip_gaussian_moments_of(&g[i], degree, &one);
        trip_gaussian_moments_add(&all, &one, degree);
    }
    return trip_gaussian_moments_merge(&all, degree);
}

/* Computes the covariance from the rotation of the three unit vectors. */
static void covariance_of(const trip_gaussian *g, double out[3][3])
{
    const double w = (double)g->rotation[0];
    const double v[3] = { (double)g->rotation[1], (double)g->rotation[2], (double)g->rotation[3] };
    memset(out, 0, 9 * sizeof(double));
    for (int k = 0; k < 3; k++) {
        double e[3] = { k == 0, k == 1, k == 2 };
        const double t[3] = { v[1] * e[2] - v[2] * e[1], v[2] * e[0] - v[0] * e[2],
                              v[0] * e[1] - v[1] * e[0] };
        const double u[3] = { v[1] * t[2] - v[2] * t[1], v[2] * t[0] - v[0] * t[2],
                              v[0] * t[1] - v[1] * t[0] };
        for (int i = 0; i < 3; i++)
            e[i] += 2 * (w * t[i] + u[i]);
        for (int i = 0; i < 3; i++)
            for (int j = 0; j < 3; j++)
                out[i][j] += e[i] * e[j] * (double)g->deviations[k] * (double)g->deviations[k];
    }
}

/* Returns the area that a ball covers, by its formula. */
static double covered(const trip_gaussian *g)
{
    const double s[3] = { (double)g->deviations[0], (double)g->deviations[1],
                          (double)g->deviations[2] };
    return 2 * M_PI * trip_gaussian_mean_area(s) * ((double)g->opacity - ALPHA_MIN);
}

static void two_equal_gaussians_merge_into_their_moments(void **state)
{
    (void)state;
    trip_gaussian g[2] = { ball(7, 2, 1, 0.5, 0.02), ball(13, 2, 1, 0.5, 0.02) };
    double c[3][3];
    g[0].sh[0][1] = 1;
    g[0].sh[3][2] = 2;
    g[1].sh[0][1] = 2;
    const trip_gaussian m = merge(g, 2, 1);
    const double centre[3] = { 10, 2, 1 };
    for (int a = 0; a < 3; a++)
        assert_close(m.centre[a], centre[a], 1e-12);
    covariance_of(&m, c);
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            assert_close(c[i][j], i != j ? 0 : i == 0 ? 0.25 + 9 : 0.25, 1e-5);
    assert_close((double)m.sh[0][1], 1.5, 1e-6);
    assert_close((double)m.sh[3][2], 1, 1e-6);
    /* Thin Gaussians cover the sum of their areas. */
    assert_close(covered(&m) / (2 * covered(&g[0])), 1, 0.02);
}

static void a_gaussian_weighs_the_area_that_it_covers(void **state)
{
    (void)state;
    /* The second covers 4 * 4 times the area: twice the deviation, and 4 times o - 1/255. */
    const trip_gaussian g[2] = { ball(0, 0, 0, 1, 0.01 + ALPHA_MIN),
                                 ball(17, 0, 0, 2, 0.04 + ALPHA_MIN) };
    double c[3][3];
    const trip_gaussian m = merge(g, 2, 0);
    assert_close(m.centre[0], 16, 1e-5);
    covariance_of(&m, c);
    assert_close(c[0][0], (1 + 16 * 4) / 17.0 + 16 * 1 / 289.0 * 17 * 17, 1e-4);
    assert_close(c[1][1], (1 + 16 * 4) / 17.0, 1e-4);
}

static void the_order_of_merging_does_not_matter(void **state)
{
    (void)state;
    enum { COUNT = 40 };
    trip_gaussian g[COUNT];
    trip_gaussian_moments parts[2] = { { .count = 0 }, { .count = 0 } }, one;
    double sum[3][3] = { { 0 } }, mean[3] = { 0 }, mass = 0, c[3][3];
    for (int i = 0; i < COUNT; i++) {
        float length = 0;
        g[i] = ball(5e6 + test_random(), test_random(), 3 * test_random(), 1, test_random());
        for (int k = 0; k < 4; k++) {
            g[i].rotation[k] = (float)(test_random() - 0.5);
            length += g[i].rotation[k] * g[i].rotation[k];
        }
        for (int k = 0; k < 4; k++)
            g[i].rotation[k] /= sqrtf(length);
        for (int k = 0; k < 3; k++)
            g[i].deviations[k] = (float)(0.1 * test_random());
        trip_gaussian_moments_of(&g[i], 0, &one);
        trip_gaussian_moments_add(&parts[i % 3 == 0], &one, 0);
        mass += one.mass;
        for (int a = 0; a < 3; a++)
            mean[a] += one.mass * (g[i].centre[a] - (a == 0 ? 5e6 : 0));
    }
    for (int i = 0; i < COUNT; i++) {
        trip_gaussian_moments_of(&g[i], 0, &one);
        covariance_of(&g[i], c);
        for (int a = 0; a < 3; a++)
            for (int b = 0; b < 3; b++)
                sum[a][b] += one.mass / mass *
                             (c[a][b] + (g[i].centre[a] - (a == 0 ? 5e6 : 0) - mean[a] / mass) *
                                            (g[i].centre[b] - (b == 0 ? 5e6 : 0) - mean[b] / mass));
    }
    trip_gaussian_moments_add(&parts[0], &parts[1], 0);
    const trip_gaussian m = trip_gaussian_moments_merge(&parts[0], 0);
    const trip_gaussian whole = merge(g, COUNT, 0);
    covariance_of(&m, c);
    /* The deviations may have grown for the opacity, all by one factor. */
    const double grown = (c[0][0] + c[1][1] + c[2][2]) / (sum[0][0] + sum[1][1] + sum[2][2]);
    assert_true(grown > 1 - 1e-5 && grown < 2);
    for (int a = 0; a < 3; a++) {
        assert_close(m.centre[a], mean[a] / mass + (a == 0 ? 5e6 : 0), 1e-9);
        assert_close(m.centre[a], whole.centre[a], 1e-12);
        assert_close((double)m.deviations[a], (double)whole.deviations[a], 1e-6);
        for (int b = 0; b < 3; b++)
            assert_close(c[a][b], grown * sum[a][b], 1e-5);
    }
    assert_close((double)m.opacity, (double)whole.opacity, 1e-6);
}

static void opaque_gaussians_behind_one_another_cover_no_more_than_their_disc(void **state)
{
    (void)state;
    enum { COUNT = 1000 };
    static trip_gaussian g[COUNT];
    for (int i = 0; i < COUNT; i++)
        g[i] = ball(0, 0, 0, 1, 0.99);
    const trip_gaussian m = merge(g, COUNT, 0);
    assert_close((double)m.opacity, 0.99, 1e-6);
    /* The area grows until 2 pi A Li2(0.99) = 1.5 * 4 pi a, up to the cut at 1/255. Li2(0.99) is
     * 1.588625. */
    assert_close((double)m.deviations[1], sqrt((3 + ALPHA_MIN) / 1.588625), 1e-5);
    const trip_gaussian few = merge(g, 1, 0);
    assert_close((double)few.opacity, 0.99, 1e-4);
    assert_close((double)few.deviations[1], 1, 1e-5);
}

static void areas_and_dilogarithms_have_their_known_values(void **state)
{
    (void)state;
    assert_close(trip_dilogarithm(1), M_PI * M_PI / 6, 1e-12);
    assert_close(trip_dilogarithm(0.5), M_PI * M_PI / 12 - M_LN2 * M_LN2 / 2, 1e-12);
    assert_close(trip_dilogarithm(0), 0, 1e-12);
    assert_close(trip_gaussian_mean_area((const double[]){ 3, 3, 3 }), 9, 1e-12);
    /* A disc has half of its area on average, a needle none. */
    assert_close(trip_gaussian_mean_area((const double[]){ 2, 0, 2 }), 2, 0.011);
    assert_close(trip_gaussian_mean_area((const double[]){ 0, 5, 0 }), 0, 1e-12);
    /* A spheroid with half axes 1, 1, 2 has the surface 2 pi (1 + 2 asin(e) / e), e^2 = 3/4. */
    const double e = sqrt(0.75), surface = 2 * M_PI * (1 + 2 * asin(e) / e);
    assert_close(trip_gaussian_mean_area((const double[]){ 1, 2, 1 }), surface / (4 * M_PI), 0.011);
}

static void invisible_gaussians_have_no_mass(void **state)
{
    (void)state;
    trip_gaussian_moments m;
    const trip_gaussian faint = ball(0, 0, 0, 1, 0.0039), point = ball(0, 0, 0, 0, 1);
    trip_gaussian_moments_of(&faint, 0, &m);
    assert_true(m.mass == 0);
    trip_gaussian_moments_of(&point, 0, &m);
    assert_true(m.mass == 0);
}

static void two_positive_deviations_and_an_opacity_give_mass(void **state)
{
    (void)state;
    static const struct {
        float deviations[3], opacity;
        bool has_mass;
    } cases[] = {
        { { 1, 1, 1 }, 0.0039f, false },
        { { 1, 1, 1 }, 0.00393f, true },
        { { 0, 0, 0 }, 1, false },
        { { 0, 2, 0 }, 1, false },
        { { 1e-45f, 0, 3e38f }, 0.5f, true },
        { { 0, 1e-45f, 1e-45f }, 1, true },
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        trip_gaussian g = ball(0, 0, 0, 1, 1);
        trip_gaussian_moments m;
        memcpy(g.deviations, cases[i].deviations, sizeof g.deviations);
        g.opacity = cases[i].opacity;
        trip_gaussian_moments_of(&g, 0, &m);
        assert_int_equal(trip_gaussian_has_mass(&g), cases[i].has_mass);
        assert_int_equal(m.mass > 0, cases[i].has_mass);
    }
}

/* Returns surfel `i` of a square of 10 x 10. Its normal is (0, 0, 1), or the opposite, and turned
 * by a quaternion. */
static trip_gaussian surfel(int i, bool opposite, const double q[4])
{
    trip_gaussian g = { .deviations = { 0.05f, 0.05f, 0 }, .opacity = 1 };
    const double at[3] = { 0.1 * (i % 10), 0.1 * (i / 10 % 10), 0 };
    const double t[3] = { 2 * (q[2] * at[2] - q[3] * at[1]), 2 * (q[3] * at[0] - q[1] * at[2]),
                          2 * (q[1] * at[1] - q[2] * at[0]) };
    g.centre[0] = at[0] + q[0] * t[0] + q[2] * t[2] - q[3] * t[1];
    g.centre[1] = at[1] + q[0] * t[1] + q[3] * t[0] - q[1] * t[2];
    g.centre[2] = at[2] + q[0] * t[2] + q[1] * t[1] - q[2] * t[0];
    for (int k = 0; k < 4; k++)
        g.rotation[k] = (float)q[k];
    if (opposite) { /* q (0, 0, 1, 0): half a turn about the second axis */
        const float r[4] = { -(float)q[2], -(float)q[3], (float)q[0], (float)q[1] };
        memcpy(g.rotation, r, sizeof r);
    }
    return g;
}

static void merged_surfels_keep_the_side_of_most(void **state)
{
    (void)state;
    trip_gaussian g[100];
    for (int turn = 0; turn < 60; turn++) {
        double q[4], length = 0;
        for (int k = 0; k < 4; k++) {
            q[k] = sin(1 + 7.3 * turn + 2.1 * k * (turn + 1));
            length += q[k] * q[k];
        }
        for (int k = 0; k < 4; k++)
            q[k] /= sqrt(length);
        const double n[3] = { 2 * (q[1] * q[3] + q[0] * q[2]), 2 * (q[2] * q[3] - q[0] * q[1]),
                              1 - 2 * (q[1] * q[1] + q[2] * q[2]) };
        for (int opposite = 0; opposite <= 100; opposite += 10) {
            for (int i = 0; i < 100; i++)
                g[i] = surfel(i, i * 37 % 100 < opposite, q);
            const trip_gaussian m = merge(g, 100, 0);
            const trip_vec3 normal = trip_surfel_normal(&m);
            const double along = normal.x * n[0] + normal.y * n[1] + normal.z * n[2];
            /* the mean cosine is 1 - opposite / 50, and one half decides */
            assert_int_equal(m.two_sided, opposite > 25 && opposite < 75);
            if (opposite != 50)
                assert_true(opposite < 50 ? along > 0.999 : along < -0.999);
        }
    }
}

/* ---- levels of a bricked scene ---- */

/* Thin balls in a box of 64 * 32 * 16, and large ones among them. */
typedef struct scene {
    uint64_t count, next;
} scene;

static int read_scene(void *user, trip_gaussian *out, size_t room, size_t *got)
{
    scene *s = user;
    for (*got = 0; *got < room && s->next < s->count; ++*got, s->next++) {
        uint64_t bits = (s->next + 1) * UINT64_C(0x9E3779B97F4A7C15);
        double r[3];
        for (int a = 0; a < 3; a++) {
            bits = (bits ^ bits >> 29) * UINT64_C(0xBF58476D1CE4E5B9);
            r[a] = (double)(bits >> 11) * 0x1p-53;
        }
        out[*got] = ball(64 * r[0], 32 * r[1], 16 * r[2], s->next % 500 ? 0.03 : 2, 0.02);
    }
    return TRIP_OK;
}

static trip_gaussian_set *make_set(uint64_t count, trip_budget **budget)
{
    scene s = { .count = count };
    trip_gaussian_set *set;
    assert_int_equal(trip_budget_create(budget, 256 * MIB), TRIP_OK);
    assert_int_equal(trip_brick_gaussians(&(trip_brick_gaussians_params){ .path = NAME,
                                                                          .replace = true,
                                                                          .source = read_scene,
                                                                          .source_user = &s },
                                          *budget, NULL),
                     TRIP_OK);
    assert_int_equal(trip_gaussian_set_open(&set, NAME, *budget), TRIP_OK);
    assert_int_equal(trip_gaussian_set_verify(set, *budget), TRIP_OK);
    return set;
}

static void close_set(trip_gaussian_set *set, trip_budget *budget)
{
    trip_gaussian_set_close(set);
    assert_int_equal(trip_budget_left_bytes(budget), trip_budget_limit_bytes(budget));
    trip_budget_destroy(budget);
}

static uint64_t records_of(const trip_gaussian_set *set, uint64_t node)
{
    const trip_file_gaussian_node *n = &set->nodes[node];
    uint64_t sum = 0;
    for (uint32_t i = 0; i < n->brick_count[0]; i++)
        sum += set->lists[0].bricks[n->first_brick[0] + i].records;
    return sum;
}

static void each_level_has_fewer_gaussians_down_to_a_few_thousand(void **state)
{
    (void)state;
    trip_budget *budget;
    trip_gaussian_set *set = make_set(300000, &budget);
    uint64_t scene_records = 0, least = UINT64_MAX;
    for (uint64_t i = 0; i < set->header.node_count; i++) {
        const trip_file_gaussian_node *n = &set->nodes[i];
        const uint64_t own = records_of(set, i);
        uint64_t inside = 0;
        for (uint64_t j = i + 1; j < i + n->nodes; j += set->nodes[j].nodes)
            inside += records_of(set, j);
        if (n->nodes > 1)
            assert_true(own <= inside / 2 && own >= inside / 40);
        else
            scene_records += own;
        least = own < least ? own : least;
    }
    assert_int_equal(scene_records, 300000);
    assert_true(set->nodes[0].nodes == set->header.node_count);
    assert_true(least < 8192);
    close_set(set, budget);
}

static double distance(const trip_file_gaussian_node *n, const double eye[3])
{
    double square = 0;
    for (int a = 0; a < 3; a++) {
        const double away = fmax(0, fmax(n->lo[a] - eye[a], eye[a] - n->hi[a]));
        square += away * away;
    }
    return sqrt(square);
}

/* Checks that the shares of each leaf add up to 1, and that nodes near the eye are fine. Returns
 * the number of Gaussians drawn. */
static uint64_t check_shares(const trip_gaussian_set *set, const trip_gaussian_lod *lod)
{
    double *sums = calloc(set->header.node_count, sizeof *sums);
    uint64_t records = 0;
    trip_gaussian_walk w = { 0 };
    while (trip_gaussian_walk_next(set, lod, &w)) {
        const trip_file_gaussian_node *n = &set->nodes[w.node];
        assert_true(w.share > 0 && w.share <= 1);
        records += records_of(set, w.node);
        for (uint64_t i = w.node; i < w.node + n->nodes; i++)
            sums[i] += w.share;
        if (n->nodes > 1)
            assert_true(n->width * lod->px <=
                        lod->voxel_px * (lod->parallel ? 1 : distance(n, lod->eye)));
    }
    for (uint64_t i = 0; i < set->header.node_count; i++)
        if (set->nodes[i].nodes == 1)
            assert_close(sums[i], 1, 1e-12);
    free(sums);
    return records;
}

static void each_gaussian_is_drawn_once_at_any_distance(void **state)
{
    (void)state;
    trip_budget *budget;
    trip_gaussian_set *set = make_set(300000, &budget);
    uint64_t before = UINT64_MAX, mixed = 0;
    for (double away = 0; away < 1e5; away = 1.1 * away + 1) {
        const trip_gaussian_lod lod = { .voxel_px = 1, .eye = { 64 + away, 20, 8 }, .px = 200 };
        trip_gaussian_stream_params p = { .key = { .direction = { -1, 0, 0 } }, .lod = lod };
        trip_gaussian_plan plan;
        const uint64_t records = check_shares(set, &lod);
        assert_int_equal(trip_gaussian_stream_plan(set, &p, budget, &plan), TRIP_OK);
        assert_int_equal(plan.records, records);
        mixed += plan.coarse_records > 0 && plan.coarse_records < plan.records;
        if (away == 0)
            assert_true(plan.coarse_records < plan.records);
        before = records;
    }
    assert_true(mixed > 5);
    assert_true(before < 8192);
    for (double width = 0.001; width < 1000; width *= 1.3)
        check_shares(set, &(trip_gaussian_lod){ .voxel_px = width, .parallel = true, .px = 1 });
    assert_int_equal(check_shares(set, &(trip_gaussian_lod){ .voxel_px = 0 }), 300000);
    close_set(set, budget);
}

/* Returns the area that all Gaussians of a stream cover, and their number. */
static double stream_area(const trip_gaussian_set *set, double voxel_px, trip_budget *budget,
                          uint64_t *count, uint64_t *merged)
{
    enum { ROOM = 256 };
    static trip_gaussian batch[ROOM];
    trip_gaussian_stream *stream;
    double sum = 0;
    size_t got = 1;
    const trip_gaussian_stream_params p = {
        .key = { .direction = { 0, 1, 0 } },
        .axis = 1,
        .lod = { .voxel_px = voxel_px, .parallel = true, .px = 1 },
    };
    *count = *merged = 0;
    assert_int_equal(trip_gaussian_stream_open(&stream, set, &p, budget), TRIP_OK);
    while (got > 0) {
        assert_int_equal(trip_gaussian_stream_next(stream, batch, NULL, ROOM, &got), TRIP_OK);
        for (size_t i = 0; i < got; i++) {
            sum += covered(&batch[i]);
            *merged += batch[i].merged;
        }
        *count += got;
    }
    trip_gaussian_stream_close(stream);
    return sum;
}

static void coarse_gaussians_cover_the_area_of_thin_ones(void **state)
{
    (void)state;
    trip_budget *budget;
    trip_gaussian_set *set = make_set(300000, &budget);
    uint64_t count, merged;
    const double fine = stream_area(set, 0, budget, &count, &merged);
    assert_int_equal(count, 300000);
    assert_int_equal(merged, 0);
    const double coarse = stream_area(set, 1e6, budget, &count, &merged);
    assert_true(count < 8192 && merged == count);
    /* Codes of opacities have steps of 1/4095, and these opacities are near 0.02. */
    assert_close(coarse / fine, 1, 0.02);
    close_set(set, budget);
}

static int remove_data_sets(void **state)
{
    (void)state;
    return system("rm -rf " NAME);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(two_equal_gaussians_merge_into_their_moments),
        cmocka_unit_test(a_gaussian_weighs_the_area_that_it_covers),
        cmocka_unit_test(the_order_of_merging_does_not_matter),
        cmocka_unit_test(opaque_gaussians_behind_one_another_cover_no_more_than_their_disc),
        cmocka_unit_test(areas_and_dilogarithms_have_their_known_values),
        cmocka_unit_test(invisible_gaussians_have_no_mass),
        cmocka_unit_test(two_positive_deviations_and_an_opacity_give_mass),
        cmocka_unit_test(merged_surfels_keep_the_side_of_most),
        cmocka_unit_test(each_level_has_fewer_gaussians_down_to_a_few_thousand),
        cmocka_unit_test(each_gaussian_is_drawn_once_at_any_distance),
        cmocka_unit_test(coarse_gaussians_cover_the_area_of_thin_ones),
    };
    return cmocka_run_group_tests(tests, NULL, remove_data_sets);
}
