#include "test.h"

#include <unistd.h>

#include "camera_path.h"

#define PI 3.14159265358979323846

/* Returns a view of (3, 4, 5) from a distance of 10, at an angle around the z axis. */
static trip_navigation around(double degrees)
{
    const triptych_camera camera = { .eye = { 3 + 10 * cos(degrees * PI / 180),
                                              4 + 10 * sin(degrees * PI / 180), 5 },
                                     .look = { 3, 4, 5 },
                                     .up = { 0, 0, 1 },
                                     .fov_degrees = 30 };
    return trip_navigation_from_camera(&camera, NULL);
}

static void add(trip_camera_path *p, double seconds, trip_navigation n, const char *text)
{
    assert_int_equal(trip_camera_path_add(p, seconds, &n, text), 0);
}

static void assert_eye(const trip_navigation *n, double x, double y, double z)
{
    assert_close(n->eye[0], x, 1e-12);
    assert_close(n->eye[1], y, 1e-12);
    assert_close(n->eye[2], z, 1e-12);
}

static void the_path_passes_through_its_keys_exactly(void **state)
{
    (void)state;
    trip_camera_path p = { 0 };
    for (int i = 0; i < 5; i++) {
        trip_navigation n = around(77 * i);
        n.eye[2] += i * i / 3.0;
        n.fov_degrees = 20 + 7.1 * i;
        add(&p, i * 0.7, n, NULL);
    }
    for (int i = 0; i < 5; i++) {
        trip_navigation n = trip_camera_path_view(&p, p.keys[i].seconds);
        assert_memory_equal(&n, &p.keys[i].camera, sizeof n);
    }
    trip_navigation before = trip_camera_path_view(&p, -1), after = trip_camera_path_view(&p, 9);
    assert_memory_equal(&before, &p.keys[0].camera, sizeof before);
    assert_memory_equal(&after, &p.keys[4].camera, sizeof after);
    trip_camera_path_release(&p);
}

/* The keys lie on a circle and have a constant speed. The path must be this circle at this speed,
 * although the times between keys differ. */
static void a_turn_about_an_axis_has_constant_speed(void **state)
{
    (void)state;
    static const double steps[] = { 0, 1, 2.5, 3, 5.5 };
    trip_camera_path p = { 0 };
    for (int i = 0; i < 5; i++)
        add(&p, steps[i], around(60 * steps[i]), NULL);
    for (double s = 0; s <= 5.5; s += 0.1) {
        trip_navigation n = trip_camera_path_view(&p, s);
        trip_navigation expected = around(60 * s);
        assert_eye(&n, expected.eye[0], expected.eye[1], 5);
        assert_close(n.look[0], 3, 1e-14);
        assert_close(n.up[2], 1, 1e-12);
        assert_close(n.fov_degrees, 30, 1e-12);
    }
    trip_camera_path_release(&p);
}

/* Returns a view that is turned about one of the camera's axes. */
static trip_navigation turned(int axis, double degrees)
{
    trip_navigation n = around(20);
    if (axis == 2)
        trip_navigation_roll(&n, degrees);
    else
        trip_navigation_orbit(&n, axis ? degrees : 0, axis ? 0 : degrees);
    return n;
}

/* The two keys are more than a right angle apart. */
static void a_turn_takes_the_shorter_way(void **state)
{
    (void)state;
    for (int i = 0; i < 24; i++) {
        const int axis = i % 3;
        const double degrees = (i % 2 ? -1 : 1) * (100 + 6 * (i / 2));
        trip_camera_path p = { 0 };
        add(&p, 0, turned(axis, 0), NULL);
        add(&p, 2, turned(axis, degrees), NULL);
        const trip_navigation n = trip_camera_path_view(&p, 1), half = turned(axis, degrees / 2);
        assert_eye(&n, half.eye[0], half.eye[1], half.eye[2]);
        for (int a = 0; a < 3; a++)
            assert_close(trip_navigation_get_axes(&n).up[a], trip_navigation_get_axes(&half).up[a],
                         1e-12);
        trip_camera_path_release(&p);
    }
}

static void a_path_of_keys_on_a_line_is_straight(void **state)
{
    (void)state;
    trip_camera_path p = { 0 };
    for (int i = 0; i < 4; i++) {
        trip_navigation n = around(0);
        trip_navigation_fly(&n, 3 * i, 2 * i, -i);
        add(&p, 2 * i, n, NULL);
    }
    for (double s = 0; s <= 6; s += 0.25) {
        trip_navigation n = trip_camera_path_view(&p, s), expected = around(0);
        trip_navigation_fly(&expected, 1.5 * s, s, -s / 2);
        assert_eye(&n, expected.eye[0], expected.eye[1], expected.eye[2]);
    }
    trip_camera_path_release(&p);
}

