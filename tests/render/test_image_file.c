#include "image_file.h"

#include <dirent.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>

#include "test.h"

static char folder[64];
static trip_image_files files;

static const char *path_of(const char *name)
{
    static char path[4][512];
    static int next;
    char *p = path[next++ % 4];
    snprintf(p, sizeof path[0], "%s/%s", folder, name);
    return p;
}

static int make_folder(void **state)
{
    (void)state;
    strcpy(folder, "image_file-XXXXXX");
    return mkdtemp(folder) ? 0 : -1;
}

static int count_files(void)
{
    DIR *d = opendir(folder);
    int count = 0;
    for (struct dirent *e; (e = readdir(d));)
        count += strcmp(e->d_name, ".") != 0 && strcmp(e->d_name, "..") != 0;
    closedir(d);
    return count;
}

static int remove_folder(void **state)
{
    (void)state;
    trip_image_close(&files);
    DIR *d = opendir(folder);
    for (struct dirent *e; (e = readdir(d));)
        unlink(path_of(e->d_name));
    closedir(d);
    return rmdir(folder);
}

/* Fills a picture with colours that do not exceed its alpha. Every pixel is different. */
static void fill(float *rgba, int width, int height)
{
    for (int y = 0; y < height; y++)
        for (int x = 0; x < width; x++) {
            float *p = rgba + ((size_t)y * (size_t)width + (size_t)x) * 4;
            p[3] = (float)(x + 1) / (float)width;
            p[0] = p[3] * (float)x / (float)width;
            p[1] = p[3] * (float)y / (float)height;
            p[2] = p[3] * 0.5f;
        }
}

/* Writes a picture, reads it back and returns the largest difference. */
static double round_trip(const char *name, const trip_image_params *params)
{
    enum { W = 37, H = 23 };
    float rgba[W * H * 4], *back;
    int width, height;
    fill(rgba, W, H);
    assert_int_equal(trip_image_write(&files, path_of(name), W, H, rgba, params), 0);
    assert_int_equal(trip_image_read(&files, path_of(name), &width, &height, &back), 0);
    assert_int_equal(width, W);
    assert_int_equal(height, H);
    double worst = test_max_apart(rgba, back, W * H * 4);
    free(back);
    return worst;
}

static void float_formats_give_back_the_same_numbers(void **state)
{
    (void)state;
    assert_true(round_trip("a.exr", NULL) < 1e-6); /* through a curve and back */
    assert_true(round_trip("a.tif", &(trip_image_params){ .depth = TRIP_IMAGE_FLOAT }) == 0);
}

static void integer_formats_are_within_half_a_step(void **state)
{
    (void)state;
    /* A PNG rounds colour and alpha, so that their product differs by at most twice half a step. */
    assert_true(round_trip("a.png", NULL) <= 1.01 / 255);
    assert_true(round_trip("a.png", &(trip_image_params){ .depth = TRIP_IMAGE_U16 }) <=
                1.01 / 65535);
    assert_true(round_trip("a.tif", NULL) <= 0.501 / 65535);
    assert_true(round_trip("a.TIFF", &(trip_image_params){ .depth = TRIP_IMAGE_U8 }) <=
                0.501 / 255);
}

static void half_floats_are_within_their_precision(void **state)
{
    (void)state;
    double worst = round_trip("h.exr", &(trip_image_params){ .depth = TRIP_IMAGE_HALF });
    assert_true(worst > 0 && worst <= 0x1p-12);
}

/* Reads the only pixel of an EXR. Its channels A, B, G, R or B, G, R are floats, uncompressed
 * because zip saves nothing here. They are the last bytes of the file. */
static void read_exr_pixel(const char *path, int channels, float *values)
{
    FILE *f = fopen(path, "rb");
    assert_non_null(f);
    fseek(f, -4L * channels, SEEK_END);
    assert_int_equal(fread(values, 4, (size_t)channels, f), channels);
    fclose(f);
}

/* A display value of 0.5 is ((0.5 + 0.055) / 1.055) ^ 2.4 = 0.214041 of the light. A value of 0.02
 * is 0.02 / 12.92 = 0.00154799. */
