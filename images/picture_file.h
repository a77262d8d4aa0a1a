/* Reads and writes picture files with OpenImageIO. Throws trip_slice_error with the path of the
 * file. One thread at a time. */
#ifndef TRIP_PICTURE_FILE_H
#define TRIP_PICTURE_FILE_H

#include <functional>
#include <string>
#include <vector>

#include "image_file.h"

struct trip_picture {
    std::string path; /* selects the format and appears in error messages */
    int fd;           /* open for writing, empty */
    int width, height;
    trip_image_params params;
};

/* Fills one row of float RGBA or distances. Returns false if no more rows come; the picture is then
 * abandoned. */
using trip_picture_row = std::function<bool(float *pixels)>;

/* Implements trip_image_write() for a valid path and params, writing to the descriptor. Requests
 * all rows from the top, and no more. */
void trip_picture_write(const trip_picture &picture, const trip_picture_row &next_row);

/* Returns premultiplied RGBA rows of a picture with one to four channels. They are display values
 * for all formats. */
std::vector<float> trip_picture_read(const std::string &path, int &width, int &height);

/* Returns the distances of a depth image as stored, and whether they are integers. They are the
 * channel named Z or depth, or the only one besides alpha, or the first of an EXR file. Integers of
 * 0 and of the greatest number of their type become NaN. */
std::vector<float> trip_distances_read(const std::string &path, int &width, int &height,
                                       bool &integers);

#endif