/* Each key is nearer by the same factor, so that the distance falls exponentially. */
static void distances_are_interpolated_exponentially(void **state)
{
    (void)state;
    trip_camera_path p = { 0 };
    for (int i = 0; i < 4; i++) {
        trip_navigation n = around(40);
        trip_navigation_dolly(&n, pow(0.5, i), n.look);
        n.ortho_height = 8 * pow(0.5, i);
        add(&p, i, n, NULL);
    }
    for (double s = 0; s <= 3; s += 0.2) {
        trip_navigation n = trip_camera_path_view(&p, s);
        assert_close(trip_navigation_distance(&n), 10 * pow(0.5, s), 1e-12);
        assert_close(n.ortho_height, 8 * pow(0.5, s), 1e-12);
    }
    trip_camera_path_release(&p);
}

/* The derivatives on both sides of a key agree. */
static void the_eye_passes_keys_smoothly(void **state)
{
    (void)state;
    trip_camera_path p = { 0 };
    for (int i = 0; i < 6; i++) {
        trip_navigation n = around(50 * i + 20 * (i % 2));
        n.look[2] += i % 3;
        n.eye[0] += sin(i);
        add(&p, i + 0.3 * (i % 2), n, NULL);
    }
    const double h = 1e-5;
    for (int i = 1; i < 5; i++) {
        double at = p.keys[i].seconds;
        trip_navigation a = trip_camera_path_view(&p, at - h), b = p.keys[i].camera;
        trip_navigation c = trip_camera_path_view(&p, at + h);
        for (int k = 0; k < 3; k++)
            assert_close((b.look[k] - a.look[k]) / h, (c.look[k] - b.look[k]) / h, 2e-3);
    }
    trip_camera_path_release(&p);
}

/* Every turn between two keys ends at the second key, including a half turn. */
static void turns_end_at_their_keys(void **state)
{
    (void)state;
    for (int i = 0; i < 300; i++) {
        trip_camera_path p = { 0 };
        trip_navigation n[2];
        for (int k = 0; k < 2; k++) {
            n[k] = around(i == 0 ? 180 * k : 360 * test_random());
            if (i > 0)
                trip_navigation_orbit(&n[k], 0, 360 * test_random());
            if (i > 0)
                trip_navigation_roll(&n[k], 360 * test_random());
            add(&p, k, n[k], NULL);
        }
        trip_navigation end = trip_camera_path_view(&p, 1 - 1e-12);
        trip_navigation_axes got = trip_navigation_get_axes(&end);
        trip_navigation_axes expected = trip_navigation_get_axes(&n[1]);
        for (int k = 0; k < 3; k++) {
            assert_close(got.right[k], expected.right[k], 1e-9);
            assert_close(got.up[k], expected.up[k], 1e-9);
        }
        trip_camera_path_release(&p);
    }
}

static void frames_divide_the_time_equally(void **state)
{
    (void)state;
    trip_camera_path p = { .frames_per_second = 10 };
    assert_int_equal(trip_camera_path_frames(&p), 0);
    add(&p, 1, around(0), NULL);
    assert_int_equal(trip_camera_path_frames(&p), 1);
    assert_close(trip_camera_path_seconds(&p, 0), 1, 0);
    add(&p, 3, around(20), NULL);
    assert_int_equal(trip_camera_path_frames(&p), 21);
    assert_close(trip_camera_path_seconds(&p, 5), 1.5, 1e-15);
    assert_true(trip_camera_path_seconds(&p, 20) == 3);
    p.frames_per_second = 0;
    assert_int_equal(trip_camera_path_frames(&p), 61);
    test_catch_reports();
    trip_navigation n = around(0);
    assert_int_equal(trip_camera_path_add(&p, 3, &n, NULL), TRIP_USAGE);
    assert_one_report("must be later");
    trip_camera_path_release(&p);
}

