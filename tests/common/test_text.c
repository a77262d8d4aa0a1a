#include "test.h"

#include "text.h"

#include <float.h>
#include <locale.h>

static void decimal_numbers_are_read(void **state)
{
    (void)state;
    static const struct {
        const char *text;
        double value;
    } cases[] = { { "0", 0 },           { "-1", -1 },   { "+2.5", 2.5 },
                  { ".5", 0.5 },        { "1.", 1 },    { "1e3", 1000 },
                  { "-2.5E-1", -0.25 }, { "0.1", 0.1 }, { "1e-400", 0 } };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        double value = NAN;
        assert_true(trip_text_to_double(cases[i].text, &value));
        assert_true(value == cases[i].value);
    }
}

static void anything_else_is_refused(void **state)
{
    (void)state;
    static const char *const texts[] = { "",     " ",     "1 ",   " 1",  "1,5", "0x10",
                                         "nan",  "inf",   "-",    ".",   "e5",  "1e",
                                         "1e5x", "1e999", "1..2", "--1", "1-2", "infinity" };
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++) {
        double value = 7;
        assert_false(trip_text_to_double(texts[i], &value));
        assert_true(value == 7);
    }
}

static void written_numbers_read_back_the_same(void **state)
{
    (void)state;
    static const double values[] = { 0, 1, -1, 0.1, 1.0 / 3, 1e-300, DBL_MAX, DBL_MIN, 5e-324 };
    char text[32];
    double back;
    for (size_t i = 0; i < sizeof values / sizeof *values; i++) {
        assert_true(trip_text_to_double(trip_text_from_double(values[i], text), &back));
        assert_true(back == values[i]);
    }
    for (int i = 0; i < 10000; i++) {
        double value = (test_random() - 0.5) * pow(10, 40 * test_random() - 20);
        assert_true(trip_text_to_double(trip_text_from_double(value, text), &back));
        assert_true(back == value);
    }
}

static void written_numbers_are_short(void **state)
{
    (void)state;
    char text[32];
    assert_string_equal(trip_text_from_double(0.1, text), "0.1");
    assert_string_equal(trip_text_from_double(255, text), "255");
    assert_string_equal(trip_text_from_double(-1000, text), "-1000");
}

static void a_locale_with_decimal_commas_changes_nothing(void **state)
{
    (void)state;
    static const char *const names[] = { "de_DE.UTF-8", "de_DE", "fr_FR.UTF-8", "fr_FR" };
    const char *found = NULL;
    for (size_t i = 0; i < sizeof names / sizeof *names && !found; i++)
        found = setlocale(LC_ALL, names[i]);
    if (!found) {
        print_message("skipped: no locale with decimal commas is installed\n");
        skip();
    }
    char text[32];
    double value = 0;
    bool read = trip_text_to_double("1.5", &value);
    trip_text_from_double(2.5, text);
    setlocale(LC_ALL, "C");
    assert_true(read);
    assert_true(value == 1.5);
    assert_string_equal(text, "2.5");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(decimal_numbers_are_read),
        cmocka_unit_test(anything_else_is_refused),
        cmocka_unit_test(written_numbers_read_back_the_same),
        cmocka_unit_test(written_numbers_are_short),
        cmocka_unit_test(a_locale_with_decimal_commas_changes_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
