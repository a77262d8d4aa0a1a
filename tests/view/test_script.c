#include "test.h"

#include <unistd.h>

#include "comma_locale.h"
#include "script.h"

static trip_script parse(const char *text)
{
    trip_script s;
    assert_int_equal(trip_script_parse(&s, "test", text, strlen(text)), 0);
    return s;
}

static void assert_refused(const char *text, const char *why)
{
    trip_script s;
    test_catch_reports();
    assert_int_equal(trip_script_parse(&s, "test.script", text, strlen(text)), TRIP_ERROR);
    assert_one_report(why);
    assert_int_equal(s.count, 0);
    assert_null(s.events);
}

static void lines_become_events_in_order(void **state)
{
    (void)state;
    trip_script s = parse("# a tour\n"
                          "\n"
                          "  move 10.5 20\r\n"
                          "press right +shift +control\n"
                          "release right\n"
                          "wheel -1.5 +alt\n"
                          "resize 800 600\n"
                          "minimise\nrestore\nwait\nsleep 250\nclose");
    const trip_event *e = s.events;
    assert_int_equal(s.count, 10);
    assert_true(e[0].kind == TRIP_EVENT_MOVE && e[0].x == 10.5 && e[0].y == 20);
    assert_true(e[1].kind == TRIP_EVENT_BUTTON && e[1].code == TRIP_BUTTON_RIGHT && e[1].down);
    assert_int_equal(e[1].modifiers, TRIP_SHIFT | TRIP_CONTROL);
    assert_true(e[2].kind == TRIP_EVENT_BUTTON && !e[2].down && !e[2].modifiers);
    assert_true(e[3].kind == TRIP_EVENT_WHEEL && e[3].y == -1.5 && e[3].modifiers == TRIP_ALT);
    assert_true(e[4].kind == TRIP_EVENT_RESIZE && e[4].x == 800 && e[4].y == 600);
    assert_true(e[5].kind == TRIP_EVENT_ICONIFY && e[5].down);
    assert_true(e[6].kind == TRIP_EVENT_ICONIFY && !e[6].down);
    assert_true(e[7].kind == TRIP_EVENT_WAIT);
    assert_true(e[8].kind == TRIP_EVENT_SLEEP && e[8].x == 250);
    assert_true(e[9].kind == TRIP_EVENT_CLOSE);
    trip_script_free(&s);
    assert_null(s.events);
}

static void keys_are_pressed_and_released(void **state)
{
    (void)state;
    trip_script s = parse("key f +control\nkey page-down\nhold w\nlet w\nkey +\nkey space\n");
    static const struct {
        int code, down;
    } keys[] = { { 'f', 1 },
                 { 'f', 0 },
                 { TRIP_KEY_PAGE_DOWN, 1 },
                 { TRIP_KEY_PAGE_DOWN, 0 },
                 { 'w', 1 },
                 { 'w', 0 },
                 { '+', 1 },
                 { '+', 0 },
                 { ' ', 1 },
                 { ' ', 0 } };
    assert_int_equal(s.count, 10);
    for (int i = 0; i < 10; i++) {
        assert_int_equal(s.events[i].kind, TRIP_EVENT_KEY);
        assert_int_equal(s.events[i].code, keys[i].code);
        assert_int_equal(s.events[i].down, keys[i].down);
        assert_int_equal(s.events[i].modifiers, i < 2 ? TRIP_CONTROL : 0);
    }
    trip_script_free(&s);
}

static void a_drag_consists_of_steps(void **state)
{
    (void)state;
    trip_script s = parse("drag left 100 50 200 30 4 +shift\n");
    assert_int_equal(s.count, 7);
    for (int i = 0; i < 7; i++)
        assert_int_equal(s.events[i].modifiers, TRIP_SHIFT);
    assert_true(s.events[0].x == 100 && s.events[0].y == 50);
    assert_true(s.events[1].kind == TRIP_EVENT_BUTTON && s.events[1].down);
    for (int i = 1; i <= 4; i++) {
        assert_close(s.events[1 + i].x, 100 + 25 * i, 1e-12);
        assert_close(s.events[1 + i].y, 50 - 5 * i, 1e-12);
    }
    assert_true(s.events[6].kind == TRIP_EVENT_BUTTON && !s.events[6].down);
    trip_script_free(&s);
}

static void files_and_texts_are_the_rest_of_the_line(void **state)
{
    (void)state;
    trip_script s = parse("screenshot a picture.png  \ndrop /data/head.trip\npicture p.exr\n"
                          "status s.json\ntype x \xc3\xa9#\nrandom 10000 7\n");
    assert_int_equal(s.count, 4 + 4 + 1);
    assert_int_equal(s.events[0].kind, TRIP_EVENT_SCREENSHOT);
    assert_string_equal(s.events[0].text, "a picture.png");
    assert_int_equal(s.events[1].kind, TRIP_EVENT_DROP);
    assert_string_equal(s.events[1].text, "/data/head.trip");
    assert_int_equal(s.events[2].kind, TRIP_EVENT_PICTURE);
    assert_int_equal(s.events[3].kind, TRIP_EVENT_STATUS);
    static const int typed[] = { 'x', ' ', 0xe9, '#' };
    for (int i = 0; i < 4; i++) {
        assert_int_equal(s.events[4 + i].kind, TRIP_EVENT_TEXT);
        assert_int_equal(s.events[4 + i].code, typed[i]);
    }
    assert_int_equal(s.events[8].count, 10000);
    assert_int_equal(s.events[8].seed, 7);
    trip_script_free(&s);
}

