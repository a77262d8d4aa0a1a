#include "picture_data.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <zlib.h>

enum { HEADER_BYTES = 13, CHUNK_BYTES = 12 };

static void put_u32(uint8_t *at, size_t value)
{
    for (int i = 0; i < 4; i++)
        at[i] = (uint8_t)(value >> (24 - 8 * i));
}

/* Completes a PNG chunk with its data already at `at` + 8. Returns the position after the chunk. */
static uint8_t *close_chunk(uint8_t *at, const char *name, size_t bytes)
{
    put_u32(at, bytes);
    memcpy(at + 4, name, 4);
    put_u32(at + 8 + bytes, (size_t)crc32(0, at + 4, (uInt)(bytes + 4)));
    return at + bytes + CHUNK_BYTES;
}

/* Encodes rows as a PNG file. A row has a filter byte (0 disables filtering) and 3 bytes per pixel.
 * Returns NULL if memory is exhausted. */
static uint8_t *encode_png(const uint8_t *rows, int width, int height, size_t *bytes)
{
    static const uint8_t magic[8] = { 0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n' };
    uLong raw = (uLong)height * (3 * (uLong)width + 1);
    uLongf packed = compressBound(raw);
    uint8_t *file = malloc(sizeof magic + 3 * CHUNK_BYTES + HEADER_BYTES + packed), *at = file;
    if (!file)
        return NULL;
    memcpy(at, magic, sizeof magic);
    at += sizeof magic;
    put_u32(at + 8, (size_t)width);
    put_u32(at + 12, (size_t)height);
    memcpy(at + 16, "\x08\x02\x00\x00\x00", 5); /* 8 bits, RGB */
    at = close_chunk(at, "IHDR", HEADER_BYTES);
    if (compress2(at + 8, &packed, rows, raw, 9) != Z_OK) {
        free(file);
        return NULL;
    }
    at = close_chunk(at, "IDAT", packed);
    at = close_chunk(at, "IEND", 0);
    *bytes = (size_t)(at - file);
    return file;
}

static char *encode_base64(const uint8_t *file, size_t bytes)
{
    static const char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    static const char prefix[] = "data:image/png;base64,";
    char *text = malloc(sizeof prefix + (bytes + 2) / 3 * 4), *at = text;
    if (!text)
        return NULL;
    at = stpcpy(at, prefix);
    for (size_t i = 0; i < bytes; i += 3) {
        size_t left = bytes - i;
        uint32_t three = (uint32_t)file[i] << 16 | (left > 1 ? (uint32_t)file[i + 1] << 8 : 0) |
                         (left > 2 ? (uint32_t)file[i + 2] : 0);
        *at++ = digits[three >> 18];
        *at++ = digits[three >> 12 & 63];
        *at++ = left > 1 ? digits[three >> 6 & 63] : '=';
        *at++ = left > 2 ? digits[three & 63] : '=';
    }
    *at = 0;
    return text;
}

/* Picture a, or the difference of a and b unless b is NULL. */
typedef struct source {
    const float *a, *b;
    int width, height, step; /* step x step pixels become one */
} source;

static uint8_t byte_of(double x)
{
    return (uint8_t)lround(255 * fmin(1, fmax(0, x)));
}

/* Computes the mean colour of the step x step pixels that become one. */
static void mean_colour(const source *s, int x, int y, uint8_t rgb[3])
{
    double sum[3] = { 0 };
    for (int j = y * s->step; j < (y + 1) * s->step; j++)
        for (int i = x * s->step; i < (x + 1) * s->step; i++)
            for (int c = 0; c < 3; c++)
                sum[c] += (double)s->a[4 * ((size_t)j * (size_t)s->width + (size_t)i) + (size_t)c];
    for (int c = 0; c < 3; c++)
        rgb[c] = byte_of(sum[c] / (s->step * s->step));
}

static void difference_colour(const source *s, int x, int y, uint8_t rgb[3])
{
    double max = 0;
    for (int j = y * s->step; j < (y + 1) * s->step; j++)
        for (int i = x * s->step; i < (x + 1) * s->step; i++)
            for (size_t c = 0; c < 4; c++) {
                size_t at = 4 * ((size_t)j * (size_t)s->width + (size_t)i) + c;
                max = fmax(max, fabs((double)s->a[at] - (double)s->b[at]));
            }
    double heat = 3 * 255 * max / ACCURACY_DIFFERENCE_MAX;
    for (int c = 0; c < 3; c++)
        rgb[c] = byte_of(heat - c);
}

static char *encode(source s, int max)
{
    int longer = s.width > s.height ? s.width : s.height;
    s.step = (longer + max - 1) / max;
    int width = s.width / s.step, height = s.height / s.step;
    width = width > 0 ? width : 1;
    height = height > 0 ? height : 1;
    if (s.step > s.width || s.step > s.height)
        s.step = 1;
    size_t bytes = 0;
    uint8_t *rows = calloc((size_t)height, 3 * (size_t)width + 1), *file = NULL;
    for (int y = 0; y < height && rows; y++)
        for (int x = 0; x < width; x++)
            (s.b ? difference_colour : mean_colour)(
                &s, x, y, rows + (size_t)y * (3 * (size_t)width + 1) + 1 + 3 * (size_t)x);
    if (rows)
        file = encode_png(rows, width, height, &bytes);
    char *text = file ? encode_base64(file, bytes) : NULL;
    free(rows);
    free(file);
    return text;
}

char *accuracy_picture_data(const float *rgba, int width, int height, int max)
{
    return encode((source){ .a = rgba, .width = width, .height = height }, max);
}

char *accuracy_difference_data(const float *a, const float *b, int width, int height, int max)
{
    return encode((source){ .a = a, .b = b, .width = width, .height = height }, max);
}
