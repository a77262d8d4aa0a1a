#include "test.h"

#include "text.h"

#include <float.h>

#include "comma_locale.h"

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

static void other_texts_are_not_numbers(void **state)
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

static void written_numbers_can_be_read_without_loss(void **state)
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

static void a_locale_with_decimal_commas_has_no_effect(void **state)
{
    (void)state;
    need_comma_locale();
    char text[32], points[8], commas[8];
    double value = 0;
    bool read = trip_text_to_double("1.5", &value);
    trip_text_from_double(2.5, text);
    locale_t before = trip_text_use_points();
    snprintf(points, sizeof points, "%.1f", 3.5);
    uselocale(before);
    snprintf(commas, sizeof commas, "%.1f", 3.5);
    setlocale(LC_ALL, "C");
    assert_true(read);
    assert_true(value == 1.5);
    assert_string_equal(text, "2.5");
    assert_string_equal(points, "3.5");
    assert_string_equal(commas, "3,5");
}

static void check_character(const char *text, uint32_t code, unsigned bytes, bool printable)
{
    trip_text_character c = trip_text_next(text);
    assert_int_equal(c.code, code);
    assert_int_equal(c.bytes, bytes);
    assert_int_equal(c.printable, printable);
}

/* The bytes are the first and last valid sequences, and the nearest invalid sequences, of table 3-7
 * in the Unicode standard. */
static void valid_utf8_is_recognised(void **state)
{
    (void)state;
    check_character("a", 'a', 1, true);
    check_character("\x7f", 0x7f, 1, false);
    check_character("\xc2\x80", 0x80, 2, false);
    check_character("\xc2\xa0", 0xa0, 2, true);
    check_character("\xc1\xbf", 0xfffd, 1, false);
    check_character("\xe0\xa0\x80", 0x800, 3, true);
    check_character("\xe0\x9f\xbf", 0xfffd, 1, false);
    check_character("\xed\x9f\xbf", 0xd7ff, 3, true);
    check_character("\xed\xa0\x80", 0xfffd, 1, false);
    check_character("\xf0\x90\x80\x80", 0x10000, 4, true);
    check_character("\xf4\x8f\xbf\xbf", 0x10ffff, 4, true);
    check_character("\xf4\x90\x80\x80", 0xfffd, 1, false);
    check_character("\xf8\x88\x80\x80", 0xfffd, 1, false);
    check_character("\x80", 0xfffd, 1, false);
    check_character("\xe2\x82", 0xfffd, 1, false);
    check_character("\xe2\x80\xae", 0x202e, 3, false);
    check_character("\xe2\x81\xa6", 0x2066, 3, false);
}

static void unprintable_characters_are_printed_as_bytes(void **state)
{
    (void)state;
    char text[64] = "";
    FILE *f = fmemopen(text, sizeof text, "w");
    trip_text_write(f, "a\n\t\x1b\xc3\xbc\xc2\x9b\xff");
    fclose(f);
    assert_string_equal(text, "a\\n\\t\\x1b\xc3\xbc\\xc2\\x9b\\xff");
}

static void the_distance_counts_changes_of_single_characters(void **state)
{
    (void)state;
    assert_int_equal(trip_text_distance("bone", "bone"), 0);
    assert_int_equal(trip_text_distance("", "bone"), 4);
    assert_int_equal(trip_text_distance("bone", "bones"), 1);
    assert_int_equal(trip_text_distance("bone", "bnoe"), 2);
    assert_int_equal(trip_text_distance("kitten", "sitting"), 3);
    assert_int_equal(trip_text_distance("saturday", "sunday"), 3);
    char lengthy[65];
    memset(lengthy, 'a', 64);
    lengthy[64] = 0;
    assert_true(trip_text_distance(lengthy, "a") == SIZE_MAX);
}

static const char *nearest(const char *text)
{
    static const char *const names[] = { "orbit", "size", "samples", "background", "tf" };
    trip_text_nearest n = { .text = text };
    for (size_t i = 0; i < sizeof names / sizeof *names; i++)
        trip_text_nearest_try(&n, names[i]);
    return n.name ? n.name : "";
}

static void the_nearest_name_differs_in_few_letters(void **state)
{
    (void)state;
    assert_string_equal(nearest("orbti"), "orbit");
    assert_string_equal(nearest("Size"), "size");
    assert_string_equal(nearest("sample"), "samples");
    assert_string_equal(nearest("bakcgroundd"), "background");
    assert_string_equal(nearest("frt"), "");
    assert_string_equal(nearest("t"), "");
    assert_string_equal(nearest("orrr"), "");
    assert_string_equal(nearest(""), "");
}

static void words_of_a_shell_are_quoted(void **state)
{
    (void)state;
    static const char *const words[][2] = { { "a/b-1.nrrd", "a/b-1.nrrd" },
                                            { "", "''" },
                                            { "it's a $x;", "'it'\\''s a $x;'" } };
    for (int i = 0; i < 3; i++) {
        char *word = trip_text_word(words[i][0]);
        assert_non_null(word);
        assert_string_equal(word, words[i][1]);
        free(word);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_nearest_name_differs_in_few_letters),
        cmocka_unit_test(words_of_a_shell_are_quoted),
        cmocka_unit_test(decimal_numbers_are_read),
        cmocka_unit_test(other_texts_are_not_numbers),
        cmocka_unit_test(written_numbers_can_be_read_without_loss),
        cmocka_unit_test(written_numbers_are_short),
        cmocka_unit_test(valid_utf8_is_recognised),
        cmocka_unit_test(unprintable_characters_are_printed_as_bytes),
        cmocka_unit_test(a_locale_with_decimal_commas_has_no_effect),
        cmocka_unit_test(the_distance_counts_changes_of_single_characters),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
