#include "picture_file.h"

#include <cerrno>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <memory>

#include <strings.h>
#include <unistd.h>

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include "report.h"
#include "slice_files.h"

namespace
{

/* Writes the encoder's bytes with pwrite(2) and keeps errno. A full disk is then reported, even if
 * the encoder ignores the error. */
class FileSink : public OIIO::Filesystem::IOProxy
{
  public:
    FileSink(const std::string &path, int fd) : IOProxy(path, Write), fd_(fd)
    {
    }

    const char *proxytype() const override
    {
        return "triptych";
    }
    size_t write(const void *buf, size_t size) override
    {
        size_t done = pwrite(buf, size, m_pos);
        m_pos += (int64_t)done;
        return done;
    }
    size_t pwrite(const void *buf, size_t size, int64_t offset) override
    {
        size_t done = 0;
        while (errno_ == 0 && done < size) {
            ssize_t n = ::pwrite(fd_, (const char *)buf + done, size - done, offset + (off_t)done);
            if (n < 0 && errno != EINTR)
                errno_ = errno;
            done += n > 0 ? (size_t)n : 0;
        }
        if (offset + (int64_t)done > size_)
            size_ = offset + (int64_t)done;
        return done;
    }
    size_t size() const override
    {
        return (size_t)size_;
    }

    int error_number() const
    {
        return errno_;
    }

