#include "slice_files_by_hand.h"

static void write_tiff(const char *name, trip_scalar type, int first, int count)
{
    bytes b = { .count = 0 };
    append_tiff(&b, type, first, count, 0);
    write_file(name, &b);
}

static void write_dicom(const char *name, const dicom *d, int first, int count)
{
    bytes b = { .count = 0 };
    append_dicom(&b, d, first, count);
    write_file(name, &b);
}

/* Reads the file once and compares it with the sample, scaled by `slope` and `inter`. */
static trip_volume_info assert_sample(const char *path, trip_scalar type, trip_scalar read_as,
                                      double slope, double inter, int expected_reports)
{
    float values[VOXELS];
    trip_volume_info info;
    catch_reports();
    int status = read_volume(path, NULL, 2, values, VOXELS, &info);
    trip_report_redirect(NULL, NULL);
    if (status < 0 || reports != expected_reports)
        fail_msg("%d reports: %s", reports, reported);
    assert_int_equal(info.type, read_as);
    assert_string_equal(info.format, "images");
    for (int v = 0; v < VOXELS; v++) {
        double expected = slope * sample(type, v % NX, v / NX % NY, v / NX / NY) + inter;
        assert_true(values[v] == (float)expected);
    }
    return info;
}

static void pages_of_one_tiff_are_slices(void **state)
{
    (void)state;
    write_tiff("pages.tif", TRIP_I16, 0, NZ);
    assert_holds_sample(path_of("pages.tif"), NULL, TRIP_I16);
}

static void a_pattern_gives_the_slices_by_number(void **state)
{
    (void)state;
    static const trip_scalar types[] = { TRIP_U8, TRIP_U16, TRIP_U32, TRIP_F32, TRIP_F64 };
    for (size_t t = 0; t < sizeof types / sizeof types[0]; t++) {
        for (int k = 0; k < NZ; k++) {
            char name[32];
            snprintf(name, sizeof name, "n%zu-%02d.tif", t, k + 8);
            write_tiff(name, types[t], k, 1);
        }
        char pattern[32];
        snprintf(pattern, sizeof pattern, "n%zu-%%02d.tif", t);
        trip_volume_info info = assert_sample(path_of(pattern), types[t], types[t], 1, 0, 0);
        const double identity[3][4] = { { 1, 0, 0, 0 }, { 0, 1, 0, 0 }, { 0, 0, 1, 0 } };
        assert_map(&info.index_to_world, identity);
    }
}

/* "s2" comes before "s10". The reader skips files that are not pictures. */
static void a_folder_and_a_glob_are_read_in_natural_order(void **state)
{
    (void)state;
    char name[64];
    mkdir(path_of("stack"), 0777);
    write_bytes("stack/notes.txt", "not a picture", 13);
    for (int k = 0; k < NZ; k++) {
        snprintf(name, sizeof name, "stack/s%d.png", 7 + k);
        bytes b = { .count = 0 };
        append_png(&b, TRIP_U16, k, 1);
        write_file(name, &b);
    }
    assert_sample(path_of("stack"), TRIP_U16, TRIP_U16, 1, 0, 0);
    assert_sample(path_of("stack/s*.png"), TRIP_U16, TRIP_U16, 1, 0, 0);
    remove(path_of("stack/notes.txt"));
    for (int k = 0; k < NZ; k++) {
        snprintf(name, sizeof name, "stack/s%d.png", 7 + k);
        remove(path_of(name));
    }
    assert_refused(path_of("stack"), "holds no TIFF, PNG, EXR or DICOM");
    remove(path_of("stack"));
}

static void exr_gives_halves_and_floats(void **state)
{
    (void)state;
    static const trip_scalar types[] = { TRIP_F16, TRIP_F32 };
    for (int t = 0; t < 2; t++) {
        for (int k = 0; k < NZ; k++) {
            char name[32];
            bytes b = { .count = 0 };
            snprintf(name, sizeof name, "e%d-%d.exr", t, k);
            append_exr(&b, types[t], k);
            write_file(name, &b);
        }
        assert_sample(path_of(t ? "e1-%d.exr" : "e0-%d.exr"), types[t], types[t], 1, 0, 0);
    }
}

/* The alpha does not multiply the value. The luma of three equal channels is their value. */
static void grey_is_taken_from_channels(void **state)
{
    (void)state;
    for (int channels = 2; channels <= 4; channels++) {
        char name[32];
        for (int k = 0; k < NZ; k++) {
            bytes b = { .count = 0 };
            snprintf(name, sizeof name, "c%d-%d.png", channels, k);
            append_png(&b, TRIP_U8, k, channels);
            write_file(name, &b);
        }
        snprintf(name, sizeof name, "c%d-%%d.png", channels);
        assert_sample(path_of(name), TRIP_U8, channels == 2 ? TRIP_U8 : TRIP_F32, 1, 0, 0);
    }
}

