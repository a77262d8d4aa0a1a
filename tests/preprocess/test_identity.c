/* The texts of the options name every option that changes the data set, and no other option. The
 * options for kept values are in the second text alone. */
#include "brick_files.h"

#include "identity.h"

static char *text_of(const trip_brick_params *p)
{
    char *form, *kept, *text;
    assert_int_equal(trip_brick_form_text(p, &form), 0);
    assert_int_equal(trip_brick_kept_text(p, &kept), 0);
    assert_true(asprintf(&text, "%s|%s", form, kept) > 0);
    free(form);
    free(kept);
    return text;
}

static const trip_value_range ranges[] = { { 1, 2 }, { 1, 3 }, { 0, 2 } };
static const char *const functions[] = { "ct", "mr" };

/* Each entry leads to a data set that differs from all others. */
static const trip_brick_params different[] = {
    { 0 },
    { .volume.grid = "a" },
    { .volume.level_set = TRIP_LEVEL_SET_BAND },
    { .volume.raw_dims = { 7, 8, 9 } },
    { .volume.raw_dims = { 9, 8, 7 } },
    { .volume.raw_type = "int8" },
    { .volume.raw_endian = 1 },
    { .volume.raw_endian = 2 },
    { .volume.raw_offset_bytes = 1 },
    { .volume.allow_gaps = true },
    { .volume.channel = 1 },
    { .volume.time = 1 },
    { .volume.series = 2 },
    { .volume.time = 2 },
    { .volume.coordinates = "x,y,z" },
    { .volume.spacing = { 1, 1, 2 } },
    { .volume.spacing = { 2, 1, 1 } },
    { .volume.axes = "PIR" },
    { .volume.fill = "none" },
    { .volume.fill = "-9999" },
    { .volume.max_voxels = 1000 },
    { .functions = functions, .function_count = 1 },
    { .functions = functions + 1, .function_count = 1 },
    { .functions = functions, .function_count = 2 },
    { .functions = functions, .function_count = 1, .automatic = true },
    { .ranges = ranges, .range_count = 1 },
    { .ranges = ranges + 1, .range_count = 1 },
    { .ranges = ranges + 2, .range_count = 1 },
    { .ranges = ranges, .range_count = 2 },
    { .keep_all = true },
    { .region.first = { 1, 0, 0 } },
    { .region.first = { 0, 0, 1 } },
    { .region.past = { 1, 0, 0 } },
    { .region.past = { 0, 0, 1 } },
    { .code_bits = TRIP_CODE_BITS_8 },
    { .code_bits = TRIP_CODE_BITS_16 },
    { .normals = TRIP_NORMALS_COMPACT },
    { .normals = TRIP_NORMALS_FULL },
    { .normals = TRIP_NORMALS_NONE },
    { .levels = 1 },
    { .levels = -1 },
    { .levels_for = TRIP_LEVELS_FOR_PRE },
    { .levels_for = TRIP_LEVELS_FOR_BOTH },
    { .no_halo = true },
    { .tile_voxels = 32 },
    { .slab_sheets = 4 },
};

enum { COUNT = sizeof different / sizeof *different };

static void every_relevant_option_changes_the_text(void **state)
{
    (void)state;
    char *texts[COUNT];
    for (int i = 0; i < COUNT; i++) {
        texts[i] = text_of(&different[i]);
        for (int j = 0; j < i; j++)
            if (strcmp(texts[i], texts[j]) == 0)
                fail_msg("options %d and %d have one text: %s", i, j, texts[i]);
    }
    for (int i = 0; i < COUNT; i++)
        free(texts[i]);
}

/* Compares both texts with the texts of the defaults. */
static void options_for_kept_values_are_in_their_own_text(void **state)
{
    (void)state;
    char *form, *kept;
    assert_int_equal(trip_brick_form_text(&different[0], &form), 0);
    assert_int_equal(trip_brick_kept_text(&different[0], &kept), 0);
    for (int i = 1; i < COUNT; i++) {
        const trip_brick_params *p = &different[i];
        const bool keeps = p->keep_all || p->automatic || p->function_count || p->range_count;
        char *other_form, *other_kept;
        assert_int_equal(trip_brick_form_text(p, &other_form), 0);
        assert_int_equal(trip_brick_kept_text(p, &other_kept), 0);
        assert_int_equal(!strcmp(form, other_form), keeps);
        assert_int_equal(!strcmp(kept, other_kept), !keeps);
        free(other_form);
        free(other_kept);
    }
    free(form);
    free(kept);
}

static void irrelevant_options_leave_the_text_unchanged(void **state)
{
    (void)state;
    static const trip_brick_params alike[] = {
        { .input = "a", .output = "b" },
        { .replace = true, .resume = true },
        { .memory_bytes = 1 << 30, .threads = 3, .slices = 5, .max_bytes = 1 },
        { .levels_for = TRIP_LEVELS_FOR_POST }, /* the default */
    };
    char *text = text_of(&different[0]);
    for (size_t i = 0; i < sizeof alike / sizeof *alike; i++) {
        char *other = text_of(&alike[i]);
        assert_string_equal(other, text);
        free(other);
    }
    free(text);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_relevant_option_changes_the_text),
        cmocka_unit_test(options_for_kept_values_are_in_their_own_text),
        cmocka_unit_test(irrelevant_options_leave_the_text_unchanged),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
