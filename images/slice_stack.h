/* A stack of slices in files. Creating it reads all headers; slices are read one at a time, by one
 * thread. Throws trip_slice_error with the path of the file. */
#ifndef TRIP_SLICE_STACK_H
#define TRIP_SLICE_STACK_H

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "budget.h"
#include "slice_files.h"
#include "volume_info.h"

/* Memory from the budget. take() throws an error with the size if the budget refuses. */
class trip_slice_buffer
{
  public:
    trip_slice_buffer() = default;
    trip_slice_buffer(const trip_slice_buffer &) = delete;
    trip_slice_buffer &operator=(const trip_slice_buffer &) = delete;
    ~trip_slice_buffer();
    void take(trip_budget *budget, const std::string &file, uint64_t bytes);
    char *data() const
    {
        return (char *)memory_;
    }

  private:
    trip_budget *budget_ = nullptr;
    void *memory_ = nullptr;
    size_t bytes_ = 0;
};

class trip_slice_stack
{
  public:
    virtual ~trip_slice_stack() = default;
    /* Reads slice k: dims[0] * dims[1] values of the stored type in the machine's byte order. */
    virtual void read(int64_t k, void *values) = 0;

    int64_t dims[3] = { 0, 0, 0 };
    trip_scalar type = TRIP_U8;
    double slope = 1, inter = 0; /* value = slope * stored + inter */
    trip_affine index_to_world = { { { 1, 0, 0, 0 }, { 0, 1, 0, 0 }, { 0, 0, 1, 0 } } };
    char space[4] = "";        /* anatomical, as in anatomy.h */
    char up[4] = "";           /* "+z": up by the custom of the format */
    char modality[24] = "";    /* from DICOM: "CT", "MR", ... */
    bool oriented = false;     /* the file states the directions of the map */
    std::vector<double> along; /* positions of slices at uneven distances, ascending, else empty */
    std::string note;          /* choices made for the user */
    std::string parts;         /* the series of a DICOM folder, one a line */
};

/* Which part of the files is read, and how. */
struct trip_stack_choice {
    bool allow_gaps; /* DICOM: slices may be missing between others */
    int series;      /* DICOM: its number; 0 chooses the largest */
    int time;        /* from 0; in DICOM, of slices that share their position */
    int channel;     /* from 0 */
};

/* Throws trip_slice_error unless `index` is one of `count` entries of "channel" or "time".
 */
void trip_check_entry(const std::string &file, const char *what, int64_t index, int64_t count);

/* Opens TIFF, PNG or EXR files with OpenImageIO (picture_stack.cpp). The pages of a single TIFF
 * file are slices, too. Descriptions of ImageJ and OME give their order (page_order.h). */
std::unique_ptr<trip_slice_stack> trip_picture_stack(const trip_slice_files &files,
                                                     trip_budget *budget,
                                                     const trip_stack_choice &choice);
/* Opens DICOM files with GDCM (dicom_stack.cpp). Slices are sorted by their position in space.
 * `path` is the one that the user gave. */
std::unique_ptr<trip_slice_stack> trip_dicom_stack(const std::string &path,
                                                   const trip_slice_files &files,
                                                   trip_budget *budget,
                                                   const trip_stack_choice &choice);

#endif