/* Appends values of few bits, packed from the highest bit on. Each row starts a byte. */
static void append_packed(bytes *b, const uint32_t *values, int width, int height, int bits)
{
    for (int j = 0; j < height; j++) {
        unsigned char row[64] = { 0 };
        for (int i = 0; i < width * bits; i++)
            row[i / 8] |=
                (unsigned char)((values[j * width + i / bits] >> (bits - 1 - i % bits) & 1)
                                << (7 - i % 8));
        append(b, row, (size_t)(width * bits + 7) / 8);
    }
}

/* Writes a TIFF of one page. Values of 24 bits have the byte order of the file, and values of other
 * numbers of bits are packed. `absent` is the text of GDAL's tag, or NULL. */
static const char *write_bits(const char *name, const uint32_t *values, int width, int height,
                              int bits, bool big, const char *absent)
{
    bytes b = { .count = 0 };
    append(&b, big ? "MM\0*" : "II*\0", 4);
    append_word(&b, 8, 4, big);
    const int tags = absent ? 11 : 10;
    const size_t data = 8 + 2 + 12 * (size_t)tags + 4;
    bytes rows = { .count = 0 };
    if (bits == 24 || bits % 16 == 0)
        for (int v = 0; v < width * height; v++)
            append_word(&rows, values[v], (unsigned)bits / 8, big);
    else
        append_packed(&rows, values, width, height, bits);
    const struct {
        unsigned tag, type;
        uint64_t count, value;
    } all[] = { { 256, 4, 1, (uint64_t)width },
                { 257, 4, 1, (uint64_t)height },
                { 258, 4, 1, (uint64_t)bits },
                { 259, 4, 1, 1 },
                { 262, 4, 1, 1 },
                { 273, 4, 1, data },
                { 277, 4, 1, 1 },
                { 278, 4, 1, (uint64_t)height },
                { 279, 4, 1, rows.count },
                { 339, 4, 1, 1 },
                { 42113, 2, absent ? strlen(absent) + 1 : 0, data + rows.count } };
    append_word(&b, (uint64_t)tags, 2, big);
    for (int t = 0; t < tags; t++) {
        append_word(&b, all[t].tag, 2, big);
        append_word(&b, all[t].type, 2, big);
        append_word(&b, all[t].count, 4, big);
        char inside[4] = "";
        if (absent && all[t].type == 2 && all[t].count <= 4) /* the tag itself holds a short text */
            append(&b, memcpy(inside, absent, all[t].count), 4);
        else
            append_word(&b, all[t].value, 4, big);
    }
    append_word(&b, 0, 4, big);
    append(&b, rows.data, rows.count);
    if (absent)
        append(&b, absent, strlen(absent) + 1);
    return write_file(name, &b);
}

static void values_of_any_number_of_bits_stay_what_they_are(void **state)
{
    (void)state;
    enum { WIDTH = 10, HEIGHT = 6, COUNT = WIDTH * HEIGHT };
    static const int some[] = { 1, 2, 4, 6, 8, 10, 12, 14, 16, 24, 32 };
    for (size_t n = 0; n < sizeof some / sizeof *some; n++)
        for (int big = 0; big < 2; big++) {
            const int bits = some[n];
            const uint32_t most = bits == 32 ? 1 << 24 : (1u << bits) - 1;
            uint32_t values[COUNT];
            float got[COUNT];
            for (uint32_t v = 0; v < COUNT; v++)
                values[v] = v == 1 ? most : v * v * 7919 & most;
            const char *path = write_bits("bits.tif", values, WIDTH, HEIGHT, bits, big, NULL);
            assert_int_equal(read_volume(path, NULL, 1, got, COUNT, NULL), 0);
            for (int v = 0; v < COUNT; v++)
                if (got[v] != (float)values[v])
                    fail_msg("%d bits: value %d is %g, not %u", bits, v, got[v], values[v]);
        }
}

static void gdal_gives_the_absent_value(void **state)
{
    (void)state;
    static const struct {
        const char *text;
        bool absent; /* whether the number is finite and among the values */
    } tags[] = { { "7", true },   { " 7.0 ", true }, { "nan", false }, { "7x", false },
                 { "-7", false }, { "", false },     { "7.5", false } };
    const uint32_t values[4] = { 1, 7, 70, 7 };
    for (size_t n = 0; n < sizeof tags / sizeof *tags; n++)
        for (int bits = 12; bits <= 32; bits += 4) {
            float got[4];
            trip_volume_info info;
            if (bits == 20 || bits == 28)
                continue;
            const char *path = write_bits("absent.tif", values, 2, 2, bits, n % 2, tags[n].text);
            assert_int_equal(read_volume(path, NULL, 1, got, 4, &info), 0);
            assert_true(got[0] == 1 && got[2] == 70);
            assert_true(tags[n].absent ? isnan(got[1]) && isnan(got[3]) : got[1] == 7);
            assert_true(!tags[n].absent || strstr(info.note, "the value 7 is absent"));
        }
}

