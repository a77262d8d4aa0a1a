#include "png_file.h"

#include <errno.h>
#include <png.h>
#include <setjmp.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "errno_text.h"
#include "report.h"

/* zlib's default, 6, takes twice as long and makes files 7 % smaller. */
enum { COMPRESSION = 4 };

typedef struct sink {
    int fd;
    int number;      /* errno of a failed write, or 0 */
    char fault[128]; /* libpng's message, if writing did not fail */
} sink;

static void put_bytes(png_structp png, png_bytep bytes, size_t count)
{
    sink *s = png_get_io_ptr(png);
    while (count > 0) {
        const ssize_t n = write(s->fd, bytes, count);
        if (n < 0 && errno != EINTR) {
            s->number = errno;
            png_error(png, "write");
        }
        bytes += n > 0 ? n : 0;
        count -= n > 0 ? (size_t)n : 0;
    }
}

/* put_bytes() does not buffer. */
static void flush_nothing(png_structp png)
{
    (void)png;
}

static void keep_fault(png_structp png, png_const_charp text)
{
    sink *s = png_get_error_ptr(png);
    strncpy(s->fault, text, sizeof s->fault - 1);
    png_longjmp(png, 1);
}

static void ignore_warning(png_structp png, png_const_charp text)
{
    (void)png;
    (void)text;
}

/* Converts a row to unassociated alpha. The colour is divided by alpha before rounding, so that
 * thin parts keep their hue. Without an alpha channel the colour stays premultiplied, over
 * black. */
static void convert_row(const float *rgba, int width, int channels, unsigned top, png_bytep row)
{
    for (int x = 0; x < width; x++, rgba += 4) {
        const float alpha = rgba[3] < 0 ? 0 : rgba[3] > 1 ? 1 : rgba[3];
        for (int c = 0; c < channels; c++) {
            float v = rgba[c];
            if (channels == 4 && c < 3)
                v = alpha > 0 ? v / alpha : 0;
            const unsigned n = trip_image_integer(v, top);
            if (top > UINT8_MAX)
                *row++ = (png_byte)(n >> 8);
            *row++ = (png_byte)n;
        }
    }
}

typedef struct picture {
    const char *path;
    int width, height, channels, bits;
    const float *rgba;
    png_bytep row; /* room for one row */
} picture;

static int write_rows(png_structp png, png_infop info, const picture *p)
{
    const unsigned top = (1u << p->bits) - 1;
    png_set_IHDR(png, info, (png_uint_32)p->width, (png_uint_32)p->height, p->bits,
                 p->channels == 4 ? PNG_COLOR_TYPE_RGBA : PNG_COLOR_TYPE_RGB, PNG_INTERLACE_NONE,
                 PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    png_set_compression_level(png, COMPRESSION);
    png_write_info(png, info);
    for (int y = 0; y < p->height; y++) {
        if (trip_interrupted())
            return trip_fail(TRIP_INTERRUPTED, "write", p->path, "interrupted; nothing is written");
        convert_row(p->rgba + (size_t)y * (size_t)p->width * 4, p->width, p->channels, top, p->row);
        png_write_row(png, p->row);
    }
    png_write_end(png, info);
    return 0;
}

static int fail(const sink *s, const char *path)
{
    char room[256];
    if (s->number)
        return trip_fail(TRIP_ERROR, "write", path, "cannot write: %s",
                         trip_errno_text(s->number, room, sizeof room));
    return trip_fail(TRIP_ERROR, "write", path, "cannot encode: %s", s->fault);
}

/* libpng longjmps back here on errors. */
static int write_picture(sink *s, const picture *p)
{
    png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, s, keep_fault, ignore_warning);
    png_infop info = png ? png_create_info_struct(png) : NULL;
    int status;
    if (!info) {
        png_destroy_write_struct(&png, NULL);
        return trip_fail(TRIP_ERROR, "write", p->path, "out of memory");
    }
    if (setjmp(png_jmpbuf(png))) {
        png_destroy_write_struct(&png, &info);
        return fail(s, p->path);
    }
    png_set_write_fn(png, s, put_bytes, flush_nothing);
    status = write_rows(png, info, p);
    png_destroy_write_struct(&png, &info);
    return status;
}

int trip_png_write(int fd, const char *path, int width, int height, const float *rgba,
                   const trip_image_params *params)
{
    sink s = { .fd = fd };
    picture p = { .path = path,
                  .width = width,
                  .height = height,
                  .channels = params->drop_alpha ? 3 : 4,
                  .bits = params->depth == TRIP_IMAGE_U16 ? 16 : 8,
                  .rgba = rgba };
    p.row = malloc((size_t)width * (size_t)p.channels * (size_t)p.bits / 8);
    if (!p.row)
        return trip_fail(TRIP_ERROR, "write", path, "out of memory");
    const int status = write_picture(&s, &p);
    free(p.row);
    return status;
}
