#include "image_file.h"

#include <limits.h>
#include <math.h>
#include <pthread.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "budget.h"
#include "image_helper.h"
#include "new_file.h"
#include "report.h"

/* One helper for all pictures of this process, started when first wanted and kept. */
static pthread_mutex_t helper_lock = PTHREAD_MUTEX_INITIALIZER;
static trip_image_helper *helper; /* under helper_lock */

/* What a format can hold, the default depth first. */
typedef struct format {
    const char *extension;
    trip_image_depth depths[3];
} format;

static const format formats[] = {
    { "png", { TRIP_IMAGE_U8, TRIP_IMAGE_U16 } },
    { "jpg", { TRIP_IMAGE_U8 } },
    { "jpeg", { TRIP_IMAGE_U8 } },
    { "tif", { TRIP_IMAGE_U16, TRIP_IMAGE_U8, TRIP_IMAGE_FLOAT } },
    { "tiff", { TRIP_IMAGE_U16, TRIP_IMAGE_U8, TRIP_IMAGE_FLOAT } },
    { "exr", { TRIP_IMAGE_FLOAT, TRIP_IMAGE_HALF } },
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

int trip_image_check_path(const char *path, const trip_image_params *params)
{
    const format *f = find_format(path);
    if (!f)
        return trip_fail(TRIP_USAGE, "write", path,
                         "pictures are named .png, .jpg, .tif or .exr, which sets their format");
    if (params && (params->jpeg_quality < 0 || params->jpeg_quality > 100))
        return trip_fail(TRIP_USAGE, "write", path, "a JPEG quality is 1 to 100");
    if (!params || params->depth == TRIP_IMAGE_DEPTH_DEFAULT)
        return 0;
    for (int i = 0; i < 3; i++)
        if (f->depths[i] == params->depth)
            return 0;
    return trip_fail(TRIP_USAGE, "write", path, "a .%s file cannot hold that kind of number",
                     f->extension);
}

static int start_helper(const char *what)
{
    return helper ? 0 : trip_image_helper_start(&helper, what);
}

/* After a failure the connection may be in the middle of something. */
static void drop_helper(void)
{
    trip_image_helper_stop(helper);
    helper = NULL;
}

int trip_image_prepare(void)
{
    pthread_mutex_lock(&helper_lock);
    int status = start_helper("write");
    pthread_mutex_unlock(&helper_lock);
    return status;
}

static int check_finite(const char *path, int width, int height, const float *rgba)
{
    for (int y = 0; y < height; y++) {
        if (trip_interrupted())
            return trip_fail(TRIP_INTERRUPTED, "write", path, "interrupted; nothing is written");
        for (int x = 0; x < width; x++)
            for (int c = 0; c < 4; c++)
                if (!isfinite(rgba[((size_t)y * (size_t)width + (size_t)x) * 4 + (size_t)c]))
                    return trip_fail(TRIP_ERROR, "write", path,
                                     "pixel (%d, %d) is not a finite number; nothing is written", x,
                                     y);
    }
    return 0;
}

static int write_locked(const char *path, int width, int height, const float *rgba,
                        const trip_image_params *params)
{
    trip_new_file file;
    const int64_t numbers[5] = { width, height, params->depth, params->drop_alpha,
                                 params->jpeg_quality };
    int status = trip_new_file_begin(&file, "write", path);
    if (status < 0)
        return status;
    status = start_helper("write");
    if (status == 0)
        status = trip_image_helper_request(helper, TRIP_IMAGE_WRITE, path, numbers, file.fd);
    if (status == 0)
        status = trip_image_helper_send(helper, rgba,
                                        (size_t)width * (size_t)height * 4 * sizeof(float));
    if (status == 0)
        status = trip_image_helper_expect(helper, 0);
    if (status == 0)
        return trip_new_file_finish(&file);
    drop_helper();
    trip_new_file_abandon(&file);
    return status;
}

int trip_image_write(const char *path, int width, int height, const float *rgba,
                     const trip_image_params *params)
{
    static const trip_image_params defaults;
    int status = trip_image_check_path(path, params);
    if (status < 0)
        return status;
    if (width < 1 || height < 1)
        return trip_fail(TRIP_USAGE, "write", path, "a picture of %d x %d pixels is empty", width,
                         height);
    status = check_finite(path, width, height, rgba);
    if (status < 0)
        return status;
    pthread_mutex_lock(&helper_lock);
    status = write_locked(path, width, height, rgba, params ? params : &defaults);
    pthread_mutex_unlock(&helper_lock);
    return status;
}

/* The size that comes first must be that of a picture which fills the data. */
static bool is_size_of(const trip_image_size *size, uint64_t data_bytes)
{
    uint64_t bytes = 4 * sizeof(float);
    return size->width >= 1 && size->width <= INT_MAX && size->height >= 1 &&
           size->height <= INT_MAX &&
           !__builtin_mul_overflow(bytes, (uint64_t)size->width, &bytes) &&
           !__builtin_mul_overflow(bytes, (uint64_t)size->height, &bytes) &&
           !__builtin_add_overflow(bytes, sizeof *size, &bytes) && bytes == data_bytes;
}

static int receive_picture(const char *path, trip_image_size *size, float **rgba_out)
{
    uint64_t bytes;
    int status = trip_image_helper_outcome(helper, &bytes);
    if (status == 0 && bytes < sizeof *size)
        status = trip_image_helper_distrust(helper, "a picture without a size");
    if (status == 0)
        status = trip_image_helper_receive(helper, size, sizeof *size);
    if (status == 0 && !is_size_of(size, bytes))
        status = trip_image_helper_distrust(helper, "a picture of another size than it says");
    if (status < 0)
        return status;
    float *rgba = malloc(bytes - sizeof *size);
    if (!rgba)
        return trip_fail(TRIP_ERROR, "read", path, "no memory for its pixels");
    status = trip_image_helper_receive(helper, rgba, bytes - sizeof *size);
    if (status < 0)
        free(rgba);
    else
        *rgba_out = rgba;
    return status;
}

int trip_image_read(const char *path, int *width_out, int *height_out, float **rgba_out)
{
    trip_image_size size = { 0 };
    const int64_t numbers[5] = { (int64_t)(trip_memory_available_bytes() / 4) };
    pthread_mutex_lock(&helper_lock);
    int status = start_helper("read");
    if (status == 0)
        status = trip_image_helper_request(helper, TRIP_IMAGE_READ, path, numbers, -1);
    if (status == 0)
        status = receive_picture(path, &size, rgba_out);
    if (status < 0)
        drop_helper();
    pthread_mutex_unlock(&helper_lock);
    if (status < 0)
        return status;
    *width_out = (int)size.width;
    *height_out = (int)size.height;
    return 0;
}