static void grey_png_values_of_few_bits_stay_what_they_are(void **state)
{
    (void)state;
    for (int bits = 1; bits <= 4; bits *= 2) {
        enum { WIDTH = 9, HEIGHT = 4, COUNT = WIDTH * HEIGHT };
        bytes rows = { .count = 0 }, b = { .count = 0 };
        uint32_t values[COUNT];
        float got[COUNT];
        for (uint32_t v = 0; v < COUNT; v++)
            values[v] = (v * 5 + v / WIDTH) & ((1u << bits) - 1);
        for (int j = 0; j < HEIGHT; j++) {
            append(&rows, "", 1); /* no filter */
            append_packed(&rows, values + j * WIDTH, WIDTH, 1, bits);
        }
        append_png_file(&b, WIDTH, HEIGHT, bits, 0, &rows);
        assert_int_equal(read_volume(write_file("bits.png", &b), NULL, 1, got, COUNT, NULL), 0);
        for (int v = 0; v < COUNT; v++)
            assert_true(got[v] == (float)values[v]);
    }
}

/* Descriptions and pages as in test_page_order.cpp. */
static void pages_are_read_in_the_order_of_their_description(void **state)
{
    (void)state;
    static const char description[] = "ImageJ=1\nimages=14\nchannels=2\nslices=7\nunit=nm\n"
                                      "spacing=3";
    bytes b = { .count = 0 }, other = { .count = 0 };
    append(&b, "II*\0", 4);
    size_t link = b.count;
    append_u32(&b, 0);
    const size_t text = b.count;
    append(&b, description, sizeof description);
    b.count += b.count % 2;
    for (int page = 0; page < 2 * NZ; page++) {
        const size_t data = b.count;
        append_slices(&b, TRIP_U8, false, page % 2 ? page / 2 : 0, 1);
        patch_u32(&b, link, b.count);
        append_u16(&b, 10);
        append_tag(&b, 256, TIFF_LONG, NX);
        append_tag(&b, 257, TIFF_LONG, NY);
        append_tag(&b, 258, TIFF_SHORT, 8);
        append_tag(&b, 259, TIFF_SHORT, 1);
        append_tag(&b, 262, TIFF_SHORT, 1);
        append_u16(&b, 270);
        append_u16(&b, 2);
        append_u32(&b, sizeof description);
        append_u32(&b, text);
        append_tag(&b, 273, TIFF_LONG, data);
        append_tag(&b, 277, TIFF_SHORT, 1);
        append_tag(&b, 278, TIFF_LONG, NY);
        append_tag(&b, 279, TIFF_LONG, NX * NY);
        link = b.count;
        append_u32(&b, 0);
    }
    const char *path = write_file("hyper.tif", &b);
    float values[VOXELS];
    trip_volume_info info;
    assert_holds_sample(path, &(trip_volume_params){ .channel = 1 }, TRIP_U8);
    assert_int_equal(read_volume(path, NULL, 2, values, VOXELS, &info), 0);
    assert_true(values[VOXELS - 1] == (float)sample(TRIP_U8, NX - 1, NY - 1, 0));
    assert_non_null(strstr(info.note, "channel 0 of 2"));
    assert_map(&info.index_to_world,
               (const double[3][4]){ { 1, 0, 0, 0 }, { 0, 1, 0, 0 }, { 0, 0, 3, 0 } });
    assert_refused_as(TRIP_USAGE, path, &(trip_volume_params){ .channel = 2 }, "has 2 channels");
    assert_refused_as(TRIP_USAGE, path, &(trip_volume_params){ .time = 1 }, "has one time");
    append_tiff(&other, TRIP_U8, 0, NZ, 0);
    assert_refused_as(TRIP_USAGE, write_file("plain.tif", &other),
                      &(trip_volume_params){ .channel = 1 }, "has one channel");
}

static void a_tiff_with_deep_tiles_is_refused(void **state)
{
    (void)state;
    bytes b = { .count = 0 };
    append_deep_tiff(&b);
    write_file("deep.tif", &b);
    assert_refused(path_of("deep.tif"), "store its slices as pages");
}

/* The order of names is the reverse of the order of positions. Slices lie along a tilted direction.
 */
