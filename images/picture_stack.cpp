#include <cstring>
#include <vector>

#include <OpenImageIO/imageio.h>

#include "slice_stack.h"
#include "volume_reader.h"

namespace
{

using Input = std::unique_ptr<OIIO::ImageInput>;

/* What all slices must have in common. */
struct Form {
    int width, height, depth, channels, x, y;
    OIIO::TypeDesc type;

    explicit Form(const OIIO::ImageSpec &s)
        : width(s.width), height(s.height), depth(s.depth), channels(s.nchannels), x(s.x), y(s.y),
          type(s.format)
    {
    }
    bool operator==(const Form &o) const
    {
        return width == o.width && height == o.height && depth == o.depth &&
               channels == o.channels && x == o.x && y == o.y && type == o.type;
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
    throw trip_slice_error(file, std::string("has numbers of an unknown kind, ") + type.c_str());
}

class PictureStack : public trip_slice_stack
{
  public:
    PictureStack(const trip_slice_files &files, trip_budget *budget);
    void read(int64_t k, void *values) override;

  private:
    Input open(const std::string &file) const;
    void check_same(const std::string &what, const OIIO::ImageSpec &spec) const;
    void count_pages(OIIO::ImageInput &in);
    void choose_channels(trip_budget *budget);
    void read_native(OIIO::ImageInput &in, int page, int z, int channels, void *to);
    void read_slab(OIIO::ImageInput &in, int page, int z, int channels, void *to);
    void colour_to_luma(float *values) const;

