/* Sweeps over lattices: light that returns behind matter, and cells that are known to be clear.
 * test_effects compares sweeps with integrals along rays. */
#include "light_sweep.h"

#include "effects.h"
#include "test.h"

enum {
    NODES = 9,
    FINE = 2 * (NODES - 1) + 1,
    ALL = NODES * NODES * NODES,
    ALL_FINE = FINE * FINE * FINE
};

typedef struct lattice {
    float fine[ALL_FINE], out[ALL];
    unsigned char clear[(NODES - 1) * (NODES - 1) * (NODES - 1)];
    trip_light_grid extinction, result;
    trip_affine cells;
    trip_budget *budget;
} lattice;

static lattice *make(void)
{
    lattice *l = test_malloc(sizeof *l);
    memset(l, 0, sizeof *l);
    l->extinction = (trip_light_grid){ 1, { FINE, FINE, FINE }, l->fine };
    l->result = (trip_light_grid){ 2, { NODES, NODES, NODES }, l->out };
    l->cells = trip_affine_identity();
    assert_int_equal(trip_budget_create(&l->budget, 1 << 20), 0);
    return l;
}

static void drop(lattice *l)
{
    trip_budget_destroy(l->budget);
    test_free(l);
}

static void run(lattice *l, trip_vec3 direction, double range, bool knows)
{
    trip_light_sweep s = { .extinction = &l->extinction,
                           .out = &l->result,
                           .weight = 1,
                           .range = range,
                           .parts = 2,
                           .clear = knows ? l->clear : NULL,
                           .last = { FINE - 1, FINE - 1, FINE - 1 },
                           .index_to_world = &l->cells };
    memset(l->out, 0, sizeof l->out);
    assert_true(trip_light_sweep_begin(&s, direction, l->budget));
    while (trip_light_sweep_step(&s, NULL))
        ;
    trip_light_sweep_end(&s);
}

/* A slab with the optical depth 3 lies in the middle of a step. The rays go straight through it. */
static void light_returns_behind_a_slab(void **state)
{
    (void)state;
    lattice *l = make();
    const double depth = 3, range = 5;
    for (int n = 0; n < FINE * FINE; n++)
        l->fine[13 * FINE * FINE + n] = (float)depth;
    run(l, trip_v3(0, 0, 1), range, false);
    for (int k = 0; k < NODES; k++) {
        const double behind = 12 - 2 * k; /* from the end of the step */
        const double lost = behind < 0 ? 0 : (1 - exp(-depth)) * exp(-behind / range);
        assert_float_equal((double)l->out[(k * NODES + 4) * NODES + 4], 1 - lost, 1e-6);
    }
    run(l, trip_v3(0, 0, 1), 0, false);
    assert_float_equal((double)l->out[4 * NODES + 4], exp(-depth), 1e-6);
    drop(l);
}

/* A ray at an angle passes the slab on a longer way. Light returns along the ray. */
static void light_returns_along_slanted_rays(void **state)
{
    (void)state;
    lattice *l = make();
    const double depth = 0.7, range = 4, longer = sqrt(1 + 0.25);
    for (int n = 0; n < FINE * FINE; n++)
        l->fine[13 * FINE * FINE + n] = (float)depth;
    run(l, trip_v3(0.5, 0, 1), range, false);
    for (int k = 3; k < 7; k++) {
        const double lost = (1 - exp(-depth * longer)) * exp(-(12 - 2 * k) * longer / range);
        assert_float_equal((double)l->out[(k * NODES + 4) * NODES + 3], 1 - lost, 1e-6);
    }
    drop(l);
}

/* Returns whether the cell and those around it have no extinction. */
static bool is_clear(const lattice *l, int x, int y, int z)
{
    for (int k = 2 * z - 2; k <= 2 * z + 4; k++)
        for (int j = 2 * y - 2; j <= 2 * y + 4; j++)
            for (int i = 2 * x - 2; i <= 2 * x + 4; i++)
                if (i >= 0 && j >= 0 && k >= 0 && i < FINE && j < FINE && k < FINE &&
                    l->fine[(k * FINE + j) * FINE + i] > 0)
                    return false;
    return true;
}

static void clear_cells_change_no_bit(void **state)
{
    (void)state;
    lattice *l = make();
    float *before = test_malloc(sizeof l->out);
    const int cells = NODES - 1;
    int known = 0;
    for (int n = 0; n < 12; n++)
        l->fine[(int)(test_random() * ALL_FINE * 0.999)] = (float)test_random();
    for (int z = 0; z < cells; z++)
        for (int y = 0; y < cells; y++)
            for (int x = 0; x < cells; x++) {
                const bool clear = is_clear(l, x, y, z);
                l->clear[(z * cells + y) * cells + x] = clear;
                known += clear;
            }
    assert_true(known > 50 && known < cells * cells * cells - 50);
    for (int n = 0; n < TRIP_OPEN_DIRECTIONS; n++) {
        run(l, trip_effects_direction(n), n % 2 ? 6 : 0, false);
        memcpy(before, l->out, sizeof l->out);
        run(l, trip_effects_direction(n), n % 2 ? 6 : 0, true);
        assert_memory_equal(before, l->out, sizeof l->out);
    }
    test_free(before);
    drop(l);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(light_returns_behind_a_slab),
        cmocka_unit_test(light_returns_along_slanted_rays),
        cmocka_unit_test(clear_cells_change_no_bit),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
