#include "test.h"

#include <string.h>

#include "scene.h"

static const trip_scene_choice *choice_of(int row)
{
    for (int i = 0; i < TRIP_SCENE_CHOICES; i++)
        if (trip_scene_choices[i].row == row)
            return &trip_scene_choices[i];
    fail_msg("row %d has no choice", row);
    return NULL;
}

static void every_order_of_the_library_is_an_entry(void **state)
{
    (void)state;
    const triptych_scene scene = { .degree = 3, .clouds = 1 }, other = { .degree = 3 };
    const char *const *names = draw_settings_table.rows[DRAW_ORDER].choices;
    trip_scene_entry e[TRIP_SCENE_ENTRIES];
    int chosen, count = 0;
    while (names[count])
        count++;
    draw_settings s = { 0 };
    assert_int_equal(trip_scene_entries(choice_of(DRAW_ORDER), &scene, &s, e, &chosen), count);
    assert_string_equal(e[chosen].value, "deferred");
    assert_int_equal(trip_scene_entries(choice_of(DRAW_ORDER), &other, &s, e, &chosen), count - 1);
    assert_string_equal(e[chosen].value, "depth");
    trip_scene_entries(choice_of(DRAW_ORDER), &scene, &s, e, &chosen);
    for (int i = 0; i < count; i++) {
        int again;
        assert_string_equal(e[i].value, names[i]);
        trip_scene_choose(choice_of(DRAW_ORDER), &e[i], &s);
        assert_int_equal(s.scene.order, TRIPTYCH_ORDER_DEPTH + i);
        trip_scene_entries(choice_of(DRAW_ORDER), &scene, &s, e, &again);
        assert_int_equal(again, i);
    }
}

static void deferred_clouds_have_sides(void **state)
{
    (void)state;
    const triptych_scene cloud = { .clouds = 1 }, other = { .degree = 3 };
    const trip_scene_choice *sides = choice_of(DRAW_SIDES);
    trip_scene_entry e[TRIP_SCENE_ENTRIES];
    draw_settings s = { 0 };
    int chosen;
    assert_int_equal(trip_scene_entries(sides, &other, &s, e, &chosen), 0);
    assert_int_equal(trip_scene_entries(sides, &cloud, &s, e, &chosen), 2);
    assert_string_equal(e[chosen].value, "both");
    trip_scene_choose(sides, &e[1], &s);
    assert_int_equal(s.scene.sides, TRIPTYCH_SIDES_FRONT);
    s.scene.order = TRIPTYCH_ORDER_DEFERRED;
    assert_int_equal(trip_scene_entries(sides, &cloud, &s, e, &chosen), 2);
    assert_string_equal(e[chosen].value, "front");
    s.scene.order = TRIPTYCH_ORDER_DEPTH;
    assert_int_equal(trip_scene_entries(sides, &cloud, &s, e, &chosen), 0);
    draw_settings_drop_kind(&s, DRAW_KIND_CLOUD);
    assert_int_equal(s.scene.sides, TRIPTYCH_SIDES_DEFAULT);
}

static void entries_that_a_scene_lacks_are_left_out(void **state)
{
    (void)state;
    static const char *const kernels[] = { "", "exact", "ewa" }, *const degrees[] = { "", "0",
                                                                                      "1" };
    const triptych_scene scene = { .degree = 2 }, plain = { .degree = 0 };
    trip_scene_entry e[TRIP_SCENE_ENTRIES];
    draw_settings s = { .splat.footprint = TRIPTYCH_FOOTPRINT_EWA };
    int chosen;
    assert_int_equal(trip_scene_entries(choice_of(DRAW_FOOTPRINT), &scene, &s, e, &chosen), 3);
    assert_int_equal(chosen, 2);
    assert_string_equal(e[0].label, "As trained");
    for (int i = 0; i < 3; i++)
        assert_string_equal(e[i].value, kernels[i]);
    trip_scene_choose(choice_of(DRAW_FOOTPRINT), &e[0], &s);
    assert_int_equal(s.splat.footprint, TRIPTYCH_FOOTPRINT_DEFAULT);
    assert_int_equal(trip_scene_entries(choice_of(DRAW_HARMONICS), &scene, &s, e, &chosen), 3);
    assert_int_equal(chosen, 0);
    for (int i = 0; i < 3; i++)
        assert_string_equal(e[i].value, degrees[i]);
    trip_scene_choose(choice_of(DRAW_HARMONICS), &e[2], &s);
    assert_int_equal(s.scene.harmonics, TRIPTYCH_HARMONICS_1);
    assert_true(trip_scene_entries(choice_of(DRAW_HARMONICS), &plain, &s, e, &chosen) < 2);
}

