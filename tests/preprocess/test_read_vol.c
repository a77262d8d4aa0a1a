#include "volume_files.h"

static const char header[] = "Center-X: 2\nCenter-Y: 2\nCenter-Z: 3\nX: 5\nY: 4\nZ: 7\n"
                             "Voxel-Size: 1\nAlpha-Color: 0\nVoxel-Endian: 0\nInt-Endian: 0123\n";

static const char *write_vol(const char *name, const char *text, bool compressed)
{
    bytes values = { .count = 0 }, b = { .count = 0 };
    append_volume(&values, TRIP_U8, false);
    append_text(&b, text);
    if (compressed)
        append_zlib(&b, &values);
    else
        append(&b, values.data, values.count);
    return write_file(name, &b);
}

static void version_3_is_a_zlib_stream(void **state)
{
    (void)state;
    char text[512];
    snprintf(text, sizeof text, "%sVersion: 3\n.\n", header);
    assert_holds_sample(write_vol("a.vol", text, true), NULL, TRIP_U8);
    assert_holds_sample(write_vol("any.name", text, true), NULL, TRIP_U8);
}

static void version_2_is_plain(void **state)
{
    (void)state;
    char text[512];
    snprintf(text, sizeof text, "%sVersion: 2\n.\n", header);
    assert_holds_sample(write_vol("b.vol", text, false), NULL, TRIP_U8);
}

/* Appends the sizes, in either byte order, and a line feed. They follow a header without a version.
 */
static bytes unversioned(bool big, int depth, char end)
{
    bytes b = { .count = 0 };
    append_text(&b, header);
    append_text(&b, ".\n");
    append_word(&b, NX, 4, big);
    append_word(&b, NY, 4, big);
    append_word(&b, (uint64_t)depth, 4, big);
    append(&b, &end, 1);
    append_volume(&b, TRIP_U8, false);
    return b;
}

static void a_header_without_a_version_repeats_the_sizes(void **state)
{
    (void)state;
    for (int big = 0; big < 2; big++) {
        const bytes b = unversioned(big, NZ, '\n');
        assert_holds_sample(write_file("c.vol", &b), NULL, TRIP_U8);
    }
    char text[512];
    snprintf(text, sizeof text, "%s.\n", header);
    assert_refused(write_vol("c.vol", text, false), "has no \"Version\"");
    const bytes other = unversioned(false, NZ + 1, '\n'), unended = unversioned(false, NZ, ' ');
    assert_refused(write_file("c.vol", &other), "has no \"Version\"");
    assert_refused(write_file("c.vol", &unended), "has no \"Version\"");
}

static void lines_may_end_in_carriage_returns(void **state)
{
    (void)state;
    assert_holds_sample(write_vol("d.vol", "X: 5\r\nY: 4\r\nZ: 7\r\nVersion: 3\r\n.\r\n", true),
                        NULL, TRIP_U8);
}

/* Voxel-Size is a number of bytes, not the spacing. The reader does not take voxels of four bytes
 * for bytes. */
static void voxels_of_several_bytes_are_refused(void **state)
{
    (void)state;
    float values[VOXELS];
    trip_volume_info info;
    const char *path = write_vol("e.vol", "X: 5\nY: 4\nZ: 7\nVoxel-Size: 1\nVersion: 3\n.\n", true);
    assert_int_equal(read_volume(path, NULL, 2, values, VOXELS, &info), 0);
    assert_map(&info.index_to_world,
               (const double[3][4]){ { 1, 0, 0, 0 }, { 0, 1, 0, 0 }, { 0, 0, 1, 0 } });
    assert_refused(write_vol("e.vol", "X: 5\nY: 4\nZ: 7\nVoxel-Size: 2\nVersion: 3\n.\n", true),
                   "line 4: \"Voxel-Size: 2\"");
    assert_refused(write_vol("e.vol", "X: 5\nY: 4\nZ: 7\nLvoxel-Size: 4\nVersion: 3\n.\n", true),
                   "line 4: \"Lvoxel-Size: 4\"");
}