static void dicom_slices_are_ordered_and_placed_in_space(void **state)
{
    (void)state;
    for (int k = 0; k < NZ; k++) {
        char name[32], position[64];
        snprintf(name, sizeof name, "d%d.dcm", NZ - k);
        snprintf(position, sizeof position, "%d\\%g\\%g", -10, 20 - 1.5 * k, 5 + 0.25 * k);
        const dicom d = { .type = TRIP_I16,
                          .series = "1.2",
                          .position = position,
                          .orientation = "1\\0\\0\\0\\0\\1",
                          .spacing = "0.5\\0.75",
                          .slope = "2.5",
                          .inter = "-1000" };
        write_dicom(name, &d, k, 1);
    }
    trip_volume_info info = assert_sample(path_of("d%d.dcm"), TRIP_I16, TRIP_I16, 2.5, -1000, 0);
    const double expected[3][4] = {
        { -0.75, 0, 0, 10 },
        { 0, 0, 1.5, -20 },
        { 0, 0.5, 0.25, 5 },
    };
    assert_map(&info.index_to_world, expected);
    assert_true(info.slope == 2.5 && info.inter == -1000);
    assert_string_equal(info.space, "RAS"); /* DICOM's x and y, negated */
    assert_true(info.oriented);
}

/* The slices are at 0, 1.5, 4.5, 6 and so on up to 10.5. If the gap is allowed, they stay there. */
static void a_missing_dicom_slice_is_refused_unless_gaps_are_allowed(void **state)
{
    (void)state;
    for (int k = 0; k < NZ; k++) {
        char name[32], position[32];
        snprintf(name, sizeof name, "gap%d.dcm", k + 1);
        snprintf(position, sizeof position, "0\\0\\%g", 1.5 * (k > 1 ? k + 1 : k));
        const dicom d = { .type = TRIP_U8,
                          .position = position,
                          .orientation = "1\\0\\0\\0\\1\\0" };
        write_dicom(name, &d, k, 1);
    }
    assert_refused(path_of("gap%d.dcm"), "gap2.dcm: a slice is missing after it");
    float values[VOXELS];
    trip_volume_info info;
    const trip_volume_params params = { .allow_gaps = true };
    catch_reports();
    assert_int_equal(read_volume(path_of("gap%d.dcm"), &params, 2, values, VOXELS, &info), 0);
    trip_report_redirect(NULL, NULL);
    assert_non_null(strstr(reported, "gap2.dcm"));
    assert_true(fabs(info.index_to_world.m[2][2] - 10.5 / (NZ - 1)) < 1e-12);
}

static void only_stacks_of_several_files_may_have_gaps(void **state)
{
    (void)state;
    const trip_volume_params params = { .allow_gaps = true };
    write_tiff("pages.tif", TRIP_U8, 0, NZ);
    assert_refused_as(TRIP_USAGE, path_of("pages.tif"), &params, "is one file");
    const dicom d = { .type = TRIP_U8 };
    write_dicom("one.dcm", &d, 0, 1);
    assert_refused_as(TRIP_USAGE, path_of("one.dcm"), &params, "is one file");
}

static void dicom_without_positions_is_ordered_by_number(void **state)
{
    (void)state;
    for (int k = 0; k < NZ; k++) {
        char name[32], number[12];
        snprintf(name, sizeof name, "i%d.dcm", (k * 3) % NZ);
        snprintf(number, sizeof number, "%d", k + 5);
        const dicom d = { .type = TRIP_U8, .number = number, .thickness = "3" };
        write_dicom(name, &d, k, 1);
    }
    trip_volume_info info = assert_sample(path_of("i*.dcm"), TRIP_U8, TRIP_U8, 1, 0, 0);
    assert_true(info.index_to_world.m[2][2] == 3);
    assert_string_equal(info.space, "");
    assert_false(info.oriented);
}

/* Writes slices with these positions and opens them. Returns the reports, which may be empty. */
static const char *report_of_positions(const char *const positions[NZ], const char *orientation,
                                       int expected_status)
{
    static float values[VOXELS];
    for (int k = 0; k < NZ; k++) {
        char name[32];
        snprintf(name, sizeof name, "p%d.dcm", k);
        const dicom d = { .type = TRIP_U8,
                          .position = positions[k],
                          .orientation = orientation,
                          .spacing = "0.5\\0.5" };
        write_dicom(name, &d, k, 1);
    }
    catch_reports();
    int status = read_volume(path_of("p%d.dcm"), NULL, 2, values, VOXELS, NULL);
    trip_report_redirect(NULL, NULL);
    if (status != expected_status)
        fail_msg("status %d: %s", status, reported);
    return reported;
}

