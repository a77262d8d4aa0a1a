/* The contents of a DICOM file without its pixels, and its pixels, frame by frame. GDCM parses the
 * file and decompresses pixels. Throws trip_slice_error with the path of the file. World space is
 * patient space in millimetres: x to the left, y to the back, z to the head. One thread. */
#ifndef TRIP_DICOM_FILE_H
#define TRIP_DICOM_FILE_H

#include <cmath>
#include <cstdint>
#include <istream>
#include <memory>
#include <string>
#include <vector>

#include "geometry.h"
#include "slice_stack.h"
#include "volume_info.h"

/* value = slope * stored + inter */
struct trip_dicom_rescale {
    double slope = 1, inter = 0;

    bool operator==(const trip_dicom_rescale &o) const
    {
        return slope == o.slope && inter == o.inter;
    }
};

/* A picture in a file: a frame, or a tile of a mosaic. Missing numbers are NAN. */
struct trip_dicom_slice {
    int64_t frame = 0; /* in the file */
    int tile = 0;
    std::vector<double> rows;     /* directions of i, then j, in space; empty if unknown */
    bool placed = false;          /* `position` and `rows` are known */
    trip_vec3 position{};         /* of the first pixel */
    double spacing[2] = { 1, 1 }; /* of pixels along i and j */
    double step = NAN;            /* from slice to slice, as stated */
    trip_dicom_rescale rescale;
    double times[4] = { NAN, NAN, NAN, NAN }; /* the order of slices at one position */
    unsigned segment = 0;                     /* of a segmentation, else 0 */

    trip_vec3 normal() const;
};

/* Returns whether the numbers of two lists are equal up to a small difference. */
bool trip_dicom_alike(const std::vector<double> &a, const std::vector<double> &b);

enum class trip_dicom_colour { GREY, PALETTE, RGB, YBR, YBR_422 };

struct trip_dicom_palette {
    double first = 0;               /* the stored value of the first entry */
    std::vector<double> channel[3]; /* red, green, blue */
};

/* How the pixels are stored. */
struct trip_dicom_pixels {
    int64_t columns = 0, rows = 0, frames = 1;    /* of a stored frame */
    unsigned allocated = 0, stored = 0, high = 0; /* bits of a sample */
    unsigned samples = 1;                         /* of a pixel */
    bool is_signed = false, floating = false;
    bool planar = false; /* one channel after the other */
    trip_dicom_colour colour = trip_dicom_colour::GREY;
    std::shared_ptr<trip_dicom_palette> palette;
    int syntax = 0;                 /* gdcm::TransferSyntax::TSType */
    bool compressed = false;        /* in fragments */
    bool in_memory = false;         /* GDCM returns them all at once */
    bool swap = false;              /* the byte order is not the machine's */
    bool words = false;             /* bytes are stored in words of 16 bits */
    uint64_t offset = 0, bytes = 0; /* of the values in the file */

    /* The size of an uncompressed frame, rounded up to whole bytes. */
    uint64_t frame_bytes() const;
};

struct trip_dicom_file {
    std::string path;
    bool has_pixels = false; /* false for reports, plans and directories */
    std::string series, object, description, modality;
    double series_number = NAN;
    std::vector<std::string> segments; /* names of segments 1, 2, ... */
    int64_t width = 0, height = 0;     /* of a slice */
    int tiles = 1;                     /* along each side of a mosaic */
    bool biped = true;                 /* x, y and z point left, back and head, as in humans */
    double location = NAN, number = NAN;
    bool has_table = false; /* of values in place of slope and intercept */
    trip_dicom_pixels pixels;
    std::vector<trip_dicom_slice> slices;

    /* The type of the values that trip_dicom_reader returns. */
    trip_scalar type() const;
    std::string size_text() const;
};

/* Reads everything but the pixels. */
trip_dicom_file trip_dicom_read(const std::string &path);
/* Returns whether a file belongs to the series with this UID. Looks for the UID in the first bytes,
 * since GDCM aborts the process at some damaged files. */
bool trip_dicom_is_of_series(const std::string &path, const std::string &series);

/* Opens a file. Inflates a deflated one into memory, as explicit VR little endian: GDCM fails to
 * read sequences in deflated files. */
std::unique_ptr<std::istream> trip_dicom_open(const std::string &path);

/* ---- dicom_pixels.cpp ---- */

/* Reads frames. Keeps the fragments of one file. */
class trip_dicom_reader
{
  public:
    trip_dicom_reader();
    ~trip_dicom_reader();
    /* Takes the memory for frames of this file. */
    void reserve(trip_budget *budget, const trip_dicom_file &file);
    /* Reads a slice: width * height values of file.type(). Colours become their luma. */
    void read(const trip_dicom_file &file, const trip_dicom_slice &slice, void *values);

  private:
    struct state;
    std::unique_ptr<state> state_;
};

#endif