static void wrong_headers_are_refused(void **state)
{
    (void)state;
    static const struct {
        const char *text, *report;
    } wrong[] = {
        { "X: 5\nY: 4\nVersion: 3\n.\n", "impossible size" },
        { "X: -5\nY: 4\nZ: 7\nVersion: 3\n.\n", "impossible size" },
        { "X: 5\nY: 4\nZ: 99999999999999999999\nVersion: 3\n.\n", "impossible size" },
        { "X: 5\nY: 4\nZ: 8\nVersion: 3\n.\n", "are expected" },
        { "X: 5x\nY: 4\nZ: 7\nVersion: 3\n.\n", "line 1" },
        { "X: 5\nY: four\nZ: 7\nVersion: 3\n.\n", "line 2" },
        { "X: 5\nY\nZ: 7\nVersion: 3\n.\n", "line 2" },
        { "X: 5\nY: 4\nZ: 7\nVersion: 4\n.\n", "version 4" },
        { "X: 5\nY: 4\nZ: 7\nVoxel-Size: 0\nVersion: 3\n.\n", "line 4" },
        { "X: 5\nY: 4\nZ: 7\nVoxel-Size: nan\nVersion: 3\n.\n", "line 4" },
    };
    for (size_t i = 0; i < sizeof wrong / sizeof wrong[0]; i++)
        assert_refused(write_vol("wrong.vol", wrong[i].text, true), wrong[i].report);
}

static void a_header_without_end_is_refused(void **state)
{
    (void)state;
    bytes b = { .count = 0 };
    for (int i = 0; i < 1000; i++)
        append_text(&b, "X: 5\n");
    assert_refused(write_file("lines.vol", &b), "the header does not end");
    memset(b.data + 3, '5', 5000);
    assert_refused(write_file("line.vol", &b), "line 1");
}

static void a_file_truncated_anywhere_is_refused(void **state)
{
    (void)state;
    char text[512];
    snprintf(text, sizeof text, "%sVersion: 3\n.\n", header);
    bytes values = { .count = 0 }, b = { .count = 0 };
    append_volume(&values, TRIP_U8, false);
    append_text(&b, text);
    append_zlib(&b, &values);
    for (size_t length = 0; length < b.count; length++)
        assert_true(survives(write_bytes("cut.vol", b.data, length), NULL));
    b = unversioned(false, NZ, '\n');
    for (size_t length = 0; length < b.count; length++)
        assert_true(survives(write_bytes("cut.vol", b.data, length), NULL));
}

/* A flipped bit is an error or leaves the values unchanged. */
static void flipped_bits_never_change_the_values_silently(void **state)
{
    (void)state;
    bytes values = { .count = 0 }, b = { .count = 0 };
    append_volume(&values, TRIP_U8, false);
    append_text(&b, "X: 5\nY: 4\nZ: 7\nVersion: 3\n.\n");
    size_t start = b.count;
    append_zlib(&b, &values);
    for (size_t bit = 8 * start; bit < 8 * b.count; bit++) {
        bytes changed = b;
        float got[VOXELS];
        changed.data[bit / 8] ^= (unsigned char)(1 << bit % 8);
        const char *path = write_file("flipped.vol", &changed);
        catch_reports();
        int status = read_volume(path, NULL, 3, got, VOXELS, NULL);
        trip_report_redirect(NULL, NULL);
        for (int v = 0; v < VOXELS && reports == 0; v++)
            assert_true(status == 0 && got[v] == values.data[v]);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(version_3_is_a_zlib_stream),
        cmocka_unit_test(version_2_is_plain),
        cmocka_unit_test(lines_may_end_in_carriage_returns),
        cmocka_unit_test(a_header_without_a_version_repeats_the_sizes),
        cmocka_unit_test(voxels_of_several_bytes_are_refused),
        cmocka_unit_test(wrong_headers_are_refused),
        cmocka_unit_test(a_header_without_end_is_refused),
        cmocka_unit_test(a_file_truncated_anywhere_is_refused),
        cmocka_unit_test(flipped_bits_never_change_the_values_silently),
    };
    return cmocka_run_group_tests_name("read_vol", tests, make_folder, remove_folder);
}