/* An offset of 0.25 to the side is half a pixel. */
static void dicom_slices_off_their_line_are_refused(void **state)
{
    (void)state;
    const char *const straight[NZ] = { "0\\0\\0", "0\\1\\2",  "0.2\\2\\4", "0\\3\\6",
                                       "0\\4\\8", "0\\5\\10", "0\\6\\12" };
    const char *const crooked[NZ] = { "0\\0\\0", "0\\1\\2",  "0\\2\\4", "0.3\\3\\6",
                                      "0\\4\\8", "0\\5\\10", "0\\6\\12" };
    const char *const gap[NZ] = { "0\\0\\0",  "0\\1\\2",  "0\\2\\4", "0\\3\\6",
                                  "0\\5\\10", "0\\6\\12", "0\\7\\14" };
    const char *const uneven[NZ] = { "0\\0\\0",   "0\\1\\2",    "0\\2\\4",   "0\\3\\6",
                                     "0\\4.5\\9", "0\\5.5\\11", "0\\6.5\\13" };
    const char *axial = "1\\0\\0\\0\\1\\0";
    assert_string_equal(report_of_positions(straight, axial, 0), "");
    assert_non_null(strstr(report_of_positions(crooked, axial, TRIP_ERROR),
                           "p0.dcm: slice 4 of its series lies 0.3 beside the line"));
    assert_non_null(
        strstr(report_of_positions(gap, axial, TRIP_ERROR), "p3.dcm: a slice is missing after it"));
    assert_string_equal(report_of_positions(uneven, axial, 0), "");
    assert_non_null(strstr(report_of_positions(straight, "1\\0\\0\\0.5\\1\\0", TRIP_ERROR),
                           "not at right angles"));
    assert_non_null(strstr(report_of_positions(straight, "0\\0\\0\\0\\0\\0", TRIP_ERROR),
                           "not at right angles"));
}

/* Without positions, the direction of the slices in the patient is unknown, and so are left and
 * right. */
static void dicom_without_positions_gives_no_orientation(void **state)
{
    (void)state;
    for (int k = 0; k < NZ; k++) {
        char name[32], number[12];
        snprintf(name, sizeof name, "q%d.dcm", k);
        snprintf(number, sizeof number, "%d", k);
        const dicom d = {
            .type = TRIP_U8, .number = number, .orientation = "1\\0\\0\\0\\0\\-1", .thickness = "3"
        };
        write_dicom(name, &d, k, 1);
    }
    trip_volume_info info = assert_sample(path_of("q%d.dcm"), TRIP_U8, TRIP_U8, 1, 0, 0);
    assert_map(&info.index_to_world,
               (const double[3][4]){ { 1, 0, 0, 0 }, { 0, 0, 3, 0 }, { 0, -1, 0, 0 } });
    assert_string_equal(info.space, "");
    assert_true(info.oriented);
}

/* The value has 12 of 16 bits, signed, with unused bits below and above that are not zero. */
static void dicom_values_are_taken_from_their_bits(void **state)
{
    (void)state;
    const dicom d = { .type = TRIP_I16, .stored = 12, .shift = 2, .frames = "7" };
    write_dicom("bits.dcm", &d, 0, NZ);
    assert_sample(path_of("bits.dcm"), TRIP_I16, TRIP_I16, 1, 0, 0);
}

static void dicom_slices_rescaled_differently_become_floats(void **state)
{
    (void)state;
    for (int k = 0; k < NZ; k++) {
        char name[32], number[12];
        snprintf(name, sizeof name, "r%d.dcm", k);
        snprintf(number, sizeof number, "%d", k);
        const dicom d = { .type = TRIP_U16,
                          .number = number,
                          .slope = k % 2 ? "3" : "1",
                          .inter = k % 2 ? "0" : "7" };
        write_dicom(name, &d, k, 1);
    }
    float values[VOXELS];
    trip_volume_info info;
    assert_int_equal(read_volume(path_of("r%d.dcm"), NULL, 2, values, VOXELS, &info), 0);
    assert_int_equal(info.type, TRIP_F32);
    for (int v = 0; v < VOXELS; v++) {
        int k = v / NX / NY, stored = sample(TRIP_U16, v % NX, v / NX % NY, k);
        assert_true(values[v] == (float)(k % 2 ? 3 * stored : stored + 7));
    }
}

/* The file stores frames from the last position to the first, each with a different slope. */
static void each_dicom_frame_is_rescaled_by_its_slope(void **state)
{
    (void)state;
    static const char *const slopes[NZ] = { "1", "2", "3", "4", "5", "6", "7" };
    static const char *const positions[NZ] = { "0\\0\\6", "0\\0\\5", "0\\0\\4", "0\\0\\3",
                                               "0\\0\\2", "0\\0\\1", "0\\0\\0" };
    const dicom d = { .type = TRIP_U16,
                      .frames = "7",
                      .orientation = "1\\0\\0\\0\\1\\0",
                      .inter = "5",
                      .frame_slopes = slopes,
                      .frame_positions = positions };
    float values[VOXELS];
    trip_volume_info info;
    write_dicom("frames.dcm", &d, 0, NZ);
    assert_int_equal(read_volume(path_of("frames.dcm"), NULL, 2, values, VOXELS, &info), 0);
    assert_int_equal(info.type, TRIP_F32);
    for (int v = 0; v < VOXELS; v++) {
        int frame = NZ - 1 - v / NX / NY;
        int stored = sample(TRIP_U16, v % NX, v / NX % NY, frame);
        assert_true(values[v] == (float)((frame + 1) * stored + 5));
    }
}

