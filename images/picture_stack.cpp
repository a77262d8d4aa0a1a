#include <algorithm>
#include <fstream>
#include <limits>
#include <string>
#include <vector>

#include <OpenImageIO/imageio.h>
#include <tiffio.h>

#include "absent_value.h"
#include "connection.h"
#include "page_order.h"
#include "slice_stack.h"
#include "text.h"
#include "volume_info.h"

namespace
{

using Input = std::unique_ptr<OIIO::ImageInput>;

/* The properties that all slices must share. */
struct Form {
    int width, height, channels, x, y;
    OIIO::TypeDesc type;

    explicit Form(const OIIO::ImageSpec &s)
        : width(s.width), height(s.height), channels(s.nchannels), x(s.x), y(s.y), type(s.format)
    {
    }
    bool operator==(const Form &o) const
    {
        return width == o.width && height == o.height && channels == o.channels && x == o.x &&
               y == o.y && type == o.type;
    }
    std::string text() const
    {
        return std::to_string(width) + " x " + std::to_string(height) + " " + type.c_str() +
               (channels > 1 ? " with " + std::to_string(channels) + " channels" : "") +
               (x || y ? " at (" + std::to_string(x) + ", " + std::to_string(y) + ")" : "");
    }
};

std::string message(std::string text)
{
    while (!text.empty() && (text.back() == '\n' || text.back() == ' '))
        text.pop_back();
    return text.empty() ? "cannot be read" : text;
}

/* Silences libtiff's remarks on sound files, such as files with private tags. OpenImageIO would
 * report the last remark as the reason for the end of the pages. It sets libtiff's handlers once,
 * with its first reader. */
void silence_remarks()
{
    OIIO::ImageInput::create("tiff");
    OIIO::geterror();
    TIFFSetWarningHandler(nullptr);
}

/* Whether a page of a TIFF is a smaller copy of another page: a thumbnail, or a level of a pyramid.
 * Bit 0 of the tag NewSubfileType says so. */
bool is_reduced(const OIIO::ImageSpec &spec)
{
    return (spec.get_int_attribute("tiff:subfiletype") & 1) != 0;
}

trip_scalar scalar_of(const std::string &file, OIIO::TypeDesc type)
{
    static const struct {
        OIIO::TypeDesc::BASETYPE from;
        trip_scalar to;
    } map[] = {
        { OIIO::TypeDesc::UINT8, TRIP_U8 },   { OIIO::TypeDesc::INT8, TRIP_I8 },
        { OIIO::TypeDesc::UINT16, TRIP_U16 }, { OIIO::TypeDesc::INT16, TRIP_I16 },
        { OIIO::TypeDesc::UINT32, TRIP_U32 }, { OIIO::TypeDesc::INT32, TRIP_I32 },
        { OIIO::TypeDesc::HALF, TRIP_F16 },   { OIIO::TypeDesc::FLOAT, TRIP_F32 },
        { OIIO::TypeDesc::DOUBLE, TRIP_F64 },
    };
    for (const auto &m : map)
        if (type == OIIO::TypeDesc(m.from))
            return m.to;
    throw trip_slice_error(file, std::string("has an unsupported number type, ") + type.c_str());
}

class PictureStack : public trip_slice_stack
{
  public:
    PictureStack(const trip_slice_files &files, trip_budget *budget,
                 const trip_stack_choice &choice);
    void read(int64_t k, void *values) override;

  private:
    Input open(const std::string &file) const;
    void check_same(const std::string &stage, const OIIO::ImageSpec &spec) const;
    std::vector<int> find_pages(OIIO::ImageInput &in);
    void order_pages(const OIIO::ImageSpec &first, const std::vector<int> &pages,
                     const trip_stack_choice &choice);
    void choose_type(const OIIO::ImageSpec &first, trip_budget *budget);
    void keep_bits(void *values) const;
    void convert(void *values) const;

