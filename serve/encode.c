#include "encode.h"

#include <png.h>
#include <setjmp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <jpeglib.h>

enum { QUALITY = 85 };

typedef struct fault {
    struct jpeg_error_mgr manager;
    jmp_buf back;
} fault;

static void give_up(j_common_ptr c)
{
    longjmp(((fault *)c->err)->back, 1);
}

static void compress(struct jpeg_compress_struct *c, const uint8_t *rgba, int width, int height)
{
    c->image_width = (JDIMENSION)width;
    c->image_height = (JDIMENSION)height;
    c->input_components = 4;
    c->in_color_space = JCS_EXT_RGBX;
    jpeg_set_defaults(c);
    jpeg_set_quality(c, QUALITY, TRUE);
    jpeg_start_compress(c, TRUE);
    while (c->next_scanline < c->image_height) {
        union {
            const uint8_t *from;
            JSAMPROW row; /* libjpeg only reads it */
        } line = { rgba + (size_t)c->next_scanline * 4 * (size_t)width };
        jpeg_write_scanlines(c, &line.row, 1);
    }
    jpeg_finish_compress(c);
}

void trip_encode_jpeg(const uint8_t *rgba, int width, int height, unsigned char **file,
                      size_t *bytes)
{
    struct jpeg_compress_struct c;
    fault error;
    unsigned long length = 0;
    *file = NULL;
    c.err = jpeg_std_error(&error.manager);
    error.manager.error_exit = give_up;
    if (setjmp(error.back)) {
        jpeg_destroy_compress(&c);
        free(*file);
        *file = NULL;
        return;
    }
    jpeg_create_compress(&c);
    jpeg_mem_dest(&c, file, &length);
    compress(&c, rgba, width, height);
    jpeg_destroy_compress(&c);
    *bytes = length;
}

void trip_encode_png(const uint8_t *rgba, int width, int height, unsigned char **file,
                     size_t *bytes)
{
    png_image image = { .version = PNG_IMAGE_VERSION,
                        .width = (png_uint_32)width,
                        .height = (png_uint_32)height,
                        .format = PNG_FORMAT_RGBA,
                        .flags = PNG_IMAGE_FLAG_FAST };
    png_alloc_size_t length = PNG_IMAGE_PNG_SIZE_MAX(image);
    *file = malloc(length);
    if (*file && !png_image_write_to_memory(&image, *file, &length, 0, rgba, 0, NULL)) {
        free(*file);
        *file = NULL;
    }
    *bytes = length;
}
