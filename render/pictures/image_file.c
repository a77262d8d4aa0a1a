#include "image_file.h"

#include <errno.h>
#include <limits.h>
#include <math.h>
#include <png.h>
#include <setjmp.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <unistd.h>

#include "budget.h"
#include "image_helper.h"
#include "new_file.h"
#include "report.h"

/* ---- PNG ---- */

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

/* Writes PNG with libpng in this process. The helper process often takes longer to start than a
 * picture takes to draw. */
static int write_png(int fd, const char *path, int width, int height, const float *rgba,
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

/* ---- all formats ---- */

/* The depths that a format can hold, default first. */
typedef struct format {
    const char *extension;
    bool is_png, has_alpha;
    trip_image_depth depths[3];
} format;

static const format formats[] = {
    { "png", true, true, { TRIP_IMAGE_U8, TRIP_IMAGE_U16 } },
    { "jpg", false, false, { TRIP_IMAGE_U8 } },
    { "jpeg", false, false, { TRIP_IMAGE_U8 } },
    { "tif", false, true, { TRIP_IMAGE_U16, TRIP_IMAGE_U8, TRIP_IMAGE_FLOAT } },
    { "tiff", false, true, { TRIP_IMAGE_U16, TRIP_IMAGE_U8, TRIP_IMAGE_FLOAT } },
    { "exr", false, true, { TRIP_IMAGE_FLOAT, TRIP_IMAGE_HALF } },
};

static const format *find_format(const char *path)
{
    const char *dot = strrchr(path, '.');
    if (!dot || dot == path || dot[-1] == '/')
        return NULL;
    for (size_t i = 0; i < sizeof formats / sizeof formats[0]; i++)
        if (strcasecmp(dot + 1, formats[i].extension) == 0)
            return &formats[i];
    return NULL;
}

static bool holds(const format *f, trip_image_depth depth)
{
    for (int i = 0; i < 3; i++)
        if (f->depths[i] == depth)
            return true;
    return false;
}

int trip_image_check_transparent(const char *path)
{
    const format *f = find_format(path);
    if (!f || f->has_alpha)
        return 0;
    return trip_fail(
        TRIP_USAGE, "write", path,
        "cannot hold a transparent background; use .png, .tif or .exr, or a background "
        "without transparency");
}

int trip_image_check_path(const char *path, const trip_image_params *params)
{
    const format *f = find_format(path);
    if (!f)
        return trip_fail(TRIP_USAGE, "write", path,
                         "unknown picture format; use the extension .png, .jpg, .tif or .exr");
    if (params && (params->jpeg_quality < 0 || params->jpeg_quality > 100))
        return trip_fail(TRIP_USAGE, "write", path,
                         "the JPEG quality is out of range; use 1 to 100");
    if (params && params->distances && !holds(f, TRIP_IMAGE_FLOAT))
        return trip_fail(TRIP_USAGE, "write", path,
                         "cannot hold distances; use the extension .exr or .tif");
    if (!params || params->depth == TRIP_IMAGE_DEPTH_DEFAULT || holds(f, params->depth))
        return 0;
    return trip_fail(TRIP_USAGE, "write", path,
                     "a .%s file cannot hold this number type; use another type or extension",
                     f->extension);
}

static int start_helper(trip_image_files *files, const char *stage)
{
    return files->helper ? 0 : trip_image_helper_start(&files->helper, stage);
}

void trip_image_close(trip_image_files *files)
{
    trip_image_helper_stop(files->helper);
    files->helper = NULL;
}

int trip_image_prepare(trip_image_files *files, const char *path)
{
    return find_format(path)->is_png ? 0 : start_helper(files, "write");
}

static size_t channels_of(const trip_image_params *params)
{
    return params->distances ? 1 : 4;
}

/* Fails if a value is not finite. Distances may be +infinity. */
static int check_numbers(const char *path, int width, int height, const float *pixels,
                         const trip_image_params *params)
{
    size_t channels = channels_of(params);
    for (int y = 0; y < height; y++) {
        if (trip_interrupted())
            return trip_fail(TRIP_INTERRUPTED, "write", path, "interrupted; nothing is written");
        for (int x = 0; x < width; x++)
            for (size_t c = 0; c < channels; c++, pixels++)
                if (!isfinite(*pixels) && !(params->distances && *pixels > 0))
                    return trip_fail(TRIP_ERROR, "write", path,
                                     "pixel (%d, %d) is not a finite number; nothing is written", x,
                                     y);
    }
    return 0;
}

/* A failure can leave the connection in the middle of a message. */
static int write_by_helper(trip_image_files *files, int fd, const char *path, int width, int height,
                           const float *pixels, const trip_image_params *params)
{
    const int64_t form = params->distances    ? TRIP_IMAGE_FORM_DISTANCES
                         : params->drop_alpha ? TRIP_IMAGE_FORM_RGB
                                              : TRIP_IMAGE_FORM_RGBA;
    const int64_t numbers[5] = { width, height, params->depth, form, params->jpeg_quality };
    int status = start_helper(files, "write");
    if (status == 0)
        status = trip_image_helper_request(files->helper, TRIP_IMAGE_WRITE, path, numbers, fd);
    if (status == 0)
        status = trip_image_helper_send(files->helper, pixels,
                                        (size_t)width * (size_t)height * channels_of(params) *
                                            sizeof(float));
    if (status == 0)
        status = trip_image_helper_expect(files->helper, 0);
    if (status < 0)
        trip_image_close(files);
    return status;
}

static int write_checked(trip_image_files *files, const char *path, int width, int height,
                         const float *pixels, const trip_image_params *params)
{
    trip_new_file file;
    int status = trip_new_file_begin(&file, "write", path);
    if (status < 0)
        return status;
    status = find_format(path)->is_png
                 ? write_png(file.fd, path, width, height, pixels, params)
                 : write_by_helper(files, file.fd, path, width, height, pixels, params);
    if (status == 0)
        return trip_new_file_finish(&file);
    trip_new_file_abandon(&file);
    return status;
}

int trip_image_write(trip_image_files *files, const char *path, int width, int height,
                     const float *pixels, const trip_image_params *params)
{
    static const trip_image_params defaults;
    const trip_image_params *p = params ? params : &defaults;
    int status = trip_image_check_path(path, params);
    if (status < 0)
        return status;
    if (width < 1 || height < 1)
        return trip_fail(TRIP_USAGE, "write", path,
                         "a picture of %d x %d pixels is empty; use 1 x 1 or more", width, height);
    status = check_numbers(path, width, height, pixels, p);
    return status < 0 ? status : write_checked(files, path, width, height, pixels, p);
}

/* The size in the reply must match the length of the data. */
static bool is_size_of(const trip_image_size *size, uint64_t data_bytes)
{
    uint64_t bytes = 4 * sizeof(float);
    return size->width >= 1 && size->width <= INT_MAX && size->height >= 1 &&
           size->height <= INT_MAX &&
           !__builtin_mul_overflow(bytes, (uint64_t)size->width, &bytes) &&
           !__builtin_mul_overflow(bytes, (uint64_t)size->height, &bytes) &&
           !__builtin_add_overflow(bytes, sizeof *size, &bytes) && bytes == data_bytes;
}

static int receive_picture(trip_image_helper *helper, const char *path, trip_image_size *size,
                           float **rgba_out)
{
    uint64_t bytes;
    int status = trip_image_helper_outcome(helper, &bytes);
    if (status == 0 && bytes < sizeof *size)
        status = trip_image_helper_distrust(helper, "a picture without a size");
    if (status == 0)
        status = trip_image_helper_receive(helper, size, sizeof *size);
    if (status == 0 && !is_size_of(size, bytes))
        status = trip_image_helper_distrust(helper, "a picture whose size differs from its data");
    if (status < 0)
        return status;
    float *rgba = malloc(bytes - sizeof *size);
    if (!rgba)
        return trip_fail(TRIP_ERROR, "read", path, "out of memory for its pixels");
    status = trip_image_helper_receive(helper, rgba, bytes - sizeof *size);
    if (status < 0)
        free(rgba);
    else
        *rgba_out = rgba;
    return status;
}

int trip_image_read(trip_image_files *files, const char *path, int *width_out, int *height_out,
                    float **rgba_out)
{
    trip_image_size size = { 0 };
    const int64_t numbers[5] = { (int64_t)(trip_memory_available_bytes() / 4) };
    int status = start_helper(files, "read");
    if (status == 0)
        status = trip_image_helper_request(files->helper, TRIP_IMAGE_READ, path, numbers, -1);
    if (status == 0)
        status = receive_picture(files->helper, path, &size, rgba_out);
    if (status < 0) {
        trip_image_close(files);
        return status;
    }
    *width_out = (int)size.width;
    *height_out = (int)size.height;
    return 0;
}