static void transfer_functions_are_mixed_between_keys_that_have_one(void **state)
{
    (void)state;
    trip_camera_path p = { 0 };
    static const char *const texts[] = { NULL, "a", NULL, "b", NULL };
    for (int i = 0; i < 5; i++)
        add(&p, i, around(i), texts[i]);
    static const struct {
        double seconds;
        int from, to;
        double t;
    } mixes[] = { { 0, -1, -1, 0 },     { 0.25, -1, 1, 0.25 }, { 1, 1, 1, 0 },   { 1.5, 1, 1, 0 },
                  { 2.75, 1, 3, 0.75 }, { 3, 3, 3, 0 },        { 3.5, 3, 3, 0 }, { 9, 3, 3, 0 } };
    for (size_t i = 0; i < sizeof mixes / sizeof *mixes; i++) {
        trip_path_mix mix = trip_camera_path_mix(&p, mixes[i].seconds);
        assert_int_equal(mix.from, mixes[i].from);
        assert_int_equal(mix.to, mixes[i].to);
        assert_close(mix.t, mixes[i].t, 1e-15);
    }
    trip_camera_path_release(&p);
}

static void a_path_is_read_as_it_was_written(void **state)
{
    (void)state;
    trip_camera_path p = { .frames_per_second = 24 }, q = { 0 };
    for (int i = 0; i < 20; i++) {
        trip_navigation n = around(360 * test_random());
        trip_navigation_orbit(&n, 0, 100 * test_random());
        memset(n.upright, 0, sizeof n.upright);
        add(&p, i / 3.0, n, i % 4 == 1 ? "0 0 0 0 0\n" : NULL);
    }
    p.keys[2].function = strdup("bone");
    assert_int_equal(trip_camera_path_save(&p, "path.json"), 0);
    assert_int_equal(trip_camera_path_load(&q, "path.json"), 0);
    unlink("path.json");
    assert_int_equal(q.count, 20);
    assert_true(q.frames_per_second == 24);
    for (int i = 0; i < 20; i++) {
        assert_memory_equal(&q.keys[i].camera, &p.keys[i].camera, sizeof p.keys[i].camera);
        assert_true(q.keys[i].seconds == p.keys[i].seconds);
        assert_int_equal(q.keys[i].text != NULL, i % 4 == 1);
    }
    assert_string_equal(q.keys[2].function, "bone");
    trip_camera_path_release(&p);
    trip_camera_path_release(&q);
}

#define KEY(seconds, more)                                                                         \
    "{\"seconds\": " seconds ", \"eye\": [0,0,1], \"look\": [0,0,0], \"up\": [0,1,0], " more "}"
#define PATH(keys) "{\"triptych_path\": 1, \"keys\": [" keys "]}"

static void assert_refused(const char *text, const char *why)
{
    trip_camera_path p = { 0 };
    test_catch_reports();
    if (trip_camera_path_parse(&p, "flight.json", text) != TRIP_ERROR)
        fail_msg("taken: %s", text);
    assert_one_report(why);
    assert_null(p.keys);
}

