/* Compares sets of codes with a count of one code at a time. */
#include "code_set.h"
#include "test.h"

#include <float.h>

static trip_tf_entry table[65536];

/* Makes the codes from `first` to `last` visible, except `but`. */
static void show(unsigned first, unsigned last, unsigned but)
{
    for (unsigned code = 0; code < 65536; code++)
        table[code].extinction = code >= first && code <= last && code != but;
}

static trip_code_set set_of_table(void)
{
    trip_code_set set;
    trip_code_set_make(&set, table, FLT_TRUE_MIN);
    return set;
}

static void codes_without_a_gap_are_a_range(void **state)
{
    (void)state;
    static const unsigned ends[] = { 0, 1, 62, 63, 64, 65, 4095, 4096, 40000, 65534, 65535 };
    enum { ENDS = sizeof ends / sizeof ends[0] };
    for (int i = 0; i < ENDS; i++)
        for (int k = i; k < ENDS; k++) {
            show(ends[i], ends[k], UINT32_MAX);
            trip_code_set set = set_of_table();
            trip_code_range range = trip_code_set_range(&set);
            assert_int_equal(range.min, ends[i]);
            assert_int_equal(range.max, ends[k]);
            if (ends[k] - ends[i] < 2)
                continue;
            show(ends[i], ends[k], (ends[i] + ends[k]) / 2);
            set = set_of_table();
            range = trip_code_set_range(&set);
            assert_true(range.min > range.max);
        }
}

static void no_codes_are_no_range(void **state)
{
    (void)state;
    show(1, 0, 0);
    const trip_code_set set = set_of_table();
    const trip_code_range range = trip_code_set_range(&set);
    assert_true(range.min > range.max);
    assert_false(trip_code_set_has_some(&set, 0, 65535));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(codes_without_a_gap_are_a_range),
        cmocka_unit_test(no_codes_are_no_range),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