    trip_slice_files files_;
    std::unique_ptr<Form> form_;
    trip_scalar stored_ = TRIP_U8;
    Input current_;
    int64_t current_file_ = -1;
    trip_slice_buffer colour_; /* a slice with all channels, for colour */
    trip_slice_buffer slab_;   /* a layer of tiles, for pictures with depth in tiles */
    int slab_first_ = -1, slab_page_ = -1, tile_depth_ = 1;
};

Input PictureStack::open(const std::string &file) const
{
    OIIO::ImageSpec hints;
    hints.attribute("oiio:UnassociatedAlpha", 1); /* leave colours as they are */
    Input in = OIIO::ImageInput::open(file, &hints);
    if (!in)
        throw trip_slice_error(file, message(OIIO::geterror()));
    return in;
}

void PictureStack::check_same(const std::string &what, const OIIO::ImageSpec &spec) const
{
    Form form(spec);
    if (!(form == *form_))
        throw trip_slice_error(what, "is " + form.text() + ", unlike the first slice, which is " +
                                         form_->text());
}

/* Slices of a single file: the pages of a TIFF, each perhaps with depth. */
void PictureStack::count_pages(OIIO::ImageInput &in)
{
    int pages = 1;
    while (in.seek_subimage(pages, 0)) {
        if (files_.kind != TRIP_IMAGE_TIFF) {
            trip_warn(files_.names[0].c_str(), "has several parts; the first one is read");
            break;
        }
        check_same(files_.names[0] + ": page " + std::to_string(pages + 1), in.spec());
        pages++;
    }
    in.geterror();
    dims[2] = (int64_t)pages * form_->depth;
}

void PictureStack::choose_channels(trip_budget *budget)
{
    const std::string &file = files_.names[0];
    const uint64_t pixels = (uint64_t)form_->width * (uint64_t)form_->height;
    stored_ = type = scalar_of(file, form_->type);
    if (form_->channels > 4)
        throw trip_slice_error(file, "has " + std::to_string(form_->channels) +
                                         " channels; a slice has one, or colour");
    if (form_->channels == 2)
        trip_warn(file.c_str(), "has two channels; the first one is read");
    if (form_->channels > 2) {
        trip_warn(file.c_str(), "is in colour; its Rec. 709 luma is read");
        type = TRIP_F32;
        colour_.take(budget, file, pixels * (uint64_t)form_->channels * trip_scalar_bytes(stored_));
    }
    if (form_->depth > 1 && tile_depth_ > 1)
        slab_.take(budget, file,
                   pixels * (uint64_t)tile_depth_ * trip_scalar_bytes(stored_) *
                       (form_->channels > 2 ? (uint64_t)form_->channels : 1));
}

PictureStack::PictureStack(const trip_slice_files &files, trip_budget *budget) : files_(files)
{
    Input in = open(files.names[0]);
    form_ = std::make_unique<Form>(in->spec());
    tile_depth_ = in->spec().tile_depth > 1 ? in->spec().tile_depth : 1;
    dims[0] = form_->width;
    dims[1] = form_->height;
    dims[2] = (int64_t)files.names.size();
    if (files.names.size() == 1)
        count_pages(*in);
    else if (form_->depth > 1 || (files.kind == TRIP_IMAGE_TIFF && in->seek_subimage(1, 0)))
        throw trip_slice_error(files.names[0], "holds several slices by itself, and is one of "
                                               "several files");
    in->geterror();
    choose_channels(budget);
    for (size_t i = 1; i < files.names.size(); i++)
        check_same(files.names[i], open(files.names[i])->spec());
}

/* One slice of a picture with depth whose tiles have depth too: the layer of tiles is kept. */
void PictureStack::read_slab(OIIO::ImageInput &in, int page, int z, int channels, void *to)
{
    const OIIO::ImageSpec spec = in.spec(page, 0);
    int first = z - z % tile_depth_;
    size_t slice_bytes =
        spec.image_pixels() / (size_t)spec.depth * (size_t)channels * spec.format.size();
    if (first != slab_first_ || page != slab_page_) {
        slab_first_ = -1;
        int end = first + tile_depth_ < spec.depth ? first + tile_depth_ : spec.depth;
        if (!in.read_tiles(page, 0, spec.x, spec.x + spec.width, spec.y, spec.y + spec.height,
                           spec.z + first, spec.z + end, 0, channels, spec.format, slab_.data()))
            throw trip_slice_error(files_.names[0], message(in.geterror()));
        slab_first_ = first;
        slab_page_ = page;
    }
    std::memcpy(to, slab_.data() + (size_t)(z - first) * slice_bytes, slice_bytes);
}

void PictureStack::read_native(OIIO::ImageInput &in, int page, int z, int channels, void *to)
{
    if (form_->depth > 1 && tile_depth_ > 1) {
        read_slab(in, page, z, channels, to);
        return;
    }
    const OIIO::ImageSpec spec = in.spec(page, 0);
    bool good;
    if (form_->depth == 1)
        good = in.read_image(page, 0, 0, channels, spec.format, to);
    else if (spec.tile_width > 0)
        good = in.read_tiles(page, 0, spec.x, spec.x + spec.width, spec.y, spec.y + spec.height,
                             spec.z + z, spec.z + z + 1, 0, channels, spec.format, to);
    else
        good = in.read_scanlines(page, 0, spec.y, spec.y + spec.height, spec.z + z, 0, channels,
                                 spec.format, to);
    if (!good)
        throw trip_slice_error(files_.names[(size_t)current_file_], message(in.geterror()));
}

/* Luma of the stored numbers (Rec. ITU-R BT.709-6, 3.2); alpha is left out. */
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
    int64_t file = single ? 0 : k;
    int64_t in_file = single ? k : 0;
    int page = (int)(in_file / form_->depth), z = (int)(in_file % form_->depth);
    if (file != current_file_) {
        current_file_ = -1;
        current_ = open(files_.names[(size_t)file]);
        check_same(files_.names[(size_t)file], current_->spec());
        current_file_ = file;
    }
    if (form_->channels > 2) {
        read_native(*current_, page, z, form_->channels, colour_.data());
        colour_to_luma((float *)values);
    } else {
        read_native(*current_, page, z, 1, values);
    }
}

} // namespace

std::unique_ptr<trip_slice_stack> trip_picture_stack(const trip_slice_files &files,
                                                     trip_budget *budget)
{
    return std::unique_ptr<trip_slice_stack>(new PictureStack(files, budget));
}