    trip_slice_files files_;
    std::unique_ptr<Form> form_;
    trip_scalar stored_ = TRIP_U8;
    Input current_;
    int64_t current_file_ = -1;
    std::vector<std::string> misfits_; /* of a single file: the fault of each page, or "" */
    std::vector<int> pages_;           /* of a single file: the page of each slice */
    bool colour_ = false;              /* the values of a pixel are a colour */
    int sample_ = 0;                   /* the value of a pixel that is read, unless colour */
    int bits_ = 0; /* of a value of fewer bits than its type, which the library scales up; or 0 */
    bool has_absent_ = false;
    double absent_ = 0;        /* the stored value that means no value */
    trip_slice_buffer buffer_; /* a slice as stored, with all its values; if it is converted */
};

Input PictureStack::open(const std::string &file) const
{
    OIIO::ImageSpec hints;
    hints.attribute("oiio:UnassociatedAlpha", 1); /* do not premultiply */
    Input in = OIIO::ImageInput::open(file, &hints);
    if (!in)
        throw trip_slice_error(file, message(OIIO::geterror()));
    if (in->spec().depth > 1 || in->spec().tile_depth > 1)
        throw trip_slice_error(file, "is a picture with depth; store its slices as pages");
    return in;
}

void PictureStack::check_same(const std::string &stage, const OIIO::ImageSpec &spec) const
{
    Form form(spec);
    if (!(form == *form_))
        throw trip_slice_error(stage, "is " + form.text() + ", unlike the first slice, which is " +
                                          form_->text());
}

/* Returns the pages of a single file, except reduced ones. Other pages may be unlike the first one
 * if the description does not count them as slices, so misfits are only kept. */
std::vector<int> PictureStack::find_pages(OIIO::ImageInput &in)
{
    const std::string &file = files_.names[0];
    std::vector<int> pages = { 0 };
    int page = 0;
    misfits_.assign(1, "");
    while (in.seek_subimage(++page, 0)) {
        if (files_.kind != TRIP_IMAGE_TIFF) {
            trip_warn(file.c_str(), "has several parts; the first one is read");
            break;
        }
        trip_connection_working();
        misfits_.push_back("");
        if (!is_reduced(in.spec()))
            pages.push_back(page);
        try {
            check_same(file + ": page " + std::to_string(page + 1), in.spec());
        } catch (const trip_slice_error &e) {
            misfits_.back() = e.what();
        }
    }
    /* After the last page the library reports only the file's name, which is no error. */
    const std::string why = in.geterror();
    if (files_.kind == TRIP_IMAGE_TIFF && !why.empty() && message(why) != file)
        throw trip_slice_error(file, "after page " + std::to_string(page) + ": " + message(why));
    return pages;
}

/* Chooses the pages that are slices of the wanted channel and time. Descriptions of ImageJ count
 * the pages that are not reduced, descriptions of OME count all. */
void PictureStack::order_pages(const OIIO::ImageSpec &first, const std::vector<int> &pages,
                               const trip_stack_choice &choice)
{
    const std::string &file = files_.names[0];
    const bool tiff = files_.kind == TRIP_IMAGE_TIFF;
    const std::string text = tiff ? first.get_string_attribute("ImageDescription") : "";
    const bool imagej = text.compare(0, 7, "ImageJ=") == 0;
    const trip_page_order order = trip_page_order_of(
        { file,
          text,
          (int64_t)(imagej ? pages.size() : misfits_.size()),
          files_.names.size() > 1,
          { first.get_float_attribute("XResolution"), first.get_float_attribute("YResolution") },
          first.get_string_attribute("ResolutionUnit"),
          colour_ ? 1 : form_->channels,
          choice.time,
          choice.channel });
    note += (note.empty() || order.note.empty() ? "" : "; ") + order.note;
    sample_ = (int)order.sample;
    slope = order.slope;
    inter = order.inter;
    if (order.measured) /* slices of microscopes are no scan of a head from the top down */
        std::strcpy(up, "+z");
    for (int a = 0; a < 3; a++)
        index_to_world.m[a][a] = order.spacing[a];
    if (files_.names.size() > 1)
        return;
    pages_ = pages;
    if (!order.pages.empty()) {
        pages_.clear();
        for (int64_t page : order.pages)
            pages_.push_back(imagej ? pages[(size_t)page] : (int)page);
    }
    for (int page : pages_)
        if (!misfits_[(size_t)page].empty())
            throw trip_slice_error(file + ": page " + std::to_string(page + 1),
                                   misfits_[(size_t)page]);
    dims[2] = (int64_t)pages_.size();
}

/* Returns whether three or four values are a colour. In a TIFF the tag of the interpretation
 * tells: 0 and 1 are grey. */
bool is_colour(const OIIO::ImageSpec &spec)
{
    const int grey = spec.get_int_attribute("tiff:PhotometricInterpretation", 2);
    return (spec.nchannels == 3 || spec.nchannels == 4) && grey != 0 && grey != 1;
}

/* Returns the bits of a value if they are fewer than the type's. The library scales such values up
 * to the type's range, except colours from a palette. */
int few_bits(const OIIO::ImageSpec &spec, trip_scalar type)
{
    const int bits = spec.get_int_attribute("oiio:BitsPerSample");
    const bool palette = spec.get_int_attribute("tiff:PhotometricInterpretation") == 3;
    const bool whole = type < TRIP_F16 && bits > 0 && bits < 8 * (int)trip_scalar_bytes(type);
    return whole && !palette ? bits : 0;
}

/* Returns the bits of the values of a grey PNG if they are fewer than 8. The library scales such
 * values up, too, and does not tell. Depth and kind are at a fixed place. */
int few_bits_of_png(const std::string &file)
{
    char head[26] = "";
    std::ifstream in(file, std::ios::binary);
    const bool grey = in.read(head, sizeof head) && head[25] == 0;
    return grey && head[24] > 0 && head[24] < 8 ? head[24] : 0;
}

void PictureStack::choose_type(const OIIO::ImageSpec &first, trip_budget *budget)
{
    const std::string &file = files_.names[0];
    stored_ = type = scalar_of(file, form_->type);
    colour_ = is_colour(first);
    if (files_.kind == TRIP_IMAGE_TIFF) {
        bits_ = few_bits(first, stored_);
        has_absent_ = !colour_ && trip_absent_value(file, absent_);
    }
    if (files_.kind == TRIP_IMAGE_PNG && stored_ == TRIP_U8)
        bits_ = few_bits_of_png(file);
    if (colour_)
        note = TRIP_VOLUME_COLOUR_NOTE;
    if (has_absent_) {
        char number[32];
        note = std::string("the value ") + trip_text_from_double(absent_, number) +
               " is absent, as the file says";
    }
    if (!colour_ && !has_absent_)
        return;
    type = stored_ == TRIP_F64 && !colour_ ? TRIP_F64 : TRIP_F32;
    buffer_.take(budget, file,
                 (uint64_t)form_->width * (uint64_t)form_->height *
                     (uint64_t)(colour_ ? form_->channels : 1) * trip_scalar_bytes(stored_));
}

PictureStack::PictureStack(const trip_slice_files &files, trip_budget *budget,
                           const trip_stack_choice &choice)
    : files_(files)
{
    silence_remarks();
    Input in = open(files.names[0]);
    const OIIO::ImageSpec first = in->spec();
    std::vector<int> pages;
    form_ = std::make_unique<Form>(first);
    dims[0] = form_->width;
    dims[1] = form_->height;
    dims[2] = (int64_t)files.names.size();
    if (files.names.size() == 1)
        pages = find_pages(*in);
    else if (files.kind == TRIP_IMAGE_TIFF && in->seek_subimage(1, 0))
        throw trip_slice_error(files.names[0], "holds several slices but is one of several files");
    in->geterror();
    choose_type(first, budget);
    order_pages(first, pages, choice);
    for (size_t i = 1; i < files.names.size(); i++) {
        check_same(files.names[i], open(files.names[i])->spec());
        trip_connection_working();
    }
}

bool on_progress(void *, float)
{
    trip_connection_working();
    return false; /* continue */
}

template <typename T> void shift_down(void *values, size_t count, int bits)
{
    T *v = static_cast<T *>(values);
    for (size_t i = 0; i < count; i++)
        v[i] = (T)(v[i] >> bits);
}

/* Restores values of few bits. The library puts them into the upper bits and repeats them below. It
 * reads values of 24 bits with their first byte as the highest, whatever the machine's order. */
void PictureStack::keep_bits(void *values) const
{
    const size_t count =
        (size_t)dims[0] * (size_t)dims[1] * (size_t)(colour_ ? form_->channels : 1);
    const int bytes = (int)trip_scalar_bytes(stored_), down = 8 * bytes - bits_;
    const bool is_signed = stored_ == TRIP_I8 || stored_ == TRIP_I16 || stored_ == TRIP_I32;
    if (bits_ == 24 && __BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__) {
        uint32_t *v = static_cast<uint32_t *>(values);
        for (size_t i = 0; i < count; i++)
            v[i] = __builtin_bswap32(v[i] >> 8);
    }
    if (bytes == 1)
        is_signed ? shift_down<int8_t>(values, count, down)
                  : shift_down<uint8_t>(values, count, down);
    else if (bytes == 2)
        is_signed ? shift_down<int16_t>(values, count, down)
                  : shift_down<uint16_t>(values, count, down);
    else
        is_signed ? shift_down<int32_t>(values, count, down)
                  : shift_down<uint32_t>(values, count, down);
}

/* Converts the buffer: colours to their luma, without opacity, and absent values to NaN. */
void PictureStack::convert(void *values) const
{
    const size_t count = (size_t)dims[0] * (size_t)dims[1], bytes = trip_scalar_bytes(stored_);
    float *to = static_cast<float *>(values);
    if (colour_) {
        for (size_t i = 0; i < count; i++)
            to[i] = trip_scalar_luma(stored_, false,
                                     buffer_.data() + i * (size_t)form_->channels * bytes);
    } else if (type == TRIP_F64) {
        double *wide = static_cast<double *>(values);
        std::copy_n(reinterpret_cast<const double *>(buffer_.data()), count, wide);
        std::replace(wide, wide + count, absent_, std::numeric_limits<double>::quiet_NaN());
    } else {
        trip_scalar_decode(stored_, false, 1, 0, buffer_.data(), count, to);
        std::replace(to, to + count, (float)absent_, std::numeric_limits<float>::quiet_NaN());
    }
}

void PictureStack::read(int64_t k, void *values)
{
    bool single = files_.names.size() == 1;
    int64_t index = single ? 0 : k;
    int page = single ? pages_[(size_t)k] : 0;
    const std::string &file = files_.names[(size_t)index];
    if (index != current_file_) {
        current_file_ = -1;
        current_ = open(file);
        check_same(file, current_->spec());
        current_file_ = index;
    }
    void *to = colour_ || has_absent_ ? (void *)buffer_.data() : values;
    const int first = colour_ ? 0 : sample_;
    if (!current_->read_image(page, 0, first, colour_ ? form_->channels : first + 1, form_->type,
                              to, OIIO::AutoStride, OIIO::AutoStride, OIIO::AutoStride,
                              on_progress))
        throw trip_slice_error(file, message(current_->geterror()));
    if (bits_)
        keep_bits(to);
    if (colour_ || has_absent_)
        convert(values);
}

} // namespace

std::unique_ptr<trip_slice_stack> trip_picture_stack(const trip_slice_files &files,
                                                     trip_budget *budget,
                                                     const trip_stack_choice &choice)
{
    return std::unique_ptr<trip_slice_stack>(new PictureStack(files, budget, choice));
}
