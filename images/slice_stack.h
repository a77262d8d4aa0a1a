/* A stack of slices, wherever they are stored. What is needed of it is read when it is made; slices
 * are read one at a time, by one thread. Throws trip_slice_error with the file at fault. */
#ifndef TRIP_SLICE_STACK_H
#define TRIP_SLICE_STACK_H

#include <cstdint>
#include <memory>

#include "slice_files.h"
#include "volume.h"

/* Memory from the budget, or an error that says how much was wanted. */
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
    /* Slice k, dims[0] * dims[1] values of the stored type in the machine's byte order. */
    virtual void read(int64_t k, void *values) = 0;

    int64_t dims[3] = { 0, 0, 0 };
    trip_scalar type = TRIP_U8;
    double slope = 1, inter = 0; /* value = slope * stored + inter */
    trip_affine index_to_world = { { { 1, 0, 0, 0 }, { 0, 1, 0, 0 }, { 0, 0, 1, 0 } } };
    char space[8] = "";     /* anatomical, as in anatomy.h */
    char modality[24] = ""; /* of DICOM: "CT", "MR", ... */
    bool oriented = false;  /* the map's directions are the file's */
};

/* TIFF, PNG or EXR, through OpenImageIO: picture_stack.cpp. The pages of one TIFF
 * are slices, too. */
std::unique_ptr<trip_slice_stack> trip_picture_stack(const trip_slice_files &files,
                                                     trip_budget *budget);
/* DICOM, through DCMTK: dicom_stack.cpp. Slices are put in order of their place in space, where
 * none may be missing in between unless `allow_gaps`. */
std::unique_ptr<trip_slice_stack> trip_dicom_stack(const trip_slice_files &files,
                                                   trip_budget *budget, bool allow_gaps);

#endif
