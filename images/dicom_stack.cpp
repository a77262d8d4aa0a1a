/* Reads DICOM slices with DCMTK. OpenImageIO reads DICOM too, but returns the decoder's
 * intermediate values in another type than it states, and no position, spacing or rescaling. World
 * space is patient space in millimetres: x to the left, y to the back, z to the head. */
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <mutex>
#include <vector>

#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dcrledrg.h>
#include <dcmtk/dcmdata/dctk.h>
#include <dcmtk/dcmjpeg/djdecode.h>
#include <dcmtk/dcmjpls/djdecode.h>

#include "connection.h"
#include "slice_stack.h"
#include "volume_info.h"

namespace
{

/* Elements longer than this stay in the file until they are read. */
constexpr Uint32 lazy_bytes = 4096;

/* value = slope * stored + inter */
struct Rescale {
    double slope, inter;

    bool operator==(const Rescale &o) const
    {
        return slope == o.slope && inter == o.inter;
    }
};

/* The information of a slice's file, without its pixels. Missing values are empty or NAN. */
struct Header {
    std::string file;
    std::string series;
    std::string modality; /* a code string, or empty */
    int64_t width = 0, height = 0, frames = 1;
    unsigned allocated = 0, stored = 0, high = 0; /* bits */
    bool is_signed = false;
    std::vector<Rescale> rescales; /* one for each frame, or one for all */
    trip_vec3 origin = { 0, 0, 0 };
    std::vector<trip_vec3> positions;  /* of the first pixel of each frame, or none */
    std::vector<double> rows;          /* directions of i, then j */
    std::vector<double> pixel_spacing; /* between rows, then between columns */
    double location = NAN, number = NAN, spacing = NAN;
    bool biped = true; /* x, y and z point left, back and head, as in humans */

    bool placed() const
    {
        return !positions.empty() && rows.size() == 6;
    }
    trip_vec3 normal() const
    {
        return trip_normalize(
            trip_cross(trip_v3(rows[0], rows[1], rows[2]), trip_v3(rows[3], rows[4], rows[5])));
    }