static void exr_holds_linear_light_of_colours_without_their_alpha(void **state)
{
    (void)state;
    const float opaque[4] = { 0.5f, 0.02f, 1, 1 }, half[4] = { 0.25f, 0.01f, 0.5f, 0.5f };
    float file[4];
    assert_int_equal(trip_image_write(&files, path_of("l.exr"), 1, 1, opaque, NULL), 0);
    read_exr_pixel(path_of("l.exr"), 4, file);
    assert_true(file[0] == 1 && file[1] == 1);
    assert_close(file[2], 0.00154799, 1e-7);
    assert_close(file[3], 0.21404114, 1e-7);
    /* Half the opacity gives half the light of the same colour. */
    assert_int_equal(trip_image_write(&files, path_of("l.exr"), 1, 1, half, NULL), 0);
    read_exr_pixel(path_of("l.exr"), 4, file);
    assert_true(file[0] == 0.5f && file[1] == 0.5f);
    assert_close(file[2], 0.00077399, 1e-7);
    assert_close(file[3], 0.10702057, 1e-7);
    /* Over black, the visible colour is the premultiplied colour: 0.25 is 0.05087609 of the light.
     */
    const trip_image_params over_black = { .drop_alpha = true };
    assert_int_equal(trip_image_write(&files, path_of("l.exr"), 1, 1, half, &over_black), 0);
    read_exr_pixel(path_of("l.exr"), 3, file);
    assert_close(file[0], 0.21404114, 1e-7);
    assert_close(file[2], 0.05087609, 1e-7);
}

static void the_curve_of_exr_loses_nothing_outside_its_range(void **state)
{
    (void)state;
    const float rgba[2][4] = { { -0.5f, 3, 0.03f, 1 }, { 0.25f, 0, 2, 0 } };
    float *back;
    int width, height;
    assert_int_equal(trip_image_write(&files, path_of("o.exr"), 2, 1, rgba[0], NULL), 0);
    assert_int_equal(trip_image_read(&files, path_of("o.exr"), &width, &height, &back), 0);
    assert_true(test_max_apart(rgba[0], back, 8) < 1e-6);
    free(back);
}

/* Reads the bytes of a PNG one pixel wide. It inflates the only IDAT chunk and undoes the filters.
 * Without a left neighbour, the filters None, Sub and Up over zero are the same. */
static void read_narrow_png(const char *path, uint8_t *pixels, int rows, int pixel_bytes)
{
    uint8_t file[4096], raw[512];
    FILE *f = fopen(path, "rb");
    size_t bytes = fread(file, 1, sizeof file, f), at = 8;
    fclose(f);
    while (at + 8 < bytes && memcmp(file + at + 4, "IDAT", 4) != 0)
        at += 12 + ((size_t)file[at + 2] << 8 | file[at + 3]);
    uLongf size = sizeof raw;
    assert_int_equal(uncompress(raw, &size, file + at + 8, bytes - at - 8), Z_OK);
    assert_int_equal(size, rows * (1 + pixel_bytes));
    for (int y = 0; y < rows; y++)
        for (int c = 0; c < pixel_bytes; c++) {
            const uint8_t *row = raw + y * (1 + pixel_bytes);
            uint8_t up = y > 0 ? pixels[(y - 1) * pixel_bytes + c] : 0;
            assert_true(row[0] == 0 || row[0] == 1 || row[0] == 2 || row[0] == 4);
            pixels[y * pixel_bytes + c] = (uint8_t)(row[1 + c] + (row[0] & 6 ? up : 0));
        }
}

static void a_png_holds_straight_colour_rounded_to_nearest_and_the_top_row_first(void **state)
{
    (void)state;
    const float rgba[] = {
        0.25f, 0.1f, 0, 0.5f, /* straight: 0.5, 0.2, 0 */
        -1,    2,    0, 1,    /* clamped */
        0.5f,  0.5f, 0, 0,    /* colour without alpha cannot be represented */
    };
    uint8_t pixels[12];
    assert_int_equal(trip_image_write(&files, path_of("p.png"), 1, 3, rgba, NULL), 0);
    read_narrow_png(path_of("p.png"), pixels, 3, 4);
    const uint8_t expected[] = { 128, 51, 0, 128, 0, 255, 0, 255, 0, 0, 0, 0 };
    assert_memory_equal(pixels, expected, sizeof pixels);
}

