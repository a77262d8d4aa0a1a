/* Finds the files of a stack of slices, in order. Throws trip_slice_error. */
#ifndef TRIP_SLICE_FILES_H
#define TRIP_SLICE_FILES_H

#include <stdexcept>
#include <string>
#include <vector>

#include "image_helper.h"
#include "report.h"

/* An error with a file. */
struct trip_slice_error : std::runtime_error {
    trip_slice_error(const std::string &file, const std::string &why, int code = TRIP_ERROR)
        : std::runtime_error(why), where(file), status(code)
    {
    }
    std::string where;
    int status;
};

struct trip_slice_files {
    trip_image_kind kind;
    std::vector<std::string> names; /* at least one */
};

/* Returns the files for `path`, which is one of
 * - a folder: its files of a known kind, in natural order of their names ("s2" before "s10");
 * - a printf-like pattern ("s%03d.tif", one conversion, in the last part): all files that exist, in
 *   order of their numbers;
 * - a glob pattern ("s*.png"): the files that match, in natural order;
 * - a file.
 * All files must be of one kind. If names number the slices, no number may be missing, unless
 * `allow_gaps` is set (trip_check_numbers() of slice_gaps.h). DICOM slices are checked by their
 * positions instead (dicom_stack.cpp). A file with the name of a slice that is not a picture or
 * cannot be read is an error. */
trip_slice_files trip_slice_find(const std::string &path, bool allow_gaps);

#endif