static void dicom_frames_rescaled_alike_keep_their_type(void **state)
{
    (void)state;
    static const char *const slopes[NZ] = { "2", "2", "2", "2", "2", "2", "2" };
    const dicom d = { .type = TRIP_I16, .frames = "7", .inter = "-5", .frame_slopes = slopes };
    write_dicom("alike.dcm", &d, 0, NZ);
    assert_sample(path_of("alike.dcm"), TRIP_I16, TRIP_I16, 2, -5, 0);
}

static void dicom_slices_that_do_not_belong_together_are_refused(void **state)
{
    (void)state;
    dicom d = { .type = TRIP_U8, .series = "1.2", .number = "1" };
    write_dicom("x1.dcm", &d, 0, 1);
    write_dicom("x2.dcm", &d, 0, 1);
    assert_refused(path_of("x%d.dcm"), "the same instance number");
}

/* The first series has slices 0 and 1, the second one slices 2, 3 and 4. Later the second one has
 * another type instead of another UID. */
static void one_of_several_dicom_series_is_read(void **state)
{
    (void)state;
    for (int turn = 0; turn < 2; turn++) {
        for (int k = 0; k < 5; k++) {
            char name[32], position[32];
            snprintf(name, sizeof name, "s%d.dcm", k);
            snprintf(position, sizeof position, "0\\0\\%d", k);
            const dicom d = { .type = k < 2 || turn == 0 ? TRIP_U8 : TRIP_U16,
                              .series = k < 2 || turn == 1 ? "1.2" : "1.3",
                              .position = position,
                              .orientation = "1\\0\\0\\0\\1\\0" };
            write_dicom(name, &d, k, 1);
        }
        for (int series = 0; series < 3; series++) {
            const int first = series == 1 ? 0 : 2;
            float values[VOXELS];
            trip_volume_info info;
            const trip_volume_params params = { .series = series };
            const size_t count = (size_t)(NX * NY * (series == 1 ? 2 : 3));
            assert_int_equal(read_volume(path_of("s%d.dcm"), &params, 2, values, count, &info), 0);
            assert_int_equal(info.dims[2], series == 1 ? 2 : 3);
            assert_true(strstr(info.note, "--series") ? series == 0 : series > 0);
            for (int v = 0; v < NX * NY; v++)
                assert_true(values[v] == sample(info.type, v % NX, v / NX, first));
        }
        assert_refused_as(TRIP_USAGE, path_of("s%d.dcm"), &(trip_volume_params){ .series = 3 },
                          "has no series 3; it has 1 (5 x 4 x 2), 2 (5 x 4 x 3)");
    }
}

/* Each position has two slices: 0 and 3, 1 and 4, 2 and 5. */
static void dicom_slices_at_one_position_are_times(void **state)
{
    (void)state;
    for (int k = 0; k < 6; k++) {
        char name[32], position[32], number[12];
        snprintf(name, sizeof name, "t%d.dcm", 5 - k);
        snprintf(position, sizeof position, "0\\0\\%d", 2 * (k % 3));
        snprintf(number, sizeof number, "%d", k + 1);
        const dicom d = { .type = TRIP_I16,
                          .number = number,
                          .position = position,
                          .orientation = "1\\0\\0\\0\\1\\0" };
        write_dicom(name, &d, k, 1);
    }
    for (int time = 0; time < 2; time++) {
        float values[VOXELS];
        trip_volume_info info;
        const trip_volume_params params = { .time = time };
        assert_int_equal(read_volume(path_of("t%d.dcm"), &params, 2, values, 3 * NX * NY, &info),
                         0);
        assert_int_equal(info.dims[2], 3);
        assert_true(strstr(info.note, "time 0 of 2") ? time == 0 : time == 1);
        for (int v = 0; v < 3 * NX * NY; v++)
            assert_true(values[v] == sample(TRIP_I16, v % NX, v / NX % NY, 3 * time + v / NX / NY));
    }
    assert_refused_as(TRIP_USAGE, path_of("t%d.dcm"), &(trip_volume_params){ .time = 2 },
                      "its times are 0 to 1");
    write_tiff("pages.tif", TRIP_U8, 0, NZ);
    assert_refused_as(TRIP_USAGE, path_of("pages.tif"), &(trip_volume_params){ .series = 1 },
                      "requires DICOM");
}

