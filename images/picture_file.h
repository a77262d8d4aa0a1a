/* Pictures to and from files, through OpenImageIO. Throws trip_slice_error with the file at fault.
 */
#ifndef TRIP_PICTURE_FILE_H
#define TRIP_PICTURE_FILE_H

#include <functional>
#include <string>
#include <vector>

#include "image_file.h"

struct trip_picture {
    std::string path; /* says the format; what is wrong is said of it */
    int fd;           /* open for writing, empty */
    int width, height;
    trip_image_params params;
};

/* Fills one row of float RGBA, or of distances; false when no more come, which abandons the
 * picture. */
using trip_picture_row = std::function<bool(float *pixels)>;

/* As trip_image_write(), for a path and params that are known to be right, to the descriptor; takes
 * all rows from the top, and only for those that it has use for. */
void trip_picture_write(const trip_picture &picture, const trip_picture_row &next_row);

/* Premultiplied RGBA rows of a picture of one to four channels, display values in any format. */
std::vector<float> trip_picture_read(const std::string &path, int &width, int &height);

#endif
