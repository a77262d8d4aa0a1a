#include "volume_files.h"

static const trip_volume_params sample_size = { .raw_dims = { NX, NY, NZ } };

static trip_volume_params with_type(trip_scalar type, int endian)
{
    trip_volume_params p = sample_size;
    p.raw_type = trip_scalar_name(type);
    p.raw_endian = endian;
    return p;
}

static void every_type_is_read_in_both_byte_orders(void **state)
{
    (void)state;
    for (int t = 0; t < TRIP_SCALARS; t++)
        for (int endian = 1; endian <= 2; endian++) {
            bytes b = { .count = 0 };
            append_volume(&b, (trip_scalar)t, endian == 2);
            trip_volume_params p = with_type((trip_scalar)t, endian);
            assert_holds_sample(write_file("sample.raw", &b), &p, (trip_scalar)t);
        }
}

static void any_file_name_is_raw_if_size_and_type_are_given(void **state)
{
    (void)state;
    bytes b = { .count = 0 };
    append_volume(&b, TRIP_U8, false);
    trip_volume_params p = with_type(TRIP_U8, 0);
    assert_holds_sample(write_file("sample.dat", &b), &p, TRIP_U8);
    assert_holds_sample(write_file("noextension", &b), &p, TRIP_U8);
}

static void compressed_raw_is_read(void **state)
{
    (void)state;
    bytes b = { .count = 0 }, gz = { .count = 0 }, bz = { .count = 0 };
    append_volume(&b, TRIP_I16, true);
    append_gzip(&gz, &b);
    append_bzip2(&bz, &b);
    trip_volume_params p = with_type(TRIP_I16, 2);
    assert_holds_sample(write_file("sample.raw.gz", &gz), &p, TRIP_I16);
    assert_holds_sample(write_file("sample.raw.bz2", &bz), &p, TRIP_I16);
}

static void the_offset_counts_decompressed_bytes(void **state)
{
    (void)state;
    bytes b = { .count = 0 }, gz = { .count = 0 };
    append_text(&b, "thirteen byte");
    append_volume(&b, TRIP_U16, false);
    append_gzip(&gz, &b);
    trip_volume_params p = with_type(TRIP_U16, 1);
    p.raw_offset_bytes = 13;
    assert_holds_sample(write_file("offset.raw", &b), &p, TRIP_U16);
    assert_holds_sample(write_file("offset.raw.gz", &gz), &p, TRIP_U16);
}

static void open_scivis_names_carry_size_and_type(void **state)
{
    (void)state;
    bytes b = { .count = 0 }, gz = { .count = 0 };
    append_volume(&b, TRIP_I16, false);
    append_gzip(&gz, &b);
    const trip_volume_params little = { .raw_endian = 1 };
    assert_holds_sample(write_file("some_name_5x4x7_int16.raw", &b), &little, TRIP_I16);
    assert_holds_sample(write_file("some-name_5x4x7_int16.raw.gz", &gz), &little, TRIP_I16);
}

static void options_override_the_name(void **state)
{
    (void)state;
    bytes b = { .count = 0 };
    append_volume(&b, TRIP_U8, false);
    trip_volume_params p = with_type(TRIP_U8, 0);
    assert_holds_sample(write_file("a_9x9x9_float32.raw", &b), &p, TRIP_U8);
}

static void spacing_becomes_the_map(void **state)
{
    (void)state;
    bytes b = { .count = 0 };
    float values[VOXELS];
    trip_volume_info info;
    append_volume(&b, TRIP_U8, false);
    trip_volume_params p = with_type(TRIP_U8, 0);
    p.spacing[0] = 0.5, p.spacing[1] = 2, p.spacing[2] = 3;
    assert_int_equal(read_volume(write_file("spacing.raw", &b), &p, 2, values, VOXELS, &info), 0);
    assert_map(&info.index_to_world,
               (const double[3][4]){ { 0.5, 0, 0, 0 }, { 0, 2, 0, 0 }, { 0, 0, 3, 0 } });
}

static void an_error_without_size_names_the_options(void **state)
{
    (void)state;
    bytes b = { .count = 0 };
    append_volume(&b, TRIP_U8, false);
    static const char *const names[] = { "x.raw", "x_5x4_uint8.raw", "x_5x4x7x_uint8.raw",
                                         "x_5x4x7_complex.raw", "x_-5x4x7_uint8.raw" };
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++)
        assert_refused_as(TRIP_USAGE, write_file(names[i], &b), NULL, "--size X,Y,Z");
    assert_refused(write_file("unknown.xyz", &b), "--size X,Y,Z");
}

static void an_error_points_at_a_header_in_the_folder(void **state)
{
    (void)state;
    bytes b = { .count = 0 };
    append_volume(&b, TRIP_U8, false);
    write_file("beside.nhdr", &b);
    assert_refused_as(TRIP_USAGE, write_file("beside.raw", &b), NULL, "beside.nhdr instead");
}