    const Rescale &rescale(Uint32 frame) const
    {
        return rescales.size() > 1 ? rescales[frame] : rescales[0];
    }
    bool all_rescaled(const Rescale &like) const
    {
        return std::count(rescales.begin(), rescales.end(), like) == (ptrdiff_t)rescales.size();
    }
    bool same_pixels(const Header &o) const
    {
        return width == o.width && height == o.height && allocated == o.allocated &&
               stored == o.stored && high == o.high && is_signed == o.is_signed;
    }
    std::string text() const
    {
        return std::to_string(width) + " x " + std::to_string(height) + ", " +
               (is_signed ? "signed, " : "unsigned, ") + std::to_string(stored) + " bits in " +
               std::to_string(allocated);
    }
};

void set_up_once()
{
    static std::once_flag done;
    std::call_once(done, [] {
        DJDecoderRegistration::registerCodecs();
        DJLSDecoderRegistration::registerCodecs();
        DcmRLEDecoderRegistration::registerCodecs();
    });
}

void require(const std::string &file, const OFCondition &condition)
{
    if (condition.bad())
        throw trip_slice_error(file, std::string("cannot be read: ") + condition.text());
}

std::vector<double> get_numbers(DcmItem &item, const DcmTagKey &tag, unsigned count, bool nested)
{
    std::vector<double> numbers;
    for (unsigned i = 0; i < count; i++) {
        Float64 v;
        if (item.findAndGetFloat64(tag, v, i, nested).bad() || !std::isfinite(v))
            return {};
        numbers.push_back(v);
    }
    return numbers;
}

double get_number(DcmItem &item, const DcmTagKey &tag, bool nested, double missing)
{
    std::vector<double> v = get_numbers(item, tag, 1, nested);
    return v.empty() ? missing : v[0];
}

unsigned get_count(DcmItem &item, const DcmTagKey &tag, unsigned missing)
{
    Uint16 v;
    return item.findAndGetUint16(tag, v).good() ? v : missing;
}

/* DCMTK cannot convert the text of an integer to a float. */
double get_integer(DcmItem &item, const DcmTagKey &tag, double missing)
{
    Sint32 v;
    return item.findAndGetSint32(tag, v).good() ? v : missing;
}

/* Returns a distance between samples, or NAN. */
double get_length(DcmItem &item, const DcmTagKey &tag, bool nested)
{
    double v = std::fabs(get_number(item, tag, nested, NAN));
    return v > 0 ? v : NAN;
}

trip_vec3 vector_of(const std::vector<double> &v, size_t at)
{
    return trip_v3(v[at], v[at + 1], v[at + 2]);
}

bool are_alike(const std::vector<double> &rows, const std::vector<double> &others)
{
    return std::equal(rows.begin(), rows.end(), others.begin(), others.end(),
                      [](double a, double b) { return std::fabs(a - b) <= 1e-3; });
}

/* Returns the item of each frame. Returns none if any frame has no item. */
std::vector<DcmItem *> get_frame_items(DcmItem &item, int64_t count)
{
    DcmSequenceOfItems *frames = nullptr;
    std::vector<DcmItem *> items;
    if (item.findAndGetSequence(DCM_PerFrameFunctionalGroupsSequence, frames).bad() ||
        (int64_t)frames->card() != count)
        return {};
    for (DcmObject *o = frames->nextInContainer(nullptr); o; o = frames->nextInContainer(o)) {
        items.push_back(dynamic_cast<DcmItem *>(o));
        if (!items.back())
            return {};
    }
    return items;
}

/* Returns the position of each frame. Returns none if any frame has no position. */
std::vector<trip_vec3> get_frame_positions(const std::vector<DcmItem *> &frames, const Header &h)
{
    std::vector<trip_vec3> positions;
    for (DcmItem *frame : frames) {
        std::vector<double> rows = get_numbers(*frame, DCM_ImageOrientationPatient, 6, true);
        if (!rows.empty() && !are_alike(rows, h.rows))
            throw trip_slice_error(h.file, "has frames with different orientations");
        std::vector<double> position = get_numbers(*frame, DCM_ImagePositionPatient, 3, true);
        if (position.empty())
            return {};
        positions.push_back(vector_of(position, 0));
    }
    return positions;
}

/* Returns the rescaling of an item, or also of its nested items if `nested`. Missing numbers are
 * taken from `missing`. */
Rescale get_rescale(DcmItem &item, bool nested, const Rescale &missing)
{
    return { get_number(item, DCM_RescaleSlope, nested, missing.slope),
             get_number(item, DCM_RescaleIntercept, nested, missing.inter) };
}

/* Returns the rescaling of each frame. A frame's own item overrides the file, which overrides the
 * item shared by all frames. */
std::vector<Rescale> get_rescales(DcmItem &item, const std::vector<DcmItem *> &frames, bool nested)
{
    DcmItem *shared = nullptr;
    Rescale all = { 1, 0 };
    if (frames.empty())
        return { get_rescale(item, nested, all) };
    if (item.findAndGetSequenceItem(DCM_SharedFunctionalGroupsSequence, shared).good() && shared)
        all = get_rescale(*shared, true, all);
    all = get_rescale(item, false, all);
    std::vector<Rescale> rescales;
    for (DcmItem *frame : frames)
        rescales.push_back(get_rescale(*frame, true, all));
    return rescales;
}

/* Checks that rows and columns are at right angles. A file states both directions or none. */
void check_rows(const Header &h)
{
    if (h.rows.empty())
        return;
    trip_vec3 i = trip_normalize(vector_of(h.rows, 0)), j = trip_normalize(vector_of(h.rows, 3));
    if (!(trip_length(trip_cross(i, j)) > 0.999))
        throw trip_slice_error(
            h.file, "has rows and columns that are not at right angles in patient space");
}

/* Files that may hold several frames store their geometry in nested items. */
void read_geometry(DcmItem &item, Header &h)
{
    bool nested = h.frames > 1 || item.tagExists(DCM_SharedFunctionalGroupsSequence);
    OFString body;
    const std::vector<DcmItem *> frames =
        nested ? get_frame_items(item, h.frames) : std::vector<DcmItem *>();
    h.rows = get_numbers(item, DCM_ImageOrientationPatient, 6, nested);
    check_rows(h);
    std::vector<double> position = get_numbers(item, DCM_ImagePositionPatient, 3, nested);
    if (h.frames > 1)
        h.positions = get_frame_positions(frames, h);
    else if (!position.empty())
        h.positions.push_back(vector_of(position, 0));
    h.origin = position.empty() ? trip_v3(0, 0, 0) : vector_of(position, 0);
    h.biped = item.findAndGetOFString(DCM_AnatomicalOrientationType, body).bad() || body.empty() ||
              body == "BIPED";
    h.pixel_spacing = get_numbers(item, DCM_PixelSpacing, 2, nested);
    if (!h.pixel_spacing.empty() && !(h.pixel_spacing[0] > 0 && h.pixel_spacing[1] > 0))
        h.pixel_spacing.clear();
    h.location = get_number(item, DCM_SliceLocation, false, NAN);
    h.number = get_integer(item, DCM_InstanceNumber, NAN);
    h.spacing = get_length(item, DCM_SpacingBetweenSlices, nested);
    if (std::isnan(h.spacing))
        h.spacing = get_length(item, DCM_SliceThickness, nested);
    h.rescales = get_rescales(item, frames, nested);
}

void check_header(const Header &h, unsigned samples)
{
    if (h.width < 1 || h.height < 1 || h.frames < 1)
        throw trip_slice_error(h.file, "contains no picture");
    if (samples != 1)
        throw trip_slice_error(h.file, "is in colour; only grey DICOM slices are read");
    if ((h.allocated != 8 && h.allocated != 16 && h.allocated != 32) || h.stored < 1 ||
        h.stored > h.allocated || h.high + 1 < h.stored || h.high >= h.allocated)
        throw trip_slice_error(h.file, "has pixels of " + std::to_string(h.stored) + " bits in " +
                                           std::to_string(h.allocated) +
                                           ", which are not supported");
}

/* Returns the modality. The standard allows at most 16 upper-case letters, digits, blanks and
 * underscores; other texts are ignored. */
std::string get_modality(DcmItem &item)
{
    OFString text;
    if (item.findAndGetOFString(DCM_Modality, text).bad())
        return "";
    auto known = [](unsigned char c) {
        return (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == ' ' || c == '_';
    };
    return text.size() <= 16 && std::all_of(text.begin(), text.end(), known) ? text.c_str() : "";
}

Header read_header(const std::string &file)
{
    DcmFileFormat format;
    require(file, format.loadFile(file.c_str(), EXS_Unknown, EGL_noChange, lazy_bytes));
    DcmDataset &set = *format.getDataset();
    Header h;
    OFString series;
    h.file = file;
    if (set.findAndGetOFString(DCM_SeriesInstanceUID, series).good())
        h.series = series.c_str();
    h.modality = get_modality(set);
    h.width = get_count(set, DCM_Columns, 0);
    h.height = get_count(set, DCM_Rows, 0);
    h.frames = (int64_t)get_integer(set, DCM_NumberOfFrames, 1);
    h.allocated = get_count(set, DCM_BitsAllocated, 0);
    h.stored = get_count(set, DCM_BitsStored, h.allocated);
    h.high = get_count(set, DCM_HighBit, h.stored - 1);
    h.is_signed = get_count(set, DCM_PixelRepresentation, 0) != 0;
    check_header(h, get_count(set, DCM_SamplesPerPixel, 1));
    read_geometry(set, h);
    return h;
}

template <typename Has> bool all_have(const std::vector<Header> &headers, const Has &has)
{
    return std::all_of(headers.begin(), headers.end(), has);
}

/* Sorts the slices by `key`. Keys must differ, and a gap is an error unless it is allowed. Returns
 * the result of trip_check_positions(). */
template <typename Key>
double sort_by(std::vector<Header> &headers, const Key &key, const char *stage, bool allow_gaps)
{
    std::vector<double> keys;
    std::vector<std::string> names;
    std::stable_sort(headers.begin(), headers.end(),
                     [&](const Header &a, const Header &b) { return key(a) < key(b); });
    for (const Header &h : headers) {
        if (!keys.empty() && !(key(h) - keys.back() > 1e-6))
            throw trip_slice_error(h.file, std::string("has the same ") + stage + " as " +
                                               names.back() +
                                               "; does the folder hold several series?");
        keys.push_back(key(h));
        names.push_back(h.file);
    }
    return trip_check_positions(keys, names, allow_gaps);
}

bool all_placed(const std::vector<Header> &headers)
{
    return all_have(headers, [](const Header &h) { return h.placed(); });
}

/* Sorts by position along the slices' normal if all slices have positions. Otherwise sorts by slice
 * location, or by instance number. Without any of them the order of the names remains. */
double sort_slices(std::vector<Header> &headers, bool allow_gaps)
{
    if (all_placed(headers)) {
        const std::vector<double> rows = headers[0].rows;
        const std::string first = headers[0].file;
        trip_vec3 normal = headers[0].normal();
        for (const Header &h : headers)
            if (!are_alike(h.rows, rows))
                throw trip_slice_error(h.file, "has another orientation than " + first);
        return sort_by(
            headers, [&](const Header &h) { return trip_dot(h.positions[0], normal); }, "position",
            allow_gaps);
    }
    if (all_have(headers, [](const Header &h) { return std::isfinite(h.location); })) {
        return sort_by(
            headers, [](const Header &h) { return h.location; }, "location", allow_gaps);
    }
    if (all_have(headers, [](const Header &h) { return std::isfinite(h.number); })) {
        return sort_by(
            headers, [](const Header &h) { return h.number; }, "instance number", allow_gaps);
    }
    return 1;
}

/* Returns the frames of one file in order of their positions; empty if positions are not known.
 * Sets `squeeze` to the result of trip_check_positions(). */
std::vector<Uint32> sort_frames(Header &h, bool allow_gaps, double &squeeze)
{
    std::vector<Uint32> order(h.placed() ? h.positions.size() : 0);
    std::vector<trip_vec3> sorted;
    std::vector<std::string> names;
    std::vector<double> depths, sorted_depths;
    for (size_t i = 0; i < order.size(); i++) {
        order[i] = (Uint32)i;
        depths.push_back(trip_dot(h.positions[i], h.normal()));
    }
    std::stable_sort(order.begin(), order.end(),
                     [&](Uint32 a, Uint32 b) { return depths[a] < depths[b]; });
    for (size_t i = 0; i < order.size(); i++) {
        if (i > 0 && !(depths[order[i]] - depths[order[i - 1]] > 1e-6))
            throw trip_slice_error(h.file,
                                   "has several frames at one position; split a time series first");
        sorted.push_back(h.positions[order[i]]);
        sorted_depths.push_back(depths[order[i]]);
        names.push_back(h.file + ": frame " + std::to_string(order[i] + 1));
    }
    squeeze = trip_check_positions(sorted_depths, names, allow_gaps);
    if (!sorted.empty()) {
        h.positions = sorted;
        h.origin = sorted[0];
    }
    return order;
}

/* Checks that slices lie on one straight line, so that they are sheets of one grid, sheared if the
 * gantry was tilted. A deviation of more than half a pixel is an error. Unequal steps draw a
 * warning, because slices may be missing. */
void check_line(const std::string &file, const std::vector<trip_vec3> &positions, trip_vec3 normal,
                trip_vec3 step, double pixel)
{
    double along = trip_dot(step, normal), min = INFINITY, max = 0, before = 0;
    for (size_t i = 1; i < positions.size(); i++) {
        trip_vec3 way = trip_sub(positions[i], positions[0]);
        double steps = trip_dot(way, normal) / along;
        double aside = trip_length(trip_sub(way, trip_scale(step, steps)));
        if (!(aside <= 0.5 * pixel)) {
            char text[200];
            std::snprintf(text, sizeof text,
                          "slice %zu of its series lies %.3g beside the line through the first and "
                          "the last; such slices form no grid",
                          i + 1, aside);
            throw trip_slice_error(file, text);
        }
        min = std::min(min, steps - before);
        max = std::max(max, steps - before);
        before = steps;
    }
    if (max - min > 0.02)
        trip_warn(file.c_str(),
                  "slices are %g to %g apart and some may be missing; they are drawn evenly spaced",
                  min * trip_length(step), max * trip_length(step));
}

/* Returns the step between slices in space, from their positions if known, else from the stated
 * location or spacing. */
trip_vec3 slice_step(const std::vector<Header> &headers, trip_vec3 normal, double pixel)
{
    const Header &first = headers.front(), &last = headers.back();
    std::vector<trip_vec3> positions;
    if (all_placed(headers))
        for (const Header &h : headers)
            positions.insert(positions.end(), h.positions.begin(), h.positions.end());
    if (positions.size() > 1) {
        trip_vec3 step = trip_scale(trip_sub(positions.back(), positions.front()),
                                    1 / ((double)positions.size() - 1));
        check_line(first.file, positions, normal, step, pixel);
        return step;
    }
    double length = (last.location - first.location) / ((double)headers.size() - 1);
    if (!(std::isfinite(length) && length > 0))
        length = std::isfinite(first.spacing) ? first.spacing : 1;
    return trip_scale(normal, length);
}

/* Returns index_to_world. `squeeze` scales the step between slices if gaps were allowed. */
trip_affine make_map(const std::vector<Header> &headers, double squeeze)
{
    const Header &h = headers[0];
    bool oriented = h.rows.size() == 6;
    double di = h.pixel_spacing.empty() ? 1 : h.pixel_spacing[1];
    double dj = h.pixel_spacing.empty() ? 1 : h.pixel_spacing[0];
    trip_vec3 i = oriented ? trip_normalize(vector_of(h.rows, 0)) : trip_v3(1, 0, 0);
    trip_vec3 j = oriented ? trip_normalize(vector_of(h.rows, 3)) : trip_v3(0, 1, 0);
    trip_vec3 k = slice_step(headers, trip_normalize(trip_cross(i, j)), std::max(di, dj));
    trip_affine map;
    for (int r = 0; r < 3; r++) {
        map.m[r][0] = trip_component(i, r) * di;
        map.m[r][1] = trip_component(j, r) * dj;
        map.m[r][2] = trip_component(k, r) * squeeze;
        map.m[r][3] = trip_component(h.origin, r);
    }
    return map;
}

/* Converts stored bits to integers. Drops the bits below high - stored and extends the sign. */
template <typename T> void align_bits(const Header &h, T *values, size_t count)
{
    using Unsigned = typename std::make_unsigned<T>::type;
    const unsigned left = h.allocated - 1 - h.high, right = h.allocated - h.stored;
    if (left == 0 && right == 0)
        return;
    for (size_t i = 0; i < count; i++)
        values[i] = (T)((T)(Unsigned)((Unsigned)values[i] << left) >> right);
}

void align_values(const Header &h, trip_scalar type, void *values, size_t count)
{
    switch (type) {
    case TRIP_U8:
        return align_bits(h, (uint8_t *)values, count);
    case TRIP_I8:
        return align_bits(h, (int8_t *)values, count);
    case TRIP_U16:
        return align_bits(h, (uint16_t *)values, count);
    case TRIP_I16:
        return align_bits(h, (int16_t *)values, count);
    case TRIP_U32:
        return align_bits(h, (uint32_t *)values, count);
    default:
        return align_bits(h, (int32_t *)values, count);
    }
}

class DicomStack : public trip_slice_stack
{
  public:
    DicomStack(const trip_slice_files &files, trip_budget *budget, bool allow_gaps);
    void read(int64_t k, void *values) override;

  private:
    void load(const std::string &file);
    void read_frame(const Header &h, Uint32 frame);

    std::vector<Header> headers_;
    std::vector<Uint32>
        frames_; /* of one file, in order of positions; empty for the order in the file */
    trip_scalar stored_ = TRIP_U8;
    trip_slice_buffer frame_;
    uint64_t frame_bytes_ = 0;
    std::unique_ptr<DcmFileFormat> format_; /* of the slice read last */
    std::string loaded_;
    Uint32 next_frame_ = 0,
           fragment_ = 0; /* the frame after the last one read, and its first fragment */
};

DicomStack::DicomStack(const trip_slice_files &files, trip_budget *budget, bool allow_gaps)
{
    set_up_once();
    bool rescaled_alike = true;
    for (const std::string &name : files.names) {
        headers_.push_back(read_header(name));
        trip_connection_working();
        const Header &h = headers_.back(), &first = headers_.front();
        if (!h.same_pixels(first))
            throw trip_slice_error(name, "is " + h.text() + ", unlike " + first.file + ", " +
                                             first.text());
        if (h.series != first.series)
            throw trip_slice_error(name, "belongs to another series than " + first.file);
        if (h.frames > 1 && files.names.size() > 1)
            throw trip_slice_error(name, "holds several frames but is one of several files");
        rescaled_alike = rescaled_alike && h.all_rescaled(first.rescales[0]);
    }
    double squeeze = sort_slices(headers_, allow_gaps);
    if (headers_[0].frames > 1)
        frames_ = sort_frames(headers_[0], allow_gaps, squeeze);
    const Header &h = headers_[0];
    index_to_world = make_map(headers_, squeeze);
    oriented = all_have(headers_, [](const Header &o) { return o.rows.size() == 6; });
    if (all_placed(headers_) && h.biped)
        std::strcpy(space, "LPS");
    std::snprintf(modality, sizeof modality, "%s", h.modality.c_str());
    dims[0] = h.width;
    dims[1] = h.height;
    dims[2] = h.frames > 1 ? h.frames : (int64_t)headers_.size();
    stored_ = h.allocated == 8    ? (h.is_signed ? TRIP_I8 : TRIP_U8)
              : h.allocated == 16 ? (h.is_signed ? TRIP_I16 : TRIP_U16)
                                  : (h.is_signed ? TRIP_I32 : TRIP_U32);
    type = rescaled_alike ? stored_ : TRIP_F32;
    slope = rescaled_alike ? h.rescales[0].slope : 1;
    inter = rescaled_alike ? h.rescales[0].inter : 0;
    frame_bytes_ = (uint64_t)h.width * (uint64_t)h.height * (h.allocated / 8);
    frame_.take(budget, h.file, frame_bytes_ + 1); /* the decoder needs an even number of bytes */
}

void DicomStack::load(const std::string &file)
{
    if (file == loaded_)
        return;
    loaded_.clear();
    next_frame_ = fragment_ = 0;
    format_ = std::make_unique<DcmFileFormat>();
    require(file, format_->loadFile(file.c_str(), EXS_Unknown, EGL_noChange, lazy_bytes));
    loaded_ = file;
}

/* Reads a frame into frame_, decompressing it if necessary. */
void DicomStack::read_frame(const Header &h, Uint32 frame)
{
    load(h.file);
    DcmElement *element = nullptr;
    OFString colours;
    Uint32 bytes = 0;
    DcmDataset *set = format_->getDataset();
    if (frame != next_frame_)
        fragment_ = 0; /* unknown; DCMTK searches for it */
    require(h.file, set->findAndGetElement(DCM_PixelData, element));
    DcmPixelData *pixels = dynamic_cast<DcmPixelData *>(element);
    if (!pixels || pixels->getUncompressedFrameSize(set, bytes).bad() ||
        (bytes != frame_bytes_ && bytes != frame_bytes_ + 1))
        throw trip_slice_error(h.file, "has pixel data of the wrong size");
    require(h.file,
            pixels->getUncompressedFrame(set, frame, fragment_, frame_.data(),
                                         (Uint32)((frame_bytes_ + 1) & ~(uint64_t)1), colours));
    next_frame_ = frame + 1;
}

void DicomStack::read(int64_t k, void *values)
{
    const Header &h = headers_[headers_.size() > 1 ? (size_t)k : 0];
    size_t count = (size_t)(dims[0] * dims[1]);
    const Uint32 frame = headers_.size() > 1 ? 0 : frames_.empty() ? (Uint32)k : frames_[(size_t)k];
    const Rescale &rescale = h.rescale(frame);
    read_frame(h, frame);
    align_values(h, stored_, frame_.data(), count);
    if (type == stored_)
        std::memcpy(values, frame_.data(), frame_bytes_);
    else
        trip_scalar_decode(stored_, false, rescale.slope, rescale.inter, frame_.data(), count,
                           (float *)values);
}

} // namespace

std::unique_ptr<trip_slice_stack> trip_dicom_stack(const trip_slice_files &files,
                                                   trip_budget *budget, bool allow_gaps)
{
    return std::unique_ptr<trip_slice_stack>(new DicomStack(files, budget, allow_gaps));
}
