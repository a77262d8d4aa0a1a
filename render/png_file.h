/* Pictures as PNG files, by libpng in this process: the helper of the other formats
 * (image_helper.h) takes longer to start than many a picture to be drawn. Any thread. */
#ifndef TRIP_PNG_FILE_H
#define TRIP_PNG_FILE_H

#include "image_file.h"

/* As trip_image_write(), for numbers and params that are known to be right, to a descriptor that is
 * open for writing, of an empty file; failures are reported about `path`. */
int trip_png_write(int fd, const char *path, int width, int height, const float *rgba,
                   const trip_image_params *params);

#endif