static void a_short_file_is_refused_before_reading(void **state)
{
    (void)state;
    bytes b = { .count = 0 };
    append_volume(&b, TRIP_U8, false);
    for (size_t length = 1; length < b.count; length += 13)
        assert_refused_as(TRIP_ERROR, write_bytes("short.raw", b.data, length), &sample_size,
                          "holds");
    assert_refused_as(TRIP_ERROR, write_bytes("short.raw", b.data, 0), &sample_size, "is empty");
}

static void a_long_file_is_read_with_a_warning(void **state)
{
    (void)state;
    bytes b = { .count = 0 };
    float values[VOXELS];
    append_volume(&b, TRIP_U8, false);
    append_text(&b, "123456789");
    const char *path = write_file("long.raw", &b);
    catch_reports();
    assert_int_equal(read_volume(path, &sample_size, 3, values, VOXELS, NULL), 0);
    trip_report_redirect(NULL, NULL);
    assert_int_equal(reports, 1);
    assert_non_null(strstr(reported, "9 bytes are after the expected"));
}

static void the_default_type_is_refused_if_voxels_are_larger(void **state)
{
    (void)state;
    const trip_volume_params no_type = { .raw_dims = { 4, 3, 2 } };
    const trip_volume_params after_two = { .raw_dims = { 4, 3, 2 }, .raw_offset_bytes = 2 };
    const trip_volume_params with_type = { .raw_dims = { 4, 3, 2 }, .raw_type = "uint8" };
    float values[24];
    bytes b = { .count = 0 };
    for (int i = 0; i < 48; i++)
        append_text(&b, "a");
    assert_refused_as(TRIP_USAGE, write_file("wide.raw", &b), &no_type,
                      "has 2 bytes for each voxel");
    assert_int_equal(read_volume(path_of("wide.raw"), &with_type, 3, values, 24, NULL), 0);
    append_text(&b, "aa");
    assert_refused_as(TRIP_USAGE, write_file("wide.raw", &b), &after_two, "for example uint16");
    assert_int_equal(read_volume(path_of("wide.raw"), &no_type, 3, values, 24, NULL), 0);
    for (int i = 0; i < 46; i++)
        append_text(&b, "a");
    assert_refused_as(TRIP_USAGE, write_file("wide.raw", &b), &no_type, "for example float");
}

static void impossible_sizes_are_refused(void **state)
{
    (void)state;
    static const int64_t sizes[][3] = {
        { -1, 4, 7 },
        { 5, 0, 7 },
        { 5, 4, -7 },
        { INT64_MAX, 4, 7 },
        { INT64_MAX, INT64_MAX, 2 },
        { 1 << 30, 1 << 30, 1 << 30 },
    };
    const char *path = write_bytes("sizes.raw", "12345678", 8);
    for (size_t i = 0; i < sizeof sizes / sizeof sizes[0]; i++) {
        trip_volume_params p = { .raw_type = "uint8" };
        memcpy(p.raw_dims, sizes[i], sizeof p.raw_dims);
        assert_refused_as(TRIP_ERROR, path, &p, "impossible size");
    }
    assert_refused_as(TRIP_ERROR, path,
                      &(trip_volume_params){ .raw_dims = { 1 << 20, 1 << 20, 1 } }, "are expected");
}

static void a_wrong_type_or_offset_is_refused(void **state)
{
    (void)state;
    bytes b = { .count = 0 };
    append_volume(&b, TRIP_U8, false);
    const char *path = write_file("wrong.raw", &b);
    trip_volume_params p = sample_size;
    p.raw_type = "quaternion";
    assert_refused_as(TRIP_USAGE, path, &p, "unknown --type \"quaternion\"");
    p = sample_size;
    p.raw_offset_bytes = UINT64_MAX;
    assert_refused_as(TRIP_ERROR, path, &p, "beyond its end");
    p.raw_offset_bytes = 1;
    assert_refused_as(TRIP_ERROR, path, &p, "are expected");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_type_is_read_in_both_byte_orders),
        cmocka_unit_test(any_file_name_is_raw_if_size_and_type_are_given),
        cmocka_unit_test(compressed_raw_is_read),
        cmocka_unit_test(the_offset_counts_decompressed_bytes),
        cmocka_unit_test(open_scivis_names_carry_size_and_type),
        cmocka_unit_test(options_override_the_name),
        cmocka_unit_test(spacing_becomes_the_map),
        cmocka_unit_test(an_error_without_size_names_the_options),
        cmocka_unit_test(an_error_points_at_a_header_in_the_folder),
        cmocka_unit_test(a_short_file_is_refused_before_reading),
        cmocka_unit_test(a_long_file_is_read_with_a_warning),
        cmocka_unit_test(the_default_type_is_refused_if_voxels_are_larger),
        cmocka_unit_test(impossible_sizes_are_refused),
        cmocka_unit_test(a_wrong_type_or_offset_is_refused),
    };
    return cmocka_run_group_tests_name("read_raw", tests, make_folder, remove_folder);
}
