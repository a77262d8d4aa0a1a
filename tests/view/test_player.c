#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>
#include <cmocka.h>

#include "player.h"

/* A window that records the actions of a script. `restful` counts the calls of rests() until it
 * returns true, and `looks` the calls of find() while the control moves. */
typedef struct fake {
    trip_event events[64];
    int count, restful, looks;
    bool resized, unsaved;
    const char *shot, *saved, *reported;
} fake;

static void send(void *user, const trip_event *e)
{
    fake *f = user;
    assert_true(f->count < 64);
    f->events[f->count++] = *e;
}

static bool rests(void *user)
{
    fake *f = user;
    return f->restful-- <= 0;
}

static bool has_size(void *user, int width, int height)
{
    const fake *f = user;
    return f->resized && width == 300 && height == 200;
}

/* The control first moves, then stays. */
static bool find(void *user, const char *label, double box[4])
{
    fake *f = user;
    const double y = f->looks > 0 ? 100 + 50 * f->looks : 100;
    assert_string_equal(label, "Some control");
    memcpy(box, (double[4]){ 10, y, 30, y + 20 }, 4 * sizeof *box);
    return f->looks-- <= 2;
}

static void shoot(void *user, const char *path)
{
    ((fake *)user)->shot = path;
}

static void save(void *user, const char *path)
{
    ((fake *)user)->saved = path;
}

static int saved(void *user)
{
    const fake *f = user;
    return f->unsaved ? -1 : 0;
}

static int report(void *user, const char *path)
{
    ((fake *)user)->reported = path;
    return 0;
}

static trip_player_window window_of(fake *f)
{
    return (trip_player_window){ f, send, rests, has_size, find, shoot, save, saved, report };
}

static trip_player load(const char *text)
{
    trip_player p = { .width = 300, .height = 200 };
    assert_int_equal(trip_script_parse(&p.script, "script", text, strlen(text)), 0);
    return p;
}

static void each_step_sends_one_event_in_order(void **state)
{
    (void)state;
    fake f = { 0 };
    const trip_player_window w = window_of(&f);
    trip_player p = load("move 3 4\npress left\nrelease left\nstatus x\n");
    for (int i = 1; i <= 3; i++) {
        assert_int_equal(trip_player_step(&p, &w, i), 1);
        assert_int_equal(f.count, i);
    }
    assert_true(f.events[0].kind == TRIP_EVENT_MOVE && f.events[0].x == 3 && f.events[0].y == 4);
    assert_true(f.events[1].down && !f.events[2].down);
    assert_int_equal(trip_player_step(&p, &w, 4), 1);
    assert_string_equal(f.reported, "x");
    assert_int_equal(trip_player_step(&p, &w, 5), 0);
    trip_script_free(&p.script);
}

static void wait_and_sleep_delay_the_next_event(void **state)
{
    (void)state;
    fake f = { .restful = 3 };
    const trip_player_window w = window_of(&f);
    trip_player p = load("wait\nsleep 500\nmove 1 1\n");
    for (int i = 0; i < 4; i++)
        assert_int_equal(trip_player_step(&p, &w, 1 + i * 0.001), 1);
    assert_true(f.restful < 0);
    for (int i = 0; i < 10; i++) {
        assert_int_equal(trip_player_step(&p, &w, 2 + i * 0.05), 1);
        assert_int_equal(f.count, 0);
    }
    trip_player_step(&p, &w, 2.51);
    trip_player_step(&p, &w, 2.52);
    assert_int_equal(f.count, 1);
    trip_script_free(&p.script);
}

static void a_control_is_pressed_once_it_no_longer_moves(void **state)
{
    (void)state;
    fake f = { .looks = 5 };
    const trip_player_window w = window_of(&f);
    trip_player p = load("click 0.25 Some control\n");
    for (int i = 0; i < 30 && trip_player_step(&p, &w, 1 + i * 0.01) > 0; i++)
        ;
    assert_int_equal(f.count, 3);
    assert_true(f.events[0].kind == TRIP_EVENT_MOVE && f.events[0].x == 15 && f.events[0].y == 110);
    assert_true(f.events[1].kind == TRIP_EVENT_BUTTON && f.events[1].down);
    assert_true(f.events[2].kind == TRIP_EVENT_BUTTON && !f.events[2].down);
    trip_script_free(&p.script);
}

static void a_missing_control_ends_the_script(void **state)
{
    (void)state;
    fake f = { .looks = 1000 };
    const trip_player_window w = window_of(&f);
    trip_player p = load("click 0.25 Some control\n");
    assert_int_equal(trip_player_step(&p, &w, 1), 1);
    assert_true(trip_player_step(&p, &w, 12) < 0);
    assert_int_equal(f.count, 0);
    trip_script_free(&p.script);
}

static void a_picture_that_cannot_be_written_ends_the_script(void **state)
{
    (void)state;
    for (int unsaved = 0; unsaved < 2; unsaved++) {
        fake f = { .restful = 2, .unsaved = unsaved };
        const trip_player_window w = window_of(&f);
        trip_player p = load("picture x.png\n");
        assert_int_equal(trip_player_step(&p, &w, 1), 1);
        assert_string_equal(f.saved, "x.png");
        assert_int_equal(trip_player_step(&p, &w, 2), 1);
        assert_int_equal(trip_player_step(&p, &w, 3), unsaved ? -1 : 1);
        trip_script_free(&p.script);
    }
}

static void random_events_depend_on_the_seed_and_do_not_quit(void **state)
{
    (void)state;
    uint64_t a = 5, b = 5, c = 6;
    int different = 0;
    for (int i = 0; i < 20000; i++) {
        const trip_event x = trip_player_random(&a, 300, 200), y = trip_player_random(&b, 300, 200);
        const trip_event z = trip_player_random(&c, 300, 200);
        assert_true(x.kind == y.kind && x.x == y.x && x.y == y.y && x.code == y.code &&
                    x.down == y.down && x.modifiers == y.modifiers);
        different += x.kind != z.kind || x.x != z.x;
        assert_true(x.kind != TRIP_EVENT_CLOSE && x.kind < TRIP_EVENT_WAIT && !x.text);
        assert_true(x.kind != TRIP_EVENT_KEY ||
                    (x.code != 'q' && x.code != TRIP_KEY_ESCAPE && x.code != 'p'));
    }
    assert_true(different > 1000);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(each_step_sends_one_event_in_order),
        cmocka_unit_test(wait_and_sleep_delay_the_next_event),
        cmocka_unit_test(a_control_is_pressed_once_it_no_longer_moves),
        cmocka_unit_test(a_missing_control_ends_the_script),
        cmocka_unit_test(a_picture_that_cannot_be_written_ends_the_script),
        cmocka_unit_test(random_events_depend_on_the_seed_and_do_not_quit),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