static void every_code_is_reached_from_half_a_step_on_either_side(void **state)
{
    (void)state;
    for (int sign = -1; sign <= 1; sign += 2) {
        float rgba[256][4];
        uint8_t pixels[256 * 3];
        for (int n = 0; n < 256; n++)
            for (int c = 0; c < 4; c++)
                rgba[n][c] = ((float)n + 0.49f * (float)sign) / 255;
        for (int n = 0; n < 256; n += 64) {
            const trip_image_params rgb = { .drop_alpha = true };
            assert_int_equal(trip_image_write(&files, path_of("c.png"), 1, 64, rgba[n], &rgb), 0);
            read_narrow_png(path_of("c.png"), pixels + n * 3, 64, 3);
        }
        for (int n = 0; n < 256 * 3; n++)
            assert_int_equal(pixels[n], n / 3);
    }
}

static void distances_are_read_back_unchanged(void **state)
{
    (void)state;
    const trip_image_params distances = { .distances = true };
    const float z[4] = { 0.5f, 1e6f, INFINITY, 3 };
    int width, height;
    float *back;
    assert_int_equal(trip_image_write(&files, path_of("z.tif"), 4, 1, z, &distances), 0);
    assert_int_equal(trip_image_read(&files, path_of("z.tif"), &width, &height, &back), 0);
    assert_int_equal(width, 4);
    assert_int_equal(height, 1);
    for (int i = 0; i < 4; i++)
        assert_true(back[4 * i] == z[i]);
    free(back);
    const float none[2] = { 1, NAN }, less[2] = { 1, -INFINITY };
    assert_int_equal(trip_image_write(&files, path_of("z.exr"), 2, 1, none, &distances),
                     TRIP_ERROR);
    assert_int_equal(trip_image_write(&files, path_of("z.exr"), 2, 1, less, &distances),
                     TRIP_ERROR);
    assert_int_equal(trip_image_check_path("z.png", &distances), TRIP_USAGE);
}

static void jpeg_is_the_picture_over_black(void **state)
{
    (void)state;
    enum { SIDE = 32 };
    static float rgba[SIDE * SIDE * 4];
    float *back;
    int width, height;
    for (int i = 0; i < SIDE * SIDE; i++)
        memcpy(rgba + 4 * i, (float[]){ 0.4f, 0.2f, 0.1f, 0.5f }, 16);
    assert_int_equal(trip_image_write(&files, path_of("a.JPG"), SIDE, SIDE, rgba, NULL), 0);
    assert_int_equal(trip_image_read(&files, path_of("a.JPG"), &width, &height, &back), 0);
    for (int i = 0; i < SIDE * SIDE; i++) {
        assert_true(fabsf(back[4 * i] - 0.4f) < 0.012f && fabsf(back[4 * i + 1] - 0.2f) < 0.012f);
        assert_true(back[4 * i + 3] == 1);
    }
    free(back);
}

static void a_pixel_that_is_no_number_is_refused_and_the_old_file_stays(void **state)
{
    (void)state;
    float rgba[2 * 4] = { 1, 1, 1, 1, 1, 1, 1, 1 };
    struct stat before, after;
    assert_int_equal(trip_image_write(&files, path_of("n.exr"), 2, 1, rgba, NULL), 0);
    stat(path_of("n.exr"), &before);
    for (int i = 0; i < 2; i++) {
        rgba[5] = i ? NAN : -INFINITY;
        test_catch_reports();
        assert_int_equal(trip_image_write(&files, path_of("n.exr"), 2, 1, rgba, NULL), TRIP_ERROR);
        assert_one_report("n.exr: pixel (1, 0) is not a finite number");
    }
    stat(path_of("n.exr"), &after);
    assert_int_equal(before.st_ino, after.st_ino);
}

static void expect_refusal(const char *path, trip_image_depth depth, int status, const char *why)
{
    const float rgba[4] = { 0, 0, 0, 1 };
    test_catch_reports();
    assert_int_equal(
        trip_image_write(&files, path, 1, 1, rgba, &(trip_image_params){ .depth = depth }), status);
    assert_one_report(why);
}

static void wrong_names_and_depths_are_wrong_usage(void **state)
{
    (void)state;
    expect_refusal(path_of("a.gif"), TRIP_IMAGE_DEPTH_DEFAULT, TRIP_USAGE,
                   "unknown picture format");
    expect_refusal(path_of("png"), TRIP_IMAGE_DEPTH_DEFAULT, TRIP_USAGE, "unknown picture format");
    expect_refusal(path_of(".png"), TRIP_IMAGE_DEPTH_DEFAULT, TRIP_USAGE, "unknown picture format");
    expect_refusal(path_of("a.png"), TRIP_IMAGE_FLOAT, TRIP_USAGE,
                   "a.png: a .png file cannot hold this number type");
    expect_refusal(path_of("a.jpg"), TRIP_IMAGE_U16, TRIP_USAGE,
                   "a.jpg: a .jpg file cannot hold this number type");
    expect_refusal(path_of("a.exr"), TRIP_IMAGE_U8, TRIP_USAGE,
                   "a.exr: a .exr file cannot hold this number type");
}

