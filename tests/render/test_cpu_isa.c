/* Runs the instruction sets of this build that the processor supports, and skips the others by
 * name. The other tests of the CPU renderer use the supported ones. */
#include "cpu/kernels/isa.h"
#include "test.h"

static void expect_runs(const char *name)
{
    test_catch_reports();
    const trip_cpu_kernels *chosen = trip_cpu_isa_choose(name);
    if (!chosen) {
        assert_one_report(name);
        skip();
    }
    assert_int_equal(test_caught_reports(), 0);
    assert_string_equal(chosen->isa, name);
    bool listed = false;
    for (const trip_cpu_kernels *const *isa = trip_cpu_isas(); *isa; isa++)
        listed |= *isa == chosen;
    assert_true(listed);
}

static void plain_c_runs(void **state)
{
    (void)state;
    expect_runs("plain");
}

#if defined(__x86_64__)
static void avx2_runs(void **state)
{
    (void)state;
    expect_runs("avx2");
}

static void avx512_runs(void **state)
{
    (void)state;
    expect_runs("avx512");
}

static void avx512_with_vbmi2_runs(void **state)
{
    (void)state;
    expect_runs("avx512-vbmi2");
}
#elif defined(__aarch64__)
static void neon_runs(void **state)
{
    (void)state;
    expect_runs("neon");
}
#endif

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(plain_c_runs),
#if defined(__x86_64__)
        cmocka_unit_test(avx2_runs),
        cmocka_unit_test(avx512_runs),
        cmocka_unit_test(avx512_with_vbmi2_runs),
#elif defined(__aarch64__)
        cmocka_unit_test(neon_runs),
#endif
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
