/* Which files a stack of slices is made of, in order. Throws trip_slice_error; only the slice
 * readers (.cpp) include this. */
#ifndef TRIP_SLICE_FILES_H
#define TRIP_SLICE_FILES_H

#include <stdexcept>
#include <string>
#include <vector>

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

enum class trip_slice_kind { OTHER, TIFF, PNG, EXR, DICOM };

/* By content. */
trip_slice_kind trip_slice_kind_of(const unsigned char *head, size_t bytes);
const char *trip_slice_kind_name(trip_slice_kind kind);

struct trip_slice_files {
    trip_slice_kind kind;
    std::vector<std::string> names; /* at least one */
};

/* `path` is one of
 *   a folder: its files of a known kind, in natural order of their names ("s2" before "s10");
 *   a printf-like pattern ("s%03d.tif", one conversion, in the last part): all that exist, in order
 *   of their numbers, of which none may be missing in between;
 *   a glob pattern ("s*.png"): what it matches, in natural order;
 *   a file.
 * All are of one kind. */
trip_slice_files trip_slice_find(const std::string &path);

#endif