static void a_click_has_a_position_and_a_label(void **state)
{
    (void)state;
    trip_script s = parse("click 0.25 Level of detail\nclick 1\t h  \n");
    assert_int_equal(s.count, 2);
    assert_int_equal(s.events[0].kind, TRIP_EVENT_CLICK);
    assert_true(s.events[0].x == 0.25 && s.events[1].x == 1);
    assert_string_equal(s.events[0].text, "Level of detail");
    assert_string_equal(s.events[1].text, "h");
    trip_script_free(&s);
    assert_refused("set --kernel-radius wide", "does not set settings");
    assert_refused("set --no-such 3", "does not set settings");
    assert_refused("click half Slices", "`half` is not how far along a control");
    assert_refused("click 1.5 Slices", "`1.5` is not how far along a control");
    assert_refused("click 0.5", "label is missing");
    assert_refused("click", "takes 1 words");
}

static void a_locale_with_decimal_commas_has_no_effect(void **state)
{
    (void)state;
    trip_script s;
    const char *text = "move 10.5 20\nclick 0.25 Slices\n";
    need_comma_locale();
    const int status = trip_script_parse(&s, "test", text, strlen(text));
    setlocale(LC_ALL, "C");
    assert_int_equal(status, 0);
    assert_true(s.events[0].x == 10.5 && s.events[1].x == 0.25);
    assert_string_equal(s.events[1].text, "Slices");
    trip_script_free(&s);
}

static void an_invalid_event_is_refused_with_its_line(void **state)
{
    (void)state;
    assert_refused("wait\njump 3\n",
                   "test.script: line 2: `jump` is not an event; triptych-view(1) lists them");
    assert_refused("move 1", "`move` takes 2 words after it, not 1");
    assert_refused("move 1 2 3", "takes 2 words");
    assert_refused("move 1 nan", "`nan` is not a number");
    assert_refused("move 1e9 0", "is not a number up to");
    assert_refused("press top", "is not a button");
    assert_refused("key F", "is not a key");
    assert_refused("key return", "is not a key");
    assert_refused("press left +meta", "`+meta`");
    assert_refused("resize 0 4", "whole number from 1");
    assert_refused("drag left 0 0 1 1 0", "whole number from 1");
    assert_refused("random 1 -1", "whole number from 0");
    assert_refused("screenshot", "takes 1 words");
    assert_refused("type \x1b[2J", "cannot be typed");
    assert_refused("wait a b c d e f g h i j k", "more than 10 words");
    test_catch_reports();
    trip_script s;
    assert_int_equal(trip_script_parse(&s, "zero", "wait\n\0", 6), TRIP_ERROR);
    assert_one_report("zero byte");
}

static void scripts_are_bounded(void **state)
{
    (void)state;
    enum { DRAGS = 120, LINE = 5000 };
    char *text = calloc(1, 64 * DRAGS + LINE + 1), *end = text;
    for (int i = 0; i < DRAGS; i++)
        end += sprintf(end, "drag left 0 0 9 9 10000\n");
    assert_refused(text, "line 105: more than 1048576 events");
    memset(text, 'a', LINE);
    text[LINE] = 0;
    assert_refused(text, "longer than 4095 characters");
    free(text);
}

static void a_script_is_read_from_a_file(void **state)
{
    (void)state;
    trip_script s;
    FILE *f = fopen("tour.script", "w");
    fputs("wait\nclose\n", f);
    fclose(f);
    assert_int_equal(trip_script_load(&s, "tour.script"), 0);
    assert_int_equal(s.count, 2);
    trip_script_free(&s);
    unlink("tour.script");
    test_catch_reports();
    assert_int_equal(trip_script_load(&s, "tour.script"), TRIP_ERROR);
    assert_one_report("tour.script: cannot read");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(lines_become_events_in_order),
        cmocka_unit_test(keys_are_pressed_and_released),
        cmocka_unit_test(a_drag_consists_of_steps),
        cmocka_unit_test(files_and_texts_are_the_rest_of_the_line),
        cmocka_unit_test(a_click_has_a_position_and_a_label),
        cmocka_unit_test(a_locale_with_decimal_commas_has_no_effect),
        cmocka_unit_test(an_invalid_event_is_refused_with_its_line),
        cmocka_unit_test(scripts_are_bounded),
        cmocka_unit_test(a_script_is_read_from_a_file),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