  private:
    int fd_, errno_ = 0;
    int64_t size_ = 0;
};

/* The format of a stored picture. */
struct Encoding {
    const char *plugin;
    trip_image_depth depth;
    int channels; /* with four, the fourth is associated alpha */
    bool linear;  /* stores linear light instead of display values */
};

Encoding choose_encoding(const trip_picture &p)
{
    const char *extension = std::strrchr(p.path.c_str(), '.') + 1;
    bool alpha = !p.params.drop_alpha;
    Encoding e = { "jpeg", TRIP_IMAGE_U8, 3, false };
    if (strcasecmp(extension, "exr") == 0)
        e = { "openexr", TRIP_IMAGE_FLOAT, alpha ? 4 : 3, true };
    else if (strncasecmp(extension, "tif", 3) == 0)
        e = { "tiff", TRIP_IMAGE_U16, alpha ? 4 : 3, false };
    if (p.params.depth != TRIP_IMAGE_DEPTH_DEFAULT)
        e.depth = p.params.depth;
    if (p.params.distances)
        e = { e.plugin, TRIP_IMAGE_FLOAT, 1, false };
    return e;
}

/* The sRGB transfer function (IEC 61966-2-1) and its inverse. Negative numbers mirror positive
 * ones, so no colour is clipped. */
float linear_of_display(float v)
{
    double x = std::fabs((double)v);
    double y = x <= 0.04045 ? x / 12.92 : std::pow((x + 0.055) / 1.055, 2.4);
    return (float)std::copysign(y, (double)v);
}

float display_of_linear(float v)
{
    double x = std::fabs((double)v);
    double y = x <= 0.04045 / 12.92 ? x * 12.92 : 1.055 * std::pow(x, 1 / 2.4) - 0.055;
    return (float)std::copysign(y, (double)v);
}

/* Applies a curve to the colour before multiplication by alpha. Colour with alpha 0 is added light,
 * and the curve applies to it directly. */
template <typename Curve> void apply_curve(const Curve &curve, float rgba[4], bool associated)
{
    float alpha = associated && rgba[3] > 0 ? rgba[3] : 1;
    for (int c = 0; c < 3; c++)
        rgba[c] = curve(rgba[c] / alpha) * alpha;
}

template <typename T> void quantise(const float *from, int channels, T *to)
{
    for (int c = 0; c < channels; c++)
        to[c] = (T)trip_image_integer(from[c], (T)-1);
}

/* Converts one row to the file's channels and type. Distances are copied. */
void convert_row(const Encoding &e, int width, const float *from, void *to)
{
    if (e.channels == 1) {
        std::memcpy(to, from, (size_t)width * sizeof(float));
        return;
    }
    for (int x = 0; x < width; x++, from += 4) {
        float rgba[4];
        size_t at = (size_t)x * (size_t)e.channels;
        std::memcpy(rgba, from, sizeof rgba);
        if (e.linear)
            apply_curve(linear_of_display, rgba, e.channels == 4);
        if (e.depth == TRIP_IMAGE_U8)
            quantise(rgba, e.channels, (uint8_t *)to + at);
        else if (e.depth == TRIP_IMAGE_U16)
            quantise(rgba, e.channels, (uint16_t *)to + at);
        else
            std::memcpy((float *)to + at, rgba, (size_t)e.channels * sizeof(float));
    }
}

OIIO::TypeDesc memory_type(trip_image_depth depth)
{
    return depth == TRIP_IMAGE_U8    ? OIIO::TypeDesc::UINT8
           : depth == TRIP_IMAGE_U16 ? OIIO::TypeDesc::UINT16
                                     : OIIO::TypeDesc::FLOAT;
}

OIIO::ImageSpec make_spec(const trip_picture &p, const Encoding &e)
{
    OIIO::TypeDesc type =
        e.depth == TRIP_IMAGE_HALF ? OIIO::TypeDesc(OIIO::TypeDesc::HALF) : memory_type(e.depth);
    OIIO::ImageSpec spec(p.width, p.height, e.channels, type);
    if (e.channels == 4) {
        spec.alpha_channel = 3;
        /* declares the values as associated, so OpenImageIO does not change them */
        spec.attribute("oiio:UnassociatedAlpha", 0);
    }
    if (e.channels == 1) {
        spec.channelnames = { "Z" };
        spec.z_channel = 0;
    }
    if (std::strcmp(e.plugin, "jpeg") == 0) {
        spec.attribute("CompressionQuality", p.params.jpeg_quality ? p.params.jpeg_quality : 95);
        spec.attribute("jpeg:subsampling", "4:4:4");
    } else {
        spec.attribute("compression", "zip");
    }
    /* OpenImageIO would store the time, and equal pictures would give different files. */
    spec.attribute("DateTime", "");
    return spec;
}

std::string trim(std::string text)
{
    while (!text.empty() && (text.back() == '\n' || text.back() == ' '))
        text.pop_back();
    return text;
}

void check_written(const trip_picture &p, const FileSink &sink)
{
    char room[256];
    if (sink.error_number())
        throw trip_slice_error(p.path, std::string("cannot write: ") +
                                           trip_errno_text(sink.error_number(), room, sizeof room));
}

[[noreturn]] void fail_encoding(const trip_picture &p, const FileSink &sink, OIIO::ImageOutput &out)
{
    std::string why = trim(out.geterror());
    check_written(p, sink);
    throw trip_slice_error(p.path, "cannot encode: " + why);
}

void encode(const trip_picture &p, const trip_picture_row &next_row, FileSink &sink)
{
    const Encoding e = choose_encoding(p);
    auto out = OIIO::ImageOutput::create(e.plugin);
    if (!out)
        throw trip_slice_error(p.path, trim(OIIO::geterror()));
    if (!out->set_ioproxy(&sink) || !out->open(sink.filename(), make_spec(p, e)))
        fail_encoding(p, sink, *out);
    OIIO::TypeDesc type = memory_type(e.depth);
    std::vector<float> row((size_t)p.width * 4);
    std::vector<char> encoded((size_t)p.width * (size_t)e.channels * type.size());
    for (int y = 0; y < p.height; y++) {
        if (!next_row(row.data()))
            throw trip_slice_error(p.path, "received only part of the picture");
        convert_row(e, p.width, row.data(), encoded.data());
        if (!out->write_scanline(y, 0, type, encoded.data()))
            fail_encoding(p, sink, *out);
    }
    if (!out->close())
        fail_encoding(p, sink, *out);
}

/* Converts `channels` values to premultiplied RGBA. */
void to_rgba(const float *from, int channels, bool premultiplied, float rgba[4])
{
    bool grey = channels < 3;
    float alpha = channels % 2 == 0 ? from[channels - 1] : 1;
    float scale = premultiplied ? 1 : alpha;
    for (int c = 0; c < 3; c++)
        rgba[c] = from[grey ? 0 : c] * scale;
    rgba[3] = alpha;
}

/* Returns the channel that holds distances, or -1. */
int channel_of_distances(const OIIO::ImageSpec &spec, bool exr)
{
    for (int c = 0; c < spec.nchannels; c++) {
        const char *name = std::strrchr(spec.channelnames[(size_t)c].c_str(), '.');
        name = name ? name + 1 : spec.channelnames[(size_t)c].c_str();
        if (strcasecmp(name, "Z") == 0 || strcasecmp(name, "depth") == 0)
            return c;
    }
    return spec.nchannels <= 2 || exr ? 0 : -1;
}

/* Converts stored integers to floats. */
template <typename T>
void take_integers(const std::vector<char> &row, int channels, int c, int width, float *to)
{
    for (int x = 0; x < width; x++) {
        T v;
        std::memcpy(&v, &row[((size_t)x * (size_t)channels + (size_t)c) * sizeof v], sizeof v);
        to[x] = v == 0 || v == std::numeric_limits<T>::max() ? NAN : (float)v;
    }
}

} // namespace

