#include "test.h"

#include "budget.h"

#include <pthread.h>
#include <stdbool.h>

static void memory_is_aligned_zeroed_and_counted(void **state)
{
    (void)state;
    trip_budget *b;
    assert_int_equal(trip_budget_create(&b, 1 << 20), 0);
    unsigned char *p = trip_budget_take(b, 10000);
    assert_non_null(p);
    assert_int_equal((uintptr_t)p % 4096, 0);
    for (int i = 0; i < 10000; i++)
        assert_int_equal(p[i], 0);
    memset(p, 1, 10000);
    assert_int_equal(trip_budget_left_bytes(b), (1 << 20) - 3 * 4096);
    trip_budget_release(b, p, 10000);
    assert_int_equal(trip_budget_left_bytes(b), 1 << 20);
    assert_int_equal(trip_budget_peak_bytes(b), 3 * 4096);
    trip_budget_destroy(b);
}

static void whole_limit_fits_and_one_byte_more_does_not(void **state)
{
    (void)state;
    trip_budget *b;
    assert_int_equal(trip_budget_create(&b, 8192), 0);
    assert_null(trip_budget_take(b, 8193));
    void *p = trip_budget_take(b, 8192);
    assert_non_null(p);
    assert_null(trip_budget_take(b, 1));
    assert_null(trip_budget_take(b, 0));
    trip_budget_release(b, p, 8192);
    assert_int_equal(trip_budget_peak_bytes(b), 8192);
    trip_budget_destroy(b);
}

static void huge_requests_are_refused_without_overflow(void **state)
{
    (void)state;
    trip_budget *b;
    assert_int_equal(trip_budget_create(&b, UINT64_MAX), 0);
    assert_null(trip_budget_take(b, SIZE_MAX));
    assert_null(trip_budget_take(b, SIZE_MAX - 4094));
    assert_int_equal(trip_budget_left_bytes(b), UINT64_MAX);
    trip_budget_destroy(b);
}

#if !TEST_ADDRESS_SANITIZER /* AddressSanitizer would abort */
/* Requests half of the address space, which every system refuses. */
static void memory_refused_by_the_system_is_not_counted(void **state)
{
    (void)state;
    trip_budget *b;
    assert_int_equal(trip_budget_create(&b, UINT64_MAX), 0);
    assert_null(trip_budget_take(b, SIZE_MAX / 2));
    assert_int_equal(trip_budget_left_bytes(b), UINT64_MAX);
    trip_budget_destroy(b);
}
#endif

static void zero_bytes_take_one_page(void **state)
{
    (void)state;
    trip_budget *b;
    assert_int_equal(trip_budget_create(&b, 8192), 0);
    void *p = trip_budget_take(b, 0);
    assert_non_null(p);
    assert_int_equal(trip_budget_left_bytes(b), 4096);
    trip_budget_release(b, p, 0);
    assert_int_equal(trip_budget_left_bytes(b), 8192);
    trip_budget_destroy(b);
}

static void releasing_null_is_allowed(void **state)
{
    (void)state;
    trip_budget *b;
    assert_int_equal(trip_budget_create(&b, 4096), 0);
    trip_budget_release(b, NULL, 4096);
    assert_int_equal(trip_budget_left_bytes(b), 4096);
    trip_budget_destroy(b);
    trip_budget_destroy(NULL);
}

static void default_limit_is_a_quarter_of_the_available_memory(void **state)
{
    (void)state;
    trip_budget *b;
    assert_int_equal(trip_budget_create(&b, 0), 0);
    assert_int_equal(trip_budget_limit_bytes(b), trip_memory_available_bytes() / 4);
    assert_true(trip_budget_limit_bytes(b) > 0);
    trip_budget_destroy(b);
}

enum { THREADS = 8, ROUNDS = 2000, BLOCK_BYTES = 4096, FIT = 5 };

static void *take_and_release(void *budget)
{
    for (int i = 0; i < ROUNDS; i++) {
        unsigned char *p = trip_budget_take(budget, BLOCK_BYTES);
        if (p)
            p[0] = 1;
        trip_budget_release(budget, p, BLOCK_BYTES);
    }
    return NULL;
}