/* The positions are 0, 1, 2, 4.5, 7, 9.5 and 12 along a tilted direction. */
static void dicom_slices_at_uneven_distances_stay_there(void **state)
{
    (void)state;
    static const double along[NZ] = { 0, 1, 2, 4.5, 7, 9.5, 12 };
    trip_budget *budget;
    trip_volume *v;
    for (int k = 0; k < NZ; k++) {
        char name[32], position[64];
        snprintf(name, sizeof name, "u%d.dcm", k);
        snprintf(position, sizeof position, "0\\%.9g\\%.9g", -0.6 * along[k], 0.8 * along[k]);
        const dicom d = { .type = TRIP_U8,
                          .position = position,
                          .orientation = "1\\0\\0\\0\\0.8\\0.6" };
        write_dicom(name, &d, k, 1);
    }
    assert_int_equal(trip_budget_create(&budget, 64 << 20), 0);
    assert_int_equal(trip_volume_open(&v, path_of("u%d.dcm"), NULL, budget), 0);
    const trip_volume_info *info = trip_volume_get_info(v);
    assert_non_null(info->coordinates[2]);
    for (int k = 0; k < NZ; k++) {
        assert_true(fabs(info->coordinates[2][k] - along[k] / 2) < 1e-9);
        assert_true(info->coordinates[1][k < NY ? k : 0] == (k < NY ? k : 0));
    }
    assert_map(&info->index_to_world,
               (const double[3][4]){ { -1, 0, 0, 0 }, { 0, -0.8, 1.2, 0 }, { 0, 0.6, 1.6, 0 } });
    trip_volume_close(v);
    trip_budget_destroy(budget);
}

static void slices_that_do_not_fit_or_are_missing_are_refused(void **state)
{
    (void)state;
    bytes b = { .count = 0 };
    write_tiff("h1.tif", TRIP_U8, 0, 1);
    write_tiff("h2.tif", TRIP_U8, 1, 1);
    write_tiff("h4.tif", TRIP_U8, 2, 1);
    assert_refused(path_of("h%d.tif"), "slice 3 is missing");
    append_tiff(&b, TRIP_U8, 2, 1, 3);
    write_file("h3.tif", &b);
    assert_refused(path_of("h%d.tif"), "h3.tif: is 8 x 4 uint8, unlike the first slice");
    write_tiff("h3.tif", TRIP_I16, 2, 1);
    assert_refused(path_of("h%d.tif"), "is 5 x 4 int16, unlike");
    write_tiff("h3.tif", TRIP_U8, 2, 2);
    assert_refused(path_of("h[34].tif"), "holds several slices");
    write_bytes("h3.tif", "nothing", 7);
    assert_refused(path_of("h%d.tif"), "h3.tif: is not a TIFF");
    b.count = 0;
    append_png(&b, TRIP_U8, 0, 1);
    write_file("h3.tif", &b);
    assert_refused(path_of("h%d.tif"), "different kinds");
}

static void wrong_patterns_are_refused(void **state)
{
    (void)state;
    assert_refused(path_of("nothing-%03d.tif"), "no file matches");
    assert_refused(path_of("nothing-*.tif"), "no file matches");
    assert_refused_as(TRIP_USAGE, path_of("a%d-%d.tif"), NULL, "one number");
    assert_refused_as(TRIP_USAGE, path_of("a%s.tif"), NULL, "one number");
    assert_refused_as(TRIP_USAGE, path_of("a%999999d.tif"), NULL, "one number");
}

static void truncated_slices_are_refused(void **state)
{
    (void)state;
    bytes files[4] = { 0 };
    append_tiff(&files[0], TRIP_F64, 0, 2, 0);
    append_png(&files[1], TRIP_U16, 0, 1);
    append_exr(&files[2], TRIP_F32, 0);
    append_dicom(&files[3], &(dicom){ .type = TRIP_I16 }, 0, 1);
    for (int f = 0; f < 4; f++)
        for (int part = 1; part < 4; part += 2) {
            write_bytes("cut", files[f].data, files[f].count * (size_t)part / 4);
            if (!survives(path_of("cut"), NULL))
                fail_msg("part %d of file %d is read", part, f);
        }
}

static void corrupted_slices_do_no_harm(void **state)
{
    (void)state;
    bytes files[4] = { 0 };
    unsigned seed = 5;
    append_tiff(&files[0], TRIP_U16, 0, 2, 0);
    append_png(&files[1], TRIP_U8, 0, 3);
    append_exr(&files[2], TRIP_F16, 0);
    append_dicom(&files[3], &(dicom){ .type = TRIP_U8, .spacing = "1\\1" }, 0, 1);
    for (int n = 0; n < 8; n++) {
        bytes bad = files[n % 4];
        for (int change = 0; change < 3; change++) {
            seed = seed * 1103515245 + 12345;
            bad.data[140 * (n % 4 == 3) + (seed >> 16) % (bad.count - 140)] = (unsigned char)seed;
        }
        write_file("bad", &bad);
        survives(path_of("bad"), NULL);
    }
}

