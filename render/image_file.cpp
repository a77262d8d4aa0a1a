#include "image_file.h"

#include <atomic>
#include <cerrno>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <string>
#include <vector>

#include <fcntl.h>
#include <strings.h>
#include <unistd.h>

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include "report.h"

namespace
{

/* What a format can hold, the default depth first. */
struct Format {
    const char *extension, *plugin;
    trip_image_depth depths[3];
    bool alpha, associated;
};

const Format formats[] = {
    { "png", "png", { TRIP_IMAGE_U8, TRIP_IMAGE_U16 }, true, false },
    { "jpg", "jpeg", { TRIP_IMAGE_U8 }, false, false },
    { "jpeg", "jpeg", { TRIP_IMAGE_U8 }, false, false },
    { "tif", "tiff", { TRIP_IMAGE_U16, TRIP_IMAGE_U8, TRIP_IMAGE_FLOAT }, true, true },
    { "tiff", "tiff", { TRIP_IMAGE_U16, TRIP_IMAGE_U8, TRIP_IMAGE_FLOAT }, true, true },
    { "exr", "openexr", { TRIP_IMAGE_FLOAT, TRIP_IMAGE_HALF }, true, true },
};

/* Bytes go to the file by write(2) as the encoder hands them over, so that a full disk is seen with
 * its errno whatever the encoder makes of it. */
class FileSink : public OIIO::Filesystem::IOProxy
{
  public:
    explicit FileSink(const std::string &path) : IOProxy(path, Write)
    {
        fd_ = ::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
        created_ = fd_ >= 0;
        if (!created_)
            errno_ = errno;
    }
    FileSink(const FileSink &) = delete;
    FileSink &operator=(const FileSink &) = delete;
    ~FileSink() override
    {
        finish();
        if (created_)
            ::unlink(m_filename.c_str());
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

    /* Closes the file; returns the first error of all, as errno. */
    int finish()
    {
        if (fd_ >= 0 && ::close(fd_) != 0 && errno_ == 0)
            errno_ = errno;
        fd_ = -1;
        return errno_;
    }
    int rename_to(const char *path)
    {
        if (::rename(m_filename.c_str(), path) != 0)
            return errno;
        created_ = false;
        return 0;
    }
    int error_number() const
    {
        return errno_;
    }

  private:
    int fd_ = -1, errno_ = 0;
    bool created_ = false;
    int64_t size_ = 0;
};

struct Picture {
    const char *path;
    int width, height;
    const float *rgba;
    const Format *format;
    trip_image_depth depth;
    int channels;
};

const Format *find_format(const char *path)
{
    const char *dot = std::strrchr(path, '.');
    for (const Format &f : formats)
        if (dot && dot != path && dot[-1] != '/' && strcasecmp(dot + 1, f.extension) == 0)
            return &f;
    return nullptr;
}

trip_image_depth choose_depth(const Format &format, trip_image_depth wanted)
{
    if (wanted == TRIP_IMAGE_DEPTH_DEFAULT)
        return format.depths[0];
    for (trip_image_depth d : format.depths)
        if (d == wanted)
            return d;
    return TRIP_IMAGE_DEPTH_DEFAULT;
}

int check_finite(const Picture &p)
{
    for (int y = 0; y < p.height; y++)
        for (int x = 0; x < p.width; x++)
            for (int c = 0; c < 4; c++)
                if (!std::isfinite(p.rgba[((size_t)y * p.width + x) * 4 + c]))
                    return trip_fail(TRIP_ERROR, "write", p.path,
                                     "pixel (%d, %d) is not a finite number; nothing is written", x,
                                     y);
    return 0;
}

/* Colour times 1 / alpha, before rounding, so that thin places keep their hue. */
void unpremultiply(float rgba[4])
{
    float alpha = rgba[3] < 0 ? 0 : rgba[3] > 1 ? 1 : rgba[3];
    for (int c = 0; c < 3; c++)
        rgba[c] = alpha > 0 ? rgba[c] / alpha : 0;
}

template <typename T> void quantise(const float *from, int channels, T *to)
{
    const float top = (T)-1;
    for (int c = 0; c < channels; c++) {
        float v = from[c] < 0 ? 0 : from[c] > 1 ? 1 : from[c];
        to[c] = (T)std::floor(v * top + 0.5f);
    }
}

/* One row in the file's channels and type. */
void convert_row(const Picture &p, const float *from, void *to)
{
    for (int x = 0; x < p.width; x++, from += 4) {
        float rgba[4];
        size_t at = (size_t)x * p.channels;
        std::memcpy(rgba, from, sizeof rgba);
        if (p.channels == 4 && !p.format->associated)
            unpremultiply(rgba);
        if (p.depth == TRIP_IMAGE_U8)
            quantise(rgba, p.channels, (uint8_t *)to + at);
        else if (p.depth == TRIP_IMAGE_U16)
            quantise(rgba, p.channels, (uint16_t *)to + at);
        else
            std::memcpy((float *)to + at, rgba, p.channels * sizeof(float));
    }
}

OIIO::TypeDesc memory_type(trip_image_depth depth)
{
    return depth == TRIP_IMAGE_U8    ? OIIO::TypeDesc::UINT8
           : depth == TRIP_IMAGE_U16 ? OIIO::TypeDesc::UINT16
                                     : OIIO::TypeDesc::FLOAT;
}

OIIO::ImageSpec make_spec(const Picture &p, const trip_image_params &params)
{
    OIIO::TypeDesc type =
        p.depth == TRIP_IMAGE_HALF ? OIIO::TypeDesc(OIIO::TypeDesc::HALF) : memory_type(p.depth);
    OIIO::ImageSpec spec(p.width, p.height, p.channels, type);
    if (p.channels == 4) {
        spec.alpha_channel = 3;
        /* Says what the values are, so that OpenImageIO leaves them alone. */
        spec.attribute("oiio:UnassociatedAlpha", p.format->associated ? 0 : 1);
    }
    if (std::strcmp(p.format->plugin, "jpeg") == 0) {
        spec.attribute("CompressionQuality", params.jpeg_quality ? params.jpeg_quality : 95);
        spec.attribute("jpeg:subsampling", "4:4:4");
    } else if (std::strcmp(p.format->plugin, "png") != 0) {
        spec.attribute("compression", "zip");
    }
    return spec;
}

std::string trim(std::string text)
{
    while (!text.empty() && (text.back() == '\n' || text.back() == ' '))
        text.pop_back();
    return text;
}

int encode_failed(const Picture &p, const FileSink &sink, OIIO::ImageOutput &out)
{
    std::string why = trim(out.geterror());
    if (sink.error_number()) {
        errno = sink.error_number();
        return trip_fail_errno("write", p.path, "cannot write");
    }
    return trip_fail(TRIP_ERROR, "write", p.path, "cannot encode: %s", why.c_str());
}

int encode(const Picture &p, const trip_image_params &params, FileSink &sink)
{
    auto out = OIIO::ImageOutput::create(p.format->plugin);
    if (!out) {
        OIIO::geterror();
        return trip_fail(TRIP_ERROR, "write", p.path, "this OpenImageIO cannot write %s",
                         p.format->plugin);
    }
    if (!out->set_ioproxy(&sink) || !out->open(sink.filename(), make_spec(p, params)))
        return encode_failed(p, sink, *out);
    OIIO::TypeDesc type = memory_type(p.depth);
    std::vector<char> row((size_t)p.width * p.channels * type.size());
    for (int y = 0; y < p.height; y++) {
        convert_row(p, p.rgba + (size_t)y * p.width * 4, row.data());
        if (!out->write_scanline(y, 0, type, row.data()))
            return encode_failed(p, sink, *out);
    }
    if (!out->close())
        return encode_failed(p, sink, *out);
    return 0;
}

std::string temporary_name(const char *path)
{
    const char *slash = std::strrchr(path, '/');
    std::string folder(path, slash ? (size_t)(slash - path) + 1 : 0);
    static std::atomic<unsigned> counter;
    return folder + ".triptych-" + std::to_string(getpid()) + "-" + std::to_string(counter++) +
           ".tmp";
}

int write_picture(const Picture &p, const trip_image_params &params)
{
    FileSink sink(temporary_name(p.path));
    if (sink.error_number()) {
        errno = sink.error_number();
        return trip_fail_errno("write", p.path, "cannot create a file beside it");
    }
    int status = encode(p, params, sink);
    if (status < 0)
        return status;
    errno = sink.finish();
    if (errno == 0)
        errno = sink.rename_to(p.path);
    return errno ? trip_fail_errno("write", p.path, "cannot write") : 0;
}

/* `channels` values as RGBA, premultiplied. */
void spread(const float *from, int channels, bool premultiplied, float rgba[4])
{
    bool grey = channels < 3;
    float alpha = channels % 2 == 0 ? from[channels - 1] : 1;
    float scale = premultiplied ? 1 : alpha;
    for (int c = 0; c < 3; c++)
        rgba[c] = from[grey ? 0 : c] * scale;
    rgba[3] = alpha;
}

int read_picture(const char *path, int *width, int *height, float **rgba)
{
    OIIO::ImageSpec hints;
    hints.attribute("oiio:UnassociatedAlpha", 1); /* premultiplied here, in float */
    auto in = OIIO::ImageInput::open(path, &hints);
    if (!in)
        return trip_fail(TRIP_ERROR, "read", path, "%s", trim(OIIO::geterror()).c_str());
    const OIIO::ImageSpec &spec = in->spec();
    int channels = spec.nchannels;
    if (channels > 4 || spec.depth > 1 || spec.width < 1 || spec.height < 1)
        return trip_fail(TRIP_ERROR, "read", path, "is no picture of one to four channels");
    std::vector<float> row((size_t)spec.width * channels);
    std::unique_ptr<float, decltype(&std::free)> picture(
        (float *)std::calloc((size_t)spec.width * spec.height, 4 * sizeof(float)), std::free);
    if (!picture)
        return trip_fail(TRIP_ERROR, "read", path, "no memory for %d x %d pixels", spec.width,
                         spec.height);
    bool premultiplied = !spec.get_int_attribute("oiio:UnassociatedAlpha", 0);
    for (int y = 0; y < spec.height; y++) {
        if (!in->read_scanline(y + spec.y, 0, OIIO::TypeDesc::FLOAT, row.data()))
            return trip_fail(TRIP_ERROR, "read", path, "%s", trim(in->geterror()).c_str());
        for (int x = 0; x < spec.width; x++)
            spread(&row[(size_t)x * channels], channels, premultiplied,
                   picture.get() + ((size_t)y * spec.width + x) * 4);
    }
    *width = spec.width;
    *height = spec.height;
    *rgba = picture.release();
    return 0;
}

} // namespace

int trip_image_check_path(const char *path, const trip_image_params *params)
{
    const Format *format = find_format(path);
    if (!format)
        return trip_fail(TRIP_USAGE, "write", path,
                         "pictures are named .png, .jpg, .tif or .exr, which sets their format");
    trip_image_depth wanted = params ? params->depth : TRIP_IMAGE_DEPTH_DEFAULT;
    if (choose_depth(*format, wanted) == TRIP_IMAGE_DEPTH_DEFAULT)
        return trip_fail(TRIP_USAGE, "write", path, "a .%s file cannot hold that kind of number",
                         format->extension);
    return 0;
}

int trip_image_write(const char *path, int width, int height, const float *rgba,
                     const trip_image_params *params)
try {
    const trip_image_params defaults = {};
    const trip_image_params &use = params ? *params : defaults;
    int status = trip_image_check_path(path, params);
    if (status < 0)
        return status;
    if (width < 1 || height < 1)
        return trip_fail(TRIP_USAGE, "write", path, "a picture of %d x %d pixels is empty", width,
                         height);
    const Format *format = find_format(path);
    const Picture picture = { path,
                              width,
                              height,
                              rgba,
                              format,
                              choose_depth(*format, use.depth),
                              format->alpha && !use.drop_alpha ? 4 : 3 };
    status = check_finite(picture);
    return status < 0 ? status : write_picture(picture, use);
} catch (const std::exception &e) {
    return trip_fail(TRIP_ERROR, "write", path, "%s", e.what());
}

int trip_image_read(const char *path, int *width_out, int *height_out, float **rgba_out)
try {
    return read_picture(path, width_out, height_out, rgba_out);
} catch (const std::exception &e) {
    return trip_fail(TRIP_ERROR, "read", path, "%s", e.what());
}
