/* Sorts the slices of DICOM files into series: slices that fit on one grid. Throws
 * trip_slice_error.
 */
#ifndef TRIP_DICOM_SERIES_H
#define TRIP_DICOM_SERIES_H

#include "dicom_file.h"

/* A slice and its file, which must outlive it. */
struct trip_dicom_ref {
    const trip_dicom_file *file;
    const trip_dicom_slice *slice;

    std::string name() const; /* for messages */
};

/* The slices at one position, in the order of their times. */
using trip_dicom_place = std::vector<trip_dicom_ref>;

struct trip_dicom_series {
    int number = 0; /* selects it: its series number, or 1, 2, ... if these are not distinct */
    std::vector<trip_dicom_ref> slices;
    /* In order along the slices' normal; of their location or number if they have no position. */
    std::vector<trip_dicom_place> places;
    std::vector<double> depths; /* of the places, ascending; empty if they are unknown */

    const trip_dicom_file &file() const
    {
        return *slices[0].file;
    }
    size_t times() const;
    int64_t voxels() const; /* of the first time */
    bool placed() const
    {
        return slices[0].slice->placed;
    }
    /* Describes it, such as: 2 "T1 axial" (MR, 256 x 256 x 25). */
    std::string text() const;
};

/* Returns the series in the order of their numbers. */
std::vector<trip_dicom_series> trip_dicom_sort(const std::vector<trip_dicom_file> &files);

#endif
