/* Writes PNG files with libpng in this process. The helper process for the other formats
 * (image_helper.h) often takes longer to start than a picture takes to draw. Any thread may call
 * it. */
#ifndef TRIP_PNG_FILE_H
#define TRIP_PNG_FILE_H

#include "image_file.h"

/* Writes a picture as trip_image_write() does, to a descriptor of an empty file that is open for
 * writing. The caller has checked the size and `params`. Failures are reported with `path`. */
int trip_png_write(int fd, const char *path, int width, int height, const float *rgba,
                   const trip_image_params *params);

#endif
