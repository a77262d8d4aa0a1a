/* The share of each voxel at the nodes of a light's lattice, for uneven spacing. */
#include "light_shares.h"
#include "test.h"

enum { MAX = 64 };

static trip_budget *open_budget(uint64_t bytes)
{
    trip_budget *b;
    assert_int_equal(trip_budget_create(&b, bytes), 0);
    return b;
}

/* Creates steps that differ by up to `most` times along the first axis. The other axes have one
 * voxel. */
static trip_coordinates random_coordinates(double table[MAX], int64_t voxels, double max)
{
    static const double one[] = { 0 };
    table[0] = 0;
    for (int64_t i = 1; i < voxels; i++)
        table[i] = table[i - 1] + pow(max, test_random());
    const double last = table[voxels - 1];
    for (int64_t i = 1; i < voxels; i++)
        table[i] *= (double)(voxels - 1) / last;
    return trip_coordinates_make((const double *const[]){ table, one, one },
                                 (const int64_t[]){ voxels, 1, 1 });
}

static int nodes_over(int64_t voxels, double spacing)
{
    const int cells = (int)ceil((double)(voxels - 1) / spacing);
    return cells < 1 ? 2 : cells + 1;
}

static double share_of(const trip_light_shares *s, int64_t voxel, int node)
{
    const size_t count = s->begin[voxel + 1] - s->begin[voxel];
    const int at = node - s->first[voxel];
    return at >= 0 && (size_t)at < count ? s->shares[s->begin[voxel] + (size_t)at] : 0;
}

static void even_steps_give_weight_by_distance(void **state)
{
    (void)state;
    trip_budget *b = open_budget(1 << 20);
    double table[MAX];
    for (int64_t voxels = 1; voxels < MAX; voxels += 7)
        for (int spacing = 1; spacing < 6; spacing++) {
            const trip_coordinates c = random_coordinates(table, voxels, 1);
            const int nodes = nodes_over(voxels, spacing);
            trip_light_shares s;
            assert_true(trip_light_shares_make(&s, &c, 0, spacing, nodes, b));
            for (int64_t i = 0; i < voxels; i++)
                for (int n = 0; n < nodes; n++)
                    assert_close(share_of(&s, i, n), fmax(0, 1 - fabs((double)i / spacing - n)),
                                 1e-9);
            trip_light_shares_destroy(&s, b);
        }
    trip_budget_destroy(b);
}

/* A voxel's shares cover half the way to each neighbour. The last point at each end of the grid
 * counts double. Points are at most 1 apart. */
static void shares_add_up_to_the_surroundings_of_a_voxel(void **state)
{
    (void)state;
    trip_budget *b = open_budget(1 << 20);
    double table[MAX];
    for (int round = 0; round < 40; round++) {
        const int64_t voxels = 2 + (int64_t)(test_random() * (MAX - 2));
        const double spacing = 1 + round % 5;
        const trip_coordinates c = random_coordinates(table, voxels, 1 + round);
        const int nodes = nodes_over(voxels, spacing);
        trip_light_shares s;
        assert_true(trip_light_shares_make(&s, &c, 0, spacing, nodes, b));
        double all = 0, sums = 0;
        for (int64_t i = 0; i < voxels; i++) {
            const double before = i > 0 ? table[i] - table[i - 1] : 0;
            const double behind = i < voxels - 1 ? table[i + 1] - table[i] : 0;
            double expected = (before + behind) / 2, found = 0;
            if (i == 0 || i == voxels - 1)
                expected += (before + behind) / ceil(before + behind - 1e-6) / 2;
            for (int n = 0; n < nodes; n++)
                found += share_of(&s, i, n);
            assert_close(found, expected, 1e-9);
            all += found;
        }
        for (int n = 0; n < nodes; n++) {
            assert_true(s.sums[n] > 0); /* every node has a value */
            sums += s.sums[n];
        }
        assert_close(sums, all, 1e-9 * all);
        trip_light_shares_destroy(&s, b);
    }
    trip_budget_destroy(b);
}

/* A function linear in the position has at each node its value there. Two effects cause an error:
 * points lie unevenly about a node, by at most the spacing, and the ends add up to one step. */
static void a_ramp_stays_close_to_its_values(void **state)
{
    (void)state;
    trip_budget *b = open_budget(1 << 20);
    double table[MAX];
    for (int round = 0; round < 20; round++) {
        const trip_coordinates c = random_coordinates(table, MAX, 1 + 2 * round);
        trip_light_shares s;
        assert_true(trip_light_shares_make(&s, &c, 0, 4, nodes_over(MAX, 4), b));
        for (int n = 1; n < s.nodes - 2; n++) {
            double sum = 0;
            for (int64_t i = 0; i < MAX; i++)
                sum += share_of(&s, i, n) * table[i];
            assert_close(sum / s.sums[n], 4 * n, 0.25);
        }
        trip_light_shares_destroy(&s, b);
    }
    trip_budget_destroy(b);
}

static void lattices_that_do_not_fit_are_refused_and_keep_nothing(void **state)
{
    (void)state;
    trip_budget *b = open_budget(1 << 20);
    double table[MAX];
    const trip_coordinates c = random_coordinates(table, MAX, 5);
    const uint64_t whole = trip_budget_left_bytes(b);
    for (uint64_t left = 0; left < 4 * 4096; left += 4096) {
        trip_light_shares s;
        assert_true(trip_budget_charge(b, whole - left));
        assert_false(trip_light_shares_make(&s, &c, 0, 2, nodes_over(MAX, 2), b));
        assert_int_equal(trip_budget_left_bytes(b), left);
        trip_budget_discharge(b, whole - left);
    }
    trip_budget_destroy(b);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(even_steps_give_weight_by_distance),
        cmocka_unit_test(shares_add_up_to_the_surroundings_of_a_voxel),
        cmocka_unit_test(a_ramp_stays_close_to_its_values),
        cmocka_unit_test(lattices_that_do_not_fit_are_refused_and_keep_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
