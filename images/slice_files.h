/* Which files a stack of slices is made of, in order. Throws trip_slice_error. */
#ifndef TRIP_SLICE_FILES_H
#define TRIP_SLICE_FILES_H

#include <stdexcept>
#include <string>
#include <vector>

#include "image_helper.h"
#include "report.h"

/* What is wrong, and with which file. */
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

/* `path` is one of
 *   a folder: its files of a known kind, in natural order of their names ("s2" before "s10");
 *   a printf-like pattern ("s%03d.tif", one conversion, in the last part): all that exist, in order
 *   of their numbers;
 *   a glob pattern ("s*.png"): what it matches, in natural order;
 *   a file.
 * All are of one kind. Where names count the slices, none may be missing in between, unless
 * `allow_gaps` (trip_check_numbers() of slice_gaps.h; the places of DICOM slices matter more
 * than their names, and are checked in dicom_stack.cpp). What is named as a slice but is none, or
 * cannot be read, is an error. */
trip_slice_files trip_slice_find(const std::string &path, bool allow_gaps);

#endif