static void the_line_has_count_order_time_and_memory(void **state)
{
    (void)state;
    const triptych_scene scene = { .gaussians = 250000 };
    const draw_settings s = { .scene.order = TRIPTYCH_ORDER_LISTS };
    const trip_frames_status status = {
        .whole_ms = 89.4, .stats = { .peak_memory_bytes = 64400000, .memory_bytes = 2000000000 }
    };
    char text[160], cut[12];
    trip_scene_say(&scene, &s, NULL, text, sizeof text);
    assert_string_equal(text, "250000 Gaussians by lists");
    trip_scene_say(&scene, &s, &status, text, sizeof text);
    assert_string_equal(text, "250000 Gaussians by lists, 89 ms, 64.4 MB of 2.00 GB");
    trip_scene_say(&scene, &s, &status, cut, sizeof cut);
    assert_string_equal(cut, "250000 Gaus");
}

static void objects_have_only_the_entries_that_apply_to_all(void **state)
{
    (void)state;
    static const draw_settings none = { .has_background = 0 };
    const triptych_scene scenes = { .gaussians = 9, .objects = 2, .moved = 1 };
    const triptych_scene both = { .gaussians = 9, .objects = 3, .volumes = 1, .moved = 1 };
    const triptych_scene volumes = { .objects = 2, .volumes = 2, .moved = 1 };
    trip_scene_entry e[TRIP_SCENE_ENTRIES];
    int chosen;
    assert_int_equal(trip_scene_entries(choice_of(DRAW_ORDER), &scenes, &none, e, &chosen), 2);
    assert_string_equal(e[1].value, "lists");
    assert_int_equal(trip_scene_entries(choice_of(DRAW_FOOTPRINT), &scenes, &none, e, &chosen), 3);
    assert_int_equal(trip_scene_entries(choice_of(DRAW_ORDER), &both, &none, e, &chosen), 1);
    assert_int_equal(trip_scene_entries(choice_of(DRAW_FOOTPRINT), &both, &none, e, &chosen), 3);
    for (int i = 0; i < TRIP_SCENE_CHOICES; i++)
        assert_true(trip_scene_entries(&trip_scene_choices[i], &volumes, &none, e, &chosen) < 2);
}

static void the_line_names_the_objects(void **state)
{
    (void)state;
    static const draw_settings none = { .has_background = 0 };
    static const struct {
        triptych_scene scene;
        const char *says;
    } cases[] = {
        { { .gaussians = 7, .objects = 1 }, "7 Gaussians by depth" },
        { { .gaussians = 7, .objects = 2 }, "2 scenes, 7 Gaussians by depth" },
        { { .gaussians = 7, .objects = 2, .volumes = 1 },
          "1 volume and 1 scene, 7 Gaussians by depth" },
        { { .gaussians = 7, .objects = 5, .volumes = 2 },
          "2 volumes and 3 scenes, 7 Gaussians by depth" },
        { { .objects = 2, .volumes = 2 }, "2 volumes" },
    };
    char text[160];
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        trip_scene_say(&cases[i].scene, &none, NULL, text, sizeof text);
        assert_string_equal(text, cases[i].says);
    }
}

static void the_bounds_are_those_that_views_fit(void **state)
{
    (void)state;
    const triptych_scene scene = { .lo = { -9, -9, -9 },
                                   .hi = { 9, 9, 9 },
                                   .typical_lo = { -1, 2, 3 },
                                   .typical_hi = { 4, 5, 6 } };
    const triptych_info info = trip_scene_bounds(&scene);
    assert_memory_equal(info.lo, scene.typical_lo, sizeof info.lo);
    assert_memory_equal(info.hi, scene.typical_hi, sizeof info.hi);
    assert_memory_equal(info.edges[1], scene.typical_hi, sizeof info.hi);
    assert_true(info.index_to_world[1][1] == 1 && info.index_to_world[1][0] == 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_order_of_the_library_is_an_entry),
        cmocka_unit_test(deferred_clouds_have_sides),
        cmocka_unit_test(entries_that_a_scene_lacks_are_left_out),
        cmocka_unit_test(the_line_has_count_order_time_and_memory),
        cmocka_unit_test(objects_have_only_the_entries_that_apply_to_all),
        cmocka_unit_test(the_line_names_the_objects),
        cmocka_unit_test(the_bounds_are_those_that_views_fit),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