void trip_picture_write(const trip_picture &p, const trip_picture_row &next_row)
{
    FileSink sink(p.path, p.fd);
    encode(p, next_row, sink);
    check_written(p, sink);
}

std::vector<float> trip_picture_read(const std::string &path, int &width, int &height)
{
    OIIO::ImageSpec hints;
    hints.attribute("oiio:UnassociatedAlpha", 1); /* premultiplied below, in float */
    auto in = OIIO::ImageInput::open(path, &hints);
    if (!in)
        throw trip_slice_error(path, trim(OIIO::geterror()));
    const OIIO::ImageSpec spec = in->spec();
    if (spec.nchannels > 4 || spec.depth > 1 || spec.width < 1 || spec.height < 1)
        throw trip_slice_error(path, "is not a picture with one to four channels");
    std::vector<float> row((size_t)spec.width * (size_t)spec.nchannels);
    std::vector<float> rgba((size_t)spec.width * (size_t)spec.height * 4);
    bool premultiplied = !spec.get_int_attribute("oiio:UnassociatedAlpha", 0);
    bool linear = std::strcmp(in->format_name(), "openexr") == 0;
    for (int y = 0; y < spec.height; y++) {
        if (!in->read_scanline(y + spec.y, 0, OIIO::TypeDesc::FLOAT, row.data()))
            throw trip_slice_error(path, trim(in->geterror()));
        for (int x = 0; x < spec.width; x++) {
            float *pixel = &rgba[((size_t)y * (size_t)spec.width + (size_t)x) * 4];
            to_rgba(&row[(size_t)x * (size_t)spec.nchannels], spec.nchannels, premultiplied, pixel);
            if (linear)
                apply_curve(display_of_linear, pixel, true);
        }
    }
    width = spec.width;
    height = spec.height;
    return rgba;
}

std::vector<float> trip_distances_read(const std::string &path, int &width, int &height,
                                       bool &integers)
{
    OIIO::ImageSpec hints;
    hints.attribute("oiio:UnassociatedAlpha", 1); /* keeps the stored values */
    auto in = OIIO::ImageInput::open(path, &hints);
    if (!in)
        throw trip_slice_error(path, trim(OIIO::geterror()));
    const OIIO::ImageSpec spec = in->spec();
    const int channel = channel_of_distances(spec, std::strcmp(in->format_name(), "openexr") == 0);
    if (spec.depth > 1 || spec.width < 1 || spec.height < 1 || spec.nchannels < 1 || channel < 0)
        throw trip_slice_error(path, "has " + std::to_string(spec.nchannels) +
                                         " channels; a depth image has one");
    const OIIO::TypeDesc stored((OIIO::TypeDesc::BASETYPE)spec.format.basetype);
    const OIIO::TypeDesc type = stored == OIIO::TypeDesc::UINT8 ||
                                        stored == OIIO::TypeDesc::UINT16 ||
                                        stored == OIIO::TypeDesc::UINT32
                                    ? stored
                                    : OIIO::TypeDesc(OIIO::TypeDesc::FLOAT);
    if (type == OIIO::TypeDesc::FLOAT && !stored.is_floating_point())
        throw trip_slice_error(path, std::string("stores values of the type ") + stored.c_str() +
                                         "; a depth image has unsigned integers or floats");
    std::vector<char> row((size_t)spec.width * (size_t)spec.nchannels * type.size());
    std::vector<float> z((size_t)spec.width * (size_t)spec.height);
    for (int y = 0; y < spec.height; y++) {
        float *to = &z[(size_t)y * (size_t)spec.width];
        if (!in->read_scanline(y + spec.y, 0, type, row.data()))
            throw trip_slice_error(path, trim(in->geterror()));
        if (type == OIIO::TypeDesc::UINT8)
            take_integers<uint8_t>(row, spec.nchannels, channel, spec.width, to);
        else if (type == OIIO::TypeDesc::UINT16)
            take_integers<uint16_t>(row, spec.nchannels, channel, spec.width, to);
        else if (type == OIIO::TypeDesc::UINT32)
            take_integers<uint32_t>(row, spec.nchannels, channel, spec.width, to);
        else
            for (int x = 0; x < spec.width; x++)
                std::memcpy(
                    &to[x],
                    &row[((size_t)x * (size_t)spec.nchannels + (size_t)channel) * sizeof(float)],
                    sizeof(float));
    }
    width = spec.width;
    height = spec.height;
    integers = type != OIIO::TypeDesc::FLOAT;
    return z;
}