static void an_unwritable_path_is_a_failure(void **state)
{
    (void)state;
    expect_refusal(path_of("missing/a.png"), TRIP_IMAGE_DEPTH_DEFAULT, TRIP_ERROR,
                   "No such file or directory");
    mkdir(path_of("folder.png"), 0777);
    expect_refusal(path_of("folder.png"), TRIP_IMAGE_DEPTH_DEFAULT, TRIP_ERROR, "directory");
    rmdir(path_of("folder.png"));
}

/* A limit on file size simulates a full disk. In both cases write(2) fails or writes less, because
 * the program ignores the signal. The helper process inherits the limit at its start. It restarts
 * after every failure, so that the failing read below restarts it. */
static void a_full_disk_is_reported_and_leaves_nothing(void **state)
{
    (void)state;
    enum { SIDE = 256 };
    static float rgba[SIDE * SIDE * 4];
    for (int i = 0; i < SIDE * SIDE * 4; i++)
        rgba[i] = (float)test_random();
    struct rlimit old, tight;
    signal(SIGXFSZ, SIG_IGN);
    getrlimit(RLIMIT_FSIZE, &old);
    tight = (struct rlimit){ 3000, old.rlim_max };
    test_catch_reports();
    assert_int_equal(trip_image_read(&files, path_of("missing.png"), &(int){ 0 }, &(int){ 0 },
                                     &(float *){ NULL }),
                     TRIP_ERROR);
    assert_one_report("missing.png");
    int before = count_files();
    const char *const names[] = { "full.png", "full.jpg", "full.tif", "full.exr" };
    for (int i = 0; i < 4; i++) {
        test_catch_reports();
        setrlimit(RLIMIT_FSIZE, &tight);
        int status = trip_image_write(&files, path_of(names[i]), SIDE, SIDE, rgba, NULL);
        setrlimit(RLIMIT_FSIZE, &old);
        assert_one_report("ulimit -f");
        assert_int_equal(status, TRIP_ERROR);
        assert_int_equal(count_files(), before);
    }
}

static void a_broken_picture_is_refused_when_read(void **state)
{
    (void)state;
    enum { SIDE = 64 };
    static float rgba[SIDE * SIDE * 4];
    float *back;
    int width, height;
    const char *const names[] = { "cut.tif", "cut.exr" };
    for (int i = 0; i < SIDE * SIDE * 4; i++)
        rgba[i] = (float)test_random();
    for (int i = 0; i < 2; i++) {
        assert_int_equal(trip_image_write(&files, path_of(names[i]), SIDE, SIDE, rgba, NULL), 0);
        assert_int_equal(truncate(path_of(names[i]), 5000), 0);
        test_catch_reports();
        assert_int_equal(trip_image_read(&files, path_of(names[i]), &width, &height, &back),
                         TRIP_ERROR);
        assert_one_report(names[i]);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(float_formats_give_back_the_same_numbers),
        cmocka_unit_test(integer_formats_are_within_half_a_step),
        cmocka_unit_test(half_floats_are_within_their_precision),
        cmocka_unit_test(exr_holds_linear_light_of_colours_without_their_alpha),
        cmocka_unit_test(the_curve_of_exr_loses_nothing_outside_its_range),
        cmocka_unit_test(a_png_holds_straight_colour_rounded_to_nearest_and_the_top_row_first),
        cmocka_unit_test(every_code_is_reached_from_half_a_step_on_either_side),
        cmocka_unit_test(distances_are_read_back_unchanged),
        cmocka_unit_test(jpeg_is_the_picture_over_black),
        cmocka_unit_test(a_pixel_that_is_no_number_is_refused_and_the_old_file_stays),
        cmocka_unit_test(wrong_names_and_depths_are_wrong_usage),
        cmocka_unit_test(an_unwritable_path_is_a_failure),
        cmocka_unit_test(a_full_disk_is_reported_and_leaves_nothing),
        cmocka_unit_test(a_broken_picture_is_refused_when_read),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
