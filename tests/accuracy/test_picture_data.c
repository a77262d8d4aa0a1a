/* Tests pictures as text. The test decodes base64, the chunks of PNG and the zlib stream. */
#include <zlib.h>

#include "picture_data.h"
#include "test.h"

static int digit(char c)
{
    static const char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    return (int)(strchr(digits, c) - digits);
}

static size_t decode_base64(const char *text, uint8_t *out)
{
    size_t bytes = 0, length = strlen(text);
    assert_int_equal(length % 4, 0);
    for (size_t i = 0; i < length; i += 4) {
        unsigned three = 0;
        for (int k = 0; k < 4; k++)
            three = three << 6 |
                    (unsigned)(text[i + (size_t)k] == '=' ? 0 : digit(text[i + (size_t)k]));
        for (int k = 0; k < 3 && text[i + (size_t)k + 1] != '='; k++)
            out[bytes++] = (uint8_t)(three >> (16 - 8 * k));
    }
    return bytes;
}

static size_t read_u32(const uint8_t *at)
{
    return (size_t)at[0] << 24 | (size_t)at[1] << 16 | (size_t)at[2] << 8 | at[3];
}

/* Decodes a PNG with one IDAT chunk into rows, and checks all checksums. */
static void decode(char *text, int width, int height, uint8_t *rows)
{
    static const char prefix[] = "data:image/png;base64,";
    static uint8_t file[1 << 16];
    assert_non_null(text);
    assert_memory_equal(text, prefix, sizeof prefix - 1);
    size_t bytes = decode_base64(text + sizeof prefix - 1, file), at = 8;
    free(text);
    assert_memory_equal(file, "\x89PNG\r\n\x1a\n", 8);
    for (int chunk = 0; at < bytes; chunk++) {
        size_t length = read_u32(file + at);
        uLongf row_bytes = (uLongf)(height * (3 * width + 1));
        assert_int_equal(crc32(0, file + at + 4, (uInt)length + 4),
                         read_u32(file + at + 8 + length));
        if (chunk == 0) {
            assert_int_equal(read_u32(file + at + 8), width);
            assert_int_equal(read_u32(file + at + 12), height);
        }
        if (chunk == 1)
            assert_int_equal(uncompress(rows, &row_bytes, file + at + 8, length), Z_OK);
        at += length + 12;
    }
    assert_memory_equal(file + bytes - 8, "IEND", 4);
}

static void pictures_are_reduced_by_averaging(void **state)
{
    (void)state;
    float rgba[4 * 4 * 2 * 4];
    uint8_t rows[2 * (3 * 4 + 1)];
    for (int i = 0; i < 8 * 4; i++)
        for (int c = 0; c < 4; c++)
            rgba[4 * i + c] = c == 0 ? 1 : c == 1 ? (float)(i % 2) : 0;
    decode(accuracy_picture_data(rgba, 8, 4, 4), 4, 2, rows);
    for (int y = 0; y < 2; y++)
        for (int x = 0; x < 4; x++) {
            const uint8_t *pixel = rows + 13 * y + 1 + 3 * x;
            assert_int_equal(rows[13 * y], 0);
            assert_int_equal(pixel[0], 255);
            assert_int_equal(pixel[1], 128);
            assert_int_equal(pixel[2], 0);
        }
}

/* A pixel of the result shows the largest difference of its source pixels and their channels. Red
 * is a third of ACCURACY_DIFFERENCE_MAX. */
static void reduced_differences_keep_the_largest(void **state)
{
    (void)state;
    float a[4 * 4 * 4] = { 0 }, b[4 * 4 * 4] = { 0 };
    uint8_t rows[2 * (3 * 2 + 1)];
    b[4 * 5 + 3] = (float)(ACCURACY_DIFFERENCE_MAX / 3 / 255);
    a[4 * 10] = 1;
    decode(accuracy_difference_data(a, b, 4, 4, 2), 2, 2, rows);
    const uint8_t red[3] = { 255, 0, 0 }, black[3] = { 0 }, white[3] = { 255, 255, 255 };
    assert_memory_equal(rows + 1, red, 3);
    assert_memory_equal(rows + 4, black, 3);
    assert_memory_equal(rows + 11, white, 3);
}

static void pictures_of_one_column_are_encoded(void **state)
{
    (void)state;
    float rgba[4 * 40] = { 0 };
    uint8_t rows[40 * (3 * 1 + 1)];
    decode(accuracy_picture_data(rgba, 1, 40, 64), 1, 40, rows);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(pictures_are_reduced_by_averaging),
        cmocka_unit_test(reduced_differences_keep_the_largest),
        cmocka_unit_test(pictures_of_one_column_are_encoded),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
