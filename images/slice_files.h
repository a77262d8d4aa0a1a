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
 * `allow_gaps` is set (trip_check_numbers()). DICOM slices are checked by their
 * positions instead (dicom_stack.cpp). A file with the name of a slice that is not a picture or
 * cannot be read is an error. */
trip_slice_files trip_slice_find(const std::string &path, bool allow_gaps);
/* Returns whether a path is a DICOM file that can be opened. */
bool trip_slice_is_dicom(const std::string &path);

/* ---- slice_gaps.cpp: missing slices ---- */

/* Returns a name with its numbers replaced. Names with one shape differ only in their numbers. */
std::string trip_name_shape(const std::string &name);

/* Checks names that differ in exactly one number. The steps between the numbers must be equal; with
 * two names the step must be 1. Names of several shapes are checked shape by shape. Names that
 * differ in several numbers, such as dates and times, are not checked. Throws trip_slice_error for
 * `path` with the number and name of a missing slice, or warns if `allow_gaps` is set. */
void trip_check_numbers(const std::string &path, const std::vector<std::string> &names,
                        bool allow_gaps);

/* Checks `positions`, in ascending order, with one entry of `names` each. Slices are missing where
 * a step is about two or more times as long as the steps beside it. Several long steps in a row are
 * no gap, since a scan may change its distance. Throws or warns as trip_check_numbers() does. */
void trip_check_positions(const std::vector<double> &positions,
                          const std::vector<std::string> &names, bool allow_gaps);

#endif
