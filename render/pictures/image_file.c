#include "image_file.h"

#include <limits.h>
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "budget.h"
#include "image_helper.h"
#include "new_file.h"
#include "png_file.h"
#include "report.h"

/* The depths that a format can hold, default first. */
typedef struct format {
    const char *extension;
    bool is_png;
    trip_image_depth depths[3];
} format;

static const format formats[] = {
    { "png", true, { TRIP_IMAGE_U8, TRIP_IMAGE_U16 } },
    { "jpg", false, { TRIP_IMAGE_U8 } },
    { "jpeg", false, { TRIP_IMAGE_U8 } },
    { "tif", false, { TRIP_IMAGE_U16, TRIP_IMAGE_U8, TRIP_IMAGE_FLOAT } },
    { "tiff", false, { TRIP_IMAGE_U16, TRIP_IMAGE_U8, TRIP_IMAGE_FLOAT } },
    { "exr", false, { TRIP_IMAGE_FLOAT, TRIP_IMAGE_HALF } },
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
                 ? trip_png_write(file.fd, path, width, height, pixels, params)
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