static void an_invalid_path_is_refused_with_the_key(void **state)
{
    (void)state;
    trip_camera_path p = { 0 };
    assert_int_equal(trip_camera_path_parse(&p, "f", PATH(KEY("0", "\"fov\": 30"))), 0);
    trip_camera_path_release(&p);
    assert_refused("", "line 1: incomplete JSON");
    assert_refused("{\n\"triptych_path\": 1,\n\"keys\": [", "line 3: incomplete JSON");
    assert_refused("{\n\"triptych_path\": 1,\n\"keys\"; []}\n", "line 3: invalid JSON");
    assert_refused(PATH(KEY("0", "\"fov\": 30")) "\n\n}", "line 3: text after the end");
    assert_refused(PATH(KEY("0", "\"fov\": 30, \"zoom\": 3")), "key 1: unknown member \"zoom\"");
    assert_refused(PATH(KEY("0", "\"fov\": 30, \"clip\": {\"boxes\": []}")),
                   "key 1, \"clip\": unknown member \"boxes\"");
    assert_refused(PATH(KEY("0", "\"fov\": 30, \"fov\": 40")), "key 1: duplicate member \"fov\"");
    assert_refused("{\"looop\": 3, \"triptych_path\": 1, \"keys\": [" KEY("0", "\"fov\": 3") "]}",
                   "unknown member \"looop\"");
    assert_refused("[]", "is not a camera path");
    assert_refused("{\"triptych_path\": 2}", "has version 2");
    assert_refused("{\"triptych_path\": 1}", "must have 1 to");
    assert_refused(PATH(""), "must have 1 to");
    assert_refused(PATH("3"), "key 1: is not an object");
    assert_refused(PATH(KEY("\"0\"", "\"fov\": 30")), "key 1: \"seconds\" must be a time");
    assert_refused(PATH(KEY("1e999", "\"fov\": 30")), "key 1: \"seconds\" must be a time");
    assert_refused(PATH(KEY("0", "\"fov\": 180")), "\"fov\" must be from");
    assert_refused(PATH(KEY("0", "\"ortho\": 0")), "\"ortho\" must be a height");
    assert_refused(PATH(KEY("0", "\"x\": 0")), "either \"fov\" or \"ortho\"");
    assert_refused(PATH(KEY("0", "\"fov\": 3, \"ortho\": 3")), "either \"fov\" or \"ortho\"");
    assert_refused(PATH(KEY("0", "\"fov\": 3") "," KEY("0", "\"fov\": 3")), "key 2: must be later");
    assert_refused(PATH(KEY("0", "\"fov\": 3") "," KEY("1", "\"ortho\": 3")), "must be parallel");
    assert_refused(PATH(KEY("0", "\"fov\": 3, \"function\": 4")), "must be texts");
    assert_refused(PATH(KEY("0", "\"fov\": 3, \"function\": \"a\", \"function_text\": \"b\"")),
                   "exclude one another");
    assert_refused(PATH("{\"seconds\": 0, \"eye\": [0,0], \"fov\": 3}"), "three numbers");
    assert_refused(PATH("{\"seconds\": 0, \"eye\": [0,0,1], \"look\": [0,0,1], \"up\": [0,1,0], "
                        "\"fov\": 3}"),
                   "is no view");
    assert_refused(PATH("{\"seconds\": 0, \"eye\": [0,0,1], \"look\": [0,0,0], \"up\": [0,0,7], "
                        "\"fov\": 3}"),
                   "is no view");
    assert_refused(PATH(KEY("0", "\"fov\": 3") "," KEY("100000", "\"fov\": 3")), "frames or more");
}

static void a_loop_continues_from_the_last_key_to_the_first(void **state)
{
    (void)state;
    trip_camera_path p = { .frames_per_second = 10, .loop_seconds = 1 };
    for (int i = 0; i < 4; i++)
        add(&p, 2 + i, around(90 * i), NULL);
    assert_int_equal(trip_camera_path_frames(&p), 40);
    for (int i = 0; i < 40; i++) {
        double seconds = trip_camera_path_seconds(&p, i), turn = (seconds - 2) * PI / 2;
        trip_navigation n = trip_camera_path_view(&p, seconds);
        assert_close(seconds, 2 + 0.1 * i, 1e-12);
        assert_eye(&n, 3 + 10 * cos(turn), 4 + 10 * sin(turn), 5);
    }
    trip_navigation end = trip_camera_path_view(&p, 6);
    assert_memory_equal(&end, &p.keys[0].camera, sizeof end);
    char *text = trip_camera_path_print(&p), *again;
    trip_camera_path q = { 0 };
    assert_int_equal(trip_camera_path_parse(&q, "q", text), 0);
    assert_string_equal(text, again = trip_camera_path_print(&q));
    assert_true(q.loop_seconds == 1);
    free(text);
    free(again);
    trip_camera_path_release(&p);
    trip_camera_path_release(&q);
}

static void a_loop_mixes_the_last_transfer_function_with_the_first(void **state)
{
    (void)state;
    trip_camera_path p = { .loop_seconds = 2 };
    add(&p, 0, around(0), "first");
    add(&p, 1, around(90), "second");
    trip_path_mix mix = trip_camera_path_mix(&p, 1.5);
    assert_int_equal(mix.from, 1);
    assert_int_equal(mix.to, 0);
    assert_close(mix.t, 0.25, 1e-12);
    trip_camera_path_release(&p);
}

static const char cutting[] =
    "{ \"triptych_path\": 1, \"keys\": ["
    "{ \"seconds\": 0, \"eye\": [9,0,0], \"look\": [0,0,0], \"up\": [0,0,1], \"fov\": 30 },"
    "{ \"seconds\": 1, \"eye\": [9,0,0], \"look\": [0,0,0], \"up\": [0,0,1], \"fov\": 30,"
    "  \"clip\": { \"box\": [0,1,2,10,11,12], \"voxels\": true, \"planes\": [[1,0,0,-4]] } },"
    "{ \"seconds\": 3, \"eye\": [9,0,0], \"look\": [0,0,0], \"up\": [0,0,1], \"fov\": 30,"
    "  \"clip\": { \"box\": [4,1,2,8,11,13], \"voxels\": true, \"planes\": [[0,1,0,2]] } },"
    "{ \"seconds\": 4, \"eye\": [9,0,0], \"look\": [0,0,0], \"up\": [0,0,1], \"fov\": 30 },"
    "{ \"seconds\": 5, \"eye\": [9,0,0], \"look\": [0,0,0], \"up\": [0,0,1], \"fov\": 30,"
    "  \"clip\": {} } ] }";