static void slices_too_large_for_the_memory_are_refused(void **state)
{
    (void)state;
    trip_budget *budget;
    trip_volume *v;
    write_tiff("pages.tif", TRIP_U8, 0, NZ);
    assert_int_equal(trip_budget_create(&budget, 100), 0);
    catch_reports();
    assert_int_equal(trip_volume_open(&v, path_of("pages.tif"), NULL, budget), TRIP_ERROR);
    trip_report_redirect(NULL, NULL);
    assert_int_equal(reports, 1);
    assert_non_null(strstr(reported, "--memory"));
    trip_budget_destroy(budget);
}

/* The file of 1.3 kB declares a window of 1048576 x 1024 pixels. The reader must not allocate its
 * lines, 4 GB. */
static void a_picture_that_declares_more_than_the_memory_is_refused(void **state)
{
    (void)state;
    trip_budget *budget;
    trip_volume *v;
    assert_int_equal(trip_budget_create(&budget, 64 << 20), 0);
    catch_reports();
    assert_int_equal(
        trip_volume_open(&v, TRIP_SOURCE_DIR "/tests/regress/huge_window.exr", NULL, budget),
        TRIP_ERROR);
    trip_report_redirect(NULL, NULL);
    assert_int_equal(reports, 1);
    assert_non_null(strstr(reported, "huge_window.exr"));
    assert_non_null(strstr(reported, "--memory"));
    trip_budget_destroy(budget);
}

static void a_stack_can_be_read_again(void **state)
{
    (void)state;
    trip_budget *budget;
    trip_volume *v;
    trip_volume_portion portion;
    float values[2][VOXELS];
    write_tiff("pages.tif", TRIP_U8, 0, NZ);
    assert_int_equal(trip_budget_create(&budget, 64 << 20), 0);
    assert_int_equal(trip_volume_open(&v, path_of("pages.tif"), NULL, budget), 0);
    for (int turn = 0; turn < 2; turn++) {
        assert_int_equal(trip_volume_next(v, NZ, &portion), 1);
        assert_int_equal(
            trip_portion_decode(v, &portion, portion.origin, portion.size, values[turn], NULL), 0);
        trip_portion_release(v, &portion);
        assert_int_equal(trip_volume_rewind(v), 0);
    }
    assert_memory_equal(values[0], values[1], sizeof values[0]);
    trip_volume_close(v);
    trip_budget_destroy(budget);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(pages_of_one_tiff_are_slices),
        cmocka_unit_test(a_pattern_gives_the_slices_by_number),
        cmocka_unit_test(a_folder_and_a_glob_are_read_in_natural_order),
        cmocka_unit_test(exr_gives_halves_and_floats),
        cmocka_unit_test(grey_is_taken_from_channels),
        cmocka_unit_test(values_of_any_number_of_bits_stay_what_they_are),
        cmocka_unit_test(gdal_gives_the_absent_value),
        cmocka_unit_test(grey_png_values_of_few_bits_stay_what_they_are),
        cmocka_unit_test(pages_are_read_in_the_order_of_their_description),
        cmocka_unit_test(a_tiff_with_deep_tiles_is_refused),
        cmocka_unit_test(dicom_slices_are_ordered_and_placed_in_space),
        cmocka_unit_test(a_missing_dicom_slice_is_refused_unless_gaps_are_allowed),
        cmocka_unit_test(only_stacks_of_several_files_may_have_gaps),
        cmocka_unit_test(dicom_without_positions_is_ordered_by_number),
        cmocka_unit_test(dicom_slices_off_their_line_are_refused),
        cmocka_unit_test(dicom_without_positions_gives_no_orientation),
        cmocka_unit_test(dicom_values_are_taken_from_their_bits),
        cmocka_unit_test(dicom_slices_rescaled_differently_become_floats),
        cmocka_unit_test(each_dicom_frame_is_rescaled_by_its_slope),
        cmocka_unit_test(dicom_frames_rescaled_alike_keep_their_type),
        cmocka_unit_test(dicom_slices_that_do_not_belong_together_are_refused),
        cmocka_unit_test(one_of_several_dicom_series_is_read),
        cmocka_unit_test(dicom_slices_at_one_position_are_times),
        cmocka_unit_test(dicom_slices_at_uneven_distances_stay_there),
        cmocka_unit_test(slices_that_do_not_fit_or_are_missing_are_refused),
        cmocka_unit_test(wrong_patterns_are_refused),
        cmocka_unit_test(truncated_slices_are_refused),
        cmocka_unit_test(corrupted_slices_do_no_harm),
        cmocka_unit_test(slices_too_large_for_the_memory_are_refused),
        cmocka_unit_test(a_picture_that_declares_more_than_the_memory_is_refused),
        cmocka_unit_test(a_stack_can_be_read_again),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