static void threads_never_exceed_the_limit(void **state)
{
    (void)state;
    trip_budget *b;
    pthread_t threads[THREADS];
    assert_int_equal(trip_budget_create(&b, FIT * BLOCK_BYTES), 0);
    for (int i = 0; i < THREADS; i++)
        assert_int_equal(pthread_create(&threads[i], NULL, take_and_release, b), 0);
    for (int i = 0; i < THREADS; i++)
        pthread_join(threads[i], NULL);
    assert_int_equal(trip_budget_left_bytes(b), FIT * BLOCK_BYTES);
    assert_in_range(trip_budget_peak_bytes(b), BLOCK_BYTES, FIT * BLOCK_BYTES);
    trip_budget_destroy(b);
}

static void peak_resident_set_grows_with_touched_memory(void **state)
{
    (void)state;
    enum { BYTES = 64 << 20 };
    trip_budget *b;
    assert_int_equal(trip_budget_create(&b, BYTES), 0);
    uint64_t before = trip_memory_peak_rss_bytes();
    void *p = trip_budget_take(b, BYTES);
    assert_non_null(p);
    memset(p, 1, BYTES);
    assert_true(before > 0);
    assert_true(trip_memory_peak_rss_bytes() > before + BYTES / 2);
    trip_budget_release(b, p, BYTES);
    trip_budget_destroy(b);
}

static void sizes_have_binary_suffixes(void **state)
{
    (void)state;
    static const struct {
        const char *text;
        uint64_t bytes;
    } cases[] = {
        { "0", 0 },
        { "4096", 4096 },
        { "4096B", 4096 },
        { "256M", UINT64_C(256) << 20 },
        { "1.5G", UINT64_C(3) << 29 },
        { "1k", 1024 },
        { "1KB", 1024 },
        { "2GiB", UINT64_C(2) << 30 },
        { ".5T", UINT64_C(1) << 39 },
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        uint64_t bytes = 1;
        assert_true(trip_parse_bytes(cases[i].text, &bytes));
        assert_int_equal(bytes, cases[i].bytes);
    }
}

static void other_texts_are_not_sizes(void **state)
{
    (void)state;
    static const char *const texts[] = { "",
                                         "M",
                                         "-1",
                                         "1 M",
                                         "1X",
                                         "1Mi",
                                         "1MBs",
                                         "1e3",
                                         "1..2",
                                         "99999999T",
                                         "8388608T", /* 2^63 */
                                         "9223372036854775808",
                                         "1iB",
                                         "1 ",
                                         "nan",
                                         "0x10",
                                         "+5",
                                         ("000000000000000000000000000000000000000000000000000000"
                                          "00000000000000000001") };
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++) {
        uint64_t bytes = 77;
        assert_false(trip_parse_bytes(texts[i], &bytes));
        assert_int_equal(bytes, 77);
    }
}

static void sizes_are_printed_with_three_digits(void **state)
{
    (void)state;
    char text[32];
    assert_string_equal(trip_format_bytes(0, text), "0 bytes");
    assert_string_equal(trip_format_bytes(999, text), "999 bytes");
    assert_string_equal(trip_format_bytes(1234, text), "1.23 kB");
    assert_string_equal(trip_format_bytes(12345678, text), "12.3 MB");
    assert_string_equal(trip_format_bytes(123456789012, text), "123 GB");
    assert_string_equal(trip_format_bytes(999999, text), "1.00 MB");
    assert_string_equal(trip_format_bytes(UINT64_MAX, text), "18.4 EB");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(memory_is_aligned_zeroed_and_counted),
        cmocka_unit_test(whole_limit_fits_and_one_byte_more_does_not),
        cmocka_unit_test(huge_requests_are_refused_without_overflow),
#if !TEST_ADDRESS_SANITIZER
        cmocka_unit_test(memory_refused_by_the_system_is_not_counted),
#endif
        cmocka_unit_test(zero_bytes_take_one_page),
        cmocka_unit_test(releasing_null_is_allowed),
        cmocka_unit_test(default_limit_is_a_quarter_of_the_available_memory),
        cmocka_unit_test(threads_never_exceed_the_limit),
        cmocka_unit_test(peak_resident_set_grows_with_touched_memory),
        cmocka_unit_test(sizes_have_binary_suffixes),
        cmocka_unit_test(other_texts_are_not_sizes),
        cmocka_unit_test(sizes_are_printed_with_three_digits),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