static void boxes_and_planes_move_between_keys(void **state)
{
    (void)state;
    trip_camera_path p = { 0 };
    triptych_clip c;
    assert_int_equal(trip_camera_path_parse(&p, "p", cutting), 0);
    assert_false(trip_camera_path_clip(&p, 0.9, &c));
    assert_true(trip_camera_path_clip(&p, 1.5, &c)); /* a quarter of the way */
    assert_true(c.box && c.box_of_voxels && c.planes == 1);
    assert_close(c.box_lo[0], 1, 1e-12);
    assert_close(c.box_hi[0], 9.5, 1e-12);
    assert_close(c.box_hi[2], 12.25, 1e-12);
    assert_close(c.plane[0][0], 0.75, 1e-12);
    assert_close(c.plane[0][1], 0.25, 1e-12);
    assert_close(c.plane[0][3], -2.5, 1e-12);
    assert_true(trip_camera_path_clip(&p, 4.9, &c)); /* the clipping of key 3 holds */
    assert_true(c.box && c.box_lo[0] == 4 && c.plane[0][1] == 1);
    assert_true(trip_camera_path_clip(&p, 5, &c));
    assert_true(!c.box && c.planes == 0);
    char *text = trip_camera_path_print(&p), *again;
    trip_camera_path q = { 0 };
    assert_int_equal(trip_camera_path_parse(&q, "q", text), 0);
    assert_string_equal(text, again = trip_camera_path_print(&q));
    free(text);
    free(again);
    trip_camera_path_release(&p);
    trip_camera_path_release(&q);
}

static void invalid_clips_are_refused(void **state)
{
    (void)state;
    static const char *const clips[][2] = {
        { "[0,1,2,10,11,12]", "[0,1,2,10,11,2]" },
        { "[0,1,2,10,11,12]", "[0,1,2]" },
        { "[[1,0,0,-4]]", "[[0,0,0,-4]]" },
        { "[[1,0,0,-4]]", "[[1,0,0]]" },
        { "[[1,0,0,-4]]", "[1]" },
        { "\"clip\": {}", "\"clip\": 3" },
        { "true", "1" },
        { "[[1,0,0,-4]]",
          "[[1,0,0,1],[1,0,0,1],[1,0,0,1],[1,0,0,1],[1,0,0,1],[1,0,0,1],[1,0,0,1]]" },
    };
    for (size_t i = 0; i < sizeof clips / sizeof *clips; i++) {
        const char *at = strstr(cutting, clips[i][0]);
        char *text;
        trip_camera_path p = { 0 };
        assert_non_null(at);
        assert_true(asprintf(&text, "%.*s%s%s", (int)(at - cutting), cutting, clips[i][1],
                             at + strlen(clips[i][0])) > 0);
        test_catch_reports();
        assert_int_equal(trip_camera_path_parse(&p, "p", text), TRIP_ERROR);
        assert_one_report("clip");
        free(text);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_path_passes_through_its_keys_exactly),
        cmocka_unit_test(a_turn_about_an_axis_has_constant_speed),
        cmocka_unit_test(a_turn_takes_the_shorter_way),
        cmocka_unit_test(a_path_of_keys_on_a_line_is_straight),
        cmocka_unit_test(distances_are_interpolated_exponentially),
        cmocka_unit_test(the_eye_passes_keys_smoothly),
        cmocka_unit_test(turns_end_at_their_keys),
        cmocka_unit_test(frames_divide_the_time_equally),
        cmocka_unit_test(transfer_functions_are_mixed_between_keys_that_have_one),
        cmocka_unit_test(a_path_is_read_as_it_was_written),
        cmocka_unit_test(an_invalid_path_is_refused_with_the_key),
        cmocka_unit_test(a_loop_continues_from_the_last_key_to_the_first),
        cmocka_unit_test(a_loop_mixes_the_last_transfer_function_with_the_first),
        cmocka_unit_test(boxes_and_planes_move_between_keys),
        cmocka_unit_test(invalid_clips_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
