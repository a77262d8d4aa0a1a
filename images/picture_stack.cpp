#include <algorithm>
#include <cstdlib>
#include <string>
#include <vector>

#include <OpenImageIO/imageio.h>

#include "connection.h"
#include "slice_stack.h"
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

/* Returns the faults among the library's messages. It remarks on tags that it does not know, such
 * as the private tags of microscopes and of GeoTIFF, and such a file is sound. */
std::string faults(const std::string &messages)
{
    std::string left;
    for (size_t at = 0; at < messages.size();) {
        const size_t end = std::min(messages.find('\n', at), messages.size());
        const std::string line = messages.substr(at, end - at);
        if (line.find("Unknown field with tag") == std::string::npos && !line.empty())
            left += line + "\n";
        at = end + 1;
    }
    return left;
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
    PictureStack(const trip_slice_files &files, trip_budget *budget);
    void read(int64_t k, void *values) override;

  private:
    Input open(const std::string &file) const;
    void check_same(const std::string &stage, const OIIO::ImageSpec &spec) const;
    void count_pages(OIIO::ImageInput &in);
    void choose_channels(trip_budget *budget);
    void colour_to_luma(float *values) const;

    trip_slice_files files_;
    std::unique_ptr<Form> form_;
    trip_scalar stored_ = TRIP_U8;
    Input current_;
    int64_t current_file_ = -1;
    std::vector<int> pages_;   /* of a single file: the page of each slice */
    trip_slice_buffer colour_; /* a slice with all channels; only for colour */
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

/* ImageJ writes stacks beyond 4 GB as one page followed by raw data, which no library reads. */
void check_imagej(const std::string &file, const OIIO::ImageSpec &spec, int pages)
{
    const std::string text = spec.get_string_attribute("ImageDescription");
    size_t at = text.find("images=");
    if (text.compare(0, 7, "ImageJ=") != 0 || at == std::string::npos)
        return;
    long images = std::strtol(text.c_str() + at + 7, nullptr, 10);
    if (pages == 1 && images > 1)
        throw trip_slice_error(file, "holds " + std::to_string(images) +
                                         " slices in a form private to ImageJ; save it as raw data "
                                         "or as an image sequence");
}

/* Counts the pages of a single file, which are the slices of a TIFF. */
void PictureStack::count_pages(OIIO::ImageInput &in)
{
    const std::string &file = files_.names[0];
    const OIIO::ImageSpec first = in.spec();
    int pages = 0;
    pages_.assign(1, 0);
    while (in.seek_subimage(++pages, 0)) {
        if (files_.kind != TRIP_IMAGE_TIFF) {
            trip_warn(file.c_str(), "has several parts; the first one is read");
            break;
        }
        trip_connection_working();
        if (is_reduced(in.spec()))
            continue;
        check_same(file + ": page " + std::to_string(pages + 1), in.spec());
        pages_.push_back(pages);
    }
    /* After the last page the library reports only the file's name, which is no error. */
    const std::string why = faults(in.geterror());
    if (files_.kind == TRIP_IMAGE_TIFF && !why.empty() && message(why) != file)
        throw trip_slice_error(file, "after page " + std::to_string(pages) + ": " + message(why));
    check_imagej(file, first, pages);
    dims[2] = (int64_t)pages_.size();
}

void PictureStack::choose_channels(trip_budget *budget)
{
    const std::string &file = files_.names[0];
    stored_ = type = scalar_of(file, form_->type);
    if (form_->channels > 4)
        throw trip_slice_error(file, "has " + std::to_string(form_->channels) +
                                         " channels; a slice must have one channel, or colour");
    if (form_->channels == 2)
        trip_warn(file.c_str(), "has two channels; the first one is read");
    if (form_->channels < 3)
        return;
    trip_warn(file.c_str(), "is in colour; its Rec. 709 luma is read");
    type = TRIP_F32;
    colour_.take(budget, file,
                 (uint64_t)form_->width * (uint64_t)form_->height * (uint64_t)form_->channels *
                     trip_scalar_bytes(stored_));
}

PictureStack::PictureStack(const trip_slice_files &files, trip_budget *budget) : files_(files)
{
    Input in = open(files.names[0]);
    form_ = std::make_unique<Form>(in->spec());
    dims[0] = form_->width;
    dims[1] = form_->height;
    dims[2] = (int64_t)files.names.size();
    if (files.names.size() == 1)
        count_pages(*in);
    else if (files.kind == TRIP_IMAGE_TIFF && in->seek_subimage(1, 0))
        throw trip_slice_error(files.names[0], "holds several slices but is one of several files");
    in->geterror();
    choose_channels(budget);
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

/* Converts to the luma of the stored numbers (Rec. ITU-R BT.709-6, 3.2). Alpha is ignored. */
void PictureStack::colour_to_luma(float *values) const
{
    const int channels = form_->channels;
    std::vector<float> row((size_t)dims[0] * (size_t)channels);
    const size_t row_bytes = row.size() * trip_scalar_bytes(stored_);
    for (int64_t y = 0; y < dims[1]; y++) {
        const char *from = colour_.data() + (size_t)y * row_bytes;
        trip_scalar_decode(stored_, false, 1, 0, from, row.size(), row.data());
        for (int64_t x = 0; x < dims[0]; x++) {
            const float *p = &row[(size_t)(x * channels)];
            values[y * dims[0] + x] = (float)(0.2126 * p[0] + 0.7152 * p[1] + 0.0722 * p[2]);
        }
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
    bool colour = form_->channels > 2;
    if (!current_->read_image(page, 0, 0, colour ? form_->channels : 1, form_->type,
                              colour ? (void *)colour_.data() : values, OIIO::AutoStride,
                              OIIO::AutoStride, OIIO::AutoStride, on_progress))
        throw trip_slice_error(file, message(current_->geterror()));
    if (colour)
        colour_to_luma((float *)values);
}

} // namespace

std::unique_ptr<trip_slice_stack> trip_picture_stack(const trip_slice_files &files,
                                                     trip_budget *budget)
{
    return std::unique_ptr<trip_slice_stack>(new PictureStack(files, budget));
}
